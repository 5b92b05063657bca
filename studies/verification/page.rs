//! The page of results.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::plot::Chart;

/// Markdown text with tables, plots beside it, and the outcome of all checks.
pub(crate) struct Page {
    path: PathBuf,
    body: String,
    failed: usize,
}

impl Page {
    /// A page to be written to `path`; plots go to a folder beside it.
    pub(crate) fn new(path: &Path) -> Self {
        Self { path: path.to_path_buf(), body: String::new(), failed: 0 }
    }

    fn plots(&self) -> PathBuf {
        self.path.with_extension("")
    }

    /// Adds text.
    pub(crate) fn text(&mut self, text: &str) {
        self.body.push_str(text);
        self.body.push('\n');
    }

    /// Adds a table.
    pub(crate) fn table(&mut self, heads: &[&str], rows: &[Vec<String>]) {
        let _ = writeln!(self.body, "| {} |\n|{}", heads.join(" | "), " --- |".repeat(heads.len()));
        for row in rows {
            let _ = writeln!(self.body, "| {} |", row.join(" | "));
        }
        self.body.push('\n');
    }

    /// Adds a plot.
    pub(crate) fn plot(&mut self, name: &str, chart: &Chart) {
        self.picture(name, chart.title, &chart.svg());
    }

    /// Adds a picture.
    pub(crate) fn picture(&mut self, name: &str, title: &str, svg: &str) {
        let folder = self.plots();
        let written = std::fs::create_dir_all(&folder)
            .and_then(|()| std::fs::write(folder.join(name).with_extension("svg"), svg));
        crate::checked(written);
        let folder = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let _ = writeln!(self.body, "![{title}]({folder}/{name}.svg)\n");
    }

    /// Adds a line that says whether something holds.
    pub(crate) fn check(&mut self, what: &str, found: f64, holds: bool) {
        let verdict = if holds { "holds" } else { "**fails**" };
        let line = format!("- {what}: {found:.3e}, {verdict}");
        println!("{line}");
        self.text(&line);
        self.failed += usize::from(!holds);
    }

    /// Writes the page; returns the number of checks that failed.
    pub(crate) fn finish(self) -> usize {
        let head = "# Verification\n\n\
                    Written by `studies/verification/run`, which runs every case below anew.\n\n";
        checked_write(&self.path, &(head.to_string() + &self.body));
        self.failed
    }
}

fn checked_write(path: &Path, text: &str) {
    if let Some(folder) = path.parent() {
        crate::checked(std::fs::create_dir_all(folder));
    }
    crate::checked(std::fs::write(path, text));
}
