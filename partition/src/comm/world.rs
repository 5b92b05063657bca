//! Start and end of MPI, and the communicator handle.

use std::cell::Cell;
use std::panic::PanicHookInfo;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use super::library::{Group, Library};

/// Exit code of a job that ended by a panic (the one Rust uses for a panic in `main`).
const PANIC_CODE: i32 = 101;

/// The step that this process works on, for the message of a panic; [`NO_STEP`] before the first.
static STEP: AtomicU64 = AtomicU64::new(NO_STEP);
const NO_STEP: u64 = u64::MAX;

/// Set by the first panic of this process: threads that panic for the same reason must not repeat the
/// message.
static TOLD: AtomicBool = AtomicBool::new(false);

/// Ranks that panic for the same reason must not all report it: the others give rank 0 this long to end the
/// job first. Longer than Open MPI takes between SIGTERM, which the program may catch, and SIGKILL (1 s).
const RANK_0_FIRST: Duration = Duration::from_millis(1500);

/// Why MPI could not be started.
#[derive(Debug, thiserror::Error)]
pub enum CommError {
    /// MPI can be started once per process only.
    #[error("MPI has been started before in this process")]
    AlreadyStarted,
    /// The MPI library refuses to run in a process that has threads.
    #[error("the MPI library does not support threads beside the one that calls it (needs FUNNELED)")]
    Threads,
    /// This build has one rank, and a launcher has started this many.
    #[error(
        "found {0} processes started by a launcher; this program is built without MPI and has one rank: start it by \
         itself, with --threads for several cores, or use a build with MPI"
    )]
    WithoutMpi(usize),
}

/// The running MPI library and all its ranks.
///
/// MPI ends when the `World` and every clone of its [`Comm`] are dropped, so a communicator can
/// never outlive it. Files opened through MPI must be closed before.
#[derive(Debug)]
pub struct World {
    comm: Comm,
}

impl World {
    /// Collective. Starts MPI and installs a panic hook.
    ///
    /// Works without `mpirun` too, as a world of one rank. A panic on any thread of any rank
    /// prints `agimp: rank R, step S: <message> (<file>:<line>)` and ends all ranks; with one rank it
    /// prints the same line and unwinds as usual. See [`Comm::begin_step`] for the step.
    ///
    /// To be called before the program starts threads: waiting ranks give their cores away only then.
    pub fn init() -> Result<World, CommError> {
        let library = Library::start()?;
        let (rank, size) = (library.all().rank(), library.all().size());
        std::panic::set_hook(Box::new(move |panic| end_by_panic(rank, size, panic)));
        let shared =
            Shared { library, sparse_parity: Cell::new(0), largest_message: Cell::new(LARGEST_MESSAGE) };
        Ok(World { comm: Comm { shared: Rc::new(shared), rank, size } })
    }

    /// Not collective. Name and version of the MPI library, or that this build has none.
    pub fn library() -> String {
        Library::name()
    }

    /// Not collective. The communicator of all ranks.
    pub fn comm(&self) -> &Comm {
        &self.comm
    }
}

/// Bytes of the largest single MPI message; counts are 32-bit. Longer messages are split.
const LARGEST_MESSAGE: usize = 1 << 30;

/// A group of ranks and the calls between them. Clones share one communicator.
#[derive(Clone)]
pub struct Comm {
    shared: Rc<Shared>,
    rank: usize,
    size: usize,
}

/// The state that clones of a [`Comm`] share.
struct Shared {
    library: Library,
    /// Number of sparse exchanges so far, modulo 2.
    sparse_parity: Cell<usize>,
    /// Bytes.
    largest_message: Cell<usize>,
}

impl Comm {
    /// Not collective. Number of this rank, from 0.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Not collective. Number of ranks.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Collective. Returns when every rank has called it.
    pub fn barrier(&self) {
        self.all().barrier();
    }

    /// Not collective. From now on a panic of this process names this step.
    pub fn begin_step(&self, step: u64) {
        STEP.store(step, Ordering::Relaxed);
    }

    /// Not collective. Ends all ranks at once with this exit code.
    pub fn abort(&self, code: i32) -> ! {
        Library::abort(code)
    }

    /// Collective. Splits messages longer than `bytes` (default 2^30). Every rank must give the
    /// same value while no exchange is under way. Lets tests reach the splitting with small data.
    pub fn set_largest_message(&self, bytes: usize) {
        assert!((1..=LARGEST_MESSAGE).contains(&bytes), "largest message of {bytes} bytes");
        self.shared.largest_message.set(bytes);
    }

    pub(super) fn all(&self) -> &Group {
        self.shared.library.all()
    }

    pub(super) fn host(&self) -> &Group {
        self.shared.library.host()
    }

    /// Items of `T` in the largest single message: the same on all ranks, at least 1.
    pub(super) fn piece_len<T>(&self) -> usize {
        assert!(size_of::<T>() > 0, "messages need a type with a size");
        (self.shared.largest_message.get() / size_of::<T>()).max(1)
    }

    /// Advances the count of sparse exchanges and returns its parity.
    pub(super) fn next_sparse_parity(&self) -> usize {
        let parity = self.shared.sparse_parity.get();
        self.shared.sparse_parity.set(1 - parity);
        parity
    }
}

impl std::fmt::Debug for Comm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Comm(rank {} of {})", self.rank, self.size)
    }
}

/// The panic hook: one line, then the end of all ranks. Without it the others would wait forever.
fn end_by_panic(rank: usize, size: usize, panic: &PanicHookInfo<'_>) {
    if size > 1 && TOLD.swap(true, Ordering::Relaxed) {
        // Another thread is about to end the process; this one must not unwind into the end of MPI meanwhile.
        loop {
            std::thread::park();
        }
    }
    let running = Library::is_running();
    if rank > 0 && running {
        std::thread::sleep(RANK_0_FIRST);
    }
    let payload = panic.payload();
    let message = payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("panic without a message");
    let place = panic.location().map(|l| format!(" ({}:{})", l.file(), l.line())).unwrap_or_default();
    let step = match STEP.load(Ordering::Relaxed) {
        NO_STEP => String::new(),
        step => format!(", step {step}"),
    };
    // In one piece, or `mpirun` may put its own text between pieces; a closed pipe is no error.
    let text = format!("agimp: rank {rank}{step}: {message}{place}\n");
    let _ = std::io::Write::write_all(&mut std::io::stderr(), text.as_bytes());
    if size > 1 && running {
        // Possibly not the main thread. The process ends either way, and waiting for the main
        // thread to notice could take forever if that one waits for a message.
        Library::abort(PANIC_CODE);
    }
}
