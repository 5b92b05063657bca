//! Displacements and total strains through the whole program, by closed forms: of falling and turning bodies,
//! and of drawn metal.

use std::path::Path;

use crate::common::history::History;
use crate::common::launch::{run, succeed, text};
use crate::common::restart;
use crate::common::runs::particles;

/// A block falls from a fine part of the tree into a coarse one and back into a fine one.
const FALL: &str = r#"
version = 1
dimension = 2
gravity = [0, -10]
[domain]
size = [2, 4]
root_edge = 1
[[materials]]
name = "m"
density = 1000
model = "neo_hookean"
young = 1e4
poisson = 0.3
[[bodies]]
name = "block"
material = "m"
shape = { kind = "box", min = [0.75, 3.25], max = [1.25, 3.75] }
velocity = [0.25, 0]
[output]
fields = ["displacement", "velocity"]
every = 0.2
[history]
every_steps = 5
[checkpoint]
every_steps = 20
keep = 99
"#;

/// Places and displacements, m, in an output of a run.
fn read(directory: &Path, job: &str, number: usize) -> Vec<([f64; 3], [f64; 3])> {
    let [places, displacements] =
        [None, Some("displacement")].map(|field| particles(directory, job, number, field));
    let triple = |values: &[f64]| [values[0], values[1], values[2]];
    places.chunks(3).zip(displacements.chunks(3)).map(|(x, u)| (triple(x), triple(u))).collect()
}

/// All of it moves alike, so displacements go through splits and merges unchanged.
#[test]
fn what_falls_is_displaced_as_its_centre() {
    let rest = "[time]\nend = 0.75\n[adaptivity]\nevery_steps = 5\n[[adaptivity.criteria]]\nkind = 'region'\nlevel = 1\n\
                shape = { kind = 'box', min = [0, 3.6], max = [2, 4] }\n[[adaptivity.criteria]]\nkind = 'region'\nlevel = 1\n\
                shape = { kind = 'box', min = [0, 0], max = [2, 0.6] }\n";
    restart::assert_same_on_any_ranks(&format!("{FALL}{rest}"), "fall", |directory, _| {
        let history = History::read(directory, "fall");
        let counts = history.column("particles");
        let (fewest, last) = (counts.iter().fold(f64::MAX, |a, &b| a.min(b)), history.last("particles"));
        assert!(fewest < counts[0] && fewest < last, "it merges and splits: {fewest} of {}", counts[0]);
        let t = history.last("time");
        let particles = read(directory, "fall", 4);
        assert_eq!(particles.len(), last as usize);
        for (_, u) in particles {
            assert!((u[0] - 0.25 * t).abs() < 1e-9 && u[2] == 0.0, "{u:?}");
            assert!((u[1] + 5.0 * t * t).abs() < 1e-9, "{u:?} after {t} s");
        }
    });
}

/// `x - u` is where a particle was, while its body turns by a right angle; a second stage counts anew.
#[test]
fn displacements_of_a_turning_body() {
    let job = FALL
        .replace("gravity = [0, -10]", "")
        .replace("young = 1e4", "young = 1e6")
        .replace("velocity = [0.25, 0]", "angular_velocity = 1.5707963267948966");
    let stages = "[time]\nend = 1.0\ncfl = 0.2\n[[stages]]\nname = 'turn'\nduration = 0.6\n[[stages]]\nname = 'on'\nreset_displacement = true\n";
    let directory = tempfile::tempdir().expect("temporary directory");
    let whole = directory.path().join("turn.toml");
    std::fs::write(&whole, format!("{job}[time]\nend = 1.0\ncfl = 0.2\n")).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &whole, &["--quiet"]));
    // Particles begin in the middles of eighths.
    for (x, u) in read(directory.path(), "turn", 5) {
        for axis in 0..2 {
            let start = 8.0 * (x[axis] - u[axis]);
            assert!((start - start.floor() - 0.5).abs() < 1e-12, "{x:?} {u:?}");
        }
        assert!(u[0].hypot(u[1]) > 0.05, "{u:?}");
    }
    let staged = directory.path().join("staged.toml");
    std::fs::write(&staged, format!("{job}{stages}")).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &staged, &["--quiet"]));
    let greatest = |job: &str| {
        let outputs = std::fs::read_dir(directory.path().join("out").join(job)).expect("outputs");
        let last = outputs.filter(|entry| {
            let name = entry.as_ref().expect("entry").file_name().into_string().expect("name");
            name.ends_with(".hdf") && !name.contains("tree") && !name.contains("checkpoint")
        });
        let number = last.count() - 1;
        read(directory.path(), job, number).iter().map(|(_, u)| u[0].hypot(u[1])).fold(0.0, f64::max)
    };
    let (all, part) = (greatest("turn"), greatest("staged"));
    // Chords of 90° and of 36°.
    let ratio = 18.0_f64.to_radians().sin() / 45.0_f64.to_radians().sin();
    assert!((part / all - ratio).abs() < 0.02, "{part} of {all}");
}

