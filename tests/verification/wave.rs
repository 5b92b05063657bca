//! A pulse of pressure waves in an elastic bar, across a level jump.
//!
//! The bar has c = 1 m/s, rollers on all faces and cells of 1 m (coarse). A wave packet runs to the right into the
//! jump; what runs to the left afterwards has been reflected there.
use agimp::job::Problem;
use agimp::particle::chunk::Layout;
use agimp::run::setup;
use agimp::solver::{Clock, Requests, Solver};
use partition::comm::Comm;

use crate::page::Page;
use crate::plot::{Chart, Series};

/// Half length of the packet in standard deviations of its envelope.
const CUT: f64 = 2.8;
/// Standard deviation of the envelope in wave lengths.
const ENVELOPE: f64 = 1.5;
/// Velocity of the packet, m/s: strains of 1e-6 are linear.
const AMPLITUDE: f64 = 1e-6;

/// One run.
#[derive(Clone, Copy)]
struct Case {
    /// Wave length in coarse cells.
    length: f64,
    /// Levels of the left and of the right part.
    levels: [u8; 2],
}

struct Outcome {
    /// Square root of reflected over incident energy.
    reflected: f64,
    /// Transmitted over incident energy.
    transmitted: f64,
    /// Positions and velocities at the end, for one line of particles.
    profile: Vec<[f64; 2]>,
}

/// The packet at distance `x` from its centre.
fn packet(x: f64, length: f64) -> f64 {
    let place = x / (ENVELOPE * length);
    if place.abs() >= CUT {
        return 0.0;
    }
    // The window ends the packet smoothly.
    let window = 1.0 - (place / CUT) * (place / CUT);
    AMPLITUDE * window * window * (-0.5 * place * place).exp() * (std::f64::consts::TAU * x / length).cos()
}

fn job(case: &Case) -> (String, f64) {
    let half = (CUT * ENVELOPE * case.length / 4.0).ceil();
    let (jump, size) = (8.0 * half, 12.0 * half);
    let base = case.levels[0].min(case.levels[1]);
    let mut regions = String::new();
    for (level, [from, to]) in case.levels.into_iter().zip([[0.0, jump], [jump, size]]) {
        if level > base {
            regions = format!(
                "regions = [{{ level = {level}, shape = {{ kind = \"box\", min = [{}, 0.5], max = [{}, 3.5] }} }}]",
                from + 0.5,
                to - 0.5
            );
        }
    }
    let text = format!(
        "version = 1\ndimension = 2\ngravity = [0, 0]\n\
         [domain]\nsize = [{size}, 4]\nroot_edge = 4\n\
         [tree]\ngraded = false\nbase_level = {base}\n{regions}\n\
         [[materials]]\nname = \"bar\"\ndensity = 1\nmodel = \"fixed_corotated\"\nyoung = 1\npoisson = 0\n\
         [[bodies]]\nname = \"bar\"\nmaterial = \"bar\"\nshape = {{ kind = \"box\", min = [0, 0], max = [{size}, 4] }}\n\
         [numerics]\ntransfer = \"flip\"\nflip = 1.0\n\
         [time]\nend = 1e6\ncfl = 0.2\n[output]\nevery = 1e6\n"
    );
    (text, jump)
}

/// Energies of what runs to the right and to the left, in the part of the bar that `side` chooses.
fn energies(solver: &Solver<2>, side: impl Fn(f64) -> bool) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for chunk in &solver.chunks {
        let at = |column: usize, p: usize| chunk.column(column)[p];
        for p in (0..chunk.len()).filter(|&p| side(chunk.position(p)[0])) {
            let (v, stress) = (at(Layout::<2>::VELOCITY, p), at(Layout::<2>::STRESS, p));
            let mass = at(Layout::<2>::MASS, p);
            // With rho c = 1: kinetic and elastic energy of a wave in one direction are equal.
            sums[0] += mass * (0.5 * (v - stress)).powi(2);
            sums[1] += mass * (0.5 * (v + stress)).powi(2);
        }
    }
    sums
}

fn run(comm: &Comm, case: &Case) -> Outcome {
    let (text, jump) = job(case);
    let problem: Problem<2> = crate::problem(&text);
    let mut solver = crate::checked(setup::solver(comm, &problem));
    let mut chunks = std::mem::take(&mut solver.chunks);
    for chunk in &mut chunks {
        for p in 0..chunk.len() {
            let v = packet(chunk.position(p)[0] - 0.5 * jump, case.length);
            let stretch = 1.0 - v;
            chunk.column_mut(Layout::<2>::VELOCITY)[p] = v;
            chunk.column_mut(Layout::<2>::LEFT_CAUCHY_GREEN)[p] = stretch * stretch;
            chunk.column_mut(Layout::<2>::STRESS)[p] = -v * stretch;
        }
    }
    let mut solver = Solver::new(comm, setup::physics(&problem), solver.forest, chunks, Clock::default());
    let [incident, _] = energies(&solver, |_| true);
    // The centre of the packet goes to the jump and back.
    while solver.clock.time < jump {
        crate::checked(solver.step(jump, Requests::default()));
    }
    let [_, reflected] = energies(&solver, |x| x < jump);
    let transmitted: f64 = energies(&solver, |x| x >= jump).iter().sum();
    let mut profile = Vec::new();
    for chunk in &solver.chunks {
        for p in 0..chunk.len() {
            let [x, y] = chunk.position(p);
            if y < 2.0 * chunk.column(Layout::<2>::HALF)[p] {
                profile.push([x, chunk.column(Layout::<2>::VELOCITY)[p] / AMPLITUDE]);
            }
        }
    }
    profile.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Outcome { reflected: (reflected / incident).sqrt(), transmitted: transmitted / incident, profile }
}

