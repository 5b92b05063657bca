//! One particle becomes `2^D`.
use super::child::{hand_share, make_child};
use super::displacement::hand_displacement;
use super::offsets::{opposite, sides};
use super::rings;
use crate::adaptivity::resample::affine::{gradient, read_matrix, write_matrix};
use crate::adaptivity::resample::{Setting, ids};
use crate::kernel::{Select, Transfer};
use crate::particle::chunk::{Chunk, Layout};

/// Results of [`split`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Split {
    /// Particles that were replaced by their children.
    pub split: u64,
    /// Particles that stayed, since their identifiers have no room for another generation.
    pub refused: u64,
}

/// Replaces the particles `which` (ascending) by `2^D` children each, of the next level, in their place:
/// child 0 first, where bit a of a child's number says that it lies on the upper side along axis a. All
/// others keep their order.
///
/// `spreads` has the second moments D of the weights of each listed particle in the grid that last gave it
/// its affine matrix, m² (see [`crate::kernel::spread`]); only APIC uses them. Children lie at the quarter
/// points of the particle's box, so that their boxes tile it. Each gets an equal share of the columns carried
/// for loads (rings: see `rings.rs`). Mass, volume and centre of mass are conserved bit for bit, momentum
/// where the affine part of a child's velocity is not greater than the rest (else to round-off), angular
/// momentum to round-off. `book` receives the kinetic energy that each split adds, J, which is taken from the
/// affine part.
pub fn split<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    which: &[u32],
    spreads: &[[f64; D]],
    book: &mut impl FnMut(f64),
) -> Split {
    assert_eq!(which.len(), spreads.len(), "one spread per particle");
    let territories = setting.territories(chunk, Select::List(which));
    let mut report = Split::default();
    let mut source = Vec::with_capacity(chunk.len() + which.len() * ((1 << D) - 1));
    let mut families = Vec::with_capacity(which.len());
    let mut listed = which.iter().enumerate().peekable();
    for (p, &id) in (0..).zip(chunk.ids()) {
        match listed.next_if(|&(_, &listed)| listed == p) {
            Some(_) if !ids::has_room(id) => report.refused += 1,
            Some((place, _)) => {
                families.push((source.len(), place));
                source.extend(std::iter::repeat_n(p, (1 << D) - 1));
            }
            None => {}
        }
        source.push(p);
    }
    if families.is_empty() {
        return report;
    }
    report.split = families.len() as u64;
    *chunk = chunk.gathered(&source);
    let divide = if setting.has_rings() { rings::divide::<D> } else { divide::<D> };
    for (first, place) in families {
        let x = chunk.position(first);
        book(divide(chunk, setting, first, &territories[place], &spreads[place]));
        hand_displacement(chunk, setting, first..first + (1 << D), &x);
    }
    report
}

/// Turns `2^D` copies of a particle from index `first` into its children. Returns the kinetic energy added,
/// J.
fn divide<const D: usize>(
    chunk: &mut Chunk<D>,
    setting: &Setting<D>,
    first: usize,
    half: &[f64; D],
    spread: &[f64; D],
) -> f64 {
    let number = 1 << D;
    let x = chunk.position(first);
    let v: [f64; D] = chunk.read(Layout::<D>::VELOCITY, first);
    let [mass] = chunk.read(Layout::<D>::MASS, first);
    let [width] = chunk.read(Layout::<D>::HALF, first);
    let share = 1.0 / number as f64;

    let places: [(f64, f64); D] =
        std::array::from_fn(|axis| sides(x[axis], 0.5 * half[axis], setting.extent[axis]));
    let offset: [f64; D] = std::array::from_fn(|axis| places[axis].1 - x[axis]);
    let mut kept = read_matrix(chunk, first);
    let gradient = gradient(setting.scheme.transfer, &kept, spread);
    if setting.scheme.transfer == Transfer::Apic {
        for i in 0..D {
            for k in 0..D {
                kept[i][k] = f64::mul_add(-gradient[i][k], offset[k] * offset[k], kept[i][k]);
            }
        }
    }

    let mut energy = 0.0;
    // Children on opposite sides have opposite offsets, hence opposite affine velocities.
    for lower in 0..number / 2 {
        let is_upper = |axis: usize| lower >> axis & 1 == 1;
        let mut velocities = [[0.0; D]; 2];
        for i in 0..D {
            let affine = (0..D).fold(0.0, |sum, k| {
                let step = if is_upper(k) { offset[k] } else { -offset[k] };
                f64::mul_add(gradient[i][k], step, sum)
            });
            let (less, more) = opposite(v[i], affine);
            (velocities[0][i], velocities[1][i]) = (more, less);
            energy += (more - v[i]) * (more - v[i]) + (less - v[i]) * (less - v[i]);
        }
        for (child, velocity) in [(lower, velocities[0]), (number - 1 - lower, velocities[1])] {
            let p = first + child;
            let position: [f64; D] =
                std::array::from_fn(|a| if child >> a & 1 == 1 { places[a].1 } else { places[a].0 });
            chunk.write(Layout::<D>::POSITION, p, &position);
            chunk.write(Layout::<D>::VELOCITY, p, &velocity);
            chunk.write(Layout::<D>::MASS, p, &[mass * share]);
            chunk.write(Layout::<D>::HALF, p, &[0.5 * width]);
            // The number of children is a power of two: together they carry exactly the values of the
            // particle, about the same point.
            hand_share(chunk, setting, p, share);
            write_matrix(chunk, p, &kept);
            make_child(chunk, p, child);
        }
    }
    0.5 * mass * share * energy
}
