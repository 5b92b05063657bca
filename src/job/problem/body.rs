//! Bodies of a job, their materials and their stress at the start.
use std::sync::Arc;

use crate::geometry::{Sampling, Shape};
use crate::job::parse::error::Position;
use crate::material::parameters::Parameters;
use crate::material::undrained::{self, Undrained};
use crate::material::{Consolidation, Failed, Material};
use crate::particle::given::Given;
use crate::quantity::Quantity;

/// A material of the job.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialSetup {
    /// Name.
    pub name: String,
    /// Density of the undeformed material, kg/m³.
    pub density: f64,
    /// Density of the undeformed material with full pores, kg/m³.
    pub saturated_density: f64,
    /// Constitutive model.
    pub model: Parameters,
    /// Water that cannot leave its pores.
    pub undrained: Option<Undrained>,
    /// Fate of its particles when they fail.
    pub failed: Failed,
}

impl MaterialSetup {
    /// The material as the solver calls it.
    pub fn build(&self) -> Box<dyn Material> {
        undrained::build(&self.model, self.undrained.as_ref(), self.density)
    }

    /// Whether it is a gas, or becomes one.
    pub fn is_gas(&self) -> bool {
        matches!(self.model, Parameters::Gas(_) | Parameters::Explosive(_))
    }
}

/// A body of particles.
#[derive(Clone, Debug)]
pub struct Body<const D: usize> {
    /// Name.
    pub name: String,
    /// Region that it fills.
    pub shape: Shape<D>,
    /// Place of the shape in the files of the job, for messages.
    pub place: Position,
    /// Index into [`Problem::materials`](super::Problem::materials).
    pub material: usize,
    /// Velocity without that of rotation, m/s; it may depend on the place.
    pub velocity: [Quantity; D],
    /// Angular velocity about the body's centre, rad/s; only the third component in plane strain.
    pub angular_velocity: [f64; 3],
    /// The point that the angular velocity turns about: the centre of the bounding box, m.
    pub centre: [f64; D],
    /// The stage at whose start it comes; 0: it is there from the start.
    pub stage: usize,
    /// Particles per cell along each axis; not necessarily a whole number.
    pub particles_per_cell: f64,
    /// Arrangement of its particles about the points of the lattice.
    pub sampling: Sampling<D>,
    /// Lower corner of a box of the lattice, m, at most a box below that of the domain: there, unless the
    /// faces of the body lie between the cells.
    pub lattice: [f64; D],
    /// Stress at the start, if there is any.
    pub stress: Option<InitialStress>,
    /// Its particles, where the job gives them one by one; the shape then is a box about them.
    pub given: Option<Arc<Given<D>>>,
    /// Number of the source that feeds it, if one does: then no particle of it is there from the start.
    pub fed: Option<usize>,
}

/// Stress of a body at the start.
#[derive(Clone, Debug)]
pub struct InitialStress {
    /// Place of its table in the files of the job, for messages.
    pub place: Position,
    /// The stress itself.
    pub kind: StressKind,
    /// Whether a stress outside the yield surface returns to it; else it is an error.
    pub relax: bool,
    /// Consolidation, in place of that of the material.
    pub consolidation: Option<Consolidation>,
}

/// Stress of a body at the start. Levels are in the coordinates of the job, along the axis of gravity.
#[derive(Clone, Debug)]
pub enum StressKind {
    /// The weight above, Pa, with this ratio of horizontal to vertical stress, under a surface (found:
    /// `None`) with a pressure on it.
    Weight {
        /// Horizontal over vertical stress.
        ratio: Quantity,
        /// Level of the surface, m.
        surface: Option<Quantity>,
        /// Pressure on the surface, Pa.
        surcharge: Quantity,
    },
    /// Vertical and horizontal pressures, Pa, over the depth under a surface, m.
    Depth {
        /// Rows of depth and pressures, depths increasing.
        rows: Vec<[f64; 3]>,
        /// Level of depth 0, m.
        surface: Option<Quantity>,
    },
    /// Components `xx, yy, zz, xy, xz, yz`, Pa, tension positive.
    Components(Box<[Quantity; 6]>),
}

impl StressKind {
    /// All quantities that it has.
    pub fn quantities(&self) -> Vec<&Quantity> {
        match self {
            Self::Weight { ratio, surface, surcharge } => {
                [ratio, surcharge].into_iter().chain(surface).collect()
            }
            Self::Depth { surface, .. } => surface.iter().collect(),
            Self::Components(components) => components.iter().collect(),
        }
    }
}
