//! Surface nodes tied: nodes of no well filled cell move with the material beside them.
//!
//! A node that only the edges of a few boxes reach has little mass and a force that does not shrink with it.
//! Left free, it moves until it relieves the stress of these boxes. Such a node j is tied: its velocity is
//! that of the plane through the corners r of the nearest well filled cells, `v_j = Σ P_r v_r` (aggregation;
//! Coombs, Bird and Pretti 2025). Each tie is a constraint that acts by an impulse J on the node and by
//! `-P_r J` on the corners. As P reproduces affine fields, J changes neither momentum nor angular momentum,
//! and it is zero in affine motion. All impulses together are sought by sweeps of Jacobi's method,
//! ```text
//! J_j = (Σ P_r v_r - v_j) / (1/m_j + Σ |P_r| S_r / m_r),   S_r = Σ |P_r| over all ties of r
//! ```
//! whose denominators are row sums of the matrix of compliances, so that no sweep adds kinetic energy,
//! whatever the masses are. A light node, for which ties matter, has its velocity after the first sweep.
//!
//! | file | what it holds |
//! |---|---|
//! | `leaf_words` | which cells are well filled, from rank to rank |
//! | `neighbourhood` | cells and nodes around a block |
//! | `plane` | the plane through the corners of cells |
mod leaf_words;
mod neighbourhood;
mod plane;

use partition::comm::{Comm, Traffic};
use rayon::prelude::*;

use self::leaf_words::LeafWords;
use self::neighbourhood::Neighbourhood;
use self::plane::{Plane, rings};
use super::mask::{bits, block_nodes, node_of_bit};
use super::plan::GridPlan;
use super::sums::node_fields::NodeFields;

/// Sweeps over all ties in a step.
const SWEEPS: usize = 1;

/// Blocks around those of its bins, counted along each axis, in which a rank needs all nodes to compute the
/// effect of ties on its own nodes without messages: a corner gets impulses that depend on all ties of the
/// corners of its ties, and these on the cells beside their nodes, four times the reach of a tie away.
pub const HALO: u32 = 3;

/// Ties of one plan and, of the last step, which cells are well filled.
pub struct Ties<const D: usize> {
    words: LeafWords,
    finder: Finder<D>,
}

/// Input and memory of the search for ties.
struct Finder<const D: usize> {
    rings: Vec<Vec<[i32; D]>>,
    /// Neighbourhood of each block, found on demand.
    around: Vec<Option<Box<Neighbourhood>>>,
    /// Nodes of each block on faces of the domain.
    on_faces: Vec<u64>,
    /// Well filled cells of each known leaf.
    filled: Vec<u64>,
    /// Sum of weights at each node; zero between two uses.
    shares: Vec<f64>,
}

/// A node that is tied.
#[derive(Clone, Copy, Debug)]
struct Tie {
    node: usize,
    /// First of its corners.
    first: usize,
}

/// The ties of a velocity field in a step.
#[derive(Debug, Default)]
struct Tied {
    /// Block by block.
    nodes: Vec<Tie>,
    /// Corners and their weights, tie by tie.
    corners: Vec<(usize, f64)>,
}

impl Tied {
    /// The ties with their corners.
    fn iter(&self) -> impl IndexedParallelIterator<Item = (usize, &[(usize, f64)])> {
        (0..self.nodes.len()).into_par_iter().with_min_len(256).map(|number| self.get(number))
    }

    fn get(&self, number: usize) -> (usize, &[(usize, f64)]) {
        let Tie { node, first } = self.nodes[number];
        let end = self.nodes.get(number + 1).map_or(self.corners.len(), |next| next.first);
        (node, &self.corners[first..end])
    }
}

impl<const D: usize> Ties<D> {
    /// Collective. For a plan that has a [`HALO`].
    pub fn new(comm: &Comm, plan: &GridPlan<D>) -> Self {
        let mut on_faces = vec![0; plan.blocks.len()];
        let nodes = block_nodes(D);
        plan.face_nodes
            .iter()
            .for_each(|&(node, _)| on_faces[node as usize / nodes] |= 1 << (node as usize % nodes));
        let finder =
            Finder { rings: rings(), around: Vec::new(), on_faces, filled: Vec::new(), shares: Vec::new() };
        Self { words: LeafWords::new(comm, &plan.tree), finder }
    }

