//! Parts of bodies in the boxes of their lattice of particles.
//!
//! A box of the lattice that the surface of a body cuts gives a particle with the volume and the centroid of
//! the part of the body in it. Parts below a tenth of a box join a neighbour in their leaf, volume and
//! centroid kept, unless it has none. So the particles of a body have its volume and its centroid, whatever
//! its surface. Bodies whose `sampling` is `fitted` have such particles.
//!
//! The box of a particle is a square, whatever the part that it stands for, so the rim of a body has gaps
//! and overlaps as wide as the boxes there. In the plane, solids that keep their shape have boxes of half
//! the edge along their surface: a quarter of the error of a ring that breathes, with 32 cells over it. In
//! space a ball of 16 cells to its radius would have 1.6 times as many particles. All follows from the body
//! and the leaf alone.
use super::lattice::Lattice;
use crate::geometry::{Aabb, Sampling, Shape, Side};
use crate::job::problem::{Body, Problem};

/// Parts of a box below this share are none, and those that lack no more are whole: they come from rounding
/// of faces that lie on the lattice.
const ROUNDING: f64 = 1e-9;
/// Parts of a box below this share join a neighbour.
const SMALL: f64 = 0.1;
/// Greatest volume of a particle that others have joined, in boxes: its box stays less than a tenth wider.
const MOST: f64 = 1.2;

/// Distance of the centre of a box to the surface up to which it is cut, in edges: its mean extent over all
/// directions of the surface in the plane.
const CUT: f64 = 0.64;
/// Distance of the centre of a box to the surface up to which more than [`SMALL`] of it is inside, in edges.
const LIKELY: f64 = 0.4;

/// A particle that a body has in a leaf.
#[derive(Clone, Debug)]
pub(super) struct Point<const D: usize> {
    /// Place in the lattice.
    pub(super) index: [u64; D],
    /// Centre of the box there, or place of a given particle, m.
    pub(super) x: [f64; D],
    /// Unless the body fills the box.
    pub(super) part: Option<Part<D>>,
    /// Places of parts that have joined this one.
    pub(super) joined: Vec<[u64; D]>,
    /// Edges of the boxes at these places in one of the lattice.
    pub(super) halves: u64,
}

/// Contents of a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Part<const D: usize> {
    /// m³ (m² in the plane).
    pub(super) volume: f64,
    /// m.
    pub(super) centre: [f64; D],
}

impl<const D: usize> Point<D> {
    pub(super) fn at(index: [u64; D], x: [f64; D]) -> Self {
        Self { index, x, part: None, joined: Vec::new(), halves: 1 }
    }

    /// Places of all its boxes in a lattice of boxes with an edge `halves` times in that of the body's.
    pub(super) fn places(&self, halves: u64) -> impl Iterator<Item = [u64; D]> {
        let more = halves / self.halves;
        std::iter::once(&self.index).chain(&self.joined).flat_map(move |index| children(*index, more))
    }
}

/// Whether a body has the parts of its boxes, as its sampling says. Else it has the points of the lattice
/// that it contains, and so do fluids, whose shift of volume takes the small gaps and overlaps of cut boxes
/// for void and excess.
pub(super) fn has_parts<const D: usize>(problem: &Problem<D>, body: &Body<D>) -> bool {
    let material = &problem.materials[body.material];
    matches!(body.sampling, Sampling::Fitted) && !material.build().is_fluid()
}

/// Edges of the boxes along the surface of a body in one of its lattice.
pub(super) fn halves_at_surface<const D: usize>(problem: &Problem<D>, body: &Body<D>) -> u64 {
    let keeps_its_shape = || problem.materials[body.material].build().keeps_its_shape();
    if D == 2 && has_parts(problem, body) && keeps_its_shape() { 2 } else { 1 }
}

/// The boxes along the surface of a body in leaves of a level.
pub(super) fn lattice_at_surface<const D: usize>(
    problem: &Problem<D>,
    level: u8,
    body: &Body<D>,
) -> Lattice<D> {
    Lattice::of(problem, level, body).finer(halves_at_surface(problem, body))
}

