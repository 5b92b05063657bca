//! Changes by the stages of a run: physics, and the particles that come and go.
use partition::comm::{Comm, Disagreement};

use super::constant::constant_physics;
use super::materials::material_of;
use super::particles::carried::carry;
use super::particles::new_particles;
use super::particles::seed::check_counts;
use super::walls;
use crate::adaptivity::Cohesion;
use crate::boundary::{ActsOn, Meets};
use crate::job::Problem;
use crate::job::problem::{Body, BoxPolicy, Coordinates, FactorSearch, MaterialSetup};
use crate::material::Weakened;
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::solver::physics::StrengthReduction;
use crate::solver::stage::Change;
use crate::solver::{Physics, Solver};

/// Physics of the last of the stages that began at these times, s.
pub fn physics<const D: usize>(problem: &Problem<D>, starts: &[f64]) -> Physics<D> {
    let mut physics = constant_physics(problem);
    for (stage, &start) in problem.stages.iter().zip(starts) {
        if let Some(gravity) = &stage.gravity {
            physics.gravity = gravity.clone();
            physics.gravity.start = start;
        }
        for (axis, side) in (0..D).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            if stage.faces[axis][side].is_some() {
                physics.absorbing[axis][side] = stage.absorbing[axis][side].clone();
            }
        }
        for (now, new) in physics.faces.as_flattened_mut().iter_mut().zip(stage.faces.as_flattened()) {
            *now = new.unwrap_or(*now);
        }
        physics.leaving = stage.leaving.unwrap_or(physics.leaving);
        physics.equilibrium = stage.equilibrium;
        physics.reduction = stage.reduction.map(|search| reduction(problem, &search));
    }
    if let (Some(load_steps), Some(reduction)) = (&mut physics.quasi_static, &physics.reduction) {
        (load_steps.step, load_steps.least_step) = (reduction.step, reduction.tolerance);
    }
    physics.stage_starts = starts.to_vec();
    let stage = physics.stage();
    for (load, stages) in physics.loads.iter_mut().zip(&problem.load_stages) {
        load.start = if stages.has(stage) { stages.clock(starts) } else { f64::INFINITY };
    }
    for (index, collider) in physics.colliders.iter_mut().enumerate() {
        let stages = &problem.collider_stages[index];
        collider.start = if stages.has(stage) { stages.clock(starts) } else { f64::INFINITY };
        if walls::acts_on_nodes(problem, stage, index) {
            collider.acts_on = ActsOn::Nodes;
        }
    }
    for (source, stages) in physics.sources.iter_mut().zip(&problem.source_stages) {
        source.start = if stages.has(stage) { stages.clock(starts) } else { f64::INFINITY };
        source.material = material_of(problem, usize::from(source.body), stage) as u16;
    }
    if physics.has_fluids() {
        let fields = 0..physics.body_contacts.fields();
        physics.fill_densities =
            fields.map(|field| density_of_field(problem, &physics, field as u8)).collect();
    }
    let fields = 0..physics.body_contacts.fields();
    physics.meets = fields.map(|field| meets(problem, field as u8, stage)).collect();
    physics.cohesion = cohesion(problem, stage);
    physics
}

/// The materials whose strength falls in a stage.
fn reduction<const D: usize>(problem: &Problem<D>, search: &FactorSearch) -> StrengthReduction {
    let FactorSearch { from, step, tolerance, davis, .. } = *search;
    let weakened = |setup: &MaterialSetup| Weakened {
        model: setup.model.clone(),
        undrained: setup.undrained,
        density: setup.density,
        davis,
    };
    StrengthReduction { from, step, tolerance, materials: problem.materials.iter().map(weakened).collect() }
}