    /// Messages and bytes so far.
    pub fn traffic(&self) -> Traffic {
        self.words.traffic()
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        let Finder { around, filled, shares, .. } = &self.finder;
        let around = around.iter().flatten().count() * size_of::<Neighbourhood>();
        around + size_of_val(&filled[..]) + size_of_val(&shares[..])
    }

    /// Collective over neighbours. Takes the well filled cells of each own leaf, a bit each.
    pub fn fill(&mut self, plan: &GridPlan<D>, own: &[u64]) {
        self.words.share(&plan.tree, own, &mut self.finder.filled);
    }

    /// Not collective. Ties the nodes of a velocity field, whose rows hold velocities and masses. `held`
    /// returns those of some nodes of a block that are fixed by other conditions; these are not tied, nor is
    /// anything tied to them.
    pub fn tie(
        &mut self,
        plan: &GridPlan<D>,
        fields: &mut NodeFields<D>,
        held: impl Fn(usize, u64) -> u64 + Sync,
    ) {
        self.finder.tie(plan, fields, held);
    }
}

impl<const D: usize> Finder<D> {
    /// See [`Ties::tie`].
    fn tie(
        &mut self,
        plan: &GridPlan<D>,
        fields: &mut NodeFields<D>,
        held: impl Fn(usize, u64) -> u64 + Sync,
    ) {
        self.look_around(plan, fields);
        let loose = self.loose(plan, fields);
        if loose.is_empty() {
            return;
        }
        let mut near = vec![false; plan.blocks.len()];
        let around = loose.iter().filter_map(|(block, _)| self.around[*block].as_deref());
        around.flat_map(Neighbourhood::blocks).for_each(|block| near[block] = true);
        let all_held: Vec<u64> = (0..plan.blocks.len())
            .into_par_iter()
            .with_min_len(64)
            .map(|block| match near[block] && fields.active[block] {
                true => {
                    let moving = with_mass(fields, block, plan.blocks[block].real_nodes());
                    self.on_faces[block] | held(block, moving)
                }
                false => 0,
            })
            .collect();
        let tied = self.find(plan, fields, &loose, &all_held);
        self.pull(fields, &tied);
    }

    /// Finds the neighbourhoods of the blocks that hold mass.
    fn look_around(&mut self, plan: &GridPlan<D>, fields: &NodeFields<D>) {
        self.around.resize_with(plan.blocks.len(), || None);
        let all = self.around.par_iter_mut().zip(&fields.active).enumerate().with_min_len(64);
        let new = all.filter(|(_, (around, active))| **active && around.is_none());
        new.for_each(|(block, (around, _))| *around = Some(Box::new(Neighbourhood::of(plan, block))));
    }

    /// Blocks with real nodes that have mass and touch no well filled cell, and these nodes. All leaves
    /// around them have their level.
    fn loose(&self, plan: &GridPlan<D>, fields: &NodeFields<D>) -> Vec<(usize, u64)> {
        let blocks = self.around.par_iter().zip(&fields.active).enumerate().with_min_len(64);
        let loose = blocks.filter_map(|(block, (around, active))| {
            let around = around.as_deref().filter(|_| *active)?;
            if around.is_full::<D>(&self.filled) || around.is_empty(&self.filled) {
                return None;
            }
            let is_loose = |bit: &u32| {
                let node = node_of_bit::<D>(*bit);
                (0..1usize << D).all(|corner| {
                    let cell = std::array::from_fn(|axis| node[axis] as i32 - (corner >> axis & 1) as i32);
                    around.is_filled::<D>(&self.filled, cell) == Some(false)
                })
            };
            let real = plan.blocks[block].real_nodes();
            let nodes = bits(real).filter(is_loose).fold(0, |nodes, bit| nodes | 1 << bit);
            let nodes = with_mass(fields, block, nodes);
            (nodes != 0).then_some((block, nodes))
        });
        loose.collect()
    }

