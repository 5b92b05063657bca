//! Bodies that spin freely across three levels.
use agimp::exact_sum::ExactSum;
use agimp::job::{AnyProblem, Problem};
use agimp::particle::chunk::Layout;
use agimp::setup;
use partition::comm::Comm;

use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::spinning::{CUBE, SQUARE};
use agimp::solver::{Requests, Solver};

/// The stiff and fast version of a set-up: E = 1 MPa, and ten times the angular velocity.
fn fast(text: &str) -> String {
    let text = text.replace("young = 1e4", "young = 1e6").replace("velocity = [0.01, 0.02, -0.01]\n", "");
    let text = text.replace("angular_velocity = [0.3, -0.2, 1]", "angular_velocity = [3, -2, 10]");
    text.replace("angular_velocity = 1\n", "angular_velocity = 10\n").replace("dt_max = 1e3\n", "")
}

/// Centre of mass, and `Σ m |v|`.
fn centre<const D: usize>(comm: &Comm, solver: &Solver<D>) -> ([f64; D], f64) {
    let mut sums = vec![ExactSum::new(); 2 + D];
    for chunk in &solver.chunks {
        for p in 0..chunk.len() {
            let (m, x) = (chunk.column(Layout::<D>::MASS)[p], chunk.position(p));
            let speed =
                (0..D).map(|k| chunk.column(Layout::<D>::VELOCITY + k)[p].powi(2)).sum::<f64>().sqrt();
            sums[0].add(m);
            sums[1].add(m * speed);
            (0..D).for_each(|k| sums[2 + k].add(m * x[k]));
        }
    }
    ExactSum::sum_over_ranks(comm, &mut sums);
    (std::array::from_fn(|k| sums[2 + k].to_f64() / sums[0].to_f64()), sums[1].to_f64())
}

fn distance<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    (0..N).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>().sqrt()
}

/// Greatest distance of a particle from `point`: how far the body has come apart.
fn farthest<const D: usize>(solver: &Solver<D>, point: [f64; D]) -> f64 {
    let chunks = solver.chunks.iter();
    let each = chunks.flat_map(|chunk| (0..chunk.len()).map(|p| distance(chunk.position(p), point)));
    each.fold(0.0, f64::max)
}

struct Outcome {
    row: Vec<String>,
    /// Greatest relative drift of angular and linear momentum.
    drift: f64,
    /// Greatest distance of the centre of mass from where it was, m.
    centre: f64,
    /// Turns, and kinetic energy over that of the start.
    energy: Vec<[f64; 2]>,
    /// Turns, and relative drift of angular momentum.
    angular: Vec<[f64; 2]>,
}

/// Spins a body with angular velocity `speed` for some steps.
fn run<const D: usize>(comm: &Comm, text: &str, name: &str, speed: f64, steps: u64) -> Outcome
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let mut solver = crate::checked(setup::solver(comm, &crate::problem::<D>(text)));
    let before = crate::checked(solver.grid_totals());
    let kinetic = solver.particle_totals().kinetic;
    let (start, scale) = centre(comm, &solver);
    let (mut drift, mut moved): (f64, f64) = (0.0, 0.0);
    let (mut energy, mut angular) = (Vec::new(), Vec::new());
    let mut momentum: f64 = 0.0;
    for step in 1..=steps {
        crate::checked(solver.step(f64::MAX, Requests::default()));
        crate::checked(solver.regrid());
        if step % (steps / 200) == 0 {
            let turns = speed * solver.clock.time / std::f64::consts::TAU;
            let now = crate::checked(solver.grid_totals());
            let turn = distance(now.angular_momentum, before.angular_momentum)
                / distance(before.angular_momentum, [0.0; 3]);
            momentum = momentum.max(distance(now.momentum, before.momentum) / scale);
            drift = drift.max(turn);
            moved = moved.max(distance(centre(comm, &solver).0, start));
            energy.push([turns, solver.particle_totals().kinetic / kinetic]);
            angular.push([turns, turn.max(1e-17)]);
        }
    }
    let turns = speed * solver.clock.time / std::f64::consts::TAU;
    let kept = energy.last().map_or(1.0, |last| last[1]);
    let first = energy.iter().take_while(|point| point[0] <= 1.0).last().map_or(1.0, |point| point[1]);
    let row = vec![
        name.to_string(),
        format!("{}", solver.particle_totals().count),
        format!("{steps}"),
        format!("{turns:.1}"),
        format!("{momentum:.1e}"),
        format!("{drift:.1e}"),
        format!("{moved:.1e}"),
        format!("{:.2} %", 100.0 * (1.0 - first)),
        format!("{:.2} %", 100.0 * (1.0 - kept.powf(1.0 / turns))),
        format!("{:.2}", farthest(&solver, start)),
    ];
    Outcome { row, drift: drift.max(momentum), centre: moved, energy, angular }
}

