//! What lies across the faces of a leaf beside finer ones, so that boxes need not be held against every leaf around.
//!
//! Along each axis a box stays within its leaf, or crosses the lower or the upper face, or both: at most `4^D` cases,
//! each with its answer in a table.
use partition::Octant;

use super::migrate::leaf_box;
use crate::grid::KnownTree;
use crate::grid::mask::{offset, offset_count};
use crate::grid::plan::Bin;
use crate::kernel::simd::Lanes;

/// A leaf near a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearLeaf<const D: usize> {
    /// Its level.
    pub level: u8,
    /// Lower corner relative to that of the domain, m.
    pub lower: [f64; D],
    /// Upper corner relative to the domain's lower corner, m.
    pub upper: [f64; D],
}

impl<const D: usize> NearLeaf<D> {
    /// How far beyond its faces boxes count as touching them, m.
    pub fn slack(&self) -> [f64; D] {
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
pub(super) struct Sides<const D: usize> {
    /// By the faces that a box crosses, see [`Crossings`].
    sides: [Side; 64],
    lower: [f64; D],
    upper: [f64; D],
    slack: [f64; D],
    middle: [f64; D],
    /// Bins one level finer by child of the leaf, counted within the leaf.
    children: [Option<u32>; 8],
}

/// Which faces of the leaf the boxes of a batch cross: per axis, bits of the lanes for lower and upper face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossings<const D: usize>([[u32; 2]; D]);

impl<const D: usize> Crossings<D> {
    fn index(self, crosses: impl Fn(u32) -> bool) -> usize {
        let faces = self.0.as_flattened().iter().enumerate();
        faces.fold(0, |index, (face, &lanes)| index | usize::from(crosses(lanes)) << face)
    }

    /// Faces that the box of one lane crosses, bit `2 axis` for the lower and `2 axis + 1` for the upper one.
    pub fn of_lane(self, lane: usize) -> usize {
        self.index(|lanes| lanes >> lane & 1 == 1)
    }

    /// Faces that any box crosses.
    pub fn of_any(self) -> usize {
        self.index(|lanes| lanes != 0)
    }
}

impl<const D: usize> Sides<D> {
    /// The sides of `leaf`, which is the octant `here` with cells of edge `cell` and has the given bins; `near` are the
    /// leaves around.
    pub fn new(leaf: NearLeaf<D>, here: Octant<D>, cell: f64, near: &[NearLeaf<D>], bins: &[Bin<D>]) -> Self {
        // Finest level in each direction, among the leaves that touch this one. A box at most a cell wide reaches
        // half a cell beyond, less than the depth of a leaf one level finer.
        let mut towards = [Side::Own; 27];
        for (index, side) in towards.iter_mut().enumerate().take(offset_count(D)) {
            let direction = offset::<D>(index);
            let touching = near.iter().filter(|other| {
                (0..D).all(|axis| match direction[axis] {
                    -1 => other.upper[axis] == leaf.lower[axis],
                    0 => other.lower[axis] < leaf.upper[axis] && other.upper[axis] > leaf.lower[axis],
                    _ => other.lower[axis] == leaf.upper[axis],
                })
            });
            *side = match touching.map(|other| other.level).max() {
                Some(level) if level == leaf.level + 1 => Side::Finer,
                Some(level) if level > leaf.level => Side::Other,
                _ => Side::Own,
            };
        }
        let sides = std::array::from_fn(|faces| {
            let crossed = (0..offset_count(D)).filter(|&index| {
                let direction = offset::<D>(index);
                (0..D).all(|axis| match direction[axis] {
                    -1 => faces >> (2 * axis) & 1 == 1,
                    0 => true,
                    _ => faces >> (2 * axis + 1) & 1 == 1,
                })
            });
            crossed.map(|index| towards[index]).max().unwrap_or(Side::Own)
        });
        let children = std::array::from_fn(|child| {
            let child = (child < Octant::<D>::CHILDREN).then(|| here.child(child))?;
            bins.iter().position(|bin| bin.block == child).map(|bin| bin as u32)
        });
        let middle = std::array::from_fn(|axis| f64::from(2 * here.coord[axis] + 1) * 2.0 * cell);
        Self { sides, lower: leaf.lower, upper: leaf.upper, slack: leaf.slack(), middle, children }
    }

    /// Which faces boxes cross, or touch up to round-off.
    pub fn crossings(&self, centre: &[Lanes; D], half: &[Lanes; D]) -> Crossings<D> {
        Crossings(std::array::from_fn(|axis| {
            let slack = Lanes::splat(self.slack[axis]);
            let (lower, upper) = (Lanes::splat(self.lower[axis]), Lanes::splat(self.upper[axis]));
            let lo = centre[axis] - half[axis] - slack;
            let hi = centre[axis] + half[axis] + slack;
            [(!lower.le(lo)).bits(), (!hi.le(upper)).bits()]
        }))
    }

    /// Where a box scatters that crosses some faces.
    pub fn side(&self, faces: usize) -> Side {
        self.sides[faces]
    }

    /// The bin one level finer, counted within the leaf, whose block contains a point of the leaf.
    pub fn child_bin(&self, centre: &[f64; D]) -> Option<usize> {
        let child =
            (0..D).fold(0, |child, axis| child | usize::from(centre[axis] >= self.middle[axis]) << axis);
        self.children[child].map(|bin| bin as usize)
    }
}
