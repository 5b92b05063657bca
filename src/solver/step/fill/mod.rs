//! Fluids keep their volume: how full nodes are, and means over cells; [`crate::kernel::g2p::fill`] has the
//! effect of both on particles.
//!
//! Everything follows from the present state: only the work of the shifts is kept from step to step, for the
//! history. Sums over nodes are those of masses, means those of one leaf; so jobs with one density need no
//! further messages between ranks.
//!
//! | file | what it holds |
//! |---|---|
//! | `nodes` | how full nodes are |
//! | `solid` | space at nodes that colliders occupy |
//! | `means` | mean volume ratios of the cells of a leaf |
pub(super) mod means;
mod nodes;
mod solid;

use crate::kernel::g2p::fill::Flow;
use crate::material::{Material, SHOCK_SUMS};
use crate::solver::physics::Physics;
use crate::solver::state::Solver;

impl<const D: usize> Physics<D> {
    /// Flow of each material in a step of this length (s) at a time (s), by index; empty without fluids.
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
    /// Not collective. Adds the work of the shifts of a step, `-Σ m g · δx`, with gravity at the middle
    /// `time` (s) of the step. `shifts` has the sum of mass times shift of each own leaf, kg m.
    pub(super) fn book_shifts(&mut self, shifts: &[[f64; D]], time: f64) {
        let gravity = self.physics.gravity.at(time);
        let Some([sum]) = self.sums.shifts.of.first_mut() else { return };
        for shift in shifts.iter().filter(|shift| **shift != [0.0; D]) {
            shift.iter().zip(gravity).for_each(|(way, gravity)| sum.add(-way * gravity));
        }
    }

    /// Not collective. Adds work and heat of artificial viscosity in a step.
    pub(super) fn book_shocks(&mut self) {
        let Some(sums) = self.sums.shocks.of.first_mut() else { return };
        for shock in self.leaf_data.shocks.iter().filter(|shock| **shock != [0.0; SHOCK_SUMS]) {
            sums.iter_mut().zip(shock).for_each(|(sum, work)| sum.add(*work));
        }
    }

    /// Collective. Work of artificial viscosity since the start and the part of it that is heat of the
    /// material, J, where there is any.
    pub fn shock_work(&self) -> Option<[f64; SHOCK_SUMS]> {
        self.sums.shocks.totals(&self.comm).first().copied()
    }

    /// Collective. Work of the shifts since the start, J, where there are fluids.
    pub fn shift_work(&self) -> Option<f64> {
        self.sums.shifts.totals(&self.comm).first().map(|[work]| *work)
    }
}
