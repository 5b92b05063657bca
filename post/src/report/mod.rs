//! `NAME.report.html`: a run on one page, from the files that it has written so far.
//!
//! | file | content |
//! |---|---|
//! | this | assembly of the page |
//! | `run.rs` | content of the files of a run |
//! | `sections.rs` | its words, numbers and tables |
//! | `figures.rs` | its pictures and charts, and their options |
//! | `results.rs` | the files of a run: which are there, and how far it has come |
//! | `history.rs` | the table of the history |
//! | `along.rs` | curves along lines of points |
//! | `panels.rs` | columns of the history that belong into one chart |
//! | `cost.rs` | time by phase, balance and memory, from telemetry |
//! | `page.html`, `page.css` | frame and style of the page |
//!
//! Runs that go on, and runs that have ended by a fault, are shown as far as they have come.
use std::fmt::Write as _;
use std::path::Path;

use agimp::io::hdf5_file::FileError;
use agimp::io::whole_file::write_whole;
use agimp::text::html;

mod along;
mod cost;
mod figures;
mod history;
mod panels;
mod results;
mod run;
mod sections;

pub use figures::Options;
use figures::{charts, pictures};
pub use results::{Results, Unclear};
use run::Run;
use sections::{costs, ending, facts, files, job, remarks, table};

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");

/// Not collective. Writes the page of a run. Returns its size in bytes.
///
/// # Errors
/// An output cannot be read or does not offer the quantity, or the page cannot be written.
pub fn write(results: &Results, options: &Options, out: &Path) -> Result<u64, FileError> {
    let text = text(results, options)?;
    write_whole(out, text.as_bytes()).map_err(|source| FileError::System {
        path: out.into(),
        action: "write",
        source,
    })?;
    Ok(text.len() as u64)
}

fn text(results: &Results, options: &Options) -> Result<String, FileError> {
    let run = Run::read(results);
    let mut body = String::new();
    facts(&mut body, &run);
    ending(&mut body, &run, results);
    remarks(&mut body, &run);
    let mut drawn = String::new();
    match pictures(&mut drawn, &run, options) {
        Ok(()) => body.push_str(&drawn),
        Err(error) if options.colour.is_some() => return Err(error),
        // A page of the readable files is better than none.
        Err(error) => {
            let _ = writeln!(body, "<p class=\"warning\">no pictures: {}</p>", html(&error.to_string()));
        }
    }
    charts(&mut body, "curves", "Over time", &panels::panels(&run.history));
    charts(&mut body, "lines", "Along lines", &along::panels(&results.lines()));
    table(&mut body, &run.history);
    costs(&mut body, &run);
    job(&mut body, &run);
    files(&mut body, results);
    let name = html(&results.name);
    let title = run.title().map_or_else(|| name.clone(), |title| html(&title));
    let (state, sentence) = run.state();
    let sentence = html(&sentence);
    Ok(filled([
        ("/*STYLE*/", STYLE),
        ("TITLE", &title),
        ("NAME", &name),
        ("STATE", state),
        ("SENTENCE", &sentence),
        ("<!--BODY-->", &body),
    ]))
}

/// The page with its marks replaced. A text that replaces a mark may contain another one.
fn filled(marks: [(&str, &str); 6]) -> String {
    let (mut page, mut rest) = (String::new(), PAGE);
    let next = |rest: &str| {
        let places = marks.iter().filter_map(|(mark, text)| Some((rest.find(mark)?, mark.len(), *text)));
        places.min()
    };
    while let Some((place, length, text)) = next(rest) {
        page.push_str(&rest[..place]);
        page.push_str(text);
        rest = &rest[place + length..];
    }
    page + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_title_may_look_like_a_mark() {
        let page = filled([
            ("/*STYLE*/", ""),
            ("TITLE", "NAME of a STATE"),
            ("NAME", "job"),
            ("STATE", "ended"),
            ("SENTENCE", "TITLE"),
            ("<!--BODY-->", "SENTENCE"),
        ]);
        assert!(page.contains("<h1>NAME of a STATE</h1>") && page.contains("ended\">TITLE</span>"), "{page}");
    }

    #[test]
    fn page_has_its_marks_once_and_asks_nobody() {
        for mark in ["/*STYLE*/", "<!--BODY-->", "SENTENCE"] {
            assert_eq!(PAGE.matches(mark).count(), 1, "{mark}");
        }
        for word in ["http:", "https:", "url(", "@import", "<script"] {
            assert!(!PAGE.contains(word) && !STYLE.contains(word), "{word}");
        }
    }
}
