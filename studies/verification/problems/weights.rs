//! Problem 12: weights of boxes, as a run uses them and by definition, against exact arithmetic.
use std::path::Path;

use serde_json::{Value, json};

use crate::checked;
use crate::page::Page;
use crate::runs::Runs;

/// Positions on the line of a box that moves, and how many there are in a cell of the finest leaves.
const POSITIONS: usize = 1024;
const IN_A_CELL: f64 = 64.0;

/// Position (root edges) of a node, its weight, and the gradient of the weight.
type NodeWeight = (Vec<f64>, f64, Vec<f64>);

/// A box with the weights of its nodes.
struct Weights {
    centre: Vec<f64>,
    half: Vec<f64>,
    nodes: Vec<NodeWeight>,
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().into_iter().flatten().map(|x| x.as_f64().unwrap_or(f64::NAN)).collect()
}

fn list<'a>(value: &'a Value, name: &str) -> &'a [Value] {
    value[name].as_array().map_or(&[], Vec::as_slice)
}

fn tree_of<'a>(input: &'a Value, case: &Value) -> &'a Value {
    list(input, "trees").iter().find(|tree| tree["id"] == case["tree"]).unwrap_or(&Value::Null)
}

/// Edge of the cells of the coarsest and of the finest leaves of a tree, root edges.
fn cells(tree: &Value) -> [f64; 2] {
    let levels = || list(tree, "octants").iter().filter_map(|octant| octant[0].as_i64());
    [levels().min(), levels().max()].map(|level| 0.25 * 0.5f64.powi(level.unwrap_or(0) as i32))
}

/// The weights of `nodes` of a case.
fn weights(input: &Value, case: &Value, nodes: &[Value]) -> Weights {
    let lattice = tree_of(input, case)["node_lattice_level"].as_i64().unwrap_or(0);
    let scale = 0.5f64.powi(lattice as i32);
    let nodes = nodes.iter().map(|node| {
        let place = numbers(&node["ijk"]).into_iter().map(|x| x * scale).collect();
        (place, node["w"].as_f64().unwrap_or(f64::NAN), numbers(&node["grad"]))
    });
    Weights { centre: numbers(&case["centre"]), half: numbers(&case["half"]), nodes: nodes.collect() }
}

impl Weights {
    /// The number of the box with which errors of double arithmetic grow.
    fn kappa(&self) -> f64 {
        let widths = self.centre.iter().zip(&self.half);
        f64::EPSILON * widths.map(|(x, half)| ((x.abs() + 1.0) / half).max(1.0)).sum::<f64>()
    }

    /// Greatest difference of weights, and of gradients times the coarsest cell.
    fn difference(&self, other: &Self, cell: f64) -> f64 {
        if self.nodes.len() != other.nodes.len() {
            return f64::INFINITY;
        }
        let pairs = self.nodes.iter().zip(&other.nodes).map(|(a, b)| {
            let slopes = a.2.iter().zip(&b.2).map(|(a, b)| cell * (a - b).abs());
            if a.0 == b.0 { slopes.fold((a.1 - b.1).abs(), f64::max) } else { f64::INFINITY }
        });
        pairs.fold(0.0, f64::max)
    }

    /// Errors of the sum of the weights, of the interpolated x, of its gradient (times the finest cell), and of the interpolated product of
    /// all coordinates.
    fn sums(&self, cell: f64) -> [f64; 4] {
        let sum = |of: &dyn Fn(&NodeWeight) -> f64| self.nodes.iter().map(of).sum::<f64>();
        let axes = 0..self.centre.len();
        let place = axes.clone().map(|a| (sum(&|node| node.1 * node.0[a]) - self.centre[a]).abs());
        let slopes = axes.clone().flat_map(|a| axes.clone().map(move |b| (a, b))).map(|(a, b)| {
            let exact = f64::from(u8::from(a == b));
            cell * (sum(&|node| node.0[a] * node.2[b]) - exact).abs()
        });
        let product =
            sum(&|node| node.1 * node.0.iter().product::<f64>()) - self.centre.iter().product::<f64>();
        [
            (sum(&|node| node.1) - 1.0).abs(),
            place.fold(0.0, f64::max),
            slopes.fold(0.0, f64::max),
            product.abs(),
        ]
    }
}

