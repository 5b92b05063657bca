//! Claim: strength reduction by load steps finds factors of safety of limit analysis, the same on any ranks
//! and across restarts, and the run ends with it as it should.

use std::path::Path;

use crate::common::history::History;
use crate::common::launch::{run, succeed, text};
use crate::common::restart;

/// Factors of the report of a run: with equilibrium, and without.
pub(crate) fn factors(directory: &Path, name: &str) -> [Option<f64>; 2] {
    let path = directory.join("out").join(name).join(format!("{name}.report.json"));
    let report = std::fs::read_to_string(path).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    ["stands", "slides"].map(|key| report["factor_of_safety"][key].as_f64())
}

/// Log spirals (Chen 1975) with β = 26.565°, φ = 20°, c / (ρ g H) = 0.05: 1.368, on cells of a twentieth of
/// the height.
#[test]
fn a_slope_has_the_factor_of_limit_analysis() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let job = Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/slope_factor_of_safety.toml");
    let output = succeed(&mut run(directory.path(), 1, 2, &job, &[]));
    let found = factors(directory.path(), "slope_factor_of_safety");
    let [Some(stands), Some(slides)] = found else { panic!("{found:?}") };
    println!("{stands} to {slides}: {:+.1} %", 100.0 * (stands / 1.368 - 1.0));
    assert!((-0.03..0.05).contains(&(stands / 1.368 - 1.0)), "{stands}");
    assert!(slides > stands && slides - stands <= 0.0101, "{stands} {slides}");
    assert!(text(&output).contains("factor of safety 1."), "{}", text(&output));
}

/// A vertical cut in clay with N = ρ g H / c = 2 without friction: bounds of 3.78 / N. Cells are a tenth of
/// its height.
const CUT: &str = r#"
version = 1
dimension = 2
gravity = [0, [[0, 0], [1, -10]]]
[domain]
size = [4, 2.4]
root_edge = 0.8
[boundaries]
x_min = { kind = "slip" }
x_max = { kind = "slip" }
y_min = { kind = "sticky" }
[tree]
base_level = 0
regions = [{ level = 1, shape = { kind = "box", min = [1.6, 0.4], max = [3.2, 2.4] } }]
[[materials]]
name = "clay"
density = 2000
model = "von_mises"
young = 5e6
poisson = 0.49
yield_stress = 17320.5
[[bodies]]
name = "ground"
material = "clay"
shape = { kind = "polygon", points = [[0, 0], [4, 0], [4, 1], [2.5, 1], [2.5, 2], [0, 2]] }
[numerics]
f_bar = true
[quasi_static]
step = 0.5
tolerance = 1e-4
[[stages]]
name = "weight"
duration = 1
[[stages]]
name = "safety"
strength_reduction = { to = 3, step = 0.25, tolerance = 0.02 }
[time]
end = 3
[checkpoint]
every_steps = 2
keep = 99
[output]
picture = false
[history]
every_steps = 1
"#;

#[test]
fn a_vertical_cut_has_the_same_factor_on_any_ranks_and_across_restart() {
    restart::assert_same_on_any_ranks(CUT, "cut", |directory, _| {
        let found = factors(directory, "cut");
        let [Some(stands), Some(slides)] = found else { panic!("{found:?}") };
        println!("N = {:.2} to {:.2}", 2.0 * stands, 2.0 * slides);
        assert!((3.6..4.2).contains(&(2.0 * stands)) && slides - stands < 0.0201, "{found:?}");
    });
}

/// N lies between 3.7752 and 3.7776 (Kammoun et al. 2010). Cells are a twentieth of the height.
#[test]
fn a_vertical_cut_has_the_factor_of_limit_analysis() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("cut.toml");
    std::fs::write(&path, CUT).expect("job");
    let cells = "tree.regions=[{ level = 1, shape = { kind = 'box', min = [0.4, 0], max = [4, 2.4] } }, \
                 { level = 2, shape = { kind = 'box', min = [1.6, 0.6], max = [3, 2.4] } }]";
    succeed(&mut run(directory.path(), 1, 2, &path, &["--quiet", "--set", cells]));
    let [Some(stands), Some(slides)] = factors(directory.path(), "cut") else { panic!("no factor") };
    let off = [stands, slides].map(|factor| 2.0 * factor / 3.7764 - 1.0);
    println!(
        "N = {:.3} to {:.3}: {:+.1} to {:+.1} %",
        2.0 * stands,
        2.0 * slides,
        100.0 * off[0],
        100.0 * off[1]
    );
    assert!(off[0] > -0.03 && off[1] < 0.05, "{off:?}");
}

/// A run whose last factor still has equilibrium, and one without any, end as well, and say so.
#[test]
fn a_search_tells_when_its_factors_are_too_low_or_too_high() {
    let runs =
        [("to = 1.2", "factor of safety above 1.2"), ("from = 4, to = 5", "factor of safety below 4.0")];
    for (keys, told) in runs {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("cut.toml");
        let job = CUT.replace("to = 3", keys).replace("regions = [", "regions = [] # ");
        std::fs::write(&path, job).expect("job");
        let output = succeed(&mut run(directory.path(), 1, 1, &path, &[]));
        assert!(text(&output).contains(told), "{}", text(&output));
    }
}

/// Ground with a coefficient of earth pressure at rest is in equilibrium to rounding; then a pit is dug in
/// two stages, and its wall has the factor of Chen's critical height (1975), 1.61, less what flow that is
/// not associated takes.
#[test]
fn a_pit_is_dug_from_ground_at_rest_and_has_its_factor() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let name = "excavation_load_steps";
    let job = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("jobs/{name}.toml"));
    succeed(&mut run(directory.path(), 1, 2, &job, &["--quiet"]));
    let history = History::read(directory.path(), name);
    let at_rest = ["newton_iterations", "unbalanced_force"].map(|column| history.column(column)[1]);
    assert!(at_rest[0] == 0.0 && at_rest[1] < 1e-10, "{at_rest:?}");
    let edge = history.column("centre_edge_y");
    assert!(edge[2] > edge[1] + 1e-3, "the ground rises where it is dug: {edge:?}");
    let found = factors(directory.path(), name);
    println!("{found:?}");
    assert!(found[0].is_some_and(|stands| (1.55..1.8).contains(&stands)), "{found:?}");
}
