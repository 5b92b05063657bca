//! Cost of the fixed order of node sums: `cargo bench --bench ordered_sums`.
//!
//! The ordered sums of the solver list for every block the arenas that reach it and add them in that order.
//! Here they compete with sums without any order, in which bins add their arenas to the nodes as they come:
//! on one thread directly, on several by atomic additions or into a copy of the nodes per thread. All start
//! from the same arenas, in one run; medians of interleaved rounds are compared with the time of a whole
//! step.
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use agimp::grid::arenas::Arenas;
use agimp::grid::arenas::arena_schedule;
use agimp::grid::mask::{block_nodes, offset_count};
use agimp::grid::plan::NO_BLOCK;
use agimp::grid::{GridPlan, NodeFields};
use agimp::job::{self, AnyProblem};
use agimp::setup;
use agimp::solver::Requests;
use partition::comm::World;
use rayon::prelude::*;

const ROUNDS: usize = 15;
const D: usize = 3;

fn main() {
    let world = World::init().expect("MPI starts");
    let text = include_str!("../studies/scaling/block.toml");
    let words = [
        ("SIZE_X", "1.0"),
        ("SIZE_Y", "1.0"),
        ("LEVEL", "3"),
        ("FINER", "4"),
        ("PER_CELL", "2"),
        ("BOXES", "volume"),
    ];
    let text = words.iter().fold(text.to_owned(), |text, (word, value)| text.replace(word, value));
    let text = text.replace("END", "1").replace("EVERY", "1000");
    let AnyProblem::Three(problem) = job::parse(&text, "block.toml".as_ref()).expect("a good job") else {
        panic!("a job in space")
    };
    // Whole steps run on one thread: their time is the work in them.
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    alone.build_global().expect("one thread");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for threads in [1, cores] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let mut solver = setup::solver(world.comm(), &problem).expect("a first state");
        let particles: usize = solver.chunks.iter().map(|chunk| chunk.len()).sum();
        solver.keep_arenas();
        let mut times: [Vec<f64>; 4] = Default::default();
        for _ in 0..ROUNDS {
            times[0].push(timed(|| solver.step(1.0, Requests::default()).expect("a step")));
            let grid = solver.grid();
            let (plan, arenas) = (&grid.plan, grid.arenas());
            let mut ordered = NodeFields::new(plan);
            let mut plain = vec![0.0; 4 * plan.blocks.len() * block_nodes(D)];
            pool.install(|| {
                // All own bins are in one wave behind the first, which is empty.
                let wave = arena_schedule::FIRST + 1;
                ordered.sum(plan, arenas, wave);
                times[1].push(timed(|| ordered.sum(plan, arenas, wave)));
                if threads == 1 {
                    times[2].push(timed(|| add_directly(plan, arenas, &mut plain)));
                } else {
                    let shared: Vec<AtomicU64> = plain.iter().map(|_| AtomicU64::new(0)).collect();
                    times[2].push(timed(|| add_atomically(plan, arenas, &shared)));
                    times[3].push(timed(|| add_into_copies(plan, arenas, &mut plain, threads)));
                }
            });
        }
        let [step, ordered, first, second] = times.map(median);
        println!("{threads} threads, {particles} particles: step on one thread {:.1} ms", 1e3 * step);
        println!("  ordered sums     {:7.3} ms", 1e3 * ordered);
        let unordered = if threads == 1 {
            println!("  direct           {:7.3} ms", 1e3 * first);
            first
        } else {
            println!("  atomic           {:7.3} ms", 1e3 * first);
            println!("  copy per thread  {:7.3} ms", 1e3 * second);
            first.min(second)
        };
        let cost = (ordered - unordered) * threads as f64 / step;
        println!("  cost of the order {:6.2} % of the step's work", 100.0 * cost);
    }
}

fn timed<R>(work: impl FnOnce() -> R) -> f64 {
    let start = Instant::now();
    std::hint::black_box(work());
    start.elapsed().as_secs_f64()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Calls `add(node, row)` for every node that the particles of a bin touch.
fn each_node(plan: &GridPlan<D>, arenas: &Arenas<D>, bin: usize, mut add: impl FnMut(usize, &[f64; 4])) {
    let Some(arena) = arenas.get(bin as u32) else { return };
    for (towards, &block) in plan.bins[bin].around.iter().enumerate().take(offset_count(D)) {
        if block == NO_BLOCK || plan.blocks[block as usize].needs_sum == 0 {
            continue;
        }
        let Some(shared) = arena.window.shared(towards) else { continue };
        shared.for_each_run(|run| {
            let first = block as usize * block_nodes(D) + run.block;
            for (node, row) in (first..).zip(&arena.rows[run.arena..][..run.len]) {
                add(node, &row.0);
            }
        });
    }
}

fn add_directly(plan: &GridPlan<D>, arenas: &Arenas<D>, rows: &mut [f64]) {
    rows.fill(0.0);
    for bin in 0..plan.bins.len() {
        each_node(plan, arenas, bin, |node, row| {
            for (to, from) in rows[4 * node..][..4].iter_mut().zip(row) {
                *to += from;
            }
        });
    }
}

fn add_atomically(plan: &GridPlan<D>, arenas: &Arenas<D>, rows: &[AtomicU64]) {
    rows.par_chunks(4096).for_each(|rows| rows.iter().for_each(|row| row.store(0, Ordering::Relaxed)));
    (0..plan.bins.len()).into_par_iter().with_min_len(16).for_each(|bin| {
        each_node(plan, arenas, bin, |node, row| {
            for (to, from) in rows[4 * node..][..4].iter().zip(row) {
                let mut old = to.load(Ordering::Relaxed);
                loop {
                    let new = (f64::from_bits(old) + from).to_bits();
                    match to.compare_exchange_weak(old, new, Ordering::Relaxed, Ordering::Relaxed) {
                        Ok(_) => break,
                        Err(found) => old = found,
                    }
                }
            }
        });
    });
}

fn add_into_copies(plan: &GridPlan<D>, arenas: &Arenas<D>, rows: &mut [f64], threads: usize) {
    let share = plan.bins.len().div_ceil(threads);
    let copies: Vec<Vec<f64>> = (0..threads)
        .into_par_iter()
        .map(|thread| {
            let mut copy = vec![0.0; rows.len()];
            for bin in thread * share..((thread + 1) * share).min(plan.bins.len()) {
                each_node(plan, arenas, bin, |node, row| {
                    for (to, from) in copy[4 * node..][..4].iter_mut().zip(row) {
                        *to += from;
                    }
                });
            }
            copy
        })
        .collect();
    rows.par_chunks_mut(4096).enumerate().for_each(|(part, rows)| {
        for (i, row) in rows.iter_mut().enumerate() {
            *row = copies.iter().map(|copy| copy[4096 * part + i]).sum();
        }
    });
}
