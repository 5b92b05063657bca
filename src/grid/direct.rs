//! The definition of the weights, cell by cell, as an oracle for the transfers of a run.
//!
//! The box is cut by the leaf cells. Each cell gives its corners the integral of its own multilinear hat
//! functions over its share of the box, divided by the volume of the box. The sum of a hanging node goes to
//! the corners of the coarse cell on whose surface it lies, with the weights of multilinear interpolation
//! there, again and again until only real nodes are left (Gao et al. 2017, section 4). Nothing here is shared
//! with bins, arenas and constraints; it is slow and needs the whole tree.
//!
//! In axisymmetry the first axis is the radius, and all integrals carry r / r_p with the radius r_p of the
//! box's centre: one degree more along that axis, and all else as it is.
use std::collections::BTreeMap;

use partition::{MAX_LEVEL, Octant};

use super::plan::ghost_layer::KnownTree;
use crate::kernel::{BLOCK, Coordinates};

/// Weight of one real node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectNode<const D: usize> {
    /// Position in cells of the finest level, `2^-(MAX_LEVEL + 2)` root edges.
    pub place: [u32; D],
    /// Mean of the node's basis function over the box.
    pub weight: f64,
    /// Mean of its gradient, 1/m.
    pub gradient: [f64; D],
}

/// Weight and gradient on the way to a real node.
type Share<const D: usize> = (f64, [f64; D]);

/// Weights of the box with `centre` and half widths `half` (m, relative to the domain's lower corner), by
/// node in lexicographic order, first axis slowest. Parts outside the domain contribute nothing.
pub fn weights<const D: usize>(
    tree: &KnownTree<D>,
    root_edge: f64,
    centre: [f64; D],
    half: [f64; D],
) -> Vec<DirectNode<D>> {
    weights_in(Coordinates::Cartesian, tree, root_edge, centre, half)
}

/// [`weights`] in these coordinates; in those of axisymmetry the domain's lower corner is on the axis.
pub fn weights_in<const D: usize>(
    coordinates: Coordinates,
    tree: &KnownTree<D>,
    root_edge: f64,
    centre: [f64; D],
    half: [f64; D],
) -> Vec<DirectNode<D>> {
    collected(coordinates, tree, root_edge, centre, half, hand_to_real)
}

/// As [`weights`], but hanging nodes keep their sums, so that fields are discontinuous beside finer leaves:
/// the control that shows the effect of the constraints.
pub fn unconstrained_weights<const D: usize>(
    tree: &KnownTree<D>,
    root_edge: f64,
    centre: [f64; D],
    half: [f64; D],
) -> Vec<DirectNode<D>> {
    let keep = |_: &KnownTree<D>, place, share, nodes: &mut BTreeMap<_, _>| add(place, share, nodes);
    collected(Coordinates::Cartesian, tree, root_edge, centre, half, keep)
}

/// Weights and gradients by node, where `hand` distributes the shares of the corners of all cells.
fn collected<const D: usize>(
    coordinates: Coordinates,
    tree: &KnownTree<D>,
    root_edge: f64,
    centre: [f64; D],
    half: [f64; D],
    hand: impl Fn(&KnownTree<D>, [u32; D], Share<D>, &mut BTreeMap<[u32; D], Share<D>>),
) -> Vec<DirectNode<D>> {
    let mut nodes = BTreeMap::new();
    for leaf in tree.leaves() {
        for (place, share) in in_leaf(coordinates, leaf, root_edge, centre, half) {
            hand(tree, place, share, &mut nodes);
        }
    }
    nodes
        .into_iter()
        .map(|(place, (weight, gradient))| DirectNode { place, weight, gradient })
        .filter(|node| node.weight != 0.0 || node.gradient.iter().any(|&g| g != 0.0))
        .collect()
}

fn add<const D: usize>(
    place: [u32; D],
    (weight, gradient): Share<D>,
    nodes: &mut BTreeMap<[u32; D], Share<D>>,
) {
    let sum = nodes.entry(place).or_insert((0.0, [0.0; D]));
    sum.0 += weight;
    (0..D).for_each(|axis| sum.1[axis] += gradient[axis]);
}

