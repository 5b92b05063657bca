//! Preconditioner of the linear systems: stiffness of each node, and leaves as elements (additive Schwarz).
//!
//! Each leaf with particles is a brick with multilinear functions over it, whose stiffness is the sum over its
//! particles. Where leaves of several levels meet, corners of the finer ones follow the coarser one. Every rank has
//! all bricks and solves their equations directly, so the correction reaches through the whole body at once,
//! and the number of iterations does not grow with it. Functions end within a cell of what holds nodes, at the
//! cost of the stiffness of these nodes.
//!
//! Sums over nodes are sums of whole numbers, of 2⁻⁴⁵ of about the norm of all: their order does not matter, so bits
//! do not depend on ranks.
use partition::comm::Comm;
use partition::{Forest, MAX_LEVEL, Octant};
use rayon::prelude::*;

use super::points::{Matrix, Points};
use super::skyline::Skyline;
use super::unknowns::{Nodal, Unknowns};
use crate::exact_sum::ExactSum;
use crate::grid::leaf_geometry::leaf_box;
use crate::particle::Chunk;
use crate::particle::chunk::Layout;
use crate::particle::volume::box_volume;
use crate::simd::{LANES, Lanes, Vector};

/// Lattice points along the edge of a finest octant: its nodes.
const FINE: u32 = 4;
/// Least diagonal entry, as a part of the stiffness of the nodes under a function.
const FLOOR: f64 = 0.05;

/// Greatest whole number of one node, so that no sum of nodes around a corner of a brick leaves 64 bits.
const MOST: f64 = (1_u64 << 50) as f64;

/// A place on the lattice of finest nodes.
type Lattice<const D: usize> = [i64; D];

/// Corners with weights.
type Weights = Vec<(u32, f64)>;

/// Bricks, and the factors of their equations.
pub(super) struct Coarse<const D: usize> {
    /// By element and corner, what each follows.
    corners: Vec<Vec<Weights>>,
    /// Number of nodes of the bricks.
    count: usize,
    /// Of each unknown, the nodes of the bricks that it follows.
    weights: Vec<Weights>,
    /// Stiffness, and later its factors.
    matrix: Skyline,
}

/// Leaves with particles of all ranks, along the curve.
struct Elements<const D: usize>(Vec<Octant<D>>);

impl<const D: usize> Elements<D> {
    /// The coarsest leaf, with its number, whose closed box has a place.
    fn at(&self, place: &Lattice<D>) -> Option<usize> {
        let beside = (0..1_i64 << D).filter_map(|corner| {
            let point: Lattice<D> = std::array::from_fn(|a| place[a] - (corner >> a & 1));
            if point.iter().any(|x| *x < 0) {
                return None;
            }
            let coord = point.map(|x| x as u32 / FINE);
            let key = Octant { level: MAX_LEVEL, coord }.key();
            let after = self.0.partition_point(|leaf| leaf.key() <= key);
            let found = after.checked_sub(1)?;
            (key < self.0[found].key_end()).then_some(found)
        });
        beside.min_by_key(|&found| (self.0[found].level, found))
    }

    /// Place of a point in the box of a leaf, 0 to 1 along each axis within it.
    fn share(&self, element: usize, place: &Lattice<D>) -> [f64; D] {
        let leaf = &self.0[element];
        let edge = f64::from(FINE << (MAX_LEVEL - leaf.level));
        let lower = leaf.lower();
        std::array::from_fn(|a| (place[a] as f64 - f64::from(lower[a]) * f64::from(FINE)) / edge)
    }

    /// Place of a corner of a leaf.
    fn corner(&self, element: usize, corner: usize) -> Lattice<D> {
        let leaf = &self.0[element];
        let edge = 1_i64 << (MAX_LEVEL - leaf.level);
        let lower = leaf.lower();
        std::array::from_fn(|a| i64::from(FINE) * (i64::from(lower[a]) + edge * (corner >> a & 1) as i64))
    }

    /// Calls `each` with the free corners, and their weights, that a place follows, if a leaf has it.
    fn follow(&self, place: &Lattice<D>, factor: f64, each: &mut impl FnMut(Lattice<D>, f64)) {
        if let Some(element) = self.at(place) {
            self.within(element, place, factor, each);
        }
    }

