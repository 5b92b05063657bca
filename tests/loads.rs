//! Loads through the whole program: closed forms of motion under body forces, grips and damping, work against energy, and
//! the same results on any ranks and across restarts.
#[path = "common/runs.rs"]
mod runs;

use runs::history::History;
use runs::launch::{agimp, run, succeed};
use runs::restart;

/// A 2D job with a rubber block that crosses a level jump, and what `rest` adds.
fn text(gravity: &str, end: f64, rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\ngravity = {gravity}\n\
         [domain]\nmin = [-1.0, -0.4]\nsize = [1.6, 0.8]\nroot_edge = 0.2\n\
         [tree]\nbase_level = 1\n\
         [[tree.regions]]\nlevel = 2\nshape = {{ kind = 'box', min = [-1.0, -0.4], max = [-0.4, 0.4] }}\n\
         [[materials]]\nname = 'rubber'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.2\n\
         [[bodies]]\nname = 'body'\nmaterial = 'rubber'\n\
         shape = {{ kind = 'box', min = [-0.5, -0.1], max = [-0.3, 0.1] }}\n\
         [time]\nend = {end}\ndt_max = 1e-3\n[output]\npicture = false\n[history]\nevery_steps = 7\n{rest}\n"
    )
}

fn history(gravity: &str, end: f64, rest: &str) -> History {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("body.toml");
    std::fs::write(&path, text(gravity, end, rest)).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    History::read(directory.path(), "body")
}

/// A uniform force that changes in time is an acceleration: v = A/ω (1 - cos ωt), to the second order of the midpoint rule.
#[test]
fn a_body_force_gives_its_impulse_and_its_work() {
    let force = "[[loads]]\nname = 'shake'\nkind = 'body_force'\nacceleration = ['8 * sin(20 * t)', -1]\n";
    let history = history("[0, 0]", 0.2, force);
    let (mass, time) = (history.last("mass"), history.last("time"));
    let exact = 8.0 / 20.0 * (1.0 - (20.0 * time).cos());
    let found = history.last("momentum_x") / mass;
    println!("velocity {found}, exact {exact}");
    assert!((found - exact).abs() < 2e-5, "{found} against {exact}");
    assert!((history.last("momentum_y") / mass + time).abs() < 1e-12);
    for axis in ["x", "y"] {
        let (given, gained) =
            (history.integral(&format!("load_shake_{axis}"), 0.0), history.last(&format!("momentum_{axis}")));
        assert!((given - gained).abs() < 1e-12 * gained.abs(), "{axis}: {given} against {gained}");
    }
    // No stress, so all work is kinetic energy, but for the offset of half a step of symplectic Euler.
    let (work, kinetic) = (history.last("work_shake"), history.last("kinetic_energy"));
    println!("work {work}, kinetic energy {kinetic}");
    assert!((work / kinetic - 1.0).abs() < 0.02, "{work} against {kinetic}");
}

/// Gravity by an expression of time is the same force as a load without a shape.
#[test]
fn gravity_may_change_in_time() {
    let gravity = history("['-3 * t', [[0.0, -9.81], [0.1, 0.0]]]", 0.2, "");
    let load = history(
        "[0, 0]",
        0.2,
        "[[loads]]\nname = 'g'\nkind = 'body_force'\nacceleration = ['-3 * t', [[0.0, -9.81], [0.1, 0.0]]]\n",
    );
    let (t, mass) = (gravity.last("time"), gravity.last("mass"));
    for name in ["momentum_x", "momentum_y", "elastic_energy"] {
        let (found, expected) = (gravity.last(name), load.last(name));
        assert!((found - expected).abs() < 1e-12 * mass, "{name}: {found} against {expected}");
    }
    assert!((gravity.last("momentum_x") / mass + 1.5 * t * t).abs() < 1e-12);
    assert!((gravity.last("momentum_y") / mass + 0.5 * 9.81 * 0.1).abs() < 1e-3);
}

