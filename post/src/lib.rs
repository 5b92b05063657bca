//! Post-processing of the results of agimp: pictures, movies, charts, files for other programs, pages for a
//! browser.
//!
//! Reads files, and of a run that ends its last state. The solver knows nothing of it, so a change here
//! compiles none of the kernels.
//!
//! | file or folder | content |
//! |---|---|
//! | [`picture`], [`movie`], [`chart`] | pictures of particles and plots of numbers |
//! | [`frame`] | particles and leaves of an output, for viewers and exports |
//! | [`revolve`] | bodies of revolution in space |
//! | [`export`] | outputs for other programs |
//! | [`view`], [`report`] | pages for a browser: outputs; a run |
pub mod chart;
pub mod export;
pub mod frame;
pub mod movie;
pub mod picture;
pub mod report;
pub mod revolve;
pub mod view;
