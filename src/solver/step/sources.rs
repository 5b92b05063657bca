//! Sources in a step: particles in their shapes move with their velocity, and new layers enter at the end.
//!
//! Particles in the shape of a source contribute to the sums of nodes with its velocity, and keep their state
//! through the step: they push the material ahead like a piston, and bear no load. The momentum and the
//! kinetic energy that this requires are added to those of the particles that enter.
use crate::geometry::{Aabb, Side};
use crate::grid::leaf_geometry::position_key;
use crate::kernel::Coordinates;
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::solver::physics::Physics;
use crate::solver::state::Solver;
use crate::solver::state::bookings::SourcePush;
use crate::source::Source;

/// Particles of a leaf that are in the shapes of their sources, with their state before the step.
#[derive(Debug, Default)]
pub(super) struct Conveyed {
    /// Their indices, ascending, with the places of their sources in the list.
    particles: Vec<(u32, usize)>,
    /// All columns, particle by particle.
    state: Vec<f64>,
}

/// Sources that convey, with their numbers in the job.
pub(super) type Conveyors<'a, const D: usize> = Vec<(u32, &'a Source<D>)>;

/// The sources that convey in a step from a time, s.
pub(super) fn conveyors<const D: usize>(physics: &Physics<D>, time: f64) -> Conveyors<'_, D> {
    (0..).zip(&physics.sources).filter(|(_, source)| source.conveys(time)).collect()
}

impl Conveyed {
    /// Conveyed particles of a leaf with these corners, m.
    pub(super) fn of_leaf<const D: usize>(
        conveyors: &[(u32, &Source<D>)],
        chunk: &Chunk<D>,
        (lower, upper): &([f64; D], [f64; D]),
    ) -> Self {
        let mut found = Self::default();
        let cell = Aabb::new(*lower, *upper);
        let is_near = |source: &Source<D>| source.shape.classify(&cell) != Side::Outside;
        let near: Vec<usize> = (0..conveyors.len()).filter(|&i| is_near(conveyors[i].1)).collect();
        if near.is_empty() {
            return found;
        }
        for (p, &tag) in chunk.tags().iter().enumerate() {
            let body = Tag::unpack(tag).body;
            let own = near.iter().find(|&&i| conveyors[i].1.body == body);
            let Some(&own) = own.filter(|&&i| conveyors[i].1.shape.contains(&chunk.position(p))) else {
                continue;
            };
            found.particles.push((p as u32, own));
            found.state.extend(chunk.tile_of(p).iter().map(|line| line[p % line.len()]));
        }
        found
    }

    /// Whether there are any.
    pub(super) fn is_empty(&self) -> bool {
        self.particles.is_empty()
    }

    /// Their indices, ascending.
    pub(super) fn indices(&self) -> Vec<u32> {
        self.particles.iter().map(|(p, _)| *p).collect()
    }

    /// Restores the state that they had before a step of length `dt` (s), moved with their sources, and
    /// records the impulse and work of that.
    pub(super) fn convey<const D: usize>(
        &self,
        conveyors: &[(u32, &Source<D>)],
        chunk: &mut Chunk<D>,
        dt: f64,
        pushes: &mut Vec<SourcePush<D>>,
    ) {
        let states = self.state.chunks_exact(Layout::<D>::REALS);
        for (&(p, own), state) in self.particles.iter().zip(states) {
            let (p, (number, source)) = (p as usize, conveyors[own]);
            let gathered: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
            chunk.write(0, p, state);
            let x: [f64; D] =
                std::array::from_fn(|a| dt.mul_add(source.velocity[a], state[Layout::<D>::POSITION + a]));
            chunk.write(Layout::<D>::POSITION, p, &x);
            chunk.write(Layout::<D>::VELOCITY, p, &source.velocity);
            (0..D).for_each(|row| chunk.write(Layout::<D>::AFFINE + D * row, p, &[0.0; D]));
            let mass = state[Layout::<D>::MASS];
            let impulse = std::array::from_fn(|a| mass * (source.velocity[a] - gathered[a]));
            let work = 0.5 * mass * (square(&source.velocity) - square(&gathered));
            pushes.push(SourcePush { source: number, impulse, work });
        }
    }
}

fn square<const D: usize>(velocity: &[f64; D]) -> f64 {
    velocity.iter().map(|v| v * v).sum()
}

