//! Problem 13: a block on an incline.
use crate::page::Page;
use crate::runs::Runs;

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 13 A block on an incline\n\n\
         An elastic block of 0.5 m slides on a plane at 20 degrees for 0.5 s, or sticks: [job](../jobs/verification/incline.toml). Exact: the acceleration (sin b - mu cos b) g, growing over 0.1 s with gravity so that the block does not bounce, and rest where \
         mu is greater than tan b. The plane is a face of the domain under gravity that is turned, or a half space that acts on particles under vertical gravity. Sixteen cells along \
         a side. Exercises friction and contact at the surface.\n",
    );
    let references = runs.reference("incline.csv", ["angle_deg", "mu", "distance_at_1s"]);
    let mut rows = Vec::new();
    let cases: &[f64] = if runs.is_full() { &[0.0, 0.1, 0.3, 0.5] } else { &[0.1, 0.5] };
    for mu in cases {
        // The first of each pair is that of a block.
        let row = references.iter().find(|row| row[0] == 20.0 && (row[1] - mu).abs() < 1e-9);
        let acceleration = 2.0 * row.map_or(f64::NAN, |row| row[2]);
        for (name, job) in [("face", "verification/incline"), ("plane", "verification/incline_plane")] {
            let key =
                if name == "face" { "boundaries.y_min.friction" } else { "colliders[0].contact.friction" };
            let results = runs.run(job, &format!("incline_{name}_{mu}"), &[format!("{key}={mu}")]);
            let history = results.history(["time", "centre_block_x", "centre_block_y"]);
            let (first, last) = (history[0], history[history.len() - 1]);
            // Gravity grows over 0.1 s.
            let (ramp, rest) = (0.1, last[0] - 0.1);
            let factor = ramp * ramp / 6.0 + ramp / 2.0 * rest + rest * rest / 2.0;
            let exact = acceleration * factor;
            let way = [last[1] - first[1], last[2] - first[2]];
            let angle = 20_f64.to_radians();
            let found = if name == "face" { way[0] } else { way[0] * angle.cos() - way[1] * angle.sin() };
            let free = 9.81 * angle.sin() * factor;
            page.line(&format!("incline.{name}.{mu}"), (found - exact).abs() / free);
            rows.push(vec![name.to_owned(), format!("{mu}"), format!("{exact:.5}"), format!("{found:.5}")]);
        }
    }
    page.table(&["plane", "friction", "exact, m", "ours, m"], &rows);
}
