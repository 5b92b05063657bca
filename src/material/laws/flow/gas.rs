//! Ideal and stiffened gas: `p = (γ - 1) ρ e - γ p_∞`, without viscosity.
//!
//! The elastic tensor is `J^(2/3) I`. With the entropy over the heat capacity since the start,
//! `s = ln((p + p_∞) J^γ / (p_0 + p_∞))`, which is the only history variable, pressure and internal energy
//! are functions of the state,
//! ```text
//! p + p_∞ = (p_0 + p_∞) e^s J^-γ,   ρ_0 e = W = (p_0 + p_∞) e^s J^(1-γ)/(γ-1) + p_∞ J,   p = -∂W/∂J at s
//! ```
//! so gas that is compressed and widened without heat comes back to its pressure whatever the steps, and heat
//! h per reference volume, that of artificial viscosity, adds `ln(1 + h/T)` to s, where T is the first part
//! of W: the energy grows by h to round-off.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::material::consolidation::{Consolidation, even_pressure};
use crate::material::laws::Model;
use crate::material::parameters::OutOfRange;
use crate::material::tensor::eigen;
use crate::material::tensor::strain::Strain;
use crate::material::{HISTORIES, Law, State, Step};
use crate::simd::math::{exp, ln};
use crate::simd::{Vector, VectorMask};

/// History variable of s: a measure of what is irreversible, as plastic strain is in solids.
const ENTROPY: usize = 0;

/// Ideal or stiffened gas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameters {
    /// Pressure p at the start, at the density of the material, Pa. The internal energy there is
    /// `(p + γ p_∞) / ((γ - 1) density)`, J/kg.
    #[schemars(range(min = 0.0, max = 1e13))]
    pub pressure: f64,
    /// Ratio γ of the heat capacities: 1.4 in air, 5/3 in gas of single atoms, about 4.4 in stiffened water.
    #[serde(default = "air")]
    #[schemars(range(max = 20.0), extend("exclusiveMinimum" = 1.0))]
    pub adiabatic_index: f64,
    /// Stiffening pressure p_∞, Pa: 0 in an ideal gas, about 6e8 in water. With it, matter bears tension.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e13))]
    pub stiffening: f64,
}

fn air() -> f64 {
    1.4
}

/// Law of a gas.
#[derive(Clone, Copy, Debug)]
pub struct Gas {
    /// p_0, Pa.
    pressure: f64,
    gamma: f64,
    /// p_∞, Pa.
    stiffening: f64,
    density: f64,
}

impl Model for Gas {
    type Parameters = Parameters;

    fn new(p: &Parameters, density: f64) -> Self {
        Self { pressure: p.pressure, gamma: p.adiabatic_index, stiffening: p.stiffening, density }
    }

    fn check(p: &Parameters) -> Result<(), OutOfRange> {
        if p.pressure + p.stiffening > 0.0 {
            return Ok(());
        }
        let range =
            "above 0 without stiffening: sound would not travel; for cold gas a small pressure".into();
        Err(OutOfRange { key: "pressure".into(), value: p.pressure, range })
    }

    fn examples() -> &'static [&'static str] {
        &[
            "model = 'gas', pressure = 1e5",
            "model = 'gas', pressure = 1e3, adiabatic_index = 4.4, stiffening = 1e6",
        ]
    }
}

impl Gas {
    /// `p_0 + p_∞`, Pa.
    fn adiabat(&self) -> f64 {
        self.pressure + self.stiffening
    }

    /// `(p + p_∞) J`, Pa, at a logarithm of J.
    #[inline(always)]
    fn stiffness<V: Vector>(&self, state: &State<V>, trace: V) -> V {
        exp(trace.mul_add(V::splat(1.0 - self.gamma), state.history[ENTROPY])) * self.adiabat()
    }

    /// Along any direction `ρ_0 c² = J² ∂²W/∂J² = γ (p + p_∞) J`.
    #[inline(always)]
    fn sound<V: Vector>(&self, stiffness: V) -> V {
        (stiffness * (self.gamma / self.density)).sqrt()
    }
}

impl Law for Gas {
    const HISTORIES: usize = ENTROPY + 1;

