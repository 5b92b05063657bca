//! A file that is a part of a job.
use std::path::PathBuf;

/// A file that is a part of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Included {
    /// As messages name it.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}
