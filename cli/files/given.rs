//! The files that a command line means: each word is a file, the directory of a run, the index of its outputs
//! or its job file.
use std::path::{Path, PathBuf};

use crate::Failure;
use agimp::io::series::Series;
use agimp::io::snapshot::directory::{is_of_tree, outputs_without_index, run_of, runs, series_path};
use agimp::job;
use agimp::text::shell_word;

/// Files that a command line means.
pub(crate) struct Given {
    /// At least one, in the order of the words, and of a run in order of time.
    pub files: Vec<PathBuf>,
    /// The file or index after which results are named.
    pub first: PathBuf,
}

impl Given {
    /// Files with particles. Files of the tree that match a pattern such as `out/a/*.hdf` are skipped, as the
    /// outputs match as well.
    ///
    /// # Errors
    /// A word means no files, or only files of the tree.
    pub(crate) fn particles(words: &[PathBuf]) -> Result<Self, Failure> {
        let given = Self::any(words)?;
        if !is_of_tree(&given.first) {
            return Ok(given);
        }
        let found = given.first.display();
        let beside = given.first.to_string_lossy().replacen(".tree.", ".", 1);
        Err(Failure::Usage(format!(
            "{found}: found the tree of a run, which holds no particles; expected its outputs: {beside}"
        )))
    }

    /// Files with particles; files of the tree if all are such.
    ///
    /// # Errors
    /// A word means no files.
    pub(crate) fn any(words: &[PathBuf]) -> Result<Self, Failure> {
        let mut all: Vec<(PathBuf, PathBuf)> = Vec::new();
        for word in words {
            let (first, files) = meant(word)?;
            all.extend(files.into_iter().map(|file| (first.clone().unwrap_or_else(|| file.clone()), file)));
        }
        let is_tree = |(_, file): &(PathBuf, PathBuf)| is_of_tree(file);
        if !all.iter().all(is_tree) {
            all.retain(|entry| !is_tree(entry));
        }
        let first = all.first().map_or_else(PathBuf::new, |(first, _)| first.clone());
        Ok(Self { files: all.into_iter().map(|(_, file)| file).collect(), first })
    }
}

/// The files that a word means, and the index that names them, if the word is not a file itself.
fn meant(word: &Path) -> Result<(Option<PathBuf>, Vec<PathBuf>), Failure> {
    let ending = word.extension().unwrap_or_default();
    if word.is_dir() {
        return of_directory(word, None);
    }
    if ending == "toml" {
        let problem = job::load(word)?;
        return of_directory(&problem.output().directory, Some(problem.name())).map_err(|error| {
            Failure::Usage(format!("{error}; run the job first: agimp run {}", shell_word(word)))
        });
    }
    if ending != "series" {
        return Ok((None, vec![word.to_path_buf()]));
    }
    let refused = |reason: &str| Failure::Usage(format!("{}: {reason}", word.display()));
    let entries = Series::listed(word).ok_or_else(|| {
        refused("found no index of outputs; expected a file such as NAME.hdf.series, written by a run")
    })?;
    if entries.is_empty() {
        return Err(refused("the index lists no outputs"));
    }
    let files = entries.into_iter().map(|entry| word.with_file_name(entry.name)).collect();
    Ok((Some(word.to_path_buf()), files))
}

/// The outputs in a directory: of the run of this name if one is given, else of the only run there.
fn of_directory(directory: &Path, name: Option<&str>) -> Result<(Option<PathBuf>, Vec<PathBuf>), Failure> {
    let refused = |reason: String| Failure::Usage(format!("{}: {reason}", directory.display()));
    let mut names = runs(directory);
    names.retain(|found| name.is_none_or(|name| name == found));
    let name = match names.as_slice() {
        [] => {
            return Err(refused(
                "found no outputs of a run; expected NAME.hdf.series or NAME_000000.hdf".into(),
            ));
        }
        [name] => name,
        [first, ..] => {
            let one = series_path(directory, first);
            let reason =
                format!("found the outputs of {}; name one run: {}", names.join(", "), one.display());
            return Err(refused(reason));
        }
    };
    let index = series_path(directory, name);
    let files = match Series::listed(&index) {
        Some(entries) => entries.into_iter().map(|entry| directory.join(entry.name)).collect(),
        None => outputs_without_index(directory, name),
    };
    if files.is_empty() {
        return Err(refused(format!("the index of {name} lists no outputs")));
    }
    Ok((Some(index), files))
}

