//! Hanging nodes: here, constrained nodes all of whose parents are real.
//!
//! APIC needs the weights of real nodes. Of a hanging node j with weight w, along an axis k on which its
//! coordinate is odd, its parents lie one cell h away on either side, and beside `w v_j d_k` they add
//! ```text
//! w Σ c v_i (x_i - x_j)_k = w h/2 (v_(j+k) - v_(j-k)) = ± w h (v_(j±k) - v_j)
//! ```
//! to B, since the velocity is multilinear in the coarse cell on whose surface or in which the node lies, and
//! nodes j ± k lie there too. So it is a sum over nodes of the stencil with other factors in place of
//! `w d_k`, and P2G adds the transpose: momentum at these nodes, which restriction passes on.
//!
//! The hanging nodes of a stencil are those of a few boxes of nodes; beside a plane face they are one. Within
//! a box the factors are those of each axis.
use super::batch::{Batch, lanes_in};
use super::weights::{Weights, add_products, dot, pencils};
use super::{ARENA_EDGE, BASES, Row, stencil_bases};
use crate::simd::{F64x4, LANES, Lanes, Vector};

/// A box of hanging nodes in a stencil: by axis an index of [`ALONG`].
type NodeBox = [u8; 3];

/// One axis of a box of nodes, for the three nodes of a stencil.
struct Along {
    /// 1 for nodes of the box.
    inside: [f64; 3],
    /// Share of `w h` of each node that moves from the lower to the upper of its two neighbours: 1 for nodes
    /// with an odd coordinate that have one neighbour in the stencil, and 1/2 for the middle one, which has
    /// two.
    odd: [f64; 3],
}

/// By nodes of the box, a bit each, and behind these whether the first node of the stencil has an odd
/// coordinate.
static ALONG: [Along; 16] = {
    let mut along = [const { Along { inside: [0.0; 3], odd: [0.0; 3] } }; 16];
    let mut index = 0;
    while index < 16 {
        let mut node = 0;
        while node < 3 {
            if index >> node & 1 == 1 {
                along[index].inside[node] = 1.0;
                if (index >> 3 & 1 == 1) == (node != 1) {
                    along[index].odd[node] = if node == 1 { 0.5 } else { 1.0 };
                }
            }
            node += 1;
        }
        index += 1;
    }
    along
};

/// The hanging nodes of an arena, as stencils find them.
#[derive(Clone, Debug)]
pub struct HangingNodes {
    /// Boxes of all stencils.
    boxes: Vec<NodeBox>,
    /// First box of each stencil by its base (see [`stencil_bases`]), and the end.
    start: Vec<u16>,
    /// By base, [`HAS_BOXES`] if there are any, and a bit for each axis if all lie at the third node along
    /// it.
    classes: Vec<u8>,
}

/// In [`HangingNodes::classes`].
const HAS_BOXES: u8 = 1 << 3;

impl HangingNodes {
    /// `is_hanging` has a value for each node of the arena. The lowest node of an arena has odd coordinates.
    pub fn new<const D: usize>(is_hanging: &[bool]) -> Self {
        let (mut boxes, mut start): (Vec<NodeBox>, _) = (Vec::new(), vec![0]);
        for base in 0..stencil_bases(D) {
            let first: [usize; 3] =
                std::array::from_fn(|k| if k < D { base / BASES.pow(k as u32) % BASES } else { 0 });
            let layers = if D == 3 { 3 } else { 1 };
            let row = |b: usize, c: usize| {
                let first = first[0] + ARENA_EDGE * (first[1] + b + ARENA_EDGE * (first[2] + c));
                (0..3).fold(0, |row, a| row | u8::from(is_hanging[first + a]) << a)
            };
            let layer = |c: usize| [row(0, c), row(1, c), row(2, c)];
            for (layer, along_z) in alike((0..layers).map(layer)) {
                for (row, along_y) in alike(layer.into_iter()) {
                    if row != 0 {
                        let nodes = [row, along_y, along_z];
                        boxes.push(std::array::from_fn(|k| {
                            nodes[k] | u8::from(k < D && first[k].is_multiple_of(2)) << 3
                        }));
                    }
                }
            }
            start.push(boxes.len() as u16);
        }
        let class = |range: &[u16]| {
            let own = &boxes[usize::from(range[0])..usize::from(range[1])];
            let is_third = |k: usize| own.iter().all(|nodes| nodes[k] & 0b111 == 0b100);
            let axes = (0..D).filter(|&k| is_third(k)).fold(0, |axes, k| axes | 1 << k);
            if own.is_empty() { 0 } else { HAS_BOXES | axes }
        };
        let classes = start.windows(2).map(class).collect();
        Self { boxes, start, classes }
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        size_of::<NodeBox>() * self.boxes.capacity() + 2 * self.start.capacity() + self.classes.capacity()
    }

    /// Members of a batch whose stencils have hanging nodes, a bit each. Boxes that lie in one cell along an
    /// axis have a third node of weight 0 there, which does not count.
    #[inline(always)]
    pub(super) fn touched<const D: usize>(&self, weights: &Weights<D>, batch: &Batch) -> u32 {
        let class = |lane: usize| u64::from(self.classes[weights.base(lane)]) << (8 * lane);
        let classes = (0..LANES).fold(0, |classes, lane| classes | class(lane));
        let mut zeros = 0;
        for k in 0..D {
            zeros |= Lanes::load(&weights.axis[k].weight[2]).le(Lanes::splat(0.0)).bytes() << k;
        }
        let ones = u64::from_le_bytes([1; 8]);
        // A byte from 1 to 7 plus this has its highest bit set.
        let without = ((classes & zeros) + 0x7f * ones) >> 7;
        let touched = (classes / u64::from(HAS_BOXES)) & !without & ones;
        // Bit 8 i goes to bit 56 + i.
        batch.members_among((touched.wrapping_mul(0x0102_0408_1020_4080) >> 56) as u32)
    }

