//! Scenarios that change trees and partitions.

use partition::{Brick, Comm, CutAt, Forest, ForestError, MAX_LEVEL, Mark, Octant, Region, correspondence};

use crate::oracle::{Oracle, all_leaves, assert_same};
use crate::random::{Random, hash};
use crate::scenarios::report;

/// A small brick with random numbers of roots; one of a single root now and then.
pub(crate) fn random_brick<const D: usize>(random: &mut Random) -> Brick<D> {
    let most = if random.one_in(4) { 1 } else { 3 };
    Brick { roots: std::array::from_fn(|_| 1 + random.below(most) as u32) }
}

/// Marks by octant. Coarsening goes by parent, or whole families would hardly ever occur.
fn mark<const D: usize>(seed: u64, leaf: &Octant<D>) -> Mark {
    let parent = leaf.parent().unwrap_or(*leaf);
    match (hash(seed, leaf.code()) % 16, hash(seed + 1, parent.code()) % 2) {
        (0..=2, _) if leaf.level < 6 => Mark::Refine,
        (_, 0) => Mark::Coarsen,
        _ => Mark::Keep,
    }
}

/// Weights of very different size, zero included.
fn weight<const D: usize>(seed: u64, leaf: &Octant<D>) -> u64 {
    match seed % 4 {
        0 => 1,
        1 => hash(seed, leaf.code()) % 100,
        2 => u64::from(hash(seed, leaf.code()).is_multiple_of(50)) * 1_000_000_007,
        _ => 0,
    }
}

/// A list that belongs to a leaf: of varying length, empty for some.
fn payload<const D: usize>(leaf: &Octant<D>) -> Vec<[u16; 3]> {
    (0..leaf.code() % 4).map(|i| [i as u16, leaf.code() as u16, (leaf.code() >> 16) as u16]).collect()
}

pub(crate) fn random_trees<const D: usize>(comm: &Comm) {
    for seed in 0..if D == 2 { 12 } else { 6 } {
        let mut random = Random::new(seed);
        // The first tree begins as one leaf, so that most ranks are empty for a while.
        let (brick, level) = match seed {
            0 => (Brick { roots: [1; D] }, 0),
            _ => (random_brick::<D>(&mut random), random.below(3) as u8),
        };
        let mut forest = Forest::uniform(comm, brick, level);
        let mut oracle = Oracle::uniform(brick, level);
        assert_same(comm, &forest, &oracle, "uniform");
        for round in 0..5 {
            let seed = random.next();
            if round == 2 {
                refine_towards_a_point(comm, &mut forest, &mut oracle, &mut random);
            }
            // The oracle's work grows with the square of the number of leaves.
            if oracle.leaves.len() < 600 {
                adapt(comm, &mut forest, &mut oracle, seed);
            }
            balance(comm, &mut forest, &mut oracle);
            share_out(comm, &mut forest, &oracle, seed);
            report(comm, format_args!("{seed} {} {:016x}", oracle.leaves.len(), forest.checksum(comm)));
        }
    }
}

fn adapt<const D: usize>(comm: &Comm, forest: &mut Forest<D>, oracle: &mut Oracle<D>, seed: u64) {
    let old = forest.leaves().to_vec();
    let marks: Vec<Mark> = old.iter().map(|leaf| mark(seed, leaf)).collect();
    let (revision, before) = (forest.revision(), oracle.clone());
    let changed = forest.adapt(comm, &marks);
    oracle.adapt(|leaf| mark(seed, leaf));
    assert_same(comm, forest, oracle, "adapt");
    assert_eq!(changed, *oracle != before);
    assert_eq!(forest.revision(), revision + u64::from(changed));
    let mut ends = (0, 0);
    for (from, to) in correspondence(&old, forest.leaves()) {
        assert_eq!((from.start, to.start), ends);
        ends = (from.end, to.end);
        let (from, to) = (&old[from], &forest.leaves()[to]);
        assert!(from.len() == 1 || to.len() == 1);
        assert_eq!(from[0].key(), to[0].key());
        assert_eq!(from[from.len() - 1].key_end(), to[to.len() - 1].key_end());
    }
    assert_eq!(ends, (old.len(), forest.leaves().len()));
}

/// Makes the tree deep at one place, so that balance has to travel far.
fn refine_towards_a_point<const D: usize>(
    comm: &Comm,
    forest: &mut Forest<D>,
    oracle: &mut Oracle<D>,
    random: &mut Random,
) {
    let size = forest.brick().lattice_size();
    let point: [u32; D] = std::array::from_fn(|a| random.below(u64::from(size[a])) as u32);
    let depth = if D == 2 { 10 } else { 5 };
    let cell = Octant { level: MAX_LEVEL, coord: point };
    let wanted = |octant: &Octant<D>| octant.level < depth && octant.contains(&cell);
    forest.refine_where(comm, wanted);
    oracle.refine_where(wanted);
    assert_same(comm, forest, oracle, "refine_where");
    assert_eq!(forest.is_balanced(comm), oracle.is_balanced());
}

