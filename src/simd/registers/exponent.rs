//! Constants that take exponents of doubles apart and put them together.

/// 2^52 + 1023: adding it to a small integer leaves that integer, biased as an exponent, in the low bits.
pub(super) const EXPONENT_MAGIC: f64 = 4_503_599_627_370_496.0 + 1023.0;
/// Bits of 2^52.
pub(super) const TWO_52_BITS: u64 = 0x4330_0000_0000_0000;
/// Bits of the fraction of a double.
pub(super) const FRACTION_BITS: u64 = 0x000f_ffff_ffff_ffff;
/// Bits of 1.0.
pub(super) const ONE_BITS: u64 = 0x3ff0_0000_0000_0000;