    /// The ties of loose nodes that are not fixed.
    fn find(&self, plan: &GridPlan<D>, fields: &NodeFields<D>, loose: &[(usize, u64)], held: &[u64]) -> Tied {
        let blocks = loose.par_iter().with_min_len(8).map(|&(block, nodes)| {
            let mut tied = Tied::default();
            let Some(around) = self.around[block].as_deref() else { return tied };
            for bit in bits(nodes & !held[block]) {
                let place: [i32; D] = node_of_bit::<D>(bit).map(|k| k as i32);
                let beside = |offset: [i32; D]| -> [i32; D] { std::array::from_fn(|a| place[a] + offset[a]) };
                let node = |offset: [i32; D]| around.node(beside(offset));
                let is_free = |cell: [i32; D]| {
                    (0..1usize << D).all(|corner| {
                        let corner = std::array::from_fn(|a| cell[a] + (corner >> a & 1) as i32);
                        node(corner).is_some_and(|(block, bit)| {
                            let row = &fields.rows[block * block_nodes(D) + bit as usize];
                            plan.blocks[block].real_nodes() & !held[block] & 1 << bit != 0
                                && row.0[3] > LEAST_MASS
                        })
                    })
                };
                let is_good = |cell: &&[i32; D]| {
                    around.is_filled(&self.filled, beside(**cell)) == Some(true) && is_free(**cell)
                };
                let nearest = self.rings.iter().find_map(|ring| {
                    let cells: Vec<[i32; D]> = ring.iter().filter(is_good).copied().collect();
                    (!cells.is_empty()).then_some(cells)
                });
                let Some(cells) = nearest else { continue };
                let first = tied.corners.len();
                tied.nodes.push(Tie { node: block * block_nodes(D) + bit as usize, first });
                for (offset, weight) in Plane::of(&cells).nodes() {
                    if let Some((block, bit)) = node(offset) {
                        tied.corners.push((block * block_nodes(D) + bit as usize, weight));
                    }
                }
            }
            tied
        });
        let mut all = Tied::default();
        for block in blocks.collect::<Vec<_>>() {
            let before = all.corners.len();
            all.nodes.extend(block.nodes.iter().map(|tie| Tie { first: before + tie.first, ..*tie }));
            all.corners.extend(block.corners);
        }
        all
    }

    /// Applies the impulses of ties to nodes.
    fn pull(&mut self, fields: &mut NodeFields<D>, tied: &Tied) {
        self.shares.resize(fields.rows.len(), 0.0);
        tied.corners.iter().for_each(|&(corner, weight)| self.shares[corner] += weight.abs());
        let (rows, shares) = (&mut fields.rows, &self.shares);
        let inertias: Vec<f64> = tied
            .iter()
            .map(|(node, corners)| {
                let own = 1.0 / rows[node].0[3];
                let compliance = corners.iter().fold(own, |sum, &(corner, weight)| {
                    (weight.abs() * shares[corner] / rows[corner].0[3]) + sum
                });
                1.0 / compliance
            })
            .collect();
        for _ in 0..SWEEPS {
            let impulses: Vec<[f64; D]> = tied
                .iter()
                .zip(&inertias)
                .map(|((node, corners), inertia)| {
                    std::array::from_fn(|a| {
                        let plane =
                            corners.iter().fold(0.0, |sum, &(corner, w)| w.mul_add(rows[corner].0[a], sum));
                        inertia * (plane - rows[node].0[a])
                    })
                })
                .collect();
            // In the order of the ties, which is that of their places, on any ranks.
            for (number, impulse) in impulses.iter().enumerate() {
                let (node, corners) = tied.get(number);
                push(&mut rows[node].0, impulse, 1.0);
                corners.iter().for_each(|&(corner, weight)| push(&mut rows[corner].0, impulse, -weight));
            }
        }
        tied.corners.iter().for_each(|&(corner, _)| self.shares[corner] = 0.0);
    }
}

/// Changes the velocity of a node, `(v, m)`, by a share of an impulse.
#[inline(always)]
fn push<const D: usize>(row: &mut [f64; 4], impulse: &[f64; D], share: f64) {
    let factor = share / row[3];
    for axis in 0..D {
        row[axis] = factor.mul_add(impulse[axis], row[axis]);
    }
}

/// Least mass of a node that is tied, kg: the inverse of less may not be finite.
const LEAST_MASS: f64 = 1e-150;

/// Nodes among those given of a block that have mass.
fn with_mass<const D: usize>(fields: &NodeFields<D>, block: usize, nodes: u64) -> u64 {
    let rows = &fields.rows[block * block_nodes(D)..][..block_nodes(D)];
    bits(nodes).filter(|&bit| rows[bit as usize].0[3] > LEAST_MASS).fold(0, |nodes, bit| nodes | 1 << bit)
}
