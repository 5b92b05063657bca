//! `agimp weights`: the weights of given boxes on given trees, as a run would use them or by definition.
use std::io::Write as _;
use std::path::PathBuf;

use agimp::solver::diagnostics::weights::{NoWeights, evaluate, evaluate_rings};
use partition::comm::{Comm, World};

use super::Failure;
use super::shared::message::together;

/// Arguments of `agimp weights`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Trees and boxes (JSON): `dim`, `cells_per_octant_edge`, `trees` with `octants` as `[level, i, j(, k)]`
    /// in the unit square or cube, and `cases` with `id`, `tree`, `centre` and `half`.
    pub cases: PathBuf,
    /// Evaluate the definition cell by cell instead of scattering with the kernels of a run.
    #[arg(long)]
    pub direct: bool,
    /// Boxes are sections of rings: the first coordinate is the radius, 0 on the axis. Prints `s`, `grad` and
    /// `t`, the means of N, of its gradient and of N / r over the ring.
    #[arg(long)]
    pub axisymmetric: bool,
}

/// Carries out `agimp weights`.
///
/// # Errors
/// The file cannot be read, or asks for something impossible.
pub(super) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let world = World::init().map_err(|error| Failure::Run(error.to_string()))?;
    let comm = world.comm();
    together(comm, print(comm, arguments))
}

fn print(comm: &Comm, arguments: &Arguments) -> Result<(), Failure> {
    let explain = |message: String| Failure::Usage(format!("{}: {message}", arguments.cases.display()));
    let text = comm.agree(std::fs::read_to_string(&arguments.cases));
    let text = text.map_err(|disagreement| explain(disagreement.message))?;
    let output = match arguments.axisymmetric {
        true => evaluate_rings(comm, &text, arguments.direct).map(|output| serde_json::to_string(&output)),
        false => evaluate(comm, &text, arguments.direct).map(|output| serde_json::to_string(&output)),
    };
    let output = output.map_err(|failure| match failure {
        NoWeights::Cases(message) => explain(message),
        NoWeights::Run(message) => Failure::Run(message),
    })?;
    if comm.rank() == 0 {
        let text = output.map_err(|error| Failure::Run(error.to_string()))?;
        writeln!(std::io::stdout(), "{text}")?;
    }
    Ok(())
}