/// How elastic bodies of a stage hold together, if there are any and boxes follow the deformation. Sections
/// of rings are not halved.
fn cohesion<const D: usize>(problem: &Problem<D>, stage: usize) -> Option<Cohesion> {
    let BoxPolicy::Volume { max_stretch, .. } = problem.boxes else { return None };
    if problem.coordinates == Coordinates::Axisymmetric {
        return None;
    }
    let bodies = problem.bodies.iter().enumerate().filter(|(_, body)| body.stage <= stage);
    let elastic = bodies.filter(|(number, _)| {
        let setup = &problem.materials[material_of(problem, *number, stage)];
        !setup.build().is_plastic()
    });
    // Boxes a cell wide are not too wide for any grid.
    let least = elastic.map(|(_, body)| body.particles_per_cell).reduce(f64::min)?;
    let half_cell = 0.5 * problem.cell_edge(0);
    let nominal = problem.bodies.iter().map(|body| half_cell / body.particles_per_cell).collect();
    Some(Cohesion { nominal, stretch: max_stretch.max(least) })
}

/// Where the material of a velocity field meets faces and colliders that act on nodes, by all materials that
/// have moved with it up to a stage.
pub fn meets<const D: usize>(problem: &Problem<D>, field: u8, stage: usize) -> Meets {
    let field_of_body = &problem.body_contacts.field_of_body;
    let there = problem.bodies.iter().enumerate().filter(|(number, body)| {
        body.stage <= stage && field_of_body.get(*number).is_none_or(|of| *of == field)
    });
    let of_body = |(number, body): (usize, &Body<D>)| {
        let materials = (body.stage..=stage).map(|stage| {
            let setup = &problem.materials[material_of(problem, number, stage)];
            let material = setup.build();
            match (material.keeps_its_shape(), material.is_plastic()) {
                (true, false) => Meets::Surface,
                (true, true) => Meets::Firm,
                (false, _) if material.is_fluid() => Meets::Feet,
                (false, _) => Meets::Frictional,
            }
        });
        materials.reduce(Meets::together).unwrap_or_default()
    };
    there.map(of_body).reduce(Meets::together).unwrap_or_default()
}

/// Density of all undeformed material that has moved with a velocity field so far, kg/m³; `None` where it
/// differs from body to body or, for particles that a file gives, from particle to particle.
fn density_of_field<const D: usize>(problem: &Problem<D>, physics: &Physics<D>, field: u8) -> Option<f64> {
    let field_of_body = &physics.body_contacts.field_of_body;
    let mut all = Vec::new();
    for (number, body) in problem.bodies.iter().enumerate() {
        let is_there = body.stage <= physics.stage();
        if is_there && field_of_body.get(number).is_none_or(|of| *of == field) {
            for stage in body.stage..=physics.stage() {
                let density = physics.materials[material_of(problem, number, stage)].density();
                if body.given.as_ref().is_some_and(|given| !given.has_density(density)) {
                    return None;
                }
                all.push(density);
            }
        }
    }
    let first = *all.first()?;
    all.iter().all(|density| *density == first).then_some(first)
}

/// Collective. Takes a solver into the next stage of its job: bodies are removed, changed and added. Returns
/// how many particles come, and how many of them to places where there is material already.
///
/// # Errors
/// A body that comes has no particle, or cannot have its stress; the same on all ranks.
pub fn enter_next<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    solver: &mut Solver<D>,
) -> Result<[u64; 2], Disagreement> {
    let mut starts = solver.physics.stage_starts.clone();
    starts.push(solver.clock.time);
    let physics = physics(problem, &starts);
    let stage = physics.stage();
    let mut added = new_particles(comm, problem, &solver.forest, &physics, solver.next_root())?;
    let mut counts = vec![0; problem.bodies.len()];
    added.iter().flat_map(Chunk::tags).for_each(|tag| counts[usize::from(Tag::unpack(*tag).body)] += 1);
    comm.sum_u64(&mut counts);
    comm.agree(check_counts(problem, &counts, stage))?;
    carry(comm, problem, solver, &mut added, stage)?;
    let is_removed = |body| problem.stages[stage].removed.contains(&body);
    let bodies = 0..problem.bodies.len();
    let is_removed: Vec<bool> = bodies.clone().map(is_removed).collect();
    let met = solver.chunks.iter().zip(&added);
    let met = met.map(|(chunk, added)| occupied(problem.coordinates, chunk, added, &is_removed));
    let mut come = [added.iter().map(|chunk| chunk.len() as u64).sum(), met.sum()];
    comm.sum_u64(&mut come);
    let change = Change {
        is_removed,
        materials: bodies
            .map(|body| [stage - 1, stage].map(|stage| material_of(problem, body, stage) as u16))
            .collect(),
        at_rest: problem.stages[stage].at_rest,
        reset_displacement: problem.stages[stage].reset_displacement,
        added,
    };
    let known = solver.enter_stage(physics, change);
    super::water::begin(comm, problem, solver, &known)?;
    Ok(come)
}

