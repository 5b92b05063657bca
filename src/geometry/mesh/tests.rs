//! Meshes against shapes with closed forms.
use super::*;

/// A ball of radius 1 about the origin by subdivision of an octahedron.
pub(in crate::geometry) fn ball(depth: u32) -> Triangles {
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let mut indices = Vec::new();
    let n = 1_usize << depth;
    let signs = [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0]];
    let signs = signs.into_iter().chain(signs.map(|s| s.map(|c: f64| -c)));
    for sign in signs {
        let point = |i: usize, j: usize| {
            let p = [i as f64, j as f64, (n - i - j) as f64].map(|c| c / n as f64);
            let length = p.iter().map(|c| c * c).sum::<f64>().sqrt();
            std::array::from_fn(|a| sign[a] * p[a] / length)
        };
        let turns = sign[0] * sign[1] * sign[2] < 0.0;
        let mut push = |a: [f64; 3], b, c| {
            let first = vertices.len() as u32;
            vertices.extend([a, b, c]);
            indices.push(if turns { [first, first + 2, first + 1] } else { [first, first + 1, first + 2] });
        };
        for i in 0..n {
            for j in 0..n - i {
                push(point(i, j), point(i + 1, j), point(i, j + 1));
                if i + j + 2 <= n {
                    push(point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
                }
            }
        }
    }
    Triangles { vertices, indices }
}

pub(in crate::geometry) fn cube() -> Triangles {
    let vertices = (0..8).map(|c| [f64::from(c & 1), f64::from(c >> 1 & 1), f64::from(c >> 2)]).collect();
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let indices = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Triangles { vertices, indices }
}

/// Points of a box about a solid, in no order.
pub(in crate::geometry) fn points(reach: f64) -> impl Iterator<Item = [f64; 3]> {
    let part = |i: u32, root: f64| (f64::from(i) * root).fract() * 2.0 - 1.0;
    (1..4000).map(move |i| {
        [part(i, 0.754_877_666), part(i, 0.569_840_291), part(i, 0.819_172_513)].map(|c| reach * c)
    })
}

/// The distance of a cube is exact near its surface, edges and corners included, and a bound with the right
/// sign elsewhere; the normal is the gradient.
#[test]
fn a_cube_is_a_box() {
    let mesh = Mesh::new(cube()).unwrap();
    assert!((mesh.volume() - 1.0).abs() < 1e-15);
    let exact = super::super::Shape::Box(Aabb::new([0.0; 3], [1.0; 3]));
    let near = 2.0 / RASTER as f64;
    for x in points(1.2).map(|x| x.map(|c| c + 0.5)) {
        let (found, expected) = (mesh.distance(&x), exact.distance(&x));
        assert!(
            found * expected >= 0.0 && found.abs() <= expected.abs() + 1e-15,
            "{x:?}: {found} {expected}"
        );
        if expected.abs() < near {
            assert!((found - expected).abs() < 1e-14, "{x:?}: {found} {expected}");
            let (normal, exact) = (mesh.gradient(&x), exact.gradient(&x));
            let cos: f64 = (0..3).map(|a| normal[a] * exact[a]).sum();
            // Along the planes that halve its edges there are two.
            assert!(cos > 1.0 - 1e-9 || expected < 0.0, "{x:?}: {normal:?} {exact:?}");
        }
    }
    assert_eq!(mesh.gradient(&[0.25, 0.5, 1.0]), [0.0, 0.0, 1.0]);
}

/// A ball of 8,192 triangles: as far off as its facets are, 2e-4 of the radius squared over the square of
/// their edge.
#[test]
fn a_fine_ball_is_nearly_a_ball() {
    let mesh = Mesh::new(ball(5)).unwrap();
    let sagitta = 2.0 * (1.0 / 32.0_f64).powi(2);
    for x in points(1.3) {
        let expected = x.iter().map(|c| c * c).sum::<f64>().sqrt() - 1.0;
        let found = mesh.distance(&x);
        assert!(found.abs() <= expected.abs() + sagitta, "{x:?}: {found} {expected}");
        assert!(found * expected > 0.0 || expected.abs() < sagitta, "{x:?}: {found} {expected}");
        if expected.abs() < 0.04 {
            assert!((found - expected).abs() < sagitta, "{x:?}: {found} {expected}");
        }
    }
}