    /// Boxes of nodes of the stencil of a lane.
    #[inline(always)]
    fn of_lane<const D: usize>(&self, weights: &Weights<D>, lane: usize) -> &[NodeBox] {
        let base = weights.base(lane);
        &self.boxes[usize::from(self.start[base])..usize::from(self.start[base + 1])]
    }

    /// Adds the second moments of the constraints, `Σ w h²` over nodes with odd coordinates along each axis,
    /// of the lanes in `touched`, to the spread.
    #[inline(always)]
    pub(super) fn add_spread<const D: usize>(
        &self,
        weights: &Weights<D>,
        touched: u32,
        cell: f64,
        spread: &mut [[f64; LANES]; D],
    ) {
        for lane in lanes_in(touched) {
            for nodes in self.of_lane(weights, lane) {
                let (mut inside, mut odd) = ([0.0; D], [0.0; D]);
                for k in 0..D {
                    let along = &ALONG[usize::from(nodes[k]) % 16];
                    let w: [f64; 3] = std::array::from_fn(|i| weights.axis[k].weight[i][lane]);
                    let sum =
                        |of: &[f64; 3], w: [f64; 3]| w[2].mul_add(of[2], w[1].mul_add(of[1], w[0] * of[0]));
                    inside[k] = sum(&along.inside, w);
                    odd[k] = sum(&along.odd, [w[0], 2.0 * w[1], w[2]]);
                }
                for k in 0..D {
                    let others = (0..D).filter(|other| *other != k).map(|other| inside[other]);
                    spread[k][lane] += cell * cell * odd[k] * others.product::<f64>();
                }
            }
        }
    }

    /// Adds the affine momentum `C e_k m h` of a lane with the factors of hanging nodes, to the nodes from
    /// the first of its stencil on.
    #[inline(always)]
    pub(super) fn scatter<const D: usize>(
        &self,
        weights: &Weights<D>,
        lane: usize,
        affine: &[F64x4; D],
        nodes: &mut [Row],
    ) {
        for part in self.of_lane(weights, lane) {
            BoxFactors::new(weights, lane, part).scatter(affine, nodes);
        }
    }

    /// Additional part of B of a lane, divided by the edge of a cell: column by column. `nodes` begin with
    /// the first of the stencil.
    #[inline(always)]
    pub(super) fn gather<const D: usize>(
        &self,
        weights: &Weights<D>,
        lane: usize,
        nodes: &[Row],
    ) -> [F64x4; D] {
        let mut sums = [F64x4::splat(0.0); D];
        for part in self.of_lane(weights, lane) {
            BoxFactors::new(weights, lane, part).gather(nodes, &mut sums);
        }
        sums
    }
}

/// The different values of a sequence of three or fewer, and where each occurs, a bit for each place.
fn alike<T: Copy + PartialEq>(values: impl Iterator<Item = T>) -> impl Iterator<Item = (T, u8)> {
    let mut found: [Option<(T, u8)>; 3] = [None; 3];
    for (place, value) in values.enumerate() {
        for slot in &mut found {
            match slot {
                Some((known, places)) if *known == value => *places |= 1 << place,
                Some(_) => continue,
                None => *slot = Some((value, 1 << place)),
            }
            break;
        }
    }
    found.into_iter().flatten()
}

/// Factors of one particle for a box of nodes.
struct BoxFactors<const D: usize> {
    /// Weights, 0 outside the box.
    weight: [[F64x4; 3]; D],
    /// Factors that replace weight times (node - particle), in cells.
    arm: [[F64x4; 3]; D],
}

impl<const D: usize> BoxFactors<D> {
    /// For the box of nodes `nodes` in the stencil of a lane.
    #[inline(always)]
    fn new(weights: &Weights<D>, lane: usize, nodes: &NodeBox) -> Self {
        let zero = F64x4::splat(0.0);
        let mut factors = Self { weight: [[zero; 3]; D], arm: [[zero; 3]; D] };
        for k in 0..D {
            let along = &ALONG[usize::from(nodes[k]) % 16];
            let mut odd = [zero; 3];
            for i in 0..3 {
                let weight = F64x4::splat(weights.axis[k].weight[i][lane]);
                factors.weight[k][i] = weight * F64x4::splat(along.inside[i]);
                odd[i] = weight * F64x4::splat(along.odd[i]);
            }
            factors.arm[k] = [-(odd[0] + odd[1]), odd[0] - odd[2], odd[1] + odd[2]];
        }
        factors
    }

    /// Adds `Σ m C e_k` times weight and arm to the nodes, as P2G does with the usual factors.
    #[inline(always)]
    fn scatter(&self, affine: &[F64x4; D], nodes: &mut [Row]) {
        let mut along = self.arm;
        for k in 0..D {
            along[k] = along[k].map(|arm| arm * affine[k]);
        }
        let (x, y, z) = (&self.weight[0], &self.weight[1], &self.weight[D - 1]);
        add_products::<Lanes, D>(nodes, x, |b| y[b], |c| z[c], |b, c| y[b] * z[c], &along);
    }

    /// Adds the sums of nodes times weight and arm, as G2P forms B with the usual factors.
    #[inline(always)]
    fn gather(&self, nodes: &[Row], sums: &mut [F64x4; D]) {
        let (x, y, z) = (&self.weight[0], &self.weight[1], &self.weight[D - 1]);
        let pencil = pencils::<Lanes, D>(nodes, x, |b| y[b], |c| z[c], |b, c| y[b] * z[c]);
        for k in 0..D {
            sums[k] = sums[k] + dot(&self.arm[k], &pencil[k]);
        }
    }
}
