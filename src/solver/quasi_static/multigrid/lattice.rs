//! Cells on the lattice of the finest nodes, and what places follow in meshes of cells of several sizes.
use rustc_hash::FxHashSet;

/// Least part of a box that counts.
const LEAST_PART: f64 = 1e-9;

/// A place on the lattice of finest nodes.
pub(super) type Lattice<const D: usize> = [i64; D];

/// A cell: its edge, and its lower corner, a multiple of the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Cell<const D: usize> {
    pub(super) edge: i64,
    pub(super) lower: Lattice<D>,
}

impl<const D: usize> Cell<D> {
    /// Place of a corner.
    pub(super) fn corner(&self, corner: usize) -> Lattice<D> {
        std::array::from_fn(|a| self.lower[a] + self.edge * (corner >> a & 1) as i64)
    }

    /// The cell itself, or the one of this edge that has it.
    fn within(&self, edge: i64) -> Self {
        if self.edge >= edge { *self } else { Self { edge, lower: self.lower.map(|x| floor_to(x, edge)) } }
    }

    /// Place of a point over the edges, 0 to 1 in the cell.
    fn share(&self, place: &Lattice<D>) -> [f64; D] {
        std::array::from_fn(|a| (place[a] - self.lower[a]) as f64 / self.edge as f64)
    }

    fn has_corner(&self, place: &Lattice<D>) -> bool {
        (0..D).all(|a| place[a] == self.lower[a] || place[a] == self.lower[a] + self.edge)
    }
}

/// The greatest multiple of `edge` that is not above `x`.
pub(super) fn floor_to(x: i64, edge: i64) -> i64 {
    x.div_euclid(edge) * edge
}

/// A box around a particle: centre and half widths, m.
type Around<const D: usize> = ([f64; D], [f64; D]);

/// Calls `each` with level and place of the cells that a box overlaps, counted along the axes, and the part
/// of it that is in each: cells of this level and edge (m), and finer ones where `is_finer` says so.
pub(super) fn overlaps<const D: usize>(
    whole: &Around<D>,
    (level, cell): (u8, f64),
    is_finer: &impl Fn(u8, &[i64; D]) -> bool,
    each: &mut impl FnMut(u8, [i64; D], f64),
) {
    let (x, half) = whole;
    let lower: [i64; D] = std::array::from_fn(|a| ((x[a] - half[a]) / cell).floor().max(0.0) as i64);
    let counts: [i64; D] =
        std::array::from_fn(|a| (((x[a] + half[a]) / cell).ceil() as i64 - lower[a]).max(1));
    for number in 0..counts.iter().product::<i64>() {
        let mut left = number;
        let at: [i64; D] = std::array::from_fn(|a| {
            let along = left % counts[a];
            left /= counts[a];
            lower[a] + along
        });
        descend(whole, (level, cell), at, is_finer, each);
    }
}

/// As [`overlaps`] for one cell and those in it.
fn descend<const D: usize>(
    whole: &Around<D>,
    (level, cell): (u8, f64),
    at: [i64; D],
    is_finer: &impl Fn(u8, &[i64; D]) -> bool,
    each: &mut impl FnMut(u8, [i64; D], f64),
) {
    let (x, half) = whole;
    let along = (0..D).map(|a| {
        let (from, to) = (at[a] as f64 * cell, (at[a] + 1) as f64 * cell);
        ((x[a] + half[a]).min(to) - (x[a] - half[a]).max(from)).max(0.0) / (2.0 * half[a])
    });
    let part: f64 = along.product();
    if part <= LEAST_PART {
        return;
    }
    if !is_finer(level, &at) {
        return each(level, at, part);
    }
    for corner in 0..1_i64 << D {
        let at = std::array::from_fn(|a| 2 * at[a] + (corner >> a & 1));
        descend(whole, (level + 1, 0.5 * cell), at, is_finer, each);
    }
}

