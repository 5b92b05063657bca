//! A smooth rise.

/// From 0 at 0 to 1 at 1 on half a period of a cosine, `(1 - cos(π s)) / 2`; constant outside.
pub fn smooth_step(s: f64) -> f64 {
    if s <= 0.0 {
        0.0
    } else if s >= 1.0 {
        1.0
    } else {
        0.5 * (1.0 - libm::cos(std::f64::consts::PI * s))
    }
}
