//! Explicit vectors of `f64`: the only module of this crate with CPU intrinsics.
//!
//! [`F64x4`] is one AVX register where the build has AVX2 and FMA and an array of four numbers
//! elsewhere. Both do the same IEEE 754 operations, each correctly rounded, so a result never depends
//! on which of them was compiled. [`Lanes`] is what the kernels compute with: [`LANES`] particles at
//! a time, wide enough to keep independent chains of operations in flight.

use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Particles per batch.
pub const LANES: usize = 8;

#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
pub use avx::{F64x4, Mask4};
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma")))]
pub use portable::{F64x4, Mask4};

pub use dispatch::{Kernel, widest};

/// 2^52 + 1023: adding it to a small integer leaves that integer, biased as an exponent, in the low bits.
const EXPONENT_MAGIC: f64 = 4_503_599_627_370_496.0 + 1023.0;
/// Bits of 2^52.
const TWO_52_BITS: u64 = 0x4330_0000_0000_0000;
/// Bits of the fraction of a double.
const FRACTION_BITS: u64 = 0x000f_ffff_ffff_ffff;
/// Bits of 1.0.
const ONE_BITS: u64 = 0x3ff0_0000_0000_0000;

#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
mod avx;
mod dispatch;
#[cfg(any(test, not(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))))]
mod portable;

/// Asks the processor to fetch the cache line at an address, which need not be valid; a hint without effect on results.
#[inline(always)]
pub fn prefetch(address: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch of any address is allowed, and never faults.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(core::ptr::without_provenance(address)) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}

/// One number for each of [`LANES`] particles.
#[derive(Clone, Copy, Debug)]
pub struct Lanes(pub(crate) [F64x4; 2]);

/// One truth value for each of [`LANES`] particles.
#[derive(Clone, Copy, Debug)]
pub struct Mask([Mask4; 2]);

impl Lanes {
    /// All lanes equal to `value`.
    #[inline(always)]
    pub fn splat(value: f64) -> Self {
        Self([F64x4::splat(value); 2])
    }
    /// From an array.
    #[inline(always)]
    pub fn new(values: [f64; LANES]) -> Self {
        let [a, b, c, d, e, f, g, h] = values;
        Self([F64x4::new([a, b, c, d]), F64x4::new([e, f, g, h])])
    }
    /// Reads from an array.
    #[inline(always)]
    pub fn load(from: &[f64; LANES]) -> Self {
        let (low, high) = from.split_at(4);
        let mut parts = [[0.0; 4]; 2];
        parts[0].copy_from_slice(low);
        parts[1].copy_from_slice(high);
        Self([F64x4::new(parts[0]), F64x4::new(parts[1])])
    }
    /// Writes to an array.
    #[inline(always)]
    pub fn store(self, to: &mut [f64; LANES]) {
        to[..4].copy_from_slice(&self.0[0].to_array());
        to[4..].copy_from_slice(&self.0[1].to_array());
    }
    /// To an array.
    #[inline(always)]
    pub fn to_array(self) -> [f64; LANES] {
        let ([a, b, c, d], [e, f, g, h]) = (self.0[0].to_array(), self.0[1].to_array());
        [a, b, c, d, e, f, g, h]
    }
    #[inline(always)]
    fn each(self, f: impl Fn(F64x4) -> F64x4) -> Self {
        Self([f(self.0[0]), f(self.0[1])])
    }
    #[inline(always)]
    fn pair(self, other: Self, f: impl Fn(F64x4, F64x4) -> F64x4) -> Self {
        Self([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
    }
    /// `self * a + b`, rounded once.
    #[inline(always)]
    pub fn mul_add(self, a: Self, b: Self) -> Self {
        Self([self.0[0].mul_add(a.0[0], b.0[0]), self.0[1].mul_add(a.0[1], b.0[1])])
    }
    /// `b - self * a`, rounded once.
    #[inline(always)]
    pub fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self([self.0[0].neg_mul_add(a.0[0], b.0[0]), self.0[1].neg_mul_add(a.0[1], b.0[1])])
    }
    /// Square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.each(F64x4::sqrt)
    }
    /// Absolute value.
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.each(F64x4::abs)
    }
    /// Largest integer not above.
    #[inline(always)]
    pub fn floor(self) -> Self {
        self.each(F64x4::floor)
    }
    /// Nearest integer, ties to even.
    #[inline(always)]
    pub fn round(self) -> Self {
        self.each(F64x4::round)
    }
    /// The smaller; `other` if they are equal or either is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.pair(other, F64x4::min)
    }
    /// The larger; `other` if they are equal or either is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.pair(other, F64x4::max)
    }
    /// `self` with the sign of `sign`.
    #[inline(always)]
    pub fn copysign(self, sign: Self) -> Self {
        self.pair(sign, F64x4::copysign)
    }
    /// `self < other`.
    #[inline(always)]
    pub fn lt(self, other: Self) -> Mask {
        Mask([self.0[0].lt(other.0[0]), self.0[1].lt(other.0[1])])
    }
    /// `self <= other`.
    #[inline(always)]
    pub fn le(self, other: Self) -> Mask {
        Mask([self.0[0].le(other.0[0]), self.0[1].le(other.0[1])])
    }
    /// Exponent `k` and significand in `[1, 2)` of positive normal numbers: `self = m · 2^k`.
    #[inline(always)]
    pub fn split(self) -> (Self, Self) {
        let ((k0, m0), (k1, m1)) = (self.0[0].split(), self.0[1].split());
        (Self([k0, k1]), Self([m0, m1]))
    }
    /// `2^self` of integers in `-1022..=1023`.
    #[inline(always)]
    pub fn power_of_two(self) -> Self {
        self.each(F64x4::power_of_two)
    }
    /// Four numbers for each particle become one row of four per particle.
    #[inline(always)]
    pub fn rows(columns: [Self; 4]) -> [F64x4; LANES] {
        let [x, y, z, w] = columns;
        let [a, b, c, d] = F64x4::transpose([x.0[0], y.0[0], z.0[0], w.0[0]]);
        let [e, f, g, h] = F64x4::transpose([x.0[1], y.0[1], z.0[1], w.0[1]]);
        [a, b, c, d, e, f, g, h]
    }
    /// Inverse of [`Lanes::rows`].
    #[inline(always)]
    pub fn columns(rows: [F64x4; LANES]) -> [Self; 4] {
        let [a, b, c, d, e, f, g, h] = rows;
        let [x0, y0, z0, w0] = F64x4::transpose([a, b, c, d]);
        let [x1, y1, z1, w1] = F64x4::transpose([e, f, g, h]);
        [Self([x0, x1]), Self([y0, y1]), Self([z0, z1]), Self([w0, w1])]
    }
}

