//! Parts of shapes in boxes against integrals that an independent program has computed, and sums over boxes
//! against closed forms.
use super::*;
use crate::geometry::mesh::Triangles;
use crate::geometry::mesh::tests::{ball as ball_of_triangles, cube};
use crate::geometry::{Placement, rotation};
use std::collections::BTreeMap;

/// Boxes of a lattice about a shape.
fn boxes<const D: usize>(shape: &Shape<D>, edge: f64) -> impl Iterator<Item = ([i64; D], Aabb<D>)> {
    let bounds = shape.bounds();
    let low = bounds.lower.map(|c| (c / edge).floor() as i64 - 1);
    let count: [i64; D] = std::array::from_fn(|a| (bounds.upper[a] / edge).ceil() as i64 + 1 - low[a]);
    (0..count.iter().product::<i64>()).map(move |mut number| {
        let index = std::array::from_fn(|a| {
            let place = low[a] + number % count[a];
            number /= count[a];
            place
        });
        let corner = |offset: i64| index.map(|i| (i + offset) as f64 * edge);
        (index, Aabb::new(corner(0), corner(1)))
    })
}

/// The sum over all boxes.
fn sum<const D: usize>(shape: &Shape<D>, edge: f64) -> Moments<D> {
    let mut all = Sums::new(shape.bounds().centre());
    let unit = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    for (_, cell) in boxes(shape, edge) {
        if let Some(Moments { volume, centre, second }) = shape.part_in(&cell) {
            all.add(1.0, &Sums { origin: centre, volume, first: [0.0; D], second }, &unit);
        }
    }
    all.moments().unwrap()
}

/// Greatest differences of volume, centre and second moments, by powers of a length.
fn difference<const D: usize>(found: &Moments<D>, exact: &Moments<D>, size: f64) -> [f64; 3] {
    let whole = size.powi(D as i32);
    let centre = (0..D).map(|a| (found.centre[a] - exact.centre[a]).abs() / size).fold(0.0, f64::max);
    let pairs = (0..D * D).map(|k| (found.second[k / D][k % D] - exact.second[k / D][k % D]).abs());
    let second = pairs.fold(0.0, f64::max) / (whole * size * size);
    [(found.volume - exact.volume).abs() / whole, centre, second]
}

/// Rows of a table by shape: place of a box, volume, centre, and second moments by the volume.
fn table<const D: usize>(name: &str) -> BTreeMap<String, Vec<([i64; D], Moments<D>)>> {
    let path = format!("{}/../tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let mut all: BTreeMap<String, Vec<_>> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let (shape, numbers) = line.split_once(',').unwrap();
        let numbers: Vec<f64> = numbers.split(',').map(|word| word.parse().unwrap()).collect();
        let (index, rest) = numbers.split_at(D);
        let (volume, rest) = rest.split_first().unwrap();
        let (centre, second) = rest.split_at(D);
        // xx, xy, yy, xz, yz, zz
        let component = |i: usize, j: usize| second[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)] * volume;
        let moments = Moments {
            volume: *volume,
            centre: std::array::from_fn(|a| centre[a]),
            second: std::array::from_fn(|i| std::array::from_fn(|j| component(i, j))),
        };
        let index = std::array::from_fn(|a| index[a] as i64);
        all.entry(shape.to_owned()).or_default().push((index, moments));
    }
    all
}

