//! Code that tests of whole runs share: how a run is started, and its results.

use std::path::Path;

use super::launch::{self, Outcome};
use agimp::io::hdf5_file::Reader;
use agimp::io::snapshot::Header;

/// Runs a job on one rank in a directory, as `block.toml`, over what an earlier run has left. Returns what it
/// leaves.
pub(crate) fn outcome(directory: &Path, job: &str) -> Outcome {
    let path = directory.join("block.toml");
    std::fs::write(&path, job).expect("job");
    launch::succeed(&mut launch::run(directory, 1, 1, &path, &["--overwrite"]));
    Outcome::read(directory, "block")
}

/// Places (`None`) or a field of the particles in an output of a run, component by component.
pub(crate) fn particles(directory: &Path, job: &str, number: usize, field: Option<&str>) -> Vec<f64> {
    let path = launch::file(directory, job, &format!("_{number:06}.hdf"));
    let file = Reader::open_alone(&path).expect("output");
    let count = Header::read(&file).expect("header").particles;
    let name = field.map_or_else(|| "VTKHDF/Points".into(), |field| format!("VTKHDF/PointData/{field}"));
    file.read_slab(&name, 0, count).expect("a field")
}
