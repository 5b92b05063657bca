//! Scalars of a file.
use crate::kernel::Coordinates;

/// Counter among the scalars of files of axisymmetric jobs.
pub const AXISYMMETRIC: &str = "axisymmetric";

/// Scalars that are saved and come back bit by bit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scalars {
    /// Real numbers by name.
    pub reals: Vec<(String, f64)>,
    /// Counters by name.
    pub counts: Vec<(String, u64)>,
    /// Words of exact sums (see [`crate::exact_sum`]) by name.
    pub exact: Vec<(String, Vec<i64>)>,
}

impl Scalars {
    /// The real number of that name.
    pub fn real(&self, name: &str) -> Option<f64> {
        find(&self.reals, name).copied()
    }

    /// The counter of that name.
    pub fn count(&self, name: &str) -> Option<u64> {
        find(&self.counts, name).copied()
    }

    /// Coordinates of the domain.
    pub fn coordinates(&self) -> Coordinates {
        if self.count(AXISYMMETRIC).is_some() { Coordinates::Axisymmetric } else { Coordinates::Cartesian }
    }

    /// The words of the exact sum of that name.
    pub fn exact(&self, name: &str) -> Option<&[i64]> {
        find(&self.exact, name).map(Vec::as_slice)
    }
}

fn find<'a, T>(list: &'a [(String, T)], name: &str) -> Option<&'a T> {
    list.iter().find(|(n, _)| n == name).map(|(_, value)| value)
}
