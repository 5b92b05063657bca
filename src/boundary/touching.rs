//! Contact of one particle with a collider: the impulse that keeps it out, bounded by Coulomb's law; and
//! paths that reach a surface.
//!
//! A particle of half widths h touches a plane of unit normal n at the distance `r = √Σ (h_k n_k)²` of its
//! centre: that of the face of its box along an axis, of the ellipsoid in the box elsewhere. Corners of boxes
//! are unsuitable: they stick out of the body that the particles fill, by up to 0.2 of a cell where a surface
//! is not along an axis.
//!
//! The impulse J acts at the point of the surface that is nearest to the particle. It takes the relative
//! velocity v there to one that keeps the particle out over the step, `v · n ≥ -(φ - r) / Δt` with the
//! distance φ, of which it takes at most μ times as much along the surface as across it (Moreau 1988: a
//! measure of contact for the step, without a penalty).
use super::Contact;
use super::collider::Collider;
use super::gap::{Bounds, STICKS};
use super::motion::{Pose, Rate};
use super::vector::length;
use crate::leapfrog::Lengths;

/// Gap, as a share of the distance at which a particle touches, up to which `sticky` and `slip` surfaces keep
/// it.
const HELD: f64 = 0.01;

/// One particle at one collider in one step.
#[derive(Clone, Copy, Debug)]
pub struct Touching<const D: usize> {
    /// Number of the collider.
    pub collider: usize,
    /// Unit normal, from the surface to the particle.
    pub normal: [f64; D],
    /// From the centre of the particle to the point of contact on the surface, m.
    pub arm: [f64; D],
    /// From its centre of mass to that point, m: another way with rings.
    pub lever: [f64; D],
    /// Velocity of the collider there, m/s.
    pub surface: [f64; D],
    /// Bounds on the velocity along the normal relative to it; the greatest is finite where the surface pulls
    /// as well.
    pub bounds: Bounds,
    /// Law of contact there.
    pub law: Contact,
    /// Impulse along the surface that cohesion bears at most, kg m/s.
    pub sticking: f64,
    /// Impulse of drag over the square of the velocity along the surface, kg s/m.
    pub drag: f64,
    /// Part of the surface that it covers, m² (of a slice one metre thick in the plane): its share of a
    /// uniform pressure. Of a foot, whose sweeps are scaled by equal impulses, 1.
    pub area: f64,
    /// Velocity that uniform pressure on all particles in contact brings, along the normal and along the
    /// surface, over the impulse on this one, 1/kg.
    pub compliance: [f64; 2],
    /// Impulse on the particle so far, kg m/s.
    pub impulse: [f64; D],
}

/// Distance from a surface at which a particle with these half widths (m) touches it, m.
pub fn touching_distance<const D: usize>(half: &[f64; D], normal: &[f64; D]) -> f64 {
    length(&std::array::from_fn::<f64, D, _>(|a| half[a] * normal[a]))
}

impl<const D: usize> Touching<D> {
    /// A particle with its centre at `x` (m), of these half widths (m) and this density (kg/m³, for drag), in
    /// a step of these lengths. `None` if the gap to the surface is wider than `reach`, m, a function of the
    /// normal, the velocity of the surface and the distance at which the particle touches.
    pub fn new(
        number: usize,
        collider: &Collider<D>,
        (pose, rate): (&Pose<D>, &Rate<D>),
        x: &[f64; D],
        (half, density): (&[f64; D], f64),
        Lengths { kick, drift }: Lengths,
        reach: impl Fn(&[f64; D], &[f64; D], f64) -> f64,
    ) -> Option<Self> {
        let distance = collider.distance(x, pose);
        let normal = collider.normal(x, pose);
        let touching = touching_distance(half, &normal);
        let arm: [f64; D] = normal.map(|n| -n * distance.clamp(0.0, touching));
        let at = std::array::from_fn(|a| x[a] + arm[a]);
        let surface = collider.velocity_at(&at, pose, rate);
        let gap = distance - touching;
        if gap > reach(&normal, &surface, touching) {
            return None;
        }
        // A particle that is closer already, or inside, does not come closer. Pushing it out would add
        // energy.
        let least = -gap.max(0.0) / drift;
        let held = gap <= HELD * touching && !matches!(collider.contact, Contact::Separating { .. });
        let bounds =
            Bounds { least, most: if held { least } else { f64::INFINITY }, sticking: 0.0, drag: 0.0 };
        let (law, impulse) = (collider.contact, [0.0; D]);
        // The part of the surface under a box that is this high over it.
        let area = (0..D).fold(1.0, |volume, a| volume * 2.0 * half[a]) / (2.0 * touching);
        let over = if gap <= STICKS * touching { area * kick } else { 0.0 };
        let (sticking, drag) = (law.cohesion() * over, law.drag() * density * over);
        Some(Self {
            collider: number,
            normal,
            arm,
            lever: arm,
            surface,
            bounds,
            law,
            sticking,
            drag,
            area,
            compliance: [0.0; 2],
            impulse,
        })
    }

