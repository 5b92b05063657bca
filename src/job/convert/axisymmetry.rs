//! Axisymmetric jobs: what they cannot have.
//!
//! Some settings have no meaning for bodies of revolution, such as gravity across the axis; the others act on
//! planar sections only so far. Each is refused by name, all in one list; `docs/design/axisymmetry.md` has
//! the reasons.
use super::checks::Checks;
use crate::boundary::Collider as Solid;
use crate::geometry::written::Shape;
use crate::job::parse::source::Path;
use crate::job::problem::{Coordinates, Field};
use crate::job::schema::common::{AxisName, Spin};
use crate::job::schema::conditions::colliders::{Collider, Motion, MotionRecord, Row};
use crate::job::schema::job_file::{self as file, Boundaries, Face, Geometry, JobFile, Quantity};
use crate::job::schema::probes::FaceName;

/// Coordinates of a job.
pub(super) fn coordinates(checks: &mut Checks, file: &JobFile) -> Coordinates {
    if file.geometry.is_some() && file.dimension != 2 {
        let message = "found a geometry in a 3D job; expected `geometry` only with dimension = 2";
        checks.fault(&Path::default().key("geometry"), message.into());
    }
    match file.geometry {
        Some(Geometry::Axisymmetric) => Coordinates::Axisymmetric,
        Some(Geometry::PlaneStrain) | None => Coordinates::Cartesian,
    }
}

/// The job with the axis as a plane of symmetry, which it is without a key.
pub(super) fn with_axis(file: &JobFile) -> JobFile {
    let mut file = file.clone();
    file.boundaries.x_min.get_or_insert(Face::Symmetric {});
    file
}

/// Adds faults for all that an axisymmetric job cannot have.
pub(super) fn check<const D: usize>(checks: &mut Checks, file: &JobFile, colliders: &[Solid<D>]) {
    let root = Path::default();
    let mut refuse = checks.refuse_in("an axisymmetric job");
    let starts = file.domain.min.as_ref().and_then(|min| min.0.first()).is_some_and(|&x| x != 0.0);
    refuse(
        starts,
        root.key("domain").key("min").index(0),
        "a lower end off the axis",
        "0: the axis is x = 0",
    );
    let gravities =
        file.stages.iter().enumerate().map(|(i, stage)| (root.key("stages").index(i), &stage.gravity));
    for (path, gravity) in std::iter::once((root.clone(), &file.gravity)).chain(gravities) {
        let radial = gravity.as_ref().and_then(|gravity| gravity.first()).is_some_and(|x| !is_zero(x));
        refuse(
            radial,
            path.key("gravity").index(0),
            "gravity across the axis",
            "0: gravity acts along the axis, y",
        );
    }
    let changed = file.stages.iter().enumerate().filter_map(|(i, stage)| {
        Some((root.key("stages").index(i).key("boundaries"), stage.boundaries.as_ref()?))
    });
    for (path, boundaries) in std::iter::once((root.key("boundaries"), &file.boundaries)).chain(changed) {
        faces(boundaries, &path, &mut refuse);
    }
    for (i, body) in file.bodies.iter().enumerate() {
        let here = root.key("bodies").index(i);
        refuse(
            body.angular_velocity.is_some(),
            here.key("angular_velocity"),
            "a rotation",
            "none: material moves along the radius and the axis only",
        );
        refuse(
            matches!(body.shape, Shape::Particles { .. }),
            here.key("shape").key("kind"),
            "particles from a file",
            "a shape",
        );
        refuse(
            body.particles_per_cell < 1.0,
            here.key("particles_per_cell"),
            "less than one particle per cell",
            "at least 1",
        );
    }
    for (i, collider) in file.colliders.iter().enumerate() {
        self::collider(collider, &root.key("colliders").index(i), &mut refuse);
    }
    for (i, collider) in colliders.iter().enumerate() {
        // Its surface there would hold material back.
        refuse(
            collider.shape.bounds().lower[0].abs() < 1e-9 * file.domain.root_edge,
            root.key("colliders").index(i).key("shape"),
            "a collider that ends on the axis",
            "one that continues beyond it, to x < 0, as its mirror image",
        );
    }
    let numerics = root.key("numerics");
    refuse(
        file.numerics.boxes == file::Boxes::Fixed,
        numerics.key("boxes"),
        "\"fixed\"",
        "\"volume\" or \"cell\"",
    );
    refuse(file.numerics.tied_surfaces == Some(true), numerics.key("tied_surfaces"), "tied surfaces", "none");
    let heads =
        file.water.iter().filter_map(|water| water.seepage.as_ref()).flat_map(|seepage| &seepage.heads);
    for (i, head) in heads.enumerate() {
        refuse(
            matches!(head.face, Some(FaceName::XMin)),
            root.key("water").key("seepage").key("heads").index(i).key("face"),
            "a head on the axis",
            "another face or a shape: a well about the axis has a radius",
        );
    }
    for (i, source) in file.sources.iter().enumerate() {
        let across = source.velocity.0.first().is_some_and(|&x| x != 0.0);
        refuse(
            across,
            root.key("sources").index(i).key("velocity").index(0),
            "a source across the axis",
            "0: rings that move along the radius do not keep their volume at one velocity",
        );
    }
    for (i, field) in file.output.chosen().iter().enumerate() {
        refuse(
            matches!(field, Field::Strain | Field::EquivalentStrain),
            root.key("output").key("fields").index(i),
            "total strains",
            "other fields, such as \"displacement\" or \"plastic_strain\"",
        );
    }
}

