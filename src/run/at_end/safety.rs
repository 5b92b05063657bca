//! The factor of safety that a stage with `strength_reduction` finds.
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::solver::Solver;
use crate::text::number;

/// Bounds of the factor of safety.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Safety {
    /// Greatest factor with equilibrium; `None` if there was none at the first.
    pub stands: Option<f64>,
    /// Least factor without equilibrium; `None` if the search ended before.
    pub slides: Option<f64>,
}

impl Safety {
    /// Not collective. What a solver in such a stage has found; the same on all ranks.
    pub fn of<const D: usize>(solver: &Solver<D>) -> Option<Self> {
        let (physics, time) = (&solver.physics, solver.clock.time);
        physics.reduction.as_ref()?;
        let has_stood = physics.stage_starts.last().is_none_or(|begun| time > *begun);
        let stands = has_stood.then(|| physics.strength_factor(time));
        Some(Self { stands, slides: solver.factor_without_equilibrium() })
    }
}

impl fmt::Display for Safety {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [stands, slides] =
            [self.stands, self.slides].map(|factor| factor.map(|factor| number(factor, 4)));
        match (stands, slides) {
            (Some(stands), Some(slides)) => write!(
                out,
                "factor of safety {stands}: equilibrium with the strength over {stands}, none over {slides}"
            ),
            (Some(stands), None) => {
                write!(
                    out,
                    "factor of safety above {stands}: equilibrium with the strength over {stands}, the last of the run"
                )
            }
            (None, Some(slides)) => {
                write!(out, "factor of safety below {slides}: no equilibrium with the strength over {slides}")
            }
            (None, None) => write!(out, "factor of safety not found: the stage has had no step"),
        }
    }
}
