//! `sweep.csv`: settings, status and the last row of the history of each run.
use std::fmt::Write as _;
use std::path::Path;

use super::one::Row;
use crate::Failure;
use agimp::io::whole_file::write_whole;
use agimp::text::excerpt;

/// Names and units of all columns of the histories, in the order of the alphabet.
fn columns(rows: &[Row]) -> Vec<(String, String)> {
    let mut columns: Vec<(String, String)> = Vec::new();
    for (name, (_, unit)) in rows.iter().filter_map(|row| row.report.as_ref()).flat_map(|r| &r.history) {
        if !columns.iter().any(|(other, _)| other == name) {
            columns.push((name.clone(), unit.clone()));
        }
    }
    columns.sort();
    columns
}

/// Values of the rows of a table, where there is one of a sweep over these keys.
///
/// # Errors
/// The table cannot be read.
pub(super) fn values(path: &Path, over: &[(String, Vec<String>)]) -> Result<Vec<Vec<String>>, Failure> {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(Failure::Run(format!("{}: cannot read: {error}", path.display()))),
    };
    let mut rows = text.lines().map(cells);
    let is_of = |header: &Vec<String>| {
        header.get(over.len()).is_some_and(|next| next == "directory")
            && header.iter().zip(over).all(|(name, (key, _))| name == key)
    };
    Ok(match rows.next().filter(is_of) {
        Some(_) => rows.filter(|row| row.len() > over.len()).map(|row| row[..over.len()].to_vec()).collect(),
        None => Vec::new(),
    })
}

/// Cells of a row, without the quotes that stand around some.
fn cells(row: &str) -> Vec<String> {
    let (mut cells, mut is_quoted) = (vec![String::new()], false);
    let mut letters = row.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if is_quoted && letters.peek() == Some(&'"') => {
                letters.next();
            }
            '"' => {
                is_quoted = !is_quoted;
                continue;
            }
            ',' if !is_quoted => {
                cells.push(String::new());
                continue;
            }
            _ => {}
        }
        cells.iter_mut().last().into_iter().for_each(|cell| cell.push(letter));
    }
    cells
}

/// Settings and the columns whose names begin with one of these words, for the terminal.
///
/// # Errors
/// No column begins with one of them.
pub(super) fn shown(
    over: &[(String, Vec<String>)],
    rows: &[Row],
    words: &[String],
) -> Result<String, Failure> {
    let all = columns(rows);
    let mut names = Vec::new();
    for word in words {
        let before = names.len();
        names.extend(all.iter().filter(|(name, _)| name.starts_with(word)));
        if names.len() == before && !all.is_empty() {
            let all: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
            return Err(Failure::Usage(format!(
                "--show {word}: found no such column; expected one of {}",
                all.join(", ")
            )));
        }
    }
    let key = |(key, _): &(String, Vec<String>)| key.rsplit('.').next().unwrap_or_default().to_owned();
    let unit = |(name, unit): &&(String, String)| {
        if unit.is_empty() { name.clone() } else { format!("{name} [{unit}]") }
    };
    let mut lines = vec![over.iter().map(key).chain(names.iter().map(unit)).collect::<Vec<_>>()];
    for Row { run, status, report } in rows {
        let value = |(name, _): &&(String, String)| {
            let value = report.as_ref().and_then(|report| report.history.get(name)?.0);
            value.map_or_else(|| (*status).to_owned(), |value| agimp::text::number(value, 4))
        };
        lines.push(run.values.iter().cloned().chain(names.iter().map(value)).collect());
    }
    let wide = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..lines[0].len()).map(wide).collect();
    let mut text = String::new();
    for line in &lines {
        for (cell, width) in line.iter().zip(&widths) {
            let _ = write!(text, "{cell:>width$}  ");
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    Ok(text)
}

/// Writes the table of all runs so far: settings, status, and the last row of each history.
pub(super) fn write(path: &Path, over: &[(String, Vec<String>)], rows: &[Row]) -> Result<(), Failure> {
    let columns = columns(rows);
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
    for Row { run, status, report } in rows {
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

#[cfg(test)]
mod tests {
    #[test]
    fn quoted_cells_hold_commas_and_quotes() {
        assert_eq!(super::cells("1,\"[0, 1]\",\"a \"\"b\"\"\",,x"), ["1", "[0, 1]", "a \"b\"", "", "x"]);
    }
}
