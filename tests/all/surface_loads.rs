//! Tractions, pressures and point forces through the whole program: force, impulse and work are those of the
//! definition while particles split and merge; closed forms of a pulled bar, a falling column and a
//! cantilever; same bits on any ranks.

use crate::common::history::History;
use crate::common::launch::agimp;
use crate::common::relaunch::{ran_if_launched, relaunch};
use crate::common::restart;
use agimp::exact_sum::ExactSum;
use agimp::job::{AnyProblem, Problem, parse};
use agimp::setup;
use agimp::solver::{Requests, Solver};
use partition::comm::Comm;

/// A rubber block, free in space, and what `rest` adds. Its faces lie on those of the particles' boxes.
fn block(tree: &str, rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\n\
         [domain]\nmin = [-1.0, -0.4]\nsize = [1.6, 0.8]\nroot_edge = 0.2\n\
         [boundaries]\nx_min = {{ kind = 'slip' }}\nx_max = {{ kind = 'slip' }}\n\
         y_min = {{ kind = 'slip' }}\ny_max = {{ kind = 'slip' }}\n\
         [tree]\nbase_level = 1\n{tree}\
         [[materials]]\nname = 'rubber'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.2\n\
         [[bodies]]\nname = 'body'\nmaterial = 'rubber'\n\
         shape = {{ kind = 'box', min = [-0.5, -0.1], max = [-0.3, 0.1] }}\n\
         [time]\nend = 0.1\ndt_max = 1e-3\n[output]\npicture = false\n[history]\nevery_steps = 7\n{rest}\n"
    )
}

const REFINED: &str =
    "[[tree.regions]]\nlevel = 2\nshape = { kind = 'box', min = [-1.0, -0.4], max = [-0.4, 0.4] }\n";

/// The block moves through the region, in which particles split and behind which they merge.
const DYNAMIC: &str = "[adaptivity]\nevery_steps = 3\n[[adaptivity.criteria]]\nkind = 'region'\nlevel = 3\n\
                       shape = { kind = 'box', min = [-0.36, -0.4], max = [-0.24, 0.4] }\n";

/// Traction on the right face, dead pressure on the upper, following pressure on the lower, a force on the
/// middle.
const LOADS: &str = "[[loads]]\nname = 'pull'\nkind = 'traction'\ntraction = [40, '30 * t']\nfacing = [1, 0]\n\
    [[loads]]\nname = 'dead'\nkind = 'pressure'\npressure = 25\nfollow = false\nfacing = [0, 1]\n\
    [[loads]]\nname = 'wind'\nkind = 'pressure'\npressure = 20\nfacing = [0, -1]\n\
    [[loads]]\nname = 'push'\nkind = 'point_force'\nforce = [5, 0]\nfrom = 0.02\nuntil = 0.06\n\
    shape = { kind = 'box', min = [-0.45, -0.05], max = [-0.35, 0.05] }\n";

fn with_speed(text: &str) -> String {
    text.replace("material = 'rubber'\nshape", "material = 'rubber'\nvelocity = [3, 0]\nshape")
}

fn history(text: &str, name: &str) -> History {
    History::of_job(name, text, &[])
}

