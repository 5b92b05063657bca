use super::*;
use crate::geometry::Shape;
use crate::job::{AnyProblem, parse};
use crate::setup::estimate::explicit::leaves;
use crate::setup::particles::lattice::Lattice;
use proptest::prelude::*;

fn problem<const D: usize>(text: &str) -> Problem<D>
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let any = parse(text, "test.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}"));
    any.try_into().unwrap_or_else(|_| panic!("wrong dimension"))
}

/// Fills all leaves, and checks each.
fn seeded<const D: usize>(problem: &Problem<D>) -> Result<Vec<Chunk<D>>, SeedError> {
    let fill = |leaf| {
        let mut chunk = Chunk::new();
        fill_leaf(problem, leaf, 0, &mut chunk)?;
        assert!(leaf_is_touched(problem, leaf) || chunk.is_empty());
        let mut counts = vec![0; problem.bodies.len()];
        count_leaf(problem, leaf, 0, &mut counts)?;
        assert_eq!(counts.iter().sum::<u64>(), chunk.len() as u64);
        let cell = problem.octant_box(leaf);
        assert!((0..chunk.len()).all(|p| cell.contains(&chunk.position(p))));
        Ok(chunk)
    };
    leaves(problem).iter().map(fill).collect()
}

fn job(dimension: usize, base_level: u8, rest: &str) -> String {
    let (min, size) = if dimension == 2 { ("[5, -3]", "[2, 1]") } else { ("[5, -3, 2]", "[2, 1, 1]") };
    format!(
        r#"
version = 1
dimension = {dimension}
domain = {{ min = {min}, size = {size}, root_edge = 1 }}
tree.base_level = {base_level}
time = {{ end = 1 }}
[[materials]]
name = "m"
density = 1500
model = "hencky"
young = 1e6
poisson = 0.3
{rest}
"#
    )
}

fn body(name: &str, rest: &str) -> String {
    format!("[[bodies]]\nname = \"{name}\"\nmaterial = \"m\"\n{rest}\n")
}

fn bits(x: [f64; 2]) -> [u64; 2] {
    x.map(f64::to_bits)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Leaves that tile the domain make each point of one lattice through all of it once.
    #[test]
    fn leaves_make_the_lattice(level in 0_u8..3, per_cell in 0.5_f64..4.0, radius in 0.2_f64..0.49) {
        let shape = format!("shape = {{ kind = \"circle\", centre = [6.1, -2.5], radius = {radius} }}");
        let rest = format!("particles_per_cell = {per_cell}\n{shape}");
        let problem = problem::<2>(&job(2, level, &body("b", &rest)));
        let mut made = Vec::new();
        for chunk in seeded(&problem)? {
            made.extend((0..chunk.len()).map(|p| bits(chunk.position(p))));
        }
        made.sort_unstable();
        let lattice = Lattice { origin: [0.0; 2], edge: 0.25 / f64::from(1 << level) / per_cell };
        let all = lattice.places_in(&Aabb::new([0.0; 2], [2.0, 1.0]));
        let mut all: Vec<[f64; 2]> = all.iter().map(|index| lattice.centre(index)).collect();
        all.retain(|x| problem.bodies[0].shape.contains(x));
        let mut expected: Vec<[u64; 2]> = all.into_iter().map(bits).collect();
        expected.sort_unstable();
        prop_assert_eq!(made, expected);
    }
}

#[test]
fn aligned_boxes_have_their_exact_mass_over_level_jumps() {
    let region =
        "[[tree.regions]]\nlevel = 3\nshape = { kind = \"box\", min = [6, -3, 2], max = [6.1, -2.9, 2.1] }";
    let rest = body("b", "shape = { kind = \"box\", min = [5.25, -3, 2], max = [6.5, -2.5, 2.75] }");
    let problem = problem::<3>(&job(3, 1, &(rest + region)));
    let chunks = seeded(&problem).unwrap();
    let mass: f64 = chunks.iter().flat_map(|chunk| chunk.column(Layout::<3>::MASS)).sum();
    assert_eq!(mass, 1500.0 * 1.25 * 0.5 * 0.75);
    let tags = chunks.iter().flat_map(Chunk::tags).map(|tag| Tag::unpack(*tag).level);
    assert_eq!((tags.clone().min(), tags.max()), (Some(1), Some(3)));
}

#[test]
fn a_turning_body_moves_rigidly() {
    let rest = "velocity = [1, 2, 3]\nangular_velocity = [0.5, -1, 2]\n\
                shape = { kind = \"sphere\", centre = [6, -2.5, 2.5], radius = 0.4 }";
    let problem = problem::<3>(&job(3, 1, &body("b", rest)));
    for chunk in seeded(&problem).unwrap() {
        for p in 0..chunk.len() {
            let x = chunk.position(p);
            let r = [x[0] - 1.0, x[1] - 0.5, x[2] - 0.5];
            let expected = [1.0 - r[2] - 2.0 * r[1], 2.0 + 2.0 * r[0] - 0.5 * r[2], 3.0 + 0.5 * r[1] + r[0]];
            for (i, expected) in expected.into_iter().enumerate() {
                let v = chunk.column(Layout::<3>::VELOCITY + i)[p];
                assert!((v - expected).abs() < 1e-14, "{v} {expected}");
            }
            assert_eq!(chunk.column(Layout::<3>::AFFINE + 1)[p], -2.0);
            assert_eq!(chunk.column(Layout::<3>::AFFINE + 2)[p], -1.0);
        }
    }
}

#[test]
fn points_in_two_bodies_are_refused_and_adjacent_boxes_share_none() {
    let lattice = "sampling = \"lattice\"\nshape = { kind = \"box\", ";
    let first = body("a", &format!("{lattice}min = [5, -3], max = [5.3, -2.5] }}"));
    let second = body("b", &format!("particles_per_cell = 3\n{lattice}min = [5.3, -3], max = [6, -2.5] }}"));
    let mut problem = problem::<2>(&job(2, 0, &(first + &second)));
    assert!(seeded(&problem).is_ok());

    // Seeding detects an overlap that the check of the job file misses.
    let mut wider = problem.bodies[1].shape.bounds();
    wider.lower[0] -= 0.2;
    problem.bodies[1].shape = Shape::Box(wider);
    let error = seeded(&problem).unwrap_err();
    assert!(matches!(&error, SeedError::Overlap { first, second, .. } if first == "a" && second == "b"));
    assert!(error.to_string().starts_with("test.toml:23:9: bodies[1].shape: found"), "{error}");
}

#[test]
fn a_body_without_particles_is_refused() {
    let rest = "shape = { kind = \"circle\", centre = [6, -2.5], radius = 0.001 }";
    let problem = problem::<2>(&job(2, 0, &body("dot", rest)));
    let count: usize = seeded(&problem).unwrap().iter().map(Chunk::len).sum();
    assert_eq!(count, 0);
    assert!(check_counts(&problem, &[0], 0).is_err());
    assert!(check_counts(&problem, &[1], 0).is_ok());
}
