//! Measurements of the job file to those of the program.
use super::checks::{Checks, Space};
use crate::geometry::written::Vector;
use crate::job::parse::source::Path;
use crate::job::schema::job_file::JobFile;
use crate::job::schema::probes::{Flux as Written, Probe as WrittenProbe};
use crate::probe::{Flux, Line, Map, Probe, Section, Track};

/// Most cells of a raster.
const MOST_CELLS: f64 = 1e6;

/// All probes, or faults.
pub(super) fn probes<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    space: &Space<D>,
    path: &Path,
) -> Option<Vec<Probe<D>>> {
    let mut all = Vec::new();
    for (i, written) in file.probes.iter().enumerate() {
        let here = path.index(i);
        let before = file.probes[..i].iter().map(|probe| &*probe.name);
        checks.column_name(&written.name, before, &here.key("name"));
        each_once(checks, &written.quantities, &here.key("quantities"));
        let region = match &written.shape {
            Some(shape) => checks.shape(shape, space, &here.key("shape")).map(Some),
            None => Some(None),
        };
        let bodies = checks.bodies(written.bodies.as_deref(), &file.body_names(), &here.key("bodies"));
        let foot = foot(checks, written, space, &here);
        if let (Some(region), Some(bodies), Some(foot)) = (region, bodies, foot) {
            let quantities = written.quantities.clone();
            all.push(Probe { name: written.name.clone(), region, bodies, quantities, foot });
        }
    }
    (all.len() == file.probes.len()).then_some(all)
}

/// The foot of a deposit, if quantities need it, or a fault.
fn foot<const D: usize>(
    checks: &mut Checks,
    written: &WrittenProbe,
    space: &Space<D>,
    path: &Path,
) -> Option<Option<[f64; D]>> {
    let needs = written.quantities.iter().position(|quantity| quantity.needs_foot());
    match (&written.foot, needs) {
        (None, None) => Some(None),
        (Some(foot), Some(_)) => point_in_domain(checks, foot, space, &path.key("foot")).map(Some),
        (None, Some(k)) => {
            let message = "found a quantity of a deposit without its foot; expected foot = [...], the point on the ground \
                           below its middle";
            checks.fault(&path.key("quantities").index(k), message.into());
            None
        }
        (Some(_), None) => {
            let message = "found a foot that no quantity needs; expected \"run_out\", \"edge\" or \"height\" among \
                           quantities";
            checks.fault(&path.key("foot"), message.into());
            None
        }
    }
}

/// A point of the domain, m from its lower corner, or a fault.
fn point_in_domain<const D: usize>(
    checks: &mut Checks,
    written: &Vector,
    space: &Space<D>,
    path: &Path,
) -> Option<[f64; D]> {
    let point: [f64; D] = checks.point(written, space, path)?;
    let is_inside = (0..D).all(|a| (0.0..=space.size[a]).contains(&point[a]));
    if !is_inside {
        checks.fault(path, format!("found {}; expected a point in the domain", space.words(&point)));
    }
    is_inside.then_some(point)
}

/// All tracks, or faults.
pub(super) fn tracks<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    space: &Space<D>,
    path: &Path,
) -> Option<Vec<Track<D>>> {
    let mut all = Vec::new();
    for (i, written) in file.tracks.iter().enumerate() {
        let here = path.index(i);
        // Columns of probes have names of the same form.
        let before = file.tracks[..i].iter().map(|track| &*track.name);
        let before = before.chain(file.probes.iter().map(|probe| &*probe.name));
        checks.column_name(&written.name, before, &here.key("name"));
        each_once(checks, &written.quantities, &here.key("quantities"));
        if let Some(k) = written.quantities.iter().position(|quantity| quantity.needs_foot()) {
            let message =
                "found a quantity of a deposit; expected it in probes only: a track follows a particle";
            checks.fault(&here.key("quantities").index(k), message.into());
        }
        let point = checks.point(&written.point, space, &here.key("point"));
        let bodies = checks.bodies(written.bodies.as_deref(), &file.body_names(), &here.key("bodies"));
        if let (Some(point), Some(bodies)) = (point, bodies) {
            let quantities = written.quantities.clone();
            all.push(Track { name: written.name.clone(), point, bodies, quantities });
        }
    }
    (all.len() == file.tracks.len()).then_some(all)
}

/// All fluxes, or faults.
pub(super) fn fluxes<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    space: &Space<D>,
    path: &Path,
) -> Option<Vec<Flux>> {
    let mut all = Vec::new();
    for (i, written) in file.fluxes.iter().enumerate() {
        let here = path.index(i);
        let before = file.fluxes[..i].iter().map(|flux| &*flux.name);
        checks.column_name(&written.name, before, &here.key("name"));
        let section = match (&written.point, &written.normal, written.face) {
            (Some(point), Some(normal), None) => {
                let point = checks.point::<D>(point, space, &here.key("point"));
                let normal = checks.direction::<D>(normal, &here.key("normal"));
                let in_space =
                    |vector: [f64; D]| std::array::from_fn(|a| if a < D { vector[a] } else { 0.0 });
                let opening = opening(checks, written, space, &here);
                point.zip(normal).zip(opening).map(|((point, normal), opening)| {
                    let (point, normal) = (in_space(point), in_space(normal));
                    match opening {
                        None => Section::Plane { point, normal },
                        Some(bounds) => Section::Opening { point, normal, bounds: bounds.map(in_space) },
                    }
                })
            }
            (None, None, Some(_)) if written.min.is_some() || written.max.is_some() => {
                let key = if written.min.is_some() { "min" } else { "max" };
                let message = "found a box at a face of the domain; expected a box at a plane only, with point and normal";
                checks.fault(&here.key(key), message.into());
                None
            }
            (None, None, Some(face)) => {
                let (axis, side) = face.axis_and_side();
                Some(Section::Face { axis, side })
            }
            _ => {
                let message =
                    "expected either a plane, point = [...] and normal = [...], or face = \"y_min\"";
                let found = if written.face.is_some() {
                    "a face and a plane"
                } else {
                    "neither a complete plane nor a face"
                };
                checks.fault(&here, format!("found {found}; {message}"));
                None
            }
        };
        all.extend(section.map(|section| Flux { name: written.name.clone(), section }));
    }
    (all.len() == file.fluxes.len()).then_some(all)
}