/// Places of the boxes that a box is cut into, so many along each axis, in the order of their lattice.
fn children<const D: usize>(index: [u64; D], halves: u64) -> impl Iterator<Item = [u64; D]> {
    let place = move |k: u64, a: usize| k / halves.pow((D - 1 - a) as u32) % halves;
    (0..halves.pow(D as u32)).map(move |k| std::array::from_fn(|a| index[a] * halves + place(k, a)))
}

/// Whether a body has a particle for a box of the lattice, its own or one that its part has joined.
pub(super) fn is_in_box<const D: usize>(shape: &Shape<D>, lattice: &Lattice<D>, index: &[u64; D]) -> bool {
    of_box(shape, lattice, index).is_some()
}

/// The particles of a body in a leaf, in the order of the lattice.
pub(super) fn of_leaf<const D: usize>(
    problem: &Problem<D>,
    body: &Body<D>,
    cell: &Aabb<D>,
    level: u8,
) -> Vec<Point<D>> {
    let Some(lattice) = lattice_of_body(problem, body, level) else { return Vec::new() };
    let mut points = of_boxes(&body.shape, &lattice, lattice.places_in(cell).into_iter());
    let cut: Vec<[u64; D]> =
        points.iter().filter(|point| point.part.is_some()).map(|point| point.index).collect();
    join(&mut points, lattice.volume());
    let halves = halves_at_surface(problem, body);
    if halves == 1 || cut.is_empty() {
        return points;
    }
    let (cut, mut points): (Vec<_>, Vec<_>) =
        points.into_iter().partition(|point| cut.binary_search(&point.index).is_ok());
    let small = lattice.finer(halves);
    let mut places: Vec<[u64; D]> = cut.iter().flat_map(|point| point.places(halves)).collect();
    places.sort_unstable();
    let mut parts = of_boxes(&body.shape, &small, places.into_iter());
    join(&mut parts, small.volume());
    points.extend(parts.into_iter().map(|point| {
        let whole = Part { volume: small.volume(), centre: point.x };
        Point { part: point.part.or(Some(whole)), halves, ..point }
    }));
    points.sort_by_key(|point| point.places(halves).next());
    points
}

/// The parts of a shape in boxes at some places, all in the order of the lattice.
fn of_boxes<const D: usize>(
    shape: &Shape<D>,
    lattice: &Lattice<D>,
    places: impl Iterator<Item = [u64; D]>,
) -> Vec<Point<D>> {
    let points = places.filter_map(|index| {
        let part = of_box(shape, lattice, &index)?;
        Some(Point { part, ..Point::at(index, lattice.centre(&index)) })
    });
    points.collect()
}

/// About as many particles as [`of_leaf`] makes, without the cost of their volumes: those of boxes of which
/// the body has more than a tenth, where its surface is plane.
pub(super) fn likely_of_leaf<const D: usize>(
    problem: &Problem<D>,
    body: &Body<D>,
    cell: &Aabb<D>,
    level: u8,
) -> Vec<Point<D>> {
    let Some(lattice) = lattice_of_body(problem, body, level) else { return Vec::new() };
    let halves = halves_at_surface(problem, body);
    let likely = lattice.places_in(cell).into_iter().flat_map(|index| {
        let distance = || body.shape.distance(&lattice.centre(&index));
        let is_cut = || body.shape.classify(&lattice.cell(&index)) == Side::Crosses;
        let halves = if halves > 1 && distance().abs() < CUT * lattice.edge && is_cut() { halves } else { 1 };
        let boxes = lattice.finer(halves);
        children(index, halves).filter_map(move |index| {
            let x = boxes.centre(&index);
            let outside = Part { volume: 0.0, centre: x };
            (body.shape.distance(&x) < LIKELY * boxes.edge)
                .then(|| Point { part: (!body.shape.contains(&x)).then_some(outside), ..Point::at(index, x) })
        })
    });
    let likely: Vec<Point<D>> = likely.collect();
    if likely.is_empty() { of_leaf(problem, body, cell, level) } else { likely }
}

