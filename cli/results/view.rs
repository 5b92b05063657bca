//! `agimp view`: particles and tree of outputs as a page for a browser.
use super::looks;
use crate::Failure;
use crate::files::given::Given;
use agimp::io::snapshot::PointField;
use agimp::text::bytes;
use post::revolve::Revolve;
use post::view::{self, Options};
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `agimp view`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Outputs or checkpoints of one run, in order of time: files, the directory of the run, its index
    /// (NAME.hdf.series) or its job file.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Fields to include, separated by commas; by default all fields of the files except identifiers and
    /// components.
    #[arg(long, value_delimiter = ',', value_parser = super::field)]
    fields: Option<Vec<PointField>>,
    /// Bits for each real value; more bits give finer values and a larger page.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u8).range(4..=16))]
    bits: u8,
    /// Bodies of revolution in space (jobs with geometry = "axisymmetric"), with the quarter towards the
    /// viewer cut out, or whole; without the tree.
    #[arg(long, value_name = "open|whole", num_args = 0..=1, require_equals = true, default_missing_value = "open",
        value_parser = str::parse::<Revolve>)]
    revolve: Option<Revolve>,
    /// Title; by default the title of the job that wrote the first file, or the name of the page.
    #[arg(long)]
    title: Option<String>,
    /// Page to write; by default beside the first file with the extension html.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Writes the page.
///
/// # Errors
/// A file cannot be read or does not show a field, or the page cannot be written.
pub(crate) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let failed = |error: agimp::io::hdf5_file::FileError| Failure::Usage(error.to_string());
    let Given { files, first } = Given::particles(&arguments.files)?;
    let out = arguments.out.clone().unwrap_or_else(|| super::beside(&first, "html"));
    let name = out.file_stem().unwrap_or_default().to_string_lossy();
    let title = looks::title(arguments.title.as_deref(), files.first().map(PathBuf::as_path), &name);
    let (fields, bits, revolve) = (arguments.fields.clone(), arguments.bits, arguments.revolve);
    let options = Options { title, fields, bits, revolve };
    let size = view::write(&files, &options, &out).map_err(failed)?;
    let times = if files.len() == 1 { "one time".into() } else { format!("{} times", files.len()) };
    writeln!(std::io::stdout(), "{} ({times}, {}; open in a browser)", out.display(), bytes(size as f64))?;
    Ok(())
}
