//! Second moments of the weights of particles, from which follows the gradient in their affine matrix.
use crate::adaptivity::resample::Setting;
use crate::kernel::domain;
use crate::particle::chunk::{Chunk, Layout};
use crate::simd::Vector;

/// Second moments of the weights of a particle on the lattice of the cells of a leaf, m².
pub(crate) fn spread<const D: usize>(chunk: &Chunk<D>, p: usize, leaf: &Setting<D>) -> [f64; D] {
    let cell = leaf.cell();
    if leaf.has_rings() {
        return of_ring(chunk, p, cell, leaf);
    }
    let half = chunk.column(Layout::<D>::HALF)[p];
    chunk.position(p).map(|x| spread_on_lattice(x, half, cell))
}

/// Second moment of the weights of a box on a lattice of nodes, along one axis: `l²/3 + mean of d (h - d)`,
/// where d is the distance to the node below, m². The first part is that of the box, the second that of
/// linear interpolation between two nodes.
pub(crate) fn spread_on_lattice(x: f64, half: f64, cell: f64) -> f64 {
    let inside = |y: f64| y - cell * (y / cell).floor();
    let box_part = half * half / 3.0;
    if half < 1e-4 * cell {
        let d = inside(x);
        return f64::mul_add(d, cell - d, box_part).max(f64::MIN_POSITIVE);
    }
    // Integral of d (h - d) from 0, each whole cell h³/6.
    let integral = |y: f64| {
        let d = inside(y);
        (y / cell).floor() * cell.powi(3) / 6.0 + d * d * (cell / 2.0 - d / 3.0)
    };
    box_part + ((integral(x + half) - integral(x - half)) / (2.0 * half)).max(0.0)
}

/// Second moments, m², of the weights of a ring about its centre of mass, on a lattice of cells of this edge
/// (m) that begins at the axis.
fn of_ring<const D: usize>(chunk: &Chunk<D>, p: usize, cell: f64, setting: &Setting<D>) -> [f64; D] {
    let half = domain::full_half_widths_of(chunk, &[p as u32], cell, &setting.extent, setting.scheme);
    let (x, half) = (chunk.position(p), half.map(|half| half.to_array()[0]));
    std::array::from_fn(|axis| match axis {
        0 => along_radius(x[0], half[0], cell),
        _ => spread_on_lattice(x[axis], half[axis], cell),
    })
}

/// Second moment of the weights along the radius, about the centre of mass: that of the ring,
/// `l²/3 - (l²/3r)²`, and the mean over it of `d (h - d)`, with d the distance to the node below, m².
fn along_radius(radius: f64, half: f64, cell: f64) -> f64 {
    let radius = radius.max(half);
    let ahead = half * half / (3.0 * radius);
    let of_ring = f64::mul_add(-ahead, ahead, half * half / 3.0);
    let split = |y: f64| ((y / cell).floor(), y - cell * (y / cell).floor());
    if half < 1e-4 * cell {
        let d = split(radius).1;
        return f64::mul_add(d, cell - d, of_ring).max(f64::MIN_POSITIVE);
    }
    // Integral of d (h - d) r from the axis: h⁴ n² / 12 up to the n-th node.
    let integral = |y: f64| {
        let (n, d) = split(y);
        let (square, cube) = (d * d, d * d * d);
        cell.powi(4) * n * n / 12.0 + n * cell * (0.5 * cell * square - cube / 3.0) + cell * cube / 3.0
            - 0.25 * square * square
    };
    of_ring + ((integral(radius + half) - integral(radius - half)) / (2.0 * half * radius)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the sums over nodes and points of a fine quadrature.
    #[test]
    fn spread_is_the_second_moment_of_the_weights() {
        let cell = 0.2;
        for (x, half) in [(0.53, 0.05), (0.6, 0.1), (0.47, 0.1), (0.71, 0.02), (0.65, 0.25), (0.55, 1e-7)] {
            let (mut sum, points) = (0.0, 20_000);
            for i in 0..points {
                let y: f64 = x + half * (2.0 * (f64::from(i) + 0.5) / f64::from(points) - 1.0);
                let below = (y / cell).floor();
                let share = y / cell - below;
                let squared = |node: f64| (node * cell - x) * (node * cell - x);
                sum += (1.0 - share) * squared(below) + share * squared(below + 1.0);
            }
            approx::assert_relative_eq!(
                spread_on_lattice(x, half, cell),
                sum / f64::from(points),
                max_relative = 1e-6
            );
        }
    }

    /// Against sums over nodes and points of a fine quadrature, at the axis too.
    #[test]
    fn spread_is_the_second_moment_of_the_weights_about_the_centre_of_mass() {
        let cell = 0.2;
        for (radius, half) in
            [(0.53, 0.05), (0.1, 0.1), (0.05, 0.05), (0.47, 0.1), (7.65, 0.25), (0.55, 1e-7)]
        {
            let centre: f64 = radius + half * half / (3.0 * radius);
            let (mut sum, points) = (0.0, 20_000);
            for i in 0..points {
                let y: f64 = radius + half * (2.0 * (f64::from(i) + 0.5) / f64::from(points) - 1.0);
                let below = (y / cell).floor();
                let share = y / cell - below;
                let squared = |node: f64| (node * cell - centre) * (node * cell - centre);
                sum += ((1.0 - share) * squared(below) + share * squared(below + 1.0)) * y / radius;
            }
            approx::assert_relative_eq!(
                along_radius(radius, half, cell),
                sum / f64::from(points),
                max_relative = 1e-6
            );
        }
    }
}
