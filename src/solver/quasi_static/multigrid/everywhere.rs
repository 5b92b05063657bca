//! Nodes of all ranks: the unknowns with their numbers, and what hanging and tied nodes follow.
use std::collections::BTreeMap;

use partition::comm::Comm;
use rustc_hash::FxHashMap;

use super::lattice::Lattice;
use crate::grid::constraints::parents::parents_of;
use crate::solver::quasi_static::unknowns::Unknowns;

/// An unknown that a corner of a cell follows: number, axes on which it does not, a bit each, weight, and the
/// number of the map of its displacement, 0 for none.
pub(super) type Share = (u32, u8, f64, u32);

/// A map of displacements.
pub(super) type Map<const D: usize> = [[f64; D]; D];

/// The map that takes out the displacements along the axes of these bits; the identity for none.
pub(super) fn without_axes<const D: usize>(bits: u8) -> Map<D> {
    let is_own = |i: usize, k: usize| i == k && bits >> i & 1 == 0;
    std::array::from_fn(|i| std::array::from_fn(|k| f64::from(u8::from(is_own(i, k)))))
}

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
    /// Of each tied node, the unknowns that it follows, by place, with axes on which they do not follow, and
    /// maps.
    tied: FxHashMap<Lattice<D>, Vec<(Lattice<D>, u8, f64, u32)>>,
    /// Places of the unknowns with what is held, in the order of their numbers.
    pub(super) free: Vec<(Lattice<D>, u8)>,
    pub(super) numbers: FxHashMap<Lattice<D>, u32>,
    /// Conditions on unknowns that are not along axes, by number: unit vectors.
    pub(super) turned: Vec<(u32, [f64; D])>,
    /// Maps of displacements; the first stands for none.
    pub(super) maps: Vec<Map<D>>,
    /// Maps of unknowns with such conditions.
    of_free: FxHashMap<u32, u32>,
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
        let numbers: FxHashMap<Lattice<D>, u32> =
            free.iter().zip(0..).map(|((place, _), number)| (*place, number)).collect();
        let projections = projections(comm, unknowns);
        let (mut maps, mut of_free) = (vec![[[0.0; D]; D]], FxHashMap::default());
        let mut turned = Vec::new();
        for (place, (all, map)) in &projections {
            if let Some(&number) = numbers.get(place) {
                turned.extend(all.iter().map(|along| (number, *along)));
                of_free.insert(number, maps.len() as u32);
                maps.push(*map);
            }
        }
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
            let mut held = words[2 * D] as u8;
            let known = |place: &Lattice<D>| projections.get(place).map(|(_, map)| map);
            let map = match (known(&node), known(&corner)) {
                (None, None) => 0,
                (own, of_corner) => {
                    let free = without_axes(held);
                    let own = own.map_or(free, |own| product(&free, own));
                    held = 0;
                    maps.push(of_corner.map_or(own, |of_corner| product(&own, of_corner)));
                    maps.len() as u32 - 1
                }
            };
            tied.entry(node).or_default().push((corner, held, weight, map));
        }
        Self { tied, free, numbers, turned, maps, of_free }
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
            let map = self.of_free.get(&number).copied().unwrap_or(0);
            return out.push((number, self.free[number as usize].1, factor, map));
        }
        if let Some(corners) = self.tied.get(place) {
            let known = corners.iter().filter_map(|(corner, held, weight, map)| {
                let number = *self.numbers.get(corner)?;
                Some((number, held | self.free[number as usize].1, factor * weight, *map))
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

/// Unit vectors of the conditions on a node that are not along axes, and the projection that takes them out.
type Projection<const D: usize> = (Vec<[f64; D]>, Map<D>);

/// Collective. Those of the nodes of all ranks, by place.
fn projections<const D: usize>(comm: &Comm, unknowns: &Unknowns<D>) -> BTreeMap<Lattice<D>, Projection<D>> {
    let own = unknowns.turned.iter().filter(|(node, _)| unknowns.owned[*node]);
    let words: Vec<i64> = own
        .flat_map(|(node, turned)| turned.iter().map(|(along, _)| (*node, *along)))
        .flat_map(|(node, along)| {
            unknowns.lattice[node].0.into_iter().chain(along.map(|value| value.to_bits() as i64))
        })
        .collect();
    let mut all: BTreeMap<Lattice<D>, Projection<D>> = BTreeMap::new();
    for words in all_of(comm, &words).chunks_exact(2 * D) {
        let along: [f64; D] = std::array::from_fn(|a| f64::from_bits(words[D + a] as u64));
        let place = std::array::from_fn(|a| words[a]);
        let (known, map) = all.entry(place).or_insert_with(|| (Vec::new(), without_axes(0)));
        known.push(along);
        for (i, row) in map.iter_mut().enumerate() {
            row.iter_mut().zip(&along).for_each(|(value, other)| *value -= along[i] * other);
        }
    }
    all
}

fn product<const D: usize>(a: &Map<D>, b: &Map<D>) -> Map<D> {
    std::array::from_fn(|i| std::array::from_fn(|k| (0..D).fold(0.0, |sum, m| a[i][m].mul_add(b[m][k], sum))))
}

/// `Aᵀ B C`.
pub(super) fn between<const D: usize>(a: &Map<D>, b: &Map<D>, c: &Map<D>) -> Map<D> {
    let transposed: Map<D> = std::array::from_fn(|i| std::array::from_fn(|k| a[k][i]));
    product(&product(&transposed, b), c)
}
