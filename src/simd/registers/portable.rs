//! Four doubles as an array: for targets without AVX2, and the reference in tests.
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::exponent::{EXPONENT_MAGIC, FRACTION_BITS, ONE_BITS, TWO_52_BITS};

/// Four doubles.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct F64x4([f64; 4]);

/// Four truth values.
#[derive(Clone, Copy, Debug)]
pub struct Mask4([bool; 4]);

impl F64x4 {
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
    fn compare(self, other: Self, f: impl Fn(f64, f64) -> bool) -> Mask4 {
        Mask4(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
    /// All lanes equal to `value`.
    #[inline(always)]
    pub fn splat(value: f64) -> Self {
        Self([value; 4])
    }
    /// From an array.
    #[inline(always)]
    pub fn new(values: [f64; 4]) -> Self {
        Self(values)
    }
    /// To an array.
    #[inline(always)]
    pub fn to_array(self) -> [f64; 4] {
        self.0
    }
    /// `self * a + b`, rounded once.
    #[inline(always)]
    pub fn mul_add(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i].mul_add(a.0[i], b.0[i])))
    }
    /// `b - self * a`, rounded once.
    #[inline(always)]
    pub fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| (-self.0[i]).mul_add(a.0[i], b.0[i])))
    }
    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }
    /// Absolute value.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }
    /// Largest integer not above.
    #[inline(always)]
    pub fn floor(self) -> Self {
        Self(self.0.map(f64::floor))
    }
    /// Nearest integer, ties to even.
    #[inline(always)]
    pub fn round(self) -> Self {
        Self(self.0.map(f64::round_ties_even))
    }
    /// The smaller; `other` if they are equal or either is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    /// The larger; `other` if they are equal or either is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    /// `self` with the sign of `sign`.
    #[inline(always)]
    pub fn copysign(self, sign: Self) -> Self {
        self.zip(sign, f64::copysign)
    }
    /// `self < other`.
    #[inline(always)]
    pub fn lt(self, other: Self) -> Mask4 {
        self.compare(other, |a, b| a < b)
    }
    /// `self <= other`.
    #[inline(always)]
    pub fn le(self, other: Self) -> Mask4 {
        self.compare(other, |a, b| a <= b)
    }
    /// Exponent `k` and significand in `[1, 2)` of positive normal numbers: `self = m · 2^k`.
    #[inline(always)]
    pub fn split(self) -> (Self, Self) {
        let k = self.0.map(|x| f64::from_bits((x.to_bits() >> 52) | TWO_52_BITS) - EXPONENT_MAGIC);
        let m = self.0.map(|x| f64::from_bits((x.to_bits() & FRACTION_BITS) | ONE_BITS));
        (Self(k), Self(m))
    }
    /// `2^self` of integers in `-1022..=1023`.
    #[inline(always)]
    pub fn power_of_two(self) -> Self {
        Self(self.0.map(|k| f64::from_bits((k + EXPONENT_MAGIC).to_bits() << 52)))
    }
    /// Rows become columns.
    #[inline(always)]
    pub fn transpose(rows: [Self; 4]) -> [Self; 4] {
        std::array::from_fn(|i| Self(std::array::from_fn(|j| rows[j].0[i])))
    }
}

impl Mask4 {
    /// `a` where true, `b` where false.
    #[inline(always)]
    pub fn select(self, a: F64x4, b: F64x4) -> F64x4 {
        F64x4(std::array::from_fn(|i| if self.0[i] { a.0[i] } else { b.0[i] }))
    }
    /// Bit `i` is lane `i`.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        (0..4).fold(0, |bits, i| bits | u32::from(self.0[i]) << i)
    }
    /// Lane `i` is bit `i`.
    #[inline(always)]
    pub fn from_bits(bits: u32) -> Self {
        Self(std::array::from_fn(|i| bits >> i & 1 == 1))
    }
}

impl Add for F64x4 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}
impl Sub for F64x4 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}
impl Mul for F64x4 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}
impl Div for F64x4 {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
}
impl Neg for F64x4 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|a| -a))
    }
}
impl BitAnd for Mask4 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] && other.0[i]))
    }
}
impl BitOr for Mask4 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] || other.0[i]))
    }
}
impl Not for Mask4 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0.map(|a| !a))
    }
}
