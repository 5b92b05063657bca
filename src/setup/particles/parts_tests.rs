use super::*;
use crate::geometry::Moments;
use crate::job::{AnyProblem, parse};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::volume::reference_volume;
use crate::setup::estimate::explicit::leaves;
use crate::setup::particles::seed::fill_leaf;

fn problem<const D: usize>(domain: &str, tree: &str, bodies: &[&str]) -> Problem<D>
where
    Problem<D>: TryFrom<AnyProblem>,
{
    let bodies: String = (bodies.iter().enumerate())
        .map(|(i, body)| {
            format!("[[bodies]]\nname = \"{i}\"\nmaterial = \"m\"\nsampling = \"fitted\"\n{body}\n")
        })
        .collect();
    let text = format!(
        "version = 1\ndimension = {D}\ntime = {{ end = 1 }}\ndomain = {domain}\ntree = {tree}\n[[materials]]\n\
         name = \"m\"\ndensity = 1500\nmodel = \"hencky\"\nyoung = 1e6\npoisson = 0.3\n{bodies}"
    );
    let any = parse(&text, "test.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}"));
    any.try_into().unwrap_or_else(|_| panic!("wrong dimension"))
}

fn seeded<const D: usize>(problem: &Problem<D>) -> Vec<Chunk<D>> {
    let fill = |leaf| {
        let mut chunk = Chunk::new();
        fill_leaf(problem, leaf, 0, &mut chunk).unwrap();
        let cell = problem.octant_box(leaf);
        assert!((0..chunk.len()).all(|p| cell.contains(&chunk.position(p))));
        chunk
    };
    leaves(problem).iter().map(fill).collect()
}

/// Mass, volume and centroid of a body's particles.
fn total<const D: usize>(chunks: &[Chunk<D>], body: u16) -> (f64, f64, [f64; D]) {
    let (mut mass, mut volume, mut first) = (0.0, 0.0, [0.0; D]);
    for chunk in chunks {
        for p in (0..chunk.len()).filter(|&p| Tag::unpack(chunk.tags()[p]).body == body) {
            let own = chunk.column(Layout::<D>::MASS)[p];
            mass += own;
            volume += reference_volume(chunk, p);
            let x = chunk.position(p);
            (0..D).for_each(|a| first[a] += own * x[a]);
        }
    }
    (mass, volume, first.map(|sum| sum / mass))
}

