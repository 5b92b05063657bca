//! Newton's method for the balance of forces at the nodes, with conjugate gradients for its linear systems.
//!
//! The residual is the force on nodes that are neither held nor tied, of loads and gravity at the end of the
//! step and of stress. A correction solves the linearised balance, with the prescribed displacements as far
//! as they are not reached, to a tolerance that falls with the residual (Eisenstat and Walker 1996); then it
//! is halved until the residual, or its work on the correction, has fallen.
use super::held::{Held, Wall};
use super::multigrid::Multigrid;
use super::points::{Points, Sweep};
use super::unknowns::{Nodal, Unknowns};
use super::walls::Springs;
use crate::kernel::{GivenColumn, Row, Scheme};
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::inside::dot;
use crate::solver::state::{Effort, Solver};
use crate::solver::step::transfer::p2g::scatter;

/// Most Newton iterations of a step.
const ITERATIONS: u32 = 25;
/// Most iterations for one linear system.
const LINEAR: u32 = 1000;
/// Halvings of a correction.
const HALVINGS: u32 = 6;
/// Corrections of a step that are made in full though no share of them lets the residual fall: where the law
/// has an edge, a state on it may have no direction that does, and the next correction knows the other side.
const FORCED: u32 = 3;
/// Residual up to which they are, over the forces: farther off, a shorter step is safer.
const NEARLY_BALANCED: f64 = 1e-3;
/// Tolerance of the first linear system, and the greatest of all.
const FORCING: [f64; 2] = [1e-2, 0.1];
/// Residual over the forces up to which nodes rub, or leave walls, anew.
const SETTLES: f64 = 1e-2;
/// Most times that they do in a step, and times after which only those do that are most wrong.
const ROUNDS: u32 = 60;
const FREELY: u32 = 6;
/// Force on a node that counts as none, over those that may be left.
const SLACK: f64 = 0.1;
/// Greatest displacement of a node in a step, in cells.
pub(super) const MOST_WAY: f64 = 0.5;

/// Displacements and forces at the end of an attempt.
pub(super) struct Balance<const D: usize> {
    pub(super) effort: Effort,
    /// How often nodes have begun to touch or to leave walls.
    pub(super) rounds: u32,
    /// Displacements of all nodes, m.
    pub(super) way: Nodal<D>,
    /// Forces of loads and gravity, less those of stress, N: on nodes that are held, the reaction with the
    /// sign turned.
    pub(super) rest: Nodal<D>,
}

/// A state of the iteration.
struct Iterate<const D: usize> {
    way: Nodal<D>,
    /// Forces of loads less those of stress, after the ties.
    rest: Nodal<D>,
    /// The same without what is held or tied.
    free: Nodal<D>,
    /// Stiffness of the nodes, N/m.
    stiffness: Vec<f64>,
    /// Norms: of `free`, and of the force to compare it with.
    norm: f64,
    greatest: f64,
}

impl<const D: usize> Iterate<D> {
    /// Norm of the unbalanced force over those of loads or stress.
    fn residual(&self) -> f64 {
        if self.norm > 0.0 { self.norm / self.greatest } else { 0.0 }
    }
}

