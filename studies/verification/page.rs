//! The page of results.
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::lines::{Lines, Row};
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

    /// Takes the text and the rows since the last call.
    pub(crate) fn take(&mut self) -> (String, Vec<Row>) {
        (std::mem::take(&mut self.body), self.lines.rows_since(&mut self.taken))
    }

    /// The lines so far.
    pub(crate) fn lines(&self) -> &Lines {
        &self.lines
    }

    /// Keeps other programs of the suite from writing the page until the file is dropped.
    fn lock(&self) -> std::fs::File {
        let folder = self.path.parent().unwrap_or(Path::new("."));
        crate::checked(std::fs::create_dir_all(folder));
        let page = std::fs::OpenOptions::new().append(true).create(true).open(&self.path);
        let page = crate::checked(page);
        crate::checked(page.lock());
        page
    }

    /// Writes the page with a section that was measured and those others of `names` that it has.
    pub(crate) fn update(&self, names: &[&str], section: &str, (body, new): (String, Vec<Row>)) {
        let _alone = self.lock();
        let old = std::fs::read_to_string(&self.path).unwrap_or_default();
        let table = old.lines().skip_while(|line| !line.starts_with("| ---")).skip(1).map_while(Row::read);
        let mut rows: Vec<Row> = table.filter(|row| self.lines.is_expected(row)).collect();
        let parts = old.split(REFERENCES).next().unwrap_or_default().split("<!-- section ").skip(1);
        let parts = parts.filter_map(|part| part.split_once(" -->\n"));
        let mut bodies: BTreeMap<&str, &str> = parts.map(|(name, body)| (name, body.trim_end())).collect();
        bodies.insert(section, body.trim_end());
        for row in new {
            match rows.iter().position(|old: &Row| old.is_of_same(&row)) {
                Some(place) => rows[place] = row,
                None => rows.push(row),
            }
        }
        rows.sort_by_key(Row::order);
        let mut text = format!(
            "# Verification\n\n\
             Written by `studies/verification/run --full`, which runs every case below anew; `--quick` runs the small ones, `--only NAME` one, whose section it replaces. References and tolerances \
             stand in [expected.toml](../studies/verification/expected.toml) and in [tables](../studies/verification/references/README.md) made by other codes.\n\n\
             {} of {} lines fail.\n\n\
             | problem | quantity | reference | ours | error | tolerance | |\n| --- | --- | --- | --- | --- | --- | --- |\n",
            rows.iter().filter(|row| row.fails()).count(),
            rows.len()
        );
        rows.iter().for_each(|row| text += &format!("{row}\n"));
        text += &self.lines.reasons(&rows);
        for (name, body) in names.iter().filter_map(|name| Some((name, bodies.get(*name)?))) {
            text += &format!("\n<!-- section {name} -->\n{body}\n");
        }
        text += &format!("{REFERENCES}{}", self.lines.sources(&rows));
        crate::checked(std::fs::write(&self.path, text));
    }
}

/// Between the sections and the sources.
const REFERENCES: &str = "\n## References\n\n";
