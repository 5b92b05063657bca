//! Warnings of `agimp check` and `agimp run`, and their refusals where the machine is too small.
use std::path::Path;
use std::process::Output;
use std::time::Instant;

use crate::common::program::{agimp, confined};
use crate::common::three_at_a_time;

/// Most seconds of processor time of what is answered at once. Three in a release build.
const AT_ONCE: u32 = 60;

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The warnings of `agimp check` about a text.
fn warnings(text: &str) -> Vec<String> {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("job.toml"), text).unwrap();
    let output = agimp(directory.path(), &["check", "job.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", words(&output));
    let lines = words(&output);
    lines.lines().filter_map(|line| line.strip_prefix("agimp: warning: ")).map(str::to_owned).collect()
}

/// A block of rubber between grips, with a tool beside.
const SOUND: &str = r#"
version = 1
dimension = 2
gravity = [0, -9.81]
[domain]
size = [4, 1]
root_edge = 0.5
[boundaries]
x_min = { kind = "separating" }
x_max = { kind = "separating" }
y_min = { kind = "separating" }
y_max = { kind = "separating" }
[[materials]]
name = "rubber"
density = 1100
model = "neo_hookean"
young = 1e6
poisson = 0.3
[[materials]]
name = "clay"
density = 2000
model = "tresca"
young = 5e7
poisson = 0.3
yield_stress = 20e3
[[bodies]]
name = "bar"
material = "rubber"
shape = { kind = "box", min = [1, 0.375], max = [2, 0.625] }
[[bodies]]
name = "ground"
material = "clay"
shape = { kind = "box", min = [3, 0], max = [4, 0.5] }
[[colliders]]
name = "left"
shape = { kind = "box", min = [0.5, 0.25], max = [1.125, 0.75] }
contact = { kind = "sticky" }
[[colliders]]
name = "right"
shape = { kind = "box", min = [1.875, 0.25], max = [2.5, 0.75] }
contact = { kind = "sticky" }
motion = { kind = "steady", velocity = [0.1, 0] }
[[colliders]]
name = "tool"
shape = { kind = "box", min = [3, 0.5], max = [4, 0.9] }
motion = { kind = "steady", velocity = [0, -0.02] }
[time]
end = 2
"#;

fn changed(changes: &[(&str, &str)]) -> String {
    changes.iter().fold(SOUND.to_owned(), |text, (from, to)| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    })
}

/// Grips hold what is inside them, and that is no overlap.
#[test]
fn a_sound_job_with_grips_has_no_warnings() {
    assert_eq!(warnings(SOUND), [""; 0]);
}

#[test]
fn mistaken_units_are_warned_of() {
    /// Changes of a sound job, and words of the warning.
    type Case<'a> = (&'a [(&'a str, &'a str)], &'a [&'a str]);
    let cases: &[Case] = &[
        // MPa and GPa for Pa, t/m³ and kN/m³ for kg/m³, km/h and mm for m.
        (&[("young = 5e7", "young = 50")], &["materials[1].yield_stress", "20 kPa", "50 Pa", "at most 0.2"]),
        (
            &[("yield_stress = 20e3", "yield_stress = 20e6")],
            &["materials[1].yield_stress", "20 MPa", "50 MPa"],
        ),
        (
            &[
                ("model = \"tresca\"", "model = \"mohr_coulomb\""),
                ("yield_stress = 20e3", "friction_angle = 20\ncohesion = 2e7"),
            ],
            &["materials[1].cohesion", "20 MPa"],
        ),
        (&[("young = 1e6", "young = 1")], &["materials[0]", "wave speed", "mm/s"]),
        (&[("density = 2000", "density = 2e-6")], &["materials[1].density", "check its unit"]),
        (&[("density = 2000", "density = 5e4")], &["materials[1].density", "50000 kg/m³"]),
        (&[("end = 2", "end = 2e-3")], &["time: the run takes about", "expected at least 100"]),
        (
            &[("gravity = [0, -9.81]", "gravity = [0, -9.81e4]")],
            &["bodies[0].material: the weight of \"bar\""],
        ),
        (&[("gravity = [0, -9.81]", "gravity = [0, \"-9.81e4 * min(t, 1)\"]")], &["the weight of \"bar\""]),
        (
            &[("velocity = [0, -0.02]", "velocity = [0, -200]")],
            &["colliders[2].motion: \"tool\" moves at 200 m/s"],
        ),
        // g/cm³ for kg/m³, MPa as Pa twice, multiples of g as m/s², mm/s as m/s.
        (&[("density = 2000", "density = 2")], &["materials[1].density", "2 kg/m³", "the lightest foams"]),
        (
            &[("yield_stress = 20e3", "yield_stress = 20e3\nhardening = 3e12")],
            &["materials[1].hardening", "3000 GPa", "50 MPa"],
        ),
        (
            &[("[time]", "[[loads]]\nname = 'shake'\nkind = 'body_force'\nacceleration = [1e7, 0]\n[time]")],
            &["bodies[0].material: the weight of \"bar\""],
        ),
        (
            &[("[time]", "[[loads]]\nname = 'grip'\nkind = 'velocity'\nx = 2e4\n[time]")],
            &["loads[0]: \"grip\" moves material at 20 km/s"],
        ),
        (
            &[(
                "motion = { kind = \"steady\", velocity = [0, -0.02]",
                "motion = { kind = \"free\", mass = 500, velocity = [0, -2e4]",
            )],
            &["colliders[2].motion: \"tool\" moves at 20 km/s"],
        ),
    ];
    for (changes, parts) in cases {
        let found = warnings(&changed(changes));
        let is_named = found.iter().any(|line| parts.iter().all(|part| line.contains(part)));
        assert!(is_named, "{changes:?}: {parts:?} are not in {found:#?}");
    }
}

