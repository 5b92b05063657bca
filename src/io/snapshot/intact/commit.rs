//! From a written file to one that is on disk under its own name.
//!
//! A file grows under a temporary name. It gets its own only when the data of every rank are on disk, so that
//! a file with its own name is whole. The disk may take many times as long as passing the bytes to the
//! operating system; this wait can go on in the background.
use std::fs::File;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use partition::comm::Comm;

use crate::io::hdf5_file::{FileError, Writer};

/// A file that is written but has no name of its own yet.
#[derive(Debug)]
pub struct Unnamed {
    part: PathBuf,
    path: PathBuf,
    /// This rank's wait for the disk.
    on_disk: JoinHandle<std::io::Result<()>>,
}

impl Unnamed {
    /// Collective. Lets `fill` write a new file, and starts to flush it to disk. After an error the temporary
    /// file is removed.
    pub fn write(
        comm: &Comm,
        path: &Path,
        fill: impl FnOnce(&Writer) -> Result<(), FileError>,
    ) -> Result<Self, FileError> {
        let part = path.with_added_extension("part");
        let written = Writer::create(comm, &part).and_then(|file| match fill(&file) {
            Ok(()) => file.close(),
            Err(error) => {
                file.abandon();
                Err(error)
            }
        });
        match written {
            Ok(rows) => {
                let on_disk = std::thread::spawn(move || rows.sync_all());
                Ok(Self { part, path: path.into(), on_disk })
            }
            Err(error) => {
                remove(comm, &part);
                Err(error)
            }
        }
    }

    /// Not collective. Whether [`Unnamed::finish`] would not have to wait for this rank.
    pub fn is_on_disk(&self) -> bool {
        self.on_disk.is_finished()
    }

    /// The name that the file will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Collective. Waits until the file is on disk and gives it its name.
    pub fn finish(self, comm: &Comm) -> Result<(), FileError> {
        let Self { part, path, on_disk } = self;
        let failed = |source| FileError::System { path: path.clone(), action: "finish", source };
        let synced = on_disk.join().unwrap_or_else(|_| Err(std::io::Error::other("the writer failed")));
        let named = comm.agree(synced.map_err(failed)).and_then(|()| {
            comm.agree(if comm.rank() == 0 { rename(&part, &path) } else { Ok(()) }.map_err(failed))
        });
        if named.is_err() {
            remove(comm, &part);
        }
        Ok(named?)
    }
}

/// Not collective. Removes an unfinished file; it may not even exist, and the error that matters is the one
/// before.
fn remove(comm: &Comm, part: &Path) {
    if comm.rank() == 0 {
        let _ = std::fs::remove_file(part);
    }
}

fn rename(part: &Path, path: &Path) -> std::io::Result<()> {
    std::fs::rename(part, path)?;
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    File::open(directory)?.sync_all()
}
