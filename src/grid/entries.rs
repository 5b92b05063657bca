//! Which arenas enter which block's sum.
use super::arena::Arenas;
use super::exchange::ReceivedArenas;
use super::fields::Part;
use super::plan::{GridPlan, NO_BLOCK, Source};

/// Which arenas enter the sum of each block in this step, in canonical order.
#[derive(Clone, Debug, Default)]
pub(super) struct Entries {
    /// First entry of each block, and the number of entries at the end.
    start: Vec<u32>,
    /// Source and place: the offset number of the block from an own bin, or the part of a received bin.
    list: Vec<(Source, u32)>,
}

impl Entries {
    /// Collects the entries of the blocks of `part` from the occupied bins.
    pub fn collect<const D: usize>(
        &mut self,
        plan: &GridPlan<D>,
        arenas: &Arenas<D>,
        received: &ReceivedArenas<D>,
        part: Part,
    ) {
        let seam = part == Part::Seam;
        let each = |f: &mut dyn FnMut(u32, Source, u32)| {
            for &source in &plan.sources {
                match source {
                    Source::Own(bin) if arenas.is_occupied(bin.0 as usize) => {
                        let window = arenas.window(bin.0 as usize);
                        let around = plan.bins[bin.0 as usize].around.iter().zip(0..);
                        for (&block, place) in around.filter(|(block, _)| **block != NO_BLOCK) {
                            if plan.is_seam[block as usize] == seam
                                && plan.blocks[block as usize].sum != 0
                                && window.reaches(place as usize)
                            {
                                f(block, source, place);
                            }
                        }
                    }
                    Source::Received(bin) if seam && received.is_occupied(bin) => {
                        let parts = plan.received[bin as usize].parts.iter().zip(0..);
                        parts.for_each(|(part, place)| f(part.block, source, place));
                    }
                    _ => {}
                }
            }
        };
        self.start.clear();
        self.start.resize(plan.blocks.len() + 1, 0);
        each(&mut |block, _, _| self.start[block as usize + 1] += 1);
        for block in 0..plan.blocks.len() {
            self.start[block + 1] += self.start[block];
        }
        self.list.clear();
        self.list.resize(self.start[plan.blocks.len()] as usize, (Source::Received(0), 0));
        each(&mut |block, source, place| {
            let next = &mut self.start[block as usize];
            self.list[*next as usize] = (source, place);
            *next += 1;
        });
        // Each start has moved to the end of its block.
        self.start.rotate_right(1);
        self.start[0] = 0;
    }

    /// Entries of a block.
    pub fn of(&self, block: usize) -> &[(Source, u32)] {
        &self.list[self.start[block] as usize..self.start[block + 1] as usize]
    }
}
