//! Constitutive models: one trait over batches of particles, one file per model.
//!
//! All models are isotropic, so the elastic left Cauchy-Green tensor `b = F_e F_eᵀ` is the whole
//! elastic state. Plastic models map a trial `b` back to their yield surface in Hencky strains.
use crate::simd::{Kernel, LANES, Lanes, Mask, Vector, VectorMask};

pub mod driver;
pub mod drucker_prager;
pub mod eigen;
pub mod fixed_corotated;
pub mod hencky;
mod near_unit;
pub mod neo_hookean;
pub mod parameters;
mod strain;
pub mod von_mises;

pub use eigen::Symmetric;
pub use parameters::Parameters;

/// Number of history variables that a particle has.
pub const HISTORIES: usize = 2;

/// State of a batch of particles. Symmetric tensors have components `xx, yy, zz, xy, xz, yz`.
#[derive(Clone, Copy, Debug)]
pub struct State<V = Lanes> {
    /// Elastic left Cauchy-Green tensor: the trial value before, the final one after an update.
    pub elastic: Symmetric<V>,
    /// Kirchhoff stress after an update, Pa.
    pub stress: Symmetric<V>,
    /// History variables (see [`Material::history_names`]); the second is the logarithm of the
    /// plastic volume ratio, or zero.
    pub history: [V; HISTORIES],
    /// Plastic work of the update per reference volume, J/m³; not negative.
    pub work: V,
    /// Upper bound of the wave speeds after an update, m/s.
    pub wave_speed: V,
}

impl<V: Vector> State<V> {
    /// A batch at rest with `elastic` as trial value and no history.
    pub fn new(elastic: Symmetric<V>) -> Self {
        let zero = V::splat(0.0);
        Self { elastic, stress: [zero; 6], history: [zero; HISTORIES], work: zero, wave_speed: zero }
    }
}

impl State {
    /// In the registers of a kernel.
    #[inline(always)]
    fn read<V: Vector>(&self) -> State<V> {
        let mut state = State::new([V::splat(0.0); 6]);
        for c in 0..6 {
            state.elastic[c] = V::load(self.elastic[c].as_array());
            state.stress[c] = V::load(self.stress[c].as_array());
        }
        for h in 0..HISTORIES {
            state.history[h] = V::load(self.history[h].as_array());
        }
        state.work = V::load(self.work.as_array());
        state.wave_speed = V::load(self.wave_speed.as_array());
        state
    }

    /// Takes over what is in the registers of a kernel.
    #[inline(always)]
    fn write<V: Vector>(&mut self, state: &State<V>) {
        for c in 0..6 {
            state.elastic[c].store(self.elastic[c].as_array_mut());
            state.stress[c].store(self.stress[c].as_array_mut());
        }
        for h in 0..HISTORIES {
            state.history[h].store(self.history[h].as_array_mut());
        }
        state.work.store(self.work.as_array_mut());
        state.wave_speed.store(self.wave_speed.as_array_mut());
    }
}

/// What [`Material::update`] of a model does, to be compiled for several instruction sets.
trait Law {
    /// See there. To be marked `inline(always)`.
    fn respond<V: Vector>(&self, state: &mut State<V>, plane: bool);
}

/// A [`Law`] with its arguments.
struct Response<'a, L>(&'a L, &'a mut State, bool);

impl<L: Law> Kernel for Response<'_, L> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self(law, state, plane) = self;
        let mut own = state.read::<V>();
        law.respond(&mut own, plane);
        state.write(&own);
    }
}

/// A constitutive model with its parameters.
///
/// Updates compute each lane from that lane alone, so the bits of a particle do not depend on its
/// neighbours in the batch.
pub trait Material: std::fmt::Debug + Send + Sync {
    /// From the trial elastic tensor to the final one, stress, history, work and wave speed. `plane`
    /// says that the components xz and yz of all tensors are zero.
    fn update(&self, state: &mut State, plane: bool);

    /// Elastic energy per reference volume, J/m³.
    fn energy(&self, elastic: &Symmetric, plane: bool) -> Lanes;

    /// Density of the undeformed material, kg/m³.
    fn density(&self) -> f64;

    /// Greatest wave speed of the undeformed material, m/s.
    fn wave_speed(&self) -> f64;

    /// True for models that flow: they have history, do plastic work, and their stretch since the
    /// start is unbounded.
    fn is_plastic(&self) -> bool {
        false
    }

    /// Names of the history variables in use, at most [`HISTORIES`].
    fn history_names(&self) -> &'static [&'static str] {
        &[]
    }

    /// History variables of an undeformed particle.
    fn initial_history(&self) -> [f64; HISTORIES] {
        [0.0; HISTORIES]
    }
}

