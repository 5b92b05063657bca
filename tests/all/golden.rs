//! Weights and transfers against data made in exact rational arithmetic by independent code; see
//! `tests/data/golden/README.md`.

use std::collections::BTreeMap;
use std::path::Path;

use crate::common::boxes::gradient_sums;
use crate::common::scenarios::{Scenario, agrees_for, report};
use crate::common::tree::{forest_of, octants};
use agimp::kernel::Transfer;
use agimp::particle::chunk::{Chunk, Layout};
use agimp::solver::diagnostics::given_boxes::{GivenBoxes, GivenParticle};
use agimp::solver::diagnostics::weights::{CaseWeights, evaluate};
use partition::{Brick, Comm, MAX_LEVEL};
use serde_json::Value;

const EPS: f64 = f64::EPSILON;

pub(crate) const SCENARIOS: &[(&str, Scenario)] = &[
    ("weights_2d", |comm| weights(comm, "weights_2d.json", false)),
    ("weights_3d", |comm| weights(comm, "weights_3d.json", false)),
    ("direct_2d", |comm| weights(comm, "weights_2d.json", true)),
    ("direct_3d", |comm| weights(comm, "weights_3d.json", true)),
    ("transfers_2d", |comm| {
        for file in ["transfer_graded_2d", "transfer_nongraded_2d", "affine_graded_2d", "affine_nongraded_2d"]
        {
            transfer::<2>(comm, file);
        }
    }),
    ("transfers_3d", |comm| {
        for file in ["transfer_graded_3d", "transfer_nongraded_3d", "affine_graded_3d", "affine_nongraded_3d"]
        {
            transfer::<3>(comm, file);
        }
    }),
    ("patches", patches),
];

#[test]
fn weights_2d() {
    agrees_for("weights_2d", &[1, 2, 3, 4]);
}

#[test]
fn weights_3d() {
    agrees_for("weights_3d", &[1, 3]);
}

#[test]
fn weights_by_definition() {
    agrees_for("direct_2d", &[1]);
    agrees_for("direct_3d", &[1]);
}

#[test]
fn transfers_2d() {
    agrees_for("transfers_2d", &[1, 2, 4]);
}

#[test]
fn transfers_3d() {
    agrees_for("transfers_3d", &[1, 2, 3]);
}

#[test]
fn uniform_stress_gives_no_force() {
    agrees_for("patches", &[1, 2]);
}

#[test]
fn command_prints_weights_or_the_reason() {
    let run = |text: &str, arguments: &[&str]| {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), text).expect("a file");
        let mut command = assert_cmd::Command::cargo_bin("agimp").expect("the program");
        let output = command.arg("weights").arg(file.path()).args(arguments).output().expect("it runs");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    // The least that a file must have.
    let tree = r#""dim": 2, "cells_per_octant_edge": 4, "trees": [{"id": 7, "octants": [[0, 0, 0]]}]"#;
    let case = |tree: u32, half: f64| {
        format!(r#"{{"id": "a", "tree": {tree}, "centre": [0.375, 0.5], "half": [{half}, 0.125]}}"#)
    };
    let input = |case: String| format!("{{{tree}, \"cases\": [{case}]}}");
    for arguments in [&[][..], &["--direct"]] {
        let (code, stdout, stderr) = run(&input(case(7, 0.125)), arguments);
        assert_eq!((code, &stderr[..]), (Some(0), ""));
        let found = parse(&stdout);
        assert_eq!(found["cases"][0]["id"], "a");
        let nodes = list(&found["cases"][0]["nodes"]);
        let places: Vec<Vec<u64>> = nodes.iter().map(|node| lattice(&node["ijk"])).collect();
        assert_eq!(places, [[1, 1], [1, 2], [1, 3], [2, 1], [2, 2], [2, 3]]);
        assert_eq!(number(&nodes[1]["w"]), 0.375);
        assert_eq!(vector::<2>(&nodes[1]["grad"]), [-3.0, 0.0]);
    }
    for (text, reason) in [
        (input(case(8, 0.125)), "a case names a tree that is not in the file"),
        (input(case(7, 0.5)), "the box must have a volume and lie in the unit cell"),
        (input(case(7, 0.125)).replace("[0, 0, 0]", "[1, 0, 0]"), "is not a tree"),
        (input(case(7, 0.125)).replace("[0, 0, 0]", "[1, 2, 0]"), "octants must be"),
        (input(case(7, 0.125)).replace("\"dim\": 2", "\"dim\": 4"), "`dim` is 4"),
        ("{".into(), "EOF"),
    ] {
        let (code, stdout, stderr) = run(&text, &[]);
        assert_eq!((code, &stdout[..]), (Some(2), ""), "{stderr}");
        assert!(stderr.contains(reason) && stderr.lines().count() == 1, "{reason:?} in {stderr:?}");
    }
}

