//! Initial fields of bodies: velocities and stresses.
use super::quantities::{quantity, vector};
use crate::job::convert::checks::Checks;
use crate::job::parse::source::Path;
use crate::job::problem::{InitialStress, StressKind};
use crate::job::schema::conditions::loads::Quantity as Written;
use crate::job::schema::conditions::stress::{Stress, StressKind as WrittenKind};
use crate::job::schema::job_file::{JobFile, Material};
use crate::material;
use crate::material::Consolidation;
use crate::quantity::Quantity;
use crate::text::written as number;

/// Components that may depend on the place and not on time, numbers at most `greatest` in size; or faults.
pub(in crate::job::convert) fn fields<const D: usize>(
    checks: &mut Checks,
    written: &[Written],
    path: &Path,
    greatest: f64,
) -> Option<[Quantity; D]> {
    let all = vector::<D>(checks, written, path)?;
    let mut sound = true;
    for (axis, component) in all.iter().enumerate() {
        sound &= is_field(checks, component, &path.index(axis));
        if let Quantity::Constant(value) = component
            && value.abs() > greatest
        {
            let message = format!(
                "found {}; expected a number from {} to {}",
                number(*value),
                number(-greatest),
                number(greatest)
            );
            checks.fault(&path.index(axis), message);
            sound = false;
        }
    }
    sound.then_some(all)
}

/// A fault for a quantity that changes in time.
fn is_field(checks: &mut Checks, quantity: &Quantity, path: &Path) -> bool {
    if quantity.depends_on_time() {
        let message = "found a quantity that changes in time; expected a number or an expression of position, for the start";
        checks.fault(path, message.into());
    }
    !quantity.depends_on_time()
}

/// A quantity that does not change in time, or a fault.
fn field<const D: usize>(checks: &mut Checks, written: &Written, path: &Path) -> Option<Quantity> {
    let quantity = quantity::<D>(checks, written, path)?;
    is_field(checks, &quantity, path).then_some(quantity)
}

/// The stress of a body at the start, or faults.
pub(in crate::job::convert) fn stress<const D: usize>(
    checks: &mut Checks,
    written: &Stress,
    file: &JobFile,
    material: &Material,
    path: &Path,
) -> Option<InitialStress> {
    let consolidation = consolidation(checks, written, material, path)?;
    if !matches!(written.kind, WrittenKind::Components { .. }) {
        needs_vertical_gravity(checks, file, &path.key("kind"), ", or a stress of kind \"components\"")?;
    }
    let surface_of = |checks: &mut Checks, surface: &Option<Written>| match surface {
        Some(written) => Some(Some(field::<D>(checks, written, &path.key("surface"))?)),
        None => Some(None),
    };
    let kind = match &written.kind {
        WrittenKind::Geostatic { k0, surface, surcharge } => StressKind::Weight {
            ratio: at_least_zero::<D>(checks, k0, &path.key("k0"))?,
            surface: surface_of(checks, surface)?,
            surcharge: field::<D>(checks, surcharge, &path.key("surcharge"))?,
        },
        WrittenKind::Hydrostatic { surface, surcharge } => StressKind::Weight {
            ratio: Quantity::Constant(1.0),
            surface: surface_of(checks, surface)?,
            surcharge: field::<D>(checks, surcharge, &path.key("surcharge"))?,
        },
        WrittenKind::Depth { table, surface } => {
            let here = path.key("table");
            if table.is_empty() {
                checks.fault(
                    &here,
                    "found an empty table; expected rows [depth, vertical pressure, horizontal pressure]"
                        .into(),
                );
                return None;
            }
            for (row, pair) in table.windows(2).enumerate().filter(|(_, pair)| pair[1][0] <= pair[0][0]) {
                let [before, depth] = [pair[0][0], pair[1][0]].map(number);
                checks.fault(
                    &here.index(row + 1).index(0),
                    format!("found a depth of {depth} m after {before} m; expected increasing depths"),
                );
            }
            StressKind::Depth { rows: table.clone(), surface: surface_of(checks, surface)? }
        }
        WrittenKind::Components { xx, yy, zz, xy, xz, yz } => {
            let given = [("xx", xx), ("yy", yy), ("zz", zz), ("xy", xy), ("xz", xz), ("yz", yz)];
            let mut components = Vec::new();
            for (name, written) in given {
                let component = field::<D>(checks, written, &path.key(name))?;
                if D == 2 && matches!(name, "xz" | "yz") && !matches!(component, Quantity::Constant(0.0)) {
                    checks.fault(
                        &path.key(name),
                        "found shear stress out of the plane; expected none in a 2D job".into(),
                    );
                }
                components.push(component);
            }
            StressKind::Components(Box::new(components.try_into().ok()?))
        }
    };
    let place = (checks.position)(checks.tree.locate(path).start);
    Some(InitialStress { place, kind, relax: written.relax, consolidation })
}

/// A field; a number of at least 0.
fn at_least_zero<const D: usize>(checks: &mut Checks, written: &Written, path: &Path) -> Option<Quantity> {
    let quantity = field::<D>(checks, written, path)?;
    match quantity {
        Quantity::Constant(value) if value < 0.0 => {
            checks.fault(path, format!("found {}; expected 0 or more", number(value)));
            None
        }
        _ => Some(quantity),
    }
}

fn consolidation(
    checks: &mut Checks,
    written: &Stress,
    material: &Material,
    path: &Path,
) -> Option<Option<Consolidation>> {
    let (key, asked) = match (written.ocr, written.preconsolidation) {
        (Some(_), Some(_)) => {
            checks.fault(
                &path.key("preconsolidation"),
                "found both `preconsolidation` and `ocr`; expected one of them".into(),
            );
            return None;
        }
        (Some(ratio), None) => ("ocr", Consolidation::Ratio(ratio)),
        (None, Some(pressure)) => ("preconsolidation", Consolidation::Pressure(pressure)),
        (None, None) => return Some(None),
    };
    if material.model.check().is_ok() && !material::build(&material.model, material.density).consolidates() {
        let name = crate::text::excerpt(&material.name, crate::job::parse::error::QUOTED);
        let message = format!(
            "found it for the material \"{name}\", whose model has no preconsolidation pressure; expected it for cam_clay only: remove it"
        );
        checks.fault(&path.key(key), message);
        return None;
    }
    Some(Some(asked))
}

/// A fault unless gravity has one component that is not 0 at the start; `instead` is another remedy.
pub(in crate::job::convert) fn needs_vertical_gravity(
    checks: &mut Checks,
    file: &JobFile,
    path: &Path,
    instead: &str,
) -> Option<()> {
    let components = file.gravity.as_deref().unwrap_or_default();
    let is_zero = |written: &Written| matches!(written, Written::Number(0.0));
    let present = components.iter().filter(|component| !is_zero(component)).count();
    if present == 1 {
        return Some(());
    }
    let found = if present == 0 { "no gravity" } else { "gravity along several axes" };
    let message = format!(
        "found {found}; expected one component of gravity that is not 0, which defines the vertical direction{instead}"
    );
    checks.fault(path, message);
    None
}
