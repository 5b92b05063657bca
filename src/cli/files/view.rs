//! `agimp view`: particles and tree of outputs as a page for a browser.
use crate::cli::Failure;
use crate::io::frame::expand;
use crate::io::snapshot::PointField;
use crate::text::bytes;
use crate::view::{self, Options};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `agimp view`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Output or checkpoint files of one run, in order of time, or the index of its outputs (NAME.hdf.series).
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Fields to take along, separated by commas; without it, all that the files show but identifiers and components.
    #[arg(long, value_delimiter = ',', value_parser = field)]
    fields: Option<Vec<PointField>>,
    /// Bits for each real value; more are finer and make a larger page.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u8).range(4..=16))]
    bits: u8,
    /// Title; without it, the name of the first file.
    #[arg(long)]
    title: Option<String>,
    /// Page to write; without it, beside the first file with the ending html.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// A field by its name.
fn field(name: &str) -> Result<PointField, String> {
    PointField::from_name(name).ok_or_else(|| {
        let names: Vec<&str> = PointField::ALL.into_iter().map(PointField::name).collect();
        format!("expected one of {}", names.join(", "))
    })
}

/// Writes the page.
///
/// # Errors
/// A file cannot be read or does not show a field, or the page cannot be written.
pub(in crate::cli) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let failed = |error: crate::io::hdf5_file::FileError| Failure::Usage(error.to_string());
    let given = without_trees(&arguments.files);
    let files = expand(&given).map_err(failed)?;
    let (first, out) = (&given[0], arguments.out.as_deref());
    let out = out.map_or_else(|| beside(first), Path::to_path_buf);
    let name = out.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let title = arguments.title.clone().unwrap_or(name);
    let options = Options { title, fields: arguments.fields.clone(), bits: arguments.bits };
    let size = view::write(&files, &options, &out).map_err(failed)?;
    let times = if files.len() == 1 { "one time".into() } else { format!("{} times", files.len()) };
    writeln!(std::io::stdout(), "{} ({times}, {}; open in a browser)", out.display(), bytes(size as f64))?;
    Ok(())
}

/// What a pattern such as `out/a/*.hdf` gives, without the trees, whose outputs are there as well.
fn without_trees(files: &[PathBuf]) -> Vec<PathBuf> {
    let is_tree = |file: &&PathBuf| file.to_string_lossy().ends_with(".tree.hdf");
    if files.iter().all(|file| is_tree(&file)) {
        return files.to_vec();
    }
    files.iter().filter(|file| !is_tree(file)).cloned().collect()
}

/// `a/b.hdf.series` and `a/b.hdf` have their page in `a/b.html`.
fn beside(file: &Path) -> PathBuf {
    let output = if file.extension().is_some_and(|ending| ending == "series") {
        file.with_extension("")
    } else {
        file.to_path_buf()
    };
    output.with_extension("html")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_may_take_trees_along() {
        let paths = |names: &[&str]| names.iter().map(PathBuf::from).collect::<Vec<_>>();
        let all = paths(&["a_000000.hdf", "a_000000.tree.hdf", "a_000001.hdf"]);
        assert_eq!(without_trees(&all), paths(&["a_000000.hdf", "a_000001.hdf"]));
        // A tree alone is refused by its name.
        assert_eq!(without_trees(&all[1..2]), all[1..2]);
    }

    #[test]
    fn page_lies_beside_the_file() {
        assert_eq!(beside(Path::new("out/a/a.hdf.series")), Path::new("out/a/a.html"));
        assert_eq!(beside(Path::new("out/a/a_000001.hdf")), Path::new("out/a/a_000001.html"));
    }
}
