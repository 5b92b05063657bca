//! Claim: with ties of surface nodes a bent beam is as stiff as theory says with few cells over its depth,
//! and results do not depend on ranks and restarts. That ties change neither momenta nor affine motion,
//! `spin.rs` shows for free bodies across level jumps.

use crate::common::history::History;
use crate::common::launch::{run, succeed};
use crate::common::restart;

/// A clamped beam that bends by its weight, under damping, with four cells over its depth, to an angle of 38
/// degrees.
const BEAM: &str = r#"
version = 1
dimension = 2
gravity = [0, "-5.333333333333333 * min(t / 5, 1)"]
[domain]
size = [6.75, 6]
root_edge = 0.75
[boundaries]
x_min = { kind = "sticky" }
[[materials]]
name = "rubber"
density = 1000
model = "neo_hookean"
young = 5e6
poisson = 0.3
[[bodies]]
name = "beam"
material = "rubber"
shape = { kind = "box", min = [0, 4.125], max = [6, 4.875] }
[[loads]]
name = "calm"
kind = "damping"
rate = 2.5
[[tracks]]
name = "a"
point = [5.953, 4.45]
quantities = ["centre"]
[[tracks]]
name = "b"
point = [5.953, 4.55]
quantities = ["centre"]
[[tracks]]
name = "c"
point = [5.859, 4.45]
quantities = ["centre"]
[[tracks]]
name = "d"
point = [5.859, 4.55]
quantities = ["centre"]
[time]
end = 10
[output]
every = 10
picture = false
[history]
every_steps = 100
"#;

/// Deflection of the end of the beam's axis, m, from the last two columns of particles.
fn tip(tied: bool) -> f64 {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("beam.toml");
    std::fs::write(&path, BEAM).expect("job");
    let tied = format!("numerics.tied_surfaces={tied}");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet", "--set", &tied]));
    let history = History::read(directory.path(), "beam");
    let way = |name: &str| {
        let column = history.column(&format!("centre_{name}_y"));
        column[column.len() - 1] - column[0]
    };
    0.75 * (way("a") + way("b")) - 0.25 * (way("c") + way("d"))
}

/// The reference is Reissner's beam with stretch and shear (5/6), by shooting.
#[test]
fn bent_beam_is_as_stiff_as_theory_says() {
    let exact = -2.8085;
    let (tied, free) = (tip(true) / exact - 1.0, tip(false) / exact - 1.0);
    println!("deflection: {:+.2} % tied, {:+.2} % free", 100.0 * tied, 100.0 * free);
    assert!(tied.abs() < 0.01, "{tied}");
    assert!(free > 0.04, "nothing to cure: {free}");
}

/// Turned bars meet, rub and fall on a slope and on level jumps: two velocity fields, a collider, refinement
/// that follows.
#[test]
fn ties_give_the_same_on_any_ranks_and_across_restart() {
    let job = r#"
version = 1
dimension = 2
gravity = [0, -10]
[domain]
size = [4, 2]
root_edge = 0.5
[tree]
base_level = 1
regions = [{ level = 2, shape = { kind = "box", min = [1.5, 0], max = [2.5, 1] } }]
[[materials]]
name = "rubber"
density = 1000
model = "neo_hookean"
young = 1e5
poisson = 0.3
[[materials]]
name = "gum"
density = 1200
model = "hencky"
young = 5e4
poisson = 0.4
[[bodies]]
name = "bar"
material = "rubber"
shape = { kind = "polygon", points = [[1.0, 0.6], [2.6, 1.2], [2.5, 1.5], [0.9, 0.9]] }
velocity = [0.5, -2]
angular_velocity = 2
[[bodies]]
name = "ball"
material = "gum"
shape = { kind = "circle", centre = [2.0, 0.62], radius = 0.25 }
velocity = [0, 1]
[[colliders]]
name = "slope"
shape = { kind = "half_space", point = [0, 0.3], normal = [0.2, 1] }
[[contact]]
between = ["bar", "ball"]
friction = 0.3
[numerics]
tied_surfaces = true
[time]
end = 0.06
[output]
picture = false
[history]
every_steps = 5
[checkpoint]
every_steps = 10
keep = 99
[adaptivity]
every_steps = 5
[[adaptivity.criteria]]
kind = "velocity_gradient"
level = 3
refine = 5.0
"#;
    restart::assert_same_on_any_ranks(job, "bars", |directory, _| {
        let history = History::read(directory, "bars");
        let mass = history.column("grid_mass");
        assert!(mass.iter().zip(history.column("mass")).all(|(grid, all)| (grid / all - 1.0).abs() < 1e-12));
    });
}