    /// As [`Elements::follow`] for the functions of one leaf.
    fn within(
        &self,
        element: usize,
        place: &Lattice<D>,
        factor: f64,
        each: &mut impl FnMut(Lattice<D>, f64),
    ) {
        let share = self.share(element, place);
        for corner in 0..1usize << D {
            let weight = weight::<D>(corner, &share);
            if weight == 0.0 {
                continue;
            }
            let at = self.corner(element, corner);
            if *place == at || self.at(&at).is_some_and(|other| self.has_corner(other, &at)) {
                each(at, factor * weight);
            } else {
                self.follow(&at, factor * weight, each);
            }
        }
    }

    fn has_corner(&self, element: usize, place: &Lattice<D>) -> bool {
        self.share(element, place).iter().all(|share| *share == 0.0 || *share == 1.0)
    }
}

/// Multilinear function of a corner.
fn weight<const D: usize>(corner: usize, share: &[f64; D]) -> f64 {
    (0..D).map(|a| if corner >> a & 1 == 1 { share[a] } else { 1.0 - share[a] }).product()
}

/// Gradient of the function of a corner, over edges of the leaf.
fn slope<const D: usize>(corner: usize, share: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|axis| {
        let along = |a: usize| if corner >> a & 1 == 1 { share[a] } else { 1.0 - share[a] };
        let others: f64 = (0..D).filter(|&a| a != axis).map(along).product();
        if corner >> axis & 1 == 1 { others } else { -others }
    })
}

/// Values of all ranks in the order of the ranks, on every rank.
fn all_of<T: bytemuck::Pod>(comm: &Comm, own: &[T]) -> Vec<T> {
    let gathered = comm.gather_bytes(bytemuck::cast_slice(own));
    let mut bytes = gathered.map(|parts| parts.concat()).unwrap_or_default();
    comm.broadcast_bytes(0, &mut bytes);
    bytemuck::pod_collect_to_vec(&bytes)
}

impl<const D: usize> Coarse<D> {
    /// Collective. The bricks of a tree with particles, and what the unknowns follow.
    pub(super) fn new(comm: &Comm, forest: &Forest<D>, chunks: &[Chunk<D>], unknowns: &Unknowns<D>) -> Self {
        let filled = forest.leaves().iter().zip(chunks).filter(|(_, chunk)| !chunk.is_empty());
        let codes: Vec<u64> = filled.map(|(leaf, _)| leaf.code()).collect();
        let codes = all_of(comm, &codes);
        let elements = Elements(codes.into_iter().filter_map(Octant::from_code).collect());
        let corners_of = |element: usize| (0..1usize << D).map(move |corner| (element, corner));
        let all = 0..elements.0.len();
        let followed: Vec<Vec<Vec<(Lattice<D>, f64)>>> = all
            .clone()
            .into_par_iter()
            .map(|element| {
                let of_corner = |(element, corner)| {
                    let (at, mut weights) = (elements.corner(element, corner), Vec::new());
                    elements.follow(&at, 1.0, &mut |place, weight| weights.push((place, weight)));
                    weights
                };
                corners_of(element).map(of_corner).collect()
            })
            .collect();
        // Numbered along the longest axis, so that the rows of the matrix are short.
        let mut places: Vec<Lattice<D>> =
            followed.iter().flatten().flatten().map(|(place, _)| *place).collect();
        let extent = |a: usize| {
            let along = || places.iter().map(|place| place[a]);
            along().max().unwrap_or(0) - along().min().unwrap_or(0)
        };
        let mut axes: [usize; D] = std::array::from_fn(|a| a);
        axes.sort_by_key(|&a| -extent(a));
        let order = |place: &Lattice<D>| axes.map(|a| place[a]);
        places.sort_unstable_by_key(order);
        places.dedup();
        let number = |place: &Lattice<D>| {
            places.binary_search_by_key(&order(place), order).map_or(u32::MAX, |number| number as u32)
        };
        let numbered = |weights: &[(Lattice<D>, f64)]| -> Weights {
            weights.iter().map(|(place, weight)| (number(place), *weight)).collect()
        };
        let corners: Vec<Vec<Weights>> = followed
            .iter()
            .map(|corners| corners.iter().map(|weights| numbered(weights)).collect())
            .collect();
        let finest = forest.brick().lattice_size();
        let tied = unknowns.tied();
        let weights = (0..unknowns.nodes.len()).into_par_iter().map(|node| {
            if tied[node] {
                return Vec::new();
            }
            let (place, cell) = unknowns.lattice[node];
            debug_assert!(place.iter().zip(finest).all(|(x, size)| *x <= i64::from(size) * i64::from(FINE)));
            let Some(element) = nearest(&elements, &place, cell) else { return Vec::new() };
            let mut weights = Vec::new();
            elements.within(element, &place, 1.0, &mut |at, weight| weights.push((at, weight)));
            numbered(&weights)
        });
        let weights = weights.collect();
        let count = places.len();
        let mut first: Vec<usize> = (0..count).collect();
        for corners in &corners {
            let all = || corners.iter().flatten().map(|(node, _)| *node as usize);
            let least = all().min().unwrap_or(0);
            all().for_each(|node| first[node] = first[node].min(least));
        }
        let rows = first.iter().flat_map(|first| (0..D).map(move |_| D * first)).collect();
        Self { corners, count, weights, matrix: Skyline::new(rows) }
    }

