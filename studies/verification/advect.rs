//! A block carried through regions of two and three levels, against the exact answer.
use std::fmt::Write as _;

use agimp::job::Problem;
use agimp::particle::chunk::Layout;
use agimp::setup;
use partition::comm::Comm;

use crate::page::Page;
use agimp::solver::{Requests, Solver};

/// Velocity of the block, m/s.
const VELOCITY: [f64; 2] = [1.0, 0.125];
/// Pixels per metre of pictures.
const SCALE: f64 = 180.0;

fn job(regions: &str, transfer: &str) -> String {
    format!(
        "version = 1\ndimension = 2\ngravity = [0, 0]\n\
         [domain]\nsize = [4, 2]\nroot_edge = 1\n[tree]\ngraded = false\nbase_level = 1\n{regions}\n\
         [[materials]]\nname = \"rubber\"\ndensity = 1000\nmodel = \"neo_hookean\"\nyoung = 1e4\npoisson = 0.3\n\
         [[bodies]]\nname = \"block\"\nmaterial = \"rubber\"\n\
         shape = {{ kind = \"box\", min = [0.25, 0.625], max = [0.875, 1.25] }}\nvelocity = [1, 0.125]\n\
         [numerics]\n{transfer}\n[time]\nend = 2.5\n\
         [output]\nevery = 2.5\nfields = [\"displacement\"]\n"
    )
}

/// Greatest errors over all particles: position (m), velocity (m/s), stress (Pa).
struct Errors {
    position: f64,
    velocity: f64,
    stress: f64,
}

/// Positions of all particles.
fn positions(solver: &Solver<2>) -> Vec<[f64; 2]> {
    solver.chunks.iter().flat_map(|chunk| (0..chunk.len()).map(|p| chunk.position(p))).collect()
}

/// Displacements are all that particles carry, also those that have split.
fn errors(solver: &Solver<2>) -> Errors {
    let mut errors = Errors { position: 0.0, velocity: 0.0, stress: 0.0 };
    for chunk in &solver.chunks {
        for p in 0..chunk.len() {
            for k in 0..2 {
                let way = VELOCITY[k] * solver.clock.time;
                errors.position = errors.position.max((chunk.carried(k)[p] - way).abs());
                let v = chunk.column(Layout::<2>::VELOCITY + k)[p];
                errors.velocity = errors.velocity.max((v - VELOCITY[k]).abs());
            }
            for c in 0..Layout::<2>::SYMMETRIC {
                errors.stress = errors.stress.max(chunk.column(Layout::<2>::STRESS + c)[p].abs());
            }
        }
    }
    errors
}

/// Leaves, and the particles at the start and at the end.
fn picture(solver: &Solver<2>, start: &[[f64; 2]]) -> String {
    let (width, height) = (4.0 * SCALE, 2.0 * SCALE);
    let mut svg = format!("<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}'>\n");
    for leaf in solver.forest.leaves() {
        let edge = SCALE / f64::from(1u32 << leaf.level);
        let [x, y] = leaf.coord.map(|c| f64::from(c) * edge);
        let top = height - y - edge;
        let _ = writeln!(
            svg,
            "<rect x='{x:.1}' y='{top:.1}' width='{edge:.1}' height='{edge:.1}' fill='white' stroke='#bbb'/>"
        );
    }
    for (points, colour) in [(start, "#999999"), (&positions(solver), "#1b6ca8")] {
        for [x, y] in points {
            let (x, y) = (x * SCALE, height - y * SCALE);
            let _ = writeln!(svg, "<circle cx='{x:.1}' cy='{y:.1}' r='1.4' fill='{colour}'/>");
        }
    }
    svg + "</svg>\n"
}

/// Runs all cases and writes their section.
pub(crate) fn section(comm: &Comm, page: &mut Page) {
    page.text(
        "## 5 A block carried through level jumps\n\n\
         A free elastic block (E = 10 kPa, 1000 kg/m3) flies 2.5 m with (1, 0.125) m/s. Exact: every particle moves by \
         velocity times time, without stress. Greatest errors of any particle; mass on real nodes against mass of \
         particles.\n",
    );
    let two = "regions = [{ level = 2, shape = { kind = \"box\", min = [1.5, 0], max = [2.4, 1] } }]";
    let three = "regions = [{ level = 2, shape = { kind = \"box\", min = [1, 0], max = [1.9, 0.9] } }, \
                 { level = 3, shape = { kind = \"box\", min = [2, 0], max = [2.9, 2] } }]";
    let mut rows = Vec::new();
    let mut worst: f64 = 0.0;
    for (levels, regions) in [("2", two), ("3, jump of two", three)] {
        for transfer in ["apic", "tpic", "flip", "xpic"] {
            let problem: Problem<2> = crate::problem(&job(regions, &format!("transfer = \"{transfer}\"")));
            let mut solver = crate::checked(setup::solver(comm, &problem));
            let start = positions(&solver);
            while solver.clock.time < problem.time.end {
                crate::checked(solver.step(problem.time.end, Requests::default()));
                crate::checked(solver.regrid());
            }
            let Errors { position, velocity, stress } = errors(&solver);
            let grid = crate::checked(solver.grid_totals());
            let mass = (grid.mass / solver.particle_totals().mass - 1.0).abs();
            worst = worst.max(position).max(velocity).max(mass);
            rows.push(vec![
                levels.to_string(),
                transfer.to_string(),
                format!("{}", solver.clock.step),
                format!("{position:.1e}"),
                format!("{velocity:.1e}"),
                format!("{stress:.1e}"),
                format!("{mass:.1e}"),
            ]);
            if levels.starts_with('3') && transfer == "apic" {
                let title = "The block at the start (grey) and the end (blue), and the leaves";
                page.picture("advect", title, &picture(&solver, &start));
            }
        }
    }
    page.table(&["levels", "transfer", "steps", "position, m", "velocity, m/s", "stress, Pa", "mass"], &rows);
    page.line("advect", worst);
}
