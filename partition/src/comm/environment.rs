//! Environment variables: settings of the MPI library, made before it starts, and those that launchers give
//! to ranks.
//!
//! Settings that `mpirun` itself needs (running as root, more ranks than cores) are in `jobs/environment`.

/// Not collective. Whether a launcher has started this process as one of its ranks: `mpirun` of Open MPI or
/// MPICH, or `srun` through PMI or PMIx. A process that none has started is alone.
pub fn is_launched() -> bool {
    ["OMPI_COMM_WORLD_SIZE", "PMI_RANK", "PMI_SIZE", "PMIX_RANK"]
        .iter()
        .any(|name| std::env::var_os(name).is_some())
}

/// Not collective. Name of this machine.
pub fn host() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    if name.trim().is_empty() { "(unknown)".into() } else { name.trim().to_owned() }
}

/// Not collective. Gives the library the settings that this program needs, as far as the user has not chosen.
/// A process that has threads already is left as it is: one of them may read the environment meanwhile.
pub(super) fn prepare() {
    let version = mpi::environment::library_version().unwrap_or_default();
    for &(name, value) in settings(&version) {
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

/// Settings for the library that calls itself `version`.
fn settings(version: &str) -> &'static [(&'static str, &'static str)] {
    if version.starts_with("Open MPI v") {
        // A rank that waits for a message gives its core to another rank, a thread that writes files, or
        // another program with work. If none has any, it continues at once.
        &[("OMPI_MCA_mpi_yield_when_idle", "1")]
    } else {
        &[]
    }
}

#[cfg(test)]
mod tests {
    use super::{has_one_thread, settings};

    /// The environment of a process with threads is not changed. A test is a thread beside that of its
    /// harness.
    #[test]
    fn threads_are_noticed() {
        std::thread::scope(|scope| {
            let other = scope.spawn(std::thread::park);
            assert!(!has_one_thread());
            other.thread().unpark();
        });
    }

    /// Yielding for all versions of Open MPI; nothing for other libraries.
    #[test]
    fn settings_fit_the_library() {
        for version in
            ["Open MPI v1.10.7, package: Debian", "Open MPI v4.1.4, ident: 4.1.4", "Open MPI v5.0.7, x"]
        {
            assert_eq!(settings(version), [("OMPI_MCA_mpi_yield_when_idle", "1")], "{version}");
        }
        for other in ["MPICH Version:\t4.2.1", "Intel(R) MPI Library 2021.9 for Linux* OS", ""] {
            assert!(settings(other).is_empty(), "{other}");
        }
    }
}
