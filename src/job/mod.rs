//! Job files: the input of a run.
//!
//! A file is parsed to a tree of values with their places ([`load`]), checked against the schema (keys,
//! types, ranges), then against itself (names, shapes, overlaps), and becomes a [`Problem`] of its dimension.
mod convert;
mod difference;
mod parse;
pub mod problem;
pub mod schema;

pub use difference::{Difference, differences};
pub use parse::bytes::read;
pub use parse::error::{Fault, FaultList, JobError, Position};
pub use parse::included::Included;
pub use parse::settings::Settings;
pub use problem::{AnyProblem, Problem};
pub use schema::json::schema;

use std::path::Path;
use std::sync::LazyLock;

use self::parse::error::Lines;
use self::parse::include::Whole;
use self::parse::settings::Edited;

/// Reads and checks a job file. Not collective: every rank that calls it reads the file.
///
/// # Errors
/// The file cannot be read, or its content is not a valid job; all faults that were found, with their
/// places.
pub fn load(path: &Path) -> Result<AnyProblem, JobError> {
    load_with(path, &Settings::default())
}

/// As [`load`], with some values set from outside.
///
/// # Errors
/// The same; also a setting may be at fault.
pub fn load_with(path: &Path, settings: &Settings) -> Result<AnyProblem, JobError> {
    from_bytes(read(path)?, path, settings)
}

/// Checks the bytes of a job file, with some values set from outside. Nothing is read from `path`: its stem
/// becomes the name of the job.
///
/// # Errors
/// The name is not UTF-8, or the content is not a valid job; all faults that were found, with their places.
pub fn from_bytes(bytes: Vec<u8>, path: &Path, settings: &Settings) -> Result<AnyProblem, JobError> {
    if path.file_stem().is_some_and(|stem| stem.to_str().is_none()) {
        return Err(JobError::Name { path: path.to_path_buf() });
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
        let message = "found a byte that is not UTF-8; expected text in UTF-8".into();
        let faults = vec![Fault {
            key: String::new(),
            message,
            span: valid..valid,
            help: None,
            setting: None,
            included: None,
        }];
        FaultList { path: path.to_path_buf(), text, faults }
    })?;
    parse_with(&text, path, settings)
        .map_err(|faults| FaultList { path: path.to_path_buf(), text, faults }.into())
}

/// The text of a job with some values set, comments and all. `name` is its name in messages.
///
/// # Errors
/// A setting leads nowhere.
pub fn with_settings(text: &str, name: &Path, settings: &Settings) -> Result<String, JobError> {
    let edited = settings.apply(text);
    edited
        .map(|edited| edited.text)
        .map_err(|faults| FaultList { path: name.to_path_buf(), text: text.to_owned(), faults }.into())
}

/// Checks the text of a job file. Nothing is read from `path` itself: its stem becomes the name of the job,
/// and files that the job names or includes lie relative to its directory.
///
/// # Errors
/// All faults that were found.
pub fn parse(text: &str, path: &Path) -> Result<AnyProblem, Vec<Fault>> {
    parse_with(text, path, &Settings::default())
}

/// As [`parse`], with some values set from outside.
///
/// # Errors
/// All faults that were found, in the file and in the settings.
pub fn parse_with(text: &str, path: &Path, settings: &Settings) -> Result<AnyProblem, Vec<Fault>> {
    let whole = Whole::of(text, path)?;
    let edited = settings.apply(&whole.text)?;
    parse_edited(&edited, &whole, text, path)
        .map_err(|faults| faults.into_iter().map(|fault| whole.attribute(edited.attribute(fault))).collect())
}

/// `original` is the text of the job file, `whole` that with what it includes, before settings have changed
/// it.
fn parse_edited(
    edited: &Edited,
    whole: &Whole,
    original: &str,
    path: &Path,
) -> Result<AnyProblem, Vec<Fault>> {
    let text = edited.text.as_str();
    let alone = |span, message| {
        vec![Fault { key: String::new(), message, span, help: None, setting: None, included: None }]
    };
    let tree = parse::source::Node::parse(text).map_err(|(span, message)| match text.get(span.clone()) {
        Some(key) if message == "duplicate key" => {
            let message = "found the key a second time; expected it once".into();
            vec![Fault { key: key.to_owned(), message, span, help: None, setting: None, included: None }]
        }
        _ => alone(span, message),
    })?;
    let faults = parse::structure::check(&tree, schema_of_jobs());
    if !faults.is_empty() {
        return Err(faults);
    }
    // The types accept all that the schema accepts; should they ever differ, the parser's error is reported.
    let file: schema::job_file::JobFile = toml::from_str(text)
        .map_err(|error| alone(error.span().unwrap_or(0..0), error.message().to_owned()))?;
    let lines = Lines::of(original);
    convert::convert(&file, &tree, text, &|byte| whole.position(edited.original(byte), path, &lines), path)
}

/// The schema that all jobs are checked against, made once.
fn schema_of_jobs() -> &'static serde_json::Value {
    static SCHEMA: LazyLock<serde_json::Value> = LazyLock::new(schema);
    &SCHEMA
}

#[cfg(test)]
mod tests;
