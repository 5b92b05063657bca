//! Compares adaptive runs with runs whose cells are as fine as the finest everywhere, and writes a page about it.
//!
//! `studies/adaptivity/compare` builds and starts it.
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[path = "../common.rs"]
mod common;
mod derive;
mod headline;
mod page;
mod runs;

use common::checked;
use headline::Headline;

/// A job that refines; the page quotes the text of the same name beside this file.
struct Scene {
    /// Name of the job file in `jobs/`.
    job: &'static str,
    /// What to compare.
    headline: Headline,
    /// Whether the uniform run of the job as it is takes so long that all levels are one lower unless that is wanted.
    is_long: bool,
}

const SCENES: [Scene; 3] = [
    Scene { job: "column_collapse_tall", headline: Headline::Collapse, is_long: true },
    Scene { job: "cylinder_in_sand", headline: Headline::Penetration, is_long: false },
    Scene { job: "taylor_bar", headline: Headline::Bar, is_long: true },
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((page, rest)) = arguments.split_first() else {
        eprintln!("usage: adaptivity PAGE.md [--quick | --full] [SCENE...]");
        return ExitCode::from(2);
    };
    let (flags, names): (Vec<&String>, Vec<&String>) = rest.iter().partition(|text| text.starts_with('-'));
    let unknown = flags
        .iter()
        .find(|flag| !["--quick", "--full"].contains(&flag.as_str()))
        .or_else(|| names.iter().find(|name| SCENES.iter().all(|scene| scene.job != name.as_str())));
    if let Some(unknown) = unknown {
        eprintln!(
            "found \"{unknown}\"; expected --quick, --full or scenes of {}",
            SCENES.map(|s| s.job).join(", ")
        );
        return ExitCode::from(2);
    }
    let [quick, full] = ["--quick", "--full"].map(|known| flags.iter().any(|flag| *flag == known));
    if quick && full {
        eprintln!("found both --quick and --full; expected one");
        return ExitCode::from(2);
    }
    let folder = PathBuf::from("target/adaptivity");
    checked(std::fs::create_dir_all(&folder), folder.display());
    let floor = runs::memory_of_an_empty_job(&folder);
    let mut text = page::head(floor);
    for scene in SCENES.iter().filter(|scene| names.is_empty() || names.iter().any(|name| *name == scene.job))
    {
        let is_lower = quick || scene.is_long && !full;
        text.push_str(&compare(scene, is_lower, floor, &folder));
    }
    let regrid = Path::new("studies/adaptivity/regrid.md");
    text.push_str(&checked(std::fs::read_to_string(regrid), regrid.display()));
    checked(std::fs::write(page, text), page);
    println!("{page} written");
    ExitCode::SUCCESS
}

/// Runs a scene in both ways, with all levels one lower if `is_lower`; its section of the page.
fn compare(scene: &Scene, is_lower: bool, floor: f64, folder: &Path) -> String {
    let path = Path::new("jobs").join(scene.job).with_extension("toml");
    let text = checked(std::fs::read_to_string(&path), path.display());
    let job: toml::Table = checked(toml::from_str(&text), path.display());
    let levels = checked(derive::Levels::of(&job, is_lower), path.display());
    let adaptive = derive::adaptive(&job, is_lower);
    let uniform = derive::uniform(&job, &levels);
    let results = [("adaptive", adaptive), ("uniform", uniform)].map(|(kind, job)| {
        println!("{} {kind}", scene.job);
        let run = runs::run(&job, &format!("{}_{kind}", scene.job), folder);
        let values = checked(scene.headline.values(&job, &run), scene.job);
        (run, values)
    });
    let about = Path::new("studies/adaptivity").join(scene.job).with_extension("md");
    let about = checked(std::fs::read_to_string(&about), about.display());
    page::section(scene, &about, &job, is_lower, &levels, &results, floor)
}
