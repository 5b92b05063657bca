//! Sums of floating-point numbers without rounding.
//!
//! An accumulator holds the sum as a fixed-point number that spans the whole range of `f64`, cut into
//! limbs of 32 bits that are kept in 64-bit words. Adding is integer arithmetic, hence associative: the
//! result does not depend on the order of the summands or on how they are spread over ranks and
//! threads. It is rounded once, when it is read.

use partition::comm::Comm;

/// Bits of one limb.
const LIMB: u32 = 32;
/// Bit 0 stands for 2^-1074, the smallest subnormal; the largest `f64` ends at bit 2097.
const LIMBS: usize = 68;
/// Words behind the limbs: number of NaN, +∞ and -∞ added.
const SPECIALS: usize = 3;
/// Additions after which the carries must be propagated. One addition changes a limb by less than 2^32.
const CARRY_EVERY: u32 = 1 << 30;

/// An exact sum of `f64` values.
#[derive(Clone, Debug)]
pub struct ExactSum {
    words: [i64; Self::WORDS],
    pending: u32,
}

impl Default for ExactSum {
    fn default() -> Self {
        Self::new()
    }
}

impl ExactSum {
    /// Number of words of an accumulator.
    pub const WORDS: usize = LIMBS + SPECIALS;

    /// The empty sum.
    pub fn new() -> Self {
        Self { words: [0; Self::WORDS], pending: 0 }
    }

    /// Adds a value.
    #[inline]
    pub fn add(&mut self, value: f64) {
        let bits = value.to_bits();
        let field = (bits >> 52) as usize & 0x7ff;
        let fraction = bits & ((1 << 52) - 1);
        if field == 0x7ff {
            let special = if fraction != 0 { 0 } else { 1 + (bits >> 63) as usize };
            self.words[LIMBS + special] += 1;
            return;
        }
        // Subnormals share the scale of the smallest normal numbers but lack the leading bit.
        let (mantissa, shift) = if field == 0 { (fraction, 0) } else { (fraction | 1 << 52, field - 1) };
        let spread = u128::from(mantissa) << (shift as u32 % LIMB);
        let first = shift / LIMB as usize;
        let sign = if bits >> 63 == 0 { 1 } else { -1 };
        for piece in 0..3 {
            self.words[first + piece] += sign * i64::from((spread >> (LIMB * piece as u32)) as u32);
        }
        self.pending += 1;
        if self.pending == CARRY_EVERY {
            self.carry();
        }
    }

    /// Adds another sum.
    pub fn merge(&mut self, other: &Self) {
        let mut other = other.clone();
        other.carry();
        self.carry();
        for (mine, theirs) in self.words.iter_mut().zip(other.words) {
            *mine += theirs;
        }
        self.pending = 1;
    }

    /// The words of the sum in their unique form: equal sums have equal words. Words of several sums (up to
    /// 2^30 of them) may be added entry by entry and passed to [`ExactSum::from_words`].
    pub fn words(&mut self) -> &[i64] {
        self.carry();
        &self.words
    }

    /// A sum from its words; `None` if their number is wrong.
    pub fn from_words(words: &[i64]) -> Option<Self> {
        let mut sum = Self { words: words.try_into().ok()?, pending: 0 };
        sum.carry();
        Some(sum)
    }

    /// Collective. Replaces each sum by its total over all ranks, with one reduction for all of them; without
    /// sums there is none.
    pub fn sum_over_ranks(comm: &Comm, sums: &mut [Self]) {
        if sums.is_empty() {
            return;
        }
        let mut words: Vec<i64> = sums.iter_mut().flat_map(|sum| sum.words().to_vec()).collect();
        comm.sum_i64(&mut words);
        for (sum, words) in sums.iter_mut().zip(words.chunks_exact(Self::WORDS)) {
            sum.words.copy_from_slice(words);
            sum.carry();
        }
    }

    /// Brings every limb but the last, which keeps the sign, into `0 .. 2^32`.
    fn carry(&mut self) {
        let mut carry = 0;
        for limb in &mut self.words[..LIMBS - 1] {
            let value = *limb + carry;
            carry = value >> LIMB;
            *limb = value & 0xffff_ffff;
        }
        self.words[LIMBS - 1] += carry;
        self.pending = 0;
    }

    /// The sum rounded to the nearest `f64`, ties to even.
    pub fn to_f64(&self) -> f64 {
        let [nans, plus, minus] = [0, 1, 2].map(|special| self.words[LIMBS + special] != 0);
        if nans || (plus && minus) {
            return f64::NAN;
        }
        if plus || minus {
            return if plus { f64::INFINITY } else { f64::NEG_INFINITY };
        }
        let mut sum = self.clone();
        sum.carry();
        let negative = sum.words[LIMBS - 1] < 0;
        if negative {
            sum.words[..LIMBS].iter_mut().for_each(|limb| *limb = -*limb);
            sum.carry();
        }
        let magnitude = sum.rounded_magnitude();
        if negative { -magnitude } else { magnitude }
    }

