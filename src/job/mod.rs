//! Job files: what a run is asked to do.
//!
//! A file is parsed to a tree that knows where everything stands ([`load`]), checked against the
//! schema (keys, types, ranges), then against itself (names, shapes, overlaps), and becomes a
//! [`Problem`] of its dimension.
mod convert;
mod difference;
mod parse;
pub mod problem;
pub mod schema;

pub use difference::{Difference, differences};
pub use parse::error::{Fault, FaultList, JobError};
pub use problem::{AnyProblem, Problem};
pub use schema::json::schema;

use std::path::Path;

/// Reads and checks a job file. Not collective: every rank that calls it reads the file.
///
/// # Errors
/// The file cannot be read, or its content is not a valid job; all faults that were found, with their
/// places.
pub fn load(path: &Path) -> Result<AnyProblem, JobError> {
    from_bytes(read(path)?, path)
}

/// The bytes of a job file. Not collective.
///
/// # Errors
/// The file cannot be read.
pub fn read(path: &Path) -> Result<Vec<u8>, JobError> {
    std::fs::read(path).map_err(|source| JobError::Unreadable { path: path.to_path_buf(), source })
}

/// Checks the bytes of a job file. Nothing is read from `path`: its stem becomes the name of the job.
///
/// # Errors
/// The name is not UTF-8, or the content is not a valid job; all faults that were found, with their places.
pub fn from_bytes(bytes: Vec<u8>, path: &Path) -> Result<AnyProblem, JobError> {
    if path.file_stem().is_some_and(|stem| stem.to_str().is_none()) {
        return Err(JobError::Name { path: path.to_path_buf() });
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
        let message = "found a byte that is not UTF-8; expected text in UTF-8".into();
        let faults = vec![Fault { key: String::new(), message, span: valid..valid, help: None }];
        FaultList { path: path.to_path_buf(), text, faults }
    })?;
    parse(&text, path).map_err(|faults| FaultList { path: path.to_path_buf(), text, faults }.into())
}

/// Checks the text of a job file. Nothing is read from `path`: its stem becomes the name of the job.
///
/// # Errors
/// All faults that were found.
pub fn parse(text: &str, path: &Path) -> Result<AnyProblem, Vec<Fault>> {
    let alone = |span, message| vec![Fault { key: String::new(), message, span, help: None }];
    let tree = parse::source::Node::parse(text).map_err(|(span, message)| match text.get(span.clone()) {
        Some(key) if message == "duplicate key" => {
            let message = "found the key a second time; expected it once".into();
            vec![Fault { key: key.to_owned(), message, span, help: None }]
        }
        _ => alone(span, message),
    })?;
    let faults = parse::structure::check(&tree, &schema());
    if !faults.is_empty() {
        return Err(faults);
    }
    // What the schema accepts, the types accept; should they ever differ, the parser's words count.
    let file: schema::job_file::JobFile = toml::from_str(text)
        .map_err(|error| alone(error.span().unwrap_or(0..0), error.message().to_owned()))?;
    convert::convert(&file, &tree, text, path)
}

#[cfg(test)]
mod tests;
