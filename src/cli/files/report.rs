//! `agimp report`: a run on one page for a browser.
use crate::cli::Failure;
use crate::job;
use crate::report::{self, Options, Results};
use crate::text::bytes;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `agimp report`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Directory of the results of a run, or job file that was run without --out.
    run: PathBuf,
    /// Name of the job, if the directory contains the results of several jobs.
    #[arg(long)]
    name: Option<String>,
    /// Quantity that colours the pictures, as for `agimp plot`; by default plastic strain if there is any, otherwise
    /// the speed.
    #[arg(long, alias = "color")]
    colour: Option<String>,
    /// Maximum number of pictures, from the first output to the last.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u8).range(0..=100))]
    pictures: u8,
    /// Page to write; by default NAME.report.html in the directory.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Writes the page.
///
/// # Errors
/// No results are found, an output cannot be read, or the page cannot be written.
pub(in crate::cli) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let results = results(&arguments.run, arguments.name.as_deref())?;
    let options = Options {
        colour: arguments.colour.clone(),
        pictures: usize::from(arguments.pictures),
        job: Some(arguments.run.clone()).filter(|run| run.is_file()),
    };
    let out = arguments.out.clone().unwrap_or_else(|| results.path("report.html"));
    let size = report::write(&results, &options, &out).map_err(|error| Failure::Usage(error.to_string()))?;
    writeln!(std::io::stdout(), "{} ({}; open in a browser)", out.display(), bytes(size as f64))?;
    Ok(())
}

/// The results of a job, or those in a directory.
fn results(run: &Path, name: Option<&str>) -> Result<Results, Failure> {
    let unclear = |error: report::Unclear| Failure::Usage(error.to_string());
    if run.is_dir() {
        return Results::in_directory(run, name).map_err(unclear);
    }
    let problem = job::load(run)?;
    Results::in_directory(&problem.output().directory, Some(problem.name())).map_err(|error| {
        let run = run.display();
        Failure::Usage(format!(
            "{error}; run the job (agimp run {run}), or name the directory of its results"
        ))
    })
}
