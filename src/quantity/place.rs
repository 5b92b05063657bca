//! Places at which quantities are taken.

/// A place of material, m, in the coordinates of the job; z is 0 in plane strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The present place.
    pub now: [f64; 3],
    /// The place in the undeformed body: `now` less the displacement.
    pub undeformed: [f64; 3],
}

impl From<[f64; 3]> for Place {
    /// A place of material that has not moved, or of none.
    fn from(now: [f64; 3]) -> Self {
        Self { now, undeformed: now }
    }
}

/// A point x (m from the lower corner of the domain, which lies at `origin`) in the coordinates of the job,
/// the argument of quantities; z is 0 in plane strain.
pub fn in_job<const D: usize>(origin: &[f64; D], x: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|a| if a < D { origin[a] + x[a] } else { 0.0 })
}
