//! Scatter and gather together, against a plain scalar definition.
use super::constrained_nodes::{ConstrainedNodes, MomentNode};
use super::g2p::booked::Booked;
use super::g2p::leavers::Leavers;
use super::g2p::{Fields, Gathered, Moments};
use super::hanging::HangingNodes;
use super::p2g::MomentSums;
use super::*;
use crate::material::{Material, Parameters};
use crate::particle::chunk::{Chunk, Layout, Place, Tag};

mod beside_coarser;
mod given;
mod leavers;
mod parts;

/// As [`super::g2p::Gather::whole_boxes`], for particles that may go anywhere.
fn gather<const D: usize>(
    chunk: &mut Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    dt: f64,
    fields: &Fields,
    next: Place,
) -> f64 {
    let (scratch, leavers) = (&mut Default::default(), &mut Leavers::default());
    g2p::Gather {
        scratch,
        chunk,
        frame,
        scheme,
        dt,
        fields,
        leavers,
        dilation: &[],
        filling: None,
        booked: &mut Booked::default(),
        rates: None,
    }
    .whole_boxes(select, next)
}

/// As [`super::p2g::Scatter::whole_boxes`], with memory of its own.
fn scatter<const D: usize>(
    chunk: &Chunk<D>,
    select: Select,
    frame: &Frame<D>,
    scheme: &Scheme,
    dt: f64,
    arena: &mut [Row],
    moments: Option<MomentSums>,
    next: Place,
) {
    let scratch = &mut Default::default();
    p2g::Scatter { scratch, chunk, given: &[], frame, scheme, dt, arena, moments }.whole_boxes(select, next);
}

/// A small deterministic generator of numbers in [0, 1).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

const CELL: f64 = 0.05;
const DT: f64 = 1e-4;

fn materials() -> Vec<Box<dyn Material>> {
    [
        "model = 'neo_hookean', young = 1e5, poisson = 0.3",
        "model = 'von_mises', young = 1e5, poisson = 0.3, yield_stress = 500, hardening = 100",
        "model = 'drucker_prager', young = 1e5, poisson = 0.3, friction_angle = 30",
        "model = 'hencky', young = 1e5, poisson = 0.3",
        "model = 'fixed_corotated', young = 1e5, poisson = 0.3",
    ]
    .map(|text| text.parse::<Parameters>().unwrap().build(1000.0))
    .into()
}

fn frame<const D: usize>() -> Frame<D> {
    // Away from the walls: second block of a domain of four.
    Frame { corner: [4.0 * CELL; D], cell: CELL, extent: [16.0 * CELL; D] }
}

fn scheme(materials: &[Box<dyn Material>], transfer: Transfer) -> Scheme<'_> {
    Scheme::new(BoxPolicy::default(), CELL, transfer, materials)
}

/// `n` particles at random in the block with random velocity, B, b and stress; materials in turn.
fn particles<const D: usize>(n: usize, seed: u64, kinds: u16) -> Chunk<D> {
    let mut numbers = Numbers(seed);
    let mut chunk = Chunk::new();
    for id in 0..n {
        let tag = Tag { material: id as u16 % kinds, body: 0, level: 0 };
        let p = chunk.push_zeroed(id as u64, tag);
        let mut set = |column: usize, value: f64| chunk.column_mut(column)[p] = value;
        for k in 0..D {
            set(Layout::<D>::POSITION + k, CELL * (4.0 + 4.0 * numbers.next()));
            set(Layout::<D>::VELOCITY + k, numbers.next() - 0.5);
        }
        for k in 0..D * D {
            // Of the size that a velocity gradient of 10/s gives.
            set(Layout::<D>::AFFINE + k, 5.0 * CELL * CELL * (numbers.next() - 0.5));
        }
        for c in 0..Layout::<D>::SYMMETRIC {
            let unit = if c < 3 { 1.0 } else { 0.0 };
            set(Layout::<D>::LEFT_CAUCHY_GREEN + c, unit + 0.05 * (numbers.next() - 0.5));
            set(Layout::<D>::STRESS + c, 1e4 * (numbers.next() - 0.5));
        }
        set(Layout::<D>::MASS, 0.1 + numbers.next());
        set(Layout::<D>::HALF, CELL * (0.05 + 0.2 * numbers.next()));
    }
    chunk
}

fn position<const D: usize>(node: usize) -> [f64; D] {
    std::array::from_fn(|k| CELL * (4.0 + (node / ARENA_EDGE.pow(k as u32) % ARENA_EDGE) as f64 - 1.0))
}

