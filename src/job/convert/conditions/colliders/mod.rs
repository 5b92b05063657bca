//! Colliders of the job file to those of the solver.
//!
//! | file | subject |
//! |---|---|
//! | `free_bodies` | colliders that move by themselves |
//! | `deforming` | meshes in time |
//! | `records` | tables of motion, also from files |
//! | this | the others, and their motion |
mod deforming;
mod free_bodies;
mod keys;
mod records;

use self::free_bodies::free_body;
use self::keys::{Z, optional};
use crate::boundary::motion::{Motion, Rate, Table};
use crate::boundary::{ActsOn, Collider, Contact};
use crate::geometry::{Aabb, Shape, common_point};
use crate::job::convert::checks::{Checks, Space};
use crate::job::parse::source::Path;
use crate::job::schema::common::Spin;
use crate::job::schema::conditions::colliders::{
    ActsOn as WrittenActsOn, Contact as WrittenContact, Motion as Written,
};
use crate::job::schema::job_file as file;

/// Most colliders of a job: the header of a checkpoint has limited room.
const MAX_COLLIDERS: usize = 16;
/// Most boxes in which a point of a shape is searched.
const MOST_BOXES: usize = 10_000;

/// All colliders, or faults.
pub(in crate::job::convert) fn colliders<const D: usize>(
    checks: &mut Checks,
    colliders: &[file::Collider],
    space: &Space<D>,
    path: &Path,
) -> Option<Vec<Collider<D>>> {
    if colliders.len() > MAX_COLLIDERS {
        checks.fault(path, format!("found {} colliders; expected at most {MAX_COLLIDERS}", colliders.len()));
        return None;
    }
    let mut all = Vec::new();
    for (i, written) in colliders.iter().enumerate() {
        let here = path.index(i);
        checks.column_name(&written.name, colliders[..i].iter().map(|other| &*other.name), &here.key("name"));
        all.push(collider(checks, written, space, &here));
    }
    all.into_iter().collect()
}

fn collider<const D: usize>(
    checks: &mut Checks,
    written: &file::Collider,
    space: &Space<D>,
    path: &Path,
) -> Option<Collider<D>> {
    let is_free = matches!(written.motion, Some(Written::Free { .. }));
    let here = path.key("motion");
    let motion = if is_free { None } else { motion::<D>(checks, written.motion.as_ref(), &here) };
    let here = path.key("shape");
    let acts_on = match written.acts_on {
        None | Some(WrittenActsOn::Nodes) => ActsOn::Nodes,
        Some(WrittenActsOn::Particles) => ActsOn::Particles,
    };
    // Sheets have two sides for particles, and no node inside.
    checks.takes_sheets = acts_on == ActsOn::Particles;
    let shape = checks.shape(&written.shape, space, &here);
    let takes_sheets = std::mem::take(&mut checks.takes_sheets);
    let shape = shape?;
    let bounds = shape.bounds();
    let is_empty = match takes_sheets {
        true => (0..D).any(|a| bounds.lower[a] > bounds.upper[a]),
        false => bounds.is_empty(),
    };
    if is_empty || (!takes_sheets && has_no_point(&shape, &bounds)) {
        checks.fault(&here, "found a shape without a point; expected one with a volume".into());
        return None;
    }
    let mut reference = match &written.reference {
        Some(point) => Some(checks.point(point, space, &path.key("reference"))?),
        None => None,
    };
    let (motion, axis) = match &written.motion {
        Some(motion) if is_free => {
            let paths = [&path.key("motion"), path];
            let (free, axis, centre) = free_body(checks, motion, &shape, reference.as_ref(), paths)?;
            reference = reference.or(centre);
            (Motion::Free(free), axis)
        }
        _ => motion?,
    };
    let reference = reference.unwrap_or_else(|| centre(&bounds, space));
    let contact = match written.contact {
        None => Contact::default(),
        Some(WrittenContact::Sticky {}) => Contact::Sticky,
        Some(WrittenContact::Slip {}) => Contact::Slip,
        Some(WrittenContact::Separating { friction, cohesion, turbulent_friction }) => {
            Contact::Separating { friction, cohesion, drag: Contact::drag_of(turbulent_friction) }
        }
    };
    let deforming = match &written.frames {
        Some(frames) => {
            Some(deforming::deforming(checks, &shape, frames, (&written.shape, takes_sheets), space, path)?)
        }
        None => None,
    };
    Some(Collider {
        name: written.name.clone(),
        shape,
        deforming,
        reference,
        axis,
        contact,
        acts_on,
        motion,
        start: 0.0,
    })
}

