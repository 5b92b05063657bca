//! Problem 4: cantilevers, static and dynamic.
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::Runs;

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 4 Cantilevers\n\n\
         *Static* ([job](../jobs/cantilever.toml)): 10 x 1 m, Hencky, E = 12 MPa, nu = 0.2, a dead force of 100 kN at the tip (Molstad 1977; Coombs and Augarde 2020), cells of \
         0.25 m; the tip's displacement is the work of the force over the force. *Dynamic* ([job](../jobs/verification/cantilever_dynamic.toml)): 4 x 1 m, neo-Hookean, E = 1 MPa, nu = 0.3, 1050 kg/m3, \
         clamped, g = 2 m/s2 at once, in a domain whose lower face is far below. References are finite elements (Q9 static, mesh spread 0.1 %; Q4 dynamic). *2:1* has cells of half the size within 1.5 m of the clamp. Exercises bending and large rotations; boxes stay parallel to the \
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
    let near_clamp = "{ level = 2, shape = { kind = \"box\", min = [0, 0], max = [1.5, 4] } }";
    // Name, level of the coarsest cells, finer parts of the tree.
    let uniform = [("0.25 m", 0, ""), ("0.125 m", 1, ""), ("0.0625 m", 2, "")];
    let all = uniform.into_iter().chain([("0.125 m, 2:1", 1, near_clamp)]);
    let mut series = Vec::new();
    for (cells, level, regions) in all.take(if runs.is_full() { 4 } else { 1 }) {
        let settings = [format!("tree.base_level={level}"), format!("tree.regions=[{regions}]")];
        // Centres of particles, two to a cell along each axis.
        let half = 0.0625 / f64::from(1_u32 << level);
        let places =
            [[1.0, -1.0], [1.0, 1.0], [3.0, -1.0], [3.0, 1.0]].map(|[x, y]| [4.0 - x * half, 2.0 + y * half]);
        let points =
            places.iter().enumerate().map(|(track, point)| format!("tracks[{track}].point={point:?}"));
        let settings: Vec<String> = settings.into_iter().chain(points).collect();
        let run = format!("cantilever_{level}_{}", regions.len());
        let results = runs.run("verification/cantilever_dynamic", &run, &settings);
        let track =
            results.history(["time", "centre_tip_1_y", "centre_tip_2_y", "centre_tip_3_y", "centre_tip_4_y"]);
        // The end of the axis, from the last two columns of particles.
        let tip = |[_, a, b, c, d]: &[f64; 5]| 0.75 * (a + b) - 0.25 * (c + d);
        let start = tip(&track[0]);
        let curve: Vec<[f64; 2]> = track.iter().map(|row| [row[0], tip(row) - start]).collect();
        let lowest =
            curve.iter().copied().fold([0.0, 0.0], |low, row| if row[1] < low[1] { row } else { low });
        page.line(&format!("cantilever.peak.{cells}"), lowest[1]);
        page.line(&format!("cantilever.time.{cells}"), lowest[0]);
        rows.push(vec![
            format!("dynamic, cells of {cells}: m and s"),
            "-1.4863, 1.564".into(),
            format!("{:.4}, {:.3}", lowest[1], lowest[0]),
        ]);
        series.push(Series {
            name: format!("cells of {cells}"),
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
