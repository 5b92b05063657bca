//! The numbered output files of a run, their series, and its checkpoints.

use std::path::{Path, PathBuf};

use partition::comm::Comm;

use super::directory::{
    checkpoint_path, output_path, remove_old_checkpoints, series_path, tree_path, tree_series_path,
};
use super::intact::commit::Unnamed;
use super::{Options, View, start_write, write, write_tree};
use crate::io::hdf5_file::FileError;
use crate::io::series::Series;

/// Writes the outputs of one run. The same calls on all ranks.
#[derive(Debug)]
pub struct Outputs {
    directory: PathBuf,
    name: String,
    options: Options,
    next: u64,
    particles: Series,
    tree: Series,
    pending: Option<Pending>,
}

/// A checkpoint on its way to disk.
#[derive(Debug)]
struct Pending {
    file: Unnamed,
    job_digest: u64,
    step: u64,
    keep: usize,
}

impl Outputs {
    /// Collective. Creates the directory and starts at output 0.
    pub fn create(comm: &Comm, directory: &Path, name: &str, options: Options) -> Result<Self, FileError> {
        Self::start(comm, directory, name, options, None)
    }

    /// Collective. Goes on with output `next` after a restart from `time`; entries of the series after that
    /// time are dropped with the next output.
    pub fn resume(
        comm: &Comm,
        directory: &Path,
        name: &str,
        options: Options,
        next: u64,
        time: f64,
    ) -> Result<Self, FileError> {
        Self::start(comm, directory, name, options, Some((next, time)))
    }

    fn start(
        comm: &Comm,
        directory: &Path,
        name: &str,
        options: Options,
        from: Option<(u64, f64)>,
    ) -> Result<Self, FileError> {
        let made = if comm.rank() == 0 { std::fs::create_dir_all(directory) } else { Ok(()) };
        comm.agree(made.map_err(|source| FileError::System {
            path: directory.into(),
            action: "create the directory",
            source,
        }))?;
        let series = |path: PathBuf| match from {
            Some((_, time)) if comm.rank() == 0 => {
                Series::resume(&path, Series::listed(&path).unwrap_or_default(), time)
            }
            _ => Series::new(&path),
        };
        let (particles, tree) =
            (series(series_path(directory, name)), series(tree_series_path(directory, name)));
        let (directory, name) = (directory.into(), name.into());
        Ok(Self {
            directory,
            name,
            options,
            next: from.map_or(0, |(next, _)| next),
            particles,
            tree,
            pending: None,
        })
    }

    /// Index of the particle files, for ParaView.
    pub fn series(&self) -> &Path {
        self.particles.path()
    }

    /// Not collective. The last output in the index; known on rank 0.
    pub fn last(&self) -> Option<PathBuf> {
        Some(self.directory.join(&self.particles.entries().last()?.name))
    }

    /// Number of the next output.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// Collective. Writes the next output: particles, tree and series. Returns the path of the particles.
    pub fn write<const D: usize>(&mut self, comm: &Comm, view: &View<D>) -> Result<PathBuf, FileError> {
        let paths = [
            output_path(&self.directory, &self.name, self.next),
            tree_path(&self.directory, &self.name, self.next),
        ];
        write(comm, &paths[0], view, &self.options)?;
        write_tree(comm, &paths[1], view)?;
        let mut listed = Ok(());
        if comm.rank() == 0 {
            for (series, path) in [&mut self.particles, &mut self.tree].into_iter().zip(&paths) {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                listed = listed.and_then(|()| series.push(&name, view.time));
            }
        }
        comm.agree(listed)?;
        self.next += 1;
        let [particles, _] = paths;
        Ok(particles)
    }

    /// The next output takes the number, and so the place, of the last one.
    pub fn give_back_number(&mut self) {
        self.next = self.next.saturating_sub(1);
    }

    /// Collective. Writes a checkpoint and removes older ones but for the last `keep` (at least one,
    /// with this), as well as those of later steps: they are of an earlier run. Those of other jobs stay.
    /// Returns the path that it will have when it is on disk: see [`Outputs::settle`].
    pub fn checkpoint<const D: usize>(
        &mut self,
        comm: &Comm,
        view: &View<D>,
        keep: usize,
    ) -> Result<PathBuf, FileError> {
        self.settle(comm)?;
        let path = checkpoint_path(&self.directory, &self.name, view.step);
        // Velocity and level suffice for viewers; the state has the rest.
        let options = Options {
            fields: vec![super::PointField::Velocity, super::PointField::LeafLevel],
            single: true,
            restart: true,
        };
        let file = start_write(comm, &path, view, &options)?;
        self.pending = Some(Pending { file, job_digest: view.job_digest, step: view.step, keep });
        Ok(path)
    }

    /// Collective. Waits until the last checkpoint is on disk, and gives it its name.
    pub fn settle(&mut self, comm: &Comm) -> Result<(), FileError> {
        let Some(Pending { file, job_digest, step, keep }) = self.pending.take() else { return Ok(()) };
        file.finish(comm)?;
        let removed = match comm.rank() {
            0 => remove_old_checkpoints(&self.directory, &self.name, job_digest, step, keep.max(1)),
            _ => Ok(()),
        };
        comm.agree(removed)?;
        Ok(())
    }

    /// Whether a checkpoint is on its way to disk.
    pub fn is_pending(&self) -> bool {
        self.pending.is_some()
    }

    /// Collective. Whether no rank would have to wait in [`Outputs::settle`].
    pub fn is_on_disk(&self, comm: &Comm) -> bool {
        let mut ready = [u64::from(self.pending.as_ref().is_none_or(|pending| pending.file.is_on_disk()))];
        comm.min_u64(&mut ready);
        ready[0] == 1
    }
}