/// With all triangles turned it is the same solid.
#[test]
fn facing_inwards_is_turned() {
    let mut inwards = cube();
    inwards.indices.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    let mesh = Mesh::new(inwards).unwrap();
    assert!(mesh.distance(&[0.5; 3]) < 0.0 && mesh.distance(&[1.5; 3]) > 0.0);
}

/// A torus of radii 1 and 0.4 about z.
fn torus(parts: [u32; 2]) -> Triangles {
    let angle = |k: u32, n: u32| f64::from(k) * std::f64::consts::TAU / f64::from(n);
    let [n, m] = parts;
    let point = |i: u32, j: u32| {
        let ((s, c), (t, d)) = (angle(i, n).sin_cos(), angle(j, m).sin_cos());
        let arm = 0.4_f64.mul_add(d, 1.0);
        [arm * c, arm * s, 0.4 * t]
    };
    let number = |i: u32, j: u32| (i % n) * m + j % m;
    let vertices = (0..n * m).map(|k| point(k / m, k % m)).collect();
    let quads = (0..n * m).map(|k| (k / m, k % m));
    let indices = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    Triangles { vertices, indices: indices.collect() }
}

/// Distance of a point to a triangle by its plane and its three edges.
fn to_triangle(x: &[f64; 3], corners: &[[f64; 3]; 3]) -> f64 {
    let minus = |a: &[f64; 3], b: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|k| a[k] - b[k]) };
    let dot = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
    let cross = |a: &[f64; 3], b: &[f64; 3]| -> [f64; 3] {
        std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
    };
    let [a, b, c] = corners;
    let normal = cross(&minus(b, a), &minus(c, a));
    let edges = [(a, b), (b, c), (c, a)];
    let is_over = edges.iter().all(|(p, q)| dot(&cross(&normal, &minus(q, p)), &minus(x, p)) >= 0.0);
    if is_over {
        return dot(&normal, &minus(x, a)).abs() / dot(&normal, &normal).sqrt();
    }
    let to_edge = |(p, q): &(&[f64; 3], &[f64; 3])| {
        let (way, along) = (minus(x, p), minus(q, p));
        let t = (dot(&way, &along) / dot(&along, &along)).clamp(0.0, 1.0);
        let off: [f64; 3] = std::array::from_fn(|k| way[k] - t * along[k]);
        dot(&off, &off).sqrt()
    };
    edges.iter().map(to_edge).fold(f64::INFINITY, f64::min)
}

/// Within a raster cell of the surface the distance to a torus and to a bunny is that to the nearest of all
/// triangles, to 1e-12 of the size; that to the torus of the closed form differs by the flatness of the
/// triangles alone.
#[test]
fn distances_of_a_torus_and_a_bunny_are_those_of_the_nearest_triangle() {
    let bunny = read(std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../jobs/meshes/bunny.obj")));
    for (name, triangles) in [("torus", torus([96, 48])), ("bunny", bunny.unwrap())] {
        let mesh = Mesh::new(triangles).unwrap();
        let (bounds, edge) = (mesh.bounds(), Raster::edge(&mesh.bounds()));
        let (mut worst, mut of_form, mut count) = (0.0_f64, 0.0_f64, 0);
        for (x, part) in mesh.vertices().step_by(13).zip(points(2.0)) {
            let x: [f64; 3] = std::array::from_fn(|a| edge.mul_add(0.28 * part[a], x[a]));
            let exact = mesh.triangles().map(|t| to_triangle(&x, &t)).fold(f64::INFINITY, f64::min);
            worst = worst.max((mesh.distance(&x).abs() - exact).abs());
            let form = (x[0].hypot(x[1]) - 1.0).hypot(x[2]) - 0.4;
            of_form = of_form.max((mesh.distance(&x) - form).abs());
            count += 1;
        }
        let size = bounds.upper[0] - bounds.lower[0];
        println!("{name}: {count} points, {:.1e} of a raster cell; {of_form:.1e} off the form", worst / edge);
        assert!(count > 100 && worst < 1e-12 * size, "{name} {worst}");
        // Chords of 96 and 48 parts: 1.4 (1 - cos π/96) and 0.4 (1 - cos π/48).
        assert!(name != "torus" || of_form < 1.4 * 5.4e-4 + 0.4 * 2.2e-3, "{of_form}");
    }
}
