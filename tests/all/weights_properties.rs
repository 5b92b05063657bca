//! Properties of the weights on random trees with random boxes, on 1 to 4 ranks.
//!
//! Each test launches this binary under `mpirun`, once per number of ranks. All ranks draw the same random
//! numbers, and the bits of all weights must not depend on the number of ranks.

use std::collections::BTreeMap;

use crate::common::boxes::{
    ALL, NARROW, WIDE, cell_at, gradient_sums, kappa, position, random_box, random_tree, tree_with_jump, unit,
};
use crate::common::random::Random;
use crate::common::scenarios::{Scenario, agrees_for, report};
use crate::common::tree::{forest_of, graded, random_leaves};
use agimp::exact_sum::ExactSum;
use agimp::grid::{KnownTree, direct};
use agimp::kernel::Transfer;
use agimp::particle::chunk::Layout;
use agimp::solver::diagnostics::given_boxes::{GivenBoxes, GivenParticle, RealNode};
use partition::{Brick, Comm, Octant};

const EPS: f64 = f64::EPSILON;

pub(crate) const SCENARIOS: &[(&str, Scenario)] = &[
    ("boxes_2d", |comm| random_boxes::<2>(comm, 14, 9, 5)),
    ("boxes_3d", |comm| random_boxes::<3>(comm, 6, 7, 3)),
    ("crowd_2d", |comm| crowds::<2>(comm, 12, 300)),
    ("crowd_3d", |comm| crowds::<3>(comm, 4, 200)),
    ("ghosts_2d", |comm| ghosts::<2>(comm, Brick { roots: [32, 2] }, 12, 5)),
    ("ghosts_3d", |comm| ghosts::<3>(comm, Brick { roots: [16, 1, 1] }, 5, 3)),
    ("lines_2d", lines::<2>),
    ("lines_3d", lines::<3>),
    ("slivers_2d", slivers::<2>),
    ("slivers_3d", slivers::<3>),
    ("lattices", |comm| {
        lattices::<2>(comm);
        lattices::<3>(comm);
    }),
];

#[test]
fn boxes_on_trees_2d() {
    agrees_for("boxes_2d", &[1, 2, 3, 4]);
}

#[test]
fn boxes_on_trees_3d() {
    agrees_for("boxes_3d", &[1, 2, 3, 4]);
}

#[test]
fn mass_reaches_real_nodes_2d() {
    agrees_for("crowd_2d", &[1, 2, 3, 4]);
}

#[test]
fn mass_reaches_real_nodes_3d() {
    agrees_for("crowd_3d", &[1, 2, 3, 4]);
}

#[test]
fn far_ranks_2d() {
    agrees_for("ghosts_2d", &[1, 2, 3, 4]);
}

#[test]
fn far_ranks_3d() {
    agrees_for("ghosts_3d", &[1, 2, 3, 4]);
}

#[test]
fn smooth_through_level_jumps_2d() {
    agrees_for("lines_2d", &[1, 4]);
}

#[test]
fn smooth_through_level_jumps_3d() {
    agrees_for("lines_3d", &[1, 2]);
}

#[test]
fn lattices_of_boxes_give_no_spurious_force() {
    agrees_for("lattices", &[1, 3]);
}

#[test]
fn no_node_gets_an_impulse_without_mass_2d() {
    agrees_for("slivers_2d", &[1, 2]);
}

#[test]
fn no_node_gets_an_impulse_without_mass_3d() {
    agrees_for("slivers_3d", &[1, 2]);
}

/// Mixes values into a number that tells sequences of bits apart.
#[derive(Default)]
struct Digest(u64);

impl Digest {
    fn add<const D: usize>(&mut self, nodes: &[RealNode<D>]) {
        for node in nodes {
            let words = node.place.into_iter().map(u64::from);
            let reals = node.momentum.into_iter().chain([node.mass]).map(f64::to_bits);
            for word in words.chain(reals) {
                self.0 = (self.0 ^ word).wrapping_mul(0x100_0000_01b3).rotate_left(29);
            }
        }
    }
}

