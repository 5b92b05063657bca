//! Tables of the leaves across the faces of a leaf beside finer ones, so that boxes need not be compared with
//! every leaf around.
//!
//! Along each axis a box stays within its leaf, or crosses the lower or the upper face, or both: at most
//! `4^D` cases, each with its answer in a table.
use std::cmp::Ordering;

use partition::Octant;

use crate::grid::KnownTree;
use crate::grid::leaf_geometry::leaf_box;
use crate::grid::mask::{offset, offset_count, offset_index};
use crate::grid::plan::Bin;
use crate::simd::{LANES, Lanes, Vector, VectorMask};

/// A leaf near a leaf.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct NearLeaf<const D: usize> {
    /// Its level.
    pub level: u8,
    /// Lower corner relative to that of the domain, m.
    pub lower: [f64; D],
    /// Upper corner relative to the domain's lower corner, m.
    pub upper: [f64; D],
}

impl<const D: usize> NearLeaf<D> {
    /// How far beyond its faces boxes count as touching them, m.
    pub(crate) fn slack(&self) -> [f64; D] {
        self.upper.map(|x| 16.0 * f64::EPSILON * x)
    }
}

/// A known leaf.
pub(super) fn near_leaf<const D: usize>(tree: &KnownTree<D>, known: usize, root_edge: f64) -> NearLeaf<D> {
    let leaf = tree.leaves()[known];
    let (lower, upper) = leaf_box(&leaf, root_edge);
    NearLeaf { level: leaf.level, lower, upper }
}

/// On which level a box at most a cell wide scatters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Side {
    /// On the leaf's own.
    Own,
    /// One level finer.
    Finer,
    /// To be found from the leaves around.
    Other,
}

/// The leaves across the faces of one leaf.
#[derive(Clone, Debug)]
pub(super) struct LeafFaces<const D: usize> {
    /// By the faces that a box crosses, see [`LeafFaces::faces`].
    sides: [Side; 64],
    /// Faces, a bit each, on which the side of a box depends.
    decisive: u32,
    lower: [f64; D],
    upper: [f64; D],
    slack: [f64; D],
    middle: [f64; D],
    /// Bins one level finer by child of the leaf, counted within the leaf.
    children: [Option<u32>; 8],
}

impl<const D: usize> LeafFaces<D> {
    /// The sides of `leaf`, which is the octant `here` with cells of edge `cell` and has the given bins;
    /// `near` are the finer leaves around.
    pub(super) fn new(
        leaf: NearLeaf<D>,
        here: Octant<D>,
        cell: f64,
        near: &[NearLeaf<D>],
        bins: &[Bin<D>],
    ) -> Self {
        // Finest level in each direction, among the leaves that touch this one. A box at most a cell wide
        // reaches half a cell beyond, less than the depth of a leaf one level finer.
        let mut towards = [Side::Own; 27];
        for other in near {
            let along: [Option<i32>; D] = std::array::from_fn(|axis| {
                let (above_lower, below_upper) =
                    (other.upper[axis] - leaf.lower[axis], leaf.upper[axis] - other.lower[axis]);
                match (above_lower, below_upper) {
                    (0.0, _) => Some(-1),
                    (_, 0.0) => Some(1),
                    _ => (above_lower > 0.0 && below_upper > 0.0).then_some(0),
                }
            });
            if along.contains(&None) {
                continue;
            }
            let side = &mut towards[offset_index(along.map(Option::unwrap_or_default))];
            *side = (*side).max(match other.level.cmp(&(leaf.level + 1)) {
                Ordering::Less => Side::Own,
                Ordering::Equal => Side::Finer,
                Ordering::Greater => Side::Other,
            });
        }
        let mut sides = [Side::Own; 64];
        for (index, &side) in towards.iter().enumerate().take(offset_count(D)) {
            let along = offset::<D>(index).map(|direction| [0b01, 0b00, 0b10][(direction + 1) as usize]);
            let faces = (0..D).fold(0, |faces, axis| faces | along[axis] << (2 * axis));
            sides[faces] = side;
        }
        // A box that crosses several faces reaches the leaves across any of them.
        for face in 0..2 * D {
            for faces in (0..1 << (2 * D)).filter(|faces| faces >> face & 1 == 1) {
                sides[faces] = sides[faces].max(sides[faces & !(1 << face)]);
            }
        }
        let children = std::array::from_fn(|child| {
            let child = (child < Octant::<D>::CHILDREN).then(|| here.child(child))?;
            bins.iter().position(|bin| bin.block == child).map(|bin| bin as u32)
        });
        let middle = std::array::from_fn(|axis| f64::from(2 * here.coord[axis] + 1) * 2.0 * cell);
        let faces = (0..2 * D as u32)
            .filter(|face| (0..1 << (2 * D)).any(|set: usize| sides[set] != sides[set & !(1 << face)]));
        let decisive = faces.fold(0, |bits, face| bits | 1 << face);
        Self { sides, decisive, lower: leaf.lower, upper: leaf.upper, slack: leaf.slack(), middle, children }
    }

