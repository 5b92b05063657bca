//! Weights of given boxes on given trees in JSON, as a run would use them or by definition.
use std::collections::BTreeMap;

use partition::comm::Comm;
use partition::{Brick, Forest, MAX_LEVEL, Octant};
use serde::{Deserialize, Serialize};

use super::given_boxes::{GivenBoxes, GivenParticle, RealNode};
use crate::grid::direct;
use crate::grid::plan::ghost_layer::KnownTree;
use crate::kernel::Coordinates;

/// Why there are no weights.
#[derive(Debug, thiserror::Error)]
pub enum NoWeights {
    /// The cases ask for something impossible; in words.
    #[error("{0}")]
    Cases(String),
    /// A failure on the way; in words.
    #[error("{0}")]
    Run(String),
}

/// Trees and boxes.
#[derive(Debug, Deserialize)]
struct Input {
    dim: u64,
    cells_per_octant_edge: u64,
    trees: Vec<Tree>,
    cases: Vec<Case>,
}

#[derive(Debug, Deserialize)]
struct Tree {
    id: Option<serde_json::Value>,
    /// Positions of nodes are `ijk / 2^node_lattice_level`; the finest cells of the tree if absent.
    node_lattice_level: Option<u32>,
    octants: Vec<Vec<u32>>,
}

#[derive(Debug, Deserialize)]
struct Case {
    id: serde_json::Value,
    /// `id` of a tree, or its number in the list where trees have none.
    tree: serde_json::Value,
    centre: Vec<f64>,
    half: Vec<f64>,
}

/// The printed result.
#[derive(Debug, Serialize)]
pub struct Output<N = NodeWeights> {
    /// One entry per case, in the order of the input.
    pub cases: Vec<CaseWeights<N>>,
}

/// Weights of one box.
#[derive(Debug, Serialize)]
pub struct CaseWeights<N = NodeWeights> {
    /// As in the input.
    pub id: serde_json::Value,
    /// Real nodes with a weight or gradient other than zero, in lexicographic order.
    pub nodes: Vec<N>,
}

/// Weight of one node.
#[derive(Debug, Serialize)]
pub struct NodeWeights {
    /// Position on the lattice of the tree.
    pub ijk: Vec<u64>,
    /// Weight.
    pub w: f64,
    /// Gradient of the weight with respect to the box's centre.
    pub grad: Vec<f64>,
}

/// Weight of one node for a box that is the section of a ring of area A around the radius r_p; integrals over
/// the section.
#[derive(Debug, Serialize)]
pub struct RingWeights {
    /// Position on the lattice of the tree.
    pub ijk: Vec<u64>,
    /// Weight, `∫ N r / (A r_p)`.
    pub s: f64,
    /// Along radius and height, `∫ ∇N r / (A r_p)`, 1/m.
    pub grad: Vec<f64>,
    /// Along the hoop, `∫ N / (A r_p)`, 1/m.
    pub t: f64,
}

/// Collective. Weights of all cases in `text`, on rank 0; by definition if `direct`.
///
/// # Errors
/// The same on all ranks.
pub fn evaluate(comm: &Comm, text: &str, direct: bool) -> Result<Output, NoWeights> {
    let input = read(comm, text)?;
    match input.dim {
        2 => evaluate_in::<2, _>(comm, &input, direct, planar, Coordinates::Cartesian),
        _ => evaluate_in::<3, _>(comm, &input, direct, planar, Coordinates::Cartesian),
    }
}

/// As [`evaluate`], for boxes that are sections of rings.
///
/// # Errors
/// The same on all ranks.
pub fn evaluate_rings(comm: &Comm, text: &str, direct: bool) -> Result<Output<RingWeights>, NoWeights> {
    let input = read(comm, text)?;
    if input.dim != 2 {
        return Err(NoWeights::Cases("`dim` is 3; sections of rings have `dim` 2, radius and height".into()));
    }
    evaluate_in::<2, _>(comm, &input, direct, ring, Coordinates::Axisymmetric)
}

/// Collective. The same on all ranks.
fn read(comm: &Comm, text: &str) -> Result<Input, NoWeights> {
    let input: Result<Input, _> =
        serde_json::from_str(text).map_err(|error| NoWeights::Cases(error.to_string()));
    let input = agreed(comm, input)?;
    match (input.dim, input.cells_per_octant_edge) {
        (2 | 3, 4) => Ok(input),
        (2 | 3, cells) => Err(NoWeights::Cases(format!("octants have 4 cells along an edge, not {cells}"))),
        (dim, _) => Err(NoWeights::Cases(format!("`dim` is {dim}; it must be 2 or 3"))),
    }
}

/// Collective. Fails on all ranks, in the same words, if any rank failed.
fn agreed<T>(comm: &Comm, result: Result<T, NoWeights>) -> Result<T, NoWeights> {
    comm.agree(result).map_err(|disagreement| NoWeights::Cases(disagreement.message))
}

