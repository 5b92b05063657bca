//! Grid to particles: velocity, its gradient and the affine matrix, then the advance of particles.
//!
//! With d = x_j - x_p, a particle gathers
//! ```text
//! v = Σ w v_j,  ∇v = Σ v_j ⊗ ∇w,  B = Σ w (v_j ⊗ d + V_j),  D_k = Σ w (d_k² + S_j,k)
//! ```
//! axis by axis, where V and S are the first and second moments that constrained nodes inherit (zero
//! on real nodes). Then `C = B D⁻¹` (APIC, Jiang et al. 2015), `x += Δt v`,
//! `b = (1 + Δt ∇v) b (1 + Δt ∇v)ᵀ`, and the material maps b back and gives the stress.
use super::batch::Batch;
use super::simd::{F64x4, LANES, Lanes};
use super::stencil::Axis;
use super::{ARENA_EDGE, BASES, Frame, Row, Scheme, Select, SubBox, Transfer, domain};
use crate::material::{self, State};
use crate::particle::chunk::{Chunk, Layout};

/// Moments of the arena's nodes at level jumps.
#[derive(Clone, Copy)]
pub struct Moments<'a, const D: usize> {
    /// Whether a stencil touches a constrained node; index of [`super::stencil_bases`].
    pub touched: &'a [bool],
    /// First moments V: row k of a node is column k, `(V_xk, V_yk, V_zk, unused)`.
    pub first: &'a [[Row; D]],
    /// Second moments S: `(S_x, S_y, S_z, unused)`.
    pub second: &'a [Row],
}

/// What the nodes of an arena offer.
#[derive(Clone, Copy)]
pub struct Fields<'a, const D: usize> {
    /// Velocities after the update, `(vx, vy, vz, unused)`; finite also at nodes without mass.
    pub velocity: &'a [Row],
    /// Changes of velocity in this step; needed for [`Transfer::Flip`].
    pub increment: Option<&'a [Row]>,
    /// Moments, where the block touches constrained nodes.
    pub moments: Option<Moments<'a, D>>,
}

/// Sums over the stencils of one particle. Additive: a box in parts is the sum of its parts.
#[derive(Clone, Copy, Debug)]
pub struct Gathered<const D: usize> {
    /// `Σ w v_j`.
    velocity: F64x4,
    /// Column k is `Σ v_j ∂w/∂x_k`.
    gradient: [F64x4; D],
    /// Column k is `Σ w (v_j d_k + V_j,k)`.
    affine: [F64x4; D],
    /// `Σ w (d_k² + S_j,k)` in lane k.
    spread: F64x4,
    /// `Σ w Δv_j`.
    increment: F64x4,
}

impl<const D: usize> Default for Gathered<D> {
    fn default() -> Self {
        let zero = F64x4::splat(0.0);
        Self { velocity: zero, gradient: [zero; D], affine: [zero; D], spread: zero, increment: zero }
    }
}

impl<const D: usize> Gathered<D> {
    /// Adds `share` times `other`.
    fn add(&mut self, other: &Self, share: f64) {
        let share = F64x4::splat(share);
        let add = |to: &mut F64x4, from: F64x4| *to = from.mul_add(share, *to);
        add(&mut self.velocity, other.velocity);
        add(&mut self.spread, other.spread);
        add(&mut self.increment, other.increment);
        for k in 0..D {
            add(&mut self.gradient[k], other.gradient[k]);
            add(&mut self.affine[k], other.affine[k]);
        }
    }
}

