//! F-bar: rate of dilation and pressure as means over each cell, against volumetric locking.
//!
//! Where plastic flow conserves volume, every particle requires zero dilation, which is more constraints than
//! the nodes of a cell can satisfy: the material is too stiff and its pressure alternates. With F-bar the
//! particles of a cell strain with `∇v + (θ̄ - tr ∇v) 1 / n`, where `θ̄ = Σ V₀ tr ∇v / Σ V₀` over the
//! particles of the same material in the cell (de Souza Neto et al. 1996; for the material point method
//! Coombs et al. 2018), and their stress acts with the same mean of their pressures, `τ + (p̄ - p) 1`,
//! `p = Σ τ_ii / n`. Here n is the number of rates of normal strain: D, and 3 in axisymmetry. The second
//! follows from the first: only so is the power of stress, `Σ V₀ τ : ∇v`, that of the strains (as with B-bar,
//! Hughes 1980). Without it a dilatant soil is unstable. Cells are those of the leaf, so no messages are
//! needed.
use crate::grid::leaf_geometry::LeafCells;
use crate::kernel::{BLOCK, Coordinates};
use crate::particle::chunk::{Chunk, Layout, Tag};

/// F-bar in a leaf. A thread reuses its memory.
#[derive(Default)]
pub(in crate::solver) struct MeanDilation {
    /// By particle: at first the trace of the velocity gradient, 1/s; after `average` the correction
    /// of its diagonal, 1/s. Empty without F-bar.
    pub added: Vec<f64>,
    /// Material and cell of each particle, as one number.
    places: Vec<u32>,
    /// Of each material and cell: value times volume, and volume.
    sums: Vec<[f64; 2]>,
    /// Whether there is a rate along the hoop.
    has_hoop: bool,
}

impl MeanDilation {
    /// Starts with the particles of a leaf, at their places before the advance.
    pub(in crate::solver) fn begin<const D: usize>(
        &mut self,
        chunk: &Chunk<D>,
        cells: &LeafCells<D>,
        coordinates: Coordinates,
    ) {
        self.has_hoop = coordinates == Coordinates::Axisymmetric;
        self.added.clear();
        self.added.resize(chunk.len(), 0.0);
        self.places.clear();
        self.places.extend((0..chunk.len()).map(|p| {
            let material = usize::from(Tag::unpack(chunk.tags()[p]).material);
            (material * BLOCK.pow(D as u32) + cells.cell_of(&chunk.position(p))) as u32
        }));
    }

    /// Records the velocity gradient of a particle and its rate along the hoop, 1/s.
    pub(in crate::solver) fn note<const D: usize>(&mut self, p: usize, gradient: &[[f64; D]; D], hoop: f64) {
        self.added[p] = (0..D).map(|i| gradient[i][i]).sum::<f64>() + hoop;
    }

    /// Number of rates of normal strain.
    fn normals(&self, dimension: usize) -> usize {
        if self.has_hoop { 3 } else { dimension }
    }

    /// Sums a value of each particle in each cell, weighted by volume.
    fn sum<const D: usize>(&mut self, chunk: &Chunk<D>, value: impl Fn(usize) -> f64) {
        let half = chunk.column(Layout::<D>::HALF);
        self.sums.clear();
        for (p, &place) in self.places.iter().enumerate() {
            let place = place as usize;
            if place >= self.sums.len() {
                self.sums.resize(place + 1, [0.0; 2]);
            }
            let volume = half[p].powi(D as i32);
            self.sums[place][0] += volume * value(p);
            self.sums[place][1] += volume;
        }
    }

    /// The mean of the cell of a particle.
    fn mean(&self, p: usize) -> f64 {
        let [sum, volume] = self.sums[self.places[p] as usize];
        sum / volume
    }

    /// Once all gradients are recorded: replaces the traces by the corrections.
    pub(in crate::solver) fn average<const D: usize>(&mut self, chunk: &Chunk<D>) {
        let rates = std::mem::take(&mut self.added);
        self.sum(chunk, |p| rates[p]);
        self.added = rates;
        for p in 0..self.added.len() {
            self.added[p] = (self.mean(p) - self.added[p]) / self.normals(D) as f64;
        }
    }

    /// Once all particles have advanced: gives each the mean pressure of the cell in which it was.
    pub(in crate::solver) fn average_pressure<const D: usize>(&mut self, chunk: &mut Chunk<D>) {
        // xx, yy and zz come first in either dimension.
        let normals = self.normals(D);
        let diagonal = |chunk: &Chunk<D>, p: usize| chunk.read::<3>(Layout::<D>::STRESS, p);
        let mean = |stress: [f64; 3]| stress[..normals].iter().sum::<f64>() / normals as f64;
        self.sum(chunk, |p| mean(diagonal(chunk, p)));
        for p in 0..chunk.len() {
            let stress = diagonal(chunk, p);
            let change = self.mean(p) - mean(stress);
            chunk.write(Layout::<D>::STRESS, p, &stress.map(|s| s + change)[..normals]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A leaf of edge 4 m with particles of two sizes and two materials.
    fn leaf(particles: &[([f64; 2], f64, u16)]) -> Chunk<2> {
        let mut chunk = Chunk::new();
        for (id, &(x, half, material)) in particles.iter().enumerate() {
            let p = chunk.push_zeroed(id as u64, Tag { material, body: 0, level: 0 });
            chunk.write(Layout::<2>::POSITION, p, &x);
            chunk.write(Layout::<2>::HALF, p, &[half]);
        }
        chunk
    }

    /// Each cell keeps its rate of change of volume, the same for all its particles of a material; materials
    /// do not mix.
    #[test]
    fn particles_of_a_cell_share_its_dilation() {
        let chunk = leaf(&[
            ([10.2, 20.2], 0.5, 0),
            ([10.7, 20.9], 0.25, 0),
            ([10.5, 20.5], 0.5, 1),
            ([13.9, 23.9], 0.5, 0),
        ]);
        let mut mean = MeanDilation::default();
        mean.begin(&chunk, &LeafCells::new(&([10.0, 20.0], [14.0, 24.0])), Coordinates::Cartesian);
        for (p, rate) in [3.0, -2.0, 7.0, 5.0].into_iter().enumerate() {
            mean.note(p, &[[rate, 9.0], [-4.0, 0.0]], 0.0);
        }
        mean.average(&chunk);
        // (0.25 · 3 - 0.0625 · 2) / 0.3125 = 2
        assert_eq!(mean.added, [(2.0 - 3.0) / 2.0, (2.0 + 2.0) / 2.0, 0.0, 0.0]);
    }
}
