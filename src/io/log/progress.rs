//! Progress of a run for its user: a row of figures on a terminal, a line now and then elsewhere.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::telemetry::Record;
use crate::text::{bytes, count, number, quantity, quantity_to};

/// Time between lines where there is no terminal; in long runs a sixtieth of the time so far.
const BETWEEN_LINES: Duration = Duration::from_secs(5);
/// Time between changes on a terminal.
const BETWEEN_DRAWS: Duration = Duration::from_millis(200);
/// Time over which the speed on a terminal is a mean.
const BETWEEN_SPEEDS: Duration = Duration::from_secs(2);
/// Columns of a terminal that does not say how many it has.
const COLUMNS: usize = 80;

/// How the progress is shown.
enum Display {
    Nothing,
    Bar(ProgressBar),
    Lines(Box<dyn Write>),
}

/// Figures that change with each record of telemetry.
#[derive(Clone, Debug, Default)]
struct Known {
    particles: u64,
    /// Coarsest and finest level of the tree.
    levels: Option<[u8; 2]>,
    /// Of all ranks, bytes.
    memory: f64,
    /// In words, for lines.
    words: String,
}

/// The progress of a run, on standard error. Prints on rank 0 only; the other ranks create it silent.
pub struct Progress {
    display: Display,
    start_time: f64,
    end_time: f64,
    began: Instant,
    shown: Option<Instant>,
    known: Known,
    warnings: usize,
    /// How the last load step went, in words; empty without load steps.
    effort: String,
    /// When the mean of the speed began, and at which step.
    since: Option<(Instant, u64)>,
    /// Steps per second.
    speed: Option<f64>,
}

impl Progress {
    /// A run from `start_time` to `end_time` (s), of which the user has been warned `warnings` times.
    /// `speaks` is true on rank 0, unless the user wants a quiet run.
    pub fn new(speaks: bool, start_time: f64, end_time: f64, warnings: usize) -> Self {
        let display = if !speaks {
            Display::Nothing
        } else if std::io::stderr().is_terminal() {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
            // The template is fixed; if it could not be read, the plain style would do.
            if let Ok(style) = ProgressStyle::with_template("{msg}") {
                bar.set_style(style);
            }
            Display::Bar(bar)
        } else {
            Display::Lines(Box::new(std::io::stderr()))
        };
        Self {
            display,
            start_time,
            end_time,
            began: Instant::now(),
            shown: None,
            known: Known::default(),
            warnings,
            effort: String::new(),
            since: None,
            speed: None,
        }
    }

    /// Updates the figures that change slowly: particles, leaves per level, imbalance and memory.
    pub fn record(&mut self, record: &Record) {
        let levels: Vec<String> =
            record.levels.iter().map(|level| format!("{}:{}", level.level, level.leaves)).collect();
        let resampled = record.resampled.map_or_else(String::new, |r| {
            format!(", {} regrids, {} splits, {} merges", r.regrids, count(r.splits), count(r.merges))
        });
        let words = format!(
            "{} particles, leaves {}, imbalance {}, {}/rank{resampled}",
            count(record.particles),
            levels.join(" "),
            number(record.imbalance, 3),
            bytes(record.memory.max)
        );
        let ends = record.levels.first().zip(record.levels.last());
        self.known = Known {
            particles: record.particles,
            levels: ends.map(|(coarse, fine)| [coarse.level, fine.level]),
            memory: record.memory.mean * record.ranks as f64,
            words,
        };
    }

    /// How the load step that is done went: Newton and linear iterations, and the unbalanced force over that
    /// of loads or stress.
    pub fn effort(&mut self, newton: u32, linear: u32, unbalanced: f64) {
        self.effort = format!("  {newton} Newton, {linear} linear iterations, unbalanced {unbalanced:.1e}");
    }

    /// After each step; shows it now and then.
    pub fn step(&mut self, step: u64, time: f64, dt: f64) {
        let pause = match self.display {
            Display::Nothing => return,
            Display::Bar(_) => BETWEEN_DRAWS,
            Display::Lines(_) => BETWEEN_LINES.max(self.began.elapsed() / 60),
        };
        if self.shown.is_some_and(|shown| shown.elapsed() < pause) {
            return;
        }
        self.shown = Some(Instant::now());
        self.show(step, time, dt);
    }

    fn show(&mut self, step: u64, time: f64, dt: f64) {
        let done = self.done(time);
        let left = remaining(self.began.elapsed(), self.done(self.start_time), done);
        self.measure(step);
        let text = self.text(step, time, dt, done, left);
        match &mut self.display {
            Display::Nothing => {}
            Display::Bar(bar) => {
                let columns = console_columns().saturating_sub(1);
                let row = Row {
                    done,
                    step,
                    time,
                    left,
                    speed: self.speed.map(|steps| steps * self.known.particles as f64),
                    known: &self.known,
                    warnings: self.warnings,
                };
                let effort: String = self.effort.trim_start().chars().take(columns).collect();
                let line = if effort.is_empty() { "" } else { "\n" };
                bar.set_message(format!("{}{line}{effort}", row.fit(columns)));
            }
            // A closed pipe must not end the run.
            Display::Lines(out) => drop(writeln!(out, "{text}")),
        }
    }

