//! Elastic bodies that a job stretches further than particles follow.
use super::name::NAME;
use crate::boundary::Contact;
use crate::boundary::vector::length;
use crate::geometry::{Aabb, common_point};
use crate::job::Problem;
use crate::job::problem::{Body, BoxPolicy};
use crate::load::{CarriedForce, Kind, Load};
use crate::material::parameters::Parameters;
use crate::quantity::Quantity;
use crate::setup::particles::seed::raster;
use crate::text::{excerpt, number, quantity};

/// Greatest traction over Young's modulus: beyond, the outermost particles may come off; measured.
const TRACTION: f64 = 0.45;
/// Stretch up to which elastic bodies hold together whose particles are halved; measured, see
/// `docs/known-limits.md`.
const HELD: f64 = 3.2;
/// The same where they are not.
const HELD_WHOLE: f64 = 2.0;
/// Times of a run at which loads and motions are evaluated.
const TIMES: u32 = 32;

/// Warns of elastic bodies that are drawn, thrown or pulled apart.
pub(super) fn look<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let shaped = problem.bodies.iter().enumerate();
    for (index, body) in shaped.filter(|(_, body)| body.given.is_none() && body.fed.is_none()) {
        let Some(young) = young(&problem.materials[body.material].model) else { continue };
        let (limit, halved) = match problem.boxes {
            BoxPolicy::Volume { .. } => (HELD, ""),
            BoxPolicy::Fixed | BoxPolicy::Cell => (HELD_WHOLE, " and boxes = \"volume\""),
        };
        let density = problem.materials[body.material].density;
        let thrown = 1.0 + spread(problem, body) / (young / density).sqrt();
        let (stretch, by) = match between_grips(problem, body) {
            Some((stretch, grips)) if stretch > thrown => (stretch, format!("the grips {grips}")),
            _ => (thrown, "its own velocity".into()),
        };
        if stretch > limit {
            all.push(format!(
                "bodies[{index}]: \"{}\" is stretched about {} times by {by}; bodies hold together up to about {limit}, beyond which it may tear: more particles_per_cell{halved} carry it further",
                excerpt(&body.name, NAME),
                number(stretch, 2)
            ));
        }
    }
    for (index, load) in problem.loads.iter().enumerate() {
        of_load(problem, index, load, all);
    }
}

/// Young's modulus of a material that is elastic at all strains, Pa.
fn young(model: &Parameters) -> Option<f64> {
    match model {
        Parameters::NeoHookean(elastic) | Parameters::FixedCorotated(elastic) => Some(elastic.young),
        Parameters::Hencky(elastic) if elastic.damage.is_none() => Some(elastic.young),
        _ => None,
    }
}

/// Half the greatest difference between velocities of a body, m/s.
fn spread<const D: usize>(problem: &Problem<D>, body: &Body<D>) -> f64 {
    if !body.velocity.iter().any(Quantity::depends_on_place) {
        return 0.0;
    }
    let velocity = |x: [f64; D]| body.velocity.each_ref().map(|c| c.at(problem.place(&x), 0.0));
    let bounds = Aabb::of_points(raster(problem, body).map(velocity));
    if bounds.lower[0] <= bounds.upper[0] { bounds.half_diagonal() } else { 0.0 }
}

/// A load or collider that grips a part of a body, and moves it.
struct Grip<const D: usize> {
    /// In words.
    name: String,
    bounds: Aabb<D>,
    /// Axes along which it holds.
    axes: [bool; D],
    /// Its displacement at each of [`times`], m.
    ways: Vec<[f64; D]>,
}

/// Times at which motions are evaluated, s.
fn times<const D: usize>(problem: &Problem<D>) -> impl Iterator<Item = f64> {
    let end = problem.time.end;
    (0..=TIMES).map(move |part| end * f64::from(part) / f64::from(TIMES))
}

/// The greatest stretch of a body between two grips that part, with their names.
fn between_grips<const D: usize>(problem: &Problem<D>, body: &Body<D>) -> Option<(f64, String)> {
    let grips = grips(problem, body);
    let mut greatest: Option<(f64, String)> = None;
    for (number, first) in grips.iter().enumerate() {
        for second in &grips[number + 1..] {
            let stretch = stretch(first, second);
            if stretch > greatest.as_ref().map_or(1.0, |(most, _)| *most) {
                greatest = Some((stretch, format!("{} and {}", first.name, second.name)));
            }
        }
    }
    greatest
}

