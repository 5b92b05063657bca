//! Rows of `history.csv`.
use crate::adaptivity::resample::ledger::LedgerTotals;
use crate::boundary::motion::Motion;
use crate::boundary::rigid::turning::quaternion;
use crate::boundary::{Collider, ColliderState};
use crate::exact_sum::ExactSum;
use crate::io::log::history::Column;
use crate::job::Problem;
use crate::load::Water;
use crate::material::Failed;
use crate::probe;
use crate::setup;
use crate::solver::Effort;
use crate::solver::diagnostics::totals::{GridTotals, ParticleTotals};
use crate::solver::migration::crossings::Crossings;
use crate::solver::state::bookings::{FAILED_SUMS, ForceAndWork, Reaction, SOURCE_SUMS};
use crate::solver::state::relaxation::Relaxation;

const fn column(name: &'static str, unit: &'static str) -> Column<'static> {
    Column { name, unit }
}

/// Columns after the step, without those of colliders.
const COLUMNS: [Column<'static>; 20] = [
    column("time", "s"),
    column("dt", "s"),
    column("kinetic_energy", "J"),
    column("elastic_energy", "J"),
    column("gravitational_energy", "J"),
    column("plastic_work", "J"),
    column("momentum_x", "kg m/s"),
    column("momentum_y", "kg m/s"),
    column("momentum_z", "kg m/s"),
    column("angular_momentum_x", "kg m²/s"),
    column("angular_momentum_y", "kg m²/s"),
    column("angular_momentum_z", "kg m²/s"),
    column("mass", "kg"),
    column("grid_mass", "kg"),
    column("particles", ""),
    column("put_back", ""),
    column("deleted", ""),
    column("deleted_mass", "kg"),
    column("left", ""),
    column("left_mass", "kg"),
];

