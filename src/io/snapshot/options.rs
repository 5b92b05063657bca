//! Optional contents of a file.
use super::content::fields::PointField;

/// Optional contents of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Fields of the particles for ParaView.
    pub fields: Vec<PointField>,
    /// Those fields in single precision, but for those that the restart state holds already: that never is.
    pub single: bool,
    /// Also write all that a restart needs.
    pub restart: bool,
}
