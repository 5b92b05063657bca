//! Grid to particles: velocity, its gradient and the affine matrix, then the advance of particles.
//!
//! With d = x_j - x_p, a particle gathers
//! ```text
//! v = Σ w v_j,  ∇v = Σ v_j ⊗ ∇w,  B = Σ w (v_j ⊗ d + V_j),  D_k = Σ w (d_k² + S_j,k)
//! ```
//! where V and S are the first and second moments that constrained nodes inherit (see [`super::hanging`];
//! zero on real nodes). Then `C = B D⁻¹` (APIC, Jiang et al. 2015), `x += Δt v`,
//! `b = (1 + Δt ∇v) b (1 + Δt ∇v)ᵀ`, and the material maps b back and gives the stress.
//!
//! In axisymmetry velocity and B belong to the centre of mass of the box, and `∇v` has the rate along the
//! hoop, `L_θθ = Σ v_r T` (see [`super::p2g`]). The position is the centre of the box, which moves with
//! the plain mean of the velocity over the box. So the radius grows at the rate `r L_θθ`: the stretch along
//! the hoop is the ratio of the radii, whatever the motion.
//!
//! | file | what it holds |
//! |---|---|
//! | this | the sweeps over the particles of a bin |
//! | `advance` | their new velocity, place, strain and stress |
//! | `gathered` | the sums over nodes |
//! | [`fill`] | remedies that keep fluids in their volume |
//! | `steep` | a bound on rates of elastic particles that are alone |
//! | [`leavers`], [`rates`], [`booked`] | particles that leave; rates of deformation; sums for the history |
pub use self::advance::Advance;
use self::booked::Booked;
use self::fill::Filling;
pub use self::gathered::{FILL_MORE, Fields, Gathered, Moments};
use self::gathered::{Sums, mean};
use self::leavers::Leavers;
use self::rates::Rates;
use super::batch::{Batch, Batches, Tile};
use super::domain::AtWall;
use super::weights::{NodeWeights, Weights};
use super::{Coordinates, Frame, Row, Scheme, Select, SubBox, domain};
use crate::particle::chunk::{Chunk, Layout, Place};
use crate::simd::{Kernel, LANES, Lanes, Vector, widest};

mod advance;
pub mod booked;
pub mod fill;
mod gathered;
pub mod leavers;
pub mod rates;
mod steep;

/// Memory reused from bin to bin, as setting it up is slow.
pub struct Scratch<const D: usize> {
    weights: Weights<D>,
    nodes: NodeWeights,
    sums: Sums<D>,
    spare: Tile,
}

impl<const D: usize> Default for Scratch<D> {
    fn default() -> Self {
        Self { weights: Weights::new(), nodes: NodeWeights::new(), sums: Sums::new(), spare: Tile::new() }
    }
}

/// Input and output of the gather for the particles of a bin, and of their advance.
pub struct Gather<'a, const D: usize> {
    /// Memory of the thread.
    pub scratch: &'a mut Scratch<D>,
    /// Particles of the leaf.
    pub chunk: &'a mut Chunk<D>,
    /// The block.
    pub frame: &'a Frame<D>,
    /// Properties of the run, the same for all particles.
    pub scheme: &'a Scheme<'a>,
    /// Length of the step, s.
    pub dt: f64,
    /// Velocities of the nodes.
    pub fields: &'a Fields<'a>,
    /// Receives the particles that leave the box of the block.
    pub leavers: &'a mut Leavers<D>,
    /// By particle, the rate added to each diagonal component of its velocity gradient for the strain, 1/s;
    /// empty for none.
    pub dilation: &'a [f64],
    /// Data that keep fluids at their volume, in jobs with fluids; `fields` then has how full nodes are.
    pub filling: Option<&'a Filling<'a>>,
    /// Sums for the history: of the shifts that this gives to particles, of the work of artificial viscosity.
    pub booked: &'a mut Booked<D>,
    /// Receives the rates of the particles, where something follows the deformation.
    pub rates: Option<&'a mut Rates<D>>,
}

