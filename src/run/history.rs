//! Rows of `history.csv`.
use std::fmt::Arguments;

use crate::adaptivity::resample::ledger::LedgerTotals;
use crate::boundary::motion::Motion;
use crate::boundary::rigid::turning::quaternion;
use crate::boundary::{Collider, ColliderState};
use crate::exact_sum::ExactSum;
use crate::job::Problem;
use crate::job::problem::Coordinates;
use crate::load::Water;
use crate::material::{Failed, SHOCK_SUMS};
use crate::probe::Readings;
use crate::row::{AXES, Row};
use crate::solver::diagnostics::totals::{GridTotals, ParticleTotals};
use crate::solver::migration::crossings::Crossings;
use crate::solver::state::bookings::{FAILED_SUMS, ForceAndWork, Reaction, SOURCE_SUMS};
use crate::solver::state::relaxation::Relaxation;
use crate::solver::{Effort, Solver};

/// The state of a step in sums over all ranks, with what it belongs to.
pub struct Totals<'a, const D: usize> {
    /// The solver.
    pub solver: &'a Solver<D>,
    /// Sums over particles.
    pub particles: ParticleTotals,
    /// Sums over nodes.
    pub grid: GridTotals,
    /// Particles that crossed faces.
    pub crossings: Crossings,
    /// Splits and merges; none without adaptivity.
    pub ledger: Option<LedgerTotals>,
    /// Work of the shift of fluids, J; none without fluids.
    pub shift_work: Option<f64>,
    /// Work and heat of artificial viscosity, J; none without.
    pub shock_work: Option<[f64; SHOCK_SUMS]>,
    /// Of each source.
    pub sources: Vec<[f64; SOURCE_SUMS]>,
    /// Of particles that have failed; none where none can.
    pub failed: Option<[f64; FAILED_SUMS]>,
    /// Of the water that has come into pores.
    pub pores: Vec<[f64; SOURCE_SUMS]>,
    /// Flow at each head and through the surface, m³/s.
    pub flows: Vec<[f64; 1]>,
    /// Of each load.
    pub loads: Vec<ForceAndWork>,
    /// Of each contact between bodies.
    pub bodies: Vec<ForceAndWork>,
    /// Of each probe.
    pub probes: Vec<Readings<D>>,
    /// Of each track.
    pub tracks: Vec<Readings<D>>,
    /// Mass that has passed each flux, kg.
    pub passed: Vec<f64>,
    /// Force on each face of the domain, N.
    pub faces: Vec<[f64; 3]>,
    /// Thrust of the water on each face, N.
    pub thrust_on_faces: Vec<f64>,
    /// Force and torque on each collider.
    pub reactions: Vec<Reaction>,
    /// Force of the water on each collider, N.
    pub thrust_on_colliders: Vec<[f64; D]>,
}

/// Names and units of the columns behind the step.
pub fn columns<const D: usize>(problem: &Problem<D>) -> Vec<(String, &'static str)> {
    Row::names(|row| add(row, problem, None))
}

/// Values of a row.
pub fn values<const D: usize>(problem: &Problem<D>, of: &Totals<'_, D>) -> Vec<f64> {
    Row::values(|row| add(row, problem, Some(of)))
}

