//! What is allowed in a job and likely not meant.
use crate::boundary::{ActsOn, Collider};
use crate::geometry::{Aabb, Shape, Side, common_point};
use crate::job::Problem;
use crate::material::laws::drucker_prager::FrictionMatch;
use crate::material::parameters::Parameters;
use crate::text::{count, excerpt, quantity};

/// Steps from which a run is called long.
const MANY_STEPS: f64 = 1e6;
/// Boxes looked at for bodies inside colliders.
const BOXES: usize = 50_000;
/// Longest name that is quoted, in characters.
const NAME: usize = 60;

/// Not collective. Warnings about a job that takes about this number of steps, each with the key that it is about.
pub fn warnings<const D: usize>(problem: &Problem<D>, steps: f64) -> Vec<String> {
    let mut all = Vec::new();
    faces(problem, &mut all);
    materials(problem, &mut all);
    colliders(problem, &mut all);
    if steps >= MANY_STEPS {
        all.push(format!(
            "time: the run takes about {} steps; stiff material and fine cells shorten the step; use softer material or coarser cells if possible",
            count(steps.min(1e18) as u64)
        ));
    }
    all
}

/// Faces that the job does not name, if there are any.
fn faces<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let mut unnamed = Vec::new();
    let mut conditions = Vec::new();
    for a in 0..D {
        for (side, end) in
            ["min", "max"].into_iter().enumerate().filter(|(side, _)| !problem.named_faces[a][*side])
        {
            unnamed.push(format!("{}_{end}", ["x", "y", "z"][a]));
            conditions.push(problem.faces[a][side].name());
        }
    }
    if let Some(condition) = conditions.first() {
        all.push(format!(
            "boundaries: found no condition for {}; the default applies: {condition}",
            unnamed.join(", ")
        ));
    }
}

/// Drucker-Prager in plane strain with a cone for triaxial compression.
fn materials<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    for (index, material) in problem.materials.iter().enumerate().filter(|_| D == 2) {
        if let Parameters::DruckerPrager(parameters) = &material.model
            && parameters.matching == FrictionMatch::TriaxialCompression
            && parameters.friction_angle > 0.0
        {
            all.push(format!(
                "materials[{index}].match: \"{}\" has its friction angle in triaxial compression and a greater one in plane strain, as in this 2D job; use match = \"plane_strain\" for the friction angle in plane strain",
                excerpt(&material.name, NAME)
            ));
        }
    }
}

/// Colliders that material may pass through, and bodies that begin inside one.
fn colliders<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let mut boxes = BOXES;
    for (index, collider) in problem.colliders.iter().enumerate() {
        let name = excerpt(&collider.name, NAME);
        let (thickness, cell) =
            (thickness(&collider.shape), problem.cell_edge(level_at(problem, index, collider)));
        if collider.acts_on == ActsOn::Nodes && thickness < 2.0 * cell {
            all.push(format!(
                "colliders[{index}].shape: \"{name}\" is {} thick, less than two cells of {}; material may pass through it: use acts_on = \"particles\", a thicker shape or finer cells",
                quantity(thickness, "m"),
                quantity(cell, "m")
            ));
        }
        // Where it is in the job is where it begins, unless a table says otherwise.
        let start = collider.state_at(0.0).pose;
        if start.translation != [0.0; D] || start.angle != 0.0 {
            continue;
        }
        let slack = 0.5 * problem.cell_edge(problem.finest_level());
        for (number, body) in problem.bodies.iter().enumerate() {
            let domain = Aabb::new([0.0; D], problem.size());
            let bounds = collider.shape.bounds().intersection(&domain);
            let common = body.shape.bounds().intersection(&bounds);
            if boxes == 0 || common.is_empty() || body.given.is_some() {
                continue;
            }
            if common_point([&body.shape, &collider.shape], common, slack, &mut boxes).is_some() {
                all.push(format!(
                    "bodies[{number}].shape: \"{}\" starts partly inside the collider \"{name}\", which pushes it out: move one of them",
                    excerpt(&body.name, NAME)
                ));
            }
        }
    }
}

