//! A pulse of pressure waves in an elastic bar, across a level jump.
//!
//! The bar has c = 1 m/s, rollers on all faces and cells of 1 m (coarse). A wave packet runs to the right into the
//! jump. What its left part then holds beside what it holds in a run without the jump, on a uniform grid with the same
//! time steps, has been reflected: all is linear, so the difference is free of what dispersion and the start do.
//!
//! | file | what it has |
//! |---|---|
//! | this | the bar, measured along it |
//! | `by_definition.rs` | the same by the plain definition, with hanging nodes constrained or free |
//! | `oblique.rs` | a packet that meets the jump at 45 degrees |
mod by_definition;
mod oblique;

use agimp::job::Problem;
use agimp::particle::chunk::{Chunk, Layout};
use agimp::setup;
use partition::comm::Comm;

use crate::page::Page;
use crate::plot::{Chart, Series};
use agimp::solver::{Clock, Requests, Solver};
use by_definition::{Bar, HangingNodes};

/// Half length of the packet in standard deviations of its envelope.
const CUT: f64 = 2.8;
/// Standard deviation of the envelope in wave lengths.
const ENVELOPE: f64 = 1.5;
/// Velocity of the packet, m/s: strains of 1e-6 are linear.
const AMPLITUDE: f64 = 1e-6;

/// Mass, velocity and stress along the bar.
const ALONG: [usize; 3] = [Layout::<2>::MASS, Layout::<2>::VELOCITY, Layout::<2>::STRESS];

/// One run.
#[derive(Clone, Copy)]
struct Case {
    /// Wave length in coarse cells.
    length: f64,
    /// Levels of the left and of the right part.
    levels: [u8; 2],
}

/// Motion at the end.
struct Outcome {
    /// Sum over all particles of `m (v² + stress²) / 2`, with density and wave speed 1 their energy, at the start.
    incident: f64,
    /// Mass, velocity and stress by identifier, left of the jump.
    left: Vec<[f64; 3]>,
    /// Energy right of the jump.
    right: f64,
    /// Positions and velocities, for one line of particles.
    profile: Vec<[f64; 2]>,
    /// How far the transmitted packet is behind the exact one, coarse cells.
    behind: f64,
    /// Greatest velocity of the transmitted packet over that of the exact one.
    amplitude: f64,
}

/// Velocity of a packet at a place along its path and at a distance from its centre, in standard deviations of its envelope.
fn packet(along: f64, distance: f64, length: f64) -> f64 {
    let place = distance.abs();
    if place >= CUT {
        return 0.0;
    }
    // The window ends the packet smoothly.
    let window = 1.0 - (place / CUT) * (place / CUT);
    AMPLITUDE
        * window
        * window
        * (-0.5 * place * place).exp()
        * (std::f64::consts::TAU * along / length).cos()
}

/// Half length of the packet in roots, rounded up.
fn half_length(length: f64) -> f64 {
    (CUT * ENVELOPE * length / 4.0).ceil()
}

/// Way of the packet, coarse cells.
fn way(length: f64) -> f64 {
    8.0 * half_length(length)
}

fn job(case: &Case, dt: f64) -> (String, f64) {
    let half = half_length(case.length);
    let (jump, size) = (8.0 * half, 16.0 * half);
    // A brick has at most 64 roots along an axis; a longer bar takes larger roots, each a level coarser.
    let deeper = u8::from(size > 256.0);
    let edge = 4.0 * f64::from(1 << deeper);
    let levels = case.levels.map(|level| level + deeper);
    let base = levels[0].min(levels[1]);
    let mut regions = String::new();
    for (level, [from, to]) in levels.into_iter().zip([[0.0, jump], [jump, size]]) {
        if level > base {
            regions = fine(level, [from, to], edge);
        }
    }
    let text = elastic([size, edge], edge, base, &regions, dt);
    (text, jump)
}

/// Setting of leaves of a level between two places along the bar, all over its height.
fn fine(level: u8, [from, to]: [f64; 2], height: f64) -> String {
    format!(
        "regions = [{{ level = {level}, shape = {{ kind = \"box\", min = [{}, 0.5], max = [{}, {}] }} }}]",
        from + 0.5,
        to - 0.5,
        height - 0.5
    )
}

