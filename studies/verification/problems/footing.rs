//! Problem 14: a strip footing, a thick cylinder, and a cone.
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::{Runs, between};

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 14 Strip footing and thick cylinder\n\n\
         *Footing* ([job](../jobs/strip_footing.toml)): a rough rigid footing on weightless clay of strength c; limit analysis gives (2 + pi) c. Cells of B/20, F-bar; the limit is the mean over the last tenth \
         ([more](footing.md)). *Cylinder* ([job](../jobs/thick_cylinder.toml)): inner radius 1 m, outer 2 m, Tresca, pressures of 7.5 kPa (first yield), 10, 12 and 13 kPa, each to its equilibrium. Exact: Lame, and the \
         closed form with a plastic ring. Sixteen cells over the wall. Exercises yield, contact, pressure on curved surfaces, and equilibrium.\n",
    );
    let results = runs.run("strip_footing", "footing", &["time.end=1.2".into()]);
    let rows = results.history(["time", "force_footing_y"]);
    let curve: Vec<[f64; 2]> =
        rows.iter().map(|row| [5.0 * row[0], row[1] / (HALF_WIDTH * STRENGTH)]).collect();
    let last = &curve[curve.len() * 9 / 10..];
    page.line("footing.clay", last.iter().map(|row| row[1]).sum::<f64>() / last.len() as f64);
    page.plot(
        "footing",
        &Chart {
            title: "Mean pressure below the footing over c",
            labels: ["settlement, mm", ""],
            logarithmic: [false, false],
            series: vec![
                Series {
                    name: "ours, B/20".into(),
                    points: curve.iter().copied().step_by(4).collect(),
                    marks: false,
                },
                Series {
                    name: "limit analysis".into(),
                    points: vec![[0.0, 5.14159], [curve[curve.len() - 1][0], 5.14159]],
                    marks: false,
                },
            ],
        },
    );
    let results = runs.run("thick_cylinder", "cylinder", &[]);
    let rows = results.history(["stage", "work_elastic"]);
    let exact = runs.reference("cylinder_tresca_b2a_nu0.3.csv", ["u_inner", "pressure"]);
    let mut points = Vec::new();
    let mut worst: f64 = 0.0;
    for (stage, pressure) in (1..).zip([7.5e3, 10e3, 12e3, 13e3]) {
        let Some(row) = rows.iter().rfind(|row| row[0] == f64::from(stage)) else { continue };
        let moved = row[1] / (7.5e3 * std::f64::consts::FRAC_PI_2);
        if stage == 1 {
            page.line("cylinder.elastic", moved);
        } else {
            worst = worst.max((between(&exact, moved) - pressure).abs() / 13_862.94);
        }
        points.push([1e3 * moved, 1e-3 * pressure]);
    }
    page.line("cylinder.curve", worst);
    page.plot(
        "cylinder",
        &Chart {
            title: "Pressure over the displacement of the inner wall",
            labels: ["mm", "kPa"],
            logarithmic: [false, false],
            series: vec![
                Series {
                    name: "closed form".into(),
                    points: exact.iter().map(|[u, p]| [1e3 * u, 1e-3 * p]).filter(|p| p[0] < 8.0).collect(),
                    marks: false,
                },
                Series { name: "ours".into(), points, marks: true },
            ],
        },
    );
    if runs.is_full() {
        cone(runs, page);
    }
}

fn cone(runs: &Runs, page: &mut Page) {
    page.text(
        "*Cone* ([job](../jobs/cone_penetration.toml)): a smooth cone of 30 mm and 60 degrees goes into clay (von Mises, G = 50 s), a quarter in space, cells of 5 mm at the cone, F-bar. Resistance over s, the mean from 64 to 112 mm of depth; cavity expansion with steady flow round the tip \
         has 8.35 for this stiffness (Teh and Houlsby 1991).\n",
    );
    let results = runs.run("cone_penetration", "cone", &[]);
    let rows = results.history(["time", "force_cone_z"]);
    let area = std::f64::consts::PI * 0.015 * 0.015;
    let curve: Vec<[f64; 2]> =
        rows.iter().map(|row| [800.0 * row[0], 4.0 * row[1].abs() / area / 20e3]).collect();
    let steady = curve.iter().filter(|row| (64.0..112.0).contains(&row[0]));
    let (count, sum) = steady.fold((0.0, 0.0), |(count, sum), row| (count + 1.0, sum + row[1]));
    page.line("cone", sum / count);
    let limit = vec![[0.0, 8.35], [curve[curve.len() - 1][0], 8.35]];
    page.plot(
        "cone",
        &Chart {
            title: "Resistance of the cone over s",
            labels: ["depth, mm", ""],
            logarithmic: [false, false],
            series: vec![
                Series { name: "ours".into(), points: curve, marks: false },
                Series { name: "Teh and Houlsby".into(), points: limit, marks: false },
            ],
        },
    );
}

/// Half of the footing's width, m, and the strength of the clay, Pa.
const HALF_WIDTH: f64 = 0.5;
const STRENGTH: f64 = 1e4;
