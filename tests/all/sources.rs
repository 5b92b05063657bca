//! Sources through the whole program: material that enters during a run. Mass is rate times time, momentum
//! and energy are booked so that balances close, layers do not overlap, and results are the same on any
//! ranks, with refinement, and from any step on.
use std::collections::BTreeSet;
use std::path::Path;

use crate::common::history::History;
use crate::common::launch::{Outcome, agimp, contents, run, succeed, text};
use crate::common::restart;

/// Runs a job on one rank; its history, and what it said.
fn history(job: &str) -> (History, String) {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("feed.toml");
    std::fs::write(&path, job).expect("job");
    let words = text(&succeed(&mut run(directory.path(), 1, 1, &path, &[])));
    (History::read(directory.path(), "feed"), words)
}

fn assert_close(found: f64, expected: f64, share: f64, what: &str) {
    assert!((found - expected).abs() <= share * expected.abs(), "{what}: {found}, expected {expected}");
}

/// Cells of 1/16 m and particles 1/32 m apart.
const BASE: &str = "version = 1\ndimension = 2\n[domain]\nsize = [2, 1]\nroot_edge = 0.5\n[tree]\nbase_level = 1\n\
    [boundaries]\nx_max.kind = 'outflow'\ny_min.kind = 'separating'\ny_max.kind = 'separating'\n\
    [[materials]]\nname = 'sand'\ndensity = 1600\nmodel = 'drucker_prager'\nyoung = 2e5\npoisson = 0.3\nfriction_angle = 32\n\
    [[materials]]\nname = 'gel'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.2\n\
    [output]\npicture = false\nfields = ['id']\n[history]\nevery_steps = 1\n";

/// A free jet: no force acts, so what it has of mass, momentum and energy is what its source has brought. The
/// stream fills its section, and its front has gone speed times time.
#[test]
fn a_jet_has_what_its_source_brought() {
    let job = format!(
        "{BASE}[time]\nend = 0.3\n[[probes]]\nname = 'jet'\nquantities = ['centre']\n\
         [[sources]]\nname = 'jet'\nmaterial = 'gel'\nvelocity = [2, 0]\nuntil = 0.25\n\
         shape = {{ kind = 'box', min = [0.125, 0.375], max = [0.25, 0.625] }}\n"
    );
    let (history, words) = history(&job);
    assert!(!words.contains("warning: source"), "{words}");
    // Density times area times speed times time.
    let mass = 1000.0 * 0.25 * 2.0 * 0.25;
    assert_close(history.last("mass"), mass, 1e-12, "mass");
    assert_eq!(history.last("mass"), history.last("fed_jet"));
    assert_close(history.last("fed_jet_x"), 2.0 * mass, 1e-12, "momentum brought");
    assert_close(history.last("momentum_x"), 2.0 * mass, 1e-10, "momentum");
    assert_close(history.last("fed_energy_jet"), 2.0 * mass, 1e-12, "energy brought");
    assert_close(history.last("kinetic_energy"), 2.0 * mass, 1e-10, "energy");
    // The first layer enters half a distance of particles inside the shape at t = 0, the last 0.5 m behind
    // it.
    let front = 0.125 + 1.0 / 64.0 + 2.0 * history.last("time");
    assert_close(history.last("centre_jet_x"), front - 0.5 * (0.5 - 1.0 / 32.0), 1e-10, "centre");
    // At all times to a layer: 8 particles.
    for (time, fed) in
        history.column("time").iter().zip(history.column("fed_jet")).filter(|(t, _)| **t < 0.25)
    {
        let layer = 1000.0 * 8.0 / 32.0 / 32.0;
        assert!(
            (fed - 500.0 * time - 0.5 * layer).abs() <= 0.5 * layer * (1.0 + 1e-9),
            "{fed} kg at {time} s"
        );
    }
}