/// The particles of bodies have the masses and the centroids of their shapes, whatever the tree.
fn has_moments<const D: usize>(domain: &str, trees: &[&str], shapes: &[&str])
where
    Problem<D>: TryFrom<AnyProblem>,
{
    for tree in trees {
        for shape in shapes {
            let problem = problem::<D>(domain, tree, &[&format!("shape = {shape}")]);
            let Moments { volume, centre, .. } = problem.bodies[0].shape.moments().unwrap();
            let (mass, boxes, found) = total(&seeded(&problem), 0);
            let off = [mass / (1500.0 * volume) - 1.0, boxes / volume - 1.0];
            assert!(off.iter().all(|off| off.abs() < 1e-12), "{tree} {shape}: {off:?}");
            let off = (0..D).map(|a| (found[a] - centre[a]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-12, "{tree} {shape}: {off:e}");
        }
    }
}

#[test]
fn bodies_in_the_plane_have_their_mass_and_centroid() {
    has_moments::<2>(
        "{ min = [5, -3], size = [2, 1], root_edge = 1 }",
        &[
            "{ base_level = 0 }",
            "{ base_level = 2 }",
            "{ base_level = 1, regions = [{ level = 4, shape = { kind = \"circle\", centre = [5.8, -2.4], radius = 0.1 } }] }",
        ],
        &[
            "{ kind = \"circle\", centre = [6.01, -2.52], radius = 0.41 }",
            "{ kind = \"box\", min = [5.213, -2.71], max = [6.31, -2.3107] }",
            "{ kind = \"polygon\", points = [[5.3, -2.9], [6.6, -2.8], [6.2, -2.1], [5.9, -2.6], [5.5, -2.2]] }",
            "{ kind = \"rotated\", angle = 17, centre = [6, -2.5], shape = { kind = \"box\", min = [5.7, -2.7], max = [6.3, -2.3] } }",
        ],
    );
}

#[test]
fn bodies_in_space_have_their_mass_and_centroid() {
    has_moments::<3>(
        "{ min = [5, -3, 2], size = [1, 1, 1], root_edge = 1 }",
        &[
            "{ base_level = 1 }",
            "{ base_level = 1, regions = [{ level = 2, shape = { kind = \"sphere\", centre = [5.8, -2.4, 2.5], radius = 0.1 } }] }",
        ],
        &[
            "{ kind = \"sphere\", centre = [5.51, -2.52, 2.49], radius = 0.41 }",
            "{ kind = \"cylinder\", base = [5.5, -2.5, 2.1], axis = [0, 0, 1], height = 0.77, radius = 0.33 }",
            "{ kind = \"cone\", base = [5.3, -2.7, 2.2], axis = [1, 1, 2], height = 0.7, radius = 0.2, top_radius = 0.1 }",
        ],
    );
}

/// The ring between two discs, over whose boxes no other goes at once: exact, although it is a difference.
#[test]
fn a_ring_has_its_mass() {
    let ring = "shape = { kind = \"difference\", from = { kind = \"circle\", centre = [1, 0.51], radius = 0.45 }, \
                remove = [{ kind = \"circle\", centre = [1, 0.51], radius = 0.2 }] }";
    let problem = problem::<2>("{ size = [2, 1], root_edge = 1 }", "{ base_level = 1 }", &[ring]);
    let (mass, ..) = total(&seeded(&problem), 0);
    let exact = 1500.0 * std::f64::consts::PI * (0.45 * 0.45 - 0.04);
    assert!((mass / exact - 1.0).abs() < 1e-12, "{}", mass / exact - 1.0);
}

/// A disc in a block with a hole for it: each has its part of the boxes that both share.
#[test]
fn bodies_with_a_common_curved_face_leave_no_gap() {
    let disc = "{ kind = \"circle\", centre = [1.03, 0.51], radius = 0.33 }";
    let block = format!(
        "shape = {{ kind = \"difference\", from = {{ kind = \"box\", min = [0.5, 0], max = [1.5, 1] }}, remove = [{disc}] }}"
    );
    let bodies = [&*format!("shape = {disc}"), &*block];
    let problem = problem::<2>("{ size = [2, 1], root_edge = 1 }", "{ base_level = 1 }", &bodies);
    let chunks = seeded(&problem);
    let [(disc, ..), (block, ..)] = [total(&chunks, 0), total(&chunks, 1)];
    let exact = 1500.0 * std::f64::consts::PI * 0.33 * 0.33;
    assert!((disc / exact - 1.0).abs() < 1e-12 && ((disc + block) / 1500.0 - 1.0).abs() < 1e-12);
}

/// No particle is a tenth of a box or less beside one that could have taken it over; none is much larger than
/// a box.
#[test]
fn small_parts_join_their_neighbours() {
    let disc = "shape = { kind = \"circle\", centre = [1.03, 0.51], radius = 0.43 }";
    let problem = problem::<2>("{ size = [2, 1], root_edge = 1 }", "{ base_level = 1 }", &[disc]);
    let (mut small, mut parts, mut joined) = (0, 0, 0);
    for leaf in leaves(&problem) {
        let points = of_leaf(&problem, &problem.bodies[0], &problem.octant_box(&leaf), leaf.level);
        let edge = Lattice::of(&problem, leaf.level, &problem.bodies[0]).edge;
        for point in &points {
            let whole = (edge / point.halves as f64).powi(2);
            let volume = point.part.map_or(whole, |part| part.volume);
            assert!(volume < MOST * whole);
            small += u32::from(volume < SMALL * whole);
            parts += u32::from(point.part.is_some());
            joined += point.joined.len();
        }
    }
    println!("{parts} parts, {joined} joined, {small} small");
    assert!(parts > 20 && joined > 3 && 10 * small <= parts);
}

/// In the plane a disc of rubber has boxes of half the edge along its rim, at the places of its lattice of
/// them, and no others; one of sand has none. In space no body has.
#[test]
fn solids_in_the_plane_have_smaller_boxes_along_their_surface() {
    let of_model = |model: &str| {
        let text = format!(
            "version = 1\ndimension = 2\ntime = {{ end = 1 }}\ndomain = {{ size = [2, 1], root_edge = 1 }}\ntree = {{ base_level = 1 }}\n\
             [[materials]]\nname = \"m\"\ndensity = 1500\nyoung = 1e6\npoisson = 0.3\n{model}\n[[bodies]]\nname = \"disc\"\nmaterial = \"m\"\n\
             sampling = \"fitted\"\nshape = {{ kind = \"circle\", centre = [1.03, 0.51], radius = 0.43 }}\n"
        );
        let any = parse(&text, "test.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}"));
        let problem: Problem<2> = any.try_into().unwrap_or_else(|_| panic!("wrong dimension"));
        let body = &problem.bodies[0];
        let halves = halves_at_surface(&problem, body);
        for leaf in leaves(&problem) {
            let points = of_leaf(&problem, body, &problem.octant_box(&leaf), leaf.level);
            let edge = Lattice::of(&problem, leaf.level, body).edge;
            let mut all: Vec<[u64; 2]> = points.iter().flat_map(|point| point.places(halves)).collect();
            for point in points {
                // What is far from the rim has the boxes of the lattice.
                let is_far = body.shape.distance(&point.x) < -1.1 * edge;
                assert!(!is_far || point.halves == 1, "{:?}", point.x);
                assert!(point.part.is_none() || !point.joined.is_empty() || point.halves == halves);
            }
            let number = all.len();
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), number, "two particles at a place");
        }
        halves
    };
    assert_eq!(of_model("model = \"neo_hookean\""), 2);
    assert_eq!(of_model("model = \"drucker_prager\"\nfriction_angle = 30"), 1);
    let ball = "shape = { kind = \"sphere\", centre = [0.5, 0.5, 0.5], radius = 0.4 }";
    let problem = problem::<3>("{ size = [1, 1, 1], root_edge = 1 }", "{ base_level = 0 }", &[ball]);
    assert_eq!(halves_at_surface(&problem, &problem.bodies[0]), 1);
}

