//! What regrids cost, against the steps between them: through the library, so that single regrids are timed.
//!
//! `cargo run --release --example regrid_price -- CASE [PARTICLES [THREADS [REGRIDS]]]`, also under `mpirun`.
//! `turns JOB RESTART_FILE OTHER_JOB OTHER_RESTART_FILE [THREADS [TURNS]]` has two runs go on in turns, for the price of a
//! particle-step in either with its regrids.
use std::process::ExitCode;
use std::time::Instant;

use agimp::job::{AnyProblem, Problem, parse};
use agimp::particle::Chunk;
use agimp::run::{From, restart};
use agimp::setup;
use agimp::solver::state::regrid_timers::Part;
use agimp::solver::{Requests, Solver};
use partition::comm::{Comm, World};

/// Steps from one regrid to the next.
const EVERY: u64 = 20;
/// Steps of a turn: several regrids, as some change the tree and others do not.
const TURN: u64 = 4 * EVERY;
/// Cells of level 2 are 20 mm wide, with particles 10 mm apart.
const SPACING: f64 = 0.01;
const ROOT: f64 = 0.32;
/// Length of all steps, s.
const STEP: f64 = 1e-4;

/// A scene to measure.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Case {
    /// Sand at rest in leaves of two levels, with three criteria: nothing ever changes.
    Rest,
    /// Sand at rest of which half was refined at the start and is not any more, and that may not merge.
    Refused,
    /// A slab of fine leaves wanders through an elastic block: all regrids change the tree.
    Sweep,
}

impl Case {
    fn named(name: &str) -> Option<Self> {
        match name {
            "rest" => Some(Self::Rest),
            "refused" => Some(Self::Refused),
            "sweep" => Some(Self::Sweep),
            _ => None,
        }
    }

