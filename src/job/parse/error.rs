//! What can be wrong with a job file, and where.
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;

/// One fault of a job file: where it is, what was found and what would be right.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key}{}{message}", if key.is_empty() { "" } else { ": " })]
pub struct Fault {
    /// Path of the key, such as `bodies[0].shape.radius`; empty for faults of the whole file.
    pub key: String,
    /// What was found and what would be right.
    pub message: String,
    /// Bytes of the file's text that the fault is about.
    pub span: Range<usize>,
    /// More that may help, such as the meaning of the key.
    pub help: Option<String>,
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
    /// Files of the run could not be named after the job.
    #[error("{}: the name of the file is not UTF-8; expected one that is, since results take it over", path.display())]
    Name {
        /// The file.
        path: PathBuf,
    },
    /// The content is not a valid job.
    #[error(transparent)]
    Invalid(#[from] FaultList),
}

/// All faults found in one job file, in the order of the file; at least one.
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
    /// Line and column, both from 1, of a byte position; columns count characters.
    pub fn position(&self, byte: usize) -> (usize, usize) {
        position(&self.text, byte)
    }

    /// `file:line:column: key: message` of one fault.
    pub fn headline(&self, fault: &Fault) -> String {
        let (line, column) = self.position(fault.span.start);
        format!("{}:{line}:{column}: {fault}", self.path.display())
    }
}

impl fmt::Display for FaultList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, fault) in self.faults.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            f.write_str(&self.headline(fault))?;
        }
        Ok(())
    }
}

/// Line and column, both from 1, of a byte position; columns count characters.
pub(in crate::job) fn position(text: &str, byte: usize) -> (usize, usize) {
    // A place inside a character belongs to its start; one behind the end, to the end.
    let before = &text[..text.floor_char_boundary(byte)];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// The known word nearest to `word`, if it is near enough to be meant.
pub(in crate::job) fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|candidate| (strsim::damerau_levenshtein(word, candidate), candidate))
        .min_by_key(|&(distance, _)| distance)
        // A third of the letters may differ; shorter words than three letters have to be right.
        .filter(|&(distance, candidate)| distance <= word.len().max(candidate.len()).div_ceil(3))
        .map(|(_, candidate)| candidate)
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
    }

    #[test]
    fn nearest_word_is_near() {
        let known = ["density", "name", "young"];
        assert_eq!(nearest("denisty", known), Some("density"));
        assert_eq!(nearest("Young", known), Some("young"));
        assert_eq!(nearest("wobble", known), None);
    }
}
