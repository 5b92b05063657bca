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
}
