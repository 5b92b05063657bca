//! Bodies at walls, and domains far from the origin: jobs on trees of several levels.
//!
//! A body under uniform stress that fills a domain with walls stays at rest, at faces, edges and corners,
//! whatever the number of particles per cell; and where the domain lies changes no bit.

use std::fmt::Write as _;

use crate::common::scenarios::{Scenario, agrees_for, report};
use agimp::exact_sum::ExactSum;
use agimp::job::{AnyProblem, Problem, parse};
use agimp::particle::chunk::Layout;
use agimp::setup;
use agimp::solver::{Clock, Requests, Solver};
use partition::Comm;

pub(crate) const SCENARIOS: &[(&str, Scenario)] = &[
    ("rest_2d", |comm| rest::<2>(comm, &[1.0, 2.0, 3.0, 4.0, 1.5, 2.5, 2.75], 40)),
    ("rest_3d", |comm| rest::<3>(comm, &[1.0, 2.0, 1.5, 3.0, 4.0], 3)),
    ("origin", |comm| {
        origin::<2>(comm);
        origin::<3>(comm);
    }),
];

#[test]
fn stressed_body_between_walls_rests_2d() {
    agrees_for("rest_2d", &[1, 2, 3, 4]);
}

#[test]
fn stressed_body_between_walls_rests_3d() {
    agrees_for("rest_3d", &[1, 2, 4]);
}

#[test]
fn far_origin_changes_no_bit() {
    agrees_for("origin", &[1, 2]);
}

/// Places of the domain's lower corner, m.
const ORIGINS: [[f64; 3]; 2] = [[0.0; 3], [1e6, -1e6, 1e3]];

/// A list of coordinates about an origin.
fn at<const D: usize>(origin: [f64; 3], x: [f64; 3]) -> String {
    format!("{:?}", &std::array::from_fn::<f64, D, _>(|a| origin[a] + x[a])[..])
}

/// A job on a domain of edge 1 m with leaves of levels 1 to 3, where level 1 touches level 3: fine leaves lie
/// in the middle and in the upper corner.
fn job<const D: usize>(origin: [f64; 3], body: &str, rest: &str) -> String {
    let region = |low: f64, high: f64| {
        let (min, max) = (at::<D>(origin, [low; 3]), at::<D>(origin, [high; 3]));
        format!("{{ level = 3, shape = {{ kind = \"box\", min = {min}, max = {max} }} }}")
    };
    let mut text = format!(
        "version = 1\ndimension = {D}\n[domain]\nmin = {}\nsize = {:?}\nroot_edge = 1\n",
        at::<D>(origin, [0.0; 3]),
        &[1.0; D][..]
    );
    let _ = write!(
        text,
        "[tree]\ngraded = false\nregions = [{}, {}]\n\
         [[materials]]\nname = \"a\"\ndensity = 1\nmodel = \"fixed_corotated\"\nyoung = 1\npoisson = 0\n\
         [time]\nend = 1e3\ncfl = 0.4\n[output]\nevery = 1e3\n{rest}\n\
         [[bodies]]\nname = \"a\"\nmaterial = \"a\"\n{body}\n",
        region(0.44, 0.49),
        region(0.95, 0.99)
    );
    text
}

fn solver<const D: usize>(comm: &Comm, text: &str) -> (Problem<D>, Solver<D>)
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let problem = parse(text, "walls.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}\n{text}"));
    let problem = Problem::<D>::try_from(problem).unwrap_or_else(|_| panic!("another dimension"));
    let solver = setup::solver(comm, &problem).unwrap_or_else(|error| panic!("{error}"));
    (problem, solver)
}

