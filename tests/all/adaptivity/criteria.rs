//! Each criterion refines where it should, and only there; leaves become coarse again and do not flicker.
use agimp::job::{AnyProblem, Problem};
use partition::comm::Comm;

use super::state::{Filled, advance, filled, on_ranks, solver};
use agimp::solver::Solver;

/// A job on 2 m x 1 m with leaves of 0.25 m on level 0.
fn job(every: u64, criterion: &str, bodies: &str, rest: &str) -> String {
    format!(
        r#"
version = 1
dimension = 2
[domain]
size = [2, 1]
root_edge = 0.25
[boundaries]
y_min = {{ kind = "separating", friction = 0.3 }}
[adaptivity]
every_steps = {every}
buffer = 0
[[adaptivity.criteria]]
{criterion}
[[materials]]
name = "rubber"
density = 1000
model = "neo_hookean"
young = 1e5
poisson = 0.3
[[materials]]
name = "metal"
density = 1000
model = "von_mises"
young = 1e5
poisson = 0.3
yield_stress = 1e3
{bodies}
[time]
end = 1e3
{rest}
"#
    )
}

/// A body of a material in a box.
fn body(name: &str, material: &str, (min, max): ([f64; 2], [f64; 2]), rest: &str) -> String {
    format!(
        "[[bodies]]\nname = '{name}'\nmaterial = '{material}'\n\
         shape = {{ kind = 'box', min = {min:?}, max = {max:?} }}\n{rest}\n"
    )
}

/// A bar along x that rests in the middle.
fn bar() -> String {
    body("bar", "rubber", ([0.25, 0.25], [1.75, 0.75]), "")
}

/// Two squares apart, the second one with `rest`.
fn squares(materials: [&str; 2], rest: &str) -> String {
    body("left", materials[0], ([0.25, 0.25], [0.75, 0.75]), "")
        + &body("right", materials[1], ([1.25, 0.25], [1.75, 0.75]), rest)
}

fn with(comm: &Comm, text: &str, body: impl Fn(&mut Solver<2>)) {
    body(&mut solver::<2>(comm, text));
}

/// Every filled leaf has `fine` where `is_fine`, else level 0; both kinds are there.
fn assert_levels(solver: &Solver<2>, fine: u8, is_fine: impl Fn(&Filled<2>) -> bool) {
    let leaves = filled(solver);
    for leaf in &leaves {
        let expected = if is_fine(leaf) { fine } else { 0 };
        assert_eq!(leaf.level, expected, "{leaf:?} at {} s", solver.clock.time);
    }
    for level in [0, fine] {
        assert!(leaves.iter().any(|leaf| leaf.level == level), "no leaf of level {level}");
    }
}

/// Leaves that intersect the stripe between two places along x are fine, those further from it than a leaf
/// are coarse.
fn assert_stripe(solver: &Solver<2>, (from, to): (f64, f64)) {
    for leaf in filled(solver) {
        let distance = (leaf.lower[0] - to).max(from - leaf.upper[0]);
        assert!(distance >= 0.0 || leaf.level == 1, "{leaf:?} at {} s", solver.clock.time);
        assert!(distance <= 0.25 || leaf.level == 0, "{leaf:?} at {} s", solver.clock.time);
    }
}

/// A stripe, and what is within a distance of it, refines; where it has gone, leaves become coarse again.
#[test]
fn region_and_its_way() {
    let criterion = "kind = 'region'\nlevel = 1\nshape = { kind = 'box', min = [0.26, -9], max = [0.49, 9] }\n\
                     motion = [{ time = 0.01, translation = [0, 0] }, { time = 0.05, translation = [1, 0] }]";
    on_ranks(module_path!(), "region_and_its_way", &[1], |comm| {
        with(comm, &job(5, criterion, &bar(), ""), |solver| {
            assert_stripe(solver, (0.26, 0.49));
            while solver.clock.time < 0.06 {
                advance(solver, 5);
            }
            // Nothing stays fine at the place left.
            assert_stripe(solver, (1.26, 1.49));
            let empty =
                solver.forest.leaves().iter().zip(&solver.chunks).filter(|(_, chunk)| chunk.is_empty());
            assert!(empty.map(|(leaf, _)| leaf.level).all(|level| level == 0), "an empty leaf is fine");
        });
    });
}

