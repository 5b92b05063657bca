//! Compares pressures under a strip footing with limit analysis, and writes a page about it.
//!
//! `studies/footing/run` makes the runs and starts it.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[path = "../common.rs"]
mod common;
#[path = "../verification/plot.rs"]
mod plot;

use common::{checked, history};
use plot::{Chart, Series};

/// Half the width of the footing, m; its velocity, m/s; strength of the ground, Pa, as the job has them.
const HALF_WIDTH: f64 = 0.5;
const VELOCITY: f64 = 5e-3;
const STRENGTH: f64 = 1e4;
/// Friction angle of the soil.
const FRICTION: f64 = 20.0;

/// Settlement, mm, and mean pressure over strength, row by row.
fn curve(directory: &Path) -> Vec<[f64; 2]> {
    let rows = history(&directory.join("strip_footing.history.csv"), ["time", "force_footing_y"]);
    let scaled = |[time, force]: [f64; 2]| [1e3 * VELOCITY * time, force / (HALF_WIDTH * STRENGTH)];
    rows.into_iter().map(scaled).collect()
}

/// Mean over the last tenth of the rows.
fn limit(curve: &[[f64; 2]]) -> f64 {
    let last = &curve[curve.len() * 9 / 10..];
    last.iter().map(|row| row[1]).sum::<f64>() / last.len() as f64
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [runs, page] = arguments.as_slice() else {
        eprintln!("usage: footing RUNS PAGE.md");
        return ExitCode::from(2);
    };
    let (runs, page) = (PathBuf::from(runs), PathBuf::from(page));
    let plots = page.with_extension("");
    checked(std::fs::create_dir_all(&plots), plots.display());
    let about = Path::new("studies/footing/about.md");
    let mut text = checked(std::fs::read_to_string(about), about.display());
    let pi = std::f64::consts::PI;
    let tan = FRICTION.to_radians().tan();
    let passive = (45.0 + 0.5 * FRICTION).to_radians().tan().powi(2);
    let grounds = [("clay", 2.0 + pi), ("soil", ((pi * tan).exp() * passive - 1.0) / tan)];
    text.push_str("| ground | cells | F-bar | limit over c | exact | error |\n|---|---|---|---|---|---|\n");
    let folder = plots.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut pictures = String::new();
    for (ground, exact) in grounds {
        let mut series = Vec::new();
        for (f_bar, said) in [("true", "with"), ("false", "without")] {
            for cells in [20, 40] {
                let curve = curve(&runs.join(format!("{ground}_{cells}_{f_bar}")));
                let limit = limit(&curve);
                let error = 100.0 * (limit / exact - 1.0);
                let _ = writeln!(
                    text,
                    "| {ground} | B/{cells} | {said} | {limit:.2} | {exact:.2} | {error:+.1} % |"
                );
                let points = curve.into_iter().step_by(4).collect();
                series.push(Series { name: format!("B/{cells}, {said} F-bar"), points, marks: false });
            }
        }
        let ends = [[0.0, exact], [6.0, exact]];
        series.push(Series { name: "limit analysis".into(), points: ends.to_vec(), marks: false });
        let title = if ground == "clay" { "Footing on clay" } else { "Footing on soil with friction" };
        let labels = ["settlement, mm", "mean pressure over c"];
        let chart = Chart { title, labels, logarithmic: [false; 2], series };
        let file = format!("{ground}.svg");
        checked(std::fs::write(plots.join(&file), chart.svg()), &file);
        let _ = writeln!(pictures, "\n![{title}]({folder}/{file})");
    }
    let _ = writeln!(text, "{pictures}");
    let findings = Path::new("studies/footing/findings.md");
    text.push_str(&checked(std::fs::read_to_string(findings), findings.display()));
    checked(std::fs::write(&page, text), page.display());
    println!("{} written", page.display());
    ExitCode::SUCCESS
}