/// Gathers for the selected particles and advances them by `dt`. Returns the greatest sum of wave
/// speed and particle speed, m/s, for the time step; infinite if any is not finite.
pub fn gather<const D: usize>(
    chunk: &mut Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    dt: f64,
    fields: &Fields<D>,
) -> f64 {
    let len = chunk.len();
    let (reals, stride, tags) = chunk.reals_mut_and_tags();
    let mut greatest = Lanes::splat(0.0);
    for i in 0..Batch::number(&select, len) {
        let batch = Batch::of(&select, len, i);
        let position: [Lanes; D] =
            std::array::from_fn(|axis| batch.load(reals, stride, Layout::<D>::POSITION + axis));
        let cap = 0.5 * frame.cell;
        let half =
            domain::of_batch(reals, stride, tags, &batch, &position, frame.cell, cap, &frame.extent, scheme);
        let weights = Weights::new(frame, &position, &position, &half);
        let gathered = weights.gather_batch(batch.count, fields);
        greatest = advance(reals, stride, tags, &batch, &position, &gathered, scheme, dt).max(greatest);
    }
    largest(greatest)
}

/// Gathers for parts of boxes and adds each to `gathered[part.slot]`; [`advance_gathered`] follows
/// when all parts of a particle have been added.
pub fn gather_sub_boxes<const D: usize>(
    chunk: &Chunk<D>,
    parts: &[SubBox<D>],
    frame: &Frame<D>,
    fields: &Fields<D>,
    gathered: &mut [Gathered<D>],
) {
    let (reals, stride) = chunk.reals();
    for parts in parts.chunks(LANES) {
        let batch = Batch::from_indices(parts, |part| part.particle);
        let part = |lane: usize| &parts[lane.min(parts.len() - 1)];
        let lanes = |f: &dyn Fn(&SubBox<D>) -> f64| Lanes::new(std::array::from_fn(|lane| f(part(lane))));
        let centre = std::array::from_fn(|axis| lanes(&|part| part.centre[axis]));
        let half = std::array::from_fn(|axis| lanes(&|part| part.half[axis]));
        let position = std::array::from_fn(|axis| batch.load(reals, stride, Layout::<D>::POSITION + axis));
        let weights = Weights::new(frame, &position, &centre, &half);
        let spread = weights.spread_rows();
        for (lane, part) in parts.iter().enumerate() {
            let mut one = weights.gather_one(lane, fields);
            one.spread = one.spread + spread[lane];
            gathered[part.slot as usize].add(&one, part.fraction);
        }
    }
}

/// Advances the particles of a list by `dt` with what they gathered. Returns as [`gather`].
pub fn advance_gathered<const D: usize>(
    chunk: &mut Chunk<D>,
    particles: &[u32],
    gathered: &[Gathered<D>],
    scheme: &Scheme,
    dt: f64,
) -> f64 {
    let (reals, stride, tags) = chunk.reals_mut_and_tags();
    let mut greatest = Lanes::splat(0.0);
    for (particles, gathered) in particles.chunks(LANES).zip(gathered.chunks(LANES)) {
        let batch = Batch::from_indices(particles, |&p| p);
        let position: [Lanes; D] =
            std::array::from_fn(|axis| batch.load(reals, stride, Layout::<D>::POSITION + axis));
        let of = |lane: usize| &gathered[lane.min(gathered.len() - 1)];
        let lanes = GatheredLanes::from_rows(&of);
        greatest = advance(reals, stride, tags, &batch, &position, &lanes, scheme, dt).max(greatest);
    }
    largest(greatest)
}

fn largest(lanes: Lanes) -> f64 {
    lanes.to_array().into_iter().fold(0.0, f64::max)
}

/// Factors of one axis for the lanes of a batch.
#[derive(Clone, Copy)]
struct Factors {
    weight: [[f64; LANES]; 3],
    /// Weight times (node - particle).
    arm: [[f64; LANES]; 3],
    slope: [[f64; LANES]; 3],
}

/// Stencils of a batch: scalars by lane.
struct Weights<const D: usize> {
    base: [[f64; LANES]; D],
    axis: [Factors; D],
    /// `Σ w d_k²` over the nodes.
    spread: [Lanes; D],
}

