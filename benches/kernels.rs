//! Scatter and gather per particle: `cargo bench --bench kernels`.
//!
//! A million particles in blocks of their own, so that columns come from memory as in a run; eight
//! per cell in 3D, four in 2D. Plastic materials flow in every step. Blocks beside level jumps hold some of
//! their leaf's particles, whose stencils touch constrained nodes.
use agimp::kernel::constrained_nodes::ConstrainedNodes;
use agimp::kernel::g2p::booked::Booked;
use agimp::kernel::g2p::leavers::Leavers;
use agimp::kernel::hanging::HangingNodes;
use agimp::kernel::{BoxPolicy, Frame, Row, Scheme, Select, Transfer, arena_nodes, g2p, p2g};
use agimp::material::{Material, Parameters};
use agimp::particle::chunk::{Chunk, Layout, Place, Tag};
use divan::Bencher;
use divan::counter::ItemsCount;

const CELL: f64 = 0.01;
const PARTICLES: usize = 1 << 20;
const DT: f64 = 1e-6;

fn main() {
    divan::main();
}

/// Parameters of a model, named by what tells it from other models.
#[derive(Clone, Copy)]
struct Model(&'static str);

impl std::fmt::Display for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let common = |key: &&str| !key.starts_with("young") && !key.starts_with("poisson");
        let keys: Vec<&str> = self.0.split(", ").filter(common).collect();
        f.write_str(&keys.join(" ").replace("model = ", "").replace(" = ", "="))
    }
}

/// The examples of all models.
fn models() -> Vec<Model> {
    Parameters::examples().into_iter().map(Model).collect()
}

fn material(model: Model) -> Box<dyn Material> {
    let parameters: Parameters = model.0.parse().expect("examples can be read");
    parameters.build(1000.0)
}

const ELASTIC: Model = Model("model = 'neo_hookean', young = 1e6, poisson = 0.3");

/// Blocks full of particles, sheared and slightly compressed, with their nodes' velocities.
struct Setting<const D: usize> {
    chunks: Vec<Chunk<D>>,
    materials: Vec<Box<dyn Material>>,
    velocity: Vec<Row>,
    frame: Frame<D>,
}

impl<const D: usize> Setting<D> {
    /// `distinct` blocks, visited in turn: two stay in the cache, as many as the particles fill do not.
    fn new(model: Model, distinct: usize) -> Self {
        // An odd number of cache lines per column: columns do not fall into the same cache set.
        let mut chunk = Chunk::with_capacity(8usize.pow(D as u32) + 8);
        for i in 0..8usize.pow(D as u32) {
            let p = chunk.push_zeroed(i as u64, Tag { material: 0, body: 0, level: 0 });
            let mut set = |column: usize, value: f64| chunk.column_mut(column)[p] = value;
            for k in 0..D {
                let place = (i / 8usize.pow(k as u32) % 8) as f64;
                set(Layout::<D>::POSITION + k, CELL * (4.25 + 0.5 * place + 0.01 * (p % 7) as f64));
                set(Layout::<D>::VELOCITY + k, 0.1 * place);
            }
            for c in 0..3 {
                set(Layout::<D>::LEFT_CAUCHY_GREEN + c, 0.99 - 0.01 * c as f64);
            }
            for c in 3..Layout::<D>::SYMMETRIC {
                set(Layout::<D>::LEFT_CAUCHY_GREEN + c, 0.02 + 0.005 * c as f64);
            }
            set(Layout::<D>::MASS, 1.0);
            set(Layout::<D>::HALF, 0.25 * CELL);
        }
        let velocity = (0..arena_nodes(D))
            .map(|node| {
                let [x, y, z] = std::array::from_fn(|k| (node / 7usize.pow(k as u32) % 7) as f64);
                Row([0.3 * y - 0.01 * x, 0.2 * z - 0.01 * y, 0.1 * x - 0.01 * z, 1.0])
            })
            .collect();
        Self {
            chunks: vec![chunk; distinct.min(PARTICLES / 8usize.pow(D as u32))],
            materials: vec![material(model)],
            velocity,
            frame: Frame { corner: [4.0 * CELL; D], cell: CELL, extent: [16.0 * CELL; D] },
        }
    }

    fn scheme(&self) -> Scheme<'_> {
        Scheme::new(BoxPolicy::default(), CELL, Transfer::Apic, &self.materials)
    }
}

/// Blocks in all.
fn blocks<const D: usize>() -> usize {
    PARTICLES / 8usize.pow(D as u32)
}

fn scatter<const D: usize>(bencher: Bencher, model: Model, distinct: usize) {
    let setting = Setting::<D>::new(model, distinct);
    let mut arena = vec![Row::default(); arena_nodes(D)];
    let mut scratch = p2g::Scratch::default();
    bencher.counter(ItemsCount::new(PARTICLES)).bench_local(|| {
        let scheme = setting.scheme();
        for chunk in setting.chunks.iter().cycle().take(blocks::<D>()) {
            arena.fill(Row::default());
            let (frame, scheme, scratch, arena) = (&setting.frame, &scheme, &mut scratch, &mut arena[..]);
            p2g::Scatter { scratch, chunk, given: &[], frame, scheme, dt: DT, arena, moments: None }
                .whole_boxes(Select::All, Place::default());
        }
        arena[100 % arena_nodes(D)]
    });
}