/// One cell along one axis.
#[derive(Clone, Copy)]
struct Interval {
    /// Coordinate of its lower corner, in cells of the leaf.
    cell: u32,
    /// Mean of the hat functions of the lower and of the upper corner over the box, as far as it lies in the
    /// cell.
    hat: [f64; 2],
    /// Mean of the upper one's slope, 1/m; the lower one has the opposite.
    slope: f64,
}

/// Shares of a leaf's cells for their corners, cell by cell.
fn in_leaf<const D: usize>(
    coordinates: Coordinates,
    leaf: &Octant<D>,
    root_edge: f64,
    centre: [f64; D],
    half: [f64; D],
) -> Vec<([u32; D], Share<D>)> {
    let cell = root_edge / f64::from((BLOCK as u32) << leaf.level);
    let along: [Vec<Interval>; D] = std::array::from_fn(|axis| {
        let is_radius = axis == 0 && coordinates == Coordinates::Axisymmetric;
        intervals(leaf.coord[axis], cell, centre[axis], half[axis], is_radius)
    });
    let size = 1u32 << (MAX_LEVEL - leaf.level);
    let count = along.iter().map(Vec::len).product::<usize>();
    let mut shares = Vec::with_capacity(count << D);
    for mut index in 0..count {
        let cut: [Interval; D] = std::array::from_fn(|axis| {
            let interval = along[axis][index % along[axis].len()];
            index /= along[axis].len();
            interval
        });
        for corner in 0..1u32 << D {
            let upper = |axis: usize| corner >> axis & 1;
            let hat = |axis: usize| cut[axis].hat[upper(axis) as usize];
            let slope = |axis: usize| if upper(axis) == 0 { -cut[axis].slope } else { cut[axis].slope };
            let place = std::array::from_fn(|axis| (cut[axis].cell + upper(axis)) * size);
            let gradient = std::array::from_fn(|k| {
                (0..D).map(|axis| if axis == k { slope(axis) } else { hat(axis) }).product()
            });
            shares.push((place, ((0..D).map(hat).product(), gradient)));
        }
    }
    shares
}

/// The cells of a leaf along one axis that a box overlaps. Everything is evaluated relative to the cell, so
/// that a tiny box far from the origin loses no digits. Along a radius means carry r over that of the centre.
fn intervals(leaf: u32, cell: f64, centre: f64, half: f64, is_radius: bool) -> Vec<Interval> {
    let first = BLOCK as u32 * leaf;
    (first..first + BLOCK as u32)
        .filter_map(|at| {
            let middle = centre - f64::from(at) * cell;
            let (low, high) = ((middle - half).max(0.0), (middle + half).min(cell));
            (high > low).then(|| {
                let share = (high - low) / (2.0 * half);
                // Distance of the middle of the share from the lower and from the upper corner, in cells.
                // Each is computed on its own, so that a small one keeps its digits.
                let middle = [0.5 * (low + high) / cell, 0.5 * ((cell - low) + (cell - high)) / cell];
                // The radius of the middle, and what the slope of a hat adds to its mean: width² / 12.
                let (radius, bend) = match is_radius {
                    true => (
                        (f64::from(at) * cell + 0.5 * (low + high)) / centre,
                        (high - low) * (high - low) / (12.0 * cell * centre),
                    ),
                    false => (1.0, 0.0),
                };
                let hat = [share * (middle[1] * radius - bend), share * (middle[0] * radius + bend)];
                Interval { cell: at, hat, slope: share / cell * radius }
            })
        })
        .collect()
}

