//! The advance of particles with what they have gathered: velocity and place, strain, and the stress by their
//! material.
use super::booked::{self, Booked};
use super::fill::Filling;
use super::gathered::Sums;
use super::leavers::Leavers;
use super::steep::Rate;
use crate::kernel::batch::Batch;
use crate::kernel::domain::{self, AtWall};
use crate::kernel::{Coordinates, Scheme, Transfer, symmetric_index};
use crate::material::eigen::{Symmetric, determinant};
use crate::material::{self, Shock, State, Step};
use crate::particle::chunk::Layout;
use crate::simd::{LANES, Lanes, Vector, VectorMask};

/// Input of the advance of particles, beside the gathered values.
#[derive(Clone, Copy)]
pub struct Advance<'a> {
    /// Properties of the run, the same for all particles.
    pub scheme: &'a Scheme<'a>,
    /// Length of the step, s.
    pub dt: f64,
    /// The least edge of the cells that their boxes overlap, m.
    pub cell: f64,
    /// As [`super::Gather::dilation`].
    pub dilation: &'a [f64],
    /// As [`super::Gather::filling`].
    pub filling: Option<&'a Filling<'a>>,
}

impl Advance<'_> {
    /// New state of a batch; returns wave speed plus particle speed.
    #[inline(always)]
    pub(super) fn batch<V: Vector, const D: usize>(
        &self,
        tile: &mut [[f64; LANES]],
        tags: &[u64],
        batch: &Batch,
        position: &[V; D],
        sums: &Sums<D>,
        wall: Option<AtWall<V, D>>,
        (leavers, booked): (&mut Leavers<D>, &mut Booked<D>),
    ) -> V {
        let &Self { scheme, dt, cell, dilation, filling } = self;
        let (zero, step) = (V::splat(0.0), V::splat(dt));
        let velocity = V::columns(&sums.velocity);
        let is_ring = scheme.coordinates == Coordinates::Axisymmetric;
        let plain = if is_ring { V::columns(&sums.plain) } else { velocity };
        let square = self.velocity(tile, batch, sums, &velocity);
        let mut moved = *position;
        (0..D).for_each(|i| moved[i] = plain[i].mul_add(step, position[i]));
        // Jobs with one material need not read tags.
        let index = if scheme.materials.len() == 1 { [0; LANES] } else { batch.materials(tags) };
        let mut elastic = [zero; 6];
        for c in 0..Layout::<D>::SYMMETRIC {
            elastic[c] = batch.load(tile, Layout::<D>::LEFT_CAUCHY_GREEN + c);
        }
        let filled = match filling {
            Some(filling) => filling.of_batch::<V, D>(batch, index, sums, &elastic, cell),
            None => None,
        };
        if let Some(filled) = &filled {
            filled.shift(batch, tile, &mut moved, wall.map(|wall| wall.extent), booked);
        }
        for i in 0..D {
            batch.store(tile, Layout::<D>::POSITION + i, moved[i]);
        }
        leavers.look(batch, &moved);
        let flows = || domain::plastic_lanes(|| index, scheme);
        let mut rate = Rate {
            gradient: gradient(sums),
            added: if dilation.is_empty() { zero } else { batch.values(dilation) },
            hoop: if is_ring { plain[2] } else { zero },
        };
        let kept = if scheme.is_all_plastic { None } else { rate.limit(step, flows) };
        self.affine(tile, batch, sums, &rate.gradient, kept, wall.map(|wall| (wall, moved)));
        if !dilation.is_empty() {
            rate.add(is_ring);
        }
        let mut trial = strained(&elastic, &rate.gradient, step);
        if is_ring {
            let stretch = rate.hoop.mul_add(step, V::splat(1.0));
            trial[2] = stretch * stretch * elastic[2];
        }
        if let Some(filled) = &filled {
            filled.settle(&mut trial);
        }
        let (wave_speed, is_sound) =
            self.stress(tile, tags, batch, (index, flows() != 0), &trial, &rate, booked);
        let speed = wave_speed + square.sqrt();
        let is_sound = is_sound & speed.le(V::splat(f64::MAX));
        batch.of_members(is_sound.select(speed, V::splat(f64::INFINITY)))
    }

    /// Stores the velocity that the transfer gives; returns the square of its length.
    #[inline(always)]
    fn velocity<V: Vector, const D: usize>(
        &self,
        tile: &mut [[f64; LANES]],
        batch: &Batch,
        sums: &Sums<D>,
        velocity: &[V; 4],
    ) -> V {
        let transfer = self.scheme.transfer;
        let mut square = V::splat(0.0);
        let increment = if transfer.has_increments() { V::columns(&sums.increment) } else { [square; 4] };
        for i in 0..D {
            let new = match transfer {
                Transfer::Apic | Transfer::Tpic => velocity[i],
                Transfer::Flip { blend } => {
                    let flip = batch.load::<V>(tile, Layout::<D>::VELOCITY + i) + increment[i];
                    (flip - velocity[i]).mul_add(V::splat(blend), velocity[i])
                }
                Transfer::Xpic { .. } => increment[i],
            };
            batch.store(tile, Layout::<D>::VELOCITY + i, new);
            square = new.mul_add(new, square);
        }
        square
    }

    /// Stores the affine matrix B of APIC, of which `kept` remains where rates are steep, and less as the
    /// particle comes to a wall; the velocity gradient of the other transfers.
    #[inline(always)]
    fn affine<V: Vector, const D: usize>(
        &self,
        tile: &mut [[f64; LANES]],
        batch: &Batch,
        sums: &Sums<D>,
        gradient: &[[V; D]; D],
        kept: Option<V>,
        at_wall: Option<(AtWall<V, D>, [V; D])>,
    ) {
        let transfer = self.scheme.transfer;
        let kept_at_wall = match (transfer, at_wall) {
            (Transfer::Apic, Some((wall, moved))) => wall.kept_affine_velocity(&moved),
            _ => None,
        };
        for k in 0..D {
            let mut affine = V::columns(&sums.affine[k]);
            if let Some(kept) = kept {
                affine = affine.map(|affine| affine * kept);
            }
            for i in 0..D {
                let value = match (transfer, kept_at_wall) {
                    (Transfer::Apic, Some(kept)) => affine[i] * kept[k],
                    (Transfer::Apic, None) => affine[i],
                    _ => gradient[i][k],
                };
                batch.store(tile, Layout::<D>::AFFINE + D * i + k, value);
            }
        }
    }

    /// Stores strain, history and stress that materials of these numbers give to a trial strain. Returns the
    /// wave speed, and whether all is finite and det b above zero.
    #[inline(always)]
    fn stress<V: Vector, const D: usize>(
        &self,
        tile: &mut [[f64; LANES]],
        tags: &[u64],
        batch: &Batch,
        (index, is_plastic): ([u16; LANES], bool),
        trial: &Symmetric<V>,
        rate: &Rate<V, D>,
        booked: &mut Booked<D>,
    ) -> (V, V::Mask) {
        let &Self { scheme, dt, cell, .. } = self;
        let mut state = State::new([Lanes::splat(0.0); 6]);
        for c in 0..6 {
            trial[c].store(state.elastic[c].as_array_mut());
        }
        if is_plastic {
            for h in 0..material::HISTORIES {
                if h < scheme.histories {
                    let history: V = batch.load(tile, Layout::<D>::HISTORY + h);
                    history.store(state.history[h].as_array_mut());
                }
            }
        }
        let size = if scheme.softens { scheme.sizes(tags, batch) } else { [0.0; LANES] };
        let shock = scheme.viscosity.map(|viscosity| Shock { viscosity, rate: rate.trace().to_array() });
        let update = Step { dt, plane: D == 2, cell, size, shock };
        match scheme.materials {
            [only] => only.update(&mut state, &update),
            several => material::update(several, &index, &mut state, &update),
        }
        let result = |lanes: &Lanes| V::load(lanes.as_array());
        let mut elastic = *trial;
        // The sum is not finite if any of them is not.
        let mut sum = V::splat(0.0);
        for c in 0..Layout::<D>::SYMMETRIC {
            elastic[c] = result(&state.elastic[c]);
            batch.store(tile, Layout::<D>::LEFT_CAUCHY_GREEN + c, elastic[c]);
            let stress = result(&state.stress[c]);
            batch.store(tile, Layout::<D>::STRESS + c, stress);
            sum += stress;
        }
        if is_plastic {
            for h in 0..material::HISTORIES {
                if h < scheme.histories {
                    let history = result(&state.history[h]);
                    batch.store(tile, Layout::<D>::HISTORY + h, history);
                    sum += history;
                }
            }
            let work = batch.load::<V>(tile, Layout::<D>::WORK) + result(&state.work);
            batch.store(tile, Layout::<D>::WORK, work);
            sum += work;
        }
        if scheme.viscosity.is_some() {
            let width = batch.load::<V>(tile, Layout::<D>::HALF) * 2.0;
            let volume = (1..D).fold(width, |volume, _| volume * width);
            for (sum, work) in booked.shocks.iter_mut().zip(&state.shock) {
                booked::add(sum, batch.of_members(result(work) * volume));
            }
        }
        let (ratio, most) = (determinant(&elastic), V::splat(f64::MAX));
        let is_sound = V::splat(0.0).lt(ratio) & ratio.le(most) & sum.abs().le(most);
        (result(&state.wave_speed), is_sound)
    }
}

