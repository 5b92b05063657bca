//! A parameter outside its range.

/// A parameter outside the range that its model needs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} = {value} is out of range: it must be {range}")]
pub struct OutOfRange {
    /// Name of the parameter in a job file; inside a table, with the table's name and a dot before it.
    pub key: String,
    /// Its value.
    pub value: f64,
    /// The range in words.
    pub range: String,
}
