//! The particle that stands for a group.
use rustc_hash::FxHashSet;

use super::affine::{read_matrix, write_matrix};
use super::setting::volume;
use super::{Limits, Setting, ids};
use crate::kernel::{Select, Transfer};
use crate::material::{self, HISTORIES, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step, Symmetric, eigen};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::halvings;
use crate::simd::math::{exp, ln};
use crate::simd::{LANES, Lanes, Vector};

/// Particles that might become one.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// At least two; children of a family in the order of their numbers, others in the order of the chunk.
    pub members: Vec<u32>,
    /// Identifier of the merged particle.
    pub id: u64,
    /// Whether these are all children of one parent.
    pub is_family: bool,
    /// Axis along which the parent was halved, where these are its halves.
    pub rejoined: Option<usize>,
}

impl Group {
    /// Children of a family are given by number, which is not their order in the chunk once they have moved.
    pub(super) fn new(mut members: Vec<u32>, id: u64, is_family: bool) -> Self {
        if let Some(first) = (0..members.len()).min_by_key(|&i| members[i]) {
            // The merged particle takes the place of the first in the chunk.
            members[..=first].rotate_right(1);
        }
        Self { members, id, is_family, rejoined: None }
    }
}

/// Merged particles, one per group.
pub(super) struct Mixtures<const D: usize> {
    /// The groups that pass the quick tests, in their order.
    pub groups: Vec<Group>,
    /// Their particles.
    pub chunk: Chunk<D>,
    /// Kinetic energy that the merge would remove, J; `None` if the group is not within the other limits
    /// either.
    pub energy: Vec<Option<f64>>,
}

/// Merges each group into a particle of a level, and finds which groups are within the limits. Identifiers of
/// the others are added to `refused`.
pub(super) fn mixtures<const D: usize>(
    chunk: &Chunk<D>,
    setting: &Setting<D>,
    limits: &Limits,
    mut groups: Vec<Group>,
    level: u8,
    refused: &mut FxHashSet<u64>,
) -> Mixtures<D> {
    // The quickest test comes first.
    keep(&mut groups, chunk, refused, |_, group| {
        is_alike(chunk, group, limits) && has_like_histories(chunk, group, setting)
    });
    let members: Vec<u32> = groups.iter().flat_map(|group| &group.members).copied().collect();
    let half = setting.territories(chunk, Select::List(&members));
    let ahead = setting.ways_to_mass_centres(chunk, &members);
    let mut out = chunk.gathered(&groups.iter().map(|group| group.members[0]).collect::<Vec<u32>>());
    let mut motions = Vec::with_capacity(groups.len());
    let mut start = 0;
    for (number, group) in groups.iter().enumerate() {
        let range = start..start + group.members.len();
        start = range.end;
        let boxes = (&half[range.clone()], &ahead[range]);
        motions.push(mix_motion(&mut out, number, chunk, setting, group, boxes));
    }
    let close = keep(&mut groups, chunk, refused, |number, group| {
        let material = usize::from(Tag::unpack(chunk.tags()[group.members[0] as usize]).material);
        motions[number].difference <= limits.velocity * setting.scheme.materials[material].wave_speed()
    });
    let mut out = out.gathered(&close);
    let motions: Vec<&Motion<D>> = close.iter().map(|&number| &motions[number as usize]).collect();

    let members: Vec<u32> = groups.iter().flat_map(|group| &group.members).copied().collect();
    let strain = hencky(chunk, &members);
    let mut energy = Vec::with_capacity(groups.len());
    let mut strains = Vec::with_capacity(groups.len());
    let mut start = 0;
    for (number, group) in groups.iter().enumerate() {
        let range = start..start + group.members.len();
        start = range.end;
        let packed = chunk.tags()[group.members[0] as usize];
        let tag = halvings::with(packed, Tag { level, ..Tag::unpack(packed) });
        out.ids_mut()[number] = group.id;
        out.tags_mut()[number] =
            group.rejoined.map_or(tag, |axis| halvings::rejoined(tag, axis, ids::generation(group.id)));
        let (mean, difference) = mix_matter(&mut out, number, chunk, setting, group, &strain[range]);
        let close = difference.strain <= limits.strain
            && difference.volume <= limits.volume
            && difference.history <= limits.history;
        energy.push(close.then_some(motions[number].energy));
        strains.push(mean);
    }
    restore(&mut out, setting, &strains);

    for (number, half) in setting.territories(&out, Select::All).iter().enumerate() {
        let tag = Tag::unpack(out.tags()[number]);
        // A box that just fits does so to round-off.
        let nominal = setting.nominal(tag, level) * (1.0 + 1e-9);
        let reach = if groups[number].is_family { limits.stretch } else { limits.stretch + 0.5 };
        let exceeds = |halves: &[f64; D], limit: f64| halves.iter().any(|&half| half > limit * nominal);
        if exceeds(half, limits.stretch) || exceeds(&motions[number].reach, reach) {
            energy[number] = None;
        }
        // Strangers that fill less than half of a particle of the level become one of the finer level, which
        // may merge again; as one of the coarser level it would split into tiny particles as soon as it
        // entered finer cells.
        let whole = (0..D).fold(1.0, |volume, _| volume * 2.0 * setting.nominal(tag, level));
        if !groups[number].is_family && setting.section(&out, number) < 0.5 * whole * (1.0 - 1e-9) {
            out.tags_mut()[number] = halvings::with(out.tags()[number], Tag { level: level + 1, ..tag });
        }
    }
    Mixtures { groups, chunk: out, energy }
}

