//! Materials of bodies by stage.
use crate::job::Problem;

/// Material of the particles of a body in a stage.
pub(super) fn material_of<const D: usize>(problem: &Problem<D>, body: usize, stage: usize) -> usize {
    let changes = problem.stages[..=stage].iter().flat_map(|stage| &stage.materials);
    changes.filter(|(of, _)| *of == body).fold(problem.bodies[body].material, |_, (_, material)| *material)
}
