//! Stages of a run through the whole program: "settle, then excavate, then fill and load" is one job, with
//! the same results on any ranks and across restarts, also from the step in which a stage ended.

use crate::common::history::History;
use crate::common::launch::{Outcome, contents, run, succeed, text};
use crate::common::restart;

/// Ground of two bodies, of which one is dug out; a fill and a plate come in the last stage.
const PIT: &str = "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [4, 2]\nroot_edge = 1\n\
    [boundaries]\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_min.kind = 'sticky'\ny_max.kind = 'separating'\n\
    [[materials]]\nname = 'soil'\ndensity = 1800\nmodel = 'mohr_coulomb'\nyoung = 2e7\npoisson = 0.3\nfriction_angle = 30\ncohesion = 2e4\n\
    [[materials]]\nname = 'soft'\ndensity = 1800\nmodel = 'mohr_coulomb'\nyoung = 2e7\npoisson = 0.3\nfriction_angle = 30\ncohesion = 1e4\n\
    [[materials]]\nname = 'rock'\ndensity = 2000\nmodel = 'neo_hookean'\nyoung = 2e7\npoisson = 0.2\n\
    [[bodies]]\nname = 'ground'\nmaterial = 'soil'\nshape = { kind = 'box', min = [0, 0], max = [3, 1.125] }\n\
    stress = { kind = 'geostatic', k0 = 0.5 }\n\
    [[bodies]]\nname = 'pit'\nmaterial = 'soil'\nshape = { kind = 'box', min = [3, 0], max = [4, 1.125] }\n\
    stress = { kind = 'geostatic', k0 = 0.5 }\n\
    [[bodies]]\nname = 'fill'\nmaterial = 'rock'\nshape = { kind = 'box', min = [3.25, 0], max = [4, 0.5] }\nstage = 'load'\n\
    velocity = [0, -0.1]\nangular_velocity = 0.1\n\
    [[colliders]]\nname = 'plate'\nshape = { kind = 'box', min = [0, 1.125], max = [1, 1.5] }\nstages = ['load']\n\
    motion = { kind = 'steady', velocity = [0, -1] }\n\
    [[loads]]\nname = 'drag'\nkind = 'damping'\nrate = 20\nstages = ['dig']\nuntil = 0.01\n\
    [history]\nevery_steps = 5\n";
const STAGES: &str = "[[stages]]\nname = 'settle'\nduration = 0.5\nequilibrium = { speed = 1e-3, acceleration = 0.1 }\n\
    [[stages]]\nname = 'dig'\nduration = 0.02\nremove = ['pit']\nat_rest = true\n\
    materials = [{ body = 'ground', material = 'soft' }]\nboundaries = { x_max = { kind = 'separating' } }\n\
    [[stages]]\nname = 'load'\ngravity = [0, '-9.81 * (1 + t)']\n";

/// The mass of the history is that of the bodies that are there, the plate presses in its stage alone, and
/// all is the same on 1 to 3 ranks and across a restart, with dynamic refinement.
#[test]
fn settle_dig_fill_and_load_is_one_job() {
    let rest = "[time]\nend = 0.08\n[checkpoint]\nevery_steps = 15\nkeep = 99\n\
                [adaptivity]\nevery_steps = 4\ncriteria = [{ kind = 'speed', level = 1, refine = 0.05, coarsen = 0.02 }]\n";
    let rest = rest.replace(
        "{ kind = 'speed', level = 1, refine = 0.05, coarsen = 0.02 }",
        "{ kind = 'collider', collider = 'plate', level = 1, distance = 0.2 }",
    );
    restart::assert_same_on_any_ranks(&format!("{PIT}{rest}{STAGES}"), "pit", |directory, words| {
        let history = History::read(directory, "pit");
        let (stages, masses) = (history.column("stage"), history.column("mass"));
        assert!(
            stages.is_sorted() && stages.first() == Some(&1.0) && stages.last() == Some(&3.0),
            "{stages:?}"
        );
        for ((stage, mass), plate) in stages.iter().zip(masses).zip(history.column("force_plate_y")) {
            let (pit, fill) = (1800.0 * 1.125, 2000.0 * 0.75 * 0.5);
            let expected = 1800.0 * 3.0 * 1.125
                + if *stage < 2.0 { pit } else { 0.0 }
                + if *stage > 2.0 { fill } else { 0.0 };
            assert!((mass - expected).abs() < 1e-9 * expected, "stage {stage}: {mass} for {expected}");
            assert!(*stage > 2.0 || *plate == 0.0, "a plate that is not there pressed with {plate} N");
        }
        assert!(history.last("force_plate_y") > 1e3, "{}", history.last("force_plate_y"));
        assert!(
            words.contains("equilibrium at t = ") && words.contains("stage 3 of 3, load, starts at t = "),
            "{words}"
        );
    });
}

