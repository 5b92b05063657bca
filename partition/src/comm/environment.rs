//! Environment variables that launchers of ranks set, and the name of the machine.
//!
//! Settings that `mpirun` itself needs (running as root, more ranks than cores) are in `jobs/environment`.

/// Not collective. Whether a launcher has started this process as one of its ranks: `mpirun` of Open MPI or
/// MPICH, or `srun` through PMI or PMIx. A process that none has started is alone.
pub fn is_launched() -> bool {
    ["OMPI_COMM_WORLD_SIZE", "PMI_RANK", "PMI_SIZE", "PMIX_RANK"]
        .iter()
        .any(|name| std::env::var_os(name).is_some())
}

/// Not collective. Greatest number of ranks that a launcher says it has started: `mpirun` of Open MPI, that
/// of MPICH, or `srun`.
pub(super) fn launched_ranks() -> Option<usize> {
    let counts = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"];
    counts.iter().filter_map(|name| std::env::var(name).ok()?.trim().parse().ok()).max()
}

/// Not collective. Name of this machine.
pub fn host() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    if name.trim().is_empty() { "(unknown)".into() } else { name.trim().to_owned() }
}
