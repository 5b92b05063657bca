//! The same operations on a whole tree in one place, in the simplest form.

use std::collections::BTreeSet;

use partition::{Brick, Comm, CutAt, Forest, MAX_LEVEL, Mark, Octant};

/// All leaves of a tree.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Oracle<const D: usize> {
    pub brick: Brick<D>,
    pub leaves: BTreeSet<Octant<D>>,
}

impl<const D: usize> Oracle<D> {
    pub(crate) fn uniform(brick: Brick<D>, level: u8) -> Self {
        let mut leaves: BTreeSet<Octant<D>> = (0..brick.root_count())
            .map(|mut i| {
                let coord = std::array::from_fn(|a| {
                    let n = u64::from(brick.roots[a]);
                    let c = i % n;
                    i /= n;
                    c as u32
                });
                Octant { level: 0, coord }
            })
            .collect();
        for _ in 0..level {
            leaves = leaves.iter().flat_map(children).collect();
        }
        Oracle { brick, leaves }
    }

    pub(crate) fn adapt(&mut self, mark: impl Fn(&Octant<D>) -> Mark) {
        let mut result = BTreeSet::new();
        for leaf in &self.leaves {
            let coarsens = |l: &Octant<D>| self.leaves.contains(l) && mark(l) == Mark::Coarsen;
            match (mark(leaf), leaf.parent()) {
                (Mark::Refine, _) if leaf.level < MAX_LEVEL => result.extend(children(leaf)),
                (Mark::Coarsen, Some(parent)) if children(&parent).iter().all(coarsens) => {
                    result.insert(parent);
                }
                _ => {
                    result.insert(*leaf);
                }
            }
        }
        self.leaves = result;
    }

    pub(crate) fn refine_where(&mut self, wanted: impl Fn(&Octant<D>) -> bool) {
        while let Some(leaf) = self.leaves.iter().find(|l| l.level < MAX_LEVEL && wanted(l)).copied() {
            self.split(&leaf);
        }
    }

    /// Splits each leaf that touches one more than a level finer, until there is none.
    pub(crate) fn balance(&mut self) {
        loop {
            let too_coarse: Vec<_> = self.leaves.iter().filter(|&leaf| !self.fits(leaf)).copied().collect();
            if too_coarse.is_empty() {
                return;
            }
            too_coarse.iter().for_each(|leaf| self.split(leaf));
        }
    }

    pub(crate) fn is_balanced(&self) -> bool {
        self.leaves.iter().all(|leaf| self.fits(leaf))
    }

    fn fits(&self, leaf: &Octant<D>) -> bool {
        !self.leaves.iter().any(|other| other.level > leaf.level + 1 && other.touches(leaf))
    }

    fn split(&mut self, leaf: &Octant<D>) {
        self.leaves.remove(leaf);
        self.leaves.extend(children(leaf));
    }

    /// Number of leaves of each rank for these weights: each cut is nearest to its ideal place, between
    /// families runs of siblings are whole.
    pub(crate) fn shares(&self, ranks: usize, at: CutAt, weight: impl Fn(&Octant<D>) -> u64) -> Vec<usize> {
        let leaves: Vec<_> = self.leaves.iter().copied().collect();
        let mut weights: Vec<u64> = leaves.iter().map(weight).collect();
        if weights.iter().all(|&w| w == 0) {
            weights.fill(1);
        }
        let total: u64 = weights.iter().sum();
        // Places to cut, with the weight before each.
        let mut places: Vec<(u64, usize)> = Vec::new();
        let mut before = 0;
        for i in 0..=leaves.len() {
            let torn =
                |i: usize| leaves[i].parent().is_some() && leaves[i].parent() == leaves[i - 1].parent();
            if i == 0 || i == leaves.len() || at == CutAt::Leaves || !torn(i) {
                places.push((before, i));
            }
            before += weights.get(i).unwrap_or(&0);
        }
        // Nearest in weight; the earlier of two on both sides; next to the ideal place along the
        // curve if leaves without weight leave a choice.
        let cost = |&&(before, i): &&(u64, usize), rank: usize| {
            let beyond = i128::from(before) * ranks as i128 - i128::from(total) * rank as i128;
            let order = if beyond > 0 { i as i64 } else { -(i as i64) };
            (beyond.abs(), beyond > 0, order)
        };
        let mut cuts = vec![0];
        cuts.extend((1..ranks).map(|r| places.iter().min_by_key(|place| cost(place, r)).expect("a place").1));
        cuts.push(leaves.len());
        cuts.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }
}

pub(crate) fn children<const D: usize>(octant: &Octant<D>) -> Vec<Octant<D>> {
    (0..Octant::<D>::CHILDREN).map(|i| octant.child(i)).collect()
}

/// Collective. Leaves of each rank, everywhere. The library itself never does this.
pub(crate) fn all_leaves<const D: usize>(comm: &Comm, forest: &Forest<D>) -> Vec<Vec<Octant<D>>> {
    let bytes: Vec<u8> = forest.leaves().iter().flat_map(|leaf| leaf.code().to_ne_bytes()).collect();
    let gathered = comm.gather_bytes(&bytes);
    (0..comm.size())
        .map(|rank| {
            let mut bytes = gathered.as_ref().map_or(Vec::new(), |all| all[rank].clone());
            comm.broadcast_bytes(0, &mut bytes);
            let code = |b: &[u8]| u64::from_ne_bytes(b.try_into().expect("eight bytes"));
            bytes.chunks_exact(8).map(|b| Octant::from_code(code(b)).expect("a code")).collect()
        })
        .collect()
}

/// Collective. Checks that the forest is valid and has the leaves of the oracle.
pub(crate) fn assert_same<const D: usize>(comm: &Comm, forest: &Forest<D>, oracle: &Oracle<D>, what: &str) {
    if let Err(error) = forest.is_valid(comm) {
        panic!("after {what}: {error}");
    }
    let all = all_leaves(comm, forest);
    assert!(all.iter().flatten().eq(oracle.leaves.iter()), "after {what}: different leaves");
    assert_eq!(forest.global_len(), oracle.leaves.len() as u64);
    assert_eq!(forest.first_index(), all[..comm.rank()].iter().map(|l| l.len() as u64).sum::<u64>());
    for (rank, leaves) in all.iter().enumerate() {
        for leaf in leaves {
            for key in [leaf.key(), leaf.key_end() - 1] {
                assert_eq!(forest.owner(key), rank);
                let found = forest.find(key).map(|i| forest.leaves()[i]);
                assert_eq!(found, (rank == comm.rank()).then_some(*leaf));
            }
        }
    }
}
