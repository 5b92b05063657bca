//! GIMP weights of one axis (Bardenhagen & Kober 2004) for boxes at most one cell wide.
//!
//! The weight of a node is the average over the box of the node's hat function, the gradient the
//! average of its derivative. A box `[lo, hi]` in cell units, `lo` in the cell of the lowest node,
//! covers `a` of that cell and `b` of the next; integrating the hats over the two parts gives
//! ```text
//! w0 = a (1 - (lo + m)/2) / V        dw0 = -a / (V h)
//! w1 = (a (lo + m)/2 + b (1 - b/2)) / V    dw1 = (a - b) / (V h)
//! w2 = b² / (2 V)                    dw2 = b / (V h)
//! ```
//! with `m = min(hi, 1)`, `a = m - lo`, `b = max(hi - 1, 0)`, `V = a + b`.
//!
//! Where the box reaches across a grid line the outer weights are `a²/(2V)` and `b²/(2V)`: they vanish as the
//! squares of their slopes. Rounding must keep that, down to overlaps of one unit of the last place: the
//! impulse of stress goes with the slope, and a node that gets an impulse without mass takes on any velocity.
//! So `1 - (lo + m)/2` is evaluated as `((1 - lo) + (1 - m))/2`, whose differences are exact near 1.
//!
//! In axisymmetry the first axis is the radius r, and all means carry r over the radius r_p of the particle.
//! A hat is linear over a part of the box, so with the part's middle m and width a (in cells, from the axis)
//! and the hat's mean `n` the mean of hat times radius is `n m ± a²/12`, with the sign of its slope. Weights
//! are sums of such terms and keep the property above: next to an overlap they are its square.
use super::BLOCK;
use crate::simd::Vector;

/// Three nodes of one axis for a batch of boxes.
#[derive(Clone, Copy, Debug)]
pub struct Axis<V> {
    /// Lowest node of the stencil, counted from the corner of the block: an integer in -1..=3.
    pub base: V,
    /// Weights.
    pub weight: [V; 3],
    /// Derivatives of the weights, 1/m.
    pub slope: [V; 3],
}

/// The parts of a box in the cell of its lowest node and in the next; lengths in cells from that node.
#[derive(Clone, Copy)]
struct Parts<V> {
    base: V,
    /// Widths.
    a: V,
    b: V,
    /// Shares of the box.
    a_share: V,
    b_share: V,
    /// Middle of the first part, and its distance from the next node.
    mean: V,
    mean_to_one: V,
    /// Half the width of the second part.
    half_b: V,
}

impl<V: Vector> Parts<V> {
    #[inline(always)]
    fn new(centre: V, half: V) -> Self {
        let zero = V::splat(0.0);
        let one = V::splat(1.0);
        let lower = centre - half;
        // The bounds matter only for centres that round to the upper face of the block.
        let base = lower.floor().max(V::splat(-1.0)).min(V::splat(BLOCK as f64 - 1.0));
        let low = lower - base;
        let high = half.mul_add(V::splat(2.0), low);
        let middle = high.min(one);
        let a = (middle - low).max(zero);
        let b = (high - one).max(zero);
        let volume_inverse = one / (a + b);
        Self {
            base,
            a,
            b,
            a_share: a * volume_inverse,
            b_share: b * volume_inverse,
            mean: (low + middle) * 0.5,
            mean_to_one: ((one - low) + (one - middle)) * 0.5,
            half_b: b * 0.5,
        }
    }
}

impl<V: Vector> Axis<V> {
    /// Weights of boxes centred at `centre` with half width `half`, both in cells and relative to the
    /// corner of the block. `half` is at most 1/2 and the centre lies in the block. `inverse_cell` is
    /// 1 / cell edge, 1/m.
    #[inline(always)]
    pub fn new(centre: V, half: V, inverse_cell: f64) -> Self {
        let Parts { base, a_share, b_share, mean, mean_to_one, half_b, .. } = Parts::new(centre, half);
        let one = V::splat(1.0);
        let weight =
            [a_share * mean_to_one, a_share.mul_add(mean, b_share * (one - half_b)), b_share * half_b];
        let (a_slope, b_slope) = (a_share * inverse_cell, b_share * inverse_cell);
        Self { base, weight, slope: [-a_slope, a_slope - b_slope, b_slope] }
    }

