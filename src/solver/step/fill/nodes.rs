//! How full nodes are: reference volume of all material at a node over the volume of its basis function.
use rayon::prelude::*;

use super::solid::add_solids;
use crate::boundary::Collider;
use crate::grid::GridPlan;
use crate::grid::mask::{bits, block_nodes};
use crate::grid::sums::volumes::OfBlock;
use crate::kernel::{Coordinates, GivenColumn};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::volume::{reference_volume, volume};
use crate::solver::state::Solver;
use crate::solver::state::grid::Grid;
use crate::solver::state::grid::node_fill::NodeFill;
use crate::solver::state::phases::Phase;

impl<const D: usize> Solver<D> {
    /// Collective over neighbours. Sums up the reference volumes of all material at the nodes of velocity
    /// fields that bodies of unlike density share, ahead of P2G, in jobs with fluids. Other materials count
    /// with their current volume.
    pub(in crate::solver) fn scatter_volumes(&mut self) {
        if !self.physics.keeps_volumes() || self.physics.fill_densities.iter().all(Option::is_some) {
            return;
        }
        let physics = &self.physics;
        let volumes = |chunk: &Chunk<D>| {
            let of = |p: usize| match physics.materials[usize::from(Tag::unpack(chunk.tags()[p]).material)]
                .is_fluid()
            {
                true => reference_volume(chunk, p),
                false => volume(chunk, p),
            };
            let values = (0..chunk.len()).map(of).collect();
            vec![GivenColumn { column: Layout::<D>::MASS, values }]
        };
        let given: Vec<_> = self.chunks.par_iter().with_min_len(8).map(volumes).collect();
        let mut scattered = Vec::new();
        for field in 0..self.grid.fields.len() {
            let mut sums = Vec::new();
            if self.physics.fill_densities[field].is_none() {
                self.field_from_particles(field, 0.0, &given);
                sums.extend(self.grid.fields[field].nodes.rows.iter().map(|row| row.0[3]));
            }
            scattered.push(sums);
        }
        let Grid { plan, fill, .. } = &mut self.grid;
        node_fill(fill, plan, self.physics.coordinates).scattered = scattered;
    }

    /// Not collective. Finds how full the nodes are that G2P reads, in jobs with fluids: real ones from their
    /// masses, constrained ones from their parents.
    pub(in crate::solver) fn fill_nodes(&mut self) {
        if !self.physics.keeps_volumes() {
            return;
        }
        let Grid { plan, fields, fill, .. } = &mut self.grid;
        let (fill, nodes) = (node_fill(fill, plan, self.physics.coordinates), block_nodes(D));
        let fields: Vec<_> = fields.iter().map(|field| &field.nodes).collect();
        let densities = &self.physics.fill_densities;
        let (colliders, states) = (&self.physics.colliders, &self.contacts.states);
        let has_colliders = colliders.iter().any(Collider::is_present);
        let NodeFill { of_nodes, volumes, dirty, scattered, open } = fill;
        self.phases.time(Phase::Nodes, || {
            let blocks = of_nodes.par_chunks_mut(nodes).zip(dirty).zip(open).enumerate().with_min_len(32);
            blocks.for_each(|(index, ((values, dirty), open))| {
                let has_any = fields.iter().any(|fields| fields.active[index]);
                if *dirty {
                    values.fill(0.0);
                }
                *dirty = has_any || fields.iter().any(|fields| fields.may_hold(index));
                if !has_any {
                    return;
                }
                let volumes = volumes.of_block(plan, index);
                let block = &plan.blocks[index];
                for (number, fields) in fields.iter().enumerate().filter(|(_, fields)| fields.active[index]) {
                    let first = index * nodes;
                    let of_node = |bit: usize| match densities[number] {
                        Some(density) => fields.rows[first + bit].0[3] * (1.0 / density),
                        None => scattered[number][first + bit],
                    };
                    match volumes {
                        // No node is constrained; nodes that no particle reaches have no mass.
                        OfBlock::Same(volume) => {
                            let inverse = 1.0 / volume;
                            (0..nodes).for_each(|bit| values[bit] += of_node(bit) * inverse);
                        }
                        OfBlock::Each(volumes) => bits(block.real_nodes()).for_each(|bit| {
                            let bit = bit as usize;
                            values[bit] += of_node(bit) / volumes[bit];
                        }),
                    }
                }
                if has_colliders {
                    add_solids(plan, block, colliders, states, open, values);
                }
            });
            fields.iter().for_each(|fields| fields.prolong_values(plan, of_nodes));
        });
    }
}

/// How full the nodes of a plan are, made if it is not yet there.
fn node_fill<'a, const D: usize>(
    fill: &'a mut Option<Box<NodeFill>>,
    plan: &GridPlan<D>,
    coordinates: Coordinates,
) -> &'a mut NodeFill {
    fill.get_or_insert_with(|| Box::new(NodeFill::new(plan, coordinates)))
}
