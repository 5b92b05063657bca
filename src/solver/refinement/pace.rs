//! How often the tree may change: rarely while nothing goes far.
use crate::adaptivity::Kind;
use crate::solver::state::Solver;

/// Most occasions from one change of the tree to the next: what has come to rest shall become coarse soon.
const RAREST: u64 = 4;

/// Greatest power of two, at most [`RAREST`], that does not take `way` per occasion beyond `limit`.
fn occasions(way: f64, limit: f64) -> u64 {
    let mut occasions = 1;
    while occasions < RAREST && 2.0 * occasions as f64 * way <= limit {
        occasions *= 2;
    }
    occasions
}

impl<const D: usize> Solver<D> {
    /// Collective. At an occasion for a regrid: the number of steps from one change of the tree to the next, if one is due
    /// now. It follows from the state alone, and so do the steps at which it can be due, the multiples of `every` times a power
    /// of two. A run that goes on from a file changes the tree at the same steps; where something becomes faster they
    /// become more frequent.
    pub(super) fn steps_between_trees(&self) -> Option<u64> {
        let adaptivity = self.physics.adaptivity.as_ref()?;
        let (every, travel) = (adaptivity.every, adaptivity.travel);
        if travel == 0.0 {
            return Some(every);
        }
        let speed = self.comm.max_f64(self.greatest_speed());
        let edges = adaptivity.finest_edges_per_metre(self.physics.root_edge);
        let steps = every * occasions(speed * every as f64 * self.clock.dt * edges, travel);
        self.clock.step.is_multiple_of(steps).then_some(steps)
    }

    /// Not collective. Speed along an axis of the fastest own particle, and of regions and colliders that criteria follow, m/s.
    fn greatest_speed(&self) -> f64 {
        let particles = self.surveys.iter().flat_map(|survey| survey.velocity.iter().flatten());
        let criteria = self.physics.adaptivity.iter().flat_map(|adaptivity| &adaptivity.criteria);
        let followed = criteria.map(|criterion| match &criterion.kind {
            Kind::Region { motion, .. } => motion.greatest_speeds(self.clock.time).0,
            Kind::Collider(index) => {
                let state = &self.contacts.states[*index];
                self.physics.colliders[*index].greatest_speed(
                    state,
                    &self.grid.plan.extent(),
                    self.clock.time,
                )
            }
            _ => 0.0,
        });
        particles.map(|velocity| velocity.abs()).chain(followed).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_as_the_way_allows() {
        assert_eq!(occasions(0.0, 0.5), RAREST);
        assert_eq!(occasions(0.51, 0.5), 1);
        assert_eq!(occasions(0.25, 0.5), 2);
        assert_eq!(occasions(0.2, 0.5), 2);
        assert_eq!(occasions(0.125, 0.5), 4);
        assert_eq!(occasions(1e-9, 0.5), RAREST);
    }
}