    /// As [`Axis::new`] along the radius of an axisymmetric domain, for a particle at `radius`, m: weights
    /// `∫ N r dr` and slopes `∫ N' r dr`, each over the radius and the width of the box. `corner` is
    /// the radius of the block's corner, m.
    #[inline(always)]
    pub fn revolved(centre: V, half: V, cell: f64, corner: f64, radius: V) -> Self {
        let parts = Parts::new(centre, half);
        let Parts { base, a, b, a_share, b_share, mean, mean_to_one, half_b } = parts;
        let one = V::splat(1.0);
        let inverse = V::splat(cell) / radius;
        let first = base + V::splat(corner / cell);
        let (a_radius, b_radius) = ((first + mean) * inverse, (first + one + half_b) * inverse);
        let twelfth = inverse * (1.0 / 12.0);
        let (a_bend, b_bend) = (a * a * twelfth, b * b * twelfth);
        let weight = [
            a_share * (mean_to_one * a_radius - a_bend),
            a_share * (mean * a_radius + a_bend) + b_share * ((one - half_b) * b_radius - b_bend),
            b_share * (half_b * b_radius + b_bend),
        ];
        let inverse_cell = 1.0 / cell;
        let a_slope = a_share * a_radius * inverse_cell;
        let b_slope = b_share * b_radius * inverse_cell;
        Self { base, weight, slope: [-a_slope, a_slope - b_slope, b_slope] }
    }

