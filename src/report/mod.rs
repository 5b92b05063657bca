//! `NAME.report.html`: a run on one page, from the files that it has written so far.
//!
//! | file | what it does |
//! |---|---|
//! | this | the page, section by section |
//! | `results.rs` | the files of a run: which are there, and how far it has come |
//! | `history.rs` | the table of the history |
//! | `panels.rs` | columns of the history that belong into one chart |
//! | `cost.rs` | where the time went, balance and memory, from telemetry |
//! | `page.html`, `page.css` | frame and looks of the page |
//!
//! Runs that go on, and runs that have ended by a fault, are shown as far as they have come.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use crate::io::chart::{COLOURS, Chart};
use crate::io::hdf5_file::FileError;
use crate::io::lines::write_whole;
use crate::io::picture;
use crate::io::snapshot::Header;
use crate::run::scene;
use crate::text::{bytes, count, html, number, quantity, quantity_to, scale, wall_time};

mod cost;
mod history;
mod panels;
mod results;

use cost::Cost;
use history::History;
use panels::Panel;
use results::State;
pub use results::{Results, Unclear};

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
/// Pixels of a picture, and of a chart, which is shown at half of its size.
const PICTURE: [usize; 2] = [1000, 640];
const CHART: (u32, u32) = (1120, 560);

/// What goes into a page.
#[derive(Clone, Debug)]
pub struct Options {
    /// Quantity that colours the pictures, as for `agimp plot`; `None` for plastic strain if there is any, else the speed.
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
    remarks(&mut body, &run);
    pictures(&mut body, &run, options)?;
    charts(&mut body, "curves", "Over time", &panels::panels(&run.history));
    table(&mut body, &run.history);
    collapse(&mut body, &run);
    costs(&mut body, &run);
    job(&mut body, &run);
    files(&mut body, results);
    let name = html(&results.name);
    let title = run.title().map_or_else(|| name.clone(), |title| html(&title));
    let (state, sentence) = run.state();
    let page = PAGE.replace("/*STYLE*/", STYLE).replace("TITLE", &title).replace("NAME", &name);
    let page = page.replace("STATE", state).replace("SENTENCE", &html(&sentence));
    Ok(page.replace("<!--BODY-->", &body))
}

/// What the files of a run say.
struct Run<'a> {
    results: &'a Results,
    history: History,
    cost: Cost,
    report: Option<crate::run::report::Report>,
    state: State,
    /// Text of the job.
    job: Option<String>,
}

impl<'a> Run<'a> {
    fn read(results: &'a Results) -> Self {
        Self {
            results,
            history: History::read(&results.path("history.csv")),
            cost: Cost::read(&results.path("telemetry.jsonl")),
            report: results.report(),
            state: results.state(),
            job: results.job_text(),
        }
    }

    /// A value of the job at its top or in a table.
    fn of_job(&self, table: &str, key: &str) -> Option<toml::Value> {
        let job: toml::Table = toml::from_str(self.job.as_deref()?).ok()?;
        if table.is_empty() { job.get(key).cloned() } else { job.get(table)?.get(key).cloned() }
    }

    fn title(&self) -> Option<String> {
        let title = self.of_job("", "title")?.as_str()?.trim().to_owned();
        (!title.is_empty()).then_some(title)
    }

    /// End of the run that the job asks for, s.
    fn end(&self) -> Option<f64> {
        let end = self.of_job("time", "end")?;
        end.as_float().or_else(|| end.as_integer().map(|end| end as f64))
    }

    /// A word for the looks of the page, and a sentence.
    fn state(&self) -> (&'static str, String) {
        let time = self.history.last("time").map_or("its start".into(), |time| quantity(time, "s"));
        let end = self.end().map_or(String::new(), |end| format!(" of {}", quantity(end, "s")));
        match &self.state {
            State::Finished => ("finished", format!("finished at {time}")),
            State::Running(holder) => ("running", format!("running, at {time}{end} ({holder})")),
            State::Ended => ("ended", format!("ended without finishing, at {time}{end}")),
        }
    }
}

