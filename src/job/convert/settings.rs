//! From the file's types to a checked problem: faces, numerics, output.
use super::checks::Checks;
use super::conditions::quantities::at_nodes;
use crate::boundary::Absorbing;
use crate::boundary::absorbing::AbsorbingFaces;
use crate::checksum::fnv1a;
use crate::job::parse::source::Path;
use crate::job::problem::*;
use crate::job::schema::job_file::{self as file, JobFile};
use crate::job::schema::output::Output;
use crate::material::Viscosity;
use crate::particle::followed::{Followed, Motion};
use crate::quantity::FACES;
use crate::text::{number, written};

/// Most output files of one run.
const MAX_OUTPUTS: f64 = 100_000.0;

/// Conditions on those faces of the domain that are named.
pub(in crate::job) fn faces<const D: usize>(
    checks: &mut Checks,
    boundaries: &file::Boundaries,
    path: &Path,
) -> Option<[[Option<Contact>; 2]; D]> {
    let file::Boundaries { x_min, x_max, y_min, y_max, z_min, z_max, .. } = boundaries;
    if D == 2 {
        for (key, face) in [("z_min", z_min), ("z_max", z_max)] {
            if face.is_some() {
                checks
                    .fault(&path.key(key), "found a face along z; expected only x and y in a 2D job".into());
                return None;
            }
        }
    }
    let condition = |face: &file::Face| match face {
        file::Face::Slip {} => Contact::Slip,
        file::Face::Sticky {} => Contact::Sticky,
        file::Face::Separating { friction, cohesion, turbulent_friction } => Contact::Separating {
            friction: *friction,
            cohesion: *cohesion,
            drag: Contact::drag_of(*turbulent_friction),
        },
        file::Face::Symmetric {} => Contact::Symmetric,
        file::Face::Outflow {} => Contact::Outflow,
        file::Face::Absorbing { .. } => Contact::Absorbing,
    };
    let all = [[x_min, x_max], [y_min, y_max], [z_min, z_max]];
    Some(std::array::from_fn(|a| all[a].map(|face| face.as_ref().map(condition))))
}

/// Material beyond each face that absorbs waves.
pub(in crate::job) fn absorbing<const D: usize>(
    checks: &mut Checks,
    boundaries: &file::Boundaries,
    path: &Path,
) -> Option<AbsorbingFaces<D>> {
    let file::Boundaries { x_min, x_max, y_min, y_max, z_min, z_max, .. } = boundaries;
    let all = [[x_min, x_max], [y_min, y_max], [z_min, z_max]];
    let mut sides: AbsorbingFaces<D> = std::array::from_fn(|_| [None, None]);
    for (axis, side) in (0..D).flat_map(|axis| [(axis, 0), (axis, 1)]) {
        if let Some(file::Face::Absorbing { p_speed, s_speed, density, pressure }) = all[axis][side] {
            let key = FACES[axis][side];
            let pressure = at_nodes::<D>(checks, pressure, &path.key(key).key("pressure"))?;
            let face = Absorbing { p_speed: *p_speed, s_speed: *s_speed, density: *density, pressure };
            sides[axis][side] = Some(Box::new(face));
        }
    }
    Some(sides)
}

/// Treatment of particles that leave the domain.
pub(in crate::job) fn leaving(written: file::Leaving) -> LeavingPolicy {
    match written {
        file::Leaving::Error => LeavingPolicy::Error,
        file::Leaving::Delete => LeavingPolicy::Delete,
        file::Leaving::Clamp => LeavingPolicy::Clamp,
    }
}

/// Transfer and box policy.
pub(in crate::job) fn numerics(
    checks: &mut Checks,
    numerics: &file::Numerics,
    path: &Path,
) -> (Transfer, BoxPolicy) {
    if let (Some(_), false) = (numerics.flip, numerics.transfer == file::Transfer::Flip) {
        checks.fault(
            &path.key("flip"),
            "found a share of FLIP; expected `flip` only with transfer = \"flip\"".into(),
        );
    }
    if numerics.xpic_order.is_some() && numerics.transfer != file::Transfer::Xpic {
        checks.fault(
            &path.key("xpic_order"),
            "found an order of XPIC; expected `xpic_order` only with transfer = \"xpic\"".into(),
        );
    }
    let transfer = match numerics.transfer {
        file::Transfer::Apic => Transfer::Apic,
        file::Transfer::Flip => Transfer::Flip { blend: numerics.flip.unwrap_or(0.99) },
        file::Transfer::Tpic => Transfer::Tpic,
        file::Transfer::Xpic => Transfer::Xpic { order: numerics.xpic_order.unwrap_or(2) },
    };
    let here = path.key("box_stretch");
    if numerics.box_stretch.is_some() && numerics.boxes != file::Boxes::Volume {
        checks.fault(
            &here,
            "found bounds of the stretch; expected `box_stretch` only with boxes = \"volume\"".into(),
        );
    }
    let [min_stretch, max_stretch] = numerics.box_stretch.unwrap_or([0.25, 2.0]);
    if min_stretch <= 0.0 || min_stretch > 1.0 || !(1.0..=8.0).contains(&max_stretch) {
        checks.fault(
            &here,
            format!(
                "found [{}, {}]; expected a lower bound above 0 and at most 1 and an upper one from 1 to 8",
                written(min_stretch),
                written(max_stretch)
            ),
        );
    }
    let boxes = match numerics.boxes {
        file::Boxes::Volume => BoxPolicy::Volume { min_stretch, max_stretch },
        file::Boxes::Fixed => BoxPolicy::Fixed,
        file::Boxes::Cell => BoxPolicy::Cell,
    };
    (transfer, boxes)
}

