//! `include`: other files whose tables become part of a job.
//!
//! The texts of the job and of the files are divided at the headers of tables and joined anew: the text ahead
//! of the first header comes first; sections with the same header become one; all others follow, those of the
//! job first. So the result is a job file like any other, and each byte of it is mapped to its file. A key
//! that occurs twice is a fault, as in one file.
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::bytes::{self, MOST_BYTES};
use super::error::{Fault, Lines, Position, QUOTED};
use super::included::Included;
use super::source::{Node, Value};
use crate::text::excerpt;

/// The key of the job.
const KEY: &str = "include";
/// Most files that a job may include, with those that they include.
const MOST: usize = 64;

/// The text of a job with all that it includes.
#[derive(Debug)]
pub(in crate::job) struct Whole {
    /// The text with all files included.
    pub text: String,
    sources: Vec<Arc<Included>>,
    /// Where each piece begins in `text`, its source, and where it begins there.
    pieces: Vec<(usize, usize, usize)>,
}

/// Text between two headers, in pieces of sources.
struct Section {
    /// The header, without spaces; `None` if no other section can continue it.
    header: Option<String>,
    pieces: Vec<(usize, Range<usize>)>,
}

struct Reader {
    sources: Vec<Arc<Included>>,
    /// Files that are being read, outermost first, by their true names.
    open: Vec<PathBuf>,
    seen: Vec<PathBuf>,
    bytes: usize,
}

impl Whole {
    /// The text of the job at `path` with all that it includes; as it is where it includes nothing, or is no
    /// TOML.
    ///
    /// # Errors
    /// A file cannot be read or is no TOML, or files include each other.
    pub(in crate::job) fn of(text: &str, path: &Path) -> Result<Self, Vec<Fault>> {
        let alone = || Self { text: text.to_owned(), sources: Vec::new(), pieces: Vec::new() };
        let Ok(tree) = Node::parse(text) else { return Ok(alone()) };
        if names(&tree).is_none() {
            return Ok(alone());
        }
        let job = Arc::new(Included { path: path.to_path_buf(), text: text.to_owned() });
        let true_name = path.canonicalize().into_iter().collect::<Vec<_>>();
        let mut reader =
            Reader { sources: vec![job], open: true_name.clone(), seen: true_name, bytes: text.len() };
        let mut whole = Self { text: String::new(), sources: Vec::new(), pieces: Vec::new() };
        for section in reader.sections(0, &tree)? {
            for (source, range) in section.pieces {
                whole.append(&reader.sources[source].text[range.clone()], source, range.start);
            }
        }
        whole.sources = reader.sources;
        Ok(whole)
    }

    fn append(&mut self, piece: &str, source: usize, start: usize) {
        if !self.text.is_empty() && !self.text.ends_with('\n') {
            self.text.push('\n');
        }
        self.pieces.push((self.text.len(), source, start));
        self.text.push_str(piece);
    }

    /// Source of a byte of the whole, and its place there.
    fn origin(&self, byte: usize) -> (usize, usize) {
        let after = self.pieces.partition_point(|(at, ..)| *at <= byte);
        match after.checked_sub(1).map(|number| self.pieces[number]) {
            Some((at, source, start)) => (source, start + (byte - at)),
            None => (0, byte),
        }
    }

    /// Place of a byte of the whole in the job at `path`, with the text `lines`, or in the file that is
    /// included there.
    pub(in crate::job) fn position(&self, byte: usize, path: &Path, lines: &Lines<'_>) -> Position {
        let (file, (line, column)) = match self.origin(byte) {
            (0, byte) => (path, lines.position(byte)),
            (source, byte) => {
                let Included { path, text } = &*self.sources[source];
                (path.as_path(), Lines::of(text).position(byte))
            }
        };
        Position { file: file.into(), line, column }
    }

    /// A fault of the whole as one of the file in which it stands.
    pub(in crate::job) fn attribute(&self, fault: Fault) -> Fault {
        if fault.setting.is_some() || fault.included.is_some() || self.pieces.is_empty() {
            return fault;
        }
        let (source, start) = self.origin(fault.span.start);
        let end = start + fault.span.len();
        let included = (source > 0).then(|| self.sources[source].clone());
        let length = self.sources[source].text.len();
        Fault { included, span: start.min(length)..end.min(length), ..fault }
    }
}

/// The name of a file, and where it stands.
type Named = (String, Range<usize>);

