//! [`Wide`]: a [`Vector`] as one register of AVX-512.
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::F64x4;
use super::exponent::{EXPONENT_MAGIC, FRACTION_BITS, ONE_BITS, TWO_52_BITS};
use crate::simd::{LANES, Vector, VectorMask};
use core::arch::x86_64::*;

/// One number for each of [`LANES`] particles. Only [`crate::simd::widest`] names it, for kernels on
/// processors that have the instructions.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(in crate::simd) struct Wide(__m512d);

/// One truth value for each of [`LANES`] particles.
#[derive(Clone, Copy, Debug)]
pub(in crate::simd) struct WideMask(__mmask8);

/// Calls intrinsics on registers.
macro_rules! intrinsic {
    ($call:expr) => {
        // SAFETY: no value of this type exists before `widest` has found AVX-512; registers only.
        unsafe { $call }
    };
}

impl Vector for Wide {
    type Mask = WideMask;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(intrinsic!(_mm512_set1_pd(value)))
    }
    #[inline(always)]
    fn load(from: &[f64; LANES]) -> Self {
        // SAFETY: AVX-512 as above; reads the array.
        Self(unsafe { _mm512_loadu_pd(from.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, to: &mut [f64; LANES]) {
        // SAFETY: AVX-512 as above; writes the array.
        unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(intrinsic!(_mm512_fmadd_pd(self.0, a.0, b.0)))
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self(intrinsic!(_mm512_fnmadd_pd(self.0, a.0, b.0)))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(intrinsic!(_mm512_sqrt_pd(self.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(intrinsic!(_mm512_abs_pd(self.0)))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self(intrinsic!(_mm512_roundscale_pd::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0)))
    }
    #[inline(always)]
    fn round(self) -> Self {
        Self(intrinsic!(_mm512_roundscale_pd::<{ _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC }>(self.0)))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(intrinsic!(_mm512_min_pd(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(intrinsic!(_mm512_max_pd(self.0, other.0)))
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let minus = Self::splat(-0.0).0;
        Self(intrinsic!(_mm512_or_pd(_mm512_andnot_pd(minus, self.0), _mm512_and_pd(minus, sign.0))))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> WideMask {
        WideMask(intrinsic!(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> WideMask {
        WideMask(intrinsic!(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        intrinsic!({
            let bits = _mm512_castpd_si512(self.0);
            let k = _mm512_or_si512(_mm512_srli_epi64::<52>(bits), _mm512_set1_epi64(TWO_52_BITS as i64));
            let fraction = _mm512_and_si512(bits, _mm512_set1_epi64(FRACTION_BITS as i64));
            let m = _mm512_or_si512(fraction, _mm512_set1_epi64(ONE_BITS as i64));
            (Self(_mm512_castsi512_pd(k)) - Self::splat(EXPONENT_MAGIC), Self(_mm512_castsi512_pd(m)))
        })
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        let biased = self + Self::splat(EXPONENT_MAGIC);
        Self(intrinsic!(_mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_castpd_si512(biased.0)))))
    }
    #[inline(always)]
    fn keep_wide() {
        // SAFETY: AVX-512 as above; a register becomes what it is.
        unsafe { core::arch::asm!("vpord zmm31, zmm31, zmm31", options(nomem, nostack, preserves_flags)) }
    }
    #[inline(always)]
    fn halves(self) -> [F64x4; 2] {
        intrinsic!([F64x4(_mm512_castpd512_pd256(self.0)), F64x4(_mm512_extractf64x4_pd::<1>(self.0))])
    }
    /// As [`Vector::write_rows`] in general, with eight shuffles and no more.
    #[inline(always)]
    fn write_rows(columns: [Self; 4], rows: &mut [F64x4; LANES]) {
        let [ae, bf, cg, dh] = Self::transpose(columns);
        let ([a, e], [b, f], [c, g], [d, h]) = (ae.halves(), bf.halves(), cg.halves(), dh.halves());
        *rows = [a, b, c, d, e, f, g, h];
    }
    /// Reads row by row, as they were written: a load of two would wait until both have left the store queue.
    #[inline(always)]
    fn columns(rows: &[F64x4; LANES]) -> [Self; 4] {
        Self::transpose([
            Self::join(rows[0], rows[4]),
            Self::join(rows[1], rows[5]),
            Self::join(rows[2], rows[6]),
            Self::join(rows[3], rows[7]),
        ])
    }
}

impl Wide {
    /// Transposes the lower four lanes of all and the upper four, each as a matrix; its own inverse.
    #[inline(always)]
    fn transpose([x, y, z, w]: [Self; 4]) -> [Self; 4] {
        intrinsic!({
            let (xy_even, xy_odd) = (_mm512_unpacklo_pd(x.0, y.0), _mm512_unpackhi_pd(x.0, y.0));
            let (zw_even, zw_odd) = (_mm512_unpacklo_pd(z.0, w.0), _mm512_unpackhi_pd(z.0, w.0));
            let low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
            let high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
            [
                Self(_mm512_permutex2var_pd(xy_even, low, zw_even)),
                Self(_mm512_permutex2var_pd(xy_odd, low, zw_odd)),
                Self(_mm512_permutex2var_pd(xy_even, high, zw_even)),
                Self(_mm512_permutex2var_pd(xy_odd, high, zw_odd)),
            ]
        })
    }

    /// Inverse of [`Vector::halves`].
    #[inline(always)]
    fn join(low: F64x4, high: F64x4) -> Self {
        Self(intrinsic!(_mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low.0), high.0)))
    }
}

impl VectorMask<Wide> for WideMask {
    #[inline(always)]
    fn select(self, a: Wide, b: Wide) -> Wide {
        Wide(intrinsic!(_mm512_mask_blend_pd(self.0, b.0, a.0)))
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(bits as __mmask8)
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for Wide {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(intrinsic!($intrinsic(self.0, other.0)))
            }
        }
    };
}
operator!(Add, add, _mm512_add_pd);
operator!(Sub, sub, _mm512_sub_pd);
operator!(Mul, mul, _mm512_mul_pd);
operator!(Div, div, _mm512_div_pd);

impl Neg for Wide {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(intrinsic!(_mm512_xor_pd(self.0, _mm512_set1_pd(-0.0))))
    }
}
impl AddAssign for Wide {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl Mul<f64> for Wide {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self * Self::splat(factor)
    }
}
impl BitAnd for WideMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}
impl BitOr for WideMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
impl Not for WideMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}
