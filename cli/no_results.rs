//! The end of a run in a build without the feature `post`, in place of `results/ended.rs`: no picture, no
//! page, no hints.
use std::io::Write;
use std::path::{Path, PathBuf};

use agimp::run::Summary;
use agimp::run::scene::Pictures;

pub(crate) const PICTURES: Option<Pictures<'static>> = None;

pub(crate) fn page(_directory: &Path, _name: &str, _job: &Path) -> Option<Result<PathBuf, String>> {
    None
}

pub(crate) fn hints(
    _out: &mut impl Write,
    _summary: &Summary,
    _directory: &Path,
    _name: &str,
    _has_page: bool,
) -> std::io::Result<()> {
    Ok(())
}
