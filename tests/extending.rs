//! The example of `docs/extending.md`, followed word by word on a copy of the sources: the new material is in the schema, a
//! job with it is checked, and its tests pass with those of the other models.
use std::path::{Path, PathBuf};
use std::process::Command;

const PAGE: &str = include_str!("../docs/extending.md");

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
    let law = directory.path().join("src/material/laws/gel.rs");
    std::fs::write(law, block("<!-- file: src/material/laws/gel.rs -->")).expect("law");
    let list = directory.path().join("src/material/laws/mod.rs");
    let text = std::fs::read_to_string(&list).expect("list");
    let end = text.rfind('}').expect("the end of the list");
    let line = block("<!-- line: src/material/laws/mod.rs: materials! { -->");
    let text = format!("{}{line}{}", &text[..end], &text[end..]);
    std::fs::write(&list, text.replacen("pub mod hencky;", "pub mod gel;\npub mod hencky;", 1))
        .expect("list");
    directory
}

#[test]
fn a_material_is_one_file_and_one_line() {
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

    let job = std::fs::read_to_string(root.join("jobs/elastic_cubes.toml")).expect("job");
    let (head, rest) = job.split_once("[[materials]]").expect("materials");
    let (_, tail) = rest.split_once("\n[[").expect("the next table");
    let name =
        rest.lines().find_map(|line| line.strip_prefix("name = \"")?.strip_suffix('"')).expect("a name");
    let material = block("<!-- job -->").replace("jelly", name);
    let path = copy.path().join("jelly.toml");
    std::fs::write(&path, format!("{head}{material}\n[[{tail}")).expect("job");
    let checked = cargo(&["run", "--quiet", "--bin", "agimp", "--", "check", &path.to_string_lossy()]);
    assert!(checked.contains("particles"), "{checked}");

    let tests = cargo(&["test", "--quiet", "--lib", "material::"]);
    assert!(tests.contains("test result: ok"), "{tests}");
}
