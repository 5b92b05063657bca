//! Between the feet and the nodes.
use rayon::prelude::*;

use super::at_nodes::{is_at_another, obey};
use super::feet::LeafFeet;
use crate::boundary::motion::Rate;
use crate::boundary::{Bounds, Collider, ColliderState, Gap, gap};
use crate::exact_sum::ExactSum;
use crate::grid::Window;
use crate::grid::mask::block_nodes;
use crate::grid::plan::NO_BLOCK;
use crate::kernel::Row;
use crate::leapfrog::Lengths;
use crate::solver::state::Solver;
use crate::solver::state::bookings::SUMS;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::inside::{Inside, Plane};
use crate::solver::state::grid::velocity_field::VelocityField;
use crate::solver::step::colliders::Touch;
use crate::solver::step::contact::sweeps::for_real_nodes;

/// Weight of a deep node for a foot that is lighter than it: more than a node has feet.
const HEAVY: f64 = 64.0;

/// By leaf with feet and by foot, the sum of the weights of corners that have mass.
pub(super) type Covered = Vec<Vec<f64>>;

impl<const D: usize> Grid<D> {
    /// Feet of nodes that have mass in a velocity field, by own leaf that has any, on the colliders whose
    /// number `acts` at feet.
    pub(super) fn feet(
        &self,
        field: usize,
        colliders: &[Collider<D>],
        states: &[ColliderState<D>],
        acts: impl Fn(usize) -> bool + Sync,
    ) -> Vec<LeafFeet<D>> {
        let Self { plan, fields, inside_still, inside_moving, .. } = self;
        let nodes = &fields[field].nodes;
        let all = [inside_still, inside_moving];
        let blocks = (0..plan.blocks.len()).into_par_iter().with_min_len(256);
        let has_feet = |block: usize| {
            let mut inside = all.iter().filter_map(|inside| inside.get(block)).flatten().flatten();
            nodes.active[block] && inside.any(|inside| !inside.planes.is_empty() || inside.buried != 0)
        };
        let has_feet: Vec<bool> = blocks.map(has_feet).collect();
        let has_mass = |row: usize| {
            let (block, bit) = (row / block_nodes(D), row % block_nodes(D));
            plan.blocks[block].constrained >> bit & 1 == 1 || nodes.rows[row].0[3] > 0.0
        };
        let acts_at_node = |collider: usize, plane: &Plane<D>, cell: f64| {
            is_at_another(colliders, states, collider, plane, cell)
        };
        let normal = |collider: usize, x: &[f64; D]| colliders[collider].normal(x, &states[collider].pose);
        let leaves = (0..plan.leaf_start.len() - 1).into_par_iter().with_min_len(64);
        let found = leaves.filter_map(|leaf| {
            let bin = &plan.bins[plan.leaf_bins(leaf).start];
            if !bin.around.iter().any(|&block| block != NO_BLOCK && has_feet[block as usize]) {
                return None;
            }
            let [still, moving] = all.map(|inside| {
                let of_block = |block: usize| of_block(inside, &has_feet, block);
                LeafFeet::find(plan, leaf, of_block, has_mass, &acts, acts_at_node, normal)
            });
            let mut feet = still;
            feet.feet.extend(moving.feet);
            feet.touching.extend(moving.touching);
            (!feet.feet.is_empty()).then_some(feet)
        });
        found.collect()
    }
}

/// Colliders at the nodes of a block that has any of them inside.
fn of_block<'a, const D: usize>(
    inside: &'a [Vec<Option<Inside<D>>>],
    has_feet: &[bool],
    block: usize,
) -> &'a [Option<Inside<D>>] {
    inside.get(block).filter(|_| has_feet[block]).map_or(&[], Vec::as_slice)
}

