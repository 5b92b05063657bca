//! Likely mistakes in a job: settings that are allowed and hardly intended.
//!
//! | file | subject |
//! |---|---|
//! | `mod.rs` | faces, angles of friction, long runs |
//! | `colliders.rs` | thin colliders, those that overlap bodies, those outside the domain |
//! | `damage.rs` | crack bands that are too wide |
//! | `flow.rs` | sand whose flow the transfer slows |
//! | `ground.rs` | unit weights, radians, gravity upwards, water and points where no ground is |
//! | `shock.rs` | gas without what its shocks need |
//! | `stretch.rs` | elastic bodies that are stretched further than particles follow |
//! | `thickness.rs` | solids that are thicker or thinner than their shape |
//! | `units.rs` | properties that no matter has |
//! | `name.rs` | how long a name they quote |
use self::ground::foot;
use self::name::NAME;
use super::estimate::{EstimateError, steps};
use crate::job::problem::{Body, Coordinates};
use crate::job::{AnyProblem, Problem};
use crate::material::laws::drucker_prager::FrictionMatch;
use crate::material::parameters::Parameters;
use crate::text::{count, excerpt, number};

mod colliders;
mod damage;
mod flow;
mod ground;
mod name;
mod shock;
mod stretch;
mod thickness;
mod units;

/// Steps from which a run is called long.
const MANY_STEPS: f64 = 1e6;

/// Not collective. Warnings about a job that takes about this number of steps, each with the key that it is
/// about.
pub fn warnings<const D: usize>(problem: &Problem<D>, steps: f64) -> Vec<String> {
    let mut all = Vec::new();
    faces(problem, &mut all);
    materials(problem, &mut all);
    undrained(problem, &mut all);
    saturated(problem, &mut all);
    colliders::look(problem, &mut all);
    damage::look(problem, &mut all);
    flow::look(problem, steps, &mut all);
    ground::look(problem, &mut all);
    shock::look(problem, &mut all);
    stretch::look(problem, &mut all);
    thickness::look(problem, &mut all);
    units::look(problem, steps, &mut all);
    if steps >= MANY_STEPS {
        all.push(format!(
            "time: the run takes about {} steps; stiff material and fine cells shorten the step; use softer material or coarser cells if possible",
            count(steps.min(1e18) as u64)
        ));
    }
    all
}

/// Not collective. Warnings about a job before its run; none unless they are `wanted`.
///
/// # Errors
/// Its steps cannot be counted.
pub fn first_warnings(problem: &AnyProblem, wanted: bool) -> Result<Vec<String>, EstimateError> {
    match problem {
        AnyProblem::Two(problem) => first_warnings_of(problem, wanted),
        AnyProblem::Three(problem) => first_warnings_of(problem, wanted),
    }
}

