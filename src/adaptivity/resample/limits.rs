//! How much particles that become one may differ.

/// Limits on the differences of particles that become one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Greatest difference of a velocity from the affine field through the velocities of the group, as a
    /// share of the wave speed of the undeformed material. The field is fitted to the centres as if these
    /// were boxes, so that a quarter of the affine part may count as difference as well.
    pub velocity: f64,
    /// Greatest difference from the mean of the elastic Hencky strain (Frobenius norm).
    pub strain: f64,
    /// Greatest difference from the mean of the logarithm of the plastic volume ratio: a difference in the
    /// distance of grains.
    pub volume: f64,
    /// Greatest difference of the first history variable (plastic strain) from the mean.
    pub history: f64,
    /// Greatest half width of the merged box, and of a box about the boxes of a family, over that of an
    /// undeformed particle of the new level. Above 1, and below the stretch at which particles split, so that
    /// a merge does not undo that. A box about those of strangers may be wider by half: they share a cell of
    /// the lattice, out of which halves of boxes stand.
    pub stretch: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { velocity: 0.005, strain: 0.02, volume: 0.1, history: 0.2, stretch: 1.5 }
    }
}
