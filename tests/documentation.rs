//! The papers are true: every command in them runs as it stands, and every link leads somewhere.
//!
//! A command is what stands in a fenced block `sh` of a Markdown file, or after `#` and five spaces in the comments of a
//! file in `jobs/`. It runs in a copy of the repository where
//!
//! * `target/release/agimp` is the program that cargo has built for the tests, and `cargo build` does nothing,
//! * jobs have one particle per cell and a hundredth of their time,
//! * `sbatch` and `srun` run a script on two ranks of this machine.
//!
//! An HTML comment before a block says what else differs: `<!-- test: needs: PROGRAMS -->` passes over the block where
//! one of them is missing, `<!-- test: quick: OLD => NEW; REASON -->` replaces words, `<!-- test: skip: REASON -->` leaves it out.
#[path = "common/mpirun.rs"]
mod mpirun;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files below a folder of the repository, without what is built or hidden; paths from the top, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(repository().join(&folder)).expect("a folder") {
            let name = entry.expect("an entry").file_name();
            let path = if folder == Path::new(".") { PathBuf::from(&name) } else { folder.join(&name) };
            let hidden = name.to_string_lossy().starts_with('.');
            match repository().join(&path).is_dir() {
                _ if hidden => {}
                true if ["target", "out", "node_modules", "__pycache__"]
                    .iter()
                    .any(|built| *built == name) => {}
                true => folders.push(path),
                false => found.push(path),
            }
        }
    }
    found.sort();
    found
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(repository().join(path)).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The Markdown files; README first, since the guide goes on from its first job.
fn papers() -> Vec<PathBuf> {
    let mut papers: Vec<_> = files(Path::new("."))
        .into_iter()
        .filter(|path| path.extension().is_some_and(|e| e == "md"))
        .collect();
    papers.sort_by_key(|path| (path != Path::new("README.md"), path.clone()));
    assert!(papers.len() >= 20, "{papers:?}");
    papers
}

/// A fenced block.
#[derive(Debug)]
struct Block {
    line: usize,
    language: String,
    /// What the comment before it says after `test:`.
    note: Option<String>,
    text: String,
}

fn blocks(paper: &str) -> Vec<Block> {
    let mut found = Vec::new();
    let (mut note, mut open): (Option<String>, Option<Block>) = (None, None);
    for (i, line) in paper.lines().enumerate() {
        match (&mut open, line.trim_start().strip_prefix("```")) {
            (Some(_), Some(_)) => found.extend(open.take()),
            (Some(block), None) => {
                block.text.push_str(line);
                block.text.push('\n');
            }
            (None, Some(language)) => {
                let (language, note) = (language.trim().to_owned(), note.take());
                open = Some(Block { line: i + 1, language, note, text: String::new() });
            }
            (None, None) => {
                let inner = line.trim().strip_prefix("<!-- test:").and_then(|rest| rest.strip_suffix("-->"));
                note = inner.map(|inner| inner.trim().to_owned());
            }
        }
    }
    assert!(open.is_none(), "a block without an end");
    found
}

/// The commands of a block as they run here; none if it is passed over.
fn commands(paper: &Path, block: &Block) -> Option<String> {
    let place = format!("{}:{}", paper.display(), block.line);
    let note = block.note.as_deref().unwrap_or_default();
    if let Some(reason) = note.strip_prefix("skip:") {
        assert!(reason.trim().len() > 10, "{place}: a reason is missing");
        println!("{place}: not run: {}", reason.trim());
        return None;
    }
    if let Some(programs) = note.strip_prefix("needs:") {
        let is_missing = |program: &&str| {
            !Command::new("sh")
                .args(["-c", "command -v \"$0\" >/dev/null", program])
                .status()
                .is_ok_and(|s| s.success())
        };
        if let Some(missing) = programs.split_whitespace().find(is_missing) {
            println!("{place}: passed over: there is no {missing}");
            return None;
        }
    } else if let Some(quick) = note.strip_prefix("quick:") {
        let (words, reason) = quick.split_once(';').unwrap_or_else(|| panic!("{place}: a reason is missing"));
        let (old, new) = words.split_once("=>").unwrap_or_else(|| panic!("{place}: OLD => NEW"));
        assert!(block.text.contains(old.trim()), "{place}: {old} is not there");
        println!("{place}: {} instead of {}: {}", new.trim(), old.trim(), reason.trim());
        return Some(block.text.replace(old.trim(), new.trim()));
    } else {
        assert!(note.is_empty(), "{place}: unknown note {note:?}");
    }
    Some(block.text.clone())
}

/// A copy of the repository that commands may write to.
struct Copy {
    directory: tempfile::TempDir,
}

