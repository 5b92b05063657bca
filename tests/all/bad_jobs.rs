//! Job files through the program itself: bad ones are refused with the place and what would be right,
//! good ones are counted right.
//!
//! The comments at the top of the files in `tests/jobs/` say what is expected:
//! `# expect: LINE:COLUMN | part of the message | …` for bad ones, `# expect: part of the output | …`
//! for good ones.
use std::path::{Path, PathBuf};

use crate::common::program::agimp;
use crate::common::three_at_a_time;

fn jobs(kind: &str) -> Vec<(PathBuf, String)> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/jobs").join(kind);
    let mut files: Vec<PathBuf> = std::fs::read_dir(&directory)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    files.sort();
    files.into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).unwrap())).collect()
}

fn expectations(text: &str) -> Vec<Vec<&str>> {
    let lines = text.lines().take_while(|line| line.starts_with('#'));
    let expected: Vec<Vec<&str>> = lines
        .filter_map(|line| line.strip_prefix("# expect: "))
        .map(|line| line.split(" | ").collect())
        .collect();
    assert!(!expected.is_empty(), "a job without expectation:\n{text}");
    expected
}

/// The commands that read a job.
fn commands() -> Vec<&'static str> {
    let help = agimp(Path::new("."), &["--help"]);
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    ["check", "run"].into_iter().filter(|name| help.contains(&format!("\n  {name} "))).collect()
}

fn assert_refused(command: &str, path: &Path, expected: &[Vec<&str>]) {
    let directory = tempfile::tempdir().unwrap();
    let output = agimp(directory.path(), &[command, path.to_str().unwrap()]);
    let message = String::from_utf8_lossy(&output.stderr);
    let context = || format!("agimp {command} {}:\n{message}", path.display());
    assert_eq!(output.status.code(), Some(2), "{}", context());
    for parts in expected {
        let start = format!("{}:{}: ", path.display(), parts[0]);
        let line = message.lines().find(|line| line.contains(&start));
        let line = line.unwrap_or_else(|| panic!("no line with {start:?}\n{}", context()));
        for part in &parts[1..] {
            assert!(line.contains(part), "{part:?} is not in {line:?}\n{}", context());
        }
    }
    assert_eq!(output.stdout, b"", "{}", context());
    let left: Vec<_> = std::fs::read_dir(directory.path()).unwrap().collect();
    assert!(left.is_empty(), "{left:?} left behind by {}", context());
}

#[test]
fn bad_jobs_are_refused_with_place_and_remedy() {
    let jobs = jobs("bad");
    assert!(jobs.len() >= 30);
    let commands = commands();
    assert!(commands.contains(&"check"));
    // A run starts MPI before it can refuse a job, which is mostly waiting.
    three_at_a_time(&jobs, |(path, text)| {
        let expected = expectations(text);
        commands.iter().for_each(|command| assert_refused(command, path, &expected));
    });
}

#[test]
fn files_that_are_no_text_or_not_there_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("latin.toml");
    std::fs::write(&path, b"version = 1\ntitle = \"S\xe4ule\"\n").unwrap();
    for command in commands() {
        assert_refused(command, &path, &[vec!["2:11", "found a byte that is not UTF-8"]]);
        let output = agimp(directory.path(), &[command, "absent.toml"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains("absent.toml: cannot be read"));
    }
}

#[test]
fn good_jobs_are_counted() {
    for (path, text) in jobs("good") {
        let directory = tempfile::tempdir().unwrap();
        let output = agimp(directory.path(), &["check", path.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let printed = String::from_utf8_lossy(&output.stdout);
        // Columns are padded with spaces; one is enough for comparison.
        let squeezed: Vec<String> =
            printed.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
        for part in expectations(&text).concat() {
            assert!(
                squeezed.iter().any(|line| line.contains(part)),
                "{part:?} is not in the output for {}\n{printed}",
                path.display()
            );
        }
        assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    }
}

#[test]
fn new_writes_a_job_that_check_accepts_and_overwrites_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let list = agimp(directory.path(), &["new", "--list"]);
    let list = String::from_utf8_lossy(&list.stdout).into_owned();
    let names: Vec<&str> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.contains(&"elastic_cubes"));
    let name = "elastic_cubes";
    assert_eq!(agimp(directory.path(), &["new", name]).status.code(), Some(0));
    let file = format!("{name}.toml");
    assert_eq!(agimp(directory.path(), &["check", &file]).status.code(), Some(0));
    let path = directory.path().join(&file);
    std::fs::write(&path, "mine").unwrap();
    let refused = agimp(directory.path(), &["new", name]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("exists already"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine");
    assert_eq!(agimp(directory.path(), &["new", "no_such_template"]).status.code(), Some(2));
}

#[test]
fn schema_is_json_with_units() {
    let output = agimp(Path::new("."), &["schema"]);
    assert_eq!(output.status.code(), Some(0));
    let schema: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let density = schema.pointer("/$defs/Material/properties/density/description").unwrap();
    assert!(density.as_str().unwrap().contains("kg/m³"));
}
