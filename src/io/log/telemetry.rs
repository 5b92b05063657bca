//! `telemetry.jsonl`: one JSON object per reported step, for machines to read.

use std::path::Path;

use partition::comm::{Comm, Traffic};
use partition::{MAX_LEVEL, Octant};
use serde::{Deserialize, Serialize};

use super::lines::{Lines, Verdict};
use crate::grid::sums::statistics::Statistics;
use crate::io::hdf5_file::FileError;
use crate::io::whole_file::system;
use crate::particle::chunk::Chunk;

/// A quantity over the ranks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Smallest value of any rank.
    pub min: f64,
    /// Mean over the ranks.
    pub mean: f64,
    /// Largest value of any rank.
    pub max: f64,
}

impl Spread {
    /// Collective. The spread of each entry; all ranks give the same number of non-negative entries.
    pub fn over_ranks(comm: &Comm, values: &[f64]) -> Vec<Self> {
        let (mut min, mut max) = (values.to_vec(), values.to_vec());
        comm.min_f64s(&mut min);
        comm.max_f64s(&mut max);
        // Reductions add integers only; 32 binary digits of the largest value suffice for a report.
        let scale = |max: f64| if max > 0.0 { f64::from(u32::MAX) / max } else { 0.0 };
        let mut sums: Vec<u64> = values.iter().zip(&max).map(|(v, &max)| (v * scale(max)) as u64).collect();
        comm.sum_u64(&mut sums);
        let mean = |sum: u64, max: f64| {
            if max > 0.0 { sum as f64 / scale(max) / comm.size() as f64 } else { 0.0 }
        };
        let both = min.iter().zip(&max);
        sums.into_iter()
            .zip(both)
            .map(|(sum, (&min, &max))| Self { min, mean: mean(sum, max), max })
            .collect()
    }
}

/// Wall time of a phase of the step since the last record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PhaseTime {
    /// Name of the phase.
    pub phase: String,
    /// Wall seconds.
    pub seconds: Spread,
}

/// Leaves and particles of one level of the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LevelCount {
    /// Level.
    pub level: u8,
    /// Leaves.
    pub leaves: u64,
    /// Particles in them.
    pub particles: u64,
}

/// Sizes and traffic of single ranks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PerRank {
    /// Own leaves.
    pub leaves: Spread,
    /// Leaves of other ranks that a rank knows.
    pub ghost_leaves: Spread,
    /// Particles.
    pub particles: Spread,
    /// Ranks with which a rank exchanges messages.
    pub neighbours: Spread,
    /// Messages that a rank sent per step since the last record, one reduction per step not counted.
    pub messages_per_step: Spread,
    /// Bytes that a rank sent per step since the last record.
    pub bytes_per_step: Spread,
    /// Bytes of a rank's arenas in one exchange, at the time of the record.
    pub arena_bytes: Spread,
    /// Bytes of the distinct nodes in them that the receivers need.
    pub surface_bytes: Spread,
    /// Heap bytes of grid plan, arenas and node fields.
    pub grid_bytes: Spread,
}

/// Totals of dynamic refinement: particles since the start of the run, changes of the tree since that of the
/// process.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resampled {
    /// Changes of the tree.
    pub regrids: u64,
    /// Particles split.
    pub splits: u64,
    /// Particles that could not be split any further.
    pub refused: u64,
    /// Particles made by merges.
    pub merges: u64,
    /// Particles that merges removed.
    pub merged_away: u64,
    /// Kinetic energy that splits removed from affine velocities, J.
    pub split_energy: f64,
    /// Kinetic energy that merges removed, J.
    pub merge_energy: f64,
}

/// One line of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Steps done.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Last time step, s.
    pub dt: f64,
    /// Steps since the last record.
    pub steps: u64,
    /// Wall seconds since the last record (of the slowest rank).
    pub wall_seconds: f64,
    /// Wall time by phase.
    pub phases: Vec<PhaseTime>,
    /// Particles times steps per wall second.
    pub particle_steps_per_second: f64,
    /// Messages sent by all ranks since the last record.
    pub messages: u64,
    /// Bytes sent by all ranks since the last record.
    pub bytes: u64,
    /// Particles.
    pub particles: u64,
    /// Levels that have leaves.
    pub levels: Vec<LevelCount>,
    /// Largest cost of a rank over the mean cost.
    pub imbalance: f64,
    /// The same for new cuts of the curve.
    pub possible_imbalance: f64,
    /// New partitions since the start of this process.
    #[serde(default)]
    pub partitions: u64,
    /// Sizes and traffic of single ranks.
    pub per_rank: PerRank,
    /// Resident memory per rank, bytes.
    pub memory: Spread,
    /// Relative difference between the mass on the real nodes and that of the particles in the last step, or
    /// in the state itself before the first and at the end.
    pub mass_error: f64,
    /// Dynamic refinement, in jobs that have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resampled: Option<Resampled>,
    /// Number of ranks.
    pub ranks: u64,
    /// Threads per rank.
    pub threads: u64,
}

