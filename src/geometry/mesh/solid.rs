//! Whether triangles bound a solid.
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
        "found the vertex {0} with a coordinate that is no number below 1e12 m; expected finite coordinates"
    )]
    Vertex(usize),
    /// Edges with a triangle on one side only.
    #[error(
        "found {count} open edges, the first near {}; expected a closed surface: fill the holes (in a mesh program: \"make manifold\", \"fill \
         holes\")",
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
        "found neighbouring triangles near {} of which one faces in and one out; expected one orientation (in a mesh program: \"recalculate \
         normals\")",
        point(.0)
    )]
    Turned([f64; 3]),
    /// Nothing inside.
    #[error("found a surface around a volume of {}; expected one with a volume", quantity(*.0, "m³"))]
    Flat(f64),
    /// The library refuses it.
    #[error("found a surface that cannot be used: {0}; expected a closed one without crossings")]
    Refused(String),
}

fn point(x: &[f64; 3]) -> String {
    let [x, y, z] = x.map(|c| number(c, 4));
    format!("[{x}, {y}, {z}] m")
}

/// Greatest coordinate, m: squares and cubes of distances stay finite.
const FARTHEST: f64 = 1e12;

/// The triangles with vertices at the same place made one, without those that have two corners at one place.
pub(super) fn merged(triangles: Triangles) -> Result<Triangles, NotSolid> {
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
    let indices: Vec<[u32; 3]> = triangles
        .indices
        .iter()
        .map(|corners| corners.map(|corner| of_vertex[corner as usize]))
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect();
    if indices.is_empty() { Err(NotSolid::Empty) } else { Ok(Triangles { vertices, indices }) }
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
}