    /// The job for about so many particles.
    fn job(self, particles: f64) -> String {
        // A layer of fine leaves has eight times as many particles as it would have had.
        let more = match self {
            Self::Rest => 2.3,
            Self::Refused => 1.0 + 7.0 * 0.1,
            Self::Sweep => 1.0 + 7.0 * 0.15,
        };
        // From wall to wall, with room above.
        let roots = ((particles / more).cbrt() * SPACING / ROOT).round().max(1.0);
        let size = roots * ROOT;
        let depth = particles / more * SPACING.powi(3) / (size * size);
        let height = (depth / ROOT + 0.5).ceil() * ROOT;
        let slab = |low: f64, high: f64| {
            format!("{{ kind = \"box\", min = [-9, -9, {low}], max = [9, 9, {high}] }}")
        };
        let criteria = match self {
            Self::Rest => format!(
                "[[adaptivity.criteria]]\nkind = \"free_surface\"\nlevel = 2\n\
                 [[adaptivity.criteria]]\nkind = \"velocity_gradient\"\nlevel = 3\nrefine = 15\n\
                 [[adaptivity.criteria]]\nkind = \"plastic_strain_rate\"\nlevel = 3\nrefine = 8\n\
                 [[tree.regions]]\nlevel = 3\nshape = {}\n",
                slab(-1.0, 0.24 * depth)
            ),
            Self::Refused => format!(
                "[adaptivity.merge]\nstrain = 0\n[[adaptivity.criteria]]\nkind = \"region\"\nlevel = 3\nshape = {}\n\
                 motion = [{{ time = {}, translation = [0, 0, 0] }}, {{ time = {}, translation = [0, 0, 9] }}]\n",
                slab(-1.0, 0.09 * depth),
                1.5 * EVERY as f64 * STEP,
                1.6 * EVERY as f64 * STEP
            ),
            Self::Sweep => {
                // A leaf's edge of level 3 from one regrid to the next.
                let way = ROOT / 8.0;
                let speed = way / (EVERY as f64 * STEP);
                format!(
                    "[[adaptivity.criteria]]\nkind = \"region\"\nlevel = 3\nshape = {}\n\
                     motion = [{{ time = 0, translation = [0, 0, 0] }}, {{ time = 1, translation = [0, 0, {speed}] }}]\n",
                    slab(-0.5 * way, 0.15 * depth - 0.5 * way)
                )
            }
        };
        let material = match self {
            Self::Sweep => "model = \"neo_hookean\"\nyoung = 1e5",
            _ => "model = \"drucker_prager\"\nyoung = 1e5\nfriction_angle = 29.5\nmatch = \"plane_strain\"",
        };
        let base = if self == Self::Rest { 1 } else { 2 };
        let gravity = if self == Self::Refused { -9.81 } else { 0.0 };
        format!(
            "version = 1\ntitle = \"{self:?}\"\ndimension = 3\ngravity = [0, 0, {gravity}]\n\
             [boundaries]\n\
             x_min = {{ kind = \"slip\" }}\n\
             x_max = {{ kind = \"slip\" }}\n\
             y_min = {{ kind = \"slip\" }}\n\
             y_max = {{ kind = \"slip\" }}\n\
             z_min = {{ kind = \"slip\" }}\n\
             z_max = {{ kind = \"slip\" }}\n\
             [domain]\nsize = [{size}, {size}, {height}]\n\
             root_edge = {ROOT}\n[tree]\nbase_level = {base}\n[adaptivity]\nevery_steps = {EVERY}\nbuffer = 0\n{criteria}\
             [[materials]]\nname = \"sand\"\ndensity = 1600\npoisson = 0.2\n{material}\n\
             [[bodies]]\nname = \"bed\"\nmaterial = \"sand\"\n\
             shape = {{ kind = \"box\", min = [0, 0, 0], max = [{size}, {size}, {depth}] }}\n\
             [time]\nend = 1e3\ndt_max = {STEP}\n"
        )
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number =
        |place: usize, usual: usize| arguments.get(place).and_then(|n| n.parse().ok()).unwrap_or(usual);
    let world = World::init().expect("MPI starts");
    let mut solver = match arguments.first().map(String::as_str) {
        Some("from") if arguments.len() > 2 => {
            start_threads(number(3, 1));
            restarted(world.comm(), &arguments[1], &arguments[2])
        }
        Some("turns") if arguments.len() > 4 => {
            start_threads(number(5, 1));
            let pair = [1, 3].map(|job| restarted(world.comm(), &arguments[job], &arguments[job + 1]));
            take_turns(world.comm(), pair, number(6, 10));
            return ExitCode::SUCCESS;
        }
        Some(name) if Case::named(name).is_some() => {
            start_threads(number(2, 1));
            let text = Case::named(name).map(|case| case.job(number(1, 60_000) as f64)).unwrap_or_default();
            setup::solver(world.comm(), &problem(&text)).unwrap_or_else(|error| panic!("{error}"))
        }
        _ => {
            eprintln!(
                "usage: regrid_price rest|refused|sweep [PARTICLES [THREADS [REGRIDS]]] | \
                 from JOB RESTART_FILE [THREADS [REGRIDS]] | \
                 turns JOB RESTART_FILE OTHER_JOB OTHER_RESTART_FILE [THREADS [TURNS]]"
            );
            return ExitCode::from(2);
        }
    };
    measure(world.comm(), &mut solver, number(if arguments[0] == "from" { 4 } else { 3 }, 10));
    ExitCode::SUCCESS
}

fn start_threads(number: usize) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(number).use_current_thread();
    pool.build_global().expect("threads start once");
}

fn problem(text: &str) -> Problem<3> {
    match parse(text, "job.toml".as_ref()) {
        Ok(AnyProblem::Three(problem)) => problem,
        Ok(AnyProblem::Two(_)) => panic!("expected a job in space"),
        Err(faults) => panic!("{faults:?}\n{text}"),
    }
}

/// Collective. The state in a restart file of a job.
fn restarted(comm: &Comm, job: &str, file: &str) -> Solver<3> {
    let text = std::fs::read_to_string(job).unwrap_or_else(|error| panic!("{job}: {error}"));
    let state = restart::solver(comm, &problem(&text), &From::File(file.into()));
    state.unwrap_or_else(|error| panic!("{error}")).0
}

/// What a run took in a turn.
#[derive(Clone, Copy, Debug)]
struct Price {
    /// Mean number of particles.
    particles: f64,
    /// Nanoseconds per particle and step, regrids included.
    step: f64,
    /// What regrids have of that.
    regrid: f64,
}

