//! Subcommands for output and checkpoint files.
//!
//! | file | task |
//! |---|---|
//! | `given.rs` | finds the files that a command line means |
//! | `info.rs` | lists the contents of a file |
//! | `plot.rs`, `movie.rs`, `view.rs` | draws particles: as PNG, as a movie, as a page for a browser |
//! | `export.rs` | writes particles for other programs |
//! | `report.rs` | writes a run on one page |
//! | `digest.rs`, `diff.rs` | compares states: by a number, in detail |
pub(super) mod diff;
pub(super) mod digest;
pub(super) mod export;
mod given;
pub(super) mod info;
pub(super) mod movie;
pub(super) mod plot;
pub(super) mod report;
pub(super) mod view;

use std::path::{Path, PathBuf};

use crate::io::snapshot::PointField;

/// A field by its name.
fn field(name: &str) -> Result<PointField, String> {
    PointField::from_name(name).ok_or_else(|| {
        let names: Vec<&str> = PointField::ALL.into_iter().map(PointField::name).collect();
        format!("expected one of {}", names.join(", "))
    })
}

/// With the ending `html`, `a/b.hdf.series` and `a/b.hdf` have their page in `a/b.html`.
fn beside(file: &Path, ending: &str) -> PathBuf {
    let output = if file.extension().is_some_and(|ending| ending == "series") {
        file.with_extension("")
    } else {
        file.to_path_buf()
    };
    output.with_extension(ending)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_lies_beside_the_file() {
        assert_eq!(beside(Path::new("out/a/a.hdf.series"), "html"), Path::new("out/a/a.html"));
        assert_eq!(beside(Path::new("out/a/a_000001.hdf"), "html"), Path::new("out/a/a_000001.html"));
    }
}