#[test]
fn collider() {
    let criterion = "kind = 'collider'\nlevel = 2\ncollider = 'ball'\ndistance = 0.06";
    let ball = "[[colliders]]\nname = 'ball'\nshape = { kind = 'circle', centre = [1, 0.9], radius = 0.1 }";
    on_ranks(module_path!(), "collider", &[1], |comm| {
        with(comm, &job(5, criterion, &bar(), ball), |solver| {
            let leaves = filled(solver);
            let near =
                |leaf: &Filled<2>| leaf.lower[0] < 1.01 && leaf.upper[0] > 0.99 && leaf.upper[1] > 0.74;
            assert!(leaves.iter().any(near));
            assert!(leaves.iter().filter(|leaf| near(leaf)).all(|leaf| leaf.level == 2), "{leaves:?}");
            let far = |leaf: &&Filled<2>| leaf.upper[0] < 0.75 || leaf.lower[0] > 1.25;
            assert!(leaves.iter().filter(far).all(|leaf| leaf.level == 0), "{leaves:?}");
        });
    });
}

/// The leaves at the surface, not those inside.
#[test]
fn free_surface() {
    let criterion = "kind = 'free_surface'\nlevel = 1";
    let block = body("block", "rubber", ([0.25, 0.0], [1.75, 0.75]), "");
    on_ranks(module_path!(), "free_surface", &[1], |comm| {
        with(comm, &job(5, criterion, &block, ""), |solver| {
            let inside =
                |leaf: &Filled<2>| leaf.lower[0] >= 0.5 && leaf.upper[0] <= 1.5 && leaf.upper[1] <= 0.5;
            let (leaves, mut surface) = (filled(solver), 0);
            for leaf in &leaves {
                let at_surface = leaf.lower[0] < 0.375 || leaf.upper[0] > 1.625 || leaf.upper[1] > 0.625;
                assert!(!at_surface || leaf.level == 1, "{leaf:?}");
                assert!(!inside(leaf) || leaf.level == 0, "{leaf:?}");
                surface += usize::from(at_surface);
            }
            assert!(surface > 10 && leaves.iter().any(inside));
        });
    });
}

/// A square that turns, not one that stands.
#[test]
fn velocity_gradient() {
    let criterion = "kind = 'velocity_gradient'\nlevel = 1\nrefine = 1";
    on_ranks(module_path!(), "velocity_gradient", &[1], |comm| {
        let turning = job(5, criterion, &squares(["rubber"; 2], "angular_velocity = 2"), "");
        with(comm, &turning, |solver| {
            advance(solver, 20);
            assert_levels(solver, 1, |leaf| leaf.body == 1);
        });
        // Neither does one that flies.
        let flying = job(5, criterion, &squares(["rubber"; 2], "velocity = [0, 1]"), "");
        with(comm, &flying, |solver| {
            advance(solver, 20);
            assert!(filled(solver).iter().all(|leaf| leaf.level == 0));
            assert_eq!(solver.adaptation.regrids, 0);
        });
    });
}

