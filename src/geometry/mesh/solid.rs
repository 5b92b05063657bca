//! Checks that triangles bound a solid.
use std::collections::BTreeMap;

use rustc_hash::{FxHashMap, FxHashSet};

use super::Triangles;
use crate::geometry::Aabb;
use crate::geometry::vector::dot;
use crate::text::{number, ordinal, quantity};

/// Why triangles bound no solid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotSolid {
    /// There is none with an area.
    #[error("found no triangle with an area; expected a closed surface")]
    Empty,
    /// A coordinate of a vertex is not a number below the limit.
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
        "found {count} pairs of triangles that intersect, the first the {} and the {} of the file near {}; expected a surface that does not intersect itself, or solid = \"winding\", which fills overlaps",
        ordinal(triangles[0]),
        ordinal(triangles[1]),
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
    /// Triangles that are there more than once.
    #[error(
        "found {count} triangles a second time, the first the {} of the file, which is also the {}; expected each once (in a mesh program: \
         \"remove duplicate faces\"), or solid = \"winding\", which leaves them out",
        ordinal(triangles[1]),
        ordinal(triangles[0])
    )]
    Doubled {
        /// How many.
        count: usize,
        /// The first pair, counted from 1.
        triangles: [usize; 2],
    },
    /// Nothing is left inside once holes are closed.
    #[error(
        "found faces with gaps between them wider than {}, around no solid once the rim of each is closed; expected faces with common vertices \
         at their edges (in a mesh program: \"merge by distance\")",
        quantity(*.0, "m")
    )]
    Hollow(f64),
    /// Nothing inside.
    #[error(
        "found a surface around a volume of {}: all of it is flat, or it crosses itself and its parts cancel; expected one around a volume",
        quantity(*.0, "m³")
    )]
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

/// Vertices that are nearer to each other than this share of the longest edge of their bounding box are
/// welded, where a surface has gaps: rounding by programs that mesh each face by itself.
const WELDED: f64 = 1e-6;

/// Least volume of a solid whose holes were closed, as a share of the cones over its triangles with their tip
/// in its middle; a smaller one counts as none.
const HOLLOW: f64 = 0.1;

/// Triangles with vertices of their own.
pub(super) struct Merged {
    /// Places of the vertices, m.
    pub vertices: Vec<[f64; 3]>,
    /// Corners of the triangles.
    pub indices: Vec<[u32; 3]>,
    /// The number of each in the file, from 1.
    pub numbers: Vec<u32>,
}

