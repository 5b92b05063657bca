//! Arenas: what the particles of each bin scattered, before nodes sum it up.
use super::plan::GridPlan;
use crate::kernel::{Row, arena_nodes};

/// First moments of one node: row `k` is column `k` of the matrix `A_j = Σ w m C` on the way from particles
/// to nodes, or of `V_j` on the way back. Lane 3 is zero.
pub type Moments<const D: usize> = [Row; D];

/// Arenas of all bins of a rank.
#[derive(Clone, Debug, Default)]
pub struct Arenas<const D: usize> {
    rows: Vec<Row>,
    moments: Vec<Moments<D>>,
    moment_slot: Vec<Option<u32>>,
    occupied: Vec<bool>,
}

/// The arena of one bin, to scatter into.
pub struct ArenaMut<'a, const D: usize> {
    /// Number of the bin.
    pub bin: usize,
    /// Momentum and mass.
    pub rows: &'a mut [Row],
    /// First moments, for bins that touch constrained nodes.
    pub moments: Option<&'a mut [Moments<D>]>,
    /// To be set when a particle scattered.
    pub occupied: &'a mut bool,
}

impl<const D: usize> Arenas<D> {
    /// Arenas for the bins of a plan.
    pub fn new(plan: &GridPlan<D>) -> Self {
        let nodes = arena_nodes(D);
        let mut slots = 0;
        let moment_slot = plan
            .bins
            .iter()
            .map(|bin| {
                bin.touched.map(|_| {
                    slots += 1;
                    slots - 1
                })
            })
            .collect();
        Self {
            rows: vec![Row([0.0; 4]); plan.bins.len() * nodes],
            moments: vec![[Row([0.0; 4]); D]; slots as usize * nodes],
            moment_slot,
            occupied: vec![false; plan.bins.len()],
        }
    }

    /// All arenas, mutable and disjoint, in bin order.
    pub fn each_mut(&mut self) -> Vec<ArenaMut<'_, D>> {
        let mut moments = self.moments.chunks_mut(arena_nodes(D));
        self.rows
            .chunks_mut(arena_nodes(D))
            .zip(&self.moment_slot)
            .zip(&mut self.occupied)
            .enumerate()
            .map(|(bin, ((rows, slot), occupied))| {
                let moments = slot.and_then(|_| moments.next());
                ArenaMut { bin, rows, moments, occupied }
            })
            .collect()
    }

    /// True when a particle scattered into the bin in this step.
    pub fn is_occupied(&self, bin: u32) -> bool {
        self.occupied[bin as usize]
    }

    /// Momentum and mass rows of a bin.
    pub fn rows(&self, bin: u32) -> &[Row] {
        &self.rows[bin as usize * arena_nodes(D)..][..arena_nodes(D)]
    }

    /// First moments of a bin, if it touches constrained nodes.
    pub fn moments(&self, bin: u32) -> Option<&[Moments<D>]> {
        let slot = self.moment_slot[bin as usize]?;
        Some(&self.moments[slot as usize * arena_nodes(D)..][..arena_nodes(D)])
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.rows.capacity() * size_of::<Row>() + self.moments.capacity() * size_of::<Moments<D>>()
    }
}