/// Runs all cases and writes their section.
pub(crate) fn section(comm: &Comm, page: &mut Page) {
    page.text(
        "## 10 Free spin across level jumps\n\n\
         A square (plane strain) and a cube of edge 1 m (1000 kg/m3, E = 1 MPa, 10 rad/s) spin freely about a point \
         where regions of three levels meet, among them a jump of two levels. Cells of both: 1/4, 1/8 and 1/16 m. Momenta are summed over the real nodes after P2G, so what APIC \
         particles carry in their affine part is included; with the other transfers the angular momentum is that of \
         points. The start without stress sets the bodies swinging; the loss of kinetic energy of the first turn \
         contains what goes into this. Particles of coarse leaves split where they turn into finer ones; where they did not, the square on half the cells came apart within 4.6 turns.\n",
    );
    let (square, cube) = (fast(SQUARE), fast(CUBE));
    let with = |transfer: &str| square.replace("transfer = \"apic\"", transfer);
    let fine = square.replace("root_edge = 1", "root_edge = 0.5");
    let start = square.find("graded = false").unwrap_or_default();
    let end = square.find("[[materials]]").unwrap_or_default();
    let uniform = format!("{}base_level = 2\n{}", &square[..start], &square[end..]);
    let names = [
        "square, APIC",
        "square, TPIC",
        "square, FLIP",
        "square, XPIC(3)",
        "square, APIC, half the cells",
        "square, APIC, uniform 1/16 m",
        "cube, APIC",
    ];
    let outcomes = [
        run::<2>(comm, &square, names[0], 10.0, 10_000),
        run::<2>(comm, &with("transfer = \"tpic\""), names[1], 10.0, 2000),
        run::<2>(comm, &with("transfer = \"flip\"\nflip = 1.0"), names[2], 10.0, 2000),
        run::<2>(comm, &with("transfer = \"xpic\"\nxpic_order = 3"), names[3], 10.0, 2000),
        run::<2>(comm, &fine, names[4], 10.0, 10_000),
        run::<2>(comm, &uniform, names[5], 10.0, 10_000),
        run::<3>(comm, &cube, names[6], 113f64.sqrt(), 10_000),
    ];
    let rows: Vec<Vec<String>> = outcomes.iter().map(|outcome| outcome.row.clone()).collect();
    page.table(
        &[
            "body, transfer",
            "particles",
            "steps",
            "turns",
            "momentum drift",
            "angular momentum drift",
            "centre of mass moved, m",
            "kinetic energy lost in the first turn",
            "per turn, mean",
            "farthest particle, m",
        ],
        &rows,
    );
    let chart = |pick: fn(&Outcome) -> &Vec<[f64; 2]>| -> Vec<Series> {
        let named = names.iter().zip(&outcomes);
        let all =
            named.map(|(name, o)| Series { name: (*name).into(), points: pick(o).clone(), marks: false });
        all.collect()
    };
    page.plot(
        "spin_angular",
        &Chart {
            title: "Drift of angular momentum",
            labels: ["turns", "relative drift"],
            logarithmic: [false, true],
            series: chart(|outcome| &outcome.angular),
        },
    );
    page.plot(
        "spin_energy",
        &Chart {
            title: "Kinetic energy of particles",
            labels: ["turns", "over that of the start"],
            logarithmic: [false, false],
            series: chart(|outcome| &outcome.energy),
        },
    );
    let drift = [0, 4, 5, 6].map(|i: usize| outcomes[i].drift).into_iter().fold(0.0, f64::max);
    page.line("spin.drift", drift);
    let moved = outcomes.iter().map(|outcome| outcome.centre).fold(0.0, f64::max);
    page.line("spin.centre", moved);
}
