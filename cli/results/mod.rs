//! Subcommands that draw outputs or write them for others; a build without the feature `post` has none of
//! them.
//!
//! | file | task |
//! |---|---|
//! | `looks.rs` | options of pictures and movies |
//! | `plot.rs`, `movie.rs`, `view.rs` | draws particles: as PNG, as a movie, as a page for a browser |
//! | `export.rs` | writes particles for other programs |
//! | `report.rs` | writes a run on one page |
//! | `ended.rs` | picture and page of a run that has ended |
pub(super) mod ended;
pub(super) mod export;
mod looks;
pub(super) mod movie;
pub(super) mod plot;
pub(super) mod report;
pub(super) mod view;

use std::path::{Path, PathBuf};

use agimp::io::snapshot::PointField;

use crate::Failure;

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

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    let own = path.extension().unwrap_or_default();
    endings.iter().any(|ending| own.eq_ignore_ascii_case(ending))
}

/// The file for each output: beside it with the first of the endings, in the directory that is given, or of
/// one output the file that is given with one of the endings.
///
/// # Errors
/// One file is given for several outputs; `hint` follows. The directory cannot be made.
fn outs(
    out: Option<&Path>,
    files: &[PathBuf],
    endings: &[&str],
    hint: &str,
) -> Result<Vec<PathBuf>, Failure> {
    let beside = |file: &PathBuf| file.with_extension(endings[0]);
    let Some(out) = out else { return Ok(files.iter().map(beside).collect()) };
    let found = out.display();
    if has_ending(out, endings) && !out.is_dir() {
        return match files.len() {
            1 => Ok(vec![out.to_path_buf()]),
            count => Err(Failure::Usage(format!(
                "{found}: found one file for {count} outputs; expected a directory, or one output{hint}"
            ))),
        };
    }
    std::fs::create_dir_all(out)
        .map_err(|error| Failure::Usage(format!("{found}: cannot create the directory: {error}")))?;
    Ok(files.iter().map(|file| out.join(beside(file).file_name().unwrap_or_default())).collect())
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
