//! Problem 2: manufactured solutions.
use std::f64::consts::PI;

use super::order;
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::Runs;

const AMPLITUDE: f64 = 0.05;

/// Greatest error of a particle's place over the amplitude, over all outputs: exact is X + A sin(pi X) sin(100 pi t + phase).
fn error(runs: &Runs, name: &str, settings: &[String]) -> f64 {
    let results = runs.run("verification/axis_aligned_2d", name, settings);
    let start = results.particles(0, "position", 2);
    let mut worst: f64 = 0.0;
    for number in 1..results.outputs() {
        let time = results.time(number);
        for (x, from) in results.particles(number, "position", 2).iter().zip(&start) {
            for (axis, sign) in [(0, 1.0), (1, -1.0)] {
                let exact =
                    from[axis] + sign * AMPLITUDE * (PI * from[axis]).sin() * (100.0 * PI * time).sin();
                worst = worst.max((x[axis] - exact).abs() / AMPLITUDE);
            }
        }
    }
    worst
}

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 2 Manufactured solutions\n\n\
         *Axis-aligned* ([job](../jobs/verification/axis_aligned_2d.toml)): a body force is found from the momentum balance so that u = A sin(pi X) sin(w t + phi) along \
         each axis is exact in the unit square, with A = 0.05, w = pi c, phi = 0 and pi, over one period (Wallstedt and Guilkey 2008; neo-Hookean, E = \
         10 MPa, nu = 0.3, 1000 kg/m3). The force belongs to the place X where the material was; in the job X follows from x by ten rounds of X = x - u(X). \
         The error is the greatest of any particle at 16 times, over A; Courant number 0.1, for the error in time is of first order: with FLIP on 32 cells 1.29e-2 at 0.3, 1.10e-2 at 0.1 and at 0.03. Exercises large deformation, forces, and particles that cross cells. *2:1* has cells \
         of half the size in a disk of radius 0.3, counted by the coarse cells. FLIP with the disk rings on finer cells: with 64, and the Courant number 0.3, the error was 0.28. *Fixed boxes*, which do not follow the stretch, are the control that must not \
         converge.\n",
    );
    let levels: &[u32] = if runs.is_full() { &[1, 2, 3, 4] } else { &[1, 2, 3] };
    let disk = |level: u32| {
        format!(
            "tree.regions=[{{ level = {}, shape = {{ kind = \"circle\", centre = [0.5, 0.5], radius = 0.3 }} }}]",
            level + 1
        )
    };
    let mut rows = Vec::new();
    let mut series = Vec::new();
    let cases: [(&str, &[&str], bool); 5] = [
        ("flip", &["numerics.transfer=\"flip\"", "numerics.flip=1"], false),
        ("apic", &["numerics.transfer=\"apic\""], false),
        ("flip_2_1", &["numerics.transfer=\"flip\"", "numerics.flip=1"], true),
        ("apic_2_1", &["numerics.transfer=\"apic\""], true),
        ("fixed", &["numerics.transfer=\"flip\"", "numerics.flip=1", "numerics.boxes=\"fixed\""], false),
    ];
    for (name, numerics, is_graded) in cases {
        let mut points = Vec::new();
        // With the disk, 32 cells have 64 in it.
        for &level in levels.iter().take(if is_graded { 3 } else { 4 }) {
            let mut settings: Vec<String> = numerics.iter().map(|setting| (*setting).to_owned()).collect();
            settings.push(format!("tree.base_level={level}"));
            settings.extend(is_graded.then(|| disk(level)));
            let cells = f64::from(4_u32 << level);
            points.push((cells, error(runs, &format!("mms_{name}_{cells}"), &settings)));
        }
        let mut row = vec![name.replace("_2_1", ", 2:1")];
        row.extend(points.iter().map(|(_, error)| format!("{error:.2e}")));
        row.resize(1 + levels.len(), String::new());
        let last = order(points[points.len() - 2], points[points.len() - 1]);
        row.push(format!("{last:.2}"));
        rows.push(row);
        // Fixed boxes stall from 32 cells on.
        if name != "fixed" || runs.is_full() {
            page.line(&format!("mms.order.{name}"), last);
        }
        if let Some((_, at_64)) =
            points.iter().find(|(cells, _)| *cells == 64.0).filter(|_| name == "flip" || name == "apic")
        {
            page.line(&format!("mms.error.{name}"), *at_64);
        }
        series.push(Series {
            name: name.replace("_2_1", ", 2:1"),
            points: points.into_iter().map(|(n, e)| [n, e]).collect(),
            marks: false,
        });
    }
    let mut heads = vec!["".to_owned()];
    heads.extend(levels.iter().map(|level| format!("{} cells", 4 << level)));
    heads.push("last order".into());
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    page.table(&heads, &rows);
    page.plot(
        "manufactured",
        &Chart {
            title: "Greatest error over A",
            labels: ["cells", "error"],
            logarithmic: [true, true],
            series,
        },
    );
}
