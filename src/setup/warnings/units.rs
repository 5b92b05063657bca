//! Properties that no matter has, or under which it collapses at once: mostly mistaken units.
use serde_json::Value;

use super::name::NAME;
use crate::geometry::Aabb;
use crate::job::Problem;
use crate::job::problem::{Body, MaterialSetup};
use crate::load::{Kind, Load};
use crate::material::Material;
use crate::setup::particles::seed::{greatest_speed, raster};
use crate::text::{counted, excerpt, number, quantity};

/// Keys of models that are strengths, Pa.
const STRENGTHS: [&str; 3] = ["yield_stress", "cohesion", "preconsolidation_pressure"];
/// Greatest strength over stiffness: metals, soils and rocks have up to 0.05, polymers 0.1.
const STRENGTH: f64 = 0.2;
/// Greatest modulus of hardening over stiffness: metals have up to 0.1.
const HARDENING: f64 = 1.0;
/// Densities from gases to the heaviest metals, kg/m³.
const DENSITIES: [f64; 2] = [1.0, 23_000.0];
/// Density of the lightest foams, kg/m³.
const FOAM: f64 = 5.0;
/// Density of thin gas, kg/m³.
const THIN: f64 = 0.01;
/// Speeds of waves from the softest gels to beyond diamond, m/s.
const WAVES: [f64; 2] = [0.2, 20_000.0];
/// Least number of steps of a meaningful run.
const STEPS: f64 = 100.0;
/// Greatest pressure of a body's weight at its foot over the stiffness of its material.
const WEIGHT: f64 = 0.2;
/// Greatest speed of a tool over that of waves in the material. A blow strains the material by about this.
const TOOL: f64 = 0.5;
/// Greatest speed of a body over that of waves in it.
const BODY: f64 = 2.0;
/// Most bodies that are checked.
const BODIES: usize = 1000;

/// Warns of properties that no material has, and of loads that no material bears.
pub(super) fn look<const D: usize>(problem: &Problem<D>, steps: f64, all: &mut Vec<String>) {
    let materials: Vec<_> = problem.materials.iter().map(|m| m.build()).collect();
    for (index, (setup, material)) in problem.materials.iter().zip(&materials).enumerate() {
        of_material(index, setup, &**material, all);
    }
    for (index, body) in problem.bodies.iter().enumerate().take(BODIES) {
        of_body(problem, index, body, &*materials[body.material], all);
    }
    tools(problem, &materials, all);
    loads(problem, &materials, all);
    if steps < STEPS && problem.quasi_static.is_none() {
        all.push(format!(
            "time: the run takes about {}; expected at least {STEPS}: check time.end, and the units of stiffness and density (Pa, kg/m³)",
            counted(steps.max(1.0) as u64, "step")
        ));
    }
}