/// Each box alone: sums, signs, linear reproduction, and agreement with the definition.
fn random_boxes<const D: usize>(comm: &Comm, trees: usize, boxes: usize, deepest: u8) {
    let mut random = Random::new(17 + D as u64);
    let mut worst = Worst::default();
    let mut digest = Digest::default();
    for number in 0..trees {
        let (brick, leaves) = random_tree::<D>(&mut random, number, deepest);
        let tree = KnownTree::whole(brick, leaves.clone());
        let mut grid = GivenBoxes::new(comm, forest_of(comm, brick, leaves.clone()), 1.0);
        for _ in 0..boxes {
            let (centre, half) = random_box(&mut random, brick, &leaves, ALL);
            grid.place(&[unit(centre, half)]);
            grid.to_nodes(-1.0).expect("a box fits its bins");
            let nodes = grid.all_real_nodes(comm);
            if comm.rank() == 0 {
                digest.add(&nodes);
                let exact = direct::weights(&tree, 1.0, centre, half);
                worst.check(&nodes, &exact, centre, half, cell_at(&leaves, centre));
            }
        }
    }
    report(comm, format!("{worst:.3?} bits {:016x}", digest.0));
}

fn total(values: impl Iterator<Item = f64>) -> f64 {
    let mut sum = ExactSum::new();
    values.for_each(|value| sum.add(value));
    sum.to_f64()
}

/// Greatest errors in units of `eps κ`.
#[derive(Debug, Default)]
struct Worst {
    sum: f64,
    gradient_sum: f64,
    position: f64,
    definition: f64,
    definition_gradient: f64,
}

impl Worst {
    fn check<const D: usize>(
        &mut self,
        nodes: &[RealNode<D>],
        exact: &[direct::DirectNode<D>],
        centre: [f64; D],
        half: [f64; D],
        cell: f64,
    ) {
        let unit = EPS * kappa(centre, half);
        let note = |worst: &mut f64, error: f64, what: &str| {
            assert!(error <= 2.0 * unit, "{what}: {error:e} for the box {centre:?}, {half:?}");
            *worst = worst.max(error / unit);
        };
        assert!(nodes.iter().all(|node| node.mass >= 0.0), "a weight is negative: {centre:?} {half:?}");
        // Exact sums: the errors of the weights count here, not those of adding them up.
        let one = total(nodes.iter().map(|node| node.mass).chain([-1.0]));
        note(&mut self.sum, one.abs(), "sum of weights");
        for axis in 0..D {
            let gradient = total(nodes.iter().map(|node| node.momentum[axis]));
            note(&mut self.gradient_sum, cell * gradient.abs(), "sum of gradients");
            // About the centre, so that the products are small.
            let arm = |node: &RealNode<D>| node.mass * (position(node.place)[axis] - centre[axis]);
            note(&mut self.position, total(nodes.iter().map(arm)).abs(), "mean of positions");
        }
        // Rounding may give either a node with next to no weight that the other does not have.
        let mut both: BTreeMap<[u32; D], [(f64, [f64; D]); 2]> = BTreeMap::new();
        for node in nodes {
            both.entry(node.place).or_insert([(0.0, [0.0; D]); 2])[0] = (node.mass, node.momentum);
        }
        for node in exact {
            both.entry(node.place).or_insert([(0.0, [0.0; D]); 2])[1] = (node.weight, node.gradient);
        }
        for [found, exact] in both.values() {
            note(&mut self.definition, (found.0 - exact.0).abs(), "weight against its definition");
            for axis in 0..D {
                let error = cell * (found.1[axis] - exact.1[axis]).abs();
                note(&mut self.definition_gradient, error, "gradient against its definition");
            }
        }
    }
}

/// Many boxes of all kinds at once, on trees with known jumps: all mass arrives on real nodes.
fn crowds<const D: usize>(comm: &Comm, trees: usize, boxes: usize) {
    let mut random = Random::new(41 + D as u64);
    let mut digest = Digest::default();
    let mut worst: f64 = 0.0;
    for number in 0..trees {
        let jump = 1 + number % 4;
        let (brick, leaves) = tree_with_jump::<D>(&mut random, jump as u8);
        let mut grid = GivenBoxes::new(comm, forest_of(comm, brick, leaves.clone()), 1.0);
        let particles: Vec<GivenParticle<D>> = (0..boxes)
            .map(|_| {
                let (centre, half) = random_box(&mut random, brick, &leaves, ALL);
                let mass = random.between(0.1, 1.0);
                let affine = std::array::from_fn(|_| random.point(-1.0, 1.0));
                GivenParticle { mass, velocity: random.point(-1.0, 1.0), affine, ..unit(centre, half) }
            })
            .collect();
        grid.place(&particles);
        grid.to_nodes(-1.0).expect("boxes fit their bins");
        let nodes = grid.all_real_nodes(comm);
        if comm.rank() == 0 {
            digest.add(&nodes);
            let mass: f64 = particles.iter().map(|p| p.mass).sum();
            let found: f64 = nodes.iter().map(|node| node.mass).sum();
            let error = (found / mass - 1.0).abs();
            assert!(error <= 1e-14, "jump of {jump} levels: {error:e} of the mass is lost");
            worst = worst.max(error);
        }
    }
    report(comm, format!("{worst:.1e} bits {:016x}", digest.0));
}

