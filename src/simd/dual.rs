//! [`Dual`]: a [`Vector`] whose numbers carry derivatives (forward differentiation).
//!
//! Operations are separate functions: code for derivatives runs once where kernels run a thousand times, and
//! is compiled for one instruction set only.
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::{F64x4, LANES, Lanes, Mask, Vector, VectorMask};

/// Directions of derivatives: as many as a tensor has principal values, and one for the unknown of a scalar
/// equation (see [`Vector::unknown`]).
pub const DIRECTIONS: usize = 4;
/// The direction of the unknown.
const UNKNOWN: usize = DIRECTIONS - 1;

/// One number for each of [`LANES`] particles, and its derivatives.
///
/// Comparisons see values alone, and what is constant between jumps has no derivative. That of a root is 0 at
/// 0: the norm of a tensor has none there.
#[derive(Clone, Copy, Debug)]
pub struct Dual {
    value: Lanes,
    slope: [Lanes; DIRECTIONS],
}

/// One truth value for each of [`LANES`] particles.
#[derive(Clone, Copy, Debug)]
pub struct DualMask(Mask);

impl Dual {
    /// A variable of the derivatives in this direction, with the derivative `slope` of its own.
    pub fn variable(value: Lanes, direction: usize, slope: Lanes) -> Self {
        let mut own = Self::from(value);
        own.slope[direction] = slope;
        own
    }

    /// The value.
    pub fn value(self) -> Lanes {
        self.value
    }

    /// The derivative in a direction.
    pub fn slope(self, direction: usize) -> Lanes {
        self.slope[direction]
    }

    /// A function of this with the given value and derivative there.
    #[inline(never)]
    fn chain(self, value: Lanes, derivative: Lanes) -> Self {
        Self { value, slope: self.slope.map(|slope| slope * derivative) }
    }

    /// `a self + b other` with derivatives of both, and the given value.
    #[inline(never)]
    fn mix(self, other: Self, value: Lanes, [a, b]: [Lanes; 2]) -> Self {
        let mut slope = self.slope;
        for (own, other) in slope.iter_mut().zip(other.slope) {
            *own = own.mul_add(a, other * b);
        }
        Self { value, slope }
    }
}

impl From<Lanes> for Dual {
    fn from(value: Lanes) -> Self {
        Self { value, slope: [Lanes::splat(0.0); DIRECTIONS] }
    }
}

impl Vector for Dual {
    type Mask = DualMask;

    const DERIVES: bool = true;

    fn splat(value: f64) -> Self {
        Lanes::splat(value).into()
    }
    fn load(from: &[f64; LANES]) -> Self {
        Lanes::load(from).into()
    }
    fn store(self, to: &mut [f64; LANES]) {
        self.value.store(to);
    }
    #[inline(never)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        let product = self.mix(a, self.value.mul_add(a.value, b.value), [a.value, self.value]);
        let one = Lanes::splat(1.0);
        product.mix(b, product.value, [one, one])
    }
    #[inline(never)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        (-self).mul_add(a, b)
    }
    #[inline(never)]
    fn sqrt(self) -> Self {
        let (root, zero) = (self.value.sqrt(), Lanes::splat(0.0));
        self.chain(root, zero.lt(root).select(Lanes::splat(0.5) / root, zero))
    }
    #[inline(never)]
    fn abs(self) -> Self {
        self.value.lt(Lanes::splat(0.0)).to_dual().select(-self, self)
    }
    fn floor(self) -> Self {
        self.value.floor().into()
    }
    fn round(self) -> Self {
        self.value.round().into()
    }
    #[inline(never)]
    fn min(self, other: Self) -> Self {
        self.lt(other).select(self, other)
    }
    #[inline(never)]
    fn max(self, other: Self) -> Self {
        other.lt(self).select(self, other)
    }
    #[inline(never)]
    fn copysign(self, sign: Self) -> Self {
        let (one, zero) = (Lanes::splat(1.0), Lanes::splat(0.0));
        let turns = (one.copysign(self.value) * one.copysign(sign.value)).lt(zero);
        turns.to_dual().select(-self, self)
    }
    #[inline(never)]
    fn lt(self, other: Self) -> DualMask {
        DualMask(self.value.lt(other.value))
    }
    #[inline(never)]
    fn le(self, other: Self) -> DualMask {
        DualMask(self.value.le(other.value))
    }
    #[inline(never)]
    fn split(self) -> (Self, Self) {
        let (exponent, significand) = self.value.split();
        (exponent.into(), self.chain(significand, significand / self.value))
    }
    fn power_of_two(self) -> Self {
        self.value.power_of_two().into()
    }
    fn halves(self) -> [F64x4; 2] {
        self.value.halves()
    }
    fn columns(rows: &[F64x4; LANES]) -> [Self; 4] {
        Lanes::columns(rows).map(Self::from)
    }
    fn unknown(self) -> Self {
        Self::variable(self.value, UNKNOWN, Lanes::splat(1.0))
    }
    #[inline(never)]
    fn implied(self, residual: Self) -> Self {
        let per_unknown = Lanes::splat(-1.0) / residual.slope[UNKNOWN];
        let mut root = Self { value: self.value, slope: residual.slope.map(|slope| slope * per_unknown) };
        root.slope[UNKNOWN] = Lanes::splat(0.0);
        root
    }
}