/// Names and units of the columns after the step. Parts of a job add their own in this order: splits and
/// merges of dynamic refinement; the work of the shift of fluids; work and heat of artificial viscosity; the
/// progress towards equilibrium; effort of load steps, and the factor over which the strength is; the number
/// of the stage, from 1; sources; failed particles; water in the pores; loads; contacts between bodies;
/// probes; tracks; fluxes; faces of the domain, and the thrust of the water on them; colliders, each with
/// that on it.
pub fn columns<const D: usize>(problem: &Problem<D>) -> Vec<(String, &'static str)> {
    let mut columns: Vec<(String, &'static str)> =
        COLUMNS.iter().map(|column| (column.name.to_owned(), column.unit)).collect();
    if problem.adaptivity.is_some() {
        columns.extend(LEDGER.map(|(name, unit)| (name.to_owned(), unit)));
    }
    if setup::physics(problem).has_fluids() {
        columns.push(("shift_work".to_owned(), "J"));
    }
    if problem.viscosity.is_some() {
        columns.extend(["viscous_work", "viscous_heat"].map(|name| (name.to_owned(), "J")));
    }
    if problem.has_equilibrium() {
        columns.extend(RELAXATION.map(|(name, unit)| (name.to_owned(), unit)));
    }
    if problem.quasi_static.is_some() {
        columns.extend(EFFORT.map(|name| (name.to_owned(), "")));
    }
    if problem.has_reduction() {
        columns.push(("strength_factor".to_owned(), ""));
    }
    if problem.stages.len() > 1 {
        columns.push(("stage".to_owned(), ""));
    }
    for source in &problem.sources {
        columns.push((format!("fed_{}", source.name), "kg"));
        AXES[..D].iter().for_each(|axis| columns.push((format!("fed_{}{axis}", source.name), "kg m/s")));
        columns.push((format!("fed_energy_{}", source.name), "J"));
    }
    if problem.materials.iter().any(|material| material.failed != Failed::Stays) {
        columns.extend(["failed", "failed_mass"].iter().zip(["", "kg"]).map(|(n, u)| ((*n).to_owned(), u)));
        AXES[..D].iter().for_each(|axis| columns.push((format!("failed{axis}"), "kg m/s")));
        columns.extend(FAILED_ENERGIES.map(|name| (name.to_owned(), "J")));
    }
    if problem.output.followed.saturation {
        columns.push(("pore_water".to_owned(), "kg"));
        AXES[..D].iter().for_each(|axis| columns.push((format!("pore_water{axis}"), "kg m/s")));
        columns.push(("pore_water_energy".to_owned(), "J"));
    }
    if let Some(seepage) = &problem.seepage {
        let names = seepage.heads.iter().map(|head| &*head.name).chain(["surface"]);
        columns.extend(names.map(|name| (format!("flow_{name}"), "m³/s")));
    }
    for load in &problem.loads {
        AXES[..D].iter().for_each(|axis| columns.push((format!("load_{}{axis}", load.name), "N")));
        columns.push((format!("work_{}", load.name), "J"));
    }
    for (name, two_sides) in &problem.body_contacts.names {
        let force = AXES[..D].iter().filter(|_| *two_sides);
        columns.extend(force.map(|axis| (format!("contact_{name}{axis}"), "N")));
        columns.push((format!("contact_work_{name}"), "J"));
    }
    let probes = problem.probes.iter().map(|probe| (&probe.name, &probe.quantities));
    let tracks = problem.tracks.iter().map(|track| (&track.name, &track.quantities));
    for (name, quantities) in probes.chain(tracks) {
        columns.extend(probe::columns::<D>(quantities, &format!("_{name}")));
    }
    columns.extend(problem.fluxes.iter().map(|flux| (format!("passed_{}", flux.name), "kg")));
    if problem.face_forces {
        for name in &AXES[..D] {
            for side in ["min", "max"] {
                columns.extend(AXES[..D].iter().map(|along| (format!("force{name}_{side}{along}"), "N")));
            }
        }
    }
    if problem.face_forces && has_thrust(problem) {
        for axis in &AXES[..D] {
            columns.extend(["min", "max"].map(|side| (format!("water{axis}_{side}{axis}"), "N")));
        }
    }
    for collider in &problem.colliders {
        let mut add = |what: &str, axis: &str, unit| {
            columns.push((format!("{what}_{}{axis}", collider.name), unit));
        };
        AXES[..D].iter().for_each(|axis| add("force", axis, "N"));
        turning_axes::<D>().for_each(|k| add("torque", if D == 2 { "" } else { AXES[k] }, "N m"));
        if collider.motion != Motion::Fixed {
            AXES[..D].iter().for_each(|axis| add("position", axis, "m"));
            if collider.turns_freely() {
                ["_w", "_x", "_y", "_z"].iter().for_each(|axis| add("orientation", axis, ""));
            } else {
                add("angle", "", "rad");
            }
            AXES[..D].iter().for_each(|axis| add("velocity", axis, "m/s"));
            if collider.turns_freely() {
                AXES.iter().for_each(|axis| add("spin", axis, "rad/s"));
            } else {
                add("spin", "", "rad/s");
            }
        }
        if has_thrust(problem) && collider.deforming.is_none() {
            AXES[..D].iter().for_each(|axis| add("water", axis, "N"));
        }
    }
    columns
}

/// Whether the water presses on colliders and faces with a pressure that the job gives.
pub fn has_thrust<const D: usize>(problem: &Problem<D>) -> bool {
    let given = |water: &Water| water.quantity().is_some();
    problem.loads.iter().any(|load| load.water().is_some_and(given))
}

/// Columns of runs with dynamic refinement: sums since the start.
const LEDGER: [(&str, &str); 5] =
    [("splits", ""), ("merges", ""), ("merged_away", ""), ("split_energy", "J"), ("merge_energy", "J")];

/// Columns of energies that go with failed particles.
const FAILED_ENERGIES: [&str; 4] =
    ["failed_kinetic_energy", "failed_elastic_energy", "failed_gravitational_energy", "failed_plastic_work"];

/// The values of a row for particles that have failed and gone.
pub fn failed_values<const D: usize>(sums: &[f64; FAILED_SUMS]) -> impl Iterator<Item = f64> {
    let [deleted, changed, mass, x, y, z, energies @ ..] = *sums;
    [deleted + changed, mass].into_iter().chain([x, y, z].into_iter().take(D)).chain(energies)
}

/// Columns of runs towards equilibrium.
const RELAXATION: [(&str, &str); 3] =
    [("peak_speed", "m/s"), ("unbalanced_acceleration", "m/s²"), ("stops", "")];

/// The values of a row for the progress towards equilibrium.
pub fn relaxation_values(relaxation: &Relaxation) -> [f64; RELAXATION.len()] {
    [relaxation.speed, relaxation.acceleration, relaxation.stops as f64]
}

/// Columns of runs with load steps.
const EFFORT: [&str; 4] = ["newton_iterations", "linear_iterations", "unbalanced_force", "cuts"];

/// The values of a row for the last load step.
pub fn effort_values(effort: &Effort) -> [f64; EFFORT.len()] {
    let Effort { newton, linear, residual, cuts, .. } = *effort;
    [newton.into(), linear.into(), residual, cuts.into()]
}

/// The values of a row for splits and merges.
pub fn ledger_values(ledger: &LedgerTotals) -> [f64; LEDGER.len()] {
    let count = |n: u64| n as f64;
    [
        count(ledger.splits),
        count(ledger.merges),
        count(ledger.removed),
        ledger.split_energy,
        ledger.merge_energy,
    ]
}

const AXES: [&str; 3] = ["_x", "_y", "_z"];

/// Components of a torque: only that about z in 2D.
fn turning_axes<const D: usize>() -> std::ops::Range<usize> {
    if D == 2 { 2..3 } else { 0..3 }
}

/// The values of a row, but for those of colliders.
pub fn row(
    time: f64,
    dt: f64,
    particles: &ParticleTotals,
    grid: &GridTotals,
    crossings: &Crossings,
) -> Vec<f64> {
    let [deleted_mass, left_mass] = crossings.masses.each_ref().map(ExactSum::to_f64);
    let [px, py, pz] = particles.momentum;
    let [lx, ly, lz] = grid.angular_momentum;
    vec![
        time,
        dt,
        particles.kinetic,
        particles.elastic,
        particles.gravitational,
        particles.plastic_work,
        px,
        py,
        pz,
        lx,
        ly,
        lz,
        particles.mass,
        grid.mass,
        particles.count as f64,
        crossings.put_back as f64,
        crossings.deleted as f64,
        deleted_mass,
        crossings.left as f64,
        left_mass,
    ]
}

/// The values of a row for one source: mass, momentum and kinetic energy.
pub fn source_values<const D: usize>(sums: &[f64; SOURCE_SUMS]) -> impl Iterator<Item = f64> {
    let [mass, x, y, z, energy] = *sums;
    [mass].into_iter().chain([x, y, z].into_iter().take(D)).chain([energy])
}

/// The values of a row for one load or contact between bodies: the force, if it has one, and the work.
pub fn force_and_work<const D: usize>(totals: &ForceAndWork, has_force: bool) -> impl Iterator<Item = f64> {
    let ForceAndWork { force, work } = *totals;
    force.into_iter().take(if has_force { D } else { 0 }).chain([work])
}

/// The values of a row for one collider. `origin` is the lower corner of the domain, m.
pub fn collider_values<const D: usize>(
    collider: &Collider<D>,
    state: &ColliderState<D>,
    reaction: &Reaction,
    origin: &[f64],
) -> Vec<f64> {
    let mut values = reaction.force[..D].to_vec();
    values.extend(&reaction.torque[turning_axes::<D>()]);
    if collider.motion != Motion::Fixed {
        let centre = collider.centre(&state.pose);
        values.extend((0..D).map(|a| origin[a] + centre[a]));
        let (pose, rate) = (&state.pose, &state.rate);
        if collider.turns_freely() {
            values.extend(quaternion(&pose.orientation).into_iter().chain(rate.velocity).chain(rate.turning));
        } else {
            values.push(pose.angle);
            values.extend(rate.velocity);
            values.push(rate.spin);
        }
    }
    values
}
