//! `agimp digest`: one number that is equal for equal states, whatever the ranks that wrote them.
use crate::Failure;
use agimp::io::snapshot::compare::digest;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `agimp digest`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Output or checkpoint files with restart state.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Also print the checksum of each part.
    #[arg(long)]
    parts: bool,
}

/// Verifies the files and prints a line for each.
///
/// # Errors
/// A file is damaged or holds no restart state.
pub(crate) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    for path in &arguments.files {
        let digest = digest(path).map_err(|error| Failure::Usage(error.to_string()))?;
        writeln!(out, "{:016x}  {}", digest.whole, path.display())?;
        if arguments.parts {
            for (name, crc) in digest.parts {
                writeln!(out, "        {crc:08x}  {name}")?;
            }
        }
    }
    Ok(())
}