/// Artificial viscosity.
pub(in crate::job) fn viscosity(numerics: &file::Numerics) -> Option<Viscosity> {
    let file::ArtificialViscosity { linear, quadratic } = numerics.artificial_viscosity?;
    (linear > 0.0 || quadratic > 0.0).then_some(Viscosity { linear, quadratic })
}

/// Output files.
pub(in crate::job) fn output(checks: &mut Checks, file: &JobFile, name: &str, path: &Path) -> OutputSetup {
    let output = &file.output;
    let directory = match output.directory.as_deref() {
        Some(directory) if directory.trim().is_empty() => {
            checks.fault(
                &path.key("directory"),
                "found an empty string; expected the name of a directory".into(),
            );
            String::new()
        }
        Some(directory) => directory.to_owned(),
        None => format!("out/{name}"),
    };
    if let Some(every) = output.every.filter(|every| file.time.end / every > MAX_OUTPUTS) {
        checks.fault(
            &path.key("every"),
            format!(
                "found {}; expected at least {}, for at most {MAX_OUTPUTS} outputs until time.end",
                written(every),
                // Rounded, but not down.
                number(1.001 * file.time.end / MAX_OUTPUTS, 4)
            ),
        );
    }
    let has_water =
        file.water.is_some() || file.materials.iter().any(|material| material.undrained.is_some());
    for (i, field) in output.chosen().iter().enumerate() {
        if output.chosen()[..i].contains(field) {
            checks.fault(
                &path.key("fields").index(i),
                "found a field a second time; expected each once".into(),
            );
        }
        if *field == Field::ContactPressure && file.contact.is_empty() {
            checks.fault(
                &path.key("fields").index(i),
                "found \"contact_pressure\" without contact; expected [[contact]] between bodies".into(),
            );
        }
    }
    OutputSetup {
        directory: directory.into(),
        every: output.every,
        fields: output.fields(has_water),
        followed: followed(output),
        restart: output.restart,
        picture: output.picture,
        picture_field: output.picture_field,
        report: output.report,
    }
}

/// Quantities that particles carry for the fields of the output.
pub(super) fn followed(output: &Output) -> Followed {
    let motion = match output.has_any(&[Field::Strain, Field::EquivalentStrain]) {
        true => Motion::Strain,
        false if output.has_any(&[Field::Displacement]) => Motion::Displacement,
        false => Motion::Nothing,
    };
    Followed { motion, contact_pressure: output.has_any(&[Field::ContactPressure]), ..Followed::default() }
}

/// The part of a job that decides the state.
pub(in crate::job) fn deciding(file: &JobFile) -> JobFile {
    let mut state = file.clone();
    state.title.clear();
    state.output = file::Output::default();
    state.checkpoint = file::Checkpoint::default();
    state.history = file::History::default();
    state.probes.clear();
    state.tracks.clear();
    state.fluxes.clear();
    state.lines.clear();
    state.maps.clear();
    state.telemetry = file::Telemetry::default();
    state.time.end = 0.0;
    state
}

/// Checksum (64-bit FNV-1a) of the keys that decide the state, from the file with all defaults filled in.
pub(in crate::job) fn digest(file: &JobFile) -> u64 {
    let state = deciding(file);
    // Field order and shortest round-trip numbers make the text canonical.
    let text = serde_json::to_string(&state).unwrap_or_else(|_| format!("{state:?}"));
    fnv1a(text.bytes().map(u64::from))
}

/// The condition on a face of the domain, where the job names one.
pub(super) fn face(boundaries: &file::Boundaries, axis: usize, side: usize) -> Option<&file::Face> {
    let file::Boundaries { x_min, x_max, y_min, y_max, z_min, z_max, .. } = boundaries;
    [[x_min, x_max], [y_min, y_max], [z_min, z_max]][axis][side].as_ref()
}

/// Whether a face of the domain is a plane of symmetry.
pub(super) fn is_symmetric(boundaries: &file::Boundaries, axis: usize, side: usize) -> bool {
    matches!(face(boundaries, axis, side), Some(file::Face::Symmetric {}))
}

/// Whether material leaves through a face of the domain.
pub(super) fn is_outflow(boundaries: &file::Boundaries, axis: usize, side: usize) -> bool {
    matches!(face(boundaries, axis, side), Some(file::Face::Outflow {}))
}
