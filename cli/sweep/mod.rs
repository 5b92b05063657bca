//! `agimp sweep`: runs a job for each combination of values, and puts the results into one table.
//!
//! Each run is a process of its own (`agimp run`, by default alone, or started by a launcher such as
//! `mpirun -n 4`) with a directory of its own. A run that has its report is finished and not done again, so
//! that the same command goes on after an interruption, and other values join those that are there. Results
//! of another job are replaced only on request.
//!
//! | file | content |
//! |---|---|
//! | this | combinations of values, one run after the other |
//! | `one` | arguments, one run and its row of the table |
//! | `process` | directory and process of a run |
//! | `table` | `sweep.csv` |
mod one;
mod process;
mod table;

use std::cmp::Ordering;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

pub(super) use self::one::Arguments;
use self::one::{Row, Run, finished};
use self::process::Ended;
use super::Failure;
use super::shared::message::warn_of;
use agimp::checksum::fnv1a;
use agimp::job::{self, Settings};
use agimp::run::at_end::report;
use agimp::run::claim;
use agimp::run::stop::StopRequest;

/// Most runs of a sweep.
const MOST_RUNS: usize = 10_000;
/// Characters of a setting in the name of a directory.
const NAME: usize = 60;

/// Runs the combinations that are not finished yet, and writes the table.
///
/// # Errors
/// A combination is no valid job, another sweep writes here, or results of another job would be lost (then
/// nothing is run); some run failed; or the sweep was stopped.
pub(super) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let stop = StopRequest::listen()?;
    let over: Vec<(String, Vec<String>)> =
        arguments.over.iter().map(|text| key_and_values(text)).collect::<Result<_, _>>()?;
    let bytes = job::read(&arguments.job)?;
    let runs = runs(arguments, &bytes, &over)?;
    let (name, root) = (name(arguments), root(arguments));
    let cannot = |error| Failure::Run(format!("{}: cannot create the directory: {error}", root.display()));
    std::fs::create_dir_all(&root).map_err(cannot)?;
    let _claim = claim::lock(&root.join("sweep.lock"), "sweep").map_err(|refusal| match refusal {
        claim::Refusal::Taken { .. } => Failure::Usage(refusal.to_string()),
        claim::Refusal::File(error) => Failure::Run(error.to_string()),
    })?;
    if !arguments.overwrite {
        process::spare_results(&runs, &name)?;
    }
    let (mut failed, table) = (0, root.join("sweep.csv"));
    let earlier = earlier(arguments, &bytes, &over, &runs, &table)?;
    let report_of = |run: &Run| finished(&report::path(&run.directory, &name), run);
    let mut rows: Vec<Row> = earlier
        .iter()
        .filter_map(|run| Some(Row { run, status: "finished", report: Some(report_of(run)?) }))
        .collect();
    if rows.len() < earlier.len() {
        warn_of(&[format!(
            "{}: {} of {} earlier rows are those of another job, and leave the table; their directories stay",
            table.display(),
            earlier.len() - rows.len(),
            earlier.len()
        )]);
    }
    for (number, run) in runs.iter().enumerate() {
        let what = run.settings[arguments.set.len()..].join(", ");
        let place = format!("run {} of {}, {what}", number + 1, runs.len());
        let report = report::path(&run.directory, &name);
        let mut status = "finished";
        if finished(&report, run).is_some() {
            writeln!(std::io::stderr(), "{place}: finished already")?;
        } else if stop.is_set() {
            return Err(Failure::SweepStopped);
        } else {
            writeln!(std::io::stderr(), "{place}")?;
            let mut ended = process::start(arguments, run, &name, &stop)?;
            if ended == Ended::Finished && finished(&report, run).is_none() {
                ended = Ended::Failed("it has left no report");
            }
            match ended {
                Ended::Finished => {}
                Ended::Stopped => return Err(Failure::SweepStopped),
                Ended::Failed(why) => {
                    (failed, status) = (failed + 1, "failed");
                    warn_of(&[format!(
                        "{place}: failed, {why}; its directory is {}",
                        run.directory.display()
                    )]);
                }
            }
        }
        rows.push(Row { run, status, report: finished(&report, run) });
        rows.sort_by(|a, b| {
            order(&a.run.values).partial_cmp(&order(&b.run.values)).unwrap_or(Ordering::Equal)
        });
        table::write(&table, &over, &rows)?;
    }
    if !arguments.show.is_empty() {
        write!(std::io::stdout(), "{}", table::shown(&over, &rows, &arguments.show)?)?;
    }
    writeln!(std::io::stdout(), "{} ({} runs)", table.display(), rows.len())?;
    match failed {
        0 => Ok(()),
        _ => Err(Failure::Run(format!("{failed} of {} runs failed", runs.len()))),
    }
}

/// `key=a,b,c` with its values; commas inside brackets and quotes separate nothing.
fn key_and_values(text: &str) -> Result<(String, Vec<String>), Failure> {
    let usage = || Failure::Usage(format!("--over {text}: found no values; expected KEY=A,B,C"));
    let (key, list) = text.split_once('=').ok_or_else(usage)?;
    let (mut values, mut depth, mut quote) = (vec![String::new()], 0_i32, None);
    for c in list.chars() {
        match (c, quote) {
            (',', None) if depth == 0 => {
                values.push(String::new());
                continue;
            }
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth -= 1,
            ('"' | '\'', None) => quote = Some(c),
            (c, Some(open)) if c == open => quote = None,
            _ => {}
        }
        values.iter_mut().last().into_iter().for_each(|value| value.push(c));
    }
    values.iter_mut().for_each(|value| *value = value.trim().to_owned());
    if key.trim().is_empty() || values.iter().any(String::is_empty) {
        return Err(usage());
    }
    Ok((key.trim().to_owned(), values))
}

