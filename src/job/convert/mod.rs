//! From the file's types to a checked problem: conditions beyond the schema on domain, tree, materials and
//! bodies.
//!
//! | file | subject |
//! |---|---|
//! | `checks` | state that all share: faults with their places, the domain |
//! | `quasi_static` | load steps, and what jobs with them cannot have |
//! | `settings` | faces, numerics, output, report |
//! | `shapes` | shapes, among them terrain, and particles from a file |
//! | `adaptivity` | dynamic refinement |
//! | `axisymmetry` | what axisymmetric jobs cannot have |
//! | `colliders` | colliders and their motion |
//! | `contact` | contact between bodies |
//! | `failed` | what becomes of failed particles |
//! | `loads` | loads and quantities |
//! | `probes` | probes, tracks, fluxes, lines and maps |
//! | `sources` | sources |
//! | `stages` | stages of the run |
//! | `stress` | stress of bodies at the start |
//! | `overlap` | whether bodies overlap |
//! | `water` | water in the pores |
use self::adaptivity::{Context, adaptivity};
use self::checks::{Checks, Space};
use self::colliders::colliders;
use self::contact::body_contacts;
use self::loads::loads;
use self::quantities::vector;
use self::settings::{digest, faces, numerics, output, report};
use super::parse::error::{Fault, Position, QUOTED};
use super::parse::source::{Node, Path};
use super::problem::*;
use super::schema::common::FASTEST;
use super::schema::job_file::{self as file, JobFile};
use crate::geometry::written::{Shape as Written, Vector};
use crate::geometry::{Aabb, Sampling, Shape};
use crate::load::{Gravity, Load};
use crate::material::Failed;
use crate::material::laws::flow::explosive;
use crate::material::parameters::{OutOfRange, Parameters};
use crate::material::undrained::Undrained;
use crate::particle::followed::Motion;
use crate::quantity::{AXES, Quantity};
use crate::solver::Ties;
use crate::text::{excerpt, number, written};
use partition::{Brick, key::MAX_ROOTS};
use rustc_hash::FxHashMap;

mod adaptivity;
mod axisymmetry;
mod checks;
mod colliders;
mod contact;
mod failed;
mod loads;
mod overlap;
mod probes;
mod quantities;
mod quasi_static;
pub(super) mod settings;
mod shapes;
mod sources;
mod stages;
mod stress;
mod water;

/// Most leaves that a uniform tree of the base level may have.
const MAX_BASE_LEAVES: f64 = 4_294_967_296.0;

/// Converts and checks; `text` is what `file` and `tree` were made from, `position` gives line and column of
/// its bytes.
pub(super) fn convert(
    file: &JobFile,
    tree: &Node,
    text: &str,
    position: &dyn Fn(usize) -> Position,
    path: &std::path::Path,
) -> Result<AnyProblem, Vec<Fault>> {
    let directory = path.parent().unwrap_or(std::path::Path::new(""));
    let domain = bounds(&file.domain);
    let mut checks =
        Checks { tree, text, position, directory, domain, files: 0, takes_sheets: false, faults: Vec::new() };
    let problem = if file.dimension == 2 {
        problem(&mut checks, file, path).map(AnyProblem::Two)
    } else {
        problem(&mut checks, file, path).map(AnyProblem::Three)
    };
    match problem {
        Some(problem) if checks.faults.is_empty() => Ok(problem),
        _ => {
            checks.faults.sort_by_key(|fault| fault.span.start);
            Err(checks.faults)
        }
    }
}

/// The ends of the domain along each axis, m, as they are written.
fn bounds(domain: &file::Domain) -> [[f64; 2]; 3] {
    let component =
        |of: Option<&Vector>, axis: usize| of.and_then(|of| of.0.get(axis)).copied().unwrap_or(0.0);
    std::array::from_fn(|axis| {
        let low = component(domain.min.as_ref(), axis);
        [low, low + component(Some(&domain.size), axis)]
    })
}