fn read(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/golden").join(file);
    std::fs::read_to_string(path).expect("golden data")
}

fn parse(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn vector<const D: usize>(value: &Value) -> [f64; D] {
    std::array::from_fn(|axis| number(&value[axis]))
}

fn matrix<const D: usize>(value: &Value) -> [[f64; D]; D] {
    std::array::from_fn(|row| vector(&value[row]))
}

/// `ijk` of a node.
fn lattice(value: &Value) -> Vec<u64> {
    list(value).iter().map(|x| x.as_u64().expect("a coordinate")).collect()
}

/// All weights within `2 eps κ`, for exactly the nodes of the reference.
fn weights(comm: &Comm, file: &str, direct: bool) {
    let text = read(file);
    let found = evaluate(comm, &text, direct).expect("weights");
    if comm.rank() != 0 {
        return;
    }
    let reference = parse(&text);
    let mut worst: f64 = 0.0;
    assert_eq!(found.cases.len(), list(&reference["cases"]).len());
    for (case, found) in list(&reference["cases"]).iter().zip(&found.cases) {
        assert_eq!(case["id"], found.id);
        worst = worst.max(error_of_case(&reference, case, found));
    }
    assert!(worst <= 2.0, "{file}: {worst} eps kappa");
    let bits = found.cases.iter().flat_map(|case| &case.nodes);
    let bits = bits.fold(0u64, |sum, node| {
        node.grad
            .iter()
            .fold(sum.rotate_left(7) ^ node.w.to_bits(), |sum, g| sum.rotate_left(9) ^ g.to_bits())
    });
    report(comm, format!("{file}: {worst:.3} eps kappa, bits {bits:016x}"));
}

/// Greatest error of a case in units of `eps κ`.
fn error_of_case(reference: &Value, case: &Value, found: &CaseWeights) -> f64 {
    let tree = list(&reference["trees"]).iter().find(|tree| tree["id"] == case["tree"]).expect("a tree");
    let widths = list(&case["centre"]).iter().zip(list(&case["half"]));
    let kappa: f64 = widths.map(|(x, half)| ((number(x).abs() + 1.0) / number(half)).max(1.0)).sum();
    // The coarsest cells make the strictest bound on gradients.
    let coarsest = list(&tree["octants"]).iter().map(|o| o[0].as_u64().expect("a level")).min();
    let cell = 0.25 * 0.5f64.powi(coarsest.expect("octants") as i32);
    let nodes = list(&case["nodes"]);
    let places: Vec<Vec<u64>> = nodes.iter().map(|node| lattice(&node["ijk"])).collect();
    let found_places: Vec<Vec<u64>> = found.nodes.iter().map(|node| node.ijk.clone()).collect();
    assert_eq!(places, found_places, "nodes of case {}", case["id"]);
    let mut worst: f64 = 0.0;
    for (node, found) in nodes.iter().zip(&found.nodes) {
        assert!(found.w >= 0.0);
        worst = worst.max((number(&node["w"]) - found.w).abs());
        for (g, found) in list(&node["grad"]).iter().zip(&found.grad) {
            worst = worst.max(cell * (number(g) - found).abs());
        }
    }
    worst / (EPS * kappa)
}

/// Errors of one quantity, relative to its greatest value.
#[derive(Default)]
struct Errors(BTreeMap<&'static str, (f64, f64)>);

impl Errors {
    fn add(&mut self, what: &'static str, found: f64, reference: f64) {
        let entry = self.0.entry(what).or_default();
        // NaN must not pass.
        entry.0 = if (found - reference).abs() <= entry.0 { entry.0 } else { (found - reference).abs() };
        entry.1 = entry.1.max(reference.abs());
    }

    fn check(&self, comm: &Comm, file: &str) {
        for (what, (error, greatest)) in &self.0 {
            let relative = error / greatest;
            assert!(relative <= 1e-13, "{file}: {what} is wrong by {relative:e}");
            println!("rank {} {file}: {what} {relative:.1e}", comm.rank());
        }
    }
}

/// Columns `AFFINE` of a particle with affine matrix `c` and second moments `d`: the matrix `B = C D` of
/// APIC.
fn stored_affine<const D: usize>(c: [[f64; D]; D], d: [f64; D]) -> [[f64; D]; D] {
    c.map(|row| std::array::from_fn(|k| row[k] * d[k]))
}

/// Columns `AFFINE`: B after an APIC transfer, the velocity gradient after a TPIC transfer.
fn columns<const D: usize>(chunk: &Chunk<D>, p: usize) -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|k| chunk.column(Layout::<D>::AFFINE + D * i + k)[p]))
}

