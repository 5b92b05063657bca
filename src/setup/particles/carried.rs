//! Columns that particles carry for loads at the start: the surface that they stand for, and their shares of
//! point forces.
//!
//! The surface of the bodies is cut by the lattice of particles. A piece belongs to the particle in its box,
//! or to the one that has taken over the part of the body there; where boxes do not tile leaves and one has
//! no particle, since its centre is not in the body, to the first particle inwards. Bodies against each other
//! have no surface between them, nor has a body one on a face of the domain. All follows from job and tree,
//! so each rank finds what its own particles carry, in the same order on any partition.

use partition::comm::{Comm, Disagreement};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::lattice::Lattice;
use super::parts::{has_parts, is_in_box, lattice_at_surface};
use super::seed::{NumberedPlace, SeedError, lattice_places};
use crate::exact_sum::ExactSum;
use crate::geometry::surface::{Patch, Region, patches};
use crate::geometry::{Aabb, Side};
use crate::grid::KnownTree;
use crate::grid::leaf_geometry::position_key;
use crate::job::Problem;
use crate::load::{Carried, CarriedForce, Load};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::volume::reference_volume;
use crate::solver::Solver;
use crate::text::excerpt;

/// How far from the surface of its shape a load still counts a point, as a share of the distance of
/// particles.
const ROUNDING: f64 = 1e-9;
/// Steps inwards in search of a particle, half the distance of particles each.
const STEPS: u32 = 6;

/// Collective. Fills the columns that particles of a stage carry for the loads of the job. They lie in the
/// own leaves of the solver, which does not have them yet.
///
/// # Errors
/// A load finds nothing to act on, and no body comes later that could carry it; the same on all ranks.
pub(in crate::setup) fn carry<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    solver: &Solver<D>,
    chunks: &mut [Chunk<D>],
    stage: usize,
) -> Result<(), Disagreement> {
    let columns = solver.physics.carried_columns();
    for (number, load) in problem.loads.iter().enumerate() {
        let Some(carried) = load.carried() else { continue };
        if carried.force.is_on_surface() {
            let tree = solver.known_tree();
            let shares = surface_shares(problem, tree, load, carried, stage);
            let own = &tree.leaves()[tree.own_leaves()];
            // Bodies that overlap have no particles.
            let places = |leaf: usize| lattice_places(problem, &own[leaf], stage).unwrap_or_default();
            hand_out(places, chunks, (carried, columns), &shares);
        } else if !comm.any(is_carried(&solver.chunks, carried)) {
            share_force(comm, chunks, load, carried, columns);
        }
        let may_come =
            (0..problem.bodies.len()).any(|body| problem.bodies[body].stage > stage && carried.is_on(body));
        let found = [&solver.chunks[..], chunks].iter().any(|chunks| is_carried(chunks, carried));
        let found = comm.any(found) || may_come || stage > 0;
        comm.agree(if found { Ok(()) } else { Err(nothing(problem, number, carried)) })?;
    }
    Ok(())
}

fn nothing<const D: usize>(problem: &Problem<D>, number: usize, carried: &Carried<D>) -> SeedError {
    let (found, expected) = match carried.force.is_on_surface() {
        true => (
            "surface",
            "a shape with part of a body's free surface, away from faces of the domain and other bodies",
        ),
        false => {
            ("particle", "a shape that contains particles, which lie half their distance inside the body")
        }
    };
    SeedError::Load {
        place: format!("{}: loads[{number}]", problem.load_places[number]),
        load: excerpt(&problem.loads[number].name, 60).into_owned(),
        found,
        expected,
    }
}

/// Whether any of these particles carries anything of a load.
fn is_carried<const D: usize>(chunks: &[Chunk<D>], carried: &Carried<D>) -> bool {
    let mut columns = carried.first..carried.first + carried.force.columns();
    columns.any(|column| chunks.iter().any(|chunk| chunk.carried(column).iter().any(|&number| number != 0.0)))
}

/// A place of the lattice of a body's particles in an own leaf, and what the particle there carries.
struct Share<const D: usize> {
    leaf: usize,
    body: u16,
    index: [u64; D],
    numbers: Vec<f64>,
}

