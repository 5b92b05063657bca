//! When one rank fails, all end, soon and with one message; what is on disk stays good.
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::common::in_turn;
use crate::common::launch::{
    Outcome, Running, agimp, contents, file, is_alive, job, last_step, mpirun, reasons, results, run, signal,
    succeed, text, variant,
};

/// All ranks must have ended this long after one has failed or was killed.
const SOON: Duration = Duration::from_secs(10);

/// A few moments, chosen by a fixed seed; see [`killed_at_twenty_moments`].
#[test]
fn killed_ranks_leave_no_hang_and_no_damage() {
    let _turn = in_turn();
    kill_at_random_moments(4, 0x5eed, |_| {});
}

/// Takes about two minutes:
/// `cargo test --release --test mpi_runs -- --ignored --nocapture killed_at_twenty_moments`.
/// `AGIMP_TEST_SEED` chooses other moments.
#[test]
#[ignore = "long; the short form runs always"]
fn killed_at_twenty_moments() {
    let _turn = in_turn();
    let seed = std::env::var("AGIMP_TEST_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
    let mut kills = Vec::new();
    kill_at_random_moments(20, seed, |kill| {
        println!("{kill}");
        kills.push(kill);
    });
    let while_writing = kills.iter().filter(|kill| kill.while_writing).count();
    let slowest = kills.iter().map(|kill| kill.ended_after).max().unwrap_or_default();
    println!("{while_writing} of {} while a file was written; slowest end after {slowest:?}", kills.len());
    assert!(while_writing > 0, "no moment fell into the writing of a checkpoint; try another seed");
}

/// One kill.
struct Kill {
    /// `None`: `mpirun` itself, or the only process.
    rank: Option<usize>,
    ranks: usize,
    step: u64,
    while_writing: bool,
    ended_after: Duration,
}

impl std::fmt::Display for Kill {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { rank, ranks, step, while_writing, ended_after } = self;
        let victim = rank.map_or_else(|| "launcher".into(), |rank| format!("rank {rank}"));
        let doing = if *while_writing { ", while a file was written" } else { "" };
        write!(f, "{victim} of {ranks} killed after step {step}{doing}; all ended after {ended_after:.1?}")
    }
}

/// Ranks or `mpirun` are killed one after another, in a run on 1 to 3 ranks that writes a checkpoint after
/// every step and an output after every few; each time the run goes on from the latest. Besides, the
/// directory holds the later checkpoints of an earlier run with other sand.
fn kill_at_random_moments(kills: u64, seed: u64, mut tell: impl FnMut(Kill)) {
    let name = "collapse_2d";
    let home = tempfile::tempdir().expect("temporary directory");
    let directory = home.path();
    let other = variant(directory, "other", ("friction_angle = 29.5", "friction_angle = 35"));
    let outputs = "every = 0.02\n\n[checkpoint]\nevery_steps = 20";
    let seldom = variant(directory, "seldom", (outputs, &outputs.replace("0.02", "0.004")));
    let often = outputs.replace("0.02", "0.004").replace("= 20", "= 1");
    let often = variant(directory, "often", (outputs, &often));
    succeed(&mut run(directory, 1, 2, &other, &["--quiet"]));
    let reference = tempfile::tempdir().expect("temporary directory");
    succeed(&mut run(reference.path(), 1, 1, &seldom, &["--quiet"]));

    // Steps are counted in the history, which must not be that of the other sand.
    std::fs::remove_file(file(directory, name, ".history.csv")).expect("history");
    let mut random = Random(seed);
    for kill in 0..kills {
        let ranks = 1 + random.below(3) as usize;
        // One more than there are ranks: the launcher.
        let (steps, victim) = (3 + random.below(15), random.below(ranks as u64 + 1) as usize);
        let from: &[&str] =
            if kill == 0 { &["--quiet", "--overwrite"] } else { &["--quiet", "--restart", "latest"] };
        let mut running = Running::start(&mut run(directory, ranks, 1, &often, from));
        running.wait_for_step(directory, name, last_step(directory, name) + steps);
        std::thread::sleep(Duration::from_micros(random.below(40_000)));
        let processes = running.ranks();
        assert_eq!(processes.len(), ranks);
        signal(processes.get(victim).copied().unwrap_or(running.launcher()), "KILL");
        let killed = Instant::now();
        let output = running.finish_within(SOON);
        assert!(!output.status.success(), "{}", text(&output));
        all_ended(&processes);
        let ended_after = killed.elapsed();
        assert!(ended_after < SOON, "ranks were there for {ended_after:?}");
        let left = contents(&directory.join("out").join(name));
        for file in left.keys().filter(|file| file.ends_with(".hdf") && !file.contains(".tree.")) {
            let path = directory.join("out").join(name).join(file);
            succeed(agimp(directory).args(["info", "--verify"]).arg(path));
        }
        tell(Kill {
            rank: (victim < ranks).then_some(victim),
            ranks,
            step: last_step(directory, name),
            while_writing: left.keys().any(|file| file.ends_with(".part")),
            ended_after,
        });
    }
    // To the end without so many checkpoints.
    succeed(&mut run(directory, 2, 1, &seldom, &["--quiet", "--restart", "latest"]));
    let what = "killed again and again";
    Outcome::read(directory, name).assert_same(&Outcome::read(reference.path(), name), what);
    let outputs = |directory: &Path| {
        let mut files = results(directory, name);
        files.retain(|file, _| file.contains("hdf"));
        files
    };
    let (found, expected) = (outputs(directory), outputs(reference.path()));
    let differing: Vec<&String> =
        found.keys().chain(expected.keys()).filter(|file| found.get(*file) != expected.get(*file)).collect();
    assert!(differing.is_empty(), "{what}: {differing:?}");
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (x ^ x >> 31) % limit
    }
}