/// Distributes the share to real nodes: to the node itself, or over the coarse cell on which it hangs.
fn hand_to_real<const D: usize>(
    tree: &KnownTree<D>,
    place: [u32; D],
    (weight, gradient): Share<D>,
    nodes: &mut BTreeMap<[u32; D], Share<D>>,
) {
    let Some(level) = coarsest_without_corner(tree, place) else {
        return add(place, (weight, gradient), nodes);
    };
    let size = 1u32 << (MAX_LEVEL - level);
    let inside = place.map(|x| x % size);
    for corner in 0..1u32 << D {
        let upper = |axis: usize| corner >> axis & 1 == 1;
        // Along axes on which the node lies on the cell's surface there is one corner only.
        if (0..D).any(|axis| upper(axis) && inside[axis] == 0) {
            continue;
        }
        let factor: f64 = (0..D)
            .map(|axis| {
                let fraction = f64::from(inside[axis]) / f64::from(size);
                if upper(axis) { fraction } else { 1.0 - fraction }
            })
            .product();
        let parent =
            std::array::from_fn(|axis| place[axis] - inside[axis] + if upper(axis) { size } else { 0 });
        hand_to_real(tree, parent, (factor * weight, gradient.map(|g| factor * g)), nodes);
    }
}

/// Level of the coarsest leaf around a node that has no cell corner there; `None` for a real node.
fn coarsest_without_corner<const D: usize>(tree: &KnownTree<D>, place: [u32; D]) -> Option<u8> {
    let size = tree.brick().lattice_size();
    let octants = (0..1u32 << D).filter_map(|side| {
        let mut coord = [0; D];
        for axis in 0..D {
            // The finest octants below and above the node along this axis.
            let near = place[axis].checked_sub(side >> axis & 1)? / BLOCK as u32;
            coord[axis] = (near < size[axis]).then_some(near)?;
        }
        Some(Octant { level: MAX_LEVEL, coord })
    });
    octants
        .filter_map(|octant| tree.locate(octant.key()))
        .map(|leaf| tree.leaves()[leaf].level)
        .filter(|level| place.iter().any(|x| x % (1 << (MAX_LEVEL - level)) != 0))
        .min()
}

#[cfg(test)]
mod tests {
    use super::*;
    use partition::Brick;

    /// One root whose octants of level 1 are leaves, but for the first, which is split once more.
    fn jump() -> KnownTree<2> {
        let leaf = |level, x, y| Octant { level, coord: [x, y] };
        let mut leaves: Vec<_> = (0..4).map(|i| leaf(2, i % 2, i / 2)).collect();
        leaves.extend([leaf(1, 1, 0), leaf(1, 0, 1), leaf(1, 1, 1)]);
        KnownTree::whole(Brick { roots: [1, 1] }, leaves)
    }

    #[test]
    fn box_in_one_cell_is_its_bilinear_interpolation() {
        let found = weights(&jump(), 1.0, [0.5625 + 0.03125, 0.1875], [0.015625, 0.03125]);
        let cell = 1 << (MAX_LEVEL - 1);
        assert_eq!(found.len(), 4);
        assert_eq!(found[0].place, [4 * cell, cell]);
        for (node, weight) in found.iter().zip([0.125, 0.125, 0.375, 0.375]) {
            assert_eq!(node.weight, weight);
        }
        assert_eq!(found[3].gradient, [4.0, 6.0]);
    }

    #[test]
    fn hanging_nodes_have_no_weight_of_their_own() {
        let tree = jump();
        let found = weights(&tree, 1.0, [0.5, 0.25], [0.05, 0.05]);
        assert!(found.iter().all(|node| coarsest_without_corner(&tree, node.place).is_none()));
        assert!((found.iter().map(|node| node.weight).sum::<f64>() - 1.0).abs() < 1e-15);
        for axis in 0..2 {
            let unit = f64::from(1 << (MAX_LEVEL + 2));
            let x: f64 = found.iter().map(|node| node.weight * f64::from(node.place[axis]) / unit).sum();
            assert!((x - [0.5, 0.25][axis]).abs() < 1e-15);
            assert!(found.iter().map(|node| node.gradient[axis]).sum::<f64>().abs() < 1e-13);
        }
    }
}