impl<const D: usize> Solver<D> {
    /// Collective over neighbours. Finds the contact at each foot of a velocity field from the gap there, and
    /// how much of the foot's cell has mass.
    pub(super) fn find_gaps(
        &mut self,
        field: usize,
        lengths: Lengths,
        rates: &[Rate<D>],
        all: &mut [LeafFeet<D>],
    ) -> Covered {
        // This marks the nodes in reach of feet of any rank.
        self.scatter_at_feet(all, |_, _| [0.0; 4]);
        let Grid { plan, solids, fields, contact: VelocityField { nodes, arenas, .. }, .. } = &mut self.grid;
        let touches = !self.physics.moves_over_gaps(field);
        let known = !touches || self.physics.has_walls_by_area();
        let masses = &fields[field].nodes.rows;
        let sums = |node: usize| match known {
            true => solids[field].at_walls()[node].0,
            false => [0.0; 4],
        };
        let cells: Vec<f64> = plan.blocks.iter().map(|block| plan.cell(block.level)).collect();
        for_real_nodes(nodes, plan, |node, row| {
            let has_mass = masses[node].0[3] > 0.0;
            let size = sums(node)[3] / cells[node / block_nodes(D)];
            *row = if has_mass { Row([size, 1.0, 0.0, 0.0]) } else { Row::default() };
        });
        nodes.prolong(plan, arenas);
        let sizes: Vec<Vec<_>> = all
            .iter()
            .map(|leaf| leaf.feet.iter().map(|foot| foot.at_corners(&nodes.rows)).collect())
            .collect();
        let covered: Covered = all
            .iter()
            .map(|leaf| leaf.feet.iter().map(|foot| foot.gather(&nodes.rows)[1]).collect())
            .collect();
        for_real_nodes(nodes, plan, |node, row| {
            let [x, y, z, _] = sums(node);
            *row = if masses[node].0[3] > 0.0 { Row([x, y, z, 0.0]) } else { Row::default() };
        });
        nodes.prolong(plan, arenas);
        let (colliders, states) = (&self.physics.colliders, &self.contacts.states);
        for (leaf, (sizes, covered)) in all.iter_mut().zip(sizes.iter().zip(&covered)) {
            let each = leaf.feet.iter().zip(&mut leaf.touching).zip(sizes.iter().zip(covered));
            for ((foot, touching), (sizes, covered)) in each.filter(|((foot, _), _)| !foot.is_deep) {
                if *covered <= 0.0 {
                    continue;
                }
                let collider = &colliders[foot.collider];
                let gap = match touches || !collider.contact.has_gap() {
                    true => Some(Gap::CLOSED),
                    false => foot.gap(self.physics.coordinates, sizes, &foot.at_corners(&nodes.rows)),
                };
                *touching = gap.map(|gap| {
                    let surface =
                        collider.velocity_at(&foot.at, &states[foot.collider].pose, &rates[foot.collider]);
                    foot.touching(collider.contact, surface, gap, lengths)
                });
            }
        }
        covered
    }

    /// Collective over neighbours. Velocities at each foot that impulses of 1 kg m/s on all feet bring: along
    /// its normal by those of all feet along their normals, with what friction adds, so that feet of walls at
    /// right angles leave each other alone; along the surface by any.
    pub(super) fn find_compliances_at_feet(
        &mut self,
        field: usize,
        all: &mut [LeafFeet<D>],
        covered: &Covered,
    ) {
        self.scatter_at_feet(all, |leaf, foot| {
            let Some(contact) = &all[leaf].touching[foot] else { return [0.0; 4] };
            let reach = all[leaf].feet[foot].reach(contact.law);
            // Ranks send each other the lanes of a velocity and that of the mass.
            let impulse =
                std::array::from_fn(
                    |lane| if lane == 3 { 1.0 } else { reach.get(lane).copied().unwrap_or(0.0) },
                );
            impulse.map(|impulse: f64| impulse / covered[leaf][foot])
        });
        let Grid { plan, fields, contact, .. } = &mut self.grid;
        let masses = &fields[field].nodes.rows;
        for_real_nodes(&mut contact.nodes, plan, |node, row| {
            let mass = masses[node].0[3];
            *row = Row(if mass > 0.0 { row.0.map(|sum| sum / mass) } else { [0.0; 4] });
        });
        contact.prolong(plan, &mut self.phases);
        let rows = &contact.nodes.rows;
        for (leaf, covered) in all.iter_mut().zip(covered) {
            for ((foot, touching), covered) in leaf.feet.iter().zip(&mut leaf.touching).zip(covered) {
                if let Some(contact) = touching {
                    let [axes @ .., of_surface] = foot.gather(rows).map(|sum| sum / covered);
                    let of_normal = (0..D).fold(0.0, |sum, a| axes[a].mul_add(foot.normal[a].abs(), sum));
                    contact.compliance = [of_normal, of_surface];
                }
            }
        }
        if self.physics.has_walls_by_area() {
            self.find_areas(field, all, covered);
        }
    }