impl<const D: usize> Gather<'_, D> {
    /// Gathers for the selected particles and advances them. Returns the greatest sum of wave speed and
    /// particle speed, m/s, for the time step; infinite if the state of any particle is not finite or its det
    /// b is not above zero. `next` is the place of the chunk that will be read after this one.
    pub fn whole_boxes(self, select: Select, next: Place) -> f64 {
        widest(WholeBoxes { bin: self, select, next })
    }
}

/// The kernel of [`Gather::whole_boxes`].
struct WholeBoxes<'a, const D: usize> {
    bin: Gather<'a, D>,
    select: Select<'a>,
    next: Place,
}

impl<const D: usize> Kernel for WholeBoxes<'_, D> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Vector>(self) -> f64 {
        // Two copies of the loop, so that bins away from walls make no test at every particle.
        if self.bin.frame.is_at_wall() {
            self.advance_all::<V, true>()
        } else {
            self.advance_all::<V, false>()
        }
    }
}

impl<const D: usize> WholeBoxes<'_, D> {
    #[inline(always)]
    fn advance_all<V: Vector, const AT_WALL: bool>(self) -> f64 {
        let Gather { scratch, chunk, frame, scheme, dt, fields, dilation, filling, .. } = self.bin;
        let Gather { leavers, booked, mut rates, .. } = self.bin;
        let batches = Batches::new(self.select, chunk, self.next);
        let (tiles, tags) = chunk.tiles_mut_and_tags();
        let (cell, extent) = (frame.cell, &frame.extent);
        let Scratch { weights, nodes, sums, spare } = scratch;
        let mut greatest = V::splat(0.0);
        for batch in batches {
            let tile = batch.tile_mut::<D>(tiles, spare);
            let position: [V; D] = batch.positions(tile);
            let whole = domain::whole_of_batch(tile, tags, &batch, 0.5 * cell, scheme);
            let (half, wall) = if AT_WALL {
                let half = domain::cut_at_walls(&whole, &position, cell, extent);
                (half, Some(AtWall { whole, half, cell, extent }))
            } else {
                (domain::away_from_walls(&whole, cell), None)
            };
            weights.fill_whole(scheme, frame, &position, &half);
            if AT_WALL && let Some(factors) = domain::softening(&whole, &half, cell) {
                weights.soften(&factors);
            }
            sums.gather::<V>(weights, nodes, &batch, cell, fields);
            if let Some(rates) = &mut rates {
                batch.members().for_each(|lane| rates.note(batch.particle(lane), &sums.row(lane)));
            }
            let update = Advance { scheme, dt, cell, dilation, filling };
            let speed = update.batch(tile, tags, &batch, &position, sums, wall, (leavers, booked));
            greatest = speed.max(greatest);
            batch.put_back::<D>(tiles, spare);
        }
        largest(greatest)
    }
}

/// Gathers for parts of boxes and adds each to `gathered[part.slot]`; [`advance_gathered`] follows
/// when all parts of a particle have been added.
pub fn gather_sub_boxes<const D: usize>(
    scratch: &mut Scratch<D>,
    chunk: &Chunk<D>,
    parts: &[SubBox<D>],
    frame: &Frame<D>,
    coordinates: Coordinates,
    fields: &Fields,
    gathered: &mut [Gathered<D>],
) {
    let Scratch { weights, nodes, sums, spare } = scratch;
    for parts in parts.chunks(LANES) {
        let batch = Batch::from_indices(parts, |part| part.particle);
        let position: [Lanes; D] = batch.positions(batch.tile::<D>(
            chunk.tiles(),
            Layout::<D>::POSITION..Layout::<D>::POSITION + D,
            spare,
        ));
        weights.fill_parts(coordinates, frame, &position, parts);
        sums.gather::<Lanes>(weights, nodes, &batch, frame.cell, fields);
        for (lane, part) in parts.iter().enumerate() {
            gathered[part.slot as usize].add(&sums.row(lane), part.fraction);
        }
    }
}

