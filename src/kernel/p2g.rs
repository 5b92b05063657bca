//! Particles to grid: mass, affine momentum and the impulse of stress, scattered in one pass.
//!
//! Node j receives from particle p
//! ```text
//! mass      w m
//! momentum  w m (v + C (x_j - x_p)) - Δt V₀ τ ∇w
//! ```
//! The tensor product of the weights is factored: with rows q = m (v, 1), C_k = m C e_k,
//! T_k = -Δt V₀ τ e_k and d = x_j - x_p,
//! ```text
//! X_a = wx_a q + wx_a dx_a C_x + wx'_a T_x,  Y_b = wy_b dy_b C_y + wy'_b T_y,  Z_c alike
//! row = (wy_b wz_c) X_a + wx_a (wz_c Y_b + wy_b Z_c)
//! ```
use super::batch::Batch;
use super::simd::{F64x4, LANES, Lanes};
use super::stencil::Axis;
use super::{ARENA_EDGE, BASES, Frame, Row, Scheme, Select, SubBox, domain};
use crate::particle::chunk::{Chunk, Layout};

/// First moments `A = Σ w m C` of the nodes, gathered only from stencils that touch a constrained
/// node.
pub struct MomentSums<'a, const D: usize> {
    /// Whether a stencil touches a constrained node; index of [`super::stencil_bases`].
    pub touched: &'a [bool],
    /// Per arena node, row k is column k of A: `(A_xk, A_yk, A_zk, 0)`.
    pub sums: &'a mut [[Row; D]],
}

/// Adds the selected particles to the arena of their block: rows (momentum, mass).
///
/// `dt` is the step that turns internal forces into impulses; each particle's box must lie within
/// the arena, which holds when its centre lies in the block.
pub fn scatter<const D: usize>(
    chunk: &Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    dt: f64,
    arena: &mut [Row],
) {
    scatter_all(chunk, select, frame, scheme, dt, arena, None);
}

/// As [`scatter`], and adds first moments where a stencil touches a constrained node.
pub fn scatter_with_moments<const D: usize>(
    chunk: &Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    dt: f64,
    arena: &mut [Row],
    moments: MomentSums<D>,
) {
    scatter_all(chunk, select, frame, scheme, dt, arena, Some(moments));
}

/// Adds parts of boxes to the arena of their block; the affine term is relative to the particle.
pub fn scatter_sub_boxes<const D: usize>(
    chunk: &Chunk<D>,
    parts: &[SubBox<D>],
    frame: &Frame<D>,
    dt: f64,
    arena: &mut [Row],
    mut moments: Option<MomentSums<D>>,
) {
    let (reals, stride) = chunk.reals();
    for parts in parts.chunks(LANES) {
        let batch = Batch::from_indices(parts, |part| part.particle);
        let part = |lane: usize| &parts[lane.min(parts.len() - 1)];
        let lanes = |f: &dyn Fn(&SubBox<D>) -> f64| Lanes::new(std::array::from_fn(|lane| f(part(lane))));
        let centre = std::array::from_fn(|axis| lanes(&|part| part.centre[axis]));
        let half = std::array::from_fn(|axis| lanes(&|part| part.half[axis]));
        let position = std::array::from_fn(|axis| batch.load(reals, stride, Layout::<D>::POSITION + axis));
        let share = Some(lanes(&|part| part.fraction));
        let prepared = Prepared::new(reals, stride, &batch, frame, dt, &position, &centre, &half, share);
        prepared.add(batch.count, arena, moments.as_mut());
    }
}

#[inline(always)]
fn scatter_all<const D: usize>(
    chunk: &Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    dt: f64,
    arena: &mut [Row],
    mut moments: Option<MomentSums<D>>,
) {
    let (reals, stride) = chunk.reals();
    for i in 0..Batch::number(&select, chunk.len()) {
        let batch = Batch::of(&select, chunk.len(), i);
        let position: [Lanes; D] =
            std::array::from_fn(|axis| batch.load(reals, stride, Layout::<D>::POSITION + axis));
        let half = domain::of_batch(
            reals,
            stride,
            chunk.tags(),
            &batch,
            &position,
            frame.cell,
            0.5 * frame.cell,
            &frame.extent,
            scheme,
        );
        let prepared = Prepared::new(reals, stride, &batch, frame, dt, &position, &position, &half, None);
        prepared.add(batch.count, arena, moments.as_mut());
    }
}

/// Factors of one axis for the lanes of a batch.
#[derive(Clone, Copy)]
struct Factors {
    weight: [[f64; LANES]; 3],
    /// Weight times (node - particle).
    arm: [[f64; LANES]; 3],
    slope: [[f64; LANES]; 3],
}

/// A batch ready to be added to nodes: scalars by lane, rows by particle.
struct Prepared<const D: usize> {
    base: [[f64; LANES]; D],
    axis: [Factors; D],
    /// Products of y and z weights.
    product: [[[f64; LANES]; 3]; 3],
    momentum: [F64x4; LANES],
    affine: [[F64x4; LANES]; D],
    impulse: [[F64x4; LANES]; D],
}

