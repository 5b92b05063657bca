//! Loads through the whole program: closed forms of motion under body forces, grips and damping, work against
//! energy, and the same results on any ranks and across restarts.

use crate::common::history::History;
use crate::common::launch::{agimp, run, succeed};
use crate::common::restart;

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

/// A uniform force that changes in time is an acceleration: v = A/ω (1 - cos ωt), to the second order of the
/// midpoint rule.
#[test]
fn a_body_force_gives_its_impulse_and_its_work() {
    let force = "[[loads]]\nname = 'shake'\nkind = 'body_force'\nacceleration = ['8 * sin(20 * t)', -1]\n";
    let history = history("[0, 0]", 0.2, force);
    let (mass, time) = (history.last("mass"), history.time_of_velocities());
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
    // No stress, so all work is kinetic energy; work is that of the velocity after each impulse.
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
    let (t, mass) = (gravity.time_of_velocities(), gravity.last("mass"));
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

/// Local damping takes the share α of the unbalanced force: a block thrown up slows down with (1 + α) g and
/// falls with (1 - α) g, whatever the transfer, and also where criteria look at the velocities between steps.
/// Its work is the energy lost.
#[test]
fn local_damping_takes_a_share_of_the_unbalanced_force() {
    let looked_at = "[adaptivity]\nevery_steps = 2\n[[adaptivity.criteria]]\nkind = 'velocity_gradient'\nrefine = 1e9\nlevel = 3\n";
    for transfer in ["", "[numerics]\ntransfer = 'flip'\n", looked_at] {
        let damping = "[[loads]]\nname = 'local'\nkind = 'local_damping'\nfactor = 0.5\n";
        let thrown = text("[0, -10]", 0.2, &format!("{damping}{transfer}"))
            .replace("material = 'rubber'", "velocity = [0, 1]\nmaterial = 'rubber'");
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("body.toml");
        std::fs::write(&path, thrown).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let history = History::read(directory.path(), "body");
        let (up, down) = (15.0, 5.0);
        let expected = |t: f64| if t < 1.0 / up { 1.0 - up * t } else { -down * (t - 1.0 / up) };
        for (time, momentum) in history.times_of_velocities().into_iter().zip(history.column("momentum_y")) {
            let found = momentum / history.last("mass");
            // The force turns in the step after the velocity has: half of g over a step of 1 ms.
            assert!(
                (found - expected(time)).abs() < 0.011,
                "{found} at {time} s, expected {}",
                expected(time)
            );
        }
        let energy =
            |row: usize| history.column("kinetic_energy")[row] + history.column("gravitational_energy")[row];
        let lost = energy(history.column("time").len() - 1) - energy(0);
        let work = history.last("work_local");
        assert!(lost < 0.0 && (work / lost - 1.0).abs() < 0.03, "{work} J of {lost} J");
    }
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

/// Springs between the material and its places in the undeformed body, `-ω² (x - X)`: a block with a velocity
/// v swings as a whole, through splits and merges at level jumps, by v/ω sin ωt. A load that is a function of
/// X alone stays with its material. The same on any ranks and across a restart.
#[test]
fn forces_belong_to_places_of_the_undeformed_body() {
    let loads = "[checkpoint]\nevery_steps = 50\nkeep = 9\n\
                 [adaptivity]\nevery_steps = 10\n[[adaptivity.criteria]]\nkind = 'region'\nlevel = 2\nshape = { kind = 'box', min = [-1.0, -0.4], max = [-0.4, 0.4] }\n\
                 [[loads]]\nname = 'springs'\nkind = 'body_force'\nacceleration = ['-400 * (x - X)', 0]\n\
                 [[loads]]\nname = 'pair'\nkind = 'body_force'\nacceleration = [0, '0.1 * step(-0.4 - X) - 0.1 * step(X + 0.4)']\n";
    let job = text("[0, 0]", 0.25, loads)
        .replace("picture = false", "")
        .replace(
            "[[tree.regions]]\nlevel = 2\nshape = { kind = 'box', min = [-1.0, -0.4], max = [-0.4, 0.4] }\n",
            "",
        )
        .replace("name = 'body'\nmaterial", "name = 'body'\nvelocity = [3, 0]\nmaterial");
    restart::assert_same_on_any_ranks(&job, "body", |directory, _| {
        let history = History::read(directory, "body");
        let (time, mass) = (history.times_of_velocities(), history.last("mass"));
        let splits = history.column("particles");
        assert!(splits.iter().any(|&count| count != splits[0]), "no particle splits");
        for (row, &t) in time.iter().enumerate() {
            let exact = 3.0 * (20.0 * t).cos();
            let found = history.column("momentum_x")[row] / mass;
            assert!((found - exact).abs() < 0.04, "{found} at {t} s, exact {exact}");
        }
        // Half of the block is pushed up, half down, wherever it is.
        assert!(history.last("momentum_y").abs() < 1e-9 * mass && history.last("work_pair") > 0.0);
    });
}

#[test]
fn same_results_on_any_ranks_and_across_restart() {
    let loads = "[checkpoint]\nevery_steps = 33\nkeep = 9\n[[loads]]\nname = 'shake'\nkind = 'body_force'\nacceleration = ['8 * sin(20 * t) * (x + 1)', '-y']\n\
                 [[loads]]\nname = 'grip'\nkind = 'velocity'\ny = 0.1\nfrom = 0.02\nuntil = 0.08\nshape = { kind = 'box', min = [-0.55, -0.2], max = [-0.45, 0.2] }\n";
    let job = text("[0, '-9.81 * step(t - 0.05)']", 0.1, loads).replace("picture = false", "");
    restart::assert_same_on_any_ranks(&job, "body", |_, _| ());
}

/// The message for a wrong load names its key, the fault, and what would be right.
#[test]
fn wrong_loads_are_refused_with_their_key() {
    let cases = [
        (
            "kind = 'body_force'\nacceleration = ['2 * q', 0]",
            "loads[0].acceleration[0]",
            "found the name \"q\"",
        ),
        ("kind = 'body_force'\nacceleration = [1]", "loads[0].acceleration", "expected 2"),
        ("kind = 'velocity'\nx = [[0.0, 1.0], [0.0, 2.0]]", "loads[0].x", "increasing times"),
        ("kind = 'velocity'", "loads[0]", "expected a velocity along"),
        ("kind = 'velocity'\nz = 1", "loads[0].z", "2D job"),
        ("kind = 'damping'\nrate = -1", "loads[0].rate", "0 or more"),
        ("kind = 'damping'\nrate = 1\nfrom = 2\nuntil = 1", "loads[0].until", "after from"),
        ("kind = 'dampin'\nrate = 1", "loads[0].kind", "did you mean \"damping\""),
        ("kind = 'damping'\nrat = 1", "loads[0].rat", "did you mean `rate`"),
        ("kind = 'damping'\nrate = '1 + X'", "loads[0].rate", "positions in the undeformed body"),
        ("kind = 'velocity'\nx = 'X'", "loads[0].x", "positions in the undeformed body"),
        (
            "kind = 'body_force'\nacceleration = ['Z', 0]",
            "loads[0].acceleration[0]",
            "X, Y and t in a 2D job",
        ),
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

/// A record in a file is the table in the job, bit by bit, whatever its columns are called; with other rows
/// it is another job.
#[test]
fn a_record_in_a_file_is_a_table_over_time() {
    let load = |acceleration: &str| {
        format!("[[loads]]\nname = 'shake'\nkind = 'body_force'\nacceleration = [{acceleration}, 0]\n")
    };
    let directory = tempfile::tempdir().expect("temporary directory");
    let inside = |name: &str| directory.path().join(name);
    std::fs::create_dir(inside("records")).expect("directory");
    let rows = "# station, component\nnumber;acc (g);t (s)\n1;0;0\n2;0.25;0.03\n3;-0.5;0.05\n4;0;0.11\n";
    std::fs::write(inside("records/a.csv"), rows).expect("record");
    let run_of = |name: &str, acceleration: &str, options: &[&str]| {
        let path = inside(name);
        std::fs::write(&path, text("[0, 0]", 0.12, &load(acceleration))).expect("job");
        run(directory.path(), 1, 1, &path, options).output().expect("starts")
    };
    let in_file = "{ file = 'records/a.csv', time = 't (s)', value = 2, scale = 8.0 }";
    assert!(
        run_of("table.toml", "[[0, 0], [0.03, 2], [0.05, -4], [0.11, 0]]", &["--quiet"]).status.success()
    );
    assert!(run_of("file.toml", in_file, &["--quiet"]).status.success());
    let [table, file] = ["table", "file"].map(|name| History::read(directory.path(), name));
    for name in ["time", "momentum_x", "work_shake", "elastic_energy"] {
        assert_eq!(table.column(name), file.column(name), "{name}");
    }
    assert!(table.last("momentum_x").abs() > 1.0);
    std::fs::write(inside("records/a.csv"), rows.replace("0.25", "0.26")).expect("record");
    let output = run_of("file.toml", in_file, &["--restart", "latest", "--end", "0.13"]);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert!(told.contains("files that the job names"), "{told}");
}

/// A stiff block on a slope with friction, shaken by the record of `jobs/shaken_slope.toml`, slides as
/// N. M. Newmark says (Géotechnique 15, 1965): while it moves, its acceleration is that of the record and its
/// weight less the friction, and else it sticks.
#[test]
fn a_shaken_block_slides_as_newmark_says() {
    let (slope, friction, g) = (8_f64.to_radians(), 0.22, 9.81);
    let record = concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/records/tapered_sine.csv");
    // Top in the middle of a cell, so that the weight of the start is in equilibrium.
    let job = format!(
        "version = 1\ndimension = 2\ngravity = [0, {}]\n[domain]\nsize = [1.6, 0.4]\nroot_edge = 0.4\n[tree]\nbase_level = 1\n\
         [boundaries]\ny_min = {{ kind = 'separating', friction = {friction} }}\n\
         [[materials]]\nname = 'stone'\ndensity = 2000\nmodel = 'neo_hookean'\nyoung = 8e6\npoisson = 0.2\n\
         [[bodies]]\nname = 'body'\nmaterial = 'stone'\nshape = {{ kind = 'box', min = [0.2, 0], max = [0.8, 0.125] }}\n\
         stress = {{ kind = 'geostatic', k0 = 0.25 }}\n\
         [[loads]]\nname = 'quake'\nkind = 'body_force'\nacceleration = [{{ file = '{record}', time = 't', value = 'a', scale = {g} }}, 0]\n\
         [[loads]]\nname = 'slope'\nkind = 'body_force'\nacceleration = ['{} * min(t / 0.2, 1)', 0]\n\
         [[probes]]\nname = 'block'\nquantities = ['centre']\n\
         [time]\nend = 3\n[output]\npicture = false\n[history]\nevery_steps = 20\n",
        -g * slope.cos(),
        g * slope.sin(),
    );
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("body.toml");
    std::fs::write(&path, job).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "body");

    let text = std::fs::read_to_string(record).expect("record");
    let cells = text.lines().skip(2).map(|line| line.split_once(',').expect("two columns"));
    let rows: Vec<(f64, f64)> = cells.map(|(t, a)| (t.parse().expect("t"), a.parse().expect("a"))).collect();
    let table = agimp::quantity::Table::new(&rows).expect("a table");
    let (dt, most) = (1e-5, friction * g * slope.cos());
    let (mut velocity, mut way, mut ways) = (0.0_f64, 0.0, vec![0.0]);
    for step in 0..300_000 {
        let t = (f64::from(step) + 0.5) * dt;
        let driving = g * (table.at(t) + slope.sin() * (t / 0.2).min(1.0));
        let free = velocity + dt * driving;
        // Friction takes from the motion what it can, and no more than there is.
        velocity = free - free.signum() * free.abs().min(dt * most);
        way += dt * velocity;
        ways.push(way);
    }
    let start = history.column("centre_block_x")[0];
    let (mut worst, all) = (0.0_f64, way);
    for (time, x) in history.column("time").iter().zip(history.column("centre_block_x")) {
        worst = worst.max((x - start - ways[((time / dt) as usize).min(300_000)]).abs());
    }
    let found = history.last("centre_block_x") - start;
    println!("way {found} m, Newmark {all} m, greatest difference on the way {worst} m");
    assert!(all > 0.1 && (found / all - 1.0).abs() < 0.02, "{found} against {all}");
    assert!(worst < 0.02 * all, "{worst} of {all}");
}

/// A value that is not finite ends the run with key, expression, place and time; at the start it is refused
/// before the run.
#[test]
fn a_value_that_is_not_finite_names_its_expression() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("body.toml");
    let told = |job: String, code: i32| {
        std::fs::write(&path, job).expect("job");
        let output =
            run(directory.path(), 1, 1, &path, &["--quiet", "--overwrite"]).output().expect("starts");
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{told}");
        told
    };
    let in_time = told(text("[0, '-1 / (t < 0.01)']", 0.02, ""), 1);
    let parts =
        ["gravity[1]: found the value -inf of \"-1 / (t < 0.01)\" at t = 0.01", "expected a finite number"];
    assert!(parts.iter().all(|part| in_time.contains(part)), "{in_time}");
    let load = "[[loads]]\nname = 'pull'\nkind = 'body_force'\nacceleration = ['sqrt(x + 0.4)', 0]\n";
    let in_place = told(text("[0, 0]", 0.02, load), 1);
    let parts = ["loads[0].acceleration[0]: found the value NaN of \"sqrt(x + 0.4)\" at x = -0.", " m"];
    assert!(parts.iter().all(|part| in_place.contains(part)), "{in_place}");
    let moving = text("[0, 0]", 0.02, "")
        .replace("material = 'rubber'\nshape", "material = 'rubber'\nvelocity = ['ln(x + 0.4)', 0]\nshape");
    let at_start = told(moving, 2);
    let parts = ["bodies[0].velocity[0]: found the value", "ln(x + 0.4)"];
    assert!(parts.iter().all(|part| at_start.contains(part)), "{at_start}");
    let check = agimp(directory.path()).arg("check").arg(&path).output().expect("starts");
    assert_eq!(check.status.code(), Some(2), "{}", String::from_utf8_lossy(&check.stderr));
}

/// A record of PEER and one with columns apart by spaces are the table in the job, bit by bit; `ramp` is half
/// a period of a cosine.
#[test]
fn records_of_other_programs_and_smooth_ramps() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let peer = "PEER\nSomewhere\nACCELERATION IN UNITS OF G\nNPTS=  4, DT=  .0500 SEC\n  .0000E+00  .2500E+00\n -.5000E+00 .0000E+00\n";
    std::fs::write(directory.path().join("a.at2"), peer).expect("record");
    let spaced = "T  ACC\n0.0 0\n5.0D-02 2.5d-1\n0.1 -.5\n0.15 0\n";
    std::fs::write(directory.path().join("b.txt"), spaced).expect("record");
    let momenta = |acceleration: &str| {
        let load =
            format!("[[loads]]\nname = 'shake'\nkind = 'body_force'\nacceleration = [{acceleration}, 0]\n");
        let path = directory.path().join("body.toml");
        std::fs::write(&path, text("[0, 0]", 0.1, &load)).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet", "--overwrite"]));
        let history = History::read(directory.path(), "body");
        (
            history.column("momentum_x").to_vec(),
            history.last("momentum_x") / history.last("mass"),
            history.time_of_velocities(),
        )
    };
    let (table, ..) = momenta("[[0, 0], [0.05, 2], [0.1, -4], [0.15000000000000002, 0]]");
    assert_eq!(momenta("{ file = 'a.at2', scale = 8 }").0, table);
    let (table, ..) = momenta("[[0, 0], [0.05, 2], [0.1, -4], [0.15, 0]]");
    assert_eq!(momenta("{ file = 'b.txt', time = 't', value = 'acc', scale = 8 }").0, table);
    // Half of the impulse of the whole force over the ramp, and all of it in the rest of the last step.
    let (_, speed, time) = momenta("'8 * ramp(t / 0.1)'");
    let exact = 0.4 + 8.0 * (time - 0.1);
    assert!((speed - exact).abs() < 1e-5, "{speed} for {exact}");
}
