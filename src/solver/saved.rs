//! The state that files hold beside particles, tree and clock.
use super::state::Solver;
use crate::saved::Saved;

impl<const D: usize> Solver<D> {
    /// Collective to a file. Each part declares its own. `bodies` is the number of bodies in the job.
    pub fn save(&mut self, bodies: usize, saved: &mut Saved<'_>) {
        let Self { physics, contacts, sums, equilibrium, adaptation, measured, .. } = self;
        measured.crossings.save(saved);
        for (index, (collider, state)) in physics.colliders.iter().zip(&mut contacts.states).enumerate() {
            collider.save(index, state, saved);
        }
        contacts.sums.save("collider", saved);
        sums.save(saved);
        if physics.seepage.is_some() {
            saved.if_there(|saved| saved.count("unsettled_heads", &mut sums.unsettled_heads));
        }
        if physics.equilibrium.is_some() {
            equilibrium.relaxation.save(saved);
        }
        if let Some(adaptivity) = &physics.adaptivity {
            match adaptivity.is_refining() {
                true => adaptation.ledger.save(saved),
                // Earlier programs left particles as they were.
                false => saved.if_there(|saved| adaptation.ledger.save(saved)),
            }
        } else if !physics.sources.is_empty() {
            adaptation.ledger.save_next_root(saved);
        }
        saved.counts(|body| format!("pieces_{body}"), bodies, &mut adaptation.pieces_before);
    }
}
