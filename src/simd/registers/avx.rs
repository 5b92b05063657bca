//! Four doubles in an AVX register.
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::exponent::{EXPONENT_MAGIC, FRACTION_BITS, ONE_BITS, TWO_52_BITS};
use core::arch::x86_64::*;

/// Four doubles in one register.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct F64x4(pub(super) __m256d);

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
            let k = _mm256_or_si256(_mm256_srli_epi64::<52>(bits), _mm256_set1_epi64x(TWO_52_BITS as i64));
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
        let [Self(a), Self(b), Self(c), Self(d)] = rows;
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
