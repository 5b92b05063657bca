//! Content of the files of a run.
use std::path::PathBuf;

use super::cost::Cost;
use super::history::History;
use super::results::{self, Results, State};
use agimp::io::snapshot::{self, Header};
use agimp::text::{count, quantity};

/// Content of the files of a run.
pub(super) struct Run {
    pub(super) history: History,
    pub(super) cost: Cost,
    pub(super) report: Option<agimp::run::at_end::report::Report>,
    pub(super) state: State,
    /// Outputs in order of time.
    pub(super) outputs: Vec<PathBuf>,
    /// The header of the last output, and the text of the job in it.
    pub(super) header: Option<Header>,
    pub(super) job_text: Option<String>,
    /// The same as a table; empty if there is none.
    pub(super) job: toml::Table,
}

impl Run {
    pub(super) fn read(results: &Results) -> Self {
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

    pub(super) fn title(&self) -> Option<String> {
        let title = self.job.get("title")?.as_str()?.trim().to_owned();
        (!title.is_empty()).then_some(title)
    }

    /// End of the run that the job asks for, s.
    pub(super) fn end(&self) -> Option<f64> {
        let end = self.job.get("time")?.get("end")?;
        end.as_float().or_else(|| end.as_integer().map(|end| end as f64))
    }

    /// A class for the style of the page, and a sentence.
    pub(super) fn state(&self) -> (&'static str, String) {
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
