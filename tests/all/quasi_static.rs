//! Claim: load steps find the equilibria of closed forms and of finite elements, in few iterations on trees of one
//! level and of several, with the same bits on any ranks and across restarts.

use crate::common::history::History;
use crate::common::load_steps::{CHECKPOINTS, load_steps};
use crate::common::restart;

/// A soft column under its weight, 50 m high (Charlton, Coombs and Augarde 2017).
const COLUMN: &str = r#"
dimension = 2
gravity = [0, [[0, 0], [1, -10]]]
[domain]
size = [8, 56]
root_edge = 8
[boundaries]
x_min = { kind = "slip" }
y_min = { kind = "slip" }
[tree]
base_level = 1
[[materials]]
name = "soft"
density = 80
model = "hencky"
young = 1e6
poisson = 0
[[bodies]]
name = "column"
material = "soft"
shape = { kind = "box", min = [0, 0], max = [4, 50] }
[[tracks]]
name = "top"
point = [0.25, 49.75]
quantities = ["centre"]
"#;

/// With ν = 0 the column keeps its width, so `E ln λ = λ σ` and `σ = -ρ g (H - Y)`.
#[test]
fn a_column_under_its_weight_is_as_high_as_theory_says() {
    let stretch = |depth: f64| {
        let load = 80.0 * 10.0 * depth / 1e6;
        (0..50).fold(1.0, |stretch: f64, _| (-load * stretch).exp())
    };
    let (parts, top) = (1000, 49.75);
    let part = top / f64::from(parts);
    let height: f64 = (0..parts).map(|i| part * stretch(50.0 - part * (f64::from(i) + 0.5))).sum();
    let job = load_steps(COLUMN, "step = 0.25") + "face_forces = true";
    let found = History::of_job("column", &job, &[]);
    let error = found.last("centre_top_y") / height - 1.0;
    let force = found.last("force_y_min_y");
    println!("height {error:+.1e}, force {force:.1} N");
    assert!(error.abs() < 2e-4, "{error}");
    assert!((force / -160e3 - 1.0).abs() < 1e-4, "{force}");
    let residuals = found.column("unbalanced_force");
    assert!(residuals.iter().all(|residual| *residual <= 1e-6), "{residuals:?}");
}

/// An elastic slope under its weight, on cells of 1/32 m and, in finer regions, of 1/64 and 1/128 m.
const SLOPE: &str = r#"
dimension = 2
gravity = [0, -9.81]
[domain]
size = [1, 1]
root_edge = 1
[boundaries]
x_min = { kind = "slip" }
y_min = { kind = "sticky" }
[tree]
base_level = 3
[[materials]]
name = "soil"
density = 2000
model = "hencky"
young = 1e7
poisson = 0.3
[[bodies]]
name = "slope"
material = "soil"
shape = { kind = "polygon", points = [[0, 0], [0.93, 0], [0.93, 0.289], [0.35, 0.55], [0, 0.55]] }
[[probes]]
name = "crest"
quantities = ["centre"]
shape = { kind = "box", min = [0, 0.4], max = [0.3, 0.6] }
"#;

/// Finer cells at the crest, two and three times as fine as around.
const FINE: &str = "tree.regions=[{ level = 4, shape = { kind = 'box', min = [0.2, 0.3], max = [0.6, 0.6] } }, { level = 5, shape = { kind = 'box', min = [0.3, 0.4], max = [0.45, 0.6] } }]";

/// Linear iterations of the one step, over all its linear systems.
fn iterations(set: &[&str]) -> f64 {
    let arguments: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
    let found = History::of_job("slope", &load_steps(SLOPE, "step = 1"), &arguments);
    let [newton, linear] = ["newton_iterations", "linear_iterations"].map(|name| found.last(name));
    assert!(newton <= 3.0, "{set:?}: {newton}");
    linear
}

/// On 16, 32 and 64 cells across, and on three levels.
#[test]
fn iterations_do_not_grow_with_the_number_of_cells() {
    let all = [&["tree.base_level=2"][..], &[], &["tree.base_level=4"], &[FINE]].map(iterations);
    println!("{all:?}");
    assert!(all.iter().all(|linear| *linear <= 25.0), "{all:?}");
}

#[test]
fn nearly_incompressible_slopes_take_at_most_twice_as_many() {
    let nu = "materials.soil.poisson=0.49";
    let all = [&[nu][..], &["tree.base_level=4", nu], &[FINE, nu]].map(iterations);
    println!("{all:?}");
    assert!(all.iter().all(|linear| *linear <= 50.0), "{all:?}");
}

/// A block between plates that keep its sides free, far beyond yield in plane strain: `|σ| = 2 Y / √3`.
const BLOCK: &str = r#"
dimension = 2
[domain]
size = [4, 4]
root_edge = 2
[boundaries]
x_min = { kind = "symmetric" }
y_min = { kind = "symmetric" }
[[materials]]
name = "lead"
density = 11000
model = "von_mises"
young = 1e9
poisson = 0.3
yield_stress = 1e6
[[bodies]]
name = "block"
material = "lead"
shape = { kind = "box", min = [0, 0], max = [2, 2] }
[[loads]]
name = "plate"
kind = "velocity"
y = -0.04
shape = { kind = "box", min = [0, 1.9], max = [4, 2.6] }
"#;

