//! Widths of particles in pictures: those of their boxes in the solver.
use crate::kernel::domain::stretches_of_one;
use crate::kernel::{BoxPolicy, Coordinates};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::halvings;
use crate::particle::volume::symmetric;

/// Cells of a leaf along an axis.
const CELLS: f64 = 4.0;

/// Data from which half widths follow, beside the state of the particles.
#[derive(Clone, Debug)]
pub struct Boxes {
    /// How boxes follow the deformation.
    pub policy: BoxPolicy,
    /// Coordinates of the domain.
    pub coordinates: Coordinates,
    /// Whether each material flows, by its number.
    pub is_plastic: Vec<bool>,
}

/// The data of a particle from which its box follows.
#[derive(Clone, Copy, Debug)]
pub struct Particle {
    /// Half of the edge of the undeformed box, m; of the section of a ring at its radius.
    pub half: f64,
    /// Left Cauchy-Green tensor: xx, yy, zz, xy, yz, xz.
    pub elastic: [f64; 6],
    /// Logarithm of its plastic change of volume.
    pub plastic_volume: f64,
    /// Its packed tag.
    pub tag: u64,
}

impl Boxes {
    /// Half widths along the axes, m, of a particle in a domain of `dimension` axes whose root octants have
    /// this edge, m.
    pub fn half_widths(&self, particle: &Particle, dimension: usize, root_edge: f64) -> [f64; 3] {
        let Particle { half, elastic, plastic_volume, tag: packed } = particle;
        let tag = Tag::unpack(*packed);
        match self.policy {
            BoxPolicy::Fixed => [*half; 3],
            BoxPolicy::Cell => [0.5 * root_edge / CELLS / f64::from(1_u32 << tag.level.min(31)); 3],
            BoxPolicy::Volume { min_stretch, max_stretch } => {
                let is_plastic = self.is_plastic.get(usize::from(tag.material)).copied().unwrap_or(true);
                // Those that do not flow are halved before their boxes reach a bound.
                let limits = [min_stretch, if is_plastic { max_stretch } else { f64::INFINITY }];
                let mut stretch = stretches_of_one(elastic, *plastic_volume, dimension, is_plastic, limits);
                if self.coordinates == Coordinates::Axisymmetric && !is_plastic {
                    // See `kernel::domain`.
                    stretch = stretch.map(|stretch| stretch * elastic[2].sqrt().sqrt());
                }
                let shape = match (dimension, halvings::shape::<2>(*packed)) {
                    (2, [x, y]) => [x, y, 1.0],
                    _ => halvings::shape::<3>(*packed),
                };
                std::array::from_fn(|axis| half * shape[axis] * stretch[axis])
            }
        }
    }

    /// Half widths of a particle of a run, m.
    pub fn of_chunk<const D: usize>(&self, chunk: &Chunk<D>, p: usize, root_edge: f64) -> [f64; 3] {
        let particle = Particle {
            half: self.coordinates.half_width(chunk.column(Layout::<D>::HALF)[p], chunk.position(p)[0]),
            elastic: symmetric(chunk, Layout::<D>::LEFT_CAUCHY_GREEN, p),
            plastic_volume: chunk.column(Layout::<D>::PLASTIC_VOLUME)[p],
            tag: chunk.tags()[p],
        };
        self.half_widths(&particle, D, root_edge)
    }
}
