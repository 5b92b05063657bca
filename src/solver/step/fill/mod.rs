//! Fluids keep their volume: how full nodes are, and means over cells; [`crate::kernel::fill`] has what particles do with both.
//!
//! Everything follows from the state at hand: nothing is carried from step to step but the work of the shift, for the history.
//! Sums over nodes are those of masses, means those of one leaf; so ranks need no further message in jobs with one density.
//!
//! | file | what it holds |
//! |---|---|
//! | `nodes` | how full nodes are |
//! | `solid` | what colliders take of the room at nodes |
//! | `means` | mean volume ratios of the cells of a leaf |
pub(super) mod means;
mod nodes;
mod solid;

use crate::kernel::fill::Flow;
use crate::material::Material;
use crate::solver::physics::Physics;
use crate::solver::state::Solver;

impl<const D: usize> Physics<D> {
    /// How materials flow in a step of this length (s) at a time (s), by index; nothing where there are no fluids.
    pub(super) fn flows(&self, time: f64, dt: f64) -> Vec<Flow> {
        if !self.keeps_volumes() {
            return Vec::new();
        }
        let gravity = self.gravity.at(time).iter().map(|g| g * g).sum::<f64>().sqrt();
        let flow = |material: &dyn Material| match material.is_fluid() {
            true => Flow {
                way: material.wave_speed() * dt,
                widest: if material.bears_tension() { f64::INFINITY } else { 1.0 },
                weight: gravity / (material.wave_speed() * material.wave_speed()),
            },
            false => Flow::NONE,
        };
        self.materials.iter().map(|material| flow(&**material)).collect()
    }
}

impl<const D: usize> Solver<D> {
    /// Not collective. Books the work of the shifts of a step in the middle of which gravity acts at `time` (s): `-Σ m g · δx`. One sum
    /// of masses times ways for each own leaf, kg m.
    pub(super) fn book_shifts(&mut self, shifts: &[[f64; D]], time: f64) {
        let gravity = self.physics.gravity.at(time);
        let Some([sum]) = self.shift_sums.of.first_mut() else { return };
        for shift in shifts.iter().filter(|shift| **shift != [0.0; D]) {
            shift.iter().zip(gravity).for_each(|(way, gravity)| sum.add(-way * gravity));
        }
    }

    /// Collective. Work of the shifts since the start, J, where there are fluids.
    pub fn shift_work(&self) -> Option<f64> {
        self.shift_sums.totals(&self.comm).first().map(|[work]| *work)
    }
}
