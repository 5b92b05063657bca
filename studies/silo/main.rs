//! Compares the rates at which a silo discharges with Beverloo's law, and writes a page about it.
//!
//! `studies/silo/run` makes the runs and starts it.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[path = "../common.rs"]
mod common;
#[path = "../verification/plot.rs"]
mod plot;

use common::{checked, history};
use plot::{Chart, Series};

/// Runs, the whole width of their slot in cells of 1/256 m, and the edge of their cells, mm.
const RUNS: [(&str, f64, f64); 5] = [
    ("7", 7.0, 3.90625),
    ("11", 11.0, 3.90625),
    ("15", 15.0, 3.90625),
    ("19", 19.0, 3.90625),
    ("fine_10.5", 10.5, 1.953_125),
];
/// Density of the sand at rest, kg/m³, and gravity, m/s².
const DENSITY: f64 = 1500.0;
const GRAVITY: f64 = 9.81;
/// Part of the sand that has passed the slot where the rate is first and last counted.
const WINDOW: [f64; 2] = [0.1, 0.6];
/// Parts of the discharge over which rates are compared.
const SLICE: f64 = 0.05;
/// Beverloo's coefficient for slots, R. M. Nedderman, Statics and Kinematics of Granular Materials (1992).
const SLOT: f64 = 1.03;

/// A discharge: of the whole silo, the double of what the run has.
struct Discharge {
    /// Width of the slot, m.
    width: f64,
    /// Time, s, and mass that has passed the slot, kg/m.
    passed: Vec<[f64; 2]>,
    /// Mass at the start, kg/m.
    whole: f64,
    /// Whether mass inside and out made up the whole in every row, to the last bit.
    is_exact: bool,
}

impl Discharge {
    fn read(directory: &Path, cells: f64) -> Self {
        let names = ["time [s]", "mass [kg]", "passed_out [kg]", "passed_slot [kg]"];
        let rows = history(&directory.join("silo.history.csv"), names);
        let whole = rows[0][1];
        Self {
            width: cells / 256.0,
            passed: rows.iter().map(|[time, _, _, slot]| [*time, 2.0 * slot]).collect(),
            whole: 2.0 * whole,
            is_exact: rows.iter().all(|[_, mass, out, _]| mass + out == whole),
        }
    }

    /// Time at which so much of the whole has passed, s; of the end where it has not.
    fn time_of(&self, part: f64) -> f64 {
        let next = self.passed.partition_point(|row| row[1] < part * self.whole);
        let [to, from] =
            [next.min(self.passed.len() - 1), next.saturating_sub(1)].map(|row| self.passed[row]);
        let share = if to[1] > from[1] { (part * self.whole - from[1]) / (to[1] - from[1]) } else { 0.0 };
        from[0] + share.clamp(0.0, 1.0) * (to[0] - from[0])
    }

    /// Mean rate between two parts of the discharge, kg/(m s).
    fn rate(&self, [from, to]: [f64; 2]) -> f64 {
        (to - from) * self.whole / (self.time_of(to) - self.time_of(from))
    }

    /// The last part of the window that has passed.
    fn window(&self) -> [f64; 2] {
        let last = self.passed.last().map_or(0.0, |row| row[1] / self.whole);
        [WINDOW[0], WINDOW[1].min((last / SLICE).floor() * SLICE)]
    }

    /// Rates of the slices of the window.
    fn slices(&self) -> Vec<f64> {
        let [from, to] = self.window();
        let count = ((to - from) / SLICE).round() as usize;
        (0..count).map(|i| from + i as f64 * SLICE).map(|part| self.rate([part, part + SLICE])).collect()
    }

    /// Coefficient of Beverloo's law without the size of grains.
    fn coefficient(&self, rate: f64) -> f64 {
        rate / (DENSITY * GRAVITY.sqrt() * self.width.powf(1.5))
    }
}

