//! The phases of a step between particles and nodes, in parallel over bins and leaves.
use rayon::prelude::*;

use super::update::{apply_faces, update_velocity};
use crate::adaptivity::resample::cell_fit::Resampling;
use crate::boundary::motion::Rate;
use crate::exact_sum::ExactSum;
use crate::grid::GridPlan;
use crate::grid::arenas::ArenaMut;
use crate::grid::plan::Bin;
use crate::grid::sums::fields::{VelocityArena, load_rows};
use crate::kernel::constrained::ConstrainedNodes;
use crate::kernel::g2p::{Fields, Gathered, Moments};
use crate::kernel::leavers::Leavers;
use crate::kernel::p2g::MomentSums;
use crate::kernel::{Frame, Row, Select, SubBox, Transfer, arena_nodes, g2p, p2g, spread};
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, Place};
use crate::simd::prefetch;
use crate::solver::migration::depart::Departed;
use crate::solver::sorting::bins::{BinMissing, BoxWidths, window_of};
use crate::solver::sorting::leaf_bins::{self, LeafBins};
use crate::solver::state::Solver;
use crate::solver::state::bookings::SUMS;
use crate::solver::state::grid::Grid;
use crate::solver::state::phases::{Phase, Phases};
use crate::solver::state::survey::{Survey, Watch};

/// Lines of an arena that are asked for ahead of time: all in 2D; in 3D the processor foresees the rest.
const READ_AHEAD: usize = 25;

/// Memory that a thread reuses from leaf to leaf.
struct Scratch<const D: usize> {
    kernel: g2p::Scratch<D>,
    arena: VelocityArena<D>,
    increments: Vec<Row>,
    gathered: Vec<Gathered<D>>,
    leavers: Leavers<D>,
    sort: leaf_bins::Scratch,
}

impl<const D: usize> Default for Scratch<D> {
    fn default() -> Self {
        Self {
            kernel: g2p::Scratch::default(),
            arena: VelocityArena::default(),
            increments: vec![Row::default(); arena_nodes(D)],
            gathered: Vec::new(),
            leavers: Leavers::default(),
            sort: leaf_bins::Scratch::default(),
        }
    }
}

/// The block of cells of a bin.
fn frame<const D: usize>(plan: &GridPlan<D>, bin: &Bin<D>) -> Frame<D> {
    let cell = plan.cell(bin.block.level);
    Frame { corner: bin.block.coord.map(|c| f64::from(4 * c) * cell), cell, extent: plan.extent() }
}

/// Constrained nodes in the arena of a bin, if there are any.
fn constrained<'a, const D: usize>(plan: &'a GridPlan<D>, bin: &Bin<D>) -> Option<&'a ConstrainedNodes> {
    Some(&plan.constraints[bin.touched? as usize].nodes)
}

/// Asks for the first lines of the arena at an address, which is cleared next.
fn read_ahead(next: usize) {
    (0..READ_AHEAD).for_each(|line| prefetch(next + 64 * line));
}

/// The members of a bin.
struct Selected<'a, const D: usize> {
    whole: Option<Select<'a>>,
    parts: &'a [SubBox<D>],
}

impl<'a, const D: usize> Selected<'a, D> {
    /// Members of bin number `number` of a leaf.
    fn of(lists: Option<&'a LeafBins<D>>, number: usize, chunk: &Chunk<D>) -> Self {
        let Some(bins) = lists else {
            let whole = (number == 0 && !chunk.is_empty()).then_some(Select::All);
            return Self { whole, parts: &[] };
        };
        let members = &bins.members[number];
        if number == 0 && members.whole.len() == chunk.len() && !chunk.is_empty() {
            return Self { whole: Some(Select::All), parts: &[] };
        }
        let whole = (!members.whole.is_empty()).then_some(Select::List(&members.whole));
        Self { whole, parts: &members.parts }
    }

    fn is_empty(&self) -> bool {
        self.whole.is_none() && self.parts.is_empty()
    }
}