impl Price {
    /// Collective. Goes on by a turn.
    fn of_turn(comm: &Comm, run: &mut Solver<3>) -> Self {
        let (start, mut regrids, mut work) = (Instant::now(), 0.0, 0);
        for _ in 0..TURN {
            run.step(f64::MAX, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
            work += run.chunks.iter().map(Chunk::len).sum::<usize>();
            let start = Instant::now();
            run.regrid().unwrap_or_else(|error| panic!("{error}"));
            regrids += start.elapsed().as_secs_f64();
        }
        let mut work = [work as u64];
        comm.sum_u64(&mut work);
        let per_step = 1e9 / work[0] as f64;
        Self {
            particles: work[0] as f64 / TURN as f64,
            step: start.elapsed().as_secs_f64() * per_step,
            regrid: regrids * per_step,
        }
    }
}

impl std::fmt::Display for Price {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.0} | {:.1} | {:.1}", self.particles, self.step, self.regrid)
    }
}

/// A row for each turn with the prices of both runs, then medians. The first turn, which fills caches and arenas, is left out.
fn take_turns(comm: &Comm, mut runs: [Solver<3>; 2], turns: usize) {
    let speaks = comm.rank() == 0;
    if speaks {
        println!("| particles | ns | regrid, ns | particles | ns | regrid, ns | ratio |");
    }
    let mut rows = Vec::new();
    for turn in 0..=turns {
        let prices = runs.each_mut().map(|run| Price::of_turn(comm, run));
        if turn > 0 {
            rows.push(prices);
        }
    }
    let show = |name: &str, [one, other]: [Price; 2], ratio: f64| {
        println!("{name}| {one} | {other} | {ratio:.3} |");
    };
    let median = |value: &dyn Fn(&[Price; 2]) -> f64| {
        let mut values: Vec<f64> = rows.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let ratio = |row: &[Price; 2]| row[0].step / row[1].step;
    let medians = [0, 1].map(|run| Price {
        particles: median(&|row| row[run].particles),
        step: median(&|row| row[run].step),
        regrid: median(&|row| row[run].regrid),
    });
    if speaks {
        rows.iter().for_each(|row| show("", *row, ratio(row)));
        show("medians ", medians, median(&ratio));
    }
}

/// A row for each regrid, and the mean.
fn measure(comm: &Comm, solver: &mut Solver<3>, regrids: usize) {
    let speaks = comm.rank() == 0;
    if speaks {
        let parts = Part::ALL.map(Part::name).join(" | ");
        println!("| particles | fine | step, ms | regrid, steps | {parts} |");
    }
    let mut shares = Vec::new();
    let every = solver.physics.adaptivity.as_ref().map_or(EVERY, |adaptivity| adaptivity.every);
    for _ in 0..regrids {
        let mut steps = Vec::new();
        // A restart file may be of any step.
        for _ in 0..every - solver.clock.step % every {
            let start = Instant::now();
            solver.step(f64::MAX, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
            steps.push(start.elapsed().as_secs_f64());
        }
        steps.sort_by(f64::total_cmp);
        let step = steps[steps.len() / 2];
        let before = solver.adaptation.timers.seconds();
        let start = Instant::now();
        solver.regrid().unwrap_or_else(|error| panic!("{error}"));
        let regrid = start.elapsed().as_secs_f64();
        let after = solver.adaptation.timers.seconds();
        let parts =
            before.iter().zip(&after).map(|(before, after)| format!("{:.4}", (after - before) / step));
        let parts = parts.collect::<Vec<String>>().join(" | ");
        shares.push(regrid / step);
        let particles = solver.particle_totals().count;
        let mut fine = [fine(solver)];
        comm.sum_u64(&mut fine);
        if speaks {
            println!("| {particles} | {} | {:.2} | {:.4} | {parts} |", fine[0], 1e3 * step, regrid / step);
        }
    }
    shares.sort_by(f64::total_cmp);
    if speaks {
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        println!("mean {mean:.4}, median {:.4}", shares[shares.len() / 2]);
    }
}

/// Own particles that are finer than their leaf.
fn fine(solver: &Solver<3>) -> u64 {
    use agimp::particle::chunk::Tag;
    let leaves = solver.forest.leaves().iter().zip(&solver.chunks);
    let each = leaves.map(|(leaf, chunk)| {
        chunk.tags().iter().filter(|&&tag| Tag::unpack(tag).level > leaf.level).count() as u64
    });
    each.sum()
}
