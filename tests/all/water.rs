//! Water in the pores with a given pressure: bodies are buoyant, saturated ground rests, critical seepage lifts
//! it, and it swells as the table rises; pressures and stresses against closed forms by independent code
//! (`tests/data/water_hydrostatic.csv`).
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::common::history::History;
use crate::common::launch::{agimp, run, succeed};
use crate::common::restart;

const ELASTIC: &str = "model = 'hencky'\nyoung = 2e7\npoisson = 0.3\n";

/// A job with ground between slip faces, with cells of 1/4 m and a finer part.
fn job(water: &str, soil: &str, body: &str, rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nmin = [3, -5]\nsize = [2, 8]\nroot_edge = 2\n\
         [boundaries]\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_min.kind = 'slip'\ny_max.kind = 'separating'\n\
         [tree]\nbase_level = 1\n[[tree.regions]]\nlevel = 2\nshape = {{ kind = 'box', min = [3, -2], max = [4, 0] }}\n\
         [water]\n{water}\n[[materials]]\nname = 'soil'\n{soil}\n\
         [[bodies]]\nname = 'ground'\nmaterial = 'soil'\n{body}\n{rest}\n"
    )
}

fn written(directory: &Path, text: &str) -> PathBuf {
    let path = directory.join("ground.toml");
    std::fs::write(&path, text).expect("job");
    path
}

fn history_of(text: &str) -> History {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = written(directory.path(), text);
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    History::read(directory.path(), "ground")
}

/// The greatest speed of a run, as the root of its kinetic energy per mass, m/s.
fn liveliness(history: &History) -> f64 {
    let kinetic = history.column("kinetic_energy").iter().fold(0.0_f64, |most, &e| most.max(e));
    (2.0 * kinetic / history.last("mass")).sqrt()
}

fn rows(text: &str) -> Vec<BTreeMap<String, f64>> {
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("header").split(',').collect();
    let row = |line: &str| {
        let values = line.split(',').map(|value| value.parse().unwrap_or(f64::NAN));
        header.iter().map(|name| (*name).to_owned()).zip(values).collect()
    };
    lines.map(row).collect()
}

/// The particles of the first output as a table.
fn particles_at_start(directory: &Path) -> Vec<BTreeMap<String, f64>> {
    succeed(agimp(directory).args(["export", "out/ground", "--csv", "--out", "given"]));
    let files = std::fs::read_dir(directory.join("given")).expect("a directory");
    let first = files.map(|file| file.expect("a file").path()).min().expect("a table");
    rows(&std::fs::read_to_string(first).expect("a table").replace(" [m]", "").replace(" [Pa]", ""))
}

const GROUND: &str = "shape = { kind = 'box', min = [3, -5], max = [5, 0] }";
const SHORT: &str = "[time]\nend = 0.02\n[output]\npicture = false\n[history]\nevery_steps = 10\n";

/// Ground as heavy as the water in it, without any stress, rests to round-off at and below the water table, on
/// cells of two sizes.
#[test]
fn ground_that_floats_in_its_water_rests() {
    for level in ["0", "2.7", "'40 + 0 * x'"] {
        let soil = format!("density = 900\nsaturated_density = 1000\n{ELASTIC}");
        let history = history_of(&job(&format!("level = {level}"), &soil, GROUND, SHORT));
        let speed = liveliness(&history);
        assert!(speed < 1e-12, "level {level}: {speed} m/s");
        let weight = 9.81 * history.last("mass");
        assert!((history.last("load_water_y") / weight - 1.0).abs() < 1e-12, "all of its weight");
    }
}

/// Seepage upwards with the critical gradient, saturated over water density less 1, bears all of the ground.
#[test]
fn critical_seepage_bears_the_ground() {
    let soil = format!("density = 2000\nsaturated_density = 2000\n{ELASTIC}");
    let speed = liveliness(&history_of(&job("pressure = '-2 * 9810 * y'", &soil, GROUND, SHORT)));
    assert!(speed < 1e-11, "{speed} m/s");
    let half = liveliness(&history_of(&job("pressure = '-1.5 * 9810 * y'", &soil, GROUND, SHORT)));
    assert!(half > 1e-3, "less gradient, and the ground sinks: {half} m/s");
}

