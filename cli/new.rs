//! `agimp new`: a commented job file to start from.
use super::Failure;
use agimp::io::whole_file::write_whole;
use agimp::job::{self, Settings};
use agimp::text::{excerpt, nearest, shell_word};
use std::borrow::Cow;
use std::ffi::OsStr;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

/// A job to start from: one of the project itself.
struct Template {
    name: &'static str,
    text: &'static str,
    /// Settings with which it runs in under a minute on two cores, where the job of the project takes longer.
    quick: &'static [&'static str],
    /// Files that the job names, relative to it, with their contents.
    files: &'static [(&'static str, &'static str)],
}

/// Templates from `jobs/`: a name, perhaps files, perhaps settings.
macro_rules! templates {
    ($($name:literal $(with $($file:literal),+)? $(quick $($setting:literal),+)?;)+) => {
        &[$(Template {
            name: $name,
            text: include_str!(concat!("../jobs/", $name, ".toml")),
            quick: &[$($($setting),+)?],
            files: &[$($(($file, include_str!(concat!("../jobs/", $file)))),+)?],
        }),+]
    };
}

/// Templates by discipline (granular flow, ground, other flow, solids, metal, effects).
const TEMPLATES: &[Template] = templates![
    "column_collapse_2d";
    "column_collapse_mohr_coulomb";
    "column_collapse";
    "column_collapse_axisymmetric";
    "column_collapse_tall" quick "tree.base_level=0", "adaptivity.criteria.0.level=1", "adaptivity.criteria.1.level=2";
    "silo";
    "hopper" with "meshes/hopper.obj", "meshes/glass.obj" quick "time.end=0.2";
    "cylinder_in_sand";
    "wheel" with "meshes/wheel.obj" quick "time.end=1.2";
    "landslide" with "terrain/jacksboro.asc" quick "adaptivity.criteria.0.level=3";
    "slope_failure";
    "shaken_slope" with "records/tapered_sine.csv";
    "excavation";
    "excavation_load_steps";
    "retaining_wall_load_steps";
    "slope_factor_of_safety";
    "ground_at_rest";
    "drawdown";
    "dike";
    "undrained_footing";
    "strip_footing";
    "clay_footing";
    "footing_load_steps";
    "cone_penetration";
    "dam_break";
    "sod";
    "snowball";
    "cantilever";
    "thick_cylinder";
    "thick_cylinder_load_steps";
    "cavity_expansion_axisymmetric";
    "rubber_block_load_steps";
    "oblique_disks";
    "elastic_cubes";
    "perforated_plate";
    "block_on_edge";
    "charge_in_sand";
    "taylor_bar" quick "tree.base_level=1", "adaptivity.criteria.0.level=3", "adaptivity.criteria.1.level=2";
    "taylor_bar_johnson_cook" quick "tree.base_level=1", "adaptivity.criteria.0.level=2", "adaptivity.criteria.1.level=2";
    "taylor_bar_johnson_cook_axisymmetric" quick "tree.base_level=2";
    "bunny" with "meshes/bunny.obj" quick "tree.regions.0.level=2";
    "snow_bunny" with "meshes/bunny.obj";
];

/// File by which editors complete and check job files.
const SCHEMA: &str = "agimp.schema.json";

/// Arguments of `agimp new`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Name of the template; without it, the list of templates.
    #[arg(value_name = "TEMPLATE")]
    first: Option<String>,
    /// File to write; TEMPLATE.toml by default. An existing file remains unchanged.
    file: Option<PathBuf>,
    /// Name of the template; then the file is the only argument.
    #[arg(long, value_name = "TEMPLATE", conflicts_with = "file")]
    template: Option<String>,
    /// List the templates and write nothing.
    #[arg(long)]
    list: bool,
    /// Write the full job of the project, even if it takes longer than a minute.
    #[arg(long)]
    full: bool,
}

