//! Nodes of all ranks: the unknowns with their numbers, and what hanging and tied nodes follow.
use partition::comm::Comm;
use rustc_hash::FxHashMap;

use super::lattice::Lattice;
use super::unknowns::Unknowns;
use crate::grid::constraints::parents::parents_of;

/// An unknown that a corner of a cell follows: number, axes on which it does not, a bit each, and weight.
pub(super) type Share = (u32, u8, f64);

/// Values of all ranks in the order of the ranks, on every rank.
pub(super) fn all_of<T: bytemuck::Pod>(comm: &Comm, own: &[T]) -> Vec<T> {
    let gathered = comm.gather_bytes(bytemuck::cast_slice(own));
    let mut bytes = gathered.map(|parts| parts.concat()).unwrap_or_default();
    comm.broadcast_bytes(0, &mut bytes);
    bytemuck::pod_collect_to_vec(&bytes)
}

/// Whole numbers per unit for sums of values up to `greatest`: a power of two.
pub(super) fn whole_unit(greatest: f64) -> f64 {
    let exponent = if greatest > 0.0 { libm::frexp(greatest).1 } else { 0 };
    libm::ldexp(1.0, (45 - exponent).clamp(-1000, 1000))
}

/// Nodes of all ranks.
pub(super) struct Everywhere<const D: usize> {
    /// Of each tied node, the unknowns that it follows, by place, with axes on which they do not follow.
    tied: FxHashMap<Lattice<D>, Vec<(Lattice<D>, u8, f64)>>,
    /// Places of the unknowns with what is held, in the order of their numbers.
    pub(super) free: Vec<(Lattice<D>, u8)>,
    pub(super) numbers: FxHashMap<Lattice<D>, u32>,
}

impl<const D: usize> Everywhere<D> {
    /// Collective.
    pub(super) fn new(comm: &Comm, unknowns: &Unknowns<D>) -> Self {
        let held =
            |node: usize| (0..D).fold(0, |bits, a| bits | u8::from(unknowns.held[node][a].is_some()) << a);
        let tied = unknowns.tied();
        let is_free = |node: &usize| unknowns.owned[*node] && !tied[*node];
        let words: Vec<i64> = (0..unknowns.nodes.len())
            .filter(is_free)
            .flat_map(|node| unknowns.lattice[node].0.into_iter().chain([i64::from(held(node))]))
            .collect();
        let words = all_of(comm, &words);
        let all = words.chunks_exact(D + 1).map(|w| (std::array::from_fn(|a| w[a]), w[D] as u8));
        let mut free: Vec<(Lattice<D>, u8)> = all.collect();
        // Along the longest axis, so that the rows of the bottom are short.
        let extent = |a: usize| {
            let along = || free.iter().map(|(place, _)| place[a]);
            along().max().unwrap_or(0) - along().min().unwrap_or(0)
        };
        let mut axes: [usize; D] = std::array::from_fn(|a| a);
        axes.sort_by_key(|&a| -extent(a));
        free.sort_unstable_by_key(|(place, _)| axes.map(|a| place[a]));
        let numbers = free.iter().zip(0..).map(|((place, _), number)| (*place, number)).collect();
        let ties = unknowns.ties().iter().filter(|(node, _)| unknowns.owned[*node]);
        let words: Vec<i64> = ties
            .flat_map(|(node, corners)| corners.iter().map(|(corner, weight)| (*node, *corner, *weight)))
            .flat_map(|(node, corner, weight)| {
                let places = unknowns.lattice[node].0.into_iter().chain(unknowns.lattice[corner].0);
                places.chain([i64::from(held(node)), weight.to_bits() as i64])
            })
            .collect();
        let mut tied: FxHashMap<Lattice<D>, Vec<_>> = FxHashMap::default();
        for words in all_of(comm, &words).chunks_exact(2 * D + 2) {
            let [node, corner]: [Lattice<D>; 2] =
                std::array::from_fn(|which| std::array::from_fn(|a| words[which * D + a]));
            let weight = f64::from_bits(words[2 * D + 1] as u64);
            tied.entry(node).or_default().push((corner, words[2 * D] as u8, weight));
        }
        Self { tied, free, numbers }
    }

    /// Adds what a node on the lattice of this edge follows.
    pub(super) fn follow(
        &self,
        place: &Lattice<D>,
        edge: i64,
        coarsest: i64,
        factor: f64,
        out: &mut Vec<Share>,
    ) {
        if let Some(&number) = self.numbers.get(place) {
            return out.push((number, self.free[number as usize].1, factor));
        }
        if let Some(corners) = self.tied.get(place) {
            let known = corners.iter().filter_map(|(corner, held, weight)| {
                let number = *self.numbers.get(corner)?;
                Some((number, held | self.free[number as usize].1, factor * weight))
            });
            return out.extend(known);
        }
        if edge < coarsest {
            let node: [u32; D] = std::array::from_fn(|a| (place[a] / edge) as u32);
            for parent in parents_of(node) {
                let at = std::array::from_fn(|a| 2 * edge * i64::from(parent.node[a]));
                self.follow(&at, 2 * edge, coarsest, factor * parent.weight, out);
            }
        }
    }
}