/// `map` of an array, which the compiler may not move out of line as it does with that of the standard library.
#[inline(always)]
pub fn each<const N: usize>(mut values: [Lanes; N], f: impl Fn(Lanes) -> Lanes) -> [Lanes; N] {
    for value in &mut values {
        *value = f(*value);
    }
    values
}

impl Mask {
    /// `a` where true, `b` where false.
    #[inline(always)]
    pub fn select(self, a: Lanes, b: Lanes) -> Lanes {
        Lanes([self.0[0].select(a.0[0], b.0[0]), self.0[1].select(a.0[1], b.0[1])])
    }
    /// Bit `i` is lane `i`.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0[0].bits() | self.0[1].bits() << 4
    }
    /// Lanes that are set, as the lowest bit of each byte.
    #[inline(always)]
    pub fn bytes(self) -> u64 {
        // Byte i gets bit i of eight, from where carries bring it to the highest bit of the byte.
        let bits = u64::from(self.bits()).wrapping_mul(0x0101_0101_0101_0101) & 0x8040_2010_0804_0201;
        (bits.wrapping_add(0x0040_6070_787c_7e7f) >> 7) & 0x0101_0101_0101_0101
    }

    /// Lane `i` is bit `i`.
    #[inline(always)]
    pub fn from_bits(bits: u32) -> Self {
        Self([Mask4::from_bits(bits & 15), Mask4::from_bits(bits >> 4)])
    }
    /// True if any lane is.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.bits() != 0
    }
    /// True if all lanes are.
    #[inline(always)]
    pub fn all(self) -> bool {
        self.bits() == (1 << LANES) - 1
    }
}

macro_rules! lane_operator {
    ($type:ty, $trait:ident, $method:ident) => {
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self([self.0[0].$method(other.0[0]), self.0[1].$method(other.0[1])])
            }
        }
    };
}
lane_operator!(Lanes, Add, add);
lane_operator!(Lanes, Sub, sub);
lane_operator!(Lanes, Mul, mul);
lane_operator!(Lanes, Div, div);
lane_operator!(Mask, BitAnd, bitand);
lane_operator!(Mask, BitOr, bitor);

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|x| -x)
    }
}
impl Not for Mask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self([!self.0[0], !self.0[1]])
    }
}
impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl Mul<f64> for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self * Self::splat(factor)
    }
}

#[cfg(test)]
mod tests;
