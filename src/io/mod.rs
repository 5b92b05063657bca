//! Files: HDF5 output of all ranks that ParaView opens and a run restarts from, tables and logs.
//!
//! | file or folder | content |
//! |---|---|
//! | [`hdf5_file`] | HDF5 files of all ranks; the only folder that calls the library |
//! | `whole_file.rs` | other files, written whole |
//! | [`snapshot`] | outputs and checkpoints |
//! | [`series`] | the index of the outputs of a run |
//! | [`log`] | history, telemetry, progress |
//! | [`particles`], [`raster`] | tables of particles and rasters |
//! | [`cause`] | reasons of the operating system for refusals |
pub mod cause;
pub mod hdf5_file;
pub mod log;
pub mod particles;
pub mod raster;
pub mod series;
pub mod snapshot;
pub mod whole_file;
