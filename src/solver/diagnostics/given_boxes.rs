//! Transfers of particles whose boxes are given one by one, through the phases of a step.
//!
//! In a run half widths follow from a particle's state. Here they are given instead, to examine the weights
//! of any box and to compare transfers with references; all else is the same code on the same grid.
use partition::comm::Comm;
use partition::{Forest, MAX_LEVEL};

use crate::boundary::{Contact, Leaving};
use crate::grid::constraints::parents::node_coord;
use crate::grid::leaf_geometry::position_key;
use crate::grid::mask::{bits, block_nodes};
use crate::kernel::{BoxPolicy, Coordinates, Transfer};
use crate::load::Gravity;
use crate::material::{self, parameters};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::followed::Followed;
use crate::particle::lanes::values;
use crate::simd::{Lanes, Vector};
use crate::solver::physics::{Physics, StepControl, Ties};
use crate::solver::sorting::box_widths::{BinMissing, BoxWidths};
use crate::solver::state::grid::Grid;
use crate::solver::state::{Clock, Solver};
use crate::solver::step::node_update::update_velocity;

/// A particle with its box. Lengths in m, relative to the domain's lower corner.
#[derive(Clone, Copy, Debug)]
pub struct GivenParticle<const D: usize> {
    /// Centre.
    pub position: [f64; D],
    /// Half widths.
    pub half: [f64; D],
    /// Mass, kg.
    pub mass: f64,
    /// Velocity, m/s.
    pub velocity: [f64; D],
    /// As in the columns [`Layout::AFFINE`] with APIC.
    pub affine: [[f64; D]; D],
    /// Isotropic Kirchhoff stress times volume, `V₀ τ = energy I`, J.
    pub energy: f64,
}

/// A real node with its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RealNode<const D: usize> {
    /// Position in cells of the finest level, `2^-(MAX_LEVEL + 2)` root edges.
    pub place: [u32; D],
    /// Momentum, kg m/s.
    pub momentum: [f64; D],
    /// Mass, kg.
    pub mass: f64,
}

/// Particles with given boxes on a tree.
pub struct GivenBoxes<const D: usize> {
    solver: Solver<D>,
    halves: Halves<D>,
}

/// Half widths by identifier of the particle.
struct Halves<const D: usize> {
    halves: Vec<[f64; D]>,
    /// Whether the kernels find them from the particles' state.
    are_cubes: bool,
}

impl<const D: usize> BoxWidths<D> for Halves<D> {
    fn of_batch(&self, chunk: &Chunk<D>, particles: &[u32], _cell: f64) -> [Lanes; D] {
        let last = particles.len() - 1;
        std::array::from_fn(|axis| {
            let half = |lane| self.halves[chunk.ids()[particles[last.min(lane)] as usize] as usize][axis];
            Lanes::new(std::array::from_fn(half))
        })
    }

    fn bounds(&self, chunk: &Chunk<D>, first: usize) -> Lanes {
        values(chunk, Layout::<D>::HALF, first)
    }

    fn bound(&self, chunk: &Chunk<D>) -> f64 {
        chunk.greatest_half()
    }

    fn are_known_to_kernels(&self) -> bool {
        self.are_cubes
    }
}

