//! Water in the pores.
use super::quantities::at_nodes;
use super::stress::needs_vertical_gravity;
use crate::job::convert::checks::{Checks, Space};
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::job::problem::InStages;
use crate::job::schema::conditions::loads::Quantity as Written;
use crate::job::schema::conditions::water as schema;
use crate::job::schema::job_file::JobFile;
use crate::load::seepage::{HeldHead, HeldRegion};
use crate::load::water::Given;
use crate::load::{Gravity, Kind, Load, Seepage, Up, Water};
use crate::material;
use crate::quantity::AXES;
use crate::text::{excerpt, written as number};

/// Name of the water among the loads.
const NAME: &str = "water";

/// The load of the water in the pores, if the job has any; `None` after faults.
pub(in crate::job::convert) fn water<const D: usize>(
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
    let given = match (&written.level, &written.pressure, &written.seepage) {
        (Some(level), None, None) => Given::Level(at_nodes::<D>(checks, level, &path.key("level"))?),
        (None, Some(pressure), None) => {
            Given::Pressure(at_nodes::<D>(checks, pressure, &path.key("pressure"))?)
        }
        (None, None, Some(_)) => Given::Seepage(None),
        (None, None, None) => {
            let message = "found neither `level`, `pressure` nor `seepage`; expected the level of the water table, m, the pressure of the water, Pa, or the heads between which it seeps";
            checks.fault(&path, message.into());
            return None;
        }
        (_, pressure, seepage) => {
            let (key, other) = match (pressure, seepage) {
                (Some(_), Some(_)) => ("pressure", "seepage"),
                (Some(_), None) => ("pressure", "level"),
                (None, _) => ("seepage", "level"),
            };
            checks.fault(&path.key(key), format!("found both `{other}` and `{key}`; expected one of them"));
            return None;
        }
    };
    needs_vertical_gravity(checks, file, &path, "")?;
    // A copy: what it is evaluated for here may not be reached by the run.
    let start = gravity?.clone().at(0.0);
    let vertical = file.gravity.iter().flatten().zip(start).map(|(written, start)| match written {
        Written::Number(_) => start,
        // Gravity that grows from 0: down.
        _ if start == 0.0 => -1.0,
        _ => start,
    });
    let up = Up::new(&vertical.collect::<Vec<_>>());
    if let Given::Level(level) = &given
        && level.depends_on(up.axis)
    {
        let vertical = AXES[up.axis];
        let message = format!(
            "found a level that depends on {vertical}, the vertical; expected the height of the water table over the horizontal coordinates and t"
        );
        checks.fault(&path.key("level"), message);
    }
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

/// The stages in which the job has water, or faults.
pub(in crate::job::convert) fn stages(checks: &mut Checks, file: &JobFile, root: &Path) -> InStages {
    let written = file.water.iter().map(|water| &water.stages);
    let path = root.key("water");
    crate::job::convert::stages::of_list(checks, file, written, |_| path.key("stages"))
        .pop()
        .unwrap_or_default()
}

/// The seepage of the job, if it has any; `None` after faults.
pub(in crate::job::convert) fn seepage<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    space: &Space<D>,
    root: &Path,
) -> Option<Option<Seepage<D>>> {
    permeabilities(checks, file, &root.key("materials"));
    let Some(written) = file.water.as_ref().and_then(|water| water.seepage.as_ref()) else {
        return Some(None);
    };
    let path = root.key("water").key("seepage");
    if !file.sources.is_empty() {
        let message = "found seepage in a job with sources; expected a water table, `[water] level = …`: material that enters has no head";
        checks.fault(&path, message.into());
    }
    let mut heads = Vec::new();
    for (i, head) in written.heads.iter().enumerate() {
        let here = path.key("heads").index(i);
        let before = written.heads[..i].iter().map(|head| &*head.name).chain(["surface"]);
        checks.column_name(&head.name, before, &here.key("name"));
        heads.push(held(checks, head, space, &here));
    }
    let heads: Vec<HeldHead<D>> = heads.into_iter().collect::<Option<_>>()?;
    for (i, head) in heads.iter().enumerate().filter(|(_, head)| head.level.depends_on_time()) {
        if written.every.is_none() {
            let name = excerpt(&head.name, QUOTED);
            let message = format!(
                "found a level of \"{name}\" that changes in time; expected water.seepage.every as well, the time between solutions, s"
            );
            checks.fault(&path.key("heads").index(i).key("level"), message);
        }
    }
    let permeabilities = file.materials.iter().map(|material| material.permeability.unwrap_or(0.0)).collect();
    Some(Some(Seepage { heads, permeabilities, every: written.every.unwrap_or(f64::INFINITY) }))
}

/// A head that is held, or faults.
fn held<const D: usize>(
    checks: &mut Checks,
    written: &schema::Head,
    space: &Space<D>,
    path: &Path,
) -> Option<HeldHead<D>> {
    let region = match (written.face, &written.shape) {
        (Some(face), None) if face.axis_and_side().0 >= D => {
            let message = "found a face along z in a 2D job; expected a face along x or y";
            checks.fault(&path.key("face"), message.into());
            return None;
        }
        (Some(face), None) => {
            let (axis, side) = face.axis_and_side();
            HeldRegion::Face { axis, side }
        }
        (None, Some(shape)) => HeldRegion::Shape(checks.shape(shape, space, &path.key("shape"))?),
        (face, _) => {
            let found = if face.is_some() { "both `face` and `shape`" } else { "neither `face` nor `shape`" };
            checks.fault(path, format!("found {found}; expected one of them: where the head is held"));
            return None;
        }
    };
    let level = at_nodes::<D>(checks, &written.level, &path.key("level"))?;
    Some(HeldHead { name: written.name.clone(), region, level })
}

/// Faults of the permeabilities of materials.
fn permeabilities(checks: &mut Checks, file: &JobFile, path: &Path) {
    let seeps = file.water.as_ref().is_some_and(|water| water.seepage.is_some());
    for (index, material) in file.materials.iter().enumerate() {
        if seeps == material.permeability.is_some() {
            continue;
        }
        let name = excerpt(&material.name, QUOTED);
        let message = match seeps {
            true => format!(
                "found no permeability of \"{name}\" in a job with seepage; expected `permeability`, m/s, of each material, such as 1e-5 for sand and 1e-12 for concrete"
            ),
            false => "found it in a job without seepage; expected [water] with `seepage`, or none".to_owned(),
        };
        let here = path.index(index);
        checks.fault(&if seeps { here } else { here.key("permeability") }, message);
    }
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