impl<const D: usize> Solver<D> {
    /// Collective. Balances the forces `outer` (N) at the end of a step of length `dt` (s). `None` if the
    /// iteration fails, with its effort.
    pub(super) fn balance_forces(
        &mut self,
        unknowns: &mut Unknowns<D>,
        outer: &Nodal<D>,
        dt: f64,
        tolerance: f64,
    ) -> Result<Balance<D>, Effort> {
        let mut points: Vec<Vec<Points>> = vec![Vec::new(); self.chunks.len()];
        let mut effort = Effort::default();
        let zero = vec![[0.0; D]; unknowns.nodes.len()];
        let (leaves, grid) = ((&self.forest, &self.chunks[..]), (&self.grid.plan, &self.physics.scheme()));
        let mut multigrid = Multigrid::new(&self.comm, leaves, grid, unknowns);
        let [has_walls, has_friction] = {
            let brakes = |wall: &Wall<D>| wall.friction.coefficient > 0.0;
            [!unknowns.walls.is_empty(), unknowns.walls.iter().any(brakes)].map(|has| self.comm.any(has))
        };
        let Some(mut now) = self.iterate(unknowns, &mut points, outer, zero, dt) else { return Err(effort) };
        if has_friction {
            unknowns.set_springs(&now.stiffness);
            let Some(next) = self.iterate(unknowns, &mut points, outer, now.way, dt) else {
                return Err(effort);
            };
            now = next;
        }
        let mut forcing = FORCING[0];
        // A search for a factor of safety looks for steps that fail.
        let mut forced = if self.physics.reduction.is_some() { FORCED } else { 0 };
        let is_moved = |held: &[Option<Held>; D]| held.iter().flatten().any(|held| held.way != 0.0);
        let turns = unknowns.turned.iter().flat_map(|(_, turned)| turned).any(|(_, held)| held.way != 0.0);
        let mut held_is_reached = !self.comm.any(unknowns.held.iter().any(is_moved) || turns);
        let (mut rounds, mut since) = (0, 0);
        loop {
            effort.residual = now.residual();
            let mut is_other = false;
            if has_walls
                && held_is_reached
                && effort.residual <= SETTLES * if rounds < FREELY { 1.0 } else { 0.1 }
            {
                let slack = now.norm.max(SLACK * tolerance * now.greatest);
                let share = if rounds < FREELY { 0.0 } else { 0.5 };
                let forces = (&mut now.way, &now.rest);
                is_other = unknowns.settle_walls(&self.comm, forces, &now.stiffness, (slack, share));
                is_other = self.comm.any(is_other);
                if is_other {
                    (rounds, since) = (rounds + 1, 0);
                    unknowns.hold_at_walls();
                    let leaves = (&self.forest, &self.chunks[..]);
                    let grid = (&self.grid.plan, &self.physics.scheme());
                    multigrid = Multigrid::new(&self.comm, leaves, grid, unknowns);
                    held_is_reached = !self.comm.any(unknowns.is_off(&now.way));
                }
                if is_other || has_friction {
                    let next = self.iterate(unknowns, &mut points, outer, now.way, dt);
                    let Some(next) = next else { return Err(effort) };
                    now = next;
                    effort.residual = now.residual();
                }
            }
            if held_is_reached && effort.residual <= tolerance {
                if is_other && rounds < ROUNDS {
                    continue;
                }
                if !is_other {
                    let Iterate { way, rest, .. } = now;
                    return Ok(Balance { effort, rounds, way, rest });
                }
            }
            if since == ITERATIONS || rounds == ROUNDS {
                effort.worst = unknowns.worst(&self.comm, &now.free);
                return Err(effort);
            }
            (effort.newton, since) = (effort.newton + 1, since + 1);
            let enough = if now.norm > 0.0 { 0.3 * tolerance * now.greatest / now.norm } else { 0.0 };
            let target = forcing.max(enough.min(0.5));
            let springs = has_friction.then(|| unknowns.springs(&now.way));
            multigrid.assemble(&self.comm, &points, (&now.stiffness, springs.as_ref()), unknowns);
            let correction = self.correct(
                unknowns,
                &mut points,
                (&multigrid, springs),
                &now,
                (target, held_is_reached),
                &mut effort,
            );
            let (slope, mut share): (f64, f64) =
                (unknowns.products(&self.comm, [(&correction, &now.free)])[0], 1.0);
            let (mut halvings, mut is_forced) = (0, false);
            let next = loop {
                let way: Nodal<D> = now
                    .way
                    .iter()
                    .zip(&correction)
                    .map(|(way, more)| std::array::from_fn(|a| share.mul_add(more[a], way[a])))
                    .collect();
                let next = self.iterate(unknowns, &mut points, outer, way, dt);
                if let Some(next) = next {
                    // Where displacements are prescribed the first correction raises the forces from nothing.
                    let is_less = next.norm < (1.0 - 1e-4 * share) * now.norm;
                    let work = unknowns.products(&self.comm, [(&correction, &next.free)])[0];
                    let is_first = !held_is_reached && share == 1.0;
                    if is_forced
                        || is_first
                        || is_less
                        || work.abs() <= 0.5 * slope.abs()
                        || next.norm <= tolerance * next.greatest
                    {
                        break Some(next);
                    }
                }
                halvings += 1;
                share *= 0.5;
                if halvings > HALVINGS {
                    if is_forced || forced == FORCED || effort.residual > NEARLY_BALANCED {
                        break None;
                    }
                    (forced, is_forced, share) = (forced + 1, true, 1.0);
                }
            };
            let Some(next) = next else {
                effort.worst = unknowns.worst(&self.comm, &now.free);
                return Err(effort);
            };
            held_is_reached |= share == 1.0;
            let fall = next.norm / now.norm;
            forcing = if fall.is_finite() { (0.9 * fall * fall).clamp(1e-4, FORCING[1]) } else { FORCING[0] };
            now = next;
        }
    }

