use super::explicit::leaves;
use super::*;
use crate::job::{AnyProblem, parse};

fn problem(graded: bool) -> Problem<2> {
    let text = format!(
        r#"
version = 1
dimension = 2
domain = {{ size = [1, 1], root_edge = 1 }}
time = {{ end = 1 }}
materials = [{{ name = "m", density = 1000, model = "hencky", young = 1e6, poisson = 0.0 }}]
bodies = [{{ name = "b", material = "m", shape = {{ kind = "box", min = [0, 0], max = [1, 0.5] }} }}]
[tree]
graded = {graded}
regions = [{{ level = 4, shape = {{ kind = "box", min = [0.5, 0.5], max = [0.53, 0.53] }} }}]
"#
    );
    match parse(&text, "job.toml".as_ref()) {
        Ok(AnyProblem::Two(problem)) => problem,
        other => panic!("{other:?}"),
    }
}

#[test]
fn balanced_tree_has_no_jump_over_faces_or_corners() {
    let problem = problem(true);
    let leaves = leaves(&problem);
    for a in &leaves {
        for b in leaves.iter().filter(|b| a.touches(b)) {
            assert!(a.level.abs_diff(b.level) <= 1, "{a:?} {b:?}");
        }
    }
    let area: f64 = leaves.iter().map(|leaf| 0.25_f64.powi(leaf.level.into())).sum();
    assert_eq!(area, 1.0);
}

/// A corner of the region touches the middle of the domain: by hand, leaf by leaf.
#[test]
fn leaves_by_level() {
    let counts = |graded| {
        let estimate = estimate(&problem(graded)).unwrap();
        estimate.levels.iter().map(|level| level.leaves).collect::<Vec<_>>()
    };
    assert_eq!(counts(false), [0, 3, 3, 3, 4]);
    // The leaves at the middle have level 4 on one side, so level 3 on the other three.
    assert_eq!(counts(true), [0, 0, 12, 15, 4]);
}

#[test]
fn time_step_and_outputs() {
    let estimate = estimate(&problem(false)).unwrap();
    // A wave of sqrt(E / rho) over cells of 1/64 m.
    let expected = 0.4 / 64.0 / 1000_f64.sqrt();
    assert!((estimate.time_step - expected).abs() < 1e-12 * expected);
    assert_eq!(estimate.outputs, 2);
    assert_eq!(estimate.total_particles(), 2 * 64);
}

/// Bodies that meet with artificial viscosity: waves count as it damps them in the shock between the bodies.
#[test]
fn artificial_viscosity_shortens_the_step() {
    let text = r#"
version = 1
dimension = 2
domain = { size = [1, 1], root_edge = 1 }
time = { end = 1 }
numerics = { artificial_viscosity = { linear = 0.5, quadratic = 4 } }
materials = [{ name = "m", density = 1000, model = "hencky", young = 1e6, poisson = 0.0 }]
bodies = [
    { name = "a", material = "m", velocity = [6, 0], shape = { kind = "box", min = [0, 0], max = [0.5, 0.5] } },
    { name = "b", material = "m", velocity = [-3, 0], shape = { kind = "box", min = [0.5, 0], max = [1, 0.5] } },
]
"#;
    let Ok(AnyProblem::Two(problem)) = parse(text, "job.toml".as_ref()) else { panic!("no job") };
    let wave = 1000_f64.sqrt();
    let damping = 0.5 * wave + 2.0 * 4.0 * 3.0;
    let expected = 0.4 / 4.0 / (damping + damping.hypot(wave) + 6.0);
    let step = estimate(&problem).unwrap().time_step;
    assert!((step / expected - 1.0).abs() < 1e-12, "{step} {expected}");
}
