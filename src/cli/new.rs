//! `agimp new`: a commented job file to start from.
use super::Failure;
use crate::text::{excerpt, nearest};
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write as _};
use std::path::PathBuf;

/// Templates: name and text. They are the jobs of the project itself, so they always run.
const TEMPLATES: [(&str, &str); 7] = [
    ("column_collapse", include_str!("../../jobs/column_collapse.toml")),
    ("column_collapse_fine", include_str!("../../jobs/column_collapse_fine.toml")),
    ("column_collapse_2d", include_str!("../../jobs/column_collapse_2d.toml")),
    ("column_collapse_tall", include_str!("../../jobs/column_collapse_tall.toml")),
    ("cylinder_in_sand", include_str!("../../jobs/cylinder_in_sand.toml")),
    ("taylor_bar", include_str!("../../jobs/taylor_bar.toml")),
    ("elastic_cubes", include_str!("../../jobs/elastic_cubes.toml")),
];

/// Arguments of `agimp new`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Name of the template; without it, the list of templates.
    template: Option<String>,
    /// File to write; TEMPLATE.toml by default. A file that exists is left alone.
    file: Option<PathBuf>,
    /// List the templates, and write nothing.
    #[arg(long)]
    list: bool,
}

/// Writes the template, or lists all.
///
/// # Errors
/// No such template, the file exists already, or it cannot be written.
pub(super) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let Some(name) = arguments.template.as_deref().filter(|_| !arguments.list) else {
        for (name, text) in TEMPLATES {
            writeln!(out, "{name:22} {}", title(text))?;
        }
        return Ok(());
    };
    let Some((_, text)) = TEMPLATES.iter().find(|(known, _)| *known == name) else {
        let known: Vec<&str> = TEMPLATES.iter().map(|(known, _)| *known).collect();
        let meant = nearest(name, known.iter().copied());
        let guess = meant.map_or(String::new(), |meant| format!("; did you mean \"{meant}\"?"));
        return Err(Failure::Usage(format!(
            "found the template \"{}\"; expected one of {}{guess}",
            excerpt(name, 60),
            known.join(", ")
        )));
    };
    let path = arguments.file.clone().unwrap_or_else(|| format!("{name}.toml").into());
    let failure = |error: std::io::Error| match error.kind() {
        ErrorKind::AlreadyExists => {
            Failure::Usage(format!("{}: exists already and is left as it is", path.display()))
        }
        _ => Failure::Run(format!("{}: cannot be written: {error}", path.display())),
    };
    let mut file = OpenOptions::new().write(true).create_new(true).open(&path).map_err(failure)?;
    file.write_all(text.as_bytes()).map_err(failure)?;
    writeln!(out, "{} written; next: agimp check {0}", path.display())?;
    Ok(())
}

/// The title that the job gives itself.
fn title(text: &str) -> &str {
    text.lines()
        .find_map(|line| line.strip_prefix("title = \""))
        .and_then(|rest| rest.strip_suffix('"'))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_are_valid_jobs_with_titles() {
        for (name, text) in TEMPLATES {
            assert!(!title(text).is_empty(), "{name}");
            let faults = crate::job::parse(text, name.as_ref()).err().unwrap_or_default();
            assert!(faults.is_empty(), "{name}: {faults:?}");
        }
    }
}
