//! Loads of the job file to those of the solver.
use super::checks::{Checks, Space};
use crate::geometry::written::Vector;
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::job::schema::job_file::JobFile;
use crate::job::schema::loads::{
    Column as WrittenColumn, Load as Written, LoadKind, Quantity as WrittenQuantity, Record, Sharing,
};
use crate::load::{Carried, CarriedForce, Kind, Load};
use crate::quantity::record::{self, Column};
use crate::quantity::{Expression, Quantity, Table};
use crate::text::{excerpt, written as number};

/// Most exact sums of colliders (six each), faces (one for each axis), fluxes, contacts between bodies and
/// loads (four each): the header of a checkpoint has limited room.
const MAX_SUMS: usize = 108;

/// All loads, or faults.
pub(super) fn loads<const D: usize>(
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

/// As many quantities as the job has dimensions, or faults.
pub(super) fn vector<const D: usize>(
    checks: &mut Checks,
    written: &[WrittenQuantity],
    path: &Path,
) -> Option<[Quantity; D]> {
    if written.len() != D {
        checks.fault(path, format!("found {} components; expected {D} in a {D}D job", written.len()));
        return None;
    }
    let mut all = Vec::new();
    for (i, component) in written.iter().enumerate() {
        all.push(quantity::<D>(checks, component, &path.index(i)));
    }
    let all: Option<Vec<Quantity>> = all.into_iter().collect();
    all?.try_into().ok()
}

/// A quantity at nodes, which cannot depend on places of the undeformed body, or a fault.
pub(super) fn at_nodes<const D: usize>(
    checks: &mut Checks,
    written: &WrittenQuantity,
    path: &Path,
) -> Option<Quantity> {
    let quantity = quantity::<D>(checks, written, path)?;
    if quantity.names_undeformed() {
        let message = "found X, Y or Z, positions in the undeformed body; expected x, y, z and t, positions in the domain";
        checks.fault(path, message.into());
        return None;
    }
    Some(quantity)
}

/// A quantity, or a fault.
pub(super) fn quantity<const D: usize>(
    checks: &mut Checks,
    written: &WrittenQuantity,
    path: &Path,
) -> Option<Quantity> {
    let read = match written {
        WrittenQuantity::Number(value) => Ok(Quantity::Constant(*value)),
        WrittenQuantity::Expression(text) => match Expression::parse(text) {
            Ok(expression) if D == 2 && expression.names_z() => Err(format!(
                "found z in \"{}\"; expected x, y, X, Y and t in a 2D job",
                excerpt(text, QUOTED)
            )),
            Ok(expression) => {
                let key = format!("{}: {path}", checks.place(path));
                Ok(Quantity::Expression(Box::new(expression.of_key(key))))
            }
            Err(error) => Err(error.to_string()),
        },
        WrittenQuantity::Table(rows) => {
            let rows: Vec<(f64, f64)> = rows.iter().map(|[time, value]| (*time, *value)).collect();
            Table::new(&rows).map(Quantity::Table).map_err(|error| error.to_string())
        }
        WrittenQuantity::Record(record) => return of_file(checks, record, path),
    };
    read.map_err(|message| checks.fault(path, message)).ok()
}

/// A column of a file.
pub(super) fn column(written: &WrittenColumn) -> Column {
    match written {
        WrittenColumn::Number(number) => Column::Number(usize::from(*number)),
        WrittenColumn::Name(name) => Column::Name(name.clone()),
    }
}

/// The table in a file, or a fault.
fn of_file(checks: &mut Checks, written: &Record, path: &Path) -> Option<Quantity> {
    let (time, value) = (column(&written.time), column(&written.value));
    let expected = "rows of a time and a value in columns";
    let read = |file: &std::path::Path| record::read(file, &time, &value, written.scale);
    let table = checks.read(&written.file, expected, &path.key("file"), read)?;
    checks.note_file(table.checksum());
    Some(Quantity::Table(table))
}
