//! Materials, and what becomes of those that fail.
use super::super::parse::error::QUOTED;
use super::checks::{Checks, check_names};
use crate::job::parse::source::Path;
use crate::job::problem::MaterialSetup;
use crate::job::schema::job_file as file;
use crate::material::Failed;
use crate::material::laws::flow::explosive;
use crate::material::parameters::{OutOfRange, Parameters};
use crate::material::undrained::Undrained;
use crate::text::{excerpt, written};

pub(super) fn materials(
    checks: &mut Checks,
    materials: &[file::Material],
    dimension: usize,
    path: &Path,
) -> Vec<MaterialSetup> {
    check_names(checks, materials.iter().map(|material| material.name.as_str()), path);
    for (i, material) in materials.iter().enumerate() {
        if let Err(OutOfRange { key, value, range }) = material.model.check() {
            let own = key.split('.').fold(path.index(i), |path, key| path.key(key.to_owned()));
            checks.fault(&own, format!("found {value}; expected a number {range}"));
        } else if let Some(water) = &material.undrained {
            undrained(checks, water, &material.model, &path.index(i));
        }
        if let Parameters::Explosive(own) = &material.model {
            ignition(checks, own, dimension, &path.index(i).key("ignition"));
        }
        if let Some(factor) = material.strength_factor
            && material.model.weakened(factor).is_none()
        {
            let message = "found it for a model without cohesion, yield stress or friction; expected mohr_coulomb, drucker_prager, tresca or von_mises";
            checks.fault(&path.index(i).key("strength_factor"), message.into());
        }
    }
    (0..)
        .zip(materials)
        .map(|(i, material)| {
            let failed = failed(checks, material, materials, &path.index(i).key("failed"));
            MaterialSetup { failed, ..material_setup(material) }
        })
        .collect()
}

/// Faults of the points from which an explosive burns.
fn ignition(checks: &mut Checks, own: &explosive::Parameters, dimension: usize, path: &Path) {
    for (number, ignition) in own.ignition.iter().enumerate() {
        if ignition.point.0.len() != dimension {
            let message = format!(
                "found {} coordinates; expected {dimension}, as many as the job has dimensions",
                ignition.point.0.len()
            );
            checks.fault(&path.index(number).key("point"), message);
        }
    }
}

/// Faults of water in the pores of a material.
fn undrained(checks: &mut Checks, water: &Undrained, model: &Parameters, path: &Path) {
    if let Err(OutOfRange { key, value, range }) = water.check() {
        let own = key.split('.').fold(path.clone(), |path, key| path.key(key.to_owned()));
        checks.fault(&own, format!("found {value}; expected a number {range}"));
    } else if let Err(reason) = Undrained::check_model(model) {
        checks.fault(&path.key("undrained"), reason.to_owned());
    }
}

pub(super) fn material_setup(material: &file::Material) -> MaterialSetup {
    let weakened = material.strength_factor.and_then(|factor| material.model.weakened(factor));
    MaterialSetup {
        name: material.name.clone(),
        density: material.density,
        saturated_density: material.saturated_density.unwrap_or(material.density),
        model: weakened.unwrap_or_else(|| material.model.clone()),
        undrained: material.undrained,
        failed: Failed::Stays,
    }
}

/// The fate of failed particles of a material, or faults.
fn failed(checks: &mut Checks, own: &file::Material, all: &[file::Material], path: &Path) -> Failed {
    let Some(own_rule) = own.failed.as_ref().filter(|rule| **rule != file::Failed::Stays) else {
        return Failed::Stays;
    };
    if !own.model.can_fail() {
        let message = "found it for a material that does not fail; expected `damage` beside it";
        checks.fault(path, message.into());
        return Failed::Stays;
    }
    let file::Failed::Material(name) = own_rule else { return Failed::Delete };
    let here = path.key("material");
    let known = || all.iter().map(|material| material.name.as_str());
    let Some(number) = checks.named(name, "material", known, &here) else { return Failed::Stays };
    let other = &all[number];
    let quoted = excerpt(name, QUOTED);
    let law = material_setup(other).build();
    let full = |material: &file::Material| material.saturated_density.unwrap_or(material.density);
    let fault = if std::ptr::eq(own, other) {
        Some("found the material itself; expected another one".to_owned())
    } else if law.is_fluid() || matches!(other.model, Parameters::Gas(_) | Parameters::Explosive(_)) {
        Some(format!("found \"{quoted}\", which is no solid; expected a solid"))
    } else if other.undrained.is_some() {
        Some(format!("found \"{quoted}\", which is undrained; expected a material without `undrained`"))
    } else if [own.density, full(own)] != [other.density, full(other)] {
        Some(format!(
            "found \"{quoted}\" with a density of {} kg/m³; expected {} kg/m³, since mass and volume stay (also those of full pores)",
            written(other.density),
            written(own.density)
        ))
    } else {
        None
    };
    match fault {
        Some(message) => {
            checks.fault(&here, message);
            Failed::Stays
        }
        None => Failed::Becomes(number as u16),
    }
}
