//! Cost of a job, estimated without running it.
//!
//! | file | what it holds |
//! |---|---|
//! | this | particles, steps, memory and files of a job |
//! | `count`, `levels` | leaves and particles of its tree, counted without building it; the same by level |
//! | [`pace`], `coarser` | cost of steps on this machine; that of a job that is too large to be tried |
//! | `explicit` | the tree leaf by leaf: reference of the tests |
use self::count::Tally;
pub use self::levels::LevelCount;
use self::pace::Pace;
use super::particles::seed::{SeedError, check_finite, greatest_speed};
use crate::job::problem::{Body, Field, MaterialSetup, Problem};
use crate::particle::Layout;
use crate::quantity::Quantity;
use crate::setup::Size;
use std::path::PathBuf;

mod coarser;
mod count;
mod levels;
pub mod pace;

/// The size and the cost of a job cannot be estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EstimateError {
    /// A particle cannot be made.
    #[error(transparent)]
    Seed(#[from] SeedError),
    /// The steps cannot be counted.
    #[error(
        "{}:1:1: time: found an initial time step of {time_step:e} s and an end of {end:e} s; expected a countable number of steps: check root_edge, young, density, velocities and cfl",
        path.display()
    )]
    Steps {
        /// The job file.
        path: PathBuf,
        /// First time step, s.
        time_step: f64,
        /// End of the run, s.
        end: f64,
    },
}

/// Size and cost of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Particles of each body, in the order of the job, those of sources by the end of the run; on the tree
    /// that the job gives, unless that of [`Estimate::for_tree`] is another, since criteria of dynamic
    /// refinement need the particles themselves.
    pub particles: Vec<u64>,
    /// Leaves of that tree by level, from level 0 to the finest one.
    pub levels: Vec<LevelCount>,
    /// Whether there are more particles and leaves than that: the tree is too large to be counted to the end.
    pub is_cut: bool,
    /// First time step, s; with dynamic refinement for leaves of the finest level that a criterion wants.
    pub time_step: f64,
    /// Steps to the end if the first time step were kept.
    pub steps: f64,
    /// Particles that one core advances by a step in a second; roughly.
    pub particle_steps_per_second: f64,
    /// Cost of steps on this machine, if it was measured.
    pub pace: Option<Pace>,
    /// Bytes of memory of all ranks together, without the program itself; about.
    pub memory: f64,
    /// Bytes of one output file with its tree; about.
    pub output_bytes: f64,
    /// Number of outputs, the first and the last one included.
    pub outputs: u64,
    /// Bytes of one checkpoint; about.
    pub checkpoint_bytes: f64,
}

/// Particles that one core advances by a step in a second, in 2D and in 3D: two thirds of what
/// docs/performance.md has, for machines that are slower and cores that share their memory.
const PARTICLE_STEPS_PER_SECOND: [f64; 2] = [12e6, 5.5e6];

/// Time of start, picture and report of a run, s; of an output beside that for its bytes, s; and bytes that
/// reach the disk in a second.
const START_AND_END: f64 = 0.4;
const OUTPUT: f64 = 0.02;
const BYTES_PER_SECOND: f64 = 3e8;

/// Bytes that each rank takes with next to no particles: the program itself and its libraries.
pub const PROGRAM: f64 = 37e6;

impl Estimate {
    /// Bytes of memory of each of some ranks that share the work evenly; about.
    pub fn memory_per_rank(&self, ranks: u32) -> f64 {
        PROGRAM + self.memory / f64::from(ranks)
    }

    /// Seconds of wall time if particles and time step stay what they are at the start: by what was measured
    /// on all cores of this machine, or roughly for some cores.
    pub fn wall_time(&self, cores: u32) -> f64 {
        let work = self.total_particles() as f64 * self.steps;
        let steps = match self.pace {
            Some(pace) => work * pace.seconds_per_particle,
            None => work / (self.particle_steps_per_second * f64::from(cores)),
        };
        START_AND_END + steps + self.outputs as f64 * (OUTPUT + self.output_bytes / BYTES_PER_SECOND)
    }

    /// Takes over what was measured. Steps get no longer by it, since cells may become finer than they are at
    /// the start.
    pub fn with_pace(mut self, end: f64, pace: Option<Pace>) -> Self {
        self.pace = pace;
        if let Some(pace) = pace.filter(|pace| pace.time_step < self.time_step) {
            self.time_step = pace.time_step;
            self.steps = (end / pace.time_step).ceil();
        }
        self
    }

    /// Takes over the memory of all ranks (bytes) of a tree that is too large to be made; the work grows like
    /// it.
    pub fn extrapolated(mut self, memory: f64) -> Self {
        let growth = (memory / self.memory.max(1.0)).max(1.0);
        self.particle_steps_per_second /= growth;
        self.memory *= growth;
        self
    }

