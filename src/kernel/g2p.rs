//! Grid to particles: velocity, its gradient and the affine matrix, then the advance of particles.
//!
//! With d = x_j - x_p, a particle gathers
//! ```text
//! v = Σ w v_j,  ∇v = Σ v_j ⊗ ∇w,  B = Σ w (v_j ⊗ d + V_j),  D_k = Σ w (d_k² + S_j,k)
//! ```
//! where V and S are the first and second moments that constrained nodes inherit (zero
//! on real nodes). Then `C = B D⁻¹` (APIC, Jiang et al. 2015), `x += Δt v`,
//! `b = (1 + Δt ∇v) b (1 + Δt ∇v)ᵀ`, and the material maps b back and gives the stress.
use super::batch::{Batch, Batches};
use super::constrained::ConstrainedNodes;
use super::leavers::Leavers;
use super::simd::{F64x4, Kernel, LANES, Lanes, widest};
use super::weights::Weights;
use super::{ARENA_EDGE, Frame, Row, Scheme, Select, SubBox, Transfer, domain};
use crate::material::{self, State};
use crate::particle::chunk::{Chunk, Layout, Place};

/// First moments of the constrained nodes of an arena.
#[derive(Clone, Copy)]
pub struct Moments<'a, const D: usize> {
    /// The constrained nodes.
    pub nodes: &'a ConstrainedNodes,
    /// Per constrained node, row k is column k of V: `(V_xk, V_yk, V_zk, unused)`.
    pub first: &'a [[Row; D]],
}

/// What the nodes of an arena offer.
#[derive(Clone, Copy)]
pub struct Fields<'a, const D: usize> {
    /// Velocities after the update, `(vx, vy, vz, unused)`; finite also at nodes without mass.
    pub velocity: &'a [Row],
    /// With [`Transfer::Flip`] the changes of velocity in this step; with [`Transfer::Xpic`] the velocities that
    /// particles take on.
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
    /// `Σ w Δv_j`.
    increment: F64x4,
}

impl<const D: usize> Default for Gathered<D> {
    fn default() -> Self {
        let zero = F64x4::splat(0.0);
        Self { velocity: zero, gradient: [zero; D], affine: [zero; D], increment: zero }
    }
}

impl<const D: usize> Gathered<D> {
    /// Velocity, m/s.
    pub fn velocity(&self) -> [f64; D] {
        let row = self.velocity.to_array();
        std::array::from_fn(|axis| row[axis])
    }

    /// Adds `share` times `other`.
    fn add(&mut self, other: &Self, share: f64) {
        let share = F64x4::splat(share);
        let add = |to: &mut F64x4, from: F64x4| *to = from.mul_add(share, *to);
        add(&mut self.velocity, other.velocity);
        add(&mut self.increment, other.increment);
        for k in 0..D {
            add(&mut self.gradient[k], other.gradient[k]);
            add(&mut self.affine[k], other.affine[k]);
        }
    }
}

/// Gathers for the selected particles and advances them by `dt`. Returns the greatest sum of wave
/// speed and particle speed, m/s, for the time step; infinite if any is not finite. `leavers` notes those that leave its
/// box; `next` is the place of the chunk that will be read after this one.
pub fn gather<const D: usize>(
    chunk: &mut Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    dt: f64,
    fields: &Fields<D>,
    leavers: &mut Leavers<D>,
    next: Place,
) -> f64 {
    widest(Gather { chunk, select, frame, scheme, dt, fields, leavers, next })
}

/// [`gather`] with its arguments.
struct Gather<'a, const D: usize> {
    chunk: &'a mut Chunk<D>,
    select: Select<'a>,
    frame: &'a Frame<D>,
    scheme: &'a Scheme<'a>,
    dt: f64,
    fields: &'a Fields<'a, D>,
    leavers: &'a mut Leavers<D>,
    next: Place,
}

