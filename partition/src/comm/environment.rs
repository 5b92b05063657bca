//! What the MPI library is told by environment variables, before it starts, and what its launcher tells us.
//!
//! What must be known before `mpirun` itself starts (running as root, more ranks than cores) stands in `jobs/environment`.

/// Not collective. Whether a launcher has started this process as one of its ranks: `mpirun` of Open MPI or MPICH, or
/// `srun` through PMI or PMIx. A process that none has started is alone.
pub fn is_launched() -> bool {
    ["OMPI_COMM_WORLD_SIZE", "PMI_RANK", "PMI_SIZE", "PMIX_RANK"]
        .iter()
        .any(|name| std::env::var_os(name).is_some())
}

/// Tells the library what this program needs of it, as far as the user has not chosen.
///
/// # Safety
///
/// Nothing reads the environment meanwhile; see [`std::env::set_var`].
pub(super) unsafe fn prepare() {
    let version = mpi::environment::library_version().unwrap_or_default();
    for (name, value) in settings(&version) {
        if std::env::var_os(name).is_none() {
            // SAFETY: the caller's promise.
            unsafe { std::env::set_var(name, value) };
        }
    }
}

/// Settings for the library that calls itself `version`.
fn settings(version: &str) -> Vec<(&'static str, &'static str)> {
    let Some(number) = version.strip_prefix("Open MPI v") else { return Vec::new() };
    // A rank that waits for a message gives its core to whoever has work: another rank, a thread that writes files,
    // another program. Where nobody has, it comes back at once.
    let mut settings = vec![("OMPI_MCA_mpi_yield_when_idle", "1")];
    let major: Option<u32> = number.split('.').next().and_then(|digits| digits.parse().ok());
    if major.is_some_and(|major| major <= 4) {
        // ROMIO accesses files. Open MPI's own layer `ompio` has written wrong parallel HDF5 files up to version 4.
        settings.push(("OMPI_MCA_io", "^ompio"));
    }
    settings
}

#[cfg(test)]
mod tests {
    use super::settings;

    /// ROMIO for Open MPI up to version 4 only; yielding for all its versions; nothing for other libraries.
    #[test]
    fn settings_fit_the_library() {
        let names = |version: &str| settings(version).iter().map(|(name, _)| *name).collect::<Vec<_>>();
        let both = ["OMPI_MCA_mpi_yield_when_idle", "OMPI_MCA_io"];
        for old in
            ["Open MPI v1.10.7, package: Debian", "Open MPI v4.1.4, package: Debian OpenMPI, ident: 4.1.4"]
        {
            assert_eq!(names(old), both, "{old}");
        }
        for new in ["Open MPI v5.0.7, package: Debian OpenMPI", "Open MPI v10.0.0, package: x"] {
            assert_eq!(names(new), both[..1], "{new}");
        }
        for other in ["MPICH Version:\t4.2.1", "Intel(R) MPI Library 2021.9 for Linux* OS", ""] {
            assert!(names(other).is_empty(), "{other}");
        }
    }
}
