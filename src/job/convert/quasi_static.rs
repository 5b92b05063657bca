//! Load steps: their settings, and what jobs with them cannot have.
//!
//! Each setting without a meaning there, or whose forces a load step does not know so far, is refused by
//! name, all in one list.
use super::checks::Checks;
use crate::boundary::Contact;
use crate::job::parse::source::Path;
use crate::job::problem::Problem;
use crate::job::schema::job_file::JobFile;
use crate::kernel::Transfer;
use crate::load::Kind;
use crate::quantity::FACES;
use crate::solver::QuasiStatic;
use crate::text::written;

/// Load steps without a `min_step` become that much shorter at most.
const SHORTENING: f64 = 1024.0;

/// Settings of the load steps of a job, if it has them.
pub(super) fn settings(checks: &mut Checks, file: &JobFile, root: &Path) -> Option<QuasiStatic> {
    let given = file.quasi_static.as_ref()?;
    let least_step = given.min_step.unwrap_or(given.step / SHORTENING);
    if least_step > given.step {
        let message = format!(
            "found {}; expected at most quasi_static.step = {}",
            written(least_step),
            written(given.step)
        );
        checks.fault(&root.key("quasi_static").key("min_step"), message);
    }
    Some(QuasiStatic { step: given.step, least_step, tolerance: given.tolerance })
}

/// Adds faults for all that a job with load steps cannot have.
pub(super) fn check<const D: usize>(checks: &mut Checks, file: &JobFile, problem: &Problem<D>) {
    if problem.quasi_static.is_none() {
        return;
    }
    let root = Path::default();
    let mut refuse = checks.refuse_in("a quasi-static job");
    let none = "none";
    refuse(file.equilibrium.is_some(), root.key("equilibrium"), "kinetic damping", none);
    for (i, stage) in file.stages.iter().enumerate() {
        let here = root.key("stages").index(i).key("equilibrium");
        refuse(stage.equilibrium.is_some(), here, "kinetic damping", none);
    }
    refuse(!file.sources.is_empty(), root.key("sources"), "sources", "bodies");
    refuse(!file.contact.is_empty(), root.key("contact"), "contact between bodies", "bodies that stick");
    let numerics = root.key("numerics");
    let is_affine = matches!(problem.transfer, Transfer::Apic | Transfer::Tpic);
    refuse(!is_affine, numerics.key("transfer"), "a transfer by increments", "\"apic\" or \"tpic\"");
    refuse(problem.viscosity.is_some(), numerics.key("artificial_viscosity"), "artificial viscosity", none);
    for (i, material) in problem.materials.iter().enumerate() {
        let here = root.key("materials").index(i).key("model");
        refuse(material.build().is_fluid(), here, "a fluid", "a solid or granular material");
    }
    for (i, body) in file.bodies.iter().enumerate() {
        let here = root.key("bodies").index(i);
        let rest = "none: all material is at rest";
        refuse(body.velocity.is_some(), here.key("velocity"), "a velocity", rest);
        refuse(body.angular_velocity.is_some(), here.key("angular_velocity"), "a rotation", rest);
        let moves =
            problem.bodies.get(i).and_then(|body| body.given.as_ref()).is_some_and(|g| g.has_velocity);
        refuse(moves, here.key("shape"), "particles with velocities", "particles at rest");
    }
    for (i, load) in problem.loads.iter().enumerate().take(file.loads.len()) {
        let rests =
            matches!(load.kind, Kind::BodyForce(_) | Kind::Velocity(_) | Kind::Carried(_) | Kind::Water(_));
        refuse(!rests, root.key("loads").index(i).key("kind"), "damping", "forces and grips");
    }
    for (i, collider) in problem.colliders.iter().enumerate() {
        let here = root.key("colliders").index(i);
        refuse(collider.free().is_some(), here.key("motion"), "a free body", "a prescribed motion");
        let shears = collider.contact.acts_by_area();
        refuse(shears, here.key("contact"), "cohesion or drag", "friction alone");
        refuse(
            !collider.acts_on_nodes(),
            here.key("acts_on"),
            "a collider that acts on particles",
            "\"nodes\"",
        );
    }
    let mut of_stages = vec![(root.clone(), problem.faces.map(|pair| pair.map(Some)))];
    for (i, stage) in problem.stages.iter().enumerate().take(file.stages.len()) {
        of_stages.push((root.key("stages").index(i), stage.faces));
    }
    for (number, (path, faces)) in of_stages.iter().enumerate() {
        for axis in 0..D {
            for side in 0..2 {
                let is_named = number > 0 || problem.named_faces[axis][side];
                let here = path.key("boundaries").key(FACES[axis][side]);
                let (found, expected) = match faces[axis][side] {
                    Some(contact) if contact.acts_by_area() => ("cohesion or drag", "friction alone"),
                    Some(Contact::Absorbing) => ("a face that absorbs waves", "another kind"),
                    _ => continue,
                };
                refuse(is_named, here.key("kind"), found, expected);
            }
        }
    }
}
