//! Claim: in load steps material slides along walls in any direction and leaves those that only press, with the same
//! bits on any ranks and across restarts.

use std::path::Path;

use crate::common::history::History;
use crate::common::launch::{run, text};
use crate::common::load_steps::{CHECKPOINTS, load_steps};
use crate::common::restart;

const RUBBER: &str = r#"[[materials]]
name = "rubber"
density = 1000
model = "hencky"
young = 1e6
poisson = 0.3
"#;

/// A block of 1 m between a floor and a plate that presses it by 2 mm, all turned about (1, 1) by an angle.
/// A grip at its middle keeps it from sliding away.
fn press(degrees: f64, contact: &str) -> String {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let below = [1.0 + 0.5 * sine, 1.0 - 0.5 * cosine];
    let above = [1.0 - 0.5 * sine, 1.0 + 0.5 * cosine];
    let way = [0.002 * sine, -0.002 * cosine];
    let job = format!(
        r#"
dimension = 2
[domain]
size = [2, 2]
root_edge = 2
[boundaries]
x_min.kind = "slip"
x_max.kind = "slip"
y_min.kind = "slip"
y_max.kind = "slip"
[tree]
base_level = 3
{RUBBER}[[bodies]]
name = "block"
material = "rubber"
[bodies.shape]
kind = "rotated"
centre = [1, 1]
angle = {degrees}
shape = {{ kind = "box", min = [0.5, 0.5], max = [1.5, 1.5] }}
[[colliders]]
name = "floor"
shape = {{ kind = "half_space", point = {below:?}, normal = [{:?}, {cosine:?}] }}
contact = {contact}
[[colliders]]
name = "plate"
shape = {{ kind = "half_space", point = {above:?}, normal = [{sine:?}, {:?}] }}
motion = {{ kind = "table", rows = [{{ time = 0, translation = [0, 0] }}, {{ time = 1, translation = {way:?} }}] }}
contact = {contact}
[[loads]]
name = "middle"
kind = "velocity"
x = {:?}
y = {:?}
shape = {{ kind = "box", min = [0.99, 0.99], max = [1.01, 1.01] }}
"#,
        -sine,
        -cosine,
        0.5 * way[0],
        0.5 * way[1]
    );
    load_steps(&job, "step = 1")
}

/// Forces of the plate on the block along its normal and across it, N.
fn pressed(degrees: f64, contact: &str, arguments: &[&str]) -> [f64; 2] {
    let found = History::of_job("press", &press(degrees, contact), arguments);
    let [floor, plate] =
        ["floor", "plate"].map(|name| ["x", "y"].map(|a| found.last(&format!("force_{name}_{a}"))));
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let size = plate[0].hypot(plate[1]);
    assert!((0..2).all(|a| (floor[a] + plate[a]).abs() < 1e-5 * size), "{floor:?} {plate:?}");
    [cosine.mul_add(plate[1], -sine * plate[0]), cosine.mul_add(plate[0], sine * plate[1])]
}

/// In plane strain a smooth press needs `E / (1 - ν²)` times the strain, whatever its direction. Plates whose
/// surface is not on nodes hold those behind it, so that the block is longer by a share of a cell: half as much
/// with cells of half the edge.
#[test]
fn smooth_plates_of_any_direction_press_as_theory_says() {
    let exact = 0.002 * 1e6 / (1.0 - 0.3 * 0.3);
    for (degrees, within) in [(0.0, 0.01), (17.0, 0.2), (30.0, 0.2)] {
        let off = [3, 4].map(|level| {
            let level = format!("tree.base_level={level}");
            let [across, along] = pressed(degrees, "{ kind = 'slip' }", &["--set", &level]);
            assert!(along.abs() < 1e-5 * across, "{degrees}: {along}");
            across / exact - 1.0
        });
        println!("{degrees}: {:+.1} %, {:+.1} %", 100.0 * off[0], 100.0 * off[1]);
        assert!(off[0].abs() < within && off[1].abs() < 0.6 * within, "{degrees}: {off:?}");
    }
}

/// An elastic block of 500 kg on the lower face.
fn on_floor(gravity: &str, floor: &str, loads: &str) -> String {
    let job = format!(
        r#"
dimension = 2
gravity = {gravity}
[domain]
size = [2, 1]
root_edge = 1
[boundaries]
x_min.kind = "slip"
x_max.kind = "slip"
y_min = {floor}
y_max.kind = "slip"
[tree]
base_level = 2
{RUBBER}[[bodies]]
name = "block"
material = "rubber"
shape = {{ kind = "box", min = [0.5, 0], max = [1.5, 0.5] }}
{loads}
"#
    );
    load_steps(&job, "step = 0.25") + "face_forces = true\n"
}

