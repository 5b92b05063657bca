//! Results that a run leaves when it ends.
//!
//! | file | content |
//! |---|---|
//! | [`report`] | `JOB.report.json`: the results of a finished run |
//! | [`ending`] | `JOB.ended.json`: why a run ended early, and what to do |
//! | [`collapse`] | evaluation of a column of sand |
//! | [`safety`] | the factor of safety |
pub mod collapse;
pub mod ending;
pub mod report;
pub mod safety;
