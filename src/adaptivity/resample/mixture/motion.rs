//! Mass, place and motion of the particle that stands for a group.
use super::super::Setting;
use super::super::affine::{read_matrix, write_matrix};
use super::group::Group;
use super::means::{mean, shares};
use crate::kernel::Transfer;
use crate::particle::chunk::{Chunk, Layout};

/// Relative motion of the members of a group.
pub(super) struct Motion<const D: usize> {
    /// Kinetic energy of the differences of velocity, J.
    pub energy: f64,
    /// Greatest difference of a velocity from the affine field, m/s.
    pub difference: f64,
    /// Half widths of a box about the new centre that holds all boxes, m.
    pub reach: [f64; D],
}

/// Mass, position, velocity and affine matrix. `boxes` are the half widths of the members and the ways to
/// their centres of mass along the first axis, m.
///
/// A ring from several has the sum of the areas of their sections, `Σ m_c / r_c` for equal densities, and the
/// sum of their volumes. Both are its own at the radius `M / Σ (m_c / r_c)`.
pub(super) fn mix_motion<const D: usize>(
    out: &mut Chunk<D>,
    number: usize,
    chunk: &Chunk<D>,
    setting: &Setting<D>,
    group: &Group,
    (half, ahead): (&[[f64; D]], &[f64]),
) -> Motion<D> {
    let member = |i: usize| group.members[i] as usize;
    let masses: Vec<f64> =
        group.members.iter().map(|&p| chunk.column(Layout::<D>::MASS)[p as usize]).collect();
    let (shares, mass) = shares(masses);
    let centre_of = |i: usize| {
        let mut x = chunk.position(member(i));
        x[0] += ahead[i];
        x
    };
    let centre = mean(&shares, centre_of);
    let mut x = centre;
    if setting.has_rings() {
        let radius = |i: usize| chunk.position(member(i))[0].max(f64::MIN_POSITIVE);
        let [more] = mean(&shares, |i| [(radius(0) - radius(i)) / radius(i)]);
        x[0] = radius(0) / (1.0 + more);
    }
    let v: [f64; D] = mean(&shares, |i| chunk.read(Layout::<D>::VELOCITY, member(i)));

    // Sums of u ⊗ r, of r ⊗ r with the second moments s of boxes, and of the members' own affine matrices.
    let (mut turning, mut metric, mut own, mut boxed) =
        ([[0.0; D]; D], [[0.0; D]; D], [[0.0; D]; D], [[0.0; D]; D]);
    let mut reach = [0.0_f64; D];
    let mut energy = 0.0;
    let mut relative = Vec::with_capacity(shares.len());
    for (i, &share) in shares.iter().enumerate() {
        let (from, p) = (centre_of(i), member(i));
        let position = chunk.position(p);
        let velocity: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
        let affine = read_matrix(chunk, p);
        let r: [f64; D] = std::array::from_fn(|a| from[a] - centre[a]);
        let u: [f64; D] = std::array::from_fn(|a| velocity[a] - v[a]);
        let to_centre = setting.scheme.coordinates.to_mass_centre(half[i][0], position[0]);
        for a in 0..D {
            for b in 0..D {
                // Of a box, about the centre of mass.
                let to_centre = if b == 0 { to_centre } else { 0.0 };
                let second = f64::mul_add(-to_centre, to_centre, half[i][b] * half[i][b] * (1.0 / 3.0));
                turning[a][b] = f64::mul_add(share * u[a], r[b], turning[a][b]);
                metric[a][b] = f64::mul_add(share * r[a], r[b], metric[a][b]);
                own[a][b] = share.mul_add(affine[a][b], own[a][b]);
                boxed[a][b] = f64::mul_add(share * affine[a][b], second, boxed[a][b]);
                if a == b {
                    metric[a][b] = share.mul_add(second, metric[a][b]);
                }
            }
            reach[a] = reach[a].max((position[a] - x[a]).abs() + half[i][a]);
            energy = f64::mul_add(share * u[a], u[a], energy);
        }
        relative.push((r, u));
    }
    let field = divide(turning, metric);
    let difference = relative.iter().map(|(r, u)| {
        let square = (0..D).fold(0.0, |square, a| {
            let rest = (0..D).fold(u[a], |rest, b| f64::mul_add(-field[a][b], r[b], rest));
            f64::mul_add(rest, rest, square)
        });
        square.sqrt()
    });
    let affine = match setting.scheme.transfer {
        Transfer::Apic => add(own, turning),
        _ => divide(add(boxed, turning), metric),
    };
    out.write(Layout::<D>::POSITION, number, &x);
    out.write(Layout::<D>::VELOCITY, number, &v);
    out.write(Layout::<D>::MASS, number, &[mass]);
    write_matrix(out, number, &affine);
    Motion { energy: 0.5 * mass * energy, difference: difference.fold(0.0, f64::max), reach }
}

fn add<const D: usize>(a: [[f64; D]; D], b: [[f64; D]; D]) -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|k| a[i][k] + b[i][k]))
}

/// X with `X A = N` for a symmetric positive definite A, by elimination.
fn divide<const D: usize>(n: [[f64; D]; D], mut a: [[f64; D]; D]) -> [[f64; D]; D] {
    let mut n = n;
    // Columns of N follow those of A, as A is symmetric.
    for pivot in 0..D {
        for row in pivot + 1..D {
            let factor = a[row][pivot] / a[pivot][pivot];
            (pivot..D).for_each(|k| a[row][k] = f64::mul_add(-factor, a[pivot][k], a[row][k]));
            (0..D).for_each(|i| n[i][row] = f64::mul_add(-factor, n[i][pivot], n[i][row]));
        }
    }
    for pivot in (0..D).rev() {
        for i in 0..D {
            let rest = (pivot + 1..D).fold(n[i][pivot], |rest, k| f64::mul_add(-a[pivot][k], n[i][k], rest));
            n[i][pivot] = rest / a[pivot][pivot];
        }
    }
    n
}
