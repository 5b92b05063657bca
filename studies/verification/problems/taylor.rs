//! Problem 7: metal rods strike a wall, and a punch in metal.
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::Runs;

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    if !runs.is_full() {
        return;
    }
    page.text(
        "## 7 Taylor rods\n\n\
         *Linear hardening* ([job](../jobs/taylor_bar.toml)): a copper rod of 32.4 by 6.4 mm strikes a wall at 227 m/s, a quarter in space (Wilkins and Guinan 1973; E = 117 GPa, nu = 0.35, 400 MPa, H = \
         100 MPa). Finite elements agree on 21.42 mm and a face radius of 7.2 mm. Cells of R/32 at the face, coarser behind, refined as it goes. Exercises large plastic flow, refinement, splitting \
         and merging. It is limited by locking at constant volume.\n",
    );
    let probe = "probes=[{ name = \"rod\", quantities = [\"extent\"] }]".to_owned();
    let results = runs.run("taylor_bar", "taylor_bar", &[probe]);
    let rows = results.history(["time", "greatest_rod_z", "greatest_rod_x"]);
    // Centres of particles end half a distance inside the surface, as at the start.
    let [first, last] = [rows[0], rows[rows.len() - 1]];
    let length = last[1] + (32.4e-3 - first[1]);
    let radius = last[2] + (3.2e-3 - first[2]);
    page.line("taylor.length", 1e3 * length);
    page.line("taylor.radius", 1e3 * radius);
    let curve = |column: usize, beyond: f64| -> Vec<[f64; 2]> {
        rows.iter().step_by(5).map(|row| [1e6 * row[0], 1e3 * (row[column] + beyond)]).collect()
    };
    page.plot(
        "taylor",
        &Chart {
            title: "Length and face radius of the rod",
            labels: ["time, µs", "mm"],
            logarithmic: [false, false],
            series: vec![
                Series { name: "length".into(), points: curve(1, 32.4e-3 - first[1]), marks: false },
                Series { name: "radius".into(), points: curve(2, 3.2e-3 - first[2]), marks: false },
                Series {
                    name: "finite elements".into(),
                    points: vec![[80.0, 21.42], [80.0, 7.2]],
                    marks: true,
                },
            ],
        },
    );
    johnson_cook(runs, page);
}

/// Undeformed length and radius of the rod of oxygen-free copper, and what was measured at the end: length, face and the diameter at a fifth of the
/// first length, m (Johnson and Holmquist 1988).
const ROD: [f64; 2] = [25.4e-3, 3.81e-3];
const MEASURED: [f64; 3] = [16.2e-3, 13.5e-3, 10.1e-3];

fn johnson_cook(runs: &Runs, page: &mut Page) {
    page.text(
        "*Johnson-Cook* ([job](../jobs/taylor_bar_johnson_cook.toml)): oxygen-free copper, 25.4 by 7.62 mm at 190 m/s, against the experiment of Johnson and Holmquist (1988), with the constants of Johnson and Cook (1983), and \
         with constants without rate and heat (65 MPa + 356 MPa kappa^0.37, E = 115 GPa), for which an independent axisymmetric code has 16.204, 14.73 and 9.85 mm.\n",
    );
    let cold: [&str; 5] = [
        "materials[0].yield_stress=65e6",
        "materials[0].hardening.modulus=356e6",
        "materials[0].hardening.exponent=0.37",
        "materials[0].hardening.rate_factor=0",
        "materials[0].hardening.heat_fraction=0",
    ];
    let mut table = Vec::new();
    for (name, settings) in [("full", &cold[..0]), ("cold", &cold[..])] {
        let mut settings: Vec<String> = settings.iter().map(|setting| (*setting).to_owned()).collect();
        settings.push("probes=[{ name = \"rod\", quantities = [\"extent\"] }]".into());
        let results = runs.run("taylor_bar_johnson_cook", &format!("johnson_cook_{name}"), &settings);
        let rows = results.history(["time", "greatest_rod_z", "greatest_rod_x"]);
        let [first, last] = [rows[0], rows[rows.len() - 1]];
        let places = results.particles(results.outputs() - 1, "position", 3);
        let halves = results.particles(results.outputs() - 1, "half_width", 1);
        let bulge = places.iter().zip(&halves).filter(|(x, _)| (x[2] - 0.2 * ROD[0]).abs() < 0.2e-3);
        let bulge = bulge.map(|(x, half)| x[0].hypot(x[1]) + half[0]).fold(0.0, f64::max);
        // Centres of particles end half a distance inside the surface, as at the start.
        let ours = [last[1] + ROD[0] - first[1], 2.0 * (last[2] + ROD[1] - first[2]), 2.0 * bulge];
        let errors: Vec<f64> =
            ours.iter().zip(MEASURED).map(|(ours, measured)| ours / measured - 1.0).collect();
        page.line(&format!("johnson_cook.{name}.length"), 1e3 * ours[0]);
        page.line(
            &format!("johnson_cook.{name}.mean"),
            errors.iter().map(|error| error.abs()).sum::<f64>() / 3.0,
        );
        let mut row = vec![if name == "full" {
            "Johnson and Cook (1983)".into()
        } else {
            "no rate, no heat".to_owned()
        }];
        row.extend(
            ours.iter()
                .zip(&errors)
                .map(|(ours, error)| format!("{:.2} ({:+.1} %)", 1e3 * ours, 100.0 * error)),
        );
        table.push(row);
    }
    table.push(vec!["measured".into(), "16.2".into(), "13.5".into(), "10.1".into()]);
    page.table(&["constants", "length, mm", "face, mm", "diameter at a fifth, mm"], &table);
}