/// What `agimp weights` prints for an input.
fn evaluate(runs: &Runs, input: &Path, direct: bool, ranks: usize) -> Value {
    let mut command = runs.command(ranks);
    command.arg("weights").arg(input);
    if direct {
        command.arg("--direct");
    }
    let output = checked(command.output());
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
    checked(serde_json::from_slice(&output.stdout))
}

/// Whether a leaf touches a place.
fn touches(octant: &[f64], place: &[f64]) -> bool {
    let edge = 0.5f64.powi(octant[0] as i32);
    octant[1..].iter().zip(place).all(|(at, x)| at * edge <= *x && *x <= (at + 1.0) * edge)
}

/// Whether two leaves are one, or share a face.
fn shares_face(a: &[f64], b: &[f64]) -> bool {
    let edge = |octant: &[f64]| 0.5f64.powi(octant[0] as i32);
    let overlaps = a[1..].iter().zip(&b[1..]).map(|(x, y)| {
        let [low, high] = [(x * edge(a)).max(y * edge(b)), ((x + 1.0) * edge(a)).min((y + 1.0) * edge(b))];
        high - low
    });
    let overlaps: Vec<f64> = overlaps.collect();
    overlaps.iter().all(|&overlap| overlap >= 0.0)
        && overlaps.iter().filter(|&&overlap| overlap == 0.0).count() <= 1
}

/// Share of the boxes with a node that neither the leaf of the box nor its neighbours across faces have.
fn beyond_faces(input: &Value) -> f64 {
    let cases = list(input, "cases");
    let beyond = cases.iter().filter(|case| {
        let given = weights(input, case, list(case, "nodes"));
        let leaves: Vec<Vec<f64>> = list(tree_of(input, case), "octants").iter().map(numbers).collect();
        let Some(own) = leaves.iter().find(|leaf| touches(leaf, &given.centre)) else { return false };
        let near: Vec<_> = leaves.iter().filter(|leaf| shares_face(own, leaf)).collect();
        given.nodes.iter().any(|(place, ..)| !near.iter().any(|leaf| touches(leaf, place)))
    });
    beyond.count() as f64 / cases.len() as f64
}

