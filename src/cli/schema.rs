//! `agimp schema`: the JSON schema of job files.
use super::Failure;
use std::io::Write as _;

/// Prints the schema.
///
/// # Errors
/// Standard output cannot be written.
pub fn execute() -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(&crate::job::schema())
        .map_err(|error| Failure::Run(format!("the schema cannot be printed: {error}")))?;
    writeln!(std::io::stdout().lock(), "{text}")?;
    Ok(())
}
