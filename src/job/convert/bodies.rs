//! Bodies.
use rustc_hash::FxHashMap;

use super::checks::{Checks, Space, check_names};
use super::conditions::stress;
use super::materials::material_setup;
use super::settings::is_symmetric;
use super::stages;
use crate::geometry::written::Shape as Written;
use crate::geometry::{Aabb, Faces, Sampling, Shape};
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::job::problem::*;
use crate::job::schema::common::FASTEST;
use crate::job::schema::job_file::{self as file, JobFile};
use crate::quantity::{AXES, Quantity};
use crate::text::{excerpt, number, written};

pub(super) fn bodies<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    space: &Space<D>,
    path: &Path,
) -> Option<Vec<Body<D>>> {
    if file.sources.is_empty() || !file.bodies.is_empty() {
        check_names(checks, file.bodies.iter().map(|body| body.name.as_str()), path);
    }
    // Of equal names the first counts, as elsewhere.
    let mut numbers = FxHashMap::default();
    for (number, material) in file.materials.iter().enumerate() {
        numbers.entry(material.name.as_str()).or_insert(number);
    }
    let bodies: Vec<Body<D>> = (file.bodies.iter().enumerate())
        .map_while(|(i, body)| {
            (!checks.is_full()).then(|| self::body(checks, body, &numbers, file, space, &path.index(i)))
        })
        .flatten()
        .collect();
    (bodies.len() == file.bodies.len()).then(|| fit(bodies, file, space))
}

/// Without a word, particles of bodies that keep their shape fill it. Where a lattice has planes in all faces
/// of a body and of those that it touches, directly or through others, their particles lie on that; else,
/// where any surface is off the lattice of the coarsest cells, they are fitted to it, but for inclined faces
/// that no other body slides along. Particles of what flows leave their places anyway. Bodies that touch one
/// on the lattice of the cells stay there, since the parts of one and the whole boxes of the other would
/// overlap. Boxes of fluids may overlap with solids: fluid is shifted from where it is too dense.
fn fit<const D: usize>(mut bodies: Vec<Body<D>>, file: &JobFile, space: &Space<D>) -> Vec<Body<D>> {
    let slack = 1e-9 * space.size.iter().fold(0.0, |most: f64, &size| most.max(size));
    let bounds: Vec<Aabb<D>> = bodies.iter().map(|body| body.shape.bounds().grown(slack)).collect();
    let of_body = |body: &Body<D>| material_setup(&file.materials[body.material]).build();
    let may_move = |number: usize| {
        let has_no_word = file.bodies[number].sampling.is_none() && bodies[number].given.is_none();
        has_no_word && of_body(&bodies[number]).keeps_its_shape()
    };
    let may_move: Vec<bool> = (0..bodies.len()).map(may_move).collect();
    let may_be_fitted = |number: usize| match file.bodies[number].sampling {
        Some(sampling) => sampling == file::Sampling::Fitted,
        None => may_move[number] && particles_per_leaf(bodies[number].particles_per_cell).fract() == 0.0,
    };
    let may_be_fitted: Vec<bool> = (0..bodies.len()).map(may_be_fitted).collect();
    // Steps of surfaces interlock.
    let slides = !file.contact.is_empty();
    let domain = Aabb::new([0.0; D], space.size);
    let is_along_axes = |body: &Body<D>| body.shape.add_faces(&domain, &mut Faces::default());
    let is_along_axes: Vec<bool> = bodies.iter().map(is_along_axes).collect();
    // Cells of several sizes would cut the boxes of a lattice of its own.
    let is_uniform = file.tree.regions.is_empty() && file.adaptivity.is_none();
    let leaf = file.domain.root_edge / f64::from(1_u32 << file.tree.base_level);
    let mut is_seen: Vec<bool> = bodies.iter().map(|body| of_body(body).is_fluid()).collect();
    for first in 0..bodies.len() {
        let (mut group, mut next) = (Vec::new(), vec![first]);
        while let Some(number) = next.pop() {
            if !std::mem::replace(&mut is_seen[number], true) {
                group.push(number);
                let touches = |other: &usize| !bounds[number].intersection(&bounds[*other]).is_empty();
                next.extend((0..bodies.len()).filter(|other| !is_seen[*other]).filter(touches));
            }
        }
        let lattice = |of: &[usize]| lattice_of(of.iter().map(|&number| &bodies[number]), leaf, space);
        if group.iter().all(|&number| lattice(&[number]) == Some([0.0; D])) {
            continue; // a group without members, too
        }
        let own = lattice(&group).filter(|_| is_uniform && group.iter().all(|&number| may_move[number]));
        if let Some(origin) = own {
            group.iter().for_each(|&number| bodies[number].lattice = origin);
        } else if group.iter().all(|&number| may_be_fitted[number])
            && (slides
                || group.iter().any(|&number| bodies[number].shape.is_curved())
                || group.iter().all(|&number| is_along_axes[number]))
        {
            group.iter().for_each(|&number| bodies[number].sampling = Sampling::Fitted);
        }
    }
    bodies
}