/// The directory of the results vanishes under a run.
#[test]
fn a_failure_while_writing_names_the_step() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let (directory, name) = (home.path(), "collapse_2d");
    let often = variant(directory, "often", ("every_steps = 20", "every_steps = 1"));
    let mut running = Running::start(&mut run(directory, 3, 1, &often, &["--quiet"]));
    running.wait_for_step(directory, name, 9);
    let results = directory.join("out").join(name);
    std::fs::rename(&results, directory.join("out/elsewhere")).expect("renamed");
    let output = running.finish_within(SOON);
    let shown = text(&output);
    assert_eq!(output.status.code(), Some(1), "{shown}");
    let messages: Vec<&str> = shown.lines().filter(|line| line.starts_with("agimp:")).collect();
    assert_eq!(messages.len(), 1, "one message: {shown}");
    // Which file it was depends on the moment: a checkpoint, a table, or the directory when old files are
    // listed.
    for part in ["step ", "time ", "out/collapse_2d"] {
        assert!(messages[0].contains(part), "'{part}' is missing: {}", messages[0]);
    }
}

/// A particle is lost on one rank.
#[test]
fn an_error_of_one_rank_is_told_once() {
    let _turn = in_turn();
    for ranks in [1, 3] {
        let home = tempfile::tempdir().expect("temporary directory");
        let started = Instant::now();
        let running = Running::start(&mut run(home.path(), ranks, 1, &job("unstable"), &["--quiet"]));
        let output = running.finish_within(SOON);
        let shown = text(&output);
        assert!(started.elapsed() < SOON);
        assert_eq!(output.status.code(), Some(1), "{shown}");
        let [message] = reasons(&shown)[..] else { panic!("one message: {shown}") };
        for part in ["step ", "time ", "rank ", "particle ", "left the domain"] {
            assert!(message.contains(part), "'{part}' is missing: {message}");
        }
    }
}

/// A wrong job is told once, with its place, whatever the number of ranks; no output appears.
#[test]
fn a_bad_job_is_told_once() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let directory = home.path();
    let text_of_job = std::fs::read_to_string(job("few_leaves")).expect("job");
    std::fs::write(directory.join("bad.toml"), text_of_job.replace("root_edge", "rot_edge"))
        .expect("written");
    for ranks in [1, 2] {
        let command = &mut run(directory, ranks, 1, &directory.join("bad.toml"), &[]);
        let output = Running::start(command).finish_within(SOON);
        let shown = text(&output);
        assert_eq!(output.status.code(), Some(2), "{shown}");
        assert_eq!(shown.matches("bad.toml:7:1: ").count(), 1, "one message: {shown}");
        assert!(shown.contains("root_edge"), "{shown}");
        assert!(!directory.join("out").exists());
    }
}

/// The results cannot be written: only rank 0 notices, all ranks end.
#[test]
fn an_unwritable_directory_ends_all_ranks() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    std::fs::write(home.path().join("out"), "a file in the way").expect("written");
    let output = Running::start(&mut run(home.path(), 3, 1, &job("few_leaves"), &[])).finish_within(SOON);
    let shown = text(&output);
    assert_eq!(output.status.code(), Some(1), "{shown}");
    assert_eq!(shown.matches("agimp:").count(), 1, "one message: {shown}");
    assert!(shown.contains("out/few_leaves: cannot create the directory"), "{shown}");
}

