//! `agimp new`: a commented job file to start from.
use super::Failure;
use crate::io::lines::write_whole;
use crate::job;
use crate::text::{excerpt, nearest};
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write as _};
use std::path::PathBuf;

/// A template for each name: jobs of the project itself that need no other file, so that they always run.
macro_rules! templates {
    ($($name:literal),+ $(,)?) => {
        [$(($name, include_str!(concat!("../../jobs/", $name, ".toml")))),+]
    };
}

/// Templates by discipline (granular flow, ground, other flow, solids, metal): name and text.
const TEMPLATES: [(&str, &str); 21] = templates![
    "column_collapse_2d",
    "column_collapse_mohr_coulomb",
    "column_collapse",
    "column_collapse_tall",
    "column_collapse_fine",
    "slope_failure",
    "excavation",
    "ground_at_rest",
    "strip_footing",
    "clay_footing",
    "cone_penetration",
    "silo",
    "cylinder_in_sand",
    "snowball",
    "dam_break",
    "cantilever",
    "thick_cylinder",
    "oblique_disks",
    "elastic_cubes",
    "taylor_bar",
    "taylor_bar_johnson_cook",
];

/// File that editors complete and check job files by.
const SCHEMA: &str = "agimp.schema.json";

/// Arguments of `agimp new`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Name of the template; without it, the list of templates.
    #[arg(value_name = "TEMPLATE")]
    first: Option<String>,
    /// File to write; TEMPLATE.toml by default. A file that exists is left alone.
    file: Option<PathBuf>,
    /// Name of the template; then the file is the only word.
    #[arg(long, value_name = "TEMPLATE", conflicts_with = "file")]
    template: Option<String>,
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
    let (name, file) = match (&arguments.template, &arguments.first) {
        (Some(name), file) => (Some(name), file.as_ref().map(PathBuf::from)),
        (None, name) => (name.as_ref(), arguments.file.clone()),
    };
    let Some(name) = name.map(String::as_str).filter(|_| !arguments.list) else {
        for (name, text) in TEMPLATES {
            writeln!(out, "{name:28} {}", title(text))?;
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
    let path = file.unwrap_or_else(|| format!("{name}.toml").into());
    let failure = |error: std::io::Error| match error.kind() {
        ErrorKind::AlreadyExists => {
            Failure::Usage(format!("{}: exists already and is left as it is", path.display()))
        }
        _ => Failure::Run(format!("{}: cannot be written: {error}", path.display())),
    };
    let mut file = OpenOptions::new().write(true).create_new(true).open(&path).map_err(failure)?;
    // Editors look for the schema beside the job.
    let text = format!("#:schema ./{SCHEMA}\n{text}");
    file.write_all(text.as_bytes()).map_err(failure)?;
    writeln!(out, "{} written; next: agimp check {0}", path.display())?;
    let schema = path.with_file_name(SCHEMA);
    if !schema.exists() {
        let text = serde_json::to_string_pretty(&job::schema()).map_err(std::io::Error::other)?;
        let written = write_whole(&schema, text.as_bytes());
        written.map_err(|error| Failure::Run(format!("{}: cannot be written: {error}", schema.display())))?;
        writeln!(out, "{} written: editors complete and check job files by it", schema.display())?;
    }
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
            let faults = job::parse(text, name.as_ref()).err().unwrap_or_default();
            assert!(faults.is_empty(), "{name}: {faults:?}");
        }
    }
}