/// A box off the lattice by rounding alone has the particles of one on it, bit for bit.
#[test]
fn rounding_of_faces_does_not_matter() {
    let make = |high: f64| {
        let body = format!("shape = {{ kind = \"box\", min = [0.25, 0], max = [{high:?}, 0.625] }}");
        let problem = problem::<2>("{ size = [2, 1], root_edge = 1 }", "{ base_level = 1 }", &[&body]);
        let chunks = seeded(&problem);
        let bits = |chunk: &Chunk<2>| -> Vec<u64> {
            let columns = (0..Layout::<2>::REALS).flat_map(|column| chunk.column(column));
            columns.map(|value| value.to_bits()).collect()
        };
        chunks.iter().map(bits).collect::<Vec<_>>()
    };
    let exact = make(1.5);
    assert_eq!(make(1.5_f64.next_up()), exact);
    assert_eq!(make(1.5 - 1e-12), exact);
}

/// A job with bodies of these shapes and materials ("rubber", "steel", "water" or "sand") in a domain of 4 by
/// 2 m, on cells of a quarter.
fn with_bodies(bodies: &[(&str, &str)], rest: &str) -> Problem<2> {
    let bodies: String = (bodies.iter().enumerate())
        .map(|(i, (material, shape))| {
            format!("[[bodies]]\nname = \"{i}\"\nmaterial = \"{material}\"\nshape = {shape}\n")
        })
        .collect();
    let elastic = "density = 1000\nyoung = 1e6\npoisson = 0.3\n";
    let text = format!(
        "version = 1\ndimension = 2\ntime = {{ end = 1 }}\ndomain = {{ size = [4, 2], root_edge = 1 }}\n\
         [[materials]]\nname = \"rubber\"\nmodel = \"hencky\"\n{elastic}\
         [[materials]]\nname = \"steel\"\nmodel = \"von_mises\"\nyield_stress = 1e4\n{elastic}\
         [[materials]]\nname = \"water\"\nmodel = \"fluid\"\ndensity = 1000\nbulk_modulus = 1e6\n\
         [[materials]]\nname = \"sand\"\nmodel = \"drucker_prager\"\nfriction_angle = 30\n{elastic}{bodies}{rest}"
    );
    let any = parse(&text, "test.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}"));
    any.try_into().unwrap_or_else(|_| panic!("wrong dimension"))
}

