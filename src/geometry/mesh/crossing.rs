//! Triangles of a surface that intersect.
use parry3d_f64::partitioning::Bvh;

use super::solid::NotSolid;

/// Heights over a plane below this share of the size of the triangles, cubed with the area, count as on it:
/// they touch.
const TOUCHES: f64 = 1e-12;

/// Finds pairs of triangles of which an edge of one pierces the other. Pairs with a common edge are left out.
pub(super) fn check(
    vertices: &[[f64; 3]],
    indices: &[[u32; 3]],
    numbers: &[u32],
    tree: &Bvh,
) -> Result<(), NotSolid> {
    let pairs: Vec<(u32, u32)> =
        tree.leaf_pairs(tree, |a, b| a.intersects(b)).filter(|(first, second)| first < second).collect();
    let mut found: Vec<(u32, u32, [f64; 3])> = pairs
        .into_iter()
        .filter_map(|(first, second)| {
            let [a, b] = [first, second].map(|triangle| indices[triangle as usize]);
            crossing(vertices, a, b).map(|near| (first, second, near))
        })
        .collect();
    found.sort_unstable_by_key(|&(first, second, _)| (first, second));
    match found.first() {
        None => Ok(()),
        Some(&(first, second, near)) => {
            let triangles = [first, second].map(|triangle| numbers[triangle as usize] as usize);
            Err(NotSolid::Crosses { count: found.len(), triangles, near })
        }
    }
}

/// A point in which an edge of one triangle pierces the other.
fn crossing(vertices: &[[f64; 3]], a: [u32; 3], b: [u32; 3]) -> Option<[f64; 3]> {
    let common = a.iter().filter(|corner| b.contains(corner)).count();
    if common > 1 {
        return None;
    }
    let places = |corners: [u32; 3]| corners.map(|corner| vertices[corner as usize]);
    let through = |of: [u32; 3], other: [u32; 3]| {
        let edges = [[of[0], of[1]], [of[1], of[2]], [of[2], of[0]]];
        let free = edges.into_iter().filter(|edge| edge.iter().all(|corner| !other.contains(corner)));
        free.map(|edge| edge.map(|corner| vertices[corner as usize]))
            .find_map(|edge| piercing(edge, places(other)))
    };
    through(a, b).or_else(|| through(b, a))
}

/// The point in which an edge pierces a triangle from one side to the other.
fn piercing([p, q]: [[f64; 3]; 2], [u, v, w]: [[f64; 3]; 3]) -> Option<[f64; 3]> {
    let reach = |axis: usize| {
        let all = [p, q, u, v, w].map(|x| x[axis]);
        all.iter().fold(f64::NEG_INFINITY, |m, c| m.max(*c))
            - all.iter().fold(f64::INFINITY, |m, c| m.min(*c))
    };
    let size = reach(0).max(reach(1)).max(reach(2));
    let least = TOUCHES * size * size * size;
    let (below, above) = (volume(u, v, w, p), volume(u, v, w, q));
    if !(below.abs() > least && above.abs() > least) || (below > 0.0) == (above > 0.0) {
        return None;
    }
    let sides = [volume(p, q, u, v), volume(p, q, v, w), volume(p, q, w, u)];
    let one_way = sides.iter().all(|side| *side > -least) || sides.iter().all(|side| *side < least);
    let share = below / (below - above);
    one_way.then(|| std::array::from_fn(|axis| p[axis] + share * (q[axis] - p[axis])))
}

/// Six times the volume of a tetrahedron, with the sign of its orientation.
fn volume(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let [b, c, d] = [b, c, d].map(|x| [x[0] - a[0], x[1] - a[1], x[2] - a[2]]);
    let cross = [c[1] * d[2] - c[2] * d[1], c[2] * d[0] - c[0] * d[2], c[0] * d[1] - c[1] * d[0]];
    b[0] * cross[0] + b[1] * cross[1] + b[2] * cross[2]
}
