//! Whether triangles bound a solid.
use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use super::Triangles;
use crate::text::{number, quantity};

/// Why triangles bound no solid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotSolid {
    /// There is none with an area.
    #[error("found no triangle with an area; expected a closed surface")]
    Empty,
    /// A vertex is not at a place.
    #[error(
        "found the vertex {0} with a coordinate that is not a number below 1e12 m; expected finite coordinates"
    )]
    Vertex(usize),
    /// Edges with a triangle on one side only.
    #[error(
        "found {count} open edges, the first near {}; expected a closed surface: fill the holes (in a mesh program: \"make manifold\", \"fill \
         holes\"), or give solid = \"winding\", which closes them",
        point(near)
    )]
    Open {
        /// How many edges.
        count: usize,
        /// The middle of the first, m.
        near: [f64; 3],
    },
    /// Neighbours of which one faces in and one out.
    #[error(
        "found neighbouring triangles near {} , one facing inwards and one outwards; expected one orientation (in a mesh program: \"recalculate \
         normals\"), or solid = \"winding\"",
        point(.0)
    )]
    Turned([f64; 3]),
    /// Triangles go through each other.
    #[error(
        "found {count} pairs of triangles that intersect, the first the {}th and the {}th of the file near {}; expected a surface that does not intersect itself, or solid = \"winding\", which fills overlaps",
        triangles[0],
        triangles[1],
        point(near)
    )]
    Crosses {
        /// How many pairs.
        count: usize,
        /// The first pair, counted from 1.
        triangles: [usize; 2],
        /// Where, m.
        near: [f64; 3],
    },
    /// Nothing inside.
    #[error("found a surface around a volume of {}; expected one with a volume", quantity(*.0, "m³"))]
    Flat(f64),
    /// The library refuses it.
    #[error("found a surface that cannot be used: {0}; expected a closed surface without self-intersections")]
    Refused(String),
}

fn point(x: &[f64; 3]) -> String {
    let [x, y, z] = x.map(|c| number(c, 4));
    format!("[{x}, {y}, {z}] m")
}

/// Greatest coordinate, m: squares and cubes of distances stay finite.
const FARTHEST: f64 = 1e12;

/// Triangles with vertices of their own.
pub(super) struct Merged {
    /// Places of the vertices, m.
    pub vertices: Vec<[f64; 3]>,
    /// Corners of the triangles.
    pub indices: Vec<[u32; 3]>,
    /// The number of each in the file, from 1.
    pub numbers: Vec<u32>,
}

/// The triangles with vertices at the same place made one, without those that have two corners at one place.
pub(super) fn merged(triangles: Triangles) -> Result<Merged, NotSolid> {
    let mut numbers = FxHashMap::default();
    let mut vertices = Vec::new();
    let mut of_vertex = Vec::with_capacity(triangles.vertices.len());
    for (index, x) in triangles.vertices.iter().enumerate() {
        if x.iter().any(|c| !c.is_finite() || c.abs() >= FARTHEST) {
            return Err(NotSolid::Vertex(index));
        }
        // Zero has two signs, and one place.
        let x = x.map(|c| c + 0.0);
        let number = *numbers.entry(x.map(f64::to_bits)).or_insert_with(|| {
            vertices.push(x);
            vertices.len() as u32 - 1
        });
        of_vertex.push(number);
    }
    let of_vertex = |corners: &[u32; 3]| corners.map(|corner| of_vertex[corner as usize]);
    let numbered = triangles.indices.iter().zip(1..).map(|(corners, number)| (of_vertex(corners), number));
    let (indices, numbers): (Vec<[u32; 3]>, Vec<u32>) =
        numbered.filter(|([a, b, c], _)| a != b && b != c && c != a).unzip();
    if indices.is_empty() { Err(NotSolid::Empty) } else { Ok(Merged { vertices, indices, numbers }) }
}

/// Closes what is open by cones. The rims of all holes are what the edges of the triangles add up to with their directions; they have no
/// end, and so each loop of them and the cone over it, from the mean of its vertices, close the surface.
pub(super) fn cap_holes(vertices: &mut Vec<[f64; 3]>, indices: &mut Vec<[u32; 3]>) {
    let mut sums: BTreeMap<(u32, u32), i64> = BTreeMap::new();
    for [a, b, c] in indices.iter() {
        for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
            *sums.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
        }
    }
    let mut onwards: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for ((a, b), sum) in sums {
        let (from, to) = if sum > 0 { (a, b) } else { (b, a) };
        if sum != 0 {
            onwards.entry(from).or_default().extend((0..sum.unsigned_abs()).map(|_| to));
        }
    }
    let starts: Vec<u32> = onwards.keys().copied().collect();
    for start in starts {
        // A walk along the rims; where it comes to a vertex again, it has gone round a loop.
        let mut walk = vec![start];
        let mut places = BTreeMap::from([(start, 0)]);
        while let Some(next) = walk.last().and_then(|vertex| onwards.get_mut(vertex)).and_then(Vec::pop) {
            let Some(&place) = places.get(&next) else {
                places.insert(next, walk.len());
                walk.push(next);
                continue;
            };
            let rim = &walk[place..];
            let sum = rim.iter().fold([0.0; 3], |sum: [f64; 3], vertex| {
                std::array::from_fn(|axis| sum[axis] + vertices[*vertex as usize][axis])
            });
            let tip = vertices.len() as u32;
            for (at, &from) in rim.iter().enumerate() {
                indices.push([rim[(at + 1) % rim.len()], from, tip]);
            }
            let count = rim.len() as f64;
            vertices.push(sum.map(|c| c / count));
            for vertex in walk.drain(place + 1..) {
                places.remove(&vertex);
            }
        }
    }
}