/// Begins a section.
fn section(body: &mut String, id: &str, title: &str) {
    let _ = write!(body, "</section>\n<section id=\"{id}\">\n<h2>{title}</h2>\n");
}

/// What one wants to know first.
fn facts(body: &mut String, run: &Run<'_>) {
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

/// Warnings, messages and stages.
fn remarks(body: &mut String, run: &Run<'_>) {
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
        body.push_str("<details><summary>What the run said</summary>\n<ul>\n");
        report.messages.iter().for_each(|text| {
            let _ = writeln!(body, "<li>{}</li>", html(text));
        });
        body.push_str("</ul></details>\n");
    }
}

/// Outputs from the first to the last, with one frame and one range of colours.
fn pictures(body: &mut String, run: &Run<'_>, options: &Options) -> Result<(), FileError> {
    let outputs = run.results.outputs();
    let wanted = options.pictures.min(outputs.len());
    if wanted == 0 {
        return Ok(());
    }
    // The last one always; the first one if there is room.
    let last = outputs.len() - 1;
    let mut chosen: Vec<_> =
        (0..wanted).map(|i| last - last * (wanted - 1 - i) / wanted.max(2).saturating_sub(1)).collect();
    chosen.dedup();
    let files: Vec<_> = chosen.into_iter().map(|number| outputs[number].clone()).collect();
    let job = scene::job_of(&outputs[last], options.job.as_deref()).ok();
    let solids = |header: &Header| job.as_ref().map_or_else(Vec::new, |job| scene::solids_of(job, header));
    let mut settings = picture::Settings::new("");
    [settings.width, settings.height] = PICTURE;
    let survey = |colour: &str| picture::survey(&files, colour, &settings, &solids);
    let (colour, look) = match &options.colour {
        Some(colour) => (colour.as_str(), survey(colour)?),
        None => {
            let plastic = survey("plastic_strain").ok().filter(|look| look.range[1] > look.range[0]);
            match plastic {
                Some(look) => ("plastic_strain", look),
                None => ("speed", survey("speed")?),
            }
        }
    };
    section(body, "pictures", "Pictures");
    let _ = write!(
        body,
        "<p>Coloured by {}, all with one range.</p>\n<div class=\"grid\">\n",
        html(&colour.replace('_', " "))
    );
    (settings.range, settings.frame) = (Some(look.range), Some(look.frame));
    for file in &files {
        let (png, time) = picture::png_of_file(file, colour, &settings, &solids)?;
        let (data, time) = (BASE64.encode(png), quantity(time, "s"));
        let name = html(&file.file_name().unwrap_or_default().to_string_lossy());
        let _ = writeln!(
            body,
            "<figure><img alt=\"particles at {time}\" src=\"data:image/png;base64,{data}\"><figcaption>t = {time} \
             <small>{name}</small></figcaption></figure>"
        );
    }
    body.push_str("</div>\n");
    Ok(())
}

