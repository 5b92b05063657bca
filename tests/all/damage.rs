//! Claim: a bar of brittle material breaks at its strength and takes the energy of fracture, whatever the
//! cells; same bits on any ranks and threads, and across a restart while it cracks and particles split. Failed
//! particles that are deleted or become rubble leave mass, momentum and energy in balance.
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

/// The job of the notched beam with coarse cells of this edge (m), and perhaps with half of it about the crack;
/// the places of its supports and the edge of the cells at the crack, m.
fn notched_beam(coarse: f64, is_refined: bool) -> (String, [f64; 2], f64) {
    let level = (0.025 / coarse).log2().round() as u32;
    let fine = if is_refined { 0.5 * coarse } else { coarse };
    // The middle of a fine cell is that of the beam.
    let corner = -((0.3 / fine).round() + 0.5) * fine;
    let supports = [-0.19375, 0.19375].map(|x: f64| coarse.mul_add(((x - corner) / coarse).round(), corner));
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/notched_beam.toml");
    let mut job = std::fs::read_to_string(path).expect("job");
    let mut change = |from: &str, to: String| {
        assert!(job.contains(from), "{from}");
        job = job.replace(from, &to);
    };
    change("min = [-0.303125, -0.1]", format!("min = [{corner}, -0.1]"));
    change("base_level = 1", format!("base_level = {level}"));
    if is_refined {
        change("level = 2", format!("level = {}", level + 1));
    } else {
        let region = "[[tree.regions]]\nlevel = 2\nshape = { kind = \"box\", min = [-0.04, -0.05], max = [0.04, 0.15] }\n";
        change(region, String::new());
    }
    let half = 0.5 * fine;
    change(
        "min = [-0.003125, -0.01], max = [0.003125, 0.025]",
        format!("min = [{}, -0.01], max = [{half}, 0.025]", -half),
    );
    for (from, x) in
        ["min = [-0.192, -0.04], max = [-0.189, 0.005]", "min = [0.1955, -0.04], max = [0.1985, 0.005]"]
            .into_iter()
            .zip(supports)
    {
        change(from, format!("min = [{}, -0.04], max = [{}, 0.005]", x - 1e-3, x + 1e-3));
    }
    change(
        "min = [-0.004, 0.0975], max = [0.004, 0.13]",
        format!("min = [{}, {}], max = [{}, 0.13]", -half - 1e-3, 0.1 - 0.4 * fine, half + 1e-3),
    );
    (job, supports, fine)
}

/// A notched beam in three-point bending, on three kinds of cells, one of them over a level jump: the greatest
/// moment in its middle is that of a cohesive crack between finite elements (independent code: 50424 N/m with
/// arms of 93.75 mm) within 5 %, and the crack takes the energy of its ligament within 10 %.
#[test]
#[ignore = "nightly: a minute; a bar breaks always"]
fn a_notched_beam_breaks_as_a_cohesive_crack_does_nightly() {
    for (coarse, is_refined) in [(0.025, false), (0.025, true), (0.0125, false)] {
        let directory = tempfile::tempdir().expect("temporary directory");
        let (job, [left, right], fine) = notched_beam(coarse, is_refined);
        let path = directory.path().join("beam.toml");
        std::fs::write(&path, job).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let history = History::read(directory.path(), "beam");
        let supports =
            history.column("load_left_y").iter().zip(history.column("load_right_y")).map(|(l, r)| [*l, *r]);
        // The load acts on both edges of the cell of the crack.
        let moment = supports.map(|[l, r]| -l * left - 0.25 * (l + r) * fine).fold(0.0, f64::max);
        let taken = history.last("plastic_work") / (100.0 * 0.075);
        let place = format!("cells of {coarse} m to {fine} m, supports at {left} and {right} m");
        println!("{place}: moment {moment:.1} N m, {taken:.3} of the energy");
        assert!((moment / (50424.0 * 0.09375) - 1.0).abs() < 0.05, "{place}: {moment}");
        assert!((taken - 1.0).abs() < 0.1, "{place}: {taken}");
    }
}

/// Ranks, threads and a restart while damage grows, with particles that split.
#[test]
fn damage_is_the_same_on_any_ranks_and_across_restart() {
    restart::assert_same_in_all_ways("brittle_bar_refined", |history| {
        assert!(history.last("particles") > history.column("particles")[0]);
        assert!(history.last("plastic_work") > 0.3 * ENERGY * AREA);
    });
}

/// A plate of metal that is deleted where it fails flies into rock that becomes rubble: mass is kept exactly,
/// momentum to round-off, no energy comes, on any ranks and across restarts.
#[test]
fn what_fails_goes_with_its_mass_momentum_and_energy() {
    restart::assert_same_in_all_ways("failing_blocks", |history| {
        let [first, last] = [0, history.column("mass").len() - 1];
        let at = |name: &str, row: usize| history.column(name)[row];
        let sum = |names: &[&str], row: usize| names.iter().map(|name| at(name, row)).sum::<f64>();
        assert!(at("failed", last) > 50.0 && at("failed_mass", last) > 0.0);
        assert!(at("particles", last) != at("particles", first));
        let mass = |row| sum(&["mass", "failed_mass"], row);
        assert!((mass(last) / mass(first) - 1.0).abs() < 1e-13, "{} {}", mass(first), mass(last));
        // Rubble stays in its body.
        assert!((at("mass_block", last) / at("mass_block", first) - 1.0).abs() < 1e-13);
        for axis in ["_x", "_y"] {
            let momentum = |row| sum(&[&format!("momentum{axis}"), &format!("failed{axis}")], row);
            let scale = at("momentum_x", first);
            assert!((momentum(last) - momentum(first)).abs() < 1e-11 * scale, "{axis}");
        }
        let energies = [
            "kinetic_energy",
            "elastic_energy",
            "plastic_work",
            "split_energy",
            "merge_energy",
            "failed_kinetic_energy",
            "failed_elastic_energy",
            "failed_gravitational_energy",
            "failed_plastic_work",
        ];
        let (start, end) = (sum(&energies, first), sum(&energies, last));
        println!("energy {start:.5e} J, at the end {end:.5e} J");
        assert!(end < 1.002 * start && end > 0.6 * start, "{start} {end}");
        // What has passed and what is deleted beyond the plane is counted.
        assert!(at("passed_gate", last) > 0.0);
    });
}
