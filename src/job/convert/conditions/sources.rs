//! Sources of the job file, and the bodies that they feed.
use crate::geometry::written::Shape as Written;
use crate::geometry::{Aabb, Side};
use crate::job::convert::bodies::body;
use crate::job::convert::checks::{Checks, Space};
use crate::job::convert::settings::is_outflow;
use crate::job::parse::source::Path;
use crate::job::problem::{Body, CELLS_PER_LEAF, TreeSetup};
use crate::job::schema::common::FASTEST;
use crate::job::schema::job_file::{self as file, JobFile, Source as WrittenSource};
use crate::kernel::Coordinates;
use crate::material::parameters::Parameters;
use crate::quantity::{FACES, Quantity};
use crate::source::{Source, particles_in};
use crate::text::{number as rounded, quantity, written as number};
use rustc_hash::FxHashMap;

/// Greatest number of lattice points to test in the shape of a source.
const MOST_POINTS: f64 = 2e7;

/// Parts of the job that sources need.
pub(in crate::job::convert) struct Context<'a, const D: usize> {
    pub file: &'a JobFile,
    pub space: &'a Space<D>,
    pub tree: &'a TreeSetup<D>,
    pub root_edge: f64,
    pub coordinates: Coordinates,
}

/// All sources with their bodies, or faults.
pub(in crate::job::convert) fn sources<const D: usize>(
    checks: &mut Checks,
    context: &Context<'_, D>,
    path: &Path,
) -> Option<Vec<(Source<D>, Body<D>)>> {
    let file = context.file;
    let mut all = Vec::new();
    for (i, written) in file.sources.iter().enumerate() {
        let here = path.index(i);
        let before = file.body_names().into_iter().take(file.bodies.len() + i);
        checks.column_name(&written.name, before, &here.key("name"));
        all.push(source(checks, written, i, context, &here));
    }
    all.into_iter().collect()
}

