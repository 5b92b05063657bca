//! Starts the program under `mpirun` as a user would, and watches its processes.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use agimp::io::hdf5_file::Reader;
use agimp::io::snapshot::Header;

use super::mpirun;

/// After this a run that ends soon has ended, also on a machine on which others keep it waiting.
const SOON: Duration = Duration::from_secs(60);
/// After this a run counts as hanging.
const PATIENCE: Duration = Duration::from_secs(300);

/// A job of `tests/jobs/runs`.
pub(crate) fn job(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/jobs/runs/{name}.toml"))
}

/// The small collapse with one text of its job replaced, in a directory of its own.
pub(crate) fn variant(directory: &Path, folder: &str, (from, to): (&str, &str)) -> PathBuf {
    let text = std::fs::read_to_string(job("collapse_2d")).expect("job");
    assert!(text.contains(from));
    let path = directory.join(folder).join("collapse_2d.toml");
    std::fs::create_dir_all(directory.join(folder)).expect("made");
    std::fs::write(&path, text.replace(from, to)).expect("written");
    path
}

/// Lines in which the program says why it ends; warnings may come ahead of them.
pub(crate) fn reasons(shown: &str) -> Vec<&str> {
    let is_reason = |line: &&str| line.starts_with("agimp: ") && !line.starts_with("agimp: warning: ");
    shown.lines().filter(is_reason).collect()
}

/// The program, in a directory.
pub(crate) fn agimp(directory: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_agimp"));
    command.current_dir(directory);
    command
}

/// `mpirun` in a directory. What the program needs of the MPI library it has to set itself.
pub(crate) fn mpirun(directory: &Path, ranks: usize) -> Command {
    let mut command = mpirun::command(ranks, PATIENCE.as_secs() as u32);
    command.current_dir(directory).env_remove("OMPI_MCA_mpi_yield_when_idle");
    command
}

/// A command of the shell for rank 0 and one for rank 1. One command of `mpirun`: several, of which each
/// fails, make that of Open MPI 5.0.7 crash.
pub(crate) fn by_rank(directory: &Path, [first, second]: [&str; 2]) -> Command {
    let mut command = mpirun(directory, 2);
    let script = r#"if [ "${OMPI_COMM_WORLD_RANK:-$PMI_RANK}" = 0 ]; then eval "$0"; else eval "$1"; fi"#;
    command.args(["bash", "-c", script, first, second]);
    command
}

/// `agimp run JOB --threads THREADS ARGUMENTS…` on that many ranks; one rank is started without `mpirun`.
pub(crate) fn run(directory: &Path, ranks: usize, threads: usize, job: &Path, arguments: &[&str]) -> Command {
    let mut command = if ranks == 1 {
        agimp(directory)
    } else {
        let mut command = mpirun(directory, ranks);
        command.arg(env!("CARGO_BIN_EXE_agimp"));
        command
    };
    command.arg("run").arg(job).args(["--threads", &threads.to_string()]).args(arguments);
    command
}

/// A command under way; killed if dropped early.
pub(crate) struct Running {
    child: Child,
    what: String,
}

impl Running {
    pub(crate) fn start(command: &mut Command) -> Self {
        let what = format!("{command:?}");
        let child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{what}: {error}"));
        Self { child, what }
    }

    /// Process identifiers of the ranks: the process itself, or what `mpirun` has started.
    pub(crate) fn ranks(&self) -> Vec<u32> {
        let launcher = self.child.id();
        let is_rank = |process: &u32| {
            std::fs::read_link(format!("/proc/{process}/exe"))
                .is_ok_and(|program| program == Path::new(env!("CARGO_BIN_EXE_agimp")))
        };
        // A rank without `mpirun` may have a helper of MPI as its child.
        if is_rank(&launcher) {
            vec![launcher]
        } else {
            // Ranks are children of `mpirun`, or of a helper that it has started.
            let mut processes = children(launcher);
            let mut ranks = Vec::new();
            while let Some(process) = processes.pop() {
                if is_rank(&process) {
                    ranks.push(process);
                } else {
                    processes.extend(children(process));
                }
            }
            ranks.sort_unstable();
            ranks
        }
    }

