//! Settings of a job for time steps, output and checkpoints.
use std::path::PathBuf;

use crate::io::snapshot::PointField as Field;
use crate::particle::followed::Followed;

/// End and time step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeSetup {
    /// End of the run, s; it ends with the first step that reaches this time.
    pub end: f64,
    /// Courant number.
    pub cfl: f64,
    /// Longest time step, s.
    pub dt_max: Option<f64>,
    /// Most that a step may exceed the one before it, as a factor.
    pub growth: f64,
}

/// Output files.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputSetup {
    /// Directory for all files of the run; made if missing.
    pub directory: PathBuf,
    /// Simulated time between output files, s; `None`: at the start and the end only.
    pub every: Option<f64>,
    /// Particle fields beside the position.
    pub fields: Vec<Field>,
    /// Quantities that particles carry for the fields.
    pub followed: Followed,
    /// Whether each output file carries the complete state, so that a run can restart from it.
    pub restart: bool,
    /// Whether a picture of the last state is drawn.
    pub picture: bool,
    /// Field that colours it; `None`: by the materials.
    pub picture_field: Option<Field>,
    /// Whether the run ends with a page for a browser.
    pub report: bool,
}

/// When checkpoints are written, beside the end of the run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckpointSetup {
    /// Steps between checkpoints.
    pub every_steps: Option<u64>,
    /// Simulated time between checkpoints, s.
    pub every_time: Option<f64>,
    /// Minutes of wall time between checkpoints.
    pub every_wall_minutes: Option<f64>,
    /// Checkpoints kept; older ones are deleted once a newer one is complete.
    pub keep: usize,
}
