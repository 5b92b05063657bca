//! Weights of sections of rings against exact rational arithmetic by independent code, and what holds for any
//! box and tree; see `tests/data/golden/README.md`.
use std::collections::BTreeMap;
use std::path::Path;

use crate::common::random::Random;
use crate::common::scenarios::{Scenario, agrees_for, report};
use crate::common::tree::{graded, random_leaves};
use crate::weights_exact::{KINDS, random_box};
use agimp::solver::diagnostics::weights::{CaseWeights, RingWeights, evaluate_rings};
use partition::{Brick, Comm};
use serde_json::{Value, json};

const EPS: f64 = f64::EPSILON;

pub(crate) const SCENARIOS: &[(&str, Scenario)] = &[
    ("rings", |comm| golden(comm, false)),
    ("rings_by_definition", |comm| golden(comm, true)),
    ("ring_patches", patches),
    ("random_rings", random_rings),
];

#[test]
fn rings_equal_exact_arithmetic() {
    agrees_for("rings", &[1, 2, 3]);
    agrees_for("rings_by_definition", &[1]);
}

#[test]
fn uniform_stress_in_a_ring_gives_no_force() {
    agrees_for("ring_patches", &[1, 2]);
}

#[test]
fn kernels_equal_the_definition_on_any_tree() {
    agrees_for("random_rings", &[1, 3]);
}

#[test]
fn boxes_across_the_axis_are_refused_by_name() {
    let run = |text: &str| {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), text).expect("a file");
        let mut command = assert_cmd::Command::cargo_bin("agimp").expect("the program");
        let output = command.args(["weights", "--axisymmetric"]).arg(file.path()).output().expect("it runs");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let input = |centre: f64, half: f64| {
        format!(
            r#"{{"dim": 2, "cells_per_octant_edge": 4, "trees": [{{"id": 7, "octants": [[0, 0, 0]]}}],
            "cases": [{{"id": "a", "tree": 7, "centre": [{centre}, 0.5], "half": [{half}, 0.125]}}]}}"#
        )
    };
    // A box of a cell at the axis: ∫ N r / (A r_p) of the node on the axis is 1/3, and ∫ N / (A r_p) is 4.
    let (code, stdout, stderr) = run(&input(0.125, 0.125));
    assert_eq!((code, &stderr[..]), (Some(0), ""));
    let found: Value = serde_json::from_str(&stdout).expect("JSON");
    let nodes = list(&found["cases"][0]["nodes"]);
    assert_eq!(nodes.len(), 6);
    let of = |name: &str| nodes[..3].iter().map(|node| number(&node[name])).sum::<f64>();
    assert!((of("s") - 1.0 / 3.0).abs() < 1e-15 && (of("t") - 4.0).abs() < 1e-14, "{stdout}");
    for (text, reason) in [
        (
            input(0.125, 0.25),
            "case \"a\": its box reaches r = -0.125; the box must not cross the axis, r = 0",
        ),
        (input(0.0, 0.125), "case \"a\": its centre has the radius 0; it must be above 0"),
        (input(-0.25, 0.125), "case \"a\": its centre has the radius -0.25; it must be above 0"),
        (input(0.125, 0.0), "the box must have a volume and lie in the unit cell"),
        (input(0.125, 0.125).replace("\"dim\": 2", "\"dim\": 3"), "sections of rings have `dim` 2"),
    ] {
        let (code, stdout, stderr) = run(&text);
        assert_eq!((code, &stdout[..]), (Some(2), ""), "{stderr}");
        assert!(stderr.contains(reason) && stderr.lines().count() == 1, "{reason:?} in {stderr:?}");
    }
}

fn read(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/golden").join(file);
    std::fs::read_to_string(path).expect("golden data")
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn pair(value: &Value) -> [f64; 2] {
    [number(&value[0]), number(&value[1])]
}

fn lattice(value: &Value) -> Vec<u64> {
    list(value).iter().map(|x| x.as_u64().expect("a coordinate")).collect()
}

fn tree<'a>(input: &'a Value, id: &Value) -> &'a Value {
    list(&input["trees"]).iter().find(|tree| tree["id"] == *id).expect("a tree")
}

/// A section of a ring on a tree, for bounds.
struct Ring {
    centre: [f64; 2],
    half: [f64; 2],
    /// Edge of the cells of the lattice, and of the finest cells.
    unit: f64,
    cell: f64,
}

impl Ring {
    fn new(tree: &Value, case: &Value) -> Self {
        let finest = list(&tree["octants"]).iter().map(|o| o[0].as_i64().expect("a level")).max();
        Self {
            centre: pair(&case["centre"]),
            half: pair(&case["half"]),
            unit: 0.5f64.powi(tree["node_lattice_level"].as_i64().expect("a level") as i32),
            cell: 0.5f64.powi(finest.expect("octants") as i32 + 2),
        }
    }