/// Under gravity: what a source conveys does not fall, and the impulse that holds it is booked. `dp = g m dt`
/// in each step, with what the source brings, over the middles of steps.
#[test]
fn momentum_closes_under_gravity() {
    let job = format!(
        "gravity = [0, -10]\n{BASE}[time]\nend = 0.25\n\
         [[sources]]\nname = 'belt'\nmaterial = 'sand'\nvelocity = [2, 0]\nrate = 150\n\
         shape = {{ kind = 'box', min = [0.125, 0.5], max = [0.3125, 0.625] }}\n"
    );
    let (history, _) = history(&job);
    let (mass, dt) = (history.column("mass"), history.column("dt"));
    let weight: f64 = (1..mass.len()).map(|i| -10.0 * mass[i - 1] * 0.5 * (dt[i - 1] + dt[i])).sum();
    assert!(weight < -10.0);
    let expected = history.last("fed_belt_y") + weight;
    assert!((history.last("momentum_y") - expected).abs() < 1e-10 * weight.abs());
    assert_close(history.last("momentum_x"), history.last("fed_belt_x"), 1e-10, "momentum along the belt");
    assert!(history.last("momentum_y") < 0.0, "what has left the belt falls");
    // To a layer of four particles.
    let layer = 1600.0 * 4.0 / 32.0 / 32.0;
    assert!((history.last("fed_belt") - 150.0 * history.last("time")).abs() <= layer);
}

/// A jet against a wall: what the source has brought is in the jet or has gone to the wall, in each row.
#[test]
fn a_jet_pushes_a_wall_with_its_momentum() {
    let job = format!(
        "{BASE}face_forces = true\n[time]\nend = 0.5\n\
         [[sources]]\nname = 'jet'\nmaterial = 'sand'\nvelocity = [-2, 0]\n\
         shape = {{ kind = 'box', min = [0.5, 0.375], max = [0.75, 0.5] }}\n"
    );
    let (history, _) = history(&job);
    let pushed = history.integral("force_x_min_x", 0.0);
    let brought = history.last("fed_jet_x");
    assert_close(
        brought,
        -1600.0 * 0.125 * 4.0 * 0.5,
        0.05,
        "density times area times speed squared times time",
    );
    assert!(pushed < 0.3 * brought, "the jet has reached the wall");
    assert_close(history.last("momentum_x") + pushed, brought, 1e-9, "momentum");
}

/// A mass rate holds to half a particle whatever the span, and a source that ends and one that begins share a
/// place: a hopper is filled twice. With refinement, on any ranks, across a restart amid the feeding; every
/// particle has an identifier of its own.
#[test]
fn a_hopper_is_filled_twice() {
    let source = |name: &str, rate: f64, from: f64, until: f64| {
        format!(
            "[[sources]]\nname = '{name}'\nmaterial = 'sand'\nvelocity = [0.2, -1]\nrate = {rate}\nfrom = {from}\nuntil = {until}\n\
             shape = {{ kind = 'circle', centre = [0.5, 0.8], radius = 0.1 }}\n"
        )
    };
    let job = format!(
        "gravity = [0, -9.81]\n{BASE}[time]\nend = 0.55\n[checkpoint]\nevery_steps = 60\nkeep = 99\n\
         [adaptivity]\nevery_steps = 10\ncriteria = [{{ kind = 'region', level = 2, shape = {{ kind = 'box', min = [0.25, 0], max = [0.75, 0.25] }} }}]\n\
         [[bodies]]\nname = 'floor'\nmaterial = 'sand'\nshape = {{ kind = 'box', min = [0, 0], max = [1, 0.125] }}\n\
         [[colliders]]\nname = 'wall'\nshape = {{ kind = 'box', min = [1, 0], max = [1.25, 1] }}\n{}{}",
        source("first", 123.4, 0.05, 0.21),
        source("second", 77.7, 0.3, 0.5)
    );
    restart::assert_same_on_any_ranks(&job, "feed", |directory, words| {
        assert!(!words.contains("warning: source"), "{words}");
        let history = History::read(directory, "feed");
        let particle = 1600.0 / 32.0 / 32.0;
        let first = (123.4_f64 * 0.16 / particle).round() * particle;
        let second = (77.7_f64 * 0.2 / particle).round() * particle;
        assert_close(history.last("fed_first"), first, 1e-12, "first");
        assert_close(history.last("fed_second"), second, 1e-12, "second");
        assert_close(history.last("mass"), 1600.0 * 0.125 + first + second, 1e-9, "all");
        assert!(history.last("splits") > 0.0, "refinement at work");
        assert_unique_ids(directory);
    });
}

