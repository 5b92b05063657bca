//! Colliders that act on particles and hold fluids alone.
use crate::boundary::{ActsOn, Collider};
use crate::geometry::{Aabb, Side};
use crate::job::Problem;
use crate::setup::materials::material_of;

/// Cells below its surface that a wall which acts on nodes has, or it leaks.
const CELLS: f64 = 2.0;

/// Whether a collider that acts on particles acts on nodes in a stage: all material that has come by then is
/// fluid, and it is thick enough. At nodes fluids rest to round-off; at particles rounding lets single ones
/// of a row that bears their weight go, and they sink.
pub fn acts_on_nodes<const D: usize>(problem: &Problem<D>, stage: usize, index: usize) -> bool {
    let collider = &problem.colliders[index];
    if collider.acts_on != ActsOn::Particles || collider.free().is_some() || collider.deforming.is_some() {
        return false;
    }
    let thick = || (0..problem.colliders.len()).map(|index| is_thick(problem, index)).collect();
    holds_fluids(problem, stage) && problem.thick.get_or_init(thick)[index]
}

/// Whether a collider that acts on particles is thick enough to act on nodes.
fn is_thick<const D: usize>(problem: &Problem<D>, index: usize) -> bool {
    let (domain, collider) = (Aabb::new([0.0; D], problem.size()), &problem.colliders[index]);
    let cell = problem.cell_edge(level_at(problem, index, collider));
    collider.acts_on == ActsOn::Particles && collider.shape.is_thick(&domain, CELLS * cell, cell)
}

/// Whether all material that has come up to a stage is fluid.
fn holds_fluids<const D: usize>(problem: &Problem<D>, stage: usize) -> bool {
    let there = problem.bodies.iter().enumerate().filter(|(_, body)| body.stage <= stage);
    let mut materials = there.flat_map(|(number, body)| {
        (body.stage..=stage).map(move |stage| &problem.materials[material_of(problem, number, stage)])
    });
    materials.all(|setup| setup.build().is_fluid())
}

/// Level of the leaves at a collider where it begins: the coarsest that may lie there.
pub(super) fn level_at<const D: usize>(problem: &Problem<D>, index: usize, collider: &Collider<D>) -> u8 {
    let domain = Aabb::new([0.0; D], problem.size());
    let bounds = collider.shape.bounds().intersection(&domain);
    let regions = problem.tree.regions.iter();
    let regions =
        regions.filter(|region| region.shape.classify(&bounds) == Side::Inside).map(|region| region.level);
    let criteria = problem.adaptivity.iter().flat_map(|adaptivity| &adaptivity.criteria);
    let criteria =
        criteria.filter(|criterion| criterion.collider() == Some(index)).map(|criterion| criterion.level);
    regions.chain(criteria).fold(problem.tree.base_level, u8::max)
}
