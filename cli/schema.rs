//! `agimp schema`: the JSON schema of job files.
use super::Failure;
use std::io::Write as _;

/// Arguments of `agimp schema`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Print the reference of job files in Markdown.
    #[arg(long)]
    markdown: bool,
}

/// Prints the schema.
///
/// # Errors
/// Standard output cannot be written.
pub(super) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    if arguments.markdown {
        write!(out, "{}", agimp::job::schema::reference::reference())?;
        return Ok(());
    }
    let text = serde_json::to_string_pretty(&agimp::job::schema())
        .map_err(|error| Failure::Run(format!("the schema cannot be printed: {error}")))?;
    writeln!(out, "{text}")?;
    Ok(())
}
