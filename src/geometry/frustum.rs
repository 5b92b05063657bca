//! Truncated cones.

/// A truncated cone; a cylinder when both radii are equal, a cone when the upper one is 0.
///
/// In 2D it is the symmetric trapezium with these half widths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum<const D: usize> {
    /// Centre of the lower end, m.
    pub base: [f64; D],
    /// Unit vector from the lower end to the upper one.
    pub axis: [f64; D],
    /// Distance between the ends, m.
    pub height: f64,
    /// Radius of the lower end, m.
    pub lower_radius: f64,
    /// Radius of the upper end, m.
    pub upper_radius: f64,
}