/// The model with these parameters and the density of the undeformed material, kg/m³.
pub fn build(parameters: &Parameters, density: f64) -> Box<dyn Material> {
    match *parameters {
        Parameters::NeoHookean(p) => {
            Box::new(neo_hookean::NeoHookean::new(Lame::new(p.young, p.poisson), density))
        }
        Parameters::FixedCorotated(p) => {
            Box::new(fixed_corotated::FixedCorotated::new(Lame::new(p.young, p.poisson), density))
        }
        Parameters::Hencky(p) => Box::new(hencky::Hencky::new(Lame::new(p.young, p.poisson), density)),
        Parameters::VonMises(ref p) => Box::new(von_mises::VonMises::new(p, density)),
        Parameters::DruckerPrager(ref p) => Box::new(drucker_prager::DruckerPrager::new(p, density)),
    }
}

/// Lamé's constants, Pa.
#[derive(Clone, Copy, Debug)]
pub struct Lame {
    /// First constant.
    pub lambda: f64,
    /// Shear modulus.
    pub mu: f64,
}

impl Lame {
    /// From Young's modulus (Pa) and Poisson's ratio.
    pub fn new(young: f64, poisson: f64) -> Self {
        Self {
            lambda: young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            mu: young / (2.0 * (1.0 + poisson)),
        }
    }

    /// Modulus of pressure waves, `λ + 2μ`.
    pub fn pressure_wave(&self) -> f64 {
        self.lambda + 2.0 * self.mu
    }
}

/// Updates a batch whose lane `i` is of material `index[i]`; the bits are those of each material
/// alone.
#[inline]
pub fn update(materials: &[Box<dyn Material>], index: &[u16; LANES], state: &mut State, plane: bool) {
    if index.iter().all(|&i| i == index[0]) {
        materials[usize::from(index[0])].update(state, plane);
        return;
    }
    let trial = *state;
    let mut pending = (1u32 << LANES) - 1;
    while pending != 0 {
        let first = index[pending.trailing_zeros() as usize];
        let bits = (0..LANES).filter(|&i| index[i] == first).fold(0, |bits, i| bits | 1 << i);
        let mut part = trial;
        materials[usize::from(first)].update(&mut part, plane);
        let mask = Mask::from_bits(bits);
        for c in 0..6 {
            state.elastic[c] = mask.select(part.elastic[c], state.elastic[c]);
            state.stress[c] = mask.select(part.stress[c], state.stress[c]);
        }
        for h in 0..HISTORIES {
            state.history[h] = mask.select(part.history[h], state.history[h]);
        }
        state.work = mask.select(part.work, state.work);
        state.wave_speed = mask.select(part.wave_speed, state.wave_speed);
        pending &= !bits;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::parameters::FrictionMatch;
    use super::*;

    /// The update with the processor's widest instructions against the one that this test is compiled for.
    fn instructions_change_no_bit<M: Material + Law>(model: &M, trial: State) {
        for plane in [false, true] {
            let (mut wide, mut plain) = (trial, trial);
            model.update(&mut wide, plane);
            model.respond(&mut plain, plane);
            for (wide, plain) in all(&wide).zip(all(&plain)) {
                assert_eq!(wide.map(f64::to_bits), plain.map(f64::to_bits), "{model:?}");
            }
        }
    }

    fn all(state: &State) -> impl Iterator<Item = [f64; LANES]> {
        let scalars = [state.work, state.wave_speed];
        let lanes = state.elastic.into_iter().chain(state.stress).chain(state.history).chain(scalars);
        lanes.map(Lanes::to_array)
    }

    proptest! {
        #[test]
        fn bits_do_not_depend_on_instructions(
            normal in prop::array::uniform3(prop::array::uniform8(0.7_f64..1.4)),
            shear in prop::array::uniform3(prop::array::uniform8(-0.2_f64..0.2)),
            history in prop::array::uniform8(0.0_f64..0.1),
        ) {
            let [xy, xz, yz] = shear.map(Lanes::new);
            let [xx, yy, zz] = normal.map(Lanes::new);
            let mut trial = State::new([xx, yy, zz, xy, xz, yz]);
            trial.history = [Lanes::new(history); HISTORIES];
            let (young, poisson, density) = (1e6, 0.3, 1500.0);
            let lame = Lame::new(young, poisson);
            instructions_change_no_bit(&neo_hookean::NeoHookean::new(lame, density), trial);
            instructions_change_no_bit(&fixed_corotated::FixedCorotated::new(lame, density), trial);
            instructions_change_no_bit(&hencky::Hencky::new(lame, density), trial);
            let metal = parameters::VonMises { young, poisson, yield_stress: 5e4, hardening: 1e5 };
            instructions_change_no_bit(&von_mises::VonMises::new(&metal, density), trial);
            let matching = FrictionMatch::default();
            let sand =
                parameters::DruckerPrager { young, poisson, friction_angle: 30.0, matching, volume_correction: true };
            instructions_change_no_bit(&drucker_prager::DruckerPrager::new(&sand, density), trial);
        }
    }
}
