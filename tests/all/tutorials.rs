//! The tutorials are true: each runs word by word in an empty directory, and gives the results that it shows.
//!
//! * A fenced block after a line "Save as `NAME`:" is written to that file.
//! * A block `sh` runs; a block `text` after it shows some of what it prints, line by line and in order.
//!   Numbers may differ by 1 %, as those of another build do, `…` stands for any words, and punctuation does
//!   not count.
//! * Bold numbers are among those printed.
//! * Files that the text names in code exist at the end, and so do the pictures that it shows.

use crate::common::mpirun;
use crate::common::papers;
use std::path::Path;

use crate::common::papers::{bash, blocks, commands, text};

/// The words of a line, without the punctuation of tables and of JSON.
fn words(line: &str) -> Vec<&str> {
    let separates = |c: char| c.is_whitespace() || matches!(c, ',' | '"' | '[' | ']' | ':' | '|');
    line.split(separates).filter(|word| !word.is_empty()).collect()
}

/// Whether two words are the same, or numbers that differ by less than 1 %.
fn agree(shown: &str, printed: &str) -> bool {
    match (shown.parse::<f64>(), printed.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= 0.01 * a.abs().max(b.abs()),
        _ => shown == printed,
    }
}

/// Whether a printed line shows these words in a row; `…` stands for any.
fn shows(shown: &[&str], printed: &[&str]) -> bool {
    let parts: Vec<&[&str]> = shown.split(|word| *word == "…").collect();
    let mut rest = printed;
    parts.iter().all(|part| {
        let starts = |at: &usize| rest[*at..].iter().zip(*part).all(|(printed, shown)| agree(shown, printed));
        match (0..=rest.len().saturating_sub(part.len())).find(|at| rest.len() >= part.len() && starts(at)) {
            Some(at) => {
                rest = &rest[at + part.len()..];
                true
            }
            None => false,
        }
    })
}

/// Runs `docs/tutorials/NAME.md`.
fn follow(name: &str) {
    let paper = Path::new("docs/tutorials").join(name).with_extension("md");
    let tutorial = text(&paper);
    let directory = tempfile::tempdir().expect("temporary directory");
    let here = directory.path();
    let programs = Path::new(env!("CARGO_BIN_EXE_agimp")).parent().expect("a directory");
    let environment = format!(". {}", mpirun::environment().display());
    let (mut printed, mut all, mut runs) = (String::new(), String::new(), 0);
    for block in blocks(&tutorial) {
        let place = format!("{}:{}", paper.display(), block.line);
        if let Some(file) = block.before.strip_prefix("Save as `").and_then(|rest| rest.strip_suffix("`:")) {
            assert!(!here.join(file).exists(), "{place}: {file} exists");
            std::fs::write(here.join(file), &block.text).expect("written");
        } else if block.language == "sh" {
            let Some(commands) = commands(&paper, &block) else { continue };
            // The program must be found, but not the rest of its directory.
            let output = bash(here, programs, &environment, &commands);
            printed = mpirun::text(&output);
            assert!(output.status.success(), "{place}:\n{commands}\n{printed}");
            all.push_str(&printed);
            runs += 1;
        } else if block.language == "text" {
            let mut lines = printed.lines().map(words);
            for shown in block.text.lines() {
                let found = lines.any(|line| shows(&words(shown), &line));
                assert!(found, "{place}: not printed there: {shown}\n{printed}");
            }
        } else {
            panic!("{place}: a block that is neither a file, nor commands, nor what they print");
        }
    }
    assert!(runs >= 3, "{runs} commands");
    let prose: Vec<(usize, &str)> = outside_of_blocks(&tutorial).collect();
    let mut named = 0;
    for (line, text) in prose {
        let place = format!("{}:{line}", paper.display());
        for number in text.split("**").skip(1).step_by(2) {
            let is_printed = all.lines().any(|line| words(line).iter().any(|word| agree(number, word)));
            assert!(is_printed && number.parse::<f64>().is_ok(), "{place}: {number} is not printed");
        }
        for code in text.split('`').skip(1).step_by(2) {
            let ending = Path::new(code).extension().and_then(|ending| ending.to_str());
            let is_file = !code.contains(' ')
                && ending
                    .is_some_and(|e| ["toml", "py", "html", "png", "gif", "svg", "csv", "hdf"].contains(&e));
            assert!(!is_file || here.join(code).exists(), "{place}: there is no {code}");
            named += usize::from(is_file);
        }
        for picture in text.split("![").skip(1).filter_map(|part| part.split("](").nth(1)?.split(')').next())
        {
            assert!(here.join(picture).exists(), "{place}: {picture} is not made");
            assert!(papers::repository().join("docs/tutorials").join(picture).exists(), "{place}: {picture}");
            named += 1;
        }
    }
    assert!(named >= 2, "{named} files");
}

/// Lines outside of fenced blocks, with their numbers from 1.
fn outside_of_blocks(paper: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut in_block = false;
    paper.lines().enumerate().filter_map(move |(i, line)| {
        let is_fence = line.starts_with("```");
        in_block ^= is_fence;
        (!in_block && !is_fence).then_some((i + 1, line))
    })
}

#[test]
fn soil() {
    follow("soil");
}

#[test]
#[ignore = "nightly: takes a minute"]
fn safety_nightly() {
    follow("safety");
}

#[test]
fn metal() {
    follow("metal");
}

#[test]
#[ignore = "nightly: takes a minute"]
fn effects_nightly() {
    follow("effects");
}

#[test]
fn research() {
    follow("research");
}

#[test]
fn every_tutorial_is_followed() {
    let source = text(Path::new("tests/all/tutorials.rs"));
    let mut tutorials = 0;
    for path in papers::files(Path::new("docs/tutorials")) {
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        if path.extension().is_some_and(|e| e == "md") {
            assert!(source.contains(&format!("follow({name:?})")), "{name}");
            tutorials += 1;
        }
    }
    assert!(tutorials >= 5, "{tutorials}");
}

/// Texts that these tests take for the same, and texts that they do not.
#[test]
fn lines_are_compared_by_words() {
    let shows = |shown, printed| shows(&words(shown), &words(printed));
    assert!(shows("40e3,finished,15.33", "40e3,finished,15.330430324063089,5.41"));
    assert!(shows("particles … 25688", "| particles | on rank 0 | 25688 |"));
    assert!(!shows("40e3,finished,15.53", "40e3,finished,15.330430324063089"));
    assert!(!shows("40e3,finished", "40e3,failed"));
    assert!(!shows("a b", "a"));
}
