//! Check that a run fits into the memory of its machines, before anything large is allocated.
use std::cell::Cell;
use std::time::{Duration, Instant};

use partition::comm::Comm;

use super::RunError;
use crate::io::log::progress::tell;
use crate::job::Problem;
use crate::memory::Limits;
use crate::setup::Size;
use crate::setup::estimate::{EstimateError, PROGRAM, estimate, greatest_memory, tree_memory};
use crate::text::{bytes, count};

/// Time between lines about a tree that is being refined.
const BETWEEN_LINES: Duration = Duration::from_secs(2);

/// The memory that ranks have.
pub(super) struct Room {
    ranks: usize,
    /// Least memory of a rank, bytes, and the ranks of the machine where it has that.
    per_rank: f64,
    host_ranks: u64,
    speaks: bool,
    /// When a line was shown last.
    shown: Cell<Instant>,
}

impl Room {
    /// Collective. The memory of the machines of all ranks.
    pub(super) fn of_machines(comm: &Comm, speaks: bool) -> Self {
        let ranks = comm.host_size();
        let own = Limits::of_machine().per_rank(ranks);
        let per_rank = comm.min_f64(own);
        let mut host_ranks = [if own == per_rank { ranks as u64 } else { 0 }];
        comm.max_u64(&mut host_ranks);
        let (ranks, host_ranks) = (comm.size(), host_ranks[0]);
        Self { ranks, per_rank, host_ranks, speaks, shown: Cell::new(Instant::now()) }
    }

    /// Collective. Refuses a job whose tree, before criteria refine it, takes more.
    ///
    /// # Errors
    /// It does, or cannot be made; the same on all ranks.
    pub(super) fn check<const D: usize>(&self, comm: &Comm, problem: &Problem<D>) -> Result<(), RunError> {
        // Counting takes a moment, and most jobs need none.
        if self.refusal(problem, greatest_memory(problem), "").is_none() {
            return Ok(());
        }
        let counted = match comm.rank() {
            0 => estimate(problem).map(|estimate| (estimate.memory, estimate.is_cut)),
            _ => Ok((0.0, false)),
        };
        let counted: Result<_, EstimateError> = counted;
        let (memory, is_cut) = comm.agree(counted).map_err(RunError::Seed)?;
        let (memory, is_cut) = (comm.max_f64(memory), comm.any(is_cut));
        let about = if is_cut { "more than" } else { "about" };
        self.refusal(problem, memory, about).map_or(Ok(()), |reason| Err(RunError::Refused(reason)))
    }

    /// Not collective. Refuses a tree of this size if it does not fit, and prints its size now and then.
    ///
    /// # Errors
    /// It takes more memory than there is; the same on all ranks.
    pub(super) fn fits<const D: usize>(&self, problem: &Problem<D>, size: Size) -> Result<(), String> {
        if self.speaks && self.shown.get().elapsed() > BETWEEN_LINES {
            self.shown.set(Instant::now());
            let [particles, leaves, _] = size.map(count);
            tell(&format!(
                "refining at the start: {leaves} leaves, {particles} particles, about {}",
                bytes(tree_memory::<D>(size))
            ));
        }
        self.refusal(problem, tree_memory::<D>(size), "at least").map_or(Ok(()), Err)
    }

    /// Why a job is refused that takes this much on all ranks together, bytes.
    fn refusal<const D: usize>(&self, problem: &Problem<D>, memory: f64, about: &str) -> Option<String> {
        let needed = PROGRAM + memory / self.ranks as f64;
        if needed <= self.per_rank {
            return None;
        }
        let needs = |each: &str| format!("takes {about} {} of memory{each}", bytes(needed));
        let (needs, has) = match self.ranks {
            1 => (needs(""), "what this machine has".to_owned()),
            ranks => {
                let here = if self.host_ranks == 1 {
                    "its rank".to_owned()
                } else {
                    format!("each of its {} ranks", self.host_ranks)
                };
                (needs(&format!(" on each of {ranks} ranks")), format!("what a machine has for {here}"))
            }
        };
        Some(format!(
            "{}:1:1: tree: found a job that {needs}; expected at most {}, {has}: coarser cells, lower levels, or more machines",
            problem.path.display(),
            bytes(self.per_rank)
        ))
    }
}
