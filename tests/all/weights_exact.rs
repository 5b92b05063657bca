//! Weights of random boxes on random trees against exact arithmetic, through the same entry as
//! `agimp weights`.

use crate::common::exact::{UNIT, UnitBox, weights};
use crate::common::random::Random;
use crate::common::scenarios::{Scenario, agrees_for, report};
use crate::common::tree::{graded, random_leaves};
use agimp::solver::diagnostics::weights::{CaseWeights, evaluate};
use partition::{Brick, Comm, Octant};
use serde_json::json;

pub(crate) const SCENARIOS: &[(&str, Scenario)] =
    &[("exact_2d", |comm| compare::<2>(comm, 24, 7)), ("exact_3d", |comm| compare::<3>(comm, 8, 3))];

#[test]
fn weights_are_exact_2d() {
    agrees_for("exact_2d", &[1, 2, 3, 4]);
}

#[test]
fn weights_are_exact_3d() {
    agrees_for("exact_3d", &[1, 2, 3, 4]);
}

/// Kinds of boxes.
pub(crate) const KINDS: [&str; 14] = [
    "quarter",
    "half",
    "narrow",
    "unlike",
    "wide",
    "nano",
    "tiny",
    "aligned",
    "on a node",
    "at walls",
    "on a face",
    "huge",
    "sliver",
    "a cell and a bit",
];

pub(crate) fn random_box<const D: usize>(
    random: &mut Random,
    leaves: &[Octant<D>],
    kind: &str,
) -> UnitBox<D> {
    let leaf = leaves[random.below(leaves.len() as u64) as usize];
    let cell = 1u64 << (UNIT - 2 - u32::from(leaf.level));
    let root = 1u64 << UNIT;
    let share = |low: f64, high: f64, random: &mut Random| (random.between(low, high) * cell as f64) as u64;
    let one_of = |list: &[f64], random: &mut Random| {
        (list[random.below(list.len() as u64) as usize] * cell as f64) as u64
    };
    let same = match kind {
        "quarter" => cell / 4,
        "narrow" => share(0.1, 0.5, random),
        "wide" => share(0.5, 4.0, random),
        "nano" => root / 1_000_000_000,
        "tiny" => one_of(&[1e-2, 1e-4, 1e-6], random),
        "aligned" => (1 + random.below(3)) * cell / 2,
        "on a node" => one_of(&[0.25, 0.5, 0.1, 1.0 / 3.0, 1.0, 1e-6], random),
        "at walls" => one_of(&[0.25, 0.5, 0.1, 0.9, 1.3, 1e-5], random),
        "on a face" => one_of(&[0.25, 0.5, 0.3, 1.2], random),
        "huge" => share(0.1, 0.5, random) * (root / cell),
        "a cell and a bit" => cell / 2 + [1, 3, 1 << 8][random.below(3) as usize],
        _ => cell / 2,
    };
    let mut given = UnitBox { centre: [0; D], half: [same; D] };
    for a in 0..D {
        given.half[a] = match kind {
            "unlike" => share(0.02, 2.0, random),
            "sliver" => one_of(&[1e-3, 1e-5, 3.0, 0.5], random),
            _ => same,
        }
        .clamp(1, root / 2);
        let inside = random.below(4) * cell + share(0.0, 1.0, random);
        let x = 4 * u64::from(leaf.coord[a]) * cell + inside;
        let x = match kind {
            "aligned" => x / cell * cell + random.below(2) * cell / 2,
            "on a node" => (x + cell / 2) / cell * cell,
            "on a face" => {
                (x / cell * cell).saturating_add_signed([-1, 1][random.below(2) as usize] * same as i64)
            }
            "at walls" => [0, root, x][random.below(3) as usize],
            _ => x,
        };
        given.centre[a] = x.clamp(given.half[a], root - given.half[a]);
    }
    given
}

