//! Wall time of the parts of regrids.
use std::time::Instant;

/// Parts of a regrid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Values of the criteria, and the levels that leaves request.
    Criteria,
    /// Marks of the leaves around, and the changed and balanced tree.
    Tree,
    /// Particles into new leaves, and splits.
    Split,
    /// New cuts, and leaves that change rank.
    Partition,
    /// Ghost layer and grid plan.
    Grid,
    /// Merges.
    Merge,
    /// Children and merged particles into their leaves, and the bound on the next step.
    Migrate,
}

impl Part {
    /// All parts, in order.
    pub const ALL: [Self; 7] =
        [Self::Criteria, Self::Tree, Self::Split, Self::Partition, Self::Grid, Self::Merge, Self::Migrate];

    /// A word for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Criteria => "criteria",
            Self::Tree => "tree",
            Self::Split => "split",
            Self::Partition => "partition",
            Self::Grid => "grid",
            Self::Merge => "merge",
            Self::Migrate => "migrate",
        }
    }
}

/// Seconds of wall time that each part of the regrids so far took.
#[derive(Clone, Copy, Debug)]
pub struct RegridTimers {
    seconds: [f64; Part::ALL.len()],
    since: Instant,
}

impl Default for RegridTimers {
    fn default() -> Self {
        Self { seconds: [0.0; Part::ALL.len()], since: Instant::now() }
    }
}

impl RegridTimers {
    /// Starts the time of a part.
    pub(in crate::solver) fn begin(&mut self) {
        self.since = Instant::now();
    }

    /// Ends the time of a part, and starts that of the next.
    pub(in crate::solver) fn end(&mut self, part: Part) {
        let now = Instant::now();
        self.seconds[part as usize] += (now - self.since).as_secs_f64();
        self.since = now;
    }

    /// Seconds so far, in the order of [`Part::ALL`].
    pub fn seconds(&self) -> [f64; Part::ALL.len()] {
        self.seconds
    }
}
