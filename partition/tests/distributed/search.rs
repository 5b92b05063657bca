//! Scenarios of searching leaves of other ranks.

use partition::{Brick, Comm, CutAt, Forest, MAX_LEVEL, Octant, Region};

use crate::oracle::all_leaves;
use crate::random::{Random, hash};
use crate::scenarios::report;
use crate::tree::random_brick;

/// Boxes of any size, also flat, empty or outside; many with faces on octant boundaries.
fn random_region<const D: usize>(random: &mut Random, brick: &Brick<D>) -> Region<D> {
    let size = brick.lattice_size();
    let grain = 1 << random.below(u64::from(MAX_LEVEL) + 1);
    let reach = 1 << random.below(u64::from(MAX_LEVEL) + 2);
    let mut region = Region { lo: [0; D], hi: [0; D] };
    for a in 0..D {
        let lo = random.below(u64::from(size[a]) * 9 / 8) as u32;
        region.lo[a] = if random.one_in(2) { lo / grain * grain } else { lo };
        region.hi[a] = region.lo[a] + if random.one_in(4) { 0 } else { random.below(reach) as u32 };
    }
    if random.one_in(20) {
        std::mem::swap(&mut region.lo, &mut region.hi);
    }
    region
}

pub(crate) fn random_queries<const D: usize>(comm: &Comm) {
    for seed in 0..6 {
        let mut random = Random::new(1000 + seed);
        let brick = random_brick::<D>(&mut random);
        let mut forest = Forest::uniform(comm, brick, random.below(2) as u8);
        let (salt, depth) = (random.next(), if D == 2 { 7 } else { 4 });
        forest.refine_where(comm, |o| o.level < depth && hash(salt, o.code()).is_multiple_of(2));
        if seed % 2 == 0 {
            forest.balance(comm);
        }
        let weights: Vec<u64> = forest.leaves().iter().map(|o| hash(seed, o.code()) % 10).collect();
        forest.partition(comm, &weights, CutAt::Families);
        forest.is_valid(comm).expect("valid");
        let all = all_leaves(comm, &forest);
        let mut found_in_total = 0;
        for round in 0..60 {
            // Ranks ask for different things, some for nothing. The draws are common to all.
            let mut queries = Vec::new();
            for rank in 0..4 {
                let regions: Vec<_> =
                    (0..random.below(4)).map(|_| random_region(&mut random, &brick)).collect();
                if rank % comm.size() == comm.rank() {
                    queries.extend(regions);
                }
            }
            if round == 0 {
                queries = forest.leaves().iter().map(Region::of).collect();
            }
            let found = forest.leaves_in(comm, &queries);
            let meets = |leaf: &Octant<D>| queries.iter().any(|q| q.meets(leaf));
            let expected: Vec<(Octant<D>, usize)> = (0..comm.size())
                .flat_map(|rank| all[rank].iter().map(move |leaf| (*leaf, rank)))
                .filter(|(leaf, _)| meets(leaf))
                .collect();
            assert_eq!(found, expected, "seed {seed} round {round}: {queries:?}");
            for query in &queries {
                let mut own = Vec::new();
                forest.own_leaves_in(query, &mut |leaf| own.push(leaf));
                own.sort_unstable();
                let leaves = forest.leaves();
                assert!(
                    own.iter().eq((0..leaves.len())
                        .filter(|&i| query.meets(&leaves[i]))
                        .collect::<Vec<_>>()
                        .iter())
                );
            }
            found_in_total += found.len();
        }
        assert!(found_in_total > 0 || comm.size() > 1);
        report(comm, format_args!("{} {:016x}", forest.global_len(), forest.checksum(comm)));
    }
}