/// Charts side by side, each with its curves named in their colours.
fn charts(body: &mut String, id: &str, title: &str, panels: &[Panel]) {
    let mut drawn = String::new();
    for panel in panels {
        let greatest = |values: &mut dyn Iterator<Item = f64>| {
            values.filter(|x| x.is_finite()).fold(0.0, |m: f64, x| m.max(x.abs()))
        };
        let points = || panel.curves.iter().flat_map(|(_, points)| points);
        let (by, unit) = scale(greatest(&mut points().map(|p| p.1)), &panel.unit);
        let (by_across, unit_across) = scale(greatest(&mut points().map(|p| p.0)), &panel.across.1);
        let scaled = |points: &[(f64, f64)]| points.iter().map(|(x, y)| (x / by_across, y / by)).collect();
        let chart = Chart {
            across: format!("{} ({unit_across})", panel.across.0),
            up: unit,
            from_zero: false,
            is_logarithmic: panel.is_logarithmic,
            curves: panel.curves.iter().map(|(_, points)| scaled(points)).collect(),
        };
        let svg = if chart.is_empty() { continue } else { chart.svg(CHART) };
        let Ok(svg) = svg else { continue };
        let _ = write!(drawn, "<figure class=\"chart\"><figcaption><b>{}</b>", html(&panel.title));
        for (number, (name, _)) in panel.curves.iter().enumerate().filter(|_| panel.curves.len() > 1) {
            let colour = COLOURS[number % COLOURS.len()];
            let _ = write!(drawn, " <span class=\"key\" style=\"--c:{colour}\">{}</span>", html(name));
        }
        let _ = writeln!(drawn, "</figcaption>\n{svg}</figure>");
    }
    if !drawn.is_empty() {
        section(body, id, title);
        let _ = write!(body, "<div class=\"grid\">\n{drawn}</div>\n");
    }
}

/// First and last row of the history with the extremes of each column.
fn table(body: &mut String, history: &History) {
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
        let _ = writeln!(body, "<p><small>0 all the time: {}</small></p>", zero.join(", "));
    }
}

/// The deposit of a collapsed column beside published laws.
fn collapse(body: &mut String, run: &Run<'_>) {
    let Some(deposit) = run.report.as_ref().and_then(|report| report.column_collapse.as_ref()) else {
        return;
    };
    section(body, "collapse", "Column collapse");
    let metres = |value: Option<f64>| value.map_or("–".into(), |value| quantity_to(value, "m", 3));
    let _ = write!(
        body,
        "<p>Height over radius at the start: {}.</p>\n<table><thead><tr><th></th><th>run-out</th><th>height</th></tr></thead>\
         <tbody>\n<tr><td>this run (98 % of the mass)</td><td>{}</td><td>{}</td></tr>\n",
        number(deposit.aspect, 4),
        metres(Some(deposit.run_out)),
        metres(Some(deposit.height)),
    );
    let _ = writeln!(
        body,
        "<tr><td>this run (connected deposit)</td><td>{}</td><td></td></tr>",
        metres(Some(deposit.outer_edge))
    );
    for (authors, [run_out, height]) in &deposit.laws {
        let _ = writeln!(
            body,
            "<tr><td>{}</td><td>{}</td><td>{}</td></tr>",
            html(authors),
            metres(*run_out),
            metres(*height)
        );
    }
    body.push_str("</tbody></table>\n");
}

/// Where the time went.
fn costs(body: &mut String, run: &Run<'_>) {
    if run.cost.records.is_empty() {
        return;
    }
    section(body, "cost", "Where the time went");
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
fn job(body: &mut String, run: &Run<'_>) {
    section(body, "job", "Job");
    let mut facts = Vec::new();
    if let Some(header) = run.results.header() {
        facts.push(format!("outputs written by agimp {} (format {})", header.program, header.format));
        facts.push(format!("job digest {:016x}", header.job_digest));
        facts.push(format!("materials: {}", header.materials.join(", ")));
        facts.push(format!("bodies: {}", header.bodies.join(", ")));
    }
    facts.push(format!("page written by agimp {}", env!("CARGO_PKG_VERSION")));
    let _ = writeln!(body, "<p>{}</p>", html(&facts.join("; ")));
    if let Some(text) = &run.job {
        let _ = writeln!(body, "<pre>{}</pre>", html(text));
    }
}

/// What is in the directory.
fn files(body: &mut String, results: &Results) {
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
        "</tbody></table>\n<p>Turn and cut the particles in a browser: <code>agimp view {0}</code>; or open <code>{0}</code> in ParaView.</p>",
        html(&series)
    );
}

#[cfg(test)]
mod tests {
    use super::*;

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
