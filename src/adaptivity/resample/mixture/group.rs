//! Particles that might become one.

/// Particles that might become one.
#[derive(Clone, Debug)]
pub(in crate::adaptivity::resample) struct Group {
    /// At least two; children of a family in the order of their numbers, others in the order of the chunk.
    pub members: Vec<u32>,
    /// Identifier of the merged particle.
    pub id: u64,
    /// Whether these are all children of one parent.
    pub is_family: bool,
    /// Axis along which the parent was halved, where these are its halves.
    pub rejoined: Option<usize>,
}

impl Group {
    /// Children of a family are given by number, which is not their order in the chunk once they have moved.
    pub(in crate::adaptivity::resample) fn new(mut members: Vec<u32>, id: u64, is_family: bool) -> Self {
        if let Some(first) = (0..members.len()).min_by_key(|&i| members[i]) {
            // The merged particle takes the place of the first in the chunk.
            members[..=first].rotate_right(1);
        }
        Self { members, id, is_family, rejoined: None }
    }
}
