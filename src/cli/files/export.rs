//! `agimp export`: particles for other programs.
use crate::cli::Failure;
use crate::io::export::{self, Format};
use crate::io::frame::{Frame, expand, shown_in};
use crate::io::snapshot::PointField;
use crate::text::{bytes, count};
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `agimp export`.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("format").required(true))]
pub struct Arguments {
    /// Output or checkpoint files, or the index of the outputs of a run (NAME.hdf.series).
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Binary PLY with radii, single precision: for renderers such as Blender.
    #[arg(long, group = "format")]
    ply: bool,
    /// A row for each particle, all digits, names and units in the first row.
    #[arg(long, group = "format")]
    csv: bool,
    /// XML of VTK for points: for ParaView, PyVista and others.
    #[arg(long, group = "format")]
    vtp: bool,
    /// Fields to take along, separated by commas; without it, all that the files show.
    #[arg(long, value_delimiter = ',', value_parser = super::field)]
    fields: Option<Vec<PointField>>,
    /// Directory to write to; without it, beside each file.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Writes a file for each output.
///
/// # Errors
/// A file cannot be read or does not show a field, or one cannot be written.
pub(in crate::cli) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let failed = |error: crate::io::hdf5_file::FileError| Failure::Usage(error.to_string());
    let format = if arguments.ply {
        Format::Ply
    } else if arguments.csv {
        Format::Csv
    } else {
        Format::Vtp
    };
    if let Some(directory) = &arguments.out {
        std::fs::create_dir_all(directory).map_err(|error| {
            Failure::Usage(format!("{}: cannot make the directory: {error}", directory.display()))
        })?;
    }
    for file in expand(&super::without_trees(&arguments.files)).map_err(failed)? {
        let fields = match &arguments.fields {
            Some(fields) => fields.clone(),
            None => shown_in(&file).map_err(failed)?,
        };
        let frame = Frame::read(&file, &fields, true).map_err(failed)?;
        let beside = file.with_extension(format.ending());
        let out = match (&arguments.out, beside.file_name()) {
            (Some(directory), Some(name)) => directory.join(name),
            _ => beside,
        };
        export::write(&frame, format, &out).map_err(failed)?;
        let size = std::fs::metadata(&out).map_or(0, |data| data.len());
        let particles = count(frame.positions.len() as u64);
        writeln!(std::io::stdout(), "{} ({particles} particles, {})", out.display(), bytes(size as f64))?;
    }
    Ok(())
}
