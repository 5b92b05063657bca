//! Scaling: counts of memory and messages for docs/scaling.md, and measured times of strong and weak scaling.
//!
//! `studies/scaling/run` builds and starts it.
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use serde_json::Value;

mod counts;
mod curve;
mod fit;
#[path = "../verification/plot.rs"]
mod plot;
mod times;

const USAGE: &str = "usage: scaling counts [PAGE] | --quick | times [RANKSxTHREADS …] | \
                     job strong|weak RANKS [--large] [--directory DIR] | table TELEMETRY …";

/// Why the program ends early.
type Failure = String;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match &words[..] {
        ["counts"] => counts::write_page(Path::new("docs/scaling.md"), false),
        ["--quick"] => counts::write_page(Path::new("target/quick/scaling.md"), true),
        ["counts", page] => counts::write_page(Path::new(page), false),
        ["times", ways @ ..] => times::measure(ways),
        ["job", kind @ ("strong" | "weak"), ranks, rest @ ..] => print_job(kind, ranks, rest),
        ["table", files @ ..] if !files.is_empty() => times::table(files),
        _ => Err(USAGE.into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("scaling: {failure}");
            ExitCode::from(2)
        }
    }
}

/// The block of sand of `studies/scaling/block.toml`.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// Root octants along x and y; one along z.
    roots: [usize; 2],
    /// Level of its leaves; the floor is one level finer.
    level: u32,
    /// Particles per cell and direction.
    per_cell: u32,
    /// Steps of 1e-6 s.
    steps: u32,
    /// Steps between records.
    every: u32,
}

impl Block {
    /// The nearest to a square of `count` roots.
    fn roots(count: usize) -> [usize; 2] {
        let side =
            (1..=count).rev().find(|side| side * side <= count && count.is_multiple_of(*side)).unwrap_or(1);
        [count / side, side]
    }

    fn text(&self, directory: &Path) -> String {
        let text = include_str!("block.toml")
            .replace("SIZE_X", &format!("{:.1}", self.roots[0] as f64))
            .replace("SIZE_Y", &format!("{:.1}", self.roots[1] as f64))
            .replace("LEVEL", &self.level.to_string())
            .replace("FINER", &(self.level + 1).to_string())
            .replace("PER_CELL", &self.per_cell.to_string())
            // With one particle per cell stretched boxes would be wider than a cell.
            .replace("BOXES", if self.per_cell == 1 { "fixed" } else { "volume" })
            .replace("END", &format!("{:e}", f64::from(self.steps) * 1e-6))
            .replace("EVERY", &self.every.to_string());
        text.replace("[output]\n", &format!("[output]\ndirectory = {:?}\n", directory.display().to_string()))
    }
}

fn print_job(kind: &str, ranks: &str, rest: &[&str]) -> Result<(), Failure> {
    let ranks: usize = ranks.parse().map_err(|_| format!("'{ranks}' is no number of ranks; {USAGE}"))?;
    let mut large = false;
    let mut directory = PathBuf::from(format!("out/scaling/{kind}_{ranks}"));
    let mut rest = rest.iter();
    while let Some(word) = rest.next() {
        match (*word, rest.len()) {
            ("--large", _) => large = true,
            ("--directory", 1..) => directory = PathBuf::from(rest.next().copied().unwrap_or_default()),
            _ => return Err(USAGE.into()),
        }
    }
    print!("{}", times::block(ranks, large).text(&directory));
    Ok(())
}

/// Runs a block on ranks of this machine, cores shared if need be; returns its records.
fn run(block: &Block, name: &str, ranks: usize, threads: usize) -> Result<Vec<Value>, Failure> {
    let directory = Path::new("target/scaling").join(name);
    let failed =
        |what: &str, error: &dyn std::fmt::Display| format!("{what} {}: {error}", directory.display());
    std::fs::create_dir_all(&directory).map_err(|error| failed("cannot create", &error))?;
    let job = directory.join(format!("{name}.toml"));
    std::fs::write(&job, block.text(&directory)).map_err(|error| failed("cannot write in", &error))?;
    let this = std::env::current_exe().map_err(|error| error.to_string())?;
    let program = this.parent().and_then(Path::parent).map(|folder| folder.join("agimp")).unwrap_or_default();
    let mut command = match ranks {
        1 => Command::new(&program),
        _ => {
            // That ranks may share cores, `jobs/environment` says, which `run` sources.
            let mut command = Command::new("mpirun");
            command.args(["--bind-to", "none", "-n", &ranks.to_string()]).arg(&program);
            command
        }
    };
    command.arg("run").arg(&job).args(["--quiet", "--overwrite", "--threads", &threads.to_string()]);
    let output = command.output().map_err(|error| format!("{}: {error}", program.display()))?;
    if !output.status.success() {
        return Err(format!("{command:?} failed:\n{}", String::from_utf8_lossy(&output.stderr)));
    }
    records(&directory.join(format!("{name}.telemetry.jsonl")))
}

/// The records of a finished run.
fn records(path: &Path) -> Result<Vec<Value>, Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let records: Result<Vec<Value>, _> = text.lines().map(serde_json::from_str).collect();
    records.map_err(|error| format!("{}: {error}", path.display()))
}

/// A number in a record, by its path.
fn number(record: &Value, path: &str) -> f64 {
    record.pointer(path).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

/// A table in Markdown.
fn markdown(heads: &[&str], rows: &[Vec<String>]) -> String {
    let mut text = format!("| {} |\n|{}\n", heads.join(" | "), " ---: |".repeat(heads.len()));
    for row in rows {
        text.push_str(&format!("| {} |\n", row.join(" | ")));
    }
    text
}
