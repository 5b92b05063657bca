//! Problems of the verification suite that take seconds: within the tolerances of
//! `studies/verification/expected.toml`, and the same numbers, to the last bit, on 1 and 2 ranks.
#[path = "../studies/verification/lines.rs"]
mod lines;
#[path = "../studies/verification/page.rs"]
#[allow(dead_code, reason = "the suite uses all of it")]
mod page;
#[path = "../studies/verification/plot.rs"]
mod plot;
#[path = "../studies/verification/problems/mod.rs"]
#[allow(dead_code, reason = "the suite runs all of them")]
mod problems;
#[path = "../studies/verification/runs.rs"]
#[allow(dead_code, reason = "the suite uses all of it")]
mod runs;

use runs::{Effort, Runs};
use std::path::{Path, PathBuf};

/// The value, or the end of the test with the reason.
fn checked<T, E: std::fmt::Display>(result: Result<T, E>) -> T {
    result.unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn quick_problems_pass_and_do_not_depend_on_ranks() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let top = Path::new(env!("CARGO_MANIFEST_DIR"));
    let found: Vec<Vec<(String, f64)>> = [1, 2]
        .into_iter()
        .map(|ranks| {
            let runs = Runs {
                agimp: PathBuf::from(env!("CARGO_BIN_EXE_agimp")),
                top: top.to_path_buf(),
                folder: directory.path().join(ranks.to_string()),
                ranks,
                effort: Effort::Quick,
                set: Vec::new(),
            };
            let mut page = page::Page::new(&directory.path().join("page.md"), top);
            let quick = ["column", "cantilever", "disks", "drivers", "weights"];
            for (_, problem) in problems::ALL.into_iter().filter(|(name, _)| quick.contains(name)) {
                problem(&runs, &mut page);
            }
            let (_, unknown) = page.lines().failures();
            assert!(unknown.is_empty(), "{unknown:?}");
            page.lines().found().to_vec()
        })
        .collect();
    assert!(found[0].len() > 15);
    assert_eq!(found[0], found[1]);
}
