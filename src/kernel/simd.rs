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

/// 2^52 + 1023: adding it to a small integer leaves that integer, biased as an exponent, in the low bits.
const EXPONENT_MAGIC: f64 = 4_503_599_627_370_496.0 + 1023.0;
/// Bits of 2^52.
const TWO_52_BITS: u64 = 0x4330_0000_0000_0000;
/// Bits of the fraction of a double.
const FRACTION_BITS: u64 = 0x000f_ffff_ffff_ffff;
/// Bits of 1.0.
const ONE_BITS: u64 = 0x3ff0_0000_0000_0000;

#[cfg(any(test, not(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))))]
mod portable {
    use super::*;

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
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma"))]
mod avx {
    use super::*;
    use core::arch::x86_64::*;

    /// Four doubles in one register.
    #[derive(Clone, Copy, Debug)]
    #[repr(transparent)]
    pub struct F64x4(__m256d);

    /// Four truth values; a lane is all ones or all zeros.
    #[derive(Clone, Copy, Debug)]
    #[repr(transparent)]
    pub struct Mask4(__m256d);

    /// Calls intrinsics. The module exists only where AVX2 and FMA are enabled for the whole build,
    /// and the ones used here take and return registers, never pointers.
    macro_rules! intrinsic {
        ($call:expr) => {
            // SAFETY: the target has AVX2 and FMA (see `cfg` of this module); registers only.
            unsafe { $call }
        };
    }