impl<const D: usize> Weights<D> {
    #[inline(always)]
    fn new(frame: &Frame<D>, position: &[Lanes; D], centre: &[Lanes; D], half: &[Lanes; D]) -> Self {
        let inverse = 1.0 / frame.cell;
        let local = |x: Lanes, axis: usize| (x - Lanes::splat(frame.corner[axis])) * inverse;
        let mut spread = [Lanes::splat(0.0); D];
        let mut base = [[0.0; LANES]; D];
        let axis = std::array::from_fn(|k| {
            let axis = Axis::new(local(centre[k], k), half[k] * inverse, inverse);
            let offset = axis.offsets(local(position[k], k), frame.cell);
            let arm: [Lanes; 3] = std::array::from_fn(|i| axis.weight[i] * offset[i]);
            spread[k] = arm[0].mul_add(offset[0], arm[1].mul_add(offset[1], arm[2] * offset[2]));
            base[k] = axis.base.to_array();
            Factors {
                weight: axis.weight.map(Lanes::to_array),
                arm: arm.map(Lanes::to_array),
                slope: axis.slope.map(Lanes::to_array),
            }
        });
        Self { base, axis, spread }
    }

    /// Index of the lowest node of a stencil in a cube with `edge` nodes per axis, from node -1 on.
    #[inline(always)]
    fn first(&self, lane: usize, edge: usize) -> usize {
        (0..D).rev().fold(0, |index, k| index * edge + (self.base[k][lane] + 1.0) as usize)
    }

    fn spread_rows(&self) -> [F64x4; LANES] {
        let zero = Lanes::splat(0.0);
        Lanes::rows(std::array::from_fn(|k| if k < D { self.spread[k] } else { zero }))
    }

    /// All lanes; those beyond `count` stay zero.
    #[inline(always)]
    fn gather_batch(&self, count: usize, fields: &Fields<D>) -> GatheredLanes<D> {
        let mut rows = [Gathered::default(); LANES];
        if fields.increment.is_none() && fields.moments.is_none() {
            let span = super::stencil_span(D);
            for (lane, row) in rows.iter_mut().enumerate().take(count) {
                let first = self.first(lane, ARENA_EDGE);
                self.contract(lane, &fields.velocity[first..first + span], row);
            }
        } else {
            for (lane, row) in rows.iter_mut().enumerate().take(count) {
                *row = self.gather_one(lane, fields);
            }
        }
        let mut lanes = GatheredLanes::from_rows(&|lane| &rows[lane]);
        for k in 0..D {
            lanes.spread[k] = lanes.spread[k] + self.spread[k];
        }
        lanes
    }

    /// One lane, with all that the fields offer; the spread holds second moments only.
    #[inline(always)]
    fn gather_one(&self, lane: usize, fields: &Fields<D>) -> Gathered<D> {
        let span = super::stencil_span(D);
        let first = self.first(lane, ARENA_EDGE);
        let mut sum = Gathered::default();
        self.contract(lane, &fields.velocity[first..first + span], &mut sum);
        if let Some(increment) = fields.increment {
            sum.increment = self.mean(lane, |node| increment[first + node]);
        }
        if let Some(moments) = &fields.moments
            && moments.touched[self.first(lane, BASES)]
        {
            sum.spread = self.mean(lane, |node| moments.second[first + node]);
            for k in 0..D {
                sum.affine[k] = sum.affine[k] + self.mean(lane, |node| moments.first[first + node][k]);
            }
        }
        sum
    }

    /// `Σ w f_j`.
    fn mean(&self, lane: usize, f: impl Fn(usize) -> Row) -> F64x4 {
        let mut sum = F64x4::splat(0.0);
        super::for_each_node::<D>(|node, index| {
            let weight = (0..D).fold(1.0, |weight, k| weight * self.axis[k].weight[index[k]][lane]);
            sum = F64x4::splat(weight).mul_add(F64x4::new(f(node).0), sum);
        });
        sum
    }