/// Collective. A number for the bits of all particles.
fn bits<const D: usize>(comm: &Comm, solver: &Solver<D>) -> u64 {
    let mut sum = [0];
    for chunk in &solver.chunks {
        for p in 0..chunk.len() {
            let columns = (0..Layout::<D>::REALS).map(|column| chunk.column(column)[p].to_bits());
            let mixed = columns.fold(chunk.ids()[p], |mixed, bits| {
                (mixed ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
            });
            // Shorter, so that the sum does not overflow.
            sum[0] += mixed >> 24;
        }
    }
    comm.sum_u64(&mut sum);
    sum[0]
}

/// Stretches along the axes, and the stress `s² - s` of each.
const STRETCH: [f64; 3] = [1.25, 0.75, 1.125];

fn rest<const D: usize>(comm: &Comm, counts: &[f64], steps: u64)
where
    Problem<D>: TryFrom<AnyProblem>,
{
    for &count in counts {
        let mut same = Vec::new();
        for origin in ORIGINS {
            let (min, max) = (at::<D>(origin, [0.0; 3]), at::<D>(origin, [1.0; 3]));
            let body = format!(
                "shape = {{ kind = \"box\", min = {min}, max = {max} }}\nparticles_per_cell = {count:?}"
            );
            // Walls that hold the material in tension as well as in compression.
            let faces = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];
            let slip: String =
                faces[..2 * D].iter().map(|face| format!("{face} = {{ kind = \"slip\" }}\n")).collect();
            let text = job::<D>(origin, &body, &format!("[boundaries]\n{slip}[numerics]\nboxes = \"fixed\""));
            let (problem, mut solver) = solver::<D>(comm, &text);
            let mut chunks = std::mem::take(&mut solver.chunks);
            let mut volume = vec![ExactSum::new()];
            for chunk in &mut chunks {
                chunk.column(Layout::<D>::MASS).iter().for_each(|mass| volume[0].add(*mass));
                for (axis, s) in STRETCH.into_iter().enumerate().take(D) {
                    chunk.column_mut(Layout::<D>::LEFT_CAUCHY_GREEN + axis).fill(s * s);
                    chunk.column_mut(Layout::<D>::STRESS + axis).fill(s * s - s);
                }
            }
            ExactSum::sum_over_ranks(comm, &mut volume);
            let volume = volume[0].to_f64();
            assert!((volume - 1.0).abs() < 1e-12, "the particles fill the domain: {volume}");
            let mut solver =
                Solver::new(comm, setup::physics(&problem), solver.forest, chunks, Clock::default());
            for _ in 0..steps {
                solver.step(f64::MAX, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
            }
            let mut speed: f64 = 0.0;
            for chunk in &solver.chunks {
                for axis in 0..D {
                    let column = chunk.column(Layout::<D>::VELOCITY + axis);
                    speed = column.iter().fold(speed, |speed, v| speed.max(v.abs()));
                }
            }
            let speed = comm.max_f64(speed);
            // Impulses of a step are up to stress / (density c) = 0.3 m/s.
            assert!(speed < 1e-13, "{D}D, {count} per cell, origin {origin:?}: {speed:e} m/s");
            same.push((bits(comm, &solver), speed));
        }
        assert_eq!(same[0], same[1], "{D}D, {count} particles per cell: origins {ORIGINS:?}");
        report(comm, format!("{D}D, {count} per cell: {:.1e} m/s, bits {:x}", same[0].1, same[0].0));
    }
}

/// A body that falls, spins and hits a wall.
fn origin<const D: usize>(comm: &Comm)
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let same = ORIGINS.map(|origin| {
        let (min, max) = (at::<D>(origin, [0.375, 0.0, 0.375]), at::<D>(origin, [0.75, 0.4375, 0.75]));
        let spin = if D == 2 { "2.0" } else { "[0.5, -1.0, 2.0]" };
        let body = format!(
            "shape = {{ kind = \"box\", min = {min}, max = {max} }}\nvelocity = {:?}\nangular_velocity = {spin}",
            &[0.125, -0.25, 0.0625][..D]
        );
        let walls = "[boundaries]\ny_min = { kind = \"separating\", friction = 0.3 }";
        let (_, mut solver) = solver::<D>(comm, &job::<D>(origin, &body, walls));
        for _ in 0..if D == 2 { 100 } else { 15 } {
            solver.step(f64::MAX, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
        }
        bits(comm, &solver)
    });
    assert_eq!(same[0], same[1], "{D}D");
    report(comm, format!("{D}D: bits {:x}", same[0]));
}
