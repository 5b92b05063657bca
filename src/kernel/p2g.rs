//! Particles to grid: mass, affine momentum and the impulse of stress, scattered in one pass.
//!
//! Node j receives from particle p
//! ```text
//! mass      w m
//! momentum  w m (v + C (x_j - x_p)) - Δt V₀ τ ∇w
//! ```
//! where the affine matrix is `C = B D⁻¹` (APIC): the particle keeps B, since B, and not C, carries its
//! angular momentum when D changes until the next step.
//!
//! The tensor product of the weights is factored: with rows q = m (v, 1), C_k = m C e_k,
//! T_k = -Δt V₀ τ e_k and d = x_j - x_p,
//! ```text
//! X_a = wx_a q + wx_a dx_a C_x + wx'_a T_x,  Y_b = wy_b dy_b C_y + wy'_b T_y,  Z_c alike
//! row = (wy_b wz_c) X_a + wx_a (wz_c Y_b + wy_b Z_c)
//! ```
//! With [`Scheme::forces`] the particles' affine columns hold a stress that need not be symmetric, in place
//! of τ, and there is no affine momentum.
//!
//! In axisymmetry the hoop stress adds `-Δt V₀ τ_θθ T` to the momentum along the radius, with T the plain
//! mean of the hat over the box, over the radius; it has a pass of its own.
use super::batch::{Batch, Batches, Tile, lanes_in};
use super::constrained_nodes::ConstrainedNodes;
use super::hanging::HangingNodes;
use super::weights::{NodeWeights, Weights, add_products};
use super::{ARENA_EDGE, Frame, GivenColumn, Row, Scheme, Select, SubBox, Transfer, domain};
use crate::particle::chunk::{Chunk, Layout, Place};
use crate::particle::volume::box_volume;
use crate::simd::{F64x4, Kernel, LANES, Lanes, Vector, widest};

/// Constrained nodes of an arena, and first moments `A = Σ w m C` of those that have them.
pub struct MomentSums<'a> {
    /// Hanging nodes, and nodes with moments.
    pub nodes: &'a ConstrainedNodes,
    /// By node, one row for each axis; row k is column k of A: `(A_xk, A_yk, A_zk, 0)`.
    pub sums: &'a mut [Row],
}

/// Memory that is reused from bin to bin, since its initialisation takes a while.
pub struct Scratch<const D: usize> {
    prepared: Prepared<D>,
    nodes: NodeWeights,
    spare: Tile,
}

impl<const D: usize> Default for Scratch<D> {
    fn default() -> Self {
        Self { prepared: Prepared::new(), nodes: NodeWeights::new(), spare: Tile::new() }
    }
}

/// Input and output of the scatter of a bin of particles into the arena of its block.
pub struct Scatter<'a, const D: usize> {
    /// Memory of the thread.
    pub scratch: &'a mut Scratch<D>,
    /// Particles of the leaf.
    pub chunk: &'a Chunk<D>,
    /// Columns that are given in place of theirs: of masses, velocities or stress; none as a rule.
    pub given: &'a [GivenColumn],
    /// The block.
    pub frame: &'a Frame<D>,
    /// Properties of the run, the same for all particles.
    pub scheme: &'a Scheme<'a>,
    /// The step that turns internal forces into impulses, s.
    pub dt: f64,
    /// Rows (momentum, mass) of the nodes.
    pub arena: &'a mut [Row],
    /// Sums of constrained nodes, where there are any: first moments, or other factors (see
    /// [`super::hanging`]).
    pub moments: Option<MomentSums<'a>>,
}