    /// Lanes whose boxes may scatter elsewhere than on the leaf's own level, given bounds on their half
    /// widths. `position` gives coordinates along an axis.
    #[inline(always)]
    pub(super) fn undecided(&self, half: Lanes, position: impl Fn(usize) -> Lanes) -> u32 {
        let mut lanes = 0;
        for axis in 0..D {
            let faces = self.decisive >> (2 * axis) & 0b11;
            if faces == 0 {
                continue;
            }
            let (centre, slack) = (position(axis), Lanes::splat(self.slack[axis]));
            if faces & 1 == 1 {
                lanes |= (!Lanes::splat(self.lower[axis]).le(centre - half - slack)).bits();
            }
            if faces & 2 == 2 {
                lanes |= (!(centre + half + slack).le(Lanes::splat(self.upper[axis]))).bits();
            }
        }
        lanes
    }

    /// Faces that a box crosses, or touches up to round-off: bit `2 axis` for the lower and `2 axis + 1` for
    /// the upper one.
    pub(super) fn faces(&self, centre: &[f64; D], half: &[f64; D]) -> usize {
        (0..D).fold(0, |faces, axis| {
            let above_lower = self.lower[axis] <= centre[axis] - half[axis] - self.slack[axis];
            let below_upper = centre[axis] + half[axis] + self.slack[axis] <= self.upper[axis];
            faces | (usize::from(!above_lower) | usize::from(!below_upper) << 1) << (2 * axis)
        })
    }

    /// Bins, counted within the leaf, of the boxes of a batch that are whole and on the leaf's own level or
    /// one finer: half widths are compared with these limits of both levels.
    #[inline(always)]
    pub(super) fn bins(
        &self,
        centre: &[Lanes; D],
        half: &[Lanes; D],
        [limit, limit_of_finer]: [f64; 2],
    ) -> [Option<u32>; LANES] {
        let narrow =
            |limit: f64| half.iter().fold(u32::MAX, |all, half| all & half.le(Lanes::splat(limit)).bits());
        let (narrow, narrow_for_finer) = (narrow(limit), narrow(limit_of_finer));
        let (faces, children) = (self.faces_of_batch(centre, half), self.children_of_batch(centre));
        std::array::from_fn(|lane| match self.sides[usize::from(faces[lane])] {
            // The first bin of a leaf is its own block's.
            Side::Own if narrow >> lane & 1 == 1 => Some(0),
            Side::Finer if narrow_for_finer >> lane & 1 == 1 => self.children[usize::from(children[lane])],
            _ => None,
        })
    }