/// All weights within `2 eps κ`, by the kernels and by the definition cell by cell.
fn compare<const D: usize>(comm: &Comm, trees: u64, deepest: u8) {
    let mut random = Random::new(2 + D as u64);
    for number in 0..trees {
        let points = 1 + random.below(3);
        let leaves = random_leaves(&mut random, Brick { roots: [1; D] }, points, deepest);
        let leaves = if number % 3 == 2 { graded(leaves) } else { leaves };
        let levels = || leaves.iter().map(|leaf| u32::from(leaf.level));
        let level = levels().max().expect("leaves") + 2;
        let boxes = KINDS.map(|kind| random_box(&mut random, &leaves, kind));
        let octant = |leaf: &Octant<D>| {
            let numbers = [u32::from(leaf.level)].into_iter().chain(leaf.coord);
            numbers.collect::<Vec<_>>()
        };
        let cases: Vec<_> = boxes
            .iter()
            .zip(KINDS)
            .map(|(given, kind)| {
                let [centre, half] = given.reals().map(|list| list.to_vec());
                json!({"id": kind, "tree": 0, "centre": centre, "half": half})
            })
            .collect();
        let octants: Vec<_> = leaves.iter().map(octant).collect();
        let text = json!({"dim": D, "cells_per_octant_edge": 4, "cases": cases,
            "trees": [{"id": 0, "node_lattice_level": level, "octants": octants}]})
        .to_string();
        let found = [false, true].map(|direct| evaluate(comm, &text, direct).expect("weights"));
        if comm.rank() != 0 {
            continue;
        }
        let (mut bits, mut worst) = (0u64, [0f64; 2]);
        for (i, given) in boxes.iter().enumerate() {
            let [kernels, direct] = [0, 1].map(|path| error(&leaves, level, given, &found[path].cases[i]));
            worst = [worst[0].max(kernels), worst[1].max(direct)];
            println!("{D}D, tree {number}, {}: {kernels:.3} and {direct:.3} eps kappa", KINDS[i]);
            for (path, error) in [("kernels", kernels), ("definition", direct)] {
                assert!(error <= 2.0, "{path}: {error} eps kappa in tree {number}, {}: {given:?}", KINDS[i]);
            }
            for node in &found[0].cases[i].nodes {
                bits = node.grad.iter().fold(bits ^ node.w.to_bits(), |bits, g| {
                    (bits ^ g.to_bits()).wrapping_mul(0x100_0000_01b3).rotate_left(29)
                });
            }
        }
        report(
            comm,
            format!("tree {number}: {:.3} and {:.3} eps kappa, bits {bits:016x}", worst[0], worst[1]),
        );
    }
}

/// Greatest error in units of `eps κ`; gradients times the finest cell.
fn error<const D: usize>(leaves: &[Octant<D>], level: u32, given: &UnitBox<D>, found: &CaseWeights) -> f64 {
    let mut exact = weights(leaves, level, given);
    let one: f64 = exact.values().map(|(w, _)| w).sum();
    assert!((one - 1.0).abs() < 1e-13, "the reference is not a partition of unity: {one}");
    let [centre, half] = given.reals();
    let kappa: f64 = (0..D).map(|a| ((centre[a] + 1.0) / half[a]).max(1.0)).sum();
    let cell = 0.5f64.powi(level as i32);
    let mut worst: f64 = 0.0;
    for node in &found.nodes {
        let place: [u64; D] = std::array::from_fn(|a| node.ijk[a]);
        // Rounding may give a node next to nothing that has nothing.
        let (w, gradient) = exact.remove(&place).unwrap_or((0.0, [0.0; D]));
        assert!(node.w >= 0.0);
        worst = worst.max((node.w - w).abs());
        (0..D).for_each(|a| worst = worst.max(cell * (node.grad[a] - gradient[a]).abs()));
    }
    for (w, gradient) in exact.values() {
        worst = gradient.iter().fold(worst.max(*w), |worst, g| worst.max(cell * g.abs()));
    }
    worst / (f64::EPSILON * kappa)
}