fn problem<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    path: &std::path::Path,
) -> Option<Problem<D>> {
    let name = path.file_stem().map_or_else(|| "job".into(), |stem| stem.to_string_lossy().into_owned());
    let root = Path::default();
    let coordinates = axisymmetry::coordinates(checks, file);
    let is_ring = coordinates == Coordinates::Axisymmetric;
    let with_axis = is_ring.then(|| axisymmetry::with_axis(file));
    let file = with_axis.as_ref().unwrap_or(file);
    let (origin, brick) = domain::<D>(checks, &file.domain, &root.key("domain"))?;
    let root_edge = file.domain.root_edge;
    let space = Space { origin, size: brick.roots.map(|n| f64::from(n) * root_edge) };

    let tree = tree(checks, &file.tree, &brick, &space, &root.key("tree"));
    let materials = materials(checks, &file.materials, D, &root.key("materials"));
    let bodies = bodies(checks, file, &space, &root.key("bodies"));
    let colliders = colliders(checks, &file.colliders, &space, &root.key("colliders"));
    let gravity = match &file.gravity {
        Some(gravity) => self::gravity(checks, gravity, &root.key("gravity")),
        None => Some(Gravity::constant([0.0; D])),
    };
    let faces_with_sums = if file.history.face_forces { 2 * D } else { 0 };
    let body_contacts = body_contacts(checks, file, &root.key("contact"));
    let taken = 6 * file.colliders.len()
        + D * faces_with_sums
        + file.fluxes.len()
        + 4 * file.contact.len()
        + 5 * file.sources.len()
        + file
            .water
            .as_ref()
            .map_or(0, |water| 9 + water.seepage.as_ref().map_or(0, |seepage| 1 + seepage.heads.len()));
    let loads = loads(checks, file, taken, &space, &root.key("loads"));
    let water = water::water(checks, file, gravity.as_ref(), &space, &root);
    let water_stages = water::stages(checks, file, &root);
    let seepage = water::seepage(checks, file, &space, &root);
    let stages = stages::stages(checks, file, &root);
    let mut load_stages =
        stages::of_each(checks, file, file.loads.iter().map(|load| &load.stages), &root.key("loads"));
    let collider_stages = stages::of_each(
        checks,
        file,
        file.colliders.iter().map(|collider| &collider.stages),
        &root.key("colliders"),
    );
    let source_stages =
        stages::of_each(checks, file, file.sources.iter().map(|source| &source.stages), &root.key("sources"));
    let faces = faces(checks, &file.boundaries, &root.key("boundaries"));
    let absorbing = settings::absorbing(checks, &file.boundaries, &root.key("boundaries"));
    let (transfer, boxes) = numerics(checks, &file.numerics, &root.key("numerics"));
    let (tree, mut bodies, faces) = (tree?, bodies?, faces?);
    let mut load_places: Vec<_> =
        (0..file.loads.len()).map(|i| checks.place(&root.key("loads").index(i))).collect();
    let (mut loads, water) = (loads?, water?);
    if let Some(water) = water {
        loads.push(water);
        load_stages.push(water_stages);
        load_places.push(checks.place(&root.key("water")));
    }
    let context = sources::Context { file, space: &space, tree: &tree, root_edge };
    let (sources, fed): (Vec<_>, Vec<_>) =
        sources::sources(checks, &context, &root.key("sources"))?.into_iter().unzip();
    bodies.extend(fed);
    let context = Context { file, space: &space, tree: &tree, bodies: &bodies, boxes, root_edge };
    let adaptivity = adaptivity(checks, &context, &root.key("adaptivity"));
    let probes = probes::probes(checks, file, &space, &root.key("probes"));
    let tracks = probes::tracks(checks, file, &space, &root.key("tracks"));
    let fluxes = probes::fluxes(checks, file, &space, &root.key("fluxes"));
    let lines = probes::lines(checks, file, &space, &root.key("lines"));
    let maps = probes::maps(checks, file, &space, &root.key("maps"));
    let mut output = output(checks, file, &name, &root.key("output"));
    let needs_places = loads.iter().any(Load::names_undeformed);
    if needs_places && output.followed.motion == Motion::Nothing {
        output.followed.motion = Motion::Displacement;
    }
    output.followed.head = file.water.as_ref().is_some_and(|water| water.seepage.is_some());
    output.followed.saturation =
        file.water.is_some() && materials.iter().any(|m| m.saturated_density != m.density);
    let report = match &file.report {
        Some(written) => Some(report(checks, written, (&space, coordinates), &root.key("report"))?),
        None => None,
    };
    if is_ring && checks.faults.is_empty() {
        axisymmetry::check(checks, file, &materials, colliders.as_deref().unwrap_or(&[]));
    }
    let problem = Problem {
        name,
        path: path.to_path_buf(),
        text: checks.text.to_owned(),
        title: file.title.clone(),
        digest: digest(file) ^ checks.files,
        origin,
        root_edge,
        brick,
        tree,
        adaptivity,
        materials,
        bodies,
        sources,
        gravity: gravity?,
        load_places,
        seepage: seepage?,
        loads,
        faces: faces.map(|pair| pair.map(Option::unwrap_or_default)),
        absorbing: absorbing?,
        named_faces: faces.map(|pair| pair.map(|face| face.is_some())),
        colliders: colliders?,
        thick: std::sync::OnceLock::new(),
        body_contacts: body_contacts?,
        leaving: settings::leaving(file.boundaries.leaving.unwrap_or_default()),
        stages: stages?,
        load_stages,
        collider_stages,
        source_stages,
        time: TimeSetup {
            end: file.time.end,
            cfl: file.time.cfl,
            dt_max: file.time.dt_max,
            growth: file.time.growth,
        },
        transfer,
        coordinates,
        boxes,
        f_bar: file.numerics.f_bar,
        viscosity: settings::viscosity(&file.numerics),
        quasi_static: quasi_static::settings(checks, file, &root),
        ties: match (file.numerics.tied_surfaces, coordinates) {
            (Some(true), _) => Ties::All,
            (None, Coordinates::Cartesian) => Ties::Elastic,
            _ => Ties::None,
        },
        output,
        checkpoint: CheckpointSetup {
            every_steps: file.checkpoint.every_steps,
            every_time: file.checkpoint.every_time,
            every_wall_minutes: file.checkpoint.every_wall_minutes,
            keep: file.checkpoint.keep as usize,
        },
        history_every: file.history.every_steps,
        face_forces: file.history.face_forces,
        probes: probes?,
        tracks: tracks?,
        fluxes: fluxes?,
        lines: lines?,
        maps: maps?,
        telemetry_every: file.telemetry.every_steps,
        report,
    };
    quasi_static::check(checks, file, &problem);
    for overlap in overlap::find(&problem) {
        let [first, second] = overlap.bodies.map(|body| excerpt(&problem.bodies[body].name, QUOTED));
        let point = space.words(&overlap.point);
        let key = match problem.bodies[overlap.bodies[1]].fed {
            Some(source) => root.key("sources").index(source),
            None => root.key("bodies").index(overlap.bodies[1]),
        };
        checks.fault(
            &key.key("shape"),
            format!("found the body \"{second}\" overlapping \"{first}\" at {point}; expected bodies without a common point"),
        );
    }
    Some(problem)
}