/// A job of an elastic medium (E = 1 Pa, nu = 0, 1 kg/m3) that fills a domain of `size` m with roots of `root_edge` m, on leaves of level
/// `base` but in `regions`.
fn elastic(size: [f64; 2], root_edge: f64, base: u8, regions: &str, dt: f64) -> String {
    format!(
        "version = 1\ndimension = 2\ngravity = [0, 0]\n\
         [domain]\nsize = {size:?}\nroot_edge = {root_edge}\n\
         [boundaries]\nx_min = {{ kind = \"slip\" }}\nx_max = {{ kind = \"slip\" }}\n\
         y_min = {{ kind = \"slip\" }}\ny_max = {{ kind = \"slip\" }}\n\
         [tree]\ngraded = false\nbase_level = {base}\n{regions}\n\
         [[materials]]\nname = \"bar\"\ndensity = 1\nmodel = \"fixed_corotated\"\nyoung = 1\npoisson = 0\n\
         [[bodies]]\nname = \"bar\"\nmaterial = \"bar\"\nshape = {{ kind = \"box\", min = [0, 0], max = {size:?} }}\n\
         [numerics]\ntransfer = \"flip\"\nflip = 1.0\n\
         [time]\nend = 1e6\ncfl = 0.5\ndt_max = {dt}\n[output]\nevery = 1e6\n"
    )
}

/// Energy of the small motion of a particle.
fn energy([mass, v, stress]: [f64; 3]) -> f64 {
    0.5 * mass * (v * v + stress * stress)
}

/// Columns of the particles where `side` holds of the place along the bar, in the order of their identifiers.
fn motion<const N: usize>(
    solver: &Solver<2>,
    columns: [usize; N],
    side: impl Fn(f64) -> bool,
) -> Vec<[f64; N]> {
    let mut all = Vec::new();
    for chunk in &solver.chunks {
        let columns = columns.map(|column| chunk.column(column));
        let chosen = (0..chunk.len()).filter(|&p| side(chunk.position(p)[0]));
        all.extend(chosen.map(|p| (chunk.ids()[p], columns.map(|column| column[p]))));
    }
    all.sort_by_key(|(id, _)| *id);
    all.into_iter().map(|(_, state)| state).collect()
}

/// The medium of a job with particles that `set` has changed.
fn started(comm: &Comm, job: &str, set: impl Fn(&mut Chunk<2>, usize)) -> Solver<2> {
    let problem: Problem<2> = crate::problem(job);
    let mut solver = crate::checked(setup::solver(comm, &problem));
    let mut chunks = std::mem::take(&mut solver.chunks);
    for chunk in &mut chunks {
        (0..chunk.len()).for_each(|p| set(chunk, p));
    }
    Solver::new(comm, setup::physics(&problem), solver.forest, chunks, Clock::default())
}

/// The bar with the packet on its way to the jump, and the place of the jump.
fn at_start(comm: &Comm, case: &Case, dt: f64) -> (Solver<2>, f64) {
    let (text, jump) = job(case, dt);
    let solver = started(comm, &text, |chunk, p| {
        let x = chunk.position(p)[0] - 0.5 * jump;
        let v = packet(x, x / (ENVELOPE * case.length), case.length);
        let stretch = 1.0 - v;
        chunk.column_mut(Layout::<2>::VELOCITY)[p] = v;
        chunk.column_mut(Layout::<2>::LEFT_CAUCHY_GREEN)[p] = stretch * stretch;
        chunk.column_mut(Layout::<2>::STRESS)[p] = -v * stretch;
    });
    (solver, jump)
}

/// Root of the reflected over the incident energy: what the left part holds beside what it holds without the jump. Masses stand first.
fn reflection<const N: usize>(
    left: &[[f64; N]],
    uniform: &[[f64; N]],
    energy: impl Fn([f64; N]) -> f64,
    incident: f64,
) -> f64 {
    assert_eq!(left.len(), uniform.len());
    let difference = left
        .iter()
        .zip(uniform)
        .map(|(a, b)| energy(std::array::from_fn(|i| if i == 0 { a[0] } else { a[i] - b[i] })));
    (difference.sum::<f64>() / incident).sqrt()
}

