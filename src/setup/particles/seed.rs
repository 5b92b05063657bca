//! Fills bodies with particles.
//!
//! In a leaf with cells of edge h a body gets the points of a lattice of spacing h / particles per cell,
//! anchored at the lower corner of the domain or at the faces of the body. Leaf boxes are half-open, so every
//! leaf makes its own points, on whichever rank it is, and no point is made twice. A body from a file has the
//! particles of the file. Particles lie at these points or, by the sampling of their body, near them, within
//! the same leaf and body. Where the surface of a fitted body cuts the box of a point, the particle is the
//! part of the body in it (`parts.rs`).
use super::lattice::Lattice;
use super::parts::{Point, halves_at_surface, has_parts, likely_of_leaf, of_leaf};
use crate::geometry::{Aabb, Sampling, Side};
use crate::job::problem::{Body, Problem};
use crate::load::Water;
use crate::material::initial::NoState;
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::quantity::{NotFinite, Quantity};
use partition::Octant;

/// A particle cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SeedError {
    /// A lattice point lies in two bodies.
    #[error(
        "{place}: found the body \"{second}\" overlapping \"{first}\" at {}; expected bodies without a common point",
        crate::text::place(point)
    )]
    Overlap {
        /// File, line, column and key of the second body's shape.
        place: String,
        /// The body that comes first in the job.
        first: String,
        /// The other one.
        second: String,
        /// The point in the coordinates of the job file, m.
        point: Vec<f64>,
    },
    /// A body has no particle at all.
    #[error(
        "{place}: found no particle in the body \"{body}\"; expected a shape larger than the distance of \
         particles, or finer cells there"
    )]
    Empty {
        /// File, line, column and key of the body's shape.
        place: String,
        /// The body.
        body: String,
    },
    /// A body cannot have the stress that the job gives it.
    #[error(
        "{place}: found a stress at {} that the body \"{body}\" cannot have: {reason}; expected {}",
        crate::text::place(point),
        reason.expected()
    )]
    Stress {
        /// File, line, column and key of the stress.
        place: String,
        /// The body.
        body: String,
        /// The point in the coordinates of the job file, m.
        point: Vec<f64>,
        /// Why.
        reason: NoState,
    },
    /// A velocity or stress at the start, or gravity, has no finite value.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
    /// A head is held where no ground is.
    #[error(
        "{place}: found no ground below the level of the head \"{head}\" where it is held; expected a face or a shape that the ground reaches, \
         and a level above its foot"
    )]
    Head {
        /// File, line, column and key of the head.
        place: String,
        /// The head.
        head: String,
    },
    /// A load that particles carry finds none.
    #[error("{place}: found no {found} for the load \"{load}\"; expected {expected}")]
    Load {
        /// File, line, column and key of the load.
        place: String,
        /// The load.
        load: String,
        /// Kind of particle or surface that is missing.
        found: &'static str,
        /// Valid input.
        expected: &'static str,
    },
}

/// Not collective. True when a body may have points in the leaf: never false for a leaf that
/// [`fill_leaf`] puts particles in.
pub fn leaf_is_touched<const D: usize>(problem: &Problem<D>, octant: &Octant<D>) -> bool {
    let cell = problem.octant_box(octant);
    problem.bodies.iter().any(|body| body.shape.classify(&cell) != Side::Outside)
}

