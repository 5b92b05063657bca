//! Links between constrained nodes and their parents, over which sums are restricted and values prolonged.

use rustc_hash::FxHashMap;

use super::columns::{Columns, axes_in};
use super::constraint::{block_and_bit, node_coord, parents_of};
use super::mask::{bits, block_nodes, offset, offset_index, opposite};
use super::plan::{Block, GridPlan};

/// A link between a constrained node and one of its parents.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Node at the other end (block number × nodes per block + bit).
    pub node: u32,
    /// Place of that node's first column of first moments, if it has any.
    pub moments: u32,
    /// Axes of these columns, a bit each.
    pub axes: u8,
    /// Offset number of parent minus constrained node, in cells of the finer level. The weight follows from it, see
    /// [`weight_of`].
    pub offset: u8,
}

impl Link {
    /// To a node of a block, which has a number.
    fn to<const D: usize>(block: &Block<D>, number: u32, bit: u32, offset: u8) -> Self {
        Self {
            node: number * block_nodes(D) as u32 + bit,
            moments: block.moments + block.columns.first_of(bit) as u32,
            axes: block.columns.axes_of(bit),
            offset,
        }
    }
}

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

/// A parent that a rank has of a constrained node.
struct Found {
    /// The constrained node in its block.
    bit: u32,
    /// Number among the node's parents.
    order: u32,
    /// The parent's block and its place there.
    block: u32,
    parent: u32,
    /// Offset number of parent minus constrained node.
    offset: u8,
}

impl<const D: usize> GridPlan<D> {
    /// Lists the links of all levels and finds which first moments nodes have; `number` numbers the blocks.
    pub(super) fn link_levels(&mut self, number: &FxHashMap<(u8, [u32; D]), u32>) {
        let nodes = block_nodes(D) as u32;
        let levels = self.levels();
        let mut restriction: Vec<Vec<(u32, u32, Link)>> = vec![Vec::new(); levels];
        let mut prolongation = restriction.clone();
        let mut parents = Vec::new();
        for index in 0..self.blocks.len() {
            self.find_columns(index, number, &mut parents);
            let block = &self.blocks[index];
            let level = block.level as usize;
            for &Found { bit, order, block: coarse_block, parent, offset } in &parents {
                let coarse = &self.blocks[coarse_block as usize];
                if block.sum >> bit & 1 == 1 && coarse.sum >> parent & 1 == 1 {
                    // A parent meets its children in lexicographic order of their position.
                    let order = u32::from(opposite(D, offset as usize) as u8);
                    let link = Link::to(block, index as u32, bit, offset);
                    restriction[level - 1].push((coarse_block * nodes + parent, order, link));
                }
                if block.value >> bit & 1 == 1 {
                    let link = Link::to(coarse, coarse_block, parent, offset);
                    prolongation[level].push((index as u32 * nodes + bit, order, link));
                }
            }
        }
        self.restriction = restriction.into_iter().map(|entries| Links::group(entries, nodes)).collect();
        self.prolongation = prolongation.into_iter().map(|entries| Links::group(entries, nodes)).collect();
    }

    /// Finds the parents of the constrained nodes of a block, and of these nodes the columns of first moments: those along
    /// which a parent lies beside the node, and those of its parents. Coarser blocks come before finer ones.
    fn find_columns(
        &mut self,
        index: usize,
        number: &FxHashMap<(u8, [u32; D]), u32>,
        parents: &mut Vec<Found>,
    ) {
        parents.clear();
        let mut columns = Columns::NONE;
        let block = &self.blocks[index];
        for bit in bits((block.sum | block.value) & block.constrained) {
            for (order, parent) in parents_of::<D>(node_coord(block.coord, bit)).enumerate() {
                let offset = offset_index(parent.offset);
                debug_assert_eq!(parent.weight, weight_of(parent.offset));
                columns.insert(bit, beside(parent.offset));
                let (coord, bit_of_parent) = block_and_bit(parent.node);
                let Some(&coarse) = number.get(&(block.level - 1, coord)) else { continue };
                columns.insert(bit, self.blocks[coarse as usize].columns.axes_of(bit_of_parent));
                parents.push(Found {
                    bit,
                    order: order as u32,
                    block: coarse,
                    parent: bit_of_parent,
                    offset: offset as u8,
                });
            }
        }
        let moments = self.columns as u32;
        self.columns += columns.len();
        let block = &mut self.blocks[index];
        (block.columns, block.moments) = (columns, moments);
    }

    /// Second moments of the constraints, `S_j = Σ c (S_i + (x_i - x_j)²)` with `S = 0` on real nodes, along the axis of each
    /// column of first moments; along others they are zero.
    pub(super) fn constraint_spread(&self) -> Vec<f64> {
        let nodes = block_nodes(D);
        let mut spread = vec![0.0; self.columns];
        for level in 1..self.levels() {
            let cell_squared = self.cell(level as u8).powi(2);
            let links = &self.prolongation[level];
            for (i, &node) in links.nodes.iter().enumerate() {
                let block = &self.blocks[node as usize / nodes];
                let bit = node % nodes as u32;
                let mut sum = [0.0; D];
                for link in links.of(i) {
                    let delta = offset::<D>(link.offset as usize);
                    let weight = weight_of(delta);
                    let mut place = link.moments as usize;
                    for axis in 0..D {
                        sum[axis] += weight * f64::from(delta[axis] * delta[axis]) * cell_squared;
                        if link.axes >> axis & 1 == 1 {
                            sum[axis] += weight * spread[place];
                            place += 1;
                        }
                    }
                }
                let first = block.moments as usize + block.columns.first_of(bit);
                let axes = axes_in::<D>(block.columns.axes_of(bit));
                axes.zip(first..).for_each(|(axis, place)| spread[place] = sum[axis]);
            }
        }
        spread
    }
}

/// Axes along which an offset leads elsewhere, a bit each.
fn beside<const D: usize>(offset: [i32; D]) -> u8 {
    (0..D).fold(0, |axes, axis| axes | u8::from(offset[axis] != 0) << axis)
}