/// Trees so large that a rank knows a part only: still the same bits, and all mass on real nodes.
fn ghosts<const D: usize>(comm: &Comm, brick: Brick<D>, points: u64, deepest: u8) {
    let mut random = Random::new(61 + D as u64);
    let mut digest = Digest::default();
    for (number, kinds) in [NARROW, WIDE, ALL, NARROW, WIDE].into_iter().enumerate() {
        let leaves = random_leaves::<D>(&mut random, brick, points, deepest);
        let leaves = if number < 3 { leaves } else { graded(leaves) };
        let mut grid = GivenBoxes::new(comm, forest_of(comm, brick, leaves.clone()), 1.0);
        let particles: Vec<GivenParticle<D>> = (0..400)
            .map(|_| {
                let (centre, half) = random_box(&mut random, brick, &leaves, kinds);
                let affine = std::array::from_fn(|_| random.point(-1.0, 1.0));
                GivenParticle { velocity: random.point(-1.0, 1.0), affine, ..unit(centre, half) }
            })
            .collect();
        grid.place(&particles);
        grid.to_nodes(-1.0).expect("boxes fit their bins");
        assert!(comm.size() < 4 || 4 * grid.ghost_leaves() < 3 * leaves.len(), "the tree is too small");
        let nodes = grid.all_real_nodes(comm);
        if comm.rank() == 0 {
            digest.add(&nodes);
            let mass = total(nodes.iter().map(|node| node.mass).chain([-(particles.len() as f64)]));
            assert!(mass.abs() <= 1e-14 * particles.len() as f64, "{mass:e} of the mass is lost");
        }
        // Prolongation and G2P too.
        grid.to_velocities();
        grid.to_particles(Transfer::Apic);
        let mut sum = [0u64];
        for chunk in grid.chunks() {
            for (p, id) in chunk.ids().iter().enumerate() {
                let columns = (0..Layout::<D>::REALS).map(|column| chunk.column(column)[p].to_bits());
                let mixed = columns.fold(*id, |mixed, bits| (mixed ^ bits).wrapping_mul(0x100_0000_01b3));
                sum[0] = sum[0].wrapping_add(mixed >> 8);
            }
        }
        comm.sum_u64(&mut sum);
        digest.0 ^= sum[0];
    }
    report(comm, format!("bits {:016x}", digest.0));
}

/// A box of fixed size on lines through faces, edges and corners of level jumps: weights and gradients are
/// continuous, and the gradients are the derivatives of the weights.
fn lines<const D: usize>(comm: &Comm) {
    let mut random = Random::new(97 + D as u64);
    let (lines, steps) = if D == 2 { (12, 40) } else { (6, 24) };
    let mut worst: f64 = 0.0;
    for number in 0..lines {
        let jump = 1 + number as u8 % 4;
        let (brick, leaves) = tree_with_jump::<D>(&mut random, jump.min(if D == 2 { 4 } else { 3 }));
        let mut grid = GivenBoxes::new(comm, forest_of(comm, brick, leaves), 1.0);
        let fine = 0.125 * 0.5f64.powi(i32::from(jump));
        let half: [f64; D] = std::array::from_fn(|_| fine * random.between(0.2, 1.2));
        // Through the middle along an axis (a face), in a plane (an edge) or along a diagonal (a corner).
        let along = 1 + number % D;
        let direction: [f64; D] =
            std::array::from_fn(|a| if a < along { random.between(0.5, 1.0) } else { 0.0 });
        let aside: [f64; D] =
            std::array::from_fn(|a| if a < along { 0.0 } else { random.between(-0.1, 0.1) });
        let mut weights = |t: f64| {
            let centre = std::array::from_fn(|a| 0.5 + aside[a] + t * direction[a]);
            grid.place(&[unit(centre, half)]);
            grid.to_nodes(-1.0).expect("a box fits its bins");
            let nodes = grid.all_real_nodes(comm).into_iter();
            nodes.map(|node| (node.place, node)).collect::<BTreeMap<_, _>>()
        };
        let steepest = (0..D).map(|a| 1.0 / half[a].min(fine)).fold(0.0, f64::max);
        // Curvature of a weight, twice over for boxes astride cells of both sizes.
        let curvature = 2.0 * D as f64 * steepest * steepest;
        let delta = 1e-6 * fine;
        for step in 0..steps {
            let t = 3.0 * fine * (2.0 * f64::from(step) / f64::from(steps) - 1.0 + random.between(0.0, 0.01));
            // Also where a face of the box passes a face of the fine leaves.
            let t = if step % 4 == 0 {
                half[0] / direction[0] * if step % 8 == 0 { 1.0 } else { -1.0 }
            } else {
                t
            };
            let (before, after) = (weights(t - delta), weights(t + delta));
            let none = RealNode { place: [0; D], momentum: [0.0; D], mass: 0.0 };
            for place in before.keys().chain(after.keys()) {
                let (a, b) = (before.get(place).unwrap_or(&none), after.get(place).unwrap_or(&none));
                let mean: f64 = (0..D).map(|k| (a.momentum[k] + b.momentum[k]) * delta * direction[k]).sum();
                let bound = curvature * (4.0 * delta * delta) + 64.0 * EPS * (1.0 + steepest);
                let error = (b.mass - a.mass - mean).abs();
                assert!(error <= bound, "weight of {place:?} at {t}: {error:e} > {bound:e}");
                worst = worst.max(error / bound);
                for k in 0..D {
                    let change = (b.momentum[k] - a.momentum[k]).abs();
                    let bound = 4.0 * curvature * delta + 1e-12 * steepest;
                    assert!(change <= bound, "gradient of {place:?} at {t}: {change:e} > {bound:e}");
                    worst = worst.max(change / bound);
                }
            }
        }
    }
    report(comm, format!("at most {worst:.2} of the bounds"));
}

