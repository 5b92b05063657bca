//! Sums that particles gather from the nodes of their stencils; see [the gather](super).
use crate::kernel::batch::{Batch, lanes_in};
use crate::kernel::constrained_nodes::ConstrainedNodes;
use crate::kernel::hanging::HangingNodes;
use crate::kernel::weights::{NodeWeights, Weights, dot, pencils};
use crate::kernel::{ARENA_EDGE, Row, stencil_span};
use crate::simd::{F64x4, LANES, Vector};

/// Constrained nodes of an arena, and first moments of those that have them.
#[derive(Clone, Copy)]
pub struct Moments<'a> {
    /// Hanging nodes, and nodes with moments.
    pub nodes: &'a ConstrainedNodes,
    /// By node, one row for each axis; row k is column k of V: `(V_xk, V_yk, V_zk, unused)`.
    pub first: &'a [Row],
}

/// Values at the nodes of an arena that particles gather.
#[derive(Clone, Copy)]
pub struct Fields<'a> {
    /// Velocities after the update, `(vx, vy, vz, unused)`; finite also at nodes without mass.
    pub velocity: &'a [Row],
    /// With [`crate::kernel::Transfer::Flip`] the changes of velocity in this step; with
    /// [`crate::kernel::Transfer::Xpic`] the velocities that particles take on.
    pub increment: Option<&'a [Row]>,
    /// How full nodes are (see [`super::fill`]), with [`FILL_MORE`] values behind the last; where there are
    /// fluids.
    pub fill: Option<&'a [f64]>,
    /// Where the block touches constrained nodes.
    pub moments: Option<Moments<'a>>,
}

/// Values behind those of the nodes of an arena, since they are read four at a time.
pub const FILL_MORE: usize = 1;

/// Sums over the stencils of one particle. Additive: a box in parts is the sum of its parts.
#[derive(Clone, Copy, Debug)]
pub struct Gathered<const D: usize> {
    /// `Σ w v_j`.
    velocity: F64x4,
    /// Column k is `Σ v_j ∂w/∂x_k`.
    gradient: [F64x4; D],
    /// Column k is `Σ w (v_j d_k + V_j,k)`.
    affine: [F64x4; D],
    /// `Σ w Δv_j`.
    increment: F64x4,
    /// `Σ e_j ∂w/∂x_k`, then `Σ w φ_j`.
    fill: F64x4,
    /// In axisymmetry the plain mean of the velocity over the box, then the rate of strain along the hoop.
    plain: F64x4,
}

impl<const D: usize> Default for Gathered<D> {
    fn default() -> Self {
        let zero = F64x4::splat(0.0);
        let all = [zero; D];
        Self { velocity: zero, gradient: all, affine: all, increment: zero, fill: zero, plain: zero }
    }
}

impl<const D: usize> Gathered<D> {
    /// Rate of strain along the hoop, 1/s; 0 but in axisymmetry.
    pub fn hoop(&self) -> f64 {
        let [.., hoop, _] = self.plain.to_array();
        hoop
    }

    /// Velocity, m/s.
    pub fn velocity(&self) -> [f64; D] {
        let row = self.velocity.to_array();
        std::array::from_fn(|axis| row[axis])
    }

    /// Velocity gradient, 1/s.
    pub fn gradient(&self) -> [[f64; D]; D] {
        let columns = self.gradient.map(F64x4::to_array);
        std::array::from_fn(|i| std::array::from_fn(|k| columns[k][i]))
    }

    /// Affine sums `Σ w v_j ⊗ (x_j - x)`, m²/s.
    pub fn affine(&self) -> [[f64; D]; D] {
        let columns = self.affine.map(F64x4::to_array);
        std::array::from_fn(|i| std::array::from_fn(|k| columns[k][i]))
    }

    /// Adds `share` times `other`.
    pub(super) fn add(&mut self, other: &Self, share: f64) {
        let share = F64x4::splat(share);
        let add = |to: &mut F64x4, from: F64x4| *to = from.mul_add(share, *to);
        add(&mut self.velocity, other.velocity);
        add(&mut self.increment, other.increment);
        add(&mut self.fill, other.fill);
        add(&mut self.plain, other.plain);
        for k in 0..D {
            add(&mut self.gradient[k], other.gradient[k]);
            add(&mut self.affine[k], other.affine[k]);
        }
    }
}

