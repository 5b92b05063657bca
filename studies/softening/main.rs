//! Compares loads and shear bands of a specimen that softens in cells of different sizes, and writes a page about it.
//!
//! `studies/softening/run` makes the runs and starts it.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

mod band;
#[path = "../common.rs"]
mod common;
#[path = "../verification/plot.rs"]
mod plot;

use band::Band;
use common::{checked, history};
use plot::{Chart, Series};

/// Runs and what they are.
const RUNS: [(&str, &str); 3] = [("coarse", "h"), ("fine", "h/2"), ("refined", "h, h/2 where it shears")];
/// Compressions at which loads are compared, mm.
const COMPRESSIONS: [f64; 5] = [20.0, 30.0, 40.0, 50.0, 58.0];
/// Compression over which loads are averaged, mm.
const WINDOW: f64 = 1.5;

/// Compression of the specimen, mm, after a time, s, as the job has it.
fn compression(time: f64) -> f64 {
    1e3 * if time < 0.2 { 0.125 * time * time } else { 0.005 + 0.05 * (time - 0.2) }
}

/// Compression, mm, and load per metre, kN, row by row.
fn curve(directory: &Path) -> Vec<[f64; 2]> {
    let rows = history(&directory.join("specimen.history.csv"), ["time", "load_press_y"]);
    rows.into_iter().map(|[time, load]| [compression(time), -1e-3 * load]).collect()
}

/// Mean load near a compression.
fn load(curve: &[[f64; 2]], at: f64) -> f64 {
    let near: Vec<f64> = curve.iter().filter(|row| (row[0] - at).abs() < WINDOW).map(|row| row[1]).collect();
    near.iter().sum::<f64>() / near.len() as f64
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [runs, page] = arguments.as_slice() else {
        eprintln!("usage: softening RUNS PAGE.md");
        return ExitCode::from(2);
    };
    let (runs, page) = (PathBuf::from(runs), PathBuf::from(page));
    let plots = page.with_extension("");
    checked(std::fs::create_dir_all(&plots), plots.display());
    let about = Path::new("studies/softening/about.md");
    let mut text = checked(std::fs::read_to_string(about), about.display());
    let heads = COMPRESSIONS.map(|at| format!("at {at} mm")).join(" | ");
    let _ = writeln!(
        text,
        "Loads in kN per metre:\n\n| cells | particles at the end | greatest load | {heads} | band |"
    );
    let _ = writeln!(text, "|---|---|---|{}---|", "---|".repeat(COMPRESSIONS.len()));
    let mut series = Vec::new();
    for (name, cells) in RUNS {
        let directory = runs.join(name);
        let curve = curve(&directory);
        let last = directory.join("specimen_000004.hdf");
        let Band { angle, particles } = checked(Band::read(&last), last.display());
        let most = curve.iter().map(|row| row[1]).fold(0.0, f64::max);
        let loads = COMPRESSIONS.map(|at| format!("{:.1}", load(&curve, at))).join(" | ");
        let _ = writeln!(text, "| {cells} | {particles} | {most:.1} | {loads} | {angle:.1}° |");
        let points = curve.into_iter().step_by(4).collect();
        series.push(Series { name: format!("cells of {cells}"), points, marks: false });
    }
    let title = "Load on a specimen that softens";
    let chart = Chart { title, labels: ["compression, mm", "load, kN/m"], logarithmic: [false; 2], series };
    checked(std::fs::write(plots.join("load.svg"), chart.svg()), "load.svg");
    let folder = plots.file_name().unwrap_or_default().to_string_lossy();
    let _ = writeln!(text, "\n![{title}]({folder}/load.svg)\n");
    let findings = Path::new("studies/softening/findings.md");
    text.push_str(&checked(std::fs::read_to_string(findings), findings.display()));
    checked(std::fs::write(&page, text), page.display());
    println!("{} written", page.display());
    ExitCode::SUCCESS
}
