//! The lattice on which bodies are filled.
use crate::geometry::Aabb;
use crate::job::problem::{Body, Problem};

/// Boxes that fill space, of which a body has a particle in each that it fills. A corner lies at the lower
/// corner of the domain, or where the faces of the body ask for it ([`Body::lattice`]).
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice<const D: usize> {
    /// Lower corner of the first box, m; not above that of the domain.
    pub(super) origin: [f64; D],
    /// Edge of a box, m.
    pub(super) edge: f64,
}

impl<const D: usize> Lattice<D> {
    /// That of a body in leaves of a level.
    pub(super) fn of(problem: &Problem<D>, level: u8, body: &Body<D>) -> Self {
        Self { origin: body.lattice, edge: problem.cell_edge(level) / body.particles_per_cell }
    }

    /// One of boxes with an edge so many times in that of these.
    pub(super) fn finer(self, times: u64) -> Self {
        Self { edge: self.edge / times as f64, ..self }
    }

    /// Centre of a box, m.
    pub(super) fn centre(&self, index: &[u64; D]) -> [f64; D] {
        std::array::from_fn(|a| self.coordinate(a, index[a]))
    }

    /// The box at a place.
    pub(super) fn cell(&self, index: &[u64; D]) -> Aabb<D> {
        let corner =
            |offset: u64| std::array::from_fn(|a| (index[a] + offset) as f64 * self.edge + self.origin[a]);
        Aabb::new(corner(0), corner(1))
    }

    /// The box that holds a point of the domain.
    pub(super) fn place_of(&self, x: &[f64; D]) -> [u64; D] {
        std::array::from_fn(|a| ((x[a] - self.origin[a]) / self.edge) as u64)
    }

    /// Volume of a box, m³ (m² in the plane).
    pub(super) fn volume(&self) -> f64 {
        (0..D).fold(1.0, |volume, _| volume * self.edge)
    }

    /// The places of boxes whose centres lie in a half-open box, lexicographic with the last axis fastest.
    pub(super) fn places_in(&self, cell: &Aabb<D>) -> Vec<[u64; D]> {
        let mut places = Vec::new();
        self.visit(cell, |index| places.push(index));
        places
    }

    /// The number of these places.
    pub(super) fn count_in(&self, cell: &Aabb<D>) -> u64 {
        self.range(cell).iter().fold(1, |all, (first, end)| all.saturating_mul(end.saturating_sub(*first)))
    }

    /// Calls `take` with each of these places.
    pub(super) fn visit(&self, cell: &Aabb<D>, mut take: impl FnMut([u64; D])) {
        let range = self.range(cell);
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

    fn coordinate(&self, axis: usize, index: u64) -> f64 {
        (index as f64 + 0.5) * self.edge + self.origin[axis]
    }

    fn range(&self, cell: &Aabb<D>) -> [(u64, u64); D] {
        std::array::from_fn(|a| {
            (self.first_at_or_after(a, cell.lower[a]), self.first_at_or_after(a, cell.upper[a]))
        })
    }

    /// The first index along an axis whose coordinate is not below `bound`: decided by the coordinate itself,
    /// so that two leaves with a common face agree on every point.
    fn first_at_or_after(&self, axis: usize, bound: f64) -> u64 {
        let mut index = ((bound - self.origin[axis]) / self.edge - 0.5).ceil().max(0.0) as u64;
        while index > 0 && self.coordinate(axis, index - 1) >= bound {
            index -= 1;
        }
        while self.coordinate(axis, index) < bound {
            index += 1;
        }
        index
    }
}
