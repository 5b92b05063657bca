//! Exchange with partners that only the senders know.

use std::collections::BTreeMap;

use bytemuck::Pod;

use super::incoming::{Incoming, Patience};
use super::library::{Mode, Outgoing};
use super::{Comm, tag};

impl Comm {
    /// Collective. Sends each `(rank, message)` and returns the messages received as `(rank, message)`,
    /// sorted by source; two messages from one source stay in the order in which it gave them. Empty messages
    /// arrive too. A rank may send to itself.
    ///
    /// The receivers need not know who sends. The cost grows with the number of partners and the
    /// logarithm of the number of ranks: sends complete when they are received; when all own ones
    /// have, a rank enters a non-blocking barrier; when that ends, every message of every rank has
    /// arrived (Hoefler, Siebert, Lumsdaine: Scalable communication protocols for dynamic sparse
    /// data exchange, PPoPP 2010).
    pub fn sparse_exchange<T: Pod>(&self, outgoing: Vec<(usize, Vec<T>)>) -> Vec<(usize, Vec<T>)> {
        // A fast rank may start the next exchange while a slow one has not seen this barrier end,
        // but not the one after that. Two tags in turn therefore keep the exchanges apart.
        let tag = tag::SPARSE[self.next_sparse_parity()];
        let mut received = Vec::new();
        let mut sends = Vec::new();
        for (to, message) in outgoing {
            if to == self.rank() {
                received.push((to, message));
            } else {
                sends.push(Outgoing::start(self, to, tag, Mode::Synchronous, message));
            }
        }
        let mut arriving: BTreeMap<usize, Incoming<T>> = BTreeMap::new();
        let mut barrier = None;
        let mut patience = Patience::default();
        loop {
            if let Some(found) = self.all().find(None, tag) {
                let source = found.source();
                let incoming = arriving.entry(source).or_insert_with(Incoming::new);
                if let Some(message) = incoming.receive(self, found) {
                    received.push((source, message));
                }
                patience.reset();
                continue;
            }
            match &mut barrier {
                None => {
                    sends.retain_mut(|send| !send.test());
                    barrier = sends.is_empty().then(|| self.all().start_barrier());
                }
                Some(barrier) => {
                    if barrier.is_over() {
                        break;
                    }
                }
            }
            patience.wait();
        }
        received.sort_by_key(|&(source, _)| source); // stable
        received
    }
}