/// Shares of own particles in a load on surfaces, in the order of the known leaves.
fn surface_shares<const D: usize>(
    problem: &Problem<D>,
    tree: &KnownTree<D>,
    load: &Load<D>,
    carried: &Carried<D>,
    stage: usize,
) -> Vec<Share<D>> {
    let new: Vec<usize> = problem.bodies_of_stage(stage).collect();
    let bodies: Vec<usize> = new
        .iter()
        .copied()
        .filter(|&body| carried.is_on(body) && problem.bodies[body].given.is_none())
        .collect();
    let shares = tree.leaves().par_iter().map(|leaf| {
        let mut shares = Vec::new();
        for &body in &bodies {
            let lattice = lattice_at_surface(problem, leaf.level, &problem.bodies[body]);
            let of_leaf = problem.octant_box(leaf);
            // Boxes of a lattice of its own stick out of the leaf that holds their centres.
            if !is_near(problem, load, body, &of_leaf.grown(0.5 * lattice.edge), lattice.edge) {
                continue;
            }
            let search = Search { problem, tree, load, new: &new, body, lattice };
            for index in lattice.places_in(&of_leaf) {
                let cell = lattice.cell(&index);
                if is_near(problem, load, body, &cell, lattice.edge) {
                    search.add(carried, &cell, &mut shares);
                }
            }
        }
        shares
    });
    shares.collect::<Vec<_>>().into_iter().flatten().collect()
}

/// Whether surface of a body that a load acts on may lie in a box or on its faces.
fn is_near<const D: usize>(
    problem: &Problem<D>,
    load: &Load<D>,
    body: usize,
    cell: &Aabb<D>,
    spacing: f64,
) -> bool {
    let grown = cell.grown(1e-3 * spacing);
    problem.bodies[body].shape.classify(&grown) == Side::Crosses
        && load.region.as_ref().is_none_or(|region| region.classify(&grown) != Side::Outside)
}

/// The surface of a body in the boxes of a lattice.
struct Search<'a, const D: usize> {
    problem: &'a Problem<D>,
    tree: &'a KnownTree<D>,
    load: &'a Load<D>,
    /// Bodies that come with this one.
    new: &'a [usize],
    body: usize,
    lattice: Lattice<D>,
}

impl<const D: usize> Search<'_, D> {
    /// Adds the shares of own particles in the surface in a box.
    fn add(&self, carried: &Carried<D>, cell: &Aabb<D>, shares: &mut Vec<Share<D>>) {
        let (problem, size) = (self.problem, self.problem.size());
        let shape = &problem.bodies[self.body].shape;
        let others = || self.new.iter().filter(|&&other| other != self.body);
        let region = Region {
            inside: &|x| shape.distance(x) < 0.0,
            free: &|x| {
                (0..D).all(|a| x[a] > 0.0 && x[a] < size[a])
                    && others().all(|&other| problem.bodies[other].shape.distance(x) >= 0.0)
            },
            counts: &|x| {
                let slack = ROUNDING * self.lattice.edge;
                self.load.region.as_ref().is_none_or(|region| region.distance(x) <= slack)
            },
            // Distances to booleans are bounds, so one step may stop short of the surface.
            project: &|x| {
                (0..8).fold(*x, |x, _| {
                    let (distance, normal) = (shape.distance(&x), shape.gradient(&x));
                    std::array::from_fn(|a| f64::mul_add(-distance, normal[a], x[a]))
                })
            },
            normal: &|x| shape.gradient(x),
        };
        for patch in patches(&region, cell).iter().filter(|patch| carried.is_facing(&patch.area)) {
            if let Some((leaf, index)) = self.particle_of(patch, cell)
                && let Some(leaf) = self.tree.local(leaf)
            {
                let around = problem.coordinates.around(patch.centre[0]);
                let numbers = carried.of_surface(&patch.area.map(|component| around * component));
                shares.push(Share { leaf, body: self.body as u16, index, numbers });
            }
        }
    }

    /// Known leaf and place in the lattice of the particle that a piece of surface in a box belongs to.
    fn particle_of(&self, patch: &Patch<D>, cell: &Aabb<D>) -> Option<(usize, [u64; D])> {
        let size = patch.area.iter().map(|c| c * c).sum::<f64>().sqrt();
        let step = 0.5 * self.lattice.edge;
        let inwards = (1..=STEPS).map(|k| {
            std::array::from_fn(|a| (f64::from(k) * step).mul_add(-patch.area[a] / size, patch.centre[a]))
        });
        std::iter::once(cell.centre()).chain(inwards).find_map(|x| self.particle_at(&x))
    }

    /// Known leaf and place in the lattice of the body's particle whose box holds a point.
    fn particle_at(&self, x: &[f64; D]) -> Option<(usize, [u64; D])> {
        let Problem { bodies, root_edge, brick, .. } = self.problem;
        let size = self.problem.size();
        let leaf_of = |x: &[f64; D]| {
            let is_inside = (0..D).all(|a| x[a] >= 0.0 && x[a] < size[a]);
            let key = is_inside.then(|| position_key(*x, brick.roots, *root_edge))?;
            self.tree.locate(key)
        };
        let level = self.tree.leaves()[leaf_of(x)?].level;
        let lattice = lattice_at_surface(self.problem, level, &bodies[self.body]);
        let index = lattice.place_of(x);
        let centre = lattice.centre(&index);
        let leaf = leaf_of(&centre).filter(|&leaf| self.tree.leaves()[leaf].level == level)?;
        let body = &bodies[self.body];
        if has_parts(self.problem, body) {
            return is_in_box(&body.shape, &lattice, &index).then_some((leaf, index));
        }
        let is_there = body.shape.contains(&centre)
            && (self.new.iter().take_while(|&&earlier| earlier < self.body))
                .all(|&earlier| !bodies[earlier].shape.contains(&centre));
        is_there.then_some((leaf, index))
    }
}

