//! Files: HDF5 output of all ranks that ParaView opens and a run restarts from, tables, logs, charts and
//! pictures.
//!
//! | file or folder | content |
//! |---|---|
//! | [`hdf5_file`] | HDF5 files of all ranks; the only folder that calls the library |
//! | `whole_file.rs` | other files, written whole |
//! | [`snapshot`] | outputs and checkpoints |
//! | [`series`] | the index of the outputs of a run |
//! | [`frame`] | particles and leaves of an output, for viewers and exports |
//! | [`picture`], [`movie`], `chart.rs` | pictures of particles and plots of numbers |
//! | [`revolve`] | bodies of revolution in space |
//! | [`export`] | outputs for other programs |
//! | [`log`] | history, telemetry, progress |
//! | [`particles`], [`raster`] | tables of particles and rasters |
//! | [`cause`] | reasons of the operating system for refusals |
pub mod cause;
pub(crate) mod chart;
pub mod export;
pub mod frame;
pub mod hdf5_file;
pub mod log;
pub mod movie;
pub mod particles;
pub mod picture;
pub mod raster;
pub mod revolve;
pub mod series;
pub mod snapshot;
pub(crate) mod whole_file;
