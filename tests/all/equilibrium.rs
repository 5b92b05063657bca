//! Equilibrium through the whole program: kinetic damping leads a column to its closed form and a slope to
//! rest, the run ends there and says so, with the same bits on any ranks and across restarts.

use crate::common::history::History;
use crate::common::launch::{run, succeed};
use crate::common::restart;

/// A job with a body of 1800 kg/m³ in a box of 4 m by 2 m with slip faces at its sides.
fn text(model: &str, shape: &str, rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [4, 2]\nroot_edge = 1\n\
         [boundaries]\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_min.kind = 'sticky'\ny_max.kind = 'separating'\n\
         [[materials]]\nname = 'soil'\ndensity = 1800\n{model}\n\
         [[bodies]]\nname = 'ground'\nmaterial = 'soil'\nshape = {shape}\n\
         [history]\nevery_steps = 20\n{rest}\n"
    )
}

const SLOPE: &str = "{ kind = 'polygon', points = [[0, 0], [4, 0], [4, 0.5], [2.5, 0.5], [1, 1.25], [0, 1.25]] }\n\
                     stress = { kind = 'geostatic', k0 = 0.5 }";
const SOIL: &str = "model = 'mohr_coulomb'\nyoung = 2e7\npoisson = 0.3\nfriction_angle = 35\ncohesion = 3e3";

/// A column put under its weight at once comes to rest under the stress of the closed form: its elastic
/// energy is (ρ g)² H³ / 6 M per area, with M = λ + 2μ.
#[test]
fn a_column_comes_to_rest_under_its_weight() {
    let job = text(
        "model = 'hencky'\nyoung = 2e7\npoisson = 0.25",
        "{ kind = 'box', min = [0, 0], max = [4, 1.125] }",
        "[time]\nend = 5\n[output]\npicture = false\n[equilibrium]\nspeed = 1e-5\nacceleration = 1e-2",
    );
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("column.toml");
    std::fs::write(&path, job).expect("job");
    let output = run(directory.path(), 1, 1, &path, &[]).output().expect("starts");
    let words =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(output.status.success() && words.contains("equilibrium at t = "), "{words}");
    let history = History::read(directory.path(), "column");
    let stops = history.last("stops");
    println!("{stops} stops, {} s", history.last("time"));
    assert!(stops >= 2.0 && history.last("time") < 3.0, "{stops} stops until {} s", history.last("time"));
    assert!(history.last("peak_speed") <= 1e-5 && history.last("unbalanced_acceleration") <= 1e-2);
    let modulus = 2e7 * 0.75 / (1.25 * 0.5);
    let exact = 4.0 * (1800.0 * 9.81_f64).powi(2) * 1.125_f64.powi(3) / (6.0 * modulus);
    let found = history.last("elastic_energy");
    println!("elastic energy {found} J, exact {exact} J");
    assert!((found / exact - 1.0).abs() < 0.02, "{found} for {exact}");
}

/// However fine the grid and whatever the Courant number, stops take energy out of all motions: a column that
/// is put under its weight has at most the energy that this does, and rests soon.
#[test]
fn stops_feed_no_motion() {
    for cfl in [0.3, 0.4, 0.5] {
        let rest = format!(
            "[time]\nend = 1\ncfl = {cfl}\n[output]\npicture = false\n[equilibrium]\nspeed = 1e-6\nacceleration = 1e-3\n\
             [tree]\nbase_level = 2\n"
        );
        let shape = "{ kind = 'box', min = [0, 0], max = [4, 0.53125] }";
        let job = text("model = 'hencky'\nyoung = 2e7\npoisson = 0.25", shape, &rest);
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("column.toml");
        std::fs::write(&path, job).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let history = History::read(directory.path(), "column");
        let (steps, energy) = (history.last("step"), history.last("elastic_energy"));
        let exact = 4.0 * (1800.0 * 9.81_f64).powi(2) * 0.53125_f64.powi(3) / (6.0 * 2.4e7);
        println!("cfl {cfl}: {steps} steps, {energy} J, exact {exact} J");
        assert!(steps < 1000.0 && (energy / exact - 1.0).abs() < 0.02, "{steps} steps, {energy} for {exact}");
    }
}

