//! Coordinates of the domain among the scalars of a file.
use crate::kernel::Coordinates;
use crate::saved::Scalars;

/// Counter among the scalars of files of axisymmetric jobs.
pub const AXISYMMETRIC: &str = "axisymmetric";

impl Scalars {
    /// Coordinates of the domain.
    pub fn coordinates(&self) -> Coordinates {
        if self.count(AXISYMMETRIC).is_some() { Coordinates::Axisymmetric } else { Coordinates::Cartesian }
    }
}