    /// Collective over neighbours. Forces at displacements; `None` on all ranks if a state is not sound or a
    /// node moves too far. One reduction.
    fn iterate(
        &mut self,
        unknowns: &Unknowns<D>,
        points: &mut [Vec<Points>],
        outer: &Nodal<D>,
        mut way: Nodal<D>,
        dt: f64,
    ) -> Option<Iterate<D>> {
        unknowns.spread_ties(&mut way);
        let mut moves = way.iter().zip(&unknowns.cells);
        let is_near = moves.all(|(way, cell)| way.iter().all(|way| way.abs() <= MOST_WAY * cell));
        self.show(unknowns, &way);
        let is_sound = self.stress_of_displacements(points, Sweep::Deform { dt });
        if self.comm.any(!is_near || !is_sound) {
            return None;
        }
        let mut stiffness: Vec<f64> = Vec::with_capacity(way.len());
        let mut rest = self.forces(unknowns, &[], |row, cell| stiffness.push(row / (cell * cell)));
        unknowns.gather_stiffness(&mut stiffness);
        let (mut inner, mut outer) = (rest.clone(), outer.clone());
        unknowns.add_friction(&way, &mut outer);
        for (rest, outer) in rest.iter_mut().zip(&outer) {
            (0..D).for_each(|a| rest[a] += outer[a]);
        }
        [&mut rest, &mut inner, &mut outer].into_iter().for_each(|forces| unknowns.gather_ties(forces));
        let mut free = rest.clone();
        unknowns.mask(&mut free);
        let squares = unknowns.products(&self.comm, [(&free, &free), (&outer, &outer), (&inner, &inner)]);
        let [norm, outer, inner] = squares.map(f64::sqrt);
        Some(Iterate { way, rest, free, stiffness, norm, greatest: outer.max(inner) })
    }

    /// Gives all nodes displacements, constrained ones those of their parents.
    fn show(&mut self, unknowns: &Unknowns<D>, way: &Nodal<D>) {
        let rows = &mut self.grid.fields[0].nodes.rows;
        for (&node, way) in unknowns.nodes.iter().zip(way) {
            let mut row = [0.0; 4];
            row[..D].copy_from_slice(way);
            rows[node as usize] = Row(row);
        }
        self.prolong(0);
    }

    /// Collective over neighbours. Forces of the particles' affine columns on the nodes, with these columns
    /// in place of their own; `note` gets the sum of their masses at each, and the edge of its cells.
    pub(super) fn forces(
        &mut self,
        unknowns: &Unknowns<D>,
        given: &[Vec<GivenColumn>],
        mut note: impl FnMut(f64, f64),
    ) -> Nodal<D> {
        let (chunks, times) = (&self.chunks, &self.leaf_data.times);
        let scheme = Scheme { forces: true, ..self.physics.scheme() };
        let Grid { plan, fields, exchange, .. } = &mut self.grid;
        fields[0].scatter_and_sum((plan, exchange), &mut self.phases, chunks, |scratch, bin, arena| {
            times.time(bin.leaf, || scatter(scratch, bin, (chunks, given), &scheme, 1.0, arena));
        });
        let rows = &fields[0].nodes.rows;
        let all = unknowns.nodes.iter().zip(&unknowns.cells).map(|(&node, &cell)| {
            let row = rows[node as usize].0;
            note(row[3], cell);
            std::array::from_fn(|a| row[a])
        });
        all.collect()
    }