fn stretch<const D: usize>(first: &Grip<D>, second: &Grip<D>) -> f64 {
    let mut greatest = 1.0_f64;
    for k in (0..D).filter(|&k| first.axes[k] && second.axes[k]) {
        let (below, above) = match first.bounds.upper[k] < second.bounds.lower[k] {
            true => (first, second),
            false => (second, first),
        };
        let gap = above.bounds.lower[k] - below.bounds.upper[k];
        if gap > 0.0 {
            let parting = below.ways.iter().zip(&above.ways).map(|(low, high)| high[k] - low[k]);
            greatest = greatest.max(1.0 + parting.fold(0.0, f64::max) / gap);
        }
    }
    greatest
}

/// Sticky colliders, prescribed velocities and faces of the domain that hold a body.
fn grips<const D: usize>(problem: &Problem<D>, body: &Body<D>) -> Vec<Grip<D>> {
    let own = body.shape.bounds();
    let mut grips = Vec::new();
    for collider in problem.colliders.iter().filter(|c| c.free().is_none()) {
        let bounds = collider.shape.bounds();
        let common = bounds.intersection(&own);
        let meets = |budget: &mut usize| {
            !common.is_empty() && common_point([&collider.shape, &body.shape], common, 0.0, budget).is_some()
        };
        if collider.contact == Contact::Sticky && meets(&mut 2000) {
            let name = format!("\"{}\"", excerpt(&collider.name, NAME));
            let ways = times(problem).map(|time| collider.motion.place(time).0).collect();
            grips.push(Grip { name, bounds, axes: [true; D], ways });
        }
    }
    for load in problem.loads.iter().filter(|load| load.start.is_finite()) {
        let (Kind::Velocity(components), Some(region)) = (&load.kind, &load.region) else { continue };
        let bounds = region.bounds().intersection(&Aabb::new([0.0; D], problem.size()));
        let depends = components.iter().flatten().any(Quantity::depends_on_place);
        if !depends && !bounds.intersection(&own).is_empty() {
            let place = problem.place(&bounds.centre());
            let axes = components.each_ref().map(Option::is_some);
            let name = format!("\"{}\"", excerpt(&load.name, NAME));
            let dt = problem.time.end / f64::from(TIMES);
            let mut way = [0.0; D];
            let ways = times(problem).map(|time| {
                let before = way;
                if load.is_active(time) {
                    let velocity =
                        |c: &Option<Quantity>| c.as_ref().map_or(0.0, |c| c.at(place, time + 0.5 * dt));
                    way = std::array::from_fn(|k| dt.mul_add(velocity(&components[k]), way[k]));
                }
                before
            });
            grips.push(Grip { name, bounds, axes, ways: ways.collect() });
        }
    }
    let size = problem.size();
    for (k, side) in (0..D).flat_map(|k| [(k, 0), (k, 1)]) {
        let axes = match problem.faces[k][side] {
            Contact::Sticky => [true; D],
            Contact::Slip | Contact::Symmetric => std::array::from_fn(|axis| axis == k),
            _ => continue,
        };
        let at = if side == 0 { 0.0 } else { size[k] };
        if own.lower[k] <= at && at <= own.upper[k] {
            let mut bounds = Aabb::new([0.0; D], size);
            (bounds.lower[k], bounds.upper[k]) = (at, at);
            let name = format!("{}_{}", ["x", "y", "z"][k], ["min", "max"][side]);
            grips.push(Grip { name, bounds, axes, ways: vec![[0.0; D]; TIMES as usize + 1] });
        }
    }
    grips
}

/// Tractions, and pressures that pull.
fn of_load<const D: usize>(problem: &Problem<D>, index: usize, load: &Load<D>, all: &mut Vec<String>) {
    let Some(carried) = load.carried() else { return };
    let centre = problem.place(&match &load.region {
        Some(region) => region.bounds().intersection(&Aabb::new([0.0; D], problem.size())).centre(),
        None => problem.size().map(|edge| 0.5 * edge),
    });
    let force = |time: f64| match &carried.force {
        CarriedForce::Traction(components) => length(&components.each_ref().map(|c| c.at(centre, time))),
        CarriedForce::Pressure { pressure, .. } => -pressure.at(centre, time),
        CarriedForce::Point { .. } => 0.0,
    };
    let greatest =
        times(problem).filter(|&time| load.is_active(load.start + time)).map(force).fold(0.0, f64::max);
    let bodies = problem.bodies.iter().enumerate().filter(|(body, _)| carried.is_on(*body));
    let softest = bodies
        .filter_map(|(_, body)| Some((young(&problem.materials[body.material].model)?, &body.name)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((young, body)) = softest
        && greatest > TRACTION * young
    {
        all.push(format!(
            "loads[{index}]: \"{}\" pulls with up to {}, {} of the young of \"{}\"; expected at most {TRACTION}, beyond which particles at the surface may come off: a lesser load, or a stiffer body",
            excerpt(&load.name, NAME),
            quantity(greatest, "Pa"),
            number(greatest / young, 2),
            excerpt(body, NAME)
        ));
    }
}
