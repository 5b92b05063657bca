//! Initial stress and velocity through the whole program: ground that starts under its own weight stays at
//! rest, the stress is that of the job, and what cannot be is refused.

use crate::common::history::History;
use crate::common::launch::{agimp, run, succeed};
use crate::common::restart;

/// Sand of 1800 kg/m³; P waves at 120 m/s.
const SAND: &str =
    "model = 'mohr_coulomb'\nyoung = 2e7\npoisson = 0.3\nfriction_angle = 33\ndilation_angle = 5";

/// Clay under 10 kPa as made.
const CLAY: &str = "model = 'cam_clay'\nshear_modulus = 4e6\ncritical_stress_ratio = 1.0\ncompression_index = 0.1\n\
                    swelling_index = 0.02\npressure = 1e4\npreconsolidation_pressure = 2e4";

/// Ground between slip faces, 3 m and half a cell high in a domain of 4 m, at a place away from the origin.
/// Its surface lies between nodes: on them, rounding would let boxes reach into the empty cells above, where
/// they meet nodes without other mass.
fn ground(dimension: usize, model: &str, stress: &str, end: f64, rest: &str) -> String {
    // Cells of level 1 in the plane, of level 0 in space; half of that with finer leaves above.
    let cell = 0.25
        / if rest.contains("level = 2") {
            4.0
        } else if rest.contains("level = 1") {
            2.0
        } else {
            1.0
        };
    let top = 2.0 + 0.5 * cell;
    let (gravity, domain, body, faces) = match dimension {
        2 => (
            "[0, -9.81]",
            "min = [5, -1]\nsize = [2, 4]",
            format!("min = [5, -1], max = [7, {top}]"),
            vec!["x", "y"],
        ),
        _ => (
            "[0, 0, -9.81]",
            "min = [5, 3, -1]\nsize = [1, 1, 4]",
            format!("min = [5, 3, -1], max = [6, 4, {top}]"),
            vec!["x", "y", "z"],
        ),
    };
    let faces: String = faces
        .iter()
        .flat_map(|axis| [format!("{axis}_min.kind = 'slip'\n"), format!("{axis}_max.kind = 'slip'\n")])
        .collect();
    format!(
        "version = 1\ndimension = {dimension}\ngravity = {gravity}\n[domain]\n{domain}\nroot_edge = 1\n\
         [boundaries]\n{faces}\n[[materials]]\nname = 'soil'\ndensity = 1800\n{model}\n\
         [[bodies]]\nname = 'ground'\nmaterial = 'soil'\nshape = {{ kind = 'box', {body} }}\nstress = {stress}\n\
         [time]\nend = {end}\n[output]\npicture = false\n[history]\nevery_steps = 20\n{rest}\n"
    )
}

/// The history of a job, and how many steps it took at least.
fn history(text: &str) -> (History, usize) {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("ground.toml");
    std::fs::write(&path, text).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "ground");
    let steps = 20 * (history.column("time").len() - 2);
    (history, steps)
}

/// Greatest over all rows of the root mean square of the velocities, m/s.
fn fastest(history: &History) -> f64 {
    let kinetic = history.column("kinetic_energy").iter().fold(0.0_f64, |most, &e| most.max(e));
    (2.0 * kinetic / history.last("mass")).sqrt()
}

const LAYERED: &str = "[tree]\nbase_level = 1\n[[tree.regions]]\nlevel = 2\nshape = { kind = 'half_space', point = POINT, normal = NORMAL }\n";

/// Level ground with K0 stays at rest to round-off: for a cone of friction and for clay, on trees that are
/// uniform or finer towards the surface, in the plane and in space. Fault it shows: volumes, boxes or weights
/// that are off by the elastic strain, 3e-4 here.
#[test]
fn level_ground_is_at_rest_to_round_off() {
    let finer_in_the_plane = LAYERED.replace("POINT", "[0, 0.9]").replace("NORMAL", "[0, -1]");
    let finer_in_space = LAYERED.replace("POINT", "[0, 0, 0.9]").replace("NORMAL", "[0, 0, -1]");
    let finer_in_space = finer_in_space.replace("level = 1", "level = 0").replace("level = 2", "level = 1");
    let k0 = "{ kind = 'geostatic', k0 = 0.45 }";
    let clay = "{ kind = 'geostatic', k0 = 0.7, ocr = 1.2 }";
    let cases = [
        ("clay", ground(2, CLAY, clay, 0.1, "[tree]\nbase_level = 1")),
        ("uniform", ground(2, SAND, k0, 0.2, "[tree]\nbase_level = 1")),
        ("finer above", ground(2, SAND, k0, 0.1, &finer_in_the_plane)),
        ("in space", ground(3, SAND, k0, 0.1, "")),
        ("in space, finer above", ground(3, SAND, k0, 0.03, &finer_in_space)),
    ];
    for (name, text) in cases {
        let (history, steps) = history(&text);
        let speed = fastest(&history);
        println!("{name}: {steps} steps, {speed:e} m/s");
        assert!(speed < 1e-10, "{name}: {speed} m/s after {steps} steps");
    }
}

