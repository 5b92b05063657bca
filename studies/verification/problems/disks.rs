//! Problem 5: two elastic disks collide.
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::Runs;

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 5 Colliding disks\n\n\
         Two disks (radius 0.2 m, E = 1 kPa, nu = 0.3, 1000 kg/m3, plane strain) meet head-on along the diagonal with 0.1 m/s along each axis (Sulsky, \
         Chen and Schreyer 1994): [job](../jobs/verification/disks.toml). Exact: no momentum at any time, both are mirror images, the energy does not grow, \
         and they touch at 1.586 s. Through one grid they feel each other earlier, up to two cells apart. Rebound speeds by finite elements are \
         kept apart for an independent comparison. Exercises momentum across cells, contact through the grid, and what each transfer keeps; processor times contain reading and writing of files.\n",
    );
    let mut rows = Vec::new();
    let mut series = Vec::new();
    let cases: &[(&str, &str, u32)] = if runs.is_full() {
        &[
            ("flip", "transfer=\"flip\"", 0),
            ("flip", "transfer=\"flip\"", 1),
            ("apic", "transfer=\"apic\"", 0),
            ("apic", "transfer=\"apic\"", 1),
            ("tpic", "transfer=\"tpic\"", 0),
            ("tpic", "transfer=\"tpic\"", 1),
            ("xpic", "transfer=\"xpic\"", 0),
            ("xpic", "transfer=\"xpic\"", 1),
        ]
    } else {
        &[("flip", "transfer=\"flip\"", 0), ("apic", "transfer=\"apic\"", 0)]
    };
    for (name, transfer, level) in cases {
        let id = format!("{name}.{}", if *level == 0 { "0.05" } else { "0.025" });
        let mut settings = vec![format!("numerics.{transfer}"), format!("tree.base_level={level}")];
        settings.extend((*name == "flip").then(|| "numerics.flip=1".to_owned()));
        let results = runs.run("verification/disks", &format!("disks_{id}"), &settings);
        let history = results.history([
            "time",
            "kinetic_energy",
            "elastic_energy",
            "momentum_x",
            "momentum_y",
            "mass",
            "velocity_first_x",
            "velocity_second_x",
            "velocity_first_y",
        ]);
        let scale = history[0][5] * 0.1 * 2.0_f64.sqrt();
        let momentum = history.iter().map(|row| row[3].hypot(row[4])).fold(0.0, f64::max) / scale;
        page.line(&format!("disks.momentum.{id}"), momentum);
        let mirror = history
            .iter()
            .map(|row| (row[6] + row[7]).abs().max((row[6] - row[8]).abs()))
            .fold(0.0, f64::max);
        page.line(&format!("disks.mirror.{id}"), mirror);
        let energy: Vec<[f64; 2]> =
            history.iter().map(|row| [row[0], (row[1] + row[2]) / history[0][1]]).collect();
        let most = energy.iter().map(|row| row[1]).fold(0.0, f64::max);
        let loss = 1.0 - energy[energy.len() - 1][1];
        page.line(&format!("disks.gain.{id}"), most - 1.0);
        if id == "flip.0.025" {
            page.line("disks.loss", loss);
        }
        let touch = history.iter().find(|row| row[6] < 0.1 * (1.0 - 1e-3)).map_or(f64::NAN, |row| row[0]);
        let rebound = -history[history.len() - 1][6];
        rows.push(vec![
            id.clone(),
            format!("{momentum:.1e}"),
            format!("{mirror:.1e}"),
            format!("{:.2} %", 100.0 * loss),
            format!("{touch:.3}"),
            format!("{rebound:.5}"),
            format!("{:.1}", results.processor),
        ]);
        series.push(Series { name: id, points: energy.into_iter().step_by(5).collect(), marks: false });
    }
    page.table(
        &[
            "transfer, cells",
            "momentum",
            "mirror, m/s",
            "energy lost",
            "first contact, s",
            "rebound speed along x, m/s",
            "processor time, s",
        ],
        &rows,
    );
    page.plot(
        "disks",
        &Chart {
            title: "Energy over that at the start",
            labels: ["time, s", ""],
            logarithmic: [false, false],
            series,
        },
    );
}