/// Greatest change of a gradient over its bound as a box of half a cell, times `factor`, moves nearly along the diagonal through the finest
/// leaves of the tree with the greatest jump of levels.
fn roughness(runs: &Runs, input: &Value, factor: f64) -> f64 {
    let steepest = |tree: &&Value| tree["max_level_jump"].as_i64();
    let Some(tree) = list(input, "trees").iter().max_by_key(steepest) else { return f64::NAN };
    let [_, cell] = cells(tree);
    let (half, step) = (0.5 * cell, cell / IN_A_CELL);
    let finest =
        list(tree, "octants").iter().map(numbers).max_by(|a, b| a[0].total_cmp(&b[0])).unwrap_or_default();
    let length = step * POSITIONS as f64;
    let start = |axis: usize| {
        // Not quite along the diagonal, so that faces are not passed together.
        let middle = (finest[axis + 1] + 0.5) * 4.0 * cell + 0.13 * cell * axis as f64;
        (middle - 0.5 * length).clamp(half, 1.0 - half - length)
    };
    let cases = (0..POSITIONS).map(|i| {
        let centre: Vec<f64> = (0..finest.len() - 1).map(|axis| start(axis) + step * i as f64).collect();
        let dim = centre.len();
        json!({ "id": i, "tree": tree["id"], "centre": centre, "half": vec![factor * half; dim] })
    });
    let dim = finest.len() - 1;
    let path = json!({
        "dim": dim, "cells_per_octant_edge": 4, "trees": [tree], "cases": cases.collect::<Vec<_>>()
    });
    let file = runs.folder.join("path.json");
    checked(std::fs::write(&file, path.to_string()));
    let found = evaluate(runs, &file, false, runs.ranks);
    let gradients = list(&found, "cases").iter().map(|case| {
        let nodes = list(case, "nodes").iter().map(|node| (node["ijk"].to_string(), numbers(&node["grad"])));
        nodes.collect::<std::collections::BTreeMap<_, _>>()
    });
    let gradients: Vec<_> = gradients.collect();
    // Proved for boxes of at least half a cell: half of this (problem set, W6).
    let bound = 2.0 * dim as f64 / (half * cell) * step;
    let mut worst = 0.0f64;
    for pair in gradients.windows(2) {
        for place in pair[0].keys().chain(pair[1].keys()) {
            for axis in 0..dim {
                let [a, b] = [0, 1].map(|i: usize| pair[i].get(place).map_or(0.0, |gradient| gradient[axis]));
                worst = worst.max((a - b).abs() / bound);
            }
        }
    }
    worst
}

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 12 Weights\n\n\
         Weights and gradients of boxes of many shapes on graded and non-graded trees (jumps of up to five levels), in 2D and 3D, against exact rational arithmetic by independent code: \
         `tests/data/golden`. *Kernels* are the weights with which a run transfers, *definition* the integral cell by cell (`agimp weights`, with and without `--direct`). \
         Errors are in units of eps kappa, the error of double arithmetic for a box of its size and place. Exact are 1 for the sum of the weights, the centre for the interpolated \
         position, the unit matrix for its gradient, and the product of the centre's coordinates for that of the nodes. As a box of half a fine cell moves through a jump of levels, \
         gradients are Lipschitz continuous; with *linear hats* (boxes of a millionth) they jump. *Face neighbours*: boxes whose nodes do not all belong to the leaf that holds the \
         box and to its neighbours across faces; a ghost layer of face neighbours alone would lose their mass. Transfers of many particles on these trees are compared in \
         `tests/all/golden.rs`, on 1 to 4 ranks.\n",
    );
    checked(std::fs::create_dir_all(&runs.folder));
    let mut rows = Vec::new();
    for dim in ["2d", "3d"] {
        let path = runs.top.join(format!("tests/data/golden/weights_{dim}.json"));
        let input: Value = checked(serde_json::from_str(&checked(std::fs::read_to_string(&path))));
        let cases = list(&input, "cases");
        let compared = |found: &Value| {
            let pairs = cases.iter().zip(list(found, "cases")).map(|(case, found)| {
                let [exact, ours] = [case, found].map(|of| weights(&input, case, list(of, "nodes")));
                let [coarsest, finest] = cells(tree_of(&input, case));
                let errors = [exact.difference(&ours, coarsest)].into_iter().chain(ours.sums(finest));
                errors.map(|error| error / exact.kappa()).collect::<Vec<_>>()
            });
            pairs.fold([0.0f64; 5], |worst, errors| std::array::from_fn(|i| worst[i].max(errors[i])))
        };
        let found = evaluate(runs, &path, false, runs.ranks);
        let kernels = compared(&found);
        let definition = compared(&evaluate(runs, &path, true, runs.ranks))[0];
        let same = found == evaluate(runs, &path, false, 3);
        let smooth = [1.0, 1e-6].map(|factor| roughness(runs, &input, factor));
        let beyond = beyond_faces(&input);
        let measured = [
            ("kernels", kernels[0]),
            ("definition", definition),
            ("sum", kernels[1]),
            ("place", kernels[2]),
            ("slope", kernels[3]),
            ("product", kernels[4]),
            ("ranks", f64::from(u8::from(!same))),
            ("smooth", smooth[0]),
            ("hats", smooth[1]),
            ("faces", beyond),
        ];
        for (what, value) in measured {
            page.line(&format!("weights.{what}.{dim}"), value);
        }
        let numbers = [kernels[0], definition, kernels[1], kernels[2], kernels[3], kernels[4]];
        let mut row = vec![dim.to_uppercase(), cases.len().to_string()];
        row.extend(numbers.map(|value| format!("{value:.2}")));
        row.extend(smooth.map(|value| format!("{value:.2}")));
        row.push(format!("{:.0} %", 100.0 * beyond));
        rows.push(row);
    }
    page.table(
        &[
            "",
            "boxes",
            "kernels",
            "definition",
            "sum of weights",
            "position",
            "its gradient",
            "product",
            "change of gradients over its bound",
            "linear hats",
            "beyond face neighbours",
        ],
        &rows,
    );
}
