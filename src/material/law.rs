//! The trait of constitutive models ([`Law`]).
use super::consolidation::Consolidation;
use super::solid::Hencky;
use super::state::{HISTORIES, State, Step};
use crate::simd::Vector;

/// A constitutive model for the registers of any instruction set. [`super::Material`] follows from it.
///
/// Each lane is computed from that lane alone, so the bits of a particle do not depend on its neighbours in
/// the batch.
pub trait Law: std::fmt::Debug + Send + Sync {
    /// History columns that it reads and writes; 0 for laws without history.
    const HISTORIES: usize = 0;

    /// See [`super::Material::update`]. To be marked `inline(always)`.
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step);

    /// See [`super::Material::energy`]. To be marked `inline(always)`.
    fn energy<V: Vector>(&self, state: &State<V>, plane: bool) -> V;

    /// Takes up heat (J/m³, per reference volume) after an update: that of artificial viscosity. Returns the
    /// part that its energy has then; by default none. To be marked `inline(always)`.
    #[inline(always)]
    fn take_heat<V: Vector>(&self, _state: &mut State<V>, _heat: V) -> V {
        V::splat(0.0)
    }

    /// See [`super::Material::density`].
    fn density(&self) -> f64;

    /// See [`super::Material::wave_speed`].
    fn wave_speed(&self) -> f64;

    /// See [`super::Material::viscous_speed`].
    fn viscous_speed(&self, _cell: f64) -> f64 {
        0.0
    }

    /// See [`super::Material::rest_pressure`].
    fn rest_pressure(&self) -> f64 {
        0.0
    }

    /// See [`super::Material::history_names`].
    fn history_names(&self) -> &'static [&'static str] {
        &[]
    }

    /// See [`super::Material::initial_history`].
    fn initial_history(&self) -> [f64; HISTORIES] {
        [0.0; HISTORIES]
    }

    /// See [`super::Material::place_history`].
    fn place_history(&self, _place: &[f64], _time: f64, _history: &mut [f64; HISTORIES]) {}

    /// See [`super::Material::softens`].
    fn softens(&self) -> bool {
        false
    }

    /// See [`super::Material::is_fluid`].
    fn is_fluid(&self) -> bool {
        false
    }

    /// See [`super::Material::is_firm`].
    fn is_firm(&self) -> bool {
        false
    }

    /// See [`super::Material::bears_tension`].
    fn bears_tension(&self) -> bool {
        true
    }

    /// The elastic part of the law, where it is that of Hencky.
    fn solid(&self) -> Option<&Hencky> {
        None
    }

    /// See [`super::Material::strain_under`]. By default that of [`Law::solid`]; without either, no body of
    /// this law can start under stress.
    fn strain_under(
        &self,
        stress: [f64; 3],
        consolidation: Option<Consolidation>,
        history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]> {
        Law::strain_under(self.solid()?, stress, consolidation, history)
    }

    /// See [`super::Material::consolidates`].
    fn consolidates(&self) -> bool {
        false
    }

    /// See [`super::Material::alike`].
    fn alike(&self, _a: &[f64; HISTORIES], _b: &[f64; HISTORIES]) -> bool {
        true
    }

    /// See [`super::Material::has_failed`].
    fn has_failed(&self, _history: &[f64; HISTORIES]) -> bool {
        false
    }
}