/// The columns behind the step: those of every job, and those of what a job has.
fn add<const D: usize>(row: &mut Row, problem: &Problem<D>, of: Option<&Totals<'_, D>>) {
    let axes = &AXES[..D];
    of_state(row, of);
    if problem.adaptivity.is_some() {
        of_ledger(row, of.and_then(|of| of.ledger.as_ref()));
    }
    if problem.materials.iter().any(|material| material.build().is_fluid()) {
        row.add(format_args!("shift_work"), "J", of.and_then(|of| of.shift_work));
    }
    if problem.viscosity.is_some() {
        let work = of.and_then(|of| of.shock_work);
        row.vector(format_args!("viscous_"), &["work", "heat"], "J", work);
    }
    if problem.has_equilibrium() {
        of_relaxation(row, of.map(|of| of.solver));
    }
    if problem.quasi_static.is_some() {
        of_effort(row, of.map(|of| &of.solver.equilibrium.effort));
    }
    if problem.has_reduction() {
        let factor = |of: &Totals<'_, D>| of.solver.physics.strength_factor(of.solver.clock.time);
        row.add(format_args!("strength_factor"), "", of.map(factor));
    }
    if problem.stages.len() > 1 {
        row.add(format_args!("stage"), "", of.map(|of| (of.solver.physics.stage() + 1) as f64));
    }
    for (i, source) in problem.sources.iter().enumerate() {
        let names = [format_args!("fed_{}", source.name), format_args!("fed_energy_{}", source.name)];
        mass_momentum_energy::<D>(row, names, of.map(|of| &of.sources[i]));
    }
    if problem.materials.iter().any(|material| material.failed != Failed::Stays) {
        of_failed::<D>(row, of.and_then(|of| of.failed.as_ref()));
    }
    if problem.output.followed.saturation {
        let names = [format_args!("pore_water"), format_args!("pore_water_energy")];
        mass_momentum_energy::<D>(row, names, of.map(|of| &of.pores[0]));
    }
    if let Some(seepage) = &problem.seepage {
        let names = seepage.heads.iter().map(|head| &*head.name).chain(["surface"]);
        for (i, name) in names.enumerate() {
            row.add(format_args!("flow_{name}"), "m³/s", of.map(|of| of.flows[i][0]));
        }
    }
    for (i, load) in problem.loads.iter().enumerate() {
        row.vector(format_args!("load_{}", load.name), axes, "N", of.map(|of| of.loads[i].force));
        row.add(format_args!("work_{}", load.name), "J", of.map(|of| of.loads[i].work));
    }
    for (i, (name, two_sides)) in problem.body_contacts.names.iter().enumerate() {
        if *two_sides {
            row.vector(format_args!("contact_{name}"), axes, "N", of.map(|of| of.bodies[i].force));
        }
        row.add(format_args!("contact_work_{name}"), "J", of.map(|of| of.bodies[i].work));
    }
    for (i, probe) in problem.probes.iter().enumerate() {
        let (suffix, readings) = (format!("_{}", probe.name), of.map(|of| &of.probes[i]));
        probe.quantities.iter().for_each(|it| it.add_to(row, &suffix, readings, &problem.origin));
    }
    for (i, track) in problem.tracks.iter().enumerate() {
        let (suffix, readings) = (format!("_{}", track.name), of.map(|of| &of.tracks[i]));
        track.quantities.iter().for_each(|it| it.add_to(row, &suffix, readings, &problem.origin));
    }
    for (i, flux) in problem.fluxes.iter().enumerate() {
        row.add(format_args!("passed_{}", flux.name), "kg", of.map(|of| of.passed[i]));
    }
    let faces = axes.iter().flat_map(|axis| ["min", "max"].map(|side| (axis, side))).enumerate();
    if problem.face_forces {
        for (i, (axis, side)) in faces.clone() {
            row.vector(format_args!("force{axis}_{side}"), axes, "N", of.map(|of| of.faces[i]));
        }
    }
    let has_thrust = has_thrust(problem);
    if problem.face_forces && has_thrust {
        for (i, (axis, side)) in faces {
            row.add(format_args!("water{axis}_{side}{axis}"), "N", of.map(|of| of.thrust_on_faces[i]));
        }
    }
    for (i, collider) in problem.colliders.iter().enumerate() {
        of_collider(row, collider, &problem.origin, of.map(|of| (of, i)));
        if has_thrust && collider.deforming.is_none() {
            let thrust = of.map(|of| of.thrust_on_colliders[i]);
            row.vector(format_args!("water_{}", collider.name), axes, "N", thrust);
        }
    }
}

/// Whether the water presses on colliders and faces with a pressure that the job gives.
pub fn has_thrust<const D: usize>(problem: &Problem<D>) -> bool {
    let given = |water: &Water| water.quantity().is_some();
    problem.loads.iter().any(|load| load.water().is_some_and(given))
}

/// Columns of every job. Rings do not spin, and the moments of their momenta along the radius cancel.
fn of_state<const D: usize>(row: &mut Row, of: Option<&Totals<'_, D>>) {
    let clock = of.map(|of| of.solver.clock);
    row.add(format_args!("time"), "s", clock.map(|clock| clock.time));
    row.add(format_args!("dt"), "s", clock.map(|clock| clock.dt));
    let (particles, grid) = (of.map(|of| &of.particles), of.map(|of| &of.grid));
    row.add(format_args!("kinetic_energy"), "J", particles.map(|of| of.kinetic));
    row.add(format_args!("elastic_energy"), "J", particles.map(|of| of.elastic));
    row.add(format_args!("gravitational_energy"), "J", particles.map(|of| of.gravitational));
    row.add(format_args!("plastic_work"), "J", particles.map(|of| of.plastic_work));
    row.vector(format_args!("momentum"), &AXES, "kg m/s", particles.map(|of| of.momentum));
    let spin = of.map(|of| if is_ring(of) { [0.0; 3] } else { of.grid.angular_momentum });
    row.vector(format_args!("angular_momentum"), &AXES, "kg m²/s", spin);
    row.add(format_args!("mass"), "kg", particles.map(|of| of.mass));
    row.add(format_args!("grid_mass"), "kg", grid.map(|of| of.mass));
    row.add(format_args!("particles"), "", particles.map(|of| of.count as f64));
    let crossings = of.map(|of| &of.crossings);
    let mass = |i: usize| crossings.map(|of| ExactSum::to_f64(&of.masses[i]));
    row.add(format_args!("put_back"), "", crossings.map(|of| of.put_back as f64));
    row.add(format_args!("deleted"), "", crossings.map(|of| of.deleted as f64));
    row.add(format_args!("deleted_mass"), "kg", mass(0));
    row.add(format_args!("left"), "", crossings.map(|of| of.left as f64));
    row.add(format_args!("left_mass"), "kg", mass(1));
}

fn is_ring<const D: usize>(of: &Totals<'_, D>) -> bool {
    of.solver.physics.coordinates == Coordinates::Axisymmetric
}

