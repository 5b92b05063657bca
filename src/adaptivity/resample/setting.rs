//! Input of splitting and merging, and the space of a particle.
use super::merge_backoff::RetrySlot;
use crate::kernel::{BoxPolicy, Coordinates, Scheme, Select, domain};
use crate::particle::chunk::{Chunk, Layout, Tag};

/// Input of splitting and merging, beside the particles of a leaf.
#[derive(Clone, Copy)]
pub struct Setting<'a, const D: usize> {
    /// Box policy, transfer and materials.
    pub scheme: &'a Scheme<'a>,
    /// Upper corner of the domain, m.
    pub extent: [f64; D],
    /// Level of the leaf.
    pub level: u8,
    /// Half width of an undeformed particle of level 0 by body, m: half a cell of level 0 over the particles
    /// per cell and direction. On level k it is this over 2^k.
    pub nominal: &'a [f64],
    /// Particles that are tried for a merge.
    pub turn: RetrySlot,
    /// Whether particles of materials that keep their shape merge with others than their siblings.
    pub solid_strangers: bool,
}

impl<const D: usize> Setting<'_, D> {
    /// Edge of a cell of the leaf, m.
    pub(super) fn cell(&self) -> f64 {
        self.scheme.root_cell / f64::from(1u32 << self.level.min(31))
    }

    /// Whether a particle may merge with others than its siblings.
    pub(super) fn merges_with_strangers(&self, tag: u64) -> bool {
        let material = usize::from(Tag::unpack(tag).material);
        self.solid_strangers || !self.scheme.materials[material].keeps_its_shape()
    }

    /// Half width of an undeformed particle of a level, m.
    pub(super) fn nominal(&self, tag: Tag, level: u8) -> f64 {
        self.nominal[usize::from(tag.body)] / f64::from(1u32 << level.min(31))
    }

    /// Half widths of the space that belongs to each of the selected particles, m: its box, except that boxes
    /// of one cell overlap those of their neighbours, so that there the part of the box counts that the
    /// particle's volume fills. Cut at the walls of the domain.
    pub(super) fn territories(&self, chunk: &Chunk<D>, select: Select) -> Vec<[f64; D]> {
        let cell = self.cell();
        let mut out = Vec::new();
        domain::full_half_widths(chunk, select, cell, &self.extent, self.scheme, &mut out);
        if self.scheme.boxes == BoxPolicy::Cell {
            let by_volume = Scheme { boxes: BoxPolicy::default(), ..*self.scheme };
            let mut filled = Vec::new();
            domain::full_half_widths(chunk, select, cell, &self.extent, &by_volume, &mut filled);
            for (half, filled) in out.iter_mut().zip(filled) {
                *half = std::array::from_fn(|axis| half[axis].min(filled[axis]));
            }
        }
        out
    }

    /// Distances (m) along the first axis from the positions of the selected particles to their centres of
    /// mass; 0 but for rings.
    pub(super) fn ways_to_mass_centres(&self, chunk: &Chunk<D>, which: &[u32]) -> Vec<f64> {
        if !self.has_rings() {
            return vec![0.0; which.len()];
        }
        let (cell, mut half) = (self.cell(), Vec::new());
        domain::full_half_widths(chunk, Select::List(which), cell, &self.extent, self.scheme, &mut half);
        let radius = |p: u32| chunk.position(p as usize)[0];
        let to_centre = |half: &[f64; D], x: f64| self.scheme.coordinates.to_mass_centre(half[0], x);
        half.iter().zip(which).map(|(half, &p)| to_centre(half, radius(p))).collect()
    }

    /// Area (3D: volume) of a particle's undeformed box, m²: of a ring, that of a section with its volume at
    /// its radius.
    pub(super) fn section(&self, chunk: &Chunk<D>, p: usize) -> f64 {
        volume(chunk, p) / self.scheme.coordinates.around(chunk.position(p)[0])
    }

    pub(super) fn has_rings(&self) -> bool {
        self.scheme.coordinates == Coordinates::Axisymmetric
    }
}

/// Reference volume of particle `p`, m³ (m² in plane strain).
pub(super) fn volume<const D: usize>(chunk: &Chunk<D>, p: usize) -> f64 {
    let edge = 2.0 * chunk.column(Layout::<D>::HALF)[p];
    (1..D).fold(edge, |volume, _| volume * edge)
}