/// The impulse of dead loads is force times time, all momentum comes from loads, and the energy that they
/// give is their work; on uniform, refined and changing trees.
#[test]
fn impulses_are_those_of_the_definition_while_particles_split_and_merge() {
    for (name, tree, rest) in [("uniform", "", ""), ("refined", REFINED, ""), ("dynamic", "", DYNAMIC)] {
        let history = history(&with_speed(&block(tree, &format!("{LOADS}{rest}"))), "body");
        let time = history.time_of_velocities();
        if name == "dynamic" {
            println!("splits {}, merges {}", history.last("splits"), history.last("merges"));
            assert!(history.last("splits") > 50.0 && history.last("merges") > 50.0);
        }
        let impulse = |load: &str, axis: &str| history.integral(&format!("load_{load}_{axis}"), 0.0);
        // An edge of 0.2 m each. The step takes forces at its middle, which is exact for those that are
        // linear in time.
        let exact = [
            ("pull", "x", 40.0 * 0.2 * time),
            ("pull", "y", 0.5 * 30.0 * 0.2 * time * time),
            ("dead", "x", 0.0),
            ("dead", "y", -25.0 * 0.2 * time),
            ("push", "y", 0.0),
        ];
        for (load, axis, exact) in exact {
            let found = impulse(load, axis);
            println!("{name}: {load}_{axis} {found:e}, exact {exact:e}");
            assert!((found - exact).abs() < 1e-12, "{name}: {load}_{axis} {found} against {exact}");
        }
        // It acts in whole steps.
        assert!((impulse("push", "x") - 5.0 * 0.04).abs() <= 5.0 * 2e-3, "{}", impulse("push", "x"));
        for axis in ["x", "y"] {
            let given: f64 = ["pull", "dead", "wind", "push"].iter().map(|load| impulse(load, axis)).sum();
            let column = history.column(&format!("momentum_{axis}"));
            let gained = history.last(&format!("momentum_{axis}")) - column[0];
            assert!((given - gained).abs() < 1e-12 * 60.0, "{name} {axis}: {given} against {gained}");
        }
        let work: f64 =
            ["pull", "dead", "wind", "push"].iter().map(|l| history.last(&format!("work_{l}"))).sum();
        let energy =
            |row: usize| history.column("kinetic_energy")[row] + history.column("elastic_energy")[row];
        let gained = energy(history.column("time").len() - 1) - energy(0);
        println!("{name}: work {work}, energy gained {gained}");
        // The difference is dissipation by APIC and merges.
        assert!(gained < 1.02 * work && gained > 0.8 * work, "{name}: {work} against {gained}");
    }
}

/// A block, free in space, bears a pressure on all its surface as the same stress everywhere: it stays at
/// rest to round-off, on equal cells and over a jump between cells, in the plane (without strain across it),
/// in space and as a body of revolution.
#[test]
fn uniform_pressure_is_borne_by_uniform_stress() {
    let load = "[[loads]]\nname = 'water'\nkind = 'pressure'\npressure = 100\n";
    let block = |tree: &str, across: f64| {
        let stress = format!("stress = {{ kind = 'components', xx = -100, yy = -100, zz = {across} }}");
        block(tree, load)
            .replace("neo_hookean", "hencky")
            .replace("end = 0.1", "end = 0.02")
            .replace("material = 'rubber'\nshape", &format!("material = 'rubber'\n{stress}\nshape"))
    };
    let space = block("", -100.0)
        .replace("dimension = 2", "dimension = 3")
        .replace("[-1.0, -0.4]", "[-1.0, -0.4, -0.4]")
        .replace("[1.6, 0.8]", "[1.6, 0.8, 0.8]")
        .replace("-0.1]", "-0.1, -0.1]")
        .replace("0.1] }", "0.1, 0.1] }")
        .replace("[boundaries]", "[boundaries]\nz_min = { kind = 'slip' }\nz_max = { kind = 'slip' }");
    // On nodes, rounding would let boxes reach into empty cells.
    let inner =
        "[[tree.regions]]\nlevel = 2\nshape = { kind = 'box', min = [-0.45, -0.05], max = [-0.35, 0.05] }\n";
    let graded = block(inner, -40.0).replace(
        "min = [-0.5, -0.1], max = [-0.3, 0.1]",
        "min = [-0.7125, -0.2875], max = [-0.0875, 0.3125]",
    );
    let ring = block("", -100.0)
        .replace("dimension = 2", "dimension = 2\ngeometry = 'axisymmetric'")
        .replace("x_min = { kind = 'slip' }\n", "")
        .replace("[-1.0, -0.4]", "[0, -0.4]")
        .replace("min = [-0.5, -0.1], max = [-0.3, 0.1]", "min = [0, -0.0875], max = [0.1875, 0.1125]");
    for (name, text) in [("equal", block("", -40.0)), ("graded", graded), ("space", space), ("ring", ring)] {
        let history = history(&text, name);
        let (energy, work) = (history.last("kinetic_energy"), history.last("work_water"));
        println!("{name}: {energy} J, {work} J");
        assert!(
            history.last("step") > 5.0 && energy < 1e-20 && work.abs() < 1e-10,
            "{name}: {energy} J, {work} J"
        );
    }
}

