//! Reports of failures and warnings: once, whatever the number of ranks.
use std::io::{IsTerminal as _, Write as _};

use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, Report};
use partition::comm::{Comm, World, is_launched};

use super::quote::Quote;
use crate::Failure;
use agimp::io::log::progress::warn;
use agimp::job::{FaultList, JobError};
use agimp::text::{excerpt, printable};

impl Failure {
    /// Reports the failure on standard error, unless it was reported already.
    pub fn report(&self) {
        match self {
            Self::Job(JobError::Invalid(list)) => explain_faults(list),
            Self::Reported(_) => {}
            // A closed pipe is ignored.
            Self::Arguments(error) => drop(error.print()),
            other => print(&format!("agimp: {}", visible(&other.to_string()))),
        }
    }
}

/// Collective. A failure of one rank or of all ends all: the lowest of those that failed reports the reason,
/// and every rank gets its exit code. None continues before the report: as soon as one rank has ended without
/// success, `mpirun` ends the others, with their output.
pub(crate) fn together<T>(comm: &Comm, result: Result<T, Failure>) -> Result<T, Failure> {
    let ranks = comm.size() as u64;
    let mut lowest = [if result.is_err() { comm.rank() as u64 } else { ranks }];
    comm.min_u64(&mut lowest);
    let mut code = [u64::from(u8::MAX)];
    match &result {
        Ok(_) if lowest[0] == ranks => return result,
        Err(failure) if lowest[0] == comm.rank() as u64 => {
            failure.report();
            code = [u64::from(failure.exit_code())];
        }
        _ => {}
    }
    comm.min_u64(&mut code);
    Err(Failure::Reported(code[0] as u8))
}

/// Collective under `mpirun`: its ranks. A process that it has not started is alone, and need not be able to
/// start MPI.
pub(crate) fn launched() -> Result<Option<World>, Failure> {
    is_launched().then(World::init).transpose().map_err(|error| Failure::Run(error.to_string()))
}

/// Collective under `mpirun`, where all ranks have the same command line as a rule. A command line that the
/// parser refuses, reported once.
pub fn unusable(error: clap::Error) -> Failure {
    let Ok(Some(world)) = launched() else { return error.into() };
    match together(world.comm(), Err::<(), _>(error.into())) {
        Ok(()) => Failure::Reported(0),
        Err(reported) => reported,
    }
}

/// A message with its own line breaks, but without other characters that control a terminal.
fn visible(message: &str) -> String {
    message.split('\n').map(printable).collect::<Vec<_>>().join("\n")
}

/// Writes a message in one piece: `mpirun` may put its own text between pieces. A closed pipe is no failure.
fn print(text: &str) {
    let _ = std::io::stderr().write_all(format!("{text}\n").as_bytes());
}

/// Warnings that are shown; the rest are counted.
const MOST_WARNINGS: usize = 20;

/// Writes warnings about a job.
pub(crate) fn warn_of(warnings: &[String]) {
    for text in warnings.iter().take(MOST_WARNINGS) {
        warn(&excerpt(text, LONGEST_WARNING));
    }
    if warnings.len() > MOST_WARNINGS {
        warn(&format!("and {} more", warnings.len() - MOST_WARNINGS));
    }
}

/// Longest warning, in characters.
const LONGEST_WARNING: usize = 500;

/// Each fault on a line of its own that editors and scripts understand, then its place in the file.
fn explain_faults(list: &FaultList) {
    let theme =
        if std::io::stderr().is_terminal() { GraphicalTheme::unicode() } else { GraphicalTheme::none() };
    let handler = GraphicalReportHandler::new_themed(theme).with_wrap_lines(false).with_context_lines(1);
    for fault in list.shown() {
        if fault.setting.is_some() {
            // Its place is the command line.
            print(&list.headline(fault));
            fault.help.iter().for_each(|help| print(&format!("  help: {help}")));
            continue;
        }
        let source = Quote::of(list, fault);
        let mut diagnostic = MietteDiagnostic::new(list.headline(fault))
            .with_label(LabeledSpan::at(source.label.clone(), "here"));
        if let Some(help) = &fault.help {
            diagnostic = diagnostic.with_help(help.clone());
        }
        let report = Report::new(diagnostic).with_source_code(source);
        let mut text = String::new();
        match handler.render_report(&mut text, report.as_ref()) {
            // Without colours the line begins with the file, as editors and scripts expect.
            Ok(()) => print(text.strip_prefix("  x ").unwrap_or(&text)),
            Err(_) => print(&list.headline(fault)),
        }
    }
    if let Some(summary) = list.summary() {
        print(&format!("agimp: {summary}"));
    }
}
