//! Costs of own leaves from measured times, on which all ranks agree.
use std::sync::atomic::Ordering;

use crate::solver::state::Solver;
use crate::solver::state::cost::{KINDS, Kind, UNIT, arena_cost, loads};
use crate::solver::state::phases::Phase;

impl<const D: usize> Solver<D> {
    /// Kind of transfer of the boxes of an own leaf: of the last step, or of the next where that is known.
    fn kind(&self, leaf: usize) -> Kind {
        let grid = &self.grid;
        if grid.plan.revision != self.forest.revision() {
            // The tree has just changed; nothing was transferred on it yet.
            return Kind::Plain;
        }
        match grid.fields[0].lists.of_leaf(leaf) {
            Some(bins) if !bins.cut.is_empty() => Kind::Cut,
            Some(_) => Kind::Jump,
            None if grid.plan.bins[grid.plan.leaf_bins(leaf).start].touched.is_some() => Kind::Jump,
            None => Kind::Plain,
        }
    }

    /// Not collective. Costs of the own leaves in a step, in units that are the same on all ranks.
    pub(super) fn leaf_costs(&self) -> Vec<u64> {
        let leaves = self.chunks.iter().enumerate();
        leaves.map(|(leaf, chunk)| self.balance.costs.of(chunk, self.kind(leaf))).collect()
    }

    /// Collective. Turns what all ranks have measured since the last call into costs.
    pub(super) fn agree_on_costs(&mut self) {
        let materials = self.physics.materials.len();
        let seconds = self.phases.running_time(&[Phase::Sort, Phase::Sum, Phase::Nodes]);
        let steps = self.clock.step - self.balance.costs.agreed_step;
        let units = |seconds: f64| (seconds / UNIT) as u64;
        // By material and kind: time, particles; then time and number of leaves in node work.
        let mut sums = vec![0u64; 2 * KINDS * materials + 2];
        let (times, rest) = sums.split_at_mut(KINDS * materials);
        let (particles, nodes) = rest.split_at_mut(KINDS * materials);
        let leaf_times = &self.leaf_data.times;
        for (leaf, chunk) in self.chunks.iter().enumerate().filter(|(_, chunk)| !chunk.is_empty()) {
            nodes[1] += steps;
            let (kind, len) = (self.kind(leaf) as usize, chunk.len() as u64);
            let time = leaf_times.nanoseconds.get(leaf).map_or(0, |time| time.load(Ordering::Relaxed));
            for (material, load) in loads(chunk, materials).into_iter().enumerate() {
                let share = time as f64 * load as f64 / (len + arena_cost(D, len)) as f64;
                times[KINDS * material + kind] += units(share * 1e-9);
                particles[KINDS * material + kind] += load * leaf_times.measurements(leaf);
            }
        }
        let threads = rayon::current_num_threads() as f64;
        nodes[0] = units((seconds - self.balance.costs.agreed_seconds).max(0.0) * threads);
        (self.balance.costs.agreed_seconds, self.balance.costs.agreed_step) = (seconds, self.clock.step);
        self.leaf_data.times.reset(self.chunks.len());
        self.comm.sum_u64(&mut sums);
        self.balance.costs.take_in(&sums, materials);
    }
}