    /// Rounds a carried, non-negative sum.
    fn rounded_magnitude(&self) -> f64 {
        let limbs = &self.words[..LIMBS];
        let Some(top) = limbs.iter().rposition(|&limb| limb != 0) else { return 0.0 };
        let highest = top as u32 * LIMB + (limbs[top] as u64).ilog2();
        let bit = |at: u32| (limbs[((at / LIMB) as usize).min(LIMBS - 1)] as u64 >> (at % LIMB)) & 1;
        if highest < 53 {
            // Exactly representable: below 2^53 units of the smallest subnormal, the bit pattern is
            // the integer itself.
            return f64::from_bits(limbs[0] as u64 | (limbs[1] as u64) << LIMB);
        }
        let shift = highest - 52;
        if shift > 2045 {
            return f64::INFINITY;
        }
        let mantissa = (0..53).fold(0_u64, |sum, i| sum | bit(shift + i) << i);
        let half = bit(shift - 1) == 1;
        let rest = (0..shift - 1).rev().any(|at| bit(at) == 1);
        let up = half && (rest || mantissa & 1 == 1);
        // The leading bit of the mantissa adds 1 to the exponent field, and so does a carry out of it.
        f64::from_bits((u64::from(shift) << 52) + mantissa + u64::from(up))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sum(values: &[f64]) -> f64 {
        let mut sum = ExactSum::new();
        values.iter().for_each(|&v| sum.add(v));
        sum.to_f64()
    }

    #[test]
    fn single_values_come_back() {
        for value in
            [0.0, 1.0, -1.0, 0.1, f64::MAX, f64::MIN, f64::MIN_POSITIVE, 5e-324, -5e-324, 1e-310, 1e300]
        {
            assert_eq!(sum(&[value]).to_bits(), (value + 0.0).to_bits(), "{value:e}");
        }
    }

    #[test]
    fn rounding_is_to_nearest_even() {
        let ulp = f64::EPSILON;
        assert_eq!(sum(&[1.0, ulp / 2.0]), 1.0);
        assert_eq!(sum(&[1.0 + ulp, ulp / 2.0]), 1.0 + 2.0 * ulp);
        assert_eq!(sum(&[1.0, ulp / 2.0, 5e-324]), 1.0 + ulp);
        assert_eq!(sum(&[1.0, ulp / 2.0, -5e-324]), 1.0);
        assert_eq!(sum(&[2.0 - ulp, ulp / 2.0]), 2.0);
        assert_eq!(sum(&[f64::MAX, f64::MAX]), f64::INFINITY);
        assert_eq!(sum(&[f64::MAX, f64::MAX, f64::MIN]), f64::MAX);
        assert_eq!(sum(&[1e308, 1.0, -1e308]), 1.0);
        assert_eq!(sum(&[f64::MIN_POSITIVE, -5e-324]), f64::MIN_POSITIVE - 5e-324);
    }

    #[test]
    fn not_finite_values() {
        assert!(sum(&[f64::NAN, 1.0]).is_nan());
        assert!(sum(&[f64::INFINITY, f64::NEG_INFINITY]).is_nan());
        assert_eq!(sum(&[f64::NEG_INFINITY, 1.0]), f64::NEG_INFINITY);
    }

    #[test]
    fn words_of_the_wrong_number_are_refused() {
        assert!(ExactSum::from_words(&[0; 3]).is_none());
    }

    /// Sums that fit 128-bit integers, scaled by a power of two: an independent exact result.
    fn integers() -> impl Strategy<Value = (Vec<i64>, i32)> {
        (prop::collection::vec(-(1_i64 << 53)..(1 << 53), 0..60), -1000..900)
    }

    proptest! {
        #[test]
        fn equals_integer_arithmetic((values, scale) in integers()) {
            // Powers of two in this range are exact, and so is the product (normal numbers only).
            let factor = f64::from_bits(((scale + 1023) as u64) << 52);
            let scaled: Vec<f64> = values.iter().map(|&v| v as f64 * factor).collect();
            let exact: i128 = values.iter().map(|&v| i128::from(v)).sum();
            // The conversion from i128 rounds to nearest even, like the sum.
            prop_assert_eq!(sum(&scaled), exact as f64 * factor);
        }

        #[test]
        fn does_not_depend_on_order_or_grouping(
            values in prop::collection::vec(any::<f64>().prop_filter("finite", |v| v.is_finite()), 1..80),
            cut in 0_usize..80,
        ) {
            let mut forward = ExactSum::new();
            values.iter().for_each(|&v| forward.add(v));
            let (left, right) = values.split_at(cut.min(values.len()));
            let mut parts = [ExactSum::new(), ExactSum::new()];
            right.iter().rev().for_each(|&v| parts[0].add(v));
            left.iter().rev().for_each(|&v| parts[1].add(v));
            let mut merged = parts[0].clone();
            merged.merge(&parts[1]);
            prop_assert_eq!(merged.words(), forward.words());
            let added: Vec<i64> =
                parts[0].words().to_vec().iter().zip(parts[1].words()).map(|(a, b)| a + b).collect();
            let read = ExactSum::from_words(&added).map(|mut s| s.words().to_vec());
            prop_assert_eq!(read.as_deref(), Some(forward.words()));
        }

        #[test]
        fn cancels_exactly(values in prop::collection::vec(any::<f64>().prop_filter("finite", |v| v.is_finite()), 0..50)) {
            let mut all = ExactSum::new();
            values.iter().for_each(|&v| all.add(v));
            all.add(0.1);
            values.iter().for_each(|&v| all.add(-v));
            prop_assert_eq!(all.to_f64(), 0.1);
        }
    }
}
