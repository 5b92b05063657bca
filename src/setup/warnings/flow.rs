//! Sand that collapses, and a transfer that takes energy from its flow.
use super::name::NAME;
use crate::geometry::Aabb;
use crate::job::Problem;
use crate::job::problem::{Body, Transfer};
use crate::material::parameters::Parameters;
use crate::text::{count, excerpt, number};

/// Share of the run-out that is lost at a body one cell high, for each tenfold number of steps of its fall:
/// the mean of 1.8 to 3.6 with columns of 8 to 64 cells in the plane and as rings (docs/verification.md, 6).
const LOSS: f64 = 2.8;
/// Steps of a fall up to which nothing is lost.
const FEW_STEPS: f64 = 115.0;
/// Loss from which it is told.
const NOTABLE: f64 = 0.15;

/// Warns of sand with a free side that falls in many steps and on few cells.
pub(super) fn look<const D: usize>(problem: &Problem<D>, steps: f64, all: &mut Vec<String>) {
    let is_affine = matches!(problem.transfer, Transfer::Apic | Transfer::Tpic);
    if !is_affine || problem.quasi_static.is_some() || !problem.colliders.is_empty() {
        return;
    }
    let weight = -problem.gravity.at(problem.time.end)[D - 1];
    let shaped = problem.bodies.iter().enumerate();
    for (index, body) in shaped.filter(|(_, body)| body.given.is_none() && body.fed.is_none()) {
        let bounds = body.shape.bounds();
        let height = bounds.upper[D - 1] - bounds.lower[D - 1];
        let is_sand = flows(&problem.materials[body.material].model);
        if weight <= 0.0 || !is_sand || !has_free_side(problem, body, &bounds, height) {
            continue;
        }
        let cells = height / problem.cell_edge(problem.finest_level_refined());
        let fall = (height / weight).sqrt() * steps / problem.time.end;
        let loss = LOSS / cells * (fall / FEW_STEPS).log10();
        if loss >= NOTABLE {
            all.push(format!(
                "bodies[{index}]: \"{}\" has a free side and {} cells in its height, and falls in about {} steps; APIC takes energy from its flow in each of them, so it runs out about {} % less far than on fine cells; expected finer cells, a lesser young, or numerics = {{ transfer = \"flip\", flip = 1 }}",
                excerpt(&body.name, NAME),
                number(cells, 2),
                count(rounded(fall)),
                number(100.0 * loss.min(0.5), 1),
            ));
        }
    }
}

/// A number of steps with two digits.
fn rounded(steps: f64) -> u64 {
    let unit = 10_f64.powf(steps.log10().floor() - 1.0);
    ((steps / unit).round() * unit) as u64
}

/// Whether it is sand: friction, and no cohesion.
fn flows(model: &Parameters) -> bool {
    match model {
        Parameters::DruckerPrager(parameters) => parameters.cohesion == 0.0,
        Parameters::MohrCoulomb(parameters) => parameters.cohesion == 0.0,
        _ => false,
    }
}

/// Whether nothing is beside a body within its height: no face of the domain, and no other body.
fn has_free_side<const D: usize>(
    problem: &Problem<D>,
    body: &Body<D>,
    bounds: &Aabb<D>,
    height: f64,
) -> bool {
    let size = problem.size();
    (0..D - 1).flat_map(|k| [(k, 0), (k, 1)]).any(|(k, side)| {
        let mut beside = *bounds;
        match side {
            0 => (beside.lower[k], beside.upper[k]) = (bounds.lower[k] - height, bounds.lower[k]),
            _ => (beside.lower[k], beside.upper[k]) = (bounds.upper[k], bounds.upper[k] + height),
        }
        let is_inside = beside.lower[k] >= 0.0 && beside.upper[k] <= size[k];
        let mut others = problem.bodies.iter().filter(|other| !std::ptr::eq(*other, body));
        is_inside && others.all(|other| other.shape.bounds().intersection(&beside).is_empty())
    })
}
