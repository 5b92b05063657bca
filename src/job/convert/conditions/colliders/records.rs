//! Tables of motion: rows of the job, or of a file.
use super::keys::optional;
use crate::boundary::motion::{Knot, Table};
use crate::checksum::fnv1a;
use crate::job::convert::checks::Checks;
use crate::job::convert::conditions::quantities::column;
use crate::job::parse::source::Path;
use crate::job::schema::conditions::colliders::{MotionRecord, Row};
use crate::quantity::record;
use crate::text::{counted, written};

/// Greatest displacement, m, and greatest angle, degrees.
const GREATEST: [f64; 2] = [1e12, 1e9];

/// The table of a motion at `path`, of its rows or of its file; or faults.
pub(super) fn rows<const D: usize>(
    checks: &mut Checks,
    rows: Option<&[Row]>,
    record: Option<&MotionRecord>,
    path: &Path,
) -> Option<Table<D>> {
    match (rows, record) {
        (Some(rows), None) => of_job(checks, rows, &path.key("rows")),
        (None, Some(record)) => of_file(checks, record, &path.key("record")),
        (None, None) => {
            checks.fault(path, "found neither `rows` nor `record`; expected one of them".into());
            None
        }
        (Some(_), Some(_)) => {
            let message = "found both `rows` and `record`; expected one of them";
            checks.fault(&path.key("record"), message.into());
            None
        }
    }
}

fn of_job<const D: usize>(checks: &mut Checks, rows: &[Row], path: &Path) -> Option<Table<D>> {
    if rows.len() < 2 {
        checks.fault(path, format!("found {}; expected at least 2 rows", counted(rows.len() as u64, "row")));
        return None;
    }
    let mut knots = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        let here = path.index(i);
        if i > 0 && row.time <= rows[i - 1].time {
            let message = format!(
                "found {}; expected more than the previous {}",
                written(row.time),
                written(rows[i - 1].time)
            );
            checks.fault(&here.key("time"), message);
        }
        let translation = optional(checks, row.translation.as_ref(), &here.key("translation"));
        knots.push(translation.map(|translation| Knot {
            time: row.time,
            translation,
            angle: row.rotation.to_radians(),
        }));
    }
    let rows = knots.into_iter().collect::<Option<_>>()?;
    Some(Table { rows, is_smooth: false })
}

fn of_file<const D: usize>(checks: &mut Checks, written: &MotionRecord, path: &Path) -> Option<Table<D>> {
    let along = [&written.x, &written.y, &written.z];
    if D == 2 && written.z.is_some() {
        checks.fault(&path.key("z"), "found a column along z; expected x and y only in a 2D job".into());
        return None;
    }
    let given: Vec<(usize, &_)> = (0..D).filter_map(|a| Some((a, along[a].as_ref()?))).collect();
    if given.is_empty() && written.rotation.is_none() {
        let message = "found no column of a motion; expected at least one of x, y, z and rotation";
        checks.fault(path, message.into());
        return None;
    }
    let columns = given.iter().map(|(_, written)| *written).chain(&written.rotation);
    let columns: Vec<_> = std::iter::once(&written.time).chain(columns).map(column).collect();
    let read = |file: &std::path::Path| record::read_rows(file, &columns).map_err(|error| error.to_string());
    let expected = "rows of a time and displacements in columns, at least two";
    let read = |file: &std::path::Path| read(file).and_then(|rows| knots(&rows, written, &given));
    let rows: Vec<Knot<D>> = checks.read(&written.file, expected, &path.key("file"), read)?;
    let words = rows.iter().flat_map(|knot| knot.translation.into_iter().chain([knot.time, knot.angle]));
    checks.note_file(fnv1a(words.map(f64::to_bits)));
    Some(Table { rows, is_smooth: false })
}

/// The rows of a file as those of a table, or what is wrong.
fn knots<const D: usize, T>(
    rows: &record::Rows,
    written: &MotionRecord,
    given: &[(usize, T)],
) -> Result<Vec<Knot<D>>, String> {
    if rows.numbers.len() < 2 {
        return Err(format!("it has {}", counted(rows.numbers.len() as u64, "row")));
    }
    let rows = rows.numbers.iter().zip(&rows.lines).map(|(numbers, line)| {
        let mut translation = [0.0; D];
        for ((axis, _), number) in given.iter().zip(&numbers[1..]) {
            translation[*axis] = written.scale * number;
        }
        let rotation = if written.rotation.is_some() { numbers[given.len() + 1] } else { 0.0 };
        let too_large = translation.iter().find(|c| c.abs() > GREATEST[0]);
        match too_large.or((rotation.abs() > GREATEST[1]).then_some(&rotation)) {
            Some(number) => {
                Err(format!("line {line}: found {number}; expected at most 1e12 m or 1e9 degrees"))
            }
            None => Ok(Knot { time: numbers[0], translation, angle: rotation.to_radians() }),
        }
    });
    rows.collect()
}
