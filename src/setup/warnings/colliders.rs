//! Colliders that are unlikely to act as intended.
use super::name::NAME;
use crate::boundary::motion::{Motion, Pose};
use crate::boundary::vector::length;
use crate::boundary::{ActsOn, Collider, Contact};
use crate::geometry::{Aabb, Shape, Side, common_point};
use crate::job::Problem;
use crate::job::problem::Body;
use crate::setup::walls::{acts_on_nodes, level_at};
use crate::text::{excerpt, quantity};

/// Boxes tested for bodies inside colliders.
const BOXES: usize = 50_000;

/// Warns of colliders that material may pass through or never touches, of bodies that begin inside one, and
/// of combinations with known errors.
pub(super) fn look<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let mut boxes = BOXES;
    moving_tank(problem, all);
    fluids_at_particles(problem, all);
    plates_with_f_bar(problem, all);
    for (index, collider) in problem.colliders.iter().enumerate() {
        let name = excerpt(&collider.name, NAME);
        let (thickness, cell) =
            (thickness(&collider.shape), problem.cell_edge(level_at(problem, index, collider)));
        if collider.acts_on == ActsOn::Nodes && thickness < 2.0 * cell {
            all.push(format!(
                "colliders[{index}].shape: \"{name}\" is {} thick, less than two cells of {}; material may pass through it: use acts_on = \"particles\", a thicker shape or finer cells",
                quantity(thickness, "m"),
                quantity(cell, "m")
            ));
        }
        if stays_outside(problem, collider) {
            all.push(format!(
                "colliders[{index}].shape: \"{name}\" lies outside the domain from start to end and meets no material: move it, or enlarge the domain"
            ));
            continue;
        }
        // As a grip it holds the material inside it.
        if collider.contact == Contact::Sticky && collider.acts_on == ActsOn::Nodes {
            continue;
        }
        // Where it is in the job is where it begins, unless a table says otherwise.
        let start = collider.state_at(0.0).pose;
        if start.translation != [0.0; D] || start.angle != 0.0 {
            continue;
        }
        let slack = 0.5 * problem.cell_edge(problem.finest_level());
        for (number, body) in problem.bodies.iter().enumerate() {
            let domain = Aabb::new([0.0; D], problem.size());
            let bounds = collider.shape.bounds().intersection(&domain);
            let common = body.shape.bounds().intersection(&bounds);
            if boxes == 0 || common.is_empty() || body.given.is_some() {
                continue;
            }
            if common_point([&body.shape, &collider.shape], common, slack, &mut boxes).is_some() {
                let what = match collider.acts_on {
                    ActsOn::Nodes => "which pushes it out",
                    ActsOn::Particles => "which keeps it there: it may leave, and does not go deeper",
                };
                all.push(format!(
                    "{}.shape: \"{}\" starts partly inside the collider \"{name}\", {what}: move one of them",
                    problem.key_of_body(number),
                    excerpt(&body.name, NAME)
                ));
            }
        }
    }
}

/// Bodies of fluids.
fn fluids<const D: usize>(problem: &Problem<D>) -> impl Iterator<Item = &Body<D>> {
    problem.bodies.iter().filter(|body| problem.materials[body.material].build().is_fluid())
}

/// Water in a tank of colliders that move.
fn moving_tank<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let moves = |(_, collider): &(usize, &Collider<D>)| collider.motion != Motion::Fixed;
    let mut walls = problem.colliders.iter().enumerate().filter(moves);
    let Some((first, collider)) = walls.next() else { return };
    let tank = walls.fold(collider.shape.bounds(), |tank, (_, wall)| tank.hull(&wall.shape.bounds()));
    let is_inside = |bounds: &Aabb<D>| tank.contains(&bounds.lower) && tank.contains(&bounds.upper);
    if let Some(body) = fluids(problem).find(|body| is_inside(&body.shape.bounds())) {
        all.push(format!(
            "colliders[{first}].motion: \"{}\" lies in a tank that moves, where it loses height as it sloshes: 0.7 % in 4 s and 3 % in 6 s with cells of a twentieth of its depth, 0.1 % with cells of a tenth; in faces of the domain, shaken by a load of kind \"body_force\", it does not",
            excerpt(&body.name, NAME)
        ));
    }
}