impl<const D: usize> Scatter<'_, D> {
    /// Adds the selected particles. Each particle's box must lie within the arena, which holds when its
    /// centre lies in the block. `next` is the place of the chunk that will be read after this one.
    pub fn whole_boxes(&mut self, select: Select, next: Place) {
        let Self { scratch, chunk, given, frame, scheme, dt, arena, moments } = self;
        // By value, so that the kernel holds each of them in a register.
        let moments = moments.as_mut().map(|MomentSums { nodes, sums }| MomentSums { nodes, sums });
        let bin = Scatter { scratch, chunk, given, frame, scheme, dt: *dt, arena, moments };
        widest(WholeBoxes { bin, select, next });
    }

    /// Adds parts of boxes; the affine term is relative to the particle.
    pub fn sub_boxes(&mut self, parts: &[SubBox<D>]) {
        let Self { scratch, chunk, given, frame, scheme, dt, arena, moments } = self;
        let Scratch { prepared, nodes, spare } = &mut **scratch;
        for parts in parts.chunks(LANES) {
            let batch = Batch::from_indices(parts, |part| part.particle);
            let tile = batch.tile_to_scatter::<D>(chunk.tiles(), given, spare);
            prepared.weights.fill_parts(scheme.coordinates, frame, &batch.positions(tile), parts);
            let spread = std::array::from_fn(|axis| SubBox::lane(parts, |part| part.spread[axis]).to_array());
            prepared.load::<Lanes>(tile, &batch, *dt, scheme, &spread);
            prepared.share(parts);
            prepared.add::<Lanes>(&batch, arena);
            if prepared.weights.is_ring {
                prepared.add_hoop(tile, &batch, *dt, |lane| parts[lane].fraction, arena);
            }
            if let Some(moments) = moments {
                let hanging = &moments.nodes.hanging;
                prepared.add_hanging(hanging, hanging.touched(&prepared.weights, &batch), frame.cell, arena);
                let touched = moments.nodes.prepare(&prepared.weights, nodes, &batch);
                prepared.add_moments(nodes, touched, moments);
            }
        }
    }
}

/// The kernel of [`Scatter::whole_boxes`].
struct WholeBoxes<'a, const D: usize> {
    bin: Scatter<'a, D>,
    select: Select<'a>,
    next: Place,
}

impl<const D: usize> Kernel for WholeBoxes<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        // Copies of the loop, so that bins away from walls and bins without constrained nodes do not test
        // every particle for them.
        match (self.bin.frame.is_at_wall(), self.bin.moments.is_some()) {
            (false, false) => self.add_all::<V, false, false>(),
            (true, false) => self.add_all::<V, true, false>(),
            (_, true) => self.add_all::<V, true, true>(),
        }
    }
}

impl<const D: usize> WholeBoxes<'_, D> {
    #[inline(always)]
    fn add_all<V: Vector, const AT_WALL: bool, const HAS_MOMENTS: bool>(self) {
        let Scatter { scratch, chunk, given, frame, scheme, dt, arena, moments } = self.bin;
        let mut moments = if HAS_MOMENTS { moments } else { None };
        let (tags, cell) = (chunk.tags(), frame.cell);
        let Scratch { prepared, nodes, spare } = scratch;
        let mut batches = Batches::new(self.select, chunk, self.next);
        while let Some(batch) = batches.next() {
            batches.look_up_pages();
            let tile = batch.tile_to_scatter::<D>(chunk.tiles(), given, spare);
            let position: [V; D] = batch.positions(tile);
            let whole = domain::whole_of_batch(tile, tags, &batch, 0.5 * cell, scheme);
            let half = match AT_WALL {
                true => domain::cut_at_walls(&whole, &position, cell, &frame.extent),
                false => domain::away_from_walls(&whole, cell),
            };
            prepared.weights.fill_whole(scheme, frame, &position, &half);
            if AT_WALL && let Some(factors) = domain::softening(&whole, &half, cell) {
                prepared.weights.soften(&factors);
            }
            let mut spread = prepared.weights.spread;
            let (mut touched, mut hanging) = (0, 0);
            if let Some(moments) = &moments {
                hanging = moments.nodes.hanging.touched(&prepared.weights, &batch);
                if hanging != 0 {
                    moments.nodes.hanging.add_spread(&prepared.weights, hanging, cell, &mut spread);
                }
                touched = moments.nodes.prepare(&prepared.weights, nodes, &batch);
                if touched != 0 {
                    moments.nodes.add_spread(&prepared.weights, nodes, touched, &mut spread);
                }
            }
            prepared.load::<V>(tile, &batch, dt, scheme, &spread);
            prepared.add::<V>(&batch, arena);
            if prepared.weights.is_ring {
                prepared.add_hoop(tile, &batch, dt, |_| 1.0, arena);
            }
            if let Some(moments) = &mut moments {
                prepared.add_hanging(&moments.nodes.hanging, hanging, cell, arena);
                prepared.add_moments(nodes, touched, moments);
            }
        }
    }
}

