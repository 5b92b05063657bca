//! Order in which bins scatter and blocks are summed up, so that few arenas exist at a time.
//!
//! Bins scatter in waves. A block is summed up with the wave after which all bins that reach it have
//! scattered, and an arena whose blocks are all summed up serves a bin of a later wave. The first wave are
//! the bins that other ranks need, so that their exchange can start. No sum depends on any of this: the plan
//! says which arenas a block adds up, and in which order.
use crate::csr::Csr;
use crate::grid::plan::GridPlan;
use crate::kernel::{Row, arena_nodes};

/// Bytes of the arenas of a wave, for each thread: few enough for its cache, and so many bins (64 in 3D) that
/// threads rarely wait for the last ones.
const BYTES_PER_THREAD: usize = 64 * size_of::<Row>() * arena_nodes(3);

/// Bins and blocks whose arenas or sums other ranks need.
#[derive(Clone, Debug, Default)]
pub struct Seam {
    /// Bins that other ranks need.
    pub is_sent: Vec<bool>,
    /// Blocks whose sums other ranks ask for.
    pub is_asked: Vec<bool>,
    /// Bins whose arenas are summed up again together with the sums of other ranks.
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
pub struct ArenaSchedule {
    /// Numbers of the bins among the occupied ones, by wave.
    bins: Csr<u32>,
    /// Blocks that bins reach, by the wave with which they are summed up.
    blocks: Csr<u32>,
    /// By wave, bins whose arenas are free after it.
    freed: Csr<u32>,
    /// Arena of each occupied bin.
    slots: Vec<u32>,
    /// Arenas in use at a time.
    most: usize,
    /// Wave of each block, [`NONE`] of those that no bin reaches.
    wave_of_block: Vec<u32>,
    /// Memory for making plans.
    wave_of_bin: Vec<u32>,
    free: FreeSlots,
}

/// No wave.
const NONE: u32 = u32::MAX;
/// Wave of bins that other ranks need, and of the sums these ask for.
pub const FIRST: usize = 0;

impl ArenaSchedule {
    /// Bins of a wave for all threads.
    pub fn usual_size<const D: usize>() -> usize {
        BYTES_PER_THREAD / (size_of::<Row>() * arena_nodes(D)) * rayon::current_num_threads()
    }