    /// Particles of all bodies.
    pub fn total_particles(&self) -> u64 {
        self.particles.iter().fold(0, |sum, count| sum.saturating_add(*count))
    }

    /// The estimate for a tree with these particles and leaves, which criteria have refined.
    pub fn for_tree<const D: usize>(
        mut self,
        problem: &Problem<D>,
        particles: Vec<u64>,
        levels: Vec<LevelCount>,
    ) -> Self {
        (self.particles, self.levels, self.is_cut) = (particles, levels, false);
        add_bytes(problem, &mut self);
        self
    }

    /// Leaves of all levels.
    pub fn total_leaves(&self) -> u64 {
        self.levels.iter().fold(0, |sum, level| sum.saturating_add(level.leaves))
    }
}

/// Not collective. Counts the leaves of the tree and the points that bodies have in them, with a bound on the
/// work: see [`Estimate::is_cut`].
///
/// # Errors
/// Two bodies share a lattice point, or the steps cannot be counted.
pub fn estimate<const D: usize>(problem: &Problem<D>) -> Result<Estimate, EstimateError> {
    let counted = steps(problem);
    let materials: Vec<_> = problem.materials.iter().map(|m| m.build()).collect();
    let probed = super::initial_stress::probe(problem, &materials);
    // First, since such numbers invalidate the other checks.
    check_finite(problem)?;
    let (time_step, steps) = counted?;
    probed?;
    let Tally { particles, levels, is_cut } = count::count(problem)?;
    let outputs =
        problem.output.every.map_or(2, |every| (problem.time.end / every - 1e-9).floor() as u64 + 2);
    let mut estimate = Estimate {
        particles,
        levels,
        is_cut,
        time_step,
        steps,
        particle_steps_per_second: 0.0,
        pace: None,
        memory: 0.0,
        output_bytes: 0.0,
        outputs,
        checkpoint_bytes: 0.0,
    };
    add_bytes(problem, &mut estimate);
    Ok(estimate)
}

/// Not collective. The first time step (s) and the number of such steps to the end, on leaves of the finest
/// level that the job's regions and criteria ask for: criteria may make any leaf as fine as they want, which
/// shortens the step of all.
///
/// # Errors
/// One of them is not a finite number above 0.
pub fn steps<const D: usize>(problem: &Problem<D>) -> Result<(f64, f64), EstimateError> {
    let time_step = time_step(problem, problem.finest_level_refined());
    check_finite(problem)?;
    let steps = (problem.time.end / time_step).ceil();
    if time_step.is_finite() && time_step > 0.0 && steps.is_finite() {
        return Ok((time_step, steps));
    }
    Err(EstimateError::Steps { path: problem.path.clone(), time_step, end: problem.time.end })
}

/// Share of the greatest difference of velocities of two bodies that lies over a cell of the shock between
/// them, once they meet: it is some cells wide.
const JUMP: f64 = 1.0 / 3.0;

/// Greatest speed of a body, or difference of the velocities of two where these do not depend on the place,
/// or speed at which gas moves from a greater pressure to a lesser (in the limit of small differences), m/s.
fn closing_speed<const D: usize>(problem: &Problem<D>) -> f64 {
    let greatest = problem.bodies.iter().map(|body| greatest_speed(problem, body));
    let moves_whole = |body: &&Body<D>| !body.velocity.iter().any(Quantity::depends_on_place);
    let velocity = |body: &Body<D>| body.velocity.each_ref().map(|v| v.at(problem.place(&[0.0; D]), 0.0));
    let all: Vec<[f64; D]> = problem.bodies.iter().filter(moves_whole).map(velocity).collect();
    let apart = |a: &[f64; D], b: &[f64; D]| {
        (0..D).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum::<f64>().sqrt()
    };
    let pairs = all.iter().flat_map(|a| all.iter().map(move |b| apart(a, b)));
    let materials: Vec<_> = problem.bodies.iter().map(|b| problem.materials[b.material].build()).collect();
    let least = materials.iter().map(|material| material.rest_pressure()).fold(f64::INFINITY, f64::min);
    let bursts = materials
        .iter()
        .map(|material| (material.rest_pressure() - least) / (material.density() * material.wave_speed()));
    greatest.chain(pairs).chain(bursts).fold(0.0, f64::max)
}

