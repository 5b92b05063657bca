//! Colliders that deform: a mesh for each of several times.
use crate::geometry::Shape;
use crate::geometry::mesh::{Deforming, Mismatch};
use crate::geometry::written::Shape as Written;
use crate::job::convert::checks::{Checks, Space};
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::job::schema::conditions::colliders::Frames;
use crate::text::excerpt;

/// The surface through the mesh of the collider's shape and those of its frames.
pub(super) fn deforming<const D: usize>(
    checks: &mut Checks,
    shape: &Shape<D>,
    frames: &Frames,
    (written, takes_sheets): (&Written, bool),
    space: &Space<D>,
    path: &Path,
) -> Option<Deforming> {
    let here = path.key("frames");
    let (Shape::Mesh(first), Written::Mesh { .. }) = (shape, written) else {
        checks.fault(&here, "found frames for a shape that is not a mesh; expected `kind = \"mesh\"`".into());
        return None;
    };
    let mut meshes = vec![first.clone()];
    for (number, file) in frames.files.iter().enumerate() {
        let path = here.key("files").index(number);
        checks.takes_sheets = takes_sheets;
        let mesh = checks.mesh(written, file, space, [&path, &path]);
        checks.takes_sheets = false;
        meshes.push(mesh?);
    }
    let made = Deforming::new(meshes, frames.every);
    if let Err(Mismatch { mesh, found, expected }) = made {
        let path = here.key("files").index(mesh - 1);
        let message = format!(
            "\"{}\": found {} vertices and {} triangles; expected the {} and {} of the mesh of `shape`, in the same order",
            excerpt(&frames.files[mesh - 1], QUOTED),
            found[0],
            found[1],
            expected[0],
            expected[1]
        );
        checks.fault(&path, message);
    }
    made.ok()
}