/// Number of the added particles of a leaf whose box overlaps that of a particle that stays by half along
/// each axis.
fn occupied<const D: usize>(
    coordinates: Coordinates,
    chunk: &Chunk<D>,
    added: &Chunk<D>,
    is_removed: &[bool],
) -> u64 {
    let half =
        |of: &Chunk<D>, p: usize| coordinates.half_width(of.column(Layout::<D>::HALF)[p], of.position(p)[0]);
    let stays = |p: &usize| !is_removed[usize::from(Tag::unpack(chunk.tags()[*p]).body)];
    let is_taken = |p: &usize| {
        let (x, reach) = (added.position(*p), half(added, *p));
        (0..chunk.len()).filter(stays).any(|q| {
            let (y, near) = (chunk.position(q), 0.5 * (reach + half(chunk, q)));
            (0..D).all(|a| (x[a] - y[a]).abs() < near)
        })
    };
    (0..added.len()).filter(is_taken).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Problem;

    fn job() -> Problem<2> {
        let text = "version = 1\ndimension = 2\ngravity = [0, -10]\n[domain]\nsize = [2, 1]\nroot_edge = 1\n\
            [[materials]]\nname = 'a'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e6\npoisson = 0.2\n\
            [[materials]]\nname = 'b'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 2e6\npoisson = 0.2\n\
            [[bodies]]\nname = 'ground'\nmaterial = 'a'\nshape = { kind = 'box', min = [0, 0], max = [2, 0.25] }\n\
            [[loads]]\nname = 'shake'\nkind = 'body_force'\nacceleration = ['t', 0]\nstages = ['shake']\n\
            [[colliders]]\nname = 'press'\nshape = { kind = 'box', min = [0, 0.25], max = [1, 0.5] }\nstages = ['press', 'shake']\n\
            motion = { kind = 'steady', velocity = [0, -1] }\n\
            [time]\nend = 9\n\
            [[stages]]\nname = 'settle'\nduration = 1\n\
            [[stages]]\nname = 'press'\nduration = 2\ngravity = [0, '-10 - t']\nboundaries = { x_min = { kind = 'sticky' } }\n\
            materials = [{ body = 'ground', material = 'b' }]\n\
            [[stages]]\nname = 'shake'\nboundaries = { x_max = { kind = 'outflow' } }\n";
        let path = std::path::Path::new("job.toml");
        crate::job::parse(text, path).expect("a job").try_into().expect("in 2D")
    }

    /// Changes of a stage outlast it; the clocks of loads and colliders start with the first of their stages.
    #[test]
    fn changes_stay_and_clocks_begin_with_the_first_stage() {
        let problem = job();
        let first = physics(&problem, &[0.0]);
        assert!(!first.loads[0].is_active(0.5) && !first.colliders[0].is_present());
        assert_eq!(first.gravity.at(5.0), [0.0, -10.0]);
        let second = physics(&problem, &[0.0, 1.25]);
        assert_eq!(second.gravity.at(2.25), [0.0, -11.0]);
        assert!(second.colliders[0].is_present() && !second.loads[0].is_active(2.0));
        assert_eq!(second.colliders[0].state_at(2.25).pose.translation, [0.0, -1.0]);
        let third = physics(&problem, &[0.0, 1.25, 3.5]);
        assert_eq!(third.gravity.at(2.25), [0.0, -11.0]);
        assert_eq!(third.colliders[0].state_at(3.25).pose.translation, [0.0, -2.0]);
        assert!(third.loads[0].is_active(3.5) && !third.loads[0].is_active(3.25));
        assert_eq!(third.faces[0], [crate::boundary::Contact::Sticky, crate::boundary::Contact::Outflow]);
        assert_eq!([0, 1, 2].map(|stage| material_of(&problem, 0, stage)), [0, 1, 1]);
    }
}
