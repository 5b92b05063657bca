//! A packet of pressure waves in a square that runs into a level jump at 45 degrees. Both of its envelopes are as wide as a wave length,
//! and it never comes near a wall. What the left part holds beside what it holds on a uniform grid has been reflected, as pressure or
//! shear waves.
use agimp::job::Problem;
use agimp::particle::chunk::Layout;
use agimp::setup;
use agimp::solver::{Clock, Requests, Solver};
use partition::comm::Comm;

use super::{AMPLITUDE, CUT, elastic};
use crate::page::Page;

/// Velocity of the packet at a distance from its centre, along its path and across.
fn packet(along: f64, across: f64, length: f64) -> f64 {
    let place = along.hypot(across) / length;
    if place >= CUT {
        return 0.0;
    }
    let window = 1.0 - (place / CUT) * (place / CUT);
    AMPLITUDE
        * window
        * window
        * (-0.5 * place * place).exp()
        * (std::f64::consts::TAU * along / length).cos()
}

/// Kinetic and elastic energy of the small motion of a particle: mass, velocity, stress xx, yy, xy.
fn energy([mass, vx, vy, xx, yy, xy]: [f64; 6]) -> f64 {
    0.5 * mass * (vx * vx + vy * vy + xx * xx + yy * yy + 2.0 * xy * xy)
}

/// Motion of the particles left of the jump when the packet has passed it, by identifier, and the energy at the start.
fn run(comm: &Comm, length: f64, levels: [u8; 2], dt: f64) -> (Vec<[f64; 6]>, f64) {
    // A circle of this radius starts where it touches the jump, and ends on its other side.
    let radius = 4.0 * (CUT * length / 4.0).ceil();
    let (jump, size) = (2.0 * radius, 4.0 * radius);
    let regions = if levels[1] > levels[0] {
        format!(
            "regions = [{{ level = {}, shape = {{ kind = \"box\", min = [{}, 0.5], max = [{}, {}] }} }}]",
            levels[1],
            jump + 0.5,
            size - 0.5,
            size - 0.5
        )
    } else {
        String::new()
    };
    let problem: Problem<2> = crate::problem(&elastic([size; 2], 4.0, levels[0], &regions, dt));
    let mut solver = crate::checked(setup::solver(comm, &problem));
    let mut chunks = std::mem::take(&mut solver.chunks);
    let diagonal = std::f64::consts::FRAC_1_SQRT_2;
    for chunk in &mut chunks {
        for p in 0..chunk.len() {
            let [x, y] = chunk.position(p).map(|x| x - radius);
            let v = packet(diagonal * (x + y), diagonal * (y - x), length);
            let mut set = |column: usize, value: f64| chunk.column_mut(column)[p] = value;
            for axis in 0..2 {
                set(Layout::<2>::VELOCITY + axis, diagonal * v);
                set(Layout::<2>::LEFT_CAUCHY_GREEN + axis, 1.0 - v);
                set(Layout::<2>::STRESS + axis, -0.5 * v);
            }
            set(Layout::<2>::LEFT_CAUCHY_GREEN + 3, -v);
            set(Layout::<2>::STRESS + 3, -0.5 * v);
        }
    }
    let mut solver = Solver::new(comm, setup::physics(&problem), solver.forest, chunks, Clock::default());
    let motion = |solver: &Solver<2>, side: f64| {
        let mut all = Vec::new();
        for chunk in &solver.chunks {
            let columns = [
                Layout::<2>::MASS,
                Layout::<2>::VELOCITY,
                Layout::<2>::VELOCITY + 1,
                Layout::<2>::STRESS,
                Layout::<2>::STRESS + 1,
                Layout::<2>::STRESS + 3,
            ]
            .map(|column| chunk.column(column));
            let chosen = (0..chunk.len()).filter(|&p| chunk.position(p)[0] < side);
            all.extend(chosen.map(|p| (chunk.ids()[p], columns.map(|column| column[p]))));
        }
        all.sort_by_key(|(id, _)| *id);
        all.into_iter().map(|(_, state)| state).collect::<Vec<_>>()
    };
    let incident = motion(&solver, f64::INFINITY).into_iter().map(energy).sum();
    let end = std::f64::consts::SQRT_2 * 2.0 * radius;
    while solver.clock.time < end {
        crate::checked(solver.step(end, Requests::default()));
    }
    (motion(&solver, jump), incident)
}

/// Root of the reflected over the incident energy at a jump of 1:2.
fn reflection(comm: &Comm, length: f64) -> f64 {
    let (left, incident) = run(comm, length, [0, 1], 0.1);
    let (uniform, _) = run(comm, length, [0, 0], 0.1);
    assert_eq!(left.len(), uniform.len());
    let difference = left
        .iter()
        .zip(&uniform)
        .map(|(a, b)| energy([a[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5]]));
    (difference.sum::<f64>() / incident).sqrt()
}

/// Runs both wave lengths and writes what they reflect.
pub(super) fn measure(comm: &Comm, page: &mut Page) {
    let [coarse, fine] = [10.0, 20.0].map(|length| reflection(comm, length));
    page.line("wave.oblique", fine);
    page.line("wave.oblique.fall", coarse / fine);
    page.text(&format!(
        "At 45 degrees a round packet (standard deviation of a wave length along its path and across, in a square without walls near it) reflects {coarse:.2e} at 10 and {fine:.2e} at 20 \
         cells per wave length, 1:2, as pressure and shear waves together.\n"
    ));
}