    /// Collective. Stiffness of the bricks, from the tangents of the particles and the stiffness of nodes
    /// (N/m), and its factors.
    pub(super) fn assemble(
        &mut self,
        comm: &Comm,
        chunks: &[Chunk<D>],
        points: &[Vec<Points>],
        (forest, root_edge): (&Forest<D>, f64),
        stiffness: &[f64],
        unknowns: &Unknowns<D>,
    ) {
        let leaves = chunks.par_iter().zip(points).zip(forest.leaves());
        let filled = leaves.filter(|((chunk, _), _)| !chunk.is_empty());
        let own: Vec<Vec<f64>> =
            filled.map(|((chunk, points), leaf)| brick(chunk, points, &leaf_box(leaf, root_edge))).collect();
        let all = all_of(comm, &own.concat());
        self.matrix.clear();
        let size = D << D;
        for (corners, brick) in self.corners.iter().zip(all.chunks_exact(size * size)) {
            for (row, entries) in brick.chunks_exact(size).enumerate() {
                for (column, entry) in entries.iter().enumerate() {
                    let (i, k) = (row % D, column % D);
                    for &(to, share) in &corners[row / D] {
                        for &(from, other) in &corners[column / D] {
                            let (to, from) = (D * to as usize + i, D * from as usize + k);
                            if to >= from {
                                self.matrix.add(to, from, share * other * entry);
                            }
                        }
                    }
                }
            }
        }
        // Stiffness under each function, and that of held nodes along each axis.
        let greatest = comm.max_f64(stiffness.iter().copied().fold(0.0, f64::max));
        let unit = whole_unit(greatest);
        let mut sums = vec![0_i64; (1 + D) * self.count];
        let nodes = self.weights.iter().zip(stiffness).zip(&unknowns.held).zip(&unknowns.owned);
        for (((weights, stiffness), held), _) in nodes.filter(|(_, owned)| **owned) {
            for &(node, weight) in weights {
                let at = (1 + D) * node as usize;
                sums[at] += (weight * weight * stiffness * unit) as i64;
                for a in (0..D).filter(|&a| held[a].is_some()) {
                    sums[at + 1 + a] += (weight.abs() * stiffness * unit) as i64;
                }
            }
        }
        comm.sum_i64(&mut sums);
        for (node, sums) in sums.chunks_exact(1 + D).enumerate() {
            for a in 0..D {
                let entry = self.matrix.diagonal(D * node + a);
                *entry = entry.max(FLOOR * sums[0] as f64 / unit) + sums[1 + a] as f64 / unit;
            }
        }
        self.matrix.factor();
    }

