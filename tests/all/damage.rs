//! Claim: a bar of brittle material breaks at its strength and takes the energy of fracture, whatever the
//! cells; same bits on any ranks and threads, and across a restart while it cracks and particles split.
use crate::common::history::History;
use crate::common::launch::{job, run, succeed, text};
use crate::common::restart;

/// Area of the bar, m², and energy of fracture, J/m².
const AREA: f64 = 0.05;
const ENERGY: f64 = 100.0;

/// Breaks the bar; peak of the stress (Pa), energy taken (J) and the output.
fn broken(more: &[&str]) -> (f64, f64, String) {
    let directory = tempfile::tempdir().expect("temporary directory");
    let output = succeed(&mut run(directory.path(), 1, 1, &job("brittle_bar"), more));
    let history = History::read(directory.path(), "brittle_bar");
    let stress = history.column("stress_gauge_xx");
    let peak = stress.iter().fold(0.0, |most, stress| f64::max(most, *stress));
    println!("peak {peak:.4e} Pa, taken {:.4} J", history.last("plastic_work"));
    (peak, history.last("plastic_work"), text(&output))
}

/// Peak within 5 % of the strength, energy within 10 % of that of the ligament, on two meshes.
#[test]
fn a_bar_breaks_at_its_strength_and_takes_the_energy_of_fracture() {
    for level in ["tree.base_level=0", "tree.base_level=1"] {
        let (peak, taken, _) = broken(&["--set", level]);
        assert!((peak / 3e6 - 1.0).abs() < 0.05, "{level}: {peak}");
        assert!((taken / (ENERGY * AREA) - 1.0).abs() < 0.1, "{level}: {taken}");
    }
}

/// Cells that hold more energy than a crack takes are named.
#[test]
fn bands_that_are_too_wide_are_named() {
    let (_, _, said) = broken(&["--end", "3e-3", "--set", "materials.weak.damage.fracture_energy=1"]);
    assert!(said.contains("materials[1].damage: \"weak\" in cells of 12.5 mm breaks at once"), "{said}");
}

/// Ranks, threads and a restart while damage grows, with particles that split.
#[test]
fn damage_is_the_same_on_any_ranks_and_across_restart() {
    restart::assert_same_in_all_ways("brittle_bar_refined", |history| {
        assert!(history.last("particles") > history.column("particles")[0]);
        assert!(history.last("plastic_work") > 0.3 * ENERGY * AREA);
    });
}
