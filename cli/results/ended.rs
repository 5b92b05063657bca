//! The end of a run for its user: its last state as a picture, its page, commands that show more.
use std::io::Write;
use std::path::{Path, PathBuf};

use agimp::run::Summary;
use agimp::run::scene::Pictures;
use agimp::text::shell_word;
use post::picture::draw_last;
use post::report::{self, Options, Results};

/// Pictures of the last state.
pub(crate) const PICTURES: Option<Pictures<'static>> =
    Some(Pictures { two: &draw_last::<2>, three: &draw_last::<3> });

/// Writes the page of the run with these results. All of them are on disk by now, so a failure is only a
/// message. A build without the feature `post` has `None`.
pub(crate) fn page(directory: &Path, name: &str, job: &Path) -> Option<Result<PathBuf, String>> {
    let results = Results { directory: directory.into(), name: name.into() };
    let path = results.path("report.html");
    let options = Options { job: Some(job.to_path_buf()), ..Options::default() };
    let written = report::write(&results, &options, &path);
    Some(written.map(|_| path).map_err(|error| error.to_string()))
}

/// Commands that show more of the results.
pub(crate) fn hints(
    out: &mut impl Write,
    summary: &Summary,
    directory: &Path,
    name: &str,
    has_page: bool,
) -> std::io::Result<()> {
    let series = shell_word(&summary.series);
    let colour = if summary.is_still { "" } else { " --colour speed" };
    writeln!(out, "turn     agimp view {series}")?;
    if let Some(last) = &summary.last_output {
        writeln!(out, "draw     agimp plot {}{colour}", shell_word(last))?;
    }
    writeln!(out, "play     agimp movie {series}{colour}")?;
    if has_page {
        return Ok(());
    }
    let is_alone = Results::in_directory(directory, None).is_ok();
    let name = if is_alone { String::new() } else { format!(" --name {}", shell_word(Path::new(name))) };
    writeln!(out, "read     agimp report {}{name}", shell_word(directory))
}
