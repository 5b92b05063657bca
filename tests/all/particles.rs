//! Bodies whose particles come from a file: a lattice from a table is a box, also deformed and under stress;
//! an output is a body with the same state; same results on any ranks and across a restart; damaged files
//! give a message.

use crate::common::damage::damage;
use crate::common::launch::{Outcome, agimp, run, succeed, text};
use crate::common::random::Random;
use crate::common::restart;
use crate::common::runs::outcome;
use std::fmt::Write as _;

/// A block that falls on its floor.
fn job(shape: &str, rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [2, 2]\nroot_edge = 1\n[[materials]]\nname = 'clay'\ndensity = 1000\n\
         model = 'von_mises'\nyoung = 1e5\npoisson = 0.3\nyield_stress = 1e3\n[[bodies]]\nname = 'block'\nmaterial = 'clay'\nshape = {shape}\n{rest}\n\
         [numerics]\ntransfer = 'apic'\n"
    )
}

/// A lattice of particles 1/16 m apart in a square of 0.5 m over (0.5, 0.0625), with more columns.
fn table(names: &str, rest: impl Fn(f64, f64) -> String) -> String {
    let mut table = format!("# made by a test\nx [m], y [m]{names}\n");
    for (i, j) in (0..64).map(|at| (at / 8, at % 8)) {
        let (x, y) = (0.5 + (f64::from(i) + 0.5) / 16.0, 0.0625 + (f64::from(j) + 0.5) / 16.0);
        let _ = writeln!(table, "{x}, {y}{}", rest(x, y));
    }
    table
}

const BOX: &str = "{ kind = 'box', min = [0.5, 0.0625], max = [1, 0.5625] }";
const CELLS: &str = "particles_per_cell = 4";

fn state(outcome: &Outcome) -> Vec<&str> {
    outcome.digest.lines().filter(|line| line.contains("state/particles")).collect()
}

/// The particles of a box, with velocity and mass or volume from a table or from the job, give the run of the
/// box.
#[test]
fn a_lattice_from_a_table_is_a_box() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let rest = |velocity: &str| format!("{CELLS}\n{velocity}[time]\nend = 0.3");
    let velocity = "velocity = [1, '-0.5']\n";
    let reference = outcome(directory.path(), &job(BOX, &rest(velocity)));
    let volume = 1.0_f64 / 256.0;
    let own_velocity = table(", volume, velocity_x, velocity_y", |_, _| format!(", {volume}, 1, -0.5"));
    let mass = table(", mass [kg]", |_, _| format!("; {}", 1000.0 * volume));
    for (content, velocity) in [(own_velocity, ""), (mass, velocity)] {
        std::fs::write(directory.path().join("block.csv"), content).expect("table");
        let found =
            outcome(directory.path(), &job("{ kind = 'particles', file = 'block.csv' }", &rest(velocity)));
        assert!(found.history == reference.history);
        assert_eq!(state(&found), state(&reference));
    }
}

/// A block stretched by 1 % has the stress of a Hencky solid at the start, and its undeformed volume; given
/// this stress it has the stretch.
#[test]
fn stretch_and_stress_belong_together() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let history = |content: &str| {
        std::fs::write(directory.path().join("block.csv"), content).expect("table");
        let rest = "[time]\nend = 1e-3\n[[probes]]\nname = 'all'\nquantities = ['stress', 'volume', 'mass']";
        let found = outcome(
            directory.path(),
            &job("{ kind = 'particles', file = 'block.csv' }", rest)
                .replace("yield_stress = 1e3", "yield_stress = 1e9"),
        );
        let text = String::from_utf8(found.history).expect("text");
        let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let (names, first) = (rows.next().expect("header"), rows.next().expect("row"));
        let value = |name: &str| -> f64 {
            let at = names
                .iter()
                .position(|n| n.starts_with(name))
                .unwrap_or_else(|| panic!("{name} in {names:?}"));
            first[at].parse().expect("number")
        };
        ["stress_all_xx", "stress_all_yy", "stress_all_zz", "volume_all", "mass_all"].map(value)
    };
    let strain = 1.01_f64.ln();
    let (lambda, mu) = (1e5 * 0.3 / 1.3 / 0.4, 1e5 / 2.6);
    let exact = [(lambda + 2.0 * mu) * strain / 1.01, lambda * strain / 1.01, lambda * strain / 1.01];
    let stretched =
        table(", volume, f_xx, f_xy, f_yx, f_yy, f_zz", |_, _| ", 0.00390625, 1.01, 0, 0, 1, 1".into());
    let stressed = table(", volume, stress_xx, stress_yy, stress_zz, stress_xy", |_, _| {
        format!(", 0.00390625, {}, {}, {}, 0", exact[0], exact[1], exact[2])
    });
    for content in [stretched, stressed] {
        let found = history(&content);
        let expected = [exact[0], exact[1], exact[2], 0.25, 250.0 / 1.01];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
    }
}

