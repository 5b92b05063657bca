//! Slips of those who model ground: unit weights for densities, radians for degrees, gravity upwards, water
//! that reaches nothing, points above the ground.
use serde_json::Value;

use super::name::NAME;
use crate::geometry::Aabb;
use crate::job::Problem;
use crate::job::problem::MaterialSetup;
use crate::load::{Gravity, Up};
use crate::text::{excerpt, number, place, quantity};

/// Models of ground.
const MODELS: [&str; 5] = ["mohr_coulomb", "drucker_prager", "tresca", "cam_clay", "non_associated_cam_clay"];
/// Density of the lightest ground, peat without water, kg/m³.
const LIGHTEST: f64 = 100.0;
/// Least angle of friction that is meant, degrees: no ground has less, and 90 degrees are 1.57 rad.
const ANGLE: f64 = 1.6;

/// Warns of values that ground does not have, and of places where none is.
pub(super) fn look<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    for (index, setup) in problem.materials.iter().enumerate() {
        of_material(index, setup, all);
    }
    gravity(problem, all);
    water(problem, all);
    tracks(problem, all);
}

fn of_material(index: usize, setup: &MaterialSetup, all: &mut Vec<String>) {
    let values = serde_json::to_value(&setup.model).unwrap_or_default();
    let model = values.get("model").and_then(Value::as_str).unwrap_or_default();
    if !MODELS.contains(&model) {
        return;
    }
    let name = excerpt(&setup.name, NAME);
    if setup.density < LIGHTEST {
        all.push(format!(
            "materials[{index}].density: found {} kg/m³ for \"{name}\", a material of ground; expected at least {LIGHTEST}: {0} kN/m³ are {} kg/m³",
            number(setup.density, 4),
            number(setup.density * 1000.0 / 9.81, 3)
        ));
    }
    let angle = values.get("friction_angle").and_then(Value::as_f64).unwrap_or_default();
    if angle > 0.0 && angle < ANGLE {
        all.push(format!(
            "materials[{index}].friction_angle: found {} degrees for \"{name}\"; expected more: angles are in degrees, and {0} rad are {} degrees",
            number(angle, 4),
            number(angle.to_degrees(), 3)
        ));
    }
}

/// Gravity that points up along the last axis, always and alone.
fn gravity<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let parts = |gravity: &Gravity<D>| -> Vec<[f64; D]> {
        let time = |part: u32| gravity.start + problem.time.end * f64::from(part) / 8.0;
        (0..=8).map(|part| gravity.at(time(part))).collect()
    };
    let values: Vec<[f64; D]> =
        (0..problem.stages.len()).flat_map(|stage| parts(problem.gravity_of_stage(stage))).collect();
    let is_up = |g: &[f64; D]| g[D - 1] >= 0.0 && g[..D - 1].iter().all(|g| *g == 0.0);
    let greatest = values.iter().map(|g| g[D - 1]).fold(0.0, f64::max);
    if greatest > 0.0 && values.iter().all(is_up) {
        all.push(format!(
            "gravity: found {} along +{}, which pictures show as up; expected a negative number for weight",
            quantity(greatest, "m/s²"),
            ["x", "y", "z"][D - 1]
        ));
    }
}

/// A water table below all bodies, at all times.
fn water<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let Some(water) = problem.water().filter(|water| water.quantity().is_some()) else { return };
    let (up, end) = (water.up, problem.time.end);
    let reaches = |time: f64| {
        problem.bodies.iter().any(|body| {
            let bounds = body.shape.bounds();
            let foot = foot(&bounds, up);
            // At the foot of the body along a row of places: the table may be inclined.
            (0..=8).any(|part| {
                let share = f64::from(part) / 8.0;
                let mut x: [f64; D] = std::array::from_fn(|a| {
                    share.mul_add(bounds.upper[a] - bounds.lower[a], bounds.lower[a])
                });
                x[up.axis] = foot;
                water.is_below(problem.place(&x), time)
            })
        })
    };
    let is_given = problem.bodies.iter().any(|body| body.given.is_some());
    if !is_given && !problem.bodies.is_empty() && !(0..=8).any(|part| reaches(end * f64::from(part) / 8.0)) {
        all.push(
            "water: found no body that reaches below the water table; expected one: check the level, m along the vertical axis in the coordinates of the job"
                .into(),
        );
    }
}

/// Tracks whose point lies in no body.
fn tracks<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    if problem.bodies.iter().any(|body| body.given.is_some()) {
        return;
    }
    for (index, track) in problem.tracks.iter().enumerate() {
        let counts = |body: usize| track.bodies.as_ref().is_none_or(|all| all.contains(&(body as u16)));
        let bodies = problem.bodies.iter().enumerate().filter(|(body, _)| counts(*body));
        let nearest = bodies.map(|(_, body)| body.shape.distance(&track.point)).fold(f64::INFINITY, f64::min);
        let cell = problem.cell_edge(problem.tree.base_level);
        if nearest.is_finite() && nearest > cell {
            all.push(format!(
                "tracks[{index}].point: \"{}\" lies {} from the nearest body; expected a point in one: the track follows the particle nearest to {}",
                excerpt(&track.name, NAME),
                quantity(nearest, "m"),
                place(&problem.place(&track.point)[..D])
            ));
        }
    }
}

/// Coordinate (m) of the lowest point of bounds along the vertical.
pub(super) fn foot<const D: usize>(bounds: &Aabb<D>, up: Up) -> f64 {
    if up.sign > 0.0 { bounds.lower[up.axis] } else { bounds.upper[up.axis] }
}
