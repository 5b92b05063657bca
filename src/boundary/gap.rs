//! The gap between a rigid surface and the material that lies over it, from two sums at the nodes of the
//! surface.
//!
//! Material that ends at a plane, a height `y h` over a node along the normal n of the surface, gives the
//! node the volume `Σ V w` and the slope `a = -Σ V ∂w/∂n > 0`. Their ratio `q = Σ V w / (h a)` is `(1 - y) /
//! 2` where the plane lies in the upper half of the node's hat. Both sums have the same share of what the
//! material covers of the hat along the surface, so that the height is exact at edges and corners of a body,
//! where the share of the volume is not. A condition on the velocity of a node is then one that the surface
//! of the material obeys: without the gap, material would be stopped as soon as it enters the hat, up to a
//! cell early, and the few particles in the hat would carry the force of all.
//!
//! A node beside the edge of a body has a sliver of the material, a force that does not shrink with its mass,
//! and the gap of the rows over it. What it does hardly moves the material, so this gap never closes: free to
//! move over all of it in each step, the node would move without end, and edges of bodies under load would
//! sink into the surface. So it moves over the share of the gap that the material covers of its part of the
//! surface.
/// Width of a gap, in cells, up to which cohesion and drag act.
pub const STICKS: f64 = 0.1;

/// Width of a gap, in cells, up to which it is closed: what rounding leaves between a column at rest and its
/// floor.
const CLOSED: f64 = 1e-6;

/// The same for surfaces that hold material both ways: what the sums of material at rest are off by. With
/// less, bodies under load between such walls would settle in states that depend on the way.
const CLOSED_BOTH_WAYS: f64 = 0.04;

/// Width of a gap, in cells, up to which surfaces that hold material both ways hold what moves away.
const HELD: f64 = 0.5;

/// Height of the surface of the material over a node along the normal of a rigid surface, in cells of edge
/// `cell` (m), from `Σ V w` (m³) and `-Σ V ∂w/∂n` (m²). Material that does not end towards the surface is all
/// round the node. Rings over a surface with the curvature `bend / cell` have `1 + bend / 3` times the volume
/// that they would have with its circumference throughout, if they end at it.
pub fn height(volume: f64, slope: f64, cell: f64, bend: f64) -> f64 {
    if slope <= 0.0 {
        return -1.0;
    }
    let q = volume / (cell * slope * (1.0 + bend / 3.0));
    // A plane in the lower half of the hat leaves (1 + s)² / 2 of it behind it, at s = -y: the same ratio,
    // solved for s.
    if q <= 0.5 { 1.0 - 2.0 * q } else { q.mul_add(q, 2.0).sqrt() - q - 1.0 }
}

/// `-Σ V ∂w/∂n` of material that covers all of a node's part of a surface, m²: the area of a face of its
/// cells (m²), times the hat at the height of the material, in cells.
pub fn full_slope(face: f64, height: f64) -> f64 {
    face * (1.0 - height.abs()).max(0.0)
}

/// A gap between a surface and material at a node or a foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// How wide it is, m; negative where the material has passed the surface.
    pub width: f64,
    /// Share of the surface there that the material covers, 0 to 1.
    pub cover: f64,
}

impl Gap {
    /// Where material touches, however little of it.
    pub const CLOSED: Self = Self { width: 0.0, cover: 1.0 };

    /// A gap so wide (m) to material with this slope, where all that covered the surface would have a `full`
    /// one, m².
    pub fn new(width: f64, slope: f64, full: f64) -> Self {
        Self { width, cover: if slope < full { (slope / full).max(0.0) } else { 1.0 } }
    }
}

/// `-Σ V ∂w/∂n` along a normal, from the sum of gradients `Σ V ∇w`.
pub fn slope<const D: usize>(gradient: &[f64; 4], normal: &[f64; D]) -> f64 {
    -(0..D).fold(0.0, |sum, a| gradient[a].mul_add(normal[a], sum))
}

/// Plastic strain, or damage, from which on material counts as yielded: its boxes no longer tile, and the
/// height that it has over nodes has errors of a tenth of a cell and more. Over such gaps the foot of a
/// plastic rod that strikes a face would spread too little.
const YIELDED: f64 = 0.02;

/// Size over slope from which on material that has yielded is all there is.
const ALL: f64 = 2.0;

/// Share of the slope that material with this plastic strain gives: without slope it is all round the node
/// and touches.
pub fn elastic_share(plastic_strain: f64) -> f64 {
    1.0 - (plastic_strain / YIELDED).clamp(0.0, 1.0)
}

/// Whether the material at a surface has yielded, from its volume over the edge of the cells and its slope to
/// either side, m²: what has yielded has volume and no slope.
pub fn has_yielded(size: f64, slope: f64) -> bool {
    size > ALL * slope
}

/// Where the material of a velocity field meets faces, and colliders that act on nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Meets {
    /// At its surface, once it has moved over the gap.
    #[default]
    Surface,
    /// At its surface as long as it is elastic, wherever it is once it has yielded: metals and clay.
    Firm,
    /// The same, without ties of surface nodes: material whose strength comes from pressure or is lost in
    /// cracks, as sand, rock and snow.
    Frictional,
    /// Wherever it is, at the feet of the nodes inside colliders: fluids. Over gaps water would gather at
    /// walls.
    Feet,
    /// Wherever it is, at the nodes: fluids that move with what yields.
    Nodes,
}

