//! Tests of splitting and merging: common set-up and comparisons.
use super::affine::{read_matrix, write_matrix};
use super::cell_fit::{Wanted, needs_split};
use super::family::{Bounds, separated};
use super::setting::volume;
use super::*;
use crate::kernel::{BoxPolicy, Scheme, Select, Transfer};
use crate::material::{self, HISTORIES, Material, Parameters, State, Step};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::simd::{Lanes, Vector};
use proptest::prelude::*;

mod conservation;
mod halving;
mod limits;

/// Cell of level 0, and upper corner of the domain.
const CELL: f64 = 0.25;
const EXTENT: f64 = 8.0;
/// Half width of a particle of level 0.
const NOMINAL: [f64; 1] = [CELL / 4.0];
/// Elastic, von Mises, Drucker-Prager.
const KINDS: u16 = 3;
const OPEN: Limits = Limits { velocity: 1e9, strain: 1e9, volume: 1e9, history: 1e9, stretch: 4.0 };

fn materials() -> Vec<Box<dyn Material>> {
    [
        "model = 'hencky', young = 1e6, poisson = 0.3",
        "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 2e4, hardening = 1e4",
        "model = 'drucker_prager', young = 1e6, poisson = 0.3, friction_angle = 30",
    ]
    .map(|text| text.parse::<Parameters>().unwrap().build(1000.0))
    .into()
}

fn scheme(materials: &[Box<dyn Material>], transfer: Transfer) -> Scheme<'_> {
    Scheme::new(BoxPolicy::default(), CELL, transfer, materials)
}

fn setting<'a, const D: usize>(scheme: &'a Scheme<'a>, level: u8) -> Setting<'a, D> {
    let turn = merge_backoff::RetrySlot::ALL;
    Setting { scheme, extent: [EXTENT; D], level, nominal: &NOMINAL, turn, solid_strangers: true }
}

/// The domain as one leaf.
fn everywhere<const D: usize>() -> Bounds<D> {
    ([0.0; D], [EXTENT; D])
}

struct Numbers(u64);

impl Numbers {
    /// From -1 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 / (1u64 << 52) as f64) - 1.0
    }
}

/// Particles of a level, each at random in its own cell of a lattice of `1 / per_edge` of the nominal spacing
/// of that level, in states that their materials admit. Materials by index, or the one given.
fn particles<const D: usize>(seed: u64, level: u8, per_edge: usize, kind: Option<u16>) -> Chunk<D> {
    let mut numbers = Numbers(seed);
    let mut chunk = Chunk::new();
    let half = NOMINAL[0] / f64::from(1u32 << level);
    let spacing = 2.0 * half / per_edge as f64;
    for id in 0..per_edge.pow(D as u32) * 6 {
        let material = kind.unwrap_or(id as u16 % KINDS);
        let p = chunk.push_zeroed(id as u64, Tag { material, body: 0, level });
        let cell: [usize; D] =
            std::array::from_fn(|a| id / (2 * per_edge).pow(a as u32) % (2 * per_edge) + 9);
        let x = cell.map(|c| (c as f64 + 0.5 + 0.1 * numbers.next()) * spacing);
        chunk.write(Layout::<D>::POSITION, p, &x);
        let v: [f64; D] = std::array::from_fn(|_| numbers.next());
        chunk.write(Layout::<D>::VELOCITY, p, &v);
        let b: [[f64; D]; D] = std::array::from_fn(|_| std::array::from_fn(|_| half * numbers.next()));
        write_matrix(&mut chunk, p, &b);
        chunk.write(Layout::<D>::MASS, p, &[1.0 + 0.5 * numbers.next()]);
        chunk.write(Layout::<D>::HALF, p, &[half / per_edge as f64 * (1.0 - 0.02 * numbers.next().abs())]);
        chunk.write(Layout::<D>::WORK, p, &[1e3 * (1.0 + numbers.next())]);
        let elastic: [f64; 6] = std::array::from_fn(|c| match c {
            2 if D == 2 => 1.0,
            0..=2 => 1.0 + 0.05 * numbers.next(),
            4 | 5 if D == 2 => 0.0,
            _ => 0.03 * numbers.next(),
        });
        let mut history = [0.0; HISTORIES];
        if material != 0 {
            history[material::PLASTIC_STRAIN] = 0.05 + 0.04 * numbers.next();
        }
        set_matter(&mut chunk, p, elastic, history);
    }
    chunk
}

/// Returns `b` to the yield surface and sets it, with stress and history.
fn set_matter<const D: usize>(chunk: &mut Chunk<D>, p: usize, elastic: [f64; 6], history: [f64; HISTORIES]) {
    let mut state = State::new(elastic.map(Lanes::splat));
    state.history = history.map(Lanes::splat);
    materials()[usize::from(Tag::unpack(chunk.tags()[p]).material)].update(&mut state, &Step::rest(D == 2));
    let of = |tensor: &[Lanes; 6]| tensor.map(|component| component.to_array()[0]);
    chunk.write(Layout::<D>::LEFT_CAUCHY_GREEN, p, &of(&state.elastic)[..Layout::<D>::SYMMETRIC]);
    chunk.write(Layout::<D>::STRESS, p, &of(&state.stress)[..Layout::<D>::SYMMETRIC]);
    chunk.write(Layout::<D>::HISTORY, p, &state.history.map(|variable| variable.to_array()[0]));
}