/// A run may go on from any step, that in which a stage ends included.
#[test]
fn restarts_from_any_step_give_the_same() {
    let stages = STAGES
        .replace("duration = 0.5\nequilibrium = { speed = 1e-3, acceleration = 0.1 }", "duration = 0.004");
    let rest = "[time]\nend = 0.012\n[checkpoint]\nevery_steps = 1\nkeep = 999\n";
    let job = format!("{PIT}{rest}{stages}").replace("duration = 0.02", "duration = 0.004");
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("pit.toml");
    std::fs::write(&path, job).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &[]));
    let reference = Outcome::read(directory.path(), "pit");
    let files = contents(&directory.path().join("out/pit"));
    let all: Vec<_> =
        files.keys().filter(|file| file.contains("checkpoint") && file.ends_with("hdf")).collect();
    assert!(all.len() > 10, "{} steps", all.len());
    for checkpoint in all {
        let from = format!("out/pit/{checkpoint}");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet", "--restart", &from]));
        reference.assert_same(&Outcome::read(directory.path(), "pit"), &format!("restart from {from}"));
    }
}

/// A stage gives bodies their materials from its first step on, the first stage as well: the first time step
/// is that of the new one.
#[test]
fn the_first_stage_changes_materials_as_any_other() {
    let first_step = |material: &str, stage: &str| {
        let job = format!(
            "version = 1\ndimension = 2\ndomain = {{ size = [1, 1], root_edge = 1 }}\nboundaries = {{ y_max.kind = 'separating' }}\n\
             time = {{ end = 0.01 }}\nhistory = {{ every_steps = 1 }}\n\
             [[materials]]\nname = 'soft'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.2\n\
             [[materials]]\nname = 'stiff'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e7\npoisson = 0.2\n\
             [[bodies]]\nname = 'block'\nmaterial = '{material}'\nshape = {{ kind = 'box', min = [0.25, 0.25], max = [0.75, 0.75] }}\n\
             {stage}"
        );
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("block.toml");
        std::fs::write(&path, job).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &[]));
        History::read(directory.path(), "block").column("dt")[1]
    };
    let stiff = first_step("stiff", "");
    assert!(stiff < 0.2 * first_step("soft", ""));
    let changed = "[[stages]]\nname = 'one'\nmaterials = [{ body = 'block', material = 'stiff' }]\n";
    assert_eq!(first_step("soft", changed), stiff);
}

/// A block in free flight falls from the start of the stage that has gravity, and every stage ends with an
/// output.
#[test]
fn gravity_of_a_stage_acts_from_its_start() {
    let job = "version = 1\ndimension = 2\n[domain]\nsize = [1, 2]\nroot_edge = 1\n\
        [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.2\n\
        [[bodies]]\nname = 'block'\nmaterial = 'm'\nshape = { kind = 'box', min = [0.25, 1], max = [0.75, 1.5] }\n\
        [boundaries]\ny_max.kind = 'separating'\n[history]\nevery_steps = 1\n[output]\npicture = false\n[time]\nend = 0.3\n\
        [[stages]]\nname = 'float'\nduration = 0.1\n[[stages]]\nname = 'fall'\ngravity = [0, '-100 * t']\n";
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("fall.toml");
    std::fs::write(&path, job).expect("job");
    let words = text(&succeed(&mut run(directory.path(), 1, 1, &path, &[])));
    let history = History::read(directory.path(), "fall");
    let (times, stages) = (history.column("time"), history.column("stage"));
    let begun = times
        .iter()
        .zip(stages)
        .filter(|(_, stage)| **stage == 1.0)
        .map(|(time, _)| *time)
        .fold(0.0, f64::max);
    assert!((0.1..0.12).contains(&begun), "{begun}");
    let (t, speed) =
        (history.time_of_velocities() - begun, history.last("momentum_y") / history.last("mass"));
    // Gravity is linear in time, and taken in the middle of the time over which it acts: exact but for
    // rounding, from half a step before the stage, where velocities belong to.
    let (_, last) = history.at("dt", begun);
    let exact = 50.0 * (t * t - 0.25 * last * last);
    assert!((speed + exact).abs() < 1e-12 * exact, "{speed} after {t} s");
    assert!(words.contains("stage 2 of 2, fall, starts at t = "), "{words}");
    let files = contents(&directory.path().join("out/fall"));
    let outputs = files.keys().filter(|file| file.ends_with(".hdf") && !file.contains("checkpoint")).count();
    println!("{:?}", files.keys());
    assert!(outputs >= 3, "an output at the start, at the end of the first stage and at the end");
}

