//! Trees for tests.
use super::random::Random;
use partition::{Brick, Comm, Forest, Octant};
use serde_json::Value;

/// Collective. A forest of the leaves in equal shares.
pub(crate) fn forest_of<const D: usize>(
    comm: &Comm,
    brick: Brick<D>,
    mut leaves: Vec<Octant<D>>,
) -> Forest<D> {
    leaves.sort_unstable();
    let cut = |rank: usize| rank * leaves.len() / comm.size();
    let own = leaves[cut(comm.rank())..cut(comm.rank() + 1)].to_vec();
    Forest::from_leaves(comm, brick, own).expect("the leaves are a tree")
}

/// Octants `[level, i, j(, k)]` of a file.
pub(crate) fn octants<const D: usize>(list: &Value) -> Vec<Octant<D>> {
    let number = |value: &Value| value.as_u64().expect("a number") as u32;
    let octant = |entry: &Value| Octant {
        level: number(&entry[0]) as u8,
        coord: std::array::from_fn(|axis| number(&entry[axis + 1])),
    };
    list.as_array().expect("a list").iter().map(octant).collect()
}

/// A random tree: leaves around `points` points are split down to random levels, at most `deepest`, so that
/// neighbouring leaves differ by any number of levels.
pub(crate) fn random_leaves<const D: usize>(
    random: &mut Random,
    brick: Brick<D>,
    points: u64,
    deepest: u8,
) -> Vec<Octant<D>> {
    let roots = (0..brick.root_count()).map(|index| brick.root_on_curve(index));
    let mut leaves: Vec<Octant<D>> = roots.flat_map(|root| (0..1 << D).map(move |i| root.child(i))).collect();
    for _ in 0..points {
        let at: [f64; D] = std::array::from_fn(|axis| random.between(0.0, f64::from(brick.roots[axis])));
        let level = 2 + random.below(u64::from(deepest) - 1) as u8;
        while let Some(index) = leaves.iter().position(|leaf| leaf.level < level && contains(leaf, at)) {
            let leaf = leaves.swap_remove(index);
            leaves.extend((0..1 << D).map(|child| leaf.child(child)));
        }
    }
    leaves.sort_unstable();
    leaves
}

/// Whether a position in root edges lies in the octant.
pub(crate) fn contains<const D: usize>(octant: &Octant<D>, at: [f64; D]) -> bool {
    let scale = f64::from(1u32 << octant.level);
    (0..D).all(|axis| (at[axis] * scale) as u32 == octant.coord[axis])
}

/// Splits each leaf that touches one more than a level finer, until there is none.
pub(crate) fn graded<const D: usize>(mut leaves: Vec<Octant<D>>) -> Vec<Octant<D>> {
    while let Some(index) = (0..leaves.len())
        .find(|&i| leaves.iter().any(|other| other.level > leaves[i].level + 1 && other.touches(&leaves[i])))
    {
        let leaf = leaves.swap_remove(index);
        leaves.extend((0..1 << D).map(|child| leaf.child(child)));
    }
    leaves.sort_unstable();
    leaves
}
