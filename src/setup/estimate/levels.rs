//! Leaves and particles by level.
use bytemuck::{Pod, Zeroable};
use partition::Octant;
use rustc_hash::FxHashSet;

use crate::grid::mask::{offset, offset_count};
use crate::job::Problem;

/// Leaves of one level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LevelCount {
    /// All leaves.
    pub leaves: u64,
    /// Leaves with particles.
    pub filled: u64,
    /// Those of them that touch a leaf of another level.
    pub filled_jumps: u64,
    /// Particles.
    pub particles: u64,
}

impl LevelCount {
    /// Not collective. Counts of some leaves by level up to the finest one, given the particles of each.
    pub fn of_levels<const D: usize>(
        problem: &Problem<D>,
        leaves: &[Octant<D>],
        particles: &[u64],
    ) -> Vec<Self> {
        let all: FxHashSet<Octant<D>> = leaves.iter().copied().collect();
        let finest = leaves.iter().map(|leaf| leaf.level).max().unwrap_or(0);
        let mut levels = vec![Self::default(); usize::from(finest) + 1];
        for (leaf, &particles) in leaves.iter().zip(particles) {
            let mut around =
                (0..offset_count(D)).filter_map(|index| leaf.neighbour(offset(index), &problem.brick));
            let is_jump = particles > 0 && around.any(|neighbour| !all.contains(&neighbour));
            let level = &mut levels[usize::from(leaf.level)];
            level.leaves += 1;
            level.filled += u64::from(particles > 0);
            level.filled_jumps += u64::from(is_jump);
            level.particles += particles;
        }
        levels
    }
}
