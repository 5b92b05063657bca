//! Heads at the nodes of the ground: conjugate gradients, the free surface, and where water leaves.
//!
//! The heads h solve `Σ g (h_i - h_j) = 0` at each node where no head is held, over the edges of the cells
//! around it, g being what these conduct. Three conditions depend on the solution and are found in rounds:
//! - a cell conducts by its share below the free surface, where the pressure is 0;
//! - at nodes that are open to the air, water leaves with the pressure 0 where it would have more;
//! - and enters nowhere there.
//!
//! Products of vectors are exact sums over the nodes of all ranks, so no bit depends on ranks and threads.
use partition::comm::Comm;

use super::ground::{Ground, first_node, to_corner};
use super::nodes::Nodes;
use crate::exact_sum::ExactSum;
use crate::grid::mask::{bits, block_nodes};
use crate::grid::sums::volumes::{NodeVolumes, OfBlock};
use crate::kernel::Coordinates;
use crate::load::{Seepage, Up};

/// Rounds until the free surface counts as not found.
const ROUNDS: usize = 300;
/// Rounds from which on nodes where water leaves stay so.
const DECIDED: usize = 150;
/// Accuracy of the free surface, in cells.
const SURFACE: f64 = 1e-3;
/// Greatest correction, in cells, at which heads are accepted: in the rounds, and at the end.
const CORRECTIONS: [f64; 2] = [1e-5, 1e-11];
/// Most steps of conjugate gradients for one solution.
const STEPS: usize = 20_000;

/// Condition at a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum At {
    /// In the ground.
    Inside,
    /// A head is held, by its number.
    Held(usize),
    /// Open to the air, and water leaves there or not.
    Open(bool),
}

/// Where heads are found: the real nodes of the ground that this rank needs.
pub(super) struct Heads {
    /// The nodes.
    pub(super) nodes: Vec<u32>,
    /// Their heads, m.
    pub(super) values: Vec<f64>,
    /// Whether this rank counts them.
    owned: Vec<bool>,
    /// Their heights, m along the vertical in the coordinates of the job.
    heights: Vec<f64>,
    at: Vec<At>,
    up: Up,
    /// Edge of the finest cells, m.
    cell: f64,
}

/// Place and time of the heads that are held.
pub(super) struct Held<'a, const D: usize> {
    pub(super) seepage: &'a Seepage<D>,
    pub(super) origin: &'a [f64; D],
    /// Their own time, s.
    pub(super) time: f64,
    pub(super) up: Up,
}

impl Heads {
    /// Collective. The nodes of some ground with their conditions; the greatest held head is the head of all
    /// others. `is_covered` says where the ground is not open to the air.
    pub(super) fn new<const D: usize>(
        nodes: &mut Nodes<'_, D>,
        ground: &Ground<D>,
        held: &Held<'_, D>,
        is_covered: impl Fn(&[f64; D]) -> bool,
    ) -> Self {
        let (plan, volumes) = (nodes.plan, NodeVolumes::new(nodes.plan, Coordinates::Cartesian));
        let (extent, axis) = (plan.extent(), held.up.axis);
        let finest = plan.tree.own_leaves().map(|leaf| plan.tree.leaves()[leaf].level).max().unwrap_or(0);
        let cell = nodes.comm.min_f64(plan.cell(finest));
        // The volume of the cells with ground at each node; of rings that of their sections, which says as
        // well whether it is all.
        let rows = nodes.sum(ground, |leaf, rows| {
            let share = (0.5 * leaf.cell).powi(D as i32);
            for cell in leaf.cells() {
                let first = first_node::<D>(cell);
                (0..1usize << D).for_each(|corner| rows[first + to_corner::<D>(corner)].0[0] += share);
            }
        });
        let mut heads = Self {
            nodes: Vec::new(),
            values: Vec::new(),
            owned: Vec::new(),
            heights: Vec::new(),
            at: Vec::new(),
            up: held.up,
            cell,
        };
        let mut greatest = f64::NEG_INFINITY;
        for (index, block) in plan.blocks.iter().enumerate() {
            let whole = volumes.of_block(plan, index);
            for bit in bits(block.real_nodes()) {
                let node = index * block_nodes(D) + bit as usize;
                let filled = rows[node].0[0];
                if filled <= 0.0 {
                    continue;
                }
                let whole = match whole {
                    OfBlock::Same(volume) => volume,
                    OfBlock::Each(volumes) => volumes[bit as usize],
                };
                let x = plan.node_place(block, bit as usize);
                let height = held.origin[axis] + x[axis];
                let slack = 1e-9 * cell;
                let is_open = filled < (1.0 - 1e-9) * whole && !is_covered(&x);
                let mut all = held.seepage.heads.iter().enumerate();
                let holding = all
                    .find(|(_, head)| head.is_at(&x, &extent, slack))
                    .map(|(number, head)| (number, head.level_at(held.origin, &x, held.time)));
                let (at, value) = match holding {
                    Some((number, level)) if (level - height) * held.up.sign >= -slack => {
                        (At::Held(number), level)
                    }
                    Some(_) => (At::Open(false), f64::NAN),
                    None if is_open => (At::Open(false), f64::NAN),
                    None => (At::Inside, f64::NAN),
                };
                if matches!(at, At::Held(_)) {
                    greatest = greatest.max(held.up.sign * value);
                }
                heads.nodes.push(node as u32);
                heads.values.push(value);
                heads.owned.push(block.owned >> bit & 1 == 1);
                heads.heights.push(height);
                heads.at.push(at);
            }
        }
        let greatest = held.up.sign * nodes.comm.max_f64(greatest);
        heads.values.iter_mut().filter(|value| value.is_nan()).for_each(|value| *value = greatest);
        heads
    }