    impl F64x4 {
        /// All lanes equal to `value`.
        #[inline(always)]
        pub fn splat(value: f64) -> Self {
            Self(intrinsic!(_mm256_set1_pd(value)))
        }
        /// From an array.
        #[inline(always)]
        pub fn new(values: [f64; 4]) -> Self {
            // SAFETY: same size, and every bit pattern is a value of both.
            Self(unsafe { core::mem::transmute::<[f64; 4], __m256d>(values) })
        }
        /// To an array.
        #[inline(always)]
        pub fn to_array(self) -> [f64; 4] {
            // SAFETY: same size, and every bit pattern is a value of both.
            unsafe { core::mem::transmute::<__m256d, [f64; 4]>(self.0) }
        }
        /// `self * a + b`, rounded once.
        #[inline(always)]
        pub fn mul_add(self, a: Self, b: Self) -> Self {
            Self(intrinsic!(_mm256_fmadd_pd(self.0, a.0, b.0)))
        }
        /// `b - self * a`, rounded once.
        #[inline(always)]
        pub fn neg_mul_add(self, a: Self, b: Self) -> Self {
            Self(intrinsic!(_mm256_fnmadd_pd(self.0, a.0, b.0)))
        }
        /// Square root.
        #[inline(always)]
        pub fn sqrt(self) -> Self {
            Self(intrinsic!(_mm256_sqrt_pd(self.0)))
        }
        /// Absolute value.
        #[inline(always)]
        pub fn abs(self) -> Self {
            Self(intrinsic!(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)))
        }
        /// Largest integer not above.
        #[inline(always)]
        pub fn floor(self) -> Self {
            Self(intrinsic!(_mm256_floor_pd(self.0)))
        }
        /// Nearest integer, ties to even.
        #[inline(always)]
        pub fn round(self) -> Self {
            Self(intrinsic!(_mm256_round_pd::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)))
        }
        /// The smaller; `other` if they are equal or either is NaN.
        #[inline(always)]
        pub fn min(self, other: Self) -> Self {
            Self(intrinsic!(_mm256_min_pd(self.0, other.0)))
        }
        /// The larger; `other` if they are equal or either is NaN.
        #[inline(always)]
        pub fn max(self, other: Self) -> Self {
            Self(intrinsic!(_mm256_max_pd(self.0, other.0)))
        }
        /// `self` with the sign of `sign`.
        #[inline(always)]
        pub fn copysign(self, sign: Self) -> Self {
            let minus = Self::splat(-0.0).0;
            Self(intrinsic!(_mm256_or_pd(_mm256_andnot_pd(minus, self.0), _mm256_and_pd(minus, sign.0))))
        }
        /// `self < other`.
        #[inline(always)]
        pub fn lt(self, other: Self) -> Mask4 {
            Mask4(intrinsic!(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)))
        }
        /// `self <= other`.
        #[inline(always)]
        pub fn le(self, other: Self) -> Mask4 {
            Mask4(intrinsic!(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0)))
        }
        /// Exponent `k` and significand in `[1, 2)` of positive normal numbers: `self = m · 2^k`.
        #[inline(always)]
        pub fn split(self) -> (Self, Self) {
            intrinsic!({
                let bits = _mm256_castpd_si256(self.0);
                let k =
                    _mm256_or_si256(_mm256_srli_epi64::<52>(bits), _mm256_set1_epi64x(TWO_52_BITS as i64));
                let fraction = _mm256_and_si256(bits, _mm256_set1_epi64x(FRACTION_BITS as i64));
                let m = _mm256_or_si256(fraction, _mm256_set1_epi64x(ONE_BITS as i64));
                (Self(_mm256_castsi256_pd(k)) - Self::splat(EXPONENT_MAGIC), Self(_mm256_castsi256_pd(m)))
            })
        }
        /// `2^self` of integers in `-1022..=1023`.
        #[inline(always)]
        pub fn power_of_two(self) -> Self {
            let biased = self + Self::splat(EXPONENT_MAGIC);
            Self(intrinsic!(_mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(biased.0)))))
        }
        /// Rows become columns.
        #[inline(always)]
        pub fn transpose(rows: [Self; 4]) -> [Self; 4] {
            let [a, b, c, d] = rows.map(|row| row.0);
            intrinsic!({
                let (ab_even, ab_odd) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
                let (cd_even, cd_odd) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
                [
                    Self(_mm256_permute2f128_pd::<0x20>(ab_even, cd_even)),
                    Self(_mm256_permute2f128_pd::<0x20>(ab_odd, cd_odd)),
                    Self(_mm256_permute2f128_pd::<0x31>(ab_even, cd_even)),
                    Self(_mm256_permute2f128_pd::<0x31>(ab_odd, cd_odd)),
                ]
            })
        }
    }

    impl Mask4 {
        /// `a` where true, `b` where false.
        #[inline(always)]
        pub fn select(self, a: F64x4, b: F64x4) -> F64x4 {
            F64x4(intrinsic!(_mm256_blendv_pd(b.0, a.0, self.0)))
        }
        /// Bit `i` is lane `i`.
        #[inline(always)]
        pub fn bits(self) -> u32 {
            intrinsic!(_mm256_movemask_pd(self.0)) as u32
        }
        /// Lane `i` is bit `i`.
        #[inline(always)]
        pub fn from_bits(bits: u32) -> Self {
            F64x4::splat(0.0).lt(F64x4::new(std::array::from_fn(|i| f64::from(bits >> i & 1))))
        }
    }

    macro_rules! operator {
        ($type:ty, $trait:ident, $method:ident, $intrinsic:ident) => {
            impl $trait for $type {
                type Output = Self;
                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    Self(intrinsic!($intrinsic(self.0, other.0)))
                }
            }
        };
    }
    operator!(F64x4, Add, add, _mm256_add_pd);
    operator!(F64x4, Sub, sub, _mm256_sub_pd);
    operator!(F64x4, Mul, mul, _mm256_mul_pd);
    operator!(F64x4, Div, div, _mm256_div_pd);
    operator!(Mask4, BitAnd, bitand, _mm256_and_pd);
    operator!(Mask4, BitOr, bitor, _mm256_or_pd);

    impl Neg for F64x4 {
        type Output = Self;
        #[inline(always)]
        fn neg(self) -> Self {
            Self(intrinsic!(_mm256_xor_pd(self.0, _mm256_set1_pd(-0.0))))
        }
    }
    impl Not for Mask4 {
        type Output = Self;
        #[inline(always)]
        fn not(self) -> Self {
            let ones = F64x4::splat(f64::from_bits(u64::MAX)).0;
            Self(intrinsic!(_mm256_xor_pd(self.0, ones)))
        }
    }
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
        let [a, b, c, d] = F64x4::transpose(columns.map(|column| column.0[0]));
        let [e, f, g, h] = F64x4::transpose(columns.map(|column| column.0[1]));
        [a, b, c, d, e, f, g, h]
    }
    /// Inverse of [`Lanes::rows`].
    #[inline(always)]
    pub fn columns(rows: [F64x4; LANES]) -> [Self; 4] {
        let [a, b, c, d, e, f, g, h] = rows;
        let (low, high) = (F64x4::transpose([a, b, c, d]), F64x4::transpose([e, f, g, h]));
        std::array::from_fn(|i| Self([low[i], high[i]]))
    }
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
mod tests {
    use super::*;