/// Whether triangles are closed and face one way. Returns the volume inside, m³, negative where they face inwards.
pub(super) fn check(vertices: &[[f64; 3]], indices: &[[u32; 3]]) -> Result<f64, NotSolid> {
    // Each edge is gone along as often in one direction as in the other.
    let mut edges: FxHashMap<(u32, u32), [u32; 2]> = FxHashMap::default();
    let directed = |triangle: &[u32; 3]| {
        let [a, b, c] = *triangle;
        [(a, b), (b, c), (c, a)]
    };
    for (from, to) in indices.iter().flat_map(directed) {
        edges.entry((from.min(to), from.max(to))).or_default()[usize::from(from > to)] += 1;
    }
    let middle = |(a, b): (u32, u32)| -> [f64; 3] {
        let [a, b] = [a, b].map(|vertex| vertices[vertex as usize]);
        std::array::from_fn(|axis| 0.5 * (a[axis] + b[axis]))
    };
    // In the order of the file, so that the message does not depend on a hash.
    let mut open = Vec::new();
    let mut turned = None;
    for (from, to) in indices.iter().flat_map(directed) {
        let edge = (from.min(to), from.max(to));
        match edges[&edge] {
            [there, back] if (there + back) % 2 == 1 => open.push(edge),
            [there, back] if there != back => _ = turned.get_or_insert(edge),
            _ => {}
        }
    }
    if let Some(&first) = open.first() {
        open.sort_unstable();
        open.dedup();
        return Err(NotSolid::Open { count: open.len(), near: middle(first) });
    }
    if let Some(edge) = turned {
        return Err(NotSolid::Turned(middle(edge)));
    }
    // Tetrahedra with a point of the surface, so that far from the origin nothing is lost.
    let origin = vertices[indices[0][0] as usize];
    let volume: f64 = indices
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|v| -> [f64; 3] {
                std::array::from_fn(|axis| vertices[v as usize][axis] - origin[axis])
            });
            let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
            (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
        })
        .sum();
    if volume == 0.0 || !volume.is_finite() { Err(NotSolid::Flat(volume)) } else { Ok(volume) }
}

#[cfg(test)]
mod tests {
    use super::super::Mesh;
    use super::super::tests::cube;
    use super::*;

    #[test]
    fn what_is_no_solid_is_said_with_its_place() {
        let mut open = cube();
        open.indices.pop();
        assert!(matches!(Mesh::new(open), Err(NotSolid::Open { count: 3, .. })));
        let mut turned = cube();
        turned.indices[3].swap(0, 1);
        assert!(matches!(Mesh::new(turned), Err(NotSolid::Turned(_))));
        let mut nowhere = cube();
        nowhere.vertices[5][1] = f64::NAN;
        assert_eq!(Mesh::new(nowhere), Err(NotSolid::Vertex(5)));
        let mut flat = cube();
        flat.vertices.iter_mut().for_each(|x| x[2] = 0.0);
        assert!(Mesh::new(flat).is_err());
        assert_eq!(
            Mesh::new(Triangles { vertices: vec![[0.0; 3]; 3], indices: vec![[0, 1, 2]] }),
            Err(NotSolid::Empty)
        );
    }

    /// Of two cubes that overlap, twelve edges go through six faces of the other.
    #[test]
    fn what_crosses_itself_is_said_with_triangles_and_place() {
        let mut two = cube();
        let moved = cube();
        two.indices.extend(moved.indices.iter().map(|corners| corners.map(|corner| corner + 8)));
        two.vertices.extend(moved.vertices.iter().map(|x| [x[0] + 0.55, x[1] + 0.6, x[2] + 0.7]));
        let Err(NotSolid::Crosses { count, triangles: [first, second], near }) = Mesh::new(two.clone())
        else {
            panic!("the cubes cross")
        };
        assert!(count >= 6 && first <= 12 && second > 12 && second <= 24, "{count} {first} {second}");
        assert!(near.iter().all(|c| (0.5..=1.0).contains(c)), "{near:?}");
        // One beside the other, with a face in common or away from it.
        for way in [1.0, 1.5] {
            let mut apart = two.clone();
            for (x, own) in apart.vertices[8..].iter_mut().zip(&moved.vertices) {
                *x = [own[0] + way, own[1], own[2]];
            }
            assert!(!matches!(Mesh::new(apart), Err(NotSolid::Crosses { .. })), "{way}");
        }
    }
}
