//! P2G: particles to nodes, in parallel over bins.
use rayon::prelude::*;

use crate::grid::arenas::ArenaMut;
use crate::kernel::p2g::{self, MomentSums};
use crate::kernel::{GivenColumn, Scheme, Transfer, spread};
use crate::leapfrog::Lengths;
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, Place, Tag};
use crate::solver::sorting::bin_view::BinView;
use crate::solver::sorting::box_widths::BinMissing;
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;

impl<const D: usize> Solver<D> {
    /// The bin of each box: the finest level that it overlaps; boxes wider than a cell of that level are cut.
    /// Each velocity field has lists of its own particles.
    ///
    /// # Errors
    /// A box that needs a bin outside the plan, on the rank that has it.
    pub(in crate::solver) fn sort_into_bins(&mut self) -> Result<(), BinMissing> {
        let Grid { plan, fields, exchange, .. } = &mut self.grid;
        let widths = self.physics.widths(plan);
        let widths = (&widths, self.physics.coordinates);
        let on = (&*plan, &exchange.seam);
        let mut sorted = Ok(());
        for (field, of_field) in fields.iter_mut().enumerate() {
            let group = self.physics.group(field);
            let done = of_field.sort(on, &mut self.phases, &self.chunks, widths, group.as_ref());
            sorted = sorted.and(done);
        }
        sorted
    }

    /// Collective over neighbours. `m_j = Σ w m`, `p_j = Σ w (m (v + C (x_j - x)) + Δt f) - Δt Σ V₀ τ ∇w` on
    /// real nodes, summed over all ranks, with the forces f that act on particles; with FLIP and XPIC also
    /// `p_j` without forces. Δt is the kick. With mass scaling m is the mass with which a particle moves.
    pub(in crate::solver) fn particles_to_nodes(&mut self, lengths: Lengths) {
        self.scatter_volumes();
        let mut given = self.scaled_masses();
        (0..self.grid.fields.len()).for_each(|field| self.note_velocities(field, &given));
        self.push_particles(lengths, &mut given);
        self.nodes_from_particles(lengths.kick, &given);
    }

    /// Collective over neighbours. Momentum with the impulse of stress over `dt`, and mass, on real nodes, in
    /// each velocity field; of particles with these columns in place of their own.
    pub(in crate::solver) fn nodes_from_particles(&mut self, dt: f64, given: &[Vec<GivenColumn>]) {
        let before = self.grid.exchange.arenas.traffic().bytes;
        (0..self.grid.fields.len()).for_each(|field| self.field_from_particles(field, dt, given));
        self.grid.sum_bytes = self.grid.exchange.arenas.traffic().bytes - before;
    }

    /// As [`Solver::nodes_from_particles`] in one velocity field.
    pub(in crate::solver::step) fn field_from_particles(
        &mut self,
        field: usize,
        dt: f64,
        given: &[Vec<GivenColumn>],
    ) {
        let (chunks, times, scheme) = (&self.chunks, &self.leaf_data.times, self.physics.scheme());
        let Grid { plan, fields, exchange, .. } = &mut self.grid;
        fields[field].scatter_and_sum((plan, exchange), &mut self.phases, chunks, |scratch, bin, arena| {
            times.time(bin.leaf, || scatter(scratch, bin, (chunks, given), &scheme, dt, arena));
        });
    }

    /// Turns the velocity gradients C of a new state into the `B = C D` that APIC keeps. The first
    /// particles of each own leaf, as many as `done`, already have B, and so have particles of bodies that
    /// come with it.
    pub(in crate::solver) fn moments_from_affine(&mut self, done: &[usize]) -> Result<(), BinMissing> {
        if self.physics.transfer != Transfer::Apic {
            return Ok(());
        }
        self.sort_into_bins()?;
        (0..self.grid.fields.len()).for_each(|field| self.moments_of_field(field, done));
        Ok(())
    }

    /// As [`Solver::moments_from_affine`] with APIC for the sorted particles of a velocity field.
    fn moments_of_field(&mut self, field: usize, done: &[usize]) {
        let scheme = self.physics.scheme();
        let (plan, lists) = (&self.grid.plan, &self.grid.fields[field].lists);
        let with_moments = &self.physics.with_moments;
        let chunks = self.chunks.par_iter_mut().enumerate().filter(|(leaf, _)| lists.has_members(*leaf));
        chunks.for_each(|(leaf, chunk)| {
            // Particles of other fields keep theirs.
            let spreads =
                spreads(BinView::of_leaf(plan, lists.of_leaf(leaf), leaf, chunk.len()), chunk, &scheme);
            let tags: Vec<u64> = if with_moments.is_empty() { Vec::new() } else { chunk.tags().to_vec() };
            let has =
                |p: usize| tags.get(p).is_some_and(|tag| with_moments.contains(&Tag::unpack(*tag).body));
            for i in 0..D {
                for k in 0..D {
                    let column = chunk.column_mut(Layout::<D>::AFFINE + D * i + k);
                    let new = column.into_iter().zip(&spreads).enumerate().skip(done[leaf]);
                    new.filter(|(p, _)| !has(*p)).for_each(|(_, (value, spread))| *value *= spread[k]);
                }
            }
        });
    }
}

/// Scatters mass, affine momentum and the impulse of stress of the members of a bin into its arena. Leaf by
/// leaf, columns may be given in place of those of the particles.
pub(in crate::solver) fn scatter<const D: usize>(
    scratch: &mut p2g::Scratch<D>,
    bin: &BinView<'_, D>,
    (chunks, given): (&[Chunk<D>], &[Vec<GivenColumn>]),
    scheme: &Scheme<'_>,
    dt: f64,
    mut arena: ArenaMut<'_, D>,
) {
    arena.clear(&bin.window);
    let (chunk, given) = (&chunks[bin.leaf], given.get(bin.leaf).map_or(&[][..], Vec::as_slice));
    let ArenaMut { rows, moments: sums, .. } = arena;
    let moments = bin.constrained.map(|nodes| MomentSums { nodes, sums });
    let frame = &bin.frame;
    let mut kernel = p2g::Scatter { scratch, chunk, given, frame, scheme, dt, arena: rows, moments };
    if let Some(whole) = bin.whole {
        kernel.whole_boxes(whole, chunks.get(bin.leaf + 1).map_or(Place::default(), Chunk::place));
    }
    if !bin.parts.is_empty() {
        kernel.sub_boxes(bin.parts);
    }
}

/// Second moments D of the weights, m², of the particles of a leaf that are sorted into these bins; 1 for
/// others.
pub(in crate::solver::step) fn spreads<'a, const D: usize>(
    bins: impl Iterator<Item = BinView<'a, D>>,
    chunk: &Chunk<D>,
    scheme: &Scheme,
) -> Vec<[f64; D]> {
    let mut spreads = vec![[1.0; D]; chunk.len()];
    for bin in bins {
        if let Some(whole) = bin.whole {
            spread::of_particles(chunk, whole, &bin.frame, scheme, bin.constrained, |p, spread| {
                spreads[p] = spread;
            });
        }
        bin.parts.iter().for_each(|part| spreads[part.particle as usize] = part.spread);
    }
    spreads
}