/// Lower corner of a box of the lattice that fills all of some bodies, if they have as many particles per
/// cell; `leaf` is the edge of the coarsest leaves, m.
fn lattice_of<'a, const D: usize>(
    mut bodies: impl Iterator<Item = &'a Body<D>>,
    leaf: f64,
    space: &Space<D>,
) -> Option<[f64; D]> {
    let (domain, mut faces, mut particles) = (Aabb::new([0.0; D], space.size), Faces::default(), None);
    let is_plane = bodies.all(|body| {
        let per_cell = body.particles_per_cell;
        *particles.get_or_insert(per_cell) == per_cell && body.shape.add_faces(&domain, &mut faces)
    });
    faces.lattice(leaf / particles_per_leaf(particles?)).filter(|_| is_plane)
}

pub(super) fn body<const D: usize>(
    checks: &mut Checks,
    body: &file::Body,
    materials: &FxHashMap<&str, usize>,
    file_of: &JobFile,
    space: &Space<D>,
    path: &Path,
) -> Option<Body<D>> {
    let material = materials.get(body.material.as_str()).copied();
    if material.is_none() {
        let known = || file_of.materials.iter().map(|material| material.name.as_str());
        checks.unknown(&body.material, "material", known, &path.key("material"));
    }
    let velocity = match &body.velocity {
        Some(velocity) => stress::fields(checks, velocity, &path.key("velocity"), FASTEST),
        None => Some(std::array::from_fn(|_| Quantity::default())),
    };
    let angular_velocity = match (&body.angular_velocity, D) {
        (None, _) => Some([0.0; 3]),
        (Some(file::Spin::Plane(spin)), 2) => Some([0.0, 0.0, *spin]),
        (Some(file::Spin::Space(spin)), 3) => Some(*spin),
        (Some(given), _) => {
            let (found, expected) = match given {
                file::Spin::Plane(_) => ("a number", "an array of 3 components in a 3D job"),
                file::Spin::Space(_) => ("an array", "a number (about z) in a 2D job"),
            };
            checks.fault(&path.key("angular_velocity"), format!("found {found}; expected {expected}"));
            None
        }
    };
    let here = path.key("shape");
    let given = match &body.shape {
        Written::Particles { file } => {
            if body.stress.is_some() {
                let message =
                    "found a stress; expected none with particles from a file, which contains their stress";
                checks.fault(&path.key("stress"), message.into());
            }
            let setup = material_setup(&file_of.materials[material?]);
            Some(checks.particles(file, &body.name, &setup, space, &here.key("file"))?)
        }
        _ => None,
    };
    let shape: Shape<D> = match &given {
        Some(given) => Shape::Box(given.bounds().intersection(&Aabb::new([0.0; D], space.size))),
        None => checks.shape(&body.shape, space, &here)?,
    };
    let bounds = shape.bounds();
    if bounds.is_empty() {
        checks.fault(&here, "found a shape without a point; expected one with a volume".into());
        return None;
    }
    for a in 0..D {
        // Lengths in the file are decimal; a face on the domain's may be a few roundings off.
        let slack = 1e-9 * space.size[a] + 8.0 * f64::EPSILON * space.origin[a].abs();
        let (low, high) = (bounds.lower[a], bounds.upper[a]);
        // A plane of symmetry cuts bodies that continue beyond it; particles from a file may not lie there.
        let is_cut = |side: usize| given.is_none() && is_symmetric(&file_of.boundaries, a, side);
        let below = low.is_finite() && low < -slack && !is_cut(0);
        let above = high.is_finite() && high > space.size[a] + slack && !is_cut(1);
        if below || above || low >= space.size[a] || high <= 0.0 {
            let (o, low_inside, high_inside) = (space.origin[a], low, high);
            let [low, high, least, most] = [low + o, high + o, o, o + space.size[a]].map(|x| number(x, 7));
            let (name, axis) = (excerpt(&body.name, QUOTED), AXES[a]);
            let side = if below { "min" } else { "max" };
            // What it needs, in whole roots, counted from the lower corner.
            let root = file_of.domain.root_edge;
            let needed = root * (bounds.upper[a] / root - 1e-9).ceil();
            let grown = match bounds.lower[a] > -slack && needed > space.size[a] {
                true => format!("; domain.size = {} along {axis} would hold it", number(needed, 7)),
                false => String::new(),
            };
            let lies_inside = low_inside < space.size[a] && high_inside > 0.0;
            let hint = match (below || above) && lies_inside && given.is_none() {
                true => {
                    format!(
                        "{grown}; boundaries.{axis}_{side} = {{ kind = \"symmetric\" }} would cut it there"
                    )
                }
                false => grown,
            };
            checks.fault(
                &here,
                format!(
                    "found the body \"{name}\" from {axis} = {low} to {high}; expected it inside the domain, from {axis} = {least} to {most}{hint}"
                ),
            );
            return None;
        }
    }
    Some(Body {
        name: body.name.clone(),
        place: (checks.position)(checks.tree.locate(&here).start),
        centre: bounds.intersection(&Aabb::new([0.0; D], space.size)).centre(),
        shape,
        material: material?,
        velocity: velocity?,
        angular_velocity: angular_velocity?,
        stage: stages::of_body(checks, body, file_of, path),
        particles_per_cell: body.particles_per_cell,
        sampling: sampling(checks, body, path)?,
        lattice: [0.0; D],
        given,
        fed: None,
        stress: match &body.stress {
            Some(written) => {
                let here = path.key("stress");
                Some(stress::stress::<D>(checks, written, file_of, &file_of.materials[material?], &here)?)
            }
            None => None,
        },
    })
}

