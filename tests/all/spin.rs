//! Free flight across level jumps: what each transfer conserves. Each test launches its own binary under
//! mpirun.

use crate::common::relaunch::{ran_if_launched, relaunch};
use crate::common::spinning::{CUBE, SQUARE};
use agimp::exact_sum::ExactSum;
use agimp::job::{AnyProblem, Problem, parse};
use agimp::kernel::Transfer;
use agimp::particle::chunk::{Chunk, Layout};
use agimp::setup;
use agimp::solver::{Clock, Requests, Solver};
use partition::comm::Comm;

/// Up to the first space.
fn first_word(text: &str) -> String {
    text.split_whitespace().next().unwrap_or_default().to_string()
}

/// Runs `body` on each number of ranks; what it prints after `same: ` must not depend on that number. Each is
/// a new process group, as MPI starts once per process.
fn on_ranks(test: &str, ranks: &[usize], body: impl Fn(&Comm)) {
    if ran_if_launched(body) {
        return;
    }
    let mut same: Option<Vec<String>> = None;
    for &n in ranks {
        let text = relaunch(module_path!(), test, n, 100);
        let now: Vec<String> = text.split("same: ").skip(1).map(first_word).collect();
        let before = same.get_or_insert_with(|| now.clone());
        assert_eq!(*before, now, "{test}: {n} ranks against {}", ranks[0]);
        println!("{n} ranks: {text}");
    }
}

/// Steps of a test: a tenth of them where ranks share cores.
fn steps(comm: &Comm, steps: u64) -> u64 {
    if comm.size() > 1 { steps / 10 } else { steps }
}

/// A soft square that flies through levels 0, 1 and 2 (a jump of two among them) with 1 m/s.
const FLYING: &str = r#"
version = 1
dimension = 2
gravity = [0, 0]
[domain]
size = [4, 2]
root_edge = 1
[tree]
graded = false
regions = [
    { level = 1, shape = { kind = "box", min = [1, 0], max = [1.9, 0.9] } },
    { level = 2, shape = { kind = "box", min = [2, 0], max = [2.9, 2] } },
]
[[materials]]
name = "rubber"
density = 1000
model = "neo_hookean"
young = 1e3
poisson = 0.3
[[bodies]]
name = "square"
material = "rubber"
shape = { kind = "box", min = [0.25, 0.625], max = [0.875, 1.25] }
velocity = [1, 0.125]
[numerics]
transfer = "apic"
[time]
end = 1e3
dt_max = 2.5e-3
[output]
every = 1e3
"#;

fn problem<const D: usize>(text: &str) -> Problem<D>
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let problem = parse(text, "free.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}"));
    problem.try_into().unwrap_or_else(|_| panic!("another dimension"))
}

fn solver<const D: usize>(comm: &Comm, text: &str) -> Solver<D>
where
    Problem<D>: TryFrom<AnyProblem>,
{
    setup::solver(comm, &problem(text)).unwrap_or_else(|error| panic!("{error}"))
}

fn with(text: &str, transfer: &str) -> String {
    text.replace("transfer = \"apic\"", transfer)
}

