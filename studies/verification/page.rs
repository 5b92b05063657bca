//! The page of results.
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::lines::Lines;
use crate::plot::Chart;

/// Markdown text with tables, plots beside it, and the outcome of all checks.
pub(crate) struct Page {
    path: PathBuf,
    body: String,
    lines: Lines,
    /// How many lines have been taken.
    taken: usize,
}

impl Page {
    /// A page to be written to `path`; plots go to a folder beside it.
    pub(crate) fn new(path: &Path, top: &Path) -> Self {
        Self { path: path.to_path_buf(), body: String::new(), lines: Lines::new(top), taken: 0 }
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

    /// Adds a line of the table of results.
    pub(crate) fn line(&mut self, id: &str, ours: f64) {
        self.lines.add(id, ours);
    }

    /// Takes the text and the lines since the last call.
    pub(crate) fn take(&mut self) -> (String, Vec<(String, f64)>) {
        (std::mem::take(&mut self.body), self.lines.since(&mut self.taken))
    }

    /// Adds text and lines that were taken.
    pub(crate) fn give(&mut self, (text, lines): (String, Vec<(String, f64)>)) {
        self.body.push_str(&text);
        self.lines.put(lines);
    }

    /// The lines so far.
    pub(crate) fn lines(&self) -> &Lines {
        &self.lines
    }

    /// Writes the page.
    pub(crate) fn finish(&self) {
        let (failures, _) = self.lines.failures();
        let head = format!(
            "# Verification\n\n\
             Written by `studies/verification/run --full`, which runs every case below anew; `--quick` runs the small ones, `--only NAME` one, whose section it replaces. References and tolerances \
             stand in [expected.toml](../studies/verification/expected.toml) and in [tables](../studies/verification/references/README.md) made by other codes.\n\n\
             {failures} of {} lines fail.\n\n",
            self.lines.count()
        );
        let sources = format!("\n## References\n\n{}", self.lines.sources());
        checked_write(&self.path, &(head + &self.lines.table() + "\n" + &self.body + &sources));
    }
}

fn checked_write(path: &Path, text: &str) {
    if let Some(folder) = path.parent() {
        crate::checked(std::fs::create_dir_all(folder));
    }
    crate::checked(std::fs::write(path, text));
}