/// A batch ready to be added to nodes: factors by lane, rows by particle.
#[repr(align(64))]
struct Prepared<const D: usize> {
    weights: Weights<D>,
    /// `m (v, 1)`.
    momentum: [F64x4; LANES],
    /// `m C e_k`.
    affine: [[F64x4; LANES]; D],
    /// `-Δt V₀ τ e_k`.
    impulse: [[F64x4; LANES]; D],
}

impl<const D: usize> Prepared<D> {
    fn new() -> Self {
        let rows = [F64x4::splat(0.0); LANES];
        Self { weights: Weights::new(), momentum: rows, affine: [rows; D], impulse: [rows; D] }
    }

    /// Reads the particles' state; `spread` is D of [`Transfer::Apic`].
    #[inline(always)]
    fn load<V: Vector>(
        &mut self,
        tile: &[[f64; LANES]],
        batch: &Batch,
        dt: f64,
        scheme: &Scheme<'_>,
        spread: &[[f64; LANES]; D],
    ) {
        let transfer = scheme.transfer;
        let zero = V::splat(0.0);
        let mass: V = batch.load(tile, Layout::<D>::MASS);
        let width = batch.load::<V>(tile, Layout::<D>::HALF) * 2.0;
        let mut volume = V::splat(-dt);
        for _ in 0..D {
            volume = volume * width;
        }
        let mut column = [zero, zero, zero, mass];
        for i in 0..D {
            column[i] = batch.load::<V>(tile, Layout::<D>::VELOCITY + i) * mass;
        }
        V::write_rows(column, &mut self.momentum);
        column[3] = zero;
        for k in 0..D {
            let factor = if transfer == Transfer::Apic { mass / V::load(&spread[k]) } else { mass };
            for i in 0..D {
                column[i] = match transfer.has_affine() && !scheme.forces {
                    true => batch.load::<V>(tile, Layout::<D>::AFFINE + D * i + k) * factor,
                    false => zero,
                };
            }
            V::write_rows(column, &mut self.affine[k]);
        }
        if scheme.forces {
            for k in 0..D {
                for i in 0..D {
                    column[i] = batch.load::<V>(tile, Layout::<D>::AFFINE + D * i + k) * volume;
                }
                V::write_rows(column, &mut self.impulse[k]);
            }
            return;
        }
        let mut stress = [zero; 6];
        for c in 0..Layout::<D>::SYMMETRIC {
            if D == 3 || c != 2 {
                stress[c] = batch.load::<V>(tile, Layout::<D>::STRESS + c) * volume;
            }
        }
        for k in 0..D {
            for i in 0..D {
                column[i] = stress[super::symmetric_index::<D>(i, k)];
            }
            V::write_rows(column, &mut self.impulse[k]);
        }
    }

    /// Reduces each lane to the share of its part.
    fn share(&mut self, parts: &[SubBox<D>]) {
        for (lane, part) in parts.iter().enumerate() {
            let share = F64x4::splat(part.fraction);
            self.momentum[lane] = self.momentum[lane] * share;
            for k in 0..D {
                self.affine[k][lane] = self.affine[k][lane] * share;
                self.impulse[k][lane] = self.impulse[k][lane] * share;
            }
        }
    }

