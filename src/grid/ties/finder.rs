//! The search for ties.
use rayon::prelude::*;

use super::impulses::{Corner, Tied};
use super::neighbourhood::{Around, Neighbourhood};
use super::plane::{Plane, rings};
use crate::grid::mask::{bits, block_nodes, node_of_bit};
use crate::grid::plan::GridPlan;
use crate::grid::sums::node_fields::NodeFields;

/// Neighbourhoods of the blocks of a plan, and memory of the search.
pub(super) struct Finder<const D: usize> {
    rings: Vec<Vec<[i32; D]>>,
    /// Neighbourhood of each block, found on demand.
    around: Vec<Option<Box<Neighbourhood>>>,
    /// Zero for each node between two uses.
    sums: Vec<f64>,
}

/// The ties of a velocity field in the last step.
#[derive(Default)]
pub(super) struct Memory {
    blocks: Vec<Option<Box<Known>>>,
    /// Blocks with loose nodes.
    loose: Vec<usize>,
    /// All ties.
    pub(super) tied: Tied,
}

impl Memory {
    /// Heap bytes held.
    pub(super) fn heap_bytes(&self) -> usize {
        let known = self.blocks.iter().flatten().map(|known| size_of::<Known>() + known.tied.heap_bytes());
        size_of_val(&self.blocks[..]) + known.sum::<usize>() + self.tied.heap_bytes()
    }
}

/// The ties of a block, and what they follow from.
struct Known {
    /// Well filled cells around.
    filled: Around,
    /// Nodes of the block that touch no well filled cell; all leaves around them have their level.
    untouched: u64,
    /// Those of them that have mass.
    loose: u64,
    /// Nodes around that are free; `None` before ties are sought.
    free: Option<Around>,
    tied: Tied,
}

impl<const D: usize> Finder<D> {
    pub(super) fn new() -> Self {
        Self { rings: rings(), around: Vec::new(), sums: Vec::new() }
    }

    /// Heap bytes held.
    pub(super) fn heap_bytes(&self) -> usize {
        let around = self.around.iter().flatten().count() * size_of::<Neighbourhood>();
        around + size_of_val(&self.around[..]) + size_of_val(&self.sums[..])
    }

    /// Finds the ties of a velocity field, with those of the step before; see [`super::Ties::tie`]. Nodes
    /// between cells on both sides have ties if `spans_gaps`.
    pub(super) fn find(
        &mut self,
        plan: &GridPlan<D>,
        fields: &NodeFields<D>,
        filled: &[u64],
        memory: &mut Memory,
        spans_gaps: bool,
        held: impl Fn(usize, u64) -> u64 + Sync,
    ) {
        self.look_around(plan, fields);
        memory.blocks.resize_with(plan.blocks.len(), || None);
        let blocks = memory.blocks.par_iter_mut().enumerate().with_min_len(64);
        let loose = blocks.filter_map(|(block, known)| {
            let around = self.around[block].as_deref().filter(|_| fields.active[block])?;
            self.loosen(plan, fields, block, around, filled, known).then_some(block)
        });
        let loose: Vec<usize> = loose.collect();
        let mut near = vec![false; plan.blocks.len()];
        let around = loose.iter().filter_map(|block| self.around[*block].as_deref());
        around.flat_map(Neighbourhood::blocks).for_each(|block| near[block] = true);
        let free: Vec<u64> = (0..plan.blocks.len())
            .into_par_iter()
            .with_min_len(64)
            .map(|block| match near[block] && fields.active[block] {
                true => {
                    let moving = fields.with_mass(block, plan.blocks[block].real_nodes(), LEAST_MASS);
                    moving & !held(block, moving)
                }
                false => 0,
            })
            .collect();
        let blocks = memory.blocks.par_iter_mut().enumerate().with_min_len(64);
        let changed = blocks.map(|(block, known)| match (known, self.around[block].as_deref()) {
            (Some(known), Some(around)) if known.loose != 0 => {
                self.tie(block, around, &free, spans_gaps, known)
            }
            _ => false,
        });
        let is_changed = changed.reduce(|| false, |a, b| a | b);
        if is_changed || loose != memory.loose {
            memory.tied.clear();
            for block in &loose {
                memory.blocks[*block].iter().for_each(|known| memory.tied.extend(&known.tied));
            }
            self.sums.resize(fields.rows.len(), 0.0);
            memory.tied.share_out(&mut self.sums);
            memory.loose = loose;
        }
    }

