//! MPI through rsmpi.

use mpi::Threading;
use mpi::collective::SystemOperation;
use mpi::environment::Universe;
use mpi::point_to_point::{Message, Source, Status};
use mpi::request::{Request, StaticScope};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Equivalence, Root};

use super::super::CommError;
use super::super::environment::{is_launched, launched_ranks};
use super::Operation;

/// MPI, started. Fields drop in this order: the communicators before MPI.
pub(in super::super) struct Library {
    all: Group,
    /// The ranks that share the memory of this machine.
    host: Group,
    _universe: Universe,
}

impl Library {
    /// Collective. Starts MPI.
    pub(in super::super) fn start() -> Result<Self, CommError> {
        set_environment();
        let (universe, threading) =
            mpi::initialize_with_threading(Threading::Funneled).ok_or(CommError::AlreadyStarted)?;
        if threading < Threading::Funneled {
            return Err(CommError::Threads);
        }
        // A communicator of our own: messages of other libraries cannot be mistaken for ours.
        let all = universe.world().duplicate();
        let host = Group(all.split_shared(0));
        Ok(Self { all: Group(all), host, _universe: universe })
    }

    /// Not collective. Name and version of the library.
    pub(in super::super) fn name() -> String {
        let version = mpi::environment::library_version().unwrap_or_default();
        version.split([',', '\n']).next().unwrap_or_default().replace('\t', " ").trim().to_owned()
    }

    /// Not collective. All ranks.
    pub(in super::super) fn all(&self) -> &Group {
        &self.all
    }

    /// Not collective. The ranks of this machine.
    pub(in super::super) fn host(&self) -> &Group {
        &self.host
    }

    /// Not collective. Whether the library has started and not yet ended.
    pub(in super::super) fn is_running() -> bool {
        mpi::environment::is_initialized() && !mpi::environment::is_finalized()
    }

    /// Not collective. Ends all ranks at once, from any thread.
    pub(in super::super) fn abort(code: i32) -> ! {
        SimpleCommunicator::world().abort(code)
    }
}

/// Some ranks and the calls between them.
pub(in super::super) struct Group(SimpleCommunicator);

impl Group {
    /// Not collective. Number of this rank in the group, from 0.
    pub(in super::super) fn rank(&self) -> usize {
        self.0.rank() as usize
    }

    /// Not collective. Number of ranks.
    pub(in super::super) fn size(&self) -> usize {
        self.0.size() as usize
    }

    pub(super) fn communicator(&self) -> &SimpleCommunicator {
        &self.0
    }

    /// Collective. Returns when every rank has called it.
    pub(in super::super) fn barrier(&self) {
        self.0.barrier();
    }

    /// Collective, does not wait. A barrier that ends when every rank has called this.
    pub(in super::super) fn start_barrier(&self) -> Barrier {
        Barrier(Some(self.0.immediate_barrier()))
    }

    /// Collective. The values of all ranks, combined entry by entry.
    pub(in super::super) fn reduce<T: Equivalence + Copy>(&self, values: &[T], how: Operation) -> Vec<T> {
        let operation = match how {
            Operation::Sum => SystemOperation::sum(),
            Operation::Largest => SystemOperation::max(),
            Operation::Smallest => SystemOperation::min(),
            Operation::Union => SystemOperation::bitwise_or(),
        };
        let mut result = values.to_vec();
        if !values.is_empty() {
            self.0.all_reduce_into(values, &mut result[..], operation);
        }
        result
    }

    /// Collective. Sum of the values of all ranks below this one.
    pub(in super::super) fn sum_below(&self, value: u64) -> u64 {
        let mut sum = 0u64;
        self.0.exclusive_scan_into(&value, &mut sum, SystemOperation::sum());
        // MPI leaves the result of rank 0 undefined.
        if self.rank() == 0 { 0 } else { sum }
    }

    /// Collective. The values of all ranks, in rank order.
    pub(in super::super) fn gather(&self, values: &[u64]) -> Vec<u64> {
        let mut all = vec![0u64; values.len() * self.size()];
        if !values.is_empty() {
            self.0.all_gather_into(values, &mut all[..]);
        }
        all
    }

    /// Collective. Replaces the values on every rank by those of rank `root`.
    pub(in super::super) fn broadcast<T: Equivalence>(&self, root: usize, values: &mut [T]) {
        self.0.process_at_rank(root as i32).broadcast_into(values);
    }

