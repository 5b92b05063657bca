//! Cuts of the curve that give every rank its share of the weight.

use crate::{Brick, Comm, Forest, Octant};

/// Where the curve may be cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CutAt {
    /// Between leaves that are not siblings: families stay whole, as [`Forest::adapt`] needs them to coarsen.
    Families,
    /// Between any two leaves: shares are more even.
    Leaves,
}

/// A place where the curve may be cut, between two leaves.
#[derive(Clone, Copy, Debug)]
struct Boundary {
    /// Weight of all leaves before it.
    before: u64,
    /// Key of the leaf after it.
    key: u64,
}

/// Number of integers that every rank reports of its leaves.
const SUMMARY: usize = 5;

/// New cuts of the curve, with the weights of ranks. The same on all ranks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cuts {
    /// Rank `r` gets the keys `markers[r]..markers[r + 1]`.
    pub(crate) markers: Vec<u64>,
    /// Weight before each marker.
    before: Vec<u64>,
    /// Revision of the forest they were made for.
    pub(crate) revision: u64,
}

impl Cuts {
    /// Not collective. Greatest weight of a rank over the mean; 1 if there is no weight.
    pub fn imbalance(&self) -> f64 {
        let ranks = self.before.len() - 1;
        let greatest = self.before.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
        match self.before[ranks] {
            0 => 1.0,
            total => greatest as f64 * ranks as f64 / total as f64,
        }
    }
}

/// Collective. Cuts that share out the weight: cut `r` is the boundary nearest to `r / ranks` of
/// the total weight (the earlier one of two equally near; next to the ideal place along the curve if
/// leaves without weight leave a choice). Depends on the leaves, their weights and the number of
/// ranks only, not on the present partition. If all weights are 0, all count the same.
///
/// One gather of five integers per rank and one reduction of two integers per rank.
pub(crate) fn cuts<const D: usize>(forest: &Forest<D>, comm: &Comm, weights: &[u64], at: CutAt) -> Cuts {
    assert_eq!(weights.len(), forest.leaves.len(), "one weight per leaf");
    let leaves = &forest.leaves;
    let mut before = Vec::with_capacity(leaves.len());
    let mut own_weight = 0u64;
    for &weight in weights {
        before.push(own_weight);
        own_weight = own_weight.checked_add(weight).expect("weights of a rank exceed 64 bits");
    }
    // Whether the curve may be cut before the first leaf depends on the rank before; others are known.
    let may_part = |one: &Octant<D>, next: &Octant<D>| at == CutAt::Leaves || !one.is_sibling(next);
    let starts_run = |i: usize| may_part(&leaves[i - 1], &leaves[i]);
    let second = (1..leaves.len()).find(|&i| starts_run(i));
    let summaries = comm.all_gather_u64(&[
        own_weight,
        leaves.first().map_or(0, Octant::code),
        leaves.last().map_or(0, Octant::code),
        second.map_or(u64::MAX, |i| before[i]),
        second.map_or(u64::MAX, |i| forest.keys[i]),
    ]);
    let total = summaries
        .chunks_exact(SUMMARY)
        .try_fold(0u64, |sum, s| sum.checked_add(s[0]))
        .expect("weights of all ranks exceed 64 bits");
    if total == 0 {
        return cuts(forest, comm, &vec![1; leaves.len()], at);
    }

    // First boundary of each rank (if any) and weight before each rank, from the summaries.
    let mut first_boundary: Vec<Option<Boundary>> = Vec::with_capacity(comm.size());
    let mut rank_before = Vec::with_capacity(comm.size());
    let mut first_starts = Vec::with_capacity(comm.size());
    let (mut weight_before, mut last) = (0u64, None::<Octant<D>>);
    for summary in summaries.chunks_exact(SUMMARY) {
        let first = Octant::<D>::from_code(summary[1]);
        let starts = first.is_some_and(|first| last.is_none_or(|last| may_part(&last, &first)));
        rank_before.push(weight_before);
        first_starts.push(starts);
        first_boundary.push(match first {
            Some(first) if starts => Some(Boundary { before: weight_before, key: first.key() }),
            _ => (summary[3] != u64::MAX)
                .then(|| Boundary { before: weight_before + summary[3], key: summary[4] }),
        });
        weight_before += summary[0];
        last = Octant::from_code(summary[2]).or(last);
    }

    let rank = comm.rank();
    let end = Boundary { before: total, key: Brick::<D>::KEY_END };
    let after_own = first_boundary[rank + 1..].iter().flatten().next().copied().unwrap_or(end);
    let own = (0..leaves.len())
        .filter(|&i| if i == 0 { first_starts[rank] } else { starts_run(i) })
        .map(|i| Boundary { before: rank_before[rank] + before[i], key: forest.keys[i] });

    // Each cut lies between two consecutive boundaries, of which exactly one rank owns the first.
    let mut markers = vec![0u64; 2 * (comm.size() + 1)];
    let mut lower: Option<Boundary> = None;
    for upper in own.chain([after_own]) {
        if let Some(lower) = lower {
            let (markers, before) = markers.split_at_mut(comm.size() + 1);
            place_cuts(markers, before, total, lower, upper);
        }
        lower = Some(upper);
    }
    comm.max_u64(&mut markers);
    let mut before = markers.split_off(comm.size() + 1);
    (markers[comm.size()], before[comm.size()]) = (Brick::<D>::KEY_END, total);
    Cuts { markers, before, revision: forest.revision }
}

/// Sets the markers of all cuts, and the weight before them, whose ideal place lies at `lower` or after it
/// and before `upper`.
fn place_cuts(markers: &mut [u64], before: &mut [u64], total: u64, lower: Boundary, upper: Boundary) {
    let ranks = (markers.len() - 1) as u128;
    // Everything times `ranks`, so that ideal places are integers.
    let (low, high) = (u128::from(lower.before) * ranks, u128::from(upper.before) * ranks);
    let total = u128::from(total);
    for cut in low.div_ceil(total).max(1)..high.div_ceil(total).min(ranks) {
        let ideal = cut * total;
        let nearest = if ideal - low <= high - ideal { lower } else { upper };
        (markers[cut as usize], before[cut as usize]) = (nearest.key, nearest.before);
    }
}
