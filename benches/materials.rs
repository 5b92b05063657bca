//! Nanoseconds per particle of each constitutive model, elastic and flowing:
//! `cargo bench --bench materials [-- FILTER]`.
//!
//! One row for each example of each model. Every batch starts from the same trial state, which stays in the
//! cache, so this is the law alone. Particles of a batch have different principal directions. The median over
//! the repeats counts.
#[path = "../tests/common/random.rs"]
#[allow(dead_code, reason = "shared with tests, which use all of it")]
mod random;

use random::Random;
use std::hint::black_box;
use std::time::{Duration, Instant};

use agimp::material::{Material, Parameters, State, Step};
use agimp::simd::{LANES, Lanes, Vector};

/// Batches of one repeat, each with a trial state of its own.
const BATCHES: usize = 24;
/// Sweeps over the batches in one repeat.
const SWEEPS: usize = 200;
/// Repeats.
const REPEATS: usize = 41;
/// Sizes of strain that are tried for a state that flows.
const SIZES: [f64; 5] = [0.01, 0.03, 0.1, 0.2, 0.4];

/// Trial states: elastic tensors with a compression and shear of random direction.
fn trials(material: &dyn Material, compression: f64, shear: f64) -> Vec<State> {
    let mut random = Random::new(1);
    (0..BATCHES)
        .map(|_| {
            let mut tensor = [[0.0; LANES]; 6];
            for lane in 0..LANES {
                let change: [f64; 6] = std::array::from_fn(|_| random.between(-shear, shear));
                let mean = (change[0] + change[1] + change[2]) / 3.0;
                for c in 0..6 {
                    tensor[c][lane] = change[c] + if c < 3 { 1.0 - compression - mean } else { 0.0 };
                }
            }
            let mut state = State::new(tensor.map(Lanes::new));
            state.history = material.initial_history().map(Lanes::splat);
            state
        })
        .collect()
}

/// Lanes of a batch that flow: they do plastic work, or their elastic tensor changes.
fn flowing(material: &dyn Material, trial: &State, step: &Step) -> usize {
    let mut state = *trial;
    material.update(&mut state, step);
    let at = |value: &Lanes, lane: usize| value.to_array()[lane];
    let changes = |lane: usize| (0..6).any(|c| at(&state.elastic[c], lane) != at(&trial.elastic[c], lane));
    (0..LANES).filter(|&lane| at(&state.work, lane) > 0.0 || changes(lane)).count()
}

/// Nanoseconds per particle: median over the repeats.
fn time(material: &dyn Material, trials: &[State], step: &Step) -> f64 {
    let mut states = trials.to_vec();
    let mut times: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let mut spent = Duration::ZERO;
            for _ in 0..SWEEPS {
                // Not timed: states that are half in flight to the cache would be waited for.
                states.copy_from_slice(trials);
                black_box(&mut states);
                let start = Instant::now();
                for state in &mut states {
                    material.update(state, step);
                }
                black_box(&mut states);
                spent += start.elapsed();
            }
            spent.as_secs_f64() * 1e9 / (SWEEPS * BATCHES * LANES) as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[REPEATS / 2]
}

/// The first trial states all of which flow.
fn all_flow(material: &dyn Material, step: &Step) -> Option<Vec<State>> {
    SIZES.iter().map(|&size| trials(material, 0.2 * size, size)).find(|trials| {
        trials.iter().map(|trial| flowing(material, trial, step)).sum::<usize>() >= BATCHES * LANES * 95 / 100
    })
}

/// Keys of an example that tell it from others: all but the elastic ones.
fn name(example: &str) -> String {
    let own = |key: &&str| !key.starts_with("young") && !key.starts_with("poisson");
    let keys: Vec<&str> = example.split(", ").filter(own).collect();
    keys.join(", ").replace("model = ", "").replace(" = ", " ").replace('\'', "")
}

/// Two cells of the table: time, and the share of particles that flow.
fn cells(material: &dyn Material, trials: &[State], step: &Step) -> String {
    let count: usize = trials.iter().map(|trial| flowing(material, trial, step)).sum();
    format!("{:.1} | {} %", time(material, trials, step), 100 * count / (BATCHES * LANES))
}

fn main() {
    let filter = std::env::args().skip(1).find(|argument| !argument.starts_with('-')).unwrap_or_default();
    let step = Step { dt: 1e-4, cell: 0.01, size: [0.01; LANES], ..Step::rest(false) };
    println!(
        "| model | elastic, ns per particle | of these flow | flowing, ns per particle | of these flow |"
    );
    println!("|---|---|---|---|---|");
    for text in Parameters::examples().into_iter().filter(|text| text.contains(&filter)) {
        let parameters: Parameters = text.parse().expect("examples can be read");
        let material = parameters.build(1000.0);
        let elastic = cells(material.as_ref(), &trials(material.as_ref(), 1e-3, 5e-5), &step);
        let flow = match material.is_plastic() {
            true => all_flow(material.as_ref(), &step),
            false => None,
        };
        let flow = flow.map_or(" | ".to_owned(), |trials| cells(material.as_ref(), &trials, &step));
        println!("| {} | {elastic} | {flow} |", name(text));
    }
}