/// Material that a grip draws out at a constant rate while it crosses level jumps has the logarithm of its
/// length as total strain, though its stress has long been at its limit; a stage may count it anew.
#[test]
fn total_strain_of_drawn_metal_is_the_logarithm_of_its_length() {
    let job = FALL
        .replace("gravity = [0, -10]", "")
        .replace("\"displacement\", \"velocity\"", "\"strain\", \"equivalent_strain\"")
        .replace("every = 0.2", "every = 1.0")
        .replace("min = [0.75, 3.25], max = [1.25, 3.75]", "min = [0.125, 2.25], max = [0.875, 3.5]")
        .replace("model = \"neo_hookean\"", "model = \"von_mises\"\nyield_stress = 100")
        + "[time]\nend = 1.0\n[adaptivity]\nevery_steps = 5\n[[adaptivity.criteria]]\nkind = 'region'\nlevel = 1\n\
           shape = { kind = 'box', min = [0, 0], max = [2, 0.9] }\n\
           [[loads]]\nname = 'draw'\nkind = 'velocity'\nx = '0.5 * x'\ny = '-0.5 * y'\n";
    let strains = |directory: &Path, number: usize| {
        ["strain", "equivalent_strain"].map(|name| particles(directory, "drawn", number, Some(name)))
    };
    restart::assert_same_on_any_ranks(&job, "drawn", |directory, _| {
        let history = History::read(directory, "drawn");
        let counts = history.column("particles");
        assert!(counts.iter().any(|&count| count > counts[0]), "it splits");
        let [strain, equivalent] = strains(directory, 1);
        for (strain, equivalent) in strain.chunks(6).zip(equivalent) {
            assert!((strain[0] - 0.5).abs() < 5e-3 && (strain[1] + 0.5).abs() < 5e-3, "{strain:?}");
            assert!(strain[2] == 0.0 && strain[3].abs() < 2e-3 && strain[4..] == [0.0; 2], "{strain:?}");
            assert!((equivalent - 1.0 / 3.0_f64.sqrt()).abs() < 1e-2, "{equivalent}");
        }
    });
    let staged = format!(
        "{job}[[stages]]\nname = 'a'\nduration = 0.6\n[[stages]]\nname = 'b'\nreset_displacement = true\n"
    );
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("drawn.toml");
    std::fs::write(&path, staged).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let [strain, _] = strains(directory.path(), 2);
    assert!(strain.chunks(6).all(|strain| (strain[0] - 0.2).abs() < 5e-3), "{:?}", &strain[..6]);
}

