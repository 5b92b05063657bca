//! `agimp plot`: pictures of the particles in outputs.
use super::has_ending;
use super::looks::Looks;
use crate::Failure;
use crate::files::given::Given;
use agimp::io::hdf5_file::FileError;
use post::picture::{draw_file, survey};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Endings of pictures.
const PICTURES: [&str; 2] = ["png", "svg"];

/// Arguments of `agimp plot`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Outputs or checkpoints: files, the directory of a run, its index (NAME.hdf.series) or its job file; a
    /// picture for each.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Appearance.
    #[command(flatten)]
    looks: Looks,
    /// Title; by default the title of the job that wrote the file, or the name of the file.
    #[arg(long)]
    title: Option<String>,
    /// Picture to write: .png, or .svg with text and lines as vectors; of several outputs the directory of
    /// the pictures. By default beside each file with the extension png.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Draws the pictures; several have one frame and one range of colours.
///
/// # Errors
/// A file cannot be read or does not offer the quantity, or a picture cannot be written.
pub(crate) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let failed = |error: FileError| Failure::Usage(error.to_string());
    let Arguments { looks, title, .. } = arguments;
    let files = Given::particles(&arguments.files)?.files;
    let outs = outs(arguments.out.as_deref(), &files)?;
    let scene = looks.scene(&files[0]);
    let name = |file: &Path| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut look = None;
    let settings = looks.settings(title.as_deref(), Some(&files[0]), &name(&files[0]))?;
    let colour = looks.colour(&files, &settings, &scene);
    if files.len() > 1 {
        look = Some(survey(&files, &colour, &settings, &scene).map_err(failed)?);
    }
    for (file, out) in files.iter().zip(outs) {
        let mut settings = looks.settings(title.as_deref(), Some(file), &name(file))?;
        settings.collect = has_ending(&out, &["svg"]);
        if let Some(look) = &look {
            settings.share(look);
            // A clip common to all files may remove all particles of one of them.
            settings.may_be_empty = true;
        }
        draw_file(file, &colour, &settings, &scene, &out).map_err(failed)?;
        writeln!(std::io::stdout(), "{}", out.display())?;
    }
    Ok(())
}

/// The picture of each file: beside it, in the directory that is given, or of the name that is given.
fn outs(out: Option<&Path>, files: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    if let Some(out) = out.filter(|out| files.len() == 1 && !out.is_dir() && !has_ending(out, &PICTURES)) {
        return Err(Failure::Usage(format!(
            "{}: found no extension of a picture; expected .png or .svg, or a directory",
            out.display()
        )));
    }
    super::outs(out, files, &PICTURES, " (agimp movie makes one file of all)")
}