impl Meets {
    /// Whether it moves over gaps until it yields, if nothing forbids.
    pub const fn yields(self) -> bool {
        matches!(self, Self::Firm | Self::Frictional)
    }

    /// Of two materials that move together: later ones go before earlier ones, but for fluids with what
    /// yields.
    pub fn together(self, other: Self) -> Self {
        match [self.min(other), self.max(other)] {
            [Self::Firm | Self::Frictional, Self::Feet] => Self::Nodes,
            [_, later] => later,
        }
    }
}

/// Condition of a surface on the velocity of material at it in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least velocity along the normal, relative to the surface, m/s: that which closes the gap in the step,
    /// or as much of it as the material covers of the surface.
    pub least: f64,
    /// Greatest, m/s; infinite where nothing holds the material.
    pub most: f64,
    /// Velocity along the surface that cohesion takes away at most, m/s.
    pub sticking: f64,
    /// Drag takes `k v² / (1 + k v)` of the velocity v along the surface: k, s/m.
    pub drag: f64,
}

impl Bounds {
    /// Of material that touches the surface.
    pub const TOUCHING: Self = Self { least: 0.0, most: 0.0, sticking: 0.0, drag: 0.0 };

    /// Across a gap between nodes with cells of this edge (m), in a step of length `dt`, s, to a surface
    /// that holds material `both_ways` or lets it leave.
    pub fn across(Gap { width, cover }: Gap, cell: f64, dt: f64, both_ways: bool) -> Self {
        let closed = if both_ways { CLOSED_BOTH_WAYS } else { CLOSED };
        let least = if width > closed * cell { -cover * width / dt } else { 0.0 };
        let most = if both_ways && width <= HELD * cell { 0.0 } else { f64::INFINITY };
        Self { least, most, sticking: 0.0, drag: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::Contact;

    /// Volume and slope of a layer from a height up (cells), in a hat of cells of 1 m that it covers to a
    /// share.
    fn sums(from: f64, cover: f64) -> (f64, f64) {
        let hat = |s: f64| 1.0 - s.abs();
        let volume = if from > 0.0 { 0.5 * hat(from).powi(2) } else { 1.0 - 0.5 * hat(from).powi(2) };
        (cover * volume, cover * hat(from))
    }

    #[test]
    fn planes_are_found_wherever_they_lie_and_whatever_they_cover() {
        for from in [0.9, 0.5, 0.1, 0.0, -0.1, -0.5, -0.9] {
            for cover in [1.0, 0.5, 0.01] {
                let (volume, slope) = sums(from, cover);
                approx::assert_relative_eq!(height(volume, slope, 1.0, 0.0), from, epsilon = 1e-12);
            }
        }
        assert_eq!(height(1.0, 0.0, 1.0, 0.0), -1.0);
    }

    #[test]
    fn what_moves_together_meets_surfaces_as_the_one_with_less_freedom() {
        use Meets::{Feet, Firm, Frictional, Nodes, Surface};
        let cases = [
            (Surface, Firm, Firm),
            (Surface, Feet, Feet),
            (Firm, Frictional, Frictional),
            (Firm, Feet, Nodes),
            (Frictional, Feet, Nodes),
            (Feet, Nodes, Nodes),
        ];
        for (one, other, both) in cases {
            assert_eq!((one.together(other), other.together(one)), (both, both), "{one:?}, {other:?}");
        }
    }

    #[test]
    fn heights_are_in_cells() {
        let (volume, slope) = sums(0.25, 1.0);
        approx::assert_relative_eq!(height(0.125 * volume, 0.25 * slope, 0.5, 0.0), 0.25, epsilon = 1e-12);
    }

    /// A node with a sliver of the material has as little of its gap.
    #[test]
    fn slivers_move_over_a_share_of_the_gap() {
        for cover in [1.0, 0.5, 0.01] {
            let (volume, slope) = sums(0.25, cover);
            let height = height(volume, slope, 1.0, 0.0);
            let gap = Gap::new(height, slope, full_slope(1.0, height));
            approx::assert_relative_eq!(gap.cover, cover, epsilon = 1e-12);
            let bounds = Bounds::across(gap, 1.0, 0.5, false);
            approx::assert_relative_eq!(bounds.least, -0.5 * cover, epsilon = 1e-12);
        }
        assert_eq!(Gap::new(0.1, 1.2, 1.0).cover, 1.0);
        assert_eq!(Gap::new(1.0, 0.2, full_slope(1.0, 1.0)).cover, 1.0);
    }

    #[test]
    fn gaps_close_within_the_step_and_no_further() {
        let (free, both_ways) = (f64::INFINITY, true);
        let across = |width, both| Bounds::across(Gap { width, cover: 1.0 }, 1.0, 0.5, both);
        assert_eq!(across(-0.1, both_ways), Bounds::TOUCHING);
        assert_eq!(across(0.01, both_ways), Bounds::TOUCHING);
        assert_eq!(across(0.25, both_ways), Bounds { least: -0.5, ..Bounds::TOUCHING });
        let far = Bounds { least: -1.5, most: free, ..Bounds::TOUCHING };
        assert_eq!(across(0.75, both_ways), far);
        assert_eq!(across(0.75, false), far);
        let near = Bounds { least: -0.02, most: free, ..Bounds::TOUCHING };
        assert_eq!(across(0.01, false), near);
        let free = Contact::default().bounds(Bounds::TOUCHING);
        assert_eq!(free, Bounds { most: f64::INFINITY, ..Bounds::TOUCHING });
    }
}
