//! The problem that the solver solves.
use std::ops::Range;

use crate::adaptivity::{Adaptivity, Cohesion};
use crate::boundary::absorbing::AbsorbingFaces;
use crate::boundary::{BodyContacts, Collider, Contact, Leaving, Meets};
use crate::kernel::{BoxPolicy, Coordinates, Scheme, Transfer};
use crate::load::{self, Gravity, Load, Seepage, Water};
use crate::material::{Failed, Material, Viscosity, Weakened};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::followed::{FirstColumns, Followed};
use crate::particle::group::Group;
use crate::particle::strain;
use crate::quantity::{NotFinite, Quantity};
use crate::source::Source;

/// The problem that the solver solves: the same on every rank, constant over a stage of the run.
pub struct Physics<const D: usize> {
    /// Lower corner of the domain in the coordinates of the job, m; all positions are relative to it.
    pub origin: [f64; D],
    /// Edge of a root octant, m.
    pub root_edge: f64,
    /// Whether neighbouring leaves differ by one level at most.
    pub graded: bool,
    /// Materials by index.
    pub materials: Vec<Box<dyn Material>>,
    /// Fate of particles that have failed, by material.
    pub failed: Vec<Failed>,
    /// Times at which the stages so far have begun, s; the last is the one under way.
    pub stage_starts: Vec<f64>,
    /// Acceleration of gravity.
    pub gravity: Gravity<D>,
    /// Loads, in the order in which they act.
    pub loads: Vec<Load<D>>,
    /// Steady seepage, if the pressure of the water in the pores is that of one.
    pub seepage: Option<Seepage<D>>,
    /// By material, the density with full pores over that without water.
    pub saturated: Vec<f64>,
    /// Sources, in the order in which they feed.
    pub sources: Vec<Source<D>>,
    /// Conditions on the lower and upper face of the domain along each axis.
    pub faces: [[Contact; 2]; D],
    /// Bodies whose particles come with the affine state of APIC, from another run.
    pub with_moments: Vec<u16>,
    /// Material beyond the faces that absorb waves.
    pub absorbing: AbsorbingFaces<D>,
    /// Whether the forces on these faces are summed up.
    pub face_forces: bool,
    /// Rigid bodies that act on the material, in the order in which they act.
    pub colliders: Vec<Collider<D>>,
    /// Contact between bodies that deform.
    pub body_contacts: BodyContacts,
    /// Dynamic refinement; `None`: tree and particles keep their sizes.
    pub adaptivity: Option<Adaptivity<D>>,
    /// Treatment of particles that leave the domain where no face is an outflow.
    pub leaving: Leaving,
    /// Transfer of velocities.
    pub transfer: Transfer,
    /// Coordinates of the domain.
    pub coordinates: Coordinates,
    /// By velocity field, the density of its undeformed material, kg/m³, in jobs with fluids; `None` where
    /// materials differ.
    pub fill_densities: Vec<Option<f64>>,
    /// By velocity field, where its material meets faces and colliders that act on nodes.
    pub meets: Vec<Meets>,
    /// Equilibrium at which the stage ends, and to which kinetic damping leads; `None`: neither.
    pub equilibrium: Option<Equilibrium>,
    /// Load steps to equilibrium in place of time steps; `None`: none.
    pub quasi_static: Option<QuasiStatic>,
    /// Strength that falls during the stage; `None`: it stays.
    pub reduction: Option<StrengthReduction>,
    /// How particle boxes follow the deformation.
    pub boxes: BoxPolicy,
    /// How elastic bodies hold together that are stretched; `None`: their particles are not halved.
    pub cohesion: Option<Cohesion>,
    /// Whether any particle has been halved; the same on all ranks.
    pub has_halves: bool,
    /// Whether particles strain with the mean rate of dilation of their cell (F-bar).
    pub f_bar: bool,
    /// Artificial viscosity, if there is any.
    pub viscosity: Option<Viscosity>,
    /// Velocity fields whose surface nodes are tied.
    pub ties: Ties,
    /// Quantities that particles carry of their past.
    pub followed: Followed,
    /// Choice of the time step.
    pub control: StepControl,
}

/// Velocity fields whose surface nodes move with the material beside them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ties {
    /// None.
    None,
    /// Those whose material is elastic.
    Elastic,
    /// All.
    All,
}

/// Criteria of equilibrium, and the mass scaling on the way to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equilibrium {
    /// Greatest root mean square of the velocities at a peak of the kinetic energy, m/s.
    pub speed: f64,
    /// Greatest root mean square of the unbalanced force per mass, m/s².
    pub acceleration: f64,
    /// Mass scaling: level of the cells whose material moves with its own mass. On each finer level it moves
    /// with four times the mass, so that all levels have the same longest step. `None`: all moves with its
    /// own.
    pub own_mass_level: Option<u8>,
}

