//! `NAME.hdf.series`: the index that gives ParaView the times of the output files.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::hdf5_file::FileError;

/// One file of a series.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// File name, relative to the index.
    pub name: String,
    /// Simulated time, s.
    pub time: f64,
}

#[derive(Serialize, Deserialize)]
struct Contents {
    #[serde(rename = "file-series-version")]
    version: String,
    files: Vec<Entry>,
}

/// A series and its index file. Belongs to rank 0.
#[derive(Clone, Debug)]
pub struct Series {
    path: PathBuf,
    entries: Vec<Entry>,
}

impl Series {
    /// Not collective. A new series; the index file appears with the first entry.
    pub fn new(path: &Path) -> Self {
        Self { path: path.into(), entries: Vec::new() }
    }

    /// Not collective. The entries of an index file, if it can be read.
    pub fn listed(path: &Path) -> Option<Vec<Entry>> {
        let text = std::fs::read(path).ok()?;
        Some(serde_json::from_slice::<Contents>(&text).ok()?.files)
    }

    /// Not collective. The series of an earlier run, of which `entries` are listed, without those after
    /// `time`, from which it is restarted.
    pub fn resume(path: &Path, entries: Vec<Entry>, time: f64) -> Self {
        Self { path: path.into(), entries: entries.into_iter().filter(|entry| entry.time <= time).collect() }
    }

    /// The index file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The entries so far.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Not collective. Adds a file and rewrites the index as a whole, so that a reader never sees half of it.
    pub fn push(&mut self, name: &str, time: f64) -> Result<(), FileError> {
        self.entries.retain(|entry| entry.name != name && entry.time < time);
        self.entries.push(Entry { name: name.into(), time });
        let contents = Contents { version: "1.0".into(), files: self.entries.clone() };
        let text = serde_json::to_string_pretty(&contents).map_err(std::io::Error::other);
        text.and_then(|text| super::whole_file::write_whole(&self.path, text.as_bytes()))
            .map_err(|source| FileError::System { path: self.path.clone(), action: "write", source })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn restart_drops_later_entries() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.hdf.series");
        let mut series = Series::new(&path);
        for i in 0..5 {
            series.push(&format!("a_{i:06}.hdf"), 0.1 * f64::from(i)).unwrap();
        }
        let listed = || Series::listed(&path).unwrap();
        let mut again = Series::resume(&path, listed(), 0.25);
        assert_eq!(again.entries(), &series.entries()[..3]);
        again.push("a_000003.hdf", 0.1 * 3.0).unwrap();
        assert_eq!(Series::resume(&path, listed(), 9.0).entries(), &series.entries()[..4]);
        assert!(!path.with_added_extension("part").exists());
    }
}
