//! Places on both sides of a number, exact to the last bit.

/// Places at a distance of about `offset` on both sides of x within the domain, whose mean is x exactly.
pub(super) fn sides(x: f64, offset: f64, extent: f64) -> (f64, f64) {
    // At most half the distance to a wall: a box is wider than that only within a millionth of a cell of the
    // wall.
    let offset = offset.min(0.5 * x).min(0.5 * (extent - x)).max(0.0);
    let (lower, upper) = opposite(x, offset);
    if upper < extent { (lower, upper) } else { (x, x) }
}

/// `(a - b', a + b')` with b' next to b, such that both are exact where `|b| <= |a|`; else rounded.
pub(super) fn opposite(a: f64, b: f64) -> (f64, f64) {
    // Away from zero numbers are coarser. The part of b that the sum retains is a multiple of the spacing of
    // numbers at a, so subtracting it again is exact.
    let far = a + b.abs().copysign(a);
    let near = a - (far - a);
    if b.is_sign_negative() == a.is_sign_negative() { (near, far) } else { (far, near) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn opposite_sides_are_exact(a in -1e3_f64..1e3, share in -1.0_f64..1.0) {
            let b = share * a;
            let (less, more) = opposite(a, b);
            prop_assert_eq!(more - a, a - less);
            prop_assert_eq!(0.5 * less + 0.5 * more, a);
            prop_assert!((more - a - b).abs() <= f64::EPSILON * a.abs());
        }

        #[test]
        fn sides_stay_in_the_domain(x in 0.0_f64..1.0, offset in 0.0_f64..2.0) {
            let (lower, upper) = sides(x, offset, 1.0);
            prop_assert!(lower >= 0.0 && upper < 1.0);
            prop_assert_eq!(upper - x, x - lower);
        }
    }

    #[test]
    fn at_the_walls() {
        assert_eq!(sides(0.0, 0.1, 1.0), (0.0, 0.0));
        let last = 1.0 - f64::EPSILON / 2.0;
        assert_eq!(sides(last, 0.1, 1.0), (last, last));
        assert_eq!(opposite(0.0, 0.5), (-0.5, 0.5));
        assert_eq!(opposite(0.0, -0.5), (0.5, -0.5));
        assert_eq!(opposite(-1.0, 0.5), (-1.5, -0.5));
    }
}
