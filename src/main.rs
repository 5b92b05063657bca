//! The `agimp` program: maps what a command returns to an exit code.
use agimp::cli::{Arguments, execute, unusable};
use clap::Parser as _;
use std::process::ExitCode;

fn main() -> ExitCode {
    agimp::memory::return_large_blocks();
    let done = Arguments::try_parse().map_err(unusable).and_then(|arguments| execute(arguments.command));
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.tell();
            ExitCode::from(failure.exit_code())
        }
    }
}
