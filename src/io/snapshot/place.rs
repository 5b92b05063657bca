//! Place of the job file of a run, as its files record it: meshes and terrains that the job names lie beside
//! it.
use std::path::{Component, Path, PathBuf};

use super::header::GROUP;
use crate::io::hdf5_file::{FileError, Reader, Writer};

/// Attribute with the path from the root of the file system.
const ABSOLUTE: &str = "job_file";
/// Attribute with the path from the directory of the output, which holds as long as both are moved together.
const RELATIVE: &str = "job_file_relative";

/// Collective. Records in a file of a run where its job file is; no record if that is not known on rank 0.
pub(super) fn write(file: &Writer, output: &Path, job: &Path) -> Result<(), FileError> {
    let texts = match (job.is_absolute(), job.to_str()) {
        (true, Some(absolute)) => {
            let directory = output.parent().filter(|parent| !parent.as_os_str().is_empty());
            let directory = directory.unwrap_or(Path::new(".")).canonicalize().ok();
            let relative = directory.map(|directory| from(&directory, job));
            let relative = relative.and_then(|path| path.to_str().map(str::to_owned));
            let relative = relative.map(|path| (RELATIVE, path));
            [Some((ABSOLUTE, absolute.to_owned())), relative].into_iter().flatten().collect()
        }
        _ => Vec::new(),
    };
    let texts: Vec<(&str, &str)> = texts.iter().map(|(name, text)| (*name, &**text)).collect();
    file.set_texts(GROUP, &texts)
}

/// Not collective. Candidates for the job file of the run that wrote a file: relative to the file, then
/// absolute. Empty where the file does not say it.
pub fn job_files(output: &Path) -> Vec<PathBuf> {
    let Ok(file) = Reader::open_alone(output) else { return Vec::new() };
    let read = |name: &str| {
        let path = file.has_attribute(GROUP, name).then(|| file.text(GROUP, name).ok())??;
        Some(PathBuf::from(path))
    };
    let beside = |path: PathBuf| output.parent().unwrap_or(Path::new("")).join(path);
    read(RELATIVE).map(beside).into_iter().chain(read(ABSOLUTE)).collect()
}

/// The way from a directory to a file, both from the root of the file system and without links.
fn from(directory: &Path, file: &Path) -> PathBuf {
    let common = directory.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    let up = directory.components().skip(common).map(|_| Component::ParentDir);
    up.chain(file.components().skip(common)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_between_directories() {
        for (directory, file, way) in [
            ("/a/out/job", "/a/job.toml", "../../job.toml"),
            ("/a", "/a/b/job.toml", "b/job.toml"),
            ("/x/y", "/a/job.toml", "../../a/job.toml"),
            ("/", "/job.toml", "job.toml"),
        ] {
            assert_eq!(from(Path::new(directory), Path::new(file)), Path::new(way));
        }
    }
}
