//! The values of the refinement criteria, leaf by leaf, after a step.
use rayon::prelude::*;

use crate::adaptivity::Value;
use crate::adaptivity::leaf_view::RankState;
use crate::adaptivity::surroundings::MassRange;
use crate::solver::state::Solver;

impl<const D: usize> Solver<D> {
    /// Collective. The value of each criterion (inner) in each own leaf (outer); all zero for leaves without
    /// particles. To be called after [`Solver::survey_now`], or after a step at whose end a regrid is due.
    pub(super) fn indicators(&mut self) -> Vec<Value> {
        let refining = self.physics.adaptivity.as_ref().filter(|adaptivity| adaptivity.is_refining());
        let Some(adaptivity) = refining else { return Vec::new() };
        let criteria = &adaptivity.criteria;
        let (mut beside_empty, mut masses) = (Vec::new(), Vec::new());
        let together = self.grid.fields_together();
        let fields = together.as_ref().unwrap_or(&self.grid.fields[0].nodes);
        let surroundings = &mut self.adaptation.cache.surroundings;
        if adaptivity.needs().exposure {
            surroundings.update(&self.forest, &self.grid.plan);
            // The nodes of a leaf do not show it where the empty one is coarser.
            beside_empty = surroundings.beside_empty(&self.forest, &self.comm, &self.chunks);
            masses = MassRange::of_blocks(&self.grid.plan, fields);
        }
        let state = RankState {
            leaves: self.forest.leaves(),
            chunks: &self.chunks,
            maxima: &self.leaf_data.maxima,
            plan: &self.grid.plan,
            fields,
            colliders: &self.physics.colliders,
            collider_states: &self.contacts.states,
            surroundings: &self.adaptation.cache.surroundings,
            masses: &masses,
            beside_empty: &beside_empty,
            scheme: self.physics.scheme(),
            head: self.physics.followed_columns().head,
            root_edge: self.physics.root_edge,
            time: self.clock.time,
        };
        let mut values = vec![Value::default(); self.chunks.len() * criteria.len()];
        let leaves = values.par_chunks_mut(criteria.len().max(1)).enumerate().with_min_len(16);
        leaves.filter(|(leaf, _)| !state.chunks[*leaf].is_empty()).for_each(|(leaf, values)| {
            for (value, criterion) in values.iter_mut().zip(criteria) {
                *value = criterion.value(&state.leaf(leaf));
            }
        });
        values
    }
}
