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
//! | this | the sweep over the particles of a bin, and their advance |
//! | `gathered` | the sums over nodes |
//! | [`fill`] | remedies that keep fluids in their volume |
//! | `steep` | a bound on rates of elastic particles that are alone |
//! | [`leavers`], [`rates`], [`booked`] | particles that leave; rates of deformation; sums for the history |
use self::booked::Booked;
use self::fill::Filling;
pub use self::gathered::{FILL_MORE, Fields, Gathered, Moments};
use self::gathered::{Sums, mean};
use self::leavers::Leavers;
use self::rates::Rates;
use super::batch::{Batch, Batches, Tile};
use super::domain::AtWall;
use super::weights::{NodeWeights, Weights};
use super::{Coordinates, Frame, Row, Scheme, Select, SubBox, Transfer, domain, symmetric_index};
use crate::material::eigen::determinant;
use crate::material::{self, Shock, State, Step};
use crate::particle::chunk::{Chunk, Layout, Place};
use crate::simd::{Kernel, LANES, Lanes, Vector, VectorMask, widest};

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

/// Input of the advance of particles, beside the gathered values.
#[derive(Clone, Copy)]
pub struct Advance<'a> {
    /// Properties of the run, the same for all particles.
    pub scheme: &'a Scheme<'a>,
    /// Length of the step, s.
    pub dt: f64,
    /// The least edge of the cells that their boxes overlap, m.
    pub cell: f64,
    /// As [`Gather::dilation`].
    pub dilation: &'a [f64],
    /// As [`Gather::filling`].
    pub filling: Option<&'a Filling<'a>>,
}