/// [`Gathered`] of a batch, one row per lane. Made once and filled for batch after batch; lanes that a batch
/// does not fill keep earlier values, which are valid.
#[repr(align(64))]
pub(super) struct Sums<const D: usize> {
    pub velocity: [F64x4; LANES],
    pub gradient: [[F64x4; LANES]; D],
    pub affine: [[F64x4; LANES]; D],
    pub increment: [F64x4; LANES],
    pub fill: [F64x4; LANES],
    pub plain: [F64x4; LANES],
}

impl<const D: usize> Sums<D> {
    pub(super) fn new() -> Self {
        let zero = [F64x4::splat(0.0); LANES];
        let all = [zero; D];
        Self { velocity: zero, gradient: all, affine: all, increment: zero, fill: zero, plain: zero }
    }

    pub(super) fn row(&self, lane: usize) -> Gathered<D> {
        Gathered {
            velocity: self.velocity[lane],
            gradient: std::array::from_fn(|k| self.gradient[k][lane]),
            affine: std::array::from_fn(|k| self.affine[k][lane]),
            increment: self.increment[lane],
            fill: self.fill[lane],
            plain: self.plain[lane],
        }
    }

    pub(super) fn set(&mut self, lane: usize, row: &Gathered<D>) {
        self.velocity[lane] = row.velocity;
        self.increment[lane] = row.increment;
        self.fill[lane] = row.fill;
        self.plain[lane] = row.plain;
        for k in 0..D {
            self.gradient[k][lane] = row.gradient[k];
            self.affine[k][lane] = row.affine[k];
        }
    }

    /// Sums of all fields for the members of a batch, in blocks with cells of edge `cell`; `nodes` is used
    /// where fields have moments.
    #[inline(always)]
    pub(super) fn gather<V: Vector>(
        &mut self,
        weights: &Weights<D>,
        nodes: &mut NodeWeights,
        batch: &Batch,
        cell: f64,
        fields: &Fields,
    ) {
        let span = stencil_span(D);
        for lane in batch.members() {
            let first = weights.first(lane);
            self.contract::<V>(weights, lane, &fields.velocity[first..first + span]);
        }
        if weights.is_ring {
            self.add_plain(weights, batch, fields.velocity);
        }
        if let Some(increment) = fields.increment {
            for lane in batch.members() {
                self.increment[lane] = mean(weights, lane, &increment[weights.first(lane)..]);
            }
        }
        if let Some(fill) = fields.fill {
            for lane in batch.members() {
                let first = weights.first(lane);
                self.contract_fill::<V>(weights, lane, &fill[first..first + span + FILL_MORE]);
            }
        }
        if let Some(moments) = &fields.moments {
            let hanging = &moments.nodes.hanging;
            let touched = hanging.touched(weights, batch);
            if touched != 0 {
                self.add_hanging(weights, hanging, touched, cell, fields.velocity);
            }
            let touched = moments.nodes.prepare(weights, nodes, batch);
            if touched != 0 {
                self.add_moments(weights, nodes, touched, moments);
            }
        }
    }

    /// Plain means of the velocity over sections of rings, and from them the rates along the hoop,
    /// `L_θθ = Σ v_r T`.
    #[inline(never)]
    fn add_plain(&mut self, weights: &Weights<D>, batch: &Batch, velocity: &[Row]) {
        for lane in batch.members() {
            let nodes = &velocity[weights.first(lane)..];
            let mut sum = F64x4::splat(0.0);
            for (b, weight) in weights.axis[1].weight.iter().enumerate() {
                for (a, plain) in weights.ring.plain.iter().enumerate() {
                    let row = F64x4::new(nodes[a + ARENA_EDGE * b].0);
                    sum = F64x4::splat(plain[lane] * weight[lane]).mul_add(row, sum);
                }
            }
            let [radial, axial, ..] = sum.to_array();
            self.plain[lane] = F64x4::new([radial, axial, radial * weights.ring.hoop[lane], 0.0]);
        }
    }

