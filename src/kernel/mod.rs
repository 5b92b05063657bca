//! Particle kernels on a uniform block of cells: GIMP weights, scatter (P2G) and gather (G2P).
//!
//! Knows particles and materials, but no tree, no ranks and no constraints: the caller prepares the arenas
//! for level jumps. The kernels allocate nothing, and every sum runs over particles in the order of the
//! selection, so the bits of a result depend on that order alone.
//!
//! | file or folder | what it holds |
//! |---|---|
//! | this | arenas, their rows, and the settings of transfers |
//! | [`p2g`] | particles to grid |
//! | [`g2p`] | grid to particles, and the advance of particles |
//! | [`stencil`], `weights` | weights along one axis; their products |
//! | [`domain`], [`spread`] | half widths of boxes; second moments of weights |
//! | [`hanging`], [`constrained_nodes`] | hanging nodes; nodes with moments |
//! | `batch`, `select`, `given` | batches of particles; which take part; columns in place of theirs |
use bytemuck::{Pod, Zeroable};

use self::batch::Batch;
pub use self::given::GivenColumn;
pub use self::select::Select;
use crate::material::{Material, Viscosity};
use crate::particle::chunk::Tag;
use crate::simd::{F64x4, LANES, Lanes, Vector};

mod batch;
pub mod constrained_nodes;
pub mod domain;
pub mod g2p;
mod given;
pub mod hanging;
pub mod p2g;
mod select;
pub mod spread;
pub mod stencil;
#[cfg(test)]
mod tests;
mod weights;

/// Cells of a block along one axis.
pub const BLOCK: usize = 4;
/// Nodes of an arena along one axis: -1 to 5 of its block.
pub const ARENA_EDGE: usize = BLOCK + 3;
/// Lowest nodes that a stencil may have along one axis: -1 to 3 of the block.
pub const BASES: usize = BLOCK + 1;

/// Nodes of an arena in `d` dimensions, x running fastest: index `x + 7 y (+ 49 z)`, where 0 is node
/// -1 of the block.
pub const fn arena_nodes(d: usize) -> usize {
    ARENA_EDGE.pow(d as u32)
}

/// Number of stencil positions in an arena, and so the length of a table over them: index
/// `x + 5 y (+ 25 z)`, where 0 is the stencil whose lowest node is node -1 of the block.
pub const fn stencil_bases(d: usize) -> usize {
    BASES.pow(d as u32)
}

/// Values of a node: `(px, py, pz, m)` while scattering, `(vx, vy, vz, unused)` while gathering. In plane
/// strain the z lane is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct Row(pub [f64; 4]);

impl Row {
    /// Adds another row.
    #[inline(always)]
    pub fn add(&mut self, other: &Self) {
        *self = self.plus(other);
    }

    /// The sum of two rows.
    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        Self((F64x4::new(self.0) + F64x4::new(other.0)).to_array())
    }
}

/// The block of cells that a call works on. Lengths in m, relative to the lower corner of the domain.
#[derive(Clone, Copy, Debug)]
pub struct Frame<const D: usize> {
    /// Lower corner of the block.
    pub corner: [f64; D],
    /// Edge of a cell of the block.
    pub cell: f64,
    /// Upper corner of the domain.
    pub extent: [f64; D],
}

impl<const D: usize> Frame<D> {
    /// Whether a wall of the domain is near enough to cut boxes whose centres lie in the block.
    fn is_at_wall(&self) -> bool {
        (0..D).any(|axis| {
            let upper = self.corner[axis] + BLOCK as f64 * self.cell;
            self.corner[axis] < self.cell || upper > self.extent[axis] - self.cell
        })
    }
}

/// Transfer of velocities between particles and nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Transfer {
    /// Affine particle-in-cell (Jiang et al. 2015): `C = B D⁻¹`; conserves angular momentum.
    #[default]
    Apic,
    /// Taylor particle-in-cell: `C` is the velocity gradient.
    Tpic,
    /// Blend of increments (FLIP) and velocities (PIC).
    Flip {
        /// Share of FLIP, 0 to 1.
        blend: f64,
    },
    /// Extended particle-in-cell (Hammerquist & Nairn 2017): increments as with FLIP, while the part of the
    /// particles' velocities that the grid cannot resolve is filtered out.
    Xpic {
        /// Order, at least 1: 1 is PIC, towards infinity it becomes FLIP.
        order: u32,
    },
}

impl Transfer {
    /// Whether particles take increments, so that velocities before the impulse of stress are needed.
    pub fn has_increments(self) -> bool {
        matches!(self, Self::Flip { .. } | Self::Xpic { .. })
    }

    /// Whether particles pass an affine velocity field to nodes. With the others, only splits use the
    /// gradient that they carry.
    pub fn has_affine(self) -> bool {
        !self.has_increments()
    }
}