/// Particles of the last output have identifiers of their own.
fn assert_unique_ids(directory: &Path) {
    let files = contents(&directory.join("out/feed")).into_keys();
    let last = files
        .filter(|file| file.ends_with(".hdf") && !file.contains("checkpoint") && !file.contains(".tree"))
        .max()
        .expect("an output");
    let shown = directory.join("shown");
    let mut export = agimp(directory);
    export.args(["export", "--csv", &format!("out/feed/{last}"), "--out"]).arg(&shown);
    succeed(&mut export);
    let table = std::fs::read_to_string(shown.join(last.replace(".hdf", ".csv"))).expect("a table");
    let mut rows = table.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let column = rows.next().expect("names").iter().position(|name| *name == "id").expect("identifiers");
    let ids: Vec<u64> = rows.map(|row| row[column].parse().expect("an identifier")).collect();
    assert!(ids.len() > 500, "{}", ids.len());
    assert_eq!(ids.iter().collect::<BTreeSet<_>>().len(), ids.len());
}

/// Without refinement, in a job without bodies, with particles that leave: a run goes on from any step, also
/// before the first layer.
#[test]
fn feeding_goes_on_from_any_step() {
    let job = format!(
        "{BASE}[time]\nend = 0.09\n[checkpoint]\nevery_steps = 1\nkeep = 999\n\
         [[sources]]\nname = 'jet'\nmaterial = 'gel'\nvelocity = [4, 0]\nfrom = 0.01\n\
         shape = {{ kind = 'box', min = [1.75, 0.25], max = [1.875, 0.5] }}\n"
    );
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("feed.toml");
    std::fs::write(&path, job).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &[]));
    let reference = Outcome::read(directory.path(), "feed");
    let history = History::read(directory.path(), "feed");
    assert!(history.last("left") > 0.0 && history.column("mass")[1] == 0.0);
    assert_close(history.last("mass") + history.last("left_mass"), history.last("fed_jet"), 1e-12, "mass");
    let files = contents(&directory.path().join("out/feed"));
    let all: Vec<_> =
        files.keys().filter(|file| file.contains("checkpoint") && file.ends_with("hdf")).collect();
    assert!(all.len() > 8, "{} steps", all.len());
    for checkpoint in all.iter().step_by(3) {
        let from = format!("out/feed/{checkpoint}");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet", "--restart", &from]));
        reference.assert_same(&Outcome::read(directory.path(), "feed"), &format!("restart from {from}"));
    }
}

/// A source counts its time from the stage in which it feeds, and says so if its material comes where other
/// material lies.
#[test]
fn sources_feed_in_their_stages_and_tell_when_they_are_blocked() {
    let job = format!(
        "{BASE}[time]\nend = 0.2\n[[stages]]\nname = 'wait'\nduration = 0.1\n[[stages]]\nname = 'pour'\n\
         [[bodies]]\nname = 'block'\nmaterial = 'gel'\nshape = {{ kind = 'box', min = [0.5, 0.25], max = [0.75, 0.625] }}\n\
         [[sources]]\nname = 'jet'\nmaterial = 'gel'\nvelocity = [-1, 0]\nstages = ['pour']\nuntil = 0.05\n\
         shape = {{ kind = 'box', min = [0.625, 0.5], max = [0.6875, 0.75] }}\n\
         [[probes]]\nname = 'jet'\nbodies = ['jet']\nquantities = ['mass']\n"
    );
    let (history, words) = history(&job);
    let (begun, _) = history.at("stage", 0.1);
    let before =
        history.column("time").iter().zip(history.column("mass_jet")).filter(|(time, _)| **time <= begun);
    assert!(before.map(|(_, mass)| *mass).all(|mass| mass == 0.0));
    assert_close(history.last("mass_jet"), 1000.0 * 0.25 * 0.05, 0.5 / 12.8, "mass");
    assert!(words.contains("of 13 particles came to places that other material took"), "{words}");
}
