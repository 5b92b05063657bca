//! Results that a run leaves when it ends.
//!
//! | file | content |
//! |---|---|
//! | [`report`] | `JOB.report.json`: the results of a finished run |
//! | [`ending`] | `JOB.ended.json`: why a run ended early, and what to do |
//! | [`safety`] | the factor of safety |
pub mod ending;
pub mod report;
pub mod safety;
