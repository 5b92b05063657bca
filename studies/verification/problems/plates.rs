//! Problem 18: a block between smooth plates.
use crate::page::Page;
use crate::runs::Runs;

/// Young's modulus, Pa, and Poisson's ratio.
const ELASTIC: [f64; 2] = [1e6, 0.45];
/// Height and width of the block, m.
const EDGE: f64 = 0.1;

/// Force on the plates per metre of thickness (N/m) of a neo-Hookean block in plane strain that has been
/// compressed to this part of its height: free sides, so that the stretch across makes `μ (λ_x² - 1) + λ ln J
/// = 0`.
fn exact(stretch: f64) -> f64 {
    let [young, poisson] = ELASTIC;
    let mu = young / (2.0 * (1.0 + poisson));
    let lame = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let across = |x: f64| mu.mul_add(x * x - 1.0, lame * (x * stretch).ln());
    let (mut low, mut high) = (1.0, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if across(middle) > 0.0 { high = middle } else { low = middle }
    }
    let along = mu.mul_add(stretch * stretch - 1.0, lame * (low * stretch).ln());
    -along / stretch * EDGE
}

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 18 A block between smooth plates\n\n\
         A block of rubber, 16 x 16 cells, ν = 0.45, between two plates without friction, of which one moves down smoothly by 30 % of the height: \
         [job](../jobs/verification/between_plates.toml). Exact: uniform stress, and the force that follows. *Force* is the mean of both plates over exact, from 0.35 to 0.4 s \
         of 0.4 s. Exercises contact on nodes and on particles, with and without F-bar, beside free edges.\n",
    );
    let mut rows = Vec::new();
    let cases: &[(&str, bool)] = match runs.is_full() {
        true => &[("nodes", false), ("nodes", true), ("particles", false), ("particles", true)],
        false => &[("nodes", false)],
    };
    for &(acts_on, f_bar) in cases {
        let settings = [
            format!("colliders[0].acts_on=\"{acts_on}\""),
            format!("colliders[1].acts_on=\"{acts_on}\""),
            format!("numerics.f_bar={f_bar}"),
        ];
        let name = format!("{acts_on}.{}", if f_bar { "f_bar" } else { "plain" });
        let results = runs.run("verification/between_plates", &format!("plates_{name}"), &settings);
        let history = results.history(["time", "force_bottom_y", "force_top_y"]);
        let (mut found, mut wanted) = (0.0, 0.0);
        for [time, bottom, top] in history.iter().copied().filter(|row| row[0] > 0.35) {
            found += 0.5 * (top - bottom);
            wanted += exact(1.0 - 0.15 * (1.0 - (std::f64::consts::PI * time / 0.4).cos()));
        }
        page.line(&format!("plates.force.{name}"), found / wanted);
        rows.push(vec![acts_on.to_owned(), f_bar.to_string(), format!("{:.4}", found / wanted)]);
    }
    page.table(&["plates act on", "f_bar", "force over exact"], &rows);
}