fn first_warnings_of<const D: usize>(
    problem: &Problem<D>,
    wanted: bool,
) -> Result<Vec<String>, EstimateError> {
    let (_, steps) = steps(problem)?;
    Ok(if wanted { warnings(problem, steps) } else { Vec::new() })
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
    let is_plane = D == 2 && problem.coordinates == Coordinates::Cartesian;
    for (index, material) in problem.materials.iter().enumerate().filter(|_| is_plane) {
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

/// Bodies that reach below the water table, of materials that are no heavier there.
fn saturated<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    let Some(water) = problem.water() else { return };
    for (index, setup) in problem.materials.iter().enumerate() {
        let is_wet = |body: &Body<D>| {
            let (bounds, up) = (body.shape.bounds(), water.up);
            let mut lowest = bounds.centre();
            lowest[up.axis] = foot(&bounds, up);
            body.material == index && water.is_below(problem.place(&lowest), 0.0)
        };
        if setup.saturated_density == setup.density && problem.bodies.iter().any(is_wet) {
            all.push(format!(
                "materials[{index}].saturated_density: \"{}\" lies below the water table, and its density is {} kg/m³ above and below it; set saturated_density, the density with full pores, unless that is it",
                excerpt(&setup.name, NAME),
                number(setup.density, 4)
            ));
        }
    }
}

/// Stiffness of water over that of the skeleton up to which nothing is to be gained by softer water.
const STIFF_WATER: f64 = 50.0;

/// Stiff water in the pores: many steps, and locking without F-bar.
fn undrained<const D: usize>(problem: &Problem<D>, all: &mut Vec<String>) {
    for (index, setup) in problem.materials.iter().enumerate() {
        let Some(water) = &setup.undrained else { continue };
        let (material, name) = (setup.build(), excerpt(&setup.name, NAME));
        let wave = material.wave_speed();
        let stiffness = setup.density * wave * wave - water.modulus();
        let steps = |ratio: f64| (1.0 + ratio).sqrt();
        let ratio = water.modulus() / stiffness;
        if ratio > STIFF_WATER {
            all.push(format!(
                "materials[{index}].undrained: the water in \"{name}\" is {} times as stiff as its skeleton, and takes {} times as many steps as without; with bulk_modulus = {} it is {STIFF_WATER} times as stiff, takes {} times as many steps, and bears {} % less of a load on confined ground",
                number(ratio, 2),
                number(steps(ratio), 2),
                number(STIFF_WATER * stiffness * water.porosity, 2),
                number(steps(STIFF_WATER), 2),
                number(100.0 * (ratio / (1.0 + ratio) - STIFF_WATER / (1.0 + STIFF_WATER)), 2),
            ));
        }
        if !problem.f_bar {
            all.push(format!(
                "materials[{index}].undrained: \"{name}\" with its water hardly changes volume, and numerics.f_bar is false: such material locks, and its pressures alternate from particle to particle; set numerics.f_bar = true"
            ));
        }
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
            (
                ("friction_angle = 30", "friction_angle = 0.5"),
                "materials[0].friction_angle: found 0.5 degrees for \"m\"; expected more: angles are in degrees, and 0.5 rad are 28.6",
            ),
            (
                ("density = 1000", "density = 20"),
                "materials[0].density: found 20 kg/m³ for \"m\", a material of ground; expected at least 100: 20 kN/m³ are 2039",
            ),
            (
                ("dimension = 2", "dimension = 2\ngravity = [0, 9.81]"),
                "gravity: found 9.81 m/s² along +y, which pictures show as up; expected a negative number",
            ),
            (
                ("dimension = 2", "dimension = 2\ngravity = [0, -9.81]\nwater = { level = -3 }"),
                "water: found no body that reaches below the water table",
            ),
            (
                (
                    "dimension = 2",
                    "dimension = 2\ntracks = [{ name = \"t\", point = [0.5, 0.9], quantities = [\"centre\"] }]",
                ),
                "tracks[0].point: \"t\" lies 400 mm from the nearest body; expected a point in one: the track follows the particle nearest to (0.5, 0.9) m",
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

    /// A column 8 cells high falls in 677 of 3,000 steps.
    #[test]
    fn sand_that_apic_slows_is_told() {
        let column = [
            ("dimension = 2", "dimension = 2\ngravity = [0, -9.81]"),
            ("max = [1, 0.5]", "max = [0.4, 0.5]"),
            ("colliders = ", "# colliders = "),
        ];
        let found = of(&column, 3000.0);
        let expected =
            "bodies[0]: \"b\" has a free side and 8 cells in its height, and falls in about 680 steps; ";
        assert!(found.len() == 1 && found[0].starts_with(expected), "{found:?}");
        assert!(found[0].contains("about 27 % less far"), "{found:?}");
        let with = |change: (&'static str, &'static str)| of(&[&column[..], &[change]].concat(), 3000.0);
        let flip = ("version = 1", "version = 1\nnumerics = { transfer = \"flip\", flip = 1 }");
        assert_eq!(with(flip), [""; 0]);
        assert_eq!(with(("friction_angle = 30", "friction_angle = 30, cohesion = 1e3")), [""; 0]);
        assert_eq!(with(("max = [0.4, 0.5]", "max = [0.6, 0.5]")), [""; 0], "a face within its height");
        assert_eq!(of(&column, 1000.0), [""; 0], "few steps");
    }

    /// A plate of one coarse cell is thick enough where a criterion or a region makes the cells fine.
    #[test]
    fn fine_cells_at_a_collider_count() {
        let thin = ("max = [1, 0.7]", "max = [1, 0.56]");
        assert_eq!(of(&[thin], 1e5).len(), 1);
        let region = "tree = { base_level = 2, regions = [{ level = 4, shape = { kind = \"box\", min = [0, 0.4], max = [1, 0.8] } }] }";
        assert_eq!(of(&[thin, ("tree.base_level = 2", region)], 1e5), [""; 0]);
        let criterion = "tree.base_level = 2\nadaptivity = { criteria = [{ kind = \"collider\", collider = \"plate\", level = 4 }] }";
        assert_eq!(of(&[thin, ("tree.base_level = 2", criterion)], 1e5), [""; 0]);
    }
}
