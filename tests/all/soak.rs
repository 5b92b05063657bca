//! Plain jobs, many of them: bodies of every model fall, spin, bounce and are squeezed, on lattices aligned
//! with the cells and not, on uniform and refined trees. All run through, keep every particle, and gain no
//! energy beyond a bound.

use std::fmt::Write as _;

use crate::common::relaunch::{ran_if_launched, relaunch};
use agimp::job::{AnyProblem, Problem, parse};
use agimp::setup;
use agimp::solver::diagnostics::totals::ParticleTotals;
use agimp::solver::{Requests, Solver};
use partition::comm::Comm;

/// Density of all bodies, kg/m³. With their Young's modulus of 1e5 Pa waves travel at 12 m/s.
const DENSITY: f64 = 1000.0;
/// Gravity where bodies fall or lie, m/s².
const GRAVITY: f64 = 9.81;
/// Edge of the coarsest cells, m.
const CELL: f64 = 1.0 / 32.0;

/// Models with parameters; the last two flow.
const MODELS: [(&str, &str); 5] = [
    ("neo_hookean", "poisson = 0.3"),
    ("fixed_corotated", "poisson = 0.3"),
    ("hencky", "poisson = 0.3"),
    ("von_mises", "poisson = 0.3\nyield_stress = 2e3\nhardening = 1e4"),
    ("drucker_prager", "poisson = 0.3\nfriction_angle = 30"),
];
const SHAPES: [&str; 4] = ["ball", "box", "ring", "rod"];
const MOTIONS: [&str; 4] = ["falls", "spins", "bounces", "is squeezed"];

/// One of the jobs.
#[derive(Clone, Copy, Debug)]
struct Case {
    dimension: usize,
    model: usize,
    shape: usize,
    motion: usize,
    /// Whether the body lies on the lines of the cells.
    aligned: bool,
    refined: bool,
    transfer: &'static str,
}

impl Case {
    fn name(&self) -> String {
        format!(
            "{}D {} of {} {}, {}, {} tree, {}",
            self.dimension,
            SHAPES[self.shape],
            MODELS[self.model].0,
            MOTIONS[self.motion],
            if self.aligned { "aligned" } else { "askew" },
            if self.refined { "refined" } else { "uniform" },
            self.transfer,
        )
    }

    /// Most energy that it may gain, as a share of what it has to give. The energy that particles hold in
    /// their affine velocities is not in the sums; a few particles that spin have much of it, and lose it to
    /// their velocities.
    fn most_gain(&self) -> f64 {
        if MOTIONS[self.motion] == "spins" { 0.25 } else { 0.05 }
    }

    /// Centre of the body, m.
    fn centre(&self) -> [f64; 3] {
        let up = if MOTIONS[self.motion] == "falls" { 8.0 } else { 6.0 } * CELL;
        let shift = if self.aligned { 0.0 } else { 0.37 * CELL };
        [12.0 * CELL + shift, up + 0.6 * shift, 12.0 * CELL + 0.3 * shift]
    }