#[test]
fn colliders_that_never_come_into_the_domain_are_warned_of() {
    let at = |shape: &str, motion: &str| {
        warnings(&changed(&[
            ("shape = { kind = \"box\", min = [3, 0.5], max = [4, 0.9] }", shape),
            ("motion = { kind = \"steady\", velocity = [0, -0.02] }", motion),
        ]))
    };
    let beside = "shape = { kind = \"box\", min = [5, 0], max = [6, 1] }";
    let outside = "colliders[2].shape: \"tool\" lies outside the domain from start to end";
    for (shape, motion, is_outside) in [
        (beside, "", true),
        (beside, "motion = { kind = \"steady\", velocity = [1, 0] }", true),
        (beside, "motion = { kind = \"steady\", velocity = [-1, 0] }", false),
        (
            beside,
            "motion = { kind = \"steady\", velocity = [0, 0], angular_velocity = 3 }\nreference = [6, 0.5]",
            true,
        ),
        (
            beside,
            "motion = { kind = \"steady\", velocity = [0, 0], angular_velocity = 3 }\nreference = [4.5, 0.5]",
            false,
        ),
        ("shape = { kind = \"circle\", centre = [2, -9], radius = 2 }", "", true),
        // A wall that ends where the domain ends.
        ("shape = { kind = \"box\", min = [4, 0], max = [5, 1] }", "", false),
    ] {
        let found = at(shape, motion);
        assert_eq!(
            found.iter().any(|line| line.contains(outside)),
            is_outside,
            "{shape} {motion}: {found:#?}"
        );
    }
}

/// What colliders do to water and to plates with F-bar stands in the known limits, and is said where a job
/// does it.
#[test]
fn walls_with_known_errors_are_warned_of() {
    let tank = |wall: &str| {
        format!(
            "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [2, 1]\nroot_edge = 0.5\n\
             [boundaries]\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_min.kind = 'slip'\ny_max.kind = 'slip'\n\
             [[materials]]\nname = 'water'\ndensity = 1000\nmodel = 'fluid'\nbulk_modulus = 2e5\nviscosity = 1e-3\n\
             [[bodies]]\nname = 'pool'\nmaterial = 'water'\nshape = {{ kind = 'box', min = [0.5, 0.3], max = [1.5, 0.6] }}\n\
             [[colliders]]\nname = 'floor'\nshape = {{ kind = 'box', min = [0.1, 0], max = [1.9, 0.3] }}\n{wall}\n\
             [[colliders]]\nname = 'left'\nshape = {{ kind = 'box', min = [0.1, 0], max = [0.5, 0.9] }}\n{wall}\n\
             [[colliders]]\nname = 'right'\nshape = {{ kind = 'box', min = [1.5, 0], max = [1.9, 0.9] }}\n{wall}\n\
             [time]\nend = 1\n"
        )
    };
    let moves = "motion = { kind = 'steady', velocity = [0.1, 0] }";
    let sloshes =
        "colliders[0].motion: \"pool\" lies in a tank that moves, where it loses height as it sloshes";
    let loses = "colliders[0].acts_on: \"floor\" acts on particles, as it is thinner than two cells";
    let on_particles = tank("acts_on = 'particles'");
    let thin = on_particles.replace("min = [0.1, 0], max = [1.9, 0.3]", "min = [0.1, 0.2], max = [1.9, 0.3]");
    assert_ne!(thin, on_particles);
    for (wall, job, expected) in [
        ("", tank(""), None),
        (moves, tank(moves), Some(sloshes)),
        ("on particles", on_particles, None),
        ("thin", thin, Some(loses)),
    ] {
        let found = warnings(&job);
        let of_walls = found.iter().filter(|line| line.contains("slosh")).collect::<Vec<_>>();
        assert_eq!(of_walls.len(), usize::from(expected.is_some()), "{wall}: {found:#?}");
        assert!(expected.is_none_or(|expected| of_walls[0].contains(expected)), "{wall}: {found:#?}");
    }
    let tool = "motion = { kind = \"steady\", velocity = [0, -0.02] }";
    let f_bar = ("[time]", "[numerics]\nf_bar = true\n[time]");
    let plates =
        "colliders[2].acts_on: \"tool\" acts on nodes, elastic bodies are there, and numerics.f_bar is true";
    let found = warnings(&changed(&[f_bar]));
    assert!(found.iter().any(|line| line.contains(plates)), "{found:#?}");
    let on_particles = format!("{tool}\nacts_on = \"particles\"");
    let found = warnings(&changed(&[(tool, &on_particles), f_bar]));
    assert!(!found.iter().any(|line| line.contains("f_bar")), "{found:#?}");
}

