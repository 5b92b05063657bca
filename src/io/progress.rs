//! What a user sees while the run goes on: a bar on a terminal, a line every few seconds elsewhere.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::telemetry::Record;
use crate::text::{bytes, count, number, quantity, quantity_to};

/// Time between lines where there is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(5);
/// Time between changes of the bar.
const BETWEEN_DRAWS: Duration = Duration::from_millis(200);
/// Units of the bar.
const LENGTH: u64 = 1000;

/// How the progress is shown.
enum Display {
    Nothing,
    Bar(ProgressBar),
    Lines(Box<dyn Write>),
}

/// The progress of a run, on standard error. Speaks on rank 0 only; the other ranks create it silent.
pub struct Progress {
    display: Display,
    start_time: f64,
    end_time: f64,
    began: Instant,
    shown: Option<Instant>,
    tree: String,
}

impl Progress {
    /// A run from `start_time` to `end_time` (s). `speaks` on rank 0 and unless the user wants it quiet.
    pub fn new(speaks: bool, start_time: f64, end_time: f64) -> Self {
        let display = if !speaks {
            Display::Nothing
        } else if std::io::stderr().is_terminal() {
            let bar = ProgressBar::with_draw_target(Some(LENGTH), ProgressDrawTarget::stderr());
            // The template is fixed; if it could not be read, the plain style would do.
            if let Ok(style) = ProgressStyle::with_template("{bar:30.cyan/blue} {msg}") {
                bar.set_style(style);
            }
            Display::Bar(bar)
        } else {
            Display::Lines(Box::new(std::io::stderr()))
        };
        let tree = String::new();
        Self { display, start_time, end_time, began: Instant::now(), shown: None, tree }
    }

    /// Takes over what changes slowly: particles, leaves per level, imbalance and memory.
    pub fn record(&mut self, record: &Record) {
        let levels: Vec<String> =
            record.levels.iter().map(|level| format!("{}:{}", level.level, level.leaves)).collect();
        let resampled = record.resampled.map_or_else(String::new, |r| {
            format!(", {} regrids, {} splits, {} merges", r.regrids, count(r.splits), count(r.merges))
        });
        self.tree = format!(
            "{} particles, leaves {}, imbalance {}, {}/rank{resampled}",
            count(record.particles),
            levels.join(" "),
            number(record.imbalance, 3),
            bytes(record.memory.max)
        );
    }

    /// After each step; shows it now and then.
    pub fn step(&mut self, step: u64, time: f64, dt: f64) {
        let pause = match self.display {
            Display::Nothing => return,
            Display::Bar(_) => BETWEEN_DRAWS,
            Display::Lines(_) => BETWEEN_LINES,
        };
        if self.shown.is_some_and(|shown| shown.elapsed() < pause) {
            return;
        }
        self.shown = Some(Instant::now());
        self.show(step, time, dt);
    }

    fn show(&mut self, step: u64, time: f64, dt: f64) {
        let done = self.done(time);
        let left = remaining(self.began.elapsed(), done);
        let text = self.text(step, time, dt, done, left);
        match &mut self.display {
            Display::Nothing => {}
            Display::Bar(bar) => {
                bar.set_position((done * LENGTH as f64) as u64);
                bar.set_message(text);
            }
            // A closed pipe must not end the run.
            Display::Lines(out) => drop(writeln!(out, "{text}")),
        }
    }

    fn done(&self, time: f64) -> f64 {
        let whole = self.end_time - self.start_time;
        if whole > 0.0 { ((time - self.start_time) / whole).clamp(0.0, 1.0) } else { 1.0 }
    }

    fn text(&self, step: u64, time: f64, dt: f64, done: f64, left: Option<Duration>) -> String {
        let left = left.map_or_else(|| "?".to_owned(), clock);
        let (time, dt) = (quantity_to(time, "s", 5), quantity(dt, "s"));
        let mut text = format!("{:5.1} %  step {step}  t = {time}  dt = {dt}  ETA {left}", 100.0 * done);
        if !self.tree.is_empty() {
            text.push_str("  ");
            text.push_str(&self.tree);
        }
        text
    }

    /// A message between the progress, for example that a file was written.
    pub fn message(&mut self, text: &str) {
        match &mut self.display {
            Display::Nothing => {}
            Display::Bar(bar) => bar.println(text),
            Display::Lines(out) => drop(writeln!(out, "{text}")),
        }
    }

    /// A message that is shown even if the user wants it quiet. On rank 0 only.
    pub fn warning(&mut self, text: &str) {
        match &mut self.display {
            Display::Nothing => warn(text),
            _ => self.message(&format!("agimp: warning: {text}")),
        }
    }

    /// The last state; the bar stays on the terminal.
    pub fn finish(&mut self, step: u64, time: f64, dt: f64) {
        self.show(step, time, dt);
        if let Display::Bar(bar) = &self.display {
            bar.abandon();
        }
    }
}

/// Warns the user while no progress is shown. To be called on one rank.
pub fn warn(text: &str) {
    // In one piece, or `mpirun` may put its own words between pieces; a closed pipe is no error.
    let _ = std::io::stderr().write_all(format!("agimp: warning: {text}\n").as_bytes());
}

/// Wall time that is left when the part `done` took `elapsed`.
fn remaining(elapsed: Duration, done: f64) -> Option<Duration> {
    // Too early for an estimate in the first thousandth.
    (done > 1e-3).then(|| elapsed.mul_f64((1.0 - done) / done))
}

/// `h:mm:ss`.
fn clock(duration: Duration) -> String {
    let seconds = duration.as_secs();
    format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_line_has_it_all() {
        let progress = Progress {
            display: Display::Nothing,
            start_time: 1.0,
            end_time: 3.0,
            began: Instant::now(),
            shown: None,
            tree: "1 particles".into(),
        };
        let done = progress.done(1.5);
        let left = remaining(Duration::from_secs(60), done);
        let text = progress.text(12, 1.5, 1e-4, done, left);
        assert_eq!(text, " 25.0 %  step 12  t = 1.5 s  dt = 100 µs  ETA 0:03:00  1 particles");
        assert_eq!(remaining(Duration::from_secs(1), 0.0), None);
    }
}
