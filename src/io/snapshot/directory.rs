//! Finding and keeping the files of a run.

use std::path::{Path, PathBuf};

use super::header::Header;
use crate::io::hdf5_file::{FileError, Reader};
use crate::io::series::{Entry, Series};

/// How names of files in ParaView's format end. Every ParaView that reads the format (5.11 and newer) opens
/// `.hdf`; the longer `.vtkhdf` is unknown to 5.11.
const ENDING: &str = ".hdf";

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

/// Name of a file of a run, without its ending.
fn stem(name: &str) -> Option<&str> {
    name.strip_suffix(ENDING)
}

/// Part of a name between the number of an output and the ending of its tree.
const TREE: &str = ".tree";

/// Part of a name between the run and the step of a checkpoint.
const CHECKPOINT: &str = ".checkpoint_";

/// Path of the checkpoint of a step.
pub fn checkpoint_path(directory: &Path, name: &str, step: u64) -> PathBuf {
    directory.join(format!("{name}{CHECKPOINT}{step:09}{ENDING}"))
}

/// Files from which a run may continue.
#[derive(Debug, Default)]
pub struct Candidates {
    /// Those that hold a restart state and seem complete, with their steps; the latest first.
    pub whole: Vec<(PathBuf, u64)>,
    /// Why others cannot be read.
    pub damaged: Vec<FileError>,
    /// A file that is skipped since it is of another job.
    pub other: Option<PathBuf>,
}

/// Not collective. The checkpoints and outputs of the run `name` that hold a restart state, by their headers.
///
/// A directory may still hold files of an earlier run of that name. Outputs that the index of the run does
/// not list are such files, as are files of a job with another digest if `job_digest` is given; neither
/// counts.
pub fn candidates(directory: &Path, name: &str, job_digest: Option<u64>) -> Result<Candidates, FileError> {
    let mut found = Candidates::default();
    let listed = Series::listed(&series_path(directory, name));
    let is_listed = |name: &str| {
        listed.as_ref().is_none_or(|entries: &Vec<Entry>| entries.iter().any(|entry| entry.name == name))
    };
    for (kind, _, path) in results(directory, name)? {
        if kind == Kind::Output && !is_listed(file_name(&path)) {
            continue;
        }
        match header(&path) {
            Ok(header) if !header.restart => {}
            Ok(header) if job_digest.is_some_and(|ours| ours != header.job_digest) => {
                found.other.get_or_insert(path);
            }
            Ok(header) => found.whole.push((path, header.step)),
            Err(error) => found.damaged.push(error),
        }
    }
    // Of one step, checkpoints come before outputs.
    found.whole.sort_by_key(|(_, step)| std::cmp::Reverse(*step));
    Ok(found)
}

/// Results that a run would destroy if it started anew.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AtStake {
    /// Checkpoints, the latest of which is this one.
    Checkpoint(PathBuf),
    /// Outputs of another job, such as this one.
    OtherJob(PathBuf),
}

/// Not collective. Results that a run `name` of the job with this digest would destroy if it started anew.
pub fn at_stake(directory: &Path, name: &str, job_digest: u64) -> Result<Option<AtStake>, FileError> {
    let results = results(directory, name)?;
    let of = |wanted: Kind| results.iter().filter(move |(kind, ..)| *kind == wanted).map(|(.., path)| path);
    if let Some(checkpoint) = of(Kind::Checkpoint).next_back() {
        return Ok(Some(AtStake::Checkpoint(checkpoint.clone())));
    }
    // A run replaces outputs from the first on, so if any are of another job, the first or the last is.
    let is_other = |path: &&PathBuf| header(path).is_ok_and(|header| header.job_digest != job_digest);
    let ends = of(Kind::Output).next().into_iter().chain(of(Kind::Output).next_back());
    Ok(ends.into_iter().find(is_other).map(|path| AtStake::OtherJob(path.clone())))
}

/// Not collective. Of the checkpoints of the run `name` and the job with this digest, keeps the `keep` latest
/// up to step `step`, which was just written. Those of later steps were left by an earlier run, and are
/// removed too, as are temporary files of checkpoints that were never finished. Those of other jobs stay, as
/// do those that cannot be read.
pub fn remove_old_checkpoints(
    directory: &Path,
    name: &str,
    job_digest: u64,
    step: u64,
    keep: usize,
) -> Result<(), FileError> {
    let prefix = format!("{name}.checkpoint_");
    let is_part = |path: &PathBuf| {
        let rest = file_name(path).strip_prefix(&prefix).and_then(|rest| rest.strip_suffix(".part"));
        rest.and_then(stem).is_some()
    };
    let mut remove: Vec<PathBuf> = files(directory)?.into_iter().filter(is_part).collect();
    let own = results(directory, name)?.into_iter().filter(|(kind, _, path)| {
        *kind == Kind::Checkpoint && header(path).is_ok_and(|header| header.job_digest == job_digest)
    });
    let (earlier, later): (Vec<_>, Vec<_>) = own.partition(|&(_, at, _)| at <= step);
    let old = earlier.len().saturating_sub(keep);
    remove.extend(later.into_iter().chain(earlier.into_iter().take(old)).map(|(.., path)| path));
    remove.into_iter().try_for_each(|path| {
        std::fs::remove_file(&path).map_err(|source| FileError::System { path, action: "remove", source })
    })
}