    /// The job.
    fn text(&self) -> String {
        let d = self.dimension;
        let vector = |x: [f64; 3]| format!("{:?}", &x[..d]);
        let centre = self.centre();
        let about = |by: [f64; 3]| vector(std::array::from_fn(|a| centre[a] + by[a]));
        let extent = |half: [f64; 3]| {
            format!("{{ kind = 'box', min = {}, max = {} }}", about(half.map(|h| -h)), about(half))
        };
        let round = |radius: f64| {
            let kind = if d == 2 { "circle" } else { "sphere" };
            format!("{{ kind = '{kind}', centre = {}, radius = {radius:?} }}", about([0.0; 3]))
        };
        let shape = match SHAPES[self.shape] {
            "ball" => round(2.5 * CELL),
            "box" => extent([2.0 * CELL; 3]),
            "ring" => format!(
                "{{ kind = 'difference', from = {}, remove = [{}] }}",
                round(3.0 * CELL),
                round(1.5 * CELL)
            ),
            _ => extent([4.0 * CELL, CELL, CELL]),
        };
        // The top of the body.
        let top = centre[1] + [2.5, 2.0, 3.0, 1.0][self.shape] * CELL;
        let (gravity, motion) = match MOTIONS[self.motion] {
            "falls" => (GRAVITY, String::new()),
            "spins" => (0.0, format!("angular_velocity = {}", if d == 2 { "20" } else { "[3, 5, 20]" })),
            "bounces" => (0.0, format!("velocity = {}", vector([1.5, -3.0, 0.5]))),
            _ => (
                0.0,
                format!(
                    "[[colliders]]\nname = 'plate'\nshape = {{ kind = 'box', min = {}, max = {} }}\n\
                 motion = {{ kind = 'steady', velocity = {} }}\n\
                 [[colliders]]\nname = 'bed'\nshape = {{ kind = 'half_space', point = {}, normal = {} }}",
                    vector([-1.0, top, -1.0]),
                    vector([2.0, top + 3.0 * CELL, 2.0]),
                    vector([0.0, -0.2, 0.0]),
                    vector([0.0, 2.0 * centre[1] - top, 0.0]),
                    vector([0.0, 1.0, 0.0])
                ),
            ),
        };
        let mut text = format!(
            "version = 1\ndimension = {d}\ngravity = {}\n[domain]\nsize = {}\nroot_edge = 0.25\n[tree]\nbase_level = 1\n",
            vector([0.0, -gravity, 0.0]),
            vector([0.75; 3]),
        );
        if self.refined {
            // Finer leaves on one side of the body, and where it goes.
            let (min, max) = (vector([0.4, 0.0, 0.0]), vector([0.7, 0.2, 0.7]));
            let _ = writeln!(
                text,
                "regions = [{{ level = 2, shape = {{ kind = 'box', min = {min}, max = {max} }} }}]"
            );
        }
        let (model, parameters) = MODELS[self.model];
        let _ = write!(
            text,
            "[[materials]]\nname = 'm'\ndensity = {DENSITY:?}\nmodel = '{model}'\nyoung = 1e5\n{parameters}\n\
             [numerics]\ntransfer = '{}'\n[time]\nend = 1e3\n[output]\nevery = 1e3\n\
             [[bodies]]\nname = 'b'\nmaterial = 'm'\nshape = {shape}\n{motion}\n",
            self.transfer,
        );
        text
    }
}

/// All combinations in 2D, every fifth of them with another transfer, and some in 3D.
fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (model, shape) in (0..MODELS.len()).flat_map(|m| (0..SHAPES.len()).map(move |s| (m, s))) {
        for (motion, kind) in (0..MOTIONS.len()).flat_map(|m| (0..2).map(move |kind| (m, kind))) {
            let number = cases.len();
            // Each motion meets all four of these as models and shapes change.
            let (aligned, refined) = (kind == 0, (model + shape + motion + kind) % 2 == 1);
            let transfer = if number % 5 == 4 { ["tpic", "flip"][number / 5 % 2] } else { "apic" };
            cases.push(Case { dimension: 2, model, shape, motion, aligned, refined, transfer });
        }
    }
    for number in 0..8 {
        let (model, motion, aligned) = (number % MODELS.len(), number % MOTIONS.len(), number % 3 > 0);
        let (shape, refined) = (number % 2, number % 8 > 5);
        cases.push(Case { dimension: 3, model, shape, motion, aligned, refined, transfer: "apic" });
    }
    cases
}

/// Figures of a job.
#[derive(Debug, Default)]
struct Course {
    /// Most energy above that of the start and the work of the plate, J.
    gain: f64,
    /// Energy that the job has to give, J.
    scale: f64,
    /// A number for the bits of the last sums.
    bits: u64,
    particles: u64,
}

