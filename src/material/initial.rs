//! States under a given stress, for bodies that do not start without one.
//!
//! All models are isotropic, so stress and elastic strain have the same principal directions, and a law has
//! to invert three numbers only ([`Law::strain_under`](super::Law::strain_under)). Its answer goes through an
//! update, which yields where the stress lies outside the yield surface: so no law states its yield surface
//! twice.
use super::eigen::{Symmetric, decompose};
use super::{Consolidation, HISTORIES, Material, PLASTIC_VOLUME, State, Step};
use crate::simd::{Lanes, Vector};
use crate::text::quantity;

/// State of a particle under stress.
#[derive(Clone, Copy, Debug)]
pub struct Stressed {
    /// Elastic left Cauchy-Green tensor, `xx, yy, zz, xy, xz, yz`.
    pub elastic: [f64; 6],
    /// Kirchhoff stress, Pa.
    pub stress: [f64; 6],
    /// History variables.
    pub history: [f64; HISTORIES],
    /// Volume over the reference volume.
    pub volume_ratio: f64,
}

/// Why there is no state under a stress.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoState {
    /// No elastic strain has this stress.
    #[error("no elastic strain of the material has this stress")]
    Unreachable,
    /// It yields.
    #[error(
        "the material yields, at a shear stress of {} and a pressure of {}; requested {} and {}",
        quantity(found[0], "Pa"),
        quantity(found[1], "Pa"),
        quantity(asked[0], "Pa"),
        quantity(asked[1], "Pa")
    )]
    Yields {
        /// Shear stress `√(3/2) |dev σ|` and pressure after yield, Pa.
        found: [f64; 2],
        /// Requested shear stress and pressure, Pa.
        asked: [f64; 2],
    },
}

impl NoState {
    /// Changes of a job that would give a state.
    pub fn expected(&self) -> &'static str {
        match self {
            Self::Unreachable => {
                "a stress that an elastic strain has: another k0, a lower stress, or stiffer material"
            }
            Self::Yields { .. } => {
                "a stress inside the yield surface: another k0, more cohesion, a higher preconsolidation pressure, or relax = true, which returns it to the surface"
            }
        }
    }
}

/// Largest part of a stress that may be lost to rounding on the way to the strain and back.
const TOLERANCE: f64 = 1e-9;

/// Long enough for all rate-dependent flow to end, s.
const LONG: f64 = 1e9;

/// The state of a material under a Cauchy stress (Pa, `xx, yy, zz, xy, xz, yz`). `plane`: xz and yz are zero.
///
/// # Errors
/// The material cannot have this stress, or yields under it.
pub fn under_stress(
    material: &dyn Material,
    stress: &[f64; 6],
    consolidation: Option<Consolidation>,
    plane: bool,
) -> Result<Stressed, NoState> {
    under_stress_after(material, stress, consolidation, material.initial_history(), plane)
}

/// As [`under_stress`], for a material with a history.
///
/// # Errors
/// See [`under_stress`].
pub fn under_stress_after(
    material: &dyn Material,
    stress: &[f64; 6],
    consolidation: Option<Consolidation>,
    mut history: [f64; HISTORIES],
    plane: bool,
) -> Result<Stressed, NoState> {
    let (elastic, volume_ratio) = elastic_under(material, stress, consolidation, &mut history, plane)?;
    let mut state = State::new(elastic.map(Lanes::splat));
    state.history = history.map(Lanes::splat);
    material.update(&mut state, &Step { dt: LONG, ..Step::rest(plane) });
    let first = |value: Lanes| value.to_array()[0];
    let found = state.stress.map(first);
    let asked = stress.map(|component| component * volume_ratio);
    // Strains are small compared with 1, so the rounding of the elastic tensor appears in the stress as a
    // share of the modulus.
    let modulus = material.density() * material.wave_speed() * material.wave_speed();
    let difference: [f64; 6] = std::array::from_fn(|c| found[c] - asked[c]);
    let (lost, allowed) = (norm(&difference), TOLERANCE * norm(&asked) + 1e-13 * modulus);
    if lost.is_nan() || lost > allowed {
        if !material.is_plastic() && !material.is_fluid() {
            return Err(NoState::Unreachable);
        }
        let both = |tensor: &[f64; 6]| {
            let pressure = -(tensor[0] + tensor[1] + tensor[2]) / 3.0;
            let mut deviator = *tensor;
            deviator[..3].iter_mut().for_each(|normal| *normal += pressure);
            [1.5_f64.sqrt() * norm(&deviator) / volume_ratio, pressure / volume_ratio]
        };
        return Err(NoState::Yields { found: both(&found), asked: both(&asked) });
    }
    Ok(Stressed {
        elastic: state.elastic.map(first),
        stress: found,
        history: state.history.map(first),
        volume_ratio,
    })
}

