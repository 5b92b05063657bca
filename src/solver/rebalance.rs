//! Partition of leaves by the cost of their particles.
use super::Solver;
use super::phases::Phase;
use crate::particle::Chunk;

/// Cost of a leaf without particles, in units of a particle's: its share of node sums and bookkeeping.
const LEAF_COST: u64 = 8;

/// Cost of a leaf in a step.
pub fn leaf_weight<const D: usize>(chunk: &Chunk<D>) -> u64 {
    leaf_cost(chunk.len() as u64)
}

/// Cost of a leaf with so many particles.
pub fn leaf_cost(particles: u64) -> u64 {
    LEAF_COST + particles
}

/// Greatest cost of a rank over the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imbalance(pub f64);

impl<const D: usize> Solver<D> {
    /// Collective. Imbalance of the current partition.
    pub fn imbalance(&self) -> Imbalance {
        let own: u64 = self.chunks.iter().map(leaf_weight).sum();
        let (mut total, mut greatest) = ([own], [own]);
        self.comm.sum_u64(&mut total);
        self.comm.max_u64(&mut greatest);
        Imbalance(greatest[0] as f64 * self.comm.size() as f64 / total[0].max(1) as f64)
    }

    /// Collective. Cuts the curve anew by current costs, moves leaves with their particles and rebuilds the
    /// grid. Changes no bit of the state.
    pub fn rebalance(&mut self) {
        let start = std::time::Instant::now();
        let weights: Vec<u64> = self.chunks.iter().map(leaf_weight).collect();
        let shipment = self.forest.partition(&self.comm, &weights);
        let payload = std::mem::take(&mut self.chunks).iter().map(Chunk::to_bytes).collect();
        let arrived: Vec<Vec<u8>> = shipment.move_payload(&self.comm, payload);
        self.chunks = arrived.iter().map(|bytes| Chunk::from_bytes(bytes)).collect();
        self.signal = vec![0.0; self.chunks.len()];
        self.rebuild_grid(self.grid.plan.tree.reach());
        self.phases.book(Phase::Regrid, start.elapsed());
    }
}
