//! Code that tests of subcommands share: the program, its output, a browser, and a body for a job.
use std::path::Path;
use std::process::{Command, Output};

macro_rules! rubber {
    () => {
        r#"
[[materials]]
name = "rubber"
density = 1000
model = "neo_hookean"
young = 1e5
poisson = 0.3
"#
    };
}

/// A material of a job.
pub(crate) const RUBBER_MATERIAL: &str = rubber!();

/// Domain, material and body of a job: a block of rubber at rest on the floor.
pub(crate) const RUBBER_BLOCK: &str = concat!(
    r#"
[domain]
size = [1, 1]
root_edge = 0.25
[boundaries]
y_min = { kind = "sticky" }
[[bodies]]
name = "block"
material = "rubber"
shape = { kind = "box", min = [0.25, 0.0], max = [0.75, 0.25] }
"#,
    rubber!()
);

/// Runs the program in a directory.
pub(crate) fn agimp(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_agimp")).args(arguments).current_dir(directory).output().expect("starts")
}

/// The same within this many seconds of processor time, which what else runs on the machine does not
/// lengthen; it is killed if it takes more. At most so many kB of addresses, if any.
pub(crate) fn confined(directory: &Path, seconds: u32, kilobytes: Option<u64>, arguments: &[&str]) -> Output {
    let memory = kilobytes.map_or_else(String::new, |most| format!("ulimit -v {most}; "));
    let script = format!("ulimit -t {seconds}; {memory}exec \"$0\" \"$@\"");
    let mut command = Command::new("bash");
    command.args(["-c", &script, env!("CARGO_BIN_EXE_agimp")]).args(arguments).current_dir(directory);
    command.output().expect("bash starts")
}

/// All that a program has said.
pub(crate) fn told(output: &Output) -> String {
    [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned()).concat()
}

/// Runs the program, which must succeed. Returns what it says.
pub(crate) fn succeed(directory: &Path, arguments: &[&str]) -> String {
    let output = agimp(directory, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", told(&output));
    told(&output)
}

/// A directory with a finished run of this job, `NAME.toml`, with these options.
pub(crate) fn finished(name: &str, job: &str, options: &[&str]) -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("temporary directory");
    let file = format!("{name}.toml");
    std::fs::write(directory.path().join(&file), job).expect("written");
    succeed(directory.path(), &[&["run", "--quiet", &file], options].concat());
    directory
}

/// The Chromium of this machine; without one the test says that it is passed over.
pub(crate) fn chromium() -> Option<String> {
    let given = std::env::var("AGIMP_CHROMIUM").ok();
    let usual = ["chromium", "chromium-browser", "google-chrome"].map(str::to_owned);
    let works = |program: &String| {
        Command::new(program).arg("--version").output().is_ok_and(|out| out.status.success())
    };
    let found = given.into_iter().chain(usual).find(works);
    if found.is_none() {
        eprintln!("passed over: there is no Chromium (Debian: chromium)");
    }
    found
}