/// Coordinates of the domain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Coordinates {
    /// Space, or plane strain.
    #[default]
    Cartesian,
    /// Radius and height, in 2D: bodies of revolution. Masses and volumes are those of whole rings.
    Axisymmetric,
}

impl Coordinates {
    /// Length over which a point with this first coordinate (m) stands: the circumference of its circle, m,
    /// in axisymmetry; else 1.
    pub fn around(self, x: f64) -> f64 {
        match self {
            Self::Cartesian => 1.0,
            Self::Axisymmetric => std::f64::consts::TAU * x,
        }
    }

    /// Area of a face of a cell of this edge (m) at this first coordinate (m), m²: in the plane of a slice
    /// one metre thick, in axisymmetry of the whole ring.
    pub fn face_area<const D: usize>(self, cell: f64, x: f64) -> f64 {
        cell.powi(D as i32 - 1) * self.around(x)
    }

    /// Curvature, in cells of this edge (m), of a surface at this first coordinate (m) whose normal has this
    /// first component, along the circumference. Positive where material over it lies outside.
    pub fn bend(self, normal: f64, cell: f64, x: f64) -> f64 {
        match self {
            Self::Cartesian => 0.0,
            Self::Axisymmetric => normal * cell / x.max(cell),
        }
    }

    /// Half width of the box of a particle, m, from the value in [`crate::particle::Layout::HALF`] and the
    /// first coordinate of its centre, m.
    pub fn half_width(self, half: f64, x: f64) -> f64 {
        match self {
            Self::Cartesian => half,
            Self::Axisymmetric => half / self.around(x.max(0.0)).sqrt(),
        }
    }

    /// Distance (m) along the first axis from the centre of a box with this half width (m) at `x` to its
    /// centre of mass: `∫ r² dr / ∫ r dr - x`. A box that reaches beyond the axis counts as one that
    /// touches it.
    pub fn to_mass_centre(self, half: f64, x: f64) -> f64 {
        match self {
            Self::Cartesian => 0.0,
            Self::Axisymmetric => half * half / (3.0 * x.max(half)),
        }
    }
}

/// How the half widths of a particle's box follow its deformation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BoxPolicy {
    /// The box keeps the particle's volume: each axis follows the stretch along it, or the cube (2D:
    /// square) root of the volume ratio for materials whose plastic stretch is unbounded.
    Volume {
        /// Least ratio of a half width to the undeformed one.
        min_stretch: f64,
        /// Greatest ratio of a half width to the undeformed one.
        max_stretch: f64,
    },
    /// Undeformed half widths.
    Fixed,
    /// One cell of the level that the particle was made for: the quadratic B-spline on uniform regions.
    Cell,
}

impl BoxPolicy {
    /// Greatest ratio of a half width to the undeformed one; infinite where boxes do not follow the
    /// deformation.
    pub fn greatest_stretch(self) -> f64 {
        match self {
            Self::Volume { max_stretch, .. } => max_stretch,
            Self::Fixed | Self::Cell => f64::INFINITY,
        }
    }
}

impl Default for BoxPolicy {
    fn default() -> Self {
        Self::Volume { min_stretch: 0.25, max_stretch: 2.0 }
    }
}

/// Properties of the run that the kernels use. The same for all particles.
pub struct Scheme<'a> {
    /// Box policy.
    pub boxes: BoxPolicy,
    /// Edge of a cell of level 0, m.
    pub root_cell: f64,
    /// Transfer of velocities.
    pub transfer: Transfer,
    /// Coordinates.
    pub coordinates: Coordinates,
    /// Materials by index (see [`crate::particle::chunk::Tag`]).
    pub materials: &'a [Box<dyn Material>],
    /// Whether any of them flows. If not, no particle is tested for it.
    pub is_plastic: bool,
    /// Whether all of them flow. If so, no particle is tested for it either.
    pub is_all_plastic: bool,
    /// History variables that they use.
    pub histories: usize,
    /// Whether any of them asks for the size of cells.
    pub softens: bool,
    /// Whether particles strain with the mean rate of dilation of their cell (F-bar).
    pub f_bar: bool,
    /// Artificial viscosity, if there is any.
    pub viscosity: Option<Viscosity>,
    /// Number of carried columns that are shares of a whole, which add up in a merge; those behind are
    /// values, which average.
    pub shares: usize,
    /// First carried column of the displacement, if particles carry it.
    pub displacement: Option<usize>,
    /// Greatest ratio of a half width to that of the undeformed whole, for boxes of elastic materials that
    /// keep their volume. Not less than that of others: these particles are halved before their boxes are
    /// wider than a cell.
    pub elastic_stretch: f64,
    /// Whether any particle of the run may have been halved (see [`crate::particle::halvings`]). If not, none
    /// is asked.
    pub has_halves: bool,
    /// Whether the affine columns of particles hold stress, for forces on nodes.
    pub forces: bool,
}