/// Collective. Does so many steps of a job.
fn run<const D: usize>(comm: &Comm, text: &str, steps: u64) -> Result<Course, String>
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let problem = parse(text, "soak.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}\n{text}"));
    let problem = Problem::<D>::try_from(problem).unwrap_or_else(|_| panic!("another dimension"));
    let mut solver: Solver<D> =
        setup::solver(comm, &problem).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let energy = |totals: &ParticleTotals| {
        totals.kinetic + totals.elastic + totals.gravitational + totals.plastic_work
    };
    let start = solver.particle_totals();
    let mut course = Course { particles: start.count, ..Course::default() };
    let mut work: f64 = 0.0;
    for step in 1..=steps {
        solver.step(1e3, Requests::default()).map_err(|error| format!("step {step}: {error}"))?;
        solver.regrid().map_err(|error| format!("step {step}: {error}"))?;
        if step % 10 != 0 {
            continue;
        }
        let totals = solver.particle_totals();
        // Those that split, whole or in halves, and those that merged are counted.
        let ledger = &solver.adaptation.ledger;
        let mut counts = [ledger.splits, ledger.halved, ledger.removed];
        comm.sum_u64(&mut counts);
        let [splits, halved, removed] = counts;
        let due = start.count + ((1 << D) - 1) * (splits - halved) + halved - removed;
        if totals.count != due {
            return Err(format!("step {step}: {} of {due} particles are left", totals.count));
        }
        if (totals.mass - start.mass).abs() > 1e-12 * start.mass {
            return Err(format!("step {step}: {} of {} kg are left", totals.mass, start.mass));
        }
        if let Some(plate) = solver.reactions().first() {
            let elapsed = solver.clock.time - solver.contacts.sums.since;
            // The plate moves against the force on it.
            work -= solver.contacts.states[0].rate.velocity[1] * plate.force[1] * elapsed;
            solver.forget_reactions();
        }
        let fallen = (start.gravitational - totals.gravitational).max(0.0);
        course.scale = course.scale.max(start.kinetic + fallen + work.abs());
        course.gain = course.gain.max(energy(&totals) - energy(&start) - work);
        if !energy(&totals).is_finite() {
            return Err(format!("step {step}: the energy is {}", energy(&totals)));
        }
        course.bits = [totals.kinetic, totals.elastic, totals.momentum[0], totals.plastic_work]
            .iter()
            .fold(course.bits, |bits, x| {
                (bits ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
            });
    }
    Ok(course)
}