fn balance<const D: usize>(comm: &Comm, forest: &mut Forest<D>, oracle: &mut Oracle<D>) {
    let already = oracle.is_balanced();
    let checksum = forest.checksum(comm);
    assert_eq!(forest.is_balanced(comm), already);
    assert_eq!(forest.balance(comm), !already);
    oracle.balance();
    assert_same(comm, forest, oracle, "balance");
    assert!(forest.is_balanced(comm) && !forest.balance(comm));
    assert_eq!(forest.checksum(comm) == checksum, already);
}

fn share_out<const D: usize>(comm: &Comm, forest: &mut Forest<D>, oracle: &Oracle<D>, seed: u64) {
    // Families last: the next steps may coarsen.
    for at in [CutAt::Leaves, CutAt::Families] {
        share_out_at(comm, forest, oracle, seed, at);
    }
}

fn share_out_at<const D: usize>(
    comm: &Comm,
    forest: &mut Forest<D>,
    oracle: &Oracle<D>,
    seed: u64,
    at: CutAt,
) {
    let old = forest.leaves().to_vec();
    let weights: Vec<u64> = old.iter().map(|leaf| weight(seed, leaf)).collect();
    let (revision, checksum) = (forest.revision(), forest.checksum(comm));
    let cuts = forest.plan_partition(comm, &weights, at);
    assert_eq!(cuts, forest.plan_partition(comm, &weights, at));
    let imbalance = cuts.imbalance();
    let shipment = forest.partition_at(comm, cuts);
    assert_same(comm, forest, oracle, "partition");
    assert_eq!(forest.checksum(comm), checksum);
    assert_eq!(forest.revision(), revision + u64::from(shipment.changed()));
    assert_eq!(shipment.changed(), comm.any(old != forest.leaves()));
    let all = all_leaves(comm, forest);
    let shares: Vec<usize> = all.iter().map(Vec::len).collect();
    assert_eq!(shares, oracle.shares(comm.size(), at, |leaf| weight(seed, leaf)));
    for (rank, leaves) in all.iter().enumerate() {
        for after in all[rank + 1..].iter().filter_map(|l| l.first()).take(1) {
            let torn = leaves.last().is_some_and(|last| last.is_sibling(after));
            assert!(at == CutAt::Leaves || !torn, "a family is torn");
        }
    }

    let mut load = [forest.leaves().iter().map(|leaf| weight(seed, leaf)).sum::<u64>(); 2];
    comm.max_u64(&mut load[..1]);
    comm.sum_u64(&mut load[1..]);
    if load[1] > 0 {
        assert_eq!(imbalance, load[0] as f64 * comm.size() as f64 / load[1] as f64);
    }

    let moved = shipment.move_items(
        comm,
        old.iter().map(payload).collect(),
        |items: &Vec<_>, bytes| bytes.extend_from_slice(bytemuck::cast_slice(items)),
        bytemuck::allocation::pod_collect_to_vec,
    );
    assert!(moved.iter().eq(forest.leaves().iter().map(payload).collect::<Vec<_>>().iter()));
    let tags = old.iter().map(|_| vec![comm.rank() as u8]).collect();
    let tags = shipment.move_items(comm, tags, |tag, bytes| bytes.extend_from_slice(tag), <[u8]>::to_vec);
    for (source, range) in shipment.receives() {
        assert!(tags[range.clone()].iter().all(|tag| tag[..] == [*source as u8]));
    }
    let (from, to) = shipment.kept();
    assert_eq!(old[from], forest.leaves()[to.clone()]);
    assert!(tags[to].iter().all(|tag| tag[..] == [comm.rank() as u8]));
    // Once more with the same weights: nothing to do.
    let weights: Vec<u64> = forest.leaves().iter().map(|leaf| weight(seed, leaf)).collect();
    let again = forest.partition(comm, &weights, at);
    assert!(!again.changed() && again.sends().is_empty() && again.receives().is_empty());
}