/// Place of the key `include`, and the names, if it has the right form. Another form is a fault of the
/// schema.
fn names(tree: &Node) -> Option<(Range<usize>, Vec<Named>)> {
    let node = tree.get(KEY)?;
    let Value::Array(elements) = &node.value else { return None };
    let name = |element: &Node| match &element.value {
        Value::Text(name) => Some((name.clone(), element.span.clone())),
        _ => None,
    };
    let names: Option<Vec<_>> = elements.iter().map(name).collect();
    Some((node.key_span.start..node.span.end, names?))
}

impl Reader {
    /// The sections of a source and of all that it includes; the first one stands ahead of all headers.
    fn sections(&mut self, source: usize, tree: &Node) -> Result<Vec<Section>, Vec<Fault>> {
        let text = self.sources[source].text.clone();
        let from = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        let mut headers = Vec::new();
        headers_of(tree, &text, &mut headers);
        headers.sort_by_key(|header| header.start);
        headers.dedup();
        let mut sections = vec![Section { header: Some(String::new()), pieces: Vec::new() }];
        let names = names(tree);
        let end = headers.first().map_or(text.len(), |header| line_start(&text, header.start));
        let without = names.as_ref().map_or(end..end, |(key, _)| key.clone());
        sections[0].pieces =
            vec![(source, from..without.start.min(end)), (source, without.end.min(end)..end)];
        let mut arrays: Vec<String> = Vec::new();
        for (number, header) in headers.iter().enumerate() {
            let start = line_start(&text, header.start);
            let end = headers.get(number + 1).map_or(text.len(), |next| line_start(&text, next.start));
            let name: String = text[header.clone()].chars().filter(|c| !c.is_whitespace()).collect();
            let is_element = name.starts_with("[[");
            let name = name.trim_matches(['[', ']']).to_owned();
            let is_inside = arrays
                .iter()
                .any(|array| name.strip_prefix(&**array).is_some_and(|rest| rest.starts_with('.')));
            if is_element {
                arrays.push(name.clone());
            }
            let header = (!is_element && !is_inside).then_some(name);
            sections.push(Section { header, pieces: vec![(source, start..end)] });
        }
        for (number, (name, span)) in names.into_iter().flat_map(|(_, names)| names).enumerate() {
            let key = format!("{KEY}[{number}]");
            let inner = self.include(source, &name, &key, &span)?;
            self.join(&mut sections, inner);
        }
        Ok(sections)
    }

    /// Adds the sections of an included file; those with a header that is there already go on there, without
    /// it.
    fn join(&self, sections: &mut Vec<Section>, inner: Vec<Section>) {
        for section in inner {
            let known = section
                .header
                .as_ref()
                .and_then(|header| sections.iter().position(|other| other.header.as_ref() == Some(header)));
            let Some(known) = known else {
                sections.push(section);
                continue;
            };
            let is_root = section.header.as_deref() == Some("");
            for (number, (source, range)) in section.pieces.into_iter().enumerate() {
                let text = &self.sources[source].text;
                let line = if is_root || number > 0 {
                    0
                } else {
                    text[range.clone()].find('\n').map_or(range.len(), |at| at + 1)
                };
                sections[known].pieces.push((source, range.start + line..range.end));
            }
        }
    }

    /// Reads a file that a source includes.
    fn include(
        &mut self,
        source: usize,
        name: &str,
        key: &str,
        span: &Range<usize>,
    ) -> Result<Vec<Section>, Vec<Fault>> {
        let asking = self.sources[source].clone();
        let included = (source > 0).then(|| asking.clone());
        let refuse = |message: String| {
            let key = key.to_owned();
            vec![Fault {
                key,
                message,
                span: span.clone(),
                help: None,
                setting: None,
                included: included.clone(),
            }]
        };
        let shown = excerpt(name, QUOTED);
        let path = asking.path.parent().unwrap_or(Path::new("")).join(name);
        if path.exists() && !path.is_file() {
            return Err(refuse(format!(
                "found \"{shown}\", which is not a regular file; expected a TOML file"
            )));
        }
        let bytes = bytes::read(&path).map_err(|error| {
            refuse(format!("found \"{shown}\", which cannot be included: {error}; expected a TOML file, its name relative to that of this file"))
        })?;
        let true_name = path.canonicalize().unwrap_or_else(|_| path.clone());
        if self.open.contains(&true_name) {
            return Err(refuse(format!(
                "found \"{shown}\", which includes this file; expected files that do not include each other"
            )));
        }
        if self.seen.contains(&true_name) {
            return Err(refuse(format!(
                "found \"{shown}\" a second time; expected each file once, including nested includes"
            )));
        }
        self.bytes += bytes.len();
        if self.sources.len() > MOST || self.bytes as u64 > MOST_BYTES {
            let most = MOST_BYTES / 1_000_000;
            return Err(refuse(format!(
                "found too much; expected at most {MOST} files, with the job at most {most} MB"
            )));
        }
        let text = String::from_utf8(bytes)
            .map_err(|_| refuse(format!("found \"{shown}\", which is not UTF-8; expected text in UTF-8")))?;
        let file = Arc::new(Included { path, text });
        let tree = Node::parse(&file.text).map_err(|(span, message)| {
            let included = Some(file.clone());
            vec![Fault { key: String::new(), message, span, help: None, setting: None, included }]
        })?;
        self.sources.push(file);
        self.open.push(true_name.clone());
        self.seen.push(true_name);
        let sections = self.sections(self.sources.len() - 1, &tree)?;
        self.open.pop();
        Ok(sections)
    }
}