/// Multilinear function of a corner.
pub(super) fn weight<const D: usize>(corner: usize, share: &[f64; D]) -> f64 {
    (0..D).map(|a| if corner >> a & 1 == 1 { share[a] } else { 1.0 - share[a] }).product()
}

/// Gradient of the function of a corner, over edges of the cell.
pub(super) fn slope<const D: usize>(corner: usize, share: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|axis| {
        let along = |a: usize| if corner >> a & 1 == 1 { share[a] } else { 1.0 - share[a] };
        let others: f64 = (0..D).filter(|&a| a != axis).map(along).product();
        if corner >> axis & 1 == 1 { others } else { -others }
    })
}

/// Cells of several sizes with multilinear functions; corners on a coarser cell follow its corners.
pub(super) struct Mesh<const D: usize> {
    cells: FxHashSet<Cell<D>>,
    /// Edges of the cells, the longest first.
    edges: Vec<i64>,
}

impl<const D: usize> Mesh<D> {
    /// Of these cells, each that is finer than `edge` replaced by that of this edge that has it.
    pub(super) fn of_ancestors(cells: &[Cell<D>], edge: i64) -> Self {
        let cells: FxHashSet<Cell<D>> = cells.iter().map(|cell| cell.within(edge)).collect();
        let mut edges: Vec<i64> = cells.iter().map(|cell| cell.edge).collect();
        edges.sort_unstable_by_key(|edge| -edge);
        edges.dedup();
        Self { cells, edges }
    }

    /// The coarsest cell whose closed box has a place.
    fn at(&self, place: &Lattice<D>) -> Option<Cell<D>> {
        let beside = self.edges.iter().flat_map(|&edge| {
            (0..1_i64 << D).map(move |corner| {
                let lower = std::array::from_fn(|a| floor_to(place[a] - (corner >> a & 1), edge));
                Cell { edge, lower }
            })
        });
        beside.into_iter().find(|cell| self.cells.contains(cell))
    }

    /// Calls `each` with the free corners, and their weights, that a place follows, if a cell has it.
    pub(super) fn follow(&self, place: &Lattice<D>, factor: f64, each: &mut impl FnMut(Lattice<D>, f64)) {
        let Some(cell) = self.at(place) else { return };
        if cell.has_corner(place) {
            return each(*place, factor);
        }
        let share = cell.share(place);
        for corner in 0..1_usize << D {
            let weight = weight::<D>(corner, &share);
            if weight > 0.0 {
                self.follow(&cell.corner(corner), factor * weight, each);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A coarse cell beside four fine ones: the middle of their common edge follows the coarse corners.
    #[test]
    fn a_hanging_corner_follows_the_coarse_cell() {
        let fine = (0..4).map(|n| Cell { edge: 2, lower: [4 + 2 * (n & 1), 2 * (n >> 1)] });
        let cells: Vec<_> = fine.chain([Cell { edge: 4, lower: [0, 0] }]).collect();
        let followed = |edge: i64, place: [i64; 2]| {
            let mut found = Vec::new();
            Mesh::of_ancestors(&cells, edge).follow(&place, 1.0, &mut |at, weight| found.push((at, weight)));
            found
        };
        assert_eq!(followed(1, [4, 2]), [([4, 0], 0.5), ([4, 4], 0.5)]);
        assert_eq!(followed(1, [6, 2]), [([6, 2], 1.0)]);
        assert_eq!(followed(4, [6, 0]), [([4, 0], 0.5), ([8, 0], 0.5)]);
        assert_eq!(followed(1, [9, 9]), []);
    }

    #[test]
    fn a_box_is_shared_out_to_cells() {
        let mut found = Vec::new();
        let whole = ([1.0, 0.5], [0.25, 0.5]);
        let is_finer = |level: u8, at: &[i64; 2]| level == 3 && at[0] == 1;
        overlaps(&whole, (3, 1.0), &is_finer, &mut |level, at, part| found.push((level, at, part)));
        assert_eq!(found, [(3, [0, 0], 0.5), (4, [2, 0], 0.25), (4, [2, 1], 0.25)]);
    }
}
