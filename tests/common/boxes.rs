//! Boxes on random trees.
use super::random::Random;
use super::tree::{contains, graded, random_leaves};
use agimp::solver::given_boxes::GivenParticle;
use partition::{Brick, MAX_LEVEL, Octant};

/// Position of a node, root edges.
pub fn position<const D: usize>(place: [u32; D]) -> [f64; D] {
    place.map(|x| f64::from(x) / f64::from(1u32 << (MAX_LEVEL + 2)))
}

/// A particle of mass 1 whose nodal mass is its weight, and nodal momentum the weight's gradient for a step
/// of -1.
pub fn unit<const D: usize>(centre: [f64; D], half: [f64; D]) -> GivenParticle<D> {
    let (velocity, affine) = ([0.0; D], [[0.0; D]; D]);
    GivenParticle { position: centre, half, mass: 1.0, velocity, affine, energy: 1.0 }
}

/// Errors of double arithmetic grow with this number of a box (see the README of the golden data).
pub fn kappa<const D: usize>(centre: [f64; D], half: [f64; D]) -> f64 {
    (0..D).map(|a| ((centre[a].abs() + 1.0) / half[a]).max(1.0)).sum()
}

/// Edge of the cells of the leaf that holds a position.
pub fn cell_at<const D: usize>(leaves: &[Octant<D>], at: [f64; D]) -> f64 {
    let leaf = leaves.iter().find(|leaf| contains(leaf, at)).expect("the tree fills its brick");
    0.25 * 0.5f64.powi(i32::from(leaf.level))
}

/// All kinds of boxes.
pub const ALL: &[u64] = &[0, 1, 2, 3, 4, 5, 6, 7, 8];
/// Kinds of boxes at most one cell wide.
pub const NARROW: &[u64] = &[0, 1, 2, 5, 7, 8];
/// Kinds of boxes at most a few cells wide.
pub const WIDE: &[u64] = &[0, 1, 2, 3, 4, 5, 7, 8];

/// A box of a random kind inside the brick.
pub fn random_box<const D: usize>(
    random: &mut Random,
    brick: Brick<D>,
    leaves: &[Octant<D>],
    kinds: &[u64],
) -> ([f64; D], [f64; D]) {
    let extent = brick.roots.map(f64::from);
    let mut centre: [f64; D] = std::array::from_fn(|a| random.between(0.0, extent[a]));
    let h = cell_at(leaves, centre);
    let kind = kinds[random.below(kinds.len() as u64) as usize];
    let factor = |random: &mut Random| match kind {
        0 => 0.25,
        1 => 0.5,
        2 => random.between(0.1, 0.5),
        3 => random.between(0.5, 2.5),
        4 => 2.0 * random.between(0.05, 1.6),
        5 => 1e-3,
        6 => random.between(4.0, 6.0),
        _ => 0.5,
    };
    let same = factor(random);
    let mut half = [0.0; D];
    for axis in 0..D {
        // Kind 4 is a box of unlike widths.
        half[axis] = (h * if kind == 4 { factor(random) } else { same }).min(0.45 * extent[axis]);
        match kind {
            // Faces of the box on faces of cells, or the centre on a node.
            7 => centre[axis] = ((centre[axis] / h).floor() + 0.5) * h,
            8 => centre[axis] = (centre[axis] / h).round() * h,
            _ => {}
        }
    }
    // Some boxes at walls, edges and corners.
    for axis in 0..D {
        let wall = [half[axis], extent[axis] - half[axis]];
        centre[axis] = match random.below(8) {
            0 => wall[0],
            1 => wall[1],
            _ => centre[axis].clamp(wall[0], wall[1]),
        };
    }
    (centre, half)
}

/// Bricks and trees in turn, half of them graded.
pub fn random_tree<const D: usize>(
    random: &mut Random,
    number: usize,
    deepest: u8,
) -> (Brick<D>, Vec<Octant<D>>) {
    let mut roots = [1; D];
    roots[number % D] = 1 + number as u32 % 3 / 2;
    let brick = Brick { roots };
    let points = 2 + random.below(3);
    let leaves = random_leaves(random, brick, points, deepest);
    (brick, if number.is_multiple_of(2) { leaves } else { graded(leaves) })
}

/// A tree in which some leaves of level 1 touch leaves `jump` levels finer.
pub fn tree_with_jump<const D: usize>(random: &mut Random, jump: u8) -> (Brick<D>, Vec<Octant<D>>) {
    let brick = Brick { roots: [1; D] };
    let mut leaves: Vec<Octant<D>> =
        (0..1 << D).map(|i| Octant { level: 0, coord: [0; D] }.child(i)).collect();
    // The point lies beside the middle of the domain, where all leaves of level 1 meet.
    let at: [f64; D] = std::array::from_fn(|_| 0.5 + random.between(-1e-3, 1e-3));
    let level = 1 + jump;
    while let Some(index) = leaves.iter().position(|leaf| leaf.level < level && contains(leaf, at)) {
        let leaf = leaves.swap_remove(index);
        leaves.extend((0..1 << D).map(|child| leaf.child(child)));
    }
    (brick, leaves)
}
