//! `sweep.csv`: settings, status and the last row of the history of each run.
use std::path::Path;

use super::{Failure, Run};
use crate::io::whole_file::write_whole;
use crate::run::at_end::report::Report;
use crate::text::excerpt;

/// Writes the table of all runs so far: settings, status, and the last row of each history.
pub(super) fn write(
    path: &Path,
    over: &[(String, Vec<String>)],
    rows: &[(&Run, &str, Option<Report>)],
) -> Result<(), Failure> {
    let mut columns: Vec<(String, String)> = Vec::new();
    for (name, (_, unit)) in rows.iter().filter_map(|(.., report)| report.as_ref()).flat_map(|r| &r.history) {
        if !columns.iter().any(|(other, _)| other == name) {
            columns.push((name.clone(), unit.clone()));
        }
    }
    columns.sort();
    let quoted = |text: &str| match text.contains([',', '"', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    };
    let mut header: Vec<String> = over.iter().map(|(key, _)| quoted(key)).collect();
    header.extend(["directory", "status", "steps", "wall_seconds [s]"].map(String::from));
    header.extend(columns.iter().map(|(name, unit)| match unit.is_empty() {
        true => name.clone(),
        false => format!("{name} [{unit}]"),
    }));
    let mut text = header.join(",") + "\n";
    for (run, status, report) in rows {
        let mut cells: Vec<String> = run.values.iter().map(|value| quoted(value)).collect();
        let directory = run.directory.file_name().unwrap_or_default().to_string_lossy().into_owned();
        cells.extend([quoted(&directory), (*status).to_owned()]);
        cells.push(report.as_ref().map_or_else(String::new, |report| report.steps.to_string()));
        cells.push(report.as_ref().map_or_else(String::new, |report| format!("{:.1}", report.wall_seconds)));
        cells.extend(columns.iter().map(|(name, _)| {
            let value = report.as_ref().and_then(|report| report.history.get(name)?.0);
            value.map_or_else(String::new, |value| format!("{value:?}"))
        }));
        text.push_str(&(cells.join(",") + "\n"));
    }
    let write = || {
        path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        write_whole(path, text.as_bytes())
    };
    write().map_err(|error| {
        Failure::Run(format!("{}: cannot write: {error}", excerpt(&path.display().to_string(), 200)))
    })
}