/// The box of an opening, if there is one, or a fault.
fn opening<const D: usize>(
    checks: &mut Checks,
    written: &Written,
    space: &Space<D>,
    path: &Path,
) -> Option<Option<[[f64; D]; 2]>> {
    let (min, max) = match (&written.min, &written.max) {
        (None, None) => return Some(None),
        (Some(min), Some(max)) => (min, max),
        (min, _) => {
            let (found, other) = if min.is_some() { ("min", "max") } else { ("max", "min") };
            let message = format!("found {found} without {other}; expected both corners of a box");
            checks.fault(&path.key(found), message);
            return None;
        }
    };
    let min = checks.point::<D>(min, space, &path.key("min"))?;
    let max = checks.point::<D>(max, space, &path.key("max"))?;
    if let Some(axis) = (0..D).find(|&axis| min[axis] > max[axis]) {
        let message = format!(
            "found a box with its upper corner below its lower one along {}; expected max beyond min",
            ["x", "y", "z"][axis]
        );
        checks.fault(&path.key("max"), message);
        return None;
    }
    Some(Some([min, max]))
}

/// All lines, or faults.
pub(super) fn lines<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    space: &Space<D>,
    path: &Path,
) -> Option<Vec<Line<D>>> {
    let mut all = Vec::new();
    for (i, written) in file.lines.iter().enumerate() {
        let here = path.index(i);
        let before = file.lines[..i].iter().map(|line| &*line.name);
        checks.column_name(&written.name, before, &here.key("name"));
        each_once(checks, &written.quantities, &here.key("quantities"));
        let ends = [("from", &written.from), ("to", &written.to)]
            .map(|(key, end)| point_in_domain::<D>(checks, end, space, &here.key(key)));
        let bodies = checks.bodies(written.bodies.as_deref(), &file.body_names(), &here.key("bodies"));
        if let ([Some(from), Some(to)], Some(bodies)) = (ends, bodies) {
            let last = f64::from(written.points - 1);
            let point = |k: u32| {
                let part = f64::from(k) / last;
                std::array::from_fn(|a| (1.0 - part).mul_add(from[a], part * to[a]))
            };
            let points = (0..written.points).map(point).collect();
            let quantities = written.quantities.clone();
            all.push(Line { name: written.name.clone(), points, bodies, quantities });
        }
    }
    (all.len() == file.lines.len()).then_some(all)
}

/// All maps, or faults.
pub(super) fn maps<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    space: &Space<D>,
    path: &Path,
) -> Option<Vec<Map>> {
    let mut all = Vec::new();
    for (i, written) in file.maps.iter().enumerate() {
        let here = path.index(i);
        let before = file.maps[..i].iter().map(|map| &*map.name);
        checks.column_name(&written.name, before, &here.key("name"));
        let bodies = checks.bodies(written.bodies.as_deref(), &file.body_names(), &here.key("bodies"));
        let mut corner = |given: &Option<Vec<f64>>, key: &'static str, usual: f64| {
            let Some(given) = given else {
                return Some(std::array::from_fn(|a| if a < D - 1 { usual * space.size[a] } else { 0.0 }));
            };
            if given.len() == D - 1 {
                return Some(std::array::from_fn(
                    |a| if a < D - 1 { given[a] - space.origin[a] } else { 0.0 },
                ));
            }
            let message = format!("found {} coordinates; expected {} in a {D}D job", given.len(), D - 1);
            checks.fault(&here.key(key), message);
            None
        };
        let corners = (corner(&written.min, "min", 0.0), corner(&written.max, "max", 1.0));
        let ((Some(lower), Some(upper)), Some(bodies)) = (corners, bodies) else { continue };
        let (lower, upper): ([f64; 2], [f64; 2]) = (lower, upper);
        // A whole number of cells may miss the corner by rounding.
        let cells =
            |a: usize| if a < D - 1 { ((upper[a] - lower[a]) / written.cell - 1e-9).ceil() } else { 1.0 };
        let size = [cells(0), cells(1)];
        if size[0] < 1.0 || size[1] < 1.0 {
            checks.fault(
                &here.key("max"),
                "found a corner that is not above `min`; expected a greater one".into(),
            );
        } else if size[0] * size[1] > MOST_CELLS {
            let message = format!(
                "found a raster of {} x {} cells; expected at most {MOST_CELLS} cells; use a larger cell",
                size[0], size[1]
            );
            checks.fault(&here.key("cell"), message);
        } else {
            let size = size.map(|cells| cells as usize);
            all.push(Map { name: written.name.clone(), corner: lower, cell: written.cell, size, bodies });
        }
    }
    (all.len() == file.maps.len()).then_some(all)
}

/// Faults for quantities that are named again.
fn each_once<T: PartialEq>(checks: &mut Checks, quantities: &[T], path: &Path) {
    for (k, quantity) in quantities.iter().enumerate() {
        if quantities[..k].contains(quantity) {
            let message = "found a quantity a second time; expected each once";
            checks.fault(&path.index(k), message.into());
        }
    }
}
