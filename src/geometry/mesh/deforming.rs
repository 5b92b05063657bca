//! A surface that deforms: meshes with the same triangles at given times, linear between them.
use std::sync::Arc;

use super::Mesh;

/// Meshes of one surface at the times 0, Δ, 2 Δ, …; after the last one it stays.
#[derive(Clone, Debug, PartialEq)]
pub struct Deforming {
    meshes: Arc<[Mesh]>,
    /// Time between two of them, s.
    every: f64,
    /// The greatest speed of a vertex from each interval on, m/s.
    speeds: Arc<[f64]>,
    place: Place,
}

/// Position of a surface in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// At the first mesh, before any motion.
    First,
    /// After the mesh of this number.
    After(usize),
    /// At the last one.
    Last,
}

/// Why meshes are not one surface: which of them has other vertices or triangles than the first, and how
/// many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mismatch {
    /// Number of the mesh.
    pub mesh: usize,
    /// Vertices and triangles that it has.
    pub found: [usize; 2],
    /// Those of the first mesh.
    pub expected: [usize; 2],
}

impl Deforming {
    /// Of meshes that are `every` seconds apart.
    ///
    /// # Errors
    /// One has other triangles than the first.
    pub fn new(meshes: Vec<Mesh>, every: f64) -> Result<Self, Mismatch> {
        let counts = |mesh: &Mesh| [mesh.vertices().count(), mesh.0.surface.surface.indices().len()];
        let surface = |mesh: &Mesh, first: &Mesh| {
            let triangles = [mesh, first].map(|mesh| mesh.0.surface.surface.indices());
            counts(mesh) == counts(first) && triangles[0] == triangles[1]
        };
        if let Some(first) = meshes.first()
            && let Some(other) = meshes.iter().position(|mesh| !surface(mesh, first))
        {
            let (found, expected) = (counts(&meshes[other]), counts(first));
            return Err(Mismatch { mesh: other, found, expected });
        }
        let mut speeds: Vec<f64> =
            meshes.windows(2).map(|pair| farthest(&pair[0], &pair[1]) / every).collect();
        for interval in (1..speeds.len()).rev() {
            speeds[interval - 1] = speeds[interval - 1].max(speeds[interval]);
        }
        Ok(Self { meshes: meshes.into(), every, speeds: speeds.into(), place: Place::First })
    }

    /// How many meshes there are.
    pub fn len(&self) -> usize {
        self.meshes.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.meshes.is_empty()
    }

    /// Time from the first to the last, s.
    pub fn duration(&self) -> f64 {
        self.every * self.meshes.len().saturating_sub(1) as f64
    }

    /// Moves to a time (s). Returns the surface there, unless it is the same as before.
    pub fn advance(&mut self, time: f64) -> Option<Mesh> {
        let last = self.meshes.len().checked_sub(1)?;
        let number = (time / self.every).max(0.0);
        let before = self.place;
        self.place = if number < last as f64 { Place::After(number as usize) } else { Place::Last };
        match self.place {
            Place::After(k) => {
                let part = number - k as f64;
                let (from, to) = (self.meshes[k].vertices(), self.meshes[k + 1].vertices());
                let between =
                    |(a, b): ([f64; 3], [f64; 3])| std::array::from_fn(|i| part.mul_add(b[i] - a[i], a[i]));
                Some(self.meshes[k].moved(from.zip(to).map(between).collect()))
            }
            _ => (before != Place::Last).then(|| self.meshes[last].clone()),
        }
    }

    /// Velocity of the surface at its point nearest to `x` (m), linear on each triangle, m/s.
    pub fn velocity(&self, surface: &Mesh, x: &[f64; 3]) -> [f64; 3] {
        let Place::After(k) = self.place else { return [0.0; 3] };
        let (corners, shares) = surface.nearest_triangle(x);
        let (from, to) = (&self.meshes[k].0.surface.surface, &self.meshes[k + 1].0.surface.surface);
        let mut velocity = [0.0; 3];
        for (corner, share) in corners.into_iter().zip(shares) {
            let way = to.vertices()[corner as usize] - from.vertices()[corner as usize];
            for (v, way) in velocity.iter_mut().zip([way.x, way.y, way.z]) {
                *v = (share / self.every).mul_add(way, *v);
            }
        }
        velocity
    }

    /// The greatest speed of a vertex from a time (s) on, m/s.
    pub fn greatest_speed(&self, time: f64) -> f64 {
        let next = (time / self.every).max(0.0) as usize;
        self.speeds.get(next).copied().unwrap_or(0.0)
    }
}

/// The longest displacement of a vertex between two meshes, m.
fn farthest(from: &Mesh, to: &Mesh) -> f64 {
    let ways = from.vertices().zip(to.vertices());
    let squares = ways.map(|(a, b)| (0..3).map(|i| (b[i] - a[i]).powi(2)).sum::<f64>());
    squares.fold(0.0, f64::max).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ball, points};
    use super::*;
    use crate::geometry::mesh::Triangles;

    fn scaled(factor: f64) -> Mesh {
        let Triangles { vertices, indices } = ball(4);
        let vertices = vertices.into_iter().map(|x| x.map(|c| factor * c)).collect();
        Mesh::new(Triangles { vertices, indices }).expect("closed")
    }

    /// A ball that grows from 1 to 2 m in half a second: its radius is linear in time, and its surface moves
    /// outwards at 2 m/s.
    #[test]
    fn a_growing_ball_has_the_radius_and_velocity_of_its_time() {
        let mut deforming = Deforming::new(vec![scaled(1.0), scaled(2.0)], 0.5).expect("same triangles");
        assert_eq!(deforming.duration(), 0.5);
        let mesh = deforming.advance(0.125).expect("it moves");
        for (x, part) in points(1.0).zip(points(0.03).skip(7)) {
            let length = x.iter().map(|c| c * c).sum::<f64>().sqrt();
            let radius = 1.25 + part[0];
            let x = x.map(|c| c * radius / length);
            assert!((mesh.distance(&x) - (radius - 1.25)).abs() < 5e-3, "{x:?}");
            let velocity = deforming.velocity(&mesh, &x);
            let outward: f64 = (0..3).map(|i| velocity[i] * x[i] / radius).sum();
            assert!((outward - 2.0).abs() < 1e-2, "{x:?} {velocity:?}");
        }
        assert!((deforming.greatest_speed(0.0) - 2.0).abs() < 1e-12 && deforming.greatest_speed(0.6) == 0.0);
        let last = deforming.advance(0.7).expect("it stops");
        assert_eq!(last, scaled(2.0));
        assert!(deforming.advance(0.8).is_none() && deforming.velocity(&last, &[1.0; 3]) == [0.0; 3]);
    }

    #[test]
    fn other_triangles_are_another_surface() {
        let other = Mesh::new(ball(3)).expect("closed");
        let error = Deforming::new(vec![scaled(1.0), other], 0.5).unwrap_err();
        assert_eq!((error.mesh, error.expected[1], error.found[1]), (1, 2048, 512));
    }
}
