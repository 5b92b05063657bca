//! Files: HDF5 output of all ranks that ParaView opens and a run restarts from, scalar histories,
//! telemetry, progress, charts and pictures.
pub mod cause;
pub(crate) mod chart;
pub mod export;
pub mod frame;
pub mod hdf5_file;
pub mod history;
pub(crate) mod lines;
pub mod movie;
pub mod particles;
pub mod picture;
pub mod progress;
pub mod raster;
pub mod series;
pub mod snapshot;
pub mod telemetry;