fn problem(text: &str) -> Problem<2> {
    match parse(text, "block.toml".as_ref()) {
        Ok(AnyProblem::Two(problem)) => problem,
        other => panic!("{other:?}"),
    }
}

/// Sum of a column of what particles carry.
fn carried(solver: &Solver<2>, column: usize) -> f64 {
    let mut sum = ExactSum::new();
    solver.chunks.iter().flat_map(|chunk| chunk.carried(column)).for_each(|&number| sum.add(number));
    sum.to_f64()
}

/// Areas: exact at the start, kept by all changes of the tree; the work of a force on points is force times
/// way, particle by particle.
#[test]
fn areas_are_kept_and_work_is_force_times_way() {
    if !ran_if_launched(keeps_areas) {
        relaunch(module_path!(), "areas_are_kept_and_work_is_force_times_way", 1, 100);
    }
}

fn keeps_areas(comm: &Comm) {
    for (tree, rest) in [("", ""), (REFINED, ""), ("", DYNAMIC)] {
        let problem = problem(&with_speed(&block(tree, &format!("{LOADS}{rest}"))));
        let mut solver = setup::solver(comm, &problem).unwrap_or_else(|error| panic!("{error}"));
        // Columns: area of `pull` and its vector; area vectors of `dead` and of `wind`; shares of `push`.
        let start = [0.2, 0.2, 0.0, 0.0, 0.2, 0.0, -0.2, 1.0];
        let check = |solver: &Solver<2>, columns: &[usize]| {
            for &column in columns {
                let found = carried(solver, column);
                assert!((found - start[column]).abs() < 1e-14, "{column}: {found}");
            }
        };
        check(&solver, &[0, 1, 2, 3, 4, 5, 6, 7]);
        let mut work = 0.0;
        for _ in 0..60 {
            let places = |solver: &Solver<2>| {
                let mut places = std::collections::HashMap::new();
                for chunk in &solver.chunks {
                    for p in 0..chunk.len() {
                        let share = chunk.carried(7).get(p).copied().unwrap_or(0.0);
                        places.insert(chunk.ids()[p], (chunk.position(p), share));
                    }
                }
                places
            };
            let (before, acts) = (places(&solver), (0.02..0.06).contains(&solver.clock.time));
            solver.step(f64::MAX, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
            let after = places(&solver);
            for (id, (x, share)) in before.iter().filter(|_| acts) {
                if let Some((y, _)) = after.get(id) {
                    work += share * 5.0 * (y[0] - x[0]);
                }
            }
            if rest.is_empty() {
                let booked = solver.load_totals()[3].work;
                assert!((booked - work).abs() <= 1e-12 * work.abs(), "{booked} against {work}");
            }
            if solver.clock.step % 3 == 0 && !rest.is_empty() {
                solver.regrid().unwrap_or_else(|error| panic!("{error}"));
            }
            check(&solver, &[0, 3, 4, 7]);
        }
    }
}

#[test]
fn same_results_on_any_ranks_and_across_restart() {
    let rest = format!("{LOADS}{DYNAMIC}[checkpoint]\nevery_steps = 30\nkeep = 9\n");
    let job = with_speed(&block("", &rest)).replace("picture = false", "");
    restart::assert_same_on_any_ranks(&job, "body", |_, _| ());
}

/// A job in which material of one body lies between slip faces.
fn confined(
    origin: [f64; 2],
    roots: [u32; 2],
    root_edge: f64,
    material: &str,
    shape: &str,
    rest: &str,
) -> String {
    let size = roots.map(|n| f64::from(n) * root_edge);
    format!(
        "version = 1\ndimension = 2\n[domain]\nmin = {origin:?}\nsize = {size:?}\nroot_edge = {root_edge}\n\
         [tree]\nbase_level = 0\n\
         [boundaries]\nx_min = {{ kind = 'slip' }}\nx_max = {{ kind = 'slip' }}\n\
         y_min = {{ kind = 'slip' }}\ny_max = {{ kind = 'slip' }}\n\
         [[materials]]\nname = 'm'\n{material}\n[[bodies]]\nname = 'body'\nmaterial = 'm'\n{shape}\n\
         [output]\npicture = false\n{rest}\n"
    )
}

/// A bar between slip faces, fixed at one end and pulled suddenly at the other: its end goes to and fro along
/// a triangle up to twice the static displacement, and the wall feels 0 or twice the traction.
#[test]
fn a_bar_pulled_suddenly_follows_the_closed_form() {
    let (length, stiffness, traction) = (25.0, 100.0, 0.5);
    // 64 cells of one bar, one leaf high.
    let edge = length / 16.0;
    let job = confined(
        [0.0, 0.0],
        [17, 1],
        edge,
        "density = 1\nmodel = 'fixed_corotated'\nyoung = 100\npoisson = 0",
        &format!("shape = {{ kind = 'box', min = [0, 0], max = [{length}, {edge}] }}"),
        &format!(
            "[time]\nend = 20\n[history]\nevery_steps = 1\n\
             [[loads]]\nname = 'pull'\nkind = 'traction'\ntraction = [{traction}, 0]\n"
        ),
    );
    let history = history(&job, "bar");
    let (time, work) = (history.column("time"), history.column("work_pull"));
    let most = 2.0 * traction * length / stiffness;
    let mut square = 0.0;
    for (t, work) in time.iter().zip(work) {
        // A period of 4 L / c = 10 s.
        let phase = (t / 10.0).fract();
        let exact = most * (1.0 - (2.0 * phase - 1.0).abs());
        let found = work / (traction * edge);
        square += (found - exact) * (found - exact);
    }
    let error = (square / time.len() as f64).sqrt() / most;
    println!("displacement of the end: root mean square error {error:.4} of its range");
    assert!(error < 0.01, "{error}");
    // Between its jumps at 2.5 s and 7.5 s the wall pulls twice as much as the traction.
    let ((from, before), (to, after)) = (history.at("momentum_x", 3.5), history.at("momentum_x", 6.5));
    let wall = traction * edge - (after - before) / (to - from);
    println!("force on the wall {wall}, exact {}", 2.0 * traction * edge);
    assert!((wall / (2.0 * traction * edge) - 1.0).abs() < 0.02, "{wall}");
    let energy = history.last("kinetic_energy") + history.last("elastic_energy");
    let largest = work.iter().copied().fold(0.0, f64::max);
    println!("work {}, energy {energy}, largest work {largest}", history.last("work_pull"));
    assert!((energy - history.last("work_pull")).abs() < 0.02 * largest);
}

/// A column on which gravity acts suddenly: its top moves as the sum of its modes. A small force is the
/// probe: its work is force times way.
#[test]
fn a_column_under_sudden_weight_follows_the_closed_form() {
    let (height, gravity, speed) = (50.0_f64, 10.0, (1e6_f64 / 80.0).sqrt());
    let period = 4.0 * height / speed;
    let job = confined(
        [0.0, 0.0],
        [1, 17],
        3.125,
        "density = 80\nmodel = 'fixed_corotated'\nyoung = 1e6\npoisson = 0",
        "shape = { kind = 'box', min = [0, 0], max = [3.125, 50] }",
        &format!(
            "[time]\nend = {}\n[history]\nevery_steps = 1\n\
             [[loads]]\nname = 'probe'\nkind = 'point_force'\nforce = [0, -1e-3]\n\
             shape = {{ kind = 'box', min = [0, 49.7], max = [3.125, 50] }}\n",
            2.0 * period
        ),
    );
    let history = history(&job.replace("dimension = 2", "dimension = 2\ngravity = [0, -10]"), "column");
    let modes = |t: f64| {
        let sum: f64 = (0..400)
            .map(|k| {
                let n = f64::from(2 * k + 1);
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                let angle = n * std::f64::consts::FRAC_PI_2 * speed * t / height;
                sign / n.powi(3) * (1.0 - angle.cos())
            })
            .sum();
        -16.0 * gravity * height * height / (std::f64::consts::PI.powi(3) * speed * speed) * sum
    };
    let (time, work) = (history.column("time"), history.column("work_probe"));
    let square: f64 = time.iter().zip(work).map(|(t, work)| (work / -1e-3 - modes(*t)).powi(2)).sum();
    let error = (square / time.len() as f64).sqrt() / 2.0;
    let end = (history.last("work_probe") / -1e-3 - modes(history.last("time"))).abs() / 2.0;
    println!(
        "displacement of the top: root mean square error {error:.4} of its range, {end:.4} after two periods"
    );
    assert!(error < 0.02 && end < 0.02, "{error} {end}");
}

/// A cantilever with a dead load at its tip, taken to equilibrium: large rotations. The reference is a finite
/// element solution of the plane problem (Q9, converged to 0.1 %): -8.2814 m for Hencky's law.
#[test]
fn a_cantilever_bends_as_finite_elements_do() {
    let job = confined(
        [0.0, -12.0],
        [6, 7],
        2.0,
        "density = 1000\nmodel = 'hencky'\nyoung = 12e6\npoisson = 0.2",
        "particles_per_cell = 3\nshape = { kind = 'box', min = [0, -0.5], max = [10, 0.5] }",
        "[time]\nend = 30\n[equilibrium]\nspeed = 0.01\nacceleration = 0.3\n\
         [[loads]]\nname = 'support'\nkind = 'velocity'\ny = 0\n\
         shape = { kind = 'box', min = [-0.1, -0.1], max = [0.1, 0.1] }\n\
         [[loads]]\nname = 'tip'\nkind = 'point_force'\nforce = [0, -100e3]\n\
         shape = { kind = 'box', min = [9.9, -0.1], max = [10, 0.1] }\n",
    );
    let history = history(&job, "cantilever");
    let found = history.last("work_tip") / -100e3;
    println!("displacement of the tip {found}");
    assert!((found / -8.2814 - 1.0).abs() < 0.05, "{found}");
}

/// A quarter of a thick cylinder under inner pressure: the force is p a along each axis, and the inner wall
/// goes where Lamé says.
#[test]
fn a_thick_cylinder_widens_as_lame_says() {
    let job = confined(
        [0.0, 0.0],
        [5, 5],
        0.5,
        "density = 1000\nmodel = 'hencky'\nyoung = 1e7\npoisson = 0.3",
        "shape = { kind = 'difference', from = { kind = 'intersection', parts = [{ kind = 'box', min = [0, 0], max = [2, 2] }, \
         { kind = 'circle', centre = [0, 0], radius = 2 }] }, remove = [{ kind = 'circle', centre = [0, 0], radius = 1 }] }",
        "[time]\nend = 5\ncfl = 0.2\n[equilibrium]\nspeed = 1e-4\nacceleration = 0.1\n\
         [[loads]]\nname = 'inside'\nkind = 'pressure'\npressure = 5000\nshape = { kind = 'circle', centre = [0, 0], radius = 1.2 }\n",
    );
    let history = history(&job, "cylinder");
    let found = history.last("work_inside") / (5000.0 * std::f64::consts::FRAC_PI_2);
    let exact = 5000.0 * 1.906667e-7;
    println!("displacement of the inner wall {found:e}, exact {exact:e}");
    // Eight cells through the wall; the particles lie a quarter of a cell inside.
    assert!((found / exact - 1.0).abs() < 0.04, "{found}");
    let force = history.column("load_inside_x")[1];
    assert!((force / 5000.0 - 1.0).abs() < 2e-3, "{force}");
}

/// A block of ice floats at the depth at which it displaces its weight: pressure and traction that grow with
/// depth act at the surface, and not at the centres of particles, half of their distance further inside.
#[test]
fn a_block_floats_at_its_draught() {
    let sea = "1025 * 9.81 * max(0, 1.8 - y)";
    for load in [
        format!("kind = 'pressure'\npressure = '{sea}'"),
        format!("kind = 'traction'\ntraction = [0, '{sea}']\nfacing = [0, -1]"),
    ] {
        let job = format!(
            "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [3.2, 3.2]\nroot_edge = 0.4\n\
             [boundaries]\nx_min.kind = 'separating'\nx_max.kind = 'separating'\ny_min.kind = 'separating'\ny_max.kind = 'separating'\n\
             [[materials]]\nname = 'ice'\ndensity = 917\nmodel = 'hencky'\nyoung = 1e6\npoisson = 0.3\n\
             [[bodies]]\nname = 'berg'\nmaterial = 'ice'\nshape = {{ kind = 'box', min = [0.6, 1.0], max = [2.6, 2.0] }}\n\
             [[loads]]\nname = 'sea'\n{load}\n[[loads]]\nname = 'drag'\nkind = 'damping'\nrate = 3\n\
             [[probes]]\nname = 'berg'\nquantities = ['centre']\n[time]\nend = 4\n[output]\npicture = false\n"
        );
        let history = history(&job, "berg");
        let draught = 1.8 - (history.last("centre_berg_y") - 0.5);
        println!("{load}: draught {draught} m, expected {} m", 917.0 / 1025.0);
        assert!((draught / (917.0 / 1025.0) - 1.0).abs() < 0.01, "{load}: {draught} m");
    }
}

/// The message for a wrong load names its key, the fault, and what would be right; by `check` and by `run`.
#[test]
fn wrong_loads_are_refused_with_their_key() {
    let cases = [
        ("kind = 'traction'\ntraction = [1]", "loads[0].traction", "expected 2"),
        (
            "kind = 'traction'\ntraction = [1, 0]\nbodies = ['bdy']",
            "loads[0].bodies[0]",
            "did you mean \"body\"",
        ),
        ("kind = 'traction'\ntraction = [1, 0]\nbodies = []", "loads[0].bodies", "at least one body"),
        ("kind = 'pressure'\npressure = 1\nfacing = [0, 0]", "loads[0].facing", "length 0"),
        ("kind = 'pressure'\npresure = 1", "loads[0].presure", "did you mean `pressure`"),
        ("kind = 'point_force'\nforce = [1, 0]\nshare = 'mass'", "loads[0].share", "expected"),
        (
            "kind = 'pressure'\npressure = 1\nshape = { kind = 'box', min = [-0.45, -0.05], max = [-0.35, 0.05] }",
            "loads[0]",
            "no surface for the load",
        ),
        (
            "kind = 'point_force'\nforce = [1, 0]\nshape = { kind = 'box', min = [0.3, 0.2], max = [0.4, 0.3] }",
            "loads[0]",
            "no particle for the load",
        ),
    ];
    for (load, key, words) in cases {
        for command in ["check", "run"] {
            let directory = tempfile::tempdir().expect("temporary directory");
            let path = directory.path().join("bad.toml");
            std::fs::write(&path, block("", &format!("[[loads]]\nname = 'l'\n{load}"))).expect("job");
            let output = agimp(directory.path()).arg(command).arg(&path).output().expect("starts");
            let message = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(2), "{command} {load}\n{message}");
            assert!(message.contains(key) && message.contains(words), "{load}: {key} {words}\n{message}");
            assert!(!directory.path().join("out").join("bad").exists() || command == "check", "{load}");
        }
    }
}

/// `agimp check` says what a load finds.
#[test]
fn check_says_what_loads_find() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("block.toml");
    std::fs::write(&path, block("", LOADS)).expect("job");
    let output = agimp(directory.path()).arg("check").arg(&path).output().expect("starts");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for words in [
        "on 16 particles, 200 mm of surface, force (8 N, 0 N) at 0 s",
        "on 16 particles, 200 mm of surface, force (0 N, -5 N) at 0 s",
        "on 64 particles, force (5 N, 0 N) at 20 ms",
    ] {
        assert!(text.contains(words), "{words}\n{text}");
    }
}
