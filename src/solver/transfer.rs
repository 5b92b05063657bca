//! The phases of a step between particles and nodes, in parallel over bins and leaves.
use rayon::prelude::*;

use super::bins::{BinMissing, Members};
use super::phases::Phase;
use super::update::{apply_faces, update_velocity};
use super::{Physics, Solver};
use crate::grid::GridPlan;
use crate::grid::fields::{Part, VelocityArena};
use crate::grid::plan::Bin;
use crate::kernel::g2p::{Fields, Moments};
use crate::kernel::p2g::MomentSums;
use crate::kernel::{Frame, Row, Scheme, Select, domain, g2p, p2g};
use crate::particle::Chunk;

/// Which bins a scatter treats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// Bins that another rank needs; these come first, so that their exchange can start.
    Neighbours,
    /// All others.
    Own,
}

impl<const D: usize> Physics<D> {
    /// What the kernels need to know.
    fn scheme(&self) -> Scheme<'_> {
        Scheme {
            boxes: self.boxes,
            root_cell: self.root_edge / 4.0,
            transfer: self.transfer,
            materials: &self.materials,
        }
    }
}

/// Upper corner of the domain, m.
fn extent<const D: usize>(plan: &GridPlan<D>) -> [f64; D] {
    plan.tree.brick().roots.map(|n| f64::from(n) * plan.root_edge)
}

/// The block of cells of a bin.
fn frame<const D: usize>(plan: &GridPlan<D>, bin: &Bin<D>) -> Frame<D> {
    let cell = plan.cell(bin.block.level);
    Frame { corner: bin.block.coord.map(|c| f64::from(4 * c) * cell), cell, extent: extent(plan) }
}

fn select<'a, const D: usize>(chunk: &Chunk<D>, members: Members<'a>) -> Option<Select<'a>> {
    match members {
        Members::All => (!chunk.is_empty()).then_some(Select::All),
        Members::List(list) => (!list.is_empty()).then_some(Select::List(list)),
    }
}

impl<const D: usize> Solver<D> {
    /// Lists the particles of each bin in leaves beside finer leaves.
    pub(super) fn sort_into_bins(&mut self) -> Result<(), BinMissing> {
        let scheme = self.physics.scheme();
        let (grid, chunks) = (&mut self.grid, &self.chunks);
        let extent = extent(&grid.plan);
        self.phases.time(Phase::Sort, || {
            grid.lists.sort(&grid.plan, chunks, |chunk, cell, out| {
                domain::half_widths(chunk, Select::All, cell, &extent, &scheme, out);
            })
        })
    }

    /// P2G: scatters mass, affine momentum and the impulse of stress of the bins in `reach` into their
    /// arenas.
    pub(super) fn scatter(&mut self, dt: f64, reach: Reach) {
        let scheme = self.physics.scheme();
        let (grid, chunks) = (&mut self.grid, &self.chunks);
        let (plan, lists) = (&grid.plan, &grid.lists);
        let mut arenas = grid.arenas.each_mut();
        arenas.retain(|arena| grid.is_sent[arena.bin] == (reach == Reach::Neighbours));
        self.phases.time(Phase::Scatter, || {
            arenas.into_par_iter().for_each(|arena| {
                let bin = &plan.bins[arena.bin];
                let leaf = bin.leaf as usize;
                let members = lists.members(leaf, arena.bin - plan.leaf_bins(leaf).start);
                let selected = select(&chunks[leaf], members);
                *arena.occupied = selected.is_some();
                let Some(selected) = selected else { return };
                arena.rows.fill(Row([0.0; 4]));
                let (chunk, frame) = (&chunks[leaf], frame(plan, bin));
                match arena.moments.zip(bin.touched) {
                    None => p2g::scatter(chunk, selected, &frame, &scheme, dt, arena.rows),
                    Some((sums, table)) => {
                        sums.fill([Row([0.0; 4]); D]);
                        let touched = &plan.touched[table as usize];
                        let moments = MomentSums { touched, sums };
                        p2g::scatter_with_moments(chunk, selected, &frame, &scheme, dt, arena.rows, moments);
                    }
                }
            });
        });
    }

    /// Adds up arenas on the nodes of `part`.
    pub(super) fn sum_nodes(&mut self, part: Part) {
        let grid = &mut self.grid;
        self.phases.time(Phase::Sum, || {
            grid.fields.sum(&grid.plan, &grid.arenas, &grid.received, part);
        });
    }

    /// Hands sums of constrained nodes to their parents.
    pub(super) fn restrict(&mut self) {
        let grid = &mut self.grid;
        self.phases.time(Phase::Nodes, || grid.fields.restrict(&grid.plan));
    }

    /// Velocities on real nodes: momentum over mass, gravity, boundary conditions.
    pub(super) fn update_nodes(&mut self, dt: f64) {
        let (grid, physics) = (&mut self.grid, &self.physics);
        self.phases.time(Phase::Nodes, || {
            update_velocity(&mut grid.fields, &grid.plan, physics.gravity, dt);
            apply_faces(&mut grid.fields, &grid.plan, &physics.faces);
        });
    }

    /// Interpolates velocities on constrained nodes from their parents.
    pub(super) fn prolong(&mut self) {
        let grid = &mut self.grid;
        self.phases.time(Phase::Nodes, || grid.fields.prolong(&grid.plan));
    }

    /// G2P: velocity, affine matrix, deformation, stress and position of all particles.
    pub(super) fn gather(&mut self, dt: f64) {
        let scheme = self.physics.scheme();
        let (plan, fields, lists) = (&self.grid.plan, &self.grid.fields, &self.grid.lists);
        let (chunks, signal) = (&mut self.chunks, &mut self.signal);
        self.phases.time(Phase::Gather, || {
            let leaves = chunks.par_iter_mut().enumerate();
            let speeds = leaves.map_init(VelocityArena::default, |arena, (leaf, chunk)| {
                plan.leaf_bins(leaf).enumerate().fold(0.0, |signal: f64, (number, bin)| {
                    let Some(selected) = select(chunk, lists.members(leaf, number)) else { return signal };
                    fields.load(plan, bin, arena);
                    let bin = &plan.bins[bin];
                    let frame = frame(plan, bin);
                    let moments = bin.touched.map(|table| Moments {
                        touched: &plan.touched[table as usize],
                        first: &arena.moments,
                        second: &arena.spread,
                    });
                    let nodes = Fields { velocity: &arena.rows, increment: None, moments };
                    signal.max(g2p::gather(chunk, selected, &frame, &scheme, dt, &nodes))
                })
            });
            speeds.collect_into_vec(signal);
        });
    }
}