    /// Finds the neighbourhoods of the blocks that hold mass.
    fn look_around(&mut self, plan: &GridPlan<D>, fields: &NodeFields<D>) {
        self.around.resize_with(plan.blocks.len(), || None);
        let all = self.around.par_iter_mut().zip(&fields.active).enumerate().with_min_len(64);
        let new = all.filter(|(_, (around, active))| **active && around.is_none());
        new.for_each(|(block, (around, _))| *around = Some(Box::new(Neighbourhood::of(plan, block))));
    }

    /// Finds the real nodes of a block that have mass and touch no well filled cell. Returns whether there
    /// are any.
    fn loosen(
        &self,
        plan: &GridPlan<D>,
        fields: &NodeFields<D>,
        block: usize,
        around: &Neighbourhood,
        filled: &[u64],
        known: &mut Option<Box<Known>>,
    ) -> bool {
        if around.is_full::<D>(filled) || around.is_empty(filled) {
            known.iter_mut().for_each(|known| known.loose = 0);
            return false;
        }
        let filled = around.words(filled);
        if known.as_ref().is_none_or(|known| known.filled != filled) {
            let is_untouched = |bit: &u32| {
                let node = node_of_bit::<D>(*bit);
                (0..1usize << D).all(|corner| {
                    let cell = std::array::from_fn(|axis| node[axis] as i32 - (corner >> axis & 1) as i32);
                    around.is_filled::<D>(&filled, cell) == Some(false)
                })
            };
            let real = bits(plan.blocks[block].real_nodes());
            let untouched = real.filter(is_untouched).fold(0, |nodes, bit| nodes | 1 << bit);
            let new = Known { filled, untouched, loose: 0, free: None, tied: Tied::default() };
            *known = Some(Box::new(new));
        }
        let Some(known) = known else { return false };
        known.loose = fields.with_mass(block, known.untouched, LEAST_MASS);
        known.loose != 0
    }

    /// Finds the ties of a block, given the free nodes of all blocks near it. Returns whether they may differ
    /// from those that were known.
    fn tie(
        &self,
        block: usize,
        around: &Neighbourhood,
        free: &[u64],
        spans_gaps: bool,
        known: &mut Known,
    ) -> bool {
        let free = around.of_blocks(free);
        if known.free == Some(free) {
            return false;
        }
        known.free = Some(free);
        known.tied.clear();
        let row = |(block, bit): (usize, u32)| block * block_nodes(D) + bit as usize;
        for bit in bits(known.untouched & free[Neighbourhood::centre::<D>()]) {
            let place: [i32; D] = node_of_bit::<D>(bit).map(|k| k as i32);
            let beside = |offset: [i32; D]| -> [i32; D] { std::array::from_fn(|a| place[a] + offset[a]) };
            let is_good = |cell: &&[i32; D]| {
                around.is_filled(&known.filled, beside(**cell)) == Some(true)
                    && (0..1usize << D).all(|corner| {
                        let corner = std::array::from_fn(|a| cell[a] + (corner >> a & 1) as i32);
                        Neighbourhood::has_node(&free, beside(corner))
                    })
            };
            let nearest = self.rings.iter().find_map(|ring| {
                let cells: Vec<[i32; D]> = ring.iter().filter(is_good).copied().collect();
                (!cells.is_empty()).then_some(cells)
            });
            let Some(cells) = nearest.filter(|cells| spans_gaps || !are_on_both_sides(cells)) else {
                continue;
            };
            let plane = Plane::of(&cells);
            let corners = plane.nodes().filter_map(|(offset, weight)| {
                around.node(beside(offset)).map(|node| Corner::new(row(node), weight))
            });
            known.tied.push(row((block, bit)), corners);
        }
        true
    }
}

/// Whether some of these cells, relative to a node, lie beyond it from others along an axis.
fn are_on_both_sides<const D: usize>(cells: &[[i32; D]]) -> bool {
    (0..D).any(|a| cells.iter().any(|cell| cell[a] < -1) && cells.iter().any(|cell| cell[a] > 0))
}

/// Least mass of a node that is tied, kg: the inverse of less may not be finite.
const LEAST_MASS: f64 = 1e-150;