    /// Collective. Number of nodes where each of some heads is held.
    pub(super) fn held(&self, comm: &Comm, heads: usize) -> Vec<u64> {
        let mut counts = vec![0; heads];
        for (at, _) in self.at.iter().zip(&self.owned).filter(|(_, owned)| **owned) {
            if let At::Held(number) = at {
                counts[*number] += 1;
            }
        }
        comm.sum_u64(&mut counts);
        counts
    }

    /// Collective. Finds heads and free surface. Returns whether they have been found.
    pub(super) fn find<const D: usize>(&mut self, nodes: &mut Nodes<'_, D>, ground: &mut Ground<D>) -> bool {
        let mut is_found = false;
        for round in 0..ROUNDS {
            let before = self.values.clone();
            let is_solved = self.solve(nodes, ground, CORRECTIONS[0]);
            let has_changed = self.open_and_close(nodes, ground, round >= DECIDED);
            let moves = self.values.iter().zip(&before).map(|(now, before)| (now - before).abs());
            let moved = nodes.comm.max_f64(moves.fold(0.0, f64::max));
            is_found = is_solved && !nodes.comm.any(has_changed) && moved <= SURFACE * self.cell;
            if is_found || !moved.is_finite() {
                break;
            }
            nodes.set(&self.nodes, &self.pressures());
            nodes.for_each_leaf(ground, |leaf, rows| {
                leaf.follow_surface(self.up.axis, |node| rows[node].0[0])
            });
        }
        self.solve(nodes, ground, CORRECTIONS[1]) && is_found
    }

    /// Pressure heads, m.
    fn pressures(&self) -> Vec<f64> {
        let values = self.values.iter().zip(&self.heights);
        values.map(|(head, height)| (head - height) * self.up.sign).collect()
    }

    /// Whether the head of a node is given.
    fn is_given(&self, number: usize) -> bool {
        matches!(self.at[number], At::Held(_) | At::Open(true))
    }

    /// Collective. Lets water leave at open nodes with more pressure than the air, and closes those where it
    /// would enter, unless they are decided. Returns whether any of this rank has changed.
    fn open_and_close<const D: usize>(
        &mut self,
        nodes: &mut Nodes<'_, D>,
        ground: &Ground<D>,
        is_decided: bool,
    ) -> bool {
        let flows = nodes.flows(ground, &self.nodes, &self.values);
        let mut has_changed = false;
        for (number, flow) in flows.iter().enumerate() {
            let pressure = (self.values[number] - self.heights[number]) * self.up.sign;
            match self.at[number] {
                At::Open(false) if pressure > 1e-6 * self.cell => {
                    self.at[number] = At::Open(true);
                    self.values[number] = self.heights[number];
                    has_changed = true;
                }
                At::Open(true) if flow * self.up.sign > 0.0 && !is_decided => {
                    self.at[number] = At::Open(false);
                    has_changed = true;
                }
                _ => {}
            }
        }
        has_changed
    }