    /// Velocity, gradient and affine sums: x first, then y, then z.
    #[inline(always)]
    fn contract(&self, lane: usize, nodes: &[Row], out: &mut Gathered<D>) {
        let nodes = &nodes[..super::stencil_span(D)];
        let of = |values: &[[f64; LANES]; 3]| -> [F64x4; 3] {
            std::array::from_fn(|i| F64x4::splat(values[i][lane]))
        };
        let dot = |factor: &[F64x4; 3], value: &[F64x4; 3]| {
            factor[2].mul_add(value[2], factor[1].mul_add(value[1], factor[0] * value[0]))
        };
        let [weight, arm, slope] = [of(&self.axis[0].weight), of(&self.axis[0].arm), of(&self.axis[0].slope)];
        let y = &self.axis[1];
        let [weight_y, arm_y, slope_y] = [of(&y.weight), of(&y.arm), of(&y.slope)];
        // Of one plane z: mean, then the arms along x and y, then the slopes along x and y.
        let plane = |c: usize| -> [F64x4; 5] {
            let mut mean = [F64x4::splat(0.0); 3];
            let mut arms = mean;
            let mut slopes = mean;
            for b in 0..3 {
                let row: [F64x4; 3] =
                    std::array::from_fn(|a| F64x4::new(nodes[a + ARENA_EDGE * (b + ARENA_EDGE * c)].0));
                mean[b] = dot(&weight, &row);
                arms[b] = dot(&arm, &row);
                slopes[b] = dot(&slope, &row);
            }
            [
                dot(&weight_y, &mean),
                dot(&weight_y, &arms),
                dot(&arm_y, &mean),
                dot(&weight_y, &slopes),
                dot(&slope_y, &mean),
            ]
        };
        if D == 2 {
            let [mean, arm_x, arm_y, slope_x, slope_y] = plane(0);
            out.velocity = mean;
            (out.affine[0], out.affine[1]) = (arm_x, arm_y);
            (out.gradient[0], out.gradient[1]) = (slope_x, slope_y);
            return;
        }
        let planes: [[F64x4; 5]; 3] = std::array::from_fn(plane);
        let z = &self.axis[D - 1];
        let [weight_z, arm_z, slope_z] = [of(&z.weight), of(&z.arm), of(&z.slope)];
        let through = |i: usize| [planes[0][i], planes[1][i], planes[2][i]];
        let mean = through(0);
        out.velocity = dot(&weight_z, &mean);
        out.affine[0] = dot(&weight_z, &through(1));
        out.affine[1] = dot(&weight_z, &through(2));
        out.affine[D - 1] = dot(&arm_z, &mean);
        out.gradient[0] = dot(&weight_z, &through(3));
        out.gradient[1] = dot(&weight_z, &through(4));
        out.gradient[D - 1] = dot(&slope_z, &mean);
    }
}

/// [`Gathered`] of a batch, component by component.
struct GatheredLanes<const D: usize> {
    velocity: [Lanes; D],
    /// `gradient[i][k]` is ∂v_i/∂x_k.
    gradient: [[Lanes; D]; D],
    affine: [[Lanes; D]; D],
    spread: [Lanes; D],
    increment: [Lanes; D],
}

impl<const D: usize> GatheredLanes<D> {
    #[inline(always)]
    fn from_rows<'a>(of: &impl Fn(usize) -> &'a Gathered<D>) -> Self {
        let vector = |f: &dyn Fn(&Gathered<D>) -> F64x4| -> [Lanes; D] {
            let columns = Lanes::columns(std::array::from_fn(|lane| f(of(lane))));
            std::array::from_fn(|i| columns[i])
        };
        let matrix = |f: &dyn Fn(&Gathered<D>, usize) -> F64x4| -> [[Lanes; D]; D] {
            let columns: [[Lanes; D]; D] = std::array::from_fn(|k| vector(&|g| f(g, k)));
            std::array::from_fn(|i| std::array::from_fn(|k| columns[k][i]))
        };
        Self {
            velocity: vector(&|g| g.velocity),
            gradient: matrix(&|g, k| g.gradient[k]),
            affine: matrix(&|g, k| g.affine[k]),
            spread: vector(&|g| g.spread),
            increment: vector(&|g| g.increment),
        }
    }
}