/// Courant condition over the fastest wave and the fastest particle at the start, on the finest cells. With
/// artificial viscosity waves count as it damps them while bodies meet.
fn time_step<const D: usize>(problem: &Problem<D>, finest: u8) -> f64 {
    if let Some(load_steps) = problem.quasi_static {
        return load_steps.step;
    }
    let jump = problem.viscosity.map_or(0.0, |_| JUMP * closing_speed(problem));
    let wave = problem
        .bodies
        .iter()
        .map(|body| &problem.materials[body.material])
        .map(MaterialSetup::build)
        .map(|material| {
            let wave = material.wave_speed();
            let damped = problem.viscosity.map_or(wave, |viscosity| viscosity.bound(wave, jump));
            damped + material.viscous_speed(problem.cell_edge(finest))
        })
        .fold(0.0, f64::max);
    let norm = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let speed = problem
        .bodies
        .iter()
        .map(|body| {
            let bounds = body.shape.bounds();
            let reach = if bounds.half_diagonal().is_finite() { bounds.half_diagonal() } else { 0.0 };
            greatest_speed(problem, body) + norm(&body.angular_velocity) * reach
        })
        .fold(0.0, f64::max);
    let extent = problem.size();
    let colliders = problem.colliders.iter();
    let speed = colliders.fold(speed, |speed, collider| {
        // A collider bounds the step by its own speed, not on top of the wave's.
        speed.max(collider.greatest_speed(&collider.state_at(0.0), &extent, 0.0) - wave)
    });
    let courant = problem.time.cfl * problem.cell_edge(finest) / (wave + speed);
    problem.time.dt_max.map_or(courant, |longest| courant.min(longest)).min(problem.time.end)
}

/// Bytes of the state of a particle: its reals, identifier and tag.
const fn state_bytes<const D: usize>() -> f64 {
    8.0 * (Layout::<D>::REALS + 2) as f64
}

/// Memory of particles and leaves of all ranks together, bytes; approximate.
///
/// Measured (docs/performance.md, "Memory"), in bytes for each row of an arena: leaves have their part of the
/// plan, filled ones node fields, arenas and half a page of particles; where levels meet there are more
/// blocks and bins, and moments of constrained nodes.
fn memory<const D: usize>(particles: u64, levels: &[LevelCount]) -> f64 {
    let rows = 7_f64.powi(D as i32);
    let levels = levels.iter().map(|level| {
        1.6 * level.leaves as f64 + 52.0 * level.filled as f64 + 105.0 * level.filled_jumps as f64
    });
    particles as f64 * state_bytes::<D>() + rows * levels.sum::<f64>()
}

/// Bytes of memory of all ranks that no tree of the job without criteria exceeds: leaves and particles of the
/// finest level in the whole domain.
pub fn greatest_memory<const D: usize>(problem: &Problem<D>) -> f64 {
    let edge = problem.leaf_edge(problem.finest_level());
    let leaves = problem.size().iter().map(|size| (size / edge).ceil()).product::<f64>();
    let given = problem.bodies.iter().filter_map(|body| body.given.as_ref()).map(|given| given.chunk().len());
    let along = problem.bodies.iter().map(|body| 4.0 * body.particles_per_cell).fold(0.0, f64::max);
    let particles = leaves * along.powi(D as i32) + given.sum::<usize>() as f64;
    let [leaves, particles] = [leaves, particles].map(|count| count.min(1e18) as u64);
    memory::<D>(particles, &[LevelCount { leaves, filled: leaves, filled_jumps: leaves, particles }])
}

/// Bytes of memory of a tree of some size if half of its leaves with particles lie where levels meet; about.
pub fn tree_memory<const D: usize>([particles, leaves, filled]: Size) -> f64 {
    memory::<D>(particles, &[LevelCount { leaves, filled, filled_jumps: filled / 2, particles }])
}

fn add_bytes<const D: usize>(problem: &Problem<D>, estimate: &mut Estimate) {
    for (body, particles) in estimate.particles.iter_mut().enumerate() {
        if problem.bodies[body].fed.is_some() {
            *particles = problem.fed_by_end(body);
        }
    }
    let particles = estimate.total_particles() as f64;
    let leaves = estimate.total_leaves() as f64;
    let state = state_bytes::<D>();
    estimate.memory = memory::<D>(estimate.total_particles(), &estimate.levels);
    estimate.particle_steps_per_second = PARTICLE_STEPS_PER_SECOND[D - 2];

    // A particle in the file: three coordinates, a vertex (connectivity, offset, type), the fields.
    let fields: usize = problem.output.fields.iter().map(|field| field_bytes(*field)).sum();
    let restart = if problem.output.restart { state } else { 0.0 };
    // A leaf in the tree's file: eight corners, their connectivity, offset, type and level.
    let leaf = 8.0 * 24.0 + 8.0 * 8.0 + 8.0 + 2.0;
    estimate.output_bytes = particles * (24.0 + 17.0 + fields as f64 + restart) + leaves * leaf;
    estimate.checkpoint_bytes = particles * state + leaves * 16.0;
}

fn field_bytes(field: Field) -> usize {
    match field {
        Field::Body | Field::Material | Field::LeafLevel | Field::ParticleLevel => 4,
        Field::Velocity => 24,
        Field::Stress => 48,
        _ => 8,
    }
}

#[cfg(test)]
pub(in crate::setup) mod explicit;
#[cfg(test)]
#[path = "estimate_tests.rs"]
mod tests;
