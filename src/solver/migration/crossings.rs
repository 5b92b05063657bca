//! Particles that cross the faces of the domain: their fate, and their counts and masses.
use partition::comm::Comm;

use super::fluxes::Fluxes;
use super::gone::Gone;
use crate::boundary::{Contact, Leaving};
use crate::exact_sum::ExactSum;
use crate::quantity::FACES;
use crate::saved::Saved;
use crate::solver::physics::Physics;
use crate::text::{count, quantity};

/// How far beyond a face of the domain rounding may take a particle, as a share of the domain's edge.
const ROUNDING: f64 = 1e-12;

/// Rules for particles that cross the faces of the domain.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct FaceRules<const D: usize> {
    /// At faces that are no outflow.
    pub leaving: Leaving,
    /// Whether the lower and the upper face along each axis are an outflow.
    pub outflow: [[bool; 2]; D],
    /// Lower corner of the domain in the coordinates of the job, m.
    pub origin: [f64; D],
}

/// Fate of a particle outside the domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Crossing {
    /// It is put back to the face.
    PutBack,
    /// It is removed.
    Deleted,
    /// It has left through an outflow face, and is removed.
    Left,
    /// It must not be there.
    Refused,
}

impl<const D: usize> FaceRules<D> {
    /// Those of a run.
    pub(crate) fn new(physics: &Physics<D>) -> Self {
        let outflow = physics.faces.map(|sides| sides.map(|face| face == Contact::Outflow));
        Self { leaving: physics.leaving, outflow, origin: physics.origin }
    }

    /// Fate of a particle at a position relative to the lower corner of the domain, m; `None`: it is in the
    /// domain `[0, extent)`.
    pub(super) fn of(&self, position: &[f64; D], extent: &[f64; D]) -> Option<Crossing> {
        let (mut crosses, mut flows_out, mut is_far) = (false, false, false);
        for axis in 0..D {
            let slack = ROUNDING * extent[axis];
            let beyond = [position[axis] < 0.0, position[axis] >= extent[axis]];
            crosses |= beyond[0] || beyond[1];
            flows_out |= (0..2).any(|side| beyond[side] && self.outflow[axis][side]);
            is_far |= !(-slack..=extent[axis] + slack).contains(&position[axis]);
        }
        match self.leaving {
            _ if !crosses => None,
            _ if flows_out => Some(Crossing::Left),
            _ if !is_far => Some(Crossing::PutBack),
            Leaving::Clamp => Some(Crossing::PutBack),
            Leaving::Delete => Some(Crossing::Deleted),
            Leaving::Error => Some(Crossing::Refused),
        }
    }

    /// A position in the coordinates of the job, m.
    pub(super) fn in_job(&self, position: &[f64]) -> Vec<f64> {
        position.iter().zip(&self.origin).map(|(x, origin)| x + origin).collect()
    }
}

/// The face of the domain `[0, extent)` that a position is farthest beyond, by axis and side, and how far, m.
pub(super) fn farthest_beyond<const D: usize>(
    position: &[f64; D],
    extent: &[f64; D],
) -> ((usize, usize), f64) {
    let sides =
        (0..D).flat_map(|axis| [((axis, 0), -position[axis]), ((axis, 1), position[axis] - extent[axis])]);
    sides.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(((0, 0), 0.0))
}

/// Name of a face of the domain in the job.
pub(super) fn face_name((axis, side): (usize, usize)) -> &'static str {
    FACES[axis][side]
}

/// Particles of one leaf that crossed a face of the domain in one step.
#[derive(Debug, Default)]
pub(in crate::solver) struct Crossed {
    /// Number of those put back.
    pub put_back: u64,
    /// Those deleted.
    pub deleted: Vec<Gone>,
    /// Those that left through outflow faces.
    pub left: Vec<Gone>,
    /// Those deleted in the domain, as they have failed.
    pub failed: Vec<Gone>,
    /// Masses that passed openings, kg, with the number of the flux: negative against its normal.
    pub passed: Vec<(u32, f64)>,
}

impl Crossed {
    /// Whether there are any.
    pub(crate) fn is_any(&self) -> bool {
        let gone = [&self.deleted, &self.left, &self.failed];
        self.put_back > 0 || gone.iter().any(|gone| !gone.is_empty()) || !self.passed.is_empty()
    }
}

/// Particles of this rank that crossed a face of the domain since the start of the run.
#[derive(Clone, Debug, Default)]
pub struct Crossings {
    /// Number of those put back to the face that they crossed.
    pub put_back: u64,
    /// Number of those deleted.
    pub deleted: u64,
    /// Number of those that left through outflow faces.
    pub left: u64,
    /// Masses of those deleted and of those that left, kg.
    pub masses: [ExactSum; 2],
    /// Masses that have passed planes and faces.
    pub fluxes: Fluxes,
}