    /// Steps per second over the last seconds.
    fn measure(&mut self, step: u64) {
        let (since, first) = *self.since.get_or_insert((Instant::now(), step));
        let passed = since.elapsed();
        if passed >= BETWEEN_SPEEDS || self.speed.is_none() && step > first {
            self.speed = Some((step - first.min(step)) as f64 / passed.as_secs_f64().max(1e-9));
        }
        if passed >= BETWEEN_SPEEDS {
            self.since = Some((Instant::now(), step));
        }
    }

    /// Share of the whole run, also where an earlier part of it has done some.
    fn done(&self, time: f64) -> f64 {
        if self.end_time > 0.0 { (time / self.end_time).clamp(0.0, 1.0) } else { 1.0 }
    }

    fn text(&self, step: u64, time: f64, dt: f64, done: f64, left: Option<Duration>) -> String {
        let left = left.map_or_else(|| "?".to_owned(), clock);
        let (time, dt) = (quantity_to(time, "s", 5), quantity(dt, "s"));
        let mut text = format!("{:5.1} %  step {step}  t = {time}  dt = {dt}  ETA {left}", 100.0 * done);
        text.push_str(&self.effort);
        if !self.known.words.is_empty() {
            text.push_str("  ");
            text.push_str(&self.known.words);
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

    /// A message that is shown even in a quiet run. On rank 0 only.
    pub fn warning(&mut self, text: &str) {
        self.warnings += 1;
        match &mut self.display {
            Display::Nothing => warn(text),
            _ => self.message(&format!("agimp: warning: {text}")),
        }
    }

    /// The last state; it stays on the terminal.
    pub fn finish(&mut self, step: u64, time: f64, dt: f64) {
        self.show(step, time, dt);
        if let Display::Bar(bar) = &self.display {
            bar.abandon();
        }
    }
}

/// Warns the user while no progress is shown. To be called on one rank.
pub fn warn(text: &str) {
    // In one piece, or `mpirun` may put its own text between pieces; a closed pipe is no error.
    let _ = std::io::stderr().write_all(format!("agimp: warning: {text}\n").as_bytes());
}

/// Tells the user something while no progress is shown. To be called on one rank.
pub fn tell(text: &str) {
    let _ = std::io::stderr().write_all(format!("{text}\n").as_bytes());
}

/// Columns of the terminal, or [`COLUMNS`] if it does not tell.
fn console_columns() -> usize {
    let asked = rustix::termios::tcgetwinsize(std::io::stderr()).map_or(0, |size| usize::from(size.ws_col));
    if asked == 0 { COLUMNS } else { asked }
}

/// Name, width, figure, and rank: the greater the number, the earlier it is left out.
type Figure = (&'static str, usize, String, i32);

/// Row of figures of the present state, on a terminal.
struct Row<'a> {
    /// Share of the run.
    done: f64,
    step: u64,
    /// s.
    time: f64,
    left: Option<Duration>,
    /// Particles times steps per second.
    speed: Option<f64>,
    known: &'a Known,
    warnings: usize,
}

impl Row<'_> {
    /// Names of the figures, and the figures below them, in at most so many columns: on a narrow terminal the
    /// least important ones are left out.
    fn fit(&self, columns: usize) -> String {
        let known = self.known;
        let levels = match known.levels {
            Some([coarse, fine]) if coarse < fine => format!("{coarse}-{fine}"),
            Some([level, _]) => level.to_string(),
            None => "-".into(),
        };
        let dash = || "-".to_owned();
        let step = if self.step < 10_000_000 { self.step.to_string() } else { compact(self.step as f64) };
        let mut all: Vec<Figure> = vec![
            ("done", 11, format!("{} {:3.0}%", bar(self.done), (100.0 * self.done).floor()), 0),
            ("step", 7, step, 2),
            ("time", 9, quantity(self.time, "s"), 1),
            ("ETA", 8, self.left.map_or_else(|| "?".into(), clock), 0),
            ("p/s", 7, self.speed.map_or_else(dash, compact), 5),
            ("particles", 9, compact(known.particles as f64), 4),
            ("levels", 6, levels, 6),
            ("memory", 8, bytes(known.memory), 7),
            ("warn", 4, self.warnings.min(9999).to_string(), 3),
        ];
        let width = |all: &[Figure]| {
            all.iter().map(|(_, width, text, _)| width.max(&text.chars().count()) + 1).sum::<usize>() - 1
        };
        while width(&all) > columns && all.len() > 1 {
            let least = (0..all.len()).max_by_key(|&at| all[at].3).unwrap_or(0);
            all.remove(least);
        }
        let line = |text: &dyn Fn(&Figure) -> String| {
            let cells: Vec<String> = all.iter().map(|cell| format!("{:>1$}", text(cell), cell.1)).collect();
            let line = cells.join(" ");
            line.chars().take(columns).collect::<String>()
        };
        format!("{}\n{}", line(&|cell| cell.0.to_owned()), line(&|cell| cell.2.clone()))
    }
}

/// Six columns of a bar, filled to a share.
fn bar(done: f64) -> String {
    const WIDTH: usize = 6;
    let filled = ((done * WIDTH as f64) as usize).min(WIDTH);
    format!("{}{}", "█".repeat(filled), "░".repeat(WIDTH - filled))
}

/// A count in at most seven columns: whole below ten thousand, else with three digits: `12.3M`.
fn compact(value: f64) -> String {
    let steps = [(1e15, "P"), (1e12, "T"), (1e9, "G"), (1e6, "M"), (1e4, "k")];
    match steps.into_iter().find(|(least, _)| value >= *least) {
        Some((1e4, unit)) => format!("{}{unit}", number(value / 1e3, 3)),
        Some((least, unit)) => format!("{}{unit}", number(value / least, 3)),
        None => number(value.round(), 4),
    }
}

/// Wall time that is left when the part from `before` to `done` took `elapsed`.
fn remaining(elapsed: Duration, before: f64, done: f64) -> Option<Duration> {
    let own = done - before;
    // Too early for an estimate in the first thousandth of this part.
    (own > 1e-3 * (1.0 - before)).then(|| elapsed.mul_f64((1.0 - done) / own))
}

/// `h:mm:ss`; from a hundred hours on, days and hours.
fn clock(duration: Duration) -> String {
    let seconds = duration.as_secs();
    if seconds >= 360_000 {
        return format!("{}d {}h", seconds / 86_400, seconds / 3600 % 24);
    }
    format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_line_has_it_all() {
        let mut progress = Progress::new(false, 0.0, 6.0, 0);
        progress.known.words = "1 particles".into();
        let done = progress.done(1.5);
        let left = remaining(Duration::from_secs(60), 0.0, done);
        let text = progress.text(12, 1.5, 1e-4, done, left);
        assert_eq!(text, " 25.0 %  step 12  t = 1.5 s  dt = 100 µs  ETA 0:03:00  1 particles");
        assert_eq!(remaining(Duration::from_secs(1), 0.0, 0.0), None);
    }

    /// A run that continues at half of its time shows the progress of the whole run, and estimates the rest
    /// from its own speed.
    #[test]
    fn a_part_of_a_run_counts_from_its_start() {
        let progress = Progress::new(false, 1.0, 2.0, 0);
        assert_eq!(progress.done(1.0), 0.5);
        assert_eq!(progress.done(1.25), 0.625);
        let left = remaining(Duration::from_secs(60), progress.done(1.0), progress.done(1.25));
        assert_eq!(left, Some(Duration::from_secs(180)));
        assert_eq!(remaining(Duration::from_secs(60), 0.5, 0.5), None);
    }

    #[test]
    fn a_terminal_of_80_columns_shows_all_figures_whatever_their_size() {
        let known =
            |particles, levels, memory| Known { particles, levels: Some(levels), memory, ..Known::default() };
        let usual = Row {
            done: 0.423,
            step: 12_345,
            time: 0.1234,
            left: Some(Duration::from_secs(754)),
            speed: Some(3.21e6),
            known: &known(290_000, [3, 6], 1.23e9),
            warnings: 2,
        };
        assert_eq!(
            usual.fit(79),
            "       done    step      time      ETA     p/s particles levels   memory warn\n\
             ██░░░░  42%   12345  123.4 ms  0:12:34   3.21M      290k    3-6   1.2 GB    2"
        );
        let largest = Row {
            done: 1.0,
            step: 9_876_543_210,
            time: 1234.5e-9,
            left: Some(Duration::from_secs(8_639_999)),
            speed: Some(9.876e11),
            known: &known(999_999_999_999, [10, 20], 999.9e12),
            warnings: 123_456,
        };
        let least = Row {
            done: 0.0,
            step: 0,
            time: 0.0,
            left: None,
            speed: None,
            known: &Known::default(),
            warnings: 0,
        };
        for row in [&usual, &largest, &least] {
            for line in row.fit(79).lines() {
                assert!(line.chars().count() <= 79, "{line}");
            }
            for name in ["done", "step", "time", "ETA", "p/s", "particles", "levels", "memory", "warn"] {
                assert!(row.fit(79).contains(name), "{name} is shown");
            }
            // Narrow ones keep the progress and the remaining time.
            for columns in [1, 10, 30, 50] {
                let text = row.fit(columns);
                assert!(
                    text.lines().count() == 2 && text.lines().all(|line| line.chars().count() <= columns)
                );
            }
            assert!(row.fit(40).contains("done") && row.fit(40).contains("ETA"));
        }
    }
}