fn of_material(index: usize, setup: &MaterialSetup, material: &dyn Material, all: &mut Vec<String>) {
    let (name, wave) = (excerpt(&setup.name, NAME), material.wave_speed());
    let values = serde_json::to_value(&setup.model).unwrap_or_default();
    let young = values.get("young").and_then(Value::as_f64);
    let (stiffness, word) = match young {
        Some(young) => (young, "young"),
        None => (setup.density * wave * wave, "stiffness"),
    };
    for key in STRENGTHS {
        let Some(strength) = values.get(key).and_then(Value::as_f64) else { continue };
        if strength > STRENGTH * stiffness {
            all.push(format!(
                "materials[{index}].{key}: found {} for \"{name}\", {} times its {word} of {}; expected at most {STRENGTH} of it: check the units of both (Pa)",
                quantity(strength, "Pa"),
                number(strength / stiffness, 2),
                quantity(stiffness, "Pa")
            ));
        }
    }
    let hardening = values.get("hardening");
    let modulus = hardening.and_then(|given| given.get("modulus").unwrap_or(given).as_f64());
    if let Some(modulus) = modulus.filter(|modulus| *modulus > HARDENING * stiffness) {
        all.push(format!(
            "materials[{index}].hardening: found a modulus of {} for \"{name}\", {} times its {word} of {}; expected less than that: check the units of both (Pa)",
            quantity(modulus, "Pa"),
            number(modulus / stiffness, 2),
            quantity(stiffness, "Pa")
        ));
    }
    let [gas, most] = DENSITIES;
    let (least, lightest) = match material.is_fluid() {
        _ if setup.is_gas() => (THIN, "a thin gas"),
        true => (gas, "a gas"),
        false => (FOAM, "the lightest foams"),
    };
    if !(least..=most).contains(&setup.density) {
        all.push(format!(
            "materials[{index}].density: found {} kg/m³ for \"{name}\"; expected {least} ({lightest}) to {most} (the heaviest metals): check its unit",
            number(setup.density, 4)
        ));
    }
    let [least, most] = WAVES;
    if !(least..=most).contains(&wave) {
        all.push(format!(
            "materials[{index}]: found a wave speed of {} in \"{name}\"; expected {least} (a gel) to {most} m/s (diamond): check the units of stiffness and density (Pa, kg/m³)",
            quantity(wave, "m/s")
        ));
    }
}

/// The weight of a body, and its speed.
fn of_body<const D: usize>(
    problem: &Problem<D>,
    index: usize,
    body: &Body<D>,
    material: &dyn Material,
    all: &mut Vec<String>,
) {
    let (wave, density) = (material.wave_speed(), problem.materials[body.material].density);
    let (name, key) = (excerpt(&body.name, NAME), problem.key_of_body(index));
    let speed = greatest_speed(problem, body);
    // Gas may well be faster than its sound.
    if speed > BODY * wave && !problem.materials[body.material].is_gas() {
        all.push(format!(
            "{key}.velocity: \"{name}\" moves at {}, {} times the speed of waves in its material; expected at most {BODY} times: check the units of speed, stiffness and density",
            quantity(speed, "m/s"),
            number(speed / wave, 2)
        ));
    }
    let stiffness = density * wave * wave;
    let pressure = density * greatest_fall(problem, body, WEIGHT * wave * wave);
    if pressure > WEIGHT * stiffness {
        all.push(format!(
            "{key}.material: the weight of \"{name}\" is a pressure of {} at its foot, {} of the stiffness of its material ({}); expected at most {WEIGHT}, beyond which it strains by its own size: check the units of stiffness, density and gravity",
            quantity(pressure, "Pa"),
            number(pressure / stiffness, 2),
            quantity(stiffness, "Pa")
        ));
    }
}

/// Greatest acceleration of gravity and of body forces everywhere, times the height of a body along it,
/// m²/s²; approximate, and only as exact as the comparison with `limit` requires.
fn greatest_fall<const D: usize>(problem: &Problem<D>, body: &Body<D>, limit: f64) -> f64 {
    if body.given.is_some() {
        return 0.0;
    }
    let mut greatest = [0.0_f64; D];
    for gravity in (0..problem.stages.len()).map(|stage| problem.gravity_of_stage(stage)) {
        for part in 0..=8 {
            let now = gravity.at(gravity.start + problem.time.end * f64::from(part) / 8.0);
            (0..D).for_each(|a| greatest[a] = greatest[a].max(now[a].abs()));
        }
    }
    let bounds = body.shape.bounds().intersection(&Aabb::new([0.0; D], problem.size()));
    for load in &problem.loads {
        let centre = bounds.centre();
        for time in times(problem, load) {
            let force = load.body_force(&centre, &load.place(&centre, &[0.0; D]), time);
            force.iter().for_each(|force| (0..D).for_each(|a| greatest[a] = greatest[a].max(force[a].abs())));
        }
    }
    let falls = (0..D).map(|a| greatest[a] * (bounds.upper[a] - bounds.lower[a]).max(0.0));
    let Some((axis, fall)) = falls.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else { return 0.0 };
    if fall <= limit {
        return fall;
    }
    // A sheet on a slope is thinner than its bounding box: points of the raster one above the other.
    let mut columns: Vec<([u64; D], u32)> = Vec::new();
    for x in raster(problem, body) {
        let mut column = x.map(f64::to_bits);
        column[axis] = 0;
        match columns.iter_mut().find(|(other, _)| *other == column) {
            Some((_, points)) => *points += 1,
            None => columns.push((column, 1)),
        }
    }
    let points = columns.iter().map(|(_, points)| *points).max().unwrap_or(0);
    fall * f64::from(points) / 9.0
}

