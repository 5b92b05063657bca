//! Compares collapsed columns with the laws of Lube et al. and Lajeunesse et al., and writes a page about it.
//!
//! `studies/column_collapse/run` makes the runs and starts it.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use agimp::io::hdf5_file::{FileError, Reader};
use post::frame::Frame;

#[path = "../common.rs"]
mod common;
mod laws;
#[path = "../verification/plot.rs"]
mod plot;

use common::checked;
use laws::{CollapseLaw, Published, published};
use plot::{Chart, Series};

const ASPECTS: [f64; 4] = [0.55, 0.9, 1.25, 2.75];
/// Radius or half width of all columns, m.
const RADIUS: f64 = 0.097;
/// Share of the mass within the run-out; the rest are far-flung grains.
const FRONT_SHARE: f64 = 0.98;
/// How far beyond the laws a result may lie, as a share of them.
const ALLOWANCE: f64 = 0.1;
/// Bins of the profile over the radius.
const BINS_PER_RADIUS: f64 = 20.0;

/// A deposit.
struct Deposit {
    particles: usize,
    /// Radius within which 98 % of the mass lies, m.
    front: f64,
    /// Height within a tenth of the radius from the axis, m.
    height: f64,
    /// Greatest height by distance, m.
    profile: Vec<[f64; 2]>,
}

impl Deposit {
    /// From the last checkpoint in a directory.
    fn read(directory: &Path, planar: bool) -> Result<Self, String> {
        let entries = std::fs::read_dir(directory).map_err(|error| error.to_string())?;
        let files = entries.flatten().map(|entry| entry.path());
        let checkpoint = files.filter(|path| path.to_string_lossy().contains(".checkpoint_")).max();
        let checkpoint = checkpoint.ok_or("no checkpoint; run studies/column_collapse/run")?;
        Self::of_file(&checkpoint, planar).map_err(|error| error.to_string())
    }

    fn of_file(path: &Path, planar: bool) -> Result<Self, FileError> {
        let Frame { positions, half_widths, header, .. } = Frame::read(path, &[], true)?;
        let mass = Reader::open_alone(path)?.read_slab::<f64>("state/particles/mass", 0, header.particles)?;
        let mut grains: Vec<[f64; 4]> = positions
            .iter()
            .zip(mass.iter().zip(&half_widths))
            .map(|(x, (&mass, &half))| match planar {
                true => [x[0], x[1], half, mass],
                false => [x[0].hypot(x[1]), x[2], half, mass],
            })
            .collect();
        grains.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let total: f64 = mass.iter().sum();
        let mut inside = 0.0;
        let front = grains.iter().find(|grain| {
            inside += grain[3];
            inside >= FRONT_SHARE * total
        });
        let mut profile: Vec<[f64; 2]> = Vec::new();
        for [distance, height, half, _] in &grains {
            let bin = (distance / RADIUS * BINS_PER_RADIUS) as usize;
            while profile.len() <= bin {
                profile.push([(profile.len() as f64 + 0.5) * RADIUS / BINS_PER_RADIUS, 0.0]);
            }
            profile[bin][1] = profile[bin][1].max(height + half);
        }
        let near = grains.iter().take_while(|grain| grain[0] < 0.1 * RADIUS);
        let height = near.map(|grain| grain[1] + grain[2]).fold(0.0, f64::max);
        Ok(Self { particles: grains.len(), front: front.map_or(0.0, |grain| grain[0]), height, profile })
    }

    /// Slope of the profile between a quarter and nine tenths of the run-out, degrees, by least squares.
    fn slope(&self) -> f64 {
        let within = |x: f64| (0.25 * self.front..0.9 * self.front).contains(&x);
        let points: Vec<&[f64; 2]> = self.profile.iter().filter(|point| within(point[0])).collect();
        let count = points.len() as f64;
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(|point| of(point)).sum::<f64>() / count;
        let (x, y) = (mean(&|p| p[0]), mean(&|p| p[1]));
        let slope = mean(&|p| (p[0] - x) * (p[1] - y)) / mean(&|p| (p[0] - x) * (p[0] - x));
        -slope.atan().to_degrees()
    }
}

/// What the laws say, in mm, or a dash.
fn said(value: Option<f64>) -> String {
    value.map_or("–".into(), |value| format!("{:.1}", value * 1e3))
}