    /// The contact of a ring that has this circumference at the point of contact, m, and its centre of mass
    /// `ahead` of its centre along the radius, m.
    #[must_use]
    pub fn around(mut self, circumference: f64, ahead: f64) -> Self {
        self.lever[0] -= ahead;
        self.sticking *= circumference;
        self.drag *= circumference;
        self.area *= circumference;
        self
    }

    /// Corrects the impulse for the velocity of the particle at the point of contact, m/s; returns its
    /// change, kg m/s.
    pub fn correct(&mut self, velocity: &[f64; D]) -> [f64; D] {
        let [of_normal, of_surface] = self.compliance;
        if of_normal <= 0.0 || of_surface <= 0.0 {
            return [0.0; D];
        }
        let n = &self.normal;
        let along = |v: &[f64; D]| (0..D).fold(0.0, |sum, a| v[a].mul_add(n[a], sum));
        let across =
            |v: &[f64; D], along: f64| -> [f64; D] { std::array::from_fn(|a| (-along).mul_add(n[a], v[a])) };
        let relative: [f64; D] = std::array::from_fn(|a| velocity[a] - self.surface[a]);
        let (outward, pressed) = (along(&relative), along(&self.impulse));
        let Bounds { least, most, .. } = self.bounds;
        let wanted = |bound: f64| pressed + (bound - outward) / of_normal;
        let normal = wanted(least).max(wanted(most).min(0.0));
        let (sliding, held_back) = (across(&relative, outward), across(&self.impulse, pressed));
        let mut tangential: [f64; D] = std::array::from_fn(|a| held_back[a] - sliding[a] / of_surface);
        // The impulse that stops all motion along the surface.
        let size = length(&tangential);
        let most = match self.law {
            Contact::Sticky if most < f64::INFINITY || normal > 0.0 => f64::INFINITY,
            Contact::Separating { friction, .. } => {
                let speed = size * of_surface;
                let dragged = self.drag * speed * speed / (self.drag * speed).mul_add(of_surface, 1.0);
                friction.mul_add(normal, self.sticking) + dragged
            }
            _ => 0.0,
        };
        if size > most {
            tangential = tangential.map(|t| t * (most / size));
        }
        let new: [f64; D] = std::array::from_fn(|a| normal.mul_add(n[a], tangential[a]));
        let more = std::array::from_fn(|a| new[a] - self.impulse[a]);
        self.impulse = new;
        more
    }
}

/// Intersection of a path with the surface of a shape, which may have no thickness, in the frame of the
/// shape.
pub struct Met<const D: usize> {
    /// The last place short of the surface, m.
    pub place: [f64; D],
    /// Normal there, towards the start of the path.
    pub normal: [f64; D],
}

/// Follows the path from one place to another (m) in the frame of a collider, up to a distance `close` (m)
/// from its surface. `None` if it reaches no surface: from inside a solid, and away from a surface, all paths
/// are free. Steps as long as the distance cannot jump over anything (Hart 1996, sphere tracing).
pub fn meets<const D: usize>(
    collider: &Collider<D>,
    from: &[f64; D],
    to: &[f64; D],
    close: f64,
) -> Option<Met<D>> {
    let way: [f64; D] = std::array::from_fn(|a| to[a] - from[a]);
    let long = length(&way);
    let mut distance = collider.shape.distance(from);
    if distance > long || distance < 0.0 || long == 0.0 {
        return None;
    }
    let mut gone = 0.0;
    let mut place = *from;
    loop {
        let normal = collider.shape.gradient(&place);
        let inward = (0..D).fold(0.0, |sum, a| way[a].mul_add(normal[a], sum));
        if distance <= close && inward < 0.0 {
            return Some(Met { place, normal });
        }
        gone += distance.max(0.5 * close);
        if gone >= long {
            let distance = collider.shape.distance(to);
            let normal = collider.shape.gradient(&place);
            return (distance < 0.0).then_some(Met { place, normal });
        }
        place = std::array::from_fn(|a| way[a].mul_add(gone / long, from[a]));
        let next = collider.shape.distance(&place);
        if next < 0.0 {
            // Of solids, by less than a step of half the closeness.
            let back = (gone - distance.max(0.5 * close)) / long;
            let place: [f64; D] = std::array::from_fn(|a| way[a].mul_add(back, from[a]));
            let normal = collider.shape.gradient(&place);
            return Some(Met { place, normal });
        }
        distance = next;
    }
}