/// Fluids at colliders that act on particles and are too thin to act on nodes.
fn fluids_at_particles<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let last = problem.stages.len().saturating_sub(1);
    let at_particles = |(index, collider): &(usize, &Collider<D>)| {
        collider.acts_on == ActsOn::Particles && !acts_on_nodes(problem, last, *index)
    };
    if fluids(problem).next().is_some()
        && let Some((index, collider)) = problem.colliders.iter().enumerate().find(at_particles)
    {
        let name = excerpt(&collider.name, NAME);
        all.push(format!(
            "colliders[{index}].acts_on: \"{name}\" acts on particles, as it is thinner than two cells, moves freely or holds other material as well; there fluids sink: 10 % of their height in 0.5 s at rest, 13 % in 1.5 s as they slosh, with cells of a tenth of the depth; use thicker walls with acts_on = \"nodes\""
        ));
    }
}

/// Plates at nodes that press elastic bodies together, with F-bar.
fn plates_with_f_bar<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let is_elastic = |body: &Body<D>| {
        let material = problem.materials[body.material].build();
        !material.is_fluid() && !material.is_plastic()
    };
    let presses = |(_, collider): &(usize, &Collider<D>)| {
        let moves = collider.motion != Motion::Fixed && collider.free().is_none();
        collider.acts_on == ActsOn::Nodes && collider.contact != Contact::Sticky && moves
    };
    if let Some((index, collider)) = problem.colliders.iter().enumerate().find(presses)
        && problem.f_bar
        && problem.bodies.iter().any(is_elastic)
    {
        all.push(format!(
            "colliders[{index}].acts_on: \"{}\" acts on nodes, elastic bodies are there, and numerics.f_bar is true: pressed together by 30 % a block bears 0.97 to 0.99 of its load at such plates, by 45 % 0.75; with acts_on = \"particles\" or with f_bar = false it bears all of it to 30 %",
            excerpt(&collider.name, NAME)
        ));
    }
}

/// The least width of a shape, m; of unions that of the thickest part, of other booleans an upper bound.
fn thickness<const D: usize>(shape: &Shape<D>) -> f64 {
    let least_edge =
        |bounds: &Aabb<D>| (0..D).map(|a| bounds.upper[a] - bounds.lower[a]).fold(f64::INFINITY, f64::min);
    match shape {
        Shape::Box(bounds) => least_edge(bounds),
        Shape::Sphere { radius, .. } => 2.0 * radius,
        Shape::Frustum(frustum) => frustum.height.min(2.0 * frustum.lower_radius.max(frustum.upper_radius)),
        Shape::HalfSpace { .. } => f64::INFINITY,
        Shape::Polygon(_) | Shape::Mesh(_) => least_edge(&shape.bounds()),
        Shape::Rotated(inner, _) => thickness(inner),
        Shape::Union(parts) => parts.iter().map(thickness).fold(0.0, f64::max),
        Shape::Intersection(parts) => parts.iter().map(thickness).fold(f64::INFINITY, f64::min),
        Shape::Difference(from, _) => thickness(from),
    }
}

/// Times of a run at which the place of a moving collider is computed.
const TIMES: u32 = 256;

/// Whether a collider is outside the domain, by more than a cell, at all times of a run. False for free
/// bodies.
fn stays_outside<const D: usize>(problem: &Problem<D>, collider: &Collider<D>) -> bool {
    let edge = problem.cell_edge(problem.tree.base_level);
    let size = problem.size();
    let domain = Aabb::new([-edge; D], size.map(|c| c + edge));
    if collider.free().is_some() || collider.deforming.is_some() {
        return false;
    }
    let bounds = collider.shape.bounds();
    let is_outside = |time: f64| {
        let (way, angle) = collider.motion.place(time);
        if angle == 0.0 {
            let moved = |corner: &[f64; D]| std::array::from_fn(|a| corner[a] + way[a]);
            let back = Aabb::new(
                std::array::from_fn(|a| domain.lower[a] - way[a]),
                std::array::from_fn(|a| domain.upper[a] - way[a]),
            );
            let meets = Aabb::new(moved(&bounds.lower), moved(&bounds.upper)).intersection(&domain);
            return meets.is_empty() || collider.shape.classify(&back) == Side::Outside;
        }
        // Turned: by the ball about its bounding box.
        let centre = collider.to_space(&bounds.centre(), &Pose::new(way, angle, collider.axis));
        let near: [f64; D] = std::array::from_fn(|a| centre[a].clamp(domain.lower[a], domain.upper[a]));
        let gap: [f64; D] = std::array::from_fn(|a| centre[a] - near[a]);
        length(&gap) > bounds.half_diagonal()
    };
    (0..=TIMES).all(|part| is_outside(problem.time.end * f64::from(part) / f64::from(TIMES)))
}