/// Not collective. Appends all particles of the leaf that come with a stage, at rest in their undeformed
/// state except for the velocity of their body: bodies in the order of the job, points of a body in
/// lexicographic order. Identifiers are 0; the run numbers them along the curve.
///
/// # Errors
/// A point lies in two bodies.
pub fn fill_leaf<const D: usize>(
    problem: &Problem<D>,
    octant: &Octant<D>,
    stage: usize,
    chunk: &mut Chunk<D>,
) -> Result<(), SeedError> {
    visit(problem, octant, problem.bodies_of_stage(stage), of_leaf, |index, points| {
        let body = &problem.bodies[index];
        let spacing = Lattice::of(problem, octant.level, body).edge;
        let given = body.given.as_ref().map(|given| (given, given.in_box(&problem.octant_box(octant))));
        let whole: f64 = [spacing; D].iter().product();
        let setup = &problem.materials[body.material];
        let tag = Tag { material: body.material as u16, body: index as u16, level: octant.level };
        let spin = velocity_gradient::<D>(body.angular_velocity);
        chunk.reserve_exact(chunk.len() + points.len());
        for (number, point) in points.iter().enumerate() {
            let x = &match &point.part {
                Some(part) => part.centre,
                None => place_near(problem, octant, index, &point.x, spacing),
            };
            let p = chunk.push_zeroed(0, tag);
            if let Some((given, rows)) = &given {
                let row = rows[number] as usize;
                let all: Vec<f64> =
                    (0..Layout::<D>::REALS).map(|column| given.chunk().read::<1>(column, row)[0]).collect();
                chunk.write(0, p, &all);
                if given.has_velocity {
                    continue;
                }
            }
            let mut set = |column: usize, value: f64| chunk.column_mut(column)[p] = value;
            let volume = point.part.as_ref().map_or(whole, |part| part.volume);
            // The velocity is that of the centre of mass.
            let mut inner = *x;
            let half = 0.5 * point.part.as_ref().map_or(spacing, |part| edge::<D>(part.volume));
            inner[0] += problem.coordinates.to_mass_centre(half.min(x[0]), x[0]);
            for i in 0..D {
                let turning: f64 = (0..D).map(|j| spin[i][j] * (x[j] - body.centre[j])).sum();
                set(Layout::<D>::POSITION + i, x[i]);
                set(Layout::<D>::VELOCITY + i, body.velocity[i].at(problem.place(&inner), 0.0) + turning);
                for j in 0..D {
                    let slope = slope(problem, &body.velocity[i], x, j, spacing);
                    set(Layout::<D>::AFFINE + D * i + j, spin[i][j] + slope);
                }
            }
            if given.is_some() {
                continue;
            }
            // Identity: xx, yy and zz come first in either dimension.
            for diagonal in 0..3 {
                set(Layout::<D>::LEFT_CAUCHY_GREEN + diagonal, 1.0);
            }
            let around = problem.coordinates.around(x[0]);
            let water = problem.water_of_stage(stage);
            let share = water.map_or(0.0, |water| water.share_below(problem.place(x), half, 0.0));
            let density = share.mul_add(setup.saturated_density - setup.density, setup.density);
            set(Layout::<D>::MASS, density * (volume * around));
            set(Layout::<D>::HALF, half * around.sqrt());
        }
    })
}

/// Edge of a cube (square) of this volume, m.
fn edge<const D: usize>(volume: f64) -> f64 {
    if D == 2 { volume.sqrt() } else { libm::cbrt(volume) }
}

/// Place of the particle of a lattice point: that of the sampling of its body, or nearer to the point on the
/// same line, so that it stays in the leaf and in the body and out of others.
fn place_near<const D: usize>(
    problem: &Problem<D>,
    octant: &Octant<D>,
    index: usize,
    x: &[f64; D],
    spacing: f64,
) -> [f64; D] {
    let body = &problem.bodies[index];
    if matches!(body.sampling, Sampling::Lattice | Sampling::Fitted) || body.given.is_some() {
        return *x;
    }
    let cell = problem.octant_box(octant);
    let way = body.sampling.way(&x.map(|c| (c / spacing) as u64), octant.level);
    let fits = |y: &[f64; D]| {
        let others = problem.bodies.iter().enumerate();
        let mut others = others.filter(|&(other, _)| other != index && problem.come_together(index, other));
        cell.contains(y) && body.shape.contains(y) && others.all(|(_, other)| !other.shape.contains(y))
    };
    let shares = [1.0, 0.5, 0.25, 0.125].into_iter();
    let places = shares.map(|share| std::array::from_fn(|a| (share * spacing).mul_add(way[a], x[a])));
    places.into_iter().find(fits).unwrap_or(*x)
}

/// A body, a place in its lattice, or in that of the boxes along its surface where they are smaller, and the
/// number of the particle there.
pub(super) type NumberedPlace<const D: usize> = ((u16, [u64; D]), usize);

/// Not collective. Bodies and places in the lattice, each with the number of the particle there among those
/// that [`fill_leaf`] makes.
///
/// # Errors
/// A point lies in two bodies.
pub(super) fn lattice_places<const D: usize>(
    problem: &Problem<D>,
    octant: &Octant<D>,
    stage: usize,
) -> Result<Vec<NumberedPlace<D>>, SeedError> {
    let (mut places, mut number) = (Vec::new(), 0);
    visit(problem, octant, problem.bodies_of_stage(stage), of_leaf, |body, points| {
        let halves = halves_at_surface(problem, &problem.bodies[body]);
        for point in points {
            places.extend(point.places(halves).map(|index| ((body as u16, index), number)));
            number += 1;
        }
    })?;
    Ok(places)
}

