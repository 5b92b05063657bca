//! A packet of pressure waves in a square that runs into a level jump at 45 degrees. Both of its envelopes are as wide as a wave length,
//! and it never comes near a wall. What the left part holds beside what it holds on a uniform grid has been reflected, as pressure or
//! shear waves.
use agimp::particle::chunk::Layout;
use agimp::solver::Requests;
use partition::comm::Comm;

use super::{CUT, elastic, fine, motion, packet, reflection, started};
use crate::page::Page;

/// Mass, velocity, and stress xx, yy, xy.
const PLANE: [usize; 6] = [
    Layout::<2>::MASS,
    Layout::<2>::VELOCITY,
    Layout::<2>::VELOCITY + 1,
    Layout::<2>::STRESS,
    Layout::<2>::STRESS + 1,
    Layout::<2>::STRESS + 3,
];

/// Kinetic and elastic energy of the small motion of a particle: mass, velocity, stress xx, yy, xy.
fn energy([mass, vx, vy, xx, yy, xy]: [f64; 6]) -> f64 {
    0.5 * mass * (vx * vx + vy * vy + xx * xx + yy * yy + 2.0 * xy * xy)
}

/// Motion of the particles left of the jump when the packet has passed it, by identifier, and the energy at the start.
fn run(comm: &Comm, length: f64, levels: [u8; 2], dt: f64) -> (Vec<[f64; 6]>, f64) {
    // A circle of this radius starts where it touches the jump, and ends on its other side.
    let radius = 4.0 * (CUT * length / 4.0).ceil();
    let (jump, size) = (2.0 * radius, 4.0 * radius);
    let regions = if levels[1] > levels[0] { fine(levels[1], [jump, size], size) } else { String::new() };
    let diagonal = std::f64::consts::FRAC_1_SQRT_2;
    let job = elastic([size; 2], 4.0, levels[0], &regions, dt);
    let mut solver = started(comm, &job, |chunk, p| {
        let [x, y] = chunk.position(p).map(|x| x - radius);
        let (along, across) = (diagonal * (x + y), diagonal * (y - x));
        let v = packet(along, along.hypot(across) / length, length);
        let mut set = |column: usize, value: f64| chunk.column_mut(column)[p] = value;
        for axis in 0..2 {
            set(Layout::<2>::VELOCITY + axis, diagonal * v);
            set(Layout::<2>::LEFT_CAUCHY_GREEN + axis, 1.0 - v);
            set(Layout::<2>::STRESS + axis, -0.5 * v);
        }
        set(Layout::<2>::LEFT_CAUCHY_GREEN + 3, -v);
        set(Layout::<2>::STRESS + 3, -0.5 * v);
    });
    let incident = motion(&solver, PLANE, |_| true).into_iter().map(energy).sum();
    let end = std::f64::consts::SQRT_2 * 2.0 * radius;
    while solver.clock.time < end {
        crate::checked(solver.step(end, Requests::default()));
    }
    (motion(&solver, PLANE, |x| x < jump), incident)
}

/// Root of the reflected over the incident energy at a jump of 1:2.
fn at_jump(comm: &Comm, length: f64) -> f64 {
    let (left, incident) = run(comm, length, [0, 1], 0.1);
    let (uniform, _) = run(comm, length, [0, 0], 0.1);
    reflection(&left, &uniform, energy, incident)
}

/// Runs both wave lengths and writes what they reflect.
pub(super) fn measure(comm: &Comm, page: &mut Page) {
    let [coarse, fine] = [10.0, 20.0].map(|length| at_jump(comm, length));
    page.line("wave.oblique", fine);
    page.line("wave.oblique.fall", coarse / fine);
    page.text(&format!(
        "At 45 degrees a round packet (standard deviation of a wave length along its path and across, in a square without walls near it) reflects {coarse:.2e} at 10 and {fine:.2e} at 20 \
         cells per wave length, 1:2, as pressure and shear waves together.\n"
    ));
}