    /// `2 eps κ`, the error of double arithmetic for a box of this size and place.
    fn bound(&self) -> f64 {
        let kappa = |a: usize| ((self.centre[a].abs() + 1.0) / self.half[a]).max(1.0);
        2.0 * EPS * (kappa(0) + kappa(1))
    }

    /// Errors of what holds for any ring, each over its bound for double arithmetic: the weights add up to 1,
    /// their gradients to 0 and those along the hoop to 1 / r_p; linear fields are met at the centre of mass; a
    /// uniform expansion has one rate along the radius and the hoop, and a uniform stretch one along the axis.
    fn errors(&self, found: &CaseWeights<RingWeights>) -> f64 {
        let [r, z] = self.centre;
        let sum = |f: &dyn Fn(&RingWeights, [f64; 2]) -> f64| {
            let at = |node: &RingWeights| [0, 1].map(|a| node.ijk[a] as f64 * self.unit);
            found.nodes.iter().map(|node| f(node, at(node))).sum::<f64>()
        };
        let hoop = self.cell.min(r);
        let nodes = found.nodes.len() as f64;
        [
            sum(&|node, _| node.s) - 1.0,
            sum(&|node, [x, _]| node.s * x) - r - self.half[0] * self.half[0] / (3.0 * r),
            sum(&|node, [_, y]| node.s * y) - z,
            self.cell * sum(&|node, _| node.grad[0]),
            self.cell * sum(&|node, _| node.grad[1]),
            self.cell * (sum(&|node, [x, _]| node.grad[0] * x) - 1.0),
            self.cell * (sum(&|node, [_, y]| node.grad[1] * y) - 1.0),
            self.cell * sum(&|node, [_, y]| node.grad[0] * y),
            self.cell * sum(&|node, [x, _]| node.grad[1] * x),
            hoop * (sum(&|node, _| node.t) - 1.0 / r),
            hoop * (sum(&|node, [x, _]| node.t * x) - 1.0),
        ]
        .into_iter()
        .fold(0.0, |worst: f64, error| worst.max(error.abs() / (nodes * self.bound())))
    }
}

/// All weights within `2 eps κ`, for exactly the nodes of the reference.
fn golden(comm: &Comm, direct: bool) {
    let text = read("axisymmetric_weights.json");
    let found = evaluate_rings(comm, &text, direct).expect("weights");
    if comm.rank() != 0 {
        return;
    }
    let reference: Value = serde_json::from_str(&text).expect("JSON");
    let (mut worst, mut bits) = (0f64, 0u64);
    assert_eq!(found.cases.len(), 64);
    for (case, found) in list(&reference["cases"]).iter().zip(&found.cases) {
        let ring = Ring::new(tree(&reference, &case["tree"]), case);
        let nodes = list(&case["nodes"]);
        let places: Vec<Vec<u64>> = nodes.iter().map(|node| lattice(&node["ijk"])).collect();
        let found_places: Vec<Vec<u64>> = found.nodes.iter().map(|node| node.ijk.clone()).collect();
        assert_eq!(places, found_places, "nodes of case {}", case["id"]);
        for (node, found) in nodes.iter().zip(&found.nodes) {
            assert!(found.s >= 0.0 && found.t >= 0.0);
            let gradient = pair(&node["grad"]);
            let errors = [
                number(&node["s"]) - found.s,
                ring.cell * (gradient[0] - found.grad[0]),
                ring.cell * (gradient[1] - found.grad[1]),
                ring.cell.min(ring.centre[0]) * (number(&node["t"]) - found.t),
            ];
            worst = errors.iter().fold(worst, |worst, error| worst.max(error.abs() / ring.bound()));
            bits = [found.s, found.grad[0], found.grad[1], found.t]
                .iter()
                .fold(bits, |bits, x| (bits ^ x.to_bits()).wrapping_mul(0x100_0000_01b3).rotate_left(29));
        }
        assert!(ring.errors(found) <= 1.0, "case {}", case["id"]);
    }
    assert!(worst <= 1.0, "{worst} of the bound");
    report(comm, format!("{:.3} eps kappa, bits {bits:016x}", 2.0 * worst));
}

