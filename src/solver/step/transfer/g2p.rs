//! G2P: nodes to particles, in parallel over leaves.
//!
//! All work on the particles of a leaf is done in one go, while they are in the cache: see
//! `Sweep::advance_leaf`.
use rayon::prelude::*;

use crate::adaptivity::resample::cell_fit::Resampling;
use crate::adaptivity::resample::halve;
use crate::adaptivity::{LeafMaxima, Watch};
use crate::boundary::motion::Rate;
use crate::grid::arenas::Arenas;
use crate::grid::leaf_geometry::LeafCells;
use crate::grid::sums::node_fields::{VelocityArena, load_rows, load_values};
use crate::grid::{GridPlan, NodeFields};
use crate::kernel::g2p::booked::Booked;
use crate::kernel::g2p::fill::{Filling, Flow};
use crate::kernel::g2p::leavers::Leavers;
use crate::kernel::g2p::rates::Rates;
use crate::kernel::g2p::{FILL_MORE, Fields, Gathered, Moments};
use crate::kernel::{Row, Scheme, arena_nodes, g2p};
use crate::load::{Carried, Load};
use crate::material::SHOCK_SUMS;
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, Place};
use crate::probe::Section;
use crate::solver::migration::depart::{Borders, Departed};
use crate::solver::sorting::bin_view::BinView;
use crate::solver::sorting::bins::{BinLists, OfLeaf};
use crate::solver::sorting::box_bounds::Widths;
use crate::solver::sorting::leaf_bins::{self, LeafBins};
use crate::solver::state::Solver;
use crate::solver::state::bookings::{FAILED_SUMS, Near, ParticlePush, SourcePush, Struck};
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::velocity_field::VelocityField;
use crate::solver::state::leaf_data::LeafData;
use crate::solver::state::phases::Phase;
use crate::solver::step::carried::follow::{
    add_ways, follow_areas, follow_strain, note_turns, note_ways, positions,
};
use crate::solver::step::carried::has_surfaces;
use crate::solver::step::contact::guard::Guard;
use crate::solver::step::failed::{Failures, Found};
use crate::solver::step::fill::means::MeanVolumes;
use crate::solver::step::sources::{Conveyed, Conveyors, conveyors};
use crate::solver::step::transfer::interpolate::Look;
use crate::solver::step::transfer::mean_dilation::MeanDilation;
use crate::solver::step::walls::passing::Barrier;

/// Memory that a thread reuses from leaf to leaf.
struct Scratch<const D: usize> {
    kernel: g2p::Scratch<D>,
    arena: VelocityArena<D>,
    increments: Vec<Row>,
    fill: Vec<f64>,
    gathered: Vec<Gathered<D>>,
    leavers: Leavers<D>,
    sort: leaf_bins::Scratch,
    /// Rates of deformation, where F-bar needs them ahead of the advance, or others after it.
    rates: Rates<D>,
    /// Whether others do.
    keeps_rates: bool,
    mean_dilation: MeanDilation,
    mean_volumes: MeanVolumes,
    booked: Booked<D>,
}

impl<const D: usize> Default for Scratch<D> {
    fn default() -> Self {
        Self {
            kernel: g2p::Scratch::default(),
            arena: VelocityArena::default(),
            increments: vec![Row::default(); arena_nodes(D)],
            fill: vec![0.0; arena_nodes(D) + FILL_MORE],
            gathered: Vec::new(),
            leavers: Leavers::default(),
            sort: leaf_bins::Scratch::default(),
            rates: Rates::default(),
            keeps_rates: false,
            mean_dilation: MeanDilation::default(),
            mean_volumes: MeanVolumes::default(),
            booked: Booked::default(),
        }
    }
}

impl<const D: usize> Scratch<D> {
    /// Makes room for the gathered values of cut boxes.
    fn begin_cut(&mut self, boxes: usize) {
        self.gathered.clear();
        self.gathered.resize(boxes, Gathered::default());
    }
}

/// Particles whose boxes are cut.
fn cut_of<const D: usize>(lists: Option<&LeafBins<D>>) -> &[u32] {
    lists.map_or(&[], |bins| &bins.cut)
}

