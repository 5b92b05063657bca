//! Which particles of a chunk take part.

/// Which particles of a chunk take part.
#[derive(Clone, Copy, Debug)]
pub enum Select<'a> {
    /// All, in the order of the chunk.
    All,
    /// These, in any order; none twice where a kernel writes.
    List(&'a [u32]),
}
