//! Pairs of blocks of two levels, over which sums are restricted and values prolonged.

/// A block with constrained nodes.
#[derive(Clone, Copy, Debug)]
pub struct FineBlock {
    /// Its number.
    pub block: u32,
    /// Blocks that hold parents, by corner; [`super::NO_BLOCK`] where none are needed.
    pub parents: [u32; 8],
}

/// A block whose nodes are parents of nodes that are summed.
#[derive(Clone, Debug)]
pub struct CoarseBlock {
    /// Its number.
    pub block: u32,
    /// The blocks of the children, as numbers of [`Links::children`].
    pub children: std::ops::Range<u32>,
}

/// A block that holds children of a coarser one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Child {
    /// Its number.
    pub block: u32,
    /// The corner at which it has the coarser block.
    pub corner: u8,
}

/// Pairs of blocks of one level and the level one coarser.
#[derive(Clone, Debug, Default)]
pub struct Links {
    /// Blocks of the finer level.
    pub fine: Vec<FineBlock>,
    /// Blocks of the coarser level.
    pub coarse: Vec<CoarseBlock>,
    /// Children of the coarser blocks: of one block in the order of their numbers, that is along the curve.
    pub children: Vec<Child>,
}

impl Links {
    /// Blocks that hold children of a coarser one.
    pub fn of(&self, coarse: &CoarseBlock) -> &[Child] {
        &self.children[coarse.children.start as usize..coarse.children.end as usize]
    }

    /// Groups pairs of coarser block and child.
    pub(super) fn group(&mut self, mut pairs: Vec<(u32, Child)>) {
        pairs.sort_unstable();
        for children in pairs.chunk_by(|a, b| a.0 == b.0) {
            let first = self.children.len() as u32;
            self.children.extend(children.iter().map(|(_, child)| *child));
            self.coarse
                .push(CoarseBlock { block: children[0].0, children: first..self.children.len() as u32 });
        }
    }
}
