//! What a job will cost, found without running it.
use super::seed::{SeedError, count_leaf};
use crate::grid::mask::{offset, offset_count};
use crate::job::problem::{Field, Problem};
use crate::material;
use crate::particle::Layout;
use bytemuck::{Pod, Zeroable};
use partition::Octant;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

/// Size and cost of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Particles of each body, in the order of the job; on the tree that the job gives, unless that of
    /// [`Estimate::for_tree`] is another, since criteria of dynamic refinement need the particles themselves.
    pub particles: Vec<u64>,
    /// Leaves of that tree by level, from level 0 to the finest one.
    pub levels: Vec<LevelCount>,
    /// First time step, s; with dynamic refinement for leaves of the finest level that a criterion wants.
    pub time_step: f64,
    /// Steps to the end if the first time step were kept.
    pub steps: f64,
    /// Bytes of memory of all ranks together, without the program itself; about.
    pub memory: f64,
    /// Bytes of one output file with its tree; about.
    pub output_bytes: f64,
    /// Number of outputs, the first and the last one included.
    pub outputs: u64,
    /// Bytes of one checkpoint; about.
    pub checkpoint_bytes: f64,
}

/// Bytes that each rank takes with next to no particles: the program itself and its libraries.
const PROGRAM: f64 = 37e6;

/// Leaves of one level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LevelCount {
    /// All leaves.
    pub leaves: u64,
    /// Leaves with particles.
    pub filled: u64,
    /// Those of them that touch a leaf of another level.
    pub filled_jumps: u64,
    /// Particles.
    pub particles: u64,
}

impl LevelCount {
    /// Not collective. Counts of some leaves by level up to the finest one, given the particles of each.
    pub fn of_levels<const D: usize>(
        problem: &Problem<D>,
        leaves: &[Octant<D>],
        particles: &[u64],
    ) -> Vec<Self> {
        let all: FxHashSet<Octant<D>> = leaves.iter().copied().collect();
        let finest = leaves.iter().map(|leaf| leaf.level).max().unwrap_or(0);
        let mut levels = vec![Self::default(); usize::from(finest) + 1];
        for (leaf, &particles) in leaves.iter().zip(particles) {
            let mut around =
                (0..offset_count(D)).filter_map(|index| leaf.neighbour(offset(index), &problem.brick));
            let is_jump = particles > 0 && around.any(|neighbour| !all.contains(&neighbour));
            let level = &mut levels[usize::from(leaf.level)];
            level.leaves += 1;
            level.filled += u64::from(particles > 0);
            level.filled_jumps += u64::from(is_jump);
            level.particles += particles;
        }
        levels
    }
}

impl Estimate {
    /// Bytes of memory of each of some ranks that share the work evenly; about.
    pub fn memory_per_rank(&self, ranks: u32) -> f64 {
        PROGRAM + self.memory / f64::from(ranks)
    }

    /// Particles of all bodies.
    pub fn total_particles(&self) -> u64 {
        self.particles.iter().sum()
    }

    /// The estimate for a tree with these particles and leaves, which criteria have refined.
    pub fn for_tree<const D: usize>(
        mut self,
        problem: &Problem<D>,
        particles: Vec<u64>,
        levels: Vec<LevelCount>,
    ) -> Self {
        (self.particles, self.levels) = (particles, levels);
        add_bytes(problem, &mut self);
        self
    }

    /// Leaves of all levels.
    pub fn total_leaves(&self) -> u64 {
        self.levels.iter().map(|level| level.leaves).sum()
    }
}

/// Not collective. Builds the tree and counts the points that bodies have in its leaves.
///
/// # Errors
/// Two bodies share a lattice point.
pub fn estimate<const D: usize>(problem: &Problem<D>) -> Result<Estimate, SeedError> {
    let leaves = leaves(problem);
    let counts: Vec<Vec<u64>> = leaves
        .par_iter()
        .map(|leaf| {
            let mut counts = vec![0; problem.bodies.len()];
            count_leaf(problem, leaf, &mut counts)?;
            Ok(counts)
        })
        .collect::<Result<_, SeedError>>()?;

    let finest = leaves.iter().map(|leaf| leaf.level).max().unwrap_or(0);
    let mut particles = vec![0; problem.bodies.len()];
    for counts in &counts {
        particles.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
    }
    let filling: Vec<u64> = counts.iter().map(|counts| counts.iter().sum()).collect();
    let levels = LevelCount::of_levels(problem, &leaves, &filling);
    // Criteria may make any leaf as fine as they want, which shortens the step of all.
    let criteria = problem.adaptivity.iter().flat_map(|adaptivity| &adaptivity.criteria);
    let time_step = time_step(problem, criteria.map(|criterion| criterion.level).fold(finest, u8::max));
    let outputs =
        problem.output.every.map_or(2, |every| (problem.time.end / every - 1e-9).floor() as u64 + 2);
    let mut estimate = Estimate {
        particles,
        levels,
        time_step,
        steps: (problem.time.end / time_step).ceil(),
        memory: 0.0,
        output_bytes: 0.0,
        outputs,
        checkpoint_bytes: 0.0,
    };
    add_bytes(problem, &mut estimate);
    Ok(estimate)
}

