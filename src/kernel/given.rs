//! Columns of particles that are given in place of their own.

/// A column that all particles of a chunk have in a sweep in place of their own.
#[derive(Clone, Debug)]
pub struct GivenColumn {
    /// Which of [`Layout`](crate::particle::chunk::Layout).
    pub column: usize,
    /// Its values, particle by particle.
    pub values: Vec<f64>,
}