/// Keeps the groups that pass and returns their numbers; identifiers of all others are added to `refused`.
fn keep<const D: usize>(
    groups: &mut Vec<Group>,
    chunk: &Chunk<D>,
    refused: &mut FxHashSet<u64>,
    passes: impl Fn(usize, &Group) -> bool,
) -> Vec<u32> {
    let mut kept = Vec::with_capacity(groups.len());
    let mut number = 0;
    groups.retain(|group| {
        let stays = passes(number, group);
        if stays {
            kept.push(number as u32);
        } else {
            refused.extend(group.members.iter().map(|&p| chunk.ids()[p as usize]));
        }
        number += 1;
        stays
    });
    kept
}

/// False if a member differs from the first by so much that one of them must be too far from the mean, even
/// if both are at the limit on opposite sides. Strains are not known yet; as `|a - b| <= λ |ln a - ln b|` for
/// the greatest eigenvalue λ of two positive definite tensors, which is below the greater trace, those of b
/// give a bound.
fn is_alike<const D: usize>(chunk: &Chunk<D>, group: &Group, limits: &Limits) -> bool {
    let first = group.members[0] as usize;
    let within = |column: usize, limit: f64| {
        let values = chunk.column(column);
        group.members.iter().all(|&p| (values[p as usize] - values[first]).abs() <= 2.0 * limit)
    };
    let strains_may_be = || {
        let tensor = |p: usize| symmetric(chunk, Layout::<D>::LEFT_CAUCHY_GREEN, p);
        let trace = |b: &[f64; 6]| b[0] + b[1] + b[2];
        let own = tensor(first);
        group.members[1..].iter().all(|&p| {
            let other = tensor(p as usize);
            let difference: [f64; 6] = std::array::from_fn(|c| other[c] - own[c]);
            // Hencky strains are halves of logarithms.
            let bound = 4.0 * limits.strain * trace(&own).max(trace(&other));
            square(&difference).sqrt() <= bound * (1.0 + 1e-9) + 1e-12
        })
    };
    within(Layout::<D>::PLASTIC_STRAIN, limits.history)
        && within(Layout::<D>::PLASTIC_VOLUME, limits.volume)
        && strains_may_be()
}

/// Whether the material lets particles with the histories of a group become one.
fn has_like_histories<const D: usize>(chunk: &Chunk<D>, group: &Group, setting: &Setting<D>) -> bool {
    let history = |p: u32| -> [f64; HISTORIES] { chunk.read(Layout::<D>::HISTORY, p as usize) };
    let [first, others @ ..] = group.members.as_slice() else { return true };
    let material = Tag::unpack(chunk.tags()[*first as usize]).material;
    let material = &setting.scheme.materials[usize::from(material)];
    let own = history(*first);
    others.iter().all(|&p| material.alike(&own, &history(p)))
}

/// Squared Frobenius norm of a symmetric tensor.
fn square(tensor: &[f64; 6]) -> f64 {
    (0..6).fold(0.0, |square, c| {
        f64::mul_add(if c < 3 { tensor[c] } else { 2.0 * tensor[c] }, tensor[c], square)
    })
}

/// Sum of the first `2^k` and the others, so that `2^k` equal numbers have an exact sum.
fn pairwise(values: &[f64]) -> f64 {
    match values {
        [] => 0.0,
        [value] => *value,
        _ => {
            let (first, rest) = values.split_at(values.len().next_power_of_two() / 2);
            pairwise(first) + pairwise(rest)
        }
    }
}