fn gather<const D: usize>(bencher: Bencher, model: Model, distinct: usize) {
    let mut setting = Setting::<D>::new(model, distinct);
    let mut chunks = std::mem::take(&mut setting.chunks);
    let (mut scratch, mut leavers) = (g2p::Scratch::default(), Leavers::default());
    bencher.counter(ItemsCount::new(PARTICLES)).bench_local(|| {
        let scheme = setting.scheme();
        let fields = g2p::Fields { velocity: &setting.velocity, increment: None, fill: None, moments: None };
        (0..blocks::<D>()).fold(0.0, |greatest: f64, i| {
            let chunk = &mut chunks[i % distinct.min(blocks::<D>())];
            let (frame, scheme, fields) = (&setting.frame, &scheme, &fields);
            let (scratch, leavers) = (&mut scratch, &mut leavers);
            let bin = g2p::Gather {
                scratch,
                chunk,
                frame,
                scheme,
                dt: DT,
                fields,
                leavers,
                dilation: &[],
                filling: None,
                booked: &mut Booked::default(),
                rates: None,
            };
            greatest.max(bin.whole_boxes(Select::All, Place::default()))
        })
    });
}

/// Of how many particles in four a block beside a level jump has, and whether their stencils touch
/// constrained nodes.
const MIXES: [(u32, bool); 5] = [(4, false), (4, true), (3, false), (3, true), (1, true)];

/// Two layers of hanging nodes, as beside a face.
fn constrained() -> ConstrainedNodes {
    let is_hanging: Vec<bool> = (0..arena_nodes(3)).map(|node| node % 7 < 2).collect();
    ConstrainedNodes::new::<3>(&[], HangingNodes::new::<3>(&is_hanging))
}

/// The particles that a block of a level mix has, in each leaf: whole quarters along x, as beside a face.
fn members(quarters: u32) -> Vec<u32> {
    (0..512).filter(|i| i % 8 / 2 < quarters).collect()
}

#[divan::bench(args = MIXES, sample_count = 9)]
fn p2g_3d_level_mix(bencher: Bencher, (quarters, jump): (u32, bool)) {
    let setting = Setting::<3>::new(ELASTIC, PARTICLES);
    let mut arena = vec![Row::default(); arena_nodes(3)];
    let mut scratch = p2g::Scratch::default();
    let nodes = constrained();
    let list = members(quarters);
    bencher.counter(ItemsCount::new(blocks::<3>() * list.len())).bench_local(|| {
        let scheme = setting.scheme();
        for chunk in setting.chunks.iter().cycle().take(blocks::<3>()) {
            arena.fill(Row::default());
            let moments = jump.then_some(p2g::MomentSums { nodes: &nodes, sums: &mut [] });
            let (frame, scheme, scratch, arena) = (&setting.frame, &scheme, &mut scratch, &mut arena[..]);
            p2g::Scatter { scratch, chunk, given: &[], frame, scheme, dt: DT, arena, moments }
                .whole_boxes(Select::List(&list), Place::default());
        }
        arena[100]
    });
}

#[divan::bench(args = MIXES, sample_count = 9)]
fn g2p_3d_level_mix(bencher: Bencher, (quarters, jump): (u32, bool)) {
    let mut setting = Setting::<3>::new(ELASTIC, PARTICLES);
    let mut chunks = std::mem::take(&mut setting.chunks);
    let (mut scratch, mut leavers) = (g2p::Scratch::default(), Leavers::default());
    let nodes = constrained();
    let list = members(quarters);
    bencher.counter(ItemsCount::new(blocks::<3>() * list.len())).bench_local(|| {
        let scheme = setting.scheme();
        let moments = jump.then_some(g2p::Moments { nodes: &nodes, first: &[] });
        let fields = g2p::Fields { velocity: &setting.velocity, increment: None, fill: None, moments };
        chunks.iter_mut().fold(0.0, |greatest: f64, chunk| {
            let (frame, scheme, fields) = (&setting.frame, &scheme, &fields);
            let (scratch, leavers) = (&mut scratch, &mut leavers);
            let bin = g2p::Gather {
                scratch,
                chunk,
                frame,
                scheme,
                dt: DT,
                fields,
                leavers,
                dilation: &[],
                filling: None,
                booked: &mut Booked::default(),
                rates: None,
            };
            greatest.max(bin.whole_boxes(Select::List(&list), Place::default()))
        })
    });
}

#[divan::bench(args = models(), sample_count = 9)]
fn p2g_3d(bencher: Bencher, model: Model) {
    scatter::<3>(bencher, model, PARTICLES);
}

#[divan::bench(args = models(), sample_count = 9)]
fn g2p_3d(bencher: Bencher, model: Model) {
    gather::<3>(bencher, model, PARTICLES);
}

#[divan::bench(args = models(), sample_count = 9)]
fn p2g_2d(bencher: Bencher, model: Model) {
    scatter::<2>(bencher, model, PARTICLES);
}

#[divan::bench(args = models(), sample_count = 9)]
fn g2p_2d(bencher: Bencher, model: Model) {
    gather::<2>(bencher, model, PARTICLES);
}

#[divan::bench(args = models(), sample_count = 9)]
fn p2g_3d_in_cache(bencher: Bencher, model: Model) {
    scatter::<3>(bencher, model, 2);
}

#[divan::bench(args = models(), sample_count = 9)]
fn g2p_3d_in_cache(bencher: Bencher, model: Model) {
    gather::<3>(bencher, model, 2);
}
