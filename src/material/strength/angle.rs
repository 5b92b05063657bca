//! Angles of friction and dilation that may soften.
use crate::simd::Vector;

/// The angle (degrees) whose tangent is that of another over `factor`.
pub(in crate::material) fn weakened(degrees: f64, factor: f64) -> f64 {
    if factor == 1.0 {
        return degrees;
    }
    libm::atan(libm::tan(degrees.to_radians()) / factor).to_degrees()
}

/// Share of cohesion and `tan φ` that material with associated flow needs to be as strong as one with
/// friction angle φ and dilation angle ψ, in degrees: `cos ψ cos φ / (1 - sin ψ sin φ)` (Davis 1968).
pub(in crate::material) fn davis(friction: f64, dilation: f64) -> f64 {
    if friction == dilation {
        return 1.0;
    }
    let (friction, dilation) = (friction.to_radians(), dilation.to_radians());
    libm::cos(dilation) * libm::cos(friction) / (1.0 - libm::sin(dilation) * libm::sin(friction))
}

/// An angle that may soften.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct Angle {
    /// Sine and cosine at the start.
    pub sine: f64,
    pub cosine: f64,
    /// Decrease from the start to the residual state, radians.
    pub softens: f64,
}

impl Angle {
    /// From degrees at the start and at the end.
    pub(in crate::material) fn new(first: f64, last: f64) -> Self {
        let angle = first.to_radians();
        Self { sine: libm::sin(angle), cosine: libm::cos(angle), softens: (first - last).to_radians() }
    }

    /// Whether it is zero from the start to the residual state.
    pub(in crate::material) fn is_zero(self) -> bool {
        self.sine == 0.0 && self.softens == 0.0
    }

    /// Sine and cosine once a share `lost`, from 0 to 1, of the possible decrease has occurred.
    #[inline(always)]
    pub(in crate::material) fn softened<V: Vector>(self, lost: V) -> [V; 2] {
        let (sine, cosine) = (V::splat(self.sine), V::splat(self.cosine));
        if self.softens == 0.0 {
            return [sine, cosine];
        }
        // Taylor series of the change, which is below π/2.
        let x = lost * self.softens;
        let square = x * x;
        let [mut s, mut c] = [V::splat(1.0); 2];
        for term in (1..=11).rev() {
            let n = 2.0 * f64::from(term);
            s = (square * s).neg_mul_add(V::splat(1.0 / (n * (n + 1.0))), V::splat(1.0));
            c = (square * c).neg_mul_add(V::splat(1.0 / (n * (n - 1.0))), V::splat(1.0));
        }
        let s = x * s;
        [sine * c - cosine * s, cosine * c + sine * s]
    }
}
