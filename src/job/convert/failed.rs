//! The fate of failed particles.
use super::checks::Checks;
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::job::schema::job_file as file;
use crate::material::Failed;
use crate::material::parameters::Parameters;
use crate::text::{excerpt, written};

/// The fate of failed particles of a material, or faults.
pub(super) fn failed(
    checks: &mut Checks,
    own: &file::Material,
    all: &[file::Material],
    path: &Path,
) -> Failed {
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
    let law = super::material_setup(other).build();
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