/// Average of a hat function of node at 0 over `[lo, hi]` by exact integration, and its derivative.
fn hat(lo: f64, hi: f64) -> (f64, f64) {
    let piece = |a: f64, b: f64, sign: f64| {
        let (a, b) = (a.max(lo), b.min(hi));
        if b <= a { (0.0, 0.0) } else { ((b - a) + sign * (b * b - a * a) / 2.0, sign * (b - a)) }
    };
    let (left, right) = (piece(-1.0, 0.0, 1.0), piece(0.0, 1.0, -1.0));
    ((left.0 + right.0) / (hi - lo), (left.1 + right.1) / (hi - lo))
}

/// Weight and gradient of a node from the definition.
fn definition<const D: usize>(node: [f64; D], x: [f64; D], half: [f64; D]) -> (f64, [f64; D]) {
    let axes: [(f64, f64); D] = std::array::from_fn(|k| {
        let (w, slope) = hat((x[k] - half[k] - node[k]) / CELL, (x[k] + half[k] - node[k]) / CELL);
        (w, slope / CELL)
    });
    let weight = axes.iter().map(|a| a.0).product();
    let gradient =
        std::array::from_fn(|k| (0..D).map(|i| if i == k { axes[i].1 } else { axes[i].0 }).product());
    (weight, gradient)
}

/// `Σ w (x_j - x_p)²` along each axis from the definition.
fn spread<const D: usize>(x: [f64; D], half: [f64; D]) -> [f64; D] {
    let mut spread = [0.0; D];
    for node in 0..arena_nodes(D) {
        let x_j = position::<D>(node);
        let (w, _) = definition(x_j, x, half);
        for k in 0..D {
            spread[k] += w * (x_j[k] - x[k]) * (x_j[k] - x[k]);
        }
    }
    spread
}

fn scatter_equals_definition<const D: usize>(transfer: Transfer) {
    let (materials, frame) = (materials(), frame::<D>());
    let scheme = scheme(&materials, transfer);
    let chunk = particles::<D>(61, 5, 5);
    let mut half = Vec::new();
    domain::half_widths(&chunk, Select::All, CELL, &frame.extent, &scheme, &mut half);
    let mut arena = vec![Row::default(); arena_nodes(D)];
    scatter(&chunk, Select::All, &frame, &scheme, DT, &mut arena, None, Place::default());
    let at = |column: usize, p: usize| chunk.column(column)[p];
    // C = B D⁻¹ with APIC, the gradient itself with TPIC.
    let spreads: Vec<[f64; D]> = (0..chunk.len())
        .map(|p| if transfer == Transfer::Apic { spread(chunk.position(p), half[p]) } else { [1.0; D] })
        .collect();
    for node in 0..arena_nodes(D) {
        let x_j = position::<D>(node);
        let mut expected = [0.0; 4];
        for p in 0..chunk.len() {
            let x = chunk.position(p);
            let (w, gradient) = definition(x_j, x, half[p]);
            let mass = at(Layout::<D>::MASS, p);
            let volume = (2.0 * at(Layout::<D>::HALF, p)).powi(D as i32);
            for i in 0..D {
                let mut v = at(Layout::<D>::VELOCITY + i, p);
                let mut force = 0.0;
                for k in 0..D {
                    v += at(Layout::<D>::AFFINE + D * i + k, p) / spreads[p][k] * (x_j[k] - x[k]);
                    force -= volume * at(Layout::<D>::STRESS + symmetric_index::<D>(i, k), p) * gradient[k];
                }
                expected[i] += w * mass * v + DT * force;
            }
            expected[3] += w * mass;
        }
        for i in 0..4 {
            assert!(
                (arena[node].0[i] - expected[i]).abs() < 1e-13,
                "{node} {i} {:?} {expected:?}",
                arena[node]
            );
        }
    }
}

#[test]
fn scatter_is_the_definition() {
    for transfer in [Transfer::Apic, Transfer::Tpic] {
        scatter_equals_definition::<2>(transfer);
        scatter_equals_definition::<3>(transfer);
    }
}