/// Which of these bodies are fitted without a word.
fn fitted(bodies: &[(&str, &str)]) -> Vec<bool> {
    let problem = with_bodies(bodies, "");
    problem.bodies.iter().map(|body| matches!(body.sampling, Sampling::Fitted)).collect()
}

#[test]
fn solids_off_the_lattice_and_what_touches_them_are_fitted_without_a_word() {
    let disc = r#"{ kind = "circle", centre = [0.5, 0.5], radius = 0.375 }"#;
    let far = r#"{ kind = "circle", centre = [3, 0.5], radius = 0.4 }"#;
    let floor = r#"{ kind = "box", min = [0, 0], max = [1, 0.125] }"#;
    let thick = r#"{ kind = "box", min = [0, 0], max = [1, 0.15] }"#;
    let bed = r#"{ kind = "box", min = [2, 0], max = [4, 0.1] }"#;
    assert_eq!(fitted(&[("rubber", disc)]), [true]);
    assert_eq!(fitted(&[("steel", disc)]), [true]);
    assert_eq!(fitted(&[("sand", disc)]), [false]);
    assert_eq!(fitted(&[("rubber", floor)]), [false]);
    assert_eq!(fitted(&[("rubber", thick)]), [true]);
    assert_eq!(fitted(&[("rubber", disc), ("steel", floor)]), [true, true]);
    // Boxes of 1 / 2.2 cells do not lie in one leaf each, so they are whole.
    let odd = format!("{floor}\nparticles_per_cell = 2.2");
    assert_eq!(fitted(&[("rubber", disc), ("steel", &odd)]), [false, false]);
    // Fluids give way.
    assert_eq!(fitted(&[("water", bed), ("rubber", far), ("rubber", floor)]), [false, true, false]);
    // The parts of a disc and the whole boxes of sand would overlap.
    assert_eq!(
        fitted(&[("sand", bed), ("rubber", far), ("rubber", disc), ("rubber", floor)]),
        [false, false, true, true]
    );
}

/// Blocks that whole boxes fill, and that lie between the cells, have a lattice of their own: particles of
/// one mass, whose boxes end at the faces.
#[test]
fn blocks_of_whole_boxes_have_them_wherever_they_lie() {
    let block = r#"{ kind = "box", min = [0.53, 0.29], max = [1.53, 0.79] }"#;
    let upon = r#"{ kind = "box", min = [0.78, 0.79], max = [1.28, 1.29] }"#;
    for bodies in [&[("rubber", block)][..], &[("rubber", block), ("steel", upon)]] {
        let problem = with_bodies(bodies, "");
        let chunks = seeded(&problem);
        let number: usize = chunks.iter().map(Chunk::len).sum();
        assert_eq!(number, if bodies.len() == 1 { 32 } else { 48 });
        let exact = 1000.0 * if bodies.len() == 1 { 0.5 } else { 0.75 };
        let mass: f64 = chunks.iter().flat_map(|chunk| chunk.column(Layout::<2>::MASS)).sum();
        assert!((mass / exact - 1.0).abs() < 1e-12, "{mass}");
        let low =
            |chunk: &Chunk<2>, p: usize, a: usize| chunk.position(p)[a] - chunk.column(Layout::<2>::HALF)[p];
        for (a, face) in [0.53, 0.29].into_iter().enumerate() {
            let all = chunks.iter().flat_map(|chunk| (0..chunk.len()).map(move |p| low(chunk, p, a)));
            assert!((all.fold(f64::INFINITY, f64::min) - face).abs() < 1e-12);
        }
    }
    // Cells of several sizes, a sampling by name and what flows ask for the lattice of the cells.
    let region = "[[tree.regions]]\nlevel = 1\nshape = { kind = \"box\", min = [3, 0], max = [4, 1] }";
    assert_eq!(with_bodies(&[("rubber", block)], region).bodies[0].lattice, [0.0; 2]);
    assert_eq!(with_bodies(&[("sand", block)], "").bodies[0].lattice, [0.0; 2]);
    let named = format!("{block}\nsampling = \"lattice\"");
    assert_eq!(with_bodies(&[("rubber", &named)], "").bodies[0].lattice, [0.0; 2]);
}
