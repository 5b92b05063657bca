//! Names that files carry.
use std::path::PathBuf;

use crate::job::Problem;
use crate::solver::Solver;

/// Names that files carry, in the order of the numbers in tags.
pub(super) struct Names {
    pub(super) materials: Vec<String>,
    /// Stiffness of water that cannot leave the pores, by material, Pa.
    pub(super) water_moduli: Vec<f64>,
    pub(super) bodies: Vec<String>,
    pub(super) histories: Vec<String>,
    /// The job file, from the root of the file system; empty if it is not there any more.
    pub(super) job_file: PathBuf,
}

impl Names {
    pub(super) fn of<const D: usize>(problem: &Problem<D>, solver: &Solver<D>) -> Self {
        Self {
            materials: problem.materials.iter().map(|material| material.name.clone()).collect(),
            water_moduli: solver.physics.materials.iter().map(|m| m.water_modulus()).collect(),
            bodies: problem.bodies.iter().map(|body| body.name.clone()).collect(),
            histories: solver.physics.materials.iter().map(|m| m.history_names().join(" ")).collect(),
            job_file: problem.path.canonicalize().unwrap_or_default(),
        }
    }
}
