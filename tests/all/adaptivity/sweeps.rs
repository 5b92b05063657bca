//! Conservation while refinement sweeps back and forth over a body that moves and spins.
use std::fmt::Write;

use agimp::job::{AnyProblem, Problem};
use partition::comm::Comm;

use super::state::{advance, count, on_ranks, one_body, solver};
use agimp::solver::Solver;

/// Length of all time steps, s.
const STEP: f64 = 3e-4;
/// Steps in which the slab passes once.
const STEPS_PER_SWEEP: u64 = 40;

/// A job in which a slab as thick as a leaf goes to and fro; outside of the body at the start and from the
/// end of the last sweep on.
fn job(dimension: usize, body: &str, sweeps: usize) -> String {
    let zeros = ", 0".repeat(dimension - 1);
    let mut rows = String::new();
    for sweep in 0..=sweeps {
        let time = (sweep as u64 * STEPS_PER_SWEEP) as f64 * STEP;
        let place = if sweep % 2 == 0 { 0.0 } else { 2.6 };
        write!(rows, "{{ time = {time}, translation = [{place}{zeros}] }}, ").expect("text");
    }
    let domain = ["2"; 3][..dimension].join(", ");
    let (lower, upper) = (["-9"; 2][..dimension - 1].join(", "), ["9"; 2][..dimension - 1].join(", "));
    let criterion = format!(
        "every_steps = 1\n[[adaptivity.criteria]]\nkind = 'region'\nlevel = 1\n\
         shape = {{ kind = 'box', min = [-0.4, {lower}], max = [-0.2, {upper}] }}\nmotion = [{rows}]"
    );
    let job = one_body(dimension, &domain, &criterion, "model = 'neo_hookean'\nyoung = 1e6", body);
    format!("{job}dt_max = {STEP}\n")
}

/// Mass, momentum and angular momentum.
fn conserved<const D: usize>(solver: &mut Solver<D>) -> Vec<[f64; 3]> {
    let particles = solver.particle_totals();
    let grid = solver.grid_totals().expect("boxes in the grid");
    vec![[particles.mass, 0.0, 0.0], particles.momentum, grid.angular_momentum]
}

fn energy<const D: usize>(solver: &Solver<D>) -> f64 {
    let totals = solver.particle_totals();
    totals.kinetic + totals.elastic
}

/// Sweeps so often, with checks after each. The tree must change `changes` times or more, and at most the
/// share `loss` of the energy may be lost without an entry in the ledger: children that wait in coarse cells
/// for their siblings lose by the transfers the energy that a merge would have counted, in 3D more than in
/// 2D.
fn sweeps<const D: usize>(comm: &Comm, body: &str, sweeps: usize, changes: u64, loss: f64)
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let mut solver = solver::<D>(comm, &job(D, body, sweeps));
    let (start, number) = (conserved(&mut solver), count(&solver));
    let (energy_before, mut most, mut booked) = (energy(&solver), number, 0.0);
    for part in 0..2 * sweeps {
        advance(&mut solver, STEPS_PER_SWEEP / 2);
        most = most.max(count(&solver));
        for (quantity, (now, then)) in conserved(&mut solver).iter().zip(&start).enumerate() {
            let norm = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
            let off = norm(&std::array::from_fn(|k| now[k] - then[k])) / norm(then);
            assert!(off <= 1e-12, "quantity {quantity} is off by {off:e} after part {part}");
        }
        let total = solver.adaptation.ledger.total(comm);
        assert!(total.merge_energy >= booked, "losses are not taken back");
        booked = total.merge_energy;
        assert_eq!(number + total.splits * ((1 << D) - 1) - total.removed, count(&solver));
    }
    // Families that were just left take their time.
    advance(&mut solver, 4 * STEPS_PER_SWEEP);
    let total = solver.adaptation.ledger.total(comm);
    let energy_after = energy(&solver);
    println!(
        "{number} particles, at most {most}, at the end {}; {} changes of the tree; {total:?}; energy {energy_before} \
         became {energy_after} J",
        count(&solver),
        solver.adaptation.regrids
    );
    assert!(most > 2 * number && total.refused == 0 && solver.adaptation.regrids >= changes);
    assert!(booked > 0.0 && total.merges >= 9 * number, "{total:?}");
    assert!(solver.forest.leaves().iter().all(|leaf| leaf.level == 0));
    assert_eq!(count(&solver), number, "families find together again");
    // Splits make affine velocities visible, merges hide them; the rest is what the method loses anyway.
    let explained = energy_before + total.split_energy - total.merge_energy;
    assert!((energy_after - explained).abs() <= loss * energy_before, "{energy_after} {explained}");
}

#[test]
fn over_a_disc() {
    let body = "shape = { kind = 'circle', centre = [0.9, 0.95], radius = 0.4 }\n\
                velocity = [0.2, 0.1]\nangular_velocity = 6";
    on_ranks(module_path!(), "over_a_disc", &[1], |comm| sweeps::<2>(comm, body, 130, 1000, 5e-3));
}

/// A spinning ball that drifts with this velocity, on the lattice: a fitted one loses 1.1 % of its energy in 40
/// passes, and this one 1 %.
fn ball(velocity: [f64; 3]) -> String {
    format!(
        "particles_per_cell = 1\nsampling = 'lattice'\nshape = {{ kind = 'sphere', centre = [0.9, 0.95, 1.03], radius = 0.3 }}\n\
         velocity = {velocity:?}\nangular_velocity = [2, -3, 5]"
    )
}

#[test]
fn over_a_ball() {
    let body = ball([0.5, 0.2, -0.3]);
    on_ranks(module_path!(), "over_a_ball", &[1], |comm| sweeps::<3>(comm, &body, 20, 125, 6e-3));
}

/// As [`over_a_ball`], but slower, so that the ball does not reach a wall.
#[test]
#[ignore = "nightly: takes five minutes"]
fn over_a_ball_a_thousand_times() {
    let body = ball([0.2, 0.1, -0.15]);
    on_ranks(module_path!(), "over_a_ball_a_thousand_times", &[1], |comm| {
        sweeps::<3>(comm, &body, 170, 1000, 5e-2)
    });
}
