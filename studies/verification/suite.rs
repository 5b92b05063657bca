//! The verification suite: runs problems through the program and, for what needs its inside, in this process; compares with references; writes a page.
//!
//! `studies/verification/run` builds and starts it.
use std::path::PathBuf;
use std::process::{Command, ExitCode};
use std::sync::Mutex;
use std::time::Instant;

use agimp::job::{AnyProblem, Problem, parse};
use partition::comm::{Comm, World};

mod advect;
mod lines;
mod page;
mod plot;
mod problems;
mod runs;
mod spin;
#[path = "../../tests/common/spinning.rs"]
mod spinning;
mod wave;

use runs::{Effort, Runs};

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

/// A section of the page that is computed in this process.
type Section = fn(&Comm, &mut page::Page);

/// The page of the documentation.
const PAGE: &str = "docs/verification.md";

/// Sections of more than a tenth of the suite's time: started first, so that all end together.
const LONG: [&str; 3] = ["collapse", "taylor", "rings"];

/// Sections whose results are processor times: they run alone, after all others.
const TIMED: [&str; 2] = ["cost", "cost_of_rings"];

/// What is asked for.
struct Arguments {
    effort: Effort,
    only: Vec<String>,
    /// Settings `KEY=VALUE` that all runs get beside their own, for trials.
    set: Vec<String>,
    page: PathBuf,
    /// How many sections run at a time.
    jobs: usize,
}

fn arguments() -> Arguments {
    let (only, set) = Default::default();
    let mut found = Arguments { effort: Effort::Full, only, set, page: PathBuf::from(PAGE), jobs: 1 };
    let mut all = std::env::args().skip(1);
    while let Some(argument) = all.next() {
        match argument.as_str() {
            "--quick" => found.effort = Effort::Quick,
            "--full" => found.effort = Effort::Full,
            "--only" => found.only.extend(all.next()),
            "--set" => found.set.extend(all.next()),
            "--page" => found.page = all.next().unwrap_or_default().into(),
            "--jobs" => found.jobs = checked(all.next().unwrap_or_default().parse()),
            other => panic!(
                "found {other}; expected --quick, --full, --only NAME, --set KEY=VALUE, --page FILE or --jobs N"
            ),
        }
    }
    found
}

/// Runs sections in programs of their own, so many at a time; each writes its section of the page.
/// Returns whether all pass.
fn side_by_side(names: &[&str], arguments: &Arguments, jobs: usize) -> bool {
    let waiting = Mutex::new(names.iter().copied());
    let next = || waiting.lock().ok()?.next();
    let own = checked(std::env::current_exe());
    let effort = if arguments.effort == Effort::Full { "--full" } else { "--quick" };
    let settings = arguments.set.iter().flat_map(|setting| ["--set", setting]);
    let settings: Vec<&str> = settings.chain([effort]).collect();
    let worker = || {
        let sections = std::iter::from_fn(next);
        let all_pass = |passes, name| {
            let mut section = Command::new(&own);
            section.args(["--only", name, "--page"]).arg(&arguments.page).args(&settings);
            checked(section.status()).success() && passes
        };
        sections.fold(true, all_pass)
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..jobs).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().all(|worker| worker.join().unwrap_or(false))
    })
}

fn main() -> ExitCode {
    let arguments = arguments();
    let Arguments { effort, only, set, page: path, jobs } = &arguments;
    checked(rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global());
    let mut page = page::Page::new(path, &checked(std::env::current_dir()));
    // This program lies in `examples/`, beside it the solver.
    let own = checked(std::env::current_exe());
    let built = own.parent().and_then(|folder| folder.parent()).unwrap_or(&own);
    let runs = Runs {
        agimp: std::env::var_os("AGIMP").map_or_else(|| built.join("agimp"), PathBuf::from),
        top: checked(std::env::current_dir()),
        folder: std::env::temp_dir().join(format!("agimp_verification_{}", std::process::id())),
        ranks: 1,
        effort: *effort,
        set: set.clone(),
    };
    let sections: [(&str, Section); 3] =
        [("wave", wave::section), ("advect", advect::section), ("spin", spin::section)];
    let is_wanted = |name: &str| only.is_empty() || only.iter().any(|wanted| wanted == name);
    let names = problems::ALL.iter().map(|(name, _)| *name).chain(sections.map(|(name, _)| name));
    let names: Vec<&str> = names.collect();
    if let Some(other) = only.iter().find(|wanted| !names.contains(&wanted.as_str())) {
        panic!("found --only {other}; expected one of {}", names.join(", "));
    }
    if *jobs > 1 {
        let wanted = names.into_iter().filter(|name| is_wanted(name));
        let (timed, mut others): (Vec<_>, Vec<_>) = wanted.partition(|name| TIMED.contains(name));
        others.sort_by_key(|name| !LONG.contains(name));
        let pass = [side_by_side(&others, &arguments, *jobs), side_by_side(&timed, &arguments, 1)];
        return ExitCode::from(u8::from(pass.contains(&false)));
    }
    let writes = runs.is_full() && runs.set.is_empty();
    // After each section: what has been measured stays when the run is ended.
    let end_section = |name, start: Instant, page: &mut page::Page| {
        println!("{name}: {:.0} s", start.elapsed().as_secs_f64());
        let measured = page.take();
        if writes {
            page.update(&names, name, measured);
        }
    };
    for (name, problem) in problems::ALL.into_iter().filter(|(name, _)| is_wanted(name)) {
        let start = Instant::now();
        problem(&runs, &mut page);
        end_section(name, start, &mut page);
    }
    // After the runs: `mpirun` does not start from a process that is a rank itself.
    let world = checked(World::init());
    for (name, section) in sections.into_iter().filter(|(name, _)| is_wanted(name) && runs.is_full()) {
        let start = Instant::now();
        section(world.comm(), &mut page);
        end_section(name, start, &mut page);
    }
    let _ = std::fs::remove_dir_all(&runs.folder);
    if writes {
        println!("{} written", path.display());
    }
    let (failures, unknown) = page.lines().failures();
    println!(
        "{failures} of {} lines fail, {} of them not analysed: {unknown:?}",
        page.lines().count(),
        unknown.len()
    );
    ExitCode::from(u8::from(!unknown.is_empty()))
}
