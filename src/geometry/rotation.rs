//! Rotation matrices.

/// The rotation by an angle (rad) about a unit axis, Rodrigues' formula: `R = I + sin(a) K + (1 - cos(a)) K²`
/// with `K x = axis × x`. In 2D the axis is z and the rest of the matrix is left out.
pub fn rotation<const D: usize>(axis: [f64; 3], angle: f64) -> [[f64; D]; D] {
    let [x, y, z] = axis;
    let k = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    // `libm`, since results must not depend on the library of the machine.
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let square: f64 = (0..3).map(|m| k[i][m] * k[m][j]).sum();
            f64::from(u8::from(i == j)) + sine * k[i][j] + (1.0 - cosine) * square
        })
    })
}