/// Nodes of a box from the evaluator of its tree; the last argument is the level of the lattice.
type Weigh<const D: usize, N> =
    fn(&Comm, &mut Evaluator<D>, &GivenParticle<D>, u32) -> Result<Vec<N>, NoWeights>;

/// Weights with nodes as `weigh` makes them from the evaluator of a tree, a box and the level of the lattice.
fn evaluate_in<const D: usize, N>(
    comm: &Comm,
    input: &Input,
    direct: bool,
    weigh: Weigh<D, N>,
    coordinates: Coordinates,
) -> Result<Output<N>, NoWeights> {
    let mut found: Vec<Option<CaseWeights<N>>> = input.cases.iter().map(|_| None).collect();
    let mut used = 0;
    for (number, tree) in input.trees.iter().enumerate() {
        let id = tree.id.clone().unwrap_or_else(|| number.into());
        let mut cases: Vec<usize> = (0..input.cases.len()).filter(|&i| input.cases[i].tree == id).collect();
        used += cases.len();
        let leaves = tree.leaves::<D>().map_err(|error| NoWeights::Cases(format!("tree {id}: {error}")));
        let leaves = agreed(comm, leaves)?;
        let boxes: Result<Vec<_>, _> =
            cases.iter().map(|&i| input.cases[i].given::<D>(coordinates)).collect();
        let boxes = agreed(comm, boxes.map_err(NoWeights::Cases))?;
        let forest = spread(comm, &leaves)
            .map_err(|error| NoWeights::Cases(format!("tree {id} is not a tree: {error}")));
        let forest = agreed(comm, forest)?;
        let level = tree.lattice_level(&leaves);
        let mut evaluator = Evaluator::new(comm, forest, leaves, direct);
        for (i, given) in cases.drain(..).zip(boxes) {
            let case_id = input.cases[i].id.clone();
            let nodes = weigh(comm, &mut evaluator, &given, level).map_err(|failure| match failure {
                NoWeights::Cases(message) => NoWeights::Cases(format!("case {case_id}: {message}")),
                other => other,
            });
            found[i] = Some(CaseWeights { id: case_id, nodes: agreed(comm, nodes)? });
        }
    }
    if used < input.cases.len() {
        return Err(NoWeights::Cases("a case names a tree that is not in the file".into()));
    }
    Ok(Output { cases: found.into_iter().flatten().collect() })
}

impl Tree {
    /// Octants along the curve.
    fn leaves<const D: usize>(&self) -> Result<Vec<Octant<D>>, String> {
        let octant = |numbers: &Vec<u32>| match numbers[..] {
            [level, ref coord @ ..] if coord.len() == D && level <= u32::from(MAX_LEVEL) => {
                let coord: [u32; D] = std::array::from_fn(|axis| coord[axis]);
                let is_inside = coord.iter().all(|c| c >> level == 0);
                is_inside.then_some(Octant { level: level as u8, coord })
            }
            _ => None,
        };
        let found: Option<Vec<_>> = self.octants.iter().map(octant).collect();
        let mut leaves = found.ok_or_else(|| {
            format!("octants must be [level, {} coordinates] inside the unit cell, level <= {MAX_LEVEL}", D)
        })?;
        leaves.sort_unstable();
        Ok(leaves)
    }

    fn lattice_level<const D: usize>(&self, leaves: &[Octant<D>]) -> u32 {
        let finest = leaves.iter().map(|leaf| u32::from(leaf.level)).max().unwrap_or(0);
        self.node_lattice_level.unwrap_or(finest + 2)
    }
}

impl Case {
    fn given<const D: usize>(&self, coordinates: Coordinates) -> Result<GivenParticle<D>, String> {
        let numbers = |list: &[f64]| <[f64; D]>::try_from(list).ok();
        let (Some(centre), Some(half)) = (numbers(&self.centre), numbers(&self.half)) else {
            return Err(format!("case {}: `centre` and `half` must have {D} numbers", self.id));
        };
        // Rounding may put the face of a box that touches a wall a little outside.
        let slack = 1e-12;
        if coordinates == Coordinates::Axisymmetric {
            let (radius, reach) = (centre[0], centre[0] - half[0]);
            if radius <= 0.0 {
                return Err(format!(
                    "case {}: its centre has the radius {radius}; it must be above 0",
                    self.id
                ));
            }
            if reach < -slack {
                let axis = "the box must not cross the axis, r = 0";
                return Err(format!("case {}: its box reaches r = {reach}; {axis}", self.id));
            }
        }
        let is_inside = (0..D).all(|a| {
            half[a] > 0.0
                && centre[a] > 0.0
                && centre[a] < 1.0
                && centre[a] - half[a] >= -slack
                && centre[a] + half[a] <= 1.0 + slack
        });
        if !is_inside {
            return Err(format!("case {}: the box must have a volume and lie in the unit cell", self.id));
        }
        // With V₀ τ = I and Δt = -1 the impulse of stress is the gradient of the weight.
        let still = [0.0; D];
        let affine = [[0.0; D]; D];
        Ok(GivenParticle { position: centre, half, mass: 1.0, velocity: still, affine, energy: 1.0 })
    }
}