    /// [`LeafFaces::faces`] of the boxes of a batch.
    #[inline(always)]
    fn faces_of_batch(&self, centre: &[Lanes; D], half: &[Lanes; D]) -> [u8; LANES] {
        let mut faces = 0;
        for axis in 0..D {
            let (slack, below) = (Lanes::splat(self.slack[axis]), centre[axis] - half[axis]);
            let above_lower = Lanes::splat(self.lower[axis]).le(below - slack);
            let below_upper = (centre[axis] + half[axis] + slack).le(Lanes::splat(self.upper[axis]));
            faces |= (!above_lower).bytes() << (2 * axis) | (!below_upper).bytes() << (2 * axis + 1);
        }
        faces.to_le_bytes()
    }

    /// Children of the leaf that contain the points of a batch.
    #[inline(always)]
    fn children_of_batch(&self, centre: &[Lanes; D]) -> [u8; LANES] {
        let upper = |axis: usize| Lanes::splat(self.middle[axis]).le(centre[axis]).bytes() << axis;
        (0..D).fold(0, |children, axis| children | upper(axis)).to_le_bytes()
    }

    /// Where a box scatters that crosses some faces.
    pub(super) fn side(&self, faces: usize) -> Side {
        self.sides[faces]
    }
}

#[cfg(test)]
mod tests {
    use partition::Brick;

    use super::*;
    use crate::grid::plan::bin_reach::leaves_around;

    /// Leaves of two levels, some of the coarser ones alone among finer ones.
    fn tree<const D: usize>() -> KnownTree<D> {
        let coarse = (0..4u32.pow(D as u32)).map(|number| {
            let coord = std::array::from_fn(|axis| number / 4u32.pow(axis as u32) % 4);
            Octant { level: 1, coord }
        });
        let split = |octant: &Octant<D>| octant.coord.iter().fold(7, |sum, c| 5 * sum + c) % 3 == 0;
        let leaves = coarse.flat_map(|octant| match split(&octant) {
            true => (0..Octant::<D>::CHILDREN).map(|child| octant.child(child)).collect(),
            false => vec![octant],
        });
        KnownTree::whole(Brick { roots: [2; D] }, leaves.collect())
    }

    /// Small boxes on all faces, edges and corners of all coarse leaves are on the level of the finest leaf
    /// that they overlap.
    fn sides_are_those_of_the_leaves<const D: usize>() {
        let tree = tree::<D>();
        let all: Vec<NearLeaf<D>> =
            (0..tree.leaves().len()).map(|known| near_leaf(&tree, known, 1.0)).collect();
        let cell = 0.125;
        let mut found = [0; 2];
        for (known, leaf) in all.iter().enumerate().filter(|(_, leaf)| leaf.level == 1) {
            let around = leaves_around(&tree, known).into_iter().map(|other| all[other]);
            let finer: Vec<NearLeaf<D>> = around.filter(|other| other.level > 1).collect();
            let sides = LeafFaces::new(*leaf, tree.leaves()[known], cell, &finer, &[]);
            for index in 0..offset_count(D) {
                let direction = offset::<D>(index);
                let centre: [f64; D] =
                    std::array::from_fn(|a| leaf.lower[a] + 0.25 + 0.25 * f64::from(direction[a]));
                let half = [0.25 * cell; D];
                let overlaps = |other: &&NearLeaf<D>| {
                    (0..D)
                        .all(|a| other.lower[a] < centre[a] + half[a] && other.upper[a] > centre[a] - half[a])
                };
                let finest = all.iter().filter(overlaps).map(|other| other.level).max();
                let side = sides.side(sides.faces(&centre, &half));
                assert_eq!(
                    (side, finest),
                    if finest == Some(1) { (Side::Own, finest) } else { (Side::Finer, Some(2)) }
                );
                found[usize::from(side == Side::Finer)] += 1;
            }
        }
        assert!(found.iter().all(|&number| number > 20), "{found:?}");
    }

    #[test]
    fn sides_are_those_of_the_leaves_in_the_plane_and_in_space() {
        sides_are_those_of_the_leaves::<2>();
        sides_are_those_of_the_leaves::<3>();
    }
}