/// A heavy layer of clay on sand: each body finds the weight of the other above it.
#[test]
fn layers_rest_on_each_other() {
    let text = ground(2, SAND, "{ kind = 'geostatic', k0 = 0.5 }", 0.1, "[tree]\nbase_level = 1").replace(
        "[time]",
        &format!(
            "[[materials]]\nname = 'clay'\ndensity = 2100\n{}\n\
             [[bodies]]\nname = 'layer'\nmaterial = 'clay'\nshape = {{ kind = 'box', min = [5, 2.0625], max = [7, 2.5625] }}\n\
             stress = {{ kind = 'geostatic', k0 = 0.8, preconsolidation = 2e4 }}\n[time]",
            CLAY.replace("pressure = 1e4", "pressure = 5e3")
        ),
    );
    let (history, steps) = history(&text);
    let speed = fastest(&history);
    println!("layers: {steps} steps, {speed:e} m/s");
    assert!(speed < 1e-10, "{speed} m/s after {steps} steps");
}

/// Water under its own weight is at rest, and sloped ground keeps the stress of its slope at the start.
#[test]
fn water_is_at_rest() {
    let water = "model = 'fluid'\nbulk_modulus = 2e6";
    let (history, steps) =
        history(&ground(2, water, "{ kind = 'hydrostatic' }", 0.1, "[tree]\nbase_level = 1"));
    let speed = fastest(&history);
    println!("water: {steps} steps, {speed:e} m/s");
    // Pressure is linear in depth, so it is the density that cannot be the same everywhere: it is, as the
    // body stands.
    assert!(speed < 1e-10, "{speed} m/s after {steps} steps");
}

/// The same stress by three ways of writing it gives the same energy, that of the closed form.
#[test]
fn weight_table_and_expression_are_one_stress() {
    let elastic = "model = 'hencky'\nyoung = 2e7\npoisson = 0.25";
    let ways = [
        "{ kind = 'geostatic', k0 = 0.5 }",
        "{ kind = 'geostatic', k0 = 0.5, surface = '2.125 + 0 * x' }",
        "{ kind = 'depth', table = [[0, 0, 0], [10, 176580, 88290]] }",
        "{ kind = 'components', xx = '-8829 * (2.125 - y)', yy = '-17658 * (2.125 - y)', zz = '-8829 * (2.125 - y)' }",
    ];
    // σ² / 2E' over 2 m of width, with the square of the depth at the centres of 25 rows of boxes; strains
    // are 1e-3.
    let square: f64 = (0..25).map(|i| (0.125 * (f64::from(i) + 0.5)).powi(2)).sum::<f64>() * 0.125 * 2.0;
    let per_square = (1.0 + 0.25 + 0.25 - 2.0 * 0.25 * (0.5 + 0.5 + 0.25)) / (2.0 * 2e7);
    let exact = square * 17658.0_f64.powi(2) * per_square;
    for stress in ways {
        let (history, _) = history(&ground(2, elastic, stress, 1e-6, ""));
        let found = history.column("elastic_energy")[0];
        println!("{stress}: {found} J, {exact} J");
        assert!((found / exact - 1.0).abs() < 3e-3, "{stress}: {found} for {exact}");
        let mass = 1800.0 * 6.25;
        assert!((history.last("mass") / mass - 1.0).abs() < 1e-14, "mass");
    }
}

/// Velocities by expressions: momentum, energy and angular momentum are the integrals of the field.
#[test]
fn velocity_may_depend_on_the_place() {
    let elastic = "model = 'hencky'\nyoung = 2e7\npoisson = 0.25";
    let text = ground(2, elastic, "{ kind = 'components' }", 1e-6, "")
        .replace("gravity = [0, -9.81]", "gravity = [0, 0]")
        .replace("stress = { kind = 'components' }", "velocity = ['0.5 * (y - 0.5625)', '0.2 * x']");
    let (history, _) = history(&text);
    let mass = 1800.0 * 6.25;
    assert!(history.column("momentum_x")[0].abs() < 1e-12 * mass);
    assert!((history.column("momentum_y")[0] / (mass * 0.2 * 6.0) - 1.0).abs() < 1e-14);
    // About the lower corner of the domain. Particles carry the gradient with the second moments of their
    // weights on the nodes, which are up to h²/4 wider than their boxes.
    let turning = mass * (0.2 * (4.0 / 12.0) - 0.5 * (3.125_f64.powi(2) / 12.0));
    let exact = turning + 1.0 * mass * 0.2 * 6.0;
    let found = history.column("angular_momentum_z")[0];
    println!("angular momentum {found}, exact {exact}");
    assert!((found - exact).abs() < mass * 0.3 * 0.25_f64.powi(2) / 4.0, "{found} for {exact}");
}