#[test]
fn a_body_leaves_a_face_that_only_bears_pressure() {
    let pull = "[[loads]]\nname = 'pull'\nkind = 'velocity'\nx = 0\ny = 0.01\n\
                shape = { kind = 'box', min = [0.4, 0.36], max = [1.6, 0.6] }";
    let found = History::of_job("lift", &on_floor("[0, -10]", "{ kind = 'separating' }", pull), &[]);
    let [floor, pull] = ["force_y_min_y", "load_pull_y"].map(|name| found.last(name));
    println!("floor {floor:.2e} N, pull {pull:.3} N");
    assert!(floor.abs() < 1e-2 && (pull / 5000.0 - 1.0).abs() < 1e-5, "{floor} {pull}");
}

/// Pushed from behind, it slides under μ times its weight.
#[test]
fn a_block_that_is_pushed_slides_as_coulomb_says() {
    let push = "[[loads]]\nname = 'push'\nkind = 'velocity'\nx = 0.02\n\
                shape = { kind = 'box', min = [0.4, 0.03], max = [0.57, 0.6] }";
    let floor = "{ kind = 'separating', friction = 0.3 }";
    let found = History::of_job("push", &on_floor("[0, -10]", floor, push), &[]);
    let [push, floor] = ["load_push_x", "force_y_min_x"].map(|name| found.last(name));
    println!("push {push:.2} N, floor {floor:.2} N");
    assert!((push / 1500.0 - 1.0).abs() < 0.01 && (floor / 1500.0 - 1.0).abs() < 0.01, "{push} {floor}");
}

/// Gravity turns: a block sticks up to a slope of tan φ, and has no equilibrium beyond.
#[test]
fn a_block_on_a_slope_sticks_up_to_the_angle_of_friction() {
    let floor = "{ kind = 'separating', friction = 0.3 }";
    let job = on_floor("[[[0, 0], [1, 6]], -10]", floor, "");
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("slope.toml");
    std::fs::write(&path, job).expect("job");
    let output = run(directory.path(), 1, 1, &path, &["--quiet"]).output().expect("output");
    let words = text(&output);
    let is_told = words.contains("no equilibrium at t = ")
        && words.contains("material slides wherever friction should hold it");
    assert!(!output.status.success() && is_told, "{words}");
    let reached = History::read(directory.path(), "slope").last("time");
    println!("stands at {:.4} of the limit", reached / 0.5);
    assert!((0.98..1.0 + 1e-6).contains(&(reached / 0.5)), "{reached}");
}

/// A block on a turned plane, partly beyond its edge, under a plate that moves along it, pinned below: gaps
/// and two levels. The plate stops where the first steps are halved: 3 % further they would become so short that
/// they take most of the time.
#[test]
fn walls_in_load_steps_give_the_same_on_any_ranks_and_across_restart() {
    let (sine, cosine) = 20.0_f64.to_radians().sin_cos();
    let job = format!(
        r#"
dimension = 2
gravity = [0, -10]
[domain]
size = [2, 2]
root_edge = 0.5
[boundaries]
x_min.kind = "separating"
x_max = {{ kind = "separating" }}
y_min.kind = "separating"
y_max.kind = "slip"
[tree]
base_level = 1
regions = [{{ level = 2, shape = {{ kind = "box", min = [0.5, 0.5], max = [1.2, 1.5] }} }}]
[[materials]]
name = "clay"
density = 1000
model = "von_mises"
young = 1e6
poisson = 0.3
yield_stress = 3e4
[[bodies]]
name = "block"
material = "clay"
[bodies.shape]
kind = "rotated"
centre = [1, 0.8]
angle = 20
shape = {{ kind = "box", min = [0.5, 0.8], max = [1.5, 1.3] }}
[[colliders]]
name = "plane"
shape = {{ kind = "half_space", point = [1, 0.8], normal = [{:?}, {cosine:?}] }}
contact = {{ kind = "slip" }}
[[colliders]]
name = "plate"
shape = {{ kind = "rotated", centre = [1, 0.8], angle = 20, shape = {{ kind = "box", min = [0.6, 1.3], max = [1, 1.5] }} }}
motion = {{ kind = "steady", velocity = [{:?}, {:?}] }}
contact = {{ kind = "separating" }}
[[loads]]
name = "pin"
kind = "velocity"
x = 0
y = 0
shape = {{ kind = "box", min = [0.99, 0.95], max = [1.01, 1.02] }}
"#,
        -sine,
        0.0045f64.mul_add(sine, 0.0018 * cosine),
        0.0018f64.mul_add(sine, -0.0045 * cosine),
    );
    let job = load_steps(&job, "step = 0.25\ntolerance = 1e-5") + CHECKPOINTS;
    restart::assert_same_on_any_ranks(&job, "walls", |directory: &Path, _| {
        let found = History::read(directory, "walls");
        let rest = found.column("unbalanced_force");
        assert!(rest.iter().all(|rest| *rest <= 1e-5), "{rest:?}");
    });
}