/// A layer that is drawn out to four times its length, over a level jump: neighbours drift two cells apart,
/// and with `split_gap` never one. Mass is kept to the last bit. The same on any ranks and across a restart.
#[test]
fn drawn_layers_keep_no_gaps() {
    let job = |gap: &str| {
        FALL.replace("gravity = [0, -10]", "")
            .replace("\"displacement\", \"velocity\"", "\"velocity\"")
            .replace("every = 0.2", "every = 1.0")
            .replace("size = [2, 4]", "size = [4, 1]")
            .replace("[domain]", "[tree]\nbase_level = 1\n[domain]")
            .replace("min = [0.75, 3.25], max = [1.25, 3.75]", "min = [0.25, 0], max = [0.75, 0.5]")
            .replace("velocity = [0.25, 0]", "")
            .replace("model = \"neo_hookean\"", "model = \"von_mises\"\nyield_stress = 100")
            + "[time]\nend = 1.0\n[adaptivity]\nevery_steps = 5\n"
            + gap
            + "[[adaptivity.criteria]]\nkind = 'region'\nlevel = 2\nshape = { kind = 'box', min = [3, 0], max = [4, 1] }\n\
               [[loads]]\nname = 'draw'\nkind = 'velocity'\nx = '1.3863 * x'\ny = '-1.3863 * y'\n"
    };
    // The widest stretch along x without a particle, in the cells of level 1 there.
    let widest_gap = |directory: &Path| {
        let places = particles(directory, "drawn", 1, None);
        let mut x: Vec<f64> = places.chunks(3).map(|x| x[0]).filter(|&x| x > 1.2 && x < 2.4).collect();
        x.sort_by(f64::total_cmp);
        assert!(x.last().expect("particles") - x[0] > 0.9);
        x.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max) / 0.125
    };
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("drawn.toml");
    std::fs::write(&path, job("")).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let torn = widest_gap(directory.path());
    assert!(torn > 1.5, "{torn} cells");
    restart::assert_same_on_any_ranks(&job("split_gap = 1.0\n"), "drawn", |directory, _| {
        let history = History::read(directory, "drawn");
        let (mass, gap) = (history.column("mass"), widest_gap(directory));
        println!("{gap} cells for {torn}, {} particles", history.last("particles"));
        assert!(gap < 1.0, "{gap} cells");
        assert!(mass.iter().all(|&m| m == mass[0]), "{mass:?}");
    });
}

/// A run that has not followed displacements cannot begin to on its way.
#[test]
fn restarts_do_not_invent_displacements() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("fall.toml");
    let plain = FALL.replace("\"displacement\", ", "");
    std::fs::write(&path, format!("{plain}[time]\nend = 0.1\n")).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    std::fs::write(&path, format!("{FALL}[time]\nend = 0.2\n")).expect("job");
    let output = run(directory.path(), 1, 1, &path, &["--quiet", "--restart", "out/fall/fall_000001.hdf"])
        .output()
        .expect("run");
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output).contains("displacements"), "{}", text(&output));
}

/// Sand that a turning cylinder drags along is sheared beyond what rounding leaves of its least stretch: its
/// strains stay finite, and that they are followed changes neither the run nor its end.
#[test]
fn strains_of_stirred_sand_end_no_run() {
    let job = |fields: &str| {
        format!(
            "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [1, 0.5]\nroot_edge = 0.5\n\
             [boundaries]\nleaving = 'clamp'\ny_min = {{ kind = 'sticky' }}\n[tree]\nbase_level = 2\n\
             [[materials]]\nname = 'sand'\ndensity = 1600\nmodel = 'drucker_prager'\nyoung = 2e5\npoisson = 0.25\n\
             friction_angle = 32\nmatch = 'plane_strain'\n\
             [[bodies]]\nname = 'ground'\nmaterial = 'sand'\nshape = {{ kind = 'box', min = [0, 0], max = [1, 0.1875] }}\n\
             [[colliders]]\nname = 'sill'\nacts_on = 'particles'\ncontact = {{ kind = 'sticky' }}\n\
             shape = {{ kind = 'circle', centre = [0.45, 0.05], radius = 0.08 }}\n\
             motion = {{ kind = 'steady', velocity = [0.3, 0], angular_velocity = 25 }}\n[numerics]\nf_bar = true\n\
             [time]\nend = 1\n[output]\nevery = 0.2\npicture = false\nfields = [{fields}]\n"
        )
    };
    let [with, without] = ["'strain', 'equivalent_strain', 'id'", "'id'"].map(|fields| {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("sand.toml");
        std::fs::write(&path, job(fields)).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        directory
    });
    let mut greatest: f64 = 0.0;
    for number in 0..=5 {
        let strains = particles(with.path(), "sand", number, Some("strain"));
        assert!(strains.iter().all(|strain| strain.is_finite()), "output {number}");
        greatest = strains.iter().fold(greatest, |most, strain| most.max(strain.abs()));
        let [own, other] =
            [&with, &without].map(|directory| particles(directory.path(), "sand", number, None));
        assert!(own == other, "output {number}: the particles are elsewhere");
    }
    println!("greatest strain {greatest}");
    assert!(greatest > 9.0, "{greatest}");
}
