//! The tangent of a point, and the same from differences.
use super::{Matrix, Point, components, full, tensor};
use crate::material::{State, Step, Tangent};
use crate::simd::{LANES, Lanes, Vector};

/// Displacement gradient of the nearest of the states that differences are taken from.
const STEP: f64 = 1e-6;

impl Point<'_> {
    /// Derivative of the Kirchhoff stress at the end of the last update, Pa: components of the change beside
    /// that by rotation (rows) by those of the symmetric gradient of further displacement, of which the last
    /// three count twice (columns). See [`Tangent::matrix`].
    pub fn tangent(&self) -> [[f64; 6]; 6] {
        self.whole_tangent().matrix().map(|row| row.map(first))
    }

    /// Greatest difference between the tangent and what differences of the update say, over all components of
    /// the stress and all of the gradient of displacement, rotations included; as a share of `ρ₀ c²` with the
    /// bound c of the wave speeds. Where the stress has a kink nearer than 2e-6 of strain it says nothing.
    pub fn tangent_error(&self) -> f64 {
        let tangent = self.whole_tangent();
        let modulus = self.material.density() * self.wave_speed * self.wave_speed;
        let mut worst = 0.0_f64;
        for i in 0..3 {
            for j in 0..3 {
                let mut gradient = [[0.0; 3]; 3];
                gradient[i][j] = 1.0;
                let lanes = gradient.map(|row| row.map(Lanes::splat));
                let change = tangent.change(&self.stress.map(Lanes::splat), &lanes).map(first);
                let difference = self.difference(&gradient);
                for c in 0..6 {
                    let error = (change[c] - difference[c]).abs() / modulus;
                    // What is no number counts, and stays.
                    worst = if worst.is_nan() || error <= worst { worst } else { error };
                }
            }
        }
        worst
    }

    fn whole_tangent(&self) -> Tangent {
        let mut state = State::new(self.trial.elastic.map(Lanes::splat));
        state.history = self.trial.history.map(Lanes::splat);
        self.material.tangent(&state, &self.trial.step)
    }

    /// Central difference of the fourth order along a gradient of displacement.
    fn difference(&self, gradient: &Matrix) -> [f64; 6] {
        const PLACES: [f64; 4] = [1.0, -1.0, 2.0, -2.0];
        const WEIGHTS: [f64; 4] = [8.0, -8.0, -1.0, 1.0];
        let trial = full(&self.trial.elastic);
        let mut elastic = [[0.0; LANES]; 6];
        for lane in 0..LANES {
            let mut deformation = tensor(gradient) * (STEP * PLACES[lane % 4]);
            (0..3).for_each(|k| deformation[(k, k)] += 1.0);
            let moved = components(&(deformation * trial * deformation.transpose()));
            (0..6).for_each(|c| elastic[c][lane] = moved[c]);
        }
        let mut state = State::new(elastic.map(Lanes::new));
        state.history = self.trial.history.map(Lanes::splat);
        self.material.update(&mut state, &Step { plane: false, ..self.trial.step });
        state.stress.map(|stress| {
            let stress = stress.to_array();
            (0..4).map(|place| WEIGHTS[place] * stress[place]).sum::<f64>() / (12.0 * STEP)
        })
    }
}

fn first(lanes: Lanes) -> f64 {
    lanes.to_array()[0]
}
