//! Stages of a job, and when something acts.
use crate::boundary::absorbing::AbsorbingFaces;
use crate::boundary::{Contact, Leaving as LeavingPolicy};
use crate::load::Gravity;
use crate::solver::Equilibrium;

/// A stage of the run: its changes at the start, and its end.
#[derive(Clone, Debug)]
pub struct Stage<const D: usize> {
    /// Name; empty in a job without stages.
    pub name: String,
    /// Longest duration, s; infinite where only the end of the run or equilibrium ends it.
    pub duration: f64,
    /// Equilibrium to which kinetic damping leads, and at which the stage ends.
    pub equilibrium: Option<Equilibrium>,
    /// Bodies that are removed.
    pub removed: Vec<usize>,
    /// Bodies with their new materials.
    pub materials: Vec<(usize, usize)>,
    /// New gravity, its time counted from the start of the stage.
    pub gravity: Option<Gravity<D>>,
    /// New conditions on faces.
    pub faces: [[Option<Contact>; 2]; D],
    /// Material beyond the new faces that absorb waves.
    pub absorbing: AbsorbingFaces<D>,
    /// New treatment of particles that leave the domain.
    pub leaving: Option<LeavingPolicy>,
    /// Whether all material is at rest at the start.
    pub at_rest: bool,
    /// Whether displacements are counted from its start.
    pub reset_displacement: bool,
    /// Search for the factor of safety, with which the run ends.
    pub reduction: Option<FactorSearch>,
}

/// Search for the greatest factor with whose strength over it there is equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FactorSearch {
    /// First factor.
    pub from: f64,
    /// Last factor.
    pub to: f64,
    /// Growth of the factor in a load step.
    pub step: f64,
    /// Greatest difference between the last factor with equilibrium and the first without.
    pub tolerance: f64,
    /// Whether flow becomes associated (Davis 1968).
    pub davis: bool,
}

impl<const D: usize> Stage<D> {
    /// A stage that changes nothing and lasts to the end of the run.
    pub fn whole_run(equilibrium: Option<Equilibrium>) -> Self {
        Self {
            name: String::new(),
            duration: f64::INFINITY,
            equilibrium,
            removed: Vec::new(),
            materials: Vec::new(),
            gravity: None,
            faces: [[None; 2]; D],
            absorbing: std::array::from_fn(|_| [None, None]),
            leaving: None,
            at_rest: false,
            reset_displacement: false,
            reduction: None,
        }
    }
}

/// The stages in which a load or a collider acts; all of them: `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InStages(pub Option<Vec<usize>>);

impl InStages {
    /// Whether it acts in a stage.
    pub fn has(&self, stage: usize) -> bool {
        self.0.as_ref().is_none_or(|stages| stages.contains(&stage))
    }

    /// Time from which its own time is counted, s, with the times at which stages began. Infinite until it
    /// acts for the first time.
    pub fn clock(&self, starts: &[f64]) -> f64 {
        let first = self.0.as_ref().map_or(0, |stages| stages.iter().copied().min().unwrap_or(0));
        starts.get(first).copied().unwrap_or(f64::INFINITY)
    }
}