fn advance<const D: usize>(solver: &mut Solver<D>, steps: u64) {
    for _ in 0..steps {
        solver.step(f64::MAX, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
    }
}

fn advance_to<const D: usize>(solver: &mut Solver<D>, time: f64) {
    while solver.clock.time < time {
        solver.step(time, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Collective. Sums over particles: mass, centre of mass, `Σ m |v|` and angular momentum of points, z.
fn sums<const D: usize>(comm: &Comm, solver: &Solver<D>) -> (f64, [f64; D], f64, f64) {
    let mut sums = vec![ExactSum::new(); 3 + D];
    for chunk in &solver.chunks {
        for p in 0..chunk.len() {
            let (m, x) = (chunk.column(Layout::<D>::MASS)[p], chunk.position(p));
            let v: [f64; D] = std::array::from_fn(|k| chunk.column(Layout::<D>::VELOCITY + k)[p]);
            sums[0].add(m);
            sums[1].add(m * v.iter().map(|v| v * v).sum::<f64>().sqrt());
            sums[2].add(m * (x[0] * v[1] - x[1] * v[0]));
            (0..D).for_each(|k| sums[3 + k].add(m * x[k]));
        }
    }
    ExactSum::sum_over_ranks(comm, &mut sums);
    let mass = sums[0].to_f64();
    (mass, std::array::from_fn(|k| sums[3 + k].to_f64() / mass), sums[1].to_f64(), sums[2].to_f64())
}

fn distance<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    (0..N).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f64>().sqrt()
}

/// Spins a body with APIC; linear and angular momentum and the path of the centre are exact to round-off.
fn spins<const D: usize>(comm: &Comm, text: &str, steps: u64)
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let mut solver = solver::<D>(comm, text);
    let levels: Vec<u8> = solver.forest.leaves().iter().map(|leaf| leaf.level).collect();
    assert!(comm.size() > 1 || (0..3).all(|level| levels.contains(&level)));
    let (mass, centre, scale, _) = sums(comm, &solver);
    let before = solver.grid_totals().unwrap_or_else(|error| panic!("{error}"));
    let energy = solver.particle_totals().kinetic;
    assert!((before.mass - mass).abs() < 1e-14 * mass);
    advance(&mut solver, steps);
    let after = solver.grid_totals().unwrap_or_else(|error| panic!("{error}"));
    let momentum = distance(after.momentum, before.momentum) / scale;
    let angular = distance(after.angular_momentum, before.angular_momentum)
        / distance(before.angular_momentum, [0.0; 3]);
    let time = solver.clock.time;
    let expected: [f64; D] = std::array::from_fn(|k| centre[k] + time * before.momentum[k] / mass);
    let moved = distance(sums(comm, &solver).1, expected);
    let turns = time / std::f64::consts::TAU;
    let loss = 1.0 - solver.particle_totals().kinetic / energy;
    if comm.rank() == 0 {
        println!(
            "{D}D, {steps} steps, {turns:.2} turns: momentum {momentum:.1e}, angular momentum {angular:.1e}, \
             centre {moved:.1e} m, kinetic energy lost {loss:.2e}"
        );
    }
    assert!((after.mass - mass).abs() < 1e-14 * mass);
    assert!(momentum < 1e-12 && angular < 1e-12, "{momentum:e} {angular:e}");
    assert!(moved < 1e-10, "{moved:e}");
}

#[test]
fn square_keeps_its_momenta() {
    on_ranks("square_keeps_its_momenta", &[1, 2], |comm| spins::<2>(comm, SQUARE, steps(comm, 10_000)));
}

#[test]
fn cube_keeps_its_momenta() {
    on_ranks("cube_keeps_its_momenta", &[1, 2], |comm| spins::<3>(comm, CUBE, steps(comm, 200)));
}

/// All transfers conserve linear momentum, whatever the stress.
#[test]
fn every_transfer_keeps_linear_momentum() {
    on_ranks("every_transfer_keeps_linear_momentum", &[1, 2], |comm| {
        for transfer in
            ["'apic'", "'tpic'", "'flip'\nflip = 1.0", "'flip'\nflip = 0.0", "'xpic'\nxpic_order = 3"]
        {
            let text = with(SQUARE, &format!("transfer = {transfer}"));
            let mut solver = solver::<2>(comm, &text);
            let (mass, centre, scale, _) = sums(comm, &solver);
            advance(&mut solver, steps(comm, 500));
            let momentum = distance(solver.particle_totals().momentum, [0.0; 3]);
            assert!(momentum < 1e-12 * scale, "{transfer}: {momentum:e} of {scale:e}");
            let moved = distance(sums(comm, &solver).1, centre);
            assert!(moved < 1e-11, "{transfer}: centre moved by {moved:e} m");
            assert_eq!(sums(comm, &solver).0, mass);
        }
    });
}

/// FLIP keeps the angular momentum of points up to the lumping of mass, `Σ_p m w (x_p - x_i) ≠ 0` at free
/// surfaces: its drift falls with the cells and hardly depends on the step. PIC loses angular momentum in no
/// time, XPIC lies between.
#[test]
fn angular_momentum_of_flip_falls_with_the_cells() {
    on_ranks("angular_momentum_of_flip_falls_with_the_cells", &[1], |comm| {
        let drift = |transfer: &str, edge: &str, dt: f64| {
            let text = with(SQUARE, transfer).replace("dt_max = 1e3", &format!("dt_max = {dt}"));
            let mut solver = solver::<2>(comm, &text.replace("root_edge = 1", edge));
            let before = sums(comm, &solver).3;
            advance_to(&mut solver, 0.25);
            (sums(comm, &solver).3 - before).abs() / before
        };
        let flip = ["root_edge = 0.5", "root_edge = 0.25"];
        let flip = flip.map(|edge| drift("transfer = 'flip'\nflip = 1.0", edge, 2e-3));
        let half_step = drift("transfer = 'flip'\nflip = 1.0", "root_edge = 0.5", 1e-3);
        let pic = drift("transfer = 'flip'\nflip = 0.0", "root_edge = 1", 4e-3);
        let xpic = drift("transfer = 'xpic'\nxpic_order = 5", "root_edge = 1", 4e-3);
        println!("drift in 0.25 s: FLIP {flip:?}, half the step {half_step}, PIC {pic}, XPIC(5) {xpic}");
        assert!(flip[0] < 2e-2 && flip[1] < 0.35 * flip[0], "{flip:?}");
        // Not of the order of the step.
        assert!((half_step / flip[0] - 1.0).abs() < 0.2, "{half_step} {flip:?}");
        assert!(pic > 0.1, "{pic}");
        assert!(xpic < 0.5 * pic, "{xpic} {pic}");
    });
}

/// XPIC of order 1 is PIC.
#[test]
fn first_order_xpic_is_pic() {
    on_ranks("first_order_xpic_is_pic", &[1], |comm| {
        let end = |transfer: &str| {
            let mut solver = solver::<2>(comm, &with(SQUARE, transfer));
            advance(&mut solver, 50);
            solver
        };
        let (xpic, pic) = (end("transfer = 'xpic'\nxpic_order = 1"), end("transfer = 'flip'\nflip = 0.0"));
        for (a, b) in xpic.chunks.iter().zip(&pic.chunks) {
            assert_eq!(a.ids(), b.ids());
            for column in 0..Layout::<2>::REALS {
                for (a, b) in a.column(column).iter().zip(b.column(column)) {
                    // Stress is of the order of 1e4 Pa.
                    assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "column {column}: {a} {b}");
                }
            }
        }
    });
}

/// The bits of all particles do not depend on the number of ranks, with sweeps of increments as without.
#[test]
fn bits_do_not_depend_on_ranks() {
    on_ranks("bits_do_not_depend_on_ranks", &[1, 2, 3], |comm| {
        for transfer in
            ["'apic'", "'tpic'", "'flip'", "'xpic'\nxpic_order = 3", "'flip'\ntied_surfaces = true"]
        {
            let mut solver = solver::<2>(comm, &with(SQUARE, &format!("transfer = {transfer}")));
            advance(&mut solver, 30);
            let mut sum = [0u64];
            for chunk in &solver.chunks {
                for p in 0..chunk.len() {
                    let mut hash = chunk.ids()[p];
                    for column in 0..Layout::<2>::REALS {
                        let bits = chunk.column(column)[p].to_bits();
                        hash = (hash ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
                    }
                    // Shorter, so that the sum over all particles does not overflow.
                    sum[0] += hash >> 16;
                }
            }
            comm.sum_u64(&mut sum);
            if comm.rank() == 0 {
                println!("same: {:x} ", sum[0]);
            }
        }
    });
}

/// A rigid translation stays one: no velocity and no stress but round-off, for every transfer.
#[test]
fn translation_stays_rigid() {
    on_ranks("translation_stays_rigid", &[1, 2], |comm| {
        for transfer in ["'apic'", "'tpic'", "'flip'\nflip = 1.0", "'xpic'\nxpic_order = 2"] {
            let mut solver = solver::<2>(comm, &with(FLYING, &format!("transfer = {transfer}")));
            let start = sums(comm, &solver).1;
            advance(&mut solver, steps(comm, 1000));
            let mut worst: f64 = 0.0;
            let mut stress: f64 = 0.0;
            for chunk in &solver.chunks {
                for (axis, expected) in [1.0, 0.125].into_iter().enumerate() {
                    let column = chunk.column(Layout::<2>::VELOCITY + axis);
                    worst = column.iter().fold(worst, |worst, v| worst.max((v - expected).abs()));
                }
                for c in 0..Layout::<2>::SYMMETRIC {
                    let column = chunk.column(Layout::<2>::STRESS + c);
                    stress = column.iter().fold(stress, |stress, s| stress.max(s.abs()));
                }
            }
            let worst = comm.max_f64(worst);
            let time = solver.clock.time;
            let end = sums(comm, &solver).1;
            if comm.rank() == 0 {
                println!("{transfer}: {time} s, velocity off by {worst:.1e}, stress {stress:.1e} Pa");
            }
            assert!(comm.size() > 1 || time > 2.4, "{time}");
            assert!(worst < 1e-12, "{transfer}: {worst:e}");
            assert!(distance(end, [start[0] + time, start[1] + 0.125 * time]) < 1e-11);
        }
    });
}

/// A solver whose particles move with `a x + b`, affine state included.
fn affine<const D: usize>(comm: &Comm, text: &str, a: [[f64; D]; D], b: [f64; D]) -> Solver<D>
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let problem = problem::<D>(text);
    let mut solver = setup::solver(comm, &problem).unwrap_or_else(|error| panic!("{error}"));
    let mut chunks = std::mem::take(&mut solver.chunks);
    for chunk in &mut chunks {
        for p in 0..chunk.len() {
            let x = chunk.position(p);
            for i in 0..D {
                let v = b[i] + (0..D).map(|k| a[i][k] * x[k]).sum::<f64>();
                chunk.column_mut(Layout::<D>::VELOCITY + i)[p] = v;
                for k in 0..D {
                    chunk.column_mut(Layout::<D>::AFFINE + D * i + k)[p] = a[i][k];
                }
            }
        }
    }
    Solver::new(comm, setup::physics(&problem), solver.forest, chunks, Clock::default())
}

fn reproduces<const D: usize>(comm: &Comm, text: &str)
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let a: [[f64; D]; D] =
        std::array::from_fn(|i| std::array::from_fn(|k| [0.3, -0.7, 0.45, 0.2][(2 * i + 3 * k) % 4]));
    let b: [f64; D] = std::array::from_fn(|i| 0.25 * i as f64 - 0.2);
    let still = text.replace("dt_max = 1e3", "dt_max = 1e-9");
    for transfer in ["'apic'", "'tpic'"] {
        let mut solver = affine(comm, &with(&still, &format!("transfer = {transfer}")), a, b);
        let before: Vec<Chunk<D>> = solver.chunks.clone();
        // The first step strains the body by 1e-9; its stress acts in the next one only.
        advance(&mut solver, 1);
        let (mut velocity, mut gradient): (f64, f64) = (0.0, 0.0);
        for (chunk, before) in solver.chunks.iter().zip(&before) {
            assert_eq!(chunk.ids(), before.ids());
            for p in 0..chunk.len() {
                let x = before.position(p);
                for i in 0..D {
                    let expected = b[i] + (0..D).map(|k| a[i][k] * x[k]).sum::<f64>();
                    velocity = velocity.max((chunk.column(Layout::<D>::VELOCITY + i)[p] - expected).abs());
                    for k in 0..D {
                        let column = Layout::<D>::AFFINE + D * i + k;
                        // With APIC `B = A D`, and D has not changed.
                        let expected = if transfer == "'tpic'" { a[i][k] } else { before.column(column)[p] };
                        gradient = gradient.max((chunk.column(column)[p] - expected).abs());
                    }
                }
            }
        }
        println!("{transfer} {D}D: velocity {velocity:.1e}, affine state {gradient:.1e}");
        assert!(velocity < 1e-13 && gradient < 1e-12, "{transfer}: {velocity:e} {gradient:e}");
    }
}

