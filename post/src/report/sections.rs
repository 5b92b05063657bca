//! Sections of a page that are words, numbers and tables.
use std::fmt::Write as _;

use super::figures::{charts, section};
use super::history::History;
use super::results::{Results, State};
use super::run::Run;
use agimp::io::snapshot;
use agimp::text::{bytes, count, html, number, quantity, wall_time};

/// Summary: time, steps, sizes and cost of the run.
pub(super) fn facts(body: &mut String, run: &Run) {
    let last = |name: &str| run.history.last(name);
    let mut facts: Vec<(&str, String)> = Vec::new();
    if let Some(time) = last("time") {
        let end = run.end().map_or(String::new(), |end| format!(" of {}", quantity(end, "s")));
        facts.push(("simulated time", format!("{}{end}", quantity(time, "s"))));
    }
    if let Some(step) = run.history.steps.last() {
        facts.push(("steps", count(*step)));
    }
    if let Some(dt) = last("dt").filter(|dt| *dt > 0.0) {
        facts.push(("time step", quantity(dt, "s")));
    }
    if let Some(particles) = last("particles") {
        facts.push(("particles", count(particles as u64)));
    }
    if let Some(record) = run.cost.records.last() {
        let leaves = record.levels.iter().map(|level| level.leaves).sum();
        let (low, high) = (record.levels.first(), record.levels.last());
        let levels = match (low, high) {
            (Some(low), Some(high)) if low.level < high.level => {
                format!("levels {} to {}", low.level, high.level)
            }
            (Some(low), _) => format!("level {}", low.level),
            _ => String::new(),
        };
        facts.push(("leaves", format!("{} <small>{levels}</small>", count(leaves))));
        facts.push(("wall time", wall_time(run.cost.wall)));
        facts.push((
            "speed",
            format!("{} <small>million particle steps/s</small>", number(run.cost.speed() / 1e6, 3)),
        ));
        let threads =
            if record.threads == 1 { "1 thread".into() } else { format!("{} threads", record.threads) };
        let ranks = if record.ranks == 1 { "1 rank".into() } else { format!("{} ranks", record.ranks) };
        facts.push(("processes", format!("{ranks} <small>x {threads}</small>")));
        facts.push(("most memory", format!("{} <small>per rank</small>", bytes(run.cost.memory()))));
        if record.ranks > 1 {
            facts.push(("imbalance", format!("{} <small>mean</small>", number(run.cost.imbalance(), 3))));
        }
    }
    body.push_str("<section id=\"facts\">\n<dl class=\"facts\">\n");
    for (name, value) in facts {
        let _ = writeln!(body, "<div><dt>{name}</dt><dd>{value}</dd></div>");
    }
    body.push_str("</dl>\n");
}

/// Why a run has ended ahead of its time, what to do, and from which file it can continue.
pub(super) fn ending(body: &mut String, run: &Run, results: &Results) {
    let (reason, advice) = match &run.state {
        State::Finished | State::Running(_) => return,
        State::Told(ending) => (ending.reason.as_str(), ending.advice.as_str()),
        State::Ended => (
            "The run left no message: it was killed, or its machine failed.",
            "Check the messages of the batch system or the kernel: wall time, memory (see the chart below).",
        ),
    };
    let _ = write!(
        body,
        "<div class=\"failure\">\n<p><b>Why it ended:</b> {}</p>\n<p><b>What to do:</b> {}</p>\n",
        html(reason),
        html(advice)
    );
    match results.last_state() {
        Some((path, step, time)) => {
            let job = run.outputs.last().map(|output| snapshot::job_files(output)).unwrap_or_default();
            let job = job.into_iter().find(|job| job.is_file());
            let job = job
                .and_then(|job| job.canonicalize().ok())
                .map_or_else(|| format!("{}.toml", results.name), |job| job.display().to_string());
            let _ = writeln!(
                body,
                "<p><b>Last state:</b> <code>{}</code>, t = {}, step {}. To continue from it: <code>agimp run {} --restart \
                 latest</code></p>",
                html(&path.display().to_string()),
                quantity(time, "s"),
                count(step),
                html(&job)
            );
        }
        None => body.push_str("<p><b>Last state:</b> none that a run can continue from; start again.</p>\n"),
    }
    body.push_str("</div>\n");
}

