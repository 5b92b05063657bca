//! Cores of the machines that a run is on, and how many threads fit.
use std::fmt;

use partition::comm::Comm;

/// The cores that ranks may use: `mpirun` and batch systems bind them to some of those of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cores {
    /// Cores that this rank may use.
    own: usize,
    /// Cores that any rank of its machine may use.
    host: usize,
    /// Ranks of its machine.
    ranks: usize,
    /// Cores of all machines.
    all: usize,
    /// Machines.
    hosts: usize,
}

impl Cores {
    /// Collective. The cores of all ranks.
    pub fn survey(comm: &Comm) -> Self {
        let allowed = allowed();
        let available = std::thread::available_parallelism().map_or(1, usize::from);
        let bound = ones(&allowed);
        // Processor time may be limited beside, for all ranks of the machine together.
        let is_limited = bound == 0 || available < bound;
        // All ranks send as many words as the one with most.
        let mut words = [allowed.len() as u64];
        comm.max_u64(&mut words);
        let mut bits = allowed;
        bits.resize(words[0] as usize, 0);
        let together = ones(&comm.host_union(&bits));
        let host = if is_limited { available } else { together.max(available) };
        let is_first = comm.host_rank() == 0;
        let mut sums = if is_first { [host as u64, 1] } else { [0, 0] };
        comm.sum_u64(&mut sums);
        let [all, hosts] = sums.map(|sum| sum as usize);
        Self { own: available, host, ranks: comm.host_size(), all, hosts }
    }

    /// Threads of this rank by default: its share of the machine, as far as it is bound to that many cores.
    pub fn threads(&self) -> usize {
        (self.host / self.ranks).clamp(1, self.own.max(1))
    }

    /// Collective. A warning if a machine has more threads than cores, or a rank more than it is bound to;
    /// the same on all ranks.
    pub fn shared(&self, comm: &Comm, threads: usize) -> Option<String> {
        let here = comm.host_sum_u64(threads as u64);
        let mut excess = [here.saturating_sub(self.host as u64), threads.saturating_sub(self.own) as u64];
        comm.max_u64(&mut excess);
        // Threads of the machine and of the rank with the greatest excess.
        let mut counts = [
            if here.saturating_sub(self.host as u64) == excess[0] { here } else { 0 },
            if threads.saturating_sub(self.own) as u64 == excess[1] { threads as u64 } else { 0 },
        ];
        comm.max_u64(&mut counts);
        let [on_host, of_rank] = [counts[0] - excess[0], counts[1] - excess[1]];
        match excess {
            [0, 0] => None,
            [0, _] => Some(format!(
                "{} threads of a rank are bound to {of_rank} of the cores; expect a slower run: let the launcher bind a rank to as many cores as it has threads, or to none",
                counts[1]
            )),
            _ => {
                Some(format!("{} threads share {on_host} cores of a machine; expect a slower run", counts[0]))
            }
        }
    }
}

impl fmt::Display for Cores {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.hosts {
            1 => write!(f, "{} cores", self.all),
            hosts => write!(f, "{} cores of {hosts} machines", self.all),
        }
    }
}

/// The set of cores that this process may use, one bit each; empty where the system does not say.
fn allowed() -> Vec<u64> {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap_or_default();
    set(list).unwrap_or_default()
}

/// A list of numbers and ranges, such as `0-3,8`, as a set of bits.
fn set(list: &str) -> Option<Vec<u64>> {
    /// More cores than any machine has.
    const MOST: usize = 1 << 16;
    let mut bits = Vec::new();
    for part in list.trim().split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last): (usize, usize) = (first.parse().ok()?, last.parse().ok()?);
        if last >= MOST {
            return None;
        }
        for core in first..=last {
            let word = core / 64;
            bits.resize(bits.len().max(word + 1), 0);
            bits[word] |= 1 << (core % 64);
        }
    }
    Some(bits)
}

fn ones(bits: &[u64]) -> usize {
    bits.iter().map(|word| word.count_ones() as usize).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_cores_are_sets() {
        assert_eq!(set("0-3,8\n"), Some(vec![0b1_0000_1111]));
        assert_eq!(set("63-64"), Some(vec![1 << 63, 1]));
        assert_eq!(set(""), None);
        assert_eq!(set("0-99999999999"), None);
    }

    /// Two ranks of a machine with 16 cores: bound to 4 each, to one each, to none.
    #[test]
    fn threads_by_default_are_the_share_of_a_machine() {
        let cores = |own, host| Cores { own, host, ranks: 2, all: 3 * host, hosts: 3 };
        assert_eq!(cores(4, 8).threads(), 4);
        assert_eq!(cores(1, 2).threads(), 1);
        assert_eq!(cores(16, 16).threads(), 8);
        assert_eq!(cores(1, 1).threads(), 1);
        assert_eq!(cores(4, 8).to_string(), "24 cores of 3 machines");
    }
}