impl<const D: usize> GivenBoxes<D> {
    /// Collective. No particles yet.
    pub fn new(comm: &Comm, forest: Forest<D>, root_edge: f64) -> Self {
        let elastic = parameters::Elastic { young: 1.0, poisson: 0.0 };
        let physics = Physics {
            equilibrium: None,
            quasi_static: None,
            reduction: None,
            fill_densities: Vec::new(),
            meets: Vec::new(),
            origin: [0.0; D],
            root_edge,
            graded: forest.is_balanced(comm),
            materials: vec![material::build(&parameters::Parameters::NeoHookean(elastic), 1.0)],
            failed: Vec::new(),
            stage_starts: vec![0.0],
            gravity: Gravity::constant([0.0; D]),
            loads: Vec::new(),
            seepage: None,
            saturated: Vec::new(),
            sources: Vec::new(),
            body_contacts: crate::boundary::BodyContacts::default(),
            faces: [[Contact::Slip; 2]; D],
            with_moments: Vec::new(),
            absorbing: std::array::from_fn(|_| [None, None]),
            face_forces: false,
            colliders: Vec::new(),
            adaptivity: None,
            leaving: Leaving::default(),
            transfer: Transfer::Apic,
            coordinates: Coordinates::Cartesian,
            boxes: BoxPolicy::Fixed,
            cohesion: None,
            has_halves: false,
            f_bar: false,
            viscosity: None,
            ties: Ties::None,
            followed: Followed::default(),
            control: StepControl { cfl: 1.0, dt_max: None, growth: 1.0 },
        };
        let chunks = vec![Chunk::new(); forest.leaves().len()];
        let solver = Solver::new(comm, physics, forest, chunks, Clock::default());
        Self { solver, halves: Halves { halves: Vec::new(), are_cubes: true } }
    }

    /// Collective. Replaces the particles; each rank takes those in its leaves, with their numbers as
    /// identifiers. All ranks give the same. A box is cut at the domain's walls as in a run.
    pub fn place(&mut self, particles: &[GivenParticle<D>]) {
        let (forest, root_edge) = (&self.solver.forest, self.solver.physics.root_edge);
        let roots = forest.brick().roots;
        let extent = self.solver.grid.plan.extent();
        self.solver.chunks = vec![Chunk::new(); forest.leaves().len()];
        self.halves.halves = particles
            .iter()
            .map(|p| std::array::from_fn(|a| p.half[a].min(p.position[a]).min(extent[a] - p.position[a])))
            .collect();
        let is_cube = |half: &[f64; D]| half.iter().all(|&h| h == half[0]);
        self.halves.are_cubes = self.halves.halves.iter().all(is_cube);
        for (id, particle) in particles.iter().enumerate() {
            let Some(leaf) = forest.find(position_key(particle.position, roots, root_edge)) else { continue };
            let tag = Tag { material: 0, body: 0, level: forest.leaves()[leaf].level };
            let chunk = &mut self.solver.chunks[leaf];
            let p = chunk.push_zeroed(id as u64, tag);
            particle.write(self.halves.halves[id], chunk, p);
        }
        let reach = self.solver.agreed_reach();
        if reach != self.solver.grid.plan.tree.reach() {
            self.solver.rebuild_grid(reach);
        }
    }

    /// Not collective. Coordinates of the scatters to come.
    pub fn set_coordinates(&mut self, coordinates: Coordinates) {
        self.solver.physics.coordinates = coordinates;
    }

    /// Collective. P2G with the impulse of stress over `dt`, node sums, and restriction to real nodes.
    ///
    /// # Errors
    /// On the rank that has a box which fits no bin; all ranks complete the exchange.
    pub fn to_nodes(&mut self, dt: f64) -> Result<(), BinMissing> {
        let solver = &mut self.solver;
        let widths = (&self.halves, solver.physics.coordinates);
        let Grid { plan, fields, exchange, .. } = &mut solver.grid;
        let on = (&*plan, &exchange.seam);
        let sorted = fields[0].sort(on, &mut solver.phases, &solver.chunks, widths, None);
        solver.nodes_from_particles(dt, &[]);
        sorted
    }

    /// Not collective. This rank's share of the real nodes that received anything, in no particular order;
    /// each node has one owner.
    pub fn real_nodes(&self) -> Vec<RealNode<D>> {
        let grid = &self.solver.grid;
        let rows = grid.fields[0].nodes.rows.chunks(block_nodes(D));
        let mut nodes = Vec::new();
        for (block, rows) in grid.plan.blocks.iter().zip(rows) {
            for bit in bits(block.owned) {
                let row = rows[bit as usize].0;
                if row.iter().any(|&x| x != 0.0) {
                    let place = node_coord(block.coord, bit).map(|c| c << (MAX_LEVEL - block.level));
                    nodes.push(RealNode {
                        place,
                        momentum: std::array::from_fn(|axis| row[axis]),
                        mass: row[3],
                    });
                }
            }
        }
        nodes
    }