/// Directory and name of the run that wrote the files.
///
/// # Errors
/// They are of several runs.
pub(crate) fn run_of_files(files: &[PathBuf]) -> Result<(PathBuf, String), Failure> {
    let run = |file: &PathBuf| {
        let directory = file.parent().filter(|parent| !parent.as_os_str().is_empty());
        (directory.unwrap_or(Path::new(".")).to_path_buf(), run_of(file).to_owned())
    };
    let mut found: Vec<(PathBuf, String)> = files.iter().map(run).collect();
    found.dedup();
    match found.as_slice() {
        [one] => Ok(one.clone()),
        several => {
            let names: Vec<String> =
                several.iter().map(|(directory, name)| directory.join(name).display().to_string()).collect();
            Err(Failure::Usage(format!("found files of {}; expected those of one run", names.join(", "))))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(files: &[PathBuf]) -> Vec<&str> {
        files.iter().map(|file| file.file_name().unwrap_or_default().to_str().unwrap_or_default()).collect()
    }

    #[test]
    fn a_directory_an_index_and_files_mean_the_same() {
        let directory = tempfile::tempdir().unwrap();
        let here = directory.path();
        for name in ["a_000000.hdf", "a_000001.hdf", "a_000001.tree.hdf", "a.checkpoint_000000007.hdf"] {
            std::fs::write(here.join(name), "").unwrap();
        }
        let both = ["a_000000.hdf", "a_000001.hdf"];
        let given = |words: &[PathBuf]| Given::particles(words).map_err(|error| error.to_string());
        // A run that was ended before it had an index.
        assert_eq!(names(&given(&[here.into()]).unwrap().files), both);
        let index = here.join("a.hdf.series");
        let mut series = Series::new(&index);
        both.iter().zip([0.0, 0.1]).for_each(|(name, time)| series.push(name, time).unwrap());
        for word in [here.to_path_buf(), index.clone()] {
            let found = given(&[word]).unwrap();
            assert_eq!((names(&found.files), &found.first), (both.to_vec(), &index));
        }
        let pattern = ["a_000000.hdf", "a_000001.hdf", "a_000001.tree.hdf"].map(|name| here.join(name));
        assert_eq!(names(&given(&pattern).unwrap().files), both);
        assert_eq!(given(&pattern).unwrap().first, pattern[0]);
        // A tree alone is refused, with a hint to its output.
        let told = given(&pattern[2..]).err().unwrap();
        assert!(
            told.contains("a_000001.tree.hdf: found the tree") && told.ends_with("a_000001.hdf"),
            "{told}"
        );
        assert_eq!(names(&Given::any(&pattern[2..]).unwrap().files), ["a_000001.tree.hdf"]);
        // Another run beside it.
        std::fs::write(here.join("b_000000.hdf"), "").unwrap();
        let told = given(&[here.into()]).err().unwrap();
        assert!(told.contains("found the outputs of a, b; name one run: "), "{told}");
        assert_eq!(run_of_files(&pattern).unwrap(), (here.to_path_buf(), "a".to_owned()));
        assert!(run_of_files(&[pattern[0].clone(), here.join("b_000000.hdf")]).is_err());
    }

    #[test]
    fn a_directory_without_outputs_says_so() {
        let directory = tempfile::tempdir().unwrap();
        let told = Given::any(&[directory.path().into()]).err().unwrap().to_string();
        assert!(told.contains("found no outputs of a run; expected NAME.hdf.series"), "{told}");
    }
}
