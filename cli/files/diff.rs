//! `agimp diff`: differences between the states in two files.
use crate::Failure;
use agimp::io::snapshot::compare::diff;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `agimp diff`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// First output or checkpoint file with restart state.
    first: PathBuf,
    /// Second file.
    second: PathBuf,
}

/// Prints a line per entry of the header, part of the tree and field of the particles that differs.
///
/// # Errors
/// A file cannot be read, or the states differ.
pub(crate) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let differences =
        diff(&arguments.first, &arguments.second).map_err(|error| Failure::Usage(error.to_string()))?;
    let mut out = std::io::stdout().lock();
    for difference in &differences {
        writeln!(out, "{difference}")?;
    }
    if differences.is_empty() {
        writeln!(out, "same state, bit for bit")?;
        return Ok(());
    }
    Err(Failure::Run("the states differ".into()))
}