fn source<const D: usize>(
    checks: &mut Checks,
    written: &WrittenSource,
    index: usize,
    context: &Context<'_, D>,
    path: &Path,
) -> Option<(Source<D>, Body<D>)> {
    let Context { file, space, tree, root_edge, coordinates } = *context;
    if let Some(until) = written.until.filter(|until| *until <= written.from) {
        let message =
            format!("found {} s; expected a time after from = {} s", number(until), number(written.from));
        checks.fault(&path.key("until"), message);
    }
    let velocity: Option<[f64; D]> = checks.vector(&written.velocity, &path.key("velocity"));
    if let Some(velocity) = &velocity {
        if velocity.iter().all(|v| *v == 0.0) {
            let message = "found a velocity of 0; expected one that takes the material out of the shape";
            checks.fault(&path.key("velocity"), message.into());
            return None;
        }
        if let Some(axis) = (0..D).find(|&a| velocity[a].abs() > FASTEST) {
            let message = format!("found {} m/s; expected at most {FASTEST:e} m/s", number(velocity[axis]));
            checks.fault(&path.key("velocity").index(axis), message);
        }
    }
    if matches!(written.shape, Written::Particles { .. }) {
        let message = "found particles from a file; expected a shape, which the source fills on a lattice";
        checks.fault(&path.key("shape"), message.into());
        return None;
    }
    let as_body = file::Body {
        name: written.name.clone(),
        material: written.material.clone(),
        shape: written.shape.clone(),
        particles_per_cell: written.particles_per_cell,
        sampling: None,
        seed: None,
        velocity: None,
        angular_velocity: None,
        stage: None,
        stress: None,
    };
    // Of equal names the first counts, as everywhere.
    let mut materials = FxHashMap::default();
    for (number, material) in file.materials.iter().enumerate() {
        materials.entry(material.name.as_str()).or_insert(number);
    }
    let law = materials.get(written.material.as_str()).map(|&number| &file.materials[number].model);
    if let Some(Parameters::Explosive(own)) = law
        && !own.ignition.is_empty()
    {
        let message = "found an explosive with `ignition`, which counts from where particles are at the start; expected another material, or the explosive as a body";
        checks.fault(&path.key("material"), message.into());
    }
    let body = body(checks, &as_body, &materials, file, space, path)?;
    let velocity = velocity?;
    let domain = Aabb::new([0.0; D], space.size);
    let bounds = body.shape.bounds().intersection(&domain);
    let regions = tree.regions.iter().filter(|region| region.shape.classify(&bounds) != Side::Outside);
    let level = regions.map(|region| region.level).fold(tree.base_level, u8::max);
    let cell = root_edge / f64::from(1_u32 << level) / f64::from(CELLS_PER_LEAF);
    let spacing = cell / written.particles_per_cell;
    let Some(entries) = Source::entries_of(&body.shape, &velocity, &space.size, spacing, MOST_POINTS) else {
        let message = format!(
            "found a shape with more than {MOST_POINTS:e} points of a lattice of {}; expected a smaller shape, short along the velocity, or coarser cells",
            quantity(spacing, "m")
        );
        checks.fault(&path.key("shape"), message);
        return None;
    };
    if entries.is_empty() {
        let message = format!(
            "found a shape without a point of the lattice of particles, which are {} apart; expected a larger shape, or finer cells there",
            quantity(spacing, "m")
        );
        checks.fault(&path.key("shape"), message);
        return None;
    }
    let axis = Source::main_axis(&velocity);
    let side = usize::from(velocity[axis] > 0.0);
    let way = [bounds.lower[axis], space.size[axis] - bounds.upper[axis]][side];
    if way < 0.5 * spacing && !is_outflow(&file.boundaries, axis, side) {
        let face = FACES[axis][side];
        let message = format!(
            "found a velocity that leads into the face {face}, where the shape ends; expected one that leads into the domain, or a face of kind `outflow`"
        );
        checks.fault(&path.key("velocity"), message);
    }
    let density = file.materials[body.material].density;
    let around: Vec<f64> = entries.iter().map(|entry| coordinates.around(entry[0])).collect();
    let masses: Vec<f64> = around.iter().map(|around| density * spacing.powi(D as i32) * around).collect();
    let shortest = spacing / velocity[axis].abs();
    let of_layer = match coordinates {
        Coordinates::Cartesian => masses[0] * entries.len() as f64,
        Coordinates::Axisymmetric => masses.iter().sum(),
    };
    let most = of_layer / shortest;
    if let Some(rate) = written.rate.filter(|rate| *rate > most * (1.0 + 1e-9)) {
        let message = format!(
            "found {} kg/s; expected at most {} kg/s, which fills the section of the shape at this velocity: a lower rate, a wider shape or a higher velocity",
            number(rate),
            rounded(most, 5)
        );
        checks.fault(&path.key("rate"), message);
    }
    let period = written.rate.map_or(shortest, |rate| (of_layer / rate).max(shortest));
    let span = written.until.unwrap_or(f64::INFINITY) - written.from;
    let source = Source {
        name: written.name.clone(),
        shape: body.shape.clone(),
        body: (file.bodies.len() + index) as u16,
        material: body.material as u16,
        level,
        spacing,
        masses,
        halves: around.iter().map(|around| 0.5 * spacing * around.sqrt()).collect(),
        velocity,
        total: match coordinates {
            Coordinates::Cartesian => particles_in(span, period, entries.len()),
            // Whole layers: particles of one have unlike masses.
            Coordinates::Axisymmetric => particles_in(span, period, 1).saturating_mul(entries.len() as u64),
        },
        entries,
        period,
        passage: (bounds.upper[axis] - bounds.lower[axis]) / velocity[axis].abs(),
        start: 0.0,
        from: written.from,
    };
    let body = Body { velocity: velocity.map(Quantity::Constant), fed: Some(index), ..body };
    Some((source, body))
}
