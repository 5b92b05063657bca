//! Remedies that keep fluids in their volume: bounded void, a shift out of overfull nodes, and volumes that
//! approach the mean of their cell.
//!
//! The volume ratio J of a particle is right on average, but positions drift away from it: flow that
//! compresses along one line and widens along another gathers particles, and the gaps between them have no
//! sample that would resist. Nodes know how full they are: with the reference volumes of all material,
//! `φ_j = Σ V₀ w / ∫N_j` and `e_j = max(0, φ_j - 1)`, and a particle gathers
//! ```text
//! φ = Σ w φ_j,   s = Σ e_j ∇w
//! ```
//! 1. *Void.* A fluid without tension that has widened, J > 1, has no pressure. It may fill the void that the
//!    grid has around it and no more: `J ← min(J, max(1, 1/φ))`. Neither energy nor momentum changes.
//! 2. *Shift.* `x ← x - r_α g h² s`, at most `0.05 h` along each axis, as far as compression does not explain
//!    the excess: `g = (φ J - 1) / (φ - 1)`, between 0 and 1. In water at rest φ J is 1. The shift is a
//!    diffusion, which takes long over many cells: where φ J - 1 is more than its noise δ, α is
//!    `1 + 5 max(0, 1 - δ / (φ J - 1))` times as much.
//! 3. *Mean.* `J ← J + r_β (J̄ - J)` with `J̄ = Σ V₀ J / Σ V₀` over the particles of the fluid in the cell,
//!    as far as J̄ - J exceeds the change over half a cell that weight explains, `J g h / 2c²`. The energy is
//!    convex in J, so it falls.
//!
//! Shares of a step are those of implicit relaxation, `r_α = y/(1 + y)` with `y = α c Δt / h` and c the speed
//! of sound. `docs/design/fluid-volume.md` says what each part does, and what else was tried.
use super::booked::{self, Booked};
use super::gathered::Sums;
use crate::kernel::batch::Batch;
use crate::material::Symmetric;
use crate::material::eigen::determinant;
use crate::particle::chunk::Layout;
use crate::simd::math::{exp, ln};
use crate::simd::{LANES, Vector, VectorMask};

/// Rate α of the shift, in speeds of sound over cells.
const SHIFT: f64 = 0.15;
/// Times [`SHIFT`] that are added to it where fluid is far too dense.
const FASTER: f64 = 5.0;
/// Excess `φ J - 1` that may be noise.
const NOISE: f64 = 0.01;
/// Greatest shift of a step along an axis, as a share of a cell.
const FARTHEST: f64 = 0.05;
/// Rate β towards the mean of a cell, in speeds of sound over cells.
const MEAN: f64 = 0.05;
/// Least distance from a wall to which particles are shifted, as a share of a cell.
const CLOSEST: f64 = 1e-9;

/// A material in a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Flow {
    /// `c Δt`, the way of sound in the step, m; 0 for what is no fluid.
    pub way: f64,
    /// Greatest volume ratio that particles may have where there is no void: 1, or infinite for fluids that
    /// bear tension.
    pub widest: f64,
    /// Change of J over a length, 1/m, that the weight of the fluid explains: `g / c²`.
    pub weight: f64,
}

impl Flow {
    /// No fluid.
    pub const NONE: Self = Self { way: 0.0, widest: f64::INFINITY, weight: 0.0 };
}

/// Data with which the advance of particles keeps fluids in their volume.
#[derive(Clone, Copy, Debug)]
pub struct Filling<'a> {
    /// By material.
    pub flows: &'a [Flow],
    /// By particle of the chunk, the mean J̄ of the fluid in its cell; 1 for what is no fluid.
    pub means: &'a [f64],
}

/// A batch with the sums that it gathered.
pub(super) struct Filled<V: Vector, const D: usize> {
    /// Whether a particle is of a fluid.
    is_fluid: V::Mask,
    /// Way of sound in the step over the edge of a cell.
    reach: V,
    widest: V,
    fill: V,
    /// `Σ e_j ∇w`, 1/m.
    slope: [V; D],
    /// J̄ / J - 1, less the part that weight explains.
    to_mean: V,
    /// J at the start of the step.
    ratio: V,
    cell: f64,
}