    #[inline(always)]
    fn respond<V: Vector>(&self, state: &mut State<V>, step: &Step) {
        let zero = V::splat(0.0);
        let strain = Strain::of(&state.elastic, step.plane);
        let stiffness = self.stiffness(state, strain.trace);
        let tension = exp(strain.trace).mul_add(V::splat(self.stiffening), -stiffness);
        // A particle that is not sheared keeps its bits.
        let sheared = zero.lt(strain.norm);
        if sheared.any() {
            let stretch = exp(strain.trace * (2.0 / 3.0));
            for c in 0..6 {
                let own = if c < 3 { stretch } else { zero };
                state.elastic[c] = sheared.select(own, state.elastic[c]);
            }
        }
        state.stress = [tension, tension, tension, zero, zero, zero];
        state.work = zero;
        state.wave_speed = self.sound(stiffness);
    }

    /// W less its value at the start.
    #[inline(always)]
    fn energy<V: Vector>(&self, state: &State<V>, _plane: bool) -> V {
        let trace = ln(eigen::determinant(&state.elastic)) * 0.5;
        let thermal = (self.stiffness(state, trace) - V::splat(self.adiabat())) * (1.0 / (self.gamma - 1.0));
        (exp(trace) - V::splat(1.0)).mul_add(V::splat(self.stiffening), thermal)
    }

    /// The gas takes it up: nothing is work of its own.
    #[inline(always)]
    fn take_heat<V: Vector>(&self, state: &mut State<V>, heat: V) -> V {
        let gain = heat * (self.gamma - 1.0);
        let stiffness = state.wave_speed * state.wave_speed * (self.density / self.gamma);
        let entropy = state.history[ENTROPY];
        state.history[ENTROPY] = entropy + ln(gain / stiffness + V::splat(1.0));
        for normal in &mut state.stress[..3] {
            *normal = *normal - gain;
        }
        state.wave_speed = self.sound(stiffness + gain);
        heat
    }

    fn density(&self) -> f64 {
        self.density
    }

    fn wave_speed(&self) -> f64 {
        (self.gamma * self.adiabat() / self.density).sqrt()
    }

    fn rest_pressure(&self) -> f64 {
        self.pressure
    }

    fn bears_tension(&self) -> bool {
        self.stiffening > 0.0
    }

