//! Problem 4: cantilevers, static and dynamic.
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::Runs;

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 4 Cantilevers\n\n\
         *Static* ([job](../jobs/cantilever.toml)): 10 x 1 m, Hencky, E = 12 MPa, nu = 0.2, a dead force of 100 kN at the tip (Molstad 1977; Coombs and Augarde 2020), cells of \
         0.25 m; the tip's displacement is the work of the force over the force. *Dynamic* ([job](../jobs/verification/cantilever_dynamic.toml)): 4 x 1 m, neo-Hookean, E = 1 MPa, nu = 0.3, 1050 kg/m3, \
         clamped, g = 2 m/s2 at once. References are finite elements (Q9 static, mesh spread 0.1 %; Q4 dynamic). Exercises bending and large rotations; boxes stay parallel to the \
         axes, which limits it.\n",
    );
    let mut rows = Vec::new();
    if runs.is_full() {
        let results = runs.run("cantilever", "cantilever", &[]);
        let history = results.history(["time", "work_tip"]);
        let tip = history[history.len() - 1][1] / -100e3;
        page.line("cantilever.static", tip);
        rows.push(vec!["static, tip, m".to_owned(), "-8.2814".into(), format!("{tip:.4}")]);
    }
    let sizes: &[u32] = if runs.is_full() { &[0, 1, 2] } else { &[0] };
    let mut series = Vec::new();
    for &level in sizes {
        let cell = 0.25 / f64::from(1_u32 << level);
        let settings =
            [format!("tree.base_level={level}"), format!("tracks[0].point=[4, {}]", 2.0 + 0.01 * cell)];
        let results = runs.run("verification/cantilever_dynamic", &format!("cantilever_{cell}"), &settings);
        let track = results.history(["time", "centre_tip_y"]);
        let start = track[0][1];
        let curve: Vec<[f64; 2]> = track.iter().map(|[t, y]| [*t, y - start]).collect();
        let lowest =
            curve.iter().copied().fold([0.0, 0.0], |low, row| if row[1] < low[1] { row } else { low });
        page.line(&format!("cantilever.peak.{cell}"), lowest[1]);
        page.line(&format!("cantilever.time.{cell}"), lowest[0]);
        rows.push(vec![
            format!("dynamic, cells of {cell} m, m and s"),
            "-1.4863, 1.564".into(),
            format!("{:.4}, {:.3}", lowest[1], lowest[0]),
        ]);
        series.push(Series {
            name: format!("cells of {cell} m"),
            points: curve.into_iter().step_by(5).collect(),
            marks: false,
        });
    }
    series.push(Series { name: "finite elements".into(), points: vec![[1.564, -1.4863]], marks: true });
    page.table(&["", "finite elements", "ours"], &rows);
    page.plot(
        "cantilever",
        &Chart {
            title: "Displacement of the middle of the tip",
            labels: ["time, s", "m"],
            logarithmic: [false, false],
            series,
        },
    );
}