/// Gravity is the same everywhere.
pub(super) fn gravity<const D: usize>(
    checks: &mut Checks,
    written: &[file::Quantity],
    path: &Path,
) -> Option<Gravity<D>> {
    let components = vector::<D>(checks, written, path)?;
    for (axis, _) in components.iter().enumerate().filter(|(_, component)| component.depends_on_place()) {
        let message = "found an expression of position; expected one of t only (a load of kind \"body_force\" may depend on x, y, z)";
        checks.fault(&path.index(axis), message.into());
    }
    Some(Gravity { acceleration: components, start: 0.0 })
}

fn domain<const D: usize>(
    checks: &mut Checks,
    domain: &file::Domain,
    path: &Path,
) -> Option<([f64; D], Brick<D>)> {
    let origin = match &domain.min {
        Some(min) => checks.vector(min, &path.key("min")),
        None => Some([0.0; D]),
    };
    let size: [f64; D] = checks.vector(&domain.size, &path.key("size"))?;
    let mut roots = [0; D];
    for a in 0..D {
        let here = path.key("size").index(a);
        let count = size[a] / domain.root_edge;
        let whole = count.round();
        let edge = domain.root_edge;
        if whole < 1.0 || (count - whole).abs() > 1e-9 * whole {
            let (below, above) = (count.floor().max(1.0) * edge, (count.floor() + 1.0).max(1.0) * edge);
            // Twelve digits: within the tolerance for whole numbers.
            let [below, above] = [below, above].map(|size| number(size, 12));
            let near = if below == above { above } else { format!("{below} or {above}") };
            let (found, edge) = (written(size[a]), written(edge));
            let message = format!(
                "found {found}; expected a whole multiple of domain.root_edge = {edge}, such as {near}"
            );
            checks.fault(&here, message);
        } else if whole > f64::from(MAX_ROOTS) {
            checks.fault(
                &here,
                format!(
                    "found {} root octants along {}; expected at most {MAX_ROOTS}: a larger domain.root_edge",
                    written(whole),
                    AXES[a]
                ),
            );
        } else {
            roots[a] = whole as u32;
        }
    }
    if roots.contains(&0) { None } else { Some((origin?, Brick { roots })) }
}

