//! Jobs of the tests through the library, with access to leaves and particles.
use agimp::job::{AnyProblem, Problem, parse};
use agimp::particle::chunk::{Layout, Tag};
use agimp::setup;
use partition::comm::Comm;

use crate::common::relaunch::{ran_if_launched, relaunch};
use agimp::solver::{Requests, Solver};

/// Runs `body` on each number of ranks. MPI starts once per process, so each is a process group of its own.
pub(crate) fn on_ranks(module: &str, test: &str, ranks: &[usize], body: impl Fn(&Comm)) {
    if ran_if_launched(body) {
        return;
    }
    let _turn = crate::common::in_turn();
    for &n in ranks {
        println!("{n} ranks: {}", relaunch(module, test, n, 300));
    }
}

/// A job with one body of an elastic material in a domain of leaves of 0.25 m on level 0; its last table is
/// `time`.
pub(crate) fn one_body(dimension: usize, size: &str, adaptivity: &str, model: &str, body: &str) -> String {
    format!(
        r#"
version = 1
dimension = {dimension}
[domain]
size = [{size}]
root_edge = 0.25
[adaptivity]
{adaptivity}
[[materials]]
name = "rubber"
density = 1000
poisson = 0.3
{model}
[[bodies]]
name = "body"
material = "rubber"
{body}
[time]
end = 1e3
"#
    )
}

/// The job with its first tree and particles.
pub(crate) fn solver<const D: usize>(comm: &Comm, text: &str) -> Solver<D>
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let problem = parse(text, "test.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}"));
    let problem: Problem<D> = problem.try_into().unwrap_or_else(|_| panic!("another dimension"));
    setup::solver(comm, &problem).unwrap_or_else(|error| panic!("{error}"))
}

/// Steps, each followed by what is due to tree and particles.
pub(crate) fn advance<const D: usize>(solver: &mut Solver<D>, steps: u64) {
    for _ in 0..steps {
        solver.step(f64::MAX, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
        solver.regrid().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Number of particles of all ranks.
pub(crate) fn count<const D: usize>(solver: &Solver<D>) -> u64 {
    solver.particle_totals().count
}

/// A leaf with particles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Filled<const D: usize> {
    /// Level.
    pub level: u8,
    /// Lower corner, m.
    pub lower: [f64; D],
    /// Upper corner, m.
    pub upper: [f64; D],
    /// Body of its first particle.
    pub body: u16,
    /// Greatest plastic strain.
    pub plastic_strain: f64,
}

/// Own leaves with particles.
pub(crate) fn filled<const D: usize>(solver: &Solver<D>) -> Vec<Filled<D>> {
    let leaves = solver.forest.leaves().iter().zip(&solver.chunks).filter(|(_, chunk)| !chunk.is_empty());
    leaves
        .map(|(leaf, chunk)| {
            let (lower, upper) = agimp::grid::leaf_geometry::leaf_box(leaf, solver.physics.root_edge);
            let plastic = chunk.column(Layout::<D>::HISTORY).iter().copied().fold(0.0, f64::max);
            let body = Tag::unpack(chunk.tags()[0]).body;
            Filled { level: leaf.level, lower, upper, body, plastic_strain: plastic }
        })
        .collect()
}

/// Number of own particles made for a level coarser than their leaf: those that enter it split on the way.
pub(crate) fn too_coarse<const D: usize>(solver: &Solver<D>) -> usize {
    let leaves = solver.forest.leaves().iter().zip(&solver.chunks);
    let in_leaf =
        |level: u8, tags: &[u64]| tags.iter().filter(|&&tag| Tag::unpack(tag).level < level).count();
    leaves.map(|(leaf, chunk)| in_leaf(leaf.level, chunk.tags())).sum()
}

/// Greatest component of stress of any own particle, Pa.
pub(crate) fn greatest_stress<const D: usize>(solver: &Solver<D>) -> f64 {
    let columns = (Layout::<D>::STRESS..Layout::<D>::MASS).collect::<Vec<_>>();
    let of = |column: usize| solver.chunks.iter().flat_map(move |chunk| chunk.column(column));
    columns.into_iter().flat_map(of).fold(0.0, |greatest, stress| f64::max(greatest, stress.abs()))
}

/// Lower and upper corner of a box about the boxes of all own particles, m.
pub(crate) fn extents<const D: usize>(solver: &Solver<D>) -> ([f64; D], [f64; D]) {
    let (mut lower, mut upper) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for chunk in &solver.chunks {
        for p in 0..chunk.len() {
            let (x, half) = (chunk.position(p), chunk.column(Layout::<D>::HALF)[p]);
            for a in 0..D {
                lower[a] = lower[a].min(x[a] - half);
                upper[a] = upper[a].max(x[a] + half);
            }
        }
    }
    (lower, upper)
}