    /// Node minus particle, m, for a particle at `position` cells from the corner of the block.
    #[inline(always)]
    pub fn offsets(&self, position: V, cell: f64) -> [V; 3] {
        let first = self.base - position;
        let at = |i: f64| (first + V::splat(i)) * cell;
        [at(0.0), at(1.0), at(2.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{LANES, Lanes};

    /// Centres over a block and half widths from tiny to half a cell, aligned ones among them.
    fn boxes() -> Vec<(f64, f64)> {
        let halves = [0.5, 0.25, 0.125, 0.1, 1.0 / 3.0, 0.499_999, 1e-3, 1e-6];
        let mut all = Vec::new();
        for half in halves {
            for i in 0..4000 {
                all.push((i as f64 / 1000.0 + 1e-9, half));
            }
            all.extend((0..32).map(|i| (i as f64 / 8.0, half)));
        }
        all
    }

    #[test]
    fn unity_linear_reproduction_and_sign() {
        for chunk in boxes().chunks_exact(LANES) {
            let centre = Lanes::new(std::array::from_fn(|lane| chunk[lane].0));
            let half = Lanes::new(std::array::from_fn(|lane| chunk[lane].1));
            let axis = Axis::new(centre, half, 8.0);
            let offset = axis.offsets(centre, 0.125);
            for lane in 0..LANES {
                let (x, l) = chunk[lane];
                let at = |lanes: &[Lanes; 3]| lanes.map(|v| v.to_array()[lane]);
                let (w, dw, d) = (at(&axis.weight), at(&axis.slope), at(&offset));
                let base = axis.base.to_array()[lane];
                assert!((-1.0..=3.0).contains(&base) && base == base.floor());
                assert!(w.iter().all(|w| *w >= 0.0));
                assert!((w.iter().sum::<f64>() - 1.0).abs() <= 4.0 * f64::EPSILON);
                assert!((0..3).map(|i| w[i] * d[i]).sum::<f64>().abs() <= 8.0 * f64::EPSILON);
                let slope = f64::EPSILON * 32.0 / l;
                assert!(dw.iter().sum::<f64>().abs() <= slope);
                assert!(((0..3).map(|i| dw[i] * d[i]).sum::<f64>() - 1.0).abs() <= slope, "{x} {l}");
            }
        }
    }

    /// Boxes that reach by 1 to 100 units of the last place and more across the line between two cells, at
    /// the lower or the upper side: the node beyond has a weight that goes with the square of its slope, and
    /// neither is zero alone.
    #[test]
    fn outer_weights_are_squares_of_slopes() {
        let overlaps =
            (1..=100).chain((7..=51).map(|power| 1u64 << power)).map(|n| n as f64 * 0.5 * f64::EPSILON);
        let overlaps: Vec<f64> = overlaps.collect();
        let mut reached = 0;
        for half in [0.5, 0.25, 0.125, 0.1, 1.0 / 3.0, 0.499_999, 0.02] {
            for line in 0..=4 {
                for &overlap in &overlaps {
                    for side in [-1.0, 1.0] {
                        let centre = Lanes::splat(f64::from(line) + side * (half - overlap));
                        let axis = Axis::new(centre, Lanes::splat(half), 8.0);
                        let base = axis.base.to_array()[0];
                        // On the other side of the line, unless the overlap has been rounded away.
                        let beyond = f64::from(line) - side - base;
                        let is_inside = (0.0..=4.0).contains(&centre.to_array()[0]);
                        if overlap >= half || !is_inside || !(0.0..=2.0).contains(&beyond) {
                            continue;
                        }
                        let beyond = beyond as usize;
                        let [weight, slope] = [axis.weight, axis.slope].map(|of| of[beyond].to_array()[0]);
                        let width = 2.0 * half;
                        let square = (slope / 8.0 * width).powi(2);
                        assert!((weight * 2.0 * width - square).abs() <= 1e-14 / half * square);
                        reached += usize::from(weight > 0.0);
                    }
                }
            }
        }
        assert!(reached > 4000, "{reached}");
    }

    /// Weights of rings add up to 1 and are not negative, linear fields are met at the centre of mass, a
    /// uniform expansion has the same rate along the radius and along the hoop, and next to an overlap
    /// weights are its square.
    #[test]
    fn rings_are_weighted_by_their_radius() {
        let cell = 0.125;
        for chunk in boxes().chunks_exact(LANES) {
            for corner in [0.0, 4.0 * cell, 4000.0 * cell] {
                let lanes = |i: usize| chunk[i];
                let is_ring = |i: usize| corner > 0.0 || lanes(i).0 >= lanes(i).1;
                let centre = Lanes::new(std::array::from_fn(|i| lanes(i).0));
                let half = Lanes::new(std::array::from_fn(|i| lanes(i).1));
                let radius = centre * cell + Lanes::splat(corner);
                let axis = Axis::revolved(centre, half, cell, corner, radius);
                let planar = Axis::new(centre, half, 1.0 / cell);
                for lane in (0..LANES).filter(|&i| is_ring(i)) {
                    let at = |lanes: &[Lanes; 3]| lanes.map(|v| v.to_array()[lane]);
                    let (w, dw, hoop) = (at(&axis.weight), at(&axis.slope), at(&planar.weight));
                    let (r, l) = (radius.to_array()[lane], lanes(lane).1 * cell);
                    let node = |i: usize| corner + (axis.base.to_array()[lane] + i as f64) * cell;
                    let sum = |f: &dyn Fn(usize) -> f64| (0..3).map(f).sum::<f64>();
                    let eps = f64::EPSILON * (r / cell + 1.0) * (1.0 + cell / l);
                    assert!(w.iter().all(|&w| w >= 0.0), "{w:?} at {r} {l}");
                    assert!((sum(&|i| w[i]) - 1.0).abs() <= 8.0 * eps);
                    assert!((sum(&|i| w[i] * node(i)) - r - l * l / (3.0 * r)).abs() <= 16.0 * eps * r);
                    assert!(sum(&|i| dw[i]).abs() * cell <= 8.0 * eps);
                    assert!((sum(&|i| dw[i] * node(i)) - 1.0).abs() <= 16.0 * eps * (r / cell).max(1.0));
                    assert!((sum(&|i| hoop[i] / r * node(i)) - 1.0).abs() <= 16.0 * eps);
                }
            }
        }
    }

    #[test]
    fn half_cell_boxes_are_quadratic_splines() {
        for i in 0..400 {
            let x = f64::from(i) / 100.0;
            let axis = Axis::new(Lanes::splat(x), Lanes::splat(0.5), 1.0);
            for node in 0..3 {
                let distance = (axis.base.to_array()[0] + node as f64 - x).abs();
                let spline = if distance <= 0.5 {
                    0.75 - distance * distance
                } else {
                    0.5 * (1.5 - distance) * (1.5 - distance)
                };
                assert!((axis.weight[node].to_array()[0] - spline).abs() <= 8.0 * f64::EPSILON);
            }
        }
    }

    #[test]
    fn slope_is_the_derivative_of_the_weight() {
        let (cell, step) = (0.5, 1e-6);
        for i in 0..390 {
            let x = 0.05 + f64::from(i) / 100.0;
            let at = |x: f64| Axis::new(Lanes::splat(x), Lanes::splat(0.2), 1.0 / cell);
            let (axis, left, right) = (at(x), at(x - step), at(x + step));
            if left.base.to_array()[0] != right.base.to_array()[0] {
                continue;
            }
            for node in 0..3 {
                let difference = right.weight[node] - left.weight[node];
                let slope = difference.to_array()[0] / (2.0 * step * cell);
                assert!((slope - axis.slope[node].to_array()[0]).abs() <= 1e-5);
            }
        }
    }
}
