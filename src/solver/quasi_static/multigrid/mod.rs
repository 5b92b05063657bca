//! Preconditioner of the linear systems: a V-cycle of multigrid over cells as elements.
//!
//! Its finest level has the unknowns themselves and, for the stiffness of the particles, that of cells as
//! elements (`bricks`): hanging and tied nodes follow as in the grid, so it differs from the matrix
//! of the linear system only in where stress is sampled. Each coarser level has cells of twice the least
//! edge, larger ones as they are, and `Pᵀ A P` as its matrix; the last, of few nodes, is solved directly. The
//! smoother is Chebyshev's iteration with the blocks of the diagonal, which no order of nodes affects.
//!
//! Every rank has all levels and computes the same cycle, so each application takes one reduction: of the
//! forces on all unknowns, as whole numbers of 2⁻⁴⁵ of about their norm. Bits therefore do not depend on
//! ranks.
//!
//! | file | what it holds |
//! |---|---|
//! | `everywhere` | nodes of all ranks |
//! | `lattice` | cells on the lattice of the finest nodes |
//! | `bricks` | cells as elements |
//! | `blocks` | sparse matrices of blocks, smoother, cycle |
//! | `skyline` | factors of a symmetric matrix |
//! | this | the levels, and the preconditioner |
mod blocks;
mod bricks;
mod everywhere;
mod lattice;
mod skyline;

use partition::Forest;
use partition::comm::Comm;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use self::blocks::{Blocks, Level, Weights, cycle, factors, without_held};
use self::bricks::Bricks;
use self::everywhere::{Everywhere, Map, Share, between, whole_unit, without_axes};
use self::lattice::{Lattice, Mesh};
use self::skyline::Skyline;
use super::points::Points;
use super::unknowns::{Nodal, Unknowns};
use super::walls::Springs;
use crate::exact_sum::ExactSum;
use crate::grid::plan::GridPlan;
use crate::kernel::Scheme;
use crate::particle::Chunk;

/// Least diagonal entry, as a part of the stiffness of the node.
const FLOOR: f64 = 0.05;
/// Greatest whole number of one node, so that no sum leaves 64 bits.
const MOST: f64 = (1_u64 << 50) as f64;
/// Nodes up to which a level is solved directly.
const BOTTOM: usize = 100;
/// Cells whose stiffness is computed at once.
const AT_ONCE: usize = 2048;
/// No unknown.
const NONE: u32 = u32::MAX;

/// The levels, and the factors of the coarsest.
pub(super) struct Multigrid<const D: usize> {
    bricks: Bricks<D>,
    /// By cell and corner, what each follows.
    corners: Vec<Vec<Share>>,
    /// Maps of displacements, and conditions that are not along axes, by number of the unknown.
    maps: Vec<Map<D>>,
    turned: Vec<(u32, [f64; D])>,
    levels: Vec<Level<D>>,
    bottom: Skyline,
    /// Of each node of this rank, its number among the unknowns of all; none of tied ones.
    numbers: Vec<u32>,
}