/// The state of a material in which the elastic strain under a Cauchy stress (Pa, `xx, yy, zz, xy, xz, yz`)
/// has yielded to the end: on the yield surface, where the stress lies outside.
///
/// # Errors
/// No elastic strain has this stress, or none is left.
pub fn yielded(
    material: &dyn Material,
    stress: &[f64; 6],
    consolidation: Option<Consolidation>,
    plane: bool,
) -> Result<Stressed, NoState> {
    let mut history = material.initial_history();
    let (elastic, _) = elastic_under(material, stress, consolidation, &mut history, plane)?;
    let state = under_strain(material, &elastic, history, plane);
    let numbers = state.elastic.iter().chain(&state.stress).chain(&state.history);
    let is_sane = state.volume_ratio > 0.0 && numbers.into_iter().all(|n| n.is_finite());
    if is_sane { Ok(state) } else { Err(NoState::Unreachable) }
}

/// The elastic left Cauchy-Green tensor under a Cauchy stress, and the volume over the reference volume.
fn elastic_under(
    material: &dyn Material,
    stress: &[f64; 6],
    consolidation: Option<Consolidation>,
    history: &mut [f64; HISTORIES],
    plane: bool,
) -> Result<([f64; 6], f64), NoState> {
    let (principal, directions) = principal(stress, plane);
    let strain = material
        .strain_under(principal, consolidation, history)
        .filter(|strain| strain.iter().all(|e| e.is_finite()))
        .ok_or(NoState::Unreachable)?;
    let volume_ratio = libm::exp(strain.iter().sum::<f64>() + history[PLASTIC_VOLUME]);
    Ok((compose(&strain.map(|e| libm::exp(2.0 * e)), &directions), volume_ratio))
}

/// The state of a material with an elastic left Cauchy-Green tensor (`xx, yy, zz, xy, xz, yz`), yielded where
/// it has to.
pub fn under_strain(
    material: &dyn Material,
    elastic: &[f64; 6],
    history: [f64; HISTORIES],
    plane: bool,
) -> Stressed {
    let mut state = State::new(elastic.map(Lanes::splat));
    state.history = history.map(Lanes::splat);
    material.update(&mut state, &Step { dt: LONG, ..Step::rest(plane) });
    let first = |value: Lanes| value.to_array()[0];
    let [xx, yy, zz, xy, xz, yz] = state.elastic.map(first);
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let history = state.history.map(first);
    Stressed {
        elastic: [xx, yy, zz, xy, xz, yz],
        stress: state.stress.map(first),
        history,
        volume_ratio: determinant.sqrt() * libm::exp(history[PLASTIC_VOLUME]),
    }
}

/// Norm of a symmetric tensor.
fn norm(tensor: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, xz, yz] = tensor;
    (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)).sqrt()
}

/// Principal values of a stress, and principal directions in the rows of a matrix.
fn principal(stress: &[f64; 6], plane: bool) -> ([f64; 3], [[f64; 3]; 3]) {
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    if stress[3..] == [0.0; 3] {
        return ([stress[0], stress[1], stress[2]], unit);
    }
    // Rotations require a positive definite matrix.
    let shift = 2.0 * norm(stress);
    let mut shifted: Symmetric<Lanes> = stress.map(Lanes::splat);
    for normal in &mut shifted[..3] {
        *normal += Lanes::splat(shift);
    }
    let eigen = decompose(&shifted, plane);
    let first = |value: Lanes| value.to_array()[0];
    (eigen.value.map(|value| first(value) - shift), eigen.vector.map(|row| row.map(first)))
}

