//! Claim: no job text and no state file makes the program panic, wait or fill the memory. Texts and files are
//! mutated from good ones with fixed seeds; each goes through what `agimp check` and `agimp info` do, in this
//! process.
//!
//! The long forms are run by hand:
//! `cargo test --release --test all -- --ignored --nocapture mutations`; `AGIMP_MUTATIONS` sets the number of
//! cases.
mod mutate;

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::common::relaunch::full_name;
use agimp::io::hdf5_file::{self, Reader};
use agimp::io::snapshot::{Header, compare, job_text};
use agimp::job::{self, AnyProblem, JobError, Problem, Settings};
use agimp::setup::estimate::estimate;
use agimp::setup::warnings::warnings;
use mutate::{Random, mutated_bytes, mutated_text};
use rustix::time::{ClockId, clock_gettime};

/// Most processor time of one case, s. Unoptimised programs have more.
const MOST_SECONDS: f64 = if cfg!(debug_assertions) { 5.0 } else { 1.0 };
/// Most memory that one case adds, bytes.
const MOST_BYTES: u64 = 200_000_000;

/// Runs a test in a process of its own: memory is measured of the whole process, which other tests share.
fn alone(test: &str, body: impl FnOnce()) {
    const MARK: &str = "AGIMP_TEST_ALONE";
    if std::env::var_os(MARK).is_some() {
        return body();
    }
    let status = std::process::Command::new(std::env::current_exe().expect("own path"))
        .args(["--exact", &full_name(module_path!(), test), "--include-ignored", "--nocapture"])
        .env(MARK, "1")
        .status();
    assert!(status.expect("this binary starts").success(), "{test} failed; its output is above");
}

/// Resident memory now and at its peak, bytes.
fn memory() -> [u64; 2] {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    ["VmRSS:", "VmHWM:"].map(|name| {
        let line = status.lines().find_map(|line| line.strip_prefix(name));
        let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
        kilobytes.unwrap_or(0) * 1000
    })
}

/// Greatest time and memory of the cases.
#[derive(Default)]
struct Worst {
    seconds: f64,
    bytes: u64,
    accepted: u64,
}

impl Worst {
    /// Runs a case; it returns whether the input was accepted. `show` says what it was.
    fn measure(&mut self, case: impl FnOnce() -> bool, show: impl Fn() -> String) {
        // The peak counts from now on.
        let _ = std::fs::write("/proc/self/clear_refs", "5");
        let [before, _] = memory();
        let time = || {
            let now = clock_gettime(ClockId::ThreadCPUTime);
            now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
        };
        let start = time();
        self.accepted += u64::from(case());
        let seconds = time() - start;
        let bytes = memory()[1].saturating_sub(before);
        assert!(seconds < MOST_SECONDS, "{seconds} s for {}", show());
        assert!(bytes < MOST_BYTES, "{bytes} bytes for {}", show());
        self.seconds = self.seconds.max(seconds);
        self.bytes = self.bytes.max(bytes);
    }

    fn report(&self, what: &str, cases: u64, start: Instant) {
        println!(
            "{cases} {what}: {} accepted; at most {:.3} s and {:.1} MB for one; {:.0} s in all",
            self.accepted,
            self.seconds,
            self.bytes as f64 / 1e6,
            start.elapsed().as_secs_f64()
        );
    }
}

/// Cases of a long form.
fn wanted(default: u64) -> u64 {
    std::env::var("AGIMP_MUTATIONS").ok().and_then(|count| count.parse().ok()).unwrap_or(default)
}

/// Cases between two lines of progress.
const PROGRESS: u64 = 20_000;

/// All job files of the project.
fn jobs() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<PathBuf> = ["jobs", "tests/jobs/good", "tests/jobs/runs", "tests/jobs/bad"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(root.join(folder)).expect("a folder of jobs"))
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read_to_string(path).expect("a job")).collect()
}