    fn history_names(&self) -> &'static [&'static str] {
        &["entropy"]
    }

    /// The gas has the density of the material under any pressure that is the same along all directions; what
    /// differs is its energy.
    fn strain_under(
        &self,
        stress: [f64; 3],
        _consolidation: Option<Consolidation>,
        history: &mut [f64; HISTORIES],
    ) -> Option<[f64; 3]> {
        let pressure = even_pressure(stress).filter(|p| p + self.stiffening > 0.0)?;
        history[ENTROPY] = libm::log((pressure + self.stiffening) / self.adiabat());
        Some([0.0; 3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::batches::advance::advance;
    use crate::material::driver::Point;
    use crate::material::{Shock, Viscosity};
    use crate::simd::{LANES, Lanes};

    fn gas(text: &str) -> Gas {
        match text.parse() {
            Ok(crate::material::Parameters::Gas(parameters)) => Gas::new(&parameters, 1.2),
            other => panic!("{other:?}"),
        }
    }

    /// `(p + p_∞) J^γ` is constant whatever path leads there, and the energy is the work that was done.
    #[test]
    fn compression_without_heat_is_adiabatic() {
        for (text, gamma, start, stiffening) in [
            ("model = 'gas', pressure = 1e5", 1.4, 1e5, 0.0),
            ("model = 'gas', pressure = 1e5, adiabatic_index = 4.4, stiffening = 6e8", 4.4, 1e5, 6e8),
        ] {
            let law = gas(text);
            let mut point = Point::new(&law);
            assert!((point.stress[0] / -start - 1.0).abs() < 1e-9, "{point:?}");
            for strains in [[-0.7, 0.0, 0.0], [0.1, 0.3, -0.2], [0.2, 0.5, 0.4]] {
                for _ in 0..10 {
                    point.stretch(strains.map(|strain| 0.1 * strain));
                }
                let volume =
                    libm::pow(eigen::determinant(&point.elastic.map(Lanes::splat)).to_array()[0], 0.5);
                let exact = (start + stiffening) * libm::pow(volume, -gamma) - stiffening;
                let scale = exact.abs() + stiffening;
                for normal in &point.stress[..3] {
                    assert!((normal / volume + exact).abs() < 1e-12 * scale, "{normal} at {volume}: {exact}");
                }
                let energy = |volume: f64| {
                    (start + stiffening) * libm::pow(volume, 1.0 - gamma) / (gamma - 1.0)
                        + stiffening * volume
                };
                let gain = energy(volume) - energy(1.0);
                assert!((point.energy() - gain).abs() < 1e-12 * energy(1.0), "{} {gain}", point.energy());
                let speed = (gamma * (exact + stiffening) * volume / 1.2).sqrt();
                assert!((point.wave_speed / speed - 1.0).abs() < 1e-12, "{} {speed}", point.wave_speed);
            }
            assert_eq!((point.history[ENTROPY], point.work), (0.0, 0.0));
        }
    }

    /// The work of the artificial pressure is what the energy grows by, and `p = (γ - 1) ρ e - γ p_∞` holds.
    #[test]
    fn artificial_viscosity_heats() {
        for (text, gamma, stiffening) in [
            ("model = 'gas', pressure = 1e5", 1.4, 0.0),
            ("model = 'gas', pressure = 1e3, adiabatic_index = 4.4, stiffening = 1e6", 4.4, 1e6),
        ] {
            let law = gas(text);
            let viscosity = Viscosity { linear: 0.5, quadratic: 4.0 };
            let rate = std::array::from_fn(|lane| 20.0 - 100.0 * lane as f64);
            let still = Step { dt: 1e-4, cell: 0.1, ..Step::rest(false) };
            let step = Step { shock: Some(Shock { viscosity, rate }), ..still };
            let stretch = Lanes::splat(0.81);
            let zero = Lanes::splat(0.0);
            let mut cold = State::new([stretch, stretch, stretch, zero, zero, zero]);
            cold.history[ENTROPY] = Lanes::splat(0.1);
            let mut hot = cold;
            advance(&law, &mut cold, &still);
            advance(&law, &mut hot, &step);
            let energies = [&cold, &hot].map(|state| law.energy(state, false).to_array());
            let pressures = [&cold, &hot].map(|state| state.stress[0].to_array());
            let [slow, quick] = [&cold, &hot].map(|state| state.wave_speed.to_array());
            let after = {
                let mut again = hot;
                advance(&law, &mut again, &still);
                (again.stress[0].to_array(), again.wave_speed.to_array())
            };
            for lane in 0..LANES {
                let closing = (-rate[lane]).max(0.0);
                let heat = energies[1][lane] - energies[0][lane];
                let artificial = after.0[lane] - pressures[1][lane];
                let scale = energies[0][lane].abs() + 1.2 * slow[lane] * slow[lane];
                assert!((heat - artificial * closing * 1e-4).abs() < 1e-12 * scale, "{heat} {artificial}");
                let jump = 0.1 * closing;
                let exact = 1.2 * jump * (4.0 * jump + 0.5 * slow[lane]);
                assert!((artificial - exact).abs() < 1e-11 * scale, "{artificial} {exact}");
                let warmed = (pressures[0][lane] - after.0[lane]) / (gamma - 1.0);
                assert!((warmed - heat).abs() < 1e-11 * scale, "{warmed} {heat}");
                let damping = 0.5 * after.1[lane] + 8.0 * jump;
                let bound = if closing > 0.0 { damping + damping.hypot(after.1[lane]) } else { slow[lane] };
                assert!((quick[lane] / bound - 1.0).abs() < 1e-9, "{} {bound}", quick[lane]);
            }
            assert!(stiffening >= 0.0 && hot.work.to_array() == [0.0; LANES]);
        }
    }

    /// Under any even pressure the gas keeps its density; other stresses it cannot have.
    #[test]
    fn pressure_at_the_start_is_energy() {
        let law = gas("model = 'gas', pressure = 1e5");
        let mut history = [0.0; HISTORIES];
        let strain = Law::strain_under(&law, [-3e5; 3], None, &mut history);
        assert_eq!(strain, Some([0.0; 3]));
        assert!((history[ENTROPY] - libm::log(3.0)).abs() < 1e-15);
        assert_eq!(Law::strain_under(&law, [-3e5, -2e5, -3e5], None, &mut history), None);
        assert_eq!(Law::strain_under(&law, [0.0; 3], None, &mut history), None);
    }
}