/// A wall beside sand stays on the lattice of the cells; in air or in water it is as thick as the job says.
#[test]
fn solids_that_are_thicker_or_thinner_than_their_shape_are_warned_of() {
    let job = |wide: f64, model: &str, more: &str| {
        format!(
            "version = 1\ndimension = 2\n[domain]\nsize = [4, 2]\nroot_edge = 1\n\
             [boundaries]\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_min.kind = 'slip'\ny_max.kind = 'slip'\n\
             [[materials]]\nname = 'steel'\ndensity = 2000\nmodel = 'hencky'\nyoung = 1e7\npoisson = 0.3\n\
             [[materials]]\nname = 'filling'\ndensity = 2000\n{model}\n\
             [[bodies]]\nname = 'wall'\nmaterial = 'steel'\nshape = {{ kind = 'box', min = [1, 0], max = [{}, 1] }}\n{more}\n\
             [[bodies]]\nname = 'fill'\nmaterial = 'filling'\nshape = {{ kind = 'box', min = [0, 0], max = [1, 1] }}\n\
             [time]\nend = 1\n",
            1.0 + wide
        )
    };
    let sand = "model = 'mohr_coulomb'\nyoung = 1e7\npoisson = 0.3\nfriction_angle = 30";
    let water = "model = 'fluid'\nbulk_modulus = 1e6";
    let expected = "bodies[0]: \"wall\" is 1.18 m wide along x, and its particles, which lie on the lattice of the cells, \
                    fill 1.125 m; expected faces on multiples of 125 mm, finer cells, or sampling = \"fitted\"";
    assert_eq!(warnings(&job(1.18, sand, "")), [expected]);
    for (wide, model, more) in [(1.25, sand, ""), (1.18, sand, "sampling = 'fitted'"), (1.18, water, "")] {
        assert_eq!(warnings(&job(wide, model, more)), [""; 0], "{wide} {model} {more}");
    }
}

#[test]
fn elastic_bodies_stretched_further_than_they_hold_are_warned_of() {
    let fast = ("velocity = [0.1, 0]", "velocity = [1, 0]");
    let bar = "name = \"bar\"\nmaterial = \"rubber\"";
    let thrown = format!("{bar}\nvelocity = [\"160 * (x - 1.5)\", 0]");
    let tied = [
        ("x_min = { kind = \"separating\" }", "x_min = { kind = \"sticky\" }"),
        ("min = [1, 0.375]", "min = [0, 0.375]"),
        ("min = [0.5, 0.25], max = [1.125, 0.75]", "min = [3, 0.9], max = [3.25, 1]"),
        ("velocity = [0.1, 0]", "velocity = [3, 0]"),
    ];
    let load = "[[loads]]\nname = \"pull\"\nkind = \"velocity\"\nx = 2\nshape = { kind = \"box\", min = [1.9, 0], max = [2, 1] }\n[time]";
    let traction = |force: &str| {
        format!(
            "[[loads]]\nname = \"pull\"\nkind = \"traction\"\ntraction = [{force}, 0]\nfacing = [1, 0]\nshape = {{ kind = \"box\", min = [1.99, 0], max = [2.01, 1] }}\n[time]"
        )
    };
    let cases: Vec<(Vec<(&str, String)>, &str)> = vec![
        (
            vec![(fast.0, fast.1.into())],
            "bodies[0]: \"bar\" is stretched about 3.7 times by the grips \"left\" and \"right\"",
        ),
        (vec![(bar, thrown)], "by its own velocity"),
        (tied.iter().map(|(a, b)| (*a, (*b).to_owned())).collect(), "by the grips \"right\" and x_min"),
        (
            vec![
                (
                    "name = \"right\"\nshape = { kind = \"box\", min = [1.875, 0.25], max = [2.5, 0.75] }",
                    "name = \"right\"\nshape = { kind = \"box\", min = [3, 0.9], max = [3.25, 1] }".into(),
                ),
                ("[time]", load.into()),
            ],
            "by the grips \"left\" and \"pull\"",
        ),
        (
            vec![("[time]", traction("\"500e3 * min(t, 1)\""))],
            "loads[0]: \"pull\" pulls with up to 500 kPa, 0.5 of the young of \"bar\"",
        ),
    ];
    for (changes, expected) in cases {
        let changes: Vec<(&str, &str)> = changes.iter().map(|(a, b)| (*a, b.as_str())).collect();
        let found = warnings(&changed(&changes));
        assert!(found.iter().any(|line| line.contains(expected)), "{expected} is not in {found:#?}");
    }
    let found = warnings(&changed(&[("[time]", &traction("300e3"))]));
    assert_eq!(found, [""; 0]);
}

