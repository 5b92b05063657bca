//! `agimp view`: particles and tree of outputs as one HTML file that draws itself with WebGL.
//!
//! | file | what it holds |
//! |---|---|
//! | `options.rs` | options of a view |
//! | `columns.rs` | numbers of the particles in the file, and their ranges over all times |
//! | `pack.rs` | numbers as few bytes: sorted along a curve, as differences, compressed |
//! | `meta.rs` | metadata of the page, as JSON |
//! | `page/` | the page itself: HTML, style and scripts |
//!
//! Positions keep a 32nd of the smallest particle's half width; fields keep a given number of bits on a scale
//! that is fine near zero (`columns::Scale`). Both are far below what a picture shows; `agimp export` has
//! exact numbers.
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use crate::frame::{Frame, Leaves, shown_in};
use agimp::io::hdf5_file::FileError;
use agimp::io::snapshot::PointField;

mod columns;
mod meta;
mod options;
mod pack;

use columns::{Column, LeafMaxima};
use meta::{FrameMeta, Meta};
pub use options::Options;

/// The page without its data, in three parts: up to the style, up to the data, up to the script.
const PAGE: &str = include_str!("page/index.html");
const STYLE: &str = include_str!("page/style.css");
/// In this order: later ones use earlier ones.
const SCRIPTS: [&str; 7] = [
    include_str!("page/data.js"),
    include_str!("page/colours.js"),
    include_str!("page/camera.js"),
    include_str!("page/scene.js"),
    include_str!("page/labels.js"),
    include_str!("page/controls.js"),
    include_str!("page/main.js"),
];

/// Not collective. Writes the particles and trees of `files`, in this order, to one HTML file. Returns its
/// size in bytes.
///
/// # Errors
/// A file cannot be read or does not show a field that was asked for, or the HTML file cannot be written; it
/// is then absent or unchanged.
pub fn write(files: &[PathBuf], options: &Options, out: &Path) -> Result<u64, FileError> {
    let part = out.with_added_extension("part");
    let failed = |source| FileError::System { path: out.into(), action: "write", source };
    let written = fill(files, options, &part, &failed).and_then(|size| {
        std::fs::rename(&part, out).map_err(failed)?;
        Ok(size)
    });
    if written.is_err() {
        // The error that matters is the one before.
        let _ = std::fs::remove_file(&part);
    }
    written
}

fn fill(
    files: &[PathBuf],
    options: &Options,
    part: &Path,
    failed: &impl Fn(io::Error) -> FileError,
) -> Result<u64, FileError> {
    let first = files.first().ok_or_else(|| failed(io::Error::other("no output was given")))?;
    let columns = Column::chosen(&shown_in(first)?, options.fields.as_deref(), first)?;
    let wanted = columns::sources(&columns);
    let mut survey = LeafMaxima::new(columns.len());
    for path in files {
        survey.look(path, &shown(path, &wanted, options)?, &columns)?;
    }
    let scales = survey.scales(&columns, options.bits);

    let mut file = BufWriter::new(std::fs::File::create(part).map_err(failed)?);
    let (before_style, rest) = split(PAGE, "/*STYLE*/");
    let (before_data, rest) = split(rest, "<!--DATA-->");
    let (before_script, after) = split(rest, "/*SCRIPT*/");
    let mut page = |text: &str| file.write_all(text.as_bytes()).map_err(failed);
    let title = agimp::text::html(&options.title);
    page(&before_style.replace("TITLE", &title))?;
    page(STYLE)?;
    page(&before_data.replace("TITLE", &title))?;

    let mut frames = Vec::new();
    let mut tree: Option<(usize, Leaves)> = None;
    for (number, path) in files.iter().enumerate() {
        let frame = shown(path, &wanted, options)?;
        page(&data(&format!("frame-{number}"), &pack::particles(&frame, &columns, &scales, &survey)))?;
        // A tree of sections has no place among bodies in space.
        let leaves = if options.revolve.is_some() { Leaves::default() } else { Leaves::of_output(path)? };
        // A tree that does not change is kept once.
        if tree.as_ref().is_none_or(|(_, known)| *known != leaves) {
            page(&data(&format!("tree-{number}"), &pack::leaves(&leaves)))?;
            tree = Some((number, leaves));
        }
        let (of_frame, leaves) = tree.as_ref().map_or((number, 0), |(of, leaves)| (*of, leaves.levels.len()));
        frames.push(FrameMeta::new(path, &frame.header, of_frame, leaves));
    }
    let meta = Meta::new(options, &columns, &scales, &survey, frames);
    page(&format!("<script type=\"application/json\" id=\"meta\">{}</script>\n", meta.json()))?;
    page(before_script)?;
    for script in SCRIPTS {
        page(script)?;
    }
    page(after)?;
    let file = file.into_inner().map_err(|error| failed(error.into_error()))?;
    file.metadata().map(|data| data.len()).map_err(failed)
}

/// The particles of a file, in space if the page shows them so.
fn shown(path: &Path, wanted: &[PointField], options: &Options) -> Result<Frame, FileError> {
    let frame = Frame::read(path, wanted, true)?;
    match options.revolve {
        Some(revolve) => {
            frame.revolved(revolve).map_err(|reason| FileError::Refused { path: path.into(), reason })
        }
        None => Ok(frame),
    }
}

/// Compressed numbers as an element of the page that no browser runs or shows.
fn data(id: &str, bytes: &[u8]) -> String {
    format!("<script type=\"text/plain\" id=\"{id}\">{}</script>\n", BASE64.encode(pack::compress(bytes)))
}

fn split(text: &'static str, mark: &str) -> (&'static str, &'static str) {
    text.split_once(mark).unwrap_or((text, ""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_has_its_marks_once_and_asks_nobody() {
        for mark in ["/*STYLE*/", "<!--DATA-->", "/*SCRIPT*/"] {
            assert_eq!(PAGE.matches(mark).count(), 1, "{mark}");
        }
        for text in SCRIPTS.into_iter().chain([PAGE, STYLE]) {
            for word in ["http:", "https:", "src=", "import(", "@import", "XMLHttpRequest", "fetch("] {
                assert!(!text.contains(word), "{word}");
            }
        }
        for script in SCRIPTS {
            assert!(!script.contains("</script"), "would end the element that holds it");
        }
    }
}
