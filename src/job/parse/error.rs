//! Faults in a job file, and their places.
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::included::Included;
use crate::text::{excerpt, printable};

/// A place in a file of a job, as messages name it: `FILE:LINE:COLUMN`, both from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Position {
    /// The file.
    pub file: PathBuf,
    /// Line.
    pub line: usize,
    /// Column, in characters.
    pub column: usize,
}

impl fmt::Display for Position {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file.display(), self.line, self.column)
    }
}

/// One fault of a job file: where it is, what was found and what would be right.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}{}{message}", if key.is_empty() { "" } else { ": " })]
pub struct Fault {
    /// Path of the key, such as `bodies[0].shape.radius`; empty for faults of the whole file.
    pub key: String,
    /// Found and expected value, in words.
    pub message: String,
    /// Bytes of the file's text that the fault is about.
    pub span: Range<usize>,
    /// More that may help, such as the meaning of the key.
    pub help: Option<String>,
    /// The setting that the fault is about, as typed, such as `--end 0`; `None` if the file is at fault.
    pub setting: Option<String>,
    /// The file in which it stands, if that is one that the job includes.
    pub included: Option<Arc<Included>>,
}

/// A job cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// The file itself cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is too long to be a job.
    #[error("{}:1:1: found more than {most} MB; expected a job file of at most {most} MB", path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
        /// Most that is read, MB.
        most: u64,
    },
    /// Files of the run could not be named after the job.
    #[error("{}: found a file name that is not UTF-8; expected UTF-8, because results use the name", path.display())]
    Name {
        /// The file.
        path: PathBuf,
    },
    /// The content is not a valid job.
    #[error(transparent)]
    Invalid(#[from] FaultList),
}

/// Faults of a file that are shown; the rest are counted.
const SHOWN: usize = 20;
/// Faults after which the search for more ends.
pub(in crate::job) const MOST: usize = 1000;
/// Longest message, in characters. Quotations from the file are shorter; only lists of possible values come
/// near.
const LONGEST: usize = 500;
/// Longest key of a message, in characters.
const LONGEST_KEY: usize = 100;
/// Names of the file that a message lists as possible.
const NAMES: usize = 12;
/// Longest text of the file that a message quotes, in characters.
pub(in crate::job) const QUOTED: usize = 60;

/// The faults found in one job file, in the order of the file; at least one, and not many more than a
/// thousand.
#[derive(Clone, Debug, thiserror::Error)]
pub struct FaultList {
    /// Name of the file as given.
    pub path: PathBuf,
    /// Text of the file.
    pub text: String,
    /// Faults.
    pub faults: Vec<Fault>,
}

impl FaultList {
    /// Name and text of the file in which a fault stands.
    pub fn source<'a>(&'a self, fault: &'a Fault) -> (&'a Path, &'a str) {
        match &fault.included {
            Some(file) => (&file.path, &file.text),
            None => (&self.path, &self.text),
        }
    }

    /// Line and column, both from 1, of a fault in its file; columns count characters.
    pub fn position(&self, fault: &Fault) -> (usize, usize) {
        position(self.source(fault).1, fault.span.start)
    }

    /// `file:line:column: key: message` of one fault, or with the setting in the place of the file's; without
    /// characters that control a terminal.
    pub fn headline(&self, fault: &Fault) -> String {
        let path = match &fault.setting {
            Some(typed) => excerpt(typed, LONGEST_KEY).into_owned(),
            None => {
                let (line, column) = self.position(fault);
                format!("{}:{line}:{column}", printable(&self.source(fault).0.display().to_string()))
            }
        };
        let key = excerpt(&fault.key, LONGEST_KEY);
        let separator = if key.is_empty() { "" } else { ": " };
        let message = excerpt(&fault.message, LONGEST);
        format!("{path}: {key}{separator}{message}")
    }

    /// The faults to show: the first ones of the file.
    pub fn shown(&self) -> &[Fault] {
        &self.faults[..self.faults.len().min(SHOWN)]
    }

    /// How many there are, if that is worth a line: `3 faults in job.toml`.
    pub fn summary(&self) -> Option<String> {
        let (count, path) = (self.faults.len(), self.path.display().to_string());
        let path = printable(&path);
        match count {
            0 | 1 => None,
            _ if count > MOST => Some(format!("the first {SHOWN} of more than {MOST} faults in {path}")),
            _ if count > SHOWN => Some(format!("the first {SHOWN} of {count} faults in {path}")),
            _ => Some(format!("{count} faults in {path}")),
        }
    }
}

impl fmt::Display for FaultList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, fault) in self.shown().iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            f.write_str(&self.headline(fault))?;
        }
        match self.summary() {
            Some(summary) if self.faults.len() > SHOWN => write!(f, "\n{summary}"),
            _ => Ok(()),
        }
    }
}

/// Lines and columns in the text of a file, for many queries.
pub(in crate::job) struct Lines<'t> {
    /// The text as the user has written it.
    text: &'t str,
    /// First byte of each line.
    starts: Vec<usize>,
}

impl<'t> Lines<'t> {
    pub(in crate::job) fn of(text: &'t str) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at + 1);
        Self { text, starts: std::iter::once(0).chain(breaks).collect() }
    }

    /// Line and column, both from 1, of a byte position; columns count characters.
    pub(in crate::job) fn position(&self, byte: usize) -> (usize, usize) {
        let byte = self.text.floor_char_boundary(byte);
        let line = self.starts.partition_point(|start| *start <= byte);
        (line, self.text[self.starts[line - 1]..byte].chars().count() + 1)
    }
}

/// Line and column, both from 1, of a byte position; columns count characters.
fn position(text: &str, byte: usize) -> (usize, usize) {
    // A place inside a character belongs to its start; one behind the end, to the end.
    let before = &text[..text.floor_char_boundary(byte)];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// [`alternatives`] of names that stand in the file: the first ones of many, each cut to a readable length.
pub(in crate::job) fn names<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let mut names = names.into_iter();
    let first: Vec<_> = names.by_ref().take(NAMES).map(|name| excerpt(name, QUOTED)).collect();
    let first = first.iter().map(AsRef::as_ref);
    match names.count() {
        0 => alternatives(first),
        more => format!(
            "{} or one of {more} more",
            first.map(|name: &str| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
        ),
    }
}

/// `"a", "b" or "c"`.
pub(in crate::job) fn alternatives<'a>(words: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = words.into_iter().map(|word| format!("\"{word}\"")).collect();
    match quoted.split_last() {
        None => "nothing".into(),
        Some((only, [])) => only.clone(),
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters() {
        assert_eq!(position("a = 1\nµ = \"é\" # x", 16), (2, 9));
        assert_eq!(position("", 5), (1, 1));
        let text = "a = 1\nµ = \"é\" # x\n\n";
        for byte in 0..=text.len() + 1 {
            assert_eq!(Lines::of(text).position(byte), position(text, byte));
        }
    }
}
