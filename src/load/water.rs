//! Pressure of the water in the pores where the job gives it.
//!
//! Laws see the effective stress. Water with the pressure p in pores that are connected moves the material by
//! the divergence of its part `-p I` of the total stress, and free water by the pressure `-p n` on the
//! surfaces that it wets. Together they do the work of a force per volume,
//! `∫ p ∇N dV - ∮ N p n dA = -∫ N ∇p dV`, so no surface needs to be known, water above the
//! ground loads it, and a submerged body is buoyant. The mean of ∇p over a box is the difference of p between
//! its faces over its width, also where the water table passes through the box. So material whose weight the
//! water bears is at rest to round-off.
//!
//! The volume is that of the mass at the density of the material: it has the water of these pores. Water that
//! comes as they open, and goes as they close, bears its own weight. So grains that the flow has parted sink
//! with the weight that they have under water, whatever the space between them.
use std::borrow::Cow;

use super::Up;
use super::words::in_words;
use crate::quantity::Quantity;

/// Water in the pores of all material.
#[derive(Clone, Debug)]
pub struct Water {
    /// Its pressure.
    pub given: Given,
    /// Density of the water, kg/m³.
    pub density: f64,
    /// Greatest suction that it bears, Pa: the pressure is never below its negative.
    pub suction: f64,
    /// The vertical.
    pub up: Up,
}

/// How the pressure of the water is given.
#[derive(Clone, Debug)]
pub enum Given {
    /// Level of the water table, m, along the vertical: hydrostatic pressure below.
    Level(Quantity),
    /// The pressure itself, Pa.
    Pressure(Quantity),
    /// Steady seepage: the head about a particle, which carries it; nothing where no water has been found
    /// yet.
    Seepage(Option<Head>),
}

/// Head of the water about a place: the level, m along the vertical, to which it rises in a standpipe. Linear
/// in the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Head {
    /// The place, m, in the coordinates of the job.
    pub place: [f64; 3],
    /// Head there, m.
    pub value: f64,
    /// Its gradient.
    pub gradient: [f64; 3],
}

impl Head {
    /// Head at another place, m.
    pub fn at(&self, place: [f64; 3]) -> f64 {
        (0..3).fold(self.value, |head, a| self.gradient[a].mul_add(place[a] - self.place[a], head))
    }
}

impl Water {
    /// Origin of the pressure, in words.
    pub fn describe(&self) -> String {
        match &self.given {
            Given::Level(level) => format!("water table at {}", in_words(level, "m")),
            Given::Pressure(pressure) => format!("pore pressure {}", in_words(pressure, "Pa")),
            Given::Seepage(_) => "steady seepage".to_owned(),
        }
    }

    /// The quantity that gives it, if the job has one.
    pub fn quantity(&self) -> Option<&Quantity> {
        match &self.given {
            Given::Level(quantity) | Given::Pressure(quantity) => Some(quantity),
            Given::Seepage(_) => None,
        }
    }