/// Advances the particles of a list with the gathered values, in a domain `[0, extent]`. Returns as
/// [`Gather::whole_boxes`].
pub fn advance_gathered<const D: usize>(
    scratch: &mut Scratch<D>,
    chunk: &mut Chunk<D>,
    particles: &[u32],
    gathered: &[Gathered<D>],
    update: &Advance,
    extent: &[f64; D],
    (leavers, booked): (&mut Leavers<D>, &mut Booked<D>),
) -> f64 {
    let &Advance { scheme, cell, .. } = update;
    let (tiles, tags) = chunk.tiles_mut_and_tags();
    let Scratch { sums, spare, .. } = scratch;
    let mut greatest = Lanes::splat(0.0);
    for (particles, gathered) in particles.chunks(LANES).zip(gathered.chunks(LANES)) {
        let batch = Batch::from_indices(particles, |&p| p);
        let tile = batch.tile_mut::<D>(tiles, spare);
        let position: [Lanes; D] = batch.positions(tile);
        for (lane, gathered) in gathered.iter().enumerate() {
            sums.set(lane, gathered);
        }
        let whole = domain::whole_of_batch(tile, tags, &batch, f64::INFINITY, scheme);
        let half = domain::cut_at_walls(&whole, &position, cell, extent);
        let wall = Some(AtWall { whole, half, cell, extent });
        let speed = update.batch(tile, tags, &batch, &position, sums, wall, (leavers, booked));
        greatest = speed.max(greatest);
        batch.put_back::<D>(tiles, spare);
    }
    largest(greatest)
}

/// Gathers velocities for the selected particles, `Σ w v_j`, and calls `each` with the particle and its
/// velocity. Changes no particle.
pub fn interpolate<const D: usize>(
    scratch: &mut Scratch<D>,
    chunk: &Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    velocity: &[Row],
    mut each: impl FnMut(usize, [f64; D]),
) {
    let (tags, cell) = (chunk.tags(), frame.cell);
    let Scratch { weights, spare, .. } = scratch;
    for batch in Batches::new(select, chunk, Place::default()) {
        let tile = batch.tile::<D>(chunk.tiles(), 0..Layout::<D>::REALS, spare);
        let position: [Lanes; D] = batch.positions(tile);
        let half = domain::of_batch(tile, tags, &batch, &position, cell, 0.5 * cell, &frame.extent, scheme);
        weights.fill_whole(scheme, frame, &position, &half);
        for lane in batch.members() {
            let first = weights.first(lane);
            let row = mean(weights, lane, &velocity[first..]).to_array();
            each(batch.particle(lane), std::array::from_fn(|axis| row[axis]));
        }
    }
}

/// Gathers for the selected particles as [`Gather::whole_boxes`] does, and calls `each` with the particle and
/// the gathered values. Changes no particle.
pub fn look<const D: usize>(
    scratch: &mut Scratch<D>,
    chunk: &Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    fields: &Fields,
    mut each: impl FnMut(usize, Gathered<D>),
) {
    let (tags, cell, extent) = (chunk.tags(), frame.cell, &frame.extent);
    let Scratch { weights, nodes, sums, spare } = scratch;
    for batch in Batches::new(select, chunk, Place::default()) {
        let tile = batch.tile::<D>(chunk.tiles(), 0..Layout::<D>::REALS, spare);
        let position: [Lanes; D] = batch.positions(tile);
        let whole = domain::whole_of_batch(tile, tags, &batch, 0.5 * cell, scheme);
        let half = domain::cut_at_walls(&whole, &position, cell, extent);
        weights.fill_whole(scheme, frame, &position, &half);
        if let Some(factors) = domain::softening(&whole, &half, cell) {
            weights.soften(&factors);
        }
        sums.gather::<Lanes>(weights, nodes, &batch, cell, fields);
        batch.members().for_each(|lane| each(batch.particle(lane), sums.row(lane)));
    }
}

fn largest<V: Vector>(lanes: V) -> f64 {
    lanes.to_array().into_iter().fold(0.0, f64::max)
}
