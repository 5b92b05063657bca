//! The examples of `docs/extending.md`, followed word by word on a copy of the sources: the new material, the
//! new criterion, the new load and the new probe are in the schema, a job with them runs, and the tests of the
//! material pass with those of the other models.
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::history::History;

const PAGE: &str = include_str!("../../docs/extending.md");

/// The block of code that follows a marker in the page.
fn block(marker: &str) -> &'static str {
    let after = PAGE.split_once(marker).unwrap_or_else(|| panic!("no {marker} in docs/extending.md")).1;
    let (_, code) = after.split_once("```").expect("a block of code");
    let (_, code) = code.split_once('\n').expect("a line with the language");
    code.split_once("```").expect("the end of the block").0
}

fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        std::fs::create_dir_all(to).expect("directory");
        for entry in std::fs::read_dir(from).expect("directory") {
            let entry = entry.expect("entry");
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        std::fs::copy(from, to).expect("copy");
    }
}

/// A copy of what the build needs, with the file and the lines of the example.
fn extended(root: &Path) -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("temporary directory");
    for part in [
        "Cargo.toml",
        "Cargo.lock",
        ".cargo",
        "src",
        "post",
        "cli",
        "partition",
        "benches",
        "jobs",
        "studies",
        "tests",
        "docs",
        "examples",
    ] {
        copy(&root.join(part), &directory.path().join(part));
    }
    let root = directory.path();
    add(root, "src/material/laws", "gel", "pub mod hencky;", "materials!");
    add(root, "src/adaptivity/criteria", "speed", "pub mod stretch;", "criteria!");
    for (file, line, code) in insertions() {
        let path = root.join(file);
        let text = std::fs::read_to_string(&path).expect("a file of the sources");
        std::fs::write(&path, insert(&text, line, code).expect("one place")).expect("the file");
    }
    directory
}

/// Adds the file of an example to a folder, its module ahead of another one, and its line to the end of the
/// list.
fn add(root: &Path, folder: &str, name: &str, next: &str, list: &str) {
    let file = format!("{folder}/{name}.rs");
    std::fs::write(root.join(&file), block(&format!("<!-- file: {file} -->"))).expect("file");
    let path = root.join(folder).join("mod.rs");
    let text = std::fs::read_to_string(&path).expect("list");
    let end = text.rfind('}').expect("the end of the list");
    let line = block(&format!("<!-- line: {folder}/mod.rs: {list} {{ -->"));
    let text = format!("{}{line}{}", &text[..end], &text[end..]);
    std::fs::write(&path, text.replacen(next, &format!("pub mod {name};\n{next}"), 1)).expect("list");
}

/// The insertions of the page: file, the line below which they stand, and the code.
fn insertions() -> Vec<(&'static str, &'static str, &'static str)> {
    let marker = |rest: &'static str| {
        let (place, rest) = rest.split_once(" -->").expect("the end of a marker");
        let (file, line) = place.split_once(": ").expect("a file and a line");
        let (_, code) = rest.split_once("```rust\n").expect("a block of code");
        (file, line, code.split_once("```").expect("the end of the block").0)
    };
    PAGE.split("<!-- below: ").skip(1).map(marker).collect()
}

/// Puts the code of an insertion below its line, which the file has once.
fn insert(text: &str, line: &str, code: &str) -> Result<String, usize> {
    let places: Vec<usize> = text.match_indices(line).map(|(at, _)| at).collect();
    let [at] = places[..] else { return Err(places.len()) };
    let end = at + text[at..].find('\n').expect("the end of the line") + 1;
    Ok(format!("{}{code}{}", &text[..end], &text[end..]))
}

/// Each line below which the page inserts code stands once in its file, and a load and a probe touch at most
/// three files.
#[test]
fn insertions_have_their_places() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for heading in ["## A load", "## A probe"] {
        let (_, section) = PAGE.split_once(heading).expect("the section");
        let section = section.split("\n## ").next().expect("its text");
        let here = insertions().into_iter().filter(|(_, _, code)| section.contains(code));
        let files: std::collections::BTreeSet<&str> = here.map(|(file, ..)| file).collect();
        assert!((1..=3).contains(&files.len()), "{heading}: {files:?}");
    }
    for (file, line, code) in insertions() {
        let text = std::fs::read_to_string(root.join(file)).expect("a file of the sources");
        assert!(insert(&text, line, code).is_ok(), "{file}: {:?} times {line}", insert(&text, line, code));
    }
}