    /// Waves of `size` bins each for the `occupied` ones, which ascend, where `reached` lists the blocks that
    /// a bin reaches. Without a size all but those of the first wave are in one, and every bin keeps its
    /// arena.
    pub fn plan<I: Iterator<Item = usize>>(
        &mut self,
        size: Option<usize>,
        seam: &Seam,
        reached: impl Fn(u32) -> I,
        occupied: impl Iterator<Item = u32> + Clone,
    ) {
        let keep = size.is_none();
        let size = size.unwrap_or(usize::MAX);
        self.wave_of_block.clear();
        self.wave_of_block.resize(seam.is_asked.len(), NONE);
        self.wave_of_bin.clear();
        let mut before = 0;
        for bin in occupied.clone() {
            let is_sent = seam.is_sent[bin as usize];
            let wave = if is_sent { FIRST } else { 1 + before / size };
            before += usize::from(!is_sent);
            self.wave_of_bin.push(wave as u32);
            for block in reached(bin) {
                // Blocks that no other rank asks for can wait while the first sums are on their way.
                let least = if seam.is_asked[block] { wave } else { wave.max(1) };
                let last = &mut self.wave_of_block[block];
                *last = if *last == NONE { least as u32 } else { (*last).max(least as u32) };
            }
        }
        let waves = 1 + before.div_ceil(size).max(1);
        let mut asked = seam.is_asked.iter().zip(&self.wave_of_block).filter(|(asked, _)| **asked);
        debug_assert!(asked.all(|(_, &wave)| wave == FIRST as u32 || wave == NONE), "asked for, but late");
        fill(&mut self.bins, waves, self.wave_of_bin.iter().copied());
        fill(&mut self.blocks, waves, self.wave_of_block.iter().copied());
        let last_use = |bin: u32| {
            if keep || seam.is_kept[bin as usize] {
                return NONE;
            }
            reached(bin).map(|block| self.wave_of_block[block]).max().unwrap_or(FIRST as u32)
        };
        fill(&mut self.freed, waves, occupied.map(last_use));
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
                let slot = self.free.take_least().unwrap_or(next);
                next = next.max(slot + 1);
                self.slots[bin as usize] = slot;
            }
            self.freed.of(wave).iter().for_each(|&bin| self.free.add(self.slots[bin as usize]));
        }
        self.most = next as usize;
    }

    /// Whether an occupied bin reaches a block.
    pub fn reach(&self, block: usize) -> bool {
        self.wave_of_block[block] != NONE
    }

    /// Number of waves.
    pub fn count(&self) -> usize {
        self.bins.groups()
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

/// Arenas that are free, a bit each.
#[derive(Clone, Debug, Default)]
struct FreeSlots {
    words: Vec<u64>,
    /// Words before this one are zero.
    first: usize,
}

impl FreeSlots {
    fn clear(&mut self) {
        self.words.clear();
        self.first = 0;
    }

    fn add(&mut self, slot: u32) {
        let word = slot as usize / 64;
        if word >= self.words.len() {
            self.words.resize(word + 1, 0);
        }
        self.words[word] |= 1 << (slot % 64);
        self.first = self.first.min(word);
    }

    /// The first that is free is so no longer.
    fn take_least(&mut self) -> Option<u32> {
        let skipped = self.words[self.first..].iter().take_while(|word| **word == 0).count();
        self.first += skipped;
        let word = self.words.get_mut(self.first)?;
        let bit = word.trailing_zeros();
        *word &= *word - 1;
        Some(64 * self.first as u32 + bit)
    }
}

/// Puts 0, 1, … into the groups given, but for those in [`NONE`].
fn fill(groups: &mut Csr<u32>, count: usize, group_of: impl Iterator<Item = u32> + Clone) {
    groups.fill(count, group_of.zip(0..).filter(|(group, _)| *group != NONE));
}

#[cfg(test)]
mod tests {
    use super::*;

    const EDGE: usize = 12;

    /// Blocks around one of a cube of blocks.
    fn around(bin: u32) -> impl Iterator<Item = usize> + Clone {
        let place = [1, EDGE, EDGE * EDGE].map(|stride| bin as usize / stride % EDGE);
        (0..27usize).filter_map(move |offset| {
            (0..3).try_fold(0, |block, axis| {
                let along = (place[axis] + offset / 3usize.pow(axis as u32) % 3).checked_sub(1)?;
                (along < EDGE).then_some(block + along * EDGE.pow(axis as u32))
            })
        })
    }

    /// Other ranks ask for the blocks of the lowest layers.
    fn seam(layers: usize) -> Seam {
        let blocks = EDGE.pow(3);
        let is_asked: Vec<bool> = (0..blocks).map(|block| block / (EDGE * EDGE) < layers).collect();
        let is_sent: Vec<bool> =
            (0..blocks).map(|bin| around(bin as u32).any(|block| is_asked[block])).collect();
        Seam { is_kept: is_sent.clone(), is_sent, is_asked }
    }

    #[test]
    fn arenas_last_until_all_that_needs_them_is_summed() {
        let some = |bin: &u32| bin.wrapping_mul(2_654_435_761) >> 29 != 0;
        for (layers, size) in [(0, Some(1)), (0, Some(40)), (2, Some(40)), (3, Some(100_000)), (1, None)] {
            let (seam, mut waves) = (seam(layers), ArenaSchedule::default());
            let occupied: Vec<u32> = (0..EDGE.pow(3) as u32).filter(some).collect();
            // The second plan reuses the memory of the first.
            for _ in 0..2 {
                waves.plan(size, &seam, around, occupied.iter().copied());
            }
            let mut holder = vec![None; waves.arenas()];
            let (mut scattered, mut summed) = (vec![false; EDGE.pow(3)], vec![false; EDGE.pow(3)]);
            let slot = |bin: u32| waves.slot(occupied.binary_search(&bin).unwrap()) as usize;
            for wave in 0..waves.count() {
                let bins = waves.bins(wave).iter().map(|&number| occupied[number as usize]);
                assert!(bins.clone().is_sorted_by_key(slot));
                for bin in bins {
                    assert_eq!(seam.is_sent[bin as usize], wave == FIRST);
                    let before: Option<u32> = holder[slot(bin)].replace(bin);
                    let is_done =
                        |bin: u32| around(bin).all(|block| summed[block]) && !seam.is_kept[bin as usize];
                    assert!(before.is_none_or(is_done), "{size:?}: an arena is taken too early");
                    scattered[bin as usize] = true;
                }
                for &block in waves.blocks(wave) {
                    let block = block as usize;
                    assert_eq!(seam.is_asked[block], wave == FIRST);
                    assert!(!std::mem::replace(&mut summed[block], true), "summed twice");
                    // The bins that reach a block lie around it.
                    let bins = around(block as u32).map(|bin| bin as u32).filter(some);
                    assert!(
                        bins.clone().all(|bin| scattered[bin as usize] && holder[slot(bin)] == Some(bin))
                    );
                    assert!(waves.reach(block) && bins.count() > 0);
                }
            }
            assert!(scattered.iter().zip(0..).all(|(scattered, bin)| *scattered == some(&bin)));
            assert!((0..EDGE.pow(3)).all(|block| summed[block] == waves.reach(block)));
            if layers == 0 {
                assert!(waves.arenas() < occupied.len() / 2, "{size:?}: {}", waves.arenas());
            }
        }
    }
}
