//! Problem 1: axial vibration of a bar, uniform, with a level jump, and with a front of refinement that moves.
use std::f64::consts::PI;

use super::order;
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::Runs;

/// Length of the bar, m; least cells along it.
const LENGTH: f64 = 25.0;
/// Circular frequency, 1/s.
const OMEGA: f64 = 0.2 * PI;

/// What is compared.
struct Found {
    /// Greatest and last relative error of the energy.
    energy: [f64; 2],
    /// Root mean square of the error of the mean velocity over its amplitude.
    velocity: f64,
    /// Relative error of the frequency.
    frequency: f64,
    curve: Vec<[f64; 2]>,
}

/// Settings of so many cells along the bar.
fn of_cells(cells: f64) -> Vec<String> {
    let cell = LENGTH / cells;
    let root = 4.0 * cell;
    let size = root * (LENGTH / root + 1e-9).ceil();
    vec![
        format!("domain.root_edge={root}"),
        format!("domain.size=[{size}, {root}]"),
        format!("bodies[0].shape.max=[{LENGTH}, {root}]"),
    ]
}

fn run(runs: &Runs, name: &str, cells: f64, more: &[String]) -> Found {
    let mut settings = of_cells(cells);
    settings.extend_from_slice(more);
    let results = runs.run("verification/bar", name, &settings);
    let rows = results.history(["time", "kinetic_energy", "elastic_energy", "momentum_x", "mass"]);
    let energy = |row: &[f64; 5]| row[1] + row[2];
    let start = energy(&rows[0]);
    let worst = rows.iter().map(|row| (energy(row) / start - 1.0).abs()).fold(0.0, f64::max);
    let amplitude = 0.1 * 2.0 / PI;
    let exact = runs.reference("bar_exact_v0_0.1.csv", ["t", "v_cm"]);
    let exact = |t: f64| crate::runs::between(&exact, t);
    let square = |row: &[f64; 5]| ((row[3] / row[4] - exact(row[0])) / amplitude).powi(2);
    let velocity = (rows.iter().map(square).sum::<f64>() / rows.len() as f64).sqrt();
    // Phase over a period against that of the exact frequency; from the first to the last period it grows by the error of the frequency alone.
    let phase = |start: f64| {
        let (mut cos, mut sin) = (0.0, 0.0);
        for pair in rows.windows(2).filter(|pair| (start..start + 10.0).contains(&pair[0][0])) {
            let (dt, v) = (pair[1][0] - pair[0][0], pair[0][3] / pair[0][4]);
            cos += dt * v * (OMEGA * pair[0][0]).cos();
            sin += dt * v * (OMEGA * pair[0][0]).sin();
        }
        sin.atan2(cos)
    };
    let frequency = (phase(0.0) - phase(90.0)) / (OMEGA * 90.0);
    let step = (rows.len() / 1000).max(1);
    let curve = rows.iter().step_by(step).map(|row| [row[0], energy(row) / start - 1.0]).collect();
    Found { energy: [worst, (energy(&rows[rows.len() - 1]) / start - 1.0).abs()], velocity, frequency, curve }
}