impl Copy {
    fn new() -> Self {
        let directory = tempfile::tempdir().expect("temporary directory");
        let here = directory.path();
        // What commands may write to or what differs is copied; the rest is only looked at.
        for folder in ["jobs", "docs"] {
            for path in files(Path::new(folder)) {
                let to = here.join(&path);
                std::fs::create_dir_all(to.parent().expect("a folder")).expect("made");
                std::fs::copy(repository().join(&path), &to).expect("copied");
                if path.starts_with("jobs") && path.extension().is_some_and(|e| e == "toml") {
                    std::fs::write(&to, shortened(&text(&path))).expect("written");
                }
            }
        }
        for entry in std::fs::read_dir(repository()).expect("listed") {
            let entry = entry.expect("an entry");
            let to = here.join(entry.file_name());
            let name = entry.file_name();
            if !to.exists() && !["target", "out", ".git"].iter().any(|left_out| *left_out == name) {
                std::os::unix::fs::symlink(entry.path(), to).expect("linked");
            }
        }
        std::fs::create_dir_all(here.join("target/release")).expect("made");
        let program = Path::new(env!("CARGO_BIN_EXE_agimp"));
        std::os::unix::fs::symlink(program, here.join("target/release/agimp")).expect("linked");
        let stand_in = |name: &str, script: &str| {
            let path = here.join("bin").join(name);
            std::fs::create_dir_all(here.join("bin")).expect("made");
            std::fs::write(&path, format!("#!/usr/bin/env bash\n{script}\n")).expect("written");
            let executable = std::os::unix::fs::PermissionsExt::from_mode(0o755);
            std::fs::set_permissions(&path, executable).expect("made executable");
        };
        stand_in("cargo", r#"[ "$1" = build ] || { echo "only cargo build is done already" >&2; exit 1; }"#);
        stand_in("sbatch", r#"SLURM_CPUS_PER_TASK=1 SLURM_JOB_ID=1 exec bash "$@""#);
        stand_in("srun", r#"while [[ "$1" = --* ]]; do shift; done; exec mpirun --bind-to none -n 2 "$@""#);
        Self { directory }
    }

    /// Runs commands from the top of the copy, which must succeed. `environment` are commands before them.
    fn run(&self, place: &str, environment: &str, commands: &str) {
        let script = format!("{environment}\ntrap 'echo \"failed: $BASH_COMMAND\" >&2' ERR\n{commands}");
        let path = std::env::var("PATH").unwrap_or_default();
        let run = || {
            let mut bash = Command::new("bash");
            bash.args(["-euo", "pipefail", "-c", &script])
                .current_dir(self.directory.path())
                .env("PATH", format!("{}:{path}", self.directory.path().join("bin").display()))
                .env("MPIEXEC_TIMEOUT", "600")
                .env("RAYON_NUM_THREADS", "1");
            bash.output().expect("bash starts")
        };
        let mut output = run();
        // Displays may be taken by others between the look of `xvfb-run` and its start of the server.
        for _ in 0..if commands.contains("xvfb-run") { 4 } else { 0 } {
            if output.status.success() {
                break;
            }
            output = run();
        }
        assert!(output.status.success(), "{place}:\n{commands}\n{}", mpirun::text(&output));
    }
}

/// A job with one particle per cell that ends after a hundredth of its time. Forces at points need the particles that they are for.
fn shortened(job: &str) -> String {
    let mut short = String::new();
    let mut table = "";
    let has_points = job.contains("\"point_force\"");
    for line in job.lines() {
        table = if line.starts_with('[') {
            line.split(['[', ']']).find(|part| !part.is_empty()).unwrap_or("")
        } else {
            table
        };
        let (key, value) = line.split_once('=').unwrap_or((line, ""));
        let number = value.split('#').next().and_then(|value| value.trim().parse::<f64>().ok());
        match (table, key.trim(), number) {
            ("time", "end", Some(end)) => writeln!(short, "end = {:e}", end / 100.0),
            (_, "particles_per_cell", _) if !has_points => Ok(()),
            _ => writeln!(short, "{line}"),
        }
        .expect("text");
        if line.starts_with("[[bodies]]") && !has_points {
            short.push_str("particles_per_cell = 1\n");
        }
    }
    short
}

/// What README's first job sets up for all that follows.
fn environment() -> String {
    let readme = text(Path::new("README.md"));
    let lines: Vec<&str> =
        readme.lines().filter(|line| line.starts_with("source ") || line.starts_with("export ")).collect();
    assert_eq!(lines.len(), 2, "{lines:?}");
    lines.join("\n")
}

#[test]
fn commands_of_the_papers_run() {
    let copy = Copy::new();
    let environment = environment();
    let mut done = 0;
    for paper in papers() {
        for block in blocks(&text(&paper)) {
            let first = block.text.split_whitespace().next().unwrap_or_default();
            let is_command = ["agimp", "mpirun", "cargo"].contains(&first) || first.starts_with("./");
            let place = format!("{}:{}", paper.display(), block.line);
            assert!(block.language == "sh" || !is_command, "{place}: a block of commands begins with ```sh");
            if block.language != "sh" {
                continue;
            }
            for target in block
                .text
                .split("cargo test --test ")
                .skip(1)
                .filter_map(|rest| rest.split_whitespace().next())
            {
                let exists = [format!("tests/{target}.rs"), format!("tests/{target}/main.rs")];
                assert!(
                    exists.iter().any(|file| repository().join(file).exists()),
                    "{place}: no test {target}"
                );
            }
            let Some(commands) = commands(&paper, &block) else { continue };
            let is_readme = paper == Path::new("README.md");
            copy.run(&place, if is_readme { "" } else { &environment }, &commands);
            done += 1;
        }
    }
    assert!(done >= 6, "{done} blocks");
    // The first job has left what the README promises.
    let out = copy.directory.path().join("out/my_column");
    for file in
        ["my_column.hdf.series", "my_column.tree.hdf.series", "my_column.history.csv", "my_column.png"]
    {
        assert!(out.join(file).exists(), "{file}");
    }
}

#[test]
fn commands_in_the_comments_of_jobs_run() {
    let environment = environment();
    let mut jobs = 0;
    for path in files(Path::new("jobs")) {
        let commands: Vec<_> = text(&path)
            .lines()
            .filter_map(|line| line.strip_prefix("#     "))
            .filter(|command| !command.starts_with(' '))
            .map(str::to_owned)
            .collect();
        if !commands.is_empty() {
            // Of its own: a run does not start anew over the results of another.
            let copy = Copy::new();
            copy.run(&path.display().to_string(), &environment, &commands.join("\n"));
        }
        let is_job =
            path.parent() == Some(Path::new("jobs")) && path.extension().is_some_and(|e| e == "toml");
        assert!(!is_job || !commands.is_empty(), "{}: how is it run?", path.display());
        jobs += usize::from(is_job);
    }
    assert!(jobs >= 7, "{jobs}");
}

/// The table of `tests/README.md` has every file of tests, and nothing else.
#[test]
fn every_test_is_listed() {
    let table = text(Path::new("tests/README.md"));
    let listed: BTreeSet<String> = table
        .lines()
        .filter_map(|row| row.strip_prefix("| `")?.split('`').next())
        .map(|name| name.trim_end_matches(['/', '*']).trim_end_matches(".rs").to_owned())
        .collect();
    let mut there = BTreeSet::from(["src".to_owned(), "partition/tests/distributed".to_owned()]);
    for path in files(Path::new("tests")) {
        let in_tests = path.strip_prefix("tests").expect("below tests");
        match in_tests.iter().count() {
            1 if path.extension().is_some_and(|e| e == "rs") => {
                there.insert(in_tests.with_extension("").display().to_string())
            }
            2 if path.ends_with("main.rs") => {
                there.insert(in_tests.parent().expect("a folder").display().to_string())
            }
            _ => false,
        };
    }
    assert_eq!(listed, there);
}

/// The anchor of a heading, as GitHub makes it.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.collect::<String>().trim().to_lowercase().replace(' ', "-")
}

fn anchors(paper: &str) -> BTreeSet<String> {
    let mut in_block = false;
    let mut found = BTreeSet::new();
    for line in paper.lines() {
        in_block ^= line.starts_with("```");
        if let Some(heading) = line.strip_prefix('#').filter(|_| !in_block) {
            found.insert(anchor(heading.trim_start_matches('#')));
        }
    }
    found
}

/// Targets of links and pictures outside of blocks and of code.
fn links(paper: &str) -> Vec<(usize, String)> {
    let mut in_block = false;
    let mut found = Vec::new();
    for (i, line) in paper.lines().enumerate() {
        in_block ^= line.trim_start().starts_with("```");
        if in_block {
            continue;
        }
        let prose: String = line.split('`').step_by(2).collect::<Vec<_>>().join("`");
        for part in prose.split("](").skip(1) {
            if let Some(target) = part.split(')').next() {
                found.push((i + 1, target.split(' ').next().unwrap_or_default().to_owned()));
            }
        }
    }
    found
}

#[test]
fn links_lead_somewhere() {
    let (mut broken, mut checked) = (Vec::new(), 0);
    for paper in papers() {
        let contents = text(&paper);
        for (line, target) in links(&contents) {
            if target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            checked += 1;
            let (file, heading) = target.split_once('#').unwrap_or((&target, ""));
            let to = match file {
                "" => paper.clone(),
                _ => paper.parent().unwrap_or(Path::new("")).join(file),
            };
            let leads = if repository().join(&to).exists() {
                heading.is_empty() || anchors(&text(&to)).contains(heading)
            } else {
                false
            };
            if !leads {
                broken.push(format!("{}:{line}: {target}", paper.display()));
            }
        }
    }
    assert!(checked >= 30, "{checked} links");
    assert!(broken.is_empty(), "broken links:\n{}", broken.join("\n"));
}