/// Boxes of equal size that tile the domain, 1 to 4 and a broken number per cell, under uniform stress: no
/// force inside, and none along the walls.
fn lattices<const D: usize>(comm: &Comm) {
    let mut random = Random::new(5);
    let (brick, leaves) = tree_with_jump::<D>(&mut random, 2);
    let mut grid = GivenBoxes::new(comm, forest_of(comm, brick, leaves.clone()), 1.0);
    // Along an edge of the domain there are 8 cells of the coarsest leaves.
    let counts: &[u32] = if D == 2 { &[8, 16, 24, 32, 20, 11] } else { &[8, 16, 24, 12, 20] };
    for &count in counts {
        let spacing = 1.0 / f64::from(count);
        let particles: Vec<GivenParticle<D>> = (0..count.pow(D as u32))
            .map(|index| {
                let at = |axis: usize| f64::from(index / count.pow(axis as u32) % count) + 0.5;
                let volume = spacing.powi(D as i32);
                let centre = std::array::from_fn(|axis| at(axis) * spacing);
                GivenParticle { mass: volume, energy: volume, ..unit(centre, [0.5 * spacing; D]) }
            })
            .collect();
        grid.place(&particles);
        grid.to_nodes(-1.0).expect("boxes fit their bins");
        let nodes = grid.all_real_nodes(comm);
        if comm.rank() != 0 {
            continue;
        }
        let [absolute, _] = gradient_sums(brick, &leaves, &particles);
        let mut worst: f64 = 0.0;
        for node in &nodes {
            for axis in 0..D {
                let x = position(node.place)[axis];
                // Stress pushes against the walls, and only there.
                if x > 0.0 && x < 1.0 {
                    let error = node.momentum[axis].abs() / (EPS * absolute[&node.place]);
                    assert!(error <= 64.0, "{count} boxes: {error} eps at {:?}", node.place);
                    worst = worst.max(error);
                }
            }
        }
        println!("{D}D, {count} boxes along an edge: {worst:.1} eps");
    }
    report(comm, format!("{D}D"));
}

/// A tree with leaves of one level below the middle of an axis and of another above.
fn two_halves<const D: usize>(axis: usize, levels: [u32; 2]) -> Vec<Octant<D>> {
    let half = |side: u32| {
        let (level, count) = (levels[side as usize], 1u32 << levels[side as usize]);
        (0..count.pow(D as u32))
            .map(move |n| std::array::from_fn(|a| n / count.pow(a as u32) % count))
            .filter(move |coord: &[u32; D]| coord[axis] / (count / 2) == side)
            .map(move |coord| Octant { level: level as u8, coord })
    };
    let mut leaves: Vec<_> = half(0).chain(half(1)).collect();
    leaves.sort_unstable();
    leaves
}

