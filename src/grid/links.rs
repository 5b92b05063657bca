//! Links between constrained nodes and their parents, over which sums are restricted and values prolonged.

use rustc_hash::FxHashMap;

use super::constraint::{block_and_bit, node_coord, parents_of};
use super::mask::{bits, block_nodes, offset, offset_index, opposite};
use super::plan::GridPlan;
use crate::kernel::Row;

/// A link between a constrained node and one of its parents.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Node at the other end (block number × nodes per block + bit).
    pub node: u32,
    /// Place of that node's first moments, of a constrained one; [`NO_MOMENTS`] for real ones.
    pub moments: u32,
    /// Offset number of parent minus constrained node, in cells of the finer level. The weight follows from it, see
    /// [`weight_of`].
    pub offset: u8,
}

/// No first moments.
pub const NO_MOMENTS: u32 = u32::MAX;

/// Weight of a parent at an offset from the constrained node: one half for each axis along which they differ.
pub fn weight_of<const D: usize>(offset: [i32; D]) -> f64 {
    offset.iter().filter(|along| **along != 0).fold(1.0, |weight, _| 0.5 * weight)
}

/// The nodes of one block that gather over links.
#[derive(Clone, Debug)]
pub struct LinkedBlock {
    /// The block.
    pub block: u32,
    /// Its nodes, as numbers of [`Links::nodes`].
    pub nodes: std::ops::Range<u32>,
    /// The blocks at the other ends, as numbers of [`Links::others`].
    pub others: std::ops::Range<u32>,
}

/// Links of a list of nodes: `links[start[i]..start[i + 1]]` belong to `nodes[i]`. Nodes ascend.
#[derive(Clone, Debug, Default)]
pub struct Links {
    /// The nodes by block.
    pub blocks: Vec<LinkedBlock>,
    /// Blocks at the other ends of the links, block by block.
    pub others: Vec<u32>,
    /// The nodes that gather.
    pub nodes: Vec<u32>,
    /// Start of each node's links.
    pub start: Vec<u32>,
    /// The links.
    pub links: Vec<Link>,
}

impl Links {
    /// Groups `(node, order, link)` by node; `order` fixes the order of a node's links.
    pub(super) fn group(mut entries: Vec<(u32, u32, Link)>, block_nodes: u32) -> Self {
        entries.sort_unstable_by_key(|&(node, order, _)| (node, order));
        let mut grouped = Self::default();
        for of_block in entries.chunk_by(|a, b| a.0 / block_nodes == b.0 / block_nodes) {
            let (first, first_other) = (grouped.nodes.len() as u32, grouped.others.len() as u32);
            let mut others: Vec<u32> = of_block.iter().map(|entry| entry.2.node / block_nodes).collect();
            others.sort_unstable();
            others.dedup();
            grouped.others.extend(others);
            grouped.add(of_block);
            grouped.blocks.push(LinkedBlock {
                block: of_block[0].0 / block_nodes,
                nodes: first..grouped.nodes.len() as u32,
                others: first_other..grouped.others.len() as u32,
            });
        }
        grouped.start.push(grouped.links.len() as u32);
        grouped
    }

    fn add(&mut self, entries: &[(u32, u32, Link)]) {
        for &(node, _, link) in entries {
            if self.nodes.last() != Some(&node) {
                self.nodes.push(node);
                self.start.push(self.links.len() as u32);
            }
            self.links.push(link);
        }
    }

    /// Blocks at the other ends of a block's links.
    pub fn others(&self, linked: &LinkedBlock) -> &[u32] {
        &self.others[linked.others.start as usize..linked.others.end as usize]
    }

    /// Links of the `i`-th node.
    pub fn of(&self, i: usize) -> &[Link] {
        &self.links[self.start[i] as usize..self.start[i + 1] as usize]
    }
}

impl<const D: usize> GridPlan<D> {
    /// Lists the links of all levels; `number` numbers the blocks.
    pub(super) fn link_levels(&mut self, number: &FxHashMap<(u8, [u32; D]), u32>) {
        let nodes = block_nodes(D) as u32;
        let levels = self.levels();
        let mut restriction: Vec<Vec<(u32, u32, Link)>> = vec![Vec::new(); levels];
        let mut prolongation = restriction.clone();
        for (index, block) in self.blocks.iter().enumerate() {
            let level = block.level as usize;
            for bit in bits((block.sum | block.value) & block.constrained) {
                let fine = index as u32 * nodes + bit;
                for (order, parent) in parents_of::<D>(node_coord(block.coord, bit)).enumerate() {
                    let (coord, parent_bit) = block_and_bit(parent.node);
                    let Some(&coarse_block) = number.get(&(block.level - 1, coord)) else { continue };
                    let coarse = coarse_block * nodes + parent_bit;
                    let offset = offset_index(parent.offset) as u8;
                    debug_assert_eq!(parent.weight, weight_of(parent.offset));
                    if block.sum >> bit & 1 == 1
                        && self.blocks[coarse_block as usize].sum >> parent_bit & 1 == 1
                    {
                        // A parent meets its children in lexicographic order of their position.
                        let order = u32::from(opposite(D, offset as usize) as u8);
                        let moments = self.moment_node(fine).map_or(NO_MOMENTS, |place| place as u32);
                        let link = Link { node: fine, moments, offset };
                        restriction[level - 1].push((coarse, order, link));
                    }
                    if block.value >> bit & 1 == 1 {
                        let is_real = self.blocks[coarse_block as usize].constrained >> parent_bit & 1 == 0;
                        let place = self.moment_node(coarse).filter(|_| !is_real);
                        let moments = place.map_or(NO_MOMENTS, |place| place as u32);
                        let link = Link { node: coarse, moments, offset };
                        prolongation[level].push((fine, order as u32, link));
                    }
                }
            }
        }
        self.restriction = restriction.into_iter().map(|entries| Links::group(entries, nodes)).collect();
        self.prolongation = prolongation.into_iter().map(|entries| Links::group(entries, nodes)).collect();
    }

    /// Second moments of the constraints, `S_j = Σ c (S_i + (x_i - x_j)²)` with `S = 0` on real nodes.
    pub(super) fn constraint_spread(&self) -> Vec<Row> {
        let nodes = block_nodes(D);
        let mut spread = vec![Row([0.0; 4]); self.moment_blocks * nodes];
        for level in 1..self.levels() {
            let cell_squared = self.cell(level as u8).powi(2);
            let links = &self.prolongation[level];
            for (i, &node) in links.nodes.iter().enumerate() {
                let mut sum = [0.0; 4];
                for link in links.of(i) {
                    let parent = self.moment_node(link.node).map_or([0.0; 4], |slot| spread[slot].0);
                    let delta = offset::<D>(link.offset as usize);
                    let weight = weight_of(delta);
                    for axis in 0..D {
                        let squared = f64::from(delta[axis] * delta[axis]) * cell_squared;
                        sum[axis] += weight * (parent[axis] + squared);
                    }
                }
                if let Some(slot) = self.moment_node(node) {
                    spread[slot] = Row(sum);
                }
            }
        }
        spread
    }
}