/// Level ground under its K0 stress rests as still with water as without, at any place of the table: on a row of
/// nodes, inside a box, above the ground.
#[test]
fn ground_with_a_water_table_rests_under_its_stress() {
    let soil = "density = 1600\nsaturated_density = 2000\nmodel = 'mohr_coulomb'\nyoung = 2e7\npoisson = 0.3\n\
                friction_angle = 33\ndilation_angle = 5\n";
    for stress in ["k0 = 0.45", "k0 = 0.45, surface = 0"] {
        let body = format!("{GROUND}\nstress = {{ kind = 'geostatic', {stress} }}");
        let dry = liveliness(&history_of(&job("level = -9", soil, &body, SHORT)));
        for level in [-1.0, -1.03, -2.71, 0.0, 2.5] {
            let wet = liveliness(&history_of(&job(&format!("level = {level}"), soil, &body, SHORT)));
            assert!(wet < 3.0 * dry.max(1e-11), "{stress}, level {level}: {wet} m/s, dry {dry}");
        }
    }
}

/// Effective stress and pore pressure at the start are those of the closed form: saturated to the surface, under
/// two metres of water, and with the table two metres down.
#[test]
fn stress_at_the_start_is_that_of_the_closed_form() {
    let table = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/water_hydrostatic.csv");
    let table = std::fs::read_to_string(table).expect("data");
    for (case, level) in
        [("saturated_to_surface", 0.0), ("submerged_by_hw", 2.0), ("water_table_at_hw", -2.0)]
    {
        let lines = table.lines().enumerate();
        let of_case = lines.filter(|(i, line)| *i == 0 || line.starts_with(case));
        let exact = rows(&of_case.map(|(_, line)| line).collect::<Vec<_>>().join("\n"));
        assert!(!exact.is_empty(), "{case}");
        // 16 and 20 kN/m³.
        let soil = format!("density = 1630.9887869520897\nsaturated_density = 2038.735983690112\n{ELASTIC}");
        let body = format!("{GROUND}\nparticles_per_cell = 0.5\nstress = {{ kind = 'geostatic', k0 = 0.5 }}");
        let rest = "[time]\nend = 1e-9\n[output]\npicture = false\nfields = ['stress', 'pore_pressure']\n";
        let directory = tempfile::tempdir().expect("temporary directory");
        let text = job(&format!("level = {level}"), &soil, &body, rest);
        let path = written(directory.path(), &text);
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let mut compared = 0;
        for particle in particles_at_start(directory.path()) {
            let beside = |row: &&BTreeMap<String, f64>| (row["depth"] + particle["y"]).abs() < 1e-9;
            let Some(row) = exact.iter().find(beside) else { continue };
            for (found, exact, what) in [
                (particle["pore_pressure"], row["u"], "pore pressure"),
                (-particle["stress_yy"], row["eff_vertical_compression"], "vertical effective stress"),
                (-particle["stress_xx"], row["eff_horizontal_K0"], "horizontal effective stress"),
            ] {
                assert!((found - exact).abs() < 1e-3, "{case}, {what}: {found} for {exact}");
            }
            compared += 1;
        }
        assert!(compared > 20, "{case}: {compared} particles at depths of the table");
    }
}

/// A block under water falls with its weight less that of the water in its place, Archimedes; the water does
/// the work of its force.
#[test]
fn a_block_under_water_is_buoyant() {
    let soil = format!("density = 2500\n{ELASTIC}");
    let body = "shape = { kind = 'box', min = [3.5, 0], max = [4.5, 1] }";
    let rest = "[time]\nend = 0.1\n[output]\npicture = false\n[history]\nevery_steps = 1\n";
    let history = history_of(&job("level = 3\ndensity = 1025", &soil, body, rest));
    let fall = 9.81 * (1.0 - 1025.0 / 2500.0);
    let (t, v) = (history.last("time"), history.last("momentum_y") / history.last("mass"));
    let exact = -fall * history.time_of_velocities();
    assert!((v / exact - 1.0).abs() < 1e-10, "{v} m/s for {exact}");
    assert!((history.last("load_water_y") / (1025.0 * 9.81) - 1.0).abs() < 1e-10);
    let work = -1025.0 * 9.81 * 0.5 * fall * t * t;
    assert!((history.last("work_water") / work - 1.0).abs() < 0.02, "{} J", history.last("work_water"));
}