/// Input of G2P, the same for all leaves.
struct Sweep<'a, const D: usize> {
    dt: f64,
    scheme: &'a Scheme<'a>,
    plan: &'a GridPlan<D>,
    /// The first velocity field.
    first: Source<'a, D>,
    /// The other velocity fields, with the lists of their particles.
    others: Vec<(Source<'a, D>, &'a BinLists<D>)>,
    borders: &'a Borders<D>,
    resampling: Option<&'a Resampling<'a, D>>,
    widths: &'a Widths<'a, D>,
    watch: Watch,
    /// Whether the widths of elastic boxes are noted.
    looks_at_widths: bool,
    /// Where the particles of each leaf lie.
    places: &'a [Place],
    /// Forces on surfaces that particles carry.
    on_surfaces: &'a [&'a Carried<D>],
    /// Colliders that act on particles.
    guard: Option<Guard<'a, D>>,
    /// Faces of the domain.
    barrier: Barrier<'a, D>,
    /// First column of the displacements that particles carry, if they do.
    displacement: Option<usize>,
    /// First columns of tensors that follow the deformation.
    tensors: Vec<usize>,
    /// Sources that convey, with their numbers in the job.
    conveyors: Conveyors<'a, D>,
    /// Failed particles that go, if there are any.
    failures: Option<Failures<'a, D>>,
    /// Openings at which mass is counted, with their numbers.
    openings: Vec<(u32, Section)>,
    /// Flow of each material, and fill of the nodes, in jobs with fluids.
    flows: Vec<Flow>,
    fill: Option<&'a [f64]>,
}

/// A velocity field from which particles gather.
#[derive(Clone, Copy)]
struct Source<'a, const D: usize> {
    nodes: &'a NodeFields<D>,
    arenas: &'a Arenas<D>,
    /// Changes of velocity (FLIP) or new velocities of particles (XPIC) on the nodes.
    increments: Option<&'a [Row]>,
}

impl<'a, const D: usize> Source<'a, D> {
    fn of(field: &'a VelocityField<D>, has_increments: bool) -> Self {
        let VelocityField { nodes, arenas, increments, .. } = field;
        Self { nodes, arenas, increments: has_increments.then_some(&*increments.rows) }
    }
}

/// The particles of a leaf that gather from one velocity field.
#[derive(Clone, Copy)]
struct Members<'a, const D: usize> {
    source: Source<'a, D>,
    lists: Option<&'a LeafBins<D>>,
}

/// Output of the advance of a leaf, beside its particles.
struct Notes<'a, const D: usize> {
    maxima: &'a mut LeafMaxima<D>,
    signal: &'a mut f64,
    pushes: &'a mut [ParticlePush<D>],
    near: &'a mut [Near<D>],
    conveyed: &'a mut Vec<SourcePush<D>>,
    /// Mass times shift, kg m.
    shift: &'a mut [f64; D],
    shock: &'a mut [f64; SHOCK_SUMS],
    struck: &'a mut Vec<Struck<D>>,
    failed: &'a mut Vec<[f64; FAILED_SUMS]>,
}