/// P2G, and G2P of the nodal velocities.
fn transfer<const D: usize>(comm: &Comm, name: &str) {
    let reference = parse(&read(&format!("{name}.json")));
    let (particles, gathered) = (list(&reference["particles"]), list(&reference["g2p"]));
    let given: Vec<GivenParticle<D>> = particles
        .iter()
        .zip(gathered)
        .map(|(p, after)| GivenParticle {
            position: vector(&p["x"]),
            half: vector(&p["half"]),
            mass: number(&p["m"]),
            velocity: vector(&p["v"]),
            affine: stored_affine(matrix(&p["C"]), vector(&after["D"])),
            energy: 0.0,
        })
        .collect();
    let forest = forest_of(comm, Brick { roots: [1; D] }, octants(&reference["octants"]));
    let mut boxes = GivenBoxes::new(comm, forest, 1.0);
    boxes.place(&given);
    boxes.to_nodes(0.0).expect("all boxes fit");
    let mut errors = Errors::default();
    let nodes = boxes.all_real_nodes(comm);
    if comm.rank() == 0 {
        check_nodes(&reference, &nodes, &mut errors);
    }
    boxes.to_velocities();
    boxes.to_particles(Transfer::Apic);
    for (chunk, p, id) in particles_of(&boxes) {
        let after = &gathered[id];
        let d: [f64; D] = vector(&after["D"]);
        let b = columns(chunk, p);
        let (b_exact, c_exact) = (matrix::<D>(&after["B"]), matrix::<D>(&after["C"]));
        for i in 0..D {
            let v = chunk.column(Layout::<D>::VELOCITY + i)[p];
            errors.add("v", v, number(&after["v"][i]));
            for k in 0..D {
                errors.add("B", b[i][k], b_exact[i][k]);
                errors.add("C", b[i][k] / d[k], c_exact[i][k]);
            }
        }
    }
    boxes.to_particles(Transfer::Tpic);
    for (chunk, p, id) in particles_of(&boxes) {
        let (found, exact) = (columns(chunk, p), matrix::<D>(&gathered[id]["gradv"]));
        (0..D * D).for_each(|i| errors.add("gradv", found[i / D][i % D], exact[i / D][i % D]));
    }
    errors.check(comm, name);
    report(comm, name);
}