#[test]
fn same_results_on_any_ranks_and_across_restart() {
    let rest = format!(
        "{}[checkpoint]\nevery_steps = 33\nkeep = 9\n",
        LAYERED.replace("POINT", "[5.6, 0]").replace("NORMAL", "[-1, 0]")
    );
    let text = ground(
        2,
        CLAY,
        "{ kind = 'geostatic', k0 = '0.6 + 0.02 * x', surcharge = 5e3, ocr = 1.3 }",
        0.05,
        &rest,
    );
    restart::assert_same_on_any_ranks(&text.replace("picture = false", ""), "ground", |_, _| ());
}

/// The message for a wrong stress names its key, the fault, and what would be right.
#[test]
fn wrong_stresses_are_refused_with_their_key() {
    let k0 = "{ kind = 'geostatic', k0 = 0.5 }";
    let no_gravity = |text: String| text.replace("gravity = [0, -9.81]", "gravity = [0, 0]");
    let cases = [
        (
            ground(2, SAND, "{ kind = 'geostatic', k0 = 0.2 }", 0.1, ""),
            "bodies[0].stress: ",
            "or relax = true",
        ),
        (ground(2, CLAY, k0, 0.1, ""), "bodies[0].stress: ", "yields"),
        (
            ground(2, "model = 'fluid'\nbulk_modulus = 2e6", k0, 0.1, ""),
            "bodies[0].stress: ",
            "no elastic strain",
        ),
        (ground(2, SAND, "{ kind = 'geostatic', k0 = -1 }", 0.1, ""), "bodies[0].stress.k0", "0 or more"),
        (
            ground(2, SAND, "{ kind = 'geostatic', k0 = 't' }", 0.1, ""),
            "bodies[0].stress.k0",
            "changes in time",
        ),
        (ground(2, SAND, "{ kind = 'geostatic' }", 0.1, ""), "bodies[0].stress", "k0"),
        (
            ground(2, SAND, "{ kind = 'geostatc', k0 = 0.5 }", 0.1, ""),
            "bodies[0].stress.kind",
            "did you mean \"geostatic\"",
        ),
        (
            ground(2, SAND, "{ kind = 'geostatic', k0 = 0.5, ocr = 2 }", 0.1, ""),
            "bodies[0].stress.ocr",
            "no preconsolidation",
        ),
        (
            ground(2, CLAY, "{ kind = 'geostatic', k0 = 0.5, ocr = 2, preconsolidation = 1e5 }", 0.1, ""),
            "bodies[0].stress.preconsolidation",
            "found both `preconsolidation` and `ocr`; expected one of them",
        ),
        (no_gravity(ground(2, SAND, k0, 0.1, "")), "bodies[0].stress.kind", "no gravity"),
        (
            ground(2, SAND, "{ kind = 'depth', table = [[1, 0, 0], [0.5, 1, 1]] }", 0.1, ""),
            "bodies[0].stress.table[1][0]",
            "increasing",
        ),
        (ground(2, SAND, "{ kind = 'components', xz = 1 }", 0.1, ""), "bodies[0].stress.xz", "2D job"),
    ];
    for (text, key, words) in cases {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("bad.toml");
        std::fs::write(&path, &text).expect("job");
        for command in ["check", "run"] {
            let output = agimp(directory.path()).arg(command).arg(&path).output().expect("starts");
            let message = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(2), "{command}\n{text}\n{message}");
            assert!(message.contains(key) && message.contains(words), "{command}: {key} {words}\n{message}");
        }
    }
}

/// With `relax` sand under a K0 below Rankine's starts on the yield surface: horizontal stress is the active
/// one, a third of the vertical, and the ground hardly moves.
#[test]
fn stress_beyond_yield_relaxes_to_the_surface() {
    let sand = "model = 'mohr_coulomb'\nyoung = 2e7\npoisson = 0.3\nfriction_angle = 30";
    let stress = "{ kind = 'geostatic', k0 = 0.25, relax = true }";
    let rest = "[[probes]]\nname = 'deep'\nquantities = ['stress']\nshape = { kind = 'box', min = [5.5, -0.5], max = [6.5, 0] }\n";
    let (history, _) = self::history(&ground(2, sand, stress, 0.02, rest));
    let first = |name: &str| history.column(name)[0];
    let ratio = first("stress_deep_xx") / first("stress_deep_yy");
    assert!((ratio - 1.0 / 3.0).abs() < 1e-6, "{ratio}");
    assert!(fastest(&history) < 0.05, "{}", fastest(&history));
}
