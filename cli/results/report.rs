//! `agimp report`: a run on one page for a browser.
use super::has_ending;
use crate::Failure;
use crate::files::given::{self, Given};
use agimp::job;
use agimp::text::{bytes, shell_word};
use post::report::{self, Options, Results};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `agimp report`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// A run: the directory of its results, its index (NAME.hdf.series), outputs of it, or a job file that
    /// was run without --out.
    #[arg(required = true)]
    run: Vec<PathBuf>,
    /// Name of the job, if the directory contains the results of several jobs.
    #[arg(long)]
    name: Option<String>,
    /// Quantity that colours the pictures, as for `agimp plot`; by default plastic strain if there is any,
    /// otherwise the speed.
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
pub(crate) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let results = results(&arguments.run, arguments.name.as_deref())?;
    let job = arguments.run.iter().find(|run| is_job(run));
    let options = Options {
        colour: arguments.colour.clone(),
        pictures: usize::from(arguments.pictures),
        job: job.cloned(),
    };
    let out = arguments.out.clone().unwrap_or_else(|| results.path("report.html"));
    let size = report::write(&results, &options, &out).map_err(|error| Failure::Usage(error.to_string()))?;
    writeln!(std::io::stdout(), "{} ({}; open in a browser)", out.display(), bytes(size as f64))?;
    Ok(())
}

/// Endings of the outputs of a run and their index.
const OUTPUTS: [&str; 3] = ["hdf", "vtkhdf", "series"];
/// Endings of other files of a run.
const OTHERS: [&str; 6] = ["csv", "json", "jsonl", "html", "png", "svg"];

/// Whether a word names a job file: neither a directory nor, by its ending, a file of a run.
fn is_job(word: &Path) -> bool {
    !word.is_dir() && !has_ending(word, &OUTPUTS) && !has_ending(word, &OTHERS)
}

/// The results of a job, those in a directory, or those to which files belong.
fn results(words: &[PathBuf], name: Option<&str>) -> Result<Results, Failure> {
    let unclear = |error: report::Unclear| Failure::Usage(error.to_string());
    let (run, is_one) = (&words[0], words.len() == 1);
    let refused = |word: &Path, found: &str| {
        let word = word.display();
        Err(Failure::Usage(format!(
            "{word}: found {found}; expected the directory of a run, its index (NAME.hdf.series), its outputs or its job file"
        )))
    };
    if let Some(missing) = words.iter().find(|word| !word.exists()) {
        return refused(missing, "no such file");
    }
    if let Some(other) = words.iter().find(|word| !word.is_dir() && has_ending(word, &OTHERS)) {
        return refused(other, "a file that holds no state of a run");
    }
    if is_one && run.is_dir() {
        return Results::in_directory(run, name).map_err(unclear);
    }
    if is_one && is_job(run) {
        let problem = job::load(run)?;
        return Results::in_directory(&problem.output().directory, Some(problem.name())).map_err(|error| {
            Failure::Usage(format!(
                "{error}; run the job (agimp run {}), or name the directory of its results",
                shell_word(run)
            ))
        });
    }
    let (directory, name) = given::run_of_files(&Given::any(words)?.files)?;
    Results::in_directory(&directory, Some(&name)).map_err(unclear)
}