/// The range that laws span, widened; and whether a value lies inside.
fn band(laws: &[Published; 2], of: fn(&Published) -> Option<f64>, value: f64) -> (String, String) {
    let values = || laws.iter().filter_map(of);
    let (low, high) = (values().fold(f64::MAX, f64::min), values().fold(0.0, f64::max));
    let (low, high) = (low * (1.0 - ALLOWANCE), high * (1.0 + ALLOWANCE));
    let verdict = if value < low {
        format!("**{:.1} % below**", 100.0 * (1.0 - value / low))
    } else if value > high {
        format!("**{:.1} % above**", 100.0 * (value / high - 1.0))
    } else {
        "yes".into()
    };
    (format!("{:.1} to {:.1}", low * 1e3, high * 1e3), verdict)
}

/// The profile beside the slopes of the laws, in radii.
fn chart(deposit: &Deposit, laws: &[Published; 2], title: &str) -> String {
    let scaled = |points: &[[f64; 2]]| points.iter().map(|p| p.map(|x| x / RADIUS)).collect();
    let mut series =
        vec![Series { name: "agimp, Mohr-Coulomb".into(), points: scaled(&deposit.profile), marks: false }];
    for law in laws {
        if let (Some(edge), Some(height)) = (law.edge, law.height) {
            let points = scaled(&[[0.0, height], [edge, 0.0]]);
            series.push(Series {
                name: format!("{}, as a straight slope", law.authors),
                points,
                marks: false,
            });
        }
    }
    let labels = ["distance / initial radius", "height / initial radius"];
    Chart { title, labels, logarithmic: [false; 2], series }.svg()
}

/// Tables and plots of one geometry.
fn section(runs: &Path, plots: &Path, law: CollapseLaw) -> String {
    let (kind, title) = match law {
        CollapseLaw::Axisymmetric => ("axisymmetric", "Cylinders"),
        CollapseLaw::Planar => ("planar", "Columns in plane strain"),
    };
    let mut text = format!("## {title}\n\n");
    for (quantity, of) in
        [("run-out", (|law| law.edge) as fn(&Published) -> Option<f64>), ("height", |law| law.height)]
    {
        let _ = writeln!(
            text,
            "| h₀/r₀ | {quantity}, mm | Lube et al. | Lajeunesse et al. | band | inside |\n|---|---|---|---|---|---|"
        );
        for aspect in ASPECTS {
            let deposit = checked(
                Deposit::read(&runs.join(format!("{kind}_{aspect}")), law == CollapseLaw::Planar),
                kind,
            );
            let laws = published(law, aspect, RADIUS);
            let value = if quantity == "height" { deposit.height } else { deposit.front };
            let (range, verdict) = band(&laws, of, value);
            let [lube, lajeunesse] = laws.map(|law| said(of(&law)));
            let _ = writeln!(
                text,
                "| {aspect} | {:.1} | {lube} | {lajeunesse} | {range} | {verdict} |",
                value * 1e3
            );
        }
        text.push('\n');
    }
    let _ = writeln!(
        text,
        "| h₀/r₀ | particles at the end | mean slope | Lube et al. | Lajeunesse et al. |\n|---|---|---|---|---|"
    );
    let mut pictures = String::new();
    for aspect in ASPECTS {
        let deposit =
            checked(Deposit::read(&runs.join(format!("{kind}_{aspect}")), law == CollapseLaw::Planar), kind);
        let laws = published(law, aspect, RADIUS);
        let angle = |law: &Published| Some((law.height? / law.edge?).atan().to_degrees());
        let [lube, lajeunesse] =
            laws.map(|law| angle(&law).map_or("–".into(), |angle| format!("{angle:.1}°")));
        let _ = writeln!(
            text,
            "| {aspect} | {} | {:.1}° | {lube} | {lajeunesse} |",
            deposit.particles,
            deposit.slope()
        );
        let name = format!("{kind}_{aspect}.svg");
        let title = format!("{title}: deposit for h₀/r₀ = {aspect}");
        checked(std::fs::write(plots.join(&name), chart(&deposit, &laws, &title)), &name);
        let folder = plots.file_name().unwrap_or_default().to_string_lossy();
        let _ = writeln!(pictures, "![{title}]({folder}/{name})\n");
    }
    text + "\n" + &pictures
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [runs, page] = arguments.as_slice() else {
        eprintln!("usage: column_collapse RUNS PAGE.md");
        return ExitCode::from(2);
    };
    let (runs, page) = (PathBuf::from(runs), PathBuf::from(page));
    let plots = page.with_extension("");
    checked(std::fs::create_dir_all(&plots), plots.display());
    let about = Path::new("studies/column_collapse/about.md");
    let mut text = checked(std::fs::read_to_string(about), about.display());
    text.push('\n');
    for law in [CollapseLaw::Axisymmetric, CollapseLaw::Planar] {
        text.push_str(&section(&runs, &plots, law));
    }
    checked(std::fs::write(&page, text.trim_end().to_owned() + "\n"), page.display());
    println!("{} written", page.display());
    ExitCode::SUCCESS
}
