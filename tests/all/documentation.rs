//! The papers are true: every command in them runs as it stands, and every link leads somewhere.
//!
//! A command is what stands in a fenced block `sh` of a Markdown file, or after `#` and five spaces in the
//! comments of a file in `jobs/`. It runs in a copy of the repository where
//!
//! * `target/release/agimp` is the program that cargo has built for the tests, and `cargo build` does
//!   nothing,
//! * jobs have one particle per cell and a thousandth of their time,
//! * `sbatch` and `srun` run a script on two ranks of this machine.
//!
//! Comments before a block say what else differs (`common/papers.rs`). Tutorials run unabridged in
//! `tutorials.rs`.

use crate::common::mpirun;
use crate::common::papers;
use crate::common::three_at_a_time;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::common::papers::{blocks, commands, files, repository, text};

/// The Markdown files; README first, since the guide goes on from its first job.
fn all_papers() -> Vec<PathBuf> {
    let mut papers: Vec<_> = files(Path::new("."))
        .into_iter()
        .filter(|path| path.extension().is_some_and(|e| e == "md"))
        .collect();
    papers.sort_by_key(|path| (path != Path::new("README.md"), path.clone()));
    assert!(papers.len() >= 20, "{papers:?}");
    papers
}

/// A copy of the repository that commands may write to.
struct Copy {
    directory: tempfile::TempDir,
}

impl Copy {
    fn new() -> Self {
        let directory = tempfile::tempdir().expect("temporary directory");
        let here = directory.path();
        // Files that commands may write or that differ are copied; the others are only read.
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
        let run =
            || papers::bash(self.directory.path(), &self.directory.path().join("bin"), environment, commands);
        let mut output = run();
        // Displays may be taken by others between the check of `xvfb-run` and its start of the server.
        for _ in 0..if commands.contains("xvfb-run") { 4 } else { 0 } {
            if output.status.success() {
                break;
            }
            output = run();
        }
        assert!(output.status.success(), "{place}:\n{commands}\n{}", mpirun::text(&output));
    }
}

/// A job with one particle per cell whose stages and end come after a thousandth of their times. Forces at points
/// need the particles that they are for.
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
            ("time", "end", Some(time)) | ("stages", "duration", Some(time)) => {
                writeln!(short, "{} = {:e}", key.trim(), time / 1000.0)
            }
            // Neighbours are a cell apart now, which is no gap yet.
            (_, "split_gap", Some(gap)) if !has_points => writeln!(short, "split_gap = {}", gap.max(1.5)),
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