fn is_zero(quantity: &Quantity) -> bool {
    *quantity == Quantity::Number(0.0)
}

/// Conditions on faces.
fn faces(
    boundaries: &Boundaries,
    path: &Path,
    refuse: &mut impl FnMut(bool, Path, &'static str, &'static str),
) {
    let Boundaries { x_min, x_max, y_min, y_max, .. } = boundaries;
    refuse(
        x_min.as_ref().is_some_and(|face| !matches!(face, Face::Symmetric {})),
        path.key("x_min"),
        "a condition on the axis",
        "none: the radial velocity is 0 there without a key",
    );
    for (key, face) in [("x_max", x_max), ("y_min", y_min), ("y_max", y_max)] {
        let absorbs = matches!(face, Some(Face::Absorbing { .. }));
        refuse(absorbs, path.key(key).key("kind"), "an absorbing face", "another kind");
    }
}

/// Colliders are bodies of revolution, which move along the axis.
fn collider(
    collider: &Collider,
    path: &Path,
    refuse: &mut impl FnMut(bool, Path, &'static str, &'static str),
) {
    let along = "a motion along the axis, y, without rotation";
    let here = path.key("motion");
    match &collider.motion {
        None | Some(Motion::Fixed {}) => {}
        Some(Motion::Steady { velocity, angular_velocity, .. }) => {
            let turns = !matches!(angular_velocity, None | Some(Spin::Plane(0.0)));
            let across = velocity.as_ref().and_then(|v| v.0.first()).is_some_and(|&x| x != 0.0);
            refuse(across, here.key("velocity").index(0), "a motion across the axis", along);
            refuse(turns, here.key("angular_velocity"), "a rotation", along);
        }
        Some(Motion::Table { rows, record, .. }) => {
            refuse_rows(rows.as_deref(), record.as_ref(), &here, refuse)
        }
        Some(Motion::Free {
            along: free, density, turns, inertia, angular_velocity, rows, record, ..
        }) => {
            let is_along = free.as_deref().is_some_and(|axes| axes.iter().all(|axis| *axis == AxisName::Y));
            refuse(!is_along, here.key("along"), "a free body that moves across the axis", "along = [\"y\"]");
            let whole = "`mass`, of the whole body of revolution";
            refuse(density.is_some(), here.key("density"), "a free body by its density", whole);
            refuse(*turns == Some(true), here.key("turns"), "a rotation", along);
            refuse(inertia.is_some(), here.key("inertia"), "a rotation", along);
            refuse(angular_velocity.is_some(), here.key("angular_velocity"), "a rotation", along);
            refuse_rows(rows.as_deref(), record.as_ref(), &here, refuse);
        }
    }
}

/// A table of motions, which lead along the axis.
fn refuse_rows(
    rows: Option<&[Row]>,
    record: Option<&MotionRecord>,
    path: &Path,
    refuse: &mut impl FnMut(bool, Path, &'static str, &'static str),
) {
    let along = "a motion along the axis, y, without rotation";
    let is_along = |row: &Row| {
        let across = row.translation.as_ref().and_then(|x| x.0.first()).is_some_and(|&x| x != 0.0);
        !across && row.rotation == 0.0
    };
    let row = rows.into_iter().flatten().position(|row| !is_along(row));
    refuse(row.is_some(), path.key("rows").index(row.unwrap_or(0)), "a motion across the axis", along);
    let across = record.is_some_and(|record| record.x.is_some() || record.rotation.is_some());
    refuse(across, path.key("record"), "a motion across the axis", along);
}
