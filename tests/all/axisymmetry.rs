//! Bodies of revolution: jobs with `geometry = "axisymmetric"` against closed forms in cylindrical coordinates,
//! what they conserve, and the same bits on any ranks.
use std::f64::consts::{PI, TAU};
use std::path::Path;

use crate::common::history::History;
use crate::common::launch::{agimp, run, succeed};
use crate::common::restart;
use crate::common::scenarios::{Scenario, alone};
use agimp::job::{AnyProblem, Problem, parse};
use agimp::particle::chunk::Layout;
use agimp::setup;
use agimp::solver::{Requests, Solver};
use partition::Comm;

type L = Layout<2>;

pub(crate) const SCENARIOS: &[(&str, Scenario)] =
    &[("expansion_of_rings", expansion), ("translation_of_rings", translation)];

#[test]
fn uniform_expansion_is_exact() {
    alone("expansion_of_rings");
}

#[test]
fn translation_along_the_axis_is_exact() {
    alone("translation_of_rings");
}

/// A job with a rubber of c_p = 36.69 m/s in a domain of this size, m, and what `rest` adds.
pub(crate) fn job(size: [f64; 2], rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\ngeometry = 'axisymmetric'\n\
         [domain]\nsize = {size:?}\nroot_edge = 0.5\n\
         [boundaries]\nx_max = {{ kind = 'slip' }}\ny_min = {{ kind = 'slip' }}\ny_max = {{ kind = 'slip' }}\n\
         [[materials]]\nname = 'rubber'\ndensity = 1000\nmodel = 'hencky'\nyoung = 1e6\npoisson = 0.3\n\
         [output]\npicture = false\n{rest}\n"
    )
}

pub(crate) fn history(name: &str, text: &str) -> History {
    History::of_job(name, text, &[])
}

pub(crate) fn solver(comm: &Comm, text: &str) -> Solver<2> {
    let problem: Problem<2> = match parse(text, Path::new("job.toml")) {
        Ok(AnyProblem::Two(problem)) => problem,
        other => panic!("{other:?}"),
    };
    setup::solver(comm, &problem).unwrap_or_else(|error| panic!("{error}"))
}

/// A piston of 50 kg sticks to a column without Poisson's effect, whose foot is held: with the column's
/// stiffness `E π R² / L` and a third of its mass it oscillates as a mass on a spring. Masses and forces are
/// those of the whole circumference.
#[test]
fn a_piston_on_a_column_is_a_mass_on_a_spring() {
    let (mass, young, radius, length, density, speed) = (50.0, 1e6, 0.1, 0.4, 100.0, 0.05);
    let text = format!(
        "version = 1\ndimension = 2\ngeometry = 'axisymmetric'\n\
         [domain]\nsize = [0.2, 0.6]\nroot_edge = 0.1\n[boundaries]\ny_min = {{ kind = 'sticky' }}\n\
         [[materials]]\nname = 'rubber'\ndensity = {density}\nmodel = 'hencky'\nyoung = {young}\npoisson = 0\n\
         [[bodies]]\nname = 'column'\nmaterial = 'rubber'\n\
         shape = {{ kind = 'box', min = [0, 0], max = [{radius}, {length}] }}\n\
         [[colliders]]\nname = 'piston'\nshape = {{ kind = 'box', min = [-0.15, {length}], max = [0.15, 0.5] }}\n\
         contact = {{ kind = 'sticky' }}\nacts_on = 'nodes'\n\
         motion = {{ kind = 'free', mass = {mass}, along = ['y'], velocity = [0, -{speed}] }}\n\
         [time]\nend = 0.2\n[output]\npicture = false\n[history]\nevery_steps = 1\n"
    );
    let history = history("piston", &text);
    let stiffness = young * PI * radius * radius / length;
    let moving = mass + density * PI * radius * radius * length / 3.0;
    let pace = (stiffness / moving).sqrt();
    let (times, places) = (history.column("time"), history.column("position_piston_y"));
    let places: Vec<f64> = places.iter().map(|y| y - places[0]).collect();
    let lowest = places.iter().copied().fold(0.0, f64::min);
    assert!((lowest * pace / -speed - 1.0).abs() < 0.01, "{lowest} m for {} m", -speed / pace);
    let back =
        times.iter().zip(&places).find(|(t, y)| **t > 0.5 * PI / pace && **y >= 0.0).expect("comes back").0;
    assert!((back * pace / PI - 1.0).abs() < 0.01, "{back} s for {} s", PI / pace);
}