/// An elastic block of 500 kg on a collider with friction that is turned about (1.5, 1) by 30°, not on nodes.
/// Gravity is 10 m/s² onto it and, growing to this at 1 s, so much along it, m/s².
fn on_plane(friction: f64, along: f64, loads: &str) -> String {
    let (sine, cosine) = 30.0_f64.to_radians().sin_cos();
    let gravity = |way: f64| [10.0 * sine - way * cosine, -10.0 * cosine - way * sine];
    let ([x, y], [x_end, y_end]) = (gravity(0.0), gravity(along));
    let job = format!(
        r#"
dimension = 2
gravity = [[[0, {x}], [1, {x_end}]], [[0, {y}], [1, {y_end}]]]
[domain]
size = [3, 3]
root_edge = 1
[boundaries]
x_min.kind = "slip"
x_max.kind = "slip"
y_min.kind = "slip"
y_max.kind = "slip"
[tree]
base_level = 2
{RUBBER}[[bodies]]
name = "block"
material = "rubber"
[bodies.shape]
kind = "rotated"
centre = [1.5, 1]
angle = 30
shape = {{ kind = "box", min = [1, 1], max = [2, 1.5] }}
[[colliders]]
name = "plane"
shape = {{ kind = "half_space", point = [1.5, 1], normal = [{:?}, {cosine:?}] }}
contact = {{ kind = "separating", friction = {friction} }}
{loads}
"#,
        -sine
    );
    load_steps(&job, "step = 0.25")
}

/// Forces of the block on the plane across and along it, N, in the last row.
fn on_plane_at_end(found: &History) -> [f64; 2] {
    let (sine, cosine) = 30.0_f64.to_radians().sin_cos();
    let [x, y] = ["force_plane_x", "force_plane_y"].map(|name| found.last(name));
    [sine * x - cosine * y, cosine * x + sine * y]
}

#[test]
fn a_block_on_a_turned_plane_slides_as_coulomb_says() {
    let (sine, cosine) = 30.0_f64.to_radians().sin_cos();
    let push = format!(
        "[[loads]]\nname = 'push'\nkind = 'velocity'\nx = {:?}\ny = {:?}\n\
         shape = {{ kind = 'rotated', centre = [1.5, 1], angle = 30, \
         shape = {{ kind = 'box', min = [0.9, 1.1], max = [1.07, 1.6] }} }}",
        0.02 * cosine,
        0.02 * sine
    );
    for friction in [0.1, 0.3] {
        let found = History::of_job("push", &on_plane(friction, 0.0, &push), &[]);
        let [across, along] = on_plane_at_end(&found);
        let pushed = found.last("load_push_x").mul_add(cosine, found.last("load_push_y") * sine);
        println!("{friction}: {along:.2} N of {across:.2} N, push {pushed:.2} N");
        assert!((along / across / friction - 1.0).abs() < 1e-3 && (pushed / along - 1.0).abs() < 1e-3);
        let newton = found.column("newton_iterations");
        assert!(newton.iter().all(|newton| *newton <= 12.0), "{newton:?}");
    }
}

#[test]
fn a_block_on_a_turned_plane_stands_within_the_angle_of_friction() {
    let found = History::of_job("stands", &on_plane(0.3, 0.98 * 3.0, ""), &[]);
    let [across, along] = on_plane_at_end(&found);
    println!("{along:.2} N of {across:.2} N");
    assert!((across / 5000.0 - 1.0).abs() < 1e-5 && (along / -1470.0 - 1.0).abs() < 1e-4, "{across} {along}");
}

