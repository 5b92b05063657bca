//! A body without stress that moves through fine cells and out again stays what it was.
use agimp::job::{AnyProblem, Problem};
use partition::comm::Comm;

use super::state::{advance, count, extents, greatest_stress, on_ranks, one_body, solver, too_coarse};

const YOUNG: f64 = 1e3;
/// Greatest stress over the modulus.
const TOLERANCE: f64 = 1e-10;

fn job(dimension: usize, body: &str, region: &str) -> String {
    let domain = &["2.5", "1", "1"][..dimension].join(", ");
    let criterion =
        format!("every_steps = 4\n[[adaptivity.criteria]]\nkind = 'region'\nlevel = 2\nshape = {region}");
    one_body(dimension, domain, &criterion, &format!("model = 'hencky'\nyoung = {YOUNG}"), body)
}

/// The same cells without `[adaptivity]`: the region belongs to the tree.
fn with_fixed_cells(dimension: usize, body: &str, region: &str) -> String {
    let regions = format!("[tree]\nregions = [{{ level = 2, shape = {region} }}]");
    let criterion = job(dimension, body, region);
    let (start, rest) = criterion.split_once("[adaptivity]").expect("a table");
    let (_, end) = rest.split_once("[[materials]]").expect("a table");
    format!("{start}{regions}\n[[materials]]{end}")
}

fn crosses<const D: usize>(comm: &Comm, job: &str, distance: f64)
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let mut solver = solver::<D>(comm, job);
    let (number, before, totals) = (count(&solver), extents(&solver), solver.particle_totals());
    let velocity: [f64; D] = std::array::from_fn(|a| totals.momentum[a] / totals.mass);
    let (mut most, mut stress) = (number, 0.0_f64);
    while velocity[0] * solver.clock.time < distance {
        advance(&mut solver, 1);
        assert_eq!(too_coarse(&solver), 0, "particles coarser than their leaf at {} s", solver.clock.time);
        most = most.max(count(&solver));
        stress = stress.max(greatest_stress(&solver));
        assert!(stress <= TOLERANCE * YOUNG, "stress {stress:e} Pa at {} s", solver.clock.time);
    }
    let after = extents(&solver);
    for a in 0..D {
        let way = velocity[a] * solver.clock.time;
        let off = (after.0[a] - before.0[a] - way).abs().max((after.1[a] - before.1[a] - way).abs());
        assert!(off <= 1e-10, "axis {a}: the body's end is off by {off:e} m");
    }
    let total = solver.adaptation.ledger.total(comm);
    println!(
        "{number} particles, at most {most}, at the end {}; stress at most {stress:e} Pa; {total:?}",
        count(&solver)
    );
    assert!(most > 2 * number, "{most}");
    assert_eq!(count(&solver), number);
    // All moved alike all the time.
    let moved = 0.5 * velocity.iter().map(|v| v * v).sum::<f64>() * totals.mass;
    let relative = (solver.particle_totals().kinetic - moved).abs() / moved;
    assert!(relative <= 1e-13, "{relative:e}");
    assert!(total.split_energy.max(total.merge_energy) <= 1e-20 * moved, "{total:?}");
}

#[test]
fn of_a_square() {
    let body = "shape = { kind = 'box', min = [0.1, 0.3], max = [0.5, 0.7] }\nvelocity = [1, 0.03]";
    let region = "{ kind = 'circle', centre = [1.2, 0.45], radius = 0.15 }";
    on_ranks(module_path!(), "of_a_square", &[1], |comm| crosses::<2>(comm, &job(2, body, region), 1.7));
}

#[test]
fn of_a_square_through_fixed_cells() {
    let body = "shape = { kind = 'box', min = [0.1, 0.3], max = [0.5, 0.7] }\nvelocity = [1, 0.03]";
    let region = "{ kind = 'circle', centre = [1.2, 0.45], radius = 0.15 }";
    let job = with_fixed_cells(2, body, region);
    on_ranks(module_path!(), "of_a_square_through_fixed_cells", &[1], |comm| crosses::<2>(comm, &job, 1.9));
}

#[test]
fn of_a_cube() {
    let body = "particles_per_cell = 1\nshape = { kind = 'box', min = [0.1, 0.3, 0.35], max = [0.35, 0.6, 0.6] }\n\
                velocity = [1, 0.03, -0.05]";
    let region = "{ kind = 'sphere', centre = [1.0, 0.45, 0.4], radius = 0.06 }";
    on_ranks(module_path!(), "of_a_cube", &[1], |comm| crosses::<3>(comm, &job(3, body, region), 1.5));
}