/// The lists to which the page adds a line are the ends of their files, where the page says that they are.
#[test]
fn lists_are_the_ends_of_their_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (folder, list) in [("src/material/laws", "materials!"), ("src/adaptivity/criteria", "criteria!")] {
        let text = std::fs::read_to_string(root.join(folder).join("mod.rs")).expect("list");
        let (_, after) = text.rsplit_once(&format!("\n{list} {{\n")).expect("the list");
        let end = after.find("\n}").expect("the end of the list");
        assert_eq!(&after[end..], "\n}\n", "{folder}/mod.rs goes on after {list}");
    }
}

#[test]
#[ignore = "nightly: compiles the crate twice"]
fn examples_of_the_page_do_what_it_says() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let copy = extended(&root);
    let cargo = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO"))
            .args(arguments)
            .current_dir(copy.path())
            // Dependencies are those that are built already.
            .env("CARGO_TARGET_DIR", root.join("target"))
            .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
            .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
            .output()
            .expect("cargo starts");
        let (stdout, stderr) = (
            String::from_utf8_lossy(&output.stdout).into_owned(),
            String::from_utf8_lossy(&output.stderr).into_owned(),
        );
        assert!(output.status.success(), "cargo {arguments:?}\n{stdout}\n{stderr}");
        stdout
    };
    let schema = cargo(&["run", "--quiet", "--bin", "agimp", "--", "schema"]);
    assert!(schema.contains("\"gel\"") && schema.contains("Bulk modulus, Pa; above 0."), "{schema}");
    assert!(schema.contains("\"air_drag\"") && schema.contains("Mean density, kg/m³."), "{schema}");
    assert!(schema.contains("\"speed\"") && schema.contains("Where a particle is fast."), "{schema}");

    let job = std::fs::read_to_string(root.join("jobs/elastic_cubes.toml")).expect("job");
    let (head, rest) = job.split_once("[[materials]]").expect("materials");
    let (_, tail) = rest.split_once("\n[[").expect("the next table");
    let name =
        rest.lines().find_map(|line| line.strip_prefix("name = \"")?.strip_suffix('"')).expect("a name");
    let material = block("<!-- job -->").replace("jelly", name);
    let path = copy.path().join("jelly.toml");
    let (load, probe) = (block("<!-- load -->"), block("<!-- probe -->"));
    let criterion = block("<!-- criterion -->");
    std::fs::write(&path, format!("{head}{material}\n[[{tail}\n{load}\n{probe}\n{criterion}")).expect("job");
    let checked = cargo(&["run", "--quiet", "--bin", "agimp", "--", "check", &path.to_string_lossy()]);
    assert!(checked.contains("particles"), "{checked}");
    // The cubes move at 2 m/s, so their leaves are of that level at the start.
    assert!(checked.contains("speed at least 1 m/s, coarsening below 500 mm/s"), "{checked}");
    let filled: Vec<&str> = checked.lines().filter(|line| line.trim_start().starts_with("3 ")).collect();
    assert!(checked.contains("at the start, with the criteria") && !filled.is_empty(), "{checked}");

    // A cube in free flight at 2 m/s, before the two meet: v = v₀ / (1 + c v₀ t).
    let (job, out) = (path.to_string_lossy(), copy.path().join("out/jelly"));
    let out = out.to_string_lossy();
    cargo(&["run", "--quiet", "--bin", "agimp", "--", "run", &job, "--end", "0.05", "--out", &out]);
    let history = History::read(copy.path(), "jelly");
    let (v, density) = (history.last("velocity_one_x"), history.last("density_one"));
    let expected = 2.0 / (1.0 + 0.5 * 2.0 * 0.05);
    assert!((v / expected - 1.0).abs() < 1e-3, "{v} m/s for {expected}");
    assert!((density / 1000.0 - 1.0).abs() < 1e-3, "{density} kg/m³");

    let tests = cargo(&["test", "--quiet", "-p", "agimp-solver", "material::"]);
    assert!(tests.contains("test result: ok"), "{tests}");
}