    /// Not collective, does not wait. The next piece of a message with this tag, from one rank or from any.
    pub(in super::super) fn find(&self, source: Option<usize>, tag: i32) -> Option<Arrival> {
        let (message, status) = match source {
            Some(rank) => self.0.process_at_rank(rank as i32).immediate_matched_probe_with_tag(tag),
            None => self.0.any_process().immediate_matched_probe_with_tag(tag),
        }?;
        Some(Arrival { message, status })
    }
}

/// A barrier under way.
pub(in super::super) struct Barrier(Option<Request<'static, (), StaticScope>>);

impl Barrier {
    /// Not collective. Whether every rank has started it.
    pub(in super::super) fn is_over(&mut self) -> bool {
        match self.0.take().map(Request::test) {
            Some(Err(request)) => {
                self.0 = Some(request);
                false
            }
            Some(Ok(_)) | None => true,
        }
    }
}

/// A piece of a message that has come.
pub(in super::super) struct Arrival {
    message: Message,
    status: Status,
}

impl Arrival {
    /// Who sent it.
    pub(in super::super) fn source(&self) -> usize {
        self.status.source_rank() as usize
    }

    /// Its length, bytes.
    pub(in super::super) fn len(&self) -> usize {
        self.status.count(u8::equivalent_datatype()) as usize
    }

    /// Receives it.
    pub(in super::super) fn receive_into(self, bytes: &mut [u8]) {
        self.message.matched_receive_into(bytes);
    }
}

/// Gives the library the settings that this program needs, as far as the user has not chosen. A process that
/// has threads already is left as it is: one of them may read the environment meanwhile.
fn set_environment() {
    let version = mpi::environment::library_version().unwrap_or_default();
    let is_alone = !is_launched() && launched_ranks().is_none();
    for &(name, value) in settings(&version, is_alone) {
        if std::env::var_os(name).is_none() && has_one_thread() {
            // SAFETY: this is the only thread, so nothing reads or writes the environment meanwhile.
            unsafe { std::env::set_var(name, value) };
        }
    }
}

/// Whether this thread is the only one of the process. Where the system does not say, it is taken to have
/// others.
fn has_one_thread() -> bool {
    std::fs::read_dir("/proc/self/task").is_ok_and(|threads| threads.count() == 1)
}

/// Settings for the library that calls itself `version`, in a process that no launcher has started if it
/// `is_alone`.
fn settings(version: &str, is_alone: bool) -> &'static [(&'static str, &'static str)] {
    // A rank that waits for a message gives its core to another rank, a thread that writes files, or another
    // program with work. If none has any, it continues at once.
    const YIELD: (&str, &str) = ("OMPI_MCA_mpi_yield_when_idle", "1");
    match (version.starts_with("Open MPI v"), is_alone) {
        (false, _) => &[],
        (true, false) => &[YIELD],
        // One process alone needs no daemon beside it and no network, whose start takes half a second. Nor a
        // folder for its session: all such processes have the same, and one that ends removes it while
        // another that starts makes its own in it, which fails then.
        (true, true) => &[
            YIELD,
            ("OMPI_MCA_ess_singleton_isolated", "1"),
            ("OMPI_MCA_orte_create_session_dirs", "0"),
            ("OMPI_MCA_btl", "self"),
            ("OMPI_MCA_pml", "ob1"),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::{has_one_thread, settings};

    /// A process with threads does not get its environment changed. A test is a thread beside that of its
    /// harness.
    #[test]
    fn threads_are_noticed() {
        std::thread::scope(|scope| {
            let other = scope.spawn(std::thread::park);
            assert!(!has_one_thread());
            other.thread().unpark();
        });
    }

    /// Yielding for all versions of Open MPI, no network for a process alone; nothing for other libraries.
    #[test]
    fn settings_fit_the_library() {
        for version in
            ["Open MPI v1.10.7, package: Debian", "Open MPI v4.1.4, ident: 4.1.4", "Open MPI v5.0.7, x"]
        {
            assert_eq!(settings(version, false), [("OMPI_MCA_mpi_yield_when_idle", "1")], "{version}");
            let alone = settings(version, true);
            assert!(alone.starts_with(settings(version, false)) && alone.len() == 5, "{version}");
        }
        for other in ["MPICH Version:\t4.2.1", "Intel(R) MPI Library 2021.9 for Linux* OS", ""] {
            assert!(settings(other, false).is_empty() && settings(other, true).is_empty(), "{other}");
        }
    }
}
