//! How full nodes are, in jobs with fluids.
use crate::grid::GridPlan;
use crate::grid::mask::block_nodes;
use crate::grid::sums::volumes::NodeVolumes;
use crate::kernel::Coordinates;
use crate::memory::Block;

/// Shares of the basis functions of the nodes of a block that lie outside colliders, less than 0 by depth, in
/// cells, where none does; nothing where all are whole.
#[derive(Clone, Debug, Default)]
pub(in crate::solver) struct OpenShares(pub(in crate::solver) Vec<f64>);

/// How full the nodes of one plan are.
pub(in crate::solver) struct NodeFill {
    /// `φ_j = Σ V₀ w / ∫N_j`, by node; 0 where there is no material.
    pub(in crate::solver) of_nodes: Block<f64>,
    /// Volumes of the basis functions.
    pub(in crate::solver) volumes: NodeVolumes,
    /// Per block, whether its values may differ from 0.
    pub(in crate::solver) dirty: Vec<bool>,
    /// Per block, the shares of nodal volumes that colliders which never move leave open; `None` until its
    /// first use.
    pub(in crate::solver) open: Vec<Option<OpenShares>>,
    /// Where bodies of unlike density share a velocity field, by field: sums of reference volumes, m³, by
    /// node; empty elsewhere.
    pub(in crate::solver) scattered: Vec<Vec<f64>>,
}

impl NodeFill {
    pub(in crate::solver) fn new<const D: usize>(plan: &GridPlan<D>, coordinates: Coordinates) -> Self {
        Self {
            of_nodes: Block::zeroed(plan.blocks.len() * block_nodes(D)),
            volumes: NodeVolumes::new(plan, coordinates),
            dirty: vec![false; plan.blocks.len()],
            open: vec![None; plan.blocks.len()],
            scattered: Vec::new(),
        }
    }

    /// Bytes held.
    pub(in crate::solver) fn heap_bytes(&self) -> usize {
        size_of_val(&*self.of_nodes) + self.scattered.iter().map(|of| size_of_val(&**of)).sum::<usize>()
    }
}