/// Runs every so many of the cases. Fails with the names of those that did not run through or gained energy.
fn soak(comm: &Comm, every: usize, steps: u64) {
    let mut failed = Vec::new();
    for case in cases().iter().step_by(every) {
        // Plates would meet.
        let steps = if MOTIONS[case.motion] == "is squeezed" { steps.min(300) } else { steps };
        let course = match case.dimension {
            2 => run::<2>(comm, &case.text(), steps),
            _ => run::<3>(comm, &case.text(), steps / 3),
        };
        check(comm, &case.name(), course, case.most_gain(), &mut failed);
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// Prints the figures of a job, and lists it if it failed.
fn check(comm: &Comm, name: &str, course: Result<Course, String>, most_gain: f64, failed: &mut Vec<String>) {
    match course {
        Ok(course) if course.gain <= most_gain * course.scale => {
            if comm.rank() == 0 {
                let share = course.gain / course.scale;
                println!("same: {:x} {name}: {} particles, gain {share:.4}", course.bits, course.particles);
            }
        }
        other => failed.push(format!("{name}: {other:?}")),
    }
}

/// A rubber disk between a bed and a plate that comes down: its lattice lies on the lines of the cells, and
/// the symmetry of the motion keeps many box edges within round-off of them.
fn plates(comm: &Comm, radii: &[f64], models: &[&str]) {
    let mut failed = Vec::new();
    for (radius, model) in radii.iter().flat_map(|radius| models.iter().map(move |model| (radius, model))) {
        let text = format!(
            "version = 1\ndimension = 2\n[domain]\nmin = [-0.16, 0]\nsize = [0.32, 0.32]\nroot_edge = 0.16\n\
             [tree]\nbase_level = 3\n\
             [[materials]]\nname = 'rubber'\ndensity = 1000\nmodel = '{model}'\nyoung = 1e6\npoisson = 0.3\n\
             [[bodies]]\nname = 'disk'\nmaterial = 'rubber'\n\
             shape = {{ kind = 'circle', centre = [0, {}], radius = {radius} }}\n\
             [[colliders]]\nname = 'plate'\nshape = {{ kind = 'box', min = [-0.16, {}], max = [0.16, 0.32] }}\n\
             motion = {{ kind = 'steady', velocity = [0, -0.02] }}\n\
             [[colliders]]\nname = 'bed'\nshape = {{ kind = 'half_space', point = [0, 0.02], normal = [0, 1] }}\n\
             [time]\nend = 1e3\n[output]\nevery = 1e3\n",
            0.02 + radius,
            0.02 + 2.0 * radius,
        );
        let course = run::<2>(comm, &text, 370);
        check(comm, &format!("disk of {model}, radius {radius}"), course, 0.05, &mut failed);
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// Runs `body` on numbers of ranks; what it prints after `same: ` must not depend on that number.
fn on_ranks(test: &str, ranks: &[usize], body: impl Fn(&Comm)) {
    if ran_if_launched(body) {
        return;
    }
    let mut same: Option<Vec<String>> = None;
    for &n in ranks {
        let text = relaunch(module_path!(), test, n, 300);
        let now: Vec<String> = text.split("same: ").skip(1).map(first_word).collect();
        assert!(!now.is_empty(), "{test} ran nothing");
        let before = same.get_or_insert_with(|| now.clone());
        assert_eq!(*before, now, "{test}: {n} ranks against {}", ranks[0]);
        println!("{n} ranks: {text}");
    }
}

/// Up to the first space.
fn first_word(text: &str) -> String {
    text.split_whitespace().next().unwrap_or_default().to_string()
}

#[test]
fn plain_jobs_run_through() {
    on_ranks("plain_jobs_run_through", &[1], |comm| soak(comm, 1, 900));
}

#[test]
fn plain_jobs_do_the_same_on_two_ranks() {
    on_ranks("plain_jobs_do_the_same_on_two_ranks", &[1, 2], |comm| soak(comm, 13, 100));
}

#[test]
fn disks_between_plates_run_through() {
    let radii = [0.1, 0.09, 0.0975, 0.0825];
    on_ranks("disks_between_plates_run_through", &[1], |comm| {
        plates(comm, &radii, &["neo_hookean", "fixed_corotated", "hencky"]);
    });
}

/// A block of metal that hits slip walls with 0.3 of the speed of its waves, with a yield stress so low that
/// it splashes. Single fragments come as near to the walls as they like, and no energy comes from that.
#[test]
fn soft_plastic_impacts_are_stable() {
    on_ranks("soft_plastic_impacts_are_stable", &[1], |comm| {
        let mut failed = Vec::new();
        let jobs = [(1e3, [10.0, 6.0]), (1e5, [30.0, 18.0]), (1e3, [-12.0, 3.0]), (1e4, [0.0, -14.0])];
        for (yield_stress, velocity) in jobs {
            let text = format!(
                "version = 1\ndimension = 2\n[domain]\nsize = [1, 1]\nroot_edge = 1\n[tree]\nbase_level = 2\n\
                 [boundaries]\nx_min = {{ kind = 'slip' }}\nx_max = {{ kind = 'slip' }}\n\
                 y_min = {{ kind = 'slip' }}\ny_max = {{ kind = 'slip' }}\n\
                 [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'von_mises'\nyield_stress = {yield_stress:?}\n\
                 young = 1e6\npoisson = 0.3\n\
                 [[bodies]]\nname = 'b'\nmaterial = 'm'\n\
                 shape = {{ kind = 'box', min = [0.25, 0.25], max = [0.75, 0.75] }}\nvelocity = {velocity:?}\n\
                 [time]\nend = 1e3\n[output]\nevery = 1e3\n"
            );
            let name = format!("block with yield stress {yield_stress} Pa at {velocity:?} m/s");
            check(comm, &name, run::<2>(comm, &text, 600), 1e-3, &mut failed);
        }
        assert!(failed.is_empty(), "{failed:#?}");
    });
}

/// Gravity a hundred thousand times that of the Earth takes no particle out of the domain in the first step:
/// a disk falls its height in the time that the law of free fall says.
#[test]
fn great_gravity_is_resolved_from_the_first_step() {
    on_ranks("great_gravity_is_resolved_from_the_first_step", &[1], |comm| {
        let g = 1e6;
        let text = format!(
            "version = 1\ndimension = 2\ngravity = [0, -{g:?}]\n[domain]\nsize = [1, 1]\nroot_edge = 1\n[tree]\nbase_level = 2\n\
             [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e6\npoisson = 0.3\n\
             [[bodies]]\nname = 'b'\nmaterial = 'm'\nshape = {{ kind = 'circle', centre = [0.5, 0.7], radius = 0.1 }}\n\
             [time]\nend = 1e3\n[output]\nevery = 1e3\n"
        );
        let problem = parse(&text, "soak.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}"));
        let problem = Problem::<2>::try_from(problem).unwrap_or_else(|_| panic!("another dimension"));
        let mut solver: Solver<2> = setup::solver(comm, &problem).unwrap_or_else(|error| panic!("{error}"));
        let start = solver.particle_totals();
        let mut drop = 0.0;
        while drop < 0.5 {
            solver.step(1e3, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
            let totals = solver.particle_totals();
            drop = (start.gravitational - totals.gravitational) / (start.mass * g);
        }
        let time = (2.0 * drop / g).sqrt();
        let error = solver.clock.time / time - 1.0;
        println!("same: {error:e} error of the time of fall after {} steps", solver.clock.step);
        // First order in the step, of which there are few.
        assert!(error.abs() < 0.2 && solver.clock.step > 3, "{error}");
    });
}