impl<const D: usize> Solver<D> {
    /// Not collective. `v = Σ w v_j`, `B = Σ w v_j ⊗ (x_j - x)`, `b ← (1 + Δt ∇v) b (1 + Δt ∇v)ᵀ`, return
    /// mapping, `τ(b)`, `x ← x + Δt v` in a step to the time `to`, s; no way leads through colliders that act
    /// on particles, nor through faces that hold material back. Returns what has departed from leaves, in
    /// their order, for [`Solver::migrate_particles`].
    pub(in crate::solver) fn nodes_to_particles(
        &mut self,
        rates: &[Rate<D>],
        to: f64,
        dt: f64,
    ) -> Vec<Departed> {
        let scheme = self.physics.scheme();
        let adaptivity = self.physics.adaptivity.as_ref();
        let resampling = Resampling::new(adaptivity, &scheme, self.grid.plan.extent());
        let widths = self.physics.widths(&self.grid.plan);
        let watch = adaptivity.map(|adaptivity| adaptivity.watch(self.clock.step + 1));
        let looks_at_widths = self.looks_at_widths(self.clock.step + 1);
        self.leaf_data.begin_gather(&self.chunks);
        self.particle_forces.loads.resize_with(self.chunks.len(), Vec::new);
        self.particle_forces.near.resize_with(self.chunks.len(), Vec::new);
        self.particle_forces.conveyed.resize_with(self.chunks.len(), Vec::new);
        let carried = self.physics.loads.iter().filter_map(Load::carried);
        let on_surfaces: Vec<&Carried<D>> = carried.filter(|carried| carried.force.is_on_surface()).collect();
        let flows = self.physics.flows(self.clock.time, dt);
        let LeafData { signal, maxima, shifts, shocks, struck, failed, places, times } = &mut self.leaf_data;
        let has_increments = scheme.transfer.has_increments();
        let Grid { plan, fields, migration, fill, .. } = &mut self.grid;
        let (first, others) = fields.split_at_mut(1);
        // Where it is the only one, its lists are sorted for the next step meanwhile.
        let VelocityField { nodes, arenas, increments, lists } = &mut first[0];
        let sweep = Sweep {
            dt,
            scheme: &scheme,
            plan,
            first: Source { nodes, arenas, increments: has_increments.then_some(&*increments.rows) },
            others: others.iter().map(|field| (Source::of(field, has_increments), &field.lists)).collect(),
            borders: &migration.borders,
            resampling: resampling.as_ref(),
            widths: &widths,
            watch: watch.unwrap_or_default(),
            looks_at_widths,
            places,
            on_surfaces: &on_surfaces,
            guard: Guard::new(&self.physics.colliders, &self.contacts.states, rates, [to, dt], plan.extent()),
            barrier: Barrier::new(&self.physics, plan.extent()),
            displacement: self.physics.followed_columns().displacement,
            tensors: self.physics.tensor_columns(),
            conveyors: conveyors(&self.physics, self.clock.time),
            failures: Failures::new(&self.physics, to - 0.5 * dt),
            openings: self.measured.crossings.fluxes.openings(),
            fill: fill.as_ref().filter(|_| !flows.is_empty()).map(|fill| &fill.of_nodes[..]),
            flows,
        };
        let (chunks, pushes) = (&mut self.chunks, &mut self.particle_forces.loads);
        let (near, conveyed) = (&mut self.particle_forces.near, &mut self.particle_forces.conveyed);
        let departed = self.phases.time(Phase::Gather, || {
            let leaves = chunks.par_iter_mut().zip(lists.by_leaf()).zip(maxima).zip(signal);
            let leaves = leaves
                .zip(pushes)
                .zip(near)
                .zip(&mut *shifts)
                .zip(conveyed)
                .zip(struck)
                .zip(failed)
                .zip(shocks);
            let departed = leaves.enumerate().map_init(Scratch::default, |scratch, (leaf, notes)| {
                let ((notes, failed), shock) = notes;
                let ((((((((chunk, bins), maxima), signal), pushes), near), shift), conveyed), struck) =
                    notes;
                // There may be very many empty leaves, and measuring the time costs more than their work.
                let is_empty = chunk.is_empty();
                let notes = Notes { maxima, signal, pushes, near, conveyed, shift, shock, struck, failed };
                let advance = || sweep.advance_leaf(scratch, leaf, chunk, bins, notes);
                if is_empty { advance() } else { times.time(leaf, advance) }
            });
            departed.filter(Departed::is_any).collect()
        });
        self.book_struck();
        self.book_failed();
        self.book_shocks();
        if !self.sums.shifts.of.is_empty() {
            let shifts = std::mem::take(&mut self.leaf_data.shifts);
            self.book_shifts(&shifts, to - 0.5 * dt);
            self.leaf_data.shifts = shifts;
        }
        departed
    }

    /// S: velocities of the nodes of a velocity field at its particles, leaf by leaf; 0 for those of others.
    pub(in crate::solver::step) fn interpolate(&mut self, field: usize) -> Vec<Vec<[f64; D]>> {
        let Grid { plan, fields, .. } = &self.grid;
        let VelocityField { nodes, lists, .. } = &fields[field];
        let scheme = self.physics.scheme();
        self.phases.time(Phase::Gather, || interpolate(plan, (lists, &nodes.rows), &self.chunks, &scheme))
    }
}

