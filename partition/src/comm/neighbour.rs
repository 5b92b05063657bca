//! Exchange with a fixed, symmetric set of neighbours, split into begin and finish.

use std::cell::Cell;
use std::rc::Rc;

use bytemuck::Pod;

use super::incoming::{Incoming, Patience};
use super::library::{Mode, Outgoing};
use super::{Comm, tag};

/// Messages and bytes that an exchange has sent since its creation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Messages sent.
    pub messages: u64,
    /// Bytes sent.
    pub bytes: u64,
}

/// Sends one message to each neighbour per call and receives one from each.
///
/// Lengths may differ from call to call; empty messages are sent too, so the receiver needs no
/// other signal. If a rank lists another as neighbour, that one must list it back.
#[derive(Debug)]
pub struct NeighbourExchange {
    comm: Comm,
    neighbours: Rc<[usize]>,
    tag: i32,
    traffic: Traffic,
    /// Set while a [`Pending`] of this exchange exists.
    busy: Rc<Cell<bool>>,
}

impl NeighbourExchange {
    /// Not collective, but every rank needs one with the same tag. `neighbours` is sorted, without
    /// duplicates, and symmetric among the ranks (see [`NeighbourExchange::is_valid`]). Exchanges
    /// under way at the same time need different tags.
    pub fn new(comm: &Comm, neighbours: Vec<usize>, tag: u16) -> Self {
        assert!(neighbours.is_sorted_by(|a, b| a < b), "neighbours must be sorted and unique");
        assert!(neighbours.last().is_none_or(|&last| last < comm.size()), "neighbour is not a rank");
        assert!(tag < 16_000, "tag beyond what each MPI library allows");
        NeighbourExchange {
            comm: comm.clone(),
            neighbours: neighbours.into(),
            tag: tag::NEIGHBOUR + i32::from(tag),
            traffic: Traffic::default(),
            busy: Rc::new(Cell::new(false)),
        }
    }

    /// Collective. An exchange with the ranks that get a request from this one and those that send it one;
    /// and the requests that came, as `(rank, request)` sorted by rank. `requests` has each rank at most
    /// once.
    pub fn by_requests<T: Pod>(
        comm: &Comm,
        requests: Vec<(usize, Vec<T>)>,
        tag: u16,
    ) -> (Self, Vec<(usize, Vec<T>)>) {
        let mut ranks: Vec<usize> = requests.iter().map(|(rank, _)| *rank).collect();
        let came = comm.sparse_exchange(requests);
        ranks.extend(came.iter().map(|(rank, _)| *rank));
        ranks.sort_unstable();
        ranks.dedup();
        (Self::new(comm, ranks, tag), came)
    }

    /// Not collective. The neighbours, in the order of messages.
    pub fn neighbours(&self) -> &[usize] {
        &self.neighbours
    }

    /// Not collective. Messages and bytes that this rank has sent through this exchange.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Collective. Whether on all ranks each neighbour lists the rank back.
    pub fn is_valid(&self) -> bool {
        let greetings = self.neighbours.iter().map(|&n| (n, vec![0u8])).collect();
        let heard = self.comm.sparse_exchange(greetings);
        !self.comm.any(!heard.iter().map(|(source, _)| source).eq(self.neighbours.iter()))
    }

    /// Collective among neighbours, does not wait. Starts to send `outgoing`, one message per
    /// neighbour in their order. The [`Pending`] owns the buffers until it is finished.
    ///
    /// # Panics
    /// If the previous `Pending` of this exchange still exists.
    pub fn begin(&mut self, outgoing: Vec<Vec<u8>>) -> Pending {
        assert!(!self.busy.get(), "an exchange was begun before the previous one was finished");
        assert_eq!(outgoing.len(), self.neighbours.len(), "one message per neighbour");
        self.busy.set(true);
        let mut sends = Vec::with_capacity(outgoing.len());
        for (&to, message) in self.neighbours.iter().zip(outgoing) {
            self.traffic.messages += 1;
            self.traffic.bytes += message.len() as u64;
            sends.push(Outgoing::start(&self.comm, to, self.tag, Mode::Standard, message));
        }
        Pending {
            comm: self.comm.clone(),
            neighbours: Rc::clone(&self.neighbours),
            tag: self.tag,
            incoming: self.neighbours.iter().map(|_| Slot::Arriving(Incoming::new())).collect(),
            missing: self.neighbours.len(),
            _sends: sends,
            busy: Rc::clone(&self.busy),
        }
    }
}

/// An exchange under way; ended by [`Pending::finish`]. If dropped it is finished, and its messages are lost.
#[must_use = "finish the exchange to get what arrived"]
pub struct Pending {
    comm: Comm,
    neighbours: Rc<[usize]>,
    tag: i32,
    incoming: Vec<Slot>,
    missing: usize,
    /// Dropped with the `Pending`, which waits until the buffers are free.
    _sends: Vec<Outgoing<u8>>,
    busy: Rc<Cell<bool>>,
}

/// The message from one neighbour.
enum Slot {
    Arriving(Incoming<u8>),
    Complete(Vec<u8>),
}

impl Pending {
    /// Not collective, does not wait. Receives the messages that have arrived so far and returns whether all
    /// have. Calls now and then during other work let long messages advance.
    pub fn progress(&mut self) -> bool {
        // By source, never "any": a fast neighbour's next message must not be taken for this one.
        for (slot, &source) in self.incoming.iter_mut().zip(self.neighbours.iter()) {
            while let Slot::Arriving(incoming) = slot {
                let Some(found) = self.comm.all().find(Some(source), self.tag) else { break };
                if let Some(message) = incoming.receive(&self.comm, found) {
                    *slot = Slot::Complete(message);
                    self.missing -= 1;
                }
            }
        }
        self.missing == 0
    }

    /// Collective among neighbours. Waits for all messages and returns them in neighbour order.
    pub fn finish(mut self) -> Vec<Vec<u8>> {
        self.wait();
        let slots = std::mem::take(&mut self.incoming);
        slots
            .into_iter()
            .map(|slot| match slot {
                Slot::Complete(message) => message,
                Slot::Arriving(_) => unreachable!("waited for all messages"),
            })
            .collect()
    }

    fn wait(&mut self) {
        let mut patience = Patience::default();
        while !self.progress() {
            patience.wait();
        }
    }
}

impl Drop for Pending {
    fn drop(&mut self) {
        // While a panic ends this rank, its neighbours' messages may never come.
        if !std::thread::panicking() {
            self.wait();
        }
        self.busy.set(false);
    }
}
