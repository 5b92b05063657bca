//! Measured times: strong and weak scaling.
use std::path::Path;

use serde_json::Value;

use crate::plot::{Chart, Series};
use crate::{Block, Failure, markdown, number, records, run};

/// The block for so many ranks: large for a cluster (three million particles per rank), small for a
/// workstation.
pub(crate) fn block(ranks: usize, large: bool) -> Block {
    let roots = Block::roots(ranks);
    match large {
        true => Block { roots, level: 4, per_cell: 2, steps: 200, every: 20 },
        false => Block { roots, level: 3, per_cell: 2, steps: 20, every: 2 },
    }
}

/// One finished run.
struct Time {
    kind: String,
    ranks: f64,
    threads: f64,
    particles: f64,
    /// Seconds per step: the median of the records after the first two, which warm up.
    step: f64,
    /// Share of it in exchange, migration and reduction, on the average rank.
    waiting: f64,
    imbalance: f64,
}

impl Time {
    fn cores(&self) -> f64 {
        self.ranks * self.threads
    }

    fn read(kind: &str, records: &[Value]) -> Option<Self> {
        let timed = records.iter().skip(2).filter(|record| number(record, "/steps") > 0.0);
        let per_step = |record: &Value| number(record, "/wall_seconds") / number(record, "/steps");
        let mut timed: Vec<&Value> = timed.collect();
        timed.sort_by(|a, b| per_step(a).total_cmp(&per_step(b)));
        let record = timed.get(timed.len() / 2)?;
        let phases = record["phases"].as_array()?;
        let share = |wanted: &[&str]| -> f64 {
            let of = phases
                .iter()
                .filter(|phase| wanted.is_empty() || wanted.iter().any(|w| phase["phase"] == *w));
            of.map(|phase| number(phase, "/seconds/mean")).sum()
        };
        Some(Self {
            kind: kind.into(),
            ranks: number(record, "/ranks"),
            threads: number(record, "/threads"),
            particles: number(record, "/particles"),
            step: per_step(record),
            waiting: share(&["exchange", "migrate", "reduce"]) / share(&[]),
            imbalance: number(record, "/imbalance"),
        })
    }
}

/// Runs both series on this machine and prints their table.
pub(crate) fn measure(ways: &[&str]) -> Result<(), Failure> {
    let ways = if ways.is_empty() { &["1x1", "1x2", "2x1"][..] } else { ways };
    let mut parsed = Vec::new();
    for way in ways {
        let numbers = way.split_once('x').and_then(|(r, t)| Some((r.parse().ok()?, t.parse().ok()?)));
        parsed.push(
            numbers.filter(|&(r, t)| r > 0 && t > 0).ok_or(format!("'{way}': expected RANKSxTHREADS"))?,
        );
    }
    let most = parsed.iter().map(|(ranks, threads): &(usize, usize)| ranks * threads).max().unwrap_or(1);
    let mut found = Vec::new();
    // Twice, in turn: what else the machine does shall not fall on one of them alone.
    for _ in 0..2 {
        for &(ranks, threads) in &parsed {
            for (kind, size) in [("strong", most.max(2)), ("weak", ranks * threads)] {
                let name = format!("{kind}_{ranks}x{threads}");
                let records = run(&block(size, false), &name, ranks, threads)?;
                found.extend(Time::read(kind, &records));
            }
        }
    }
    report(best(found), Path::new("target/scaling"))
}

/// Of several runs of one kind, the fastest.
fn best(mut all: Vec<Time>) -> Vec<Time> {
    let key = |time: &Time| (time.kind.clone(), time.cores() as u64, time.ranks as u64);
    all.sort_by(|a, b| key(a).cmp(&key(b)).then(a.step.total_cmp(&b.step)));
    all.dedup_by_key(|time| key(time));
    all
}

/// Prints the table of finished runs, `strong_…` and `weak_…` by the names of their files.
pub(crate) fn table(files: &[&str]) -> Result<(), Failure> {
    let mut found = Vec::new();
    for file in files {
        let name = Path::new(file).file_name().unwrap_or_default().to_string_lossy().into_owned();
        let kind = name.split('_').next().unwrap_or_default();
        found.extend(Time::read(kind, &records(Path::new(file))?));
    }
    report(best(found), Path::new("out/scaling"))
}

/// Prints the table and writes it beside the plots. The run on the fewest cores of each series is its reference.
fn report(times: Vec<Time>, folder: &Path) -> Result<(), Failure> {
    let heads = [
        "series",
        "ranks",
        "threads",
        "particles",
        "s per step",
        "particles per s and core",
        "speed-up",
        "efficiency",
        "exchange and waiting",
        "imbalance",
    ];
    let mut rows = Vec::new();
    let mut charts = Vec::new();
    for kind in ["strong", "weak"] {
        let series: Vec<&Time> = times.iter().filter(|time| time.kind == kind).collect();
        let Some(first) = series.first() else { continue };
        let rate = |time: &Time| time.particles / time.step;
        let mut points = Vec::new();
        for time in &series {
            let speed_up = rate(time) / rate(first) * first.cores();
            points.push([time.cores(), speed_up]);
            rows.push(vec![
                kind.into(),
                format!("{}", time.ranks),
                format!("{}", time.threads),
                format!("{}", time.particles),
                format!("{:.4}", time.step),
                format!("{:.3e}", rate(time) / time.cores()),
                format!("{speed_up:.2}"),
                format!("{:.3}", speed_up / time.cores()),
                format!("{:.3}", time.waiting),
                format!("{:.3}", time.imbalance),
            ]);
        }
        charts.push(Series { name: format!("{kind} scaling"), points, marks: true });
    }
    let text = markdown(&heads, &rows);
    let cores = times.iter().map(Time::cores).fold(1.0, f64::max);
    charts.push(Series { name: "ideal".into(), points: vec![[1.0, 1.0], [cores, cores]], marks: false });
    let chart = Chart {
        title: "Speed-up (particles per second, against the smallest run)",
        labels: ["cores", "speed-up"],
        logarithmic: [true, true],
        series: charts,
    };
    print!("{text}");
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::create_dir_all(folder)
            .and_then(|()| std::fs::write(&path, text))
            .map_err(|error| format!("{}: {error}", path.display()))
    };
    write("scaling.md", &text)?;
    write("scaling.svg", &chart.svg())?;
    println!("\ntable and plot: {}", folder.join("scaling.{md,svg}").display());
    Ok(())
}