/// Not collective. Removes what earlier parts of the run `name` were writing when something killed them:
/// files under temporary names. They are harmless, so that one that cannot be removed stays.
pub fn remove_unfinished(directory: &Path, name: &str) {
    let unfinished = files(directory).unwrap_or_default().into_iter();
    for path in unfinished.filter(|path| is_unfinished(file_name(path), name)) {
        let _ = std::fs::remove_file(path);
    }
}

/// Ends of file names of a run, but for outputs, trees, checkpoints and maps.
const OTHERS: [&str; 6] =
    [".hdf.series", ".tree.hdf.series", ".report.json", ".ended.json", ".png", ".report.html"];

/// Whether a file is one that the run `name` has not finished writing, and not one of another run whose name
/// begins alike.
fn is_unfinished(file: &str, name: &str) -> bool {
    let rest = file.strip_suffix(".part").and_then(|file| file.strip_prefix(name));
    let Some(rest) = rest else { return false };
    let stem = stem(rest).map(|stem| stem.strip_suffix(".tree").unwrap_or(stem));
    let number = stem.and_then(|stem| stem.strip_prefix(CHECKPOINT).or_else(|| stem.strip_prefix('_')));
    number.is_some_and(|digits| digits.bytes().all(|byte| byte.is_ascii_digit()))
        || OTHERS.contains(&rest)
        || rest.starts_with(".map_") && rest.ends_with(".asc")
}

/// Kind of a file of a run, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Checkpoint,
    Output,
}

/// Name of the run that wrote an output or checkpoint, by the name of the file.
pub fn run_of(path: &Path) -> &str {
    let own = || path.file_stem().and_then(|name| name.to_str()).unwrap_or_default();
    let stem = stem(file_name(path)).unwrap_or_else(own);
    let stem = stem.split(CHECKPOINT).next().unwrap_or(stem);
    let stem = stem.strip_suffix(TREE).unwrap_or(stem);
    match stem.rsplit_once('_') {
        Some((name, number)) if number.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => stem,
    }
}

/// Whether a file or an index is, by its name, of the tree.
pub fn is_of_tree(path: &Path) -> bool {
    let name = file_name(path);
    stem(name.strip_suffix(".series").unwrap_or(name)).is_some_and(|stem| stem.ends_with(TREE))
}

/// Not collective. Names of the runs that have an index or outputs in a directory, sorted.
pub fn runs(directory: &Path) -> Vec<String> {
    let files = files(directory).unwrap_or_default();
    let mut names: Vec<String> =
        files.iter().filter_map(|path| run_by_name(path)).map(str::to_owned).collect();
    names.sort();
    names.dedup();
    names
}

/// The run of an index of outputs or of an output, by its name.
fn run_by_name(path: &Path) -> Option<&str> {
    let name = file_name(path);
    if is_of_tree(path) {
        return None;
    }
    if let Some(index) = name.strip_suffix(".series") {
        return stem(index);
    }
    let (name, number) = stem(name)?.rsplit_once('_')?;
    let is_number = number.len() >= 6 && number.bytes().all(|byte| byte.is_ascii_digit());
    (is_number && !name.ends_with(CHECKPOINT.trim_end_matches('_'))).then_some(name)
}

/// Not collective. The outputs of a run that has no index, by their numbers.
pub fn outputs_without_index(directory: &Path, name: &str) -> Vec<PathBuf> {
    let results = results(directory, name).unwrap_or_default();
    results.into_iter().filter(|(kind, ..)| *kind == Kind::Output).map(|(.., path)| path).collect()
}

/// Checkpoints and outputs of the run `name` with their numbers, in the order of these.
fn results(directory: &Path, name: &str) -> Result<Vec<(Kind, u64, PathBuf)>, FileError> {
    let result = |path: PathBuf| {
        let number = stem(file_name(&path).strip_prefix(name)?)?;
        let (kind, digits) = match number.strip_prefix(CHECKPOINT) {
            Some(digits) => (Kind::Checkpoint, digits),
            None => (Kind::Output, number.strip_prefix('_')?),
        };
        let is_number = digits.bytes().all(|byte| byte.is_ascii_digit());
        // To open a pipe of that name would block.
        (is_number && path.is_file()).then_some((kind, digits.parse().ok()?, path))
    };
    let mut found: Vec<_> = files(directory)?.into_iter().filter_map(result).collect();
    found.sort_by_key(|(kind, number, _): &(Kind, u64, PathBuf)| (*kind, *number));
    Ok(found)
}

/// The header of a file, read by this process alone.
fn header(path: &Path) -> Result<Header, FileError> {
    Header::read(&Reader::open_alone(path)?)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_run_was_writing_goes_and_all_else_stays() {
        let gone =
            ["a_000001.hdf", "a_000001.tree.hdf", "a.checkpoint_000000012.hdf", "a.hdf.series", "a.png"];
        let gone = gone.map(|name| format!("{name}.part"));
        let stays = [
            "a_000001.hdf",
            "a.history.csv",
            "a_b_000001.hdf.part",
            "a_b.png.part",
            "ab.png.part",
            "a.txt.part",
        ];
        let directory = tempfile::tempdir().unwrap();
        let path = |name: &str| directory.path().join(name);
        gone.iter().map(String::as_str).chain(stays).for_each(|name| std::fs::write(path(name), "").unwrap());
        remove_unfinished(directory.path(), "a");
        assert!(gone.iter().all(|name| !path(name).exists()));
        assert!(stays.iter().all(|name| path(name).exists()));
    }
}