const REFINED: &str = "[tree]\n[[tree.regions]]\nlevel = 1\n\
    shape = { kind = 'box', min = [0, 0], max = [0.4, 0.4] }\n";

/// Identifier, place, velocity and stretch of a particle.
type Seen = (u64, [f64; 2], [f64; 2], [f64; 3]);

/// A cylinder expands evenly, v_r = a r and v_z = b z. In a step all positions grow by 1 + a Δt and 1 + b Δt, the
/// stretches as much, and no velocity changes: from the axis to the rim, across the jump between cells.
/// Velocities are those of centres of mass, `r + l² / (3 r)`.
fn expansion(comm: &Comm) {
    let (a, b) = (0.3, -0.2);
    for transfer in ["apic", "tpic"] {
        let body = format!(
            "{REFINED}[[bodies]]\nname = 'body'\nmaterial = 'rubber'\nvelocity = ['{a} * x', '{b} * y']\n\
             shape = {{ kind = 'box', min = [0, 0], max = [1, 1] }}\n\
             [numerics]\ntransfer = '{transfer}'\n[time]\nend = 1\ndt_max = 1e-3\n"
        );
        let mut solver = solver(comm, &job([1.0, 1.0], &body).replace("'slip'", "'outflow'"));
        let read = |solver: &Solver<2>| {
            let mut all: Vec<Seen> = Vec::new();
            for chunk in &solver.chunks {
                all.extend((0..chunk.len()).map(|p| {
                    let (velocity, stretch) =
                        (chunk.read(L::VELOCITY, p), chunk.read(L::LEFT_CAUCHY_GREEN, p));
                    (chunk.ids()[p], chunk.position(p), velocity, stretch)
                }));
            }
            all.sort_by_key(|particle| particle.0);
            all
        };
        let before = read(&solver);
        solver.step(1.0, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
        let dt = solver.clock.dt;
        let (mut looked, growth) = (0, [1.0 + a * dt, 1.0 + b * dt]);
        for ((_, x, v, _), (_, y, w, stretch)) in before.iter().zip(&read(&solver)) {
            // The faces of the domain are open, and their nodes lack the material beyond.
            if x[0] > 0.75 || x[1] < 0.25 || x[1] > 0.75 {
                continue;
            }
            looked += 1;
            for k in 0..2 {
                assert!((y[k] - x[k] * growth[k]).abs() < 4e-15, "{transfer}: {x:?} moves to {y:?}");
                assert!((w[k] - v[k]).abs() < 4e-15, "{transfer}: {v:?} becomes {w:?} at {x:?}");
            }
            let exact = [growth[0].powi(2), growth[1].powi(2), growth[0].powi(2)];
            for k in 0..3 {
                assert!((stretch[k] - exact[k]).abs() < 4e-14, "{transfer}: {stretch:?} at {x:?}");
            }
            let half = (y[0] / growth[0] - x[0]).abs();
            assert!(half < 1e-14 && v[0] > a * x[0]);
        }
        assert!(looked > 150, "{looked}");
    }
}

/// A cylinder that moves along the axis keeps its velocity, its shape and its momentum to round-off while it passes
/// from fine to coarse cells, with every transfer.
fn translation(comm: &Comm) {
    for transfer in ["transfer = 'apic'", "transfer = 'tpic'", "transfer = 'flip'", "transfer = 'xpic'"] {
        let body = format!(
            "{REFINED}[[bodies]]\nname = 'body'\nmaterial = 'rubber'\nvelocity = [0, 2]\n\
             shape = {{ kind = 'box', min = [0, 0.25], max = [0.6, 0.5] }}\n\
             [numerics]\n{transfer}\n[time]\nend = 1\n"
        );
        let mut solver = solver(comm, &job([1.0, 1.0], &body));
        let start = solver.particle_totals();
        while solver.clock.time < 0.1 {
            solver.step(1.0, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
        }
        let end = solver.particle_totals();
        assert_eq!(start.mass, end.mass);
        assert!((end.momentum[1] / start.momentum[1] - 1.0).abs() < 1e-13, "{transfer}: {end:?}");
        for chunk in &solver.chunks {
            for p in 0..chunk.len() {
                let [radial, axial]: [f64; 2] = chunk.read(L::VELOCITY, p);
                assert!(radial.abs() < 1e-12 && (axial - 2.0).abs() < 1e-12, "{transfer}: {radial} {axial}");
            }
        }
    }
}

/// Mean time between changes of sign of the momentum along the radius, times 2.
pub(crate) fn period(history: &History) -> f64 {
    let (time, momentum) = (history.column("time"), history.column("momentum_x"));
    let crossings: Vec<f64> = (1..time.len())
        .filter(|&i| momentum[i - 1] * momentum[i] < 0.0)
        .map(|i| time[i - 1] - momentum[i - 1] * (time[i] - time[i - 1]) / (momentum[i] - momentum[i - 1]))
        .collect();
    2.0 * (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64
}

/// Breathing of a cylinder between smooth plates, v ~ J1(k r), and of a sphere, v ~ j1(k r): the periods of the
/// closed forms (roots 2.125749 and 2.670215 of the equations of a free surface, k = root / R). Nothing moves the
/// sphere along the axis.
#[test]
fn a_cylinder_and_a_sphere_breathe_with_their_periods() {
    let cylinder = "[tree]\nbase_level = 1\n[[bodies]]\nname = 'body'\nmaterial = 'rubber'\n\
        shape = { kind = 'box', min = [0, 0], max = [1, 0.5] }\n\
        velocity = ['0.1 * (K*x - (K*x)^3/8 + (K*x)^5/192 - (K*x)^7/9216 + (K*x)^9/737280)', 0]\n\
        [time]\nend = 0.24\n[history]\nevery_steps = 1\n";
    let wave = 36.689_969_285_267_14;
    let k = 2.125_748_927_810_746;
    let found = period(&history("cylinder", &job([1.5, 0.5], &cylinder.replace('K', &format!("{k}")))));
    let exact = TAU / (k * wave);
    println!("cylinder: {found} s, exact {exact} s, {:+.2e}", found / exact - 1.0);
    assert!((found / exact - 1.0).abs() < 1e-3);

    let k: f64 = 2.670_214_733_237_052;
    let square = format!("({} * (x^2 + (y - 1.5)^2))", k * k);
    let j1 = format!("0.1 * (1 - {square}/10 + {square}^2/280 - {square}^3/15120)");
    let sphere = format!(
        "[tree]\nbase_level = 1\n[[bodies]]\nname = 'body'\nmaterial = 'rubber'\nsampling = 'fitted'\n\
         shape = {{ kind = 'circle', centre = [0, 1.5], radius = 1 }}\n\
         velocity = ['x * {j1}', '(y - 1.5) * {j1}']\n[time]\nend = 0.2\n[history]\nevery_steps = 1\n"
    );
    let history = history("sphere", &job([1.5, 3.0], &sphere));
    let (found, exact) = (period(&history), TAU / (k * wave));
    println!("sphere: {found} s, exact {exact} s, {:+.2e}", found / exact - 1.0);
    assert!((found / exact - 1.0).abs() < 1e-3);
    // The whole sphere, not a radian of it.
    let mass = 4.0 / 3.0 * PI * 1000.0;
    assert!((history.last("mass") / mass - 1.0).abs() < 1e-9 && history.last("grid_mass") > 0.0);
    let most = history.column("momentum_y").iter().fold(0.0_f64, |most, p| most.max(p.abs()));
    assert!(most < 1e-11 && history.last("angular_momentum_z") == 0.0, "{most}");
}

/// A thick cylinder under inner pressure (Lamé), and one that rotates, in plane strain: the displacements of the
/// closed forms. The force of the pressure is that on the whole circumference.
#[test]
fn cylinders_under_pressure_and_in_rotation_have_the_displacements_of_lame() {
    let wall = "[[bodies]]\nname = 'wall'\nmaterial = 'rubber'\nshape = { kind = 'box', min = [1, 0], max = [2, 0.5] }\n\
        [[loads]]\nname = 'inner'\nkind = 'pressure'\npressure = 750\nfacing = [-1, 0]\n\
        [equilibrium]\nspeed = 1e-4\nacceleration = 1e-2\n[time]\nend = 9\n[history]\nevery_steps = 10\n";
    let history = history("wall", &job([2.5, 0.5], &format!("[tree]\nbase_level = 1\n{wall}")));
    let (pressure, height, nu, young) = (750.0, 0.5, 0.3, 1e6);
    let exact = (1.0 + nu) / young * pressure / 3.0 * ((1.0 - 2.0 * nu) + 4.0);
    // The work of the pressure, as the wall has moved by `found`.
    let found = history.last("work_inner") / (pressure * TAU * height);
    println!("Lamé: {found} m, exact {exact} m");
    assert!((found / exact - 1.0).abs() < 0.03);
    let force = history.last("load_inner_x") / (pressure * TAU * height);
    assert!((force - 1.0 - exact).abs() < 1e-3, "{force}");

    let disk = "[[bodies]]\nname = 'disk'\nmaterial = 'rubber'\nshape = { kind = 'box', min = [0, 0], max = [1, 0.5] }\n\
        [[loads]]\nname = 'rotation'\nkind = 'body_force'\nacceleration = ['0.4 * X', 0]\n\
        [[tracks]]\nname = 'rim'\npoint = [0.984375, 0.25]\nquantities = ['centre']\n\
        [[tracks]]\nname = 'axis'\npoint = [0.015625, 0.25]\nquantities = ['stress']\n\
        [equilibrium]\nspeed = 1e-5\nacceleration = 1e-3\n[time]\nend = 9\n[history]\nevery_steps = 10\n";
    let history = self::history("disk", &job([1.5, 0.5], &format!("[tree]\nbase_level = 1\n{disk}")));
    let (r, spin) = (0.984_375, 1000.0 * 0.4);
    let factor = (1.0 + nu) * (1.0 - 2.0 * nu) / (8.0 * (1.0 - nu) * young) * spin;
    let exact = factor * r * ((3.0 - 2.0 * nu) - r * r);
    let found = history.last("centre_rim_x") - r;
    println!("rotation: {found} m, exact {exact} m");
    assert!((found / exact - 1.0).abs() < 0.01);
    let centre = spin * (3.0 - 2.0 * nu) / (8.0 * (1.0 - nu));
    for component in ["xx", "zz"] {
        let found = history.last(&format!("stress_axis_{component}"));
        assert!((found / centre - 1.0).abs() < 0.01, "{component}: {found} Pa, exact {centre} Pa");
    }
}

/// Level ground under its weight with a horizontal stress of K0 times the vertical one is at rest to round-off,
/// at the axis too.
#[test]
fn level_ground_stays_at_rest() {
    // What flows has square boxes, which tile the ground.
    let ground = "gravity = [0, -9.81]\n[[materials]]\nname = 'soil'\ndensity = 1800\nmodel = 'mohr_coulomb'\n\
        young = 1e6\npoisson = 0.3\nfriction_angle = 30\ncohesion = 100\n\
        [[bodies]]\nname = 'ground'\nmaterial = 'soil'\n\
        shape = { kind = 'box', min = [0, 0], max = [1, 0.75] }\nstress = { kind = 'geostatic', k0 = 0.5 }\n\
        [time]\nend = 0.05\n[history]\nevery_steps = 5\n";
    let (gravity, rest) = ground.split_once('\n').expect("two parts");
    let text = job([1.0, 1.0], rest).replace("dimension = 2\n", &format!("dimension = 2\n{gravity}\n"));
    let history = history("ground", &text);
    let most = history.column("kinetic_energy").iter().fold(0.0_f64, |most, e| most.max(*e));
    println!("kinetic energy {most:e} J, elastic {} J", history.last("elastic_energy"));
    assert!(most < 1e-18 * history.last("elastic_energy"), "{most}");
}

/// A rubber in a smooth tube under a smooth piston, both at particles: the forces of an oedometer on the whole
/// area and circumference. Cohesion of the tube bears its strength times the circumference at its wall.
#[test]
fn a_tube_and_a_piston_act_on_the_whole_circumference() {
    let tube = |law: &str| {
        format!(
            "[tree]\nbase_level = 3\n[[colliders]]\nname = 'tube'\nacts_on = 'particles'\ncontact = {{ {law} }}\n\
             shape = {{ kind = 'box', min = [0.25, -0.1], max = [0.45, 0.6] }}\n"
        )
    };
    let (young, nu, radius, stretch) = (1e6, 0.3, 0.25, 0.98_f64);
    let pressed = "[[bodies]]\nname = 'block'\nmaterial = 'rubber'\n\
        shape = { kind = 'box', min = [0, 0], max = [0.25, 0.25] }\n\
        [[colliders]]\nname = 'piston'\nacts_on = 'particles'\ncontact = { kind = 'slip' }\n\
        shape = { kind = 'box', min = [-0.3, 0.25], max = [0.3, 0.45] }\n\
        motion = { kind = 'table', rows = [{ time = 0 }, { time = 0.1, translation = [0, -0.005] }, { time = 1, translation = [0, -0.005] }] }\n\
        [[loads]]\nname = 'drag'\nkind = 'damping'\nrate = 60\nshape = { kind = 'box', min = [0, 0], max = [0.5, 0.5] }\n\
        [time]\nend = 0.2\n[history]\nevery_steps = 50\n";
    let history = history("pressed", &job([0.5, 0.5], &(tube("kind = 'slip'") + pressed)));
    // Cauchy stress of the law τ = λ tr ε + 2 μ ε.
    let lateral = young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)) * -stretch.ln() / stretch;
    let axial = lateral * (1.0 - nu) / nu;
    let piston = history.last("force_piston_y") / (axial * PI * radius * radius);
    let tube_force = history.last("force_tube_x") / (lateral * TAU * radius * radius * stretch);
    println!("piston {piston}, tube {tube_force} of the closed form");
    assert!((piston - 1.0).abs() < 0.03 && (tube_force - 1.0).abs() < 0.03);

    let moves = "[[bodies]]\nname = 'block'\nmaterial = 'rubber'\nvelocity = [0, 1]\n\
        shape = { kind = 'box', min = [0, 0.125], max = [0.25, 0.375] }\n\
        [time]\nend = 5e-3\n[history]\nevery_steps = 1\n";
    let cohesive = tube("kind = 'separating', cohesion = 1000");
    let history = self::history("stuck", &job([0.5, 0.5], &(cohesive + moves)));
    let force = history.last("force_tube_y") / (1000.0 * TAU * radius * 0.25);
    println!("cohesion {force} of the closed form");
    assert!((force - 1.0).abs() < 2e-3);
}

/// Sand that falls round a punch at nodes and a ring at particles, with F-bar, on two levels: the same bits on
/// any ranks and across a restart.
#[test]
fn results_are_the_same_on_any_ranks_and_across_a_restart() {
    let text = "version = 1\ndimension = 2\ngeometry = 'axisymmetric'\ngravity = [0, -9.81]\n\
        [domain]\nsize = [2, 1]\nroot_edge = 0.5\n\
        [boundaries]\nx_max = { kind = 'slip' }\ny_min = { kind = 'separating', friction = 0.5 }\ny_max = { kind = 'slip' }\n\
        [tree]\n[[tree.regions]]\nlevel = 1\nshape = { kind = 'box', min = [0, 0], max = [0.9, 0.4] }\n\
        [[materials]]\nname = 'sand'\ndensity = 1600\nmodel = 'mohr_coulomb'\nyoung = 1e6\npoisson = 0.3\nfriction_angle = 30\n\
        [[bodies]]\nname = 'column'\nmaterial = 'sand'\nvelocity = ['0.1 * x', 0]\n\
        shape = { kind = 'box', min = [0, 0], max = [0.75, 0.75] }\n\
        [[colliders]]\nname = 'punch'\nshape = { kind = 'box', min = [-1, 0.75], max = [0.2, 0.95] }\n\
        contact = { kind = 'separating', friction = 0.3 }\nmotion = { kind = 'steady', velocity = [0, -0.5] }\n\
        [[colliders]]\nname = 'ring'\nshape = { kind = 'box', min = [0.4, 0.76], max = [0.6, 0.95] }\nacts_on = 'particles'\n\
        contact = { kind = 'separating', friction = 0.3 }\nmotion = { kind = 'steady', velocity = [0, -0.6] }\n\
        [[loads]]\nname = 'rim'\nkind = 'pressure'\npressure = 200\nfacing = [1, 0]\n\
        [numerics]\nf_bar = true\n[time]\nend = 0.15\n[output]\nevery = 0.05\npicture = false\n\
        [checkpoint]\nevery_steps = 20\nkeep = 9\n[history]\nevery_steps = 5\nface_forces = true\n";
    let mut looks = 0;
    restart::assert_same_on_any_ranks(text, "column", |directory, _| {
        looks += 1;
        let history = History::read(directory, "column");
        let mass = 1600.0 * PI * 0.75 * 0.75 * 0.75;
        assert!((history.last("mass") / mass - 1.0).abs() < 1e-12, "{}", history.last("mass"));
    });
    assert_eq!(looks, 3);
}

/// Pictures, particles and surfaces in space: copies of each particle stand around the axis at its radius with the
/// velocity of that place, a picture shows the body, and the surface encloses its volume. Jobs in the plane are
/// refused.
#[test]
fn bodies_are_revolved_for_other_programs_and_pictures() {
    let text = job(
        [0.5, 1.0],
        "[tree]\nbase_level = 2\n[[bodies]]\nname = 'cylinder'\nmaterial = 'rubber'\nvelocity = ['-2 * x', 0.5]\n\
         shape = { kind = 'box', min = [0, 0.25], max = [0.25, 0.75] }\n\
         [[colliders]]\nname = 'plate'\nshape = { kind = 'box', min = [-0.4, 0], max = [0.4, 0.1] }\n[time]\nend = 1e-6\n",
    );
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = |name: &str| directory.path().join(name);
    std::fs::write(path("rod.toml"), &text).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path("rod.toml"), &["--quiet"]));
    let output = "out/rod/rod_000000.hdf";
    let exported =
        |arguments: &[&str]| succeed(agimp(directory.path()).arg("export").arg(output).args(arguments));
    exported(&["--csv", "--fields", "id,velocity", "--out", "plane.csv"]);
    exported(&["--csv", "--fields", "id,velocity", "--revolve", "--out", "space.csv"]);
    let rows = |name: &str| -> Vec<Vec<f64>> {
        let text = std::fs::read_to_string(path(name)).expect("a table");
        let row = |line: &str| line.split(',').map(|value| value.parse().expect("a number")).collect();
        text.lines().skip(1).map(row).collect()
    };
    let (plane, space) = (rows("plane.csv"), rows("space.csv"));
    assert!(space.len() > 20 * plane.len(), "{} of {}", space.len(), plane.len());
    // x, y, z, radius, id, velocity.
    for row in &space {
        let own = plane.iter().find(|own| own[4] == row[4]).expect("its particle");
        let [x, y, z] = [row[0], row[1], row[2]];
        assert!((x.hypot(y) - own[0]).abs() < 1e-14 && z == own[1] && row[3] == own[3], "{row:?} {own:?}");
        // Velocity belongs to the centre of mass, further out than that of the box.
        assert!(own[5] < -2.0 * own[0], "{own:?}");
        for (v, exact) in row[5..8].iter().zip([own[5] * x / own[0], own[5] * y / own[0], own[6]]) {
            assert!((v - exact).abs() < 1e-14, "{row:?} {own:?}");
        }
    }
    let [mean_x, mean_y] = [0, 1].map(|a| space.iter().map(|row| row[a]).sum::<f64>() / space.len() as f64);
    assert!(mean_x.abs() < 1e-12 && mean_y.abs() < 1e-12, "all around");
    exported(&["--csv", "--fields", "id", "--revolve=open", "--out", "open.csv"]);
    assert!(rows("open.csv").iter().all(|row| row[0] < 0.0 || row[1] > 0.0), "a quarter is open");

    exported(&["--surface", "obj", "--out", "rod.surface.obj"]);
    let mesh = std::fs::read_to_string(path("rod.surface.obj")).expect("a surface");
    let of = |kind: &str| {
        mesh.lines().filter_map(|line| line.strip_prefix(kind)).map(str::to_owned).collect::<Vec<_>>()
    };
    let corners: Vec<[f64; 3]> = of("v ")
        .iter()
        .map(|line| {
            let numbers: Vec<f64> = line.split(' ').map(|number| number.parse().expect("a number")).collect();
            [numbers[0], numbers[1], numbers[2]]
        })
        .collect();
    let volume: f64 = of("f ")
        .iter()
        .map(|line| {
            let corner = |text: &str| {
                corners[text.split('/').next().expect("a corner").parse::<usize>().expect("a number") - 1]
            };
            let [a, b, c]: [[f64; 3]; 3] =
                std::array::from_fn(|i| corner(line.split(' ').nth(i).expect("three")));
            (a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0]))
                / 6.0
        })
        .sum();
    let exact = PI * 0.25 * 0.25 * 0.5;
    assert!((volume / exact - 1.0).abs() < 0.05, "{volume} m³ for {exact}");

    let picture = |arguments: &[&str]| {
        let mut command = agimp(directory.path());
        command.arg("plot").args([output, "--colour", "speed"]).args(arguments);
        command
    };
    succeed(&mut picture(&["--out", "plane.png"]));
    succeed(&mut picture(&["--revolve", "--vectors", "velocity", "--out", "space.png"]));
    let [plane, space] = ["plane.png", "space.png"].map(|name| std::fs::read(path(name)).expect("a picture"));
    assert!(plane != space && space.len() > 10_000);
    let refused = picture(&["--revolve", "--tree"]).output().expect("starts");
    assert_eq!(refused.status.code(), Some(2));
    std::fs::write(path("plane.toml"), text.replace("geometry = 'axisymmetric'\n", "")).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path("plane.toml"), &["--quiet"]));
    for arguments in [&["plot", "--revolve"][..], &["export", "--vtp", "--revolve"]] {
        let mut command = agimp(directory.path());
        let output = command.args(arguments).arg("out/plane/plane_000000.hdf").output().expect("starts");
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(told.contains("found no bodies of revolution"), "{told}");
    }
}