/// Arrangement of the particles of a body.
fn sampling<const D: usize>(checks: &mut Checks, body: &file::Body, path: &Path) -> Option<Sampling<D>> {
    let is_random = matches!(body.sampling, Some(file::Sampling::Jittered | file::Sampling::Poisson));
    if body.seed.is_some() && !is_random {
        let message =
            "found a seed without random places; expected sampling = \"poisson\" or \"jittered\" beside it";
        checks.fault(&path.key("seed"), message.into());
        return None;
    }
    let along_leaf = particles_per_leaf(body.particles_per_cell);
    let in_leaves = match body.sampling {
        Some(file::Sampling::Fitted) => Some("fitted"),
        Some(file::Sampling::Poisson) => Some("poisson"),
        _ => None,
    };
    if let Some(name) = in_leaves.filter(|_| along_leaf.fract() != 0.0) {
        let message = format!(
            "found {} with sampling = \"{name}\"; expected a multiple of 0.25, for a whole number of particles along the edge of a leaf",
            written(body.particles_per_cell)
        );
        checks.fault(&path.key("particles_per_cell"), message);
        return None;
    }
    let seed = u64::from(body.seed.unwrap_or(0));
    match body.sampling {
        None | Some(file::Sampling::Lattice) => Some(Sampling::Lattice),
        Some(file::Sampling::Fitted) => Some(Sampling::Fitted),
        Some(file::Sampling::Jittered) => Some(Sampling::Jittered(seed)),
        Some(file::Sampling::Poisson) => Some(Sampling::poisson(along_leaf as usize, seed)),
    }
}