/// An affine field on the nodes comes back exactly; x, b and `B = A D` follow.
fn affine_field<const D: usize>() {
    let (materials, frame) = (materials(), frame::<D>());
    let scheme = scheme(&materials, Transfer::Apic);
    let mut numbers = Numbers(77);
    let a: [[f64; D]; D] = std::array::from_fn(|_| std::array::from_fn(|_| numbers.next() - 0.5));
    let field = |x: [f64; D]| -> [f64; D] {
        std::array::from_fn(|i| 0.3 * i as f64 + (0..D).map(|k| a[i][k] * x[k]).sum::<f64>())
    };
    let velocity: Vec<Row> = (0..arena_nodes(D))
        .map(|node| {
            let v = field(position::<D>(node));
            Row(std::array::from_fn(|i| if i < D { v[i] } else { f64::from(i == 3) }))
        })
        .collect();
    let before = particles::<D>(45, 9, 1);
    let mut chunk = before.clone();
    let fields = Fields { velocity: &velocity, increment: None, fill: None, moments: None };
    let speed = gather(&mut chunk, Select::All, &frame, &scheme, DT, &fields, Place::default());
    assert!(speed > materials[0].wave_speed() * 0.8 && speed < materials[0].wave_speed() * 1.5);
    let mut half = Vec::new();
    domain::half_widths(&before, Select::All, CELL, &frame.extent, &scheme, &mut half);
    for p in 0..chunk.len() {
        let spread = spread(before.position(p), half[p]);
        let expected = field(before.position(p));
        for i in 0..D {
            let v = chunk.column(Layout::<D>::VELOCITY + i)[p];
            assert!((v - expected[i]).abs() < 1e-14);
            let moved = before.position(p)[i] + DT * expected[i];
            assert!((chunk.position(p)[i] - moved).abs() < 1e-15);
            for k in 0..D {
                let c = chunk.column(Layout::<D>::AFFINE + D * i + k)[p] / spread[k];
                assert!((c - a[i][k]).abs() < 1e-12, "{c} {}", a[i][k]);
            }
        }
        let b = |chunk: &Chunk<D>, i: usize, k: usize| {
            chunk.column(Layout::<D>::LEFT_CAUCHY_GREEN + symmetric_index::<D>(i, k))[p]
        };
        let f = |i: usize, k: usize| f64::from(i == k) + DT * a[i][k];
        for i in 0..D {
            for k in i..D {
                let mut expected = 0.0;
                for r in 0..D {
                    for s in 0..D {
                        let rs = if r < s { b(&before, r, s) } else { b(&before, s, r) };
                        expected += f(i, r) * rs * f(k, s);
                    }
                }
                assert!((b(&chunk, i, k) - expected).abs() < 1e-14);
            }
        }
    }
}

#[test]
fn gather_reproduces_affine_fields() {
    affine_field::<2>();
    affine_field::<3>();
}

/// Linear momentum and angular momentum of particles, the affine part included.
fn momenta<const D: usize>(chunk: &Chunk<D>) -> ([f64; D], [[f64; D]; D]) {
    let mut linear = [0.0; D];
    let mut angular = [[0.0; D]; D];
    for p in 0..chunk.len() {
        let x = chunk.position(p);
        let at = |column: usize| chunk.column(column)[p];
        let mass = at(Layout::<D>::MASS);
        let affine = |i: usize, k: usize| at(Layout::<D>::AFFINE + D * i + k);
        let v = |i: usize| at(Layout::<D>::VELOCITY + i);
        for i in 0..D {
            linear[i] += mass * v(i);
            for k in 0..D {
                angular[i][k] += mass * (x[i] * v(k) - x[k] * v(i) + affine(k, i) - affine(i, k));
            }
        }
    }
    (linear, angular)
}

/// The same of nodes.
fn momenta_of_nodes<const D: usize>(arena: &[Row]) -> ([f64; D], [[f64; D]; D]) {
    let mut linear = [0.0; D];
    let mut angular = [[0.0; D]; D];
    for (node, row) in arena.iter().enumerate() {
        let x = position::<D>(node);
        for i in 0..D {
            linear[i] += row.0[i];
            for k in 0..D {
                angular[i][k] += x[i] * row.0[k] - x[k] * row.0[i];
            }
        }
    }
    (linear, angular)
}

/// Whether two states of motion differ by less than `tolerance` in every component.
fn close<const D: usize>(
    a: &([f64; D], [[f64; D]; D]),
    b: &([f64; D], [[f64; D]; D]),
    tolerance: f64,
) -> bool {
    (0..D).all(|i| {
        (a.0[i] - b.0[i]).abs() < tolerance && (0..D).all(|k| (a.1[i][k] - b.1[i][k]).abs() < tolerance)
    })
}

