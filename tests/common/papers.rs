//! Code that tests of papers share: their files, their fenced blocks, and a shell for the commands in them.
//!
//! An HTML comment before a block says what differs from its words: `<!-- test: needs: PROGRAMS -->` passes
//! over the block where one of them is missing, `<!-- test: quick: OLD => NEW; REASON -->` replaces words,
//! `<!-- test: skip: REASON -->` leaves it out.
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub(crate) fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files below a folder of the repository, without what is built or hidden; paths from the top, sorted.
pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(repository().join(&folder)).expect("a folder") {
            let name = entry.expect("an entry").file_name();
            let path = if folder == Path::new(".") { PathBuf::from(&name) } else { folder.join(&name) };
            let hidden = name.to_string_lossy().starts_with('.');
            match repository().join(&path).is_dir() {
                _ if hidden => {}
                true if ["target", "out", "node_modules", "__pycache__"]
                    .iter()
                    .any(|built| *built == name) => {}
                true => folders.push(path),
                false => found.push(path),
            }
        }
    }
    found.sort();
    found
}

pub(crate) fn text(path: &Path) -> String {
    std::fs::read_to_string(repository().join(path)).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A fenced block.
#[derive(Debug)]
pub(crate) struct Block {
    /// Line of the paper at which it begins, from 1.
    pub(crate) line: usize,
    pub(crate) language: String,
    /// The last line before it that is neither empty nor a comment.
    pub(crate) before: String,
    /// Text of the comment before it, after `test:`.
    pub(crate) note: Option<String>,
    pub(crate) text: String,
}

pub(crate) fn blocks(paper: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let (mut note, mut before, mut open): (Option<String>, String, Option<Block>) =
        (None, String::new(), None);
    for (i, line) in paper.lines().enumerate() {
        match (&mut open, line.trim_start().strip_prefix("```")) {
            (Some(_), Some(_)) => found.extend(open.take()),
            (Some(block), None) => {
                block.text.push_str(line);
                block.text.push('\n');
            }
            (None, Some(language)) => {
                let (language, note) = (language.trim().to_owned(), note.take());
                let before = std::mem::take(&mut before);
                open = Some(Block { line: i + 1, language, before, note, text: String::new() });
            }
            (None, None) => {
                let inner = line.trim().strip_prefix("<!-- test:").and_then(|rest| rest.strip_suffix("-->"));
                note = inner.map(|inner| inner.trim().to_owned());
                if note.is_none() && !line.trim().is_empty() {
                    line.trim().clone_into(&mut before);
                }
            }
        }
    }
    assert!(open.is_none(), "a block without an end");
    found
}

/// Whether there is a program of this name.
pub(crate) fn is_installed(program: &str) -> bool {
    let found = Command::new("sh").args(["-c", "command -v \"$0\" >/dev/null", program]).status();
    found.is_ok_and(|status| status.success())
}

/// The commands of a block as they run here; none if it is passed over.
pub(crate) fn commands(paper: &Path, block: &Block) -> Option<String> {
    let place = format!("{}:{}", paper.display(), block.line);
    let note = block.note.as_deref().unwrap_or_default();
    if let Some(reason) = note.strip_prefix("skip:") {
        assert!(reason.trim().len() > 10, "{place}: a reason is missing");
        println!("{place}: not run: {}", reason.trim());
        return None;
    }
    if let Some(programs) = note.strip_prefix("needs:") {
        if let Some(missing) = programs.split_whitespace().find(|program| !is_installed(program)) {
            println!("{place}: passed over: there is no {missing}");
            return None;
        }
    } else if let Some(quick) = note.strip_prefix("quick:") {
        let (words, reason) = quick.split_once(';').unwrap_or_else(|| panic!("{place}: a reason is missing"));
        let (old, new) = words.split_once("=>").unwrap_or_else(|| panic!("{place}: OLD => NEW"));
        assert!(block.text.contains(old.trim()), "{place}: {old} is not there");
        println!("{place}: {} instead of {}: {}", new.trim(), old.trim(), reason.trim());
        return Some(block.text.replace(old.trim(), new.trim()));
    } else {
        assert!(note.is_empty(), "{place}: unknown note {note:?}");
    }
    Some(block.text.clone())
}

/// Runs commands in a directory, until one fails. `environment` are commands before them, `programs` a
/// directory in front of the PATH.
pub(crate) fn bash(directory: &Path, programs: &Path, environment: &str, commands: &str) -> Output {
    let script = format!("{environment}\ntrap 'echo \"failed: $BASH_COMMAND\" >&2' ERR\n{commands}");
    let path = std::env::var("PATH").unwrap_or_default();
    Command::new("bash")
        .args(["-euo", "pipefail", "-c", &script])
        .current_dir(directory)
        .env("PATH", format!("{}:{path}", programs.display()))
        .env("MPIEXEC_TIMEOUT", "600")
        .env("RAYON_NUM_THREADS", "1")
        .output()
        .expect("bash starts")
}
