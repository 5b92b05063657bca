//! Bounds on the widths of boxes, for sorting.
use super::box_widths::BoxWidths;
use crate::grid::GridPlan;
use crate::kernel::{BoxPolicy, Coordinates, Scheme, Select, domain};
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, Tag};
use crate::particle::halvings;
use crate::particle::lanes::{list_lanes, values};
use crate::simd::{LANES, Lanes, Vector, VectorMask};
use crate::solver::physics::Physics;

/// Half widths as the kernels compute them.
pub(in crate::solver) struct Widths<'a, const D: usize> {
    pub scheme: Scheme<'a>,
    /// Upper corner of the domain, m.
    pub extent: [f64; D],
}

impl<const D: usize> Physics<D> {
    /// Half widths of boxes in the domain of a plan.
    pub(in crate::solver) fn widths(&self, plan: &GridPlan<D>) -> Widths<'_, D> {
        Widths { scheme: self.scheme(), extent: plan.extent() }
    }
}

impl<const D: usize> Widths<'_, D> {
    /// The policy that bounds the boxes: in axisymmetry none is wider than a cell of its level.
    fn policy(&self) -> BoxPolicy {
        match (self.scheme.boxes, self.scheme.coordinates) {
            (BoxPolicy::Volume { .. }, Coordinates::Axisymmetric) => BoxPolicy::Cell,
            (policy, _) => policy,
        }
    }

    /// Half widths (m) of the boxes of all particles of a leaf with cells of this edge, m.
    pub(in crate::solver) fn of_leaf(&self, chunk: &Chunk<D>, cell: f64) -> Vec<[f64; D]> {
        let mut half = Vec::with_capacity(chunk.len());
        domain::full_half_widths(chunk, Select::All, cell, &self.extent, &self.scheme, &mut half);
        half
    }

    /// The greatest half width among boxes that may become wider than `cell`, m; 0 if none may.
    pub(crate) fn greatest_of_wide(&self, chunk: &Chunk<D>, cell: f64) -> f64 {
        let limit = Lanes::splat(0.5 * cell);
        let mut wide = Vec::new();
        list_lanes(0..chunk.len(), &mut wide, |first| (!self.bounds(chunk, first).le(limit)).bits());
        let mut greatest: f64 = 0.0;
        for particles in wide.chunks(LANES) {
            let half = self.of_batch(chunk, particles, cell).map(Lanes::to_array);
            let all = half.iter().flat_map(|half| &half[..particles.len()]);
            greatest = all.copied().fold(greatest, f64::max);
        }
        greatest
    }
}

/// Edge of the cube of which a particle with a packed tag is a part over that of a cube of its volume.
fn edge_of_whole<const D: usize>(tag: u64) -> f64 {
    halvings::edge_of_whole::<D>(halvings::number::<D>(tag))
}

impl<const D: usize> BoxWidths<D> for Widths<'_, D> {
    fn of_batch(&self, chunk: &Chunk<D>, particles: &[u32], cell: f64) -> [Lanes; D] {
        domain::full_half_widths_of(chunk, particles, cell, &self.extent, &self.scheme)
    }

    fn bounds(&self, chunk: &Chunk<D>, first: usize) -> Lanes {
        let half = || values(chunk, Layout::<D>::HALF, first);
        match self.policy() {
            BoxPolicy::Fixed => half(),
            BoxPolicy::Volume { .. } if self.scheme.has_halves => {
                let whole = |lane| chunk.tags().get(first + lane).map_or(1.0, |&tag| edge_of_whole::<D>(tag));
                half() * Lanes::new(std::array::from_fn(whole)) * self.scheme.greatest_stretch()
            }
            BoxPolicy::Volume { .. } => half() * self.scheme.greatest_stretch(),
            BoxPolicy::Cell => Lanes::new(std::array::from_fn(|lane| {
                let level = chunk.tags().get(first + lane).map_or(0, |&tag| Tag::unpack(tag).level);
                0.5 * self.scheme.root_cell / f64::from(1u32 << level)
            })),
        }
    }

    fn read_ahead(&self, chunk: &Chunk<D>, first: usize) {
        domain::read_ahead::<D>(chunk.place(), first);
    }

    fn bound(&self, chunk: &Chunk<D>) -> f64 {
        match self.policy() {
            BoxPolicy::Fixed => chunk.greatest_half(),
            BoxPolicy::Volume { .. } if self.scheme.has_halves => {
                let halves = chunk.column(Layout::<D>::HALF).iter().zip(chunk.tags());
                let wholes = halves.map(|(half, &tag)| half * edge_of_whole::<D>(tag));
                self.scheme.greatest_stretch() * wholes.fold(0.0, f64::max)
            }
            BoxPolicy::Volume { .. } => self.scheme.greatest_stretch() * chunk.greatest_half(),
            BoxPolicy::Cell => {
                let coarsest = chunk.tags().iter().map(|&tag| Tag::unpack(tag).level).min();
                coarsest.map_or(0.0, |level| 0.5 * self.scheme.root_cell / f64::from(1u32 << level))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Transfer;
    use crate::material::{self, parameters};

    #[test]
    fn only_boxes_that_may_be_wide_are_measured() {
        let elastic = parameters::Elastic { young: 1.0, poisson: 0.0 };
        let materials = [material::build(&parameters::Parameters::NeoHookean(elastic), 1.0)];
        let boxes = BoxPolicy::Volume { min_stretch: 0.25, max_stretch: 2.0 };
        let scheme = Scheme::new(boxes, 1.0, Transfer::Apic, &materials);
        let widths = Widths { scheme, extent: [100.0; 2] };
        let mut chunk = Chunk::<2>::new();
        let mut push = |half: f64, stretch: f64| {
            let p = chunk.push_zeroed(chunk.len() as u64, Tag { material: 0, body: 0, level: 0 });
            let state = [50.0, 50.0, half, stretch * stretch, 1.0];
            let (position, elastic) = (Layout::<2>::POSITION, Layout::<2>::LEFT_CAUCHY_GREEN);
            let columns = [position, position + 1, Layout::<2>::HALF, elastic, elastic + 1];
            columns.into_iter().zip(state).for_each(|(column, value)| chunk.column_mut(column)[p] = value);
            (widths.bound(&chunk), widths.greatest_of_wide(&chunk, 1.0), widths.greatest_of_wide(&chunk, 0.5))
        };
        for _ in 0..LANES + 1 {
            assert_eq!(push(0.25, 1.25), (0.5, 0.0, 0.3125));
        }
        // Twice 0.375 m may be wider than a cell of 1 m, but is not.
        assert_eq!(push(0.375, 1.0), (0.75, 0.375, 0.375));
        assert_eq!(push(0.375, 1.5), (0.75, 0.5625, 0.5625));
        // No stretch makes a box wider than the bound.
        assert_eq!(push(0.375, 3.0), (0.75, 0.75, 0.75));
    }
}