    /// Collective over neighbours. What stress takes from the forces on nodes if they move a little further:
    /// the stiffness times the displacements, with that of friction.
    fn resistance(
        &mut self,
        unknowns: &Unknowns<D>,
        points: &mut [Vec<Points>],
        springs: &[(usize, [[f64; D]; D])],
        way: &Nodal<D>,
    ) -> Nodal<D> {
        let mut way = way.clone();
        unknowns.spread_ties(&mut way);
        self.show(unknowns, &way);
        self.stress_of_displacements(points, Sweep::Change);
        let mut forces = self.forces(unknowns, &[], |_, _| ());
        forces.iter_mut().flatten().for_each(|force| *force = -*force);
        for (node, spring) in springs {
            (0..D).for_each(|a| forces[*node][a] += dot(&spring[a], &way[*node]));
        }
        unknowns.gather_ties(&mut forces);
        unknowns.mask(&mut forces);
        forces
    }

    /// Collective. The correction of displacements, to a share `target` of the residual: what is held goes to
    /// its place, and the others follow by preconditioned conjugate gradients. Where the stiffness is not
    /// positive the iteration ends with what it has.
    fn correct(
        &mut self,
        unknowns: &Unknowns<D>,
        points: &mut [Vec<Points>],
        (multigrid, springs): (&Multigrid<D>, Option<Springs<D>>),
        now: &Iterate<D>,
        (target, held_is_reached): (f64, bool),
        effort: &mut Effort,
    ) -> Nodal<D> {
        let springs = springs.as_deref().unwrap_or_default();
        let mut correction = vec![[0.0; D]; unknowns.nodes.len()];
        let mut rest = now.free.clone();
        if !held_is_reached {
            correction = unknowns.way_to_held(&now.way);
            let taken = self.resistance(unknowns, points, springs, &correction);
            subtract(&mut rest, &taken, 1.0);
        }
        let norm = match held_is_reached {
            true => now.norm,
            false => unknowns.products(&self.comm, [(&rest, &rest)])[0].sqrt(),
        };
        if norm == 0.0 {
            return correction;
        }
        let mut towards = multigrid.towards(&self.comm, unknowns, &rest, norm);
        let mut way = towards.way.clone();
        for _ in 0..LINEAR {
            let taken = self.resistance(unknowns, points, springs, &way);
            let curvature = unknowns.products(&self.comm, [(&way, &taken)])[0];
            let is_convex = curvature > 0.0 && towards.product > 0.0;
            if !is_convex {
                break;
            }
            effort.linear += 1;
            let length = towards.product / curvature;
            subtract(&mut correction, &way, -length);
            subtract(&mut rest, &taken, length);
            let scale = towards.square.sqrt();
            let next = multigrid.towards(&self.comm, unknowns, &rest, scale);
            let is_left = next.square.sqrt() > target * norm;
            if !is_left {
                break;
            }
            let share = next.product / towards.product;
            towards = next;
            for (way, towards) in way.iter_mut().zip(&towards.way) {
                (0..D).for_each(|a| way[a] = share.mul_add(way[a], towards[a]));
            }
        }
        correction
    }
}

/// `a -= length b`.
fn subtract<const D: usize>(a: &mut [[f64; D]], b: &[[f64; D]], length: f64) {
    for (a, b) in a.iter_mut().zip(b) {
        (0..D).for_each(|axis| a[axis] = (-length).mul_add(b[axis], a[axis]));
    }
}
