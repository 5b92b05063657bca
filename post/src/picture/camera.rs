//! Projection from space to pixels.
use std::ops::Range;

use agimp::geometry::vector::{cross, dot};

/// Lower and upper corner of a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub low: [f64; 3],
    pub high: [f64; 3],
}

impl Bounds {
    fn corners(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        (0..8).map(|i| {
            std::array::from_fn(|axis| if i >> axis & 1 == 0 { self.low[axis] } else { self.high[axis] })
        })
    }

    /// Longest edge.
    pub(super) fn extent(&self) -> f64 {
        (0..3).fold(0.0, |most: f64, axis| most.max(self.high[axis] - self.low[axis]))
    }

    /// The smallest box round both.
    pub(super) fn hull(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|axis| self.low[axis].min(other.low[axis])),
            high: std::array::from_fn(|axis| self.high[axis].max(other.high[axis])),
        }
    }

    /// Intersection of both; empty where `low` is above `high`.
    pub(super) fn cut(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|axis| self.low[axis].max(other.low[axis])),
            high: std::array::from_fn(|axis| self.high[axis].min(other.high[axis])),
        }
    }
}

/// Direction from which a picture in space shows the material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum View {
    /// Obliquely down.
    #[default]
    Iso,
    /// Along y.
    Front,
    /// Against x.
    Side,
    /// Down, with x to the right and y upwards.
    Top,
    /// From this direction.
    From([f64; 3]),
}

impl View {
    /// Right, up and towards the viewer. Of a plane picture always x, y and z.
    fn axes(self, flat: bool) -> [[f64; 3]; 3] {
        let toward = match self {
            _ if flat => return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Self::Top => return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Self::Front => [0.0, -1.0, 0.0],
            Self::Side => [1.0, 0.0, 0.0],
            Self::Iso => {
                let ((sa, ca), (se, ce)) = ((-0.9_f64).sin_cos(), 0.42_f64.sin_cos());
                [ce * ca, ce * sa, se]
            }
            Self::From(direction) => unit(direction),
        };
        let right = unit([-toward[1], toward[0], 0.0]);
        if right == [0.0; 3] {
            // From above or below.
            let sign = if toward[2] < 0.0 { -1.0 } else { 1.0 };
            return [[1.0, 0.0, 0.0], [0.0, sign, 0.0], toward];
        }
        [right, cross(toward, right), toward]
    }
}

impl std::str::FromStr for View {
    type Err = String;

    /// A name, or three numbers separated by commas.
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || "expected iso, front, side, top or a direction such as 1,-1,0.5".to_owned();
        match text {
            "iso" => return Ok(Self::Iso),
            "front" => return Ok(Self::Front),
            "side" => return Ok(Self::Side),
            "top" => return Ok(Self::Top),
            _ => {}
        }
        let direction = numbers::<3>(text).ok_or_else(expected)?;
        if direction.iter().all(|x| *x == 0.0) { Err(expected()) } else { Ok(Self::From(direction)) }
    }
}

/// Finite numbers separated by commas.
pub(super) fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let parts: Vec<f64> = text.split(',').map(|part| part.trim().parse().ok()).collect::<Option<_>>()?;
    let numbers: [f64; N] = parts.try_into().ok()?;
    numbers.iter().all(|x| x.is_finite()).then_some(numbers)
}

/// An orthographic camera that fits a box into an image.
pub(super) struct Camera {
    pub right: [f64; 3],
    pub up: [f64; 3],
    pub toward: [f64; 3],
    /// Screen centre in camera coordinates.
    centre: [f64; 2],
    pub depths: Range<f64>,
    /// Pixels per metre.
    pub scale: f64,
    origin: [f64; 2],
}

/// Of length 1; 0 stays 0.
pub(super) fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    if length > 1e-9 { a.map(|x| x / length) } else { [0.0; 3] }
}

