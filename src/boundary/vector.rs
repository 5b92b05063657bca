//! Vectors of space with products that are rounded once, as contact and rigid bodies take them; those of
//! [`crate::geometry::vector`] round each product.

/// Euclidean length.
pub(crate) fn length(vector: &[f64]) -> f64 {
    vector.iter().fold(0.0, |sum: f64, c| c.mul_add(*c, sum)).sqrt()
}

/// Cross product.
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        a[i].mul_add(b[j], -(a[j] * b[i]))
    })
}

pub(super) fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).fold(0.0, |sum, k| a[k].mul_add(b[k], sum))
}

/// A vector of space as one of the job.
pub(super) fn in_plane<const D: usize>(v: &[f64; 3]) -> [f64; D] {
    std::array::from_fn(|a| v[a])
}
