//! The `agimp` program: maps what a command returns to an exit code.
use agimp::cli::{Arguments, execute};
use clap::Parser as _;
use std::process::ExitCode;

fn main() -> ExitCode {
    agimp::memory::return_large_blocks();
    match execute(Arguments::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.tell();
            ExitCode::from(failure.exit_code())
        }
    }
}
