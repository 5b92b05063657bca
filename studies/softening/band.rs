//! The shear band in a file of results.
use std::path::Path;

use agimp::io::hdf5_file::{FileError, Reader};
use agimp::io::snapshot::Header;

/// Where a specimen shears.
pub(crate) struct Band {
    /// Inclination of the main axis of where plastic strain is at least a third of the greatest, degrees.
    pub angle: f64,
    /// Particles in all.
    pub particles: u64,
}

impl Band {
    /// From an output with state.
    pub(crate) fn read(path: &Path) -> Result<Self, FileError> {
        let file = Reader::open_alone(path)?;
        let particles = Header::read(&file)?.particles;
        let points: Vec<f64> = file.read_slab("VTKHDF/Points", 0, particles)?;
        let history: Vec<f64> = file.read_slab("state/particles/history", 0, particles)?;
        let mass: Vec<f64> = file.read_slab("state/particles/mass", 0, particles)?;
        let stride = history.len() / mass.len();
        let strains = || history.chunks(stride).map(|own| own[0]);
        let most = strains().fold(0.0, f64::max);
        let inside: Vec<([f64; 2], f64)> = points
            .chunks(3)
            .zip(strains().zip(&mass))
            .filter(|(_, (strain, _))| *strain > most / 3.0)
            .map(|(x, (strain, mass))| ([x[0], x[1]], strain * mass))
            .collect();
        let total: f64 = inside.iter().map(|(_, weight)| weight).sum();
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| inside.iter().map(|(x, w)| w * of(x)).sum::<f64>() / total;
        let centre = [mean(&|x| x[0]), mean(&|x| x[1])];
        let moment = |i: usize, j: usize| mean(&|x| (x[i] - centre[i]) * (x[j] - centre[j]));
        let angle = 0.5 * (2.0 * moment(0, 1)).atan2(moment(0, 0) - moment(1, 1));
        Ok(Self { angle: angle.abs().to_degrees(), particles })
    }
}