/// Not collective. The number of particles of each body that [`fill_leaf`] makes in the leaf, added to
/// `counts`: about as many, where surfaces of fitted bodies cut boxes of the lattice.
///
/// # Errors
/// A point lies in two bodies.
pub fn count_leaf<const D: usize>(
    problem: &Problem<D>,
    octant: &Octant<D>,
    stage: usize,
    counts: &mut [u64],
) -> Result<(), SeedError> {
    count_bodies(problem, octant, problem.bodies_of_stage(stage), |body, points| counts[body] += points)
}

/// Not collective. Calls `take(body, particles)` for each of some bodies that [`fill_leaf`] makes particles
/// of in the leaf, as [`count_leaf`]. `bodies` are in the order of the job; the others must lie outside the
/// leaf.
///
/// # Errors
/// A point lies in two bodies.
pub fn count_bodies<const D: usize>(
    problem: &Problem<D>,
    octant: &Octant<D>,
    bodies: impl Iterator<Item = usize>,
    mut take: impl FnMut(usize, u64),
) -> Result<(), SeedError> {
    visit(problem, octant, bodies, likely_of_leaf, |body, points| take(body, points.len() as u64))
}

/// Not collective. The number of lattice points in a box that a body has in leaves of a level if it fills the
/// box.
pub fn lattice_count<const D: usize>(problem: &Problem<D>, body: usize, cell: &Aabb<D>, level: u8) -> u64 {
    if let Some(given) = &problem.bodies[body].given {
        return given.in_box(cell).len() as u64;
    }
    Lattice::of(problem, level, &problem.bodies[body]).count_in(cell)
}

/// Not collective. Checks the number of particles of each body that comes with a stage, in all leaves of all
/// ranks together.
///
/// # Errors
/// A body has none.
pub fn check_counts<const D: usize>(
    problem: &Problem<D>,
    counts: &[u64],
    stage: usize,
) -> Result<(), SeedError> {
    match problem.bodies_of_stage(stage).find(|&body| counts[body] == 0) {
        Some(empty) => {
            Err(SeedError::Empty { place: place(problem, empty), body: problem.bodies[empty].name.clone() })
        }
        None => Ok(()),
    }
}

/// Not collective. Checks that gravity at the start is finite, and all velocities and stresses of bodies
/// evaluated so far.
///
/// # Errors
/// The first value that is not finite.
pub fn check_finite<const D: usize>(problem: &Problem<D>) -> Result<(), SeedError> {
    // A copy: others may have evaluated gravity at times that are never reached.
    let gravity = problem.gravity_of_stage(0).clone();
    gravity.at(0.0);
    let of_bodies = problem.bodies.iter().flat_map(|body| {
        let stress = body.stress.iter().flat_map(|stress| stress.kind.quantities());
        body.velocity.iter().chain(stress)
    });
    let water = problem.water().and_then(Water::quantity);
    let fault = of_bodies.chain(&gravity.acceleration).chain(water).find_map(Quantity::not_finite);
    fault.map_or(Ok(()), |fault| Err(fault.into()))
}

fn place<const D: usize>(problem: &Problem<D>, body: usize) -> String {
    format!("{}: bodies[{body}].shape", problem.bodies[body].place)
}

/// Mean slope of a field along an axis over a box of this edge, by the values on its faces.
fn slope<const D: usize>(
    problem: &Problem<D>,
    field: &Quantity,
    x: &[f64; D],
    axis: usize,
    edge: f64,
) -> f64 {
    if !field.depends_on_place() {
        return 0.0;
    }
    let [mut low, mut high] = [*x; 2];
    low[axis] -= 0.5 * edge;
    high[axis] += 0.5 * edge;
    (field.at(problem.place(&high), 0.0) - field.at(problem.place(&low), 0.0)) / edge
}