#[test]
fn a_block_beyond_yield_bears_what_plane_strain_says() {
    let found = History::of_job("block", &load_steps(BLOCK, "step = 0.25"), &[]);
    let force = found.last("load_plate_y");
    // Of its volume the block loses next to nothing.
    let width = 2.0 / (1.0 - 0.04 / 2.0);
    let exact = -2.0 / 3.0_f64.sqrt() * 1e6 * width;
    println!("force {force:.4e} of {exact:.4e}");
    assert!((force / exact - 1.0).abs() < 0.03, "{force}");
    let newton = found.column("newton_iterations");
    assert!(newton.iter().all(|newton| *newton <= 8.0), "{newton:?}");
}

/// A footing on soft ground that yields: three levels, refinement that follows the flow, a pressure beside the
/// footing, which a collider presses down, and F-bar.
#[test]
fn load_steps_give_the_same_on_any_ranks_and_across_restart() {
    let job = r#"
version = 1
dimension = 2
gravity = [0, -10]
[domain]
size = [2, 1]
root_edge = 0.5
[boundaries]
x_min = { kind = "slip" }
x_max = { kind = "slip" }
y_min = { kind = "sticky" }
[tree]
base_level = 0
regions = [{ level = 1, shape = { kind = "box", min = [0.1, 0.3], max = [0.9, 0.6] } }]
[[materials]]
name = "clay"
density = 2000
model = "von_mises"
young = 1e6
poisson = 0.45
yield_stress = 2e4
[[bodies]]
name = "ground"
material = "clay"
shape = { kind = "box", min = [0, 0], max = [2, 0.56] }
[[colliders]]
name = "footing"
shape = { kind = "box", min = [0.3, 0.55], max = [0.7, 0.8] }
motion = { kind = "steady", velocity = [0.002, -0.02] }
contact = { kind = "sticky" }
[[loads]]
name = "beside"
kind = "pressure"
pressure = [[0, 0], [1, 1e3]]
facing = [0, 1]
[numerics]
f_bar = true
[quasi_static]
step = 0.2
tolerance = 1e-4
[time]
end = 0.8
[output]
picture = false
[history]
every_steps = 1
[checkpoint]
every_steps = 2
keep = 99
[adaptivity]
every_steps = 1
[[adaptivity.criteria]]
kind = "plastic_strain"
level = 2
refine = 0.02
"#;
    restart::assert_same_on_any_ranks(job, "footing", |directory, _| {
        let history = History::read(directory, "footing");
        let [rest, force] = ["unbalanced_force", "force_footing_y"].map(|name| history.column(name));
        assert!(rest.iter().all(|rest| *rest <= 1e-4), "{rest:?}");
        assert!(force.last().is_some_and(|force| *force > 0.0), "{force:?}");
    });
}

/// A slope in space that falls along two axes, on two levels.
const SLOPE_IN_SPACE: &str = r#"
dimension = 3
gravity = [0, [[0, 0], [1, -9.81]], 0]
[domain]
size = [1, 1, 1]
root_edge = 1
[boundaries]
x_min = { kind = "slip" }
y_min = { kind = "sticky" }
z_min = { kind = "slip" }
[tree]
base_level = 1
regions = [{ level = 2, shape = { kind = "box", min = [0.3, 0.3, 0], max = [0.6, 0.6, 0.4] } }]
[[materials]]
name = "soil"
density = 2000
model = "hencky"
young = 1e7
poisson = 0.4
[[bodies]]
name = "slope"
material = "soil"
[bodies.shape]
kind = "intersection"
parts = [
    { kind = "box", min = [0, 0, 0], max = [0.8, 0.55, 0.8] },
    { kind = "half_space", point = [0.35, 0.55, 0.35], normal = [0.45, 1, 0.45] },
]
"#;

/// In two steps.
#[test]
fn load_steps_in_space_give_the_same_on_any_ranks() {
    let job = load_steps(SLOPE_IN_SPACE, "step = 0.5\ntolerance = 1e-5") + CHECKPOINTS;
    restart::assert_same_on_any_ranks(&job, "space", |directory, _| {
        let history = History::read(directory, "space");
        let [rest, linear] = ["unbalanced_force", "linear_iterations"].map(|name| history.column(name));
        assert!(rest.iter().all(|rest| *rest <= 1e-5), "{rest:?}");
        assert!(linear.iter().all(|linear| *linear <= 30.0), "{linear:?}");
    });
}

/// On three levels that meet the surface, nearly incompressible: it takes 70 if nodes of next to no material
/// are free.
#[test]
fn nearly_incompressible_slopes_in_space_take_few_iterations_on_three_levels() {
    let regions = "tree.regions=[{ level = 2, shape = { kind = 'box', min = [0.2, 0.3, 0.2], max = [0.6, 0.6, 0.6] } }, \
                   { level = 3, shape = { kind = 'box', min = [0.3, 0.4, 0.3], max = [0.45, 0.6, 0.45] } }]";
    let set = ["--set", "materials.soil.poisson=0.49", "--set", regions, "--set", "tree.base_level=1"];
    let found = History::of_job("slope", &load_steps(SLOPE_IN_SPACE, "step = 1"), &set);
    let linear = found.last("linear_iterations");
    println!("{linear}");
    assert!(linear <= 50.0, "{linear}");
}
