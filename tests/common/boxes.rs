//! Boxes on random trees.
use super::random::Random;
use super::tree::{contains, graded, random_leaves};
use agimp::grid::{KnownTree, direct};
use agimp::solver::diagnostics::given_boxes::GivenParticle;
use partition::{Brick, MAX_LEVEL, Octant};
use std::collections::BTreeMap;

/// Position of a node, root edges.
pub(crate) fn position<const D: usize>(place: [u32; D]) -> [f64; D] {
    place.map(|x| f64::from(x) / f64::from(1u32 << (MAX_LEVEL + 2)))
}

/// A particle of mass 1 whose nodal mass is its weight, and nodal momentum the weight's gradient for a step
/// of -1.
pub(crate) fn unit<const D: usize>(centre: [f64; D], half: [f64; D]) -> GivenParticle<D> {
    let (velocity, affine) = ([0.0; D], [[0.0; D]; D]);
    GivenParticle { position: centre, half, mass: 1.0, velocity, affine, energy: 1.0 }
}

/// Errors of double arithmetic grow with this number of a box (see the README of the golden data).
pub(crate) fn kappa<const D: usize>(centre: [f64; D], half: [f64; D]) -> f64 {
    (0..D).map(|a| ((centre[a].abs() + 1.0) / half[a]).max(1.0)).sum()
}

/// Edge of the cells of the leaf that holds a position.
pub(crate) fn cell_at<const D: usize>(leaves: &[Octant<D>], at: [f64; D]) -> f64 {
    let leaf = leaves.iter().find(|leaf| contains(leaf, at)).expect("the tree fills its brick");
    0.25 * 0.5f64.powi(i32::from(leaf.level))
}

/// A box, by centre and half widths, and its share of the volume of the one that it was cut from.
pub(crate) type Part<const D: usize> = ([f64; D], [f64; D], f64);

/// The boxes that are transferred in place of one: equal parts, cut along the axes on which they are wider
/// than the finest cell that they overlap.
pub(crate) fn parts<const D: usize>(leaves: &[Octant<D>], whole: Part<D>) -> Vec<Part<D>> {
    let (centre, half, share) = whole;
    let overlaps = |leaf: &Octant<D>| {
        let edge = 0.5f64.powi(i32::from(leaf.level));
        (0..D).all(|a| {
            let lower = f64::from(leaf.coord[a]) * edge;
            centre[a] - half[a] < lower + edge && centre[a] + half[a] > lower
        })
    };
    let finest = leaves.iter().filter(|leaf| overlaps(leaf)).map(|leaf| leaf.level).max();
    let cell = 0.25 * 0.5f64.powi(i32::from(finest.expect("a leaf below the box")));
    let wide = half.map(|half| half > 0.5 * cell * (1.0 + 8.0 * f64::EPSILON));
    let count = wide.iter().filter(|&&wide| wide).count();
    if count == 0 {
        return vec![whole];
    }
    let smaller: [f64; D] = std::array::from_fn(|a| if wide[a] { 0.5 * half[a] } else { half[a] });
    let corners = (0..1u32 << D).filter(|corner| (0..D).all(|a| wide[a] || corner >> a & 1 == 0));
    let side = |corner: u32, a: usize| f64::from(2 * (corner >> a & 1)) - 1.0;
    let at = |corner, a: usize| centre[a] + if wide[a] { side(corner, a) * smaller[a] } else { 0.0 };
    let cut = corners.map(|c| (std::array::from_fn(|a| at(c, a)), smaller, share / f64::from(1u32 << count)));
    cut.flat_map(|part| parts(leaves, part)).collect()
}

/// `Σ V |∇w|` at each node: over the boxes that are transferred, and over the boxes as given.
pub(crate) fn gradient_sums<const D: usize>(
    brick: Brick<D>,
    leaves: &[Octant<D>],
    boxes: &[GivenParticle<D>],
) -> [BTreeMap<[u32; D], f64>; 2] {
    let tree = KnownTree::whole(brick, leaves.to_vec());
    let mut sums = [BTreeMap::new(), BTreeMap::new()];
    for given in boxes {
        let whole = (given.position, given.half, 1.0);
        for (sum, boxes) in sums.iter_mut().zip([parts(leaves, whole), vec![whole]]) {
            for (centre, half, share) in boxes {
                for node in direct::weights(&tree, 1.0, centre, half) {
                    let length = node.gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
                    *sum.entry(node.place).or_insert(0.0) += share * given.mass * length;
                }
            }
        }
    }
    sums
}

/// All kinds of boxes.
pub(crate) const ALL: &[u64] = &[0, 1, 2, 3, 4, 5, 6, 7, 8];
/// Kinds of boxes at most one cell wide.
pub(crate) const NARROW: &[u64] = &[0, 1, 2, 5, 7, 8];
/// Kinds of boxes at most a few cells wide.
pub(crate) const WIDE: &[u64] = &[0, 1, 2, 3, 4, 5, 7, 8];

/// A box of a random kind inside the brick.
pub(crate) fn random_box<const D: usize>(
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
pub(crate) fn random_tree<const D: usize>(
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
pub(crate) fn tree_with_jump<const D: usize>(random: &mut Random, jump: u8) -> (Brick<D>, Vec<Octant<D>>) {
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