fn tree<const D: usize>(
    checks: &mut Checks,
    tree: &file::Tree,
    brick: &Brick<D>,
    space: &Space<D>,
    path: &Path,
) -> Option<TreeSetup<D>> {
    let roots: f64 = brick.roots.iter().map(|&n| f64::from(n)).product();
    let leaves = roots * f64::from(1_u32 << tree.base_level).powi(D as i32);
    if leaves > MAX_BASE_LEAVES {
        checks.fault(
            &path.key("base_level"),
            format!("found {}, which makes {leaves:.3e} leaves; expected a level with at most {MAX_BASE_LEAVES:.1e}", tree.base_level),
        );
    }
    let mut regions = Vec::new();
    for (i, region) in tree.regions.iter().enumerate() {
        let here = path.key("regions").index(i);
        if region.level <= tree.base_level {
            checks.fault(
                &here.key("level"),
                format!(
                    "found {}; expected a level deeper than tree.base_level = {}",
                    region.level, tree.base_level
                ),
            );
        }
        let Some(shape) = checks.shape(&region.shape, space, &here.key("shape")) else { continue };
        let inside = shape.bounds().intersection(&Aabb::new([0.0; D], space.size));
        if inside.is_empty() {
            checks.fault(
                &here.key("shape"),
                "found a region outside the domain; expected one that intersects it".into(),
            );
        }
        regions.push(Region { shape, level: region.level });
    }
    (regions.len() == tree.regions.len()).then_some(TreeSetup {
        base_level: tree.base_level,
        graded: tree.graded,
        regions,
    })
}

/// Faults for names that are empty or taken.
fn names<'a>(checks: &mut Checks, names: impl Iterator<Item = &'a str>, path: &Path) {
    let mut seen = rustc_hash::FxHashSet::default();
    let mut count = 0;
    for (i, name) in names.enumerate() {
        count += 1;
        let here = path.index(i).key("name");
        if name.trim().is_empty() {
            checks.fault(&here, "found an empty name; expected at least one letter".into());
        } else if !seen.insert(name) {
            let name = excerpt(name, QUOTED);
            checks.fault(&here, format!("found \"{name}\" a second time; expected a name that is not taken"));
        }
    }
    if count == 0 {
        checks.fault(path, "found an empty array; expected at least one element".into());
    } else if count > usize::from(u16::MAX) {
        checks.fault(path, format!("found {count} elements; expected at most {}", u16::MAX));
    }
}

fn materials(
    checks: &mut Checks,
    materials: &[file::Material],
    dimension: usize,
    path: &Path,
) -> Vec<MaterialSetup> {
    names(checks, materials.iter().map(|material| material.name.as_str()), path);
    for (i, material) in materials.iter().enumerate() {
        if let Err(OutOfRange { key, value, range }) = material.model.check() {
            let own = key.split('.').fold(path.index(i), |path, key| path.key(key.to_owned()));
            checks.fault(&own, format!("found {value}; expected a number {range}"));
        } else if let Some(water) = &material.undrained {
            undrained(checks, water, &material.model, &path.index(i));
        }
        if let Parameters::Explosive(own) = &material.model {
            ignition(checks, own, dimension, &path.index(i).key("ignition"));
        }
        if let Some(factor) = material.strength_factor
            && material.model.weakened(factor).is_none()
        {
            let message = "found it for a model without cohesion, yield stress or friction; expected mohr_coulomb, drucker_prager, tresca or von_mises";
            checks.fault(&path.index(i).key("strength_factor"), message.into());
        }
    }
    (0..)
        .zip(materials)
        .map(|(i, material)| {
            let failed = failed::failed(checks, material, materials, &path.index(i).key("failed"));
            MaterialSetup { failed, ..material_setup(material) }
        })
        .collect()
}

