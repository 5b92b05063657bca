//! The small motion of the bar by the plain definition: linear FLIP with weights found once, cell by cell. It shares no
//! transfer, bins or constraints with the solver, and it can leave hanging nodes free.
use std::collections::BTreeMap;

use agimp::grid::{KnownTree, direct};
use agimp::particle::chunk::Layout;
use agimp::solver::Solver;
use partition::MAX_LEVEL;

/// Whether hanging nodes interpolate their parents, or move freely.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum HangingNodes {
    Constrained,
    Free,
}

/// A particle of the bar: E = 1 Pa, nu = 0, small strains in the plane.
struct Particle {
    id: u64,
    x: f64,
    mass: f64,
    volume: f64,
    velocity: [f64; 2],
    /// xx, yy, xy.
    stress: [f64; 3],
    /// Node, weight and its gradient.
    nodes: Vec<(usize, f64, [f64; 2])>,
}

/// Motion of a node.
#[derive(Clone, Copy, Default)]
struct Node {
    mass: f64,
    momentum: [f64; 2],
    force: [f64; 2],
    /// Held along the axes, by rollers.
    held: [bool; 2],
}

/// The bar.
pub(crate) struct Bar {
    particles: Vec<Particle>,
    nodes: Vec<Node>,
}

impl Bar {
    /// The state of a solver, with roots of `root_edge` m in a domain of `size` m.
    pub(crate) fn new(solver: &Solver<2>, root_edge: f64, size: [f64; 2], hanging: HangingNodes) -> Self {
        let tree = KnownTree::whole(*solver.forest.brick(), solver.forest.leaves().to_vec());
        let weights = match hanging {
            HangingNodes::Constrained => direct::weights,
            HangingNodes::Free => direct::unconstrained_weights,
        };
        let scale = root_edge / f64::from(1u32 << (MAX_LEVEL + 2));
        let mut numbers = BTreeMap::new();
        let (mut particles, mut nodes) = (Vec::new(), Vec::new());
        for chunk in &solver.chunks {
            for p in 0..chunk.len() {
                let value = |column: usize| chunk.column(column)[p];
                let half = [value(Layout::<2>::HALF); 2];
                let found = weights(&tree, root_edge, chunk.position(p), half);
                let mine = found.into_iter().map(|node| {
                    let number = *numbers.entry(node.place).or_insert_with(|| {
                        let x = node.place.map(|x| f64::from(x) * scale);
                        let held = [0, 1].map(|axis: usize| x[axis] == 0.0 || x[axis] == size[axis]);
                        nodes.push(Node { held, ..Node::default() });
                        nodes.len() - 1
                    });
                    (number, node.weight, node.gradient)
                });
                particles.push(Particle {
                    id: chunk.ids()[p],
                    x: chunk.position(p)[0],
                    mass: value(Layout::<2>::MASS),
                    volume: 4.0 * half[0] * half[1],
                    velocity: [value(Layout::<2>::VELOCITY), 0.0],
                    stress: [value(Layout::<2>::STRESS), 0.0, 0.0],
                    nodes: mine.collect(),
                });
            }
        }
        particles.sort_by_key(|particle| particle.id);
        Self { particles, nodes }
    }

    /// One step of `dt` s.
    pub(crate) fn step(&mut self, dt: f64) {
        for node in &mut self.nodes {
            *node = Node { held: node.held, ..Node::default() };
        }
        for Particle { mass, volume, velocity, stress: [xx, yy, xy], nodes, .. } in &self.particles {
            for (number, w, slope) in nodes {
                let node = &mut self.nodes[*number];
                node.mass += w * mass;
                (0..2).for_each(|axis| node.momentum[axis] += w * mass * velocity[axis]);
                node.force[0] -= volume * (xx * slope[0] + xy * slope[1]);
                node.force[1] -= volume * (xy * slope[0] + yy * slope[1]);
            }
        }
        let velocities: Vec<[[f64; 2]; 2]> = self
            .nodes
            .iter()
            .map(|node| {
                let before = node.momentum.map(|momentum| momentum / node.mass);
                let after = [0, 1].map(|axis: usize| {
                    if node.held[axis] { 0.0 } else { before[axis] + dt * node.force[axis] / node.mass }
                });
                [before, after]
            })
            .collect();
        for Particle { velocity, stress, nodes, .. } in &mut self.particles {
            for (number, w, slope) in nodes {
                let [before, after] = velocities[*number];
                (0..2).for_each(|axis| velocity[axis] += *w * (after[axis] - before[axis]));
                stress[0] += dt * after[0] * slope[0];
                stress[1] += dt * after[1] * slope[1];
                stress[2] += 0.5 * dt * (after[0] * slope[1] + after[1] * slope[0]);
            }
        }
    }

    /// Mass, velocity and stress along the bar of the particles before a place, by identifier.
    pub(crate) fn before(&self, place: f64) -> Vec<[f64; 3]> {
        let before = self.particles.iter().filter(|particle| particle.x < place);
        before.map(|particle| [particle.mass, particle.velocity[0], particle.stress[0]]).collect()
    }
}
