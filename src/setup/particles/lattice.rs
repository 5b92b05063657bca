//! The lattice on which bodies are filled.
use crate::geometry::Aabb;
use crate::job::problem::{Body, Problem};

/// Distance of lattice points of a body in leaves of a level, m.
pub(super) fn spacing<const D: usize>(problem: &Problem<D>, level: u8, body: &Body<D>) -> f64 {
    problem.cell_edge(level) / body.particles_per_cell
}

/// The places of lattice points in a half-open box along each axis, lexicographic with the last axis fastest.
pub(super) fn lattice_of<const D: usize>(cell: &Aabb<D>, spacing: f64) -> Vec<[u64; D]> {
    let mut places = Vec::new();
    for_lattice(cell, spacing, |index| places.push(index));
    places
}

pub(super) fn for_lattice<const D: usize>(cell: &Aabb<D>, spacing: f64, mut take: impl FnMut([u64; D])) {
    let range: [(u64, u64); D] = std::array::from_fn(|a| {
        (first_at_or_after(cell.lower[a], spacing), first_at_or_after(cell.upper[a], spacing))
    });
    if range.iter().any(|(first, end)| first >= end) {
        return;
    }
    let mut index: [u64; D] = std::array::from_fn(|a| range[a].0);
    loop {
        take(index);
        let mut axis = D;
        loop {
            if axis == 0 {
                return;
            }
            axis -= 1;
            index[axis] += 1;
            if index[axis] < range[axis].1 {
                break;
            }
            index[axis] = range[axis].0;
        }
    }
}

pub(super) fn coordinate(index: u64, spacing: f64) -> f64 {
    (index as f64 + 0.5) * spacing
}

/// The first lattice index whose coordinate is not below `bound`: decided by the coordinate itself, so
/// that two leaves with a common face agree on every point.
pub(super) fn first_at_or_after(bound: f64, spacing: f64) -> u64 {
    let mut index = (bound / spacing - 0.5).ceil().max(0.0) as u64;
    while index > 0 && coordinate(index - 1, spacing) >= bound {
        index -= 1;
    }
    while coordinate(index, spacing) < bound {
        index += 1;
    }
    index
}