/// Times of the run at which a load acts, s: some from its start to its end.
fn times<const D: usize>(problem: &Problem<D>, load: &Load<D>) -> impl Iterator<Item = f64> {
    let from = load.start + load.from.max(0.0);
    let until = (load.start + load.until).min(problem.time.end);
    let is_meant = from.is_finite() && from < until;
    (0..8).filter(move |_| is_meant).map(move |part| (until - from).mul_add(f64::from(part) / 8.0, from))
}

/// Words about what moves faster than a share of the speed of waves in a material: that speed (m/s) and its
/// number.
fn too_fast<const D: usize>(
    problem: &Problem<D>,
    what: &str,
    speed: f64,
    (wave, material): (f64, usize),
    (share, harm): (f64, &str),
) -> String {
    format!(
        "{what} at {}, {} times the speed of waves in \"{}\" ({}); expected at most {share} of it, beyond which it {harm} the material: check the units of speed, stiffness and density",
        quantity(speed, "m/s"),
        number(speed / wave, 2),
        excerpt(&problem.materials[material].name, NAME),
        quantity(wave, "m/s")
    )
}

/// Speed of waves in the softest material of a body, m/s, and its number.
fn softest<const D: usize>(problem: &Problem<D>, materials: &[Box<dyn Material>]) -> Option<(f64, usize)> {
    let bodies = problem.bodies.iter().map(|body| (materials[body.material].wave_speed(), body.material));
    bodies.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Colliders that run into the softest material faster than it can give way.
fn tools<const D: usize>(problem: &Problem<D>, materials: &[Box<dyn Material>], all: &mut Vec<String>) {
    let Some(softest) = softest(problem, materials) else { return };
    for (index, collider) in problem.colliders.iter().enumerate() {
        let speed = collider.greatest_speed(&collider.state_at(0.0), &problem.size(), 0.0);
        let limit = if collider.free().is_some() { BODY } else { TOOL };
        if speed > limit * softest.0 {
            let what = format!("colliders[{index}].motion: \"{}\" moves", excerpt(&collider.name, NAME));
            all.push(too_fast(problem, &what, speed, softest, (limit, "crushes")));
        }
    }
}

/// Grips that pull the softest material faster than it can follow.
fn loads<const D: usize>(problem: &Problem<D>, materials: &[Box<dyn Material>], all: &mut Vec<String>) {
    let Some(softest) = softest(problem, materials) else { return };
    for (index, load) in problem.loads.iter().enumerate() {
        let Kind::Velocity(prescribed) = &load.kind else { continue };
        let centre = load.region.as_ref().map_or([0.0; D], |region| region.bounds().centre());
        let place = load.place(&centre, &[0.0; D]);
        let speeds = times(problem, load).map(|time| {
            let squares = prescribed.iter().flatten().map(|v| v.at(place, time - load.start).powi(2));
            squares.sum::<f64>().sqrt()
        });
        let speed = speeds.fold(0.0, f64::max);
        if speed > TOOL * softest.0 {
            let what = format!("loads[{index}]: \"{}\" moves material", excerpt(&load.name, NAME));
            all.push(too_fast(problem, &what, speed, softest, (TOOL, "tears or crushes")));
        }
    }
}