/// Water stands 7 m deep on one side of a wall and 2 m on the other: its thrust on the wall is that of two
/// triangles, on a caisson the weight of the water in its place, and on the faces that of the water beside them.
#[test]
fn water_presses_on_walls_and_faces() {
    let soil = format!("density = 900\nsaturated_density = 1000\n{ELASTIC}");
    let body = "[bodies.shape]\nkind = 'difference'\nfrom = { kind = 'box', min = [3, -5], max = [5, 0] }\n\
                remove = [{ kind = 'box', min = [3.75, -6], max = [4.25, 1] }]";
    let rest = "[[colliders]]\nname = 'wall'\nshape = { kind = 'box', min = [3.9, -6], max = [4.1, 2.5] }\n\
                contact = { kind = 'slip' }\n\
                [[colliders]]\nname = 'caisson'\nshape = { kind = 'box', min = [3.2, 0.4], max = [3.5, 1.1] }\n\
                contact = { kind = 'slip' }\nmotion = { kind = 'steady', velocity = [0, 0.1], angular_velocity = 1 }\n\
                [time]\nend = 0.01\n[output]\npicture = false\n[history]\nevery_steps = 10\nface_forces = true\n";
    let history = history_of(&job("level = '2 - 5 * step(x - 4)'", &soil, body, rest));
    let weight = 9810.0;
    let expected = [
        ("water_wall_x", weight * (0.5 * 49.0 - 0.5 * 4.0)),
        ("water_caisson_x", 0.0),
        ("water_caisson_y", weight * 0.3 * 0.7),
        ("water_x_min_x", -weight * 0.5 * 49.0),
        ("water_x_max_x", weight * 0.5 * 4.0),
        ("water_y_min_y", -weight * (7.0 + 2.0) * 0.9),
        ("water_y_max_y", 0.0),
    ];
    for (name, expected) in expected {
        for found in history.column(name) {
            let scale = if name.contains("caisson") { weight * 0.3 * 0.7 } else { weight * 0.5 * 49.0 };
            assert!((found - expected).abs() < 5e-3 * scale, "{name}: {found} for {expected}");
        }
    }
}

/// Sand that flies apart under water sinks with the weight of its grains there, whatever the space between them:
/// buoyancy of that space would throw it out of the water.
#[test]
fn sand_that_flies_apart_under_water_sinks() {
    let soil = "density = 2000\nmodel = 'mohr_coulomb'\nyoung = 2e7\npoisson = 0.3\nfriction_angle = 30\n";
    let body = "shape = { kind = 'box', min = [3.5, 0.5], max = [4.5, 1.5] }\n\
                velocity = ['2 * (x - 4)', '2 * (y - 1)']";
    let rest = "[time]\nend = 0.4\n[output]\npicture = false\n[history]\nevery_steps = 1\n\
                [[probes]]\nname = 'all'\nquantities = ['volume']\n";
    let history = history_of(&job("level = 9", soil, body, rest));
    assert!(history.last("volume_all") > 1.5 * history.column("volume_all")[0], "it flies apart");
    let exact = -9.81 * (1.0 - 1000.0 / 2000.0) * history.time_of_velocities();
    let v = history.last("momentum_y") / history.last("mass");
    assert!((v / exact - 1.0).abs() < 1e-9, "{v} m/s for {exact}");
}

/// As the table rises through ground at rest, the ground swells by its unloading: γ_w H²/(2 M).
#[test]
fn ground_swells_as_the_table_rises() {
    let soil = format!("density = 2000\n{ELASTIC}");
    let body = format!("{GROUND}\nstress = {{ kind = 'geostatic', k0 = 0.428571428571 }}");
    let rest = "[time]\nend = 9\n[output]\npicture = false\n\
        [[probes]]\nname = 'top'\nquantities = ['centre']\nshape = { kind = 'box', min = [4, -0.12], max = [5, 1] }\n\
        [[stages]]\nname = 'dry'\nduration = 0.01\n\
        [[stages]]\nname = 'rise'\nduration = 2\n\
        [[stages]]\nname = 'rest'\nequilibrium = { speed = 1e-7, acceleration = 1e-4 }\n";
    let history = history_of(&job("level = [[0.01, -5], [2, 0]]", &soil, &body, rest));
    let centres = history.column("centre_top_y");
    let (m, h) = (2e7 * 0.7 / (1.3 * 0.4), 5.0);
    let swelling = 9810.0 * h * h / (2.0 * m);
    let found = centres[centres.len() - 1] - centres[0];
    assert!((found / swelling - 1.0).abs() < 0.01, "{found} m for {swelling} m");
}

