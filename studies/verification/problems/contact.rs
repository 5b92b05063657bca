//! Problem 13: a cylinder between plates, and a disk that rolls.
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::Runs;

/// Radius of the cylinder, m, and its modulus, Pa.
const RADIUS: f64 = 40.0;
const YOUNG: f64 = 1e6;

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    if !runs.is_full() {
        return;
    }
    hertz(runs, page);
    rolling(runs, page);
}

fn hertz(runs: &Runs, page: &mut Page) {
    page.text(
        "## 13 A cylinder between plates, and a disk that rolls\n\n\
         *Cylinder* ([job](../jobs/verification/hertz.toml)): neo-Hookean, 40 cells to the radius, between rigid plates without friction that act on particles; forces at approaches of the plates of 2, 4 and 8 cells against finite elements (0.3 %), which Hertz meets within 1 %; *2:1* has cells of twice the size farther than 16 m from where the plate touches. \
         *Disk* ([job](../jobs/verification/rolling.toml)): rolls down 20 degrees with friction 0.5; the closed form has the acceleration 2/3 g sin 20 degrees; without friction it slips. Exercises contact at the surface.\n",
    );
    let exact = runs.reference("hertz_disk_nu0.3.csv", ["d_over_R_per_plate", "P_over_E_R_NH"]);
    let expected = |approach: f64| {
        let depth: f64 = approach / RADIUS;
        let after = exact.iter().position(|row| row[0] >= depth).unwrap_or(exact.len() - 1).max(1);
        let [low, high] = [exact[after - 1], exact[after]].map(|row| row.map(f64::ln));
        let share = (depth.ln() - low[0]) / (high[0] - low[0]);
        YOUNG * RADIUS * (low[1] + share * (high[1] - low[1])).exp()
    };
    let near_plate = "{ level = 1, shape = { kind = \"circle\", centre = [0, 40], radius = 16 } }";
    let graded =
        ["domain.root_edge=8".into(), "domain.size=[56, 48]".into(), format!("tree.regions=[{near_plate}]")];
    let mut table = Vec::new();
    let mut series = Vec::new();
    for (name, id, settings) in [("ours", "", &[][..]), ("ours, 2:1", "2:1.", &graded[..])] {
        let results = runs.run("verification/hertz", &format!("hertz_{}", settings.len()), settings);
        let rows = results.history(["time", "position_plate_y", "force_plate_y"]);
        let start = rows[0][1];
        for cells in [2.0, 4.0, 8.0] {
            // Of one plate; forces are those on half of the cylinder.
            let near = rows.iter().filter(|row| (start - row[1] - 0.5 * cells).abs() < 0.05);
            let (count, approach, force) = near.fold((0.0, 0.0, 0.0), |(count, approach, force), row| {
                (count + 1.0, approach + start - row[1], force + 2.0 * row[2].abs())
            });
            let (approach, force) = (approach / count, force / count);
            page.line(&format!("hertz.{id}{cells}"), force / expected(approach));
            table.push(vec![
                name.to_owned(),
                format!("{cells}"),
                format!("{:.4e}", expected(approach)),
                format!("{force:.4e}"),
                format!("{:+.2} %", 100.0 * (force / expected(approach) - 1.0)),
            ]);
        }
        let points = rows.iter().step_by(8).map(|row| [start - row[1], 2e-3 * row[2].abs()]).collect();
        series.push(Series { name: name.into(), points, marks: false });
    }
    page.table(&["", "approach of the plates, cells", "finite elements, N/m", "ours, N/m", "error"], &table);
    let elements = exact.iter().filter(|row| row[0] <= 0.1);
    let elements = elements.map(|row| [row[0] * RADIUS, 1e-3 * YOUNG * RADIUS * row[1]]).collect();
    series.push(Series { name: "finite elements".into(), points: elements, marks: true });
    page.plot(
        "hertz",
        &Chart {
            title: "Force between the plates",
            labels: ["approach of a plate, cells", "kN/m"],
            logarithmic: [false, false],
            series,
        },
    );
}

fn rolling(runs: &Runs, page: &mut Page) {
    let references = runs.reference("incline.csv", ["angle_deg", "mu", "distance_at_1s"]);
    let bodies: Vec<String> = runs.texts("incline.csv", "body");
    let mut table = Vec::new();
    for (name, friction, level) in [("slips.8", 0.0, 1), ("rolls.8", 0.5, 1), ("rolls.16", 0.5, 2)] {
        let mut rows = references.iter().zip(&bodies);
        let row = rows
            .find(|(row, body)| *body == "cylinder" && row[0] == 20.0 && (row[1] - friction).abs() < 1e-9);
        let distance = row.map_or(f64::NAN, |(row, _)| row[2]);
        let settings =
            [format!("tree.base_level={level}"), format!("colliders[0].contact.friction={friction}")];
        let results = runs.run("verification/rolling", name, &settings);
        let history = results.history(["time", "centre_disk_x", "centre_disk_y"]);
        let (first, last) = (history[0], history[history.len() - 1]);
        let (sine, cosine) = 20_f64.to_radians().sin_cos();
        let way = (last[1] - first[1]) * cosine - (last[2] - first[2]) * sine;
        let exact = distance * last[0] * last[0];
        page.line(&format!("rolling.{name}"), way / exact);
        table.push(vec![
            name.replace('.', ", cells to the radius: "),
            format!("{exact:.4}"),
            format!("{way:.4}"),
            format!("{:+.2} %", 100.0 * (way / exact - 1.0)),
        ]);
    }
    page.table(&["disk", "exact, m", "ours, m", "error"], &table);
}
