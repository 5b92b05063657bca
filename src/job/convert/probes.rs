//! Probes of the job file to those of the program.
use super::checks::{Checks, Space};
use crate::job::parse::source::Path;
use crate::job::schema::job_file::JobFile;
use crate::probe::Probe;

/// All probes, or faults.
pub(super) fn probes<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    space: &Space<D>,
    path: &Path,
) -> Option<Vec<Probe<D>>> {
    let bodies: Vec<&str> = file.bodies.iter().map(|body| body.name.as_str()).collect();
    let mut all = Vec::new();
    for (i, written) in file.probes.iter().enumerate() {
        let here = path.index(i);
        let before = file.probes[..i].iter().map(|probe| &*probe.name);
        checks.column_name(&written.name, before, &here.key("name"));
        for (k, quantity) in written.quantities.iter().enumerate() {
            if written.quantities[..k].contains(quantity) {
                let message = "found a quantity a second time; expected each once";
                checks.fault(&here.key("quantities").index(k), message.into());
            }
        }
        let region = match &written.shape {
            Some(shape) => checks.shape(shape, space, &here.key("shape")).map(Some),
            None => Some(None),
        };
        let bodies = checks.bodies(written.bodies.as_deref(), &bodies, &here.key("bodies"));
        if let (Some(region), Some(bodies)) = (region, bodies) {
            let quantities = written.quantities.clone();
            all.push(Probe { name: written.name.clone(), region, bodies, quantities });
        }
    }
    (all.len() == file.probes.len()).then_some(all)
}
