//! Roots of scalar equations, lane by lane.
//!
//! A lane stops changing when it has converged, so its bits do not depend on the lanes beside it. Derivatives
//! of a root ([`Vector::DERIVES`]) are those of the theorem of implicit functions, not of the search.
use crate::simd::{Vector, VectorMask};

/// Iterations at most; a lane that brackets a root to adjacent numbers by bisection alone takes fewer.
const MOST: usize = 80;
/// Relative change below which a lane has converged.
const TOLERANCE: f64 = 4.0 * f64::EPSILON;

/// A function of lanes. Functions that capture more than a few numbers are types with a method marked
/// `inline(always)`, not closures: the compiler may compile a closure as a separate function, which lacks the
/// instructions of the kernel that calls it.
pub(super) trait Function<V, R> {
    /// Its value.
    fn at(&self, x: V) -> R;
}

impl<V, R, F: Fn(V) -> R> Function<V, R> for F {
    #[inline(always)]
    fn at(&self, x: V) -> R {
        self(x)
    }
}

/// The root of a decreasing function above 0, by Newton's method within a bracket.
///
/// `function` gives value and slope; its value is positive at 0 and not positive at `high`. A value of at
/// most `noise` counts as zero. The first point is `guess`, above 0 and at most `high`; lanes that are not
/// `active` stay there.
#[inline(always)]
pub(super) fn newton<V: Vector>(
    function: impl Function<V, [V; 2]>,
    guess: V,
    high: V,
    noise: V,
    active: V::Mask,
) -> V {
    let zero = V::splat(0.0);
    let (mut low, mut above) = (zero, high);
    let mut x = guess;
    let mut pending = active;
    for _ in 0..MOST {
        if !pending.any() {
            break;
        }
        let [value, slope] = function.at(x);
        let left = zero.lt(value);
        low = (pending & left).select(x, low);
        above = (pending & !left).select(x, above);
        let newton = x - value / slope;
        // In the middle of the exponents, since roots may be many orders below `high`.
        let middle = zero.lt(low).select((low * above).sqrt(), above * (1.0 / 1024.0));
        let inside = low.lt(newton) & newton.lt(above);
        let next = inside.select(newton, middle);
        let done = value.abs().le(noise) | (next - x).abs().le(x * TOLERANCE);
        let moves = pending & !value.abs().le(noise);
        x = moves.select(next, x);
        pending = pending & !done;
    }
    if V::DERIVES {
        let [residual, _] = function.at(x.unknown());
        return active.select(x.implied(residual), x);
    }
    x
}

/// The root of a continuous function between 0 and `high`, where it has values of different signs, positive
/// at 0: regula falsi in the form of Anderson and Björck (1973), with a bisection where three steps have not
/// halved the bracket.
///
/// `at_zero` is the value at 0; that at `high` need not be known and counts as its negative. The first point
/// is `guess`. A value of at most `noise` counts as zero. Lanes that are not `active` stay at 0.
#[inline(always)]
pub(super) fn bracketed<V: Vector>(
    function: impl Function<V, V>,
    [at_zero, guess, high]: [V; 3],
    noise: V,
    active: V::Mask,
) -> V {
    let zero = V::splat(0.0);
    let half = V::splat(0.5);
    let (mut low, mut above) = (zero, high);
    let (mut at_low, mut at_above) = (at_zero, -at_zero);
    let mut x = zero;
    let mut pending = active & !at_low.abs().le(noise);
    let mut width = high;
    // Lanes whose last point took the place of the lower or the upper end.
    let none = V::Mask::from_bits(0);
    let (mut was_low, mut was_above) = (none, none);
    for step in 0..MOST {
        if !pending.any() {
            break;
        }
        let secant = match step {
            0 => guess,
            _ => low + (above - low) * (at_low / (at_low - at_above)),
        };
        let middle = (low + above) * 0.5;
        let inside = low.lt(secant) & secant.lt(above);
        let mut next = inside.select(secant, middle);
        if step % 3 == 2 {
            let slow = (width * 0.5).lt(above - low);
            next = slow.select(middle, next);
            width = above - low;
        }
        let value = function.at(next);
        let left = zero.lt(value);
        // An end that stays twice gets a smaller value, so that the next secant is nearer to it.
        let shrink = |old: V| {
            let factor = V::splat(1.0) - value / old;
            zero.lt(factor).select(factor, half)
        };
        let (moves_low, moves_above) = (pending & left, pending & !left);
        at_above = (moves_low & was_low).select(at_above * shrink(at_low), at_above);
        at_low = (moves_above & was_above).select(at_low * shrink(at_above), at_low);
        (was_low, was_above) = (moves_low, moves_above);
        low = moves_low.select(next, low);
        at_low = moves_low.select(value, at_low);
        above = moves_above.select(next, above);
        at_above = moves_above.select(value, at_above);
        x = pending.select(next, x);
        let done = value.abs().le(noise) | (above - low).le(above * TOLERANCE);
        pending = pending & !done;
    }
    if V::DERIVES {
        return active.select(x.implied(function.at(x.unknown())), x);
    }
    x
}

