//! Time of a run by phase, and the distribution of work and memory over its ranks, from telemetry.
use std::path::Path;

use super::panels::Panel;
use agimp::io::log::telemetry::Record;

/// Wall time of a phase.
#[derive(Debug)]
pub(super) struct PhaseCost {
    /// Description of its work.
    pub words: String,
    /// Wall seconds, mean over the ranks.
    pub mean: f64,
    /// Wall seconds of the rank that was slowest in each record.
    pub most: f64,
}

/// The telemetry of a run.
#[derive(Debug, Default)]
pub(super) struct Cost {
    pub records: Vec<Record>,
    /// Phases, the longest first; the rest comes last.
    pub phases: Vec<PhaseCost>,
    /// Wall seconds of all parts of the run.
    pub wall: f64,
    /// Ranks of the last part.
    pub ranks: u64,
}

/// Names of phases and descriptions of their work.
const WORDS: [(&str, &str); 10] = [
    ("sort", "sort particles beside level jumps"),
    ("scatter", "particles to grid (P2G)"),
    ("exchange", "exchange between ranks"),
    ("sum", "sums at nodes"),
    ("nodes", "motion of nodes, contact, loads"),
    ("gather", "grid to particles (G2P), stress"),
    ("migrate", "particles to other leaves and ranks"),
    ("reduce", "agreement of all ranks"),
    ("regrid", "tree and balance"),
    ("output", "files and measurements"),
];

type Curve = (String, Vec<(f64, f64)>);

impl Cost {
    /// Reads telemetry; lines that are not whole are left out.
    pub(super) fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).unwrap_or_default();
        let lines = bytes.split(|byte| *byte == b'\n');
        Self::of(lines.filter_map(|line| serde_json::from_slice(line).ok()).collect())
    }

    fn of(records: Vec<Record>) -> Self {
        let wall = records.iter().map(|record| record.wall_seconds).sum();
        let mut phases: Vec<(String, PhaseCost)> = Vec::new();
        for phase in records.iter().flat_map(|record| &record.phases) {
            let place = phases.iter().position(|(name, _)| *name == phase.phase).unwrap_or_else(|| {
                let words = WORDS.iter().find(|(name, _)| *name == phase.phase).map(|(_, words)| *words);
                let words = words.unwrap_or(&phase.phase).to_owned();
                phases.push((phase.phase.clone(), PhaseCost { words, mean: 0.0, most: 0.0 }));
                phases.len() - 1
            });
            let cost = &mut phases[place].1;
            (cost.mean, cost.most) = (cost.mean + phase.seconds.mean, cost.most + phase.seconds.max);
        }
        let mut phases: Vec<PhaseCost> = phases.into_iter().map(|(_, cost)| cost).collect();
        phases.sort_by(|a, b| b.mean.total_cmp(&a.mean));
        let known: f64 = phases.iter().map(|phase| phase.mean).sum();
        let rest = f64::max(wall - known, 0.0);
        phases.push(PhaseCost { words: "other".into(), mean: rest, most: rest });
        let ranks = records.last().map_or(0, |record| record.ranks);
        Self { records, phases, wall, ranks }
    }

    /// Particles times steps per wall second, over the whole run.
    pub(super) fn speed(&self) -> f64 {
        let work: f64 = self.records.iter().map(|r| r.particle_steps_per_second * r.wall_seconds).sum();
        if self.wall > 0.0 { work / self.wall } else { 0.0 }
    }

    /// Most memory of a rank, bytes.
    pub(super) fn memory(&self) -> f64 {
        self.records.iter().map(|record| record.memory.max).fold(0.0, f64::max)
    }

    /// Mean imbalance by wall time.
    pub(super) fn imbalance(&self) -> f64 {
        let sum: f64 = self.records.iter().map(|r| r.imbalance * r.wall_seconds).sum();
        if self.wall > 0.0 { sum / self.wall } else { 1.0 }
    }

    /// Charts over time.
    pub(super) fn panels(&self) -> Vec<Panel> {
        let curve = |name: &str, value: &dyn Fn(&Record) -> f64| -> Curve {
            (name.to_owned(), self.records.iter().map(|record| (record.time, value(record))).collect())
        };
        let mut panels = vec![
            // Records without steps have no speed.
            Panel::new(
                "Speed",
                "particle steps/s",
                vec![curve("speed", &|r| {
                    if r.steps > 0 { r.particle_steps_per_second } else { f64::NAN }
                })],
            ),
            Panel::new(
                "Wall time so far",
                "s",
                vec![{
                    let mut wall = 0.0;
                    let sums = self.records.iter().map(|record| {
                        wall += record.wall_seconds;
                        (record.time, wall)
                    });
                    ("wall time".to_owned(), sums.collect())
                }],
            ),
        ];
        let mut levels: Vec<u8> =
            self.records.iter().flat_map(|r| r.levels.iter().map(|level| level.level)).collect();
        levels.sort_unstable();
        levels.dedup();
        let of_level = |level: u8, particles: bool| {
            curve(&format!("level {level}"), &move |record: &Record| {
                let found = record.levels.iter().find(|count| count.level == level);
                found.map_or(0.0, |count| (if particles { count.particles } else { count.leaves }) as f64)
            })
        };
        panels.push(Panel::new(
            "Leaves",
            "leaves",
            levels.iter().map(|&level| of_level(level, false)).collect(),
        ));
        panels.push(Panel::new(
            "Particles by level",
            "particles",
            levels.iter().map(|&level| of_level(level, true)).collect(),
        ));
        let mut memory = vec![curve("most of a rank", &|r| r.memory.max / 1e6)];
        if self.ranks > 1 {
            memory.push(curve("least of a rank", &|r| r.memory.min / 1e6));
            panels.push(Panel::new(
                "Imbalance: greatest cost of a rank over the mean",
                "",
                vec![curve("present", &|r| r.imbalance), curve("possible", &|r| r.possible_imbalance)],
            ));
            panels.push(Panel::new(
                "Sent by a rank in a step",
                "kB",
                vec![
                    curve("most", &|r| {
                        if r.steps > 0 { r.per_rank.bytes_per_step.max / 1e3 } else { f64::NAN }
                    }),
                    curve("mean", &|r| {
                        if r.steps > 0 { r.per_rank.bytes_per_step.mean / 1e3 } else { f64::NAN }
                    }),
                ],
            ));
        }
        panels.push(Panel::new("Memory", "MB", memory));
        panels.retain(Panel::changes);
        panels
    }
}
