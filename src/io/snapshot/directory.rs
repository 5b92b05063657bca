//! Finding and keeping the files of a run.

use std::path::{Path, PathBuf};

use super::header::Header;
use crate::io::hdf5_file::{FileError, ParallelFile};
use crate::io::series::{Entry, Series};

/// How names of files in ParaView's format end. Every ParaView that reads the format (5.11 and newer) opens `.hdf`;
/// the longer `.vtkhdf` is unknown to 5.11.
const ENDING: &str = ".hdf";
/// Endings under which the files of a run are found; earlier versions of agimp ended their names in `.vtkhdf`.
const KNOWN_ENDINGS: [&str; 2] = [ENDING, ".vtkhdf"];

/// Path of output number `number` of the run `name`.
pub fn output_path(directory: &Path, name: &str, number: u64) -> PathBuf {
    directory.join(format!("{name}_{number:06}{ENDING}"))
}

/// Path of the tree that belongs to an output.
pub fn tree_path(directory: &Path, name: &str, number: u64) -> PathBuf {
    directory.join(format!("{name}_{number:06}.tree{ENDING}"))
}

/// Path of the index of the outputs.
pub fn series_path(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!("{name}{ENDING}.series"))
}

/// Path of the index of the trees.
pub fn tree_series_path(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!("{name}.tree{ENDING}.series"))
}

/// Not collective. The entries of an index, or of the one that an earlier version has left in its place, if either can be read.
pub fn listed(series: &Path) -> Option<Vec<Entry>> {
    KNOWN_ENDINGS.iter().find_map(|ending| {
        let name = file_name(series).strip_suffix(&format!("{ENDING}.series"))?;
        Series::listed(&series.with_file_name(format!("{name}{ending}.series")))
    })
}

/// What stands before the ending of a file of a run.
fn stem(name: &str) -> Option<&str> {
    KNOWN_ENDINGS.iter().find_map(|ending| name.strip_suffix(ending))
}

/// Path of the checkpoint of a step.
pub fn checkpoint_path(directory: &Path, name: &str, step: u64) -> PathBuf {
    directory.join(format!("{name}.checkpoint_{step:09}{ENDING}"))
}

/// What [`find_latest`] found.
#[derive(Debug)]
pub struct Latest {
    /// The newest file that a run can restart from.
    pub path: PathBuf,
    /// Its header.
    pub header: Header,
    /// Files that were passed over, with the reason.
    pub damaged: Vec<FileError>,
}

/// Not collective. The file of the latest step among the checkpoints and outputs of the run `name` that
/// hold a restart state and look whole. `Ok(None)` if there is none and nothing was damaged.
///
/// A directory may still hold files of an earlier run of that name. Outputs that the index of the run does not
/// list are such files, as are files of a job with another digest if `job_digest` is given; neither counts.
pub fn find_latest(
    directory: &Path,
    name: &str,
    job_digest: Option<u64>,
) -> Result<Option<Latest>, FileError> {
    let mut best: Option<(PathBuf, Header)> = None;
    let (mut damaged, mut other) = (Vec::new(), None);
    let listed = listed(&series_path(directory, name));
    let is_listed = |name: &str| {
        listed.as_ref().is_none_or(|entries: &Vec<Entry>| entries.iter().any(|entry| entry.name == name))
    };
    for path in files(directory)? {
        let Some(rest) = file_name(&path).strip_prefix(name) else { continue };
        let number =
            stem(rest).and_then(|rest| rest.strip_prefix(".checkpoint_").or_else(|| rest.strip_prefix('_')));
        if !number.is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())) {
            continue;
        }
        if rest.starts_with('_') && !is_listed(file_name(&path)) {
            continue;
        }
        match ParallelFile::open_alone(&path).and_then(|file| Header::read(&file)) {
            Ok(header) if !header.restart => {}
            Ok(header) if job_digest.is_some_and(|ours| ours != header.job_digest) => {
                other.get_or_insert((path, header));
            }
            Ok(header) => {
                if best.as_ref().is_none_or(|(_, found)| found.step < header.step) {
                    best = Some((path, header));
                }
            }
            Err(error) => damaged.push(error),
        }
    }
    // Only files of another job: reading one tells why it cannot be used.
    match best.or(other.filter(|_| damaged.is_empty())) {
        Some((path, header)) => Ok(Some(Latest { path, header, damaged })),
        None => damaged.into_iter().next().map_or(Ok(None), Err),
    }
}

/// Not collective. Of the checkpoints of the run `name`, keeps the `keep` latest up to step `step`, which was just
/// written. Those of later steps were left by an earlier run, and go too, as do temporary files of checkpoints
/// that were never finished.
pub fn remove_old_checkpoints(directory: &Path, name: &str, step: u64, keep: usize) -> Result<(), FileError> {
    let prefix = format!("{name}.checkpoint_");
    let mut finished: Vec<(u64, PathBuf)> = Vec::new();
    let mut remove = Vec::new();
    for path in files(directory)? {
        let Some(rest) = file_name(&path).strip_prefix(&prefix) else { continue };
        match stem(rest).and_then(|digits| digits.parse().ok()) {
            Some(at) if at <= step => finished.push((at, path)),
            Some(_) => remove.push(path),
            None if rest.strip_suffix(".part").and_then(stem).is_some() => remove.push(path),
            None => {}
        }
    }
    // Of two names for one step the present one is the later.
    finished.sort_by_key(|(at, path)| (*at, file_name(path).ends_with(ENDING)));
    let old = finished.len().saturating_sub(keep);
    remove.extend(finished.into_iter().take(old).map(|(_, path)| path));
    remove.into_iter().try_for_each(|path| {
        std::fs::remove_file(&path).map_err(|source| FileError::System { path, action: "remove", source })
    })
}

fn file_name(path: &Path) -> &str {
    path.file_name().and_then(|name| name.to_str()).unwrap_or_default()
}

/// Files of a directory, sorted by name.
fn files(directory: &Path) -> Result<Vec<PathBuf>, FileError> {
    let listed = std::fs::read_dir(directory).and_then(|entries| {
        entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>()
    });
    let mut paths =
        listed.map_err(|source| FileError::System { path: directory.into(), action: "list", source })?;
    paths.sort();
    Ok(paths)
}
