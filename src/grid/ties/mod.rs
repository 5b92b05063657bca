//! Surface nodes tied: nodes of no well filled cell move with the material beside them.
//!
//! A node that only the edges of a few boxes reach has little mass and a force that does not shrink with it.
//! Left free, it moves until it relieves the stress of these boxes. Such a node j is tied: its velocity is
//! that of the plane through the corners r of the nearest well filled cells, `v_j = Σ P_r v_r` (aggregation;
//! Coombs, Bird and Pretti 2025). Each tie is a constraint that acts by an impulse J on the node and by
//! `-P_r J` on the corners. As P reproduces affine fields, J changes neither momentum nor angular momentum,
//! and it is zero in affine motion. All impulses together are sought by sweeps of Jacobi's method,
//! ```text
//! J_j = (Σ P_r v_r - v_j) / (1/m_j + Σ |P_r| S_r / m_r),   S_r = Σ |P_r| over all ties of r
//! ```
//! whose denominators are row sums of the matrix of compliances, so that no sweep adds kinetic energy,
//! whatever the masses are. A light node, for which ties matter, has its velocity after the first sweep.
//!
//! Cells become well filled, and nodes get mass, as surfaces pass them; in most steps a block has the ties of
//! the step before. So each block keeps its ties with all that they follow from.
//!
//! | file | what it holds |
//! |---|---|
//! | `finder` | the nodes that are tied, and to what |
//! | `impulses` | the impulses of ties |
//! | `leaf_words` | which cells are well filled, from rank to rank |
//! | `neighbourhood` | cells and nodes around a block |
//! | `plane` | the plane through the corners of cells |
mod finder;
mod impulses;
mod leaf_words;
mod neighbourhood;
mod plane;

use partition::comm::{Comm, Traffic};
use rayon::prelude::*;

use self::finder::{Finder, Memory};
pub use self::impulses::Tied;
use self::leaf_words::LeafWords;
use super::mask::block_nodes;
use super::plan::GridPlan;
use super::sums::node_fields::NodeFields;

/// Blocks around those of its bins, counted along each axis, in which a rank needs all nodes to compute the
/// effect of ties on its own nodes without messages: a corner gets impulses that depend on all ties of the
/// corners of its ties, and these on the cells beside their nodes, four times the reach of a tie away.
pub const HALO: u32 = 3;

/// Ties of one plan and, of the last step, which cells are well filled.
pub struct Ties<const D: usize> {
    words: LeafWords,
    /// Well filled cells of each known leaf.
    filled: Vec<u64>,
    finder: Finder<D>,
    /// Nodes of each block on faces of the domain.
    on_faces: Vec<u64>,
    /// Nodes of each block near what never moves, once they are known.
    near_still: Vec<Option<u64>>,
    /// By velocity field.
    memories: Vec<Memory>,
}

impl<const D: usize> Ties<D> {
    /// Collective. For a plan that has a [`HALO`].
    pub fn new(comm: &Comm, plan: &GridPlan<D>) -> Self {
        let mut on_faces = vec![0; plan.blocks.len()];
        let nodes = block_nodes(D);
        plan.face_nodes
            .iter()
            .for_each(|&(node, _)| on_faces[node as usize / nodes] |= 1 << (node as usize % nodes));
        let (words, finder) = (LeafWords::new(comm, &plan.tree), Finder::new());
        let near_still = vec![None; plan.blocks.len()];
        Self { words, filled: Vec::new(), finder, on_faces, near_still, memories: Vec::new() }
    }

    /// Messages and bytes so far.
    pub fn traffic(&self) -> Traffic {
        self.words.traffic()
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        let memories = self.memories.iter().map(Memory::heap_bytes).sum::<usize>();
        let words = self.filled.len() + self.on_faces.len() + 2 * self.near_still.len();
        size_of::<u64>() * words + self.finder.heap_bytes() + memories
    }

    /// Collective over neighbours. Takes the well filled cells of each own leaf, a bit each.
    pub fn fill(&mut self, plan: &GridPlan<D>, own: &[u64]) {
        self.words.share(&plan.tree, own, &mut self.filled);
    }

    /// Not collective. Tells the ties which nodes of blocks with mass are near what never moves; `find` is
    /// asked once for each block.
    pub fn note_still(&mut self, fields: &NodeFields<D>, find: impl Fn(usize) -> u64 + Sync) {
        let blocks = self.near_still.par_iter_mut().zip(&fields.active).enumerate().with_min_len(16);
        let new = blocks.filter(|(_, (known, active))| **active && known.is_none());
        new.for_each(|(block, (known, _))| *known = Some(find(block)));
    }

    /// Not collective. Ties the nodes of the velocity field of this number, whose rows hold velocities and
    /// masses. `held` returns those of some nodes of a block that are fixed by other conditions; these are
    /// not tied, nor is anything tied to them. Nodes between two bodies belong to neither.
    pub fn tie(
        &mut self,
        plan: &GridPlan<D>,
        field: usize,
        fields: &mut NodeFields<D>,
        held: impl Fn(usize, u64) -> u64 + Sync,
    ) {
        if self.memories.len() <= field {
            self.memories.resize_with(field + 1, Memory::default);
        }
        let memory = &mut self.memories[field];
        let known = |block: usize| self.on_faces[block] | self.near_still[block].unwrap_or(0);
        self.finder.find(plan, fields, &self.filled, memory, false, |block, nodes| {
            known(block) | held(block, nodes)
        });
        memory.tied.pull(fields);
    }

    /// Not collective. The ties of a velocity field, whose rows hold masses; `held` as in [`Ties::tie`],
    /// where nodes on faces of the domain are not fixed for that alone. Nodes between two bodies have ties as
    /// well: free, they would have next to no stiffness.
    pub fn search(
        &mut self,
        plan: &GridPlan<D>,
        fields: &NodeFields<D>,
        held: impl Fn(usize, u64) -> u64 + Sync,
    ) -> Tied {
        let mut memory = Memory::default();
        self.finder.find(plan, fields, &self.filled, &mut memory, true, held);
        memory.tied
    }
}
