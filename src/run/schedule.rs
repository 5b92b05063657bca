//! When files are due.
use std::time::Instant;

use crate::job::Problem;
use crate::job::problem::CheckpointSetup;

/// Times of outputs and checkpoints. Steps are never shortened to hit them, so that the state of a run does
/// not depend on what is written of it: a file is due after the first step that reaches its time.
#[derive(Clone, Debug)]
pub struct Schedule {
    output_every: Option<f64>,
    /// Simulated time up to which outputs are done, s.
    looked_until: f64,
    checkpoint: CheckpointSetup,
    next_checkpoint: f64,
    last_checkpoint: Instant,
}

impl Schedule {
    /// Not collective. The schedule of a job at simulated `time`.
    pub fn new<const D: usize>(problem: &Problem<D>, time: f64) -> Self {
        let mut schedule = Self {
            output_every: problem.output.every,
            looked_until: time,
            checkpoint: problem.checkpoint,
            next_checkpoint: f64::INFINITY,
            last_checkpoint: Instant::now(),
        };
        schedule.checkpoint_written(time);
        schedule
    }

    /// Whether an output has become due since the last call.
    pub fn output_due(&mut self, time: f64) -> bool {
        let before = std::mem::replace(&mut self.looked_until, time);
        time >= self.next_output(before)
    }

    /// When the next output after this time is due, s; infinite if none ever is.
    pub fn next_output(&self, time: f64) -> f64 {
        self.output_every.map_or(f64::INFINITY, |every| {
            // A product decides, not a rounded quotient.
            let mut next = (time / every).floor();
            while next * every <= time {
                next += 1.0;
            }
            next * every
        })
    }

    /// Whether a checkpoint is due by steps or by simulated time.
    pub fn checkpoint_due(&self, step: u64, time: f64) -> bool {
        self.checkpoint.every_steps.is_some_and(|every| step.is_multiple_of(every))
            || time >= self.next_checkpoint
    }

    /// Whether a checkpoint is due by this rank's clock; ranks have to agree on it.
    pub fn wall_due(&self) -> bool {
        self.checkpoint
            .every_wall_minutes
            .is_some_and(|minutes| self.last_checkpoint.elapsed().as_secs_f64() >= 60.0 * minutes)
    }

    /// A checkpoint was written at simulated `time`.
    pub fn checkpoint_written(&mut self, time: f64) {
        self.last_checkpoint = Instant::now();
        if let Some(every) = self.checkpoint.every_time {
            self.next_checkpoint = ((time / every).floor() + 1.0) * every;
        }
    }
}
