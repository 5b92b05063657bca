use super::*;
use crate::job::{AnyProblem, parse};
use crate::setup::estimate::explicit;
use proptest::prelude::*;

/// Counts by arithmetic equal those over all leaves of the tree, one by one.
fn compare(text: &str) {
    match parse(text, "job.toml".as_ref()) {
        Ok(AnyProblem::Two(problem)) => compare_in(&problem),
        Ok(AnyProblem::Three(problem)) => compare_in(&problem),
        Err(faults) => panic!("{faults:?}\n{text}"),
    }
}

fn compare_in<const D: usize>(problem: &Problem<D>) {
    let leaves = explicit::leaves(problem);
    let mut bodies = vec![0; problem.bodies.len()];
    let mut filling = Vec::new();
    for leaf in &leaves {
        let mut points = 0;
        count_bodies(problem, leaf, 0..problem.bodies.len(), |body, count| {
            bodies[body] += count;
            points += count;
        })
        .expect("bodies apart");
        filling.push(points);
    }
    let levels = LevelCount::of_levels(problem, &leaves, &filling);
    let tally = count(problem).expect("bodies apart");
    assert_eq!(tally, Tally { particles: bodies, levels, is_cut: false }, "{}", problem.text);
}

fn job(dimension: usize, graded: bool, base: u8, regions: &[(u8, String)], body: &str) -> String {
    let (size, min, max) = match dimension {
        2 => ("[3, 2]", "[0.2, 0]", "[2.1, 0.7]"),
        _ => ("[2, 1, 3]", "[0.2, 0, 1]", "[1.1, 0.7, 2.3]"),
    };
    let regions: Vec<String> =
        regions.iter().map(|(level, shape)| format!("{{ level = {level}, shape = {shape} }}")).collect();
    format!(
        r#"
version = 1
dimension = {dimension}
domain = {{ size = {size}, root_edge = 1 }}
time = {{ end = 1 }}
tree = {{ base_level = {base}, graded = {graded}, regions = [{}] }}
materials = [{{ name = "m", density = 1000, model = "hencky", young = 1e6, poisson = 0.0 }}]
[[bodies]]
name = "box"
material = "m"
particles_per_cell = 1.3
shape = {{ kind = "box", min = {min}, max = {max} }}
[[bodies]]
name = "other"
material = "m"
shape = {body}
"#,
        regions.join(", ")
    )
}

fn rotated(angle: f64, [x, y]: [f64; 2], [w, h]: [f64; 2]) -> String {
    format!(
        "{{ kind = \"rotated\", angle = {angle}, centre = [{x}, {y}], shape = {{ kind = \"box\", min = [{x}, {y}], \
         max = [{}, {}] }} }}",
        x + w,
        y + h
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Random regions, graded or not, in the plane: boxes, discs, turned boxes.
    #[test]
    fn counts_equal_those_of_the_explicit_tree(
        graded in any::<bool>(),
        base in 0_u8..3,
        deeper in prop::array::uniform3(1_u8..5),
        x in prop::array::uniform3(0.0_f64..2.5),
        y in prop::array::uniform3(0.0_f64..1.7),
        width in 0.001_f64..1.5,
        angle in -90.0_f64..90.0,
    ) {
        let regions = [
            (base + deeper[0], format!("{{ kind = \"circle\", centre = [{}, {}], radius = {} }}", x[0], y[0], 0.4 * width)),
            (base + deeper[1], rotated(angle, [x[1], y[1].min(1.0)], [0.4 * width, 0.3])),
            (base + deeper[2], format!("{{ kind = \"box\", min = [{}, {}], max = [{}, {}] }}", x[2], y[2], x[2] + width, y[2] + 0.2)),
        ];
        compare(&job(2, graded, base, &regions, "{ kind = \"circle\", centre = [1.5, 1.3], radius = 0.45 }"));
    }
}

#[test]
fn counts_equal_those_of_the_explicit_tree_in_space() {
    let ball = "{ kind = \"sphere\", centre = [1.5, 0.5, 0.5], radius = 0.4 }";
    let regions = [
        (4, "{ kind = \"box\", min = [0.5, 0.5, 0.5], max = [0.53, 0.53, 2.9] }".to_owned()),
        (
            3,
            "{ kind = \"cone\", base = [1.5, 0.5, 2.9], axis = [0, 0, -1], height = 0.7, radius = 0.3 }"
                .to_owned(),
        ),
    ];
    for graded in [false, true] {
        for base in 0..3 {
            compare(&job(3, graded, base, &regions, ball));
        }
    }
}

/// A tree of 10^14 leaves is counted by arithmetic where it is uniform, and bounded from below where it is
/// not.
#[test]
fn trees_without_end_are_counted_or_bounded() {
    let disc = "{ kind = \"circle\", centre = [2.5, 1.3], radius = 0.45 }";
    let all = |level| [(level, "{ kind = \"box\", min = [0, 0], max = [3, 2] }".to_owned())];
    for (base, regions, exact) in
        [(11, vec![], true), (0, all(15).to_vec(), false), (3, all(8).to_vec(), true)]
    {
        let Ok(AnyProblem::Two(problem)) = parse(&job(2, true, base, &regions, disc), "job.toml".as_ref())
        else {
            panic!("not a job")
        };
        let tally = count(&problem).expect("bodies apart");
        let level = problem.finest_level();
        assert_eq!(tally.levels[usize::from(level)].leaves, 6 << (2 * level), "level {level}");
        assert_eq!(tally.is_cut, !exact, "level {level}");
        // The area of the bodies over that of a particle.
        let edge = problem.cell_edge(level);
        let expected = [1.9 * 0.7 * (1.3 / edge).powi(2), std::f64::consts::PI * (2.0 * 0.45 / edge).powi(2)];
        for (body, expected) in expected.into_iter().enumerate() {
            let part = tally.particles[body] as f64 / expected;
            assert!(
                if exact { (part - 1.0).abs() < 0.01 } else { (0.9..1.0).contains(&part) },
                "{level}: {part}"
            );
        }
    }
}