    /// Adds the members of a batch in order.
    #[inline(always)]
    fn add<V: Vector>(&self, batch: &Batch, arena: &mut [Row]) {
        let span = super::stencil_span(D);
        for lane in batch.members() {
            let first = self.weights.first(lane);
            self.add_one::<V>(lane, &mut arena[first..first + span]);
        }
    }

    #[inline(always)]
    fn add_one<V: Vector>(&self, lane: usize, nodes: &mut [Row]) {
        V::keep_wide();
        let zero = F64x4::splat(0.0);
        let of = |values: &[f64; LANES]| F64x4::splat(values[lane]);
        let mut along = [[zero; 3]; D];
        for k in 0..D {
            let (axis, affine, impulse) =
                (&self.weights.axis[k], self.affine[k][lane], self.impulse[k][lane]);
            for i in 0..3 {
                along[k][i] = of(&axis.slope[i]).mul_add(impulse, of(&axis.arm[i]) * affine);
            }
        }
        let mut weight_x = [zero; 3];
        for a in 0..3 {
            weight_x[a] = of(&self.weights.axis[0].weight[a]);
            along[0][a] = weight_x[a].mul_add(self.momentum[lane], along[0][a]);
        }
        let (y, z) = (&self.weights.axis[1].weight, &self.weights.axis[D - 1].weight);
        let product = |b: usize, c: usize| of(&self.weights.product[b][c]);
        add_products::<V, D>(nodes, &weight_x, |b| of(&y[b]), |c| of(&z[c]), product, &along);
    }

    /// Adds the impulse of the hoop stress, `-Δt V₀ τ_θθ T` along the radius; of each lane its share.
    #[inline(never)]
    fn add_hoop(
        &self,
        tile: &[[f64; LANES]],
        batch: &Batch,
        dt: f64,
        share: impl Fn(usize) -> f64,
        arena: &mut [Row],
    ) {
        let Weights { ring, axis, .. } = &self.weights;
        for lane in batch.members() {
            let volume = box_volume::<D>(tile[Layout::<D>::HALF][lane]);
            let impulse = -dt * volume * tile[Layout::<D>::STRESS + 2][lane] * ring.hoop[lane] * share(lane);
            let first = self.weights.first(lane);
            for (b, weight) in axis[1].weight.iter().enumerate() {
                for (a, plain) in ring.plain.iter().enumerate() {
                    let radial = &mut arena[first + a + ARENA_EDGE * b].0[0];
                    *radial = impulse.mul_add(plain[lane] * weight[lane], *radial);
                }
            }
        }
    }

    /// Adds the contributions of hanging nodes of the lanes in `touched`, which have no first moments.
    #[inline(always)]
    fn add_hanging(&self, hanging: &HangingNodes, touched: u32, cell: f64, arena: &mut [Row]) {
        let span = super::stencil_span(D);
        for lane in lanes_in(touched) {
            let first = self.weights.first(lane);
            let mut affine = [F64x4::splat(0.0); D];
            for k in 0..D {
                affine[k] = self.affine[k][lane] * F64x4::splat(cell);
            }
            hanging.scatter(&self.weights, lane, &affine, &mut arena[first..first + span]);
        }
    }

    /// Adds first moments of the lanes in `touched`.
    #[inline(always)]
    fn add_moments(&self, nodes: &NodeWeights, touched: u32, moments: &mut MomentSums) {
        for lane in lanes_in(touched) {
            moments.nodes.for_each(&self.weights, nodes, lane, |row, axis, weight| {
                let sum = &mut moments.sums[row].0;
                let affine = self.affine[axis.min(D - 1)][lane];
                *sum = F64x4::splat(weight).mul_add(affine, F64x4::new(*sum)).to_array();
            });
        }
    }
}