fn check_nodes<const D: usize>(
    reference: &Value,
    nodes: &[agimp::solver::diagnostics::given_boxes::RealNode<D>],
    errors: &mut Errors,
) {
    let level = reference["node_lattice_level"].as_u64().expect("a level") as u32;
    let exact = list(&reference["nodes"]);
    assert_eq!(nodes.len(), exact.len());
    for (node, exact) in nodes.iter().zip(exact) {
        let ijk = node.place.map(|x| u64::from(x) >> (u32::from(MAX_LEVEL) + 2 - level));
        assert_eq!(ijk[..], lattice(&exact["ijk"])[..]);
        errors.add("nodal mass", node.mass, number(&exact["m"]));
        for axis in 0..D {
            errors.add("nodal momentum", node.momentum[axis], number(&exact["mv"][axis]));
        }
    }
}

/// Particles of this rank: chunk, index there and identifier.
fn particles_of<const D: usize>(boxes: &GivenBoxes<D>) -> impl Iterator<Item = (&Chunk<D>, usize, usize)> {
    boxes
        .chunks()
        .iter()
        .flat_map(|chunk| chunk.ids().iter().enumerate().map(move |(p, &id)| (chunk, p, id as usize)))
}

fn patches(comm: &Comm) {
    for patch in list(&parse(&read("patch_test.json"))) {
        match patch["dim"].as_u64() {
            Some(2) => tiling::<2>(comm, patch),
            _ => tiling::<3>(comm, patch),
        }
    }
}

/// Boxes that tile the domain under uniform stress: the force on each node is the integral of its basis
/// function's gradient, zero in the interior.
fn tiling<const D: usize>(comm: &Comm, patch: &Value) {
    let boxes: Vec<([f64; D], [f64; D])> =
        list(&patch["boxes"]).iter().map(|b| (vector(&b["centre"]), vector(&b["half"]))).collect();
    let given: Vec<GivenParticle<D>> = boxes
        .iter()
        .map(|&(position, half)| {
            let volume = half.iter().map(|h| 2.0 * h).product();
            let (velocity, affine) = ([0.0; D], [[0.0; D]; D]);
            GivenParticle { position, half, mass: volume, velocity, affine, energy: volume }
        })
        .collect();
    let leaves = octants::<D>(&patch["octants"]);
    let brick = Brick { roots: [1; D] };
    let mut grid = GivenBoxes::new(comm, forest_of(comm, brick, leaves.clone()), 1.0);
    grid.place(&given);
    grid.to_nodes(-1.0).expect("all boxes fit");
    let nodes = grid.all_real_nodes(comm);
    if comm.rank() != 0 {
        return;
    }
    let [transferred, whole] = gradient_sums(brick, &leaves, &given);
    let exact = list(&patch["nodes"]);
    assert_eq!(nodes.len(), exact.len());
    let (mut worst, mut beyond): (f64, usize) = (0.0, 0);
    for (node, exact) in nodes.iter().zip(exact) {
        let volume = number(&exact["sum_V_w"]);
        assert!((node.mass - volume).abs() <= 64.0 * EPS * volume, "volume of {:?}", node.place);
        for axis in 0..D {
            let error = (node.momentum[axis] - number(&exact["sum_V_grad"][axis])).abs();
            // The sum over the boxes that are transferred: a box around the whole support of a node has no
            // gradient itself, while its parts have.
            let bound = EPS * transferred[&node.place];
            assert!(error <= 64.0 * bound, "{}: {error:e} at {:?}", patch["name"], node.place);
            worst = worst.max(error / bound);
            // Over the boxes as given it holds as well, but where that sum is itself no more than round-off:
            // at nodes whose whole support lies in one box.
            if error > 64.0 * EPS * whole[&node.place] {
                assert!(whole[&node.place] < 1e-13 * transferred[&node.place], "{:?}", node.place);
                beyond += 1;
            }
        }
    }
    let text = format!("{} {D}D: {worst:.1} eps sum V|grad w|", patch["name"]);
    report(comm, format!("{text}; {beyond} components at nodes inside one box"));
}