impl<const D: usize> Prepared<D> {
    #[inline(always)]
    fn new(
        reals: &[f64],
        stride: usize,
        batch: &Batch,
        frame: &Frame<D>,
        dt: f64,
        position: &[Lanes; D],
        centre: &[Lanes; D],
        half: &[Lanes; D],
        share: Option<Lanes>,
    ) -> Self {
        let zero = Lanes::splat(0.0);
        let load = |column: usize| batch.load(reals, stride, column);
        let inverse = 1.0 / frame.cell;
        let local = |x: Lanes, axis: usize| (x - Lanes::splat(frame.corner[axis])) * inverse;
        let axes: [Axis; D] =
            std::array::from_fn(|k| Axis::new(local(centre[k], k), half[k] * inverse, inverse));
        let axis = std::array::from_fn(|k| {
            let offset = axes[k].offsets(local(position[k], k), frame.cell);
            Factors {
                weight: axes[k].weight.map(Lanes::to_array),
                arm: std::array::from_fn(|i| (axes[k].weight[i] * offset[i]).to_array()),
                slope: axes[k].slope.map(Lanes::to_array),
            }
        });
        let product = std::array::from_fn(|b| {
            std::array::from_fn(|c| {
                if D == 3 { (axes[1].weight[b] * axes[2].weight[c]).to_array() } else { [0.0; LANES] }
            })
        });
        let mut mass = load(Layout::<D>::MASS);
        let width = load(Layout::<D>::HALF) * 2.0;
        let mut volume = (0..D).fold(Lanes::splat(-dt), |product, _| product * width);
        if let Some(share) = share {
            (mass, volume) = (mass * share, volume * share);
        }
        let row = |column: &dyn Fn(usize) -> Lanes, factor: Lanes, last: Lanes| {
            let z = if D == 3 { column(2) * factor } else { zero };
            Lanes::rows([column(0) * factor, column(1) * factor, z, last])
        };
        Self {
            base: std::array::from_fn(|k| axes[k].base.to_array()),
            axis,
            product,
            momentum: row(&|i| load(Layout::<D>::VELOCITY + i), mass, mass),
            affine: std::array::from_fn(|k| row(&|i| load(Layout::<D>::AFFINE + D * i + k), mass, zero)),
            impulse: std::array::from_fn(|k| {
                row(&|i| load(Layout::<D>::STRESS + super::symmetric_index::<D>(i, k)), volume, zero)
            }),
        }
    }

    /// Adds the first `count` lanes in order.
    #[inline(always)]
    fn add(&self, count: usize, arena: &mut [Row], mut moments: Option<&mut MomentSums<D>>) {
        let span = super::stencil_span(D);
        for lane in 0..count.min(LANES) {
            let first = self.first(lane, ARENA_EDGE);
            self.add_one(lane, &mut arena[first..first + span]);
            if let Some(moments) = moments.as_deref_mut()
                && moments.touched[self.first(lane, BASES)]
            {
                self.add_moments(lane, &mut moments.sums[first..first + span]);
            }
        }
    }

    /// Index of the lowest node of a stencil in a cube with `edge` nodes per axis, from node -1 on.
    #[inline(always)]
    fn first(&self, lane: usize, edge: usize) -> usize {
        (0..D).rev().fold(0, |index, k| index * edge + (self.base[k][lane] + 1.0) as usize)
    }

    #[inline(always)]
    fn add_one(&self, lane: usize, nodes: &mut [Row]) {
        let nodes = &mut nodes[..super::stencil_span(D)];
        let of = |values: &[f64; LANES]| F64x4::splat(values[lane]);
        let momentum = self.momentum[lane];
        let x = &self.axis[0];
        let (affine, impulse) = (self.affine[0][lane], self.impulse[0][lane]);
        let along_x: [F64x4; 3] = std::array::from_fn(|a| {
            let sum = of(&x.slope[a]).mul_add(impulse, of(&x.arm[a]) * affine);
            of(&x.weight[a]).mul_add(momentum, sum)
        });
        let along = |k: usize| -> [F64x4; 3] {
            let (axis, affine, impulse) = (&self.axis[k], self.affine[k][lane], self.impulse[k][lane]);
            std::array::from_fn(|i| of(&axis.slope[i]).mul_add(impulse, of(&axis.arm[i]) * affine))
        };
        let along_y = along(1);
        let weight_x: [F64x4; 3] = std::array::from_fn(|a| of(&x.weight[a]));
        let y = &self.axis[1];
        if D == 2 {
            for b in 0..3 {
                let weight = of(&y.weight[b]);
                for a in 0..3 {
                    let node = &mut nodes[a + ARENA_EDGE * b].0;
                    let sum = weight.mul_add(along_x[a], F64x4::new(*node));
                    *node = weight_x[a].mul_add(along_y[b], sum).to_array();
                }
            }
            return;
        }
        let along_z = along(D - 1);
        let z = &self.axis[D - 1];
        for c in 0..3 {
            let weight_z = of(&z.weight[c]);
            for b in 0..3 {
                let other = weight_z.mul_add(along_y[b], of(&y.weight[b]) * along_z[c]);
                let product = of(&self.product[b][c]);
                for a in 0..3 {
                    let node = &mut nodes[a + ARENA_EDGE * (b + ARENA_EDGE * c)].0;
                    let sum = product.mul_add(along_x[a], F64x4::new(*node));
                    *node = weight_x[a].mul_add(other, sum).to_array();
                }
            }
        }
    }

    fn add_moments(&self, lane: usize, nodes: &mut [[Row; D]]) {
        let affine: [F64x4; D] = std::array::from_fn(|k| self.affine[k][lane]);
        super::for_each_node::<D>(|node, index| {
            let weight = (0..D).fold(1.0, |weight, k| weight * self.axis[k].weight[index[k]][lane]);
            for k in 0..D {
                let sum = &mut nodes[node][k].0;
                *sum = F64x4::splat(weight).mul_add(affine[k], F64x4::new(*sum)).to_array();
            }
        });
    }
}
