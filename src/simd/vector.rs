//! Operations of a vector of particles.
use std::ops::{Add, AddAssign, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::F64x4;

/// Particles per batch.
pub const LANES: usize = 8;

/// One number for each of [`LANES`] particles, in whatever registers a kernel is compiled for.
pub trait Vector:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
{
    /// One truth value for each particle.
    type Mask: VectorMask<Self>;

    /// Whether numbers carry derivatives by the principal values of a tensor ([`super::Dual`]). Then tensors
    /// are diagonal: what finds principal axes step by step, or leaves the type, takes those of the
    /// coordinates.
    const DERIVES: bool = false;

    /// All lanes equal to `value`.
    fn splat(value: f64) -> Self;
    /// Reads from an array.
    fn load(from: &[f64; LANES]) -> Self;
    /// Writes to an array.
    fn store(self, to: &mut [f64; LANES]);
    /// `self * a + b`, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// `b - self * a`, rounded once.
    fn neg_mul_add(self, a: Self, b: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// Largest integer not above.
    fn floor(self) -> Self;
    /// Nearest integer, ties to even.
    fn round(self) -> Self;
    /// The smaller; `other` if they are equal or either is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger; `other` if they are equal or either is NaN.
    fn max(self, other: Self) -> Self;
    /// `self` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// Exponent `k` and significand in `[1, 2)` of positive normal numbers: `self = m · 2^k`.
    fn split(self) -> (Self, Self);
    /// `2^self` of integers in `-1022..=1023`.
    fn power_of_two(self) -> Self;
    /// To be called every fifty instructions or so where a kernel works on rows ([`F64x4`]) for long:
    /// processors that narrow their units after some hundred instructions without registers of 512 bits wait
    /// when such registers come again (see `docs/performance.md`). A hint without effect on results.
    #[inline(always)]
    fn keep_wide() {}
    /// The lower and the upper four lanes.
    fn halves(self) -> [F64x4; 2];
    /// Inverse of [`Vector::write_rows`].
    fn columns(rows: &[F64x4; LANES]) -> [Self; 4];

    /// Four numbers for each particle become one row of four per particle. Writes row by row, as they are
    /// read: data that are stored and loaded in different pieces wait in the store queue.
    #[inline(always)]
    fn write_rows(columns: [Self; 4], rows: &mut [F64x4; LANES]) {
        let [x, y, z, w] = columns;
        let ([x0, x1], [y0, y1], [z0, z1], [w0, w1]) = (x.halves(), y.halves(), z.halves(), w.halves());
        let [a, b, c, d] = F64x4::transpose([x0, y0, z0, w0]);
        let [e, f, g, h] = F64x4::transpose([x1, y1, z1, w1]);
        *rows = [a, b, c, d, e, f, g, h];
    }

    /// Where numbers carry derivatives, the same value as the unknown of an equation.
    #[inline(always)]
    fn unknown(self) -> Self {
        self
    }
    /// Where numbers carry derivatives, the same value with those that the theorem of implicit functions
    /// gives it as root of an equation; `residual` is that of the equation at [`Vector::unknown`].
    #[inline(always)]
    fn implied(self, _residual: Self) -> Self {
        self
    }

    /// From an array.
    #[inline(always)]
    fn new(values: [f64; LANES]) -> Self {
        Self::load(&values)
    }
    /// To an array.
    #[inline(always)]
    fn to_array(self) -> [f64; LANES] {
        let mut values = [0.0; LANES];
        self.store(&mut values);
        values
    }
}

/// One truth value for each of [`LANES`] particles.
pub trait VectorMask<V>: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// `a` where true, `b` where false.
    fn select(self, a: V, b: V) -> V;
    /// Bit `i` is lane `i`.
    fn bits(self) -> u32;
    /// Lane `i` is bit `i`.
    fn from_bits(bits: u32) -> Self;
    /// True if any lane is.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
    /// True if all lanes are.
    #[inline(always)]
    fn all(self) -> bool {
        self.bits() == (1 << LANES) - 1
    }
}

/// `map` of an array, which the compiler may not move out of line as it does with that of the standard
/// library.
#[inline(always)]
pub fn each<V: Vector, const N: usize>(mut values: [V; N], f: impl Fn(V) -> V) -> [V; N] {
    for value in &mut values {
        *value = f(*value);
    }
    values
}
