//! Tests of results: the library and the program against closed forms, independent data and conservation
//! laws. One crate, so that the library is linked once; a module for each topic.
#[path = "../common/mod.rs"]
mod common;

mod adaptivity;
mod axisymmetry;
mod bad_jobs;
mod cohesion;
mod colliders;
mod command_line;
mod contact;
mod contact_bodies;
mod damage;
mod displacement;
mod documentation;
mod equilibrium;
mod extending;
mod faces;
mod factor_of_safety;
mod fluids;
mod footing;
mod free_bodies;
mod golden;
mod hostile_files;
mod initial_stress;
mod io_files;
mod load_step_tables;
mod load_step_walls;
mod load_step_water;
mod loads;
mod materials;
mod meshes;
mod mutations;
mod order_in_time;
mod paraview;
mod particles;
mod pictures;
mod probes;
mod quasi_static;
mod report;
mod rigid_contact;
mod ring_tables;
mod rings;
mod rings_manufactured;
mod rings_of_water;
mod seepage;
mod shocks;
mod soak;
mod softening;
mod sources;
mod spin;
mod stages;
mod surface_loads;
mod sweep;
mod ties;
mod tutorials;
mod undrained;
mod view;
mod walls_and_origin;
mod warnings;
mod water;
mod weights_axisymmetric;
mod weights_exact;
mod weights_properties;

/// The test that [`common::scenarios`] launches: the scenarios of all modules.
#[test]
#[ignore = "started by other tests"]
fn worker() {
    common::scenarios::work(&[
        axisymmetry::SCENARIOS,
        golden::SCENARIOS,
        rings::SCENARIOS,
        walls_and_origin::SCENARIOS,
        rings_manufactured::SCENARIOS,
        weights_axisymmetric::SCENARIOS,
        weights_exact::SCENARIOS,
        weights_properties::SCENARIOS,
    ]);
}
