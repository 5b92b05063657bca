//! Axis-aligned boxes.

/// An axis-aligned box, possibly unbounded or empty (`lower > upper` along some axis).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb<const D: usize> {
    /// Lower corner, m.
    pub lower: [f64; D],
    /// Upper corner, m.
    pub upper: [f64; D],
}

impl<const D: usize> Aabb<D> {
    /// All of space.
    pub const EVERYWHERE: Self = Self { lower: [f64::NEG_INFINITY; D], upper: [f64::INFINITY; D] };
    /// No point at all; the neutral element of [`Aabb::hull`].
    pub const EMPTY: Self = Self { lower: [f64::INFINITY; D], upper: [f64::NEG_INFINITY; D] };

    /// The box between two corners.
    pub const fn new(lower: [f64; D], upper: [f64; D]) -> Self {
        Self { lower, upper }
    }

    /// The midpoint.
    pub fn centre(&self) -> [f64; D] {
        std::array::from_fn(|a| 0.5 * (self.lower[a] + self.upper[a]))
    }

    /// Half of the space diagonal: the radius of the ball about the centre that holds the box.
    pub fn half_diagonal(&self) -> f64 {
        let edges = std::array::from_fn::<f64, D, _>(|a| self.upper[a] - self.lower[a]);
        0.5 * edges.iter().map(|e| e * e).sum::<f64>().sqrt()
    }

    /// The smallest box that holds these points; empty if there are none.
    pub fn of_points(points: impl IntoIterator<Item = [f64; D]>) -> Self {
        points.into_iter().fold(Self::EMPTY, |all, x| all.hull(&Self::new(x, x)))
    }

    /// The box with all its faces farther out by a distance, m.
    pub fn grown(&self, by: f64) -> Self {
        Self { lower: self.lower.map(|c| c - by), upper: self.upper.map(|c| c + by) }
    }

    /// Its halves along all axes: boxes with a corner of this one and its midpoint.
    pub fn children(&self) -> impl Iterator<Item = Self> {
        let (whole, centre) = (*self, self.centre());
        (0..1_usize << D).map(move |corner| {
            let is_upper = |a: usize| corner >> a & 1 == 1;
            Self {
                lower: std::array::from_fn(|a| if is_upper(a) { centre[a] } else { whole.lower[a] }),
                upper: std::array::from_fn(|a| if is_upper(a) { whole.upper[a] } else { centre[a] }),
            }
        })
    }

    /// Product of its edges.
    pub fn volume(&self) -> f64 {
        (0..D).map(|a| self.upper[a] - self.lower[a]).product()
    }

    /// The smallest box that holds both.
    pub fn hull(&self, other: &Self) -> Self {
        Self {
            lower: std::array::from_fn(|a| self.lower[a].min(other.lower[a])),
            upper: std::array::from_fn(|a| self.upper[a].max(other.upper[a])),
        }
    }

    /// The common part.
    pub fn intersection(&self, other: &Self) -> Self {
        Self {
            lower: std::array::from_fn(|a| self.lower[a].max(other.lower[a])),
            upper: std::array::from_fn(|a| self.upper[a].min(other.upper[a])),
        }
    }

    /// True when the box contains no open set.
    pub fn is_empty(&self) -> bool {
        // `!(<)` rather than `>=`, so that a NaN corner counts as empty.
        (0..D).any(|a| self.lower[a].partial_cmp(&self.upper[a]) != Some(std::cmp::Ordering::Less))
    }

    /// True for points with `lower <= x < upper`, so that boxes which tile space share no point.
    pub fn contains(&self, x: &[f64; D]) -> bool {
        (0..D).all(|a| self.lower[a] <= x[a] && x[a] < self.upper[a])
    }
}