/// One rank's part of a record.
#[derive(Clone, Copy, Debug)]
pub struct Contribution<'a, const D: usize> {
    /// Steps done.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Last time step, s.
    pub dt: f64,
    /// Steps since the last record.
    pub steps: u64,
    /// Wall seconds since the last record.
    pub wall_seconds: f64,
    /// Names and wall seconds of the phases since the last record; the same names on all ranks.
    pub phases: &'a [(&'static str, f64)],
    /// Messages and bytes that this rank has sent since the last record.
    pub traffic: Traffic,
    /// Leaves of this rank.
    pub leaves: &'a [Octant<D>],
    /// Their particles.
    pub chunks: &'a [Chunk<D>],
    /// Sizes and traffic of this rank.
    pub statistics: Statistics,
    /// Largest cost of a rank over the mean cost (the same on all ranks).
    pub imbalance: f64,
    /// The same for new cuts.
    pub possible_imbalance: f64,
    /// New partitions since the start of this process (the same on all ranks).
    pub partitions: u64,
    /// Relative mass error (the same on all ranks).
    pub mass_error: f64,
    /// Dynamic refinement (the same on all ranks).
    pub resampled: Option<Resampled>,
}

impl<const D: usize> Contribution<'_, D> {
    /// The entries of [`PerRank`], in their order.
    fn counts(&self) -> [f64; 9] {
        let Statistics { leaves, ghost_leaves, neighbours, arena_bytes, surface_bytes, grid_bytes } =
            self.statistics;
        let particles: u64 = self.chunks.iter().map(|chunk| chunk.len() as u64).sum();
        let per_step = |count: u64| count as f64 / self.steps.max(1) as f64;
        [
            leaves as f64,
            ghost_leaves as f64,
            particles as f64,
            neighbours as f64,
            per_step(self.traffic.messages),
            per_step(self.traffic.bytes),
            arena_bytes as f64,
            surface_bytes as f64,
            grid_bytes as f64,
        ]
    }
}

impl Record {
    /// Collective. Puts the parts of all ranks together; every rank gets the record.
    pub fn gather<const D: usize>(comm: &Comm, mine: &Contribution<D>) -> Self {
        const LEVELS: usize = MAX_LEVEL as usize + 1;
        let mut counts = vec![0; 2 * LEVELS + 2];
        for (leaf, chunk) in mine.leaves.iter().zip(mine.chunks) {
            counts[usize::from(leaf.level)] += 1;
            counts[LEVELS + usize::from(leaf.level)] += chunk.len() as u64;
        }
        counts[2 * LEVELS] = mine.traffic.messages;
        counts[2 * LEVELS + 1] = mine.traffic.bytes;
        comm.sum_u64(&mut counts);

        let mut values: Vec<f64> = mine.phases.iter().map(|&(_, seconds)| seconds).collect();
        values.extend([mine.wall_seconds, resident_bytes().unwrap_or(0) as f64]);
        values.extend(mine.counts());
        let spreads = Spread::over_ranks(comm, &values);
        let (phases, rest) = spreads.split_at(mine.phases.len());
        let (wall_seconds, memory, rest) = (rest[0].max, rest[1], &rest[2..]);

        let particles: u64 = counts[LEVELS..2 * LEVELS].iter().sum();
        let level = |level: usize| LevelCount {
            level: level as u8,
            leaves: counts[level],
            particles: counts[LEVELS + level],
        };
        let work = particles as f64 * mine.steps as f64;
        Self {
            step: mine.step,
            time: mine.time,
            dt: mine.dt,
            steps: mine.steps,
            wall_seconds,
            phases: mine
                .phases
                .iter()
                .zip(phases)
                .map(|(&(phase, _), &seconds)| PhaseTime { phase: phase.to_owned(), seconds })
                .collect(),
            particle_steps_per_second: if wall_seconds > 0.0 { work / wall_seconds } else { 0.0 },
            messages: counts[2 * LEVELS],
            bytes: counts[2 * LEVELS + 1],
            particles,
            levels: (0..LEVELS).filter(|&l| counts[l] > 0).map(level).collect(),
            imbalance: mine.imbalance,
            possible_imbalance: mine.possible_imbalance,
            partitions: mine.partitions,
            per_rank: PerRank {
                leaves: rest[0],
                ghost_leaves: rest[1],
                particles: rest[2],
                neighbours: rest[3],
                messages_per_step: rest[4],
                bytes_per_step: rest[5],
                arena_bytes: rest[6],
                surface_bytes: rest[7],
                grid_bytes: rest[8],
            },
            memory,
            mass_error: mine.mass_error,
            resampled: mine.resampled,
            ranks: comm.size() as u64,
            threads: rayon::current_num_threads() as u64,
        }
    }
}