impl<'a> Scheme<'a> {
    /// For these materials; `root_cell` is the edge of a cell of level 0, m.
    pub fn new(
        boxes: BoxPolicy,
        root_cell: f64,
        transfer: Transfer,
        materials: &'a [Box<dyn Material>],
    ) -> Self {
        let is_plastic = materials.iter().any(|material| material.is_plastic());
        let is_all_plastic = is_plastic && materials.iter().all(|material| material.is_plastic());
        let histories = materials.iter().map(|material| material.history_names().len()).max().unwrap_or(0);
        let softens = materials.iter().any(|material| material.softens());
        Self {
            boxes,
            root_cell,
            transfer,
            coordinates: Coordinates::Cartesian,
            materials,
            is_plastic,
            is_all_plastic,
            histories,
            softens,
            f_bar: false,
            viscosity: None,
            shares: 0,
            displacement: None,
            elastic_stretch: boxes.greatest_stretch(),
            has_halves: false,
            forces: false,
        }
    }

    /// Greatest ratio of the half width of any box to that of its undeformed whole.
    pub fn greatest_stretch(&self) -> f64 {
        if self.is_all_plastic { self.boxes.greatest_stretch() } else { self.elastic_stretch }
    }

    /// Edge of a cell of a level, m.
    pub fn cell(&self, level: u8) -> f64 {
        self.root_cell / f64::from(1u32 << level.min(31))
    }

    /// Edges of the cells that the particles of a batch were made for, m.
    #[inline(always)]
    fn sizes(&self, tags: &[u64], batch: &Batch) -> [f64; LANES] {
        std::array::from_fn(|lane| self.cell(Tag::unpack(tags[batch.particle(lane)]).level))
    }
}

/// Part of a particle's box, for boxes wider than a cell: the weight of a box is the mean of the
/// weights of its equal parts, each transferred with the same 3^D kernel, maybe in different blocks.
#[derive(Clone, Copy, Debug)]
pub struct SubBox<const D: usize> {
    /// Index of the particle in its chunk.
    pub particle: u32,
    /// Where [`g2p::gather_sub_boxes`] adds what this part gathers.
    pub slot: u32,
    /// Centre of the part, m.
    pub centre: [f64; D],
    /// Half widths of the part, m; at most half a cell of the block.
    pub half: [f64; D],
    /// Half width of the whole box along the first axis, m.
    pub whole: f64,
    /// Factor of the slopes along each axis: below 1 for boxes that a near wall cuts (see
    /// [`domain::softening_at`]).
    pub softening: [f64; D],
    /// Share of the particle that the part carries: 1 / number of parts.
    pub fraction: f64,
    /// D of the whole box, m² (see [`spread`]); the parts' own add up to it.
    pub spread: [f64; D],
}

impl<const D: usize> SubBox<D> {
    /// Half widths of the whole boxes along the first axis, m.
    fn wholes(parts: &[Self]) -> Lanes {
        Self::lane(parts, |part| part.whole)
    }

    /// Centres and half widths of up to a batch of parts; lanes beyond repeat the last.
    fn lanes(parts: &[Self]) -> ([Lanes; D], [Lanes; D]) {
        (
            std::array::from_fn(|axis| Self::lane(parts, |part| part.centre[axis])),
            std::array::from_fn(|axis| Self::lane(parts, |part| part.half[axis])),
        )
    }

    /// Factors of the slopes, if any is not 1.
    fn softening(parts: &[Self]) -> Option<[Lanes; D]> {
        let is_soft = parts.iter().any(|part| part.softening != [1.0; D]);
        is_soft.then(|| std::array::from_fn(|axis| Self::lane(parts, |part| part.softening[axis])))
    }

    /// One value of up to a batch of parts.
    fn lane(parts: &[Self], value: impl Fn(&Self) -> f64) -> Lanes {
        Lanes::new(std::array::from_fn(|lane| value(&parts[lane.min(parts.len() - 1)])))
    }
}

/// Nodes from the first to the last of a stencil in an arena, both included.
const fn stencil_span(d: usize) -> usize {
    if d == 2 { 2 + 2 * ARENA_EDGE + 1 } else { 2 + 2 * ARENA_EDGE + 2 * ARENA_EDGE * ARENA_EDGE + 1 }
}

/// Component of a symmetric tensor in the order of [`crate::particle::Layout`].
const fn symmetric_index<const D: usize>(i: usize, j: usize) -> usize {
    if i == j { i } else { i + j + 2 }
}
