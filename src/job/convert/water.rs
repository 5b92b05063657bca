//! Water in the pores.
use super::checks::{Checks, Space};
use super::loads::at_nodes;
use super::stress::needs_vertical_gravity;
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::job::schema::job_file::JobFile;
use crate::job::schema::loads::Quantity as Written;
use crate::load::water::Given;
use crate::load::{Gravity, Kind, Load, Up, Water};
use crate::material;
use crate::text::{excerpt, written as number};

/// Name of the water among the loads.
const NAME: &str = "water";

/// The load of the water in the pores, if the job has any; `None` after faults.
pub(super) fn water<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    gravity: Option<&Gravity<D>>,
    space: &Space<D>,
    root: &Path,
) -> Option<Option<Load<D>>> {
    densities(checks, file, &root.key("materials"));
    let Some(written) = &file.water else { return Some(None) };
    let path = root.key("water");
    if let Some(taken) = file.loads.iter().position(|load| load.name == NAME) {
        let message =
            "found \"water\" beside the table [water], whose columns have that name; expected another name";
        checks.fault(&root.key("loads").index(taken).key("name"), message.into());
    }
    no_fluids(checks, file, &path);
    let given = match (&written.level, &written.pressure) {
        (Some(level), None) => Given::Level(at_nodes::<D>(checks, level, &path.key("level"))?),
        (None, Some(pressure)) => Given::Pressure(at_nodes::<D>(checks, pressure, &path.key("pressure"))?),
        (Some(_), Some(_)) => {
            let message = "found both `level` and `pressure`; expected one of them";
            checks.fault(&path.key("pressure"), message.into());
            return None;
        }
        (None, None) => {
            let message = "found neither `level` nor `pressure`; expected the level of the water table, m, or the pressure of the water, Pa";
            checks.fault(&path, message.into());
            return None;
        }
    };
    needs_vertical_gravity(checks, file, &path, "")?;
    // A copy: what it is evaluated for here may not be reached by the run.
    let start = gravity?.clone().at(0.0);
    let vertical = file.gravity.iter().flatten().zip(start).map(|(written, start)| match written {
        // Gravity that grows from 0: down.
        Written::Expression(_) | Written::Table(_) | Written::Record(_) if start == 0.0 => -1.0,
        _ => start,
    });
    let up = Up::new(&vertical.collect::<Vec<_>>());
    Some(Some(Load {
        name: NAME.into(),
        kind: Kind::Water(Water { given, density: written.density, suction: written.suction, up }),
        region: None,
        start: 0.0,
        from: 0.0,
        until: f64::INFINITY,
        origin: space.origin,
    }))
}

/// Faults of the densities of saturated materials.
fn densities(checks: &mut Checks, file: &JobFile, path: &Path) {
    for (index, material) in file.materials.iter().enumerate() {
        let Some(saturated) = material.saturated_density else { continue };
        let here = path.index(index).key("saturated_density");
        if file.water.is_none() {
            let message = "found it in a job without [water]; expected a water table, `[water] level = …`, or `density` alone";
            checks.fault(&here, message.into());
        } else if saturated < material.density {
            let [saturated, density] = [saturated, material.density].map(number);
            let message =
                format!("found {saturated}; expected at least density = {density}: water fills the pores");
            checks.fault(&here, message);
        }
    }
}

/// A fault for each fluid: pores of solids have water.
fn no_fluids(checks: &mut Checks, file: &JobFile, path: &Path) {
    for setup in &file.materials {
        if setup.model.check().is_ok() && material::build(&setup.model, setup.density).is_fluid() {
            let name = excerpt(&setup.name, QUOTED);
            let message = format!(
                "found it in a job with the fluid \"{name}\", which would float in it; expected solids alone: the pressure of free water is in the table already"
            );
            checks.fault(path, message);
        }
    }
}