/// Collective. A forest in equal shares.
fn spread<const D: usize>(comm: &Comm, leaves: &[Octant<D>]) -> Result<Forest<D>, partition::ForestError> {
    let cut = |rank: usize| rank * leaves.len() / comm.size();
    let own = leaves[cut(comm.rank())..cut(comm.rank() + 1)].to_vec();
    Forest::from_leaves(comm, Brick { roots: [1; D] }, own)
}

/// Finds weights on one tree.
enum Evaluator<const D: usize> {
    Direct(KnownTree<D>),
    Production(Box<GivenBoxes<D>>),
}

impl<const D: usize> Evaluator<D> {
    fn new(comm: &Comm, forest: Forest<D>, leaves: Vec<Octant<D>>, direct: bool) -> Self {
        match direct {
            true => Self::Direct(KnownTree::whole(*forest.brick(), leaves)),
            false => Self::Production(Box::new(GivenBoxes::new(comm, forest, 1.0))),
        }
    }

    /// Collective. Real nodes in lexicographic order, on rank 0: mass is the weight, momentum its gradient.
    fn nodes(
        &mut self,
        comm: &Comm,
        given: &GivenParticle<D>,
        coordinates: Coordinates,
    ) -> Result<Vec<RealNode<D>>, NoWeights> {
        match self {
            Self::Direct(tree) if comm.rank() == 0 => {
                let nodes = direct::weights_in(coordinates, tree, 1.0, given.position, given.half);
                let as_real = |node: direct::DirectNode<D>| RealNode {
                    place: node.place,
                    momentum: node.gradient,
                    mass: node.weight,
                };
                Ok(nodes.into_iter().map(as_real).collect())
            }
            Self::Direct(_) => Ok(Vec::new()),
            Self::Production(boxes) => {
                boxes.set_coordinates(coordinates);
                boxes.place(&[*given]);
                let scattered = boxes.to_nodes(-1.0).map_err(|error| NoWeights::Run(error.to_string()));
                agreed(comm, scattered)?;
                Ok(boxes.all_real_nodes(comm))
            }
        }
    }
}

/// Collective. Weights and gradients of a box.
fn planar<const D: usize>(
    comm: &Comm,
    evaluator: &mut Evaluator<D>,
    given: &GivenParticle<D>,
    level: u32,
) -> Result<Vec<NodeWeights>, NoWeights> {
    let nodes = evaluator.nodes(comm, given, Coordinates::Cartesian)?;
    let as_weights = |node: &RealNode<D>| {
        let ijk = on_lattice(node.place, level)?;
        Ok(NodeWeights { ijk, w: node.mass, grad: node.momentum.to_vec() })
    };
    nodes.iter().map(as_weights).collect()
}

/// Collective. Weights of the section of a ring; along the hoop they are those of the box over its radius.
fn ring(
    comm: &Comm,
    evaluator: &mut Evaluator<2>,
    given: &GivenParticle<2>,
    level: u32,
) -> Result<Vec<RingWeights>, NoWeights> {
    let mut nodes = BTreeMap::new();
    for node in evaluator.nodes(comm, given, Coordinates::Axisymmetric)? {
        nodes.insert(node.place, (node.mass, node.momentum, 0.0));
    }
    for node in evaluator.nodes(comm, given, Coordinates::Cartesian)? {
        nodes.entry(node.place).or_insert((0.0, [0.0; 2], 0.0)).2 = node.mass / given.position[0];
    }
    let as_weights = |(place, (s, grad, t)): ([u32; 2], (f64, [f64; 2], f64))| {
        Ok(RingWeights { ijk: on_lattice(place, level)?, s, grad: grad.to_vec(), t })
    };
    nodes.into_iter().map(as_weights).collect()
}

/// A place on the lattice of the input.
fn on_lattice<const D: usize>(place: [u32; D], level: u32) -> Result<Vec<u64>, NoWeights> {
    let finest = u32::from(MAX_LEVEL) + 2;
    let ijk: Option<Vec<u64>> = place
        .iter()
        .map(|&x| {
            let (up, down) = (level.saturating_sub(finest), finest.saturating_sub(level));
            let x = u64::from(x).checked_shl(up)?;
            (x >> down << down == x).then_some(x >> down)
        })
        .collect();
    ijk.ok_or_else(|| NoWeights::Cases(format!("a node does not lie on the lattice of level {level}")))
}