impl Add for Dual {
    type Output = Self;
    #[inline(never)]
    fn add(self, other: Self) -> Self {
        let one = Lanes::splat(1.0);
        self.mix(other, self.value + other.value, [one, one])
    }
}
impl Sub for Dual {
    type Output = Self;
    #[inline(never)]
    fn sub(self, other: Self) -> Self {
        let one = Lanes::splat(1.0);
        self.mix(other, self.value - other.value, [one, -one])
    }
}
impl Mul for Dual {
    type Output = Self;
    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        self.mix(other, self.value * other.value, [other.value, self.value])
    }
}
impl Mul<f64> for Dual {
    type Output = Self;
    #[inline(never)]
    fn mul(self, factor: f64) -> Self {
        self.chain(self.value * factor, Lanes::splat(factor))
    }
}
impl Div for Dual {
    type Output = Self;
    #[inline(never)]
    fn div(self, other: Self) -> Self {
        let (ratio, inverse) = (self.value / other.value, Lanes::splat(1.0) / other.value);
        self.mix(other, ratio, [inverse, -(ratio * inverse)])
    }
}
impl Neg for Dual {
    type Output = Self;
    #[inline(never)]
    fn neg(self) -> Self {
        self.chain(-self.value, Lanes::splat(-1.0))
    }
}
impl AddAssign for Dual {
    #[inline(never)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mask {
    fn to_dual(self) -> DualMask {
        DualMask(self)
    }
}

impl VectorMask<Dual> for DualMask {
    #[inline(never)]
    fn select(self, a: Dual, b: Dual) -> Dual {
        let mut slope = a.slope;
        for (own, other) in slope.iter_mut().zip(b.slope) {
            *own = self.0.select(*own, other);
        }
        Dual { value: self.0.select(a.value, b.value), slope }
    }
    fn bits(self) -> u32 {
        self.0.bits()
    }
    fn from_bits(bits: u32) -> Self {
        Self(Mask::from_bits(bits))
    }
}
impl BitAnd for DualMask {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}
impl BitOr for DualMask {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
impl Not for DualMask {
    type Output = Self;
    fn not(self) -> Self {
        Self(!self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::math::{exp, ln};

    /// Derivatives of all operations against closed forms.
    #[test]
    fn derivatives_are_those_of_calculus() {
        let at = [0.03, 0.4, 0.999, 1.0, 1.7, 5.0, 33.0, 4e4];
        let x = Dual::variable(Lanes::new(at), 1, Lanes::splat(1.0));
        let [two, three] = [2.0, 3.0].map(Dual::splat);
        type Case = (&'static str, Dual, fn(f64) -> f64);
        let cases: [Case; 12] = [
            ("sum", x + x, |_| 2.0),
            ("difference", two - x, |_| -1.0),
            ("product", x * x * 3.0, |x| 6.0 * x),
            ("quotient", two / (x + three), |x| -2.0 / ((x + 3.0) * (x + 3.0))),
            ("multiply-add", x.mul_add(x, x), |x| 2.0 * x + 1.0),
            ("negative multiply-add", x.neg_mul_add(two, x), |_| -1.0),
            ("root", x.sqrt(), |x| 0.5 / x.sqrt()),
            ("absolute value", (x - two).abs(), |x| if x < 2.0 { -1.0 } else { 1.0 }),
            ("sign", x.copysign(two - x), |x| if x > 2.0 { -1.0 } else { 1.0 }),
            ("minimum", x.min(two), |x| if x < 2.0 { 1.0 } else { 0.0 }),
            ("logarithm", ln(x), |x| 1.0 / x),
            ("exponential", exp(-x), |x| -libm::exp(-x)),
        ];
        for (name, dual, exact) in cases {
            for (lane, x) in at.into_iter().enumerate() {
                let (found, exact) = (dual.slope(1).to_array()[lane], exact(x));
                assert!((found - exact).abs() <= 4e-15 * exact.abs(), "{name} at {x}: {found} {exact}");
            }
            assert_eq!(dual.slope(0).to_array(), [0.0; LANES], "{name}");
        }
    }

    #[test]
    fn values_are_those_of_lanes() {
        let at = Lanes::new([0.03, 0.4, 0.999, 1.0, 1.7, 5.0, 33.0, 400.0]);
        let x = Dual::variable(at, 0, Lanes::splat(1.0));
        fn mixed<V: Vector>(x: V) -> V {
            let y = exp(ln(x) * 0.3) / x.sqrt();
            y.mul_add(x, x.neg_mul_add(y, x.floor())) - x.round().min(y).max(-x).copysign(y) * 2.0
        }
        assert_eq!(mixed(x).value().to_array().map(f64::to_bits), mixed(at).to_array().map(f64::to_bits));
    }
}