impl Camera {
    /// A camera on `bounds`, which fill the given part of the image times `zoom`, with `focus` or their
    /// middle in its centre.
    pub(super) fn new(
        (flat, view): (bool, View),
        bounds: &Bounds,
        (zoom, focus): (f64, Option<[f64; 3]>),
        x: Range<f64>,
        y: Range<f64>,
    ) -> Self {
        let [right, up, toward] = view.axes(flat);
        let range = |axis: [f64; 3]| {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for corner in bounds.corners() {
                (low, high) = (low.min(dot(axis, corner)), high.max(dot(axis, corner)));
            }
            low..high
        };
        let (across, upward, depths) = (range(right), range(up), range(toward));
        let tiny = f64::MIN_POSITIVE;
        let scale = ((x.end - x.start) / (across.end - across.start).max(tiny))
            .min((y.end - y.start) / (upward.end - upward.start).max(tiny));
        let margin = 0.05 * bounds.extent() + tiny;
        let middle = [0.5 * (across.start + across.end), 0.5 * (upward.start + upward.end)];
        Self {
            right,
            up,
            toward,
            centre: focus.map_or(middle, |focus| [dot(right, focus), dot(up, focus)]),
            depths: depths.start - margin..depths.end + margin,
            scale: scale * zoom,
            origin: [0.5 * (x.start + x.end), 0.5 * (y.start + y.end)],
        }
    }

    /// Column, row and depth (towards the viewer, m) of a point.
    pub(super) fn project(&self, point: [f64; 3]) -> [f64; 3] {
        [
            self.origin[0] + self.scale * (dot(self.right, point) - self.centre[0]),
            self.origin[1] - self.scale * (dot(self.up, point) - self.centre[1]),
            dot(self.toward, point),
        ]
    }

    /// The point of a pixel at a depth.
    pub(super) fn point(&self, column: f64, row: f64, depth: f64) -> [f64; 3] {
        let a = (column - self.origin[0]) / self.scale + self.centre[0];
        let b = (self.origin[1] - row) / self.scale + self.centre[1];
        std::array::from_fn(|i| a * self.right[i] + b * self.up[i] + depth * self.toward[i])
    }

    /// Intersection of the ray of a pixel with the plane of height `z`, and the depth there; not for a flat
    /// view.
    pub(super) fn on_plane(&self, column: f64, row: f64, z: f64) -> ([f64; 3], f64) {
        let foot = self.point(column, row, 0.0);
        let depth = (z - foot[2]) / self.toward[2];
        (self.point(column, row, depth), depth)
    }

    /// Brightness of a surface with this normal: light from the upper left, in front.
    pub(super) fn light(&self, normal: [f64; 3]) -> f64 {
        let [x, y, z] = [dot(normal, self.right), dot(normal, self.up), dot(normal, self.toward)];
        0.55 + 0.5 * (-0.45 * x + 0.62 * y + 0.643 * z).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_right_handed_and_upright() {
        for view in [
            View::Iso,
            View::Front,
            View::Side,
            View::Top,
            View::From([1.0, 2.0, -0.5]),
            View::From([0.0, 0.0, -1.0]),
        ] {
            let [right, up, toward] = view.axes(false);
            for axis in 0..3 {
                assert!((cross(right, up)[axis] - toward[axis]).abs() < 1e-12, "{view:?}");
            }
            assert!(up[2] >= 0.0, "{view:?}: z points up");
        }
        assert_eq!("front".parse::<View>().map(|view| view.axes(false)[0]), Ok([1.0, 0.0, 0.0]));
        assert!(
            "0,0,0".parse::<View>().is_err()
                && "left".parse::<View>().is_err()
                && "1,2".parse::<View>().is_err()
        );
    }

    #[test]
    fn a_focus_is_in_the_middle_and_zoom_makes_it_larger() {
        let bounds = Bounds { low: [0.0; 3], high: [2.0, 1.0, 1.0] };
        let camera =
            |zoom, focus| Camera::new((false, View::Front), &bounds, (zoom, focus), 0.0..200.0, 0.0..100.0);
        let near = camera(3.0, Some([0.5, 0.5, 0.25]));
        assert_eq!(near.project([0.5, 0.9, 0.25])[..2], [100.0, 50.0]);
        assert_eq!(near.scale, 3.0 * camera(1.0, None).scale);
    }
}
