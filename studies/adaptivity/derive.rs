//! The jobs of a comparison, made from one job file.
use toml::{Table, Value};

/// Coarsest and finest level of a job.
pub(crate) struct Levels {
    /// Coarsest.
    pub base: i64,
    /// Finest that any criterion or region wants.
    pub finest: i64,
}

impl Levels {
    /// Of the job, or of its quick version.
    pub(crate) fn of(job: &Table, quick: bool) -> Result<Self, String> {
        let base = base_level(job);
        let finest = wishes(job).into_iter().filter_map(level).max();
        let finest = finest.ok_or("expected [adaptivity] with criteria; found none")?;
        match base - i64::from(quick) {
            base if base < 0 => Err("--quick needs a tree.base_level of at least 1".into()),
            base => Ok(Self { base, finest: finest - i64::from(quick) }),
        }
    }
}

fn base_level(job: &Table) -> i64 {
    job.get("tree").and_then(|tree| tree.get("base_level")).and_then(Value::as_integer).unwrap_or(0)
}

fn level(wish: &Value) -> Option<i64> {
    wish.get("level").and_then(Value::as_integer)
}

/// Criteria and regions.
fn wishes(job: &Table) -> Vec<&Value> {
    let of =
        |table: &str, key: &str| job.get(table).and_then(|table| table.get(key)).and_then(Value::as_array);
    let lists = [of("adaptivity", "criteria"), of("tree", "regions")];
    lists.into_iter().flatten().flatten().collect()
}

/// The job with the outputs that a comparison needs, with all levels one lower if `quick`.
pub(crate) fn adaptive(job: &Table, quick: bool) -> Table {
    let mut job = with_few_outputs(job);
    if quick {
        let lower = |value: &mut Value| {
            if let Value::Integer(level) = value {
                *level -= 1;
            }
        };
        for (table, key) in [("adaptivity", "criteria"), ("tree", "regions")] {
            let list = job.get_mut(table).and_then(|table| table.get_mut(key)).and_then(Value::as_array_mut);
            list.into_iter().flatten().filter_map(|wish| wish.get_mut("level")).for_each(lower);
        }
        job.get_mut("tree").and_then(|tree| tree.get_mut("base_level")).into_iter().for_each(lower);
    }
    job
}

/// The job without refinement and with the finest cells everywhere.
pub(crate) fn uniform(job: &Table, levels: &Levels) -> Table {
    let mut job = with_few_outputs(job);
    job.remove("adaptivity");
    let tree = Table::from_iter([("base_level".to_owned(), Value::Integer(levels.finest))]);
    job.insert("tree".into(), tree.into());
    job
}

/// Output only at start and end.
fn with_few_outputs(job: &Table) -> Table {
    let mut job = job.clone();
    job.remove("checkpoint");
    job.remove("report");
    let fields = Value::Array(["mass", "density"].map(Value::from).to_vec());
    let output = Table::from_iter([("fields".to_owned(), fields), ("picture".to_owned(), false.into())]);
    job.insert("output".into(), output.into());
    let every = |steps: i64| Value::Table(Table::from_iter([("every_steps".to_owned(), steps.into())]));
    job.insert("history".into(), every(100));
    job.insert("telemetry".into(), every(20));
    job
}