impl Filling<'_> {
    /// A batch of particles of these materials with the elastic tensors that they had at the start of the
    /// step; `None` if none is of a fluid.
    #[inline(always)]
    pub(super) fn of_batch<V: Vector, const D: usize>(
        &self,
        batch: &Batch,
        materials: [u16; LANES],
        sums: &Sums<D>,
        elastic: &Symmetric<V>,
        cell: f64,
    ) -> Option<Filled<V, D>> {
        let (way, widest, weight) = match self.flows {
            [only] => (V::splat(only.way), V::splat(only.widest), V::splat(only.weight)),
            several => {
                let of = materials.map(|material| several[usize::from(material)]);
                (
                    V::new(of.map(|flow| flow.way)),
                    V::new(of.map(|flow| flow.widest)),
                    V::new(of.map(|flow| flow.weight)),
                )
            }
        };
        let is_fluid = V::splat(0.0).lt(way);
        if !is_fluid.any() {
            return None;
        }
        let [x, y, z, fill] = V::columns(&sums.fill);
        let mut slope = [x; D];
        slope[1] = y;
        if D == 3 {
            slope[D - 1] = z;
        }
        let ratio = determinant(elastic).sqrt();
        // Still water is denser below: deviations within that are no noise, and stay.
        let (zero, explained) = (V::splat(0.0), weight * (0.5 * cell));
        let to_mean = batch.values::<V>(self.means) / ratio - V::splat(1.0);
        let to_mean = (to_mean - explained).max(zero) + (to_mean + explained).min(zero);
        Some(Filled { is_fluid, reach: way * (1.0 / cell), widest, fill, slope, to_mean, ratio, cell })
    }
}

/// Relaxation in a step, as a share, at a rate in speeds of sound over cells.
#[inline(always)]
fn share<V: Vector>(reach: V, rate: f64) -> V {
    let y = reach * rate;
    y / (y + V::splat(1.0))
}

impl<V: Vector, const D: usize> Filled<V, D> {
    /// Shifts particles that have moved to `moved`, and sums up their masses times shifts. No particle passes
    /// a face of the domain `[0, extent]`; `extent` is `None` away from the faces.
    #[inline(always)]
    pub(super) fn shift(
        &self,
        batch: &Batch,
        tile: &[[f64; LANES]],
        moved: &mut [V; D],
        extent: Option<&[f64; D]>,
        booked: &mut Booked<D>,
    ) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let (excess, noise) = (self.fill - one, V::splat(NOISE));
        let unexplained = self.fill.mul_add(self.ratio, -one);
        let part = zero.lt(excess).select((unexplained / excess).max(zero).min(one), one);
        let beyond_noise = (unexplained - noise).max(zero) / unexplained.max(noise);
        let rate = self.reach * beyond_noise.mul_add(V::splat(FASTER), one);
        let factor = share(rate, SHIFT) * part * (self.cell * self.cell);
        let farthest = V::splat(FARTHEST * self.cell);
        let mass: V = batch.load(tile, Layout::<D>::MASS);
        for axis in 0..D {
            let way = (-(factor * self.slope[axis])).max(-farthest).min(farthest);
            let way = self.is_fluid.select(way, zero);
            let mut to = moved[axis] + way;
            if let Some(extent) = extent {
                let lower = V::splat(CLOSEST * self.cell);
                let upper = V::splat(extent[axis]) - lower;
                to = to.max(lower.min(moved[axis])).min(upper.max(moved[axis]));
            }
            booked::add(&mut booked.ways[axis], batch.of_members(mass * (to - moved[axis])));
            moved[axis] = to;
        }
    }

    /// Bounds the void of particles and brings them nearer to the mean of their cells, in the elastic tensors
    /// after the step.
    #[inline(always)]
    pub(super) fn settle(&self, trial: &mut Symmetric<V>) {
        let one = V::splat(1.0);
        let ratio = determinant(trial).sqrt();
        let nearer = ratio * share(self.reach, MEAN).mul_add(self.to_mean, one);
        let bound = self.widest.max(one / self.fill);
        let new = nearer.min(bound);
        let changed = self.is_fluid & (new.lt(ratio) | ratio.lt(new));
        if changed.any() {
            let factor = exp(ln(new / ratio) * (2.0 / 3.0));
            for c in 0..6 {
                trial[c] = changed.select(trial[c] * factor, trial[c]);
            }
        }
    }
}