fn compare<const D: usize>(name: &str, shape: &Shape<D>, edge: f64, rows: &[([i64; D], Moments<D>)]) {
    let mut worst = [0.0_f64; 3];
    for (index, exact) in rows {
        let corner = |offset: i64| index.map(|i| (i + offset) as f64 * edge);
        let cell = Aabb::new(corner(0), corner(1));
        assert_eq!(shape.classify(&cell), Side::Crosses, "{name} {index:?}");
        let found = shape.part_in(&cell).unwrap();
        let off = difference(&found, exact, edge);
        // A thin part has its centre from few digits.
        let thin = (exact.volume / cell.volume()).min(1.0);
        let own = [off[0], off[1] * thin, off[2]];
        assert!(own.iter().all(|off| *off < 1e-12), "{name} {index:?} {own:?} {found:?} {exact:?}");
        (0..3).for_each(|k| worst[k] = worst[k].max(own[k]));
    }
    let mut cut = 0;
    for (index, cell) in boxes(shape, edge) {
        let share = shape.part_in(&cell).map_or(0.0, |part| part.volume / cell.volume());
        if share > 1e-12 && share < 1.0 - 1e-12 {
            cut += 1;
            assert!(rows.iter().any(|(row, _)| *row == index), "{name} {index:?} {share}");
        }
    }
    println!("{name}: {} boxes, {worst:?}", rows.len());
    assert_eq!(cut, rows.len(), "{name}");
}

#[test]
fn boxes_cut_by_shapes_in_the_plane_have_the_given_moments() {
    let rows = table::<2>("shape_cells_2d.csv");
    let ball = |centre, radius| Shape::<2>::Sphere { centre, radius };
    compare("disk", &ball([0.5; 2], 0.4), 0.125, &rows["disk"]);
    let centre = [0.53, 0.47];
    let ring = Shape::Difference(Box::new(ball(centre, 0.41)), vec![ball(centre, 0.23)]);
    compare("ring", &ring, 0.125, &rows["ring"]);
    let turn = Placement { rotation: rotation([0.0, 0.0, 1.0], 30_f64.to_radians()), pivot: [0.5; 2] };
    let flat = Aabb::new([0.15, 0.3], [0.85, 0.7]);
    let tilted = Shape::Rotated(Box::new(Shape::Box(flat)), turn);
    compare("tilted box", &tilted, 0.125, &rows["tilted_box"]);
    let [a, b] = [flat.lower, flat.upper];
    let corners = [a, [b[0], a[1]], b, [a[0], b[1]]].map(|x| turn.to_space(&x));
    compare("tilted polygon", &Shape::Polygon(corners.to_vec()), 0.125, &rows["tilted_box"]);
    let other = [corners[3], corners[2], corners[1], corners[0]];
    compare("tilted polygon, clockwise", &Shape::Polygon(other.to_vec()), 0.125, &rows["tilted_box"]);
    let base = turn.to_space(&[0.15, 0.5]);
    let axis = [30_f64.to_radians().cos(), 30_f64.to_radians().sin()];
    let frustum = Frustum { base, axis, height: 0.7, lower_radius: 0.2, upper_radius: 0.2 };
    compare("tilted frustum", &Shape::Frustum(frustum), 0.125, &rows["tilted_box"]);
}

#[test]
fn boxes_cut_by_shapes_in_space_have_the_given_moments() {
    let rows = table::<3>("shape_cells_3d.csv");
    let ball = |centre, radius| Shape::<3>::Sphere { centre, radius };
    compare("sphere", &ball([1.0; 3], 0.8), 0.25, &rows["sphere"]);
    let upright = Frustum {
        base: [1.0, 1.0, 0.4],
        axis: [0.0, 0.0, 1.0],
        height: 1.2,
        lower_radius: 0.7,
        upper_radius: 0.7,
    };
    compare("cylinder", &Shape::Frustum(upright), 0.25, &rows["cylinder"]);
    let length = 14_f64.sqrt();
    let axis = [1.0 / length, 2.0 / length, 3.0 / length];
    let turn = Placement { rotation: rotation(axis, 35_f64.to_radians()), pivot: [1.0; 3] };
    let flat = Aabb::new([0.4, 0.65, 0.75], [1.6, 1.35, 1.25]);
    let tilted = Shape::Rotated(Box::new(Shape::Box(flat)), turn);
    compare("tilted box", &tilted, 0.25, &rows["tilted_box_3d"]);
    let corner = |c: u32| {
        let upper = |a: u32| if c >> a & 1 == 1 { flat.upper[a as usize] } else { flat.lower[a as usize] };
        turn.to_space(&[upper(0), upper(1), upper(2)])
    };
    let mesh = Mesh::new(Triangles { vertices: (0..8).map(corner).collect(), ..cube() }).unwrap();
    compare("tilted mesh", &Shape::Mesh(mesh), 0.25, &rows["tilted_box_3d"]);
}