/// Velocity gradient of a batch, 1/s.
#[inline(always)]
fn gradient<V: Vector, const D: usize>(sums: &Sums<D>) -> [[V; D]; D] {
    let mut gradient = [[V::splat(0.0); D]; D];
    for k in 0..D {
        let column = V::columns(&sums.gradient[k]);
        for i in 0..D {
            gradient[i][k] = column[i];
        }
    }
    gradient
}

/// `(1 + Δt ∇v) b (1 + Δt ∇v)ᵀ`; in plane strain zz stays.
#[inline(always)]
fn strained<V: Vector, const D: usize>(b: &[V; 6], gradient: &[[V; D]; D], step: V) -> [V; 6] {
    let mut a = *gradient;
    for i in 0..D {
        for k in 0..D {
            let unit = V::splat(if i == k { 1.0 } else { 0.0 });
            a[i][k] = gradient[i][k].mul_add(step, unit);
        }
    }
    let mut out = *b;
    for i in 0..D {
        let mut ab = [V::splat(0.0); D];
        for j in 0..D {
            ab[j] = a[i][0] * b[symmetric_index::<D>(0, j)];
            for k in 1..D {
                ab[j] = a[i][k].mul_add(b[symmetric_index::<D>(k, j)], ab[j]);
            }
        }
        for j in i..D {
            let mut sum = ab[0] * a[j][0];
            for k in 1..D {
                sum = ab[k].mul_add(a[j][k], sum);
            }
            out[symmetric_index::<D>(i, j)] = sum;
        }
    }
    out
}