/// The jobs of the project have the warnings that they are known to have: none. So have the templates, in
/// `command_line::templates_run_as_they_are`.
#[test]
fn jobs_of_the_project_have_no_warnings() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut jobs: Vec<_> =
        std::fs::read_dir(root.join("jobs")).unwrap().map(|entry| entry.unwrap().path()).collect();
    jobs.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    assert!(jobs.len() >= 25);
    three_at_a_time(jobs, |job| {
        let output = agimp(root, &["check", job.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output));
        assert!(!words(&output).contains("warning"), "{}: {}", job.display(), words(&output));
    });
}

const REFUSED: &str = "job.toml:1:1: tree: found a job that takes ";

/// Trees that cannot be, by their regions or by their criteria: warned of by `check`, refused by `run` before
/// anything is written.
#[test]
fn jobs_beyond_the_memory_of_the_machine_are_refused_at_once() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let criteria = "[adaptivity]\n[[adaptivity.criteria]]\nkind = \"free_surface\"\nlevel = 12\n[time]";
    let region =
        "[tree]\nregions = [{ level = 12, shape = { kind = \"box\", min = [0, 0], max = [4, 1] } }]\n[time]";
    for (name, tree, limit) in [("region", region, 8_000_000), ("criteria", criteria, 900_000)] {
        std::fs::write(here.join("job.toml"), changed(&[("[time]", tree)])).unwrap();
        let run = confined(here, AT_ONCE, Some(limit), &["run", "job.toml", "--quiet"]);
        let message = words(&run);
        assert_eq!(run.status.code(), Some(2), "{name}: {message}");
        assert!(
            message.contains(REFUSED) && message.contains("what this machine has: coarser cells"),
            "{name}: {message}"
        );
        assert!(!here.join("out").exists(), "{name}");
        let check = confined(here, AT_ONCE, Some(limit), &["check", "job.toml"]);
        let message = words(&check);
        assert_eq!(check.status.code(), Some(0), "{name}: {message}");
        assert!(message.contains("agimp: warning: tree: the job takes about "), "{name}: {message}");
    }
}

/// No abort, which would have MPI print a backtrace.
#[test]
fn memory_that_is_not_there_ends_the_program_with_a_message() {
    let directory = tempfile::tempdir().unwrap();
    let model = "model = \"hencky\", young = 1e6, poisson = 0.3";
    let arguments = ["material", "--model", model, "--test", "oedometer", "--rows", "1000000"];
    let output = confined(directory.path(), AT_ONCE, Some(200_000), &arguments);
    assert_eq!(output.status.code(), Some(1), "{:?} {}", output.status, words(&output));
    assert!(words(&output).starts_with("agimp: no memory left: found no room for "), "{}", words(&output));
}

/// Few particles and many steps: what a step costs beside its particles counts.
#[test]
fn the_wall_time_of_a_job_is_measured() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let slow =
        [("velocity = [0.1, 0]", "velocity = [1e-3, 0]"), ("velocity = [0, -0.02]", "velocity = [0, -1e-4]")];
    let job = changed(&[slow[0], slow[1], ("end = 2", "end = 3")]);
    std::fs::write(here.join("job.toml"), job).unwrap();
    let out = String::from_utf8(agimp(here, &["check", "job.toml"]).stdout).unwrap();
    let line = out.lines().find(|line| line.starts_with("wall time")).unwrap();
    assert!(line.contains("of this machine by a few steps"), "{line}");
    let told: f64 = line.split_whitespace().filter_map(|word| word.parse().ok()).next().unwrap();
    let start = Instant::now();
    let run = agimp(here, &["run", "job.toml", "--quiet"]);
    assert_eq!(run.status.code(), Some(0), "{}", words(&run));
    let taken = start.elapsed().as_secs_f64();
    // Within a factor of two on an idle machine; others may be busy with one of both.
    assert!(told < 5.0 * taken && taken < 5.0 * told, "{told} s told, {taken} s taken");
}
