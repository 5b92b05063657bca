//! The fence at which errors of single ranks become errors of all.

use std::fmt::Display;

use super::Comm;
use super::environment::host;

/// Error that every rank gets from [`Comm::agree`] if some rank has failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("rank {rank}{}: {message}", .host.as_ref().map_or(String::new(), |host| format!(" on host {host}")))]
pub struct Disagreement {
    /// The lowest rank that failed.
    pub rank: usize,
    /// Its host, where that is not the host of rank 0.
    pub host: Option<String>,
    /// Its error, as text.
    pub message: String,
    /// How many ranks failed.
    pub failed: usize,
}

impl Comm {
    /// Collective. `Ok` of the own value if every rank has `Ok`; otherwise the same error on every
    /// rank. Without such a fence one rank would leave a function early and the others would wait
    /// for its messages.
    pub fn agree<T, E: Display>(&self, result: Result<T, E>) -> Result<T, Disagreement> {
        // Counts down from the last rank, so that the largest entry names the lowest failing rank.
        let place = (self.size() - self.rank()) as u64;
        let mut highest = [if result.is_err() { place } else { 0 }];
        self.max_u64(&mut highest);
        if highest[0] == 0
            && let Ok(value) = result
        {
            return Ok(value);
        }
        let mut failed = [u64::from(result.is_err())];
        self.sum_u64(&mut failed);
        let rank = self.size() - highest[0] as usize;
        let mut text = match &result {
            Err(error) if rank == self.rank() => error.to_string().into_bytes(),
            _ => Vec::new(),
        };
        self.broadcast_bytes(rank, &mut text);
        let message = String::from_utf8_lossy(&text).into_owned();
        let [first, own] = [0, rank].map(|rank| {
            let mut name = host().into_bytes();
            self.broadcast_bytes(rank, &mut name);
            String::from_utf8_lossy(&name).into_owned()
        });
        let host = (own != first).then_some(own);
        Err(Disagreement { rank, host, message, failed: failed[0] as usize })
    }
}
