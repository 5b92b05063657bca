//! Files of lines: for each row of the history a row for each of their points.
use std::path::PathBuf;

use crate::io::hdf5_file::FileError;
use crate::io::log::history::{Column, Gap, History, Kept};
use crate::job::Problem;
use crate::probe::Line;
use crate::probe::line::Sample;
use crate::row::Row;
use crate::solver::Clock;

/// The file of a line.
pub(in crate::run) fn path<const D: usize>(problem: &Problem<D>, line: &Line<D>) -> PathBuf {
    problem.output.directory.join(format!("{}.line_{}.csv", problem.name, line.name))
}

/// Columns behind the step: time (s), and those of a point with its sample.
fn add<const D: usize>(
    row: &mut Row,
    problem: &Problem<D>,
    line: &Line<D>,
    of: Option<(f64, usize, &Sample<D>)>,
) {
    row.add(format_args!("time"), "s", of.map(|(time, ..)| time));
    line.add_to(row, of.map(|(_, point, sample)| (point, sample)), &problem.origin);
}

/// Not collective. Opens the files of all lines, with the rows that are `kept`, and what is missing there.
pub(in crate::run) fn open<const D: usize>(
    problem: &Problem<D>,
    kept: Option<Kept>,
) -> Result<Vec<(History, Vec<Gap>)>, FileError> {
    let open = |line: &Line<D>| {
        let named = Row::names(|row| add(row, problem, line, None));
        let columns: Vec<Column<'_>> = named.iter().map(|(name, unit)| Column { name, unit }).collect();
        let path = path(problem, line);
        match kept {
            // A line that the run did not have before begins where the run continues.
            Some(kept) if path.exists() => History::resume(&path, &columns, line.points.len(), kept),
            _ => Ok((History::create(&path, &columns)?, Vec::new())),
        }
    };
    problem.lines.iter().map(open).collect()
}

/// Not collective. Writes the rows of a step.
pub(in crate::run) fn write<const D: usize>(
    files: &mut [History],
    problem: &Problem<D>,
    clock: Clock,
    samples: &[Vec<Sample<D>>],
) -> Result<(), FileError> {
    for ((file, line), samples) in files.iter_mut().zip(&problem.lines).zip(samples) {
        for (point, sample) in samples.iter().enumerate() {
            let of = Some((clock.time, point, sample));
            file.row(clock.step, &Row::values(|row| add(row, problem, line, of)))?;
        }
    }
    Ok(())
}
