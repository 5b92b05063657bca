//! Volume, state and stress of the particle that stands for a group.
use super::super::Setting;
use super::super::setting::volume;
use super::group::Group;
use super::means::{mean, shares, square};
use crate::material::{self, HISTORIES, PLASTIC_STRAIN, PLASTIC_VOLUME, State, Step, Symmetric, eigen};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::simd::math::{exp, ln};
use crate::simd::{LANES, Lanes, Vector};

/// Greatest differences of the material state of the members of a group from the mean.
pub(super) struct Difference {
    /// Of the Hencky strain.
    pub strain: f64,
    /// Of the logarithm of the plastic volume ratio.
    pub volume: f64,
    /// Of the plastic strain.
    pub history: f64,
}

/// Reference volume, history, plastic work and the columns carried for loads. Returns the elastic Hencky
/// strain as well, from which [`restore`] makes the elastic deformation and the stress.
pub(super) fn mix_matter<const D: usize>(
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
pub(super) fn symmetric<const D: usize>(chunk: &Chunk<D>, first: usize, p: usize) -> [f64; 6] {
    let column = |c: usize| chunk.column(first + c)[p];
    std::array::from_fn(|c| if c < Layout::<D>::SYMMETRIC { column(c) } else { 0.0 })
}

/// Elastic Hencky strains `½ ln b` of the listed particles.
pub(super) fn hencky<const D: usize>(chunk: &Chunk<D>, list: &[u32]) -> Vec<[f64; 6]> {
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
pub(super) fn restore<const D: usize>(chunk: &mut Chunk<D>, setting: &Setting<D>, strains: &[[f64; 6]]) {
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
