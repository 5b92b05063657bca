//! Gas: settings that its shocks and its expansion need.
use super::name::NAME;
use crate::job::Problem;
use crate::job::problem::BoxPolicy;
use crate::text::excerpt;

/// Warns of gas without artificial viscosity, and of boxes that do not tile it.
pub(super) fn look<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let is_gas = |index: &usize| problem.materials[*index].is_gas();
    let Some(index) = problem.bodies.iter().map(|body| body.material).find(is_gas) else { return };
    let name = excerpt(&problem.materials[index].name, NAME);
    if problem.viscosity.is_none() {
        all.push(format!(
            "numerics.artificial_viscosity: \"{name}\" is a gas, and there is none: shocks ring, and gas behind them is too dense (by 3 % in a shock tube); set numerics.artificial_viscosity = {{}}"
        ));
    }
    if problem.boxes != BoxPolicy::Cell {
        all.push(format!(
            "numerics.boxes: \"{name}\" is a gas, and boxes that keep their volume leave gaps and overlaps where it changes its density along one axis: its volume is 3 to 9 % too great behind a rarefaction; set numerics.boxes = \"cell\", with particles_per_cell = 4"
        ));
    }
}
