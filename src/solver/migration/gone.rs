//! Particles that have left the domain.

/// A particle that is no longer in the domain.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct Gone {
    /// Its mass, kg.
    pub mass: f64,
    /// Its place, m from the lower corner of the domain; z is 0 in plane strain.
    pub place: [f64; 3],
    /// The face that it is farthest beyond: axis and side; `None` of one in the domain.
    pub face: Option<(usize, usize)>,
}
