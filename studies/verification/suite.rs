//! The verification suite: runs its cases on one core and writes a page of results with plots.
//!
//! `studies/verification/run` builds and starts it.
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use agimp::job::{AnyProblem, Problem, parse};
use partition::comm::{Comm, World};

mod advect;
mod page;
mod plot;
mod spin;
#[path = "../../tests/common/spinning.rs"]
mod spinning;
mod wave;

/// The value, or the end of the suite with the reason.
fn checked<T, E: std::fmt::Display>(result: Result<T, E>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}

/// The problem that a job of this suite states.
fn problem<const D: usize>(text: &str) -> Problem<D>
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let problem =
        parse(text, "verification.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}\n{text}"));
    problem.try_into().unwrap_or_else(|_| panic!("another dimension"))
}

/// A section of the page.
type Section = fn(&Comm, &mut page::Page);

fn main() -> ExitCode {
    let path =
        std::env::args_os().nth(1).map_or_else(|| PathBuf::from("docs/verification.md"), PathBuf::from);
    let only: Vec<String> = std::env::args().skip(2).collect();
    let world = checked(World::init());
    checked(rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global());
    let mut page = page::Page::new(&path);
    let sections: [(&str, Section); 3] =
        [("wave", wave::section), ("advect", advect::section), ("spin", spin::section)];
    for (name, section) in sections {
        if only.is_empty() || only.iter().any(|wanted| wanted == name) {
            let start = Instant::now();
            section(world.comm(), &mut page);
            println!("{name}: {:.0} s", start.elapsed().as_secs_f64());
        }
    }
    let failed = page.finish();
    println!("{} written, {failed} checks failed", path.display());
    ExitCode::from(u8::from(failed > 0))
}
