//! The `agimp` program: maps the result of a command to an exit code.
use agimp::run::stop::StopRequest;
use agimp_cli::{Arguments, execute, unusable};
use clap::Parser as _;
use partition::comm::is_launched;
use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: agimp::memory::Allocator = agimp::memory::Allocator;

fn main() -> ExitCode {
    let missing = agimp::simd::missing();
    if missing.is_empty() {
        run()
    } else {
        eprintln!(
            "agimp: this processor lacks {missing}; this program is built for x86-64-v3 (AVX2, FMA, BMI2: 2013 and later). \
             Use another machine, or build it from source with RUSTFLAGS='-C target-cpu=native'"
        );
        ExitCode::FAILURE
    }
}

/// The program, on a processor that has its instructions; a function of its own, since its first lines may
/// use them.
#[inline(never)]
fn run() -> ExitCode {
    // First of all, since a batch queue may send its signal while a run starts. An error is reported when the
    // run begins.
    if std::env::args_os().nth(1).is_some_and(|command| command == "run" || command == "sweep") {
        let _ = StopRequest::listen();
    }
    agimp::memory::return_large_blocks();
    // Without it such a write ends the program silently. `agimp run` does so on ranks once MPI has started:
    // until then the limit may keep `mpirun` from starting it, and the ranks would wait for ever.
    if !is_launched() {
        let _ = agimp::io::cause::tell_size_limits();
    }
    agimp::io::hdf5_file::prepare();
    let done = Arguments::try_parse().map_err(unusable).and_then(|arguments| execute(arguments.command));
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.report();
            ExitCode::from(failure.exit_code())
        }
    }
}
