//! Solids that are thicker or thinner than their shape, on the lattice of the cells.
use super::name::NAME;
use crate::geometry::{Sampling, Shape};
use crate::job::Problem;
use crate::job::problem::Body;
use crate::quantity::AXES;
use crate::text::{excerpt, quantity};

/// Relative error of a width from which it is told: a plate then bends by a tenth too far or not far enough.
const NOTABLE: f64 = 0.03;

/// Warns of boxes of solids whose faces lie off the lattice, on cells of one size.
pub(super) fn look<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    if !problem.tree.regions.is_empty() || problem.adaptivity.is_some() {
        return;
    }
    for (index, body) in problem.bodies.iter().enumerate() {
        let edge = problem.cell_edge(problem.tree.base_level) / body.particles_per_cell;
        if let Some((axis, width, filled)) = worst_width(problem, body, edge) {
            all.push(format!(
                "bodies[{index}]: \"{}\" is {} wide along {}, and its particles, which lie on the lattice of the cells, fill {}; expected faces on multiples of {}, finer cells, or sampling = \"fitted\"",
                excerpt(&body.name, NAME),
                quantity(width, "m"),
                AXES[axis],
                quantity(filled, "m"),
                quantity(edge, "m"),
            ));
        }
    }
}

/// Axis along which the width of a solid box is furthest from what its particles fill, whose boxes have this
/// edge; its width and what they fill, m. `None` where all are near enough.
fn worst_width<const D: usize>(problem: &Problem<D>, body: &Body<D>, edge: f64) -> Option<(usize, f64, f64)> {
    let Shape::Box(bounds) = &body.shape else { return None };
    let is_on_lattice = matches!(body.sampling, Sampling::Lattice) && body.lattice == [0.0; D];
    let keeps_its_shape = || problem.materials[body.material].build().keeps_its_shape();
    if !is_on_lattice || body.given.is_some() || body.fed.is_some() || !keeps_its_shape() {
        return None;
    }
    let size = problem.size();
    let width = |axis: usize| {
        let ends = [bounds.lower[axis].max(0.0), bounds.upper[axis].min(size[axis])];
        // A box lies in the body if its centre does.
        let [low, high] = ends.map(|end| (end / edge - 0.5).ceil() * edge);
        (axis, ends[1] - ends[0], high - low)
    };
    let error = |&(_, width, filled): &(usize, f64, f64)| (filled / width - 1.0).abs();
    (0..D).map(width).filter(|all| error(all) > NOTABLE).max_by(|a, b| error(a).total_cmp(&error(b)))
}