/// New state of a batch; returns wave speed plus particle speed.
#[inline(always)]
fn advance<const D: usize>(
    reals: &mut [f64],
    stride: usize,
    tags: &[u64],
    batch: &Batch,
    position: &[Lanes; D],
    gathered: &GatheredLanes<D>,
    scheme: &Scheme,
    dt: f64,
) -> Lanes {
    let zero = Lanes::splat(0.0);
    let step = Lanes::splat(dt);
    let mut velocity = gathered.velocity;
    let affine: [[Lanes; D]; D] = match scheme.transfer {
        Transfer::Apic => {
            let inverse = gathered.spread.map(|spread| Lanes::splat(1.0) / spread);
            std::array::from_fn(|i| std::array::from_fn(|k| gathered.affine[i][k] * inverse[k]))
        }
        Transfer::Tpic => gathered.gradient,
        Transfer::Flip { blend } => {
            for i in 0..D {
                let old = batch.load(reals, stride, Layout::<D>::VELOCITY + i);
                let flip = old + gathered.increment[i];
                velocity[i] = (flip - velocity[i]).mul_add(Lanes::splat(blend), velocity[i]);
            }
            [[zero; D]; D]
        }
    };
    let mut square = zero;
    for i in 0..D {
        let moved = gathered.velocity[i].mul_add(step, position[i]);
        batch.store(reals, stride, Layout::<D>::POSITION + i, moved);
        batch.store(reals, stride, Layout::<D>::VELOCITY + i, velocity[i]);
        square = velocity[i].mul_add(velocity[i], square);
        for k in 0..D {
            batch.store(reals, stride, Layout::<D>::AFFINE + D * i + k, affine[i][k]);
        }
    }
    let index = batch.materials(tags);
    let plastic = index.iter().any(|&i| scheme.materials[usize::from(i)].is_plastic());
    let elastic = std::array::from_fn(|c| {
        if c < Layout::<D>::SYMMETRIC {
            batch.load(reals, stride, Layout::<D>::LEFT_CAUCHY_GREEN + c)
        } else {
            zero
        }
    });
    let mut state = State::new(strained(&elastic, &gathered.gradient, step));
    if plastic {
        state.history = std::array::from_fn(|h| batch.load(reals, stride, Layout::<D>::HISTORY + h));
    }
    material::update(scheme.materials, &index, &mut state, D == 2);
    for c in 0..Layout::<D>::SYMMETRIC {
        batch.store(reals, stride, Layout::<D>::LEFT_CAUCHY_GREEN + c, state.elastic[c]);
        batch.store(reals, stride, Layout::<D>::STRESS + c, state.stress[c]);
    }
    if plastic {
        for h in 0..material::HISTORIES {
            batch.store(reals, stride, Layout::<D>::HISTORY + h, state.history[h]);
        }
        let work = batch.load(reals, stride, Layout::<D>::WORK) + state.work;
        batch.store(reals, stride, Layout::<D>::WORK, work);
    }
    let speed = state.wave_speed + square.sqrt();
    speed.le(Lanes::splat(f64::MAX)).select(speed, Lanes::splat(f64::INFINITY))
}

/// `(1 + Δt ∇v) b (1 + Δt ∇v)ᵀ`; in plane strain zz stays.
#[inline(always)]
fn strained<const D: usize>(b: &[Lanes; 6], gradient: &[[Lanes; D]; D], step: Lanes) -> [Lanes; 6] {
    let one = Lanes::splat(1.0);
    let a: [[Lanes; D]; D] =
        std::array::from_fn(|i| {
            std::array::from_fn(|k| {
                if i == k { gradient[i][k].mul_add(step, one) } else { gradient[i][k] * step }
            })
        });
    let ab: [[Lanes; D]; D] = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            (1..D).fold(a[i][0] * b[super::symmetric_index::<D>(0, j)], |sum, k| {
                a[i][k].mul_add(b[super::symmetric_index::<D>(k, j)], sum)
            })
        })
    });
    let mut out = *b;
    for i in 0..D {
        for j in i..D {
            out[super::symmetric_index::<D>(i, j)] =
                (1..D).fold(ab[i][0] * a[j][0], |sum, k| ab[i][k].mul_add(a[j][k], sum));
        }
    }
    out
}