/// Weighted mean by differences from the first, exact where all are equal.
fn mean<const N: usize>(shares: &[f64], values: impl Fn(usize) -> [f64; N]) -> [f64; N] {
    let first = values(0);
    let mut sum = [0.0; N];
    for (i, share) in shares.iter().enumerate() {
        let value = values(i);
        (0..N).for_each(|c| sum[c] = share.mul_add(value[c] - first[c], sum[c]));
    }
    std::array::from_fn(|c| first[c] + sum[c])
}

/// Shares of positive values in their sum, which comes last.
fn shares(values: Vec<f64>) -> (Vec<f64>, f64) {
    let sum = pairwise(&values);
    (values.into_iter().map(|value| value / sum).collect(), sum)
}

/// Relative motion of the members of a group.
struct Motion<const D: usize> {
    /// Kinetic energy of the differences of velocity, J.
    energy: f64,
    /// Greatest difference of a velocity from the affine field, m/s.
    difference: f64,
    /// Half widths of a box about the new centre that holds all boxes, m.
    reach: [f64; D],
}

/// Mass, position, velocity and affine matrix. `boxes` are the half widths of the members and the ways to
/// their centres of mass along the first axis, m.
///
/// A ring from several has the sum of the areas of their sections, `Σ m_c / r_c` for equal densities, and the
/// sum of their volumes. Both are its own at the radius `M / Σ (m_c / r_c)`.
fn mix_motion<const D: usize>(
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
        Transfer::Tpic => divide(add(boxed, turning), metric),
        Transfer::Flip { .. } | Transfer::Xpic { .. } => [[0.0; D]; D],
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

/// Greatest differences of the material state of the members of a group from the mean.
struct Difference {
    /// Of the Hencky strain.
    strain: f64,
    /// Of the logarithm of the plastic volume ratio.
    volume: f64,
    /// Of the plastic strain.
    history: f64,
}

/// Reference volume, history, plastic work and the columns carried for loads. Returns the elastic Hencky
/// strain as well, from which [`restore`] makes the elastic deformation and the stress.
fn mix_matter<const D: usize>(
    out: &mut Chunk<D>,
    number: usize,
    chunk: &Chunk<D>,
    setting: &Setting<D>,
    group: &Group,
    strains: &[[f64; 6]],
) -> ([f64; 6], Difference) {
    let member = |i: usize| group.members[i] as usize;
    let half = |i: usize| chunk.column(Layout::<D>::HALF)[member(i)];
    let (shares, total) = shares(group.members.iter().map(|&p| volume(chunk, p as usize)).collect());
    let equal = (1..shares.len()).all(|i| half(i) == half(0));
    let width = match (D, equal && shares.len() == 1 << D) {
        (_, true) => 2.0 * half(0),
        (2, _) => 0.5 * total.sqrt(),
        _ => 0.5 * libm::cbrt(total),
    };
    let history = |i: usize| -> [f64; HISTORIES] { chunk.read(Layout::<D>::HISTORY, member(i)) };
    let mean_history = mean(&shares, history);
    let mut strain = mean(&shares, |i| strains[i]);
    let mut difference = Difference { strain: 0.0, volume: 0.0, history: 0.0 };
    for (i, own) in strains.iter().enumerate() {
        let rest: [f64; 6] = std::array::from_fn(|c| own[c] - strain[c]);
        let gain = (history(i)[PLASTIC_VOLUME] - mean_history[PLASTIC_VOLUME]).abs();
        difference.strain = difference.strain.max(square(&rest).sqrt());
        difference.volume = difference.volume.max(gain);
        difference.history =
            difference.history.max((history(i)[PLASTIC_STRAIN] - mean_history[PLASTIC_STRAIN]).abs());
    }

    // The mean of logarithms is the logarithm of the geometric mean; the volume that is missing is added.
    let tag = Tag::unpack(chunk.tags()[member(0)]);
    let is_plastic = setting.scheme.materials[usize::from(tag.material)].is_plastic();
    let logarithm = |strain: &[f64; 6], history: &[f64; HISTORIES]| {
        strain[0] + strain[1] + strain[2] + if is_plastic { history[PLASTIC_VOLUME] } else { 0.0 }
    };
    let middle = logarithm(&strain, &mean_history);
    let excess = (0..shares.len()).fold(0.0, |sum, i| {
        shares[i].mul_add(libm::expm1(logarithm(&strains[i], &history(i)) - middle), sum)
    });
    let missing = libm::log1p(excess) / D as f64;
    strain.iter_mut().take(D).for_each(|strain| *strain += missing);

    for column in 0..chunk.carried_columns() {
        let carried = chunk.carried(column);
        out.carried_mut(column)[number] = match column < setting.scheme.shares {
            true => (0..shares.len()).map(|i| carried[member(i)]).sum(),
            false => mean(&shares, |i| [carried[member(i)]])[0],
        };
    }
    out.write(Layout::<D>::HALF, number, &[width]);
    out.write(Layout::<D>::HISTORY, number, &mean_history);
    let work = mean(&shares, |i| chunk.read::<1>(Layout::<D>::WORK, member(i)));
    out.write(Layout::<D>::WORK, number, &work);
    (strain, difference)
}

/// A symmetric tensor of each of up to [`LANES`] particles.
fn tensors(count: usize, tensor: impl Fn(usize) -> [f64; 6]) -> Symmetric {
    let rows: [[f64; 6]; LANES] = std::array::from_fn(|lane| tensor(lane.min(count - 1)));
    std::array::from_fn(|c| Lanes::new(std::array::from_fn(|lane| rows[lane][c])))
}

/// Symmetric columns from `first`, in the order of [`Symmetric`].
fn symmetric<const D: usize>(chunk: &Chunk<D>, first: usize, p: usize) -> [f64; 6] {
    let column = |c: usize| chunk.column(first + c)[p];
    std::array::from_fn(|c| if c < Layout::<D>::SYMMETRIC { column(c) } else { 0.0 })
}

/// Elastic Hencky strains `½ ln b` of the listed particles.
fn hencky<const D: usize>(chunk: &Chunk<D>, list: &[u32]) -> Vec<[f64; 6]> {
    let mut out = Vec::with_capacity(list.len());
    for list in list.chunks(LANES) {
        let b = tensors(list.len(), |i| symmetric(chunk, Layout::<D>::LEFT_CAUCHY_GREEN, list[i] as usize));
        let eigen = eigen::decompose(&b, D == 2);
        let strain = eigen.compose(&eigen.value.map(|value| ln(value) * 0.5), D == 2).map(Lanes::to_array);
        out.extend((0..list.len()).map(|lane| strain.map(|component| component[lane])));
    }
    out
}

/// Elastic deformation from Hencky strains, and stress by an update of the material without increment, which
/// maps the strain to the yield surface should it lie outside. The dissipation of that update is plastic
/// work.
fn restore<const D: usize>(chunk: &mut Chunk<D>, setting: &Setting<D>, strains: &[[f64; 6]]) {
    for (first, strains) in (0..).step_by(LANES).zip(strains.chunks(LANES)) {
        let count = strains.len();
        let at = |lane: usize| first + lane.min(count - 1);
        let eigen = eigen::decompose(&tensors(count, |lane| strains[lane]), D == 2);
        let mut state = State::new(eigen.compose(&eigen.value.map(|value| exp(value + value)), D == 2));
        for (h, history) in state.history.iter_mut().enumerate() {
            let column = chunk.column(Layout::<D>::HISTORY + h);
            *history = Lanes::new(std::array::from_fn(|lane| column[at(lane)]));
        }
        let index = std::array::from_fn(|lane| Tag::unpack(chunk.tags()[at(lane)]).material);
        let cell = |lane: usize| setting.scheme.cell(Tag::unpack(chunk.tags()[at(lane)]).level);
        let step = Step { size: std::array::from_fn(cell), ..Step::rest(D == 2) };
        material::update(setting.scheme.materials, &index, &mut state, &step);
        let (elastic, stress) = (state.elastic.map(Lanes::to_array), state.stress.map(Lanes::to_array));
        let (history, work) = (state.history.map(Lanes::to_array), state.work.to_array());
        for lane in 0..count {
            let p = first + lane;
            let of = |tensor: &[[f64; LANES]; 6]| tensor.map(|component| component[lane]);
            chunk.write(Layout::<D>::LEFT_CAUCHY_GREEN, p, &of(&elastic)[..Layout::<D>::SYMMETRIC]);
            chunk.write(Layout::<D>::STRESS, p, &of(&stress)[..Layout::<D>::SYMMETRIC]);
            chunk.write(Layout::<D>::HISTORY, p, &history.map(|variable| variable[lane]));
            chunk.column_mut(Layout::<D>::WORK)[p] += work[lane];
        }
    }
}
