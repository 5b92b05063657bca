//! The next stage of a run: other physics, and particles that go, change or come.
use crate::material::undrained;
use crate::material::{HISTORIES, Material, PLASTIC_VOLUME};
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, Tag};
use crate::particle::halvings;
use crate::solver::physics::Physics;
use crate::solver::state::Solver;
use crate::solver::state::relaxation::{RelaxPhase, Relaxation};
use crate::solver::step::relax::stop;

/// Changes of the particles at the start of a stage. Lists go over the bodies of the job.
pub struct Change<const D: usize> {
    /// Whether the particles of a body go.
    pub is_removed: Vec<bool>,
    /// Material of the particles of each body before and from now on; what has become rubble stays it.
    pub materials: Vec<[u16; 2]>,
    /// Whether all particles are at rest.
    pub at_rest: bool,
    /// Whether displacements and total strains are counted from here.
    pub reset_displacement: bool,
    /// Particles that come, by own leaf.
    pub added: Vec<Chunk<D>>,
}

impl<const D: usize> Solver<D> {
    /// Collective. The lowest root that no particle has; see [`crate::adaptivity::resample::ids`].
    pub fn next_root(&self) -> u64 {
        // Roots that merges have used and given up count as well, and those of particles that have left.
        match self.physics.adaptivity.is_some() || !self.physics.sources.is_empty() {
            true => self.adaptation.ledger.next_root,
            false => self.first_free_root(),
        }
    }

    /// Collective. Goes on with the physics of another stage after a change of the particles, and with the
    /// time step that these allow. Returns how many particles of each own leaf were there before.
    pub fn enter_stage(&mut self, physics: Physics<D>, change: Change<D>) -> Vec<usize> {
        let mut added = [change.added.iter().map(|chunk| chunk.len() as u64).sum()];
        self.comm.sum_u64(&mut added);
        self.adaptation.ledger.next_root = self.next_root() + added[0];
        // Velocities that are set belong to the present time; those of bodies that come with others that move
        // count as theirs.
        let are_set = change.at_rest || self.equilibrium.relaxation.phase == RelaxPhase::Stopped;
        // A step without material sets no bound for the growth of the next one.
        if are_set || self.clock.bound == f64::INFINITY {
            self.skip_forces(self.lag());
            self.clock.dt = 0.0;
        }
        let before = std::mem::replace(&mut self.physics, physics);
        self.physics.has_halves = before.has_halves;
        self.physics.deform_colliders(self.clock.time);
        self.physics.weaken(self.clock.time);
        if let Some(reduction) = &self.physics.reduction {
            self.equilibrium.next_load_step = reduction.step;
        }
        for (index, collider) in self.physics.colliders.iter().enumerate() {
            if collider.is_present() && !before.colliders[index].is_present() {
                self.contacts.states[index] = collider.state_at(self.clock.time);
            }
        }
        self.measured.crossings.fluxes.add_beyond(&self.chunks, 1.0);
        let had: Vec<usize> = self
            .chunks
            .iter_mut()
            .map(|chunk| {
                remove(chunk, &change.is_removed);
                change_materials(chunk, &change.materials, &self.physics);
                if change.at_rest {
                    stop(chunk);
                }
                if change.reset_displacement {
                    self.physics.motion_columns().for_each(|column| chunk.carried_mut(column).fill(0.0));
                }
                chunk.len()
            })
            .collect();
        for (chunk, added) in self.chunks.iter_mut().zip(&change.added) {
            (0..added.len()).for_each(|p| chunk.push_from(added, p));
        }
        self.measured.crossings.fluxes.add_beyond(&self.chunks, -1.0);
        self.leaf_data.reset(self.chunks.len());
        // Colliders may have come or gone.
        self.grid.inside_still.clear();
        let reach = self.agreed_reach();
        self.rebuild_grid(reach);
        self.start_from(&had);
        self.equilibrium.relaxation = Relaxation::default();
        had
    }
}

/// Removes the particles of some bodies.
fn remove<const D: usize>(chunk: &mut Chunk<D>, is_removed: &[bool]) {
    let goes = |tag: &u64| is_removed[usize::from(Tag::unpack(*tag).body)];
    if chunk.tags().iter().any(goes) {
        let stay: Vec<u32> = (0..).zip(chunk.tags()).filter(|(_, tag)| !goes(tag)).map(|(p, _)| p).collect();
        chunk.keep(&stay);
    }
}

/// Gives the particles of each body its material; where that has other history variables, they begin anew.
fn change_materials<const D: usize>(chunk: &mut Chunk<D>, materials: &[[u16; 2]], physics: &Physics<D>) {
    for p in 0..chunk.len() {
        let was = Tag::unpack(chunk.tags()[p]);
        let [before, material] = materials[usize::from(was.body)];
        if material == was.material || before != was.material {
            continue;
        }
        chunk.tags_mut()[p] = halvings::with(chunk.tags()[p], Tag { material, ..was });
        let [old, new] = [was.material, material].map(|m| &physics.materials[usize::from(m)]);
        if old.water_modulus() + new.water_modulus() > 0.0 {
            change_water(chunk, p, &**old, &**new, physics);
        } else if old.history_names() != new.history_names() {
            physics.begin_history(chunk, p);
        }
    }
}

/// A change of material in which the old one or the new one has water that cannot leave its pores. The
/// history of the skeleton stays where both have the same. Excess pressure stays where both have water; else
/// there is none.
fn change_water<const D: usize>(
    chunk: &mut Chunk<D>,
    p: usize,
    old: &dyn Material,
    new: &dyn Material,
    physics: &Physics<D>,
) {
    let kept: [f64; HISTORIES] = chunk.read(Layout::<D>::HISTORY, p);
    physics.begin_history(chunk, p);
    let mut history: [f64; HISTORIES] = chunk.read(Layout::<D>::HISTORY, p);
    // Without that of opened volume, which undrained ground does not book.
    let of_skeleton = |material: &dyn Material| {
        let names = material.skeleton_history();
        &names[..names.len().min(PLASTIC_VOLUME + 1)]
    };
    let is_same = of_skeleton(old) == of_skeleton(new);
    if is_same {
        history[..=PLASTIC_VOLUME].copy_from_slice(&kept[..=PLASTIC_VOLUME]);
    }
    if new.water_modulus() > 0.0 {
        let first = Layout::<D>::LEFT_CAUCHY_GREEN;
        let column = |c: usize| chunk.column(first + c)[p];
        let elastic = std::array::from_fn(|c| if c < Layout::<D>::SYMMETRIC { column(c) } else { 0.0 });
        undrained::consolidate(&elastic, &mut history);
        if is_same && old.water_modulus() > 0.0 {
            history[PLASTIC_VOLUME + 1..].copy_from_slice(&kept[PLASTIC_VOLUME + 1..]);
        }
    }
    chunk.write(Layout::<D>::HISTORY, p, &history);
}