/// Damping takes exp(-rate t) of a rigid motion, and its work is the kinetic energy lost.
#[test]
fn damping_decays_as_an_exponential() {
    let damping = "[[loads]]\nname = 'drag'\nkind = 'damping'\nrate = 5\nuntil = 0.1\n";
    let moving = text("[0, 0]", 0.15, damping)
        .replace("material = 'rubber'\nshape", "material = 'rubber'\nvelocity = [2, 0]\nshape");
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("body.toml");
    std::fs::write(&path, moving).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "body");
    let found = history.last("momentum_x") / history.last("mass");
    // It ends with the first step that begins at 0.1 s or later.
    println!("velocity {found}, exact {}", 2.0 * (-0.5_f64).exp());
    assert!((found / (2.0 * (-0.5_f64).exp()) - 1.0).abs() < 0.006, "{found}");
    let lost = history.column("kinetic_energy")[0] - history.last("kinetic_energy");
    assert!((history.last("work_drag") / -lost - 1.0).abs() < 0.01, "{} {lost}", history.last("work_drag"));
}

/// A gripped bar follows the prescribed velocity at its end; pulled slowly, it carries E' strain.
#[test]
fn grips_stretch_a_bar() {
    let grips = "[[loads]]\nname = 'left'\nkind = 'velocity'\nx = 0\nshape = { kind = 'box', min = [-0.55, -0.2], max = [-0.475, 0.2] }\n\
                 [[loads]]\nname = 'right'\nkind = 'velocity'\nx = '0.02 * min(t / 0.05, 1)'\nshape = { kind = 'box', min = [-0.325, -0.2], max = [-0.2, 0.2] }\n\
                 [[loads]]\nname = 'calm'\nkind = 'damping'\nrate = 20\n";
    let history = history("[0, 0]", 0.3, grips);
    let way = 0.02 * (history.last("time") - 0.025);
    // Plane strain, free sideways: E' = E / (1 - ν²); 0.15 m between the grips, 0.2 m wide.
    let exact = 1e5 / (1.0 - 0.04) * (way / 0.15) * 0.2;
    let (left, right) = (history.last("load_left_x"), history.last("load_right_x"));
    println!("forces {left} {right}, exact {exact}");
    // The grips lie on nodes: the length between them is uncertain by a cell.
    assert!((right / exact - 1.0).abs() < 0.25, "{right} against {exact}");
    assert!((left / right + 1.0).abs() < 0.05, "{left} {right}");
    assert!(history.last("work_right") > history.last("elastic_energy"));
}

#[test]
fn same_results_on_any_ranks_and_across_restart() {
    let loads = "[checkpoint]\nevery_steps = 33\nkeep = 9\n[[loads]]\nname = 'shake'\nkind = 'body_force'\nacceleration = ['8 * sin(20 * t) * (x + 1)', '-y']\n\
                 [[loads]]\nname = 'grip'\nkind = 'velocity'\ny = 0.1\nfrom = 0.02\nuntil = 0.08\nshape = { kind = 'box', min = [-0.55, -0.2], max = [-0.45, 0.2] }\n";
    let job = text("[0, '-9.81 * step(t - 0.05)']", 0.1, loads).replace("picture = false", "");
    restart::assert_same_on_any_ranks(&job, "body", |_, _| ());
}

/// What is wrong with a load is said with its key, and what would be right.
#[test]
fn wrong_loads_are_refused_with_their_key() {
    let cases = [
        (
            "kind = 'body_force'\nacceleration = ['2 * q', 0]",
            "loads[0].acceleration[0]",
            "found the name \"q\"",
        ),
        ("kind = 'body_force'\nacceleration = [1]", "loads[0].acceleration", "expected 2"),
        ("kind = 'velocity'\nx = [[0.0, 1.0], [0.0, 2.0]]", "loads[0].x", "times that increase"),
        ("kind = 'velocity'", "loads[0]", "expected a velocity along"),
        ("kind = 'velocity'\nz = 1", "loads[0].z", "2D job"),
        ("kind = 'damping'\nrate = -1", "loads[0].rate", "0 or more"),
        ("kind = 'damping'\nrate = 1\nfrom = 2\nuntil = 1", "loads[0].until", "after from"),
        ("kind = 'dampin'\nrate = 1", "loads[0].kind", "did you mean \"damping\""),
        ("kind = 'damping'\nrat = 1", "loads[0].rat", "did you mean `rate`"),
    ];
    for (load, key, words) in cases {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("bad.toml");
        std::fs::write(&path, text("[0, 0]", 0.1, &format!("[[loads]]\nname = 'l'\n{load}"))).expect("job");
        let output = agimp(directory.path()).arg("check").arg(&path).output().expect("starts");
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{load}\n{message}");
        assert!(message.contains(key) && message.contains(words), "{load}: {key} {words}\n{message}");
    }
}
