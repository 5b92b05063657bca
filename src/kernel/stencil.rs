//! GIMP weights of one axis (Bardenhagen & Kober 2004) for boxes at most one cell wide.
//!
//! The weight of a node is the average over the box of the node's hat function, the gradient the
//! average of its derivative. A box `[lo, hi]` in cell units, `lo` in the cell of the lowest node,
//! covers `a` of that cell and `b` of the next; integrating the hats over the two parts gives
//! ```text
//! w0 = a (1 - (lo + m)/2) / V        dw0 = -a / (V h)
//! w1 = (a (lo + m)/2 + b (1 - b/2)) / V    dw1 = (a - b) / (V h)
//! w2 = b² / (2 V)                    dw2 = b / (V h)
//! ```
//! with `m = min(hi, 1)`, `a = m - lo`, `b = max(hi - 1, 0)`, `V = a + b`.
use super::BLOCK;
use super::simd::Lanes;

/// Three nodes of one axis for a batch of boxes.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    /// Lowest node of the stencil, counted from the corner of the block: an integer in -1..=3.
    pub base: Lanes,
    /// Weights.
    pub weight: [Lanes; 3],
    /// Derivatives of the weights, 1/m.
    pub slope: [Lanes; 3],
}

impl Axis {
    /// Weights of boxes centred at `centre` with half width `half`, both in cells and relative to the
    /// corner of the block. `half` is at most 1/2 and the centre lies in the block. `inverse_cell` is
    /// 1 / cell edge, 1/m.
    #[inline(always)]
    pub fn new(centre: Lanes, half: Lanes, inverse_cell: f64) -> Self {
        let zero = Lanes::splat(0.0);
        let one = Lanes::splat(1.0);
        let lower = centre - half;
        // The bounds matter only for centres that round to the upper face of the block.
        let base = lower.floor().max(Lanes::splat(-1.0)).min(Lanes::splat(BLOCK as f64 - 1.0));
        let low = lower - base;
        let high = half.mul_add(Lanes::splat(2.0), low);
        let middle = high.min(one);
        let a = (middle - low).max(zero);
        let b = (high - one).max(zero);
        let volume_inverse = one / (a + b);
        let a_share = a * volume_inverse;
        let b_share = b * volume_inverse;
        let mean = (low + middle) * 0.5;
        let half_b = b * 0.5;
        let weight =
            [a_share * (one - mean), a_share.mul_add(mean, b_share * (one - half_b)), b_share * half_b];
        let (a_slope, b_slope) = (a_share * inverse_cell, b_share * inverse_cell);
        Self { base, weight, slope: [-a_slope, a_slope - b_slope, b_slope] }
    }

    /// Node minus particle, m, for a particle at `position` cells from the corner of the block.
    #[inline(always)]
    pub fn offsets(&self, position: Lanes, cell: f64) -> [Lanes; 3] {
        let first = self.base - position;
        std::array::from_fn(|i| (first + Lanes::splat(i as f64)) * cell)
    }
}