    /// Collective. Flow into the ground where each head is held, and last through its open surface, m³/s: the
    /// part of this rank.
    pub(super) fn inflows<const D: usize>(
        &self,
        nodes: &mut Nodes<'_, D>,
        ground: &Ground<D>,
        heads: usize,
    ) -> Vec<ExactSum> {
        let mut sums = vec![ExactSum::new(); heads + 1];
        let flows = nodes.flows(ground, &self.nodes, &self.values);
        for (number, flow) in flows.iter().enumerate().filter(|(number, _)| self.owned[*number]) {
            match self.at[number] {
                At::Held(head) => sums[head].add(self.up.sign * flow),
                At::Open(true) => sums[heads].add(self.up.sign * flow),
                At::Open(false) | At::Inside => {}
            }
        }
        sums
    }

    /// Collective. Conjugate gradients, with what each node conducts as preconditioner, until no correction
    /// is greater than so many cells. Returns whether that is reached.
    fn solve<const D: usize>(
        &mut self,
        nodes: &mut Nodes<'_, D>,
        ground: &Ground<D>,
        correction: f64,
    ) -> bool {
        let greatest = self.values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let bound = (correction * self.cell).max(64.0 * f64::EPSILON * nodes.comm.max_f64(greatest));
        let rows = nodes.sum(ground, |leaf, rows| {
            leaf.for_each_edge(|low, high, conducts| {
                rows[low].0[0] += conducts;
                rows[high].0[0] += conducts;
            });
        });
        let conducts: Vec<f64> = self.nodes.iter().map(|&node| rows[node as usize].0[0]).collect();
        let free: Vec<bool> = (0..self.nodes.len()).map(|number| !self.is_given(number)).collect();
        let masked = |flows: Vec<f64>| -> Vec<f64> {
            flows.into_iter().zip(&free).map(|(flow, free)| if *free { flow } else { 0.0 }).collect()
        };
        let mut rest = masked(nodes.flows(ground, &self.nodes, &self.values));
        rest.iter_mut().for_each(|flow| *flow = -*flow);
        let corrections =
            |rest: &[f64]| -> Vec<f64> { rest.iter().zip(&conducts).map(|(rest, g)| rest / g).collect() };
        let mut towards = corrections(&rest);
        let mut way = towards.clone();
        let mut product = self.product(nodes.comm, &rest, &towards);
        for _ in 0..STEPS {
            let most = towards.iter().fold(0.0_f64, |most, correction| most.max(correction.abs()));
            if nodes.comm.max_f64(most) <= bound {
                return true;
            }
            let flows = masked(nodes.flows(ground, &self.nodes, &way));
            let length = product / self.product(nodes.comm, &way, &flows);
            if !length.is_finite() {
                return false;
            }
            for (number, value) in self.values.iter_mut().enumerate() {
                *value = length.mul_add(way[number], *value);
                rest[number] = (-length).mul_add(flows[number], rest[number]);
            }
            towards = corrections(&rest);
            let next = self.product(nodes.comm, &rest, &towards);
            let share = next / product;
            product = next;
            way.iter_mut().zip(&towards).for_each(|(way, towards)| *way = share.mul_add(*way, *towards));
        }
        false
    }

    /// Collective. Scalar product over the nodes of all ranks.
    fn product(&self, comm: &Comm, a: &[f64], b: &[f64]) -> f64 {
        let mut sum = [ExactSum::new()];
        let all = a.iter().zip(b).zip(&self.owned).filter(|(_, owned)| **owned);
        all.for_each(|((a, b), _)| sum[0].add(a * b));
        ExactSum::sum_over_ranks(comm, &mut sum);
        sum[0].to_f64()
    }
}