/// Values of nodes, given by their rows, at the particles in lists, leaf by leaf; 0 for others.
pub(in crate::solver::step) fn interpolate<const D: usize>(
    plan: &GridPlan<D>,
    (lists, rows): (&BinLists<D>, &[Row]),
    chunks: &[Chunk<D>],
    scheme: &Scheme<'_>,
) -> Vec<Vec<[f64; D]>> {
    let leaves = chunks.par_iter().enumerate();
    let all = leaves.map_init(Scratch::default, |scratch: &mut Scratch<D>, (leaf, chunk)| {
        let (has_members, lists) = (lists.has_members(leaf), lists.of_leaf(leaf));
        let cut = cut_of(lists);
        scratch.begin_cut(cut.len());
        let Scratch { kernel, increments: arena, gathered, .. } = scratch;
        let mut velocities = vec![[0.0; D]; chunk.len()];
        if !has_members {
            return velocities;
        }
        for bin in BinView::of_leaf(plan, lists, leaf, chunk.len()) {
            load_rows(plan, bin.number, &bin.window, rows, arena);
            let nodes = Fields { velocity: arena, increment: None, fill: None, moments: None };
            g2p::gather_sub_boxes(kernel, chunk, bin.parts, &bin.frame, scheme.coordinates, &nodes, gathered);
            if let Some(whole) = bin.whole {
                g2p::interpolate(kernel, chunk, whole, &bin.frame, scheme, arena, |p, v| {
                    velocities[p] = v;
                });
            }
        }
        for (&p, gathered) in cut.iter().zip(&*gathered) {
            velocities[p as usize] = gathered.velocity();
        }
        velocities
    });
    all.collect()
}