/// Uniform trees of bricks of many shapes are cut as `partition` cuts them.
pub(crate) fn uniform(comm: &Comm) {
    for roots in [[1, 1], [3, 1], [5, 7], [64, 1], [9, 64]] {
        for level in 0..3 {
            let brick = Brick { roots };
            let mut forest = Forest::uniform(comm, brick, level);
            assert_same(comm, &forest, &Oracle::uniform(brick, level), "uniform");
            let weights = vec![17; forest.leaves().len()];
            assert!(!forest.partition(comm, &weights, CutAt::Families).changed(), "{roots:?} level {level}");
            forest.is_valid(comm).expect("valid");
            report(comm, format_args!("{:016x}", forest.checksum(comm)));
        }
    }
    // Far too many leaves to count one by one on the way to the cuts; few are made.
    let brick = Brick { roots: [1, 2, 1] };
    let forest = Forest::uniform(comm, brick, 4);
    assert_eq!(forest.global_len(), 2 << 12);
    assert_same(comm, &forest, &Oracle::uniform(brick, 4), "uniform");
}

/// The same tree given in segments cut anywhere, families torn, is cut the same afterwards.
pub(crate) fn given_leaves(comm: &Comm) {
    for seed in 0..12 {
        let mut random = Random::new(100 + seed);
        let brick = random_brick::<2>(&mut random);
        let mut oracle = Oracle::uniform(brick, 1);
        for _ in 0..3 {
            let seed = random.next();
            oracle.adapt(|leaf| mark(seed, leaf));
        }
        let all: Vec<_> = oracle.leaves.iter().copied().collect();
        let mut cuts: Vec<usize> =
            (1..comm.size()).map(|_| random.below(all.len() as u64 + 1) as usize).collect();
        cuts.extend([0, all.len()]);
        cuts.sort_unstable();
        let own = all[cuts[comm.rank()]..cuts[comm.rank() + 1]].to_vec();
        let mut forest = Forest::from_leaves(comm, brick, own).expect("a tree");
        assert_same(comm, &forest, &oracle, "from_leaves");
        share_out(comm, &mut forest, &oracle, seed);
        balance(comm, &mut forest, &mut oracle);
        // All on one rank, then back.
        let to = random.below(comm.size() as u64) as usize;
        let own = if comm.rank() == to { oracle.leaves.iter().copied().collect() } else { vec![] };
        let mut forest = Forest::from_leaves(comm, brick, own).expect("a tree");
        assert_same(comm, &forest, &oracle, "from_leaves");
        adapt(comm, &mut forest, &mut oracle, seed);
        balance(comm, &mut forest, &mut oracle);
        share_out(comm, &mut forest, &oracle, seed + 1);
        report(comm, format_args!("{} {:016x}", all.len(), forest.checksum(comm)));
        let everything = Region { lo: [0; 2], hi: [u32::MAX; 2] };
        let found = forest.leaves_in(comm, &[everything]);
        assert!(found.iter().map(|(leaf, _)| leaf).eq(oracle.leaves.iter()));
    }
}

/// Leaves that are no tree are refused with the same words on all ranks.
pub(crate) fn bad_leaves(comm: &Comm) {
    let brick = Brick { roots: [2, 1] };
    let good: Vec<_> = Oracle::uniform(brick, 2).leaves.into_iter().collect();
    let last = comm.rank() == comm.size() - 1;
    let attempt = |leaves: Vec<Octant<2>>| {
        let own = if last { leaves } else { vec![] };
        Forest::from_leaves(comm, brick, own).expect_err("no tree").to_string()
    };
    let blame = |text: &str| format!("rank {}: {text}", comm.size() - 1);

    let mut swapped = good.clone();
    swapped.swap(3, 4);
    assert_eq!(attempt(swapped), blame("leaf 4 overlaps or precedes the leaf before it"));
    let mut overlapping = good.clone();
    overlapping[5] = overlapping[5].child(0).child(0).ancestor(2).parent().expect("a parent");
    assert_eq!(attempt(overlapping), blame("leaf 5 overlaps or precedes the leaf before it"));
    let mut outside = good.clone();
    outside[7].coord[1] = 4;
    assert_eq!(attempt(outside), blame("leaf 7 lies outside the brick or is too deep"));
    let mut deep = good.clone();
    deep[0].level = 16;
    assert_eq!(attempt(deep), blame("leaf 0 lies outside the brick or is too deep"));
    assert_eq!(attempt(good[1..].to_vec()), {
        let cell = 1u64 << (2 * (MAX_LEVEL - 2));
        format!("the leaves cover {} of {} finest octants", 31 * cell, 32 * cell)
    });
    let twice = Forest::from_leaves(comm, brick, good.clone());
    match comm.size() {
        1 => assert!(twice.is_ok()),
        _ => assert_eq!(twice.expect_err("each leaf twice"), ForestError::Seam { rank: 1 }),
    }
    let no_brick = Forest::from_leaves(comm, Brick { roots: [65, 1] }, good);
    assert_eq!(no_brick.expect_err("too many roots"), ForestError::Brick);
}