/// Places of the headers of all tables.
fn headers_of(node: &Node, text: &str, headers: &mut Vec<Range<usize>>) {
    match &node.value {
        Value::Table(entries) => {
            if text[node.span.start..].starts_with('[') && !node.span.is_empty() {
                headers.push(node.span.clone());
            }
            entries.iter().for_each(|(_, inner)| headers_of(inner, text, headers));
        }
        Value::Array(elements) => {
            let tables = elements.iter().filter(|element| matches!(element.value, Value::Table(_)));
            tables.for_each(|inner| headers_of(inner, text, headers));
        }
        _ => {}
    }
}

/// Start of the line of a byte.
fn line_start(text: &str, byte: usize) -> usize {
    text[..byte].rfind('\n').map_or(0, |at| at + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn whole(job: &str, files: &[(&str, &str)]) -> (tempfile::TempDir, Result<Whole, Vec<Fault>>) {
        let directory = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(directory.path().join(name), text).unwrap();
        }
        let path = directory.path().join("job.toml");
        std::fs::write(&path, job).unwrap();
        let whole = Whole::of(job, &path);
        (directory, whole)
    }

    #[test]
    fn tables_become_one_and_each_byte_knows_its_file() {
        let job = "version = 1\ninclude = [\"a.toml\",\n \"b.toml\"] # both\ntitle = \"t\"\n[output]\nevery = 1\n[[materials]]\nname = \"one\"\n";
        let a = "\u{feff}gravity = [0, -1]\n[[materials]]\nname = \"two\"\n[materials.hardening]\nk = [\n[1, 2]]\n[output] # more\npicture = false";
        let b = "[[materials]]\nname = \"three\"\n[materials.hardening]\nk = 3\n[domain]\nsize = [1, 1]\n";
        let (_directory, whole) = whole(job, &[("a.toml", a), ("b.toml", b)]);
        let whole = whole.unwrap();
        let expected: toml::Table = toml::from_str(
            "version = 1\ntitle = \"t\"\ngravity = [0, -1]\noutput = { every = 1, picture = false }\ndomain = { size = [1, 1] }\n\
             materials = [{ name = \"one\" }, { name = \"two\", hardening = { k = [[1, 2]] } }, { name = \"three\", hardening = { k = 3 } }]",
        )
        .unwrap();
        assert_eq!(toml::from_str::<toml::Table>(&whole.text).unwrap(), expected, "{}", whole.text);
        for (word, source, text) in
            [("title", 0, job), ("gravity", 1, a), ("picture", 1, a), ("\"three\"", 2, b)]
        {
            let (found, at) = whole.origin(whole.text.find(word).unwrap());
            assert_eq!((found, at), (source, text.find(word).unwrap()), "{word}");
        }
    }

    #[test]
    fn circles_and_what_cannot_be_read_are_refused() {
        let job = "include = [\"a.toml\"]\n";
        for (files, message) in [
            (vec![], "include[0]: found \"a.toml\", which cannot be included"),
            (vec![("a.toml", "x = 1\ninclude = [\"job.toml\"]")], "which includes this file"),
            (vec![("a.toml", "include = [\"a.toml\"]")], "which includes this file"),
            (vec![("a.toml", "include = [\"b.toml\", \"b.toml\"]"), ("b.toml", "")], "a second time"),
            (vec![("a.toml", "x = ")], ""),
        ] {
            let (_directory, whole) = whole(job, &files);
            let faults = whole.map(|whole| whole.text).unwrap_err();
            assert!(faults[0].to_string().contains(message), "{}", faults[0]);
            assert_eq!(faults[0].included.is_some(), !files.is_empty());
        }
        let (_directory, whole) = whole("include = 3\n", &[]);
        assert_eq!(whole.unwrap().text, "include = 3\n", "another form is a fault of the schema");
    }
}