/// Slope and value at 0 of the line through points by least squares.
fn line(points: &[[f64; 2]]) -> [f64; 2] {
    let n = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / n;
    let [x, y] = [mean(0), mean(1)];
    let slope = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>()
        / points.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>();
    [slope, y - slope * x]
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [runs, page] = arguments.as_slice() else {
        eprintln!("usage: silo RUNS PAGE.md");
        return ExitCode::from(2);
    };
    let (runs, page) = (PathBuf::from(runs), PathBuf::from(page));
    let plots = page.with_extension("");
    checked(std::fs::create_dir_all(&plots), plots.display());
    let about = Path::new("studies/silo/about.md");
    let mut text = checked(std::fs::read_to_string(about), about.display());
    let _ = writeln!(
        text,
        "| slot, mm | cells, mm | slot in cells | counted from, to | rate, kg/(m s) | greatest difference of a slice | C | mass in + mass out = total |\n\
         |---|---|---|---|---|---|---|---|"
    );
    let (mut mass, mut rates, mut offset) = (Vec::new(), Vec::new(), Vec::new());
    for (name, cells, edge) in RUNS {
        let run = Discharge::read(&runs.join(name), cells);
        let (window, slices) = (run.window(), run.slices());
        let rate = run.rate(window);
        let noise = slices.iter().map(|slice| (slice / rate - 1.0).abs()).fold(0.0, f64::max);
        let _ = writeln!(
            text,
            "| {:.1} | {edge:.2} | {:.0} | {:.0} to {:.0} % | {rate:.1} | {:.1} % | {:.3} | {} |",
            1e3 * run.width,
            1e3 * run.width / edge,
            100.0 * window[0],
            100.0 * window[1],
            100.0 * noise,
            run.coefficient(rate),
            if run.is_exact { "to the last bit" } else { "**no**" },
        );
        if edge > 3.0 {
            rates.push([run.width.ln(), rate.ln()]);
            offset.push([run.width, rate.powf(2.0 / 3.0)]);
            let points = run.passed.iter().step_by(20).map(|row| [row[0], row[1] / run.whole]).collect();
            mass.push(Series { name: format!("{:.0} mm", 1e3 * run.width), points, marks: false });
        }
    }
    let [exponent, _] = line(&rates);
    let [slope, value] = line(&offset);
    let constant = slope.powf(1.5) / (DENSITY * GRAVITY.sqrt());
    let missing = -value / slope;
    let _ = writeln!(
        text,
        "\nThe four rates in cells of 3.91 mm follow a power of the width with the exponent {exponent:.2}. As C ρ √g (B − b)^{{3/2}} they have \
         C = {constant:.2} and b = {:.1} mm, which is {:.1} cells.",
        1e3 * missing,
        1e3 * missing / 3.90625
    );
    let folder = plots.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut show = |name: &str, chart: &Chart<'_>| {
        checked(std::fs::write(plots.join(name), chart.svg()), name);
        let _ = writeln!(text, "\n![{}]({folder}/{name})", chart.title);
    };
    let title = "Part of the sand that has passed the slot";
    let labels = ["time, s", "part"];
    show("mass.svg", &Chart { title, labels, logarithmic: [false; 2], series: mass });
    let widths = (0..=40).map(|i| f64::from(i) * 2.5e-3);
    let law: Vec<[f64; 2]> =
        widths.map(|b| [1e3 * b, SLOT * DENSITY * GRAVITY.sqrt() * b.powf(1.5)]).collect();
    let found = rates.iter().map(|[width, rate]| [1e3 * width.exp(), rate.exp()]).collect();
    let series = vec![
        Series { name: "agimp".into(), points: found, marks: true },
        Series { name: format!("Beverloo, C = {SLOT}, no size of grains"), points: law, marks: false },
    ];
    let title = "Rate of discharge";
    let labels = ["width of the slot, mm", "rate, kg/(m s)"];
    show("rate.svg", &Chart { title, labels, logarithmic: [false; 2], series });
    checked(std::fs::write(&page, text), page.display());
    println!("{} written", page.display());
    ExitCode::SUCCESS
}
