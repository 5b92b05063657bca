//! Wall time by phase of the step.
use std::time::{Duration, Instant};

/// Processor time of this thread, to which other programs on the machine do not add.
pub(in crate::solver) fn thread_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}

/// Phases of a run whose wall time is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Sorting particles into bins beside level jumps.
    Sort,
    /// Particles to arenas.
    Scatter,
    /// Sending and awaiting arenas.
    Exchange,
    /// Sums of arenas at nodes.
    Sum,
    /// Restriction, velocity update, boundary conditions and prolongation.
    Nodes,
    /// Arenas to particles, deformation and stress.
    Gather,
    /// Particles between leaves and ranks.
    Migrate,
    /// The reduction at the end of a step.
    Reduce,
    /// Tree, partition and grid plan.
    Regrid,
    /// Files, history and reports.
    Output,
}

impl Phase {
    /// All phases, in the order of a step.
    pub const ALL: [Self; 10] = [
        Self::Sort,
        Self::Scatter,
        Self::Exchange,
        Self::Sum,
        Self::Nodes,
        Self::Gather,
        Self::Migrate,
        Self::Reduce,
        Self::Regrid,
        Self::Output,
    ];

    /// Name in telemetry.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sort => "sort",
            Self::Scatter => "scatter",
            Self::Exchange => "exchange",
            Self::Sum => "sum",
            Self::Nodes => "nodes",
            Self::Gather => "gather",
            Self::Migrate => "migrate",
            Self::Reduce => "reduce",
            Self::Regrid => "regrid",
            Self::Output => "output",
        }
    }
}

/// Seconds spent in each phase.
#[derive(Clone, Copy, Debug, Default)]
pub struct Phases {
    seconds: [f64; Phase::ALL.len()],
    running: [f64; Phase::ALL.len()],
}

impl Phases {
    /// Runs `work` and adds its wall time to a phase.
    pub fn time<R>(&mut self, phase: Phase, work: impl FnOnce() -> R) -> R {
        let (start, running) = (Instant::now(), thread_time());
        let result = work();
        self.book(phase, start.elapsed());
        self.running[phase as usize] += (thread_time() - running).as_secs_f64();
        result
    }

    /// Adds wall time measured elsewhere to a phase.
    pub fn book(&mut self, phase: Phase, time: Duration) {
        self.seconds[phase as usize] += time.as_secs_f64();
    }

    /// Seconds so far, in the order of [`Phase::ALL`].
    pub fn seconds(&self) -> [f64; Phase::ALL.len()] {
        self.seconds
    }

    /// Processor time of this thread in some phases since the start, s; [`Phases::clear`] does not touch it.
    pub fn running_time(&self, phases: &[Phase]) -> f64 {
        phases.iter().map(|&phase| self.running[phase as usize]).sum()
    }

    /// Begins a new report.
    pub fn clear(&mut self) {
        self.seconds = Default::default();
    }
}