impl<const D: usize> Kernel for Gather<'_, D> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        let Self { chunk, select, frame, scheme, dt, fields, leavers, next } = self;
        let batches = Batches::new(select, chunk, next);
        let (reals, stride, tags) = chunk.reals_mut_and_tags();
        let cell = frame.cell;
        let mut weights = Weights::new();
        let mut sums = Sums::new();
        let mut greatest = Lanes::splat(0.0);
        for batch in batches {
            let position = batch.positions(reals, stride);
            let half = domain::of_batch(
                reals,
                stride,
                tags,
                &batch,
                &position,
                cell,
                0.5 * cell,
                &frame.extent,
                scheme,
            );
            weights.fill(frame, &position, &position, &half);
            sums.gather(&mut weights, &batch, fields);
            greatest =
                advance(reals, stride, tags, &batch, &position, &sums, scheme, dt, leavers).max(greatest);
        }
        largest(greatest)
    }
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
    let mut weights = Weights::new();
    let mut sums = Sums::new();
    for parts in parts.chunks(LANES) {
        let batch = Batch::from_indices(parts, |part| part.particle);
        let position = batch.positions(reals, stride);
        let (centre, half) = SubBox::lanes(parts);
        weights.fill(frame, &position, &centre, &half);
        sums.gather(&mut weights, &batch, fields);
        for (lane, part) in parts.iter().enumerate() {
            gathered[part.slot as usize].add(&sums.row(lane), part.fraction);
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
    leavers: &mut Leavers<D>,
) -> f64 {
    let (reals, stride, tags) = chunk.reals_mut_and_tags();
    let mut sums = Sums::new();
    let mut greatest = Lanes::splat(0.0);
    for (particles, gathered) in particles.chunks(LANES).zip(gathered.chunks(LANES)) {
        let batch = Batch::from_indices(particles, |&p| p);
        let position = batch.positions(reals, stride);
        for (lane, gathered) in gathered.iter().enumerate() {
            sums.set(lane, gathered);
        }
        greatest = advance(reals, stride, tags, &batch, &position, &sums, scheme, dt, leavers).max(greatest);
    }
    largest(greatest)
}

/// Gathers velocities for the selected particles, `Σ w v_j`, and calls `each` with the particle and its velocity.
/// Changes no particle.
pub fn interpolate<const D: usize>(
    chunk: &Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    velocity: &[Row],
    mut each: impl FnMut(usize, [f64; D]),
) {
    let (reals, stride) = chunk.reals();
    let (tags, cell) = (chunk.tags(), frame.cell);
    let mut weights = Weights::new();
    for batch in Batches::new(select, chunk, Place::default()) {
        let position = batch.positions(reals, stride);
        let half =
            domain::of_batch(reals, stride, tags, &batch, &position, cell, 0.5 * cell, &frame.extent, scheme);
        weights.fill(frame, &position, &position, &half);
        for lane in batch.members() {
            let first = weights.first(lane);
            let row = mean(&weights, lane, &velocity[first..]).to_array();
            each(batch.particle(lane), std::array::from_fn(|axis| row[axis]));
        }
    }
}

fn largest(lanes: Lanes) -> f64 {
    lanes.to_array().into_iter().fold(0.0, f64::max)
}

/// [`Gathered`] of a batch, one row per lane. Made once and filled for batch after batch; lanes that
/// a batch does not fill keep what they had, which is valid.
struct Sums<const D: usize> {
    velocity: [F64x4; LANES],
    gradient: [[F64x4; LANES]; D],
    affine: [[F64x4; LANES]; D],
    increment: [F64x4; LANES],
}

impl<const D: usize> Sums<D> {
    fn new() -> Self {
        let zero = [F64x4::splat(0.0); LANES];
        Self { velocity: zero, gradient: [zero; D], affine: [zero; D], increment: zero }
    }

    fn row(&self, lane: usize) -> Gathered<D> {
        Gathered {
            velocity: self.velocity[lane],
            gradient: std::array::from_fn(|k| self.gradient[k][lane]),
            affine: std::array::from_fn(|k| self.affine[k][lane]),
            increment: self.increment[lane],
        }
    }

    fn set(&mut self, lane: usize, row: &Gathered<D>) {
        self.velocity[lane] = row.velocity;
        self.increment[lane] = row.increment;
        for k in 0..D {
            self.gradient[k][lane] = row.gradient[k];
            self.affine[k][lane] = row.affine[k];
        }
    }

    /// The members of a batch, with all that the fields offer.
    #[inline(always)]
    fn gather(&mut self, weights: &mut Weights<D>, batch: &Batch, fields: &Fields<D>) {
        let span = super::stencil_span(D);
        for lane in batch.members() {
            let first = weights.first(lane);
            self.contract(weights, lane, &fields.velocity[first..first + span]);
        }
        if let Some(increment) = fields.increment {
            for lane in batch.members() {
                self.increment[lane] = mean(weights, lane, &increment[weights.first(lane)..]);
            }
        }
        if let Some(moments) = &fields.moments
            && moments.nodes.prepare(weights, batch)
        {
            self.add_moments(weights, batch, moments);
        }
    }

    #[inline(never)]
    fn add_moments(&mut self, weights: &Weights<D>, batch: &Batch, moments: &Moments<D>) {
        for lane in batch.members() {
            let mut sum = [F64x4::splat(0.0); D];
            moments.nodes.for_each(weights, lane, |node, weight| {
                for k in 0..D {
                    sum[k] = weight.mul_add(F64x4::new(moments.first[node][k].0), sum[k]);
                }
            });
            for k in 0..D {
                self.affine[k][lane] = self.affine[k][lane] + sum[k];
            }
        }
    }

    /// Velocity, gradient and affine sums.
    ///
    /// Each needs the nodes averaged over all axes but one: the pencil along x is
    /// `X_a = Σ_bc wy_b wz_c v_abc`, and so on. All three come from one pass over the nodes.
    #[inline(always)]
    fn contract(&mut self, weights: &Weights<D>, lane: usize, nodes: &[Row]) {
        let nodes = &nodes[..super::stencil_span(D)];
        let zero = F64x4::splat(0.0);
        let of = |values: &[f64; LANES]| F64x4::splat(values[lane]);
        let (x, y, z) = (&weights.axis[0], &weights.axis[1], &weights.axis[D - 1]);
        let weight_x = [of(&x.weight[0]), of(&x.weight[1]), of(&x.weight[2])];
        let mut pencil = [[zero; 3]; D];
        for c in 0..if D == 3 { 3 } else { 1 } {
            for b in 0..3 {
                let product = of(if D == 3 { &weights.product[b][c] } else { &y.weight[b] });
                let mut across = zero;
                for a in 0..3 {
                    let row = F64x4::new(nodes[a + ARENA_EDGE * (b + ARENA_EDGE * c)].0);
                    pencil[0][a] = product.mul_add(row, pencil[0][a]);
                    across = weight_x[a].mul_add(row, across);
                }
                if D == 3 {
                    pencil[1][b] = of(&z.weight[c]).mul_add(across, pencil[1][b]);
                    pencil[D - 1][c] = of(&y.weight[b]).mul_add(across, pencil[D - 1][c]);
                } else {
                    pencil[1][b] = across;
                }
            }
        }
        let dot = |factor: &[[f64; LANES]; 3], pencil: &[F64x4; 3]| {
            let sum = of(&factor[1]).mul_add(pencil[1], of(&factor[0]) * pencil[0]);
            of(&factor[2]).mul_add(pencil[2], sum)
        };
        self.velocity[lane] = dot(&x.weight, &pencil[0]);
        for k in 0..D {
            self.affine[k][lane] = dot(&weights.axis[k].arm, &pencil[k]);
            self.gradient[k][lane] = dot(&weights.axis[k].slope, &pencil[k]);
        }
    }
}

/// `Σ w f_j` over the nodes from the first of the stencil on.
fn mean<const D: usize>(weights: &Weights<D>, lane: usize, nodes: &[Row]) -> F64x4 {
    let nodes = &nodes[..super::stencil_span(D)];
    let mut sum = F64x4::splat(0.0);
    weights.for_each_node(lane, |node, weight| sum = weight.mul_add(F64x4::new(nodes[node].0), sum));
    sum
}

/// New state of a batch; returns wave speed plus particle speed.
#[inline(always)]
fn advance<const D: usize>(
    reals: &mut [f64],
    stride: usize,
    tags: &[u64],
    batch: &Batch,
    position: &[Lanes; D],
    sums: &Sums<D>,
    scheme: &Scheme,
    dt: f64,
    leavers: &mut Leavers<D>,
) -> Lanes {
    let zero = Lanes::splat(0.0);
    let step = Lanes::splat(dt);
    let velocity = Lanes::columns(sums.velocity);
    let mut square = zero;
    let mut gradient = [[zero; D]; D];
    for k in 0..D {
        let column = Lanes::columns(sums.gradient[k]);
        for i in 0..D {
            gradient[i][k] = column[i];
        }
    }
    let increment = if scheme.transfer.has_increments() { Lanes::columns(sums.increment) } else { [zero; 4] };
    let mut moved = *position;
    for i in 0..D {
        moved[i] = velocity[i].mul_add(step, position[i]);
        batch.store(reals, stride, Layout::<D>::POSITION + i, moved[i]);
        let new = match scheme.transfer {
            Transfer::Apic | Transfer::Tpic => velocity[i],
            Transfer::Flip { blend } => {
                let flip = batch.load(reals, stride, Layout::<D>::VELOCITY + i) + increment[i];
                (flip - velocity[i]).mul_add(Lanes::splat(blend), velocity[i])
            }
            Transfer::Xpic { .. } => increment[i],
        };
        batch.store(reals, stride, Layout::<D>::VELOCITY + i, new);
        square = new.mul_add(new, square);
    }
    leavers.look(batch, &moved);
    for k in 0..D {
        let affine = Lanes::columns(sums.affine[k]);
        for i in 0..D {
            let value = match scheme.transfer {
                Transfer::Apic => affine[i],
                Transfer::Tpic => gradient[i][k],
                Transfer::Flip { .. } | Transfer::Xpic { .. } => zero,
            };
            batch.store(reals, stride, Layout::<D>::AFFINE + D * i + k, value);
        }
    }
    let index = batch.materials(tags);
    let plastic = domain::plastic_lanes(&index, scheme) != 0;
    let mut elastic = [zero; 6];
    for c in 0..Layout::<D>::SYMMETRIC {
        elastic[c] = batch.load(reals, stride, Layout::<D>::LEFT_CAUCHY_GREEN + c);
    }
    let mut state = State::new(strained(&elastic, &gradient, step));
    if plastic {
        for h in 0..material::HISTORIES {
            state.history[h] = batch.load(reals, stride, Layout::<D>::HISTORY + h);
        }
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
    batch.of_members(speed.le(Lanes::splat(f64::MAX)).select(speed, Lanes::splat(f64::INFINITY)))
}

/// `(1 + Δt ∇v) b (1 + Δt ∇v)ᵀ`; in plane strain zz stays.
#[inline(always)]
fn strained<const D: usize>(b: &[Lanes; 6], gradient: &[[Lanes; D]; D], step: Lanes) -> [Lanes; 6] {
    let mut a = *gradient;
    for i in 0..D {
        for k in 0..D {
            let unit = Lanes::splat(if i == k { 1.0 } else { 0.0 });
            a[i][k] = gradient[i][k].mul_add(step, unit);
        }
    }
    let mut out = *b;
    for i in 0..D {
        let mut ab = [Lanes::splat(0.0); D];
        for j in 0..D {
            ab[j] = a[i][0] * b[super::symmetric_index::<D>(0, j)];
            for k in 1..D {
                ab[j] = a[i][k].mul_add(b[super::symmetric_index::<D>(k, j)], ab[j]);
            }
        }
        for j in i..D {
            let mut sum = ab[0] * a[j][0];
            for k in 1..D {
                sum = ab[k].mul_add(a[j][k], sum);
            }
            out[super::symmetric_index::<D>(i, j)] = sum;
        }
    }
    out
}