/// A block in space between a plate that presses it by 4 % and a floor: with friction it needs a force between
/// those on a smooth and on a sticky floor. Nodes slide inwards or outwards, in directions that are little
/// known.
#[test]
fn a_pressed_block_spreads_against_friction() {
    let job = |floor: &str| {
        let job = format!(
            r#"
dimension = 3
[domain]
size = [0.5, 1, 0.5]
root_edge = 0.5
[boundaries]
x_min.kind = "symmetric"
y_min = {floor}
z_min.kind = "symmetric"
[tree]
base_level = 0
[[materials]]
name = "rubber"
density = 1000
model = "hencky"
young = 1e6
poisson = 0.4
[[bodies]]
name = "block"
material = "rubber"
shape = {{ kind = "box", min = [0, 0, 0], max = [0.25, 0.25, 0.25] }}
[[colliders]]
name = "plate"
shape = {{ kind = "half_space", point = [0, 0.25, 0], normal = [0, -1, 0] }}
motion = {{ kind = "steady", velocity = [0, -0.01, 0] }}
contact = {{ kind = "slip" }}
"#
        );
        load_steps(&job, "step = 0.5")
    };
    let found = |floor: &str| History::of_job("spread", &job(floor), &[]);
    let rough = found("{ kind = 'separating', friction = 0.2 }");
    let newton = rough.column("newton_iterations");
    assert!(newton.iter().all(|newton| *newton <= 12.0), "{newton:?}");
    let [smooth, sticky] =
        ["{ kind = 'slip' }", "{ kind = 'sticky' }"].map(|floor| found(floor).last("force_plate_y"));
    let rough = rough.last("force_plate_y");
    println!("{smooth:.1} N smooth, {rough:.1} N rough, {sticky:.1} N sticky");
    assert!(1.01 * smooth < rough && rough < 0.99 * sticky, "{smooth} {rough} {sticky}");
}

/// In space, on two levels: a block under a turned plate without friction, which presses it against a turned
/// wall with friction. A grip at its middle keeps it.
#[test]
fn friction_in_space_gives_the_same_on_any_ranks_and_across_restart() {
    let job = r#"
dimension = 3
gravity = [0, -1, 0]
[domain]
size = [1, 1, 1]
root_edge = 0.5
[boundaries]
x_min.kind = "slip"
y_min.kind = "slip"
z_min.kind = "slip"
[tree]
base_level = 0
regions = [{ level = 1, shape = { kind = "box", min = [0, 0, 0], max = [0.5, 0.5, 0.5] } }]
[[materials]]
name = "rubber"
density = 1000
model = "hencky"
young = 1e6
poisson = 0.3
[[bodies]]
name = "block"
material = "rubber"
[bodies.shape]
kind = "intersection"
parts = [
    { kind = "box", min = [0.25, 0, 0.25], max = [0.75, 0.6, 0.75] },
    { kind = "half_space", point = [0.5, 0.5, 0.5], normal = [0.2, 1, 0.1] },
]
[[colliders]]
name = "plate"
shape = { kind = "half_space", point = [0.5, 0.5, 0.5], normal = [-0.2, -1, -0.1] }
motion = { kind = "steady", velocity = [0, -0.004, 0] }
contact = { kind = "slip" }
[[colliders]]
name = "wall"
shape = { kind = "half_space", point = [0.75, 0.25, 0.5], normal = [-1, 0.1, 0.2] }
contact = { kind = "separating", friction = 0.2 }
[[loads]]
name = "middle"
kind = "velocity"
x = 0
z = 0
shape = { kind = "box", min = [0.45, 0.2, 0.45], max = [0.55, 0.3, 0.55] }
"#;
    let job = load_steps(job, "step = 0.25\ntolerance = 1e-5") + CHECKPOINTS;
    restart::assert_same_on_any_ranks(&job, "space", |directory: &Path, _| {
        let found = History::read(directory, "space");
        let rest = found.column("unbalanced_force");
        assert!(rest.iter().all(|rest| *rest <= 1e-5), "{rest:?}");
    });
}

/// A smooth wall that moves into soil bears Rankine's passive pressure, `γ H² K / 2 + 2 c H √K` with K = 3.
#[test]
fn a_wall_bears_the_passive_pressure_of_soil() {
    let job = include_str!("../../jobs/retaining_wall_load_steps.toml");
    let found = History::of_job("retaining_wall", job, &[]);
    let exact = 0.5 * 1800.0 * 9.81 * 3.0 + 2.0 * 2000.0 * 3.0_f64.sqrt();
    let (time, force) = (found.column("time"), found.column("force_wall_x"));
    for (time, force) in time.iter().zip(force).filter(|(time, _)| **time > 0.35) {
        println!("{time:.2}: {:.4}", -force / exact);
        assert!((-force / exact - 1.0).abs() < 0.04, "{time}: {force} of {exact}");
    }
}