/// Adds shares to the columns of own particles. `places` are those of a leaf with the numbers of its
/// particles.
fn hand_out<const D: usize>(
    places: impl Fn(usize) -> Vec<NumberedPlace<D>>,
    chunks: &mut [Chunk<D>],
    (carried, columns): (&Carried<D>, usize),
    shares: &[Share<D>],
) {
    let mut of_leaf: FxHashMap<usize, FxHashMap<(u16, [u64; D]), usize>> = FxHashMap::default();
    for Share { leaf, body, index, numbers } in shares {
        let chunk = &mut chunks[*leaf];
        let of_leaf = of_leaf.entry(*leaf);
        let places = of_leaf.or_insert_with(|| places(*leaf).into_iter().collect());
        if let Some(&p) = places.get(&(*body, *index)) {
            chunk.carry(columns);
            for (column, number) in (carried.first..).zip(numbers) {
                chunk.carried_mut(column)[p] += number;
            }
        }
    }
}

/// Collective. Gives particles in the shape of a point force their shares, which add up to 1.
fn share_force<const D: usize>(
    comm: &Comm,
    chunks: &mut [Chunk<D>],
    load: &Load<D>,
    carried: &Carried<D>,
    columns: usize,
) {
    let CarriedForce::Point { by_volume, .. } = carried.force else { return };
    let weight = |chunk: &Chunk<D>, p: usize| if by_volume { reference_volume(chunk, p) } else { 1.0 };
    let is_loaded = |chunk: &Chunk<D>, p: usize| {
        let slack = ROUNDING * chunk.column(Layout::<D>::HALF)[p];
        let is_in = load.region.as_ref().is_none_or(|region| region.distance(&chunk.position(p)) <= slack);
        is_in && carried.is_on(usize::from(Tag::unpack(chunk.tags()[p]).body))
    };
    let loaded: Vec<Vec<usize>> =
        chunks.iter().map(|chunk| (0..chunk.len()).filter(|&p| is_loaded(chunk, p)).collect()).collect();
    let mut total = [ExactSum::new()];
    for (chunk, loaded) in chunks.iter().zip(&loaded) {
        loaded.iter().for_each(|&p| total[0].add(weight(chunk, p)));
    }
    ExactSum::sum_over_ranks(comm, &mut total);
    let total = total[0].to_f64();
    for (chunk, loaded) in chunks.iter_mut().zip(&loaded).filter(|(_, loaded)| !loaded.is_empty()) {
        chunk.carry(columns);
        for &p in loaded {
            let share = weight(chunk, p) / total;
            chunk.carried_mut(carried.first)[p] = share;
        }
    }
}