impl<const D: usize> Multigrid<D> {
    /// Collective. The levels for the nodes of a step.
    pub(super) fn new(
        comm: &Comm,
        (forest, chunks): (&Forest<D>, &[Chunk<D>]),
        (plan, scheme): (&GridPlan<D>, &Scheme<'_>),
        unknowns: &Unknowns<D>,
    ) -> Self {
        let bricks = Bricks::new(comm, forest, chunks, plan, scheme);
        let nodes = Everywhere::new(comm, unknowns);
        let coarsest = bricks.cells.iter().map(|cell| cell.edge).max().unwrap_or(1);
        let finest = bricks.cells.iter().map(|cell| cell.edge).min().unwrap_or(1);
        let corners = (0..bricks.cells.len() << D).into_par_iter().map(|number| {
            let cell = &bricks.cells[number >> D];
            let mut shares = Vec::new();
            nodes.follow(&cell.corner(number & ((1 << D) - 1)), cell.edge, coarsest, 1.0, &mut shares);
            shares
        });
        let corners: Vec<Vec<Share>> = corners.collect();
        let tied = unknowns.tied();
        let number = |node: usize| nodes.numbers.get(&unknowns.lattice[node].0).copied().unwrap_or(NONE);
        let numbers = (0..tied.len()).map(|node| if tied[node] { NONE } else { number(node) }).collect();
        let (maps, turned) = (nodes.maps, nodes.turned);
        let (places, held): (Vec<_>, Vec<_>) = nodes.free.into_iter().unzip();
        let matrix = Blocks::new(&pattern(places.len(), &corners, 1 << D));
        let levels = levels(&bricks, places, held, matrix, finest);
        Self { bricks, corners, maps, turned, levels, bottom: Skyline::default(), numbers }
    }

    /// Collective, with three reductions. The matrices, from the tangents of the particles, the stiffness of
    /// nodes (N/m), and springs at nodes where any rank has some.
    pub(super) fn assemble(
        &mut self,
        comm: &Comm,
        points: &[Vec<Points>],
        (stiffness, springs): (&[f64], Option<&Springs<D>>),
        unknowns: &Unknowns<D>,
    ) {
        self.bricks.collect(comm, points);
        let unit = whole_unit(comm.max_f64(stiffness.iter().copied().fold(0.0, f64::max)));
        let mut levels = std::mem::take(&mut self.levels);
        let Some(finest) = levels.first_mut() else { return };
        let (matrix, held) = (&mut finest.matrix, &finest.held);
        matrix.clear();
        let (count, around, axes) = (self.bricks.cells.len(), 1 << D, D << D);
        for first in (0..count).step_by(AT_ONCE) {
            let cells = (first..count.min(first + AT_ONCE)).into_par_iter();
            let all: Vec<Vec<f64>> = cells.map(|cell| self.bricks.stiffness(cell)).collect();
            for (cell, brick) in all.iter().enumerate() {
                let corners = &self.corners[(first + cell) * around..][..around];
                for (to, from) in (0..around).flat_map(|to| (0..around).map(move |from| (to, from))) {
                    let block: [[f64; D]; D] = std::array::from_fn(|i| {
                        std::array::from_fn(|k| brick[(D * to + i) * axes + D * from + k])
                    });
                    for &(row, row_held, share, row_map) in &corners[to] {
                        for &(column, column_held, other, column_map) in &corners[from] {
                            let mut block = block;
                            if row_map + column_map > 0 {
                                block = between(&self.map(row_map), &block, &self.map(column_map));
                            }
                            without_held(&mut block, row_held, column_held);
                            if let Some(sum) = matrix.block(row as usize, column) {
                                add(sum, share * other, &block);
                            }
                        }
                    }
                }
            }
        }
        // Of each unknown its stiffness, and the sum of its springs.
        let words = if springs.is_some() { 1 + D * D } else { 1 };
        let mut sums = vec![0_i64; words * matrix.len()];
        for (node, &number) in self.numbers.iter().enumerate().filter(|(_, number)| **number != NONE) {
            if unknowns.owned[node] {
                sums[words * number as usize] += (stiffness[node] * unit) as i64;
            }
        }
        let leaders = springs.is_some().then(|| unknowns.leaders());
        for (node, spring) in springs.into_iter().flatten().filter(|(node, _)| unknowns.owned[*node]) {
            for (leader, share) in leaders.iter().flat_map(|leaders| leaders(*node)) {
                let Some(number) = self.numbers.get(leader).filter(|number| **number != NONE) else {
                    continue;
                };
                let own = &mut sums[words * *number as usize + 1..][..D * D];
                for (sum, value) in own.iter_mut().zip(spring.as_flattened()) {
                    *sum += (share * value * unit) as i64;
                }
            }
        }
        comm.sum_i64(&mut sums);
        for (node, sums) in sums.chunks_exact(words).enumerate() {
            let Some(block) = matrix.block(node, node as u32) else { continue };
            for a in (0..D).filter(|a| held[node] >> a & 1 == 0) {
                block[a][a] = block[a][a].max(FLOOR * sums[0] as f64 / unit);
            }
            if words > 1 {
                let mut spring: [[f64; D]; D] =
                    std::array::from_fn(|i| std::array::from_fn(|k| sums[1 + D * i + k] as f64 / unit));
                without_held(&mut spring, held[node], held[node]);
                add(block, 1.0, &spring);
            }
        }
        for &(node, along) in &self.turned {
            let Some(block) = matrix.block(node as usize, node) else { continue };
            // What is held has a stiffness of its own, which no force meets.
            let own = (0..D).map(|a| block[a][a]).fold(0.0, f64::max);
            for (i, row) in block.iter_mut().enumerate() {
                row.iter_mut().zip(&along).for_each(|(value, other)| *value += own * along[i] * other);
            }
        }
        self.levels = levels;
        let last = self.levels.len() - 1;
        for level in 0..last {
            self.levels[level].prepare();
            self.levels[level + 1].matrix = self.levels[level].reduced(&self.levels[level + 1].held);
        }
        self.bottom = factors(&self.levels[last].matrix);
    }

    /// A map by its number.
    fn map(&self, number: u32) -> Map<D> {
        match number {
            0 => without_axes(0),
            _ => self.maps[number as usize],
        }
    }

    /// Collective, with one reduction. The preconditioner: displacements for the forces `rest` (N), masked,
    /// with their work on these (J) and the square of the norm of `rest`, N²; `norm` is about this norm.
    pub(super) fn towards(
        &self,
        comm: &Comm,
        unknowns: &Unknowns<D>,
        rest: &Nodal<D>,
        norm: f64,
    ) -> Towards<D> {
        let unit = whole_unit(norm);
        let count = self.levels.first().map_or(0, |level| level.matrix.len());
        let mut words = vec![0_i64; D * count];
        let mut square = ExactSum::new();
        let owned = self.numbers.iter().zip(rest).zip(&unknowns.owned).filter(|(_, owned)| **owned);
        for ((&number, force), _) in owned {
            force.iter().for_each(|force| square.add(force * force));
            if number != NONE {
                let words = &mut words[D * number as usize..][..D];
                for (word, force) in words.iter_mut().zip(force) {
                    *word += (force * unit).clamp(-MOST, MOST) as i64;
                }
            }
        }
        words.extend(square.words());
        comm.sum_i64(&mut words);
        let (sums, square) = words.split_at(D * count);
        let square = ExactSum::from_words(square).map_or(f64::NAN, |sum| sum.to_f64());
        let forces: Nodal<D> =
            sums.chunks_exact(D).map(|sums| std::array::from_fn(|a| sums[a] as f64 / unit)).collect();
        let values = cycle(&self.levels, &self.bottom, &forces);
        let pairs = forces.iter().flatten().zip(values.iter().flatten());
        let product = pairs.fold(0.0, |sum: f64, (a, b)| a.mul_add(*b, sum));
        let own = |number: u32| values.get(number as usize).copied().unwrap_or([0.0; D]);
        let mut way: Nodal<D> = self.numbers.iter().map(|&number| own(number)).collect();
        unknowns.mask(&mut way);
        Towards { way, product, square }
    }
}

/// A direction in which to go on, by the preconditioner.
pub(super) struct Towards<const D: usize> {
    /// Displacements, m.
    pub(super) way: Nodal<D>,
    /// Work of the forces on them, J.
    pub(super) product: f64,
    /// Square of the norm of the forces, N².
    pub(super) square: f64,
}

/// Columns of each row: the unknowns of all cells of one. `around` corners follow each other for each cell.
fn pattern(count: usize, corners: &[Vec<Share>], around: usize) -> Vec<Vec<u32>> {
    let mut cells = vec![Vec::new(); count];
    for (cell, corners) in corners.chunks_exact(around).enumerate() {
        for (number, ..) in corners.iter().flatten() {
            let cells: &mut Vec<u32> = &mut cells[*number as usize];
            if cells.last() != Some(&(cell as u32)) {
                cells.push(cell as u32);
            }
        }
    }
    let columns = |(row, cells): (usize, &Vec<u32>)| {
        let of_cell = |cell: &u32| corners[*cell as usize * around..][..around].iter().flatten();
        let mut all: Vec<u32> = cells.iter().flat_map(of_cell).map(|(number, ..)| *number).collect();
        all.push(row as u32);
        all.sort_unstable();
        all.dedup();
        all
    };
    cells.par_iter().enumerate().map(columns).collect()
}

/// Levels for the unknowns at these places, on cells of twice the edge from each to the next.
fn levels<const D: usize>(
    bricks: &Bricks<D>,
    mut places: Vec<Lattice<D>>,
    mut held: Vec<u8>,
    matrix: Blocks<D>,
    finest: i64,
) -> Vec<Level<D>> {
    let (mut levels, mut matrix, mut edge) = (Vec::new(), matrix, finest);
    loop {
        edge *= 2;
        let mesh = Mesh::of_ancestors(&bricks.cells, edge);
        let follow = |place: &Lattice<D>| {
            let mut weights = Vec::new();
            mesh.follow(place, 1.0, &mut |at, weight| weights.push((at, weight)));
            weights
        };
        let followed: Vec<Vec<(Lattice<D>, f64)>> = places.par_iter().map(follow).collect();
        let (next, numbers) = numbered(&followed);
        if places.len() <= BOTTOM || next.len() >= places.len() {
            levels.push(Level::new(matrix, held, vec![Vec::new(); places.len()], 0));
            return levels;
        }
        let to: Vec<Weights> = followed
            .iter()
            .map(|all| all.iter().map(|(place, weight)| (numbers[place], *weight)).collect())
            .collect();
        let mut next_held = vec![0; next.len()];
        for (to, held) in to.iter().zip(&held) {
            if let [(coarse, 1.0)] = to[..] {
                next_held[coarse as usize] = *held;
            }
        }
        levels.push(Level::new(matrix, held, to, next.len()));
        matrix = Blocks::new(&vec![Vec::new(); next.len()]);
        (places, held) = (next, next_held);
    }
}

/// All places that are followed, in the order in which they first are, and their numbers.
fn numbered<const D: usize>(
    followed: &[Vec<(Lattice<D>, f64)>],
) -> (Vec<Lattice<D>>, FxHashMap<Lattice<D>, u32>) {
    let (mut places, mut numbers) = (Vec::new(), FxHashMap::default());
    for (place, _) in followed.iter().flatten() {
        numbers.entry(*place).or_insert_with(|| {
            places.push(*place);
            places.len() as u32 - 1
        });
    }
    (places, numbers)
}

fn add<const D: usize>(sum: &mut [[f64; D]; D], factor: f64, block: &[[f64; D]; D]) {
    for (sum, block) in sum.iter_mut().zip(block) {
        sum.iter_mut().zip(block).for_each(|(sum, value)| *sum = factor.mul_add(*value, *sum));
    }
}