/// Boxes that both balls of a shell meet are halved: their volume is right to a few parts in a thousand of
/// theirs. The others, half as wide as a radius, are right to 1e-10.
#[test]
fn a_shell_has_the_given_moments_but_for_boxes_that_both_its_surfaces_meet() {
    let rows = table::<3>("shape_cells_3d.csv");
    let ball = |radius| Shape::<3>::Sphere { centre: [1.03, 0.96, 1.01], radius };
    let shell = Shape::Difference(Box::new(ball(0.8)), vec![ball(0.5)]);
    let (mut simple, mut double) = (0, 0);
    for (index, exact) in &rows["shell"] {
        let corner = |offset: i64| index.map(|i| (i + offset) as f64 * 0.25);
        let cell = Aabb::new(corner(0), corner(1));
        let off = difference(&shell.part_in(&cell).unwrap(), exact, 0.25);
        let both = [ball(0.8), ball(0.5)].iter().all(|ball| ball.classify(&cell) == Side::Crosses);
        *(if both { &mut double } else { &mut simple }) += 1;
        let bound = if both { 3e-3 } else { 1e-10 };
        assert!(off[0] < bound && off[2] < bound, "{index:?} {both} {off:?}");
    }
    println!("shell: {simple} {double}");
    assert!(simple > 100);
}

/// Boxes of any size add up to the whole, for shapes that stand anywhere; those of two thirds of a radius
/// with fewer digits.
#[test]
fn boxes_add_up_to_closed_forms() {
    let turn = Placement { rotation: rotation([0.6, 0.0, 0.8], 1.1), pivot: [0.3, 0.2, 0.1] };
    let cone = Frustum {
        base: [0.31, 0.22, 0.13],
        axis: [0.6, 0.64, 0.48],
        height: 0.5,
        lower_radius: 0.3,
        upper_radius: 0.0,
    };
    let tall = Frustum { upper_radius: 0.3, axis: [0.0, -1.0, 0.0], ..cone };
    let shapes = [
        Shape::Box(Aabb::new([0.1, 0.2, 0.3], [0.57, 0.69, 0.71])),
        Shape::Sphere { centre: [0.5, 0.52, 0.47], radius: 0.37 },
        Shape::Frustum(cone),
        Shape::Frustum(Frustum { upper_radius: 0.1, ..cone }),
        Shape::Frustum(tall),
        Shape::Rotated(Box::new(Shape::Frustum(tall)), turn),
        Shape::Mesh(Mesh::new(cube()).unwrap()),
        Shape::Mesh(Mesh::new(ball_of_triangles(3)).unwrap()),
    ];
    for shape in shapes {
        let exact = shape.moments().unwrap();
        for edge in [0.0913, 0.125, 0.25] {
            let off = difference(&sum(&shape, edge), &exact, exact.volume.cbrt());
            println!("{shape:?} {edge}: {off:?}");
            let bound = if edge < 0.2 { 1e-12 } else { 1e-10 };
            assert!(off.iter().all(|off| *off < bound), "{shape:?} {edge}: {off:?}");
        }
    }
    let bent = [[0.1, 0.1], [0.9, 0.15], [0.85, 0.9], [0.5, 0.4], [0.2, 0.8]];
    let flat = [
        Shape::<2>::Polygon(bent.to_vec()),
        Shape::Sphere { centre: [0.5, 0.47], radius: 0.41 },
        Shape::Frustum(Frustum {
            base: [0.2, 0.3],
            axis: [0.8, 0.6],
            height: 0.4,
            lower_radius: 0.3,
            upper_radius: 0.1,
        }),
    ];
    for shape in flat {
        let exact = shape.moments().unwrap();
        for edge in [0.0413, 0.125, 0.5] {
            let off = difference(&sum(&shape, edge), &exact, exact.volume.sqrt());
            assert!(off.iter().all(|off| *off < 1e-13), "{shape:?} {edge}: {off:?}");
        }
    }
}

