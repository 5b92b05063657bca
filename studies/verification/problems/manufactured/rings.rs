//! The generalised vortex (Kamojjala et al. 2015) and the expanding ring (Wallstedt and Guilkey 2008).
use std::f64::consts::PI;

use super::{FLIP, Study, show};
use crate::page::Page;
use crate::runs::Runs;

/// Both amplitudes; that of the ring in m.
const AMPLITUDE: f64 = 0.1;

/// Of the vortex, from the lower corner of the domain along both axes, m.
const CENTRE: f64 = 1.6;

/// Where what was at a place of the undeformed body is at a time.
type Exact = fn([f64; 2], f64) -> [f64; 2];

/// Where what was at a place of the undeformed vortex is; both from the lower corner of the domain.
fn in_vortex(at: [f64; 2], time: f64) -> [f64; 2] {
    let at = at.map(|x| x - CENTRE);
    let radius = at[0].hypot(at[1]);
    let share = ((4.0 * radius - 5.0) * (4.0 * radius - 3.0)).powi(2);
    let (sine, cosine) = (AMPLITUDE * (PI * time).sin() * share).sin_cos();
    [CENTRE + cosine * at[0] - sine * at[1], CENTRE + sine * at[0] + cosine * at[1]]
}

/// The same of the ring.
fn in_ring(at: [f64; 2], time: f64) -> [f64; 2] {
    let (inner, outer) = (0.4, 0.6);
    let radius = at[0].hypot(at[1]);
    let below = outer - 3.0 * inner;
    let [c1, c2, c3] = [
        -6.0 * inner / (outer * below),
        3.0 * (outer + inner) / (outer * outer * below),
        -2.0 / (outer * outer * below),
    ];
    let stretch = 1.0 + AMPLITUDE * (100.0 * PI * time).sin() * ((c3 * radius + c2) * radius + c1);
    at.map(|x| stretch * x)
}

/// Root mean square of the errors of places over the amplitude, weighted with mass; that of the worst output.
/// Particles carry their displacement, also those that split.
fn error(runs: &Runs, job: &str, name: &str, settings: &[String], exact: Exact) -> f64 {
    let results = runs.run(job, name, settings);
    let mut worst: f64 = 0.0;
    for number in 1..results.outputs() {
        let time = results.time(number);
        let [places, displacements] =
            ["position", "carried"].map(|field| results.particles(number, field, 2));
        let masses = results.particles(number, "mass", 1);
        let (mut sum, mut mass) = (0.0, 0.0);
        for ((x, u), m) in places.iter().zip(&displacements).zip(&masses) {
            let exact = exact([x[0] - u[0], x[1] - u[1]], time);
            sum += m[0] * ((x[0] - exact[0]).powi(2) + (x[1] - exact[1]).powi(2));
            mass += m[0];
        }
        worst = worst.max((sum / mass).sqrt() / AMPLITUDE);
    }
    worst
}

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "*Generalised vortex* ([job](../jobs/verification/vortex.toml)): a ring of 0.75 to 1.25 m (neo-Hookean, E = 1 kPa, nu = 0.3, 1000 kg/m3) is turned by \
         alpha = A sin(pi t) (4 R - 5)^2 (4 R - 3)^2 for one second, A = 0.1: shear up to 0.7, no change of volume, no traction on the rims (Kamojjala et al. 2015). *Expanding ring* ([job](../jobs/verification/expanding_ring.toml)): a quarter of a ring of 0.4 to \
         0.6 m (E = 10 MPa, nu = 0) breathes with u = A sin(100 pi t) (c3 R^3 + c2 R^2 + c1 R), A = 0.1, for one period (Wallstedt and Guilkey 2008). Both forces agree with tables of an independent code. The error is the root mean square \
         over the volume, of the worst of all outputs, over A; FLIP, Courant number 0.1. *2:1* has cells of half the size on one side of a line through the middle of the ring (x < 0 in the vortex, y < x in the ring), counted by the coarse cells. Exercises shear, curved free surfaces and boxes that stay parallel to the axes.\n",
    );
    let problems: [(&str, &str, Exact, f64, &str); 2] = [
        (
            "vortex",
            "verification/vortex",
            in_vortex,
            10.0,
            "[[-1.6, -1.6], [0, -1.6], [0, 1.6], [-1.6, 1.6]]",
        ),
        ("ring", "verification/expanding_ring", in_ring, 20.0, "[[0, 0], [0.8, 0], [0.8, 0.8]]"),
    ];
    for (name, job, exact, coarsest, half) in problems {
        let mut studies = Vec::new();
        for (case, is_graded) in [("uniform", false), ("2:1", true)] {
            // The vortex takes minutes with cells half as large.
            let meshes = match (runs.is_full(), is_graded || name == "vortex") {
                (true, false) => 4,
                (true, true) => 3,
                (false, _) => 2,
            };
            let points = (0..meshes).map(|level| {
                let mut settings: Vec<String> = FLIP.iter().map(|setting| (*setting).to_owned()).collect();
                settings.push(format!("tree.base_level={level}"));
                let fine = format!(
                    "tree.regions=[{{ level = {}, shape = {{ kind = \"polygon\", points = {half} }} }}]",
                    level + 1
                );
                settings.extend(is_graded.then_some(fine));
                let cells = coarsest * f64::from(1_u32 << level);
                (cells, error(runs, job, &format!("{name}_{is_graded}_{cells}"), &settings, exact))
            });
            let study = Study { name: case.into(), points: points.collect() };
            let id = if is_graded { format!("{name}.2_1") } else { name.to_owned() };
            if runs.is_full() {
                page.line(&format!("mms.order.{id}"), study.order_of_three());
            }
            if let Some(at_40) = study.at(40.0) {
                page.line(&format!("mms.error.{id}"), at_40);
            }
            studies.push(study);
        }
        let title = if name == "vortex" { "Vortex: error over A" } else { "Expanding ring: error over A" };
        show(page, name, title, studies);
    }
}
