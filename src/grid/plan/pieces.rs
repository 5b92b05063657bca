//! Pieces: sums of other ranks, and where they enter.

/// Sum of another rank's bins in a subtree, at nodes of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// The other rank.
    pub rank: usize,
    /// The block.
    pub block: u32,
    /// Nodes that are needed.
    pub nodes: u64,
    /// Those of them whose first moments are needed.
    pub with_moments: u64,
    /// Least key in the subtree; 0 and the greatest possible key where the subtree holds all that the rank
    /// contributes.
    pub first: u64,
    /// Greatest key in the subtree.
    pub last: u64,
}

/// Contribution of a piece to a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// The region.
    pub region: u8,
    /// Number of the piece.
    pub piece: u32,
    /// A key of its subtree in this region.
    pub key: u64,
    /// Position of one of the bins in the subtree that lie in their leaves; [`NO_HOME`] if it has none.
    pub home: u8,
    /// Whether own bins, if any reach the region, are one subtree as well: then the sum is that of theirs and
    /// this one.
    pub is_only: bool,
}

/// No position.
pub const NO_HOME: u8 = u8::MAX;
