//! Limits on memory.
use std::path::Path;

/// Addresses that the program and its libraries take, bytes, and the part of the others that is filled:
/// limits of a process count addresses.
const LIBRARIES: f64 = 3e8;
const FILLED: f64 = 0.6;

/// Bytes that a run may use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// All processes on this machine together: its memory, or the share of a container or batch job.
    pub host: f64,
    /// One process (`ulimit -v`).
    pub process: f64,
}

impl Limits {
    /// Those of this machine and process; infinite where the system does not say.
    pub fn of_machine() -> Self {
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let groups = groups(&read("/proc/self/cgroup"), Path::new("/sys/fs/cgroup"));
        Self {
            host: memory(&read("/proc/meminfo")).min(groups),
            process: address_space(&read("/proc/self/limits")),
        }
    }

    /// Bytes for each of some ranks of this machine.
    pub fn per_rank(&self, ranks: usize) -> f64 {
        (self.host / ranks as f64).min(FILLED * (self.process - LIBRARIES).max(0.0))
    }
}

/// Memory of the machine by `/proc/meminfo`.
fn memory(text: &str) -> f64 {
    let total = text.lines().find_map(|line| line.strip_prefix("MemTotal:"));
    let words = total.and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok());
    words.map_or(f64::INFINITY, |kilobytes| 1024.0 * kilobytes)
}

/// The limit in `/proc/self/limits`.
fn address_space(text: &str) -> f64 {
    let line = text.lines().find_map(|line| line.strip_prefix("Max address space"));
    let soft = line.and_then(|rest| rest.split_whitespace().next()?.parse().ok());
    soft.unwrap_or(f64::INFINITY)
}

/// The least limit of the control groups of this process and of those around them; `text` is
/// `/proc/self/cgroup`.
fn groups(text: &str, root: &Path) -> f64 {
    let mut least = f64::INFINITY;
    for line in text.lines() {
        let mut fields = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (fields.next(), fields.next()) else { continue };
        let (folder, name) = match controllers {
            "" => (root.to_path_buf(), "memory.max"),
            controllers if controllers.split(',').any(|own| own == "memory") => {
                (root.join("memory"), "memory.limit_in_bytes")
            }
            _ => continue,
        };
        let mut group = Some(Path::new(path.trim_start_matches('/')));
        while let Some(path) = group {
            let limit = std::fs::read_to_string(folder.join(path).join(name)).unwrap_or_default();
            if let Ok(limit) = limit.trim().parse::<f64>() {
                least = least.min(limit);
            }
            group = path.parent();
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read_as_the_system_writes_them() {
        assert_eq!(memory("MemFree: 1 kB\nMemTotal:       24683656 kB\n"), 24_683_656.0 * 1024.0);
        assert_eq!(memory(""), f64::INFINITY);
        let text = "Limit   Soft Limit  Hard Limit  Units\nMax address space         4096                 unlimited            bytes     \n";
        assert_eq!(address_space(text), 4096.0);
        assert_eq!(address_space("Max address space  unlimited unlimited bytes"), f64::INFINITY);
    }

    /// The job of a batch system is a group within a group; both versions of groups.
    #[test]
    fn groups_within_groups_have_the_least_limit() {
        let root = tempfile::tempdir().expect("temporary directory");
        let write = |path: &str, name: &str, text: &str| {
            let folder = root.path().join(path);
            std::fs::create_dir_all(&folder).expect("made");
            std::fs::write(folder.join(name), text).expect("written");
        };
        write("slurm/job_1", "memory.max", "4000\n");
        write("slurm/job_1/step_0", "memory.max", "max\n");
        write("memory/a", "memory.limit_in_bytes", "3000\n");
        write("memory", "memory.limit_in_bytes", "9223372036854771712\n");
        assert_eq!(groups("0::/slurm/job_1/step_0\n", root.path()), 4000.0);
        assert_eq!(groups("5:cpu:/\n4:memory:/a\n", root.path()), 3000.0);
        assert_eq!(groups("0::/elsewhere\n", root.path()), f64::INFINITY);
        let limits = Limits { host: 4e9, process: 2.3e9 };
        assert_eq!([1, 2, 4].map(|ranks| limits.per_rank(ranks)), [1.2e9, 1.2e9, 1e9]);
    }
}
