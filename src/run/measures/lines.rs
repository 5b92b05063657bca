//! Files of lines: for each row of the history a row for each of their points.
use std::path::PathBuf;

use crate::io::hdf5_file::FileError;
use crate::io::log::history::{Column, Gap, History, Kept};
use crate::job::Problem;
use crate::probe::Line;
use crate::probe::line::Sample;
use crate::solver::Clock;

/// The file of a line.
pub(in crate::run) fn path<const D: usize>(problem: &Problem<D>, line: &Line<D>) -> PathBuf {
    problem.output.directory.join(format!("{}.line_{}.csv", problem.name, line.name))
}

/// Not collective. Opens the files of all lines, with the rows that are `kept`, and what is missing there.
pub(in crate::run) fn open<const D: usize>(
    problem: &Problem<D>,
    kept: Option<Kept>,
) -> Result<Vec<(History, Vec<Gap>)>, FileError> {
    let open = |line: &Line<D>| {
        let named = line.columns();
        let time = [("time".to_owned(), "s")];
        let named: Vec<_> = time.iter().chain(&named).collect();
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
            let mut values = vec![clock.time];
            values.extend(line.values(point, sample, &problem.origin));
            file.row(clock.step, &values)?;
        }
    }
    Ok(())
}
