//! Names of a job in warnings.

/// Longest name that is quoted, in characters.
pub(super) const NAME: usize = 60;