impl<const D: usize> Sweep<'_, D> {
    /// All work on the particles of a leaf: they advance, their extrema are recorded, those that leave are
    /// taken out, and the others are sorted for the next P2G.
    fn advance_leaf(
        &self,
        scratch: &mut Scratch<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        bins: OfLeaf<'_, D>,
        notes: Notes<'_, D>,
    ) -> Departed {
        let Notes { maxima, signal, pushes, near, conveyed, shift, shock, struck, failed } = notes;
        let is_empty = chunk.is_empty();
        self.watch.before(chunk, maxima);
        let aabb = self.borders.of_leaf(leaf);
        let follows = self.displacement.is_some() || !self.openings.is_empty();
        let is_beside = !is_empty && self.barrier.is_beside(aabb);
        let start = (follows || is_beside).then(|| positions(chunk));
        let in_sources = Conveyed::of_leaf(&self.conveyors, chunk, aabb);
        *signal = self.gather(scratch, leaf, chunk, &bins);
        (*shift, *shock) = (scratch.booked.shift(), scratch.booked.shock());
        conveyed.clear();
        if !in_sources.is_empty() {
            in_sources.convey(&self.conveyors, chunk, self.dt, conveyed);
            let moved = in_sources.indices();
            scratch.leavers.look_again(chunk, &moved);
            if scratch.keeps_rates {
                moved.iter().for_each(|&p| scratch.rates.clear(p as usize));
            }
        }
        if let Some(guard) = &self.guard {
            let held = guard.hold(chunk, near);
            scratch.leavers.look_again(chunk, &held);
        }
        if let Some(start) = start.as_ref().filter(|_| is_beside) {
            let held = self.barrier.hold(chunk, aabb, start, struck);
            scratch.leavers.look_again(chunk, &held);
        }
        let mut passed = Vec::new();
        if let Some(start) = start {
            self.note_passed(chunk, &start, &mut passed);
            self.displacement.into_iter().for_each(|first| add_ways(chunk, first, &start));
        }
        note_ways(chunk, pushes);
        if scratch.keeps_rates {
            note_turns(pushes, &scratch.rates, self.dt);
            follow_areas(chunk, self.on_surfaces, &scratch.rates, self.dt);
            let rates = (&scratch.rates, &scratch.mean_dilation.added[..]);
            self.tensors.iter().for_each(|&first| follow_strain(chunk, first, rates, self.dt));
        }
        self.watch.after(chunk, self.dt, maxima);
        if self.looks_at_widths {
            maxima.elastic_width = halve::widest(chunk, self.scheme);
        }
        if signal.is_infinite()
            && let Some(error) = self.borders.unsound(chunk)
        {
            return Departed { error: Some(error), ..Departed::default() };
        }
        let found = self.failures.as_ref().map(|failures| failures.find(chunk)).unwrap_or_default();
        let Found { deleted, sums, signal: changed } = found;
        (*failed, *signal) = (sums, signal.max(changed));
        let leavers = &scratch.leavers.found;
        let gone = (&leavers[..], &deleted[..]);
        let mut departed = self.borders.depart(&self.plan.tree, leaf, chunk, gone, self.resampling);
        departed.crossed.passed = passed;
        if !is_empty && self.others.is_empty() {
            bins.presort(self.plan, leaf, chunk, self.widths, &mut scratch.sort);
        }
        departed
    }

    /// Records the masses of a leaf that have passed openings on their paths from `start`.
    fn note_passed(&self, chunk: &Chunk<D>, start: &[[f64; D]], passed: &mut Vec<(u32, f64)>) {
        for (number, opening) in &self.openings {
            for (p, start) in start.iter().enumerate() {
                let sign = opening.passes(start, &chunk.position(p));
                if sign != 0.0 {
                    passed.push((*number, sign * chunk.column(Layout::<D>::MASS)[p]));
                }
            }
        }
    }

    /// The velocity fields of the particles of a leaf, with their lists.
    fn members<'b>(&'b self, leaf: usize, bins: &'b OfLeaf<'_, D>) -> impl Iterator<Item = Members<'b, D>> {
        let first = bins.has_members.then(|| Members { source: self.first, lists: bins.lists() });
        let others = self.others.iter().filter(move |(_, lists)| lists.has_members(leaf));
        let others =
            others.map(move |(source, lists)| Members { source: *source, lists: lists.of_leaf(leaf) });
        first.into_iter().chain(others)
    }

    /// Advances the particles of a leaf, bin by bin, and records those that leave it. Returns the greatest
    /// `c + |v|`, m/s.
    fn gather(
        &self,
        scratch: &mut Scratch<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        bins: &OfLeaf<'_, D>,
    ) -> f64 {
        scratch.leavers.begin(self.borders.of_leaf(leaf));
        scratch.booked = Booked::default();
        scratch.keeps_rates = !chunk.is_empty() && self.needs_rates(chunk);
        if chunk.is_empty() {
            return 0.0;
        }
        if self.scheme.f_bar || scratch.keeps_rates {
            scratch.rates.begin(chunk.len());
        }
        if self.scheme.f_bar {
            self.find_dilation(scratch, leaf, chunk, bins);
        }
        scratch.mean_volumes.find(chunk, &LeafCells::new(self.borders.of_leaf(leaf)), &self.flows);
        let mut fastest: f64 = 0.0;
        for Members { source, lists } in self.members(leaf, bins) {
            let cut = cut_of(lists);
            scratch.begin_cut(cut.len());
            for bin in BinView::of_leaf(self.plan, lists, leaf, chunk.len()) {
                fastest = fastest.max(self.gather_bin(scratch, &source, &bin, chunk));
            }
            fastest = fastest.max(self.advance_cut(scratch, leaf, chunk, cut));
        }
        if self.scheme.f_bar {
            scratch.mean_dilation.average_pressure(chunk);
        }
        // Bins add them one after the other.
        scratch.leavers.found.sort_unstable();
        fastest
    }

    /// Advances the members of a bin whose boxes are whole; sums the gathered values of the parts of the
    /// others. Returns as [`Sweep::gather`].
    fn gather_bin(
        &self,
        scratch: &mut Scratch<D>,
        source: &Source<'_, D>,
        bin: &BinView<'_, D>,
        chunk: &mut Chunk<D>,
    ) -> f64 {
        let Scratch { kernel, arena, increments, fill, gathered, leavers, mean_dilation, .. } = scratch;
        let next = source.nodes.load(self.plan, source.arenas, bin.number, &bin.window, arena);
        if let Some(rows) = source.increments {
            load_rows(self.plan, bin.number, &bin.window, rows, increments);
        }
        if let Some(values) = self.fill {
            load_values(self.plan, bin.number, &bin.window, values, fill);
        }
        let moments = bin.constrained.map(|nodes| Moments { nodes, first: &arena.moments });
        let increment = source.increments.map(|_| &increments[..]);
        let fill = self.fill.map(|_| &fill[..]);
        let nodes = Fields { velocity: &arena.rows, increment, fill, moments };
        g2p::gather_sub_boxes(
            kernel,
            chunk,
            bin.parts,
            &bin.frame,
            self.scheme.coordinates,
            &nodes,
            gathered,
        );
        let Some(whole) = bin.whole else { return 0.0 };
        let next = next.map_or(Place::default(), |next| self.places[self.plan.bins[next].leaf as usize]);
        let (frame, scheme, dt) = (&bin.frame, self.scheme, self.dt);
        let dilation = &mean_dilation.added[..];
        let (fields, booked) = (&nodes, &mut scratch.booked);
        let filling = self.filling(&scratch.mean_volumes);
        let filling = filling.as_ref();
        let rates = self.notes_rates(scratch.keeps_rates).then_some(&mut scratch.rates);
        g2p::Gather {
            scratch: kernel,
            chunk,
            frame,
            scheme,
            dt,
            fields,
            leavers,
            dilation,
            filling,
            booked,
            rates,
        }
        .whole_boxes(whole, next)
    }

    /// Data that keep the fluids of a leaf at their volume, if there are any.
    fn filling<'b>(&'b self, means: &'b MeanVolumes) -> Option<Filling<'b>> {
        self.fill.map(|_| Filling { flows: &self.flows, means: &means.of_particles })
    }

    /// With F-bar: the rates of the particles of a leaf, and the correction by the mean rate of dilation of
    /// each cell.
    fn find_dilation(&self, scratch: &mut Scratch<D>, leaf: usize, chunk: &Chunk<D>, bins: &OfLeaf<'_, D>) {
        let Scratch { kernel, arena, gathered, rates, mean_dilation, .. } = scratch;
        for Members { source: Source { nodes, arenas, .. }, lists } in self.members(leaf, bins) {
            let look = Look { plan: self.plan, fields: nodes, arenas, scheme: self.scheme };
            look.at_leaf((kernel, arena, gathered), lists, leaf, chunk, |p, gathered| {
                rates.note(p, gathered)
            });
        }
        let cells = LeafCells::new(self.borders.of_leaf(leaf));
        mean_dilation.begin(chunk, &cells, self.scheme.coordinates);
        (0..chunk.len()).for_each(|p| mean_dilation.note(p, &rates.gradient(p), rates.hoop(p)));
        mean_dilation.average(chunk);
    }

    /// Whether particles of a leaf carry what follows the deformation: areas or total strains.
    fn needs_rates(&self, chunk: &Chunk<D>) -> bool {
        !self.tensors.is_empty() || has_surfaces(chunk, self.on_surfaces)
    }

    /// Whether the gather of the advance notes the rates that a leaf keeps: with F-bar they are known before.
    fn notes_rates(&self, keeps_rates: bool) -> bool {
        keeps_rates && !self.scheme.f_bar
    }

    /// Advances the particles whose boxes are cut, once all parts have gathered. Returns as
    /// [`Sweep::gather`].
    fn advance_cut(&self, scratch: &mut Scratch<D>, leaf: usize, chunk: &mut Chunk<D>, cut: &[u32]) -> f64 {
        let Scratch { kernel, gathered, leavers, mean_dilation, mean_volumes, booked, .. } = scratch;
        if self.notes_rates(scratch.keeps_rates) {
            cut.iter().zip(&*gathered).for_each(|(&p, gathered)| scratch.rates.note(p as usize, gathered));
        }
        let (cell, extent) = (self.plan.finest_cell(leaf), self.plan.extent());
        let (scheme, dt, dilation) = (self.scheme, self.dt, &mean_dilation.added[..]);
        let filling = self.filling(mean_volumes);
        let update = g2p::Advance { scheme, dt, cell, dilation, filling: filling.as_ref() };
        g2p::advance_gathered(kernel, chunk, cut, gathered, &update, &extent, (leavers, booked))
    }
}
