//! The particles that share a velocity field.
use super::chunk::{Chunk, Tag};

/// The particles that share a velocity field.
#[derive(Clone, Copy, Debug)]
pub struct Group<'a> {
    /// Number of the field.
    pub field: u8,
    /// Number of the field of each body.
    pub field_of_body: &'a [u8],
}

/// Share of a chunk's particles that are in a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// None.
    None,
    /// Some, and others are not in the group.
    Some,
    /// All.
    All,
}

impl Group<'_> {
    /// Whether a particle with this tag is in the group.
    pub fn has(&self, tag: u64) -> bool {
        self.field_of_body[usize::from(Tag::unpack(tag).body)] == self.field
    }

    /// Share of a chunk's particles that are in the group.
    pub fn share<const D: usize>(&self, chunk: &Chunk<D>) -> Share {
        match chunk.tags().iter().filter(|&&tag| self.has(tag)).count() {
            0 => Share::None,
            members if members == chunk.len() => Share::All,
            _ => Share::Some,
        }
    }
}
