//! Bodies of revolution in space: copies of the particles of the half plane next to each other about the
//! axis.
//!
//! Radius and height, x and y of an axisymmetric job, become the distance from the z axis and z.
use std::f64::consts::{PI, TAU};
use std::str::FromStr;

use agimp::io::snapshot::Header;
use agimp::kernel::Coordinates;
use agimp::text::count;

/// Most copies of the particles of a file.
const MOST: usize = 10_000_000;

/// How far bodies are turned about the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Revolve {
    /// By three quarters: open where x > 0 and y < 0, towards the viewer of the usual view.
    Open,
    /// All around.
    Whole,
}

impl FromStr for Revolve {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "open" => Ok(Self::Open),
            "whole" => Ok(Self::Whole),
            _ => Err("expected open or whole".into()),
        }
    }
}

impl Revolve {
    /// Greatest angle, from the x axis towards the y axis.
    fn span(self) -> f64 {
        if self == Self::Open { 1.5 * PI } else { TAU }
    }

    /// Signed distance of a place from where bodies are, as far as the open quarter goes, m, or a bound
    /// smaller in magnitude.
    pub(super) fn distance(self, x: &[f64; 3]) -> f64 {
        if self == Self::Open { x[0].min(-x[1]) } else { f64::NEG_INFINITY }
    }
}

/// A turn about the axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    sine: f64,
    cosine: f64,
}

impl Turn {
    fn by(angle: f64) -> Self {
        let (sine, cosine) = libm::sincos(angle);
        Self { sine, cosine }
    }

    /// Where a place of the half plane comes to be.
    pub(super) fn place(self, [radius, height, _]: [f64; 3]) -> [f64; 3] {
        [radius * self.cosine, radius * self.sine, height]
    }

    /// A vector with these components along the radius, the axis and the hoop.
    pub(super) fn vector(self, [radial, axial, hoop]: [f64; 3]) -> [f64; 3] {
        let Self { sine, cosine } = self;
        [radial * cosine - hoop * sine, radial * sine + hoop * cosine, axial]
    }

    /// A symmetric tensor of the half plane; components xx, yy, zz, xy, yz, xz before and after.
    pub(super) fn tensor(self, [radial, axial, hoop, shear, ..]: [f64; 6]) -> [f64; 6] {
        let Self { sine, cosine } = self;
        let (cc, ss) = (cosine * cosine, sine * sine);
        [
            radial * cc + hoop * ss,
            radial * ss + hoop * cc,
            axial,
            (radial - hoop) * sine * cosine,
            shear * sine,
            shear * cosine,
        ]
    }
}

/// The copies of the particles of a file, given by radius and half width (m): the number of each particle,
/// and its turn.
///
/// # Errors
/// In words: the file is of another geometry, or has too many copies.
pub(super) fn copies(
    header: &Header,
    particles: impl Iterator<Item = (f64, f64)> + Clone,
    revolve: Revolve,
) -> Result<Vec<(usize, Turn)>, String> {
    if header.scalars.coordinates() != Coordinates::Axisymmetric {
        return Err(
            "found no bodies of revolution; expected the output of a job with geometry = \"axisymmetric\""
                .into(),
        );
    }
    let span = revolve.span();
    let around = |(radius, half): (f64, f64)| (span * radius.max(0.0) / (2.0 * half)).ceil().max(1.0);
    let all: f64 = particles.clone().map(around).sum();
    if all > MOST as f64 {
        return Err(format!(
            "found {} particles about the axis; expected at most {}: revolve an output with coarser cells",
            count(all as u64),
            count(MOST as u64)
        ));
    }
    let of = |(p, particle): (usize, (f64, f64))| {
        let number = around(particle);
        (0..number as u64).map(move |i| (p, Turn::by(span * (i as f64 + 0.5) / number)))
    };
    Ok(particles.enumerate().flat_map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn brings the radius to y; the tensor's invariants stay.
    #[test]
    fn a_turn_keeps_lengths_and_invariants() {
        let turn = Turn::by(0.5 * PI);
        let close = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
        assert!(close(turn.place([2.0, 3.0, 0.0]), [0.0, 2.0, 3.0]));
        assert!(close(turn.vector([1.0, 2.0, 0.5]), [-0.5, 1.0, 2.0]));
        let tensor = Turn::by(0.7).tensor([4.0, -1.0, 2.0, 0.5, 0.0, 0.0]);
        assert!((tensor[0] + tensor[1] + tensor[2] - 5.0).abs() < 1e-14);
        let square: f64 = tensor[..3].iter().map(|t| t * t).sum::<f64>()
            + 2.0 * tensor[3..].iter().map(|t| t * t).sum::<f64>();
        assert!((square - (16.0 + 1.0 + 4.0 + 2.0 * 0.25)).abs() < 1e-13);
    }

    #[test]
    fn the_open_quarter_is_outside() {
        for ([x, y], is_open) in [([1.0, -1.0], true), ([1.0, 1.0], false), ([-1.0, -1.0], false)] {
            assert_eq!(Revolve::Open.distance(&[x, y, 0.0]) > 0.0, is_open);
        }
    }
}