/// One rank alone cannot write on, as with a quota, a full disk of one node or a failing client. Without the
/// trap the system would end that rank without a word.
#[test]
fn a_rank_that_cannot_write_ends_all_with_the_reason() {
    let _turn = in_turn();
    for (limited, trap) in [(1, ""), (1, "trap '' XFSZ;"), (0, "")] {
        let home = tempfile::tempdir().expect("temporary directory");
        let directory = home.path();
        let often = variant(directory, "often", ("every_steps = 20", "every_steps = 1"));
        let mut command = mpirun(directory, 2);
        let script = format!("{trap} exec \"$0\" run \"$1\" --quiet --threads 1");
        command.args(["bash", "-c", &script, env!("CARGO_BIN_EXE_agimp")]).arg(often);
        let mut running = Running::start(&mut command);
        running.wait_for_step(directory, "collapse_2d", 3);
        // Now, since MPI libraries make files of the memory that ranks share when they start.
        let process = running.ranks().into_iter().find(|&process| rank_of(process) == limited);
        let process = process.expect("the rank runs").to_string();
        succeed(Command::new("prlimit").args(["--pid", &process, "--fsize=150000"]));
        let output = running.finish_within(4 * SOON);
        let shown = text(&output);
        assert_eq!(output.status.code(), Some(1), "{shown}");
        assert_eq!(shown.matches("agimp: ").count(), 1, "one message: {shown}");
        let message = shown.lines().find(|line| line.starts_with("agimp:")).expect("message");
        for part in [&format!("rank {limited}: "), "cannot write", "ulimit -f"] {
            assert!(message.contains(part), "'{part}' is missing: {message}");
        }
        let left = contents(&directory.join("out/collapse_2d"));
        assert!(!left.keys().any(|name| name.ends_with(".part")), "{:?}", left.keys());
    }
}

/// The rank of a process that `mpirun` has started.
fn rank_of(process: u32) -> u32 {
    let environment = std::fs::read_to_string(format!("/proc/{process}/environ")).expect("process");
    let value =
        |name: &str| environment.split('\0').find_map(|entry| entry.strip_prefix(name)?.strip_prefix('='));
    let rank = value("OMPI_COMM_WORLD_RANK").or_else(|| value("PMI_RANK"));
    rank.and_then(|rank| rank.parse().ok()).expect("a rank")
}

/// Nobody takes the message of rank 0 for three seconds; `mpirun` leaves others one second once a rank has
/// ended.
#[test]
fn ranks_end_after_the_message_has_gone_out() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let directory = home.path();
    // Another process group, which `mpirun` does not end; the pipe is full, so rank 0 cannot write.
    let slow = r#"
        if [ "${OMPI_COMM_WORLD_RANK:-$PMI_RANK}" = 0 ]; then
            exec 2> >(exec setsid bash -c 'sleep 3; head -c 65536 >/dev/null; cat >told.part; mv told.part told')
            head -c 65536 /dev/zero >&2
        fi
        exec "$0" run missing.toml"#;
    let mut command = mpirun(directory, 2);
    command.args(["bash", "-c", slow, env!("CARGO_BIN_EXE_agimp")]);
    let output = Running::start(&mut command).finish_within(SOON);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    let started = Instant::now();
    while !directory.join("told").exists() {
        assert!(started.elapsed() < SOON, "the listener is still there");
        std::thread::sleep(Duration::from_millis(10));
    }
    let told = std::fs::read_to_string(directory.join("told")).expect("message");
    // The MPI library may have something to say as well.
    assert!(told.lines().any(|line| line.starts_with("agimp: missing.toml: cannot be read")), "{told}");
}

/// `check` tells what it has found once, with the criteria's tree and without, and so it does with faults.
#[test]
fn a_job_is_checked_once() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    let checked = |path: &Path| {
        let mut command = mpirun(home.path(), 2);
        let output = Running::start(command.arg(env!("CARGO_BIN_EXE_agimp")).arg("check").arg(path));
        let output = output.finish_within(SOON);
        (output.status.code(), text(&output))
    };
    for name in ["few_leaves", "adaptive_2d"] {
        let (code, shown) = checked(&job(name));
        assert_eq!(code, Some(0), "{shown}");
        assert_eq!(shown.matches("particles  ").count(), 1, "{shown}");
        assert_eq!(shown.matches("checkpoints  ").count(), 1, "{shown}");
    }
    let (code, shown) = checked(Path::new("missing.toml"));
    assert_eq!(code, Some(2), "{shown}");
    assert_eq!(shown.matches("missing.toml: cannot be read").count(), 1, "{shown}");
}

/// A wrong command line is told once as well, and so is help.
#[test]
fn a_wrong_argument_is_told_once() {
    let _turn = in_turn();
    let home = tempfile::tempdir().expect("temporary directory");
    for ranks in [1, 3] {
        let output =
            Running::start(&mut run(home.path(), ranks, 0, Path::new("a.toml"), &[])).finish_within(SOON);
        let shown = text(&output);
        assert_eq!(output.status.code(), Some(2), "{shown}");
        assert_eq!(shown.matches("invalid value '0' for '--threads").count(), 1, "one message: {shown}");
    }
    let mut command = mpirun(home.path(), 3);
    let output = Running::start(command.args([env!("CARGO_BIN_EXE_agimp"), "--help"])).finish_within(SOON);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    assert_eq!(text(&output).matches("Print the JSON schema").count(), 1, "{}", text(&output));
}

fn all_ended(processes: &[u32]) {
    let started = Instant::now();
    while let Some(process) = processes.iter().find(|process| is_alive(**process)) {
        assert!(started.elapsed() < SOON, "rank with process {process} is still there");
        std::thread::sleep(Duration::from_millis(10));
    }
}