/// Level of the leaves at a collider where it begins: the coarsest that may lie there.
fn level_at<const D: usize>(problem: &Problem<D>, index: usize, collider: &Collider<D>) -> u8 {
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

/// The least width of a shape, m; of unions that of the thickest part, of other booleans an upper bound.
fn thickness<const D: usize>(shape: &Shape<D>) -> f64 {
    let least_edge =
        |bounds: &Aabb<D>| (0..D).map(|a| bounds.upper[a] - bounds.lower[a]).fold(f64::INFINITY, f64::min);
    match shape {
        Shape::Box(bounds) => least_edge(bounds),
        Shape::Sphere { radius, .. } => 2.0 * radius,
        Shape::Frustum(frustum) => frustum.height.min(2.0 * frustum.lower_radius.max(frustum.upper_radius)),
        Shape::HalfSpace { .. } => f64::INFINITY,
        Shape::Polygon(_) | Shape::Mesh(_) => least_edge(&shape.bounds()),
        Shape::Rotated(inner, _) => thickness(inner),
        Shape::Union(parts) => parts.iter().map(thickness).fold(0.0, f64::max),
        Shape::Intersection(parts) => parts.iter().map(thickness).fold(f64::INFINITY, f64::min),
        Shape::Difference(from, _) => thickness(from),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{AnyProblem, parse};

    const JOB: &str = r#"
version = 1
dimension = 2
domain = { size = [1, 1], root_edge = 1 }
tree.base_level = 2
time = { end = 1 }
boundaries = { x_min = { kind = "sticky" }, x_max = { kind = "slip" }, y_min = { kind = "sticky" }, y_max = { kind = "slip" } }
materials = [{ name = "m", density = 1000, model = "drucker_prager", young = 1e5, poisson = 0.3, friction_angle = 30, match = "plane_strain" }]
bodies = [{ name = "b", material = "m", shape = { kind = "box", min = [0, 0], max = [1, 0.5] } }]
colliders = [{ name = "plate", shape = { kind = "box", min = [0, 0.5], max = [1, 0.7] } }]
"#;

    fn of(changes: &[(&str, &str)], steps: f64) -> Vec<String> {
        let text = changes.iter().fold(JOB.to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        });
        match parse(&text, "job.toml".as_ref()) {
            Ok(AnyProblem::Two(problem)) => warnings(&problem, steps),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_sound_job_has_no_warnings() {
        assert_eq!(of(&[], 1e5), [""; 0]);
    }

    #[test]
    fn each_oddity_has_one_warning() {
        // Cells of 1/16 m: a plate of two is 0.125 m thick.
        let cases = [
            (
                ("max = [1, 0.7]", "max = [1, 0.62]"),
                "colliders[0].shape: \"plate\" is 120 mm thick, less than two cells of 62.5 mm",
            ),
            (
                ("min = [0, 0.5]", "min = [0, 0.4]"),
                "bodies[0].shape: \"b\" starts partly inside the collider \"plate\"",
            ),
            (
                (", match = \"plane_strain\"", ""),
                "materials[0].match: \"m\" has its friction angle in triaxial compression",
            ),
            (
                ("x_max = { kind = \"slip\" }, ", ""),
                "boundaries: found no condition for x_max; the default applies: ",
            ),
        ];
        for (change, expected) in cases {
            let found = of(&[change], 1e5);
            assert_eq!(found.len(), 1, "{found:?}");
            assert!(found[0].starts_with(expected), "{found:?}");
        }
        let found = of(&[], 12_345_678.0);
        assert!(found.len() == 1 && found[0].contains("12 345 678 steps"), "{found:?}");
    }

    /// A plate of one coarse cell is thick enough where a criterion or a region makes the cells fine.
    #[test]
    fn fine_cells_at_a_collider_count() {
        let thin = ("max = [1, 0.7]", "max = [1, 0.56]");
        assert_eq!(of(&[thin], 1.0).len(), 1);
        let region = "tree = { base_level = 2, regions = [{ level = 4, shape = { kind = \"box\", min = [0, 0.4], max = [1, 0.8] } }] }";
        assert_eq!(of(&[thin, ("tree.base_level = 2", region)], 1.0), [""; 0]);
        let criterion = "tree.base_level = 2\nadaptivity = { criteria = [{ kind = \"collider\", collider = \"plate\", level = 4 }] }";
        assert_eq!(of(&[thin, ("tree.base_level = 2", criterion)], 1.0), [""; 0]);
    }
}
