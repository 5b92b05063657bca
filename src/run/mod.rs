//! A whole run.
pub mod history;
pub mod report;
pub mod stop;
