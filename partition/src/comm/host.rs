//! The ranks of one machine.

use mpi::collective::SystemOperation;
use mpi::traits::{Communicator, CommunicatorCollectives};

use super::Comm;

impl Comm {
    /// Not collective. Number of ranks on this rank's machine.
    pub fn host_size(&self) -> usize {
        self.host().size() as usize
    }

    /// Not collective. Number of this rank among those of its machine, from 0.
    pub fn host_rank(&self) -> usize {
        self.host().rank() as usize
    }

    /// Collective. As [`Comm::sum_u64`], over the ranks of this rank's machine; wraps around.
    pub fn host_sum_u64(&self, value: u64) -> u64 {
        let mut sum = 0;
        self.host().all_reduce_into(&value, &mut sum, SystemOperation::sum());
        sum
    }

    /// Collective. The bits that any rank of this rank's machine has set; all ranks give the same number of
    /// words.
    pub fn host_union(&self, bits: &[u64]) -> Vec<u64> {
        let mut union = bits.to_vec();
        if !bits.is_empty() {
            self.host().all_reduce_into(bits, &mut union[..], SystemOperation::bitwise_or());
        }
        union
    }
}