    /// Not collective. Multiplies what cohesion bears by the area of the material's surface that each foot
    /// holds, and drag by the density there as well: a node shares `-Σ V ∇w · n` out to the feet that it is a
    /// corner of, by weights. Real nodes have the sums of these over their mass.
    fn find_areas(&mut self, field: usize, all: &mut [LeafFeet<D>], covered: &Covered) {
        let Grid { plan, solids, fields, contact: VelocityField { nodes, arenas, .. }, .. } = &mut self.grid;
        let (masses, sums) = (&fields[field].nodes.rows, solids[field].at_walls());
        for_real_nodes(nodes, plan, |node, row| {
            let shares = masses[node].0[3] * row.0[3];
            let [x, y, z, volume] = sums[node].0;
            let density = if volume > 0.0 { masses[node].0[3] / volume } else { 0.0 };
            *row = Row(match shares > 0.0 {
                true => [x / shares, y / shares, z / shares, density],
                false => [0.0; 4],
            });
        });
        nodes.prolong(plan, arenas);
        for (leaf, covered) in all.iter_mut().zip(covered) {
            for ((foot, touching), covered) in leaf.feet.iter().zip(&mut leaf.touching).zip(covered) {
                if let Some(contact) = touching {
                    let slopes = foot.gather(&nodes.rows);
                    let area = gap::slope(&slopes, &foot.normal) / covered;
                    contact.sticking *= area.max(0.0);
                    contact.drag *= area.max(0.0) * slopes[3] / covered;
                }
            }
        }
    }

    /// Not collective. Corrects the impulses for the velocities at the feet; returns what the nodes of each
    /// get of it, by weights.
    pub(super) fn correct_at_feet(
        &mut self,
        all: &mut [LeafFeet<D>],
        covered: &Covered,
    ) -> Vec<Vec<[f64; 4]>> {
        let rows = &self.grid.contact.nodes.rows;
        let leaves = all.iter_mut().zip(covered);
        let corrected = leaves.map(|(leaf, covered)| {
            let each = leaf.feet.iter().zip(&mut leaf.touching).zip(covered);
            let impulses = each.map(|((foot, touching), covered)| {
                let Some(contact) = touching else { return [0.0; 4] };
                let velocity = foot.gather(rows);
                let impulse = contact.correct(&std::array::from_fn(|a| velocity[a] / covered));
                std::array::from_fn(|lane| if lane < D { impulse[lane] / covered } else { 0.0 })
            });
            impulses.collect()
        });
        corrected.collect()
    }

    /// Collective over neighbours. Leaves on real nodes the sums of what each foot gives to the corners of
    /// its cell, by weights.
    pub(super) fn scatter_at_feet(
        &mut self,
        all: &[LeafFeet<D>],
        value: impl Fn(usize, usize) -> [f64; 4] + Sync + Send,
    ) {
        let Grid { plan, exchange, contact, .. } = &mut self.grid;
        contact.scatter_and_sum((plan, exchange), &mut self.phases, &self.chunks, |(), bin, mut arena| {
            arena.clear(&Window::FULL);
            let Ok(leaf) = all.binary_search_by_key(&bin.number, |leaf| leaf.bin) else { return };
            for (number, foot) in all[leaf].feet.iter().enumerate() {
                foot.scatter(&value(leaf, number), arena.rows);
            }
        });
    }

