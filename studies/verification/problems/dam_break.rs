//! Problem 11: a dam breaks.
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::{Runs, between};

/// Base of the column, m.
const BASE: f64 = 0.05715;

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 11 Dam break\n\n\
         A column of water, 57.15 mm wide and twice as high, collapses over a dry floor (Martin and Moyce 1952): [job](../jobs/verification/dam_break.toml). Front Z = z / a over T = \
         t sqrt(2 g / a), and height at the wall over 2 a. APIC, 20 cells over the base. The measured front starts late, since a gate had to be drawn: errors are given as they are and \
         with the time shifted by what fits best, at most 0.25. Exercises the fluid, the free surface and long distances. It is limited by the front's thickness of a cell.\n",
    );
    let results = runs.run("verification/dam_break", "dam_break", &[]);
    let history = results.history(["time", "greatest_water_x", "greatest_wall_y"]);
    let unit = (2.0 * 9.81 / BASE).sqrt();
    let front: Vec<[f64; 2]> = history.iter().map(|row| [row[0] * unit, row[1] / BASE]).collect();
    let height: Vec<[f64; 2]> =
        history.iter().map(|row| [row[0] * unit / 2.0_f64.sqrt(), row[2] / (2.0 * BASE)]).collect();
    let [measured, heights] = ["Z", "H"].map(|first| measured(runs, first));
    let window: Vec<[f64; 2]> =
        measured.iter().filter(|row| (0.84..=3.33).contains(&row[0])).copied().collect();
    let rms = |shift: f64| {
        let square = |row: &[f64; 2]| (between(&front, row[0] - shift) / row[1] - 1.0).powi(2);
        (window.iter().map(square).sum::<f64>() / window.len() as f64).sqrt()
    };
    let shift =
        (0..=25).map(|i| 0.01 * f64::from(i)).min_by(|a, b| rms(*a).total_cmp(&rms(*b))).unwrap_or(0.0);
    page.line("dam.front", rms(0.0));
    page.line("dam.shifted", rms(shift));
    let worst =
        heights.iter().filter(|row| row[0] <= 2.45).map(|row| (between(&height, row[0]) - row[1]).abs());
    page.line("dam.height", worst.fold(0.0, f64::max));
    let slope = (between(&front, 3.2) - between(&front, 2.2)) / 1.0;
    page.line("dam.slope", slope);
    page.text(&format!("Best shift of T: {shift:.2}.\n"));
    let every = |points: Vec<[f64; 2]>| points.into_iter().step_by(10).collect();
    page.plot(
        "dam_break",
        &Chart {
            title: "Front and height of the dam break",
            labels: ["T of the front, tau of the height", "z / a, eta / 2 a"],
            logarithmic: [false, false],
            series: vec![
                Series { name: "front".into(), points: every(front), marks: false },
                Series { name: "height at the wall".into(), points: every(height), marks: false },
                Series { name: "front, measured".into(), points: measured, marks: true },
                Series { name: "height, measured".into(), points: heights, marks: true },
            ],
        },
    );
}

/// Rows of a quantity whose name begins so, for n squared = 2.
fn measured(runs: &Runs, first: &str) -> Vec<[f64; 2]> {
    let path = runs.top.join("studies/verification/references/dambreak_martin_moyce.csv");
    let mut reader = crate::checked(csv::Reader::from_path(path));
    let rows = reader.records().map(crate::checked);
    let rows = rows.filter(|row| {
        row.get(0).is_some_and(|s| s.starts_with("n2=2")) && row.get(1).is_some_and(|q| q.starts_with(first))
    });
    rows.filter_map(|row| Some([row.get(2)?.parse().ok()?, row.get(3)?.parse().ok()?])).collect()
}