    pub(crate) fn launcher(&self) -> u32 {
        self.child.id()
    }

    /// Waits until the run in `directory` has reached a step, by its history.
    pub(crate) fn wait_for_step(&mut self, directory: &Path, name: &str, step: u64) {
        let started = Instant::now();
        while last_step(directory, name) < step {
            if let Some(status) = self.child.try_wait().expect("child") {
                panic!("{} ended ({status}) before step {step}", self.what);
            }
            assert!(started.elapsed() < PATIENCE, "{} does not reach step {step}", self.what);
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Waits for the end, which must come [`SOON`].
    pub(crate) fn finish_soon(self) -> Output {
        self.finish_within(SOON)
    }

    /// Waits for the end; not longer than `limit`.
    pub(crate) fn finish_within(mut self, limit: Duration) -> Output {
        let started = Instant::now();
        // The output is short enough for the pipes, so it can be read at the end.
        while self.child.try_wait().expect("child").is_none() {
            assert!(started.elapsed() < limit, "{} has not ended after {limit:?}", self.what);
            std::thread::sleep(Duration::from_millis(5));
        }
        let mut output = Output { status: self.child.wait().expect("child"), stdout: vec![], stderr: vec![] };
        for (pipe, text) in [
            (self.child.stdout.take().map(|p| Box::new(p) as Box<dyn std::io::Read>), &mut output.stdout),
            (self.child.stderr.take().map(|p| Box::new(p) as Box<dyn std::io::Read>), &mut output.stderr),
        ] {
            pipe.expect("piped").read_to_end(text).expect("output");
        }
        output
    }

    pub(crate) fn finish(self) -> Output {
        self.finish_within(PATIENCE)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Already ended in the good case.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Processes whose parent is `parent`.
fn children(parent: u32) -> Vec<u32> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir("/proc").expect("/proc").flatten() {
        let Some(process) = entry.file_name().to_str().and_then(|name| name.parse::<u32>().ok()) else {
            continue;
        };
        // pid (name) state parent …; the process may have ended meanwhile.
        let Ok(stat) = std::fs::read_to_string(format!("/proc/{process}/stat")) else { continue };
        let after_name = stat.rsplit(')').next().unwrap_or_default();
        if after_name.split_whitespace().nth(1) == Some(&parent.to_string()) {
            found.push(process);
        }
    }
    found.sort_unstable();
    found
}

/// Whether a process is there and not merely waiting to be collected.
pub(crate) fn is_alive(process: u32) -> bool {
    std::fs::read_to_string(format!("/proc/{process}/stat"))
        .is_ok_and(|stat| !stat.rsplit(')').next().unwrap_or_default().trim_start().starts_with('Z'))
}

/// Sends a signal, given as `kill` names it, to a process, or to a group with a minus sign ahead of its number.
pub(crate) fn signal(process: impl std::fmt::Display, name: &str) {
    // The shell's own `kill`: small systems have no other.
    let status = Command::new("sh").args(["-c", &format!("kill -{name} {process}")]).status();
    assert!(status.expect("sh starts").success(), "no process {process}");
}

/// Text of both streams, for messages of tests.
pub(crate) fn text(output: &Output) -> String {
    format!(
        "{}\n{}{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

/// Runs to the end, which must be a good one; several ranks in their turn.
pub(crate) fn succeed(command: &mut Command) -> Output {
    let _turn = mpirun::is_launch(command).then(mpirun::turn);
    let output = Running::start(command).finish();
    assert!(output.status.success(), "{command:?}\n{}", text(&output));
    output
}

/// Path of a file of the run.
pub(crate) fn file(directory: &Path, name: &str, suffix: &str) -> PathBuf {
    directory.join(format!("out/{name}/{name}{suffix}"))
}

/// Step of the last whole row of the history; 0 while there is none.
pub(crate) fn last_step(directory: &Path, name: &str) -> u64 {
    let history = std::fs::read_to_string(file(directory, name, ".history.csv")).unwrap_or_default();
    let whole = history.rfind('\n').map_or("", |end| &history[..end]);
    whole.lines().last().and_then(|row| row.split(',').next()?.parse().ok()).unwrap_or(0)
}

/// Files of a directory by name, with their contents.
pub(crate) fn contents(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(directory).expect("directory").flatten();
    let read = |path: PathBuf| std::fs::read(&path).expect("file");
    entries.map(|entry| (entry.file_name().to_string_lossy().into_owned(), read(entry.path()))).collect()
}

/// Results of a run to the end, but for times measured and the text of the job. Files with a state stand
/// there with their digests, other outputs with the checksums of all their data sets but that text; of
/// checkpoints the last counts.
pub(crate) fn results(directory: &Path, name: &str) -> BTreeMap<String, Vec<u8>> {
    let results = directory.join("out").join(name);
    let mut files = contents(&results);
    files.retain(|file, _| !file.contains("telemetry") && !file.ends_with(".report.json"));
    let last = files.keys().rfind(|file| file.contains("checkpoint_")).cloned();
    let mut kept = BTreeMap::new();
    for (file, contents) in files {
        let is_last = last.as_ref() == Some(&file);
        if file.contains("checkpoint_") && !is_last {
            continue;
        }
        let digest = agimp(&results).args(["digest", "--parts", &file]).output().expect("agimp starts");
        let contents = match digest.status.success() {
            true => digest.stdout,
            false => sums(&results.join(&file)).unwrap_or(contents),
        };
        kept.insert(if is_last { "the last checkpoint".into() } else { file }, contents);
    }
    kept
}

/// The checksums of an output that holds the text of its job, without that of the text.
fn sums(path: &Path) -> Option<Vec<u8>> {
    let header = Header::read(&Reader::open_alone(path).ok()?).ok()?;
    header.checksum("state/job")?;
    let sums: Vec<_> = header.checksums.iter().filter(|(set, _)| set != "state/job").collect();
    Some(format!("{:08x} {sums:?}", header.state_checksum()).into_bytes())
}

/// Results that have to be the same however a run was carried out.
#[derive(Clone, PartialEq, Eq)]
pub(crate) struct Outcome {
    /// Output of `agimp digest --parts` for the last output.
    pub digest: String,
    /// The whole history.
    pub history: Vec<u8>,
    /// The picture of the last state; empty where the job wants none.
    pub picture: Vec<u8>,
    /// Names of all files of the run but checkpoints.
    pub files: Vec<String>,
}

impl Outcome {
    /// Reads what a finished run has left.
    pub(crate) fn read(directory: &Path, name: &str) -> Self {
        let files = contents(&directory.join("out").join(name));
        let output = |file: &&String| {
            file.strip_prefix(name)
                .and_then(|rest| rest.strip_prefix('_'))
                .is_some_and(|rest| !rest.contains("tree"))
        };
        let last = files.keys().rfind(output).expect("an output");
        let digest = agimp(&directory.join("out").join(name)).args(["digest", "--parts", last]).output();
        let digest = digest.expect("agimp starts");
        assert!(digest.status.success(), "{}", text(&digest));
        Self {
            digest: String::from_utf8_lossy(&digest.stdout).into_owned(),
            history: files[&format!("{name}.history.csv")].clone(),
            picture: files.get(&format!("{name}.png")).cloned().unwrap_or_default(),
            files: files
                .into_keys()
                .filter(|file| !(file.contains("checkpoint") && file.ends_with("hdf")))
                .collect(),
        }
    }

    /// Fails unless both are the same, telling what is not.
    #[track_caller]
    pub(crate) fn assert_same(&self, other: &Self, what: &str) {
        assert_eq!(self.digest, other.digest, "{what}: digest");
        let rows = |result: &Self| String::from_utf8_lossy(&result.history).into_owned();
        for (ours, theirs) in rows(self).lines().zip(rows(other).lines()) {
            assert_eq!(ours, theirs, "{what}: history");
        }
        assert!(self.history == other.history, "{what}: lengths of the histories");
        assert!(self.picture == other.picture, "{what}: picture");
        assert_eq!(self.files, other.files, "{what}: files");
    }
}