/// Booleans of shapes with plane sides, and of one round shape with them, are exact; of several round ones as
/// far as the halving of boxes goes.
#[test]
fn booleans_add_up() {
    let ball = |x: f64, radius| Shape::<2>::Sphere { centre: [x, 0.5], radius };
    let block = |low, high| Shape::<2>::Box(Aabb::new(low, high));
    let half = Shape::HalfSpace { point: [0.45, 0.5], normal: [1.0, 0.0] };
    let pi = std::f64::consts::PI;
    // A segment of a disc of radius 0.4, whose chord lies 0.05 off the centre.
    let segment = 0.16 * (0.05_f64 / 0.4).acos() - 0.05 * (0.16_f64 - 0.0025).sqrt();
    let lens = 2.0 * (0.16 * 0.5_f64.acos() - 0.2 * (0.16_f64 - 0.04).sqrt());
    let cases = [
        (Shape::Intersection(vec![ball(0.5, 0.4), half.clone()]), segment, 1e-13),
        (Shape::Difference(Box::new(ball(0.5, 0.4)), vec![half]), 0.16 * pi - segment, 1e-13),
        (
            Shape::Union(vec![block([0.1, 0.1], [0.6, 0.6]), block([0.37, 0.41], [0.9, 0.93])]),
            0.25 + 0.53 * 0.52 - 0.23 * 0.19,
            1e-13,
        ),
        (Shape::Union(vec![ball(0.5, 0.2), ball(0.5, 0.2), ball(0.5, 0.2)]), 0.04 * pi, 1e-13),
        (Shape::Union(vec![ball(0.3, 0.4), ball(0.7, 0.4)]), 0.32 * pi - lens, 1e-7),
        (Shape::Intersection(vec![ball(0.3, 0.4), ball(0.7, 0.4)]), lens, 1e-7),
    ];
    for (shape, exact, tolerance) in cases {
        let off = sum(&shape, 0.0625).volume / exact - 1.0;
        println!("{shape:?}: {off:e}");
        assert!(off.abs() < tolerance, "{shape:?}: {off:e}");
    }
    let ball = Shape::<3>::Sphere { centre: [0.5; 3], radius: 0.4 };
    let drill = Frustum {
        base: [0.5, 0.5, 0.0],
        axis: [0.0, 0.0, 1.0],
        height: 1.0,
        lower_radius: 0.2,
        upper_radius: 0.2,
    };
    // Napkin ring.
    let shape = Shape::Difference(Box::new(ball), vec![Shape::Frustum(drill)]);
    let off = sum(&shape, 0.05).volume / (4.0 / 3.0 * pi * 0.12_f64.powf(1.5)) - 1.0;
    println!("drilled ball: {off:e}");
    assert!(off.abs() < 1e-4, "{off:e}");
}

/// A mesh whose faces lie on faces of boxes fills them wholly or not at all.
#[test]
fn a_mesh_on_faces_of_boxes_fills_them() {
    let mesh = Shape::<3>::Mesh(Mesh::new(cube()).unwrap());
    let mut full = 0;
    for (_, cell) in boxes(&mesh, 0.125) {
        let share = mesh.part_in(&cell).map_or(0.0, |part| part.volume / cell.volume());
        assert!(share < 1e-13 || (share - 1.0).abs() < 1e-13, "{cell:?} {share}");
        full += u32::from(share > 0.5);
    }
    assert_eq!(full, 512);
}
