//! The stress that matter has borne.

/// How strongly matter that yields under pressure was loaded once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Consolidation {
    /// Overconsolidation ratio: the preconsolidation pressure over that of the yield surface through the
    /// stress; at least 1.
    Ratio(f64),
    /// The preconsolidation pressure, Pa.
    Pressure(f64),
}

/// The pressure of a stress that is the same along all directions, Pa; `None` for any other stress.
pub(super) fn even_pressure(stress: [f64; 3]) -> Option<f64> {
    let pressure = -stress[0];
    stress.iter().all(|s| (s + pressure).abs() <= 1e-12 * pressure.abs()).then_some(pressure)
}
