//! Output of a running job: text files that grow line by line, and the terminal.
//!
//! | file | content |
//! |---|---|
//! | `lines.rs` | files of lines, mended after a crash |
//! | [`history`] | tables over time |
//! | [`telemetry`] | time, sizes and traffic of steps, one JSON object per line |
//! | [`progress`] | the live lines of the terminal, warnings |
pub mod history;
mod lines;
pub mod progress;
pub mod telemetry;
