//! Physics of a job without the changes of its stages.
use crate::job::Problem;
use crate::solver::{Physics, StepControl, Ties};

/// Physics of the job without the changes of stages.
pub(super) fn constant_physics<const D: usize>(problem: &Problem<D>) -> Physics<D> {
    Physics {
        stage_starts: vec![0.0],
        origin: problem.origin,
        root_edge: problem.root_edge,
        graded: problem.tree.graded,
        materials: problem.materials.iter().map(|m| m.build()).collect(),
        failed: problem.materials.iter().map(|material| material.failed).collect(),
        gravity: problem.gravity.clone(),
        loads: problem.loads.clone(),
        seepage: problem.seepage.clone(),
        saturated: problem.materials.iter().map(|m| m.saturated_density / m.density).collect(),
        sources: problem.sources.clone(),
        faces: problem.faces,
        with_moments: with_moments(problem),
        absorbing: problem.absorbing.clone(),
        face_forces: problem.face_forces,
        colliders: problem.colliders.clone(),
        body_contacts: problem.body_contacts.clone(),
        adaptivity: problem.adaptivity.clone(),
        leaving: problem.leaving,
        equilibrium: None,
        quasi_static: problem.quasi_static,
        reduction: None,
        fill_densities: Vec::new(),
        meets: Vec::new(),
        transfer: problem.transfer,
        coordinates: problem.coordinates,
        boxes: problem.boxes,
        cohesion: None,
        has_halves: false,
        f_bar: problem.f_bar,
        viscosity: problem.viscosity,
        ties: if problem.quasi_static.is_some() { Ties::All } else { problem.ties },
        followed: problem.output.followed,
        control: StepControl {
            cfl: problem.time.cfl,
            dt_max: problem.time.dt_max,
            growth: problem.time.growth,
        },
    }
}

/// Bodies from a file that says how their particles move.
fn with_moments<const D: usize>(problem: &Problem<D>) -> Vec<u16> {
    let moves = |body: &usize| problem.bodies[*body].given.as_ref().is_some_and(|given| given.has_velocity);
    (0..problem.bodies.len()).filter(moves).map(|body| body as u16).collect()
}