    /// Collective, with one reduction. The preconditioner: displacements for the forces `rest` (N), masked, with
    /// their work on these (J) and the square of the norm of `rest`, N²; `norm` is about this norm.
    pub(super) fn towards(
        &self,
        comm: &Comm,
        unknowns: &Unknowns<D>,
        stiffness: &[f64],
        rest: &Nodal<D>,
        norm: f64,
    ) -> Towards<D> {
        let unit = whole_unit(norm);
        let mut words = vec![0_i64; D * self.count];
        let mut exact = [ExactSum::new(), ExactSum::new()];
        let own = |node: usize, force: f64| force / stiffness[node].max(f64::MIN_POSITIVE);
        let nodes = self.weights.iter().zip(rest).enumerate();
        for (number, (weights, force)) in nodes.filter(|(number, _)| unknowns.owned[*number]) {
            for &(node, weight) in weights {
                for a in 0..D {
                    words[D * node as usize + a] += (weight * force[a] * unit).clamp(-MOST, MOST) as i64;
                }
            }
            for &force in force {
                exact[0].add(force * force);
                exact[1].add(force * own(number, force));
            }
        }
        exact.iter_mut().for_each(|sum| words.extend(sum.words()));
        comm.sum_i64(&mut words);
        let (sums, exact) = words.split_at(D * self.count);
        let exact = |number: usize| {
            let words = &exact[number * ExactSum::WORDS..][..ExactSum::WORDS];
            ExactSum::from_words(words).map_or(f64::NAN, |sum| sum.to_f64())
        };
        let forces: Vec<f64> = sums.iter().map(|&sum| sum as f64 / unit).collect();
        let mut values = forces.clone();
        self.matrix.solve(&mut values);
        let product = forces.iter().zip(&values).fold(exact(1), |sum, (a, b)| a.mul_add(*b, sum));
        let each = |(node, force): (usize, &[f64; D])| -> [f64; D] {
            let near = force.map(|force| own(node, force));
            self.weights[node].iter().fold(near, |way, &(corner, weight)| {
                std::array::from_fn(|a| weight.mul_add(values[D * corner as usize + a], way[a]))
            })
        };
        let mut way: Nodal<D> = rest.iter().enumerate().map(each).collect();
        unknowns.mask(&mut way);
        Towards { way, product, square: exact(0) }
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

/// Whole numbers per unit for sums of values up to `greatest`: a power of two.
fn whole_unit(greatest: f64) -> f64 {
    let exponent = if greatest > 0.0 { libm::frexp(greatest).1 } else { 0 };
    libm::ldexp(1.0, (45 - exponent).clamp(-1000, 1000))
}

/// The leaf whose functions a node follows: that which has it, or one up to two cells (in lattice points) away.
fn nearest<const D: usize>(elements: &Elements<D>, place: &Lattice<D>, cell: i64) -> Option<usize> {
    elements.at(place).or_else(|| {
        let mut offsets: Vec<Lattice<D>> = (0..5_usize.pow(D as u32))
            .map(|number| std::array::from_fn(|a| (number / 5_usize.pow(a as u32) % 5) as i64 - 2))
            .collect();
        offsets.sort_by_key(|offset| offset.iter().map(|o| o * o).sum::<i64>());
        offsets.iter().find_map(|offset| elements.at(&std::array::from_fn(|a| place[a] + cell * offset[a])))
    })
}

/// Stiffness of the brick of a leaf, row by row: from its corners and axes.
fn brick<const D: usize>(chunk: &Chunk<D>, points: &[Points], leaf: &([f64; D], [f64; D])) -> Vec<f64> {
    let size = D << D;
    let mut matrix = vec![0.0; size * size];
    let edge = leaf.1[0] - leaf.0[0];
    for (batch, points) in points.iter().enumerate() {
        let first = batch * LANES;
        let mut changes: [[Matrix; D]; D] = [[[[Lanes::splat(0.0); 3]; 3]; D]; D];
        for m in 0..D {
            for n in 0..D {
                let mut gradient = [[Lanes::splat(0.0); 3]; 3];
                gradient[m][n] = Lanes::splat(1.0);
                changes[m][n] = points.change(&gradient);
            }
        }
        for lane in 0..LANES.min(chunk.len() - first) {
            let p = first + lane;
            let x = chunk.position(p);
            let share = std::array::from_fn(|a| ((x[a] - leaf.0[a]) / edge).clamp(0.0, 1.0));
            let [half] = chunk.read(Layout::<D>::HALF, p);
            let factor = box_volume::<D>(half) / (edge * edge);
            for from in 0..1usize << D {
                let slope_from = slope::<D>(from, &share);
                for m in 0..D {
                    let stress: [[f64; D]; D] = std::array::from_fn(|i| {
                        std::array::from_fn(|k| {
                            (0..D).map(|n| changes[m][n][i][k].as_array()[lane] * slope_from[n]).sum::<f64>()
                        })
                    });
                    for to in 0..1usize << D {
                        let slope_to = slope::<D>(to, &share);
                        for i in 0..D {
                            let force: f64 = (0..D).map(|k| stress[i][k] * slope_to[k]).sum();
                            matrix[(D * to + i) * size + D * from + m] += factor * force;
                        }
                    }
                }
            }
        }
    }
    matrix
}
