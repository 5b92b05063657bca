//! Accuracy against cost of bodies of revolution: a cavity, a rod and a cone, with uniform cells and with fine cells where they matter.
use super::cost::{Scene, table};
use crate::page::Page;
use crate::runs::Runs;

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    if !runs.is_full() {
        return;
    }
    page.text(
        "## Accuracy against cost: bodies of revolution\n\n\
         As above, in the plane of radius and height. A half plane has one axis less in which coarse cells save than space has.\n",
    );
    let scenes = [cavity(runs), rod(runs), cone(runs)];
    table(page, &scenes);
    for scene in &scenes {
        scene.curves(page);
    }
}

fn settings(all: &[&str]) -> Vec<String> {
    all.iter().map(|setting| (*setting).to_owned()).collect()
}

/// Radii of the cavity at first and of the clay, m; strength and shear modulus of the clay, Pa.
const CAVITY: [f64; 2] = [1.0, 40.0];
const STRENGTH: f64 = 20e3;
const SHEAR: f64 = 1e6;

/// Pressure (Pa) in a cylindrical cavity that has grown to the radius a (m) in incompressible clay with a free outer wall:
/// `∫ (σ_θ - σ_r) dr/r` with the difference 4 G ln(r/R), at most 2 s, where `r² - R² = a² - a₀²`.
fn pressure(a: f64) -> f64 {
    let grown = a * a - CAVITY[0] * CAVITY[0];
    let outer = (CAVITY[1] * CAVITY[1] + grown).sqrt();
    let (pieces, from, to) = (20_000, a.ln(), outer.ln());
    let piece = (to - from) / f64::from(pieces);
    let difference = |i: i32| {
        let r = ((f64::from(i) + 0.5) * piece + from).exp();
        (4.0 * SHEAR * (r / (r * r - grown).sqrt()).ln()).min(2.0 * STRENGTH)
    };
    (0..pieces).map(|i| difference(i) * piece).sum()
}

/// A cylindrical cavity in clay: its pressure once it has grown by a quarter or more.
fn cavity(runs: &Runs) -> Scene {
    let run = |level: u32, is_refined: bool| {
        let mut settings =
            settings(&["materials[0].poisson=0.499", "materials[0].young=2.998e6", "output.every=6"]);
        settings.extend(match is_refined {
            true => {
                let region = |at: u32| {
                    let radius = 2.0 + f64::from(level - at).exp2();
                    format!(
                        "{{ level = {at}, shape = {{ kind = \"box\", min = [0, 0], max = [{radius}, 2] }} }}"
                    )
                };
                vec![format!("tree.regions=[{}]", (1..=level).map(region).collect::<Vec<_>>().join(", "))]
            }
            false => vec!["tree.regions=[]".into(), format!("tree.base_level={level}")],
        });
        let results = runs.run(
            "cavity_expansion_axisymmetric",
            &format!("cavity_rings_{level}_{is_refined}"),
            &settings,
        );
        let rows = results.history(["time", "centre_wall_x", "load_cavity_x"]);
        let first = rows[0][1];
        let errors = rows.iter().skip(1).filter_map(|row| {
            let a = (row[1] * row[1] - first * first + 1.0).sqrt();
            let found = row[2] / (std::f64::consts::TAU * a * 2.0);
            (a > 1.25).then(|| (found / pressure(a) - 1.0).powi(2))
        });
        let errors: Vec<f64> = errors.collect();
        let error = (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
        (format!("1/{} of the radius", 2_u32 << level), error, results.processor)
    };
    Scene {
        id: "cavity_rings",
        name: "cylindrical cavity in clay, by load steps: its pressure from 1.25 of its first radius on",
        // With 8 cells over the radius and this Poisson's ratio there is no equilibrium beyond t = 2.6 s.
        uniform: (0..=1).map(|level| run(level, false)).collect(),
        refined: vec![run(1, true)],
        bound: "a slice is refined along its height as well, where nothing changes",
    }
}

/// Length of the rod of Taylor's test.
fn rod(runs: &Runs) -> Scene {
    let run = |level: u32, is_refined: bool| {
        let settings = match is_refined {
            true => vec![
                format!("tree.base_level={}", level - 1),
                format!(
                    "adaptivity={{ every_steps = 20, buffer = 0, criteria = [{{ kind = \"plastic_strain\", level = {level}, refine = 0.2 }}] }}"
                ),
            ],
            false => vec![format!("tree.base_level={level}")],
        };
        let results =
            runs.run("taylor_bar_axisymmetric", &format!("rod_rings_{level}_{is_refined}"), &settings);
        let rows = results.history(["time", "centre_top_y"]);
        let length = rows[rows.len() - 1][1] + 32.4e-3 - rows[0][1];
        (format!("R/{}", 2_u32 << level), (length / 21.42e-3 - 1.0).abs(), results.processor)
    };
    Scene {
        id: "rod_rings",
        name: "Taylor rod: its length",
        uniform: (1..=4).map(|level| run(level, false)).collect(),
        refined: (2..=4).map(|level| run(level, true)).collect(),
        bound: "the rod: most of what is left of it has flowed, and the rest is half as fine",
    }
}

/// Resistance of clay to a cone.
fn cone(runs: &Runs) -> Scene {
    let run = |level: u32, is_refined: bool| {
        let settings = match is_refined {
            true => vec![
                format!("adaptivity.criteria[0].level={level}"),
                format!("adaptivity.criteria[1].level={}", level - 1),
            ],
            false => vec![format!("tree.base_level={level}"), "adaptivity.criteria=[]".into()],
        };
        let results =
            runs.run("cone_penetration_axisymmetric", &format!("cone_rings_{level}_{is_refined}"), &settings);
        let rows = results.history(["time", "force_cone_y"]);
        let steady: Vec<f64> = rows.iter().filter(|row| row[0] > 0.16).map(|row| row[1]).collect();
        let area = std::f64::consts::PI * 0.015 * 0.015;
        let factor = steady.iter().sum::<f64>() / steady.len() as f64 / (area * 20e3);
        (format!("R/{}", 3.0 * f64::from(level - 3).exp2()), (factor / 8.35 - 1.0).abs(), results.processor)
    };
    Scene {
        id: "cone_rings",
        name: "cone in clay: its steady resistance",
        uniform: (3..=4).map(|level| run(level, false)).collect(),
        refined: (3..=4).map(|level| run(level, true)).collect(),
        bound: "nothing but the clay far away: what flows is a few radii about the tip",
    }
}
