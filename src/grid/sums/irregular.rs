//! Sums at nodes with contributions beside whole arenas: bins outside their leaves, and sums of other ranks.
//!
//! Most of these take the place of one arena in the fixed pattern: where the bins of a leaf or of another
//! rank are the only ones within a subtree of the pattern, their contribution enters at one of its places,
//! the others being empty. Contributions that do not fit are listed and added up along the tree of keys.
use super::contributions::{BlockSum, Irregular, Other, Placed, ZERO, ZEROS};
use crate::grid::constraints::moments::{self, Moments};
use crate::grid::mask::{bits, offset_count, opposite};
use crate::grid::order::region::{MOST_BINS, SPAN, arena_node};
use crate::grid::order::{Origin, Term, arrange, fold};
use crate::grid::plan::pieces::{NO_HOME, Part};
use crate::kernel::Row;

impl<const D: usize> BlockSum<'_, D> {
    /// Parts of received pieces that enter a region in this step, with the nodes that they touch.
    fn parts(&self, region: usize) -> impl Iterator<Item = (&Part, u64)> {
        // Parts are listed region by region.
        let parts = if self.received.is_some() { self.plan.parts(self.block) } else { &[] };
        let first = parts.partition_point(|part| (part.region as usize) < region);
        let here = parts[first..].iter().take_while(move |part| part.region as usize == region);
        here.filter_map(move |part| {
            let touched = self.received?.touched(part.piece) & self.regions.nodes[region];
            (touched != 0).then_some((part, touched))
        })
    }

    /// Finds the places of all contributions to a region beside whole arenas; false if it does not fit the
    /// pattern.
    #[inline(never)]
    pub(super) fn place(&mut self, region: usize) -> bool {
        let (here, nodes) = (self.regions.positions[region], self.regions.nodes[region]);
        let mut placed = std::mem::take(&mut self.scratch.placed);
        placed.clear();
        // A subtree's other places must stay empty, so that all of it is one summand.
        let mut free = here & !self.occupied;
        let mut fits = |homes: u32, origin: Origin| {
            let homes = homes & here;
            if homes == 0 || homes & !free != 0 {
                return false;
            }
            free &= !homes;
            let position = homes.trailing_zeros() as u8;
            let slot = self.order[region].iter().position(|slot| slot.position == position);
            placed.extend(slot.map(|slot| Placed { slot, origin }));
            true
        };
        let mut outer = self.scratch.outer.iter().filter(|other| other.touched & nodes != 0);
        let is_home = |part: &Part| if part.home == NO_HOME { 0 } else { 1 << part.home };
        let all_fit = outer.all(|other| fits(other.homes, other.origin))
            && self.parts(region).all(|(part, _)| fits(is_home(part), Origin::Piece(part.piece)));
        self.scratch.placed = placed;
        all_fit
    }

    /// Copies rows of other ranks to their places.
    pub(super) fn copy_pieces(&mut self, region: usize) {
        let nodes = self.regions.nodes[region];
        let Some(received) = self.received else { return };
        let Irregular { placed, pieces, .. } = &mut *self.scratch;
        // Distances between nodes are the same in all arenas.
        let node = |bit| arena_node::<D>(offset_count(D) / 2, bit);
        let first = node(nodes.trailing_zeros());
        for placed in placed {
            if let Origin::Piece(piece) = placed.origin {
                let to = &mut pieces[placed.slot * SPAN..][..SPAN];
                for bit in bits(nodes) {
                    to[node(bit) - first] = received.row(piece, bit);
                }
            }
        }
    }

    /// The sums of a region, along a list of all contributions.
    pub(super) fn fold_rows(&mut self, region: usize, to: &mut [Row]) {
        self.list_terms(region);
        let nodes = self.regions.nodes[region];
        let mut stack = std::mem::take(&mut self.scratch.rows);
        let load = |term: &Term| self.rows_of(term, nodes);
        let add = |to: &mut [Row; MOST_BINS], from: &[Row; MOST_BINS]| {
            to.iter_mut().zip(from).for_each(|(to, from)| to.add(from));
        };
        let sum = fold(&self.scratch.terms, &mut stack, load, add).unwrap_or_default();
        for (bit, row) in bits(nodes).zip(&sum) {
            to[bit as usize] = row.plus(&ZERO);
        }
        self.scratch.rows = stack;
    }

    /// The moments at nodes of a region, along a list of all contributions. `to` has all of the block.
    pub(super) fn fold_moments(&mut self, region: usize, nodes: u64, to: &mut [Row]) {
        self.list_terms(region);
        let mut stack = std::mem::take(&mut self.scratch.moments);
        for bit in bits(nodes) {
            let load = |term: &Term| {
                let touched = term.touched >> bit & 1 == 1;
                let found = if touched { self.moments(term.origin, bit) } else { None };
                found.unwrap_or([ZERO; D])
            };
            let sum = fold(&self.scratch.terms, &mut stack, load, add_moments);
            let sum = sum.unwrap_or([ZERO; D]).map(|row| row.plus(&ZERO));
            moments::write(to, self.plan.blocks[self.block].with_moments, bit, &sum);
        }
        self.scratch.moments = stack;
    }

    /// Lists the contributions to a region, in order.
    fn list_terms(&mut self, region: usize) {
        let mut terms = std::mem::take(&mut self.scratch.terms);
        terms.clear();
        let nodes = self.regions.nodes[region];
        let bins = self.plan.bins_by_block.inner::<D>(self.block);
        for position in bits(u64::from(self.occupied & self.regions.positions[region])) {
            let bin = bins[position as usize];
            let key = self.plan.bins[bin as usize].block.key();
            let touched = self.touched_at(position as usize);
            let origin = Origin::Bin { bin, position: position as u8 };
            terms.push(Term { key, tie: key, separation: 0, touched, origin });
        }
        let outer = self.scratch.outer.iter().filter(|other| other.touched & nodes != 0);
        terms.extend(outer.map(|&Other { key, tie, touched, origin, .. }| Term {
            key,
            tie,
            separation: 0,
            touched,
            origin,
        }));
        terms.extend(self.parts(region).map(|(part, touched)| Term {
            key: part.key,
            tie: part.key,
            separation: 0,
            touched,
            origin: Origin::Piece(part.piece),
        }));
        arrange(&mut terms);
        self.scratch.terms = terms;
    }

    /// Contribution of a term to the nodes of a region, in the order of their bits.
    #[inline(always)]
    fn rows_of(&self, term: &Term, nodes: u64) -> [Row; MOST_BINS] {
        let mut rows = [ZERO; MOST_BINS];
        let touched = bits(nodes).enumerate().filter(|(_, bit)| term.touched >> bit & 1 == 1);
        match (term.origin, self.received) {
            (Origin::Bin { bin, position }, _) => {
                let from = self.arenas.rows(bin).unwrap_or(&ZEROS);
                touched.for_each(|(i, bit)| rows[i] = from[arena_node::<D>(position as usize, bit)]);
            }
            (Origin::Piece(piece), Some(received)) => {
                touched.for_each(|(i, bit)| rows[i] = received.row(piece, bit));
            }
            (Origin::Piece(_), None) => {}
        }
        rows
    }

    /// First moments that a contribution adds to a node.
    pub(super) fn moments(&self, origin: Origin, bit: u32) -> Option<Moments<D>> {
        match origin {
            Origin::Bin { bin, position } => {
                let moments = self.arenas.get(bin)?.moments?;
                Some(moments.at(opposite(D, position as usize), bit))
            }
            Origin::Piece(piece) => self.received.map(|received| received.moments(piece, bit)),
        }
    }
}

/// Adds one node's moments.
fn add_moments<const D: usize>(to: &mut Moments<D>, from: &Moments<D>) {
    to.iter_mut().zip(from).for_each(|(to, from)| to.add(from));
}