fn elastic<const D: usize>(chunk: &Chunk<D>, p: usize) -> [f64; 6] {
    std::array::from_fn(|c| match c < Layout::<D>::SYMMETRIC {
        true => chunk.column(Layout::<D>::LEFT_CAUCHY_GREEN + c)[p],
        false => 0.0,
    })
}

/// Conserved quantities, each with the sum of absolute values with which its rounding errors scale.
#[derive(Default)]
struct Totals {
    mass: f64,
    /// First moments of mass, momentum, angular momentum, volume, current volume, plastic work.
    sums: Vec<(f64, f64)>,
    kinetic: f64,
}

fn totals<const D: usize>(chunk: &Chunk<D>) -> Totals {
    let mut totals = Totals { sums: vec![(0.0, 0.0); 2 * D + 6], ..Totals::default() };
    let mut add = |i: usize, value: f64| {
        totals.sums[i].0 += value;
        totals.sums[i].1 += value.abs();
    };
    for p in 0..chunk.len() {
        let (x, [m]) = (chunk.position(p), chunk.read(Layout::<D>::MASS, p));
        let v: [f64; D] = chunk.read(Layout::<D>::VELOCITY, p);
        let b = read_matrix(chunk, p);
        totals.mass += m;
        for a in 0..D {
            add(a, m * x[a]);
            add(D + a, m * v[a]);
            totals.kinetic += 0.5 * m * v[a] * v[a];
        }
        for (i, (j, k)) in [(1, 2), (2, 0), (0, 1)].into_iter().enumerate() {
            if j < D && k < D {
                for term in [x[j] * v[k], -(x[k] * v[j]), b[k][j], -b[j][k]] {
                    add(2 * D + i, m * term);
                }
            }
        }
        let [gain] = chunk.read(Layout::<D>::PLASTIC_VOLUME, p);
        let [work] = chunk.read(Layout::<D>::WORK, p);
        let determinant = material::eigen::determinant(&elastic(chunk, p).map(Lanes::splat)).to_array()[0];
        add(2 * D + 3, volume(chunk, p));
        add(2 * D + 4, volume(chunk, p) * determinant.sqrt() * gain.exp());
        add(2 * D + 5, volume(chunk, p) * work);
    }
    totals
}

/// Compares all sums but the last `skipped`.
fn assert_conserved(before: &Totals, after: &Totals, tolerance: f64, skipped: usize) {
    assert!((before.mass - after.mass).abs() <= tolerance * before.mass);
    let number = before.sums.len() - skipped;
    for (i, (a, b)) in before.sums[..number].iter().zip(&after.sums).enumerate() {
        assert!((a.0 - b.0).abs() <= tolerance * a.1, "sum {i}: {a:?} became {b:?}");
    }
}

/// Second moments as a grid with cells of the particles' level has them, at least.
fn spreads<const D: usize>(chunk: &Chunk<D>, setting: &Setting<D>, which: &[u32]) -> Vec<[f64; D]> {
    let cell = CELL / f64::from(1u32 << Tag::unpack(chunk.tags()[0]).level);
    let half = setting.territories(chunk, Select::List(which));
    half.iter().map(|half| half.map(|half| half * half / 3.0 + cell * cell / 8.0)).collect()
}

/// Splits all particles; returns the kinetic energy added, J.
fn split_all<const D: usize>(chunk: &mut Chunk<D>, setting: &Setting<D>) -> f64 {
    let wanted = needs_split(chunk, setting, None);
    assert_eq!((wanted.which.len(), wanted.refused), (chunk.len(), 0));
    let spreads = spreads(chunk, setting, &wanted.which);
    let (before, mut energy) = (chunk.len(), 0.0);
    let report = split(chunk, setting, &wanted.which, &spreads, &mut |value| {
        assert!(value >= 0.0);
        energy += value;
    });
    assert_eq!(report, Split { split: before as u64, refused: 0 });
    assert_eq!(chunk.len(), before << D);
    energy
}

fn merge_all<const D: usize>(chunk: &mut Chunk<D>, setting: &Setting<D>, limits: &Limits) -> (Merged, f64) {
    let (before, mut energy) = (chunk.len(), 0.0);
    let report = merge(chunk, setting, limits, Some(&everywhere()), |_| true, &mut |value| {
        assert!(value >= 0.0);
        energy += value;
    });
    assert_eq!(before - chunk.len(), report.removed as usize);
    (report, energy)
}

/// Compares all particles; columns to `tolerance` of their greatest value (stress: of the modulus),
/// identifiers and tags exactly.
fn assert_same<const D: usize>(a: &Chunk<D>, b: &Chunk<D>, tolerance: f64) {
    assert_eq!(a.ids(), b.ids());
    assert_eq!(a.tags(), b.tags());
    for column in 0..Layout::<D>::REALS {
        // Components of a tensor are as exact as its greatest.
        let (elastic, stress) = (Layout::<D>::LEFT_CAUCHY_GREEN, Layout::<D>::STRESS);
        let least = match column {
            column if (stress..Layout::<D>::MASS).contains(&column) => 1e6,
            column if (elastic..stress).contains(&column) => 1.0,
            _ => 0.0,
        };
        let scale = a.column(column).iter().fold(least, |scale: f64, value| scale.max(value.abs()));
        for (a, b) in a.column(column).iter().zip(b.column(column)) {
            assert!((a - b).abs() <= tolerance * scale, "column {column}: {a} became {b}");
        }
    }
}