    /// The water about a particle that carries this head, where it seeps; else the same.
    pub fn about(&self, head: Option<Head>) -> Cow<'_, Self> {
        match self.given {
            Given::Seepage(_) => Cow::Owned(Self { given: Given::Seepage(head), ..*self }),
            Given::Level(_) | Given::Pressure(_) => Cow::Borrowed(self),
        }
    }

    /// Level to which the water rises from a place, m, if it follows from one.
    fn level(&self, place: [f64; 3], time: f64) -> Option<f64> {
        match &self.given {
            Given::Level(level) => Some(level.at(place, time)),
            Given::Seepage(Some(head)) => Some(head.at(place)),
            Given::Seepage(None) | Given::Pressure(_) => None,
        }
    }

    /// Weight of the water per volume, N/m³, in this gravity, m/s².
    fn unit_weight(&self, gravity: &[f64]) -> f64 {
        self.density * gravity[self.up.axis].abs()
    }

    /// Pressure (Pa) at a place in the coordinates of the job (m) and a time (s), in this gravity, m/s².
    pub fn pressure(&self, place: [f64; 3], time: f64, gravity: &[f64]) -> f64 {
        self.unbounded(place, time, gravity).max(-self.suction)
    }

    /// The pressure without the bound of the suction, Pa.
    fn unbounded(&self, place: [f64; 3], time: f64, gravity: &[f64]) -> f64 {
        match (&self.given, self.level(place, time)) {
            (Given::Pressure(pressure), _) => pressure.at(place, time),
            (_, Some(level)) => self.unit_weight(gravity) * ((level - place[self.up.axis]) * self.up.sign),
            (_, None) => f64::NEG_INFINITY,
        }
    }

    /// Whether a place lies below the water table, where pores are full.
    pub fn is_below(&self, place: [f64; 3], time: f64) -> bool {
        match (&self.given, self.level(place, time)) {
            (Given::Pressure(pressure), _) => pressure.at(place, time) > 0.0,
            (_, level) => level.is_some_and(|level| (level - place[self.up.axis]) * self.up.sign > 0.0),
        }
    }

    /// Height (m, up) where the water table crosses the vertical through a place between two heights; the
    /// upper one if the pores are full up to there, the lower one if they are full nowhere. One crossing is
    /// expected.
    pub fn table(&self, place: [f64; 3], time: f64, [low, high]: [f64; 2]) -> f64 {
        let up = self.up;
        let at =
            |height: f64| std::array::from_fn(|a| if a == up.axis { height * up.sign } else { place[a] });
        match &self.given {
            Given::Level(level) => (level.at(place, time) * up.sign).clamp(low, high),
            _ if self.is_below(at(high), time) => high,
            _ if !self.is_below(at(low), time) => low,
            _ => {
                let (mut full, mut empty) = (low, high);
                loop {
                    let middle = 0.5 * (full + empty);
                    if middle <= full || middle >= empty {
                        return middle;
                    }
                    if self.is_below(at(middle), time) { full = middle } else { empty = middle }
                }
            }
        }
    }

    /// Share of a box about a place (m) with this half width along the vertical (m) that lies below the water
    /// table.
    pub fn share_below(&self, place: [f64; 3], half: f64, time: f64) -> f64 {
        let centre = place[self.up.axis] * self.up.sign;
        let ends = [centre - half, centre + half];
        (self.table(place, time, ends) - ends[0]) / (2.0 * half)
    }

    /// Mean force per volume on a box about a place (m) with these half widths (m): `-∇p`, N/m³.
    pub fn force<const D: usize>(
        &self,
        place: [f64; 3],
        half: &[f64; D],
        time: f64,
        gravity: &[f64; D],
    ) -> [f64; D] {
        std::array::from_fn(|axis| {
            let [low, high] = [-1.0, 1.0].map(|side: f64| {
                let mut face = place;
                face[axis] = side.mul_add(half[axis], face[axis]);
                self.pressure(face, time, gravity)
            });
            (low - high) / (2.0 * half[axis])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Expression;

    fn water(given: Given) -> Water {
        Water { given, density: 1000.0, suction: 0.0, up: Up::new(&[0.0, -10.0]) }
    }

    fn expression(text: &str) -> Quantity {
        Quantity::Expression(Box::new(Expression::parse(text).expect("an expression")))
    }

    /// Archimedes: a box is buoyant by the weight of the water in it, at any height of the table.
    #[test]
    fn boxes_are_buoyant_by_the_water_in_them() {
        let water = water(Given::Level(Quantity::Constant(1.0)));
        for (y, share) in [(0.0, 1.0), (0.75, 1.0), (0.875, 0.75), (1.0, 0.5), (1.25, 0.0), (3.0, 0.0)] {
            let force = water.force([0.3, y, 0.0], &[0.5, 0.25], 0.0, &[0.0, -10.0]);
            assert_eq!(force, [0.0, 1e4 * share], "{y}");
            assert_eq!(water.share_below([0.3, y, 0.0], 0.25, 0.0), share, "{y}");
        }
    }

    /// Under an inclined table water flows, and pushes along its slope.
    #[test]
    fn an_inclined_table_pushes_along_its_slope() {
        let water = water(Given::Level(expression("2 - 0.25 * x")));
        let force = water.force([1.0, 0.5, 0.0], &[0.5, 0.25], 0.0, &[0.0, -10.0]);
        assert_eq!(force, [2500.0, 1e4]);
    }

    /// A field of pressure finds its water table.
    #[test]
    fn the_table_of_a_field_is_where_its_pressure_ends() {
        let water = water(Given::Pressure(expression("max(0, 5000 * (1 - y))")));
        assert_eq!(water.table([0.0; 3], 0.0, [0.0, 4.0]), 1.0);
        assert_eq!(water.table([0.0; 3], 0.0, [0.0, 0.5]), 0.5);
        assert_eq!(water.table([0.0; 3], 0.0, [2.0, 4.0]), 2.0);
        assert_eq!(water.share_below([0.0, 1.0, 0.0], 0.5, 0.0), 0.5);
        assert_eq!(water.force([0.0, 1.0, 0.0], &[0.5, 0.5], 0.0, &[0.0, -10.0]), [0.0, 2500.0]);
    }

    /// Seepage has its pressure from the head that a particle carries, and none where there is no head.
    #[test]
    fn seepage_pushes_along_the_gradient_of_the_head() {
        let dry = water(Given::Seepage(None));
        assert_eq!(dry.pressure([0.0; 3], 0.0, &[0.0, -10.0]), 0.0);
        assert_eq!(dry.share_below([0.0; 3], 1.0, 0.0), 0.0);
        let head = Head { place: [1.0, 0.0, 0.0], value: 2.0, gradient: [-0.5, 0.25, 0.0] };
        let wet = dry.about(Some(head));
        assert_eq!(wet.pressure([1.0, 0.0, 0.0], 0.0, &[0.0, -10.0]), 2e4);
        assert_eq!(wet.force([1.0, 0.0, 0.0], &[0.5, 0.5], 0.0, &[0.0, -10.0]), [5e3, 7.5e3]);
        // Head and height meet where 2 + y / 4 = y.
        let share = wet.share_below([1.0, 8.0 / 3.0, 0.0], 0.5, 0.0);
        assert!((share - 0.5).abs() < 1e-14, "{share}");
        let given = water(Given::Level(Quantity::Constant(1.0)));
        assert_eq!(given.about(Some(head)).pressure([0.0; 3], 0.0, &[0.0, -10.0]), 1e4);
    }

    /// Without suction pores above the table have no pressure; with it they have one down to its bound.
    #[test]
    fn suction_is_bounded() {
        let mut water = water(Given::Level(Quantity::Constant(0.0)));
        assert_eq!(water.pressure([0.0, 3.0, 0.0], 0.0, &[0.0, -10.0]), 0.0);
        water.suction = 2e4;
        assert_eq!(water.pressure([0.0, 1.0, 0.0], 0.0, &[0.0, -10.0]), -1e4);
        assert_eq!(water.pressure([0.0, 3.0, 0.0], 0.0, &[0.0, -10.0]), -2e4);
    }
}
