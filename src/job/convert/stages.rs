//! Stages of the run.
use super::checks::Checks;
use super::conditions::loads;
use super::settings;
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::job::problem::{FactorSearch, InStages, Stage};
use crate::job::schema::job_file::{Body, Equilibrium as Written, JobFile};
use crate::job::schema::stages::StrengthReduction;
use crate::particle::followed::Motion;
use crate::solver::Equilibrium;
use crate::text::{excerpt, written as number};

/// All stages, at least one, or faults.
pub(super) fn stages<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    root: &Path,
) -> Option<Vec<Stage<D>>> {
    if file.stages.is_empty() {
        return Some(vec![Stage::whole_run(equilibrium(file, file.equilibrium.as_ref()))]);
    }
    if file.equilibrium.is_some() {
        let message =
            "found [equilibrium] in a job with stages; expected `equilibrium` in the stages that end with it";
        checks.fault(&root.key("equilibrium"), message.into());
    }
    let here = root.key("stages");
    let mut all = Vec::new();
    for number in 0..file.stages.len() {
        all.push(stage(checks, file, number, &here.index(number)));
    }
    all.into_iter().collect()
}

fn equilibrium(file: &JobFile, written: Option<&Written>) -> Option<Equilibrium> {
    written.map(|written| Equilibrium {
        speed: written.speed,
        acceleration: written.acceleration,
        own_mass_level: written.mass_scaling.then_some(file.tree.base_level),
    })
}

fn stage<const D: usize>(checks: &mut Checks, file: &JobFile, index: usize, path: &Path) -> Option<Stage<D>> {
    let written = &file.stages[index];
    checks.column_name(
        &written.name,
        file.stages[..index].iter().map(|stage| &*stage.name),
        &path.key("name"),
    );
    if index + 1 < file.stages.len() && written.duration.is_none() && written.equilibrium.is_none() {
        let message = format!(
            "found the stage \"{}\" without an end before the next one; expected a duration, an equilibrium, or both",
            excerpt(&written.name, QUOTED)
        );
        checks.fault(path, message);
    }
    if index == 0 && written.at_rest {
        let message = "found `at_rest` in the first stage; expected `at_rest` in a later stage: bodies start with their own `velocity`";
        checks.fault(&path.key("at_rest"), message.into());
    }
    if written.reset_displacement && settings::followed(&file.output).motion == Motion::Nothing {
        let message = "found `reset_displacement`, but the job does not follow displacements; expected \"displacement\" or \"strain\" among output.fields";
        checks.fault(&path.key("reset_displacement"), message.into());
    }
    let begins: f64 = file.stages[..index].iter().map(|stage| stage.duration.unwrap_or(0.0)).sum();
    let ends_in_time = file.stages[..index].iter().all(|stage| stage.equilibrium.is_none());
    if ends_in_time && begins >= file.time.end {
        let (begins, end) = (number(begins), number(file.time.end));
        let message =
            format!("found a stage that begins at {begins} s; expected it before time.end = {end} s");
        checks.fault(path, message);
    }
    let reduction = strength_reduction(checks, file, index, path);
    let bodies = || file.body_names().into_iter();
    let materials_known = || file.materials.iter().map(|material| material.name.as_str());
    let mut removed = Vec::new();
    for (i, name) in written.remove.iter().enumerate() {
        let here = path.key("remove").index(i);
        let body = checks.named(name, "body", bodies, &here)?;
        let comes = file.bodies.get(body).and_then(|body| body.stage.as_ref());
        let comes =
            comes.and_then(|name| file.stages.iter().position(|stage| stage.name == *name)).unwrap_or(0);
        if index <= comes {
            let message = format!(
                "found the body \"{}\", which does not exist before this stage; expected an existing body",
                excerpt(name, QUOTED)
            );
            checks.fault(&here, message);
        }
        removed.push(body);
    }
    let mut materials = Vec::new();
    for (i, new) in written.materials.iter().enumerate() {
        let here = path.key("materials").index(i);
        let body = checks.named(&new.body, "body", bodies, &here.key("body"));
        let material = checks.named(&new.material, "material", materials_known, &here.key("material"));
        materials.push((body?, material?));
    }
    let gravity = match &written.gravity {
        Some(gravity) => Some(loads::gravity(checks, gravity, &path.key("gravity"))?),
        None => None,
    };
    let boundaries = written.boundaries.clone().unwrap_or_default();
    let faces = settings::faces(checks, &boundaries, &path.key("boundaries"))?;
    let absorbing = settings::absorbing(checks, &boundaries, &path.key("boundaries"))?;
    let leaving = written.boundaries.as_ref().and_then(|boundaries| boundaries.leaving);
    Some(Stage {
        name: written.name.clone(),
        duration: reduction
            .map(|search| search.to - search.from)
            .or(written.duration)
            .unwrap_or(f64::INFINITY),
        equilibrium: equilibrium(file, written.equilibrium.as_ref()),
        removed,
        materials,
        gravity,
        faces,
        absorbing,
        leaving: leaving.map(settings::leaving),
        at_rest: written.at_rest,
        reset_displacement: written.reset_displacement,
        reduction,
    })
}

