//! `agimp bench`: speed of whole steps on built-in jobs.
use std::ffi::OsString;
use std::io::Write;

use partition::comm::{Comm, World};

use super::Failure;
use super::run::start_threads;
use super::shared::message::together;
use super::shared::ranks;
use agimp::bench::jobs::{BenchJob, JOBS};
use agimp::bench::machine::Machine;
use agimp::bench::{Extent, Figures, measure};
use agimp::text::count;

/// Arguments of `agimp bench`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Approximate number of particles of each job.
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1000..))]
    pub particles: u64,
    /// Steps of each repeat.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    pub steps: u64,
    /// Repeats; the table shows medians.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u64).range(1..))]
    pub repeats: u64,
    /// Only jobs whose name contains this; may be given several times.
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Threads of each rank.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    pub threads: u16,
    /// Print JSON, one object per line: the machine, then each job.
    #[arg(long)]
    pub json: bool,
    /// Print the file of a job and exit.
    #[arg(long, value_name = "NAME")]
    pub show: Option<String>,
}

/// Carries out `agimp bench`.
///
/// # Errors
/// No job of that name, or a run failed.
pub(super) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let names = || JOBS.map(|job| job.name).join(", ");
    if let Some(name) = &arguments.show {
        let job = JOBS.iter().find(|job| job.name == *name);
        let job = job
            .ok_or_else(|| Failure::Usage(format!("--show: found `{name}`; expected one of {}", names())))?;
        write!(std::io::stdout(), "{}", job.text(arguments.particles, arguments.steps, "out/bench"))?;
        return Ok(());
    }
    let wanted = |job: &&BenchJob| {
        arguments.only.is_empty() || arguments.only.iter().any(|name| job.name.contains(name.as_str()))
    };
    let jobs: Vec<&BenchJob> = JOBS.iter().filter(wanted).collect();
    if jobs.is_empty() {
        let found = arguments.only.join(", ");
        return Err(Failure::Usage(format!("--only: found {found}; expected part of one of {}", names())));
    }
    let world = World::init().map_err(|error| Failure::Run(error.to_string()))?;
    let comm = world.comm();
    let words: Vec<OsString> = std::env::args_os().skip(1).collect();
    ranks::same_command(comm, &words.iter().map(OsString::as_os_str).collect::<Vec<_>>())?;
    together(comm, start_threads(comm, Some(arguments.threads)))?;
    let directory = std::env::temp_dir().join(format!("agimp-bench-{}", std::process::id()));
    let made = if comm.rank() == 0 { std::fs::create_dir_all(&directory) } else { Ok(()) };
    let made = made.map_err(|error| format!("cannot create {}: {error}", directory.display()));
    let done = comm.agree(made).map_err(|error| Failure::Run(error.to_string())).and_then(|()| {
        let extent =
            Extent { particles: arguments.particles, steps: arguments.steps, repeats: arguments.repeats };
        measure_all(comm, &jobs, extent, &directory, arguments.json)
    });
    if comm.rank() == 0 {
        // Only telemetry of these runs; if it cannot be removed, the system does so in time.
        let _ = std::fs::remove_dir_all(&directory);
    }
    together(comm, done)
}

fn measure_all(
    comm: &Comm,
    jobs: &[&BenchJob],
    extent: Extent,
    directory: &std::path::Path,
    json: bool,
) -> Result<(), Failure> {
    let machine = Machine::measure();
    let out = &mut std::io::stdout();
    if comm.rank() == 0 {
        if json {
            writeln!(out, "{}", as_json(&machine)?)?;
        } else {
            let (triad, fused) = (machine.triad * 1e-9, machine.fused * 1e-9);
            writeln!(out, "one core: triad {triad:.1} GB/s, fused multiply-add {fused:.1} GFLOP/s")?;
            writeln!(out, "{} repeats of {} steps; medians", extent.repeats, extent.steps)?;
            writeln!(out)?;
            writeln!(
                out,
                "{:15} {:>10} {:>6} {:>6} {:>6} {:>7} {:>6} {:>6} {:>8} {:>7} {:>9} {:>5} {:>5} {:>6} {:>5} {:>6} {:>5}",
                "job",
                "particles",
                "levels",
                "M/s",
                "best",
                "scatter",
                "gather",
                "sort",
                "exchange",
                "sums",
                "migrate",
                "rest",
                "flow",
                "memory",
                "band",
                "fma",
                "core"
            )?;
        }
    }
    for job in jobs {
        let figures =
            measure(comm, job, extent, directory, machine).map_err(|e| Failure::Run(e.to_string()))?;
        let Some(figures) = figures else { continue };
        if json {
            writeln!(out, "{}", as_json(&figures)?)?
        } else {
            row(out, &figures)?
        }
        out.flush()?;
    }
    if comm.rank() == 0 && !json {
        writeln!(out)?;
        writeln!(out, "M/s      million particle-steps per second and core, history and telemetry included")?;
        writeln!(out, "scatter to migrate   ns per particle and step; sums: node sums, update, level jumps")?;
        writeln!(
            out,
            "rest     share of a step outside scatter and gather;  flow: share of the particles that flowed"
        )?;
        writeln!(out, "memory   resident bytes per particle")?;
        writeln!(
            out,
            "band     particle columns alone, of the triad's bandwidth;  fma: transfers alone, of the peak"
        )?;
        writeln!(
            out,
            "core     share of the wall time that this process had the core; below 100 %, others used it"
        )?;
    }
    Ok(())
}

fn as_json(value: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string(value).map_err(|error| Failure::Run(error.to_string()))
}

fn row(out: &mut impl Write, figures: &Figures) -> std::io::Result<()> {
    let time = |names: &[&str]| -> f64 {
        figures.phases.iter().filter(|(name, _)| names.contains(name)).map(|(_, time)| time).sum()
    };
    writeln!(
        out,
        "{:15} {:>10} {:>6} {:>6.2} {:>6.2} {:>7.1} {:>6.1} {:>6.1} {:>8.1} {:>7.1} {:>9.1} {:>4.0}% {:>4.0}% {:>6.0} {:>4.0}% {:>5.1}% {:>4.0}%",
        figures.job,
        count(figures.particles),
        figures.levels,
        figures.rate * 1e-6,
        figures.best_rate * 1e-6,
        time(&["scatter"]),
        time(&["gather"]),
        time(&["sort"]),
        time(&["exchange", "reduce"]),
        time(&["sum", "nodes"]),
        time(&["migrate"]),
        100.0 * figures.rest,
        100.0 * figures.flowed,
        figures.memory,
        100.0 * figures.bandwidth,
        100.0 * figures.fused,
        100.0 * figures.core_share
    )
}
