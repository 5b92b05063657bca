//! Rates of deformation of the particles of a chunk, by lanes, for what follows the deformation.
use super::gathered::Gathered;
use crate::simd::{LANES, Lanes, Vector};

/// Rates of [`LANES`] particles that follow each other in their chunk.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Tile<const D: usize> {
    /// Component ik of the velocity gradient, 1/s.
    gradient: [[[f64; LANES]; D]; D],
    /// Rate of strain along the hoop, 1/s; 0 but in axisymmetry.
    hoop: [f64; LANES],
}

/// Velocity gradients of the particles of a chunk and their rates along the hoop, 1/s.
#[derive(Clone, Default)]
pub struct Rates<const D: usize>(Vec<Tile<D>>);

impl<const D: usize> Rates<D> {
    /// Starts with the particles of a chunk, which do not deform.
    pub fn begin(&mut self, particles: usize) {
        self.0.clear();
        let still = Tile { gradient: [[[0.0; LANES]; D]; D], hoop: [0.0; LANES] };
        self.0.resize(particles.div_ceil(LANES), still);
    }

    /// Records those of a particle.
    pub fn note(&mut self, particle: usize, gathered: &Gathered<D>) {
        self.set(particle, &gathered.gradient(), gathered.hoop());
    }

    /// A particle does not deform.
    pub fn clear(&mut self, particle: usize) {
        self.set(particle, &[[0.0; D]; D], 0.0);
    }

    fn set(&mut self, particle: usize, gradient: &[[f64; D]; D], hoop: f64) {
        let (tile, lane) = (&mut self.0[particle / LANES], particle % LANES);
        for (to, from) in tile.gradient.as_flattened_mut().iter_mut().zip(gradient.as_flattened()) {
            to[lane] = *from;
        }
        tile.hoop[lane] = hoop;
    }

    /// Velocity gradient of a particle, 1/s.
    pub fn gradient(&self, particle: usize) -> [[f64; D]; D] {
        let of = &self.0[particle / LANES].gradient;
        std::array::from_fn(|i| std::array::from_fn(|k| of[i][k][particle % LANES]))
    }

    /// Rate of strain along the hoop of a particle, 1/s.
    pub fn hoop(&self, particle: usize) -> f64 {
        self.0[particle / LANES].hoop[particle % LANES]
    }

    /// Velocity gradients of all particles, [`LANES`] at a time; those beyond the last particle are 0.
    pub fn gradients(&self) -> impl Iterator<Item = [[Lanes; D]; D]> {
        self.0.iter().map(|tile| tile.gradient.map(|row| row.map(Lanes::new)))
    }
}