/// Courant condition over the fastest wave and the fastest particle at the start, on the finest cells.
fn time_step<const D: usize>(problem: &Problem<D>, finest: u8) -> f64 {
    let wave = problem
        .bodies
        .iter()
        .map(|body| &problem.materials[body.material])
        .map(|material| material::build(&material.model, material.density).wave_speed())
        .fold(0.0, f64::max);
    let norm = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let speed = problem
        .bodies
        .iter()
        .map(|body| {
            let bounds = body.shape.bounds();
            let reach = if bounds.half_diagonal().is_finite() { bounds.half_diagonal() } else { 0.0 };
            norm(&body.velocity) + norm(&body.angular_velocity) * reach
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

fn add_bytes<const D: usize>(problem: &Problem<D>, estimate: &mut Estimate) {
    let particles = estimate.total_particles() as f64;
    let leaves = estimate.total_leaves() as f64;

    // Reals, identifier and tag of a particle.
    let state = 8.0 * (Layout::<D>::REALS + 2) as f64;
    // What was measured (docs/performance.md, "Memory"), in bytes for each row of an arena: leaves have their part of the
    // plan, filled ones node fields, arenas and half a page of particles; where levels meet there are more blocks and
    // bins, and moments of constrained nodes.
    let levels = estimate.levels.iter().map(|level| {
        1.6 * level.leaves as f64 + 52.0 * level.filled as f64 + 105.0 * level.filled_jumps as f64
    });
    let rows = 7_f64.powi(D as i32);
    estimate.memory = particles * state + rows * levels.sum::<f64>();

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

/// Not collective. All leaves of the tree that the job asks for, along the curve.
pub fn leaves<const D: usize>(problem: &Problem<D>) -> Vec<Octant<D>> {
    // The octants that are split, by level; everything else follows from them.
    let mut split = vec![FxHashSet::default(); usize::from(problem.finest_level()) + 1];
    let mut pending = roots(problem);
    while let Some(octant) = pending.pop() {
        if problem.wants_refinement(&octant) {
            split[usize::from(octant.level)].insert(octant);
            pending.extend((0..1 << D).map(|i| octant.child(i)));
        }
    }
    if problem.tree.graded {
        balance(problem, &mut split);
    }
    let mut leaves = Vec::new();
    let mut pending = roots(problem);
    while let Some(octant) = pending.pop() {
        if split[usize::from(octant.level)].contains(&octant) {
            pending.extend((0..1 << D).map(|i| octant.child(i)));
        } else {
            leaves.push(octant);
        }
    }
    leaves.sort_unstable();
    leaves
}

/// An octant that is split has children next to all its neighbours, so those must exist: their parents
/// are split too. Finest level first; each level only adds to the coarser ones.
fn balance<const D: usize>(problem: &Problem<D>, split: &mut [FxHashSet<Octant<D>>]) {
    for level in (1..split.len()).rev() {
        let octants: Vec<Octant<D>> = split[level].iter().copied().collect();
        for octant in octants {
            for index in 0..offset_count(D) {
                let Some(neighbour) = octant.neighbour(offset(index), &problem.brick) else { continue };
                let mut parent = neighbour.parent();
                while let Some(ancestor) = parent {
                    if !split[usize::from(ancestor.level)].insert(ancestor) {
                        break;
                    }
                    parent = ancestor.parent();
                }
            }
        }
    }
}

fn roots<const D: usize>(problem: &Problem<D>) -> Vec<Octant<D>> {
    (0..problem.brick.root_count()).map(|i| problem.brick.root_on_curve(i)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{AnyProblem, parse};

    fn problem(graded: bool) -> Problem<2> {
        let text = format!(
            r#"
version = 1
dimension = 2
domain = {{ size = [1, 1], root_edge = 1 }}
time = {{ end = 1 }}
materials = [{{ name = "m", density = 1000, model = "hencky", young = 1e6, poisson = 0.0 }}]
bodies = [{{ name = "b", material = "m", shape = {{ kind = "box", min = [0, 0], max = [1, 0.5] }} }}]
[tree]
graded = {graded}
regions = [{{ level = 4, shape = {{ kind = "box", min = [0.5, 0.5], max = [0.53, 0.53] }} }}]
"#
        );
        match parse(&text, "job.toml".as_ref()) {
            Ok(AnyProblem::Two(problem)) => problem,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn balanced_tree_has_no_jump_over_faces_or_corners() {
        let problem = problem(true);
        let leaves = leaves(&problem);
        for a in &leaves {
            for b in leaves.iter().filter(|b| a.touches(b)) {
                assert!(a.level.abs_diff(b.level) <= 1, "{a:?} {b:?}");
            }
        }
        let area: f64 = leaves.iter().map(|leaf| 0.25_f64.powi(leaf.level.into())).sum();
        assert_eq!(area, 1.0);
    }

    /// A corner of the region touches the middle of the domain: by hand, leaf by leaf.
    #[test]
    fn leaves_by_level() {
        let counts = |graded| {
            let estimate = estimate(&problem(graded)).unwrap();
            estimate.levels.iter().map(|level| level.leaves).collect::<Vec<_>>()
        };
        assert_eq!(counts(false), [0, 3, 3, 3, 4]);
        // The leaves at the middle have level 4 on one side, so level 3 on the other three.
        assert_eq!(counts(true), [0, 0, 12, 15, 4]);
    }

    #[test]
    fn time_step_and_outputs() {
        let estimate = estimate(&problem(false)).unwrap();
        // A wave of sqrt(E / rho) over cells of 1/64 m.
        let expected = 0.4 / 64.0 / 1000_f64.sqrt();
        assert!((estimate.time_step - expected).abs() < 1e-12 * expected);
        assert_eq!(estimate.outputs, 2);
        assert_eq!(estimate.total_particles(), 2 * 64);
    }
}
