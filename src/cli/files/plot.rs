//! `agimp plot`: a picture of the particles in an output file.
use crate::cli::Failure;
use crate::cli::shared::looks::{Looks, solids};
use crate::io::picture::draw_file;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `agimp plot`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Output or checkpoint file.
    file: PathBuf,
    /// Appearance.
    #[command(flatten)]
    looks: Looks,
    /// Title; by default the title of the job that wrote the file, or the name of the file.
    #[arg(long)]
    title: Option<String>,
    /// Picture to write: .png, or .svg with text and lines as vectors; by default beside the file with the extension
    /// png.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Draws the picture.
///
/// # Errors
/// The file cannot be read or does not offer the quantity, or the picture cannot be written.
pub(in crate::cli) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let name = arguments.file.file_stem().unwrap_or_default().to_string_lossy();
    let mut settings = arguments.looks.settings(arguments.title.as_deref(), Some(&arguments.file), &name);
    let out = arguments.out.clone().unwrap_or_else(|| arguments.file.with_extension("png"));
    settings.collect =
        match out.extension().and_then(|ending| ending.to_str()).map(str::to_lowercase).as_deref() {
            Some("svg") => true,
            Some("png") => false,
            _ => {
                let out = out.display();
                return Err(Failure::Usage(format!(
                    "{out}: found no extension of a picture; expected .png or .svg"
                )));
            }
        };
    let job = arguments.file.is_file().then(|| arguments.looks.job(&arguments.file)).flatten();
    draw_file(&arguments.file, &arguments.looks.colour, &settings, &solids(job.as_ref()), &out)
        .map_err(|error| Failure::Usage(error.to_string()))?;
    writeln!(std::io::stdout(), "{}", out.display())?;
    Ok(())
}