/// Warnings, messages and stages.
pub(super) fn remarks(body: &mut String, run: &Run) {
    let Some(report) = &run.report else { return };
    for warning in &report.warnings {
        let _ = writeln!(body, "<p class=\"warning\">{}</p>", html(warning));
    }
    if !report.stages.is_empty() {
        section(body, "stages", "Stages");
        body.push_str("<ol class=\"stages\">\n");
        for (name, start) in &report.stages {
            let _ = writeln!(body, "<li>{} <small>from {}</small></li>", html(name), quantity(*start, "s"));
        }
        body.push_str("</ol>\n");
    }
    if !report.messages.is_empty() {
        body.push_str("<details><summary>Messages of the run</summary>\n<ul>\n");
        report.messages.iter().for_each(|text| {
            let _ = writeln!(body, "<li>{}</li>", html(text));
        });
        body.push_str("</ul></details>\n");
    }
}

/// First and last row of the history with the extremes of each column.
pub(super) fn table(body: &mut String, history: &History) {
    if history.steps.is_empty() {
        return;
    }
    section(body, "results", "Numbers");
    body.push_str(
        "<table><thead><tr><th>column of the history</th><th>start</th><th>end</th><th>least</th><th>greatest</th>\
         <th>unit</th></tr></thead><tbody>\n",
    );
    let mut zero = Vec::new();
    for column in &history.columns {
        let values = || column.values.iter().copied().filter(|value| value.is_finite());
        let (least, most) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        if least == 0.0 && most == 0.0 {
            zero.push(html(&column.name));
            continue;
        }
        let ends = [column.values.first(), column.values.last(), Some(&least), Some(&most)];
        let _ = write!(body, "<tr><td><code>{}</code></td>", html(&column.name));
        for value in ends.into_iter().flatten() {
            let text = if value.is_finite() { number(*value, 6) } else { "–".into() };
            let _ = write!(body, "<td>{text}</td>");
        }
        let _ = writeln!(body, "<td>{}</td></tr>", html(&column.unit));
    }
    body.push_str("</tbody></table>\n");
    if !zero.is_empty() {
        let _ = writeln!(body, "<p><small>0 throughout: {}</small></p>", zero.join(", "));
    }
}

/// Time by phase.
pub(super) fn costs(body: &mut String, run: &Run) {
    if run.cost.records.is_empty() {
        return;
    }
    section(body, "cost", "Time by phase");
    let whole = run.cost.wall.max(f64::MIN_POSITIVE);
    body.push_str("<table class=\"bars\"><tbody>\n");
    for phase in &run.cost.phases {
        let share = 100.0 * phase.mean / whole;
        let slowest = if run.cost.ranks > 1 {
            format!("<td>{} on the slowest rank</td>", seconds(phase.most))
        } else {
            String::new()
        };
        let _ = writeln!(
            body,
            "<tr><td>{}</td><td>{}</td><td>{share:.1} %</td>{slowest}<td class=\"bar\"><i style=\"width:{share:.2}%\"></i></td></tr>",
            html(&phase.words),
            seconds(phase.mean),
        );
    }
    body.push_str("</tbody></table>\n");
    charts(body, "balance", "Speed, balance and memory", &run.cost.panels());
}

fn seconds(seconds: f64) -> String {
    if seconds < 100.0 { format!("{seconds:.2} s") } else { wall_time(seconds) }
}

/// The job, and which program ran it.
pub(super) fn job(body: &mut String, run: &Run) {
    section(body, "job", "Job");
    let mut facts = Vec::new();
    if let Some(header) = &run.header {
        facts.push(format!("outputs written by agimp {} (format {})", header.program, header.format));
        facts.push(format!("job digest {:016x}", header.job_digest));
        facts.push(format!("materials: {}", header.materials.join(", ")));
        facts.push(format!("bodies: {}", header.bodies.join(", ")));
    }
    facts.push(format!("page written by agimp {}", env!("CARGO_PKG_VERSION")));
    let _ = writeln!(body, "<p>{}</p>", html(&facts.join("; ")));
    if let Some(text) = &run.job_text {
        let _ = writeln!(body, "<pre>{}</pre>", html(text));
    }
}

/// Files in the directory, by kind, with their number and size.
pub(super) fn files(body: &mut String, results: &Results) {
    section(body, "files", "Files");
    let directory = html(&results.directory.display().to_string());
    let _ = writeln!(body, "<p>In <code>{directory}</code>:</p>\n<table><tbody>");
    for (name, number, size) in results.files() {
        let number = if number == 1 { String::new() } else { format!("{} files", count(number)) };
        let _ = writeln!(
            body,
            "<tr><td><code>{}</code></td><td>{number}</td><td>{}</td></tr>",
            html(&name),
            bytes(size as f64)
        );
    }
    let series = format!("{}/{}.hdf.series", results.directory.display(), results.name);
    let _ = writeln!(
        body,
        "</tbody></table>\n<p>Rotate and cut the particles in a browser: <code>agimp view {0}</code>; or open <code>{0}</code> in ParaView.</p>",
        html(&series)
    );
}