fn run(comm: &Comm, case: &Case, dt: f64) -> Outcome {
    let (mut solver, jump) = at_start(comm, case, dt);
    let incident = motion(&solver, ALONG, |_| true).into_iter().map(energy).sum();
    // The centre of the packet goes to the jump and back.
    while solver.clock.time < jump {
        crate::checked(solver.step(jump, Requests::default()));
    }
    let left = motion(&solver, ALONG, |x| x < jump);
    let right = motion(&solver, ALONG, |x| x >= jump).into_iter().map(energy).sum();
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
    let passed = || profile.iter().filter(|[x, _]| *x >= jump);
    let weight: f64 = passed().map(|[_, v]| v * v).sum();
    let place = passed().map(|[x, v]| x * v * v).sum::<f64>() / weight;
    // The exact packet has gone from half the way before the jump to as far behind it.
    let behind = 0.5 * jump + solver.clock.time - place;
    let amplitude = passed().map(|[_, v]| v.abs()).fold(0.0, f64::max);
    Outcome { incident, left, right, profile, behind, amplitude }
}

/// Reflection by the plain definition, with hanging nodes constrained or free.
fn reflection_by_definition(comm: &Comm, case: &Case, dt: f64, hanging: HangingNodes) -> f64 {
    let of = |levels| {
        let (solver, jump) = at_start(comm, &Case { levels, ..*case }, dt);
        let [roots, _] = solver.forest.brick().roots;
        let root_edge = 2.0 * jump / f64::from(roots);
        let mut bar = Bar::new(&solver, root_edge, [2.0 * jump, root_edge], hanging);
        let incident = bar.before(f64::INFINITY).into_iter().map(energy).sum::<f64>();
        (0..(jump / dt).round() as usize).for_each(|_| bar.step(dt));
        (bar.before(jump), incident)
    };
    let (left, incident) = of(case.levels);
    reflection(&left, &of([case.levels[0]; 2]).0, energy, incident)
}

/// Reflection between linear elements with lumped mass, continuous in time.
fn lumped_elements(length: f64, ratio: f64) -> f64 {
    let angle = |h: f64| (std::f64::consts::PI * h / length).asin().cos();
    ((angle(1.0) - angle(ratio)) / (angle(1.0) + angle(ratio))).abs()
}

