//! `NAME.report.html`: a run on one page, from the files that it has written so far.
//!
//! | file | content |
//! |---|---|
//! | this | options and assembly of the page |
//! | `sections.rs` | its words, numbers and tables |
//! | `figures.rs` | its pictures and charts |
//! | `results.rs` | the files of a run: which are there, and how far it has come |
//! | `history.rs` | the table of the history |
//! | `along.rs` | curves along lines of points |
//! | `panels.rs` | columns of the history that belong into one chart |
//! | `cost.rs` | time by phase, balance and memory, from telemetry |
//! | `page.html`, `page.css` | frame and style of the page |
//!
//! Runs that go on, and runs that have ended by a fault, are shown as far as they have come.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::io::hdf5_file::FileError;
use crate::io::snapshot::{self, Header};
use crate::io::whole_file::write_whole;
use crate::text::{count, html, quantity};

mod along;
mod cost;
mod figures;
mod history;
mod panels;
mod results;
mod sections;

use cost::Cost;
use figures::{charts, pictures};
use history::History;
use results::State;
pub use results::{Results, Unclear};
use sections::{collapse, costs, ending, facts, files, job, remarks, table};

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");

/// Options of a page.
#[derive(Clone, Debug)]
pub struct Options {
    /// Quantity that colours the pictures, as for `agimp plot`; `None` for plastic strain if there is any,
    /// else the speed.
    pub colour: Option<String>,
    /// Most pictures: times from the first output to the last.
    pub pictures: usize,
    /// Job file of the run, beside which the meshes of its colliders lie; `None`: where the run's name leads.
    pub job: Option<PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Self { colour: None, pictures: 4, job: None }
    }
}

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
    collapse(&mut body, &run);
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

/// Content of the files of a run.
struct Run {
    history: History,
    cost: Cost,
    report: Option<crate::run::at_end::report::Report>,
    state: State,
    /// Outputs in order of time.
    outputs: Vec<PathBuf>,
    /// The header of the last output, and the text of the job in it.
    header: Option<Header>,
    job_text: Option<String>,
    /// The same as a table; empty if there is none.
    job: toml::Table,
}

impl Run {
    fn read(results: &Results) -> Self {
        let (outputs, report) = (results.outputs(), results.report());
        // The last one that can be read.
        let last = outputs.iter().rev().find_map(|output| Some((output, results::header(output)?)));
        let (last, header) = last.unzip();
        let job_text = last.and_then(|last| snapshot::job_text(last));
        Self {
            history: History::read(&results.path("history.csv")),
            cost: Cost::read(&results.path("telemetry.jsonl")),
            state: results.state(report.is_some()),
            report,
            header,
            job: job_text.as_deref().and_then(|text| toml::from_str(text).ok()).unwrap_or_default(),
            job_text,
            outputs,
        }
    }

    fn title(&self) -> Option<String> {
        let title = self.job.get("title")?.as_str()?.trim().to_owned();
        (!title.is_empty()).then_some(title)
    }

    /// End of the run that the job asks for, s.
    fn end(&self) -> Option<f64> {
        let end = self.job.get("time")?.get("end")?;
        end.as_float().or_else(|| end.as_integer().map(|end| end as f64))
    }

    /// A class for the style of the page, and a sentence.
    fn state(&self) -> (&'static str, String) {
        let time = self.history.last("time").map_or("its start".into(), |time| quantity(time, "s"));
        let end = self.end().map_or(String::new(), |end| format!(" of {}", quantity(end, "s")));
        match &self.state {
            State::Finished => ("finished", format!("finished at {time}")),
            State::Running(holder) => ("running", format!("running, at {time}{end} ({holder})")),
            State::Told(ending) => {
                let (what, at) = if ending.is_stop { ("stopped", "ended") } else { ("failed", "failed") };
                (at, format!("{what} at {}{end}, step {}", quantity(ending.time, "s"), count(ending.step)))
            }
            State::Ended => ("ended", format!("ended without finishing, at {time}{end}")),
        }
    }
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