/// Reflection between linear elements with lumped mass, continuous in time.
fn lumped_elements(length: f64, ratio: f64) -> f64 {
    let angle = |h: f64| (std::f64::consts::PI * h / length).asin().cos();
    ((angle(1.0) - angle(ratio)) / (angle(1.0) + angle(ratio))).abs()
}

/// Runs all cases and writes their section.
pub fn section(comm: &Comm, page: &mut Page) {
    page.text(
        "## Pressure waves across a level jump\n\n\
         A wave packet (Gaussian envelope, standard deviation 1.5 wave lengths, cut at 2.8 of them by a smooth window; \
         strain 1e-6) runs through an elastic bar (fixed corotated, nu = 0, c = 1) into a level jump. FLIP, 2 x 2 \
         particles per cell, Courant number 0.2, cells of size H on the coarse side. R is the root of reflected over \
         incident energy, measured on the particles as the energy of what runs back. *Lumped elements* is \
         `(cos t1 - cos t2) / (cos t1 + cos t2)` with `sin ti = pi hi / wave length`, the theory of linear finite \
         elements; *GIMP* is an independent one-dimensional calculation with the FLIP operator of GIMP with the same \
         spacing of particles. Uniform grids show what the measurement itself makes of numerical dispersion.\n",
    );
    // Reference values of the independent calculation where there are any.
    let cases = [
        ("uniform", 10.0, [0, 0], None),
        ("uniform", 20.0, [0, 0], None),
        ("1:2 into fine", 8.0, [0, 1], Some(7.6e-2)),
        ("1:2 into fine", 10.0, [0, 1], Some(4.7e-2)),
        ("1:2 into fine", 15.0, [0, 1], Some(2.0e-2)),
        ("1:2 into fine", 20.0, [0, 1], Some(1.14e-2)),
        ("2:1 into coarse", 10.0, [1, 0], Some(4.4e-2)),
        ("2:1 into coarse", 20.0, [1, 0], Some(9.3e-3)),
        ("1:4 into fine", 10.0, [0, 2], Some(5.6e-2)),
        ("1:4 into fine", 20.0, [0, 2], Some(1.3e-2)),
    ];
    let mut rows = Vec::new();
    let mut series: Vec<Series> = Vec::new();
    let mut found = std::collections::HashMap::new();
    for (name, length, levels, reference) in cases {
        let outcome = run(comm, &Case { length, levels });
        let ratio = 0.5f64.powi(i32::from(levels[0].max(levels[1])));
        rows.push(vec![
            name.to_string(),
            format!("{length}"),
            format!("{:.2e}", outcome.reflected),
            if ratio < 1.0 { format!("{:.2e}", lumped_elements(length, ratio)) } else { "0".into() },
            reference.map_or_else(String::new, |r: f64| format!("{r:.2e}")),
            format!("{:.5}", outcome.transmitted),
        ]);
        found.insert((name, length as u32), (outcome.reflected, outcome.transmitted));
        if series.last().is_none_or(|s| s.name != name) {
            series.push(Series { name: name.to_string(), points: Vec::new(), marks: true });
        }
        if let Some(last) = series.last_mut() {
            last.points.push([length, outcome.reflected]);
        }
        if levels == [0, 2] && length == 20.0 {
            let shown = Series { name: "after the jump".into(), points: outcome.profile, marks: false };
            page.plot("wave_profile", &Chart {
                title: "Velocity after a 1:4 jump at x = 168 H, wave length 20 H",
                labels: ["x / H", "velocity / amplitude"],
                logarithmic: [false, false],
                series: vec![shown],
            });
        }
    }
    for (name, ratio) in [("lumped elements 1:2", 0.5), ("lumped elements 1:4", 0.25)] {
        let points = (0..=60).map(|i| 8.0 + 0.2 * f64::from(i)).map(|l| [l, lumped_elements(l, ratio)]);
        series.push(Series { name: name.into(), points: points.collect(), marks: false });
    }
    page.table(&["jump", "wave length / H", "R", "lumped elements", "GIMP", "transmitted energy"], &rows);
    page.plot("wave_reflection", &Chart {
        title: "Reflected amplitude at a level jump",
        labels: ["wave length / H", "R"],
        logarithmic: [true, true],
        series,
    });
    let (two, four) = (found[&("1:2 into fine", 20)], found[&("1:4 into fine", 20)]);
    page.check("R at 20 cells per wave length, 1:2, at most 1.5e-2", two.0, two.0 <= 1.5e-2);
    page.check("R at 20 cells per wave length, 1:4, at most 2e-2", four.0, four.0 <= 2e-2);
    let fall = found[&("1:2 into fine", 10)].0 / two.0;
    page.check("fall of R from 10 to 20 cells per wave length, at least 3.3", fall, fall >= 3.3);
    let lost = (two.1 - 1.0 + two.0 * two.0).abs().max((four.1 - 1.0 + four.0 * four.0).abs());
    page.check("transmitted energy differs from 1 - R^2 by at most 1e-2", lost, lost <= 1e-2);
}