/// Before the first pour there is no material, and only a stone that falls: the stage ends at its end,
/// outputs come in time, the stone falls as it does beside material, and what is poured falls as it would
/// from t = 0.
#[test]
fn a_stage_without_material_ends_at_its_end() {
    let stone = "[[colliders]]\nname = 'stone'\nshape = { kind = 'circle', centre = [1.25, 0.7], radius = 0.05 }\n\
                 motion = { kind = 'free', density = 2500 }\n";
    let equilibrium = ", equilibrium = { speed = 1e-3, acceleration = 0.1 }";
    for (stone, wait) in [("", ""), (stone, ""), ("", equilibrium)] {
        let job = format!(
            "version = 1\ndimension = 2\ngravity = [0, -10]\n\
             stages = [{{ name = 'empty', duration = 0.05{wait} }}, {{ name = 'pour' }}]\n[domain]\nsize = [1.6, 0.8]\nroot_edge = 0.4\n\
             [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.3\n\
             [[bodies]]\nstage = 'pour'\nname = 'b'\nmaterial = 'm'\nshape = {{ kind = 'box', min = [0.2, 0.4], max = [0.5, 0.6] }}\n\
             [[probes]]\nname = 'b'\nquantities = ['centre']\n{stone}\
             [time]\nend = 0.2\n[output]\nevery = 0.02\n[history]\nevery_steps = 1\n\
             [checkpoint]\nevery_steps = 1\nkeep = 999\n"
        );
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("pour.toml");
        std::fs::write(&path, job).expect("job");
        let output = run(directory.path(), 1, 1, &path, &["--quiet"]).output().expect("starts");
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() && !told.contains("no equilibrium"), "{told}");
        let history = History::read(directory.path(), "pour");
        let (times, stages, masses) =
            (history.column("time"), history.column("stage"), history.column("mass"));
        let poured = stages.iter().position(|&stage| stage > 1.0).expect("a second stage");
        let begins = if wait.is_empty() { 0.05 } else { times[poured - 1] };
        assert!((times[poured - 1] - begins).abs() < 1e-15 && begins <= 0.05 + 1e-15, "{times:?}");
        assert!(masses[poured - 1] == 0.0 && (masses[poured] / 60.0 - 1.0).abs() < 1e-12, "{masses:?}");
        assert!(times.iter().all(|time| time.is_finite()) && (0.2..0.21).contains(&history.last("time")));
        let fallen = 0.5 - history.last("centre_b_y");
        let own = history.last("time") - begins;
        println!("{} steps, fallen {fallen} m in {own} s", history.last("step"));
        assert!((fallen / (0.5 * 10.0 * own * own) - 1.0).abs() < 0.05, "{fallen} m in {own} s");
        if !stone.is_empty() {
            let (time, y) = (times[poured - 1], history.column("position_stone_y")[poured - 1]);
            assert!((0.7 - y - 5.0 * time * time).abs() < 1e-12, "{y} m at {time} s");
        }
        if wait.is_empty() {
            let outputs = contents(&directory.path().join("out/pour"));
            let count = outputs.keys().filter(|name| name.ends_with(".tree.hdf")).count();
            assert!(count >= 11, "{count} outputs");
        }
        // From the middle of the empty stage the same comes out.
        let reference = Outcome::read(directory.path(), "pour");
        let from = "out/pour/pour.checkpoint_000000001.hdf";
        succeed(&mut run(directory.path(), 2, 1, &path, &["--quiet", "--restart", from]));
        reference.assert_same(&Outcome::read(directory.path(), "pour"), "restart from the empty stage");
    }
}

/// Two lifts of sand are poured from one place; if the first is still there, a warning says so.
#[test]
fn pours_may_come_from_one_place() {
    let pour = |duration: f64| {
        format!(
            "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [1, 2]\nroot_edge = 0.5\n\
             [boundaries]\ny_min.kind = 'slip'\n[history]\nevery_steps = 1\n[output]\npicture = false\n\
             [[materials]]\nname = 's'\ndensity = 1600\nmodel = 'mohr_coulomb'\nyoung = 1e5\npoisson = 0.3\nfriction_angle = 35\n\
             [[bodies]]\nname = 'a'\nmaterial = 's'\nshape = {{ kind = 'box', min = [0.25, 1.25], max = [0.75, 1.5] }}\n\
             [[bodies]]\nname = 'b'\nmaterial = 's'\nshape = {{ kind = 'box', min = [0.25, 1.25], max = [0.75, 1.5] }}\nstage = 'two'\n\
             [[stages]]\nname = 'one'\nduration = {duration}\n[[stages]]\nname = 'two'\n[time]\nend = 0.35\n"
        )
    };
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("pour.toml");
    let told = |duration: f64| {
        std::fs::write(&path, pour(duration)).expect("job");
        text(&succeed(&mut run(directory.path(), 1, 1, &path, &["--overwrite"])))
    };
    let words = told(0.3);
    assert!(!words.contains("come to places"), "{words}");
    let history = History::read(directory.path(), "pour");
    let lift = 1600.0 * 0.5 * 0.25;
    let masses = [history.column("mass")[0], history.last("mass")];
    assert!((masses[0] - lift).abs() < 1e-9 && (masses[1] - 2.0 * lift).abs() < 1e-9, "{masses:?}");
    let words = told(0.01);
    assert!(
        words.contains("stage two: 32 of 32 particles come to places that other material takes"),
        "{words}"
    );
}