/// Name of the job.
fn name(arguments: &Arguments) -> String {
    arguments.job.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Directory of the sweep.
fn root(arguments: &Arguments) -> PathBuf {
    arguments.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{}.sweep", name(arguments))))
}

/// All combinations, the last key changing fastest, each checked as a job.
fn runs(arguments: &Arguments, bytes: &[u8], over: &[(String, Vec<String>)]) -> Result<Vec<Run>, Failure> {
    let count = over.iter().try_fold(1_usize, |count, (_, values)| count.checked_mul(values.len()));
    let count = count.filter(|count| *count <= MOST_RUNS).ok_or_else(|| {
        Failure::Usage(format!("found more than {MOST_RUNS} combinations; expected fewer values of --over"))
    })?;
    (0..count)
        .map(|number| {
            let mut rest = number;
            let mut values: Vec<String> = over
                .iter()
                .rev()
                .map(|(_, values)| {
                    let value = values[rest % values.len()].clone();
                    rest /= values.len();
                    value
                })
                .collect();
            values.reverse();
            run(arguments, bytes, over, values)
        })
        .collect()
}

/// The run with these values, checked as a job.
fn run(
    arguments: &Arguments,
    bytes: &[u8],
    over: &[(String, Vec<String>)],
    values: Vec<String>,
) -> Result<Run, Failure> {
    let mut settings = arguments.set.clone();
    settings.extend(over.iter().zip(&values).map(|((key, _), value)| format!("{key}={value}")));
    let mut checked = Settings::default();
    for setting in &settings {
        checked.set(setting).map_err(Failure::Usage)?;
    }
    let problem = job::from_bytes(bytes.to_vec(), &arguments.job, &checked)?;
    let directory = root(arguments).join(directory(over, &values));
    Ok(Run { values, settings, directory, digest: problem.digest(), end: problem.end() })
}

/// Runs of an earlier sweep over the same keys, with other values than these.
fn earlier(
    arguments: &Arguments,
    bytes: &[u8],
    over: &[(String, Vec<String>)],
    runs: &[Run],
    table: &Path,
) -> Result<Vec<Run>, Failure> {
    let rows = table::values(table, over)?;
    let others = rows.into_iter().filter(|values| runs.iter().all(|run| run.values != *values));
    Ok(others.filter_map(|values| run(arguments, bytes, over, values).ok()).collect())
}

/// Key by which rows are sorted: numbers by size, before all other values.
fn order(values: &[String]) -> Vec<(bool, f64, &str)> {
    let number =
        |value: &String| value.replace('_', "").parse::<f64>().ok().filter(|number| number.is_finite());
    values
        .iter()
        .map(|value| number(value).map_or((true, 0.0, value.as_str()), |number| (false, number, "")))
        .collect()
}

/// Name of the directory of a run: its settings. Where a name cannot have them, their checksum keeps it
/// apart.
fn directory(over: &[(String, Vec<String>)], values: &[String]) -> String {
    let mut whole = String::new();
    for ((key, _), value) in over.iter().zip(values) {
        let (key, before) =
            (key.rsplit('.').next().unwrap_or_default(), if whole.is_empty() { "" } else { "_" });
        let _ = write!(whole, "{before}{key}={value}");
    }
    let plain = |c: char| if c.is_alphanumeric() || "_=-+.".contains(c) { c } else { '_' };
    let mut name: String = whole.chars().map(plain).take(NAME).collect();
    if name != whole {
        let _ = write!(name, "-{:06x}", fnv1a(whole.bytes().map(u64::from)) & 0xff_ffff);
    }
    name
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_separated_outside_of_brackets_and_quotes() {
        let parse = |text| key_and_values(text).map_err(|error| error.to_string());
        let found = parse("bodies.0.velocity=[1, 0], [0, 2]").unwrap();
        assert_eq!(found, ("bodies.0.velocity".into(), vec!["[1, 0]".into(), "[0, 2]".into()]));
        assert_eq!(parse("title='a,b',c").unwrap().1, ["'a,b'", "c"]);
        assert!(parse("time.cfl").unwrap_err().contains("expected KEY=A,B,C"));
        assert!(parse("time.cfl=0.1,,0.2").unwrap_err().contains("found no values"));
    }

    #[test]
    fn directories_have_names_that_any_system_takes() {
        let over = vec![
            ("materials.sand.friction_angle".to_owned(), vec![]),
            ("bodies.0.velocity".to_owned(), vec![]),
        ];
        assert_eq!(directory(&over[..1], &["30".into()]), "friction_angle=30");
        let name = |x: &str| directory(&over, &["30".into(), format!("[{x}, 0]")]);
        assert!(name("1").starts_with("friction_angle=30_velocity=_1__0_-"), "{}", name("1"));
        assert_ne!(
            name("1"),
            directory(&over, &["30".into(), "[1; 0]".into()]),
            "apart where letters are not"
        );
    }

    #[test]
    fn rows_are_sorted_by_numbers_and_others_follow() {
        let mut rows = ["1e3", "\"b\"", "20", "-3", "\"a\"", "1_000_000"].map(|value| vec![value.to_owned()]);
        rows.sort_by(|a, b| order(a).partial_cmp(&order(b)).unwrap_or(Ordering::Equal));
        assert_eq!(rows.map(|row| row.concat()), ["-3", "20", "1e3", "1_000_000", "\"a\"", "\"b\""]);
    }
}
