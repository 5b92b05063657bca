//! The `agimp` program: maps what a command returns to messages and an exit code.
use agimp::cli::{Arguments, Failure, execute};
use agimp::job::{FaultList, JobError};
use clap::Parser as _;
use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, NamedSource, Report};
use std::io::{IsTerminal as _, Write as _};
use std::process::ExitCode;

fn main() -> ExitCode {
    agimp::memory::return_large_blocks();
    match execute(Arguments::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            explain(&failure);
            ExitCode::from(failure.exit_code())
        }
    }
}

fn explain(failure: &Failure) {
    match failure {
        Failure::Job(JobError::Invalid(list)) => explain_faults(list),
        Failure::Elsewhere(_) => {}
        other => tell(&format!("agimp: {other}")),
    }
}

/// Writes a message in one piece: `mpirun` may put its own words between pieces. If nobody listens, nobody is told.
fn tell(text: &str) {
    let _ = std::io::stderr().write_all(format!("{text}\n").as_bytes());
}

/// Each fault on a line of its own that editors and scripts understand, then its place in the file.
fn explain_faults(list: &FaultList) {
    let theme =
        if std::io::stderr().is_terminal() { GraphicalTheme::unicode() } else { GraphicalTheme::none() };
    let handler = GraphicalReportHandler::new_themed(theme).with_wrap_lines(false).with_context_lines(1);
    for fault in &list.faults {
        let mut diagnostic = MietteDiagnostic::new(list.headline(fault))
            .with_label(LabeledSpan::at(fault.span.clone(), "here"));
        if let Some(help) = &fault.help {
            diagnostic = diagnostic.with_help(help.clone());
        }
        let source = NamedSource::new(list.path.display().to_string(), list.text.clone());
        let report = Report::new(diagnostic).with_source_code(source);
        let mut text = String::new();
        match handler.render_report(&mut text, report.as_ref()) {
            // Without colours the line begins with the file, as editors and scripts like it.
            Ok(()) => tell(text.strip_prefix("  x ").unwrap_or(&text)),
            Err(_) => tell(&list.headline(fault)),
        }
    }
    if list.faults.len() > 1 {
        tell(&format!("agimp: {} faults in {}", list.faults.len(), list.path.display()));
    }
}
