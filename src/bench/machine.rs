//! Limits of the machine: memory bandwidth and arithmetic of one core, measured in place.
use std::hint::black_box;
use std::time::{Duration, Instant};

use crate::simd::{LANES, Lanes, Vector};

/// Limits of one core.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Machine {
    /// Bytes per second of `a = b + s c` over arrays far larger than the caches, 24 bytes per element (reads
    /// of `a` before it is overwritten are not counted).
    pub triad: f64,
    /// Operations per second of fused multiply-adds (two each) in registers, with the vectors that this build
    /// uses.
    pub fused: f64,
}

impl Machine {
    /// Measures, best of several repeats; takes about a second.
    pub fn measure() -> Self {
        Self { triad: triad(), fused: fused() }
    }
}

fn triad() -> f64 {
    const LEN: usize = 1 << 23;
    let (mut a, b, c) = (vec![0.0_f64; LEN], vec![1.5_f64; LEN], vec![0.25_f64; LEN]);
    let best = best_of(7, || {
        let scale = black_box(3.0);
        for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
            *a = scale * c + b;
        }
        black_box(&mut a);
    });
    24.0 * LEN as f64 / best.as_secs_f64()
}

fn fused() -> f64 {
    const ROUNDS: usize = 1 << 21;
    /// Independent chains: latency times units, in registers.
    const CHAINS: usize = 5;
    let best = best_of(7, || {
        let factor = Lanes::splat(black_box(0.999_999));
        let mut sums = [Lanes::splat(black_box(1.0)); CHAINS];
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = sum.mul_add(factor, factor);
            }
        }
        black_box(sums);
    });
    (2 * LANES * CHAINS * ROUNDS) as f64 / best.as_secs_f64()
}

fn best_of(repeats: u32, mut work: impl FnMut()) -> Duration {
    let once = |_| {
        let start = Instant::now();
        work();
        start.elapsed()
    };
    (0..repeats).map(once).min().unwrap_or_default()
}
