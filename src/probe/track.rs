//! Tracks: particles that the history follows.
use super::Measured;

/// A particle to follow: at the start the one nearest to a point.
#[derive(Clone, Debug)]
pub struct Track<const D: usize> {
    /// Name; part of the names of its columns in the history.
    pub name: String,
    /// The point, m from the lower corner of the domain.
    pub point: [f64; D],
    /// Bodies that count, by index; all without.
    pub bodies: Option<Vec<u16>>,
    /// Quantities in the history, each once.
    pub quantities: Vec<Measured>,
}

/// Where a track is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracked<const D: usize> {
    /// Identifier of the particle; `u64::MAX` while there is none.
    pub id: u64,
    /// Place where the history showed it last, m from the lower corner of the domain.
    pub place: [f64; D],
}
