//! How much surface partitions have along the Morton curve and along the Hilbert curve.
use std::collections::{BTreeMap, BTreeSet};

use partition::{Brick, MAX_LEVEL, Octant};

/// A way through the tree that visits every octant's descendants one after another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Curve {
    /// The order of the forest.
    Morton,
    /// Neighbours along the curve share a face.
    Hilbert,
}

/// Surface of a partition.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    /// Ghost leaves with particles, summed over all ranks: leaves that touch a leaf of another rank.
    pub ghosts: usize,
    /// Faces of cells between ranks, of the finer side, where both sides have particles.
    pub faces: f64,
    /// Mean number of neighbour ranks.
    pub neighbours: f64,
    /// Greatest number of neighbour ranks.
    pub most_neighbours: usize,
}

/// Place of an octant's lower corner along the Hilbert curve through a cube around the brick (J. Skilling,
/// Programming the Hilbert curve, AIP Conf. Proc. 707 (2004) 381).
fn hilbert<const D: usize>(octant: &Octant<D>, bits: u32) -> u128 {
    let mut x: [u32; D] = octant.coord.map(|c| c << (MAX_LEVEL - octant.level));
    let highest = 1u32 << (bits - 1);
    let mut q = highest;
    while q > 1 {
        let low = q - 1;
        for i in 0..D {
            if x[i] & q != 0 {
                x[0] ^= low;
            } else {
                let t = (x[0] ^ x[i]) & low;
                x[0] ^= t;
                x[i] ^= t;
            }
        }
        q >>= 1;
    }
    for i in 1..D {
        x[i] ^= x[i - 1];
    }
    let mut t = 0;
    q = highest;
    while q > 1 {
        if x[D - 1] & q != 0 {
            t ^= q - 1;
        }
        q >>= 1;
    }
    x.iter_mut().for_each(|x| *x ^= t);
    (0..bits)
        .rev()
        .fold(0u128, |index, bit| x.iter().fold(index, |index, x| index << 1 | u128::from(x >> bit & 1)))
}

/// Cuts the tree along a curve into `ranks` parts of equal weight, families whole, and measures their surface.
pub(crate) fn surface<const D: usize>(
    curve: Curve,
    brick: &Brick<D>,
    leaves: &[Octant<D>],
    particles: &[usize],
    ranks: usize,
) -> Surface {
    let roots = brick.roots.iter().copied().max().unwrap_or(1).next_power_of_two();
    let bits = u32::from(MAX_LEVEL) + roots.trailing_zeros();
    let mut order: Vec<usize> = (0..leaves.len()).collect();
    match curve {
        Curve::Morton => order.sort_by_key(|&leaf| leaves[leaf].key()),
        Curve::Hilbert => order.sort_by_key(|&leaf| hilbert(&leaves[leaf], bits)),
    }
    let weight = |leaf: usize| if particles[leaf] == 0 { 1 } else { 8 + particles[leaf] };
    let total: usize = (0..leaves.len()).map(weight).sum();
    let mut owner = vec![0; leaves.len()];
    let mut before = 0;
    let mut rank = 0;
    let mut previous: Option<usize> = None;
    for &leaf in &order {
        let in_family =
            previous.is_some_and(|p| leaves[p].level > 0 && leaves[p].parent() == leaves[leaf].parent());
        if !in_family {
            rank = ((before + weight(leaf) / 2) * ranks / total).min(ranks - 1).max(rank);
        }
        owner[leaf] = rank;
        before += weight(leaf);
        previous = Some(leaf);
    }
    measure(brick, leaves, particles, &owner, ranks)
}

fn measure<const D: usize>(
    brick: &Brick<D>,
    leaves: &[Octant<D>],
    particles: &[usize],
    owner: &[usize],
    ranks: usize,
) -> Surface {
    let by_key: BTreeMap<u64, usize> = leaves.iter().enumerate().map(|(i, leaf)| (leaf.key(), i)).collect();
    let mut ghosts = BTreeSet::new();
    let mut neighbours = vec![BTreeSet::new(); ranks];
    let mut faces = 0.0;
    for (leaf, octant) in leaves.iter().enumerate() {
        for number in 0..3usize.pow(D as u32) {
            let offset: [i32; D] =
                std::array::from_fn(|axis| (number / 3usize.pow(axis as u32) % 3) as i32 - 1);
            let Some(beside) = octant.neighbour(offset, brick) else { continue };
            // A leaf of the same size or larger; smaller ones find this leaf themselves.
            let Some((_, &other)) = by_key.range(..=beside.key()).next_back() else { continue };
            let (a, b) = (owner[leaf], owner[other]);
            if a == b || leaves[other].level > octant.level {
                continue;
            }
            for (rank, ghost) in [(a, other), (b, leaf)] {
                if particles[ghost] > 0 {
                    ghosts.insert((rank, ghost));
                }
            }
            neighbours[a].insert(b);
            neighbours[b].insert(a);
            let is_face = offset.iter().filter(|o| **o != 0).count() == 1;
            if is_face && particles[leaf] > 0 && particles[other] > 0 {
                // Leaves of one size find each other twice.
                let share = if leaves[other].level == octant.level { 0.5 } else { 1.0 };
                faces += share * 4f64.powi(D as i32 - 1);
            }
        }
    }
    let counts: Vec<usize> = neighbours.iter().map(BTreeSet::len).collect();
    Surface {
        ghosts: ghosts.len(),
        faces,
        neighbours: counts.iter().sum::<usize>() as f64 / ranks as f64,
        most_neighbours: counts.into_iter().max().unwrap_or(0),
    }
}