/// Root of an increasing function of one number in `[low, high]`, to the last digits: the slope from the last
/// two points, bisection where that leads outside or converges slowly. `None` where the function does not
/// change its sign.
pub(super) fn increasing_root(function: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2]) -> Option<f64> {
    let (mut at_low, mut at_high) = (function(low), function(high));
    if !(at_low <= 0.0 && at_high >= 0.0) {
        return None;
    }
    for round in 0..200 {
        let half = 0.5 * (low + high);
        // Regula falsi with weights halved on the side that stays (Illinois), every fourth time a half.
        let slope = low - at_low * (high - low) / (at_high - at_low);
        let middle = if round % 4 < 3 && slope > low && slope < high { slope } else { half };
        if middle <= low || middle >= high {
            break;
        }
        let value = function(middle);
        if value == 0.0 {
            return Some(middle);
        }
        if value < 0.0 {
            (low, at_low, at_high) = (middle, value, 0.5 * at_high);
        } else {
            (high, at_high, at_low) = (middle, value, 0.5 * at_low);
        }
    }
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::math::{exp, ln};
    use crate::simd::{LANES, Lanes, Mask};

    const ALL: u32 = (1 << LANES) - 1;

    /// `load - x - k x^n` from almost linear to almost a step, with roots from 1 down to 1e-30.
    fn power(x: Lanes, load: Lanes, n: f64) -> [Lanes; 2] {
        let power = exp(ln(x) * n);
        [load - x - power, Lanes::splat(-1.0) - power * n / x]
    }

    #[test]
    fn newton_finds_roots_of_powers() {
        for n in [0.05, 0.3, 0.5, 1.0, 2.0, 5.0] {
            let load = Lanes::new(std::array::from_fn(|lane| 10.0_f64.powi(1 - lane as i32)));
            let noise = load * f64::EPSILON;
            let x = newton(|x| power(x, load, n), load, load, noise, Mask::from_bits(ALL));
            let [value, slope] = power(x, load, n);
            for lane in 0..LANES {
                let at = |value: Lanes| value.to_array()[lane];
                let allowed = 8.0 * f64::EPSILON * at(load).max(-at(slope) * at(x));
                assert!(at(value).abs() <= allowed, "{n} {lane}: {} at {}", at(value), at(x));
            }
        }
    }

    #[test]
    fn brackets_close_on_roots_with_kinks() {
        for corner in [0.1, 0.5, 0.9] {
            let load = Lanes::new(std::array::from_fn(|lane| 0.05 + 0.1 * lane as f64));
            let function = |x: Lanes| load - x - (x - Lanes::splat(corner)).max(Lanes::splat(0.0)) * 50.0;
            let one = Lanes::splat(1.0);
            let points = [function(Lanes::splat(0.0)), load, one];
            let x = bracketed(function, points, one * 1e-16, Mask::from_bits(ALL));
            for value in function(x).to_array() {
                assert!(value.abs() <= 5e-14, "{value}");
            }
        }
    }

    #[test]
    fn a_lane_does_not_see_its_neighbours() {
        let loads: [f64; LANES] = std::array::from_fn(|lane| 0.3 + 0.1 * lane as f64);
        let solve =
            |load: Lanes| newton(|x| power(x, load, 0.3), load, load, load * 1e-16, Mask::from_bits(ALL));
        let together = solve(Lanes::new(loads)).to_array();
        for (lane, load) in loads.into_iter().enumerate() {
            assert_eq!(solve(Lanes::splat(load)).to_array()[0].to_bits(), together[lane].to_bits());
        }
    }
}