impl Crossings {
    /// Adds those of one leaf.
    pub(super) fn book(&mut self, crossed: &Crossed) {
        self.put_back += crossed.put_back;
        self.deleted += crossed.deleted.len() as u64;
        self.left += crossed.left.len() as u64;
        self.fluxes.book_passed(&crossed.passed);
        crossed.failed.iter().for_each(|gone| self.fluxes.book(gone));
        for (sum, gone) in self.masses.iter_mut().zip([&crossed.deleted, &crossed.left]) {
            for gone in gone {
                sum.add(gone.mass);
                self.fluxes.book(gone);
            }
        }
    }

    /// Collective to a file. The counts and masses, without fluxes.
    pub(in crate::solver) fn save(&mut self, saved: &mut Saved<'_>) {
        let counts = [&mut self.put_back, &mut self.deleted, &mut self.left];
        saved.counts_of_ranks(["put_back", "deleted", "left"], counts);
        let masses = ["deleted_mass", "left_mass"];
        saved.sums(|i| masses[i].into(), self.masses.iter_mut());
    }

    /// Collective. Those of all ranks, without fluxes.
    pub fn gather(&self, comm: &Comm) -> Self {
        let mut counts = [self.put_back, self.deleted, self.left];
        comm.sum_u64(&mut counts);
        let [put_back, deleted, left] = counts;
        let mut masses = self.masses.clone();
        ExactSum::sum_over_ranks(comm, &mut masses);
        Self { put_back, deleted, left, masses, fluxes: Fluxes::default() }
    }
}

/// One line for the end of a run; empty if no particle crossed a face.
impl std::fmt::Display for Crossings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [deleted, left] = self.masses.each_ref().map(|sum| quantity(sum.to_f64(), "kg"));
        let parts = [
            (self.left, format!("left through outflow faces ({left})")),
            (self.deleted, format!("left through other faces and were deleted ({deleted})")),
            (self.put_back, "were put back to the face that they crossed".to_owned()),
        ];
        let told: Vec<String> = parts
            .iter()
            .filter(|(number, _)| *number > 0)
            .map(|(number, what)| format!("{} {what}", count(*number)))
            .collect();
        match told.is_empty() {
            true => Ok(()),
            false => write!(f, "particles at the faces of the domain: {}", told.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(leaving: Leaving) -> FaceRules<2> {
        FaceRules { leaving, outflow: [[false, true], [false; 2]], origin: [10.0, 20.0] }
    }

    #[test]
    fn rounding_puts_back_and_outflow_comes_first() {
        let extent = [1.0, 2.0];
        for (leaving, beyond) in [
            (Leaving::Error, Crossing::Refused),
            (Leaving::Delete, Crossing::Deleted),
            (Leaving::Clamp, Crossing::PutBack),
        ] {
            let of = |position| rules(leaving).of(&position, &extent);
            assert_eq!(of([0.0, 1.0]), None);
            assert_eq!(of([-1e-15, 1.0]), Some(Crossing::PutBack));
            assert_eq!(of([0.5, 2.0]), Some(Crossing::PutBack));
            assert_eq!(of([-1e-9, 1.0]), Some(beyond));
            assert_eq!(of([1.0, 1.0]), Some(Crossing::Left));
            // Through the edge of two faces.
            assert_eq!(of([1.1, -0.1]), Some(Crossing::Left));
        }
        assert_eq!(rules(Leaving::Error).in_job(&[0.5, 1.0]), [10.5, 21.0]);
    }

    #[test]
    fn the_farthest_face_is_named() {
        assert_eq!(farthest_beyond(&[0.5, 2.25], &[1.0, 2.0]), ((1, 1), 0.25));
        assert_eq!(farthest_beyond(&[-0.5, 2.25], &[1.0, 2.0]), ((0, 0), 0.5));
        assert_eq!(face_name((1, 1)), "y_max");
    }

    #[test]
    fn the_line_says_what_there_is() {
        let gone = Gone { mass: 0.5, place: [0.0; 3], face: Some((0, 0)) };
        let mut crossings = Crossings::default();
        assert_eq!(crossings.to_string(), "");
        crossings.book(&Crossed { put_back: 2, left: vec![gone; 1200], ..Crossed::default() });
        assert_eq!(
            crossings.to_string(),
            "particles at the faces of the domain: 1 200 left through outflow faces (600 kg), 2 were put back to the face that \
             they crossed"
        );
    }
}
