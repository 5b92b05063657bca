//! Mean volume ratio of the fluid in each cell of a leaf.
use crate::grid::leaf_geometry::LeafCells;
use crate::kernel::BLOCK;
use crate::kernel::g2p::fill::Flow;
use crate::material::eigen::determinant;
use crate::particle::chunk::{Chunk, Layout, TILE, Tag};
use crate::simd::{Lanes, Vector};

/// The means of a leaf. A thread reuses its memory.
#[derive(Default)]
pub(in crate::solver::step) struct MeanVolumes {
    /// By particle, `J̄ = Σ V₀ J / Σ V₀` over the particles of its fluid in its cell; 1 for other materials.
    /// Empty in jobs without fluids.
    pub of_particles: Vec<f64>,
    /// Material and cell of each particle, as one number; [`NONE`] for other materials.
    places: Vec<u32>,
    /// Of each material and cell: `Σ V₀ J` and `Σ V₀`, in units of `2^D m³`.
    sums: Vec<[f64; 2]>,
}

/// No fluid.
const NONE: u32 = u32::MAX;

impl MeanVolumes {
    /// Finds the means of the particles of a leaf, at their places before the advance.
    pub(in crate::solver::step) fn find<const D: usize>(
        &mut self,
        chunk: &Chunk<D>,
        cells: &LeafCells<D>,
        flows: &[Flow],
    ) {
        self.of_particles.clear();
        self.places.clear();
        if flows.is_empty() {
            return;
        }
        self.sums.clear();
        self.sums.resize(flows.len() * BLOCK.pow(D as u32), [0.0; 2]);
        let tiles = chunk.tiles().chunks_exact(Layout::<D>::REALS).zip(chunk.tags().chunks(TILE));
        for (tile, tags) in tiles {
            let elastic = std::array::from_fn(|c| match c < Layout::<D>::SYMMETRIC {
                true => Lanes::load(&tile[Layout::<D>::LEFT_CAUCHY_GREEN + c]),
                false => Lanes::splat(0.0),
            });
            let ratios = determinant::<Lanes>(&elastic).sqrt().to_array();
            for (lane, tag) in tags.iter().enumerate() {
                let material = if flows.len() == 1 { 0 } else { usize::from(Tag::unpack(*tag).material) };
                if flows[material].way == 0.0 {
                    self.places.push(NONE);
                    continue;
                }
                let x = std::array::from_fn(|axis| tile[Layout::<D>::POSITION + axis][lane]);
                let place = material * BLOCK.pow(D as u32) + cells.cell_of(&x);
                let half = tile[Layout::<D>::HALF][lane];
                let volume = (0..D).fold(1.0, |volume, _| volume * half);
                let [sum, of] = &mut self.sums[place];
                (*sum, *of) = (volume.mul_add(ratios[lane], *sum), *of + volume);
                self.places.push(place as u32);
            }
        }
        let mean = |place: &u32| match self.sums.get(*place as usize) {
            Some([sum, volume]) => sum / volume,
            None => 1.0,
        };
        self.of_particles.extend(self.places.iter().map(mean));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each fluid has a mean of its own in each cell, weighted by reference volume; other materials have
    /// none.
    #[test]
    fn fluids_have_means_in_each_cell() {
        let particles = [
            ([10.2, 20.2], 0.5, 0, 1.5),
            ([10.7, 20.9], 0.25, 0, 1.0),
            ([10.5, 20.5], 0.5, 1, 0.5),
            ([13.9, 23.9], 0.5, 0, 2.0),
            ([10.4, 20.4], 0.5, 2, 0.9),
        ];
        let mut chunk = Chunk::<2>::new();
        for (id, (x, half, material, ratio)) in particles.into_iter().enumerate() {
            let p = chunk.push_zeroed(id as u64, Tag { material, body: 0, level: 0 });
            chunk.write(Layout::<2>::POSITION, p, &x);
            chunk.write(Layout::<2>::HALF, p, &[half]);
            chunk.write(Layout::<2>::LEFT_CAUCHY_GREEN, p, &[ratio, ratio, 1.0]);
        }
        let fluid = Flow { way: 0.1, widest: 1.0, weight: 0.0 };
        let mut means = MeanVolumes::default();
        let cells = LeafCells::new(&([10.0, 20.0], [14.0, 24.0]));
        means.find(&chunk, &cells, &[fluid, Flow::NONE, fluid]);
        // (0.25 · 1.5 + 0.0625) / 0.3125
        assert_eq!(means.of_particles, [1.4, 1.4, 1.0, 2.0, 0.9]);
        means.find(&chunk, &cells, &[]);
        assert!(means.of_particles.is_empty());
    }
}