/// Whether a bounded boolean shape is empty. One that is thinner than a millionth of its size, or takes too
/// long to test, passes.
fn has_no_point<const D: usize>(shape: &Shape<D>, bounds: &Aabb<D>) -> bool {
    let size = (0..D).map(|a| bounds.upper[a] - bounds.lower[a]).fold(0.0, f64::max);
    let mut boxes = MOST_BOXES;
    matches!(shape, Shape::Difference(..) | Shape::Intersection(_))
        && size.is_finite()
        && common_point([shape; 2], *bounds, 1e-6 * size, &mut boxes).is_none()
        && boxes > 0
}

/// The centre of a box, along each axis cut by the domain where it is unbounded.
fn centre<const D: usize>(bounds: &Aabb<D>, space: &Space<D>) -> [f64; D] {
    std::array::from_fn(|a| {
        let (low, high) = (bounds.lower[a], bounds.upper[a]);
        match (low.is_finite(), high.is_finite()) {
            (true, true) => 0.5 * (low + high),
            (true, false) => 0.5 * (low + space.size[a].max(low)),
            (false, true) => 0.5 * high.max(0.0),
            (false, false) => 0.5 * space.size[a],
        }
    })
}

/// A motion with its axis.
fn motion<const D: usize>(
    checks: &mut Checks,
    motion: Option<&Written>,
    path: &Path,
) -> Option<(Motion<D>, [f64; 3])> {
    match motion {
        None | Some(Written::Fixed {}) => Some((Motion::Fixed, Z)),
        Some(Written::Steady { velocity, angular_velocity, ramp }) => {
            let steady = |rate| match ramp {
                Some(span) => Motion::Rising(rate, *span),
                None => Motion::Steady(rate),
            };
            let velocity = optional(checks, velocity.as_ref(), &path.key("velocity"))?;
            let spin = match (angular_velocity, D) {
                (None, _) => [0.0; 3],
                (Some(Spin::Plane(spin)), 2) => [0.0, 0.0, *spin],
                (Some(Spin::Space(spin)), 3) => *spin,
                (Some(given), _) => {
                    let (found, expected) = match given {
                        Spin::Plane(_) => ("a number", "an array of 3 components in a 3D job"),
                        Spin::Space(_) => ("an array", "a number (about z) in a 2D job"),
                    };
                    let message = format!("found {found}; expected {expected}");
                    checks.fault(&path.key("angular_velocity"), message);
                    return None;
                }
            };
            if D == 2 {
                return Some((steady(Rate::about_axis(velocity, spin[2])), Z));
            }
            let speed = spin.iter().fold(0.0, |sum: f64, c| c.mul_add(*c, sum)).sqrt();
            let axis = if speed > 0.0 { spin.map(|c| c / speed) } else { Z };
            Some((steady(Rate::about_axis(velocity, speed)), axis))
        }
        Some(Written::Table { axis, rows, record, smooth }) => {
            let axis = checks.turning_axis::<D>(axis.as_ref(), &path.key("axis"));
            let rows = records::rows::<D>(checks, rows.as_deref(), record.as_ref(), path);
            let table = rows.map(|rows| Table { is_smooth: *smooth, ..rows });
            Some((Motion::Table(table?), axis?))
        }
        // With the shape: see `free_body`.
        Some(Written::Free { .. }) => None,
    }
}