/// Load steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuasiStatic {
    /// Longest step, s; also the first.
    pub step: f64,
    /// Length below which a step that fails ends the run, s.
    pub least_step: f64,
    /// Greatest unbalanced force, over that of loads or stress.
    pub tolerance: f64,
}

/// Strength that is divided by a factor that grows by 1 in 1 s, up to that without equilibrium.
#[derive(Clone, Debug)]
pub struct StrengthReduction {
    /// The factor at the start of the stage.
    pub from: f64,
    /// Growth of the factor in a load step, until one fails.
    pub step: f64,
    /// Greatest difference between the last factor with equilibrium and the first without.
    pub tolerance: f64,
    /// The materials, by index.
    pub materials: Vec<Weakened>,
}

/// Limits on the time step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepControl {
    /// Courant number: share of a cell that a wave may cross in a step.
    pub cfl: f64,
    /// Longest step, s.
    pub dt_max: Option<f64>,
    /// Most that a step may exceed the one before, as a factor.
    pub growth: f64,
}

impl<const D: usize> Physics<D> {
    /// Whether particles of any material go when they fail.
    pub(crate) fn can_fail(&self) -> bool {
        self.failed.iter().any(|rule| *rule != Failed::Stays)
    }

    /// The factor that divides the strength at a time, s, of the stage under way.
    pub fn strength_factor(&self, time: f64) -> f64 {
        let begun = self.stage_starts.last().copied().unwrap_or(0.0);
        self.reduction.as_ref().map_or(1.0, |reduction| reduction.from + (time - begun))
    }

    /// Gives the materials the strength of a time, s, in a stage that reduces it.
    pub(crate) fn weaken(&mut self, time: f64) {
        let factor = self.strength_factor(time);
        if let Some(reduction) = &self.reduction {
            self.materials = reduction.materials.iter().map(|material| material.over(factor)).collect();
        }
    }

    /// Number of the stage under way, from 0.
    pub fn stage(&self) -> usize {
        self.stage_starts.len().saturating_sub(1)
    }

    /// The first quantity that has had no finite value where it was needed, if there is one.
    pub(crate) fn not_finite(&self) -> Option<NotFinite> {
        let loads = self.loads.iter().flat_map(Load::quantities);
        let heads = self.seepage.iter().flat_map(|seepage| &seepage.heads).map(|head| &head.level);
        let faces = self.absorbing.as_flattened().iter().flatten().map(|face| &face.pressure);
        self.gravity.acceleration.iter().chain(loads).chain(heads).chain(faces).find_map(Quantity::not_finite)
    }

    /// Gives colliders that deform the shape that they have at a time (s): that of a step is the one at its
    /// start.
    pub(crate) fn deform_colliders(&mut self, time: f64) {
        self.colliders.iter_mut().for_each(|collider| collider.deform(time));
    }

    /// Number of carried columns: for loads, of the stretch between neighbours, then of the particles' past.
    pub fn carried_columns(&self) -> usize {
        self.followed_column() + self.followed.count::<D>()
    }

    /// First columns of what is followed.
    pub(crate) fn followed_columns(&self) -> FirstColumns {
        self.followed.first_columns::<D>(self.carried_columns())
    }

    /// First carried column of the particles' past (see [`Followed`]).
    fn followed_column(&self) -> usize {
        let gaps = self.adaptivity.as_ref().and_then(|adaptivity| adaptivity.split_gap);
        self.load_columns() + if gaps.is_some() { strain::columns(D) } else { 0 }
    }

    /// Carried columns of the particles' motion.
    pub(crate) fn motion_columns(&self) -> Range<usize> {
        let end = self.carried_columns();
        end - self.followed.motion_columns::<D>()..end
    }

    /// First columns of tensors that follow the deformation, where particles carry them: stretch between
    /// neighbours, total strain.
    pub(crate) fn tensor_columns(&self) -> Vec<usize> {
        let (loads, followed) = (self.load_columns(), self.followed_column());
        let gaps = (followed > loads).then_some(loads);
        gaps.into_iter().chain(self.followed_columns().strain).collect()
    }

    /// Mass with which the material on cells of a level moves, over its own; `None` without mass scaling. A
    /// power of four.
    pub(crate) fn mass_scale(&self, level: u8) -> Option<f64> {
        let own = self.equilibrium?.own_mass_level?;
        Some(4.0_f64.powi(i32::from(level) - i32::from(own)))
    }

    /// Whether material moves with other masses than its own.
    pub(crate) fn has_scaled_masses(&self) -> bool {
        self.mass_scale(0).is_some()
    }

    /// Whether any material is a fluid.
    pub(crate) fn has_fluids(&self) -> bool {
        self.materials.iter().any(|material| material.is_fluid())
    }

    /// Where the material of a velocity field meets surfaces.
    fn meets(&self, field: usize) -> Meets {
        self.meets.get(field).copied().unwrap_or_default()
    }