#[test]
fn affine_fields_are_reproduced() {
    on_ranks("affine_fields_are_reproduced", &[1, 2], |comm| {
        reproduces::<2>(comm, SQUARE);
        reproduces::<3>(comm, CUBE);
    });
}

/// A job whose surface nodes are tied, with a shape that ends inside cells.
fn tied(text: &str, shape: &str) -> String {
    let start = text.find("\nshape = ").expect("the shape of the body") + 1;
    let end = start + text[start..].find('\n').expect("a line");
    let text = format!("{}shape = {{ {shape} }}{}", &text[..start], &text[end..]);
    text.replace("[numerics]", "[numerics]\ntied_surfaces = true")
}

const TURNED: &str = "kind = \"polygon\", points = [[1.07, 1.33], [1.69, 1.04], [1.98, 1.66], [1.36, 1.95]]";
const BALL: &str = "kind = \"sphere\", centre = [1.51, 1.52, 1.49], radius = 0.42";

/// Ties of surface nodes change neither momenta nor affine motion.
#[test]
fn ties_keep_momenta_and_affine_fields() {
    on_ranks("ties_keep_momenta_and_affine_fields", &[1, 2], |comm| {
        spins::<2>(comm, &tied(SQUARE, TURNED), steps(comm, 2000));
        spins::<3>(comm, &tied(CUBE, BALL), steps(comm, 100));
        reproduces::<2>(comm, &tied(SQUARE, TURNED));
        reproduces::<3>(comm, &tied(CUBE, BALL));
    });
}

/// The option of the job arrives.
#[test]
fn transfers_of_jobs() {
    let transfer = |text: &str| problem::<2>(&with(SQUARE, text)).transfer;
    assert_eq!(transfer("transfer = 'flip'"), Transfer::Flip { blend: 0.99 });
    assert_eq!(transfer("transfer = 'xpic'"), Transfer::Xpic { order: 2 });
    assert_eq!(transfer("transfer = 'xpic'\nxpic_order = 4"), Transfer::Xpic { order: 4 });
}