    /// Values with all kinds of signs, sizes and special cases.
    fn samples() -> Vec<[f64; 4]> {
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            let unit = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            unit * f64::from_bits((1023 + (state & 63)) << 52) * f64::exp2(-32.0)
        };
        let mut all: Vec<[f64; 4]> = (0..500).map(|_| std::array::from_fn(|_| next())).collect();
        all.push([0.0, -0.0, 1.0, -1.0]);
        all.push([f64::MIN_POSITIVE, f64::MAX, 0.5, -2.5]);
        all.push([1.5, 2.5, 1023.0, -1022.0]);
        all
    }

    fn same(a: [f64; 4], b: [f64; 4], what: &str) {
        assert_eq!(a.map(f64::to_bits), b.map(f64::to_bits), "{what}: {a:?} {b:?}");
    }

    #[test]
    fn both_implementations_give_the_same_bits() {
        let all = samples();
        for (i, &x) in all.iter().enumerate() {
            let (y, z) = (all[(i + 7) % all.len()], all[(i + 31) % all.len()]);
            let (a, b, c) = (F64x4::new(x), F64x4::new(y), F64x4::new(z));
            let (p, q, r) = (portable::F64x4::new(x), portable::F64x4::new(y), portable::F64x4::new(z));
            same((a + b).to_array(), (p + q).to_array(), "add");
            same((a - b).to_array(), (p - q).to_array(), "sub");
            same((a * b).to_array(), (p * q).to_array(), "mul");
            same((-a).to_array(), (-p).to_array(), "neg");
            same(a.mul_add(b, c).to_array(), p.mul_add(q, r).to_array(), "mul_add");
            same(a.neg_mul_add(b, c).to_array(), p.neg_mul_add(q, r).to_array(), "neg_mul_add");
            same(a.abs().sqrt().to_array(), p.abs().sqrt().to_array(), "sqrt");
            same(a.floor().to_array(), p.floor().to_array(), "floor");
            same(a.round().to_array(), p.round().to_array(), "round");
            same(a.min(b).to_array(), p.min(q).to_array(), "min");
            same(a.max(b).to_array(), p.max(q).to_array(), "max");
            same(a.copysign(b).to_array(), p.copysign(q).to_array(), "copysign");
            if y.iter().all(|y| *y != 0.0) {
                same((a / b).to_array(), (p / q).to_array(), "div");
            }
            let positive = x.map(|x| x.abs().max(f64::MIN_POSITIVE));
            let ((k, m), (n, o)) = (F64x4::new(positive).split(), portable::F64x4::new(positive).split());
            same(k.to_array(), n.to_array(), "exponent");
            same(m.to_array(), o.to_array(), "significand");
            same(k.power_of_two().to_array(), n.power_of_two().to_array(), "power of two");
            same((m * k.power_of_two()).to_array(), positive, "split and joined");
            let (masks, portables) = ([a.lt(b), a.le(b)], [p.lt(q), p.le(q)]);
            for (mask, other) in masks.into_iter().zip(portables) {
                assert_eq!(mask.bits(), other.bits());
                assert_eq!((!mask).bits(), (!other).bits());
                assert_eq!((mask & a.le(c)).bits(), (other & p.le(r)).bits());
                assert_eq!((mask | a.le(c)).bits(), (other | p.le(r)).bits());
                same(mask.select(a, b).to_array(), other.select(p, q).to_array(), "select");
            }
            let (rows, others) = (F64x4::transpose([a, b, c, a]), portable::F64x4::transpose([p, q, r, p]));
            for i in 0..4 {
                same(rows[i].to_array(), others[i].to_array(), "transpose");
            }
        }
        for bits in 0..16 {
            assert_eq!(Mask4::from_bits(bits).bits(), bits);
            assert_eq!(portable::Mask4::from_bits(bits).bits(), bits);
        }
    }

    #[test]
    fn rows_and_columns_are_inverse() {
        let columns: [Lanes; 4] =
            std::array::from_fn(|c| Lanes::new(std::array::from_fn(|lane| (10 * c + lane) as f64)));
        let rows = Lanes::rows(columns);
        for (lane, row) in rows.iter().enumerate() {
            assert_eq!(row.to_array(), std::array::from_fn(|c| (10 * c + lane) as f64));
        }
        let back = Lanes::columns(rows);
        for c in 0..4 {
            assert_eq!(back[c].to_array(), columns[c].to_array());
        }
        assert_eq!(Mask::from_bits(0b1010_0110).bits(), 0b1010_0110);
    }
}
