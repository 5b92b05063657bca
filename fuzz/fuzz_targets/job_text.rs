//! The bytes of a job file, through all that `agimp check` does before it needs MPI.
#![no_main]
use agimp::job::{self, AnyProblem, Settings};
use agimp::setup::estimate::estimate;
use agimp::setup::warnings::warnings;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    match job::from_bytes(bytes.to_vec(), "job.toml".as_ref(), &Settings::default()) {
        Ok(AnyProblem::Two(problem)) => {
            if let Ok(estimate) = estimate(&problem) {
                warnings(&problem, estimate.steps);
            }
        }
        Ok(AnyProblem::Three(problem)) => {
            if let Ok(estimate) = estimate(&problem) {
                warnings(&problem, estimate.steps);
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
