//! Text files that grow by a line at a time and are mended after a crash.
//!
//! A machine that loses power may leave a file without its last lines, with half a line, with zero bytes in
//! the place of lines, or empty. Whole lines are kept.
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Seek, SeekFrom, Write};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use crate::io::hdf5_file::FileError;
use crate::io::whole_file::{create_new, system};

/// Fate of a line in the file of a run that continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It stays.
    Keep,
    /// It goes: it is damaged.
    Drop,
    /// It goes, and so does all behind it.
    Stop,
}

/// A file of lines, open for more of them.
#[derive(Debug)]
pub(super) struct Lines {
    file: File,
    path: PathBuf,
}

impl Lines {
    /// Not collective. Starts a new file in the place of an old one.
    pub(super) fn create(path: &Path) -> Result<Self, FileError> {
        let file = create_new(path).map_err(|source| system(path, "create", source))?;
        Ok(Self { file, path: path.into() })
    }

    /// Not collective. Opens a file to continue. `judge` gets its whole lines, without the newline, from the
    /// first on; a last one without a newline is removed.
    pub(super) fn resume(path: &Path, mut judge: impl FnMut(&[u8]) -> Verdict) -> Result<Self, FileError> {
        let failed = |source| system(path, "resume", source);
        let mut options = OpenOptions::new();
        let mut file =
            options.read(true).write(true).custom_flags(libc::O_NOFOLLOW).open(path).map_err(failed)?;
        if !file.metadata().map_err(failed)?.is_file() {
            let reason = "not a regular file; move it".into();
            return Err(FileError::Refused { path: path.into(), reason });
        }
        let mut reader = BufReader::new(&file);
        // Bytes up to the first damage, and the whole lines behind it.
        let (mut kept, mut behind, mut damaged) = (0, Vec::new(), false);
        let mut line = Vec::new();
        loop {
            line.clear();
            let bytes = reader.read_until(b'\n', &mut line).map_err(failed)?;
            let Some(text) = line.strip_suffix(b"\n") else { break };
            match judge(text) {
                Verdict::Keep if damaged => behind.extend_from_slice(&line),
                Verdict::Keep => kept += bytes as u64,
                Verdict::Drop => damaged = true,
                Verdict::Stop => break,
            }
        }
        file.set_len(kept).map_err(failed)?;
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        file.write_all(&behind).map_err(failed)?;
        Ok(Self { file, path: path.into() })
    }

    /// Name of the file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Not collective. Appends a line, which ends in a newline, and passes it to the operating system.
    pub(super) fn append(&mut self, line: &str) -> Result<(), FileError> {
        self.file.write_all(line.as_bytes()).map_err(|source| system(&self.path, "write", source))
    }

    /// Not collective. Waits until all lines are on disk.
    pub(super) fn sync(&self) -> Result<(), FileError> {
        self.file.sync_data().map_err(|source| system(&self.path, "bring to disk", source))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge(line: &[u8]) -> Verdict {
        match line {
            b"end" => Verdict::Stop,
            b"bad" => Verdict::Drop,
            _ => Verdict::Keep,
        }
    }

    #[test]
    fn whole_lines_stay() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("lines");
        for (before, after) in [
            ("", ""),
            ("a\nb\n", "a\nb\n"),
            ("a\nb\nto", "a\nb\n"),
            ("a\nbad\nb\nbad\nc\nend\nd\n", "a\nb\nc\n"),
            ("bad\na\nto", "a\n"),
            ("torn", ""),
        ] {
            std::fs::write(&path, before).unwrap();
            Lines::resume(&path, judge).unwrap().append("new\n").unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), format!("{after}new\n"), "{before:?}");
        }
    }

    #[test]
    fn links_are_not_followed() {
        let dir = tempfile::tempdir().unwrap();
        let (target, link) = (dir.path().join("target"), dir.path().join("link"));
        std::fs::write(&target, "of somebody else\n").unwrap();
        std::os::unix::fs::symlink(&target, &link).unwrap();
        assert!(Lines::resume(&link, judge).is_err());
        Lines::create(&link).unwrap().append("ours\n").unwrap();
        assert_eq!(std::fs::read_to_string(&target).unwrap(), "of somebody else\n");
        assert_eq!(std::fs::read_to_string(&link).unwrap(), "ours\n");
    }
}
