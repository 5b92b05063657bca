//! Quantities of the job file: numbers, expressions, tables over time, and values at places from files.
use std::sync::Arc;

use crate::geometry::mesh::HeightRaster;
use crate::geometry::written::Vector;
use crate::job::convert::checks::Checks;
use crate::job::convert::shapes::RASTERS;
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::job::schema::conditions::loads::{
    Column as WrittenColumn, Points, Quantity as WrittenQuantity, Raster, Record,
};
use crate::quantity::record::{self, Column};
use crate::quantity::{AXES, Expression, Field, Quantity, Table, field};
use crate::text::{excerpt, number};

/// As many quantities as the job has dimensions, or faults.
pub(in crate::job::convert) fn vector<const D: usize>(
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
pub(in crate::job::convert) fn at_nodes<const D: usize>(
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
pub(in crate::job::convert) fn quantity<const D: usize>(
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
        WrittenQuantity::Points(points) => return of_points::<D>(checks, points, path),
        WrittenQuantity::Raster(raster) => return of_raster::<D>(checks, raster, path),
    };
    read.map_err(|message| checks.fault(path, message)).ok()
}

/// A column of a file.
pub(in crate::job::convert) fn column(written: &WrittenColumn) -> Column {
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

/// The field of a table of points, or a fault.
fn of_points<const D: usize>(checks: &mut Checks, written: &Points, path: &Path) -> Option<Quantity> {
    let value = written.value.as_ref().map(column);
    let expected = "a table of points with names in its first line";
    let here = path.key("points");
    let read = |file: &std::path::Path| field::read(file, value.as_ref());
    let field = checks.read(&written.points, expected, &here, read)?;
    let origin = origin::<D>(checks, written.origin.as_ref(), path)?;
    let field = field.placed(origin, written.scale);
    let ranges = field.ranges();
    let file = excerpt(&written.points, QUOTED);
    if let Some((axis, _)) = ranges.iter().find(|(axis, _)| *axis >= D) {
        let message = format!("found \"{file}\" with a column {}; expected x and y in a 2D job", AXES[*axis]);
        checks.fault(&here, message);
        return None;
    }
    let domain = checks.domain;
    if let Some((axis, range)) =
        ranges.into_iter().find(|(axis, [low, high])| domain[*axis][0] > *high || domain[*axis][1] < *low)
    {
        let message = format!(
            "found \"{file}\" with {}, all outside the domain; expected {}",
            span(axis, range),
            span(axis, domain[axis])
        );
        checks.fault(&here, message);
        return None;
    }
    noted(checks, field)
}

/// The field of a raster, or a fault.
fn of_raster<const D: usize>(checks: &mut Checks, written: &Raster, path: &Path) -> Option<Quantity> {
    let here = path.key("raster");
    let file = excerpt(&written.raster, QUOTED);
    let placing = checks.placing(&written.raster, written.cell, written.array.as_deref(), path)?;
    let raster = checks.read(&written.raster, RASTERS, &here, |from| HeightRaster::read(from, &placing))?;
    if let Some(gaps) = raster.gaps("value") {
        checks.fault(&here, format!("found \"{file}\", but {gaps}"));
        return None;
    }
    let origin = origin::<D>(checks, written.origin.as_ref(), path)?;
    let HeightRaster { values, columns, cell, corner, .. } = raster;
    let field = Field::raster(values, columns, cell, corner).placed(origin, written.scale);
    // Its values stand in the middle of cells.
    let slack = 0.5000001 * cell;
    let domain = checks.domain;
    let is_open = |(axis, [low, high]): &(usize, [f64; 2])| {
        low - slack > domain[*axis][0] || high + slack < domain[*axis][1]
    };
    if let Some((axis, range)) = field.ranges().into_iter().find(is_open) {
        let message = format!(
            "found \"{file}\", which covers {}; expected all of the domain, {}: set `origin`, or cut the domain",
            span(axis, [range[0] - 0.5 * cell, range[1] + 0.5 * cell]),
            span(axis, domain[axis])
        );
        checks.fault(&here, message);
        return None;
    }
    noted(checks, field)
}

fn noted(checks: &mut Checks, field: Field) -> Option<Quantity> {
    checks.note_file(field.checksum());
    Some(Quantity::Field(Arc::new(field)))
}

/// A range of a coordinate, in words.
fn span(axis: usize, [low, high]: [f64; 2]) -> String {
    format!("{} from {} to {} m", AXES[axis], number(low, 6), number(high, 6))
}

/// Where the origin of the coordinates of a file lies, m, or a fault.
fn origin<const D: usize>(checks: &mut Checks, written: Option<&Vector>, path: &Path) -> Option<[f64; 3]> {
    let Some(written) = written else { return Some([0.0; 3]) };
    let origin = checks.vector::<D>(written, &path.key("origin"))?;
    Some(std::array::from_fn(|axis| if axis < D { origin[axis] } else { 0.0 }))
}
