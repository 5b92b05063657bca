//! Command line of agimp: one file per subcommand, and `shared/` for code that several need. The only part of
//! the program that prints. The library of the solver is the package `agimp-solver`, in `src/`.
use clap::{Parser, Subcommand};
use partition::World;
use std::sync::LazyLock;

// Private, so that the compiler finds a subcommand that is not in `Command`.
mod bench;
mod check;
mod files;
mod material;
mod new;
#[cfg(not(feature = "post"))]
mod no_results;
#[cfg(feature = "post")]
mod results;
mod run;
mod schema;
mod shared;
mod sweep;
mod weights;

use self::files::{diff, digest, info};
#[cfg(feature = "post")]
use self::results::{export, movie, plot, report, view};
pub use self::shared::failure::Failure;
pub use self::shared::message::unusable;

/// Adaptive generalized interpolation material point method on a distributed octree.
#[derive(Debug, Parser)]
#[command(name = "agimp", version, long_version = build(), about, arg_required_else_help = true)]
pub struct Arguments {
    /// Subcommand.
    #[command(subcommand)]
    pub command: Command,
}

/// The version, and with which MPI library this program is built.
fn build() -> &'static str {
    static BUILD: LazyLock<String> =
        LazyLock::new(|| format!("{} ({})", env!("CARGO_PKG_VERSION"), World::library()));
    BUILD.as_str()
}

/// Subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a job; under `mpirun` on all its ranks.
    Run(run::Arguments),
    /// Run a job for each combination of values, and put the results into one table.
    Sweep(sweep::Arguments),
    /// Check a job file and print its size and cost, without running it.
    Check(check::Arguments),
    /// Print the JSON schema of job files.
    Schema(schema::Arguments),
    /// Write a commented job file as a starting point.
    New(new::Arguments),
    /// Show the contents of an output or checkpoint file.
    Info(info::Arguments),
    #[cfg(feature = "post")]
    /// Draw the particles of an output file as PNG.
    Plot(plot::Arguments),
    #[cfg(feature = "post")]
    /// Draw the outputs of a run as a movie.
    Movie(movie::Arguments),
    #[cfg(feature = "post")]
    /// Write the particles of outputs for other programs: PLY, CSV, VTP.
    Export(export::Arguments),
    #[cfg(feature = "post")]
    /// Write an HTML page of a run: pictures, curves, numbers, time by phase, the job.
    Report(report::Arguments),
    #[cfg(feature = "post")]
    /// Write an HTML page that shows particles and tree in a browser: rotate, zoom, play, cut, read values.
    View(view::Arguments),
    /// Print a number that is equal for equal states, for any number of ranks that wrote the files.
    Digest(digest::Arguments),
    /// Show where the states in two files differ.
    Diff(diff::Arguments),
    /// Drive one particle of a material along a path of deformation.
    Material(material::Arguments),
    /// Print the weights of given boxes on given trees.
    Weights(weights::Arguments),
    /// Measure the speed of whole steps on built-in jobs.
    Bench(bench::Arguments),
}

/// Carries out a command.
///
/// # Errors
/// Wrong input, or a failure on the way; [`Failure::exit_code`] distinguishes them.
pub fn execute(command: Command) -> Result<(), Failure> {
    match command {
        Command::Run(arguments) => run::execute(&arguments),
        Command::Sweep(arguments) => sweep::execute(&arguments),
        Command::Check(arguments) => check::execute(&arguments),
        Command::Schema(arguments) => schema::execute(&arguments),
        Command::New(arguments) => new::execute(&arguments),
        Command::Info(arguments) => info::execute(&arguments),
        #[cfg(feature = "post")]
        Command::Plot(arguments) => plot::execute(&arguments),
        #[cfg(feature = "post")]
        Command::Movie(arguments) => movie::execute(&arguments),
        #[cfg(feature = "post")]
        Command::Export(arguments) => export::execute(&arguments),
        #[cfg(feature = "post")]
        Command::Report(arguments) => report::execute(&arguments),
        #[cfg(feature = "post")]
        Command::View(arguments) => view::execute(&arguments),
        Command::Digest(arguments) => digest::execute(&arguments),
        Command::Diff(arguments) => diff::execute(&arguments),
        Command::Material(arguments) => material::execute(&arguments),
        Command::Weights(arguments) => weights::execute(&arguments),
        Command::Bench(arguments) => bench::execute(&arguments),
    }
}
