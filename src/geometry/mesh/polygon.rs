//! Polygons of a mesh to triangles.
//!
//! A polygon is cut into a fan from its first corner where the fan is valid, as for all convex ones; else
//! ears are clipped one by one (Meisters 1975), in the coordinate plane that it faces most.
use crate::geometry::vector::{cross, dot};

/// Most corners of a polygon whose ears are cut: the time grows with their square.
const MOST: usize = 2_000;

/// The triangles of a polygon with these corners, with their orientation. Corners without a vertex are kept.
pub(super) fn triangles(vertices: &[[f64; 3]], corners: &[u32]) -> Vec<[u32; 3]> {
    let [first, rest @ ..] = corners else { return Vec::new() };
    let fan = || rest.windows(2).map(|pair| [*first, pair[0], pair[1]]).collect();
    let places: Option<Vec<[f64; 3]>> =
        corners.iter().map(|&corner| vertices.get(corner as usize).copied()).collect();
    let Some(places) = places.filter(|places| places.len() > 3 && places.len() <= MOST) else { return fan() };
    let flat = flattened(&places);
    if (1..flat.len() - 1).all(|k| turn(flat[0], flat[k], flat[k + 1]) >= 0.0) {
        return fan();
    }
    ears(&flat).into_iter().map(|ear| ear.map(|k| corners[k])).collect()
}

/// Places in the plane of two axes that the polygon faces most, counter-clockwise.
fn flattened(places: &[[f64; 3]]) -> Vec<[f64; 2]> {
    let minus = |a: &[f64; 3], b: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|k| a[k] - b[k]) };
    let from_first: Vec<[f64; 3]> = places.iter().map(|x| minus(x, &places[0])).collect();
    // Twice the area with its normal (Newell).
    let normal = from_first.windows(2).fold([0.0; 3], |sum: [f64; 3], pair| {
        let product = cross(pair[0], pair[1]);
        std::array::from_fn(|k| sum[k] + product[k])
    });
    let axis = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(2);
    let [mut u, mut v] = [(axis + 1) % 3, (axis + 2) % 3];
    if dot(normal, std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 })) < 0.0 {
        (u, v) = (v, u);
    }
    from_first.iter().map(|x| [x[u], x[v]]).collect()
}

/// Twice the area of a triangle, positive counter-clockwise.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Triangles of a simple polygon by numbers of its corners. Of one that crosses itself: some triangles with
/// its edges.
fn ears(flat: &[[f64; 2]]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..flat.len()).collect();
    let mut found = Vec::with_capacity(flat.len());
    let mut from = 0;
    while left.len() > 3 {
        let n = left.len();
        let corners = |k: usize| [left[(k + n - 1) % n], left[k % n], left[(k + 1) % n]];
        let is_ear = |k: &usize| {
            let ear = corners(*k);
            let [a, b, c] = ear.map(|corner| flat[corner]);
            turn(a, b, c) > 0.0
                && !left.iter().any(|corner| {
                    let x = flat[*corner];
                    let is_other = !ear.contains(corner) && ![a, b, c].contains(&x);
                    is_other && turn(a, b, x) >= 0.0 && turn(b, c, x) >= 0.0 && turn(c, a, x) >= 0.0
                })
        };
        // One after another around the polygon, so that no fan of thin triangles arises; where there is none,
        // any corner.
        let k = (from..from + n).find(is_ear).unwrap_or(from) % n;
        found.push(corners(k));
        left.remove(k);
        from = if k < left.len() { k } else { 0 };
    }
    found.push([left[0], left[1], left[2]]);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Place in space of a point of a plane.
    type Plane = fn(&[f64; 2]) -> [f64; 3];

    /// Polygons in a plane that is turned every way: triangles with the sum of their areas, none of them
    /// turned, and each edge of the polygon once.
    fn is_cut_rightly(polygon: &[[f64; 2]], area: f64) {
        let planes: [Plane; 4] = [
            |x| [x[0], x[1], 2.0],
            |x| [2.0, x[0], x[1]],
            |x| [x[1], -1.0, x[0]],
            |x| [0.6 * x[0], x[1], 0.8 * x[0]],
        ];
        for (plane, reversed) in planes.iter().flat_map(|plane| [(plane, false), (plane, true)]) {
            for start in 0..polygon.len() {
                let vertices: Vec<[f64; 3]> = polygon.iter().map(plane).collect();
                let mut corners: Vec<u32> =
                    (0..polygon.len()).map(|k| ((k + start) % polygon.len()) as u32).collect();
                if reversed {
                    corners.reverse();
                }
                let all = triangles(&vertices, &corners);
                assert_eq!(all.len(), polygon.len() - 2);
                let areas = all.iter().map(|triangle| {
                    let [a, b, c] = triangle.map(|corner| polygon[corner as usize]);
                    0.5 * turn(a, b, c) * if reversed { -1.0 } else { 1.0 }
                });
                let areas: Vec<f64> = areas.collect();
                assert!(areas.iter().all(|area| *area >= 0.0), "{polygon:?} {start} {areas:?}");
                assert!((areas.iter().sum::<f64>() - area).abs() < 1e-12, "{polygon:?} {start} {areas:?}");
                for k in 0..corners.len() {
                    let edge = [corners[k], corners[(k + 1) % corners.len()]];
                    let has =
                        |triangle: &&[u32; 3]| (0..3).any(|i| [triangle[i], triangle[(i + 1) % 3]] == edge);
                    assert_eq!(all.iter().filter(has).count(), 1, "{polygon:?} {start}");
                }
            }
        }
    }

    #[test]
    fn concave_polygons_are_cut_into_their_parts() {
        is_cut_rightly(
            &[
                [0.0, 0.0],
                [1.0, 0.0],
                [1.0, 1.0],
                [0.75, 1.0],
                [0.75, 0.25],
                [0.25, 0.25],
                [0.25, 1.0],
                [0.0, 1.0],
            ],
            0.625,
        );
        is_cut_rightly(&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [1.0, 2.0]], 1.25);
        // A square with a corner in the middle of an edge, and a star.
        is_cut_rightly(&[[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 1.0);
        let star: Vec<[f64; 2]> = (0..10)
            .map(|k| {
                let (radius, angle) =
                    (if k % 2 == 0 { 1.0 } else { 0.4 }, f64::from(k) * std::f64::consts::PI / 5.0);
                [radius * angle.cos(), radius * angle.sin()]
            })
            .collect();
        is_cut_rightly(&star, 10.0 * 0.5 * 0.4 * (std::f64::consts::PI / 5.0).sin());
    }

    /// Convex polygons are fans; polygons that cross themselves or are not finite give triangles as well.
    #[test]
    fn other_polygons() {
        let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(triangles(&square, &[0, 1, 2, 3]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(triangles(&square, &[0, 2, 1, 3]).len(), 2);
        assert_eq!(triangles(&square, &[0, 1, 9, 3]), [[0, 1, 9], [0, 9, 3]]);
        assert_eq!(triangles(&[[0.0; 3]; 4], &[0, 1, 2, 3]).len(), 2);
        assert!(triangles(&square, &[0, 1]).is_empty() && triangles(&square, &[]).is_empty());
    }
}