    /// Collective over neighbours. Gives deep nodes the velocity of their foot, and books what this takes
    /// from them. A node that is heavier than what is at a foot is no sliver but what has strayed into the
    /// collider: it obeys the conditions of its surfaces itself. The velocity of the few at the foot is
    /// extrapolated from its own, and to take it would add energy without bounds.
    pub(super) fn take_along(
        &mut self,
        field: usize,
        all: &[LeafFeet<D>],
        covered: &Covered,
        rates: &[Rate<D>],
        sums: &mut [[ExactSum; SUMS]],
    ) {
        let Grid { plan, fields, exchange, contact, inside_still, inside_moving, .. } = &mut self.grid;
        let own = &mut fields[field].nodes.rows;
        for_real_nodes(&mut contact.nodes, plan, |node, row| *row = own[node]);
        contact.prolong(plan, &mut self.phases);
        let rows = &contact.nodes.rows;
        let of_feet = |(leaf, covered): (&LeafFeet<D>, &Vec<f64>)| -> Vec<[f64; 4]> {
            let each = leaf.feet.iter().zip(covered);
            each.map(|(foot, covered)| {
                if !foot.is_deep || *covered <= 0.0 {
                    return [0.0; 4];
                }
                let [x, y, z, mass] = foot.gather(rows).map(|sum| sum / covered);
                match own[foot.node[1]].0[3] <= mass {
                    true => [x, y, z, 1.0],
                    false => [0.0, 0.0, 0.0, HEAVY],
                }
            })
            .collect()
        };
        let velocities: Vec<Vec<[f64; 4]>> = all.iter().zip(covered).map(of_feet).collect();
        let is_real =
            |row: usize| plan.blocks[row / block_nodes(D)].real_nodes() >> (row % block_nodes(D)) & 1 == 1;
        let real: Vec<Vec<bool>> =
            all.iter().map(|leaf| leaf.feet.iter().map(|foot| is_real(foot.node[1])).collect()).collect();
        contact.scatter_and_sum((plan, exchange), &mut self.phases, &self.chunks, |(), bin, mut arena| {
            arena.clear(&Window::FULL);
            let Ok(leaf) = all.binary_search_by_key(&bin.number, |leaf| leaf.bin) else { return };
            for (number, foot) in all[leaf].feet.iter().enumerate().filter(|(number, _)| real[leaf][*number])
            {
                let row = &mut arena.rows[foot.node[0]].0;
                (0..4).for_each(|lane| row[lane] += velocities[leaf][number][lane]);
            }
        });
        let (physics, states) = (&self.physics, &self.contacts.states);
        let mut touches = Vec::new();
        for_real_nodes(&mut contact.nodes, plan, |node, sum| {
            let row = &mut own[node];
            let [.., count] = sum.0;
            if count == 0.0 || row.0[3] <= 0.0 {
                return;
            }
            let (block, bit) = (node / block_nodes(D), node % block_nodes(D));
            let is_counted = plan.blocks[block].owned >> bit & 1 == 1;
            let known = [&*inside_still, &*inside_moving].into_iter().flat_map(|inside| inside.get(block));
            let colliders = known.flat_map(|of_block| of_block.iter().enumerate());
            let acting = colliders
                .filter(|(collider, _)| physics.acts_at_feet(field, &physics.colliders[*collider]))
                .filter_map(|(collider, inside)| Some((collider, inside.as_ref()?)));
            let mut planes = acting.flat_map(|(collider, inside)| {
                let own = inside.planes.iter().filter(|plane| usize::from(plane.bit) == bit);
                own.map(move |plane| (collider, plane))
            });
            if count >= HEAVY {
                let position = plan.node_place(&plan.blocks[block], bit);
                for (collider, plane) in planes {
                    let of = (&physics.colliders[collider], &states[collider], &rates[collider]);
                    let given =
                        obey(row, &position, of, &plane.normal, Bounds::TOUCHING).filter(|_| is_counted);
                    touches.extend(given.map(|impulse| Touch { collider, position, impulse }));
                }
                return;
            }
            let before: [f64; D] = std::array::from_fn(|a| row.0[a]);
            (0..D).for_each(|a| row.0[a] = sum.0[a] / count);
            if let Some((collider, plane)) = planes.next().filter(|_| is_counted) {
                let impulse = std::array::from_fn(|a| row.0[3] * (before[a] - row.0[a]));
                touches.push(Touch { collider, position: plane.foot, impulse });
            }
        });
        touches.iter().for_each(|touch| touch.book(&physics.colliders, states, sums));
    }
}
