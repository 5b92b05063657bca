//! Volumes of the basis functions of real nodes, `∫N_j`.
//!
//! Each cell of a leaf gives each of its corners the share `1/2^D` of its volume, and constrained nodes hand
//! theirs to their parents. Away from level jumps and faces of the domain that makes the volume of a cell.
//! Those of rings have the circumference at the mean radius of the share, and are known node by node.
use super::node_fields::NodeFields;
use crate::grid::mask::{block_nodes, node_of_bit};
use crate::grid::plan::ghost_layer::Cover;
use crate::grid::plan::{Block, GridPlan};
use crate::kernel::{BLOCK, Coordinates, Row};

/// The volumes of all real nodes of a plan.
#[derive(Clone, Debug, Default)]
pub struct NodeVolumes {
    /// By block the number of its values among those of other blocks, or [`SAME`].
    number: Vec<u32>,
    /// Values of blocks near level jumps and faces of the domain, node by node.
    values: Vec<f64>,
}

/// All nodes have the volume of a cell.
const SAME: u32 = u32::MAX;

/// Volumes of the nodes of one block, m³ (in plane strain m²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OfBlock<'a> {
    /// The same for all.
    Same(f64),
    /// Node by node; defined at real nodes.
    Each(&'a [f64]),
}

impl NodeVolumes {
    /// Not collective. For a plan.
    pub fn new<const D: usize>(plan: &GridPlan<D>, coordinates: Coordinates) -> Self {
        let nodes = block_nodes(D);
        // Only rows of blocks that are not regular take memory.
        let mut fields = NodeFields::new(plan);
        let mut number = vec![SAME; plan.blocks.len()];
        let mut irregular = Vec::new();
        for (index, block) in plan.blocks.iter().enumerate() {
            let is_leaf = leaves_around(plan, block);
            if coordinates == Coordinates::Cartesian && is_leaf & all_around(D) == all_around(D) {
                continue;
            }
            let share = cell_volume(plan, block) / f64::from(1u32 << D);
            let rows = &mut fields.rows[index * nodes..][..nodes];
            for (bit, row) in rows.iter_mut().enumerate() {
                let cells = cells_at::<D>(is_leaf, bit as u32);
                let cells = match coordinates {
                    Coordinates::Cartesian => f64::from(cells.count_ones()),
                    Coordinates::Axisymmetric => around_cells(plan, block, bit as u32, cells, coordinates),
                };
                *row = Row([0.0, 0.0, 0.0, share * cells]);
            }
            fields.active[index] = true;
            number[index] = irregular.len() as u32;
            irregular.push(index);
        }
        fields.restrict(plan);
        let rows = irregular.iter().flat_map(|index| &fields.rows[index * nodes..][..nodes]);
        Self { number, values: rows.map(|row| row.0[3]).collect() }
    }

    /// Those of a block.
    pub fn of_block<const D: usize>(&self, plan: &GridPlan<D>, block: usize) -> OfBlock<'_> {
        let nodes = block_nodes(D);
        match self.number[block] {
            SAME => OfBlock::Same(cell_volume(plan, &plan.blocks[block])),
            number => OfBlock::Each(&self.values[number as usize * nodes..][..nodes]),
        }
    }
}

/// Volume of a cell of a block's level.
fn cell_volume<const D: usize>(plan: &GridPlan<D>, block: &Block<D>) -> f64 {
    plan.cell(block.level).powi(D as i32)
}

/// One bit for each of the blocks of cells around the lower corner of a block.
const fn all_around(d: usize) -> u32 {
    (1 << (1 << d)) - 1
}

/// Which of the blocks of cells around the lower corner of a block are leaves of its level: bit `Σ 2^k` over
/// the axes k along which it lies below.
fn leaves_around<const D: usize>(plan: &GridPlan<D>, block: &Block<D>) -> u32 {
    let tree = &plan.tree;
    let is_leaf = |below: &u32| {
        let at = |axis: usize| block.coord[axis].checked_sub(below >> axis & 1);
        let coord = std::array::from_fn(|axis| at(axis).unwrap_or(u32::MAX));
        let is_inside = (0..D).all(|axis| at(axis).is_some()) && tree.contains(block.level, coord);
        is_inside
            && match tree.cover(block.level, coord) {
                Cover::Leaf(leaf) => tree.leaves()[leaf].level == block.level,
                _ => false,
            }
    };
    (0..1 << D).filter(is_leaf).fold(0, |bits, below| bits | 1 << below)
}

/// Which of the cells around a node of a block lie in these of [`leaves_around`]: bit `Σ 2^k` over the axes k
/// along which a cell lies below.
fn cells_at<const D: usize>(is_leaf: u32, bit: u32) -> u32 {
    let node = node_of_bit::<D>(bit);
    let is_there = |cell: &u32| {
        let below = (0..D).filter(|&k| cell >> k & 1 == 1 && node[k] == 0).fold(0, |below, k| below | 1 << k);
        is_leaf >> below & 1 == 1
    };
    (0..1u32 << D).filter(is_there).fold(0, |cells, cell| cells | 1 << cell)
}

/// Circumferences (m) of the shares of a node in these cells of [`cells_at`], added up: a hat has its mean
/// radius in a cell a third of the cell's edge from the node.
fn around_cells<const D: usize>(
    plan: &GridPlan<D>,
    block: &Block<D>,
    bit: u32,
    cells: u32,
    coordinates: Coordinates,
) -> f64 {
    let along = f64::from(block.coord[0]) * BLOCK as f64 + f64::from(node_of_bit::<D>(bit)[0]);
    let circumference = |cell: u32| {
        let to_mean = if cell & 1 == 1 { -1.0 / 3.0 } else { 1.0 / 3.0 };
        coordinates.around((along + to_mean) * plan.cell(block.level))
    };
    (0..1u32 << D).filter(|cell| cells >> cell & 1 == 1).map(circumference).sum()
}
