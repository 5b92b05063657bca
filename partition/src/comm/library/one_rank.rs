//! One rank and no library: what it gives to reductions comes back, and messages to itself wait in a queue.

use std::cell::RefCell;
use std::marker::PhantomData;
use std::sync::atomic::{AtomicBool, Ordering};

use bytemuck::Pod;

use super::super::{Comm, CommError, environment};
use super::{Mode, Operation};

/// Set by the first start: as MPI, the library starts once per process.
static STARTED: AtomicBool = AtomicBool::new(false);

/// The library, started.
pub(in super::super) struct Library {
    group: Group,
}

impl Library {
    /// Starts the library. Refused if a launcher has started several processes: each would do the whole job,
    /// into the same files.
    pub(in super::super) fn start() -> Result<Self, CommError> {
        match environment::launched_ranks() {
            Some(ranks) if ranks > 1 => return Err(CommError::WithoutMpi(ranks)),
            _ if STARTED.swap(true, Ordering::Relaxed) => return Err(CommError::AlreadyStarted),
            _ => {}
        }
        Ok(Self { group: Group::default() })
    }

    /// That there is none.
    pub(in super::super) fn name() -> String {
        "no MPI: one rank with threads".into()
    }

    /// All ranks: this one.
    pub(in super::super) fn all(&self) -> &Group {
        &self.group
    }

    /// The ranks of this machine: this one.
    pub(in super::super) fn host(&self) -> &Group {
        &self.group
    }

    /// Whether there are other ranks to be ended.
    pub(in super::super) fn is_running() -> bool {
        false
    }

    /// Ends the process.
    pub(in super::super) fn abort(code: i32) -> ! {
        std::process::exit(code)
    }
}

/// A piece of a message that waits in the queue.
struct Piece {
    tag: i32,
    bytes: Vec<u8>,
}

/// The one rank.
#[derive(Default)]
pub(in super::super) struct Group {
    queue: RefCell<Vec<Piece>>,
}

impl Group {
    /// Number of this rank.
    pub(in super::super) fn rank(&self) -> usize {
        0
    }

    /// Number of ranks.
    pub(in super::super) fn size(&self) -> usize {
        1
    }

    /// Returns at once.
    pub(in super::super) fn barrier(&self) {}

    /// A barrier that is over.
    pub(in super::super) fn start_barrier(&self) -> Barrier {
        Barrier
    }

    /// The values.
    pub(in super::super) fn reduce<T: Copy>(&self, values: &[T], _how: Operation) -> Vec<T> {
        values.to_vec()
    }

    /// Sum over no ranks.
    pub(in super::super) fn sum_below(&self, _value: u64) -> u64 {
        0
    }

    /// The values.
    pub(in super::super) fn gather(&self, values: &[u64]) -> Vec<u64> {
        values.to_vec()
    }

    /// Leaves the values as they are.
    pub(in super::super) fn broadcast<T>(&self, _root: usize, _values: &mut [T]) {}

    /// The oldest piece with this tag.
    pub(in super::super) fn find(&self, _source: Option<usize>, tag: i32) -> Option<Arrival> {
        let mut queue = self.queue.borrow_mut();
        let place = queue.iter().position(|piece| piece.tag == tag)?;
        Some(Arrival(queue.remove(place).bytes))
    }
}

/// A barrier of one rank.
pub(in super::super) struct Barrier;

impl Barrier {
    /// It is.
    pub(in super::super) fn is_over(&mut self) -> bool {
        true
    }
}

/// A piece of a message that has come.
pub(in super::super) struct Arrival(Vec<u8>);

impl Arrival {
    /// Who sent it.
    pub(in super::super) fn source(&self) -> usize {
        0
    }

    /// Its length, bytes.
    pub(in super::super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Receives it.
    pub(in super::super) fn receive_into(self, bytes: &mut [u8]) {
        bytes.copy_from_slice(&self.0);
    }
}

/// A message on its way: its pieces are in the queue.
pub(in super::super) struct Outgoing<T: Pod>(PhantomData<T>);

impl<T: Pod> Outgoing<T> {
    /// Sends `buffer` to rank `to`, in pieces as with MPI.
    pub(in super::super) fn start(comm: &Comm, to: usize, tag: i32, _mode: Mode, buffer: Vec<T>) -> Self {
        assert!(to < comm.size(), "no rank {to} among {}", comm.size());
        let limit = comm.piece_len::<T>();
        let mut queue = comm.all().queue.borrow_mut();
        for piece in 0..=buffer.len() / limit {
            let items = &buffer[piece * limit..buffer.len().min((piece + 1) * limit)];
            queue.push(Piece { tag, bytes: bytemuck::cast_slice(items).to_vec() });
        }
        Outgoing(PhantomData)
    }

    /// Whether the send has completed.
    pub(in super::super) fn test(&mut self) -> bool {
        true
    }
}
