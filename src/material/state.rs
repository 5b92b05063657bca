//! The state of a batch of particles, which a law updates.
use super::shock::{SHOCK_SUMS, Shock};
use super::tensor::eigen::Symmetric;
use crate::simd::{LANES, Lanes, Vector};

/// The history variable that measures plastic strain.
pub const PLASTIC_STRAIN: usize = 0;
/// The history variable that is the logarithm of the plastic volume ratio; 0 for models without.
pub const PLASTIC_VOLUME: usize = 1;
/// The first history variable that is a model's own, such as its temperature.
pub(super) const OWN: usize = PLASTIC_VOLUME + 1;

/// History variables that each particle has room for: as many as the law with most of them needs, by the list
/// of laws.
pub const HISTORIES: usize = super::laws::HISTORIES;

/// State of a batch of particles. Symmetric tensors have components `xx, yy, zz, xy, xz, yz`.
#[derive(Clone, Copy, Debug)]
pub struct State<V = Lanes> {
    /// Elastic left Cauchy-Green tensor: the trial value before, the final one after an update.
    pub elastic: Symmetric<V>,
    /// Kirchhoff stress after an update, Pa.
    pub stress: Symmetric<V>,
    /// History variables: [`PLASTIC_STRAIN`], [`PLASTIC_VOLUME`], then those of the model (see
    /// [`super::Material::history_names`]).
    pub history: [V; HISTORIES],
    /// Plastic work of the update per reference volume, J/m³; not negative.
    pub work: V,
    /// Upper bound of the wave speeds after an update, m/s.
    pub wave_speed: V,
    /// Work of artificial viscosity in the update per reference volume and the part of it that is heat of the
    /// material, J/m³; written only with such viscosity.
    pub shock: [V; SHOCK_SUMS],
}

impl<V: Vector> State<V> {
    /// A batch at rest with `elastic` as trial value and no history.
    pub fn new(elastic: Symmetric<V>) -> Self {
        let zero = V::splat(0.0);
        Self {
            elastic,
            stress: [zero; 6],
            history: [zero; HISTORIES],
            work: zero,
            wave_speed: zero,
            shock: [zero; SHOCK_SUMS],
        }
    }
}

impl State {
    /// In the registers of a kernel, with the first `histories` history variables.
    #[inline(always)]
    pub(super) fn read<V: Vector>(&self, histories: usize) -> State<V> {
        let mut state = State::new([V::splat(0.0); 6]);
        for c in 0..6 {
            state.elastic[c] = V::load(self.elastic[c].as_array());
            state.stress[c] = V::load(self.stress[c].as_array());
        }
        for h in 0..HISTORIES {
            if h < histories {
                state.history[h] = V::load(self.history[h].as_array());
            }
        }
        state.work = V::load(self.work.as_array());
        state.wave_speed = V::load(self.wave_speed.as_array());
        state
    }

    /// Takes over the registers of a kernel.
    #[inline(always)]
    pub(super) fn write<V: Vector>(&mut self, state: &State<V>, histories: usize, shock: bool) {
        for c in 0..6 {
            state.elastic[c].store(self.elastic[c].as_array_mut());
            state.stress[c].store(self.stress[c].as_array_mut());
        }
        for h in 0..HISTORIES {
            if h < histories {
                state.history[h].store(self.history[h].as_array_mut());
            }
        }
        state.work.store(self.work.as_array_mut());
        state.wave_speed.store(self.wave_speed.as_array_mut());
        if shock {
            for (own, work) in self.shock.iter_mut().zip(&state.shock) {
                work.store(own.as_array_mut());
            }
        }
    }
}

/// Arguments of a law beside the state.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Length of the step, s; 0 for an update without increment, in which nothing flows by its rate.
    pub dt: f64,
    /// Whether the components xz and yz of all tensors are zero.
    pub plane: bool,
    /// Edge of the cells on which the particles move, m: bounds the step of viscous flow.
    pub cell: f64,
    /// Edge of the cells that each particle was made for, m: regularises softening. 0: no cells. Set only for
    /// models that ask for it ([`super::Material::softens`]).
    pub size: [f64; LANES],
    /// Artificial viscosity; `None`: there is none.
    pub shock: Option<Shock>,
}

impl Step {
    /// An update without increment and without cells.
    pub fn rest(plane: bool) -> Self {
        Self { dt: 0.0, plane, cell: f64::INFINITY, size: [0.0; LANES], shock: None }
    }
}