/// Search for the factor of safety in a stage, or faults.
fn strength_reduction(
    checks: &mut Checks,
    file: &JobFile,
    index: usize,
    path: &Path,
) -> Option<FactorSearch> {
    let stage = &file.stages[index];
    let StrengthReduction { from, to, step, tolerance, davis } = *stage.strength_reduction.as_ref()?;
    let here = path.key("strength_reduction");
    let mut fault = |path: &Path, message: String| checks.fault(path, message);
    if file.quasi_static.is_none() {
        let message = "found it in a job without load steps; expected [quasi_static], or a sweep over the strength_factor of a material";
        fault(&here, message.into());
    }
    if index + 1 < file.stages.len() {
        fault(
            &here,
            "found it before the last stage; expected it in the last one: the run ends with it".into(),
        );
    }
    if let Some(duration) = stage.duration {
        let message = format!(
            "found {} s in a stage with strength_reduction; expected none: it ends with the factor of safety",
            number(duration)
        );
        fault(&path.key("duration"), message);
    }
    if to <= from {
        fault(&here.key("to"), format!("found {}; expected more than from = {}", number(to), number(from)));
    }
    if tolerance > step {
        let message = format!("found {}; expected at most step = {}", number(tolerance), number(step));
        fault(&here.key("tolerance"), message);
    }
    if file.materials.iter().all(|material| material.model.weakened(1.0).is_none()) {
        let message = "found no material with cohesion, yield stress or friction; expected mohr_coulomb, drucker_prager, tresca or von_mises";
        fault(&here, message.into());
    }
    Some(FactorSearch { from, to, step, tolerance, davis })
}

/// Number of a stage by its name, or a fault.
fn stage_named(checks: &mut Checks, file: &JobFile, name: &str, path: &Path) -> Option<usize> {
    if file.stages.is_empty() {
        let name = excerpt(name, QUOTED);
        let message = format!("found \"{name}\"; expected a job with [[stages]] to name one of them");
        checks.fault(path, message);
        return None;
    }
    checks.named(name, "stage", || file.stages.iter().map(|stage| stage.name.as_str()), path)
}

/// The stage at whose start a body is added; a fault where there is none of that name.
pub(super) fn of_body(checks: &mut Checks, body: &Body, file: &JobFile, path: &Path) -> usize {
    let Some(name) = &body.stage else { return 0 };
    stage_named(checks, file, name, &path.key("stage")).unwrap_or(0)
}

/// The stages in which each load, collider or source acts, or faults.
pub(super) fn of_each<'a>(
    checks: &mut Checks,
    file: &JobFile,
    written: impl Iterator<Item = &'a Option<Vec<String>>>,
    path: &Path,
) -> Vec<InStages> {
    of_list(checks, file, written, |number| path.index(number).key("stages"))
}

/// As [`of_each`], with the key of each.
pub(super) fn of_list<'a>(
    checks: &mut Checks,
    file: &JobFile,
    written: impl Iterator<Item = &'a Option<Vec<String>>>,
    key: impl Fn(usize) -> Path,
) -> Vec<InStages> {
    let mut all = Vec::new();
    for (number, names) in written.enumerate() {
        let here = key(number);
        let stages = names.as_ref().map(|names| {
            let named = names
                .iter()
                .enumerate()
                .filter_map(|(i, name)| stage_named(checks, file, name, &here.index(i)));
            named.collect()
        });
        all.push(InStages(stages));
    }
    all
}