/// Runs all cases and writes their section.
pub(crate) fn section(comm: &Comm, page: &mut Page) {
    page.text(
        "## 9 Pressure waves across a level jump\n\n\
         A wave packet (Gaussian envelope, standard deviation 1.5 wave lengths, cut at 2.8 of them by a smooth window; \
         strain 1e-6) runs through an elastic bar (fixed corotated, nu = 0, c = 1) into a level jump. FLIP, 2 x 2 \
         particles per cell, Courant number 0.2 of the fine cells, cells of size H on the coarse side. R is the root of \
         reflected over incident energy; reflected is the difference, on the particles before the jump, to a run on a \
         uniform grid with the same time steps. *Lumped elements* is \
         `(cos t1 - cos t2) / (cos t1 + cos t2)` with `sin ti = pi hi / wave length`, the theory of linear finite \
         elements; *GIMP* is an independent one-dimensional calculation with the FLIP operator of GIMP with the same \
         spacing of particles. When the centre of the reflected packet is back where it started, that of the exact \
         transmitted packet is as far behind the jump: *transmitted* is the energy behind the jump over the incident one, \
         *amplitude* the greatest velocity there over that of the exact packet, *late* the distance between the \
         centres (of v squared) in H, as dispersion slows the packet on its whole way; its share of this way follows. \
         Exact is 1, 1, 0 and 0. *By the jump* is what is left of that share without the mean of the delays on uniform \
         grids of both cell sizes.\n",
    );
    // Reference values of the independent calculation where there are any.
    let cases = [
        ("1:2 into fine", 8.0, [0, 1], Some(7.6e-2)),
        ("1:2 into fine", 10.0, [0, 1], Some(4.7e-2)),
        ("1:2 into fine", 15.0, [0, 1], Some(2.0e-2)),
        ("1:2 into fine", 20.0, [0, 1], Some(1.14e-2)),
        ("2:1 into coarse", 10.0, [1, 0], Some(4.4e-2)),
        ("2:1 into coarse", 20.0, [1, 0], Some(9.3e-3)),
        ("1:4 into fine", 10.0, [0, 2], Some(5.6e-2)),
        ("1:4 into fine", 20.0, [0, 2], Some(1.3e-2)),
        ("4:1 into coarse", 10.0, [2, 0], None),
    ];
    let mut rows = Vec::new();
    let mut series: Vec<Series> = Vec::new();
    let mut found = std::collections::HashMap::new();
    let mut lateness = std::collections::HashMap::new();
    for (name, length, levels, reference) in cases {
        let ratio = 0.5f64.powi(i32::from(levels[0].max(levels[1])));
        let dt = 0.2 * ratio;
        let outcome = run(comm, &Case { length, levels }, dt);
        let uniform = run(comm, &Case { length, levels: [levels[0]; 2] }, dt);
        let reflected = reflection(&outcome.left, &uniform.left, energy, outcome.incident);
        // A finer grid than that is a matter of minutes.
        let by_jump = (ratio == 0.5).then(|| {
            let behind = run(comm, &Case { length, levels: [levels[1]; 2] }, dt).behind;
            (outcome.behind - 0.5 * (uniform.behind + behind)) / way(length)
        });
        let transmitted = outcome.right / outcome.incident;
        rows.push(vec![
            name.to_string(),
            format!("{length}"),
            format!("{reflected:.2e}"),
            format!("{:.2e}", lumped_elements(length, ratio)),
            reference.map_or_else(String::new, |r: f64| format!("{r:.2e}")),
            format!("{transmitted:.4}"),
            format!("{:.3}", outcome.amplitude),
            format!("{:.3}", outcome.behind),
            format!("{:.2} %", 100.0 * outcome.behind / way(length)),
            by_jump.map_or_else(String::new, |share| format!("{:.2} %", 100.0 * share)),
        ]);
        found.insert((name, length as u32), reflected);
        lateness.insert((name, length as u32), by_jump.unwrap_or(f64::NAN));
        if series.last().is_none_or(|s| s.name != name) {
            series.push(Series { name: name.to_string(), points: Vec::new(), marks: true });
        }
        if let Some(last) = series.last_mut() {
            last.points.push([length, reflected]);
        }
        if levels == [0, 2] && length == 20.0 {
            let shown = Series { name: "after the jump".into(), points: outcome.profile, marks: false };
            page.plot(
                "wave_profile",
                &Chart {
                    title: "Velocity after a 1:4 jump at x = 168 H, wave length 20 H",
                    labels: ["x / H", "velocity / amplitude"],
                    logarithmic: [false, false],
                    series: vec![shown],
                },
            );
        }
    }
    for (name, ratio) in [("lumped elements 1:2", 0.5), ("lumped elements 1:4", 0.25)] {
        let points = (0..=60).map(|i| 8.0 + 0.2 * f64::from(i)).map(|l| [l, lumped_elements(l, ratio)]);
        series.push(Series { name: name.into(), points: points.collect(), marks: false });
    }
    page.table(
        &[
            "jump",
            "wave length / H",
            "R",
            "lumped elements",
            "GIMP",
            "transmitted energy",
            "amplitude",
            "late, H",
            "of the way",
            "by the jump",
        ],
        &rows,
    );
    page.plot(
        "wave_reflection",
        &Chart {
            title: "Reflected amplitude at a level jump",
            labels: ["wave length / H", "R"],
            logarithmic: [true, true],
            series,
        },
    );
    let (two, four) = (found[&("1:2 into fine", 20)], found[&("1:4 into fine", 20)]);
    page.line("wave.r.2", two);
    page.line("wave.r.4", four);
    let fall = found[&("1:2 into fine", 10)] / two;
    let late = lateness[&("1:2 into fine", 20)].abs();
    page.line("wave.late", late);
    page.line("wave.fall", fall);
    let [ten, twenty] = [10.0, 20.0].map(|length| {
        let case = Case { length, levels: [0, 1] };
        [HangingNodes::Constrained, HangingNodes::Free]
            .map(|hanging| reflection_by_definition(comm, &case, 0.1, hanging))
    });
    page.line("wave.definition", two / twenty[0] - 1.0);
    page.line("wave.free.10", ten[1]);
    page.line("wave.free.20", twenty[1]);
    page.text(&format!(
        "By the plain definition (linear FLIP with weights found once, cell by cell, which shares no transfer and no constraint with the solver) R is {:.2e} at 10 and {:.2e} at 20 cells per \
         wave length, 1:2. The control with free hanging nodes, which do not interpolate their parents, reflects {:.2e} and {:.2e}.\n",
        ten[0], twenty[0], ten[1], twenty[1]
    ));
    oblique::measure(comm, page);
}