/// The symmetric tensor with these principal values.
fn compose(value: &[f64; 3], vector: &[[f64; 3]; 3]) -> [f64; 6] {
    [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
        .map(|(i, j)| (0..3).map(|k| vector[k][i] * value[k] * vector[k][j]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::laws::{Visitor, for_each_law};
    use crate::material::{Law, Parameters, build};

    /// Stresses that all models but fluids carry: small beside their strengths, or isotropic. Counts the
    /// models that can start under stress.
    #[derive(Default)]
    struct GivesBack(std::cell::Cell<usize>);

    impl Visitor for GivesBack {
        fn visit(&self, example: &str, law: &impl Law) {
            if Law::strain_under(law, [-1.0; 3], None, &mut [0.0; HISTORIES]).is_none() {
                return;
            }
            self.0.set(self.0.get() + 1);
            let fluid = example.contains("'fluid'") || example.contains("'gas'");
            // Inside every yield surface: pressure, a tenth of it as shear.
            let sheared = [-2e3, -1.9e3, -2.1e3, 50.0, 0.0, 0.0];
            let turned = [-2e3, -1.95e3, -2.05e3, 40.0, 30.0, -20.0];
            let given = if fluid { vec![[-2e3, -2e3, -2e3, 0.0, 0.0, 0.0]] } else { vec![sheared, turned] };
            for stress in given {
                let clay = example.contains("'cam_clay'").then_some(Consolidation::Ratio(2.0));
                let plane = stress[4] == 0.0;
                let stressed = under_stress(law, &stress, clay, plane)
                    .unwrap_or_else(|fault| panic!("{example}: {fault}"));
                for c in 0..6 {
                    let found = stressed.stress[c] / stressed.volume_ratio;
                    assert!((found - stress[c]).abs() < 2e-9 * 2e3, "{example}: {c}: {found} for {stress:?}");
                }
                let b = &stressed.elastic;
                let square = b[0] * (b[1] * b[2] - b[5] * b[5]) - b[3] * (b[3] * b[2] - b[5] * b[4])
                    + b[4] * (b[3] * b[5] - b[1] * b[4]);
                let volume = square.sqrt() * libm::exp(stressed.history[PLASTIC_VOLUME]);
                assert!((volume / stressed.volume_ratio - 1.0).abs() < 1e-14, "{example}");
            }
        }
    }

    #[test]
    fn every_model_has_the_stress_that_was_asked_for() {
        let models = GivesBack::default();
        for_each_law(&models);
        assert!(models.0.get() >= 14, "{} models can start under stress", models.0.get());
    }

    fn law(text: &str) -> Box<dyn Material> {
        build(&text.parse::<Parameters>().unwrap_or_else(|fault| panic!("{fault}")), 1800.0)
    }

    #[test]
    fn stress_beyond_the_yield_surface_is_refused() {
        let sand = law("model = 'mohr_coulomb', young = 1e7, poisson = 0.3, friction_angle = 30.0");
        let vertical = |ratio: f64| [-1e4 * ratio, -1e4, -1e4 * ratio, 0.0, 0.0, 0.0];
        // Rankine's active and passive states of 30 degrees: 1/3 and 3.
        for (ratio, fits) in [(0.335, true), (0.331, false), (2.99, true), (3.01, false)] {
            let found = under_stress(&*sand, &vertical(ratio), None, true);
            assert_eq!(found.is_ok(), fits, "{ratio}: {found:?}");
        }
        let metal =
            law("model = 'von_mises', young = 1e9, poisson = 0.3, yield_stress = 1e6, viscosity = 20.0");
        assert!(under_stress(&*metal, &[9.9e5, 0.0, 0.0, 0.0, 0.0, 0.0], None, false).is_ok());
        let beyond = under_stress(&*metal, &[1.02e6, 0.0, 0.0, 0.0, 0.0, 0.0], None, false);
        assert!(matches!(beyond, Err(NoState::Yields { .. })), "{beyond:?}");
        let water = law("model = 'fluid', bulk_modulus = 1e6");
        let sheared = under_stress(&*water, &[-1e3, -2e3, -1e3, 0.0, 0.0, 0.0], None, true);
        assert_eq!(sheared.err(), Some(NoState::Unreachable));
    }

    /// Outside the yield surface the state is that on it: Rankine's ratio for sand, the yield stress for
    /// metal; inside it is that under the stress.
    #[test]
    fn what_yields_returns_to_the_surface() {
        let sand = law("model = 'mohr_coulomb', young = 1e7, poisson = 0.3, friction_angle = 30.0");
        for (ratio, limit) in [(0.2, 1.0 / 3.0), (5.0, 3.0)] {
            let state =
                yielded(&*sand, &[-1e4 * ratio, -1e4, -1e4 * ratio, 0.0, 0.0, 0.0], None, true).unwrap();
            let [horizontal, vertical] = [state.stress[0], state.stress[1]];
            assert!((horizontal / vertical - limit).abs() < 1e-9 * limit, "{ratio}: {horizontal} {vertical}");
            // A second update changes nothing.
            let again = under_strain(&*sand, &state.elastic, state.history, true);
            for c in 0..6 {
                assert!((again.stress[c] - state.stress[c]).abs() < 1e-6, "{c}");
            }
        }
        let inside = [-5e3, -1e4, -5e3, 0.0, 0.0, 0.0];
        let (one, other) = (yielded(&*sand, &inside, None, true), under_stress(&*sand, &inside, None, true));
        assert_eq!(one.unwrap().stress, other.unwrap().stress);
        let metal = law("model = 'von_mises', young = 1e9, poisson = 0.3, yield_stress = 1e6");
        let state = yielded(&*metal, &[2e6, 0.0, 0.0, 0.0, 0.0, 0.0], None, false).unwrap();
        assert!(((state.stress[0] - state.stress[1]).abs() / 1e6 - 1.0).abs() < 1e-9, "{state:?}");
    }

    /// The yield surface passes through the stress at a ratio of 1; its size is that of the closed form at
    /// any other.
    #[test]
    fn clay_is_consolidated_as_asked_for() {
        let text = "model = 'cam_clay', shear_modulus = 4e6, critical_stress_ratio = 1.2, compression_index = 0.1, \
                    swelling_index = 0.02, pressure = 1e4, preconsolidation_pressure = 2e4";
        let clay = law(text);
        let stress = [-6e4, -1e5, -6e4, 0.0, 0.0, 0.0];
        let (p, q) = (22e4 / 3.0, 4e4);
        let on_surface = p + q * q / (1.44 * p);
        for ratio in [1.0, 1.5, 4.0] {
            let by_ratio = under_stress(&*clay, &stress, Some(Consolidation::Ratio(ratio)), true).unwrap();
            let given = Consolidation::Pressure(ratio * on_surface * (1.0 + 1e-13));
            let by_pressure = under_stress(&*clay, &stress, Some(given), true).unwrap();
            let of = |stressed: &Stressed| {
                // p_c = p_c0 exp(e_p / (λ - κ)), a Kirchhoff stress.
                2e4 * (-stressed.history[PLASTIC_VOLUME] / 0.08).exp() / stressed.volume_ratio
            };
            assert!((of(&by_ratio) / (ratio * on_surface) - 1.0).abs() < 1e-12, "{ratio}");
            assert!((of(&by_pressure) / of(&by_ratio) - 1.0).abs() < 1e-12, "{ratio}");
        }
        let beyond = under_stress(&*clay, &stress, Some(Consolidation::Pressure(0.9 * on_surface)), true);
        assert!(matches!(beyond, Err(NoState::Yields { .. })), "{beyond:?}");
        // As made, it is consolidated to 20 kPa only.
        assert!(under_stress(&*clay, &stress, None, true).is_err());
    }
}