/// Columns of runs with dynamic refinement: sums since the start.
fn of_ledger(row: &mut Row, of: Option<&LedgerTotals>) {
    row.add(format_args!("splits"), "", of.map(|of| of.splits as f64));
    row.add(format_args!("merges"), "", of.map(|of| of.merges as f64));
    row.add(format_args!("merged_away"), "", of.map(|of| of.removed as f64));
    row.add(format_args!("split_energy"), "J", of.map(|of| of.split_energy));
    row.add(format_args!("merge_energy"), "J", of.map(|of| of.merge_energy));
}

/// Columns of runs towards equilibrium; not a number in stages that do not seek it.
fn of_relaxation<const D: usize>(row: &mut Row, of: Option<&Solver<D>>) {
    let of = of.map(|of| of.physics.equilibrium.map(|_| of.equilibrium.relaxation));
    let number = |get: fn(Relaxation) -> f64| of.map(|of| of.map_or(f64::NAN, get));
    row.add(format_args!("peak_speed"), "m/s", number(|of| of.speed));
    row.add(format_args!("unbalanced_acceleration"), "m/s²", number(|of| of.acceleration));
    row.add(format_args!("stops"), "", number(|of| of.stops as f64));
}

/// Columns of runs with load steps: the last one.
fn of_effort(row: &mut Row, of: Option<&Effort>) {
    row.add(format_args!("newton_iterations"), "", of.map(|of| of.newton.into()));
    row.add(format_args!("linear_iterations"), "", of.map(|of| of.linear.into()));
    row.add(format_args!("unbalanced_force"), "", of.map(|of| of.residual));
    row.add(format_args!("cuts"), "", of.map(|of| of.cuts.into()));
}

/// Mass, momentum and kinetic energy of what has come, with the names of the first and of the last.
fn mass_momentum_energy<const D: usize>(
    row: &mut Row,
    [name, energy]: [Arguments<'_>; 2],
    of: Option<&[f64; SOURCE_SUMS]>,
) {
    row.add(name, "kg", of.map(|of| of[0]));
    row.vector(name, &AXES[..D], "kg m/s", of.map(|[_, x, y, z, _]| [*x, *y, *z]));
    row.add(energy, "J", of.map(|of| of[4]));
}

/// Columns of particles that have failed and gone.
fn of_failed<const D: usize>(row: &mut Row, of: Option<&[f64; FAILED_SUMS]>) {
    row.add(format_args!("failed"), "", of.map(|[deleted, changed, ..]| deleted + changed));
    row.add(format_args!("failed_mass"), "kg", of.map(|of| of[2]));
    row.vector(format_args!("failed"), &AXES[..D], "kg m/s", of.map(|[_, _, _, x, y, z, ..]| [*x, *y, *z]));
    let ends = ["kinetic_energy", "elastic_energy", "gravitational_energy", "plastic_work"];
    let energies = of.map(|[_, _, _, _, _, _, energies @ ..]| *energies);
    row.vector(format_args!("failed_"), &ends, "J", energies);
}

/// Columns of one collider, by its number: force and torque on it, and how it moves. `origin` is the lower
/// corner of the domain, m.
fn of_collider<const D: usize>(
    row: &mut Row,
    collider: &Collider<D>,
    origin: &[f64; D],
    of: Option<(&Totals<'_, D>, usize)>,
) {
    let (axes, name) = (&AXES[..D], &collider.name);
    let reaction = of.map(|(of, i)| &of.reactions[i]);
    row.vector(format_args!("force_{name}"), axes, "N", reaction.map(|of| of.force));
    let torque = of.map(|(of, i)| if is_ring(of) { [0.0; 3] } else { of.reactions[i].torque });
    match D {
        2 => row.add(format_args!("torque_{name}"), "N m", torque.map(|torque| torque[2])),
        _ => row.vector(format_args!("torque_{name}"), &AXES, "N m", torque),
    }
    if collider.motion == Motion::Fixed {
        return;
    }
    let state = of.map(|(of, i)| &of.solver.contacts.states[i]);
    let place = |state: &ColliderState<D>| -> [f64; D] {
        let centre = collider.centre(&state.pose);
        std::array::from_fn(|a| origin[a] + centre[a])
    };
    row.vector(format_args!("position_{name}"), axes, "m", state.map(place));
    if collider.turns_freely() {
        let orientation = state.map(|state| quaternion(&state.pose.orientation));
        row.vector(format_args!("orientation_{name}"), &["_w", "_x", "_y", "_z"], "", orientation);
    } else {
        row.add(format_args!("angle_{name}"), "rad", state.map(|state| state.pose.angle));
    }
    row.vector(format_args!("velocity_{name}"), axes, "m/s", state.map(|state| state.rate.velocity));
    if collider.turns_freely() {
        row.vector(format_args!("spin_{name}"), &AXES, "rad/s", state.map(|state| state.rate.turning));
    } else {
        row.add(format_args!("spin_{name}"), "rad/s", state.map(|state| state.rate.spin));
    }
}