/// Greatest speed of a body at the start without its rotation, m/s, at points of a raster.
pub fn greatest_speed<const D: usize>(problem: &Problem<D>, body: &Body<D>) -> f64 {
    let speed = |x: &[f64; D]| {
        let velocity = body.velocity.each_ref().map(|component| component.at(problem.place(x), 0.0));
        velocity.iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    if let Some(given) = body.given.as_ref().filter(|given| given.has_velocity) {
        return given.greatest_speed();
    }
    if !body.velocity.iter().any(Quantity::depends_on_place) {
        return speed(&[0.0; D]);
    }
    raster(problem, body).map(|x| speed(&x)).fold(0.0, f64::max)
}

/// Nine points along each axis of the body's bounding box that lie in the body.
pub fn raster<'a, const D: usize>(
    problem: &Problem<D>,
    body: &'a Body<D>,
) -> impl Iterator<Item = [f64; D]> + 'a {
    let bounds = body.shape.bounds().intersection(&Aabb::new([0.0; D], problem.size()));
    (0..9_usize.pow(D as u32)).filter_map(move |mut index| {
        let x = std::array::from_fn(|a| {
            let share = ((index % 9) as f64 + 0.5) / 9.0;
            index /= 9;
            bounds.lower[a] + share * (bounds.upper[a] - bounds.lower[a])
        });
        body.shape.contains(&x).then_some(x)
    })
}

/// Gradient of the velocity of a rotation: `C r = ω × r`.
fn velocity_gradient<const D: usize>(spin: [f64; 3]) -> [[f64; D]; D] {
    let [x, y, z] = spin;
    let skew = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    std::array::from_fn(|i| std::array::from_fn(|j| skew[i][j]))
}

/// Calls `take(body, points)` for each of some bodies with points in the leaf. `at_surface` finds them where
/// the surface of the body may cross the leaf.
fn visit<const D: usize>(
    problem: &Problem<D>,
    octant: &Octant<D>,
    bodies: impl Iterator<Item = usize>,
    at_surface: impl Fn(&Problem<D>, &Body<D>, &Aabb<D>, u8) -> Vec<Point<D>>,
    mut take: impl FnMut(usize, &[Point<D>]),
) -> Result<(), SeedError> {
    let cell = problem.octant_box(octant);
    let near: Vec<(usize, Side)> = bodies
        .map(|index| (index, problem.bodies[index].shape.classify(&cell)))
        .filter(|(_, side)| *side != Side::Outside)
        .collect();
    let mut points = Vec::new();
    for &(index, side) in &near {
        let body = &problem.bodies[index];
        let lattice = Lattice::of(problem, octant.level, body);
        points.clear();
        if let Some(given) = &body.given {
            let rows = given.in_box(&cell).into_iter();
            points.extend(
                rows.map(|p| given.chunk().position(p as usize)).map(|x| Point::at(lattice.place_of(&x), x)),
            );
        } else if side == Side::Crosses && has_parts(problem, body) {
            points = at_surface(problem, body, &cell, octant.level);
        } else {
            lattice.visit(&cell, |index| {
                let x = lattice.centre(&index);
                if side == Side::Inside || body.shape.contains(&x) {
                    points.push(Point::at(index, x));
                }
            });
        }
        let together = |other: usize| other != index && problem.come_together(index, other);
        for &(other, _) in near.iter().filter(|(other, _)| together(*other)) {
            // Two bodies in contact may both contain a point by rounding; it belongs to the first.
            let rounding = -1e-9 * lattice.edge;
            let neighbour = &problem.bodies[other];
            let mut overlap = None;
            points.retain(|point| {
                let x = &point.x;
                // Both bodies have their parts of a box.
                let is_part = point.part.is_some();
                if !neighbour.shape.contains(x) || is_part && !body.shape.contains(x) {
                    return true;
                }
                if body.shape.distance(x).max(neighbour.shape.distance(x)) < rounding {
                    overlap.get_or_insert(*x);
                }
                is_part || index < other
            });
            if let Some(x) = overlap {
                let (first, second) = (index.min(other), index.max(other));
                return Err(SeedError::Overlap {
                    place: place(problem, second),
                    first: problem.bodies[first].name.clone(),
                    second: problem.bodies[second].name.clone(),
                    point: (0..D).map(|a| x[a] + problem.origin[a]).collect(),
                });
            }
        }
        if !points.is_empty() {
            take(index, &points);
        }
    }
    Ok(())
}

#[cfg(test)]
#[path = "seed_tests.rs"]
mod tests;