/// The triangles with vertices at the same place merged, without those that have two corners at one place.
pub(super) fn merged(triangles: Triangles) -> Result<Merged, NotSolid> {
    let mut numbers = FxHashMap::default();
    let mut vertices = Vec::new();
    let mut of_vertex = Vec::with_capacity(triangles.vertices.len());
    for (index, x) in triangles.vertices.iter().enumerate() {
        if x.iter().any(|c| !c.is_finite() || c.abs() >= FARTHEST) {
            return Err(NotSolid::Vertex(index));
        }
        // Zeros of both signs are the same place.
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

impl Merged {
    /// As [`check`].
    pub(super) fn check(&self) -> Result<f64, NotSolid> {
        match self.indices.is_empty() {
            true => Err(NotSolid::Empty),
            false => check(&self.vertices, &self.indices),
        }
    }

    /// The longest edge of the bounding box, m.
    fn size(&self) -> f64 {
        let reach = |axis: usize| {
            let along = self.vertices.iter().map(|x| x[axis]);
            along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
        };
        reach(0).max(reach(1)).max(reach(2))
    }

    /// The distance below which [`Merged::welded`] merges vertices, m.
    fn gap(&self) -> f64 {
        WELDED * self.size()
    }

    /// The same with nearly equal vertices merged to the first of them. Triangles with two corners at one
    /// place are removed.
    pub(super) fn welded(&self) -> Self {
        let gap = self.gap();
        let cell = |x: &[f64; 3]| x.map(|c| (c / gap).floor());
        let mut cells: FxHashMap<[u64; 3], Vec<u32>> = FxHashMap::default();
        let mut vertices: Vec<[f64; 3]> = Vec::new();
        let mut of_vertex = Vec::with_capacity(self.vertices.len());
        let is_near = |a: &[f64; 3], b: &[f64; 3]| {
            (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>() <= gap * gap
        };
        for x in &self.vertices {
            let own = cell(x);
            let around = (0..27).map(|k| [k % 3, k / 3 % 3, k / 9].map(|c| f64::from(c) - 1.0));
            let around = around.map(|way| std::array::from_fn(|a| (own[a] + way[a] + 0.0).to_bits()));
            let near = around.filter_map(|cell| cells.get(&cell)).flatten();
            let first = near.copied().filter(|&other| is_near(x, &vertices[other as usize])).min();
            of_vertex.push(first.unwrap_or_else(|| {
                vertices.push(*x);
                let number = vertices.len() as u32 - 1;
                cells.entry(own.map(|c| (c + 0.0).to_bits())).or_default().push(number);
                number
            }));
        }
        let corners = self.indices.iter().map(|corners| corners.map(|corner| of_vertex[corner as usize]));
        let numbered = corners.zip(self.numbers.iter().copied());
        let (indices, numbers) = numbered.filter(|([a, b, c], _)| a != b && b != c && c != a).unzip();
        Self { vertices, indices, numbers }
    }

    /// Removes repeated triangles of the same orientation.
    pub(super) fn leave_out_doubled(&mut self) {
        let mut seen = FxHashSet::default();
        let is_new: Vec<bool> = self.indices.iter().map(|corners| seen.insert(turned(corners))).collect();
        let mut keep = is_new.iter();
        self.indices.retain(|_| *keep.next().unwrap_or(&true));
        let mut keep = is_new.iter();
        self.numbers.retain(|_| *keep.next().unwrap_or(&true));
    }

    /// Checks that no triangle occurs twice in the same orientation.
    pub(super) fn check_doubled(&self) -> Result<(), NotSolid> {
        let (mut seen, mut count, mut first) = (FxHashMap::default(), 0, None);
        for (corners, number) in self.indices.iter().zip(&self.numbers) {
            if let Some(before) = seen.insert(turned(corners), *number) {
                count += 1;
                first.get_or_insert([before as usize, *number as usize]);
            }
        }
        first.map_or(Ok(()), |triangles| Err(NotSolid::Doubled { count, triangles }))
    }

    /// Closes the holes. Returns the volume inside, m³, with the sign of its orientation.
    ///
    /// # Errors
    /// Nothing is inside: faces with gaps between their edges enclose no volume once the rim of each is
    /// closed over itself. Then the volume is small compared with the cones over the triangles with their tip
    /// in the middle of the bounding box.
    pub(super) fn capped(&mut self) -> Result<f64, NotSolid> {
        if self.indices.is_empty() {
            return Err(NotSolid::Empty);
        }
        let bounds = Aabb::of_points(self.vertices.iter().copied());
        let middle: [f64; 3] = std::array::from_fn(|a| 0.5 * (bounds.lower[a] + bounds.upper[a]));
        let open = enclosed(&self.vertices, &self.indices, &middle);
        let gap = self.gap();
        cap_holes(&mut self.vertices, &mut self.indices);
        let volume = check(&self.vertices, &self.indices)?;
        if volume.abs() < HOLLOW * open.abs() { Err(NotSolid::Hollow(gap)) } else { Ok(volume) }
    }
}

/// Corners with the least first.
fn turned([a, b, c]: &[u32; 3]) -> [u32; 3] {
    let least = *a.min(b).min(c);
    if *a == least {
        [*a, *b, *c]
    } else if *b == least {
        [*b, *c, *a]
    } else {
        [*c, *a, *b]
    }
}

/// Volume of the cones over triangles with their tip in a point, with the signs of their orientation, m³.
fn enclosed(vertices: &[[f64; 3]], indices: &[[u32; 3]], tip: &[f64; 3]) -> f64 {
    let cones = indices.iter().map(|triangle| {
        let [a, b, c] = triangle
            .map(|v| -> [f64; 3] { std::array::from_fn(|axis| vertices[v as usize][axis] - tip[axis]) });
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
    });
    cones.sum()
}

/// Closes holes by cones. The rims of all holes are the sum of the directed edges of the triangles, a cycle.
/// So each loop of it, with the cone over it from the mean of its vertices, closes the surface.
fn cap_holes(vertices: &mut Vec<[f64; 3]>, indices: &mut Vec<[u32; 3]>) {
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
        // A walk along the rims; where it returns to a vertex, it has completed a loop.
        let mut walk = vec![start];
        let mut places = BTreeMap::from([(start, 0)]);
        while let Some(next) = next_on_rim(vertices, &walk, &mut onwards) {
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

/// Next edge of a rim. Where several meet, it is the one that turns back the most: so slits between edges
/// with different divisions are closed by themselves, and not with whole faces.
fn next_on_rim(vertices: &[[f64; 3]], walk: &[u32], onwards: &mut BTreeMap<u32, Vec<u32>>) -> Option<u32> {
    let (last, before) = walk.split_last()?;
    let ways = onwards.get_mut(last)?;
    let (Some(before), true) = (before.last(), ways.len() > 1) else { return ways.pop() };
    let way = |to: u32| -> [f64; 3] {
        let way: [f64; 3] = std::array::from_fn(|a| vertices[to as usize][a] - vertices[*last as usize][a]);
        let length = dot(way, way).sqrt();
        way.map(|c| c / length)
    };
    let back = way(*before);
    let along = |to: &u32| dot(back, way(*to));
    let most = (0..ways.len()).max_by(|&a, &b| along(&ways[a]).total_cmp(&along(&ways[b])))?;
    Some(ways.remove(most))
}

/// Checks that triangles are closed and face one way. Returns the volume inside, m³, negative where they face
/// inwards.
fn check(vertices: &[[f64; 3]], indices: &[[u32; 3]]) -> Result<f64, NotSolid> {
    // Each edge occurs as often in one direction as in the other.
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
    // Tetrahedra with a point of the surface, so that no digits are lost far from the origin.
    let origin = vertices[indices[0][0] as usize];
    let volume = enclosed(vertices, indices, &origin);
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

    /// A cube whose faces have vertices of their own, `gap` apart at its edges.
    fn unwelded(gap: f64) -> Triangles {
        let mut apart = Triangles::default();
        for (number, corners) in cube().indices.iter().enumerate() {
            let face = (number / 2) as f64 * gap;
            apart.push(&corners.map(|corner| cube().vertices[corner as usize].map(|c| c + face)));
        }
        apart
    }

    /// Faces with gaps of the size of rounding are one surface, closed or by winding number; wider gaps leave
    /// no solid, which is an error.
    #[test]
    fn faces_that_are_hardly_apart_are_welded() {
        for make in [Mesh::new, Mesh::wound] {
            let mesh = make(unwelded(1e-7)).unwrap_or_else(|error| panic!("{error}"));
            assert!((mesh.volume() - 1.0).abs() < 1e-5 && mesh.vertices().count() == 8, "{}", mesh.volume());
            assert!(mesh.distance(&[0.5; 3]) < -0.1 && mesh.distance(&[0.5, 0.5, 1.01]) > 0.0);
        }
        assert!(matches!(Mesh::new(unwelded(1e-3)), Err(NotSolid::Open { count: 24, .. })));
        assert!(matches!(Mesh::wound(unwelded(1e-3)), Err(NotSolid::Hollow(_))));
    }

    /// Faces that divide their common edge in different ways leave slits without an area: the solid by
    /// winding number is the cube.
    #[test]
    fn edges_that_are_divided_differently_are_closed_as_slits() {
        let mut slit = Triangles::default();
        for (number, corners) in cube().indices.iter().enumerate() {
            let [a, b, c] = corners.map(|corner| cube().vertices[corner as usize]);
            let middle = |p: [f64; 3], q: [f64; 3]| std::array::from_fn(|axis| 0.5 * (p[axis] + q[axis]));
            if number / 2 % 2 == 0 {
                slit.push(&[a, middle(a, b), c]);
                slit.push(&[middle(a, b), b, middle(b, c)]);
                slit.push(&[middle(a, b), middle(b, c), c]);
            } else {
                slit.push(&[a, b, c]);
            }
        }
        assert!(matches!(Mesh::new(slit.clone()), Err(NotSolid::Open { .. })));
        let mesh = Mesh::wound(slit).unwrap_or_else(|error| panic!("{error}"));
        assert!((mesh.volume() - 1.0).abs() < 1e-14, "{}", mesh.volume());
        for x in super::super::tests::points(0.7).map(|x| x.map(|c| c + 0.5)) {
            let exact = x.iter().fold(f64::NEG_INFINITY, |m: f64, c| m.max((c - 0.5).abs() - 0.5));
            assert_eq!(mesh.distance(&x) < 0.0, exact < 0.0, "{x:?}");
        }
    }

    /// One triangle or all of them a second time.
    #[test]
    fn doubled_triangles_are_named() {
        let mut one = cube();
        let [a, b, c] = one.indices[4];
        one.indices.push([c, a, b]);
        let error = Mesh::new(one.clone()).unwrap_err();
        assert_eq!(error, NotSolid::Doubled { count: 1, triangles: [5, 13] });
        assert!(error.to_string().starts_with(
            "found 1 triangles a second time, the first the 13th of the file, which is also the 5th"
        ));
        let mut all = cube();
        all.indices.extend(cube().indices);
        assert_eq!(Mesh::new(all.clone()), Err(NotSolid::Doubled { count: 12, triangles: [1, 13] }));
        for doubled in [one, all] {
            assert!((Mesh::wound(doubled).expect("a cube").volume() - 1.0).abs() < 1e-14);
        }
    }
}