    /// Whether the surface nodes of a velocity field are tied.
    pub(in crate::solver) fn has_ties(&self, field: usize) -> bool {
        match self.ties {
            Ties::None => false,
            Ties::Elastic => matches!(self.meets(field), Meets::Surface | Meets::Firm),
            Ties::All => true,
        }
    }

    /// Whether those of any velocity field are.
    pub(in crate::solver) fn has_any_ties(&self) -> bool {
        (0..self.body_contacts.fields()).any(|field| self.has_ties(field))
    }

    /// Whether the material of a velocity field moves freely over the gap between it and a surface.
    pub(in crate::solver) fn moves_over_gaps(&self, field: usize) -> bool {
        self.meets(field) == Meets::Surface || self.moves_until_it_yields(field)
    }

    /// Whether it does as long as it is elastic: where no law at surfaces asks for the area of what has
    /// yielded, since the sums at nodes then leave out its slope.
    pub(in crate::solver) fn moves_until_it_yields(&self, field: usize) -> bool {
        self.meets(field).yields() && !self.has_walls_by_area()
    }

    /// Whether any face or collider has a law by the area of the material at it.
    pub(in crate::solver) fn has_walls_by_area(&self) -> bool {
        let of_colliders = self.colliders.iter().map(|collider| &collider.contact);
        self.faces.as_flattened().iter().chain(of_colliders).any(|law| law.acts_by_area())
    }

    /// Whether a collider acts on a velocity field at the feet of the nodes inside it, in this stage.
    /// Cohesion and drag need the area of the material's surface, which feet know. `sticky` colliders hold
    /// solids at the nodes, since a grip that leaves the rim of a beam some freedom is too soft; fluids held
    /// there slip, up to a cell before nodes that are up to a cell behind the surface.
    pub(in crate::solver) fn acts_at_feet(&self, field: usize, collider: &Collider<D>) -> bool {
        let has_feet = match (self.meets(field), collider.contact) {
            (Meets::Feet, _) => true,
            (_, Contact::Sticky) => false,
            (Meets::Surface, _) => true,
            (Meets::Firm | Meets::Frictional, law) => self.moves_until_it_yields(field) || law.acts_by_area(),
            (Meets::Nodes, law) => law.acts_by_area(),
        };
        collider.acts_on_nodes() && has_feet
    }

    /// Whether fluids are kept in their volume: not with mass scaling, since volumes do not follow from the
    /// masses of nodes then.
    pub(in crate::solver) fn keeps_volumes(&self) -> bool {
        self.has_fluids() && !self.has_scaled_masses()
    }

    /// The water in the pores with its load, where it acts at a time, s.
    pub fn water_at(&self, time: f64) -> Option<(&Load<D>, &Water)> {
        let mut acting = self.loads.iter().filter(|load| load.is_active(time));
        acting.find_map(|load| Some((load, load.water()?)))
    }

    /// Number of carried columns for loads.
    pub fn load_columns(&self) -> usize {
        load::columns(&self.loads)
    }

    /// Gives a particle the history with which its material begins, and the stress of a gas.
    pub(crate) fn begin_history(&self, chunk: &mut Chunk<D>, p: usize) {
        let material = usize::from(Tag::unpack(chunk.tags()[p]).material);
        let pressure = self.materials[material].rest_pressure();
        if pressure > 0.0 {
            chunk.write(Layout::<D>::STRESS, p, &[-pressure; 3]);
        }
        let mut history = self.materials[material].initial_history();
        let place: [f64; D] = std::array::from_fn(|a| chunk.position(p)[a] + self.origin[a]);
        let now = self.stage_starts.last().copied().unwrap_or(0.0);
        self.materials[material].place_history(&place, now, &mut history);
        chunk.write(Layout::<D>::HISTORY, p, &history);
    }

    /// The particles of a velocity field; `None` where all share one.
    pub(in crate::solver) fn group(&self, field: usize) -> Option<Group<'_>> {
        let field_of_body = &self.body_contacts.field_of_body[..];
        (!field_of_body.is_empty()).then_some(Group { field: field as u8, field_of_body })
    }

    /// Properties of the run that the kernels use.
    pub(in crate::solver) fn scheme(&self) -> Scheme<'_> {
        let scheme = Scheme::new(self.boxes, self.root_edge / 4.0, self.transfer, &self.materials);
        let elastic_stretch =
            self.cohesion.as_ref().map_or(scheme.elastic_stretch, |cohesion| cohesion.stretch);
        let (f_bar, shares, has_halves) = (self.f_bar, self.load_columns(), self.has_halves);
        let (coordinates, viscosity) = (self.coordinates, self.viscosity);
        let displacement = self.followed_columns().displacement;
        Scheme { coordinates, f_bar, viscosity, shares, displacement, elastic_stretch, has_halves, ..scheme }
    }
}
