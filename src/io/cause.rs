//! Reasons for which the system refuses a file, in words that say what to do.
use std::io::Error;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The reason of an error on a path. Checks the file system where the error alone does not say enough.
pub fn explain(path: &Path, error: &Error) -> String {
    let Some(code) = error.raw_os_error() else { return error.to_string() };
    let words = match code {
        libc::ENOSPC if no_inodes_left(path) => "no inodes left on the file system: it holds too many files",
        libc::ENOSPC => "no space left on device",
        libc::EDQUOT => "disk quota exceeded",
        libc::EFBIG => "the file grows beyond the limit of this process (`ulimit -f`) or of the file system",
        libc::EROFS => "the file system is read-only",
        libc::EACCES | libc::EPERM => return permission(path, error),
        libc::EISDIR => "a directory of that name exists",
        libc::ENOTDIR => "a file has the name of the directory",
        libc::ELOOP => "a symbolic link of that name exists; agimp does not write results through links",
        libc::ENOENT if !parent(path).is_dir() => "No such file or directory: the directory does not exist",
        _ => return error.to_string(),
    };
    format!("{words} (os error {code})")
}

/// From now on a write beyond the limit of this process for files (`ulimit -f`) is an error, and does not end
/// the process silently.
pub fn tell_size_limits() -> std::io::Result<()> {
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::new(AtomicBool::new(false))).map(drop)
}

fn parent(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn permission(path: &Path, error: &Error) -> String {
    match path.symlink_metadata() {
        Ok(data) if data.is_dir() => format!("{error}; a directory of that name exists"),
        Ok(_) => error.to_string(),
        Err(_) => format!("{error}; the user has no permission to write to the directory"),
    }
}

/// Whether the file system of a path that need not exist has no room for another file.
fn no_inodes_left(path: &Path) -> bool {
    let counted = rustix::fs::statvfs(path).or_else(|_| rustix::fs::statvfs(parent(path)));
    // Some file systems do not count them and say 0 of 0.
    counted.is_ok_and(|counted| counted.f_files > 0 && counted.f_favail == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_are_told_in_words() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a");
        let words = |code| explain(&path, &Error::from_raw_os_error(code));
        assert_eq!(words(libc::ENOSPC), "no space left on device (os error 28)");
        assert!(words(libc::EFBIG).contains("ulimit -f"));
        assert!(words(libc::EROFS).contains("read-only"));
        assert!(words(libc::EIO).contains("os error 5"));
        let nowhere = explain(&path.join("b"), &Error::from_raw_os_error(libc::ENOENT));
        assert!(nowhere.contains("the directory does not exist"), "{nowhere}");
    }

    #[test]
    fn a_directory_in_the_way_is_named() {
        let directory = tempfile::tempdir().unwrap();
        let error = std::fs::File::create(directory.path()).unwrap_err();
        assert!(explain(directory.path(), &error).contains("a directory of that name exists"));
    }
}
