//! Loads in a step: their effect on nodes, and what is booked of it.
use partition::comm::Comm;
use rayon::prelude::*;

use super::phases::Phase;
use crate::exact_sum::ExactSum;
use crate::grid::mask::{block_nodes, node_of_bit};
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::BLOCK;
use crate::load::Load;
use crate::solver::Solver;

/// Sums of a load: three components of the impulse, and the work.
pub const LOAD_SUMS: usize = 4;

/// What is booked of the loads of a run on this rank.
#[derive(Clone, Debug, Default)]
pub struct LoadBooks {
    /// Per load, impulse since [`LoadBooks::since`] (kg m/s) and work since the start (J), of the nodes that this rank counts.
    pub sums: Vec<[ExactSum; LOAD_SUMS]>,
    /// Time of the last row of the history, s.
    pub since: f64,
}

impl LoadBooks {
    /// Nothing booked.
    pub(in crate::solver) fn new(loads: usize, time: f64) -> Self {
        Self { sums: vec![std::array::from_fn(|_| ExactSum::new()); loads], since: time }
    }

    /// Collective. Mean force since the last row (N) and work since the start (J) of each load.
    pub fn totals(&self, comm: &Comm, time: f64) -> Vec<LoadTotals> {
        if self.sums.is_empty() {
            return Vec::new();
        }
        let mut flat: Vec<ExactSum> = self.sums.iter().flatten().cloned().collect();
        ExactSum::sum_over_ranks(comm, &mut flat);
        let elapsed = time - self.since;
        let mean = |impulse: &ExactSum| if elapsed > 0.0 { impulse.to_f64() / elapsed } else { 0.0 };
        flat.chunks_exact(LOAD_SUMS)
            .map(|sums| LoadTotals { force: std::array::from_fn(|a| mean(&sums[a])), work: sums[3].to_f64() })
            .collect()
    }

    /// Not collective. Starts the mean forces anew at a time, s.
    pub fn forget_forces(&mut self, time: f64) {
        self.sums.iter_mut().for_each(|sums| sums[..3].fill_with(ExactSum::new));
        self.since = time;
    }
}

/// Mean force and work of a load.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadTotals {
    /// Mean force on the material since the last row of the history, N; in plane strain per metre of thickness.
    pub force: [f64; 3],
    /// Work on the material since the start, J: impulse times the velocity with which the step moves the material.
    pub work: f64,
}

/// What a load gives to one node in one step.
pub(in crate::solver) struct Push<const D: usize> {
    load: usize,
    node: usize,
    impulse: [f64; D],
}

/// Applies the loads to the velocities of real nodes, in the order of the job. Returns what the nodes that this rank counts
/// get, in the order of the nodes.
fn apply<const D: usize>(
    fields: &mut NodeFields<D>,
    plan: &GridPlan<D>,
    loads: &[(usize, &Load<D>)],
    middle: f64,
    dt: f64,
) -> Vec<Push<D>> {
    let nodes = block_nodes(D);
    let blocks = fields.rows.par_chunks_mut(nodes).zip(&plan.blocks).zip(&fields.active).enumerate();
    let active = blocks.with_min_len(32).filter(|(_, (_, active))| **active);
    let pushed = active.map(|(index, ((rows, block), _))| {
        let mut pushes = Vec::new();
        let (cell, real) = (plan.cell(block.level), block.value & !block.constrained);
        for (bit, row) in rows.iter_mut().enumerate() {
            let mass = row.0[3];
            if real >> bit & 1 == 0 || mass <= 0.0 {
                continue;
            }
            let local = node_of_bit::<D>(bit as u32);
            let x = std::array::from_fn(|a| f64::from(BLOCK as u32 * block.coord[a] + local[a]) * cell);
            let mut velocity: [f64; D] = std::array::from_fn(|a| row.0[a]);
            for &(number, load) in loads.iter().filter(|(_, load)| load.reaches(&x)) {
                let before = velocity;
                load.apply(&mut velocity, &x, middle, dt);
                if block.owned >> bit & 1 == 1 {
                    let impulse = std::array::from_fn(|a| mass * (velocity[a] - before[a]));
                    pushes.push(Push { load: number, node: index * nodes + bit, impulse });
                }
            }
            row.0[..D].copy_from_slice(&velocity);
        }
        pushes
    });
    pushed.collect::<Vec<_>>().into_iter().flatten().collect()
}

impl<const D: usize> Solver<D> {
    /// Not collective. Loads change the velocities of real nodes. Returns what they gave, for [`Solver::book_loads`].
    pub(in crate::solver) fn apply_loads(&mut self, dt: f64) -> Vec<Push<D>> {
        let time = self.clock.time;
        let loads = self.physics.loads.iter().enumerate();
        let active: Vec<(usize, &Load<D>)> = loads.filter(|(_, load)| load.is_active(time)).collect();
        if active.is_empty() {
            return Vec::new();
        }
        let grid = &mut self.grid;
        self.phases.time(Phase::Nodes, || apply(&mut grid.fields, &grid.plan, &active, time + 0.5 * dt, dt))
    }

    /// Not collective. Books impulse and work of the loads once nodes have their final velocities.
    pub(in crate::solver) fn book_loads(&mut self, pushes: &[Push<D>]) {
        for push in pushes {
            let row = &self.grid.fields.rows[push.node].0;
            let sums = &mut self.load_books.sums[push.load];
            for a in 0..D {
                sums[a].add(push.impulse[a]);
                // A product of two numbers, rounded once; the sum is exact.
                sums[3].add(push.impulse[a] * row[a]);
            }
        }
    }

    /// Collective. Mean force and work of each load.
    pub fn load_totals(&self) -> Vec<LoadTotals> {
        self.load_books.totals(&self.comm, self.clock.time)
    }
}