/// Faults of the points from which an explosive burns.
fn ignition(checks: &mut Checks, own: &explosive::Parameters, dimension: usize, path: &Path) {
    for (number, ignition) in own.ignition.iter().enumerate() {
        if ignition.point.0.len() != dimension {
            let message = format!(
                "found {} coordinates; expected {dimension}, as many as the job has dimensions",
                ignition.point.0.len()
            );
            checks.fault(&path.index(number).key("point"), message);
        }
    }
}

/// Faults of water in the pores of a material.
fn undrained(checks: &mut Checks, water: &Undrained, model: &Parameters, path: &Path) {
    if let Err(OutOfRange { key, value, range }) = water.check() {
        let own = key.split('.').fold(path.clone(), |path, key| path.key(key.to_owned()));
        checks.fault(&own, format!("found {value}; expected a number {range}"));
    } else if let Err(reason) = Undrained::check_model(model) {
        checks.fault(&path.key("undrained"), reason.to_owned());
    }
}

fn material_setup(material: &file::Material) -> MaterialSetup {
    let weakened = material.strength_factor.and_then(|factor| material.model.weakened(factor));
    MaterialSetup {
        name: material.name.clone(),
        density: material.density,
        saturated_density: material.saturated_density.unwrap_or(material.density),
        model: weakened.unwrap_or_else(|| material.model.clone()),
        undrained: material.undrained,
        failed: Failed::Stays,
    }
}

fn bodies<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    space: &Space<D>,
    path: &Path,
) -> Option<Vec<Body<D>>> {
    if file.sources.is_empty() || !file.bodies.is_empty() {
        names(checks, file.bodies.iter().map(|body| body.name.as_str()), path);
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
    (bodies.len() == file.bodies.len()).then_some(bodies)
}

fn body<const D: usize>(
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

/// The condition on a face of the domain, where the job names one.
fn face(boundaries: &file::Boundaries, axis: usize, side: usize) -> Option<&file::Face> {
    let file::Boundaries { x_min, x_max, y_min, y_max, z_min, z_max, .. } = boundaries;
    [[x_min, x_max], [y_min, y_max], [z_min, z_max]][axis][side].as_ref()
}

/// Whether a face of the domain is a plane of symmetry.
fn is_symmetric(boundaries: &file::Boundaries, axis: usize, side: usize) -> bool {
    matches!(face(boundaries, axis, side), Some(file::Face::Symmetric {}))
}

/// Whether material leaves through a face of the domain.
fn is_outflow(boundaries: &file::Boundaries, axis: usize, side: usize) -> bool {
    matches!(face(boundaries, axis, side), Some(file::Face::Outflow {}))
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
    let seed = u64::from(body.seed.unwrap_or(0));
    match body.sampling {
        None | Some(file::Sampling::Lattice) => Some(Sampling::Lattice),
        Some(file::Sampling::Fitted) => Some(Sampling::Fitted),
        Some(file::Sampling::Jittered) => Some(Sampling::Jittered(seed)),
        Some(file::Sampling::Poisson) => {
            let along_leaf = f64::from(CELLS_PER_LEAF) * body.particles_per_cell;
            if along_leaf.fract() != 0.0 {
                let message = format!(
                    "found {} with sampling = \"poisson\"; expected a multiple of 0.25, for a whole number of particles along the edge of a leaf",
                    written(body.particles_per_cell)
                );
                checks.fault(&path.key("particles_per_cell"), message);
                return None;
            }
            Some(Sampling::poisson(along_leaf as usize, seed))
        }
    }
}