impl Advance<'_> {
    /// New state of a batch; returns wave speed plus particle speed.
    #[inline(always)]
    fn batch<V: Vector, const D: usize>(
        &self,
        tile: &mut [[f64; LANES]],
        tags: &[u64],
        batch: &Batch,
        position: &[V; D],
        sums: &Sums<D>,
        wall: Option<AtWall<V, D>>,
        (leavers, booked): (&mut Leavers<D>, &mut Booked<D>),
    ) -> V {
        let &Self { scheme, dt, cell, dilation, filling } = self;
        let zero = V::splat(0.0);
        let step = V::splat(dt);
        let velocity = V::columns(&sums.velocity);
        let mut square = zero;
        let mut gradient = [[zero; D]; D];
        for k in 0..D {
            let column = V::columns(&sums.gradient[k]);
            for i in 0..D {
                gradient[i][k] = column[i];
            }
        }
        let increment =
            if scheme.transfer.has_increments() { V::columns(&sums.increment) } else { [zero; 4] };
        let mut moved = *position;
        let is_ring = scheme.coordinates == Coordinates::Axisymmetric;
        let plain = if is_ring { V::columns(&sums.plain) } else { velocity };
        for i in 0..D {
            moved[i] = plain[i].mul_add(step, position[i]);
            let new = match scheme.transfer {
                Transfer::Apic | Transfer::Tpic => velocity[i],
                Transfer::Flip { blend } => {
                    let flip = batch.load::<V>(tile, Layout::<D>::VELOCITY + i) + increment[i];
                    (flip - velocity[i]).mul_add(V::splat(blend), velocity[i])
                }
                Transfer::Xpic { .. } => increment[i],
            };
            batch.store(tile, Layout::<D>::VELOCITY + i, new);
            square = new.mul_add(new, square);
        }
        // Jobs with one material need not read tags.
        let index = if scheme.materials.len() == 1 { [0; LANES] } else { batch.materials(tags) };
        let mut elastic = [zero; 6];
        for c in 0..Layout::<D>::SYMMETRIC {
            elastic[c] = batch.load(tile, Layout::<D>::LEFT_CAUCHY_GREEN + c);
        }
        let filled = match filling {
            Some(filling) => filling.of_batch::<V, D>(batch, index, sums, &elastic, cell),
            None => None,
        };
        if let Some(filled) = &filled {
            filled.shift(batch, tile, &mut moved, wall.map(|wall| wall.extent), booked);
        }
        for i in 0..D {
            batch.store(tile, Layout::<D>::POSITION + i, moved[i]);
        }
        leavers.look(batch, &moved);
        let kept = match (scheme.transfer, wall) {
            (Transfer::Apic, Some(wall)) => wall.kept_affine_velocity(&moved),
            _ => None,
        };
        let flows = || domain::plastic_lanes(|| index, scheme);
        let mut added = if dilation.is_empty() { zero } else { batch.values(dilation) };
        let mut hoop = if is_ring { plain[2] } else { zero };
        let mut affine_kept = None;
        if !scheme.is_all_plastic {
            affine_kept = steep::Rate { gradient: &gradient, added, hoop }.kept(step, flows);
        }
        if let Some(kept) = affine_kept {
            gradient = gradient.map(|row| row.map(|rate| rate * kept));
            (added, hoop) = (added * kept, hoop * kept);
        }
        for k in 0..D {
            let mut affine = V::columns(&sums.affine[k]);
            if let Some(kept) = affine_kept {
                affine = affine.map(|affine| affine * kept);
            }
            for i in 0..D {
                let value = match (scheme.transfer, kept) {
                    (Transfer::Apic, Some(kept)) => affine[i] * kept[k],
                    (Transfer::Apic, None) => affine[i],
                    _ => gradient[i][k],
                };
                batch.store(tile, Layout::<D>::AFFINE + D * i + k, value);
            }
        }
        let plastic = flows() != 0;
        if !dilation.is_empty() {
            (0..D).for_each(|i| gradient[i][i] += added);
        }
        let mut trial = strained(&elastic, &gradient, step);
        if is_ring {
            hoop += added;
            let stretch = hoop.mul_add(step, V::splat(1.0));
            trial[2] = stretch * stretch * elastic[2];
        }
        if let Some(filled) = &filled {
            filled.settle(&mut trial);
        }
        let mut state = State::new([Lanes::splat(0.0); 6]);
        for c in 0..6 {
            trial[c].store(state.elastic[c].as_array_mut());
        }
        if plastic {
            for h in 0..material::HISTORIES {
                if h < scheme.histories {
                    let history: V = batch.load(tile, Layout::<D>::HISTORY + h);
                    history.store(state.history[h].as_array_mut());
                }
            }
        }
        let size = if scheme.softens { scheme.sizes(tags, batch) } else { [0.0; LANES] };
        let shock = scheme.viscosity.map(|viscosity| {
            let plane = (1..D).fold(gradient[0][0], |sum, i| sum + gradient[i][i]);
            Shock { viscosity, rate: (plane + hoop).to_array() }
        });
        let update = Step { dt, plane: D == 2, cell, size, shock };
        match scheme.materials {
            [only] => only.update(&mut state, &update),
            several => material::update(several, &index, &mut state, &update),
        }
        let result = |lanes: &Lanes| V::load(lanes.as_array());
        // The sum is not finite if any of them is not.
        let mut sum = zero;
        for c in 0..Layout::<D>::SYMMETRIC {
            elastic[c] = result(&state.elastic[c]);
            batch.store(tile, Layout::<D>::LEFT_CAUCHY_GREEN + c, elastic[c]);
            let stress = result(&state.stress[c]);
            batch.store(tile, Layout::<D>::STRESS + c, stress);
            sum += stress;
        }
        let ratio = determinant(&elastic);
        if plastic {
            for h in 0..material::HISTORIES {
                if h < scheme.histories {
                    let history = result(&state.history[h]);
                    batch.store(tile, Layout::<D>::HISTORY + h, history);
                    sum += history;
                }
            }
        }
        if scheme.viscosity.is_some() {
            let width = batch.load::<V>(tile, Layout::<D>::HALF) * 2.0;
            let volume = (1..D).fold(width, |volume, _| volume * width);
            for (sum, work) in booked.shocks.iter_mut().zip(&state.shock) {
                booked::add(sum, batch.of_members(result(work) * volume));
            }
        }
        if plastic {
            let work = batch.load::<V>(tile, Layout::<D>::WORK) + result(&state.work);
            batch.store(tile, Layout::<D>::WORK, work);
            sum += work;
        }
        let speed = result(&state.wave_speed) + square.sqrt();
        let most = V::splat(f64::MAX);
        let is_sound = zero.lt(ratio) & ratio.le(most) & sum.abs().le(most) & speed.le(most);
        batch.of_members(is_sound.select(speed, V::splat(f64::INFINITY)))
    }
}

/// `(1 + Δt ∇v) b (1 + Δt ∇v)ᵀ`; in plane strain zz stays.
#[inline(always)]
fn strained<V: Vector, const D: usize>(b: &[V; 6], gradient: &[[V; D]; D], step: V) -> [V; 6] {
    let mut a = *gradient;
    for i in 0..D {
        for k in 0..D {
            let unit = V::splat(if i == k { 1.0 } else { 0.0 });
            a[i][k] = gradient[i][k].mul_add(step, unit);
        }
    }
    let mut out = *b;
    for i in 0..D {
        let mut ab = [V::splat(0.0); D];
        for j in 0..D {
            ab[j] = a[i][0] * b[symmetric_index::<D>(0, j)];
            for k in 1..D {
                ab[j] = a[i][k].mul_add(b[symmetric_index::<D>(k, j)], ab[j]);
            }
        }
        for j in i..D {
            let mut sum = ab[0] * a[j][0];
            for k in 1..D {
                sum = ab[k].mul_add(a[j][k], sum);
            }
            out[symmetric_index::<D>(i, j)] = sum;
        }
    }
    out
}
