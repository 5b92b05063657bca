//! Loads of the job file to those of the solver.
use super::quantities::{at_nodes, quantity, vector};
use crate::geometry::written::Vector;
use crate::job::convert::checks::{Checks, Space};
use crate::job::parse::source::Path;
use crate::job::schema::conditions::loads::{Load as Written, LoadKind, Sharing};
use crate::job::schema::job_file::JobFile;
use crate::load::{Carried, CarriedForce, Gravity, Kind, Load};
use crate::quantity::Quantity;
use crate::text::written as number;

/// Most exact sums of colliders (six each), faces (one for each axis), fluxes, contacts between bodies and
/// loads (four each): the header of a checkpoint has limited room.
const MAX_SUMS: usize = 108;

/// All loads, or faults.
pub(in crate::job::convert) fn loads<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    taken: usize,
    space: &Space<D>,
    path: &Path,
) -> Option<Vec<Load<D>>> {
    let loads = &file.loads;
    let most = MAX_SUMS.saturating_sub(taken) / 4;
    if loads.len() > most {
        checks.fault(
            path,
            format!(
                "found {} loads; expected at most {most} beside the colliders, contacts, face forces and fluxes of this job",
                loads.len()
            ),
        );
        return None;
    }
    let bodies = file.body_names();
    let (mut all, mut columns) = (Vec::new(), 0);
    for (i, written) in loads.iter().enumerate() {
        let here = path.index(i);
        checks.column_name(&written.name, loads[..i].iter().map(|load| &*load.name), &here.key("name"));
        let mut load = load(checks, written, &bodies, space, &here);
        if let Some(Load { kind: Kind::Carried(carried), .. }) = &mut load {
            carried.first = columns;
            columns += carried.force.columns();
        }
        all.push(load);
    }
    all.into_iter().collect()
}

fn load<const D: usize>(
    checks: &mut Checks,
    written: &Written,
    bodies: &[&str],
    space: &Space<D>,
    path: &Path,
) -> Option<Load<D>> {
    let until = written.until.unwrap_or(f64::INFINITY);
    if until <= written.from {
        let message =
            format!("found {} s; expected a time after from = {} s", number(until), number(written.from));
        checks.fault(&path.key("until"), message);
    }
    let region = match &written.shape {
        Some(shape) => Some(checks.shape(shape, space, &path.key("shape"))?),
        None => None,
    };
    let kind = match &written.kind {
        LoadKind::BodyForce { acceleration } => {
            Kind::BodyForce(vector(checks, acceleration, &path.key("acceleration"))?)
        }
        LoadKind::Velocity { x, y, z } => {
            if D == 2 && z.is_some() {
                checks.fault(
                    &path.key("z"),
                    "found a component along z; expected x and y only in a 2D job".into(),
                );
            }
            let given = [x, y, z];
            if given[..D].iter().all(|component| component.is_none()) {
                checks.fault(path, "found no component; expected a velocity along x, y or z".into());
            }
            let mut components: [Option<Quantity>; D] = std::array::from_fn(|_| None);
            for (axis, component) in components.iter_mut().enumerate() {
                if let Some(written) = given[axis] {
                    *component = Some(at_nodes::<D>(checks, written, &path.key(["x", "y", "z"][axis]))?);
                }
            }
            Kind::Velocity(components)
        }
        LoadKind::Damping { rate } => {
            let rate = at_nodes::<D>(checks, rate, &path.key("rate"))?;
            if let Quantity::Constant(value) = rate
                && value < 0.0
            {
                checks.fault(&path.key("rate"), format!("found {}; expected 0 or more (1/s)", number(value)));
            }
            Kind::Damping(rate)
        }
        LoadKind::LocalDamping { factor } => Kind::LocalDamping(*factor),
        LoadKind::Traction { traction, bodies: on, facing } => Kind::Carried(Carried {
            force: CarriedForce::Traction(vector(checks, traction, &path.key("traction"))?),
            first: 0,
            bodies: checks.bodies(on.as_deref(), bodies, &path.key("bodies"))?,
            facing: direction(checks, facing.as_ref(), &path.key("facing"))?,
        }),
        LoadKind::Pressure { pressure, follow, bodies: on, facing } => Kind::Carried(Carried {
            force: CarriedForce::Pressure {
                pressure: quantity::<D>(checks, pressure, &path.key("pressure"))?,
                follows: *follow,
            },
            first: 0,
            bodies: checks.bodies(on.as_deref(), bodies, &path.key("bodies"))?,
            facing: direction(checks, facing.as_ref(), &path.key("facing"))?,
        }),
        LoadKind::PointForce { force, share, bodies: on } => Kind::Carried(Carried {
            force: CarriedForce::Point {
                force: vector(checks, force, &path.key("force"))?,
                by_volume: *share == Sharing::Volume,
            },
            first: 0,
            bodies: checks.bodies(on.as_deref(), bodies, &path.key("bodies"))?,
            facing: None,
        }),
    };
    Some(Load {
        name: written.name.clone(),
        kind,
        region,
        start: 0.0,
        from: written.from,
        until,
        origin: space.origin,
    })
}

/// A unit vector, or a fault; `Some(None)` if none is given.
fn direction<const D: usize>(
    checks: &mut Checks,
    written: Option<&Vector>,
    path: &Path,
) -> Option<Option<[f64; D]>> {
    match written {
        Some(vector) => checks.direction(vector, path).map(Some),
        None => Some(None),
    }
}

/// Gravity is the same everywhere.
pub(in crate::job::convert) fn gravity<const D: usize>(
    checks: &mut Checks,
    written: &[crate::job::schema::conditions::loads::Quantity],
    path: &Path,
) -> Option<Gravity<D>> {
    let components = vector::<D>(checks, written, path)?;
    for (axis, _) in components.iter().enumerate().filter(|(_, component)| component.depends_on_place()) {
        let message = "found an expression of position; expected one of t only (a load of kind \"body_force\" may depend on x, y, z)";
        checks.fault(&path.index(axis), message.into());
    }
    Some(Gravity { acceleration: components, start: 0.0 })
}