/// The last output of a block that has struck the floor and yields is the first state of a body, to the last
/// bit, in the same and in a shifted domain.
#[test]
fn an_output_is_a_body_with_the_same_state() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let first = job(BOX, "velocity = [0.5, -4]\n[time]\nend = 0.1\n[output]\nevery = 0.1");
    let path = directory.path().join("first.toml");
    std::fs::write(&path, first).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &[]));
    let first = Outcome::read(directory.path(), "first");
    let shape = "{ kind = 'particles', file = 'out/first/first_000001.hdf' }";
    let path = directory.path().join("second.toml");
    std::fs::write(&path, job(shape, "[time]\nend = 0.01\n[output]\nevery = 1")).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &[]));
    let second = agimp(directory.path()).args(["digest", "--parts", "out/second/second_000000.hdf"]).output();
    let second = text(&second.expect("starts"));
    for line in state(&first)
        .into_iter()
        .filter(|line| !line.contains("particles/tag") && !line.contains("particles/id"))
    {
        assert!(second.contains(line), "{line} in {second}");
    }
    assert!(state(&first).len() > 8);
}

/// Particles of no order in a tree with two levels: the same on 1 to 3 ranks and across a restart.
#[test]
fn same_on_any_ranks_and_across_restart() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let file = directory.path().join("block.csv");
    let content = table(", volume", |x, y| format!(", {}", (1.0 + 0.1 * (9.0 * x + 7.0 * y).sin()) / 256.0));
    std::fs::write(&file, content).expect("table");
    let rest = "velocity = [2, -3]\n[time]\nend = 0.15\n[checkpoint]\nevery_steps = 20\nkeep = 99\n[tree]\nbase_level = 1\n\
                [[tree.regions]]\nlevel = 3\nshape = { kind = 'box', min = [0, 0], max = [0.8, 1] }";
    let shape = format!("{{ kind = 'particles', file = '{}' }}", file.display());
    restart::assert_same_on_any_ranks(&job(&shape, rest), "block", |_, _| {});
}

/// Tables, PLY and outputs with bytes flipped, cut, doubled and overwritten: a body, or an error of the job;
/// never a panic.
#[test]
fn damaged_files_give_a_message() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let csv = table(", volume", |_, _| ", 0.00390625".into());
    let rows: Vec<&str> = csv.lines().skip(2).collect();
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double volume\nend_header\n{}\n",
        rows.len(),
        rows.join("\n").replace(',', " ")
    );
    std::fs::write(directory.path().join("first.toml"), job(BOX, "[time]\nend = 1e-3")).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &directory.path().join("first.toml"), &[]));
    let hdf = std::fs::read(directory.path().join("out/first/first_000000.hdf")).expect("output");
    let mut random = Random::new(3);
    let mut next = |below: usize| random.below(below as u64) as usize;
    let mut good = 0;
    for (name, bytes) in
        [("block.csv", csv.into_bytes()), ("block.ply", ply.into_bytes()), ("block.hdf", hdf)]
    {
        let path = directory.path().join("block.toml");
        std::fs::write(&path, job(&format!("{{ kind = 'particles', file = '{name}' }}"), "[time]\nend = 1"))
            .expect("job");
        for round in 0..12 {
            // The first of each is whole.
            let damaged = if round == 0 { bytes.clone() } else { damage(&bytes, &mut next) };
            std::fs::write(directory.path().join(name), damaged).expect("file");
            let output = agimp(directory.path()).args(["check", "block.toml"]).output().expect("starts");
            let ends_well = output.status.success();
            good += usize::from(ends_well);
            assert!(ends_well || output.status.code() == Some(2), "{name}: {}", text(&output));
            assert!(ends_well || round > 0, "{name}: {}", text(&output));
        }
    }
    println!("{good} of 36 are bodies all the same");
}