/// The depth of still water on a slope does not matter.
#[test]
fn a_submerged_slope_moves_alike_under_any_depth_of_water() {
    let soil = "density = 2000\nsaturated_density = 2000\nmodel = 'mohr_coulomb'\nyoung = 2e6\npoisson = 0.3\n\
                friction_angle = 20\ncohesion = 500\n";
    let body = "shape = { kind = 'polygon', points = [[3, -5], [5, -5], [5, -4], [3, 0]] }";
    let rest = "[time]\nend = 0.2\n[output]\npicture = false\n[history]\nevery_steps = 10\n";
    let ends = ["0.5", "3", "300"].map(|level| {
        let history = history_of(&job(&format!("level = {level}"), soil, body, rest));
        ["kinetic_energy", "plastic_work"].map(|name| history.last(name))
    });
    assert!(ends[0][0] > 1.0 && ends[0][1] > 0.0, "it moves: {ends:?}");
    for other in &ends[1..] {
        for (a, b) in ends[0].iter().zip(other) {
            assert!((b / a - 1.0).abs() < 1e-6, "{ends:?}");
        }
    }
}

/// A water table of a survey, as a section over x, and pressures of another program at scattered points, act as
/// the same in expressions; the depth of a raster as that over x and y.
#[test]
fn water_from_files_acts_as_that_of_expressions() {
    let soil = format!("density = 1600\nsaturated_density = 2000\n{ELASTIC}");
    let directory = tempfile::tempdir().expect("temporary directory");
    let force = |water: &str, text: &str| {
        std::fs::write(directory.path().join("water.dat"), text).expect("table");
        let path = written(directory.path(), &job(water, &soil, GROUND, SHORT));
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet", "--overwrite"]));
        let history = History::read(directory.path(), "ground");
        [history.last("load_water_x"), history.last("load_water_y"), history.last("mass")]
    };
    let close = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-9 * a.abs());
    let slope = force("level = '0.5 - 0.4 * (x - 3)'", "");
    assert!(slope[0] > 100.0, "it pushes along x: {slope:?}");
    let section = force("level = { points = 'water.dat', origin = [3, 0] }", "level [m];x\n-0.3;2\n0.5;0\n");
    assert!(close(slope, section), "{slope:?} {section:?}");
    let field = force("pressure = '2e4 - 3e3 * x - 5e3 * y'", "");
    // Corners and some points inside, in kPa.
    let places = [(3.0, -5.0), (5.0, -5.0), (5.0, 3.0), (3.0, 3.0), (3.7, -1.3), (4.4, -3.9), (4.1, 0.6)];
    let rows: String =
        places.iter().map(|(x, y)| format!("{x} {y} {:?}\n", 20.0 - 3.0 * x - 5.0 * y)).collect();
    let scattered =
        force("pressure = { points = 'water.dat', value = 'u', scale = 1e3 }", &format!("x y u\n{rows}"));
    assert!(close(field, scattered), "{field:?} {scattered:?}");
    let raster =
        "ncols 2\nnrows 3\nxllcenter -1\nyllcenter -6\ncellsize 5\n-6e3 -21e3\n19e3 4e3\n44e3 29e3\n";
    let of_raster = force("pressure = { raster = 'water.dat', origin = [3, 0] }", raster);
    assert!(close(field, of_raster), "{field:?} {of_raster:?}");
}

/// A wet heap collapses as the table falls through it, across level jumps and splits.
#[test]
fn same_bits_on_any_ranks_and_across_restart() {
    let text = "version = 1\ndimension = 2\ngravity = [0, -10]\n[domain]\nsize = [2, 2]\nroot_edge = 0.5\n\
        [boundaries]\ny_min = { kind = 'sticky' }\n[numerics]\nf_bar = true\n\
        [water]\nlevel = '0.9 - 4 * t - 0.2 * x'\nsuction = 500\n\
        [[materials]]\nname = 'sand'\ndensity = 1600\nsaturated_density = 2000\nmodel = 'mohr_coulomb'\nyoung = 1e6\npoisson = 0.3\n\
        friction_angle = 25\ncohesion = 100\ndilation_angle = 2\n\
        [[bodies]]\nname = 'block'\nmaterial = 'sand'\nshape = { kind = 'box', min = [0.2, 0.0], max = [1.4, 1.0] }\n\
        velocity = [0.2, -0.1]\n\
        [tree]\n[[tree.regions]]\nlevel = 1\nshape = { kind = 'box', min = [0.5, 0.5], max = [1.3, 1.2] }\n\
        [adaptivity]\nevery_steps = 5\n[[adaptivity.criteria]]\nkind = 'plastic_strain'\nrefine = 0.005\nlevel = 1\n\
        [history]\nevery_steps = 5\n[checkpoint]\nevery_steps = 20\nkeep = 99\n[time]\nend = 0.06\n[output]\npicture = false\n\
        fields = ['pore_pressure', 'stress']\n";
    restart::assert_same_on_any_ranks(text, "water", |_, _| {});
}
