//! All of an update: that of the law, and artificial viscosity.
use crate::material::shock::{Shock, Viscosity};
use crate::material::{Law, State, Step};
use crate::simd::{Vector, VectorMask};

/// [`Law::respond`] and artificial viscosity.
#[inline(always)]
pub(in crate::material) fn advance<V: Vector>(law: &impl Law, state: &mut State<V>, step: &Step) {
    law.respond(state, step);
    if let Some(shock) = &step.shock {
        press(shock, law, state, step);
    }
}

/// Adds the artificial pressure to the stress after an update of a law, and its heat to the state.
#[inline(always)]
fn press<V: Vector>(shock: &Shock, law: &impl Law, state: &mut State<V>, step: &Step) {
    let zero = V::splat(0.0);
    let closing = -V::load(&shock.rate);
    let is_closing = zero.lt(closing);
    if !is_closing.any() {
        return;
    }
    let Viscosity { linear, quadratic } = shock.viscosity;
    let jump = closing.max(zero) * step.cell;
    let pressure = jump * (jump * quadratic + state.wave_speed * linear) * law.density();
    let work = pressure * closing.max(zero) * step.dt;
    state.shock = [work, law.take_heat(state, work)];
    for normal in &mut state.stress[..3] {
        *normal = *normal - pressure;
    }
    let wave = state.wave_speed;
    let damping = wave.mul_add(V::splat(linear), jump * (2.0 * quadratic));
    let bound = damping + damping.mul_add(damping, wave * wave).sqrt();
    state.wave_speed = is_closing.select(bound, wave);
}