    /// Collective. The real nodes of all ranks on rank 0, in lexicographic order of their places, first axis
    /// slowest; an empty list on the others.
    pub fn all_real_nodes(&self, comm: &Comm) -> Vec<RealNode<D>> {
        let words: Vec<u64> = self.real_nodes().into_iter().flat_map(RealNode::words).collect();
        let gathered = comm.gather_bytes(bytemuck::cast_slice(&words)).unwrap_or_default();
        let mut nodes: Vec<RealNode<D>> = gathered
            .iter()
            .flat_map(|bytes| bytes.chunks_exact(8 * (2 * D + 1)).map(RealNode::from_bytes))
            .collect();
        nodes.sort_unstable_by_key(|node| node.place);
        nodes
    }

    /// Not collective. Velocities of all nodes from momentum and mass, without forces and walls.
    pub fn to_velocities(&mut self) {
        let solver = &mut self.solver;
        update_velocity(&mut solver.grid.fields[0].nodes, &solver.grid.plan, [0.0; D], 0.0);
        solver.prolong(0);
    }

    /// Not collective. G2P without moving anything: particles take velocity and affine state of the nodes.
    pub fn to_particles(&mut self, transfer: Transfer) {
        self.solver.physics.transfer = transfer;
        let rates = self.solver.collider_rates(0.0);
        self.solver.nodes_to_particles(&rates, self.solver.clock.time, 0.0);
        self.solver.physics.transfer = Transfer::Apic;
    }

    /// Not collective. How many leaves of other ranks this rank knows.
    pub fn ghost_leaves(&self) -> usize {
        self.solver.grid.plan.tree.ghost_len()
    }

    /// Not collective. The particles of this rank's leaves.
    pub fn chunks(&self) -> &[Chunk<D>] {
        &self.solver.chunks
    }
}

impl<const D: usize> RealNode<D> {
    fn words(self) -> impl Iterator<Item = u64> {
        let reals = self.momentum.into_iter().chain([self.mass]).map(f64::to_bits);
        self.place.into_iter().map(u64::from).chain(reals)
    }

    fn from_bytes(bytes: &[u8]) -> Self {
        let word = |i: usize| u64::from_ne_bytes(std::array::from_fn(|k| bytes[8 * i + k]));
        Self {
            place: std::array::from_fn(|axis| word(axis) as u32),
            momentum: std::array::from_fn(|axis| f64::from_bits(word(D + axis))),
            mass: f64::from_bits(word(2 * D)),
        }
    }
}

impl<const D: usize> GivenParticle<D> {
    fn write(&self, half: [f64; D], chunk: &mut Chunk<D>, p: usize) {
        let widest = half.into_iter().fold(0.0, f64::max);
        let volume = (0..D).fold(1.0, |volume, _| volume * (2.0 * widest));
        chunk.column_mut(Layout::<D>::MASS)[p] = self.mass;
        chunk.column_mut(Layout::<D>::HALF)[p] = widest;
        for i in 0..D {
            chunk.column_mut(Layout::<D>::POSITION + i)[p] = self.position[i];
            chunk.column_mut(Layout::<D>::VELOCITY + i)[p] = self.velocity[i];
            for k in 0..D {
                chunk.column_mut(Layout::<D>::AFFINE + D * i + k)[p] = self.affine[i][k];
            }
        }
        for normal in 0..3 {
            chunk.column_mut(Layout::<D>::LEFT_CAUCHY_GREEN + normal)[p] = 1.0;
        }
        // Without a stress along the hoop.
        for normal in 0..D {
            chunk.column_mut(Layout::<D>::STRESS + normal)[p] = self.energy / volume;
        }
    }
}
