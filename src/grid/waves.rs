//! In which order bins scatter and blocks are summed up, so that few arenas are held at a time.
//!
//! Bins scatter in waves. A block is summed up with the wave after which all bins that reach it have scattered, and an
//! arena whose blocks are all summed up serves a bin of a later wave. The first wave are the bins that other ranks need, so that
//! their exchange can start. No sum depends on any of this: what a block adds up, and in which order, the plan says.
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::plan::GridPlan;

/// Bins of a wave, for each thread.
const BINS_PER_THREAD: usize = 128;

/// What bins and blocks have to do with other ranks.
#[derive(Clone, Debug, Default)]
pub struct Seam {
    /// Bins that other ranks need.
    pub is_sent: Vec<bool>,
    /// Blocks whose sums other ranks ask for.
    pub is_asked: Vec<bool>,
    /// Bins whose arenas are summed up again with what other ranks send.
    pub is_kept: Vec<bool>,
}

impl Seam {
    /// Of a plan, where other ranks need the bins `is_sent` and ask for the sums of the blocks `is_asked`.
    pub fn new<const D: usize>(plan: &GridPlan<D>, is_sent: Vec<bool>, is_asked: Vec<bool>) -> Self {
        let bins = plan.bins.iter().zip(&is_sent);
        let is_kept =
            bins.map(|(bin, sent)| *sent || bin.reached().any(|block| plan.is_seam(block))).collect();
        Self { is_sent, is_asked, is_kept }
    }
}

/// The waves of one step.
#[derive(Clone, Debug, Default)]
pub struct Waves {
    /// Numbers of the bins among the occupied ones, by wave.
    bins: Groups,
    /// Blocks that bins reach, by the wave with which they are summed up.
    blocks: Groups,
    /// By wave, bins whose arenas are free after it.
    freed: Groups,
    /// Arena of each occupied bin.
    slots: Vec<u32>,
    /// Arenas in use at a time.
    most: usize,
    /// Wave of each block, [`NONE`] of those that no bin reaches.
    wave_of_block: Vec<u32>,
    /// Memory for making plans.
    wave_of_bin: Vec<u32>,
    free: BinaryHeap<Reverse<u32>>,
}

/// No wave.
const NONE: u32 = u32::MAX;
/// Wave of bins that other ranks need, and of the sums these ask for.
pub const FIRST: usize = 0;

impl Waves {
    /// The waves in which `occupied` bins, which ascend, are best treated. With `keep` there is one beside the first, and all
    /// arenas stay.
    pub fn plan<const D: usize>(
        &mut self,
        plan: &GridPlan<D>,
        seam: &Seam,
        keep: bool,
        occupied: impl Iterator<Item = u32> + Clone,
    ) {
        let size = if keep { usize::MAX } else { BINS_PER_THREAD * rayon::current_num_threads() };
        self.wave_of_block.clear();
        self.wave_of_block.resize(plan.blocks.len(), NONE);
        self.wave_of_bin.clear();
        let mut before = 0;
        for bin in occupied.clone() {
            let is_sent = seam.is_sent[bin as usize];
            let wave = if is_sent { FIRST } else { 1 + before / size };
            before += usize::from(!is_sent);
            self.wave_of_bin.push(wave as u32);
            for block in plan.bins[bin as usize].reached() {
                // Blocks that are not asked for can wait while the first sums are on their way.
                let least = if seam.is_asked[block] { wave } else { wave.max(1) };
                let last = &mut self.wave_of_block[block];
                *last = if *last == NONE { least as u32 } else { (*last).max(least as u32) };
            }
        }
        let waves = 1 + before.div_ceil(size).max(1);
        let mut asked = seam.is_asked.iter().zip(&self.wave_of_block).filter(|(asked, _)| **asked);
        debug_assert!(asked.all(|(_, &wave)| wave == FIRST as u32 || wave == NONE), "asked for, but late");
        self.bins.fill(waves, self.wave_of_bin.iter().copied());
        self.blocks.fill(waves, self.wave_of_block.iter().copied());
        let last_use = |bin: u32| {
            if keep || seam.is_kept[bin as usize] {
                return NONE;
            }
            let sums = plan.bins[bin as usize].reached().map(|block| self.wave_of_block[block]);
            sums.max().unwrap_or(FIRST as u32)
        };
        self.freed.fill(waves, occupied.map(last_use));
        self.assign_slots(waves);
    }

    /// Gives each bin the first arena that is free.
    fn assign_slots(&mut self, waves: usize) {
        self.slots.clear();
        self.slots.resize(self.wave_of_bin.len(), 0);
        self.free.clear();
        let mut next = 0;
        for wave in 0..waves {
            for &bin in self.bins.of(wave) {
                let slot = self.free.pop().map_or(next, |Reverse(slot)| slot);
                next = next.max(slot + 1);
                self.slots[bin as usize] = slot;
            }
            let slots = &self.slots;
            self.free.extend(self.freed.of(wave).iter().map(|&bin| Reverse(slots[bin as usize])));
        }
        self.most = next as usize;
    }

    /// Whether an occupied bin reaches a block.
    pub fn reach(&self, block: usize) -> bool {
        self.wave_of_block[block] != NONE
    }

    /// Number of waves.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Bins of a wave, by their numbers among the occupied ones; their arenas ascend as they do.
    pub fn bins(&self, wave: usize) -> &[u32] {
        self.bins.of(wave)
    }

    /// Blocks that are summed up with a wave.
    pub fn blocks(&self, wave: usize) -> &[u32] {
        self.blocks.of(wave)
    }

    /// The arena of an occupied bin.
    pub fn slot(&self, occupied: usize) -> u32 {
        self.slots[occupied]
    }

    /// Arenas that are needed.
    pub fn arenas(&self) -> usize {
        self.most
    }
}

/// Numbers by group, ascending in each.
#[derive(Clone, Debug, Default)]
struct Groups {
    /// Start of each group, and the end.
    start: Vec<u32>,
    members: Vec<u32>,
}

impl Groups {
    /// Puts 0, 1, … into the groups given, but for those in [`NONE`].
    fn fill(&mut self, groups: usize, group_of: impl Iterator<Item = u32> + Clone) {
        self.start.clear();
        self.start.resize(groups + 1, 0);
        let group_of = (0..).zip(group_of).filter(|(_, group)| *group != NONE);
        group_of.clone().for_each(|(_, group)| self.start[group as usize + 1] += 1);
        (0..groups).for_each(|group| self.start[group + 1] += self.start[group]);
        self.members.clear();
        self.members.resize(self.start[groups] as usize, 0);
        for (member, group) in group_of {
            // Starts serve as places until all are filled.
            let place = &mut self.start[group as usize];
            self.members[*place as usize] = member;
            *place += 1;
        }
        self.start.rotate_right(1);
        self.start[0] = 0;
    }

    fn len(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    fn of(&self, group: usize) -> &[u32] {
        &self.members[self.start[group] as usize..self.start[group + 1] as usize]
    }
}
