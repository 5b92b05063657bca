//! [`Lanes`]: a [`Vector`] as two groups of four numbers, for any target.
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::{F64x4, LANES, Mask4, Vector, VectorMask};

/// One number for each of [`LANES`] particles. Lies in one line of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Lanes([F64x4; 2]);

/// One truth value for each of [`LANES`] particles.
#[derive(Clone, Copy, Debug)]
pub struct Mask([Mask4; 2]);

impl Lanes {
    /// The lanes in place.
    #[inline(always)]
    pub fn as_array(&self) -> &[f64; LANES] {
        // SAFETY: both are eight doubles without gaps.
        unsafe { &*std::ptr::from_ref(self).cast() }
    }
    /// The lanes in place, mutable.
    #[inline(always)]
    pub fn as_array_mut(&mut self) -> &mut [f64; LANES] {
        // SAFETY: both are eight doubles without gaps, of which any bits are a value.
        unsafe { &mut *std::ptr::from_mut(self).cast() }
    }
    #[inline(always)]
    fn each(self, f: impl Fn(F64x4) -> F64x4) -> Self {
        Self([f(self.0[0]), f(self.0[1])])
    }
    #[inline(always)]
    fn pair(self, other: Self, f: impl Fn(F64x4, F64x4) -> F64x4) -> Self {
        Self([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
    }
}

impl Vector for Lanes {
    type Mask = Mask;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([F64x4::splat(value); 2])
    }
    #[inline(always)]
    fn load(from: &[f64; LANES]) -> Self {
        let [a, b, c, d, e, f, g, h] = *from;
        Self([F64x4::new([a, b, c, d]), F64x4::new([e, f, g, h])])
    }
    #[inline(always)]
    fn store(self, to: &mut [f64; LANES]) {
        to[..4].copy_from_slice(&self.0[0].to_array());
        to[4..].copy_from_slice(&self.0[1].to_array());
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self([self.0[0].mul_add(a.0[0], b.0[0]), self.0[1].mul_add(a.0[1], b.0[1])])
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self([self.0[0].neg_mul_add(a.0[0], b.0[0]), self.0[1].neg_mul_add(a.0[1], b.0[1])])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.each(F64x4::sqrt)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.each(F64x4::abs)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        self.each(F64x4::floor)
    }
    #[inline(always)]
    fn round(self) -> Self {
        self.each(F64x4::round)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.pair(other, F64x4::min)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.pair(other, F64x4::max)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        self.pair(sign, F64x4::copysign)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask {
        Mask([self.0[0].lt(other.0[0]), self.0[1].lt(other.0[1])])
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask {
        Mask([self.0[0].le(other.0[0]), self.0[1].le(other.0[1])])
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let ((k0, m0), (k1, m1)) = (self.0[0].split(), self.0[1].split());
        (Self([k0, k1]), Self([m0, m1]))
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.each(F64x4::power_of_two)
    }
    #[inline(always)]
    fn halves(self) -> [F64x4; 2] {
        self.0
    }
    #[inline(always)]
    fn columns(rows: &[F64x4; LANES]) -> [Self; 4] {
        let [a, b, c, d, e, f, g, h] = *rows;
        let [x0, y0, z0, w0] = F64x4::transpose([a, b, c, d]);
        let [x1, y1, z1, w1] = F64x4::transpose([e, f, g, h]);
        [Self([x0, x1]), Self([y0, y1]), Self([z0, z1]), Self([w0, w1])]
    }
}

impl Mask {
    /// Lanes that are set, as the lowest bit of each byte.
    #[inline(always)]
    pub fn bytes(self) -> u64 {
        // Byte i gets bit i of eight, from where carries bring it to the highest bit of the byte.
        let bits = u64::from(self.bits()).wrapping_mul(0x0101_0101_0101_0101) & 0x8040_2010_0804_0201;
        (bits.wrapping_add(0x0040_6070_787c_7e7f) >> 7) & 0x0101_0101_0101_0101
    }
}

impl VectorMask<Lanes> for Mask {
    #[inline(always)]
    fn select(self, a: Lanes, b: Lanes) -> Lanes {
        Lanes([self.0[0].select(a.0[0], b.0[0]), self.0[1].select(a.0[1], b.0[1])])
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        self.0[0].bits() | self.0[1].bits() << 4
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self([Mask4::from_bits(bits & 15), Mask4::from_bits(bits >> 4)])
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