/// A square hits the floor and flows there; another one rests. Whether leaves are fine where the material has
/// flowed.
fn flows(comm: &Comm, criterion: &str, has_flowed: f64) {
    let squares = body("left", "metal", ([0.25, 0.25], [0.75, 0.75]), "")
        + &body("right", "metal", ([1.25, 0.03], [1.75, 0.53]), "velocity = [0, -3]");
    with(comm, &job(5, criterion, &squares, ""), |solver| {
        assert!(filled(solver).iter().all(|leaf| leaf.level == 0));
        advance(solver, 60);
        let leaves = filled(solver);
        let flowed = |leaf: &&Filled<2>| leaf.plastic_strain >= has_flowed;
        assert!(leaves.iter().filter(flowed).count() >= 2, "{leaves:?}");
        assert!(leaves.iter().filter(flowed).all(|leaf| leaf.level == 1), "{leaves:?}");
        assert!(leaves.iter().filter(|leaf| leaf.body == 0).all(|leaf| leaf.level == 0), "{leaves:?}");
    });
}

#[test]
fn plastic_strain() {
    let criterion = "kind = 'plastic_strain'\nlevel = 1\nrefine = 0.01";
    on_ranks(module_path!(), "plastic_strain", &[1], |comm| flows(comm, criterion, 0.01));
}

#[test]
fn plastic_strain_rate() {
    let criterion = "kind = 'plastic_strain_rate'\nlevel = 1\nrefine = 0.5\ncoarsen = 0.0";
    // Once fine, leaves stay so; those that have flowed much must have flowed fast.
    on_ranks(module_path!(), "plastic_strain_rate", &[1], |comm| flows(comm, criterion, 0.03));
}

/// The square that turns fast is drawn out by its own inertia.
#[test]
fn stretch() {
    let criterion = "kind = 'stretch'\nlevel = 1\nrefine = 1.03";
    on_ranks(module_path!(), "stretch", &[1], |comm| {
        let turning = job(5, criterion, &squares(["rubber"; 2], "angular_velocity = 20"), "");
        with(comm, &turning, |solver| {
            assert!(filled(solver).iter().all(|leaf| leaf.level == 0));
            advance(solver, 60);
            let leaves = filled(solver);
            assert!(leaves.iter().any(|leaf| leaf.body == 1 && leaf.level == 1), "{leaves:?}");
            assert!(leaves.iter().filter(|leaf| leaf.body == 0).all(|leaf| leaf.level == 0), "{leaves:?}");
        });
    });
}

#[test]
fn material() {
    let criterion = "kind = 'material'\nlevel = 2\nmaterial = 'metal'";
    on_ranks(module_path!(), "material", &[1], |comm| {
        with(comm, &job(5, criterion, &squares(["rubber", "metal"], ""), ""), |solver| {
            assert_levels(solver, 2, |leaf| leaf.body == 1);
        });
    });
}

/// A body that rests, under all kinds of criteria at once: the tree of the start stays.
fn rests<const D: usize>(comm: &Comm, text: &str)
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let mut solver = solver::<D>(comm, text);
    advance(&mut solver, 6);
    let regrids = solver.adaptation.regrids;
    advance(&mut solver, 100);
    assert_eq!(solver.adaptation.regrids, regrids, "leaves flicker");
    let total = solver.adaptation.ledger.total(comm);
    assert_eq!((total.splits, total.merges), (0, 0), "{total:?}");
}

#[test]
fn no_flicker_at_rest() {
    let criteria = "kind = 'free_surface'\nlevel = 1\n\
                    [[adaptivity.criteria]]\nkind = 'collider'\nlevel = 3\ncollider = 'ball'\ndistance = 0.06\n\
                    [[adaptivity.criteria]]\nkind = 'region'\nlevel = 2\n\
                    shape = { kind = 'circle', centre = [0.6, 0.5], radius = 0.1 }\n\
                    [[adaptivity.criteria]]\nkind = 'velocity_gradient'\nlevel = 2\nrefine = 0.1\n\
                    [[adaptivity.criteria]]\nkind = 'stretch'\nlevel = 2\nrefine = 1.1";
    let ball = "[[colliders]]\nname = 'ball'\nshape = { kind = 'circle', centre = [1, 0.9], radius = 0.1 }";
    on_ranks(module_path!(), "no_flicker_at_rest", &[2], |comm| {
        rests::<2>(comm, &job(2, criteria, &bar(), ball))
    });
}