/// Momentum to velocity.
fn divide_by_mass(arena: &mut [Row]) {
    for row in arena {
        let inverse = if row.0[3] > 0.0 { 1.0 / row.0[3] } else { 0.0 };
        row.0 = row.0.map(|x| x * inverse);
    }
}

/// Repeated steps of particles that move and deform: D changes on the way, the momenta do not. The stress
/// takes part: symmetric stress has no total force and no torque.
fn steps_conserve<const D: usize>() {
    let (materials, frame) = (materials(), frame::<D>());
    let scheme = scheme(&materials, Transfer::Apic);
    let mut chunk = particles::<D>(100, 3, 5);
    for k in 0..D {
        // Clear of the block's faces, so that nobody leaves it on the way.
        for x in chunk.column_mut(Layout::<D>::POSITION + k) {
            *x = CELL * 5.0 + (*x - CELL * 4.0) * 0.5;
        }
    }
    let start = chunk.clone();
    let before = momenta(&chunk);
    let mass: f64 = chunk.column(Layout::<D>::MASS).iter().sum();
    for _ in 0..50 {
        let mut arena = vec![Row::default(); arena_nodes(D)];
        scatter(&chunk, Select::All, &frame, &scheme, 10.0 * DT, &mut arena, None, Place::default());
        assert!((arena.iter().map(|row| row.0[3]).sum::<f64>() - mass).abs() < 1e-13 * mass);
        assert!(close(&momenta_of_nodes(&arena), &before, 1e-12));
        divide_by_mass(&mut arena);
        let fields = Fields { velocity: &arena, increment: None, fill: None, moments: None };
        gather(&mut chunk, Select::All, &frame, &scheme, 10.0 * DT, &fields, Place::default());
        // A particle moves along its new velocity, which changes no angular momentum.
        let after = momenta(&chunk);
        assert!(close(&after, &before, 1e-12), "{before:?} {after:?}");
    }
    let travel = |p: usize| (0..D).map(|k| (chunk.position(p)[k] - start.position(p)[k]).abs()).sum::<f64>();
    assert!((0..chunk.len()).map(travel).fold(0.0, f64::max) > 0.02 * CELL);
}

#[test]
fn momentum_and_angular_momentum_are_conserved() {
    steps_conserve::<2>();
    steps_conserve::<3>();
}

fn bits<const D: usize>(chunk: &Chunk<D>, p: usize) -> Vec<u64> {
    (0..Layout::<D>::REALS).map(|column| chunk.column(column)[p].to_bits()).collect()
}

/// A particle's bits do not depend on the batch it is in, nor on the materials beside it.
fn batches_do_not_matter<const D: usize>() {
    let (materials, frame) = (materials(), frame::<D>());
    let scheme = scheme(&materials, Transfer::Apic);
    let start = particles::<D>(53, 21, 5);
    let mut numbers = Numbers(4);
    let velocity: Vec<Row> = (0..arena_nodes(D))
        .map(|_| Row(std::array::from_fn(|i| if i < D { 200.0 * (numbers.next() - 0.5) } else { 0.0 })))
        .collect();
    let fields = Fields { velocity: &velocity, increment: None, fill: None, moments: None };
    let mut all = start.clone();
    gather(&mut all, Select::All, &frame, &scheme, DT, &fields, Place::default());
    let mut split = start.clone();
    let (even, odd): (Vec<u32>, Vec<u32>) = (0..53).partition(|p| p % 2 == 0);
    gather(&mut split, Select::List(&odd), &frame, &scheme, DT, &fields, Place::default());
    gather(&mut split, Select::List(&even), &frame, &scheme, DT, &fields, Place::default());
    let mut single = start.clone();
    for p in 0..53 {
        gather(&mut single, Select::List(&[p]), &frame, &scheme, DT, &fields, Place::default());
    }
    for p in 0..53 {
        assert_eq!(bits(&all, p), bits(&split, p));
        assert_eq!(bits(&all, p), bits(&single, p));
    }
    let sum = |select: &[Select]| {
        let mut arena = vec![Row::default(); arena_nodes(D)];
        for &select in select {
            scatter(&all, select, &frame, &scheme, DT, &mut arena, None, Place::default());
        }
        arena
    };
    let order: Vec<u32> = (0..53).collect();
    let (whole, pieces) =
        (sum(&[Select::All]), sum(&[Select::List(&order[..10]), Select::List(&order[10..])]));
    assert_eq!(whole, pieces);
}

#[test]
fn bits_do_not_depend_on_batches() {
    batches_do_not_matter::<2>();
    batches_do_not_matter::<3>();
}
