//! Claim: load steps know the water in the pores: ground at rest has the effective stress of closed forms, a slope
//! under water the factor of safety of its buoyant weight, with the same bits on any ranks and across restarts.

use crate::common::history::History;
use crate::common::launch::{run, succeed};
use crate::common::load_steps::{CHECKPOINTS, load_steps};
use crate::common::restart;
use crate::factor_of_safety::factors;

/// A stiff column of 5 m between slip faces, with a weight of 16, saturated 20 kN/m³, and K0 = 0.5, on cells of 1/8 m.
fn column(level: f64) -> String {
    let job = format!(
        r#"
dimension = 2
gravity = [0, -9.81]
[domain]
size = [1, 6]
root_edge = 1
[boundaries]
x_min.kind = "slip"
x_max.kind = "slip"
y_min.kind = "slip"
[tree]
base_level = 1
[water]
level = {level}
[[materials]]
name = "soil"
density = 1630.9887869520897
saturated_density = 2038.7359836901122
model = "hencky"
young = 1.795e9
poisson = 0.3333333333333333
[[bodies]]
name = "ground"
material = "soil"
shape = {{ kind = "box", min = [0, 0], max = [1, 5] }}
[[tracks]]
name = "low"
point = [0.4, 0.05]
quantities = ["stress", "pore_pressure"]
[[tracks]]
name = "middle"
point = [0.4, 2.55]
quantities = ["stress", "pore_pressure"]
"#
    );
    load_steps(&job, "step = 1\ntolerance = 1e-8") + "face_forces = true\n"
}

/// Saturated to the surface, under 2 m of water, and with the table 2 m down. Particles have the stress of the
/// middle of their cell.
#[test]
fn ground_under_water_has_the_effective_stress_of_closed_forms() {
    for level in [5.0, 7.0, 3.0] {
        let found = History::of_job("column", &column(level), &[]);
        let table = level.min(5.0);
        let effective = |y: f64| 16e3 * (5.0 - table) + (20e3 - 9810.0) * (table - y);
        let near = |found: f64, exact: f64| {
            assert!((found / exact - 1.0).abs() < 1e-6, "level {level}: {found}, exact {exact}");
        };
        for (name, y) in [("low", 0.0625), ("middle", 2.5625)] {
            let stress = |component: &str| found.last(&format!("stress_{name}_{component}"));
            near(stress("yy"), -effective(y));
            near(stress("xx"), -0.5 * effective(y));
        }
        near(found.last("force_y_min_y"), -effective(0.0));
        near(found.last("water_y_min_y"), -9810.0 * level);
    }
}

/// The slope of `jobs/slope_factor_of_safety.toml` on cells of a metre.
fn factor(density: f64, water: &str) -> f64 {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/slope_factor_of_safety.toml");
    let job = std::fs::read_to_string(path).expect("the job");
    let changed = job
        .replace("base_level = 2 ", "base_level = 1 ")
        .replace("density = 2000", &format!("density = {density}"))
        .replacen("[[materials]]", &format!("{water}\n[[materials]]"), 1);
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("slope.toml");
    std::fs::write(&path, changed).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    factors(directory.path(), "slope")[0].expect("a factor")
}

#[test]
fn a_slope_under_water_is_as_safe_as_with_its_buoyant_weight() {
    let water = |level: f64| format!("[water]\nlevel = {level}\ndensity = 1000");
    let [dry, shallow, deep] =
        [factor(1000.0, ""), factor(2000.0, &water(16.0)), factor(2000.0, &water(30.0))];
    println!("{dry} dry, {shallow} and {deep} under water");
    assert!([shallow, deep].iter().all(|wet| (wet / dry - 1.0).abs() < 0.01), "{dry} {shallow} {deep}");
}

/// The table falls through ground that yields, a part of it undrained, on two levels.
#[test]
fn water_in_load_steps_gives_the_same_on_any_ranks_and_across_restart() {
    let job = r#"
dimension = 2
gravity = [0, -10]
[domain]
size = [2, 1]
root_edge = 0.5
[boundaries]
x_min.kind = "slip"
x_max.kind = "slip"
y_min.kind = "sticky"
[tree]
base_level = 0
regions = [{ level = 1, shape = { kind = "box", min = [0.3, 0.3], max = [1.2, 0.6] } }]
[water]
level = [[0, 0.7], [1, 0.2]]
[[materials]]
name = "sand"
density = 1800
saturated_density = 2000
model = "mohr_coulomb"
young = 1e6
poisson = 0.3
friction_angle = 30
dilation_angle = 30
cohesion = 1000
[[materials]]
name = "clay"
density = 1900
model = "hencky"
young = 1e6
poisson = 0.3
undrained = { bulk_modulus = 1e7, porosity = 0.4 }
[[bodies]]
name = "low"
material = "clay"
shape = { kind = "box", min = [0, 0], max = [2, 0.25] }
[[bodies]]
name = "slope"
material = "sand"
shape = { kind = "polygon", points = [[0, 0.25], [2, 0.25], [1.1, 0.6], [0, 0.6]] }
[numerics]
f_bar = true
"#;
    let job = load_steps(job, "step = 0.25\ntolerance = 1e-4") + CHECKPOINTS;
    restart::assert_same_on_any_ranks(&job, "water", |directory, _| {
        let rest = History::read(directory, "water");
        assert!(rest.column("unbalanced_force").iter().all(|rest| *rest <= 1e-4));
    });
}
