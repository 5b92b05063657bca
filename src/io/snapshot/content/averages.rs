//! Averages of stress over cells and leaves, principal stresses and invariants.
//!
//! Stresses of single particles differ from neighbour to neighbour where material flows; their mean by volume
//! over a cell does not. Sums go over the particles of one leaf in their order, which is the same on any
//! ranks.
use crate::grid::leaf_geometry::LeafCells;
use crate::kernel::BLOCK;
use crate::particle::chunk::Chunk;
use crate::particle::volume::{cauchy_stress, measured_volume};

/// Sum of volumes, m³, and of volumes times stresses, J.
#[derive(Clone, Copy, Default)]
struct Sum {
    volume: f64,
    stress: [f64; 6],
}

impl Sum {
    fn add<const D: usize>(&mut self, chunk: &Chunk<D>, p: usize) {
        let volume = measured_volume(chunk, p);
        self.volume += volume;
        let stress = cauchy_stress(chunk, p);
        self.stress.iter_mut().zip(stress).for_each(|(sum, stress)| *sum += volume * stress);
    }

    /// Mean stress, Pa; 0 without material.
    fn mean(&self) -> [f64; 6] {
        if self.volume > 0.0 { self.stress.map(|sum| sum / self.volume) } else { [0.0; 6] }
    }
}

/// Cauchy stress of the cell of each particle of a leaf with these cells.
pub(in crate::io::snapshot) fn over_cells<const D: usize>(
    cells: &LeafCells<D>,
    chunk: &Chunk<D>,
) -> Vec<[f64; 6]> {
    let cells: Vec<usize> = (0..chunk.len()).map(|p| cells.cell_of(&chunk.position(p))).collect();
    let mut sums = vec![Sum::default(); BLOCK.pow(D as u32)];
    cells.iter().enumerate().for_each(|(p, &cell)| sums[cell].add(chunk, p));
    cells.iter().map(|&cell| sums[cell].mean()).collect()
}

/// Stress in a leaf, for the file of the tree.
pub(in crate::io::snapshot) struct LeafAverage {
    /// Volume of the material over that of the leaf.
    pub volume_fraction: f64,
    /// Mean Cauchy stress by volume, Pa: xx, yy, zz, xy, yz, xz; 0 without material.
    pub stress: [f64; 6],
}

/// The average over a leaf of the edge `edge`, m. `around` is the length over which its section stands, m; 1
/// but in axisymmetry.
pub(in crate::io::snapshot) fn over_leaf<const D: usize>(
    edge: f64,
    around: f64,
    chunk: &Chunk<D>,
) -> LeafAverage {
    let mut sum = Sum::default();
    (0..chunk.len()).for_each(|p| sum.add(chunk, p));
    LeafAverage { volume_fraction: sum.volume / (edge.powi(D as i32) * around), stress: sum.mean() }
}

/// Principal values of a stress, the greatest first, by the Lode angle θ: `m + 2 √(J2/3) cos(θ - 2πk/3)` with
/// `cos 3θ = (3√3/2) J3 / J2^(3/2)`. Near-equal values are good to about 1e-8 of the greatest.
pub fn principal(stress: &[f64; 6]) -> [f64; 3] {
    let (mean, j2) = (mean(stress), von_mises(stress).powi(2) / 3.0);
    if j2 == 0.0 {
        return [mean; 3];
    }
    let cosine = 1.5 * 3.0_f64.sqrt() * third_invariant(stress) / (j2 * j2.sqrt());
    let angle = libm::acos(cosine.clamp(-1.0, 1.0)) / 3.0;
    let third = std::f64::consts::TAU / 3.0;
    [0.0, 1.0, -1.0].map(|k| libm::cos(angle - k * third).mul_add(2.0 * (j2 / 3.0).sqrt(), mean))
}

/// Determinant of the deviator.
pub fn third_invariant(stress: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = *stress;
    let mean = mean(stress);
    let [xx, yy, zz] = [xx - mean, yy - mean, zz - mean];
    xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
}

/// A third of the trace.
pub fn mean(stress: &[f64; 6]) -> f64 {
    (stress[0] + stress[1] + stress[2]) / 3.0
}

/// √(3/2 s:s) with the deviator s.
pub fn von_mises(stress: &[f64; 6]) -> f64 {
    let mean = mean(stress);
    let diagonal: f64 = stress[..3].iter().map(|s| (s - mean) * (s - mean)).sum();
    let shear: f64 = stress[3..].iter().map(|s| s * s).sum();
    (1.5 * (diagonal + 2.0 * shear)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particle::chunk::{Layout, Tag};

    /// Four particles in each of two cells, with pressures that alternate about 10 Pa and 20 Pa: the cells
    /// have the means, and the leaf has the mean of both.
    #[test]
    fn stripes_within_cells_cancel() {
        let mut chunk = Chunk::<2>::new();
        for i in 0..8_u32 {
            let p = chunk.push_zeroed(u64::from(i), Tag { material: 0, body: 0, level: 0 });
            let (cell, place) = (
                f64::from(i / 4),
                [0.125 + 0.25 * f64::from(i % 4 % 2), 0.125 + 0.25 * f64::from(i % 4 / 2)],
            );
            let stripe = if (i % 4) % 2 == 0 { 100.0 } else { -100.0 };
            let pressure = 10.0 + 10.0 * cell + stripe;
            chunk.write(Layout::<2>::POSITION, p, &[1.0 + 0.5 * cell + place[0], 2.0 + place[1]]);
            chunk.write(Layout::<2>::LEFT_CAUCHY_GREEN, p, &[1.0, 1.0, 1.0, 0.0]);
            chunk.write(Layout::<2>::STRESS, p, &[-pressure, -pressure, -pressure, 3.0]);
            chunk.column_mut(Layout::<2>::HALF)[p] = 0.125;
        }
        let cells = over_cells(&LeafCells::new(&([1.0, 2.0], [3.0, 4.0])), &chunk);
        for (p, stress) in cells.iter().enumerate() {
            let pressure = if p < 4 { 10.0 } else { 20.0 };
            assert_eq!(*stress, [-pressure, -pressure, -pressure, 3.0, 0.0, 0.0], "{p}");
        }
        let leaf = over_leaf(2.0, 1.0, &chunk);
        assert_eq!((leaf.volume_fraction, mean(&leaf.stress)), (0.125, -15.0));
        assert_eq!(over_leaf::<2>(2.0, 1.0, &Chunk::new()).stress, [0.0; 6]);
    }

    /// Uniaxial tension and pure shear.
    #[test]
    fn principal_stresses_descend() {
        let close = |stress: [f64; 6], expected: [f64; 3]| {
            for (found, expected) in principal(&stress).into_iter().zip(expected) {
                assert!((found - expected).abs() < 1e-12, "{stress:?}: {found}");
            }
        };
        close([0.0, 6.0, 0.0, 0.0, 0.0, 0.0], [6.0, 0.0, 0.0]);
        close([0.0, 0.0, 0.0, 0.0, 0.0, 3.0], [3.0, 0.0, -3.0]);
        close([-2.0, -2.0, -2.0, 0.0, 0.0, 0.0], [-2.0; 3]);
    }
}
