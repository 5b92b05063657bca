//! Numbers that follow the motion of their particle: displacements, areas of loads, total strains, and the
//! ways and turns over which forces on particles do work.
use crate::kernel::g2p::rates::Rates;
use crate::load::{Carried, cofactor};
use crate::particle::chunk::Chunk;
use crate::particle::strain;
use crate::simd::{LANES, Lanes, Vector};
use crate::solver::state::bookings::ParticlePush;

/// Sets the displacements of the particles in `pushes`, after they have moved.
pub(in crate::solver::step) fn note_ways<const D: usize>(chunk: &Chunk<D>, pushes: &mut [ParticlePush<D>]) {
    for push in pushes {
        let x = chunk.position(push.particle as usize);
        // The difference is exact, since a step is short.
        push.way = std::array::from_fn(|a| x[a] - push.way[a]);
    }
}

/// Adds the work of the moments of the forces on particles, by a step with these rates.
pub(in crate::solver::step) fn note_turns<const D: usize>(
    pushes: &mut [ParticlePush<D>],
    rates: &Rates<D>,
    dt: f64,
) {
    for push in pushes {
        let gradient = rates.gradient(push.particle as usize);
        let components = (0..D).flat_map(|i| (0..D).map(move |k| (i, k)));
        // Of the moment P2G has the symmetric part.
        let work = components.fold(0.0, |sum, (i, k)| {
            0.5f64.mul_add(push.moment[i][k] * (gradient[i][k] + gradient[k][i]), sum)
        });
        push.turn = dt * work;
    }
}

/// Positions of all particles, m.
pub(in crate::solver::step) fn positions<const D: usize>(chunk: &Chunk<D>) -> Vec<[f64; D]> {
    (0..chunk.len()).map(|p| chunk.position(p)).collect()
}

/// Adds the displacement of a step to the displacements that particles carry from column `first` on.
pub(in crate::solver::step) fn add_ways<const D: usize>(
    chunk: &mut Chunk<D>,
    first: usize,
    start: &[[f64; D]],
) {
    let end = positions(chunk);
    if end == *start {
        return;
    }
    chunk.carry(first + D);
    for axis in 0..D {
        let ways = start.iter().zip(&end).map(|(start, end)| end[axis] - start[axis]);
        chunk.carried_mut(first + axis).iter_mut().zip(ways).for_each(|(sum, way)| *sum += way);
    }
}

/// Updates the total strains that particles carry from column `first` on, by a step with these rates. `added`
/// is what the diagonal of each gradient has more, 1/s; empty for none.
pub(in crate::solver::step) fn follow_strain<const D: usize>(
    chunk: &mut Chunk<D>,
    first: usize,
    (rates, added): (&Rates<D>, &[f64]),
    dt: f64,
) {
    let columns = strain::columns(D);
    chunk.carry(first + columns);
    let count = chunk.len();
    for (tile, mut gradient) in rates.gradients().enumerate() {
        let own = tile * LANES..count.min((tile + 1) * LANES);
        let mut e = [Lanes::splat(0.0); 6];
        for (c, e) in e.iter_mut().enumerate().take(columns) {
            *e = lanes(&chunk.carried(first + c)[own.clone()]);
        }
        if let Some(added) = added.get(own.clone()) {
            (0..D).for_each(|i| gradient[i][i] += lanes(added));
        }
        let e = strain::after_step(&e, &gradient, dt);
        for (c, e) in e.iter().enumerate().take(columns) {
            let to = &mut chunk.carried_mut(first + c)[own.clone()];
            match to.first_chunk_mut::<LANES>() {
                Some(to) => *to = *e.as_array(),
                None => to.copy_from_slice(&e.as_array()[..own.len()]),
            }
        }
    }
}

/// Up to [`LANES`] values as lanes, the others 0.
fn lanes(values: &[f64]) -> Lanes {
    match values.first_chunk::<LANES>() {
        Some(whole) => Lanes::new(*whole),
        None => Lanes::new(std::array::from_fn(|lane| values.get(lane).copied().unwrap_or(0.0))),
    }
}

/// Updates the areas that particles carry, by a step with these rates: `da ← J f⁻ᵀ da`, `f = 1 + Δt ∇v`.
pub(in crate::solver::step) fn follow_areas<const D: usize>(
    chunk: &mut Chunk<D>,
    on_surfaces: &[&Carried<D>],
    rates: &Rates<D>,
    dt: f64,
) {
    for first in on_surfaces.iter().filter_map(|carried| carried.following()) {
        let carrying = chunk.carried(first).len();
        for p in 0..carrying {
            let area: [f64; D] = std::array::from_fn(|a| chunk.carried(first + a)[p]);
            if area == [0.0; D] {
                continue;
            }
            let (gradient, around) = (rates.gradient(p), dt.mul_add(rates.hoop(p), 1.0));
            let f = std::array::from_fn(|i| {
                std::array::from_fn(|j| dt.mul_add(gradient[i][j], if i == j { 1.0 } else { 0.0 }))
            });
            let turn = cofactor::<D>(&f);
            for i in 0..D {
                let turned = (0..D).fold(0.0, |sum, j| turn[i][j].mul_add(area[j], sum));
                chunk.carried_mut(first + i)[p] = around * turned;
            }
        }
    }
}