/// A box that reaches across a line between cells by one unit of the last place or more, from either side, on
/// a uniform tree and across jumps of one and three levels, whole or in parts: nodes beyond the line have
/// `w 2V = (slope h V)²`, where h is their distance from the line and V the box's width in units of h. So
/// what a particle's own stress gives back to it stays bounded.
fn slivers<const D: usize>(comm: &Comm) {
    let mut random = Random::new(29 + D as u64);
    let overlaps: Vec<u64> = if D == 2 {
        (1..=16).chain([33, 50, 77, 100]).chain((8..48).step_by(5).map(|power| 1 << power)).collect()
    } else {
        vec![1, 2, 3, 7, 8, 100, 1 << 20, 1 << 40]
    };
    let (mut reached, mut worst, mut digest) = ([0; 2], 0f64, Digest::default());
    for (axis, levels) in (0..D).flat_map(|a| [[2, 2], [2, 1], [1, 2], [4, 1], [1, 4]].map(|l| (a, l))) {
        if D == 3 && levels.contains(&4) && axis > 0 {
            continue;
        }
        let leaves = two_halves::<D>(axis, levels);
        let brick = Brick { roots: [1; D] };
        let tree = KnownTree::whole(brick, leaves.clone());
        let mut grid = GivenBoxes::new(comm, forest_of(comm, brick, leaves.clone()), 1.0);
        let cells = levels.map(|level| 0.25 * 0.5f64.powi(level as i32));
        let finest = cells[0].min(cells[1]);
        for (from, width) in [0, 1].into_iter().flat_map(|side| [0.25, 0.5, 0.3, 0.8].map(|w| (side, w))) {
            for (&overlap, unlike) in overlaps.iter().flat_map(|n| [false, true].map(|unlike| (n, unlike))) {
                let overlap = overlap as f64 * 0.5 * EPS;
                let mut half = [width * cells[from]; D];
                if unlike {
                    half[(axis + 1) % D] *= 0.7;
                }
                let mut centre: [f64; D] = random.point(0.3, 0.7);
                let outward = if from == 0 { 1.0 } else { -1.0 };
                centre[axis] = 0.5 - outward * (half[axis] - overlap);
                grid.place(&[unit(centre, half)]);
                grid.to_nodes(-1.0).expect("a box fits its bins");
                let nodes = grid.all_real_nodes(comm);
                grid.to_velocities();
                grid.to_particles(Transfer::Tpic);
                for gradient in grid
                    .chunks()
                    .iter()
                    .filter(|chunk| !chunk.is_empty())
                    .flat_map(|chunk| (0..D * D).map(|i| chunk.column(Layout::<D>::AFFINE + i)[0]))
                {
                    let bound = 16.0 / (half[axis].min(half[(axis + 1) % D]) * finest);
                    assert!(gradient.abs() <= bound, "{gradient:e} of {bound:e}: {centre:?} {half:?}");
                }
                if comm.rank() != 0 {
                    continue;
                }
                digest.add(&nodes);
                let direct = direct::weights(&tree, 1.0, centre, half).into_iter();
                let direct =
                    direct.map(|n| RealNode { place: n.place, momentum: n.gradient, mass: n.weight });
                for (path, nodes) in [nodes, direct.collect()].into_iter().enumerate() {
                    let distance = |node: &RealNode<D>| outward * (position(node.place)[axis] - 0.5);
                    let beyond: Vec<_> = nodes.iter().filter(|node| distance(node) > 0.0).collect();
                    let case = format!("path {path}, levels {levels:?}, {overlap:e}, {centre:?}, {half:?}");
                    for node in &beyond {
                        // The other axes' share is the same in weight and slope, so that it is left of the
                        // quotient.
                        let (h, slope) = (distance(node), outward * node.momentum[axis]);
                        assert!(node.mass > 0.0 && slope > 0.0, "{case}: {node:?}");
                        let whole: f64 = beyond.iter().map(|node| outward * node.momentum[axis]).sum();
                        let v = 2.0 * half[axis] / h;
                        let error = (node.mass * 2.0 * v / (slope * h * v * (whole * h * v)) - 1.0).abs();
                        assert!(error <= 32.0 * EPS, "{case}: {error:e} at {node:?}");
                        worst = worst.max(error / EPS);
                    }
                    reached[path] += usize::from(!beyond.is_empty());
                }
            }
        }
    }
    println!("{reached:?} boxes with nodes beyond, at most {worst} eps");
    assert!(
        comm.rank() != 0 || reached.iter().all(|&boxes| boxes > if D == 2 { 1500 } else { 300 }),
        "{reached:?}"
    );
    report(comm, format!("{worst:.1} eps, bits {:016x}", digest.0));
}