/// Environment that README sets up for all that follows.
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
    for paper in all_papers() {
        for block in blocks(&text(&paper)) {
            let first = block.text.split_whitespace().next().unwrap_or_default();
            let is_command = ["agimp", "mpirun", "cargo"].contains(&first) || first.starts_with("./");
            let place = format!("{}:{}", paper.display(), block.line);
            assert!(block.language == "sh" || !is_command, "{place}: a block of commands begins with ```sh");
            if block.language != "sh" || paper.starts_with("docs/tutorials") {
                continue;
            }
            let Some(commands) = commands(&paper, &block) else { continue };
            copy.run(&place, &environment, &commands);
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
    let jobs = AtomicUsize::new(0);
    three_at_a_time(files(Path::new("jobs")), |path| {
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
        jobs.fetch_add(usize::from(is_job), Ordering::Relaxed);
    });
    assert!(jobs.load(Ordering::Relaxed) >= 7, "{jobs:?}");
}

/// Crates of tests that commands name, in pages and in the scripts of `tests/`, are there.
#[test]
fn commands_name_tests_that_exist() {
    let mut places = all_papers();
    places.extend(files(Path::new("tests")).into_iter().filter(|path| {
        path.parent() == Some(Path::new("tests")) && path.extension().is_none_or(|e| e == "rs")
    }));
    let (mut named, mut missing) = (0, Vec::new());
    for place in places {
        let text = text(&place);
        // `agimp material` has an option of this name.
        for line in text.lines().filter(|line| !line.contains("agimp material")) {
            for rest in line.split("--test ").skip(1) {
                let name =
                    rest.split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or_default();
                let files = ["tests", "partition/tests"]
                    .map(|folder| [format!("{folder}/{name}.rs"), format!("{folder}/{name}/main.rs")]);
                named += 1;
                if !files.as_flattened().iter().any(|file| repository().join(file).exists()) {
                    missing.push(format!("{}: no test {name}: {line}", place.display()));
                }
            }
        }
    }
    assert!(named >= 10, "{named}");
    assert!(missing.is_empty(), "{}", missing.join("\n"));
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
        // A module of `tests/all`, or another crate.
        let of_a_folder = path.ends_with("main.rs") || path.ends_with("mod.rs");
        let name =
            if of_a_folder { path.parent().expect("a folder").to_owned() } else { path.with_extension("") };
        let is_listed = ["tests", "tests/all"].map(Path::new).contains(&name.parent().expect("a folder"));
        let is_common = ["tests/all", "tests/common"].map(Path::new).contains(&name.as_path());
        if is_listed && !is_common && path.extension().is_some_and(|extension| extension == "rs") {
            there.insert(name.file_name().expect("a name").display().to_string());
        }
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
    for paper in all_papers() {
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

/// Target of a link of a paper, from the top of the repository; none for other sites and places in the paper
/// itself.
fn target(paper: &Path, link: &str) -> Option<PathBuf> {
    let file = link.split('#').next().unwrap_or_default();
    if file.is_empty() || link.contains("://") || link.starts_with("mailto:") {
        return None;
    }
    let mut path = PathBuf::new();
    for part in paper.parent().unwrap_or(Path::new("")).join(file).components() {
        match part {
            std::path::Component::ParentDir => assert!(path.pop(), "{}: {link}", paper.display()),
            part => path.push(part),
        }
    }
    Some(path)
}

/// The pages of the book, as `docs/SUMMARY.md` lists them.
fn pages() -> Vec<PathBuf> {
    let summary = Path::new("docs/SUMMARY.md");
    links(&text(summary)).iter().filter_map(|(_, link)| target(summary, link)).collect()
}

/// The book has each page of `docs/` once, and whatever its pages link to comes with it.
#[test]
fn the_book_is_complete() {
    let pages = pages();
    let listed: BTreeSet<&PathBuf> = pages.iter().collect();
    assert_eq!(listed.len(), pages.len(), "a page twice");
    let is_page = |path: &PathBuf| path.extension().is_some_and(|e| e == "md");
    for path in files(Path::new("docs")).iter().filter(|path| is_page(path)) {
        let is_summary = path == Path::new("docs/SUMMARY.md");
        assert!(is_summary || listed.contains(path), "{}: not in docs/SUMMARY.md", path.display());
    }
    let script = text(Path::new("docs/build_book"));
    let list = script.split("<<<\"").nth(1).and_then(|rest| rest.split('"').next()).expect("a list of files");
    let taken: Vec<&Path> = list.split_whitespace().map(Path::new).collect();
    for page in &pages {
        for (line, link) in links(&text(page)) {
            let Some(to) = target(page, &link) else { continue };
            let place = format!("{}:{line}: {link}", page.display());
            assert!(taken.iter().any(|path| to.starts_with(path)), "{place}: not taken by docs/build_book");
            assert!(!is_page(&to) || listed.contains(&to), "{place}: not in docs/SUMMARY.md");
        }
    }
}

/// Where mdBook is installed, the book builds, and no link or picture of it leads nowhere.
#[test]
fn the_book_builds() {
    if papers::is_installed("mdbook") {
        let directory = tempfile::tempdir().expect("temporary directory");
        let output = std::process::Command::new(repository().join("docs/build_book"))
            .arg(directory.path())
            .output()
            .expect("starts");
        assert!(output.status.success(), "{}", mpirun::text(&output));
        let top = directory.path().join("html");
        let (mut checked, mut broken) = (0, Vec::new());
        for page in pages() {
            let page = page.with_extension("html");
            let html = std::fs::read_to_string(top.join(&page)).expect("a page");
            let body =
                html.split("<main>").nth(1).and_then(|rest| rest.split("</main>").next()).expect("text");
            for attribute in ["href=\"", "src=\""] {
                for link in body.split(attribute).skip(1).filter_map(|rest| rest.split('"').next()) {
                    let Some(to) = target(&page, link) else { continue };
                    checked += 1;
                    let heading = link.split_once('#').map_or("", |(_, heading)| heading);
                    let leads = match std::fs::read(top.join(&to)) {
                        Ok(bytes) => {
                            heading.is_empty()
                                || String::from_utf8_lossy(&bytes).contains(&format!("id=\"{heading}\""))
                        }
                        Err(_) => top.join(&to).is_dir(),
                    };
                    if !leads {
                        broken.push(format!("{}: {link}", page.display()));
                    }
                }
            }
        }
        assert!(checked >= 300, "{checked} links");
        assert!(broken.is_empty(), "broken links:\n{}", broken.join("\n"));
    } else {
        println!("passed over: there is no mdbook (cargo install mdbook)");
    }
}

/// Each problem of the guide has a job that the program takes without a warning, and the words in code are
/// keys, models or columns.
#[test]
fn problems_of_practice_have_jobs_and_their_keys_are_there() {
    let page = text(Path::new("docs/guide/which-keys.md"));
    let known = text(Path::new("docs/job-file.md"));
    let known: BTreeSet<&str> = known.split(|c: char| !(c.is_alphanumeric() || c == '_')).collect();
    let jobs: Vec<PathBuf> = links(&page)
        .iter()
        .filter_map(|(_, link)| target(Path::new("docs/guide/which-keys.md"), link))
        .filter(|path| path.starts_with("tests/jobs/which_keys"))
        .collect();
    let there = files(Path::new("tests/jobs/which_keys"));
    assert_eq!((jobs.len(), jobs.iter().collect::<BTreeSet<_>>()), (21, there.iter().collect()));
    for job in jobs {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_agimp"))
            .arg("check")
            .arg(repository().join(&job))
            .output()
            .expect("starts");
        let said = mpirun::text(&output);
        assert!(output.status.success() && !said.contains("warning"), "{}: {said}", job.display());
    }
    let code = page.split('`').skip(1).step_by(2);
    for word in code.flat_map(|code| code.split(|c: char| !(c.is_alphanumeric() || c == '_'))) {
        let is_column = ["force_", "torque_"].iter().any(|start| word.starts_with(start));
        let is_number = word.bytes().all(|byte| byte.is_ascii_digit());
        assert!(is_column || is_number || word == "agimp" || known.contains(word), "found no key {word:?}");
    }
}

/// README says how many lines of the verification fail, as the page does.
#[test]
fn the_readme_counts_the_lines_that_fail() {
    let page = text(Path::new("docs/verification.md"));
    let line = page.lines().find(|line| line.ends_with(" fail.")).expect("a count");
    let count = line.trim_end_matches(" fail.");
    assert!(text(Path::new("README.md")).contains(count), "README.md does not say {count:?}");
}

/// Each study has a quick form, and one command runs all of them.
#[test]
fn every_study_has_a_quick_form() {
    let all = text(Path::new("studies/quick"));
    let mut studies = 0;
    for folder in std::fs::read_dir(repository().join("studies")).expect("a folder") {
        let folder = folder.expect("an entry").path();
        let script = ["run", "compare"].map(|name| folder.join(name)).into_iter().find(|path| path.exists());
        let Some(script) = script else { continue };
        studies += 1;
        let name = folder.file_name().expect("a name").to_string_lossy().into_owned();
        let script = std::fs::read_to_string(script).expect("a script");
        assert!(script.contains("--quick"), "{name} has no quick form");
        assert!(all.contains(&name), "studies/quick does not run {name}");
    }
    assert_eq!(studies, 8);
}