/// Lists the particles of each bin and makes room for the arenas of those that have any.
pub(in crate::solver) fn sort_with<const D: usize>(
    grid: &mut Grid<D>,
    chunks: &[Chunk<D>],
    phases: &mut Phases,
    widths: &impl BoxWidths<D>,
) -> Result<(), BinMissing> {
    phases.time(Phase::Sort, || {
        let sorted = grid.lists.sort(&grid.plan, chunks, widths);
        let plan = &grid.plan;
        grid.lists.spread_parts(plan, chunks, |bin, chunk, parts, each| {
            spread::of_parts(chunk, parts, &frame(plan, bin), constrained(plan, bin), each);
        });
        grid.arenas.occupy(plan, &grid.seam, grid.lists.occupied(plan, chunks));
        sorted
    })
}

impl<const D: usize> Solver<D> {
    /// Lists the particles of each bin in leaves beside finer leaves.
    pub(in crate::solver) fn sort_into_bins(&mut self) -> Result<(), BinMissing> {
        let widths = self.physics.widths(&self.grid.plan);
        sort_with(&mut self.grid, &self.chunks, &mut self.phases, &widths)
    }

    /// P2G: scatters mass, affine momentum and the impulse of stress of the bins of a wave into their
    /// arenas.
    pub(in crate::solver) fn scatter(&mut self, dt: f64, wave: usize) {
        let scheme = self.physics.scheme();
        let (grid, chunks, costs) = (&mut self.grid, &self.chunks, &self.costs);
        let (plan, lists) = (&grid.plan, &grid.lists);
        let arenas = grid.arenas.of_wave(wave);
        self.phases.time(Phase::Scatter, || {
            let scatter_bin = |scratch: &mut p2g::Scratch<D>, mut arena: ArenaMut<'_, D>| {
                let bin = &plan.bins[arena.bin];
                let leaf = bin.leaf as usize;
                let chunk = &chunks[leaf];
                let (lists, number) = (lists.of_leaf(leaf), arena.bin - plan.leaf_bins(leaf).start);
                let selected = Selected::of(lists, number, chunk);
                arena.clear(&window_of(lists, number));
                read_ahead(arena.next);
                let (frame, rows, sums) = (frame(plan, bin), arena.rows, arena.moments);
                let nodes = constrained(plan, bin);
                if let Some(whole) = selected.whole {
                    let moments = nodes.map(|nodes| MomentSums { nodes, sums: &mut *sums });
                    let next = chunks.get(leaf + 1).map_or(Place::default(), Chunk::place);
                    p2g::scatter(scratch, chunk, whole, &frame, &scheme, dt, rows, moments, next);
                }
                if !selected.parts.is_empty() {
                    let moments = nodes.map(|nodes| MomentSums { nodes, sums });
                    let parts = selected.parts;
                    p2g::scatter_sub_boxes(scratch, chunk, parts, &frame, &scheme, dt, rows, moments);
                }
            };
            arenas.into_par_iter().for_each_init(Default::default, |scratch, arena| {
                costs.time(plan.bins[arena.bin].leaf as usize, || scatter_bin(scratch, arena));
            });
        });
    }

    /// Turns affine matrices C, as a new state gives them, into the `B = C D` that APIC keeps; transfers by increments
    /// keep none.
    pub(in crate::solver) fn moments_from_affine(&mut self) -> Result<(), BinMissing> {
        match self.physics.transfer {
            Transfer::Apic => {}
            Transfer::Tpic => return Ok(()),
            Transfer::Flip { .. } | Transfer::Xpic { .. } => {
                for chunk in &mut self.chunks {
                    let first = Layout::<D>::AFFINE;
                    (first..first + D * D).for_each(|column| chunk.column_mut(column).fill(0.0));
                }
                return Ok(());
            }
        }
        self.sort_into_bins()?;
        let scheme = self.physics.scheme();
        let (plan, lists) = (&self.grid.plan, &self.grid.lists);
        self.chunks.par_iter_mut().enumerate().for_each(|(leaf, chunk)| {
            let mut spreads = vec![[0.0; D]; chunk.len()];
            for (number, bin) in plan.leaf_bins(leaf).enumerate() {
                let selected = Selected::of(lists.of_leaf(leaf), number, chunk);
                let bin = &plan.bins[bin];
                if let Some(whole) = selected.whole {
                    let (frame, nodes) = (frame(plan, bin), constrained(plan, bin));
                    spread::of_particles(chunk, whole, &frame, &scheme, nodes, |p, spread| {
                        spreads[p] = spread;
                    });
                }
                selected.parts.iter().for_each(|part| spreads[part.particle as usize] = part.spread);
            }
            for i in 0..D {
                for k in 0..D {
                    let column = chunk.column_mut(Layout::<D>::AFFINE + D * i + k);
                    column.into_iter().zip(&spreads).for_each(|(value, spread)| *value *= spread[k]);
                }
            }
        });
        Ok(())
    }

    /// Adds up own arenas on the nodes of the blocks of a wave.
    pub(in crate::solver) fn sum_nodes(&mut self, wave: usize) {
        let grid = &mut self.grid;
        self.phases.time(Phase::Sum, || grid.fields.sum(&grid.plan, &grid.arenas, wave));
    }

    /// Hands sums of constrained nodes to their parents.
    pub(in crate::solver) fn restrict(&mut self) {
        let grid = &mut self.grid;
        self.phases.time(Phase::Nodes, || grid.fields.restrict(&grid.plan));
    }

    /// Velocities on real nodes: momentum over mass, gravity, loads, then the conditions of the colliders in their order, at
    /// last those of the domain's faces, so that nothing is driven out of the domain. Returns impulse and angular
    /// impulse on each collider from the nodes of this rank.
    pub(in crate::solver) fn update_nodes(&mut self, dt: f64, rates: &[Rate<D>]) -> Vec<[ExactSum; SUMS]> {
        let gravity = self.physics.gravity.at(self.clock.time + 0.5 * dt);
        let grid = &mut self.grid;
        self.phases.time(Phase::Nodes, || {
            update_velocity(&mut grid.fields, &grid.plan, gravity, dt);
        });
        let pushes = self.apply_loads(dt);
        let impulses = self.collide(rates);
        let (grid, faces) = (&mut self.grid, &self.physics.faces);
        self.phases.time(Phase::Nodes, || apply_faces(&mut grid.fields, &grid.plan, faces));
        self.book_loads(&pushes);
        impulses
    }

    /// Interpolates velocities on constrained nodes from their parents.
    pub(in crate::solver) fn prolong(&mut self) {
        let grid = &mut self.grid;
        self.phases.time(Phase::Nodes, || grid.fields.prolong(&grid.plan, &grid.arenas));
    }

    /// G2P: velocity, affine matrix, deformation, stress and position of all particles. Returns what has departed from
    /// leaves, in their order, to be handed to [`Solver::arrive`]: particles are taken out while they are in the cache.
    pub(in crate::solver) fn gather(&mut self, dt: f64) -> Vec<Departed> {
        let scheme = self.physics.scheme();
        let resampling = Resampling::new(self.physics.adaptivity.as_ref(), &scheme, self.grid.plan.extent());
        let resampling = resampling.as_ref();
        let widths = self.physics.widths(&self.grid.plan);
        let borders = &self.grid.migration.borders;
        let (plan, fields, arenas) = (&self.grid.plan, &self.grid.fields, &self.grid.arenas);
        let lists = &mut self.grid.lists;
        let changes = scheme.transfer.has_increments().then_some(&self.grid.increments.rows);
        let (chunks, signal, costs) = (&mut self.chunks, &mut self.signal, &self.costs);
        let adaptivity = self.physics.adaptivity.as_ref();
        let watch = adaptivity.map(|adaptivity| Watch::after_step(adaptivity, self.clock.step + 1));
        let watch = watch.unwrap_or_default();
        self.surveys.resize(chunks.len(), Survey::default());
        signal.resize(chunks.len(), 0.0);
        let surveys = &mut self.surveys;
        self.places.clear();
        self.places.extend(chunks.iter().map(Chunk::place));
        let places = &self.places;
        self.phases.time(Phase::Gather, || {
            let leaves = chunks.par_iter_mut().zip(lists.by_leaf()).zip(surveys).zip(signal).enumerate();
            let gather_leaf =
                |scratch: &mut Scratch<D>, leaf: usize, chunk: &mut Chunk<D>, lists: Option<&LeafBins<D>>| {
                    let Scratch { kernel, arena, increments, gathered, leavers, .. } = scratch;
                    leavers.begin(borders.of_leaf(leaf));
                    if chunk.is_empty() {
                        return 0.0;
                    }
                    let cut = lists.map_or(&[][..], |bins| &bins.cut);
                    gathered.clear();
                    gathered.resize(cut.len(), Gathered::default());
                    let mut signal: f64 = 0.0;
                    for (number, bin) in plan.leaf_bins(leaf).enumerate() {
                        let selected = Selected::of(lists, number, chunk);
                        if selected.is_empty() {
                            continue;
                        }
                        let window = window_of(lists, number);
                        fields.load(plan, bin, &window, arena);
                        let next = arenas.after(bin).map_or(Place::default(), |(next, window)| {
                            fields.read_ahead(plan, next, &window);
                            places[plan.bins[next].leaf as usize]
                        });
                        if let Some(changes) = changes {
                            load_rows(plan, bin, &window, changes, increments);
                        }
                        let bin = &plan.bins[bin];
                        let frame = frame(plan, bin);
                        let moments =
                            constrained(plan, bin).map(|nodes| Moments { nodes, first: &arena.moments });
                        let increment = changes.map(|_| &increments[..]);
                        let nodes = Fields { velocity: &arena.rows, increment, moments };
                        g2p::gather_sub_boxes(kernel, chunk, selected.parts, &frame, &nodes, gathered);
                        if let Some(whole) = selected.whole {
                            let fastest =
                                g2p::gather(kernel, chunk, whole, &frame, &scheme, dt, &nodes, leavers, next);
                            signal = signal.max(fastest);
                        }
                    }
                    let finest = plan.bins[plan.leaf_bins(leaf)].iter().map(|bin| bin.block.level).max();
                    let cell = plan.cell(finest.unwrap_or(0));
                    let fastest = g2p::advance_gathered(
                        kernel,
                        chunk,
                        cut,
                        gathered,
                        &scheme,
                        dt,
                        cell,
                        &plan.extent(),
                        leavers,
                    );
                    // Bins take them in turn.
                    leavers.found.sort_unstable();
                    signal.max(fastest)
                };
            let departed = leaves.map_init(
                Default::default,
                |scratch: &mut Scratch<D>, (leaf, (((chunk, lists), survey), signal))| {
                    // Of empty leaves there may be very many, and to take the time costs more than they do.
                    let is_empty = chunk.is_empty();
                    let work = || {
                        watch.before(chunk, survey);
                        *signal = gather_leaf(scratch, leaf, chunk, lists.lists());
                        watch.after(chunk, dt, survey);
                        let departed =
                            borders.depart(&plan.tree, leaf, chunk, &scratch.leavers.found, resampling);
                        if !is_empty {
                            lists.presort(plan, leaf, chunk, &widths, &mut scratch.sort);
                        }
                        departed
                    };
                    if is_empty { work() } else { costs.time(leaf, work) }
                },
            );
            departed.filter(Departed::is_any).collect()
        })
    }

    /// S: velocities of the nodes at all particles, leaf by leaf.
    pub(super) fn interpolate(&mut self) -> Vec<Vec<[f64; D]>> {
        let scheme = self.physics.scheme();
        let (plan, rows, lists) = (&self.grid.plan, &self.grid.fields.rows, &self.grid.lists);
        let chunks = &self.chunks;
        self.phases.time(Phase::Gather, || {
            let leaves = chunks.par_iter().enumerate();
            let all = leaves.map_init(Default::default, |scratch: &mut Scratch<D>, (leaf, chunk)| {
                let Scratch { kernel, increments: arena, gathered, .. } = scratch;
                let lists = lists.of_leaf(leaf);
                let cut = lists.map_or(&[][..], |bins| &bins.cut);
                gathered.clear();
                gathered.resize(cut.len(), Gathered::default());
                let mut velocities = vec![[0.0; D]; chunk.len()];
                for (number, bin) in plan.leaf_bins(leaf).enumerate() {
                    let selected = Selected::of(lists, number, chunk);
                    if selected.is_empty() {
                        continue;
                    }
                    load_rows(plan, bin, &window_of(lists, number), rows, arena);
                    let frame = frame(plan, &plan.bins[bin]);
                    let nodes = Fields { velocity: arena, increment: None, moments: None };
                    g2p::gather_sub_boxes(kernel, chunk, selected.parts, &frame, &nodes, gathered);
                    if let Some(whole) = selected.whole {
                        g2p::interpolate(kernel, chunk, whole, &frame, &scheme, arena, |p, v| {
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
        })
    }
}
