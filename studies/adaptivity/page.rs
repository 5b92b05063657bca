//! The page with the results.
use std::fmt::Write as _;

use toml::Table;

use crate::Scene;
use crate::derive::Levels;
use crate::runs::Run;

/// A run with its headline quantities.
pub(crate) type Result = (Run, Vec<(&'static str, f64)>);

/// What the page is about. `floor`: resident memory of an empty job, bytes.
pub(crate) fn head(floor: f64) -> String {
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    format!(
        "# What refinement gains\n\n\
         Written by `studies/adaptivity/compare`. Each scene runs twice on one rank with {cores} threads: as it is in `jobs/`, and with cells of the finest level everywhere and no refinement. Where stated, all levels are one lower than in the job, so cells are twice as wide, and so are the layers of leaves around regions that need fine leaves. All levels use the same time step, that of the finest level with particles. The ratio of the particle-steps, the sums of the particles over all steps, therefore bounds what refinement can gain.\n\n\
         Memory is the greatest resident memory in the telemetry. {:.0} MB of it are the program itself with its libraries, measured with a job of very few particles; the last row excludes it. Processor time is the sum over all threads; on a machine that also runs other programs it is a better measure than wall time.\n\n",
        floor / 1e6
    )
}

/// The section of a scene.
pub(crate) fn section(
    scene: &Scene,
    about: &str,
    job: &Table,
    is_lower: bool,
    levels: &Levels,
    results: &[Result; 2],
    floor: f64,
) -> String {
    let [(adaptive, values), (uniform, exact)] = results;
    let mut text = String::new();
    let title = job.get("title").and_then(toml::Value::as_str).unwrap_or(scene.job);
    let _ = writeln!(text, "## {title}\n\n`jobs/{}.toml`. {}", scene.job, about.trim());
    let _ = writeln!(
        text,
        "\nLevels {} to {}{}; cells of the coarsest are {} times as wide as those of the finest.\n",
        levels.base,
        levels.finest,
        if is_lower { ", one lower than in the job" } else { "" },
        1 << (levels.finest - levels.base)
    );
    let _ = writeln!(text, "| | refined | finest everywhere | ratio |\n| --- | --- | --- | --- |");
    let mut row = |name: &str, values: [f64; 2], digits: usize| {
        let [a, u] = values;
        let _ = writeln!(text, "| {name} | {a:.digits$} | {u:.digits$} | {:.2} |", u / a);
    };
    let (few, many) = (adaptive.particles(), uniform.particles());
    for (name, which) in
        ["particles at the start", "particles at most", "particles at the end"].iter().zip(0..)
    {
        row(name, [few[which] as f64, many[which] as f64], 0);
    }
    row("steps", [adaptive.steps() as f64, uniform.steps() as f64], 0);
    let steps = [adaptive.particle_steps(), uniform.particle_steps()];
    row("particle-steps, millions", steps.map(|steps| steps / 1e6), 0);
    row("wall time, s", [adaptive.wall, uniform.wall], 1);
    row("processor time, s", [adaptive.processor, uniform.processor], 1);
    let each = [adaptive.processor / steps[0], uniform.processor / steps[1]];
    row("processor time per particle-step, ns", each.map(|seconds| seconds * 1e9), 0);
    let memory = [adaptive.memory(), uniform.memory()];
    row("memory, MB", memory.map(|bytes| bytes / 1e6), 0);
    row("memory without the program, MB", memory.map(|bytes| (bytes - floor) / 1e6), 0);
    let _ =
        writeln!(text, "\n| | refined, mm | finest everywhere, mm | difference |\n| --- | --- | --- | --- |");
    for ((name, value), (_, exact)) in values.iter().zip(exact) {
        let difference = 100.0 * (value / exact - 1.0);
        let _ = writeln!(text, "| {name} | {:.3} | {:.3} | {difference:+.2} % |", value * 1e3, exact * 1e3);
    }
    let regrids = adaptive.records.last().and_then(|record| record.resampled).map_or(0, |done| done.regrids);
    let _ = writeln!(
        text,
        "\nThe tree changed {regrids} times; checking it, changing it, splitting and merging took {:.1} % of the time.\n",
        100.0 * adaptive.phase("regrid") / adaptive.recorded()
    );
    text
}
