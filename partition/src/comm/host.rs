//! The ranks of one machine.

use super::Comm;
use super::library::Operation;

impl Comm {
    /// Not collective. Number of ranks on this rank's machine.
    pub fn host_size(&self) -> usize {
        self.host().size()
    }

    /// Not collective. Number of this rank among those of its machine, from 0.
    pub fn host_rank(&self) -> usize {
        self.host().rank()
    }

    /// Collective. As [`Comm::sum_u64`], over the ranks of this rank's machine; wraps around.
    pub fn host_sum_u64(&self, value: u64) -> u64 {
        self.host().reduce(&[value], Operation::Sum)[0]
    }

    /// Collective. The bits that any rank of this rank's machine has set; all ranks give the same number of
    /// words.
    pub fn host_union(&self, bits: &[u64]) -> Vec<u64> {
        self.host().reduce(bits, Operation::Union)
    }
}
