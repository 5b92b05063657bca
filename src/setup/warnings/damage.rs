//! Crack bands that are too wide.
use super::name::NAME;
use crate::geometry::{Aabb, Side};
use crate::job::Problem;
use crate::material::parameters::Parameters;
use crate::text::{excerpt, quantity};

/// Warns of bodies whose cells hold more energy at the strength than a crack takes: they break at once, and
/// take more than the energy of fracture.
pub(super) fn look<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    for (index, material) in problem.materials.iter().enumerate() {
        let Parameters::Hencky(elastic) = &material.model else { continue };
        let Some(damage) = &elastic.damage else { continue };
        let widest = damage.widest_band(elastic.young);
        let own = problem.bodies.iter().filter(|body| body.material == index && body.given.is_none());
        let coarsest = own.map(|body| problem.cell_edge(level(problem, &body.shape.bounds())));
        let coarsest = coarsest.fold(0.0, f64::max);
        if coarsest > widest {
            all.push(format!(
                "materials[{index}].damage: \"{}\" in cells of {} breaks at once and takes more than its fracture_energy; expected cells of at most {}: finer cells, a greater fracture_energy or a lesser strength",
                excerpt(&material.name, NAME),
                quantity(coarsest, "m"),
                quantity(widest, "m")
            ));
        }
    }
}

/// Level of the coarsest leaves in a box.
fn level<const D: usize>(problem: &Problem<D>, bounds: &Aabb<D>) -> u8 {
    let regions = problem.tree.regions.iter();
    let around = regions.filter(|region| region.shape.classify(bounds) == Side::Inside);
    around.map(|region| region.level).fold(problem.tree.base_level, u8::max)
}