/// The lattice of a body on a level; `None` where the body would be a single particle far smaller than its
/// box.
fn lattice_of_body<const D: usize>(problem: &Problem<D>, body: &Body<D>, level: u8) -> Option<Lattice<D>> {
    let (lattice, bounds) = (Lattice::of(problem, level, body), body.shape.bounds());
    (0..D).any(|a| bounds.upper[a] - bounds.lower[a] >= 0.5 * lattice.edge).then_some(lattice)
}

/// The part of a shape in a box of the lattice: `None` if it has none, no part if it fills the box.
fn of_box<const D: usize>(
    shape: &Shape<D>,
    lattice: &Lattice<D>,
    index: &[u64; D],
) -> Option<Option<Part<D>>> {
    let cell = lattice.cell(index);
    match shape.classify(&cell) {
        Side::Outside => return None,
        Side::Inside => return Some(None),
        Side::Crosses => {}
    }
    let found = shape.part_in(&cell)?;
    let share = found.volume / cell.volume();
    if share < ROUNDING {
        return None;
    }
    let inside = |a: usize| {
        let slack = 1e-9 * lattice.edge;
        found.centre[a].clamp(cell.lower[a] + slack, cell.upper[a] - slack)
    };
    let part = Part { volume: found.volume, centre: std::array::from_fn(inside) };
    Some((share < 1.0 - ROUNDING).then_some(part))
}

/// Lets small parts join the largest neighbour that is not small: beside a face where there is one, else at
/// an edge or a corner.
fn join<const D: usize>(points: &mut Vec<Point<D>>, whole: f64) {
    let volume = |point: &Point<D>| point.part.map_or(whole, |part| part.volume);
    let is_small: Vec<bool> = points.iter().map(|point| volume(point) < SMALL * whole).collect();
    if !is_small.contains(&true) {
        return;
    }
    for small in (0..points.len()).filter(|&p| is_small[p]) {
        let own = volume(&points[small]);
        let mut best: Option<(u32, f64, usize)> = None;
        for offset in (0..3_u64.pow(D as u32)).map(offset::<D>) {
            let (index, steps) = moved(&points[small].index, &offset);
            let Ok(p) = points.binary_search_by(|point| point.index.cmp(&index)) else { continue };
            let volume = volume(&points[p]);
            let is_better =
                best.is_none_or(|(least, most, _)| steps < least || steps == least && volume > most);
            if !is_small[p] && volume + own <= MOST * whole && is_better {
                best = Some((steps, volume, p));
            }
        }
        let Some((_, volume, p)) = best else { continue };
        let (index, centre) =
            (points[small].index, points[small].part.map_or(points[small].x, |part| part.centre));
        let point = &mut points[p];
        let old = point.part.map_or(point.x, |part| part.centre);
        let total = volume + own;
        let mean = |a: usize| (centre[a] - old[a]).mul_add(own / total, old[a]);
        point.part = Some(Part { volume: total, centre: std::array::from_fn(mean) });
        point.joined.push(index);
    }
    let gone: Vec<[u64; D]> = points.iter().flat_map(|point| point.joined.iter().copied()).collect();
    points.retain(|point| !gone.contains(&point.index));
}

/// One of the ways to a neighbour: 0, 1 or 2 for a step back, none or a step on along each axis.
fn offset<const D: usize>(number: u64) -> [u64; D] {
    std::array::from_fn(|a| number / 3_u64.pow(a as u32) % 3)
}

/// The place there, and the number of axes with a step. That of the box itself, or one beyond the first, is
/// no neighbour.
fn moved<const D: usize>(index: &[u64; D], offset: &[u64; D]) -> ([u64; D], u32) {
    let place = std::array::from_fn(|a| (index[a] + offset[a]).wrapping_sub(1));
    (place, offset.iter().map(|&step| u32::from(step != 1)).sum())
}

#[cfg(test)]
#[path = "parts_tests.rs"]
mod tests;