/// Resident memory of this process, bytes; `None` where the system does not say.
pub fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
}

/// The open file. Belongs to rank 0.
#[derive(Debug)]
pub struct Telemetry(Lines);

impl Telemetry {
    /// Not collective. Starts a new file, replacing an old one.
    pub fn create(path: &Path) -> Result<Self, FileError> {
        Ok(Self(Lines::create(path)?))
    }

    /// Not collective. Opens the file of a run that continues from `step`: its records stay; later ones and
    /// damaged ones are removed. Starts a new file if there is none.
    pub fn resume(path: &Path, step: u64) -> Result<Self, FileError> {
        /// The part of a record that decides whether it stays.
        #[derive(Deserialize)]
        struct Step {
            step: u64,
        }
        if path.symlink_metadata().is_err() {
            return Self::create(path);
        }
        let judge = |line: &[u8]| match serde_json::from_slice(line) {
            Ok(Step { step: of }) if of <= step => Verdict::Keep,
            _ => Verdict::Drop,
        };
        Ok(Self(Lines::resume(path, judge)?))
    }

    /// Not collective. Appends a record and passes it to the operating system.
    pub fn write(&mut self, record: &Record) -> Result<(), FileError> {
        let line =
            serde_json::to_string(record).map_err(|error| system(self.0.path(), "write", error.into()))?;
        self.0.append(&(line + "\n"))
    }

    /// Not collective. Waits until all records are on disk.
    pub fn sync(&self) -> Result<(), FileError> {
        self.0.sync()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_come_back_and_what_is_damaged_or_later_goes() {
        let spread = Spread { min: 0.1, mean: 0.2, max: 0.7 };
        let record = Record {
            step: 10,
            time: 0.1 + 0.2,
            dt: 1e-6,
            steps: 10,
            wall_seconds: 2.0,
            phases: vec![PhaseTime { phase: "scatter".into(), seconds: spread }],
            particle_steps_per_second: 1e6,
            messages: 12,
            bytes: 1 << 40,
            particles: 200_000,
            levels: vec![LevelCount { level: 3, leaves: 8, particles: 200_000 }],
            imbalance: 1.01,
            possible_imbalance: 1.005,
            partitions: 3,
            per_rank: PerRank {
                leaves: spread,
                ghost_leaves: spread,
                particles: spread,
                neighbours: spread,
                messages_per_step: spread,
                bytes_per_step: spread,
                arena_bytes: spread,
                surface_bytes: spread,
                grid_bytes: spread,
            },
            memory: spread,
            mass_error: 1e-16,
            resampled: None,
            ranks: 2,
            threads: 1,
        };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("telemetry.jsonl");
        Telemetry::create(&path).unwrap().write(&record).unwrap();
        let mut damaged = std::fs::read(&path).unwrap();
        damaged.extend_from_slice(b"\0\xff\n{\"step\":11}\n{\"step\":1");
        std::fs::write(&path, damaged).unwrap();
        Telemetry::resume(&path, 10).unwrap().write(&record).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let read: Vec<Record> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        assert_eq!(read, [record.clone(), record]);
    }

    #[test]
    fn memory_of_this_process() {
        assert!(resident_bytes().is_none_or(|bytes| bytes > 1 << 20));
    }
}
