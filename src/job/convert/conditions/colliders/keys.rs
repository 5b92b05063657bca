//! Keys that several motions have.
use crate::geometry::written::Vector;
use crate::job::convert::checks::Checks;
use crate::job::parse::source::Path;
use crate::job::schema::common::AxisName;

/// The axis of rotations in a plane.
pub(super) const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// A vector, or 0 where none is given.
pub(super) fn optional<const D: usize>(
    checks: &mut Checks,
    vector: Option<&Vector>,
    path: &Path,
) -> Option<[f64; D]> {
    vector.map_or(Some([0.0; D]), |vector| checks.vector(vector, path))
}

/// Which axes a list names.
pub(super) fn allowed<const D: usize>(
    checks: &mut Checks,
    along: Option<&[AxisName]>,
    path: &Path,
) -> Option<[bool; D]> {
    let Some(names) = along else { return Some([true; D]) };
    let mut allowed = [false; D];
    for (i, name) in names.iter().enumerate() {
        let axis = match name {
            AxisName::X => 0,
            AxisName::Y => 1,
            AxisName::Z => 2,
        };
        match allowed.get_mut(axis) {
            None => {
                checks.fault(&path.index(i), "found \"z\"; expected \"x\" or \"y\" in a 2D job".into());
                return None;
            }
            Some(allowed) => *allowed = true,
        }
    }
    Some(allowed)
}