/// The part of `agimp check` before MPI. Returns whether the job is accepted.
fn check(bytes: Vec<u8>) -> bool {
    fn look<const D: usize>(problem: &Problem<D>) -> bool {
        match estimate(problem) {
            Ok(estimate) => {
                assert!(estimate.steps.is_finite() && estimate.time_step > 0.0, "{}", problem.text);
                warnings(problem, estimate.steps);
                true
            }
            Err(error) => {
                assert!(error.to_string().starts_with("job.toml:"), "{error}");
                false
            }
        }
    }
    match job::from_bytes(bytes, Path::new("job.toml"), &Settings::default()) {
        Ok(AnyProblem::Two(problem)) => look(&problem),
        Ok(AnyProblem::Three(problem)) => look(&problem),
        Err(JobError::Invalid(list)) => {
            assert!(!list.faults.is_empty(), "refused without a fault");
            for fault in list.shown() {
                let line = list.headline(fault);
                assert!(line.starts_with("job.toml:") && !line.chars().any(char::is_control), "{line:?}");
            }
            false
        }
        Err(_) => false,
    }
}

fn job_texts(cases: u64, seed: u64) {
    let (jobs, start, mut worst) = (jobs(), Instant::now(), Worst::default());
    for case in 0..cases {
        let mut random = Random::new(seed ^ case);
        let bytes = mutated_text(&mut random, &jobs);
        let shown = bytes.clone();
        if case > 0 && case.is_multiple_of(PROGRESS) {
            worst.report("mutated job texts", case, start);
        }
        worst.measure(|| check(bytes), || format!("case {case}:\n{}", String::from_utf8_lossy(&shown)));
    }
    worst.report("mutated job texts", cases, start);
}

#[test]
fn mutated_job_texts_are_refused_or_estimated_at_once() {
    alone("mutated_job_texts_are_refused_or_estimated_at_once", || job_texts(1_000, 0x5eed));
}

#[test]
#[ignore = "long: run by hand"]
fn a_million_mutated_job_texts() {
    alone("a_million_mutated_job_texts", || job_texts(wanted(1_000_000), 0x1_0000_0000));
}

/// The state files of a small run.
fn state_files(home: &Path) -> Vec<Vec<u8>> {
    let job = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/jobs/runs/few_leaves.toml");
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_agimp"))
        .arg("run")
        .arg(job)
        .args(["--quiet", "--end", "1e-3", "--set", "output.picture=false", "--out"])
        .arg(home.join("out"))
        .current_dir(home)
        .output()
        .expect("agimp runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let entries = std::fs::read_dir(home.join("out")).expect("results");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "hdf"));
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).expect("a state")).collect()
}

/// Where files are written often: in memory, if the system has such a place.
fn place() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    made.expect("temporary directory")
}

/// Reads mutated files; `whole` ones with all that is in them, otherwise the header alone.
fn state_headers(cases: u64, seed: u64, whole: bool) {
    hdf5_file::prepare();
    let home = place();
    let (files, start, mut worst) = (state_files(home.path()), Instant::now(), Worst::default());
    assert!(files.len() >= 2);
    let path = home.path().join("mutated.hdf");
    for case in 0..cases {
        if case > 0 && case.is_multiple_of(PROGRESS) {
            worst.report("mutated files", case, start);
        }
        let mut random = Random::new(seed ^ case);
        std::fs::write(&path, mutated_bytes(&mut random, &files, b"agimp state")).expect("written");
        let read = || {
            let Ok(file) = Reader::open_alone(&path) else { return false };
            let header = Header::read(&file);
            drop(file);
            let _ = job_text(&path);
            if whole {
                let verified = compare::verify(&path).is_ok();
                let _ = compare::digest(&path);
                return verified;
            }
            header.is_ok()
        };
        worst.measure(read, || format!("case {case} of seed {seed:x}"));
    }
    worst.report(if whole { "mutated state files" } else { "mutated headers" }, cases, start);
}

#[test]
fn mutated_headers_are_refused_or_read_at_once() {
    alone("mutated_headers_are_refused_or_read_at_once", || state_headers(1_000, 0x5eed, false));
}

#[test]
fn mutated_state_files_are_refused_or_verified_at_once() {
    alone("mutated_state_files_are_refused_or_verified_at_once", || state_headers(300, 0x5eed, true));
}

#[test]
#[ignore = "long: run by hand"]
fn two_hundred_thousand_mutated_headers() {
    alone("two_hundred_thousand_mutated_headers", || state_headers(wanted(200_000), 0x2_0000_0000, false));
}