    /// Fullness, and the gradient of the excess: one value for each node, three nodes along x together.
    #[inline(always)]
    fn contract_fill<V: Vector>(&mut self, weights: &Weights<D>, lane: usize, nodes: &[f64]) {
        let nodes = &nodes[..stencil_span(D) + FILL_MORE];
        let zero = F64x4::splat(0.0);
        let of = |values: &[f64; LANES]| F64x4::splat(values[lane]);
        let (x, y, z) = (&weights.axis[0], &weights.axis[1], &weights.axis[D - 1]);
        let (mut fill, mut over, mut along_y, mut along_z) = (zero, zero, zero, zero);
        for c in 0..if D == 3 { 3 } else { 1 } {
            V::keep_wide();
            for b in 0..3 {
                let at = ARENA_EDGE * (b + ARENA_EDGE * c);
                let row = F64x4::new([nodes[at], nodes[at + 1], nodes[at + 2], nodes[at + 3]]);
                let excess = (row - F64x4::splat(1.0)).max(zero);
                let weight = if D == 3 { of(&weights.product[b][c]) } else { of(&y.weight[b]) };
                fill = weight.mul_add(row, fill);
                over = weight.mul_add(excess, over);
                if D == 3 {
                    along_y = (of(&y.slope[b]) * of(&z.weight[c])).mul_add(excess, along_y);
                    along_z = (of(&y.weight[b]) * of(&z.slope[c])).mul_add(excess, along_z);
                } else {
                    along_y = of(&y.slope[b]).mul_add(excess, along_y);
                }
            }
        }
        let along_x = |of: &[[f64; LANES]; 3]| F64x4::new([of[0][lane], of[1][lane], of[2][lane], 0.0]);
        let (weight, slope) = (along_x(&x.weight), along_x(&x.slope));
        let [first, second, third, _] =
            F64x4::transpose([over * slope, along_y * weight, along_z * weight, fill * weight]);
        self.fill[lane] = first + second + third;
    }

    #[inline(never)]
    fn add_hanging(
        &mut self,
        weights: &Weights<D>,
        hanging: &HangingNodes,
        touched: u32,
        cell: f64,
        velocity: &[Row],
    ) {
        let span = stencil_span(D);
        for lane in lanes_in(touched) {
            let first = weights.first(lane);
            let sums = hanging.gather(weights, lane, &velocity[first..first + span]);
            for k in 0..D {
                self.affine[k][lane] = sums[k].mul_add(F64x4::splat(cell), self.affine[k][lane]);
            }
        }
    }

    #[inline(never)]
    fn add_moments(&mut self, weights: &Weights<D>, nodes: &NodeWeights, touched: u32, moments: &Moments) {
        for lane in lanes_in(touched) {
            let mut sums = [F64x4::splat(0.0); D];
            moments.nodes.for_each(weights, nodes, lane, |row, axis, weight| {
                sums[axis] = F64x4::splat(weight).mul_add(F64x4::new(moments.first[row].0), sums[axis]);
            });
            for axis in 0..D {
                self.affine[axis][lane] = self.affine[axis][lane] + sums[axis];
            }
        }
    }

    /// Velocity, gradient and affine sums.
    ///
    /// Each needs the nodes averaged over all axes but one; see [`pencils`].
    #[inline(always)]
    fn contract<V: Vector>(&mut self, weights: &Weights<D>, lane: usize, nodes: &[Row]) {
        let of = |values: &[f64; LANES]| F64x4::splat(values[lane]);
        let all = |factors: &[[f64; LANES]; 3]| [of(&factors[0]), of(&factors[1]), of(&factors[2])];
        let (x, y, z) = (&weights.axis[0], &weights.axis[1], &weights.axis[D - 1]);
        let pencil = pencils::<V, D>(
            nodes,
            &all(&x.weight),
            |b| of(&y.weight[b]),
            |c| of(&z.weight[c]),
            |b, c| of(&weights.product[b][c]),
        );
        self.velocity[lane] = dot(&all(&x.weight), &pencil[0]);
        for k in 0..D {
            self.affine[k][lane] = dot(&all(&weights.axis[k].arm), &pencil[k]);
            self.gradient[k][lane] = dot(&all(&weights.axis[k].slope), &pencil[k]);
        }
    }
}

/// `Σ w f_j` over the nodes from the first of the stencil on.
pub(super) fn mean<const D: usize>(weights: &Weights<D>, lane: usize, nodes: &[Row]) -> F64x4 {
    let nodes = &nodes[..stencil_span(D)];
    let mut sum = F64x4::splat(0.0);
    weights.for_each_node(lane, |node, weight| sum = weight.mul_add(F64x4::new(nodes[node].0), sum));
    sum
}