/// Boxes that tile the domain: the sums `V S` are the integrals of the basis functions, and uniform stress
/// with `σ_rr = σ_θθ`, or `σ_zz` alone, gives no force to free nodes, those on the axis included.
fn patches(comm: &Comm) {
    let reference: Value = serde_json::from_str(&read("axisymmetric_patches.json")).expect("JSON");
    let patches = list(&reference["patches"]);
    let mut worst = [0f64; 2];
    for direct in [false, true] {
        for patch in patches {
            let tree = tree(&reference, &patch["tree"]);
            let boxes = list(&patch["boxes"]);
            let cases: Vec<Value> = boxes
                .iter()
                .enumerate()
                .map(|(i, given)| {
                    json!({"id": i, "tree": tree["id"], "centre": given["centre"], "half": given["half"]})
                })
                .collect();
            let text = json!({"dim": 2, "cells_per_octant_edge": 4, "trees": [tree], "cases": cases});
            let found = evaluate_rings(comm, &text.to_string(), direct).expect("weights");
            if comm.rank() != 0 {
                continue;
            }
            let mut sums: BTreeMap<Vec<u64>, [f64; 3]> = BTreeMap::new();
            for (given, case) in boxes.iter().zip(&found.cases) {
                let ([r, _], [a, b]) = (pair(&given["centre"]), pair(&given["half"]));
                let volume = 4.0 * a * b * r;
                for node in &case.nodes {
                    let sum = sums.entry(node.ijk.clone()).or_default();
                    sum[0] += volume * node.s;
                    sum[1] += volume * (node.grad[0] + node.t);
                    sum[2] += volume * node.grad[1];
                }
            }
            let edge = 1u64 << tree["node_lattice_level"].as_u64().expect("a level");
            let nodes = list(&patch["nodes"]);
            assert_eq!(nodes.len(), sums.len());
            for node in nodes {
                let place = lattice(&node["ijk"]);
                let found = sums[&place];
                let exact = ["sum_V_s", "sum_V_gr_plus_t", "sum_V_gz"].map(|name| number(&node[name]));
                worst[0] = worst[0].max((found[0] - exact[0]).abs());
                (1..3).for_each(|k| worst[1] = worst[1].max((found[k] - exact[k]).abs()));
                assert!(place[0] == edge || exact[1] == 0.0, "the reference is in balance");
            }
            let total: f64 = sums.values().map(|sum| sum[0]).sum();
            assert!((total - 0.5).abs() <= 1e-14, "{total}");
        }
    }
    // Of integrals and forces of the order of a cell's; some hundred terms for each node.
    assert!(worst[0] <= 1e-16 && worst[1] <= 1e-15, "{worst:?}");
    report(comm, format!("{worst:?}"));
}

/// Random boxes of many shapes on random trees.
fn random_rings(comm: &Comm) {
    let mut random = Random::new(5);
    for number in 0..24 {
        let points = 1 + random.below(3);
        let leaves = random_leaves(&mut random, Brick { roots: [1; 2] }, points, 7);
        let leaves = if number % 3 == 2 { graded(leaves) } else { leaves };
        let level = leaves.iter().map(|leaf| u32::from(leaf.level)).max().expect("leaves") + 2;
        let boxes = KINDS.map(|kind| random_box(&mut random, &leaves, kind));
        let octants: Vec<_> =
            leaves.iter().map(|leaf| json!([leaf.level, leaf.coord[0], leaf.coord[1]])).collect();
        let tree = json!({"id": 0, "node_lattice_level": level, "octants": octants});
        let cases: Vec<Value> = boxes
            .iter()
            .zip(KINDS)
            .map(|(given, kind)| {
                let [centre, half] = given.reals().map(|list| list.to_vec());
                json!({"id": kind, "tree": 0, "centre": centre, "half": half})
            })
            .collect();
        let text = json!({"dim": 2, "cells_per_octant_edge": 4, "cases": cases, "trees": [tree]}).to_string();
        let [kernels, direct] =
            [false, true].map(|direct| evaluate_rings(comm, &text, direct).expect("weights").cases);
        if comm.rank() != 0 {
            continue;
        }
        let mut worst = [0f64; 2];
        for ((case, kernels), direct) in cases.iter().zip(&kernels).zip(&direct) {
            let ring = Ring::new(&tree, case);
            let by_place = |found: &CaseWeights<RingWeights>| -> BTreeMap<Vec<u64>, [f64; 4]> {
                let scale = ring.cell.min(ring.centre[0]);
                let values = |node: &RingWeights| {
                    let [g, h] = [0, 1].map(|a| node.grad[a] * ring.cell);
                    (node.ijk.clone(), [node.s, g, h, node.t * scale])
                };
                found.nodes.iter().map(values).collect()
            };
            let mut other = by_place(direct);
            for (place, values) in by_place(kernels) {
                let exact = other.remove(&place).unwrap_or_default();
                (0..4).for_each(|k| worst[0] = worst[0].max((values[k] - exact[k]).abs() / ring.bound()));
            }
            let rest = other.into_values().flatten();
            worst[0] = rest.fold(worst[0], |worst, value| worst.max(value.abs() / ring.bound()));
            for found in [kernels, direct] {
                for node in &found.nodes {
                    // No impulse without mass.
                    assert!(node.s > 0.0 || (node.grad[0] == 0.0 && node.grad[1] == 0.0), "{case}: {node:?}");
                    assert!(node.t >= 0.0, "{case}: {node:?}");
                }
                worst[1] = worst[1].max(ring.errors(found));
            }
        }
        assert!(worst[0] <= 1.0 && worst[1] <= 1.0, "tree {number}: {worst:?} of the bounds");
        report(comm, format!("tree {number}: {:.3} and {:.3} of the bounds", worst[0], worst[1]));
    }
}