/// Order of the error in time: the bar from rest under a force that acts at once, with steps of 1, 1/2 and 1/4
/// of the longest against 1/16 of it.
pub(crate) fn in_time(runs: &Runs, page: &mut Page) {
    // Powers of 2, so that all steps end at the same times.
    const LONGEST: f64 = 1.0 / 32.0;
    const END: f64 = 17.5;
    page.text(
        "*In time*: the bar on 50 cells at rest, on which a force 0.05 sin(pi X / 50) m/s2 begins to act at the start, after 1.75 periods with steps of 1/32 s (Courant number \
         0.63) and of 1/2, 1/4 and 1/16 of it. The error is the root mean square of the difference of all places to those of the shortest steps. What the transfers do in each step, \
         whatever its length, is in it: with 16 cells to a wave it hides the order.\n",
    );
    let mut rows = Vec::new();
    for (name, numerics) in
        [("flip", "{ transfer = \"flip\", flip = 1 }"), ("apic", "{ transfer = \"apic\" }")]
    {
        let places = |parts: usize| {
            let mut settings = of_cells(50.0);
            settings.push("loads=[{ name = \"push\", kind = \"body_force\", acceleration = [\"0.05 * sin(pi / 50 * X)\", 0] }]".into());
            settings.extend(["bodies[0].velocity=[0, 0]".into(), format!("numerics={numerics}")]);
            settings.extend(["time.cfl=1".into(), format!("time.dt_max={:?}", LONGEST / parts as f64)]);
            settings.extend([format!("time.end={END}"), format!("output.every={END}")]);
            runs.run("verification/bar", &format!("bar_time_{name}_{parts}"), &settings)
                .particles(1, "position", 2)
        };
        let exact = places(16);
        let error = |parts: usize| {
            let found = places(parts);
            let both = found.iter().flatten().zip(exact.iter().flatten());
            let square = both.map(|(x, exact)| (x - exact).powi(2)).sum::<f64>();
            (parts as f64, (square / (2 * found.len()) as f64).sqrt())
        };
        let errors = [1, 2, 4].map(error);
        let orders = [order(errors[0], errors[1]), order(errors[1], errors[2])];
        page.line(&format!("bar.time.{name}"), orders[0].min(orders[1]));
        let mut row = vec![name.to_owned()];
        row.extend(errors.iter().map(|(_, error)| format!("{error:.2e} m")));
        row.push(orders.map(|order| format!("{order:.2}")).join(", "));
        rows.push(row);
    }
    page.table(&["", "1", "1/2", "1/4", "orders"], &rows);
}

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 1 Axial vibration of a bar\n\n\
         A bar of 25 m (fixed corotated, E = 100 Pa, nu = 0, 1 kg/m3), fixed at one end, swings in its first mode from v = 0.1 sin(pi x / 50) \
         m/s for ten periods (Bardenhagen and Kober 2004): [job](../jobs/verification/bar.toml). Exact: the energy stays, and the mean velocity is \
         (0.2 / pi) cos(0.2 pi t). FLIP, `volume` boxes, 2 particles per cell, Courant number 0.1. *Graded* has cells of half the size on the right \
         half; in *moving* the finer half ends at 12.5 + 5 sin(0.2 pi t / 3) m. Exercises the time integrator, the order of stress update and transfer, and \
         weights as particles cross cells and level jumps. It is limited by the half step between kinetic and elastic energy, of first order in \
         the step.\n",
    );
    let sizes: &[f64] = if runs.is_full() { &[25.0, 50.0, 100.0] } else { &[25.0, 50.0] };
    let mut rows = Vec::new();
    let mut series = Vec::new();
    let mut add = |page: &mut Page, name: &str, found: Found| {
        page.line(&format!("bar.energy.{name}"), found.energy[0]);
        page.line(&format!("bar.drift.{name}"), found.energy[1]);
        page.line(&format!("bar.velocity.{name}"), found.velocity);
        rows.push(vec![
            name.to_owned(),
            format!("{:.2e}", found.energy[0]),
            format!("{:.2e}", found.energy[1]),
            format!("{:.2e}", found.velocity),
            format!("{:.2e}", found.frequency),
        ]);
        series.push(Series { name: name.to_owned(), points: found.curve, marks: false });
    };
    let mut frequencies = Vec::new();
    let mut coarse_drift = 0.0;
    for &cells in sizes {
        let found = run(runs, &format!("bar_{cells}"), cells, &[]);
        frequencies.push((cells, found.frequency.abs()));
        if cells == 50.0 {
            coarse_drift = found.energy[1];
        }
        add(page, &format!("{cells}"), found);
    }
    let fine = "tree.regions=[{ level = 1, shape = { kind = \"box\", min = [13, 0], max = [26, 2] } }]";
    let graded = run(runs, "bar_graded", 50.0, &[fine.into()]);
    let way = |at: usize| {
        let time = at as f64 * 2.5;
        format!("{{ time = {time}, translation = [{}, 0] }}", 5.0 * (OMEGA * time / 3.0).sin())
    };
    let motion: Vec<String> = (0..=40).map(way).collect();
    let front = format!(
        "adaptivity.criteria=[{{ kind = \"region\", level = 1, coarsen = 0, shape = {{ kind = \"box\", min = [12.5, 0], max = [40, 2] }}, motion = [{}] }}]",
        motion.join(", ")
    );
    let moving = run(runs, "bar_moving", 50.0, &[front]);
    for (name, found) in [("graded", graded), ("moving", moving)] {
        page.line(&format!("bar.{name}.ratio"), found.energy[1] / coarse_drift);
        add(page, name, found);
    }
    page.table(
        &["cells", "energy, greatest error", "energy after 10 periods", "mean velocity, rms", "frequency"],
        &rows,
    );
    // Between the finest two of three.
    if let [_, coarse, fine] = frequencies[..] {
        page.line("bar.order", order(coarse, fine));
    }
    page.plot(
        "bar",
        &Chart {
            title: "Relative error of the energy",
            labels: ["time, s", "error"],
            logarithmic: [false, false],
            series,
        },
    );
}