/// With mass scaling the column with a patch that is three levels finer has the same equilibrium, in steps
/// that are eight times as long and so in fewer of them.
#[test]
fn mass_scaling_leads_to_the_same_equilibrium_in_fewer_steps() {
    let column = |scaling: &str| {
        let rest = format!(
            "[time]\nend = 50\n[output]\npicture = false\n[equilibrium]\nspeed = 1e-6\nacceleration = 1e-3\n{scaling}\
             [tree]\n[[tree.regions]]\nlevel = 3\nshape = {{ kind = 'box', min = [1.95, 0.4], max = [2.05, 0.5] }}\n\
             [[loads]]\nname = 'push'\nkind = 'body_force'\nacceleration = [0, -1]"
        );
        let job = text(
            "model = 'hencky'\nyoung = 2e7\npoisson = 0.25",
            "{ kind = 'box', min = [0, 0], max = [4, 1.125] }",
            &rest,
        );
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("column.toml");
        std::fs::write(&path, job).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        History::read(directory.path(), "column")
    };
    let (own, scaled) = (column(""), column("mass_scaling = true\n"));
    let steps = [&own, &scaled].map(|history| history.last("step"));
    let energies = [&own, &scaled].map(|history| history.last("elastic_energy"));
    println!("{steps:?} steps, {energies:?} J");
    assert!(scaled.last("unbalanced_acceleration") <= 1e-3 && scaled.last("peak_speed") <= 1e-6);
    assert!((energies[1] / energies[0] - 1.0).abs() < 1e-4, "{energies:?}");
    assert!(steps[1] < 0.8 * steps[0], "{steps:?}");
    assert_eq!(scaled.last("mass"), own.last("mass"));
}

/// A slope under the stress of level ground relaxes to below 1e-6 of the wave speed, 120 m/s, on any ranks
/// and across restarts with the same bits; without the bounds met until the end, the run says that.
#[test]
fn a_slope_relaxes_with_the_same_bits_on_any_ranks_and_across_restart() {
    relaxes("");
    relaxes("mass_scaling = true\n");
}

fn relaxes(scaling: &str) {
    let rest = "[time]\nend = 3\n[checkpoint]\nevery_steps = 20\nkeep = 99\n[equilibrium]\nspeed = 1e-4\nacceleration = 0.01\nSCALING\
                [tree]\n[[tree.regions]]\nlevel = 1\nshape = { kind = 'box', min = [1, 0], max = [2.5, 2] }";
    let job = text(SOIL, SLOPE, &rest.replace("SCALING", scaling));
    restart::assert_same_on_any_ranks(&job, "slope", |directory, _| {
        let history = History::read(directory, "slope");
        let (speed, time) = (history.last("peak_speed"), history.last("time"));
        println!("{speed} m/s after {time} s and {} stops", history.last("stops"));
        assert!(speed <= 1.2e-4 && time < 3.0 && history.last("stops") > 1.0, "{speed} {time}");
    });
}

/// A beam under a pressure that follows it, without ties of its surface, which is stopped every few steps
/// once near equilibrium: steps stay as long as the material allows, the run comes to its end, and says what
/// is left.
#[test]
fn stops_do_not_shorten_the_steps() {
    let job = "version = 1\ndimension = 2\n[domain]\nsize = [6.375, 5.625]\nroot_edge = 0.375\n[boundaries]\nx_min = { kind = 'sticky' }\n\
               [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'fixed_corotated'\nyoung = 5e6\npoisson = 0.3\n\
               [[bodies]]\nname = 'b'\nmaterial = 'm'\nshape = { kind = 'box', min = [0, 4.125], max = [6, 4.875] }\n\
               [[loads]]\nname = 'w'\nkind = 'pressure'\npressure = 4000\nfacing = [0, 1]\nfollow = true\n\
               shape = { kind = 'box', min = [-1, 4.865], max = [7, 4.885] }\n\
               [numerics]\ntied_surfaces = false\n\
               [equilibrium]\nspeed = 1e-4\nacceleration = 5.333e-3\n[time]\nend = 4.5\ncfl = 0.5\n\
               [output]\npicture = false\n[history]\nevery_steps = 100\n";
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("beam.toml");
    std::fs::write(&path, job).expect("job");
    let output = run(directory.path(), 1, 1, &path, &[]).output().expect("starts");
    let words =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    let history = History::read(directory.path(), "beam");
    let lengths = &history.column("dt")[1..];
    let (least, most) =
        lengths.iter().fold((f64::MAX, 0.0_f64), |(least, most), &dt| (least.min(dt), most.max(dt)));
    println!("{} stops, {} s, steps of {least} to {most} s", history.last("stops"), history.last("time"));
    assert!(
        output.status.success() && words.contains("no equilibrium by the end of the run, t = 4.5"),
        "{words}"
    );
    assert!(words.contains("expected at most 100 µm/s"), "{words}");
    assert!(history.last("stops") > 30.0 && least > 0.3 * most, "steps of {least} to {most} s");
}

#[test]
fn a_run_that_is_not_settled_at_its_end_says_so() {
    let rest =
        "[time]\nend = 0.01\n[output]\npicture = false\n[equilibrium]\nspeed = 1e-9\nacceleration = 1e-6";
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("slope.toml");
    std::fs::write(&path, text(SOIL, SLOPE, rest)).expect("job");
    let output = run(directory.path(), 2, 1, &path, &[]).output().expect("starts");
    let words =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(output.status.success() && words.contains("no equilibrium by the end"), "{words}");
}