impl<const D: usize> Solver<D> {
    /// Not collective. Adds the impulse and work of sources on particles in their shapes to the sums.
    pub(in crate::solver) fn book_conveyed(&mut self) {
        for push in self.particle_forces.conveyed.iter().flatten() {
            let sums = &mut self.sums.sources.of[push.source as usize];
            (0..D).for_each(|a| sums[1 + a].add(push.impulse[a]));
            sums[4].add(push.work);
        }
    }

    /// Not collective. Adds the layers that are due in the present step, which ends at the time `to`, s. All
    /// ranks number all particles, and make those in their own leaves; behind the arrivals there, as if they
    /// came from leaves at the end of the curve.
    pub(in crate::solver) fn feed(&mut self, to: f64) {
        let Self { physics, grid, chunks, leaf_data, measured, adaptation, sums, clock, .. } = self;
        let (ledger, fluxes) = (&mut adaptation.ledger, &mut measured.crossings.fluxes);
        let (plan, extent) = (&grid.plan, grid.plan.extent());
        for (number, source) in physics.sources.iter().enumerate() {
            let layers = source.layers_before(clock.time)..source.layers_before(to);
            if layers.is_empty() {
                continue;
            }
            let mut columns = vec![0.0_f64; Layout::<D>::REALS];
            (0..3).for_each(|diagonal| columns[Layout::<D>::LEFT_CAUCHY_GREEN + diagonal] = 1.0);
            columns[Layout::<D>::VELOCITY..][..D].copy_from_slice(&source.velocity);
            let material = &physics.materials[usize::from(source.material)];
            columns[Layout::<D>::STRESS..][..3].fill(-material.rest_pressure());
            let history = material.initial_history();
            columns[Layout::<D>::HISTORY..][..history.len()].copy_from_slice(&history);
            let tag = Tag { material: source.material, body: source.body, level: source.level }.pack();
            for layer in layers {
                for (line, x) in source.layer(layer, to) {
                    let mass = source.masses[line];
                    columns[Layout::<D>::MASS] = mass;
                    columns[Layout::<D>::HALF] = source.halves[line];
                    let id = ledger.next_root;
                    ledger.next_root += 1;
                    // A shape at a face of the domain may end within the displacement of a step.
                    let x: [f64; D] = std::array::from_fn(|a| x[a].clamp(0.0, extent[a].next_down()));
                    let tree = &plan.tree;
                    let known = tree.locate(position_key(x, tree.brick().roots, physics.root_edge));
                    let Some(leaf) = known.and_then(|known| tree.local(known)) else { continue };
                    let chunk = &mut chunks[leaf];
                    sums.fed[number][0] += 1;
                    sums.fed[number][1] +=
                        u64::from(is_taken(chunk, &x, 0.5 * source.spacing, physics.coordinates));
                    columns[Layout::<D>::POSITION..][..D].copy_from_slice(&x);
                    let words: Vec<u64> = columns.iter().map(|value| value.to_bits()).collect();
                    chunk.push_words(&words, id, tag, &[]);
                    let signal = &mut leaf_data.signal[leaf];
                    *signal = signal.max(physics.signal_of(source, plan.finest_cell(leaf)));
                    fluxes.book_fed(&x, mass);
                    let sums = &mut sums.sources.of[number];
                    sums[0].add(mass);
                    (0..D).for_each(|a| sums[1 + a].add(mass * source.velocity[a]));
                    sums[4].add(0.5 * mass * square(&source.velocity));
                }
            }
        }
    }

    /// Collective. Particles that each source has fed since the start of this process, and those among them
    /// that entered where other material was.
    pub fn fed_totals(&self) -> Vec<[u64; 2]> {
        let mut all = self.sums.fed.clone();
        self.comm.sum_u64(all.as_flattened_mut());
        all
    }
}

/// Whether half of the box of an entering particle, along each axis, lies in the box of a particle of the
/// chunk.
fn is_taken<const D: usize>(chunk: &Chunk<D>, x: &[f64; D], half: f64, coordinates: Coordinates) -> bool {
    let halves = chunk.column(Layout::<D>::HALF);
    (0..chunk.len()).any(|q| {
        let y = chunk.position(q);
        let near = 0.5 * (half + coordinates.half_width(halves[q], y[0]));
        (0..D).all(|a| (x[a] - y[a]).abs() < near)
    })
}