/// Writes the template with the files that it needs, or lists all.
///
/// # Errors
/// No such template, the file exists already, or it cannot be written.
pub(super) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    let (name, file) = match (&arguments.template, &arguments.first) {
        (Some(name), file) => (Some(name), file.as_ref().map(PathBuf::from)),
        (None, name) => (name.as_ref(), arguments.file.clone()),
    };
    let Some(name) = name.map(String::as_str).filter(|_| !arguments.list) else {
        for template in TEMPLATES {
            writeln!(out, "{:28} {}", template.name, title(template.text))?;
        }
        return Ok(());
    };
    let Some(template) = TEMPLATES.iter().find(|known| known.name == name) else {
        let known: Vec<&str> = TEMPLATES.iter().map(|known| known.name).collect();
        let meant = nearest(name, known.iter().copied());
        let guess = meant.map_or(String::new(), |meant| format!("; did you mean \"{meant}\"?"));
        return Err(Failure::Usage(format!(
            "found the template \"{}\"; expected one of {}{guess}",
            excerpt(name, 60),
            known.join(", ")
        )));
    };
    let path = file.unwrap_or_else(|| format!("{name}.toml").into());
    let failure = |error: std::io::Error| match error.kind() {
        ErrorKind::AlreadyExists => {
            Failure::Usage(format!("{}: exists already and remains unchanged", path.display()))
        }
        _ => Failure::Run(format!("{}: cannot be written: {error}", path.display())),
    };
    let text = template.text(arguments.full)?;
    let text = renamed(&text, name, &path);
    let mut file = OpenOptions::new().write(true).create_new(true).open(&path).map_err(failure)?;
    // Editors look for the schema beside the job.
    file.write_all(format!("#:schema ./{SCHEMA}\n{text}").as_bytes()).map_err(failure)?;
    writeln!(out, "{} written; next: agimp check {}", path.display(), shell_word(&path))?;
    for (name, contents) in template.files {
        beside(&path, name, contents, "the job reads it")?;
    }
    let schema = serde_json::to_string_pretty(&job::schema()).map_err(std::io::Error::other)?;
    beside(&path, SCHEMA, &schema, "editors use it to complete and check job files")
}

impl Template {
    /// The job, with the settings that make it quick unless `full`.
    fn text(&self, full: bool) -> Result<String, Failure> {
        if full || self.quick.is_empty() {
            return Ok(self.text.to_owned());
        }
        let mut settings = Settings::default();
        self.quick.iter().try_for_each(|setting| settings.set(setting)).map_err(Failure::Usage)?;
        let text = job::with_settings(self.text, self.name.as_ref(), &settings)?;
        let list = self.quick.join(", ");
        let name = self.name;
        Ok(format!(
            "# This job runs in less than a minute, with {list}.\n# The comments below describe the full job: agimp new {name} --full\n#\n{text}"
        ))
    }
}

/// The text of a template with the name of its new file, and those of the results, in the commands of its
/// comments.
fn renamed(text: &str, name: &str, path: &Path) -> String {
    let word = shell_word(path);
    let stem = path.file_stem().map_or(Cow::from(name), OsStr::to_string_lossy);
    let (job, results) = (format!("jobs/{name}.toml"), format!("out/{name}/{name}."));
    let line = |line: &str| match line.starts_with('#') {
        true => line.replace(&job, &excerpt(&word, 200)).replace(&results, &format!("out/{stem}/{stem}.")),
        false => line.to_owned(),
    };
    text.split_inclusive('\n').map(line).collect()
}

/// Writes a file that belongs to a job, unless it exists.
fn beside(job: &Path, name: &str, contents: &str, purpose: &str) -> Result<(), Failure> {
    let path = job.with_file_name(name);
    if path.exists() {
        return Ok(());
    }
    let write = || {
        path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        write_whole(&path, contents.as_bytes())
    };
    write().map_err(|error| Failure::Run(format!("{}: cannot be written: {error}", path.display())))?;
    writeln!(std::io::stdout(), "{} written: {purpose}", path.display())?;
    Ok(())
}

/// The title that the job gives itself.
fn title(text: &str) -> &str {
    text.lines()
        .find_map(|line| line.strip_prefix("title = \""))
        .and_then(|rest| rest.strip_suffix('"'))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_are_valid_jobs_with_titles() {
        for template in TEMPLATES {
            assert!(!title(template.text).is_empty(), "{}", template.name);
            for full in [false, true] {
                let text = template.text(full).map_err(|failure| failure.to_string()).expect(template.name);
                // Files are opened where the project has them.
                let path = Path::new("jobs").join(template.name);
                let faults = job::parse(&text, &path).err().unwrap_or_default();
                assert!(faults.is_empty(), "{}: {faults:?}", template.name);
                assert_eq!(full || template.quick.is_empty(), text == template.text, "{}", template.name);
            }
        }
    }
}
