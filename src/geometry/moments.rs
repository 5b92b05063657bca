//! Volume, centre and second moments of shapes: closed forms of primitives, exact sums over the triangles of
//! meshes, and sums over cells of booleans, the same on all ranks.
use super::{Aabb, Frustum, Mesh, Shape};

/// Levels of cells that a boolean is cut into: 2^7 along each edge of its box.
const DEPTH: u32 = 7;

/// Integrals over a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments<const D: usize> {
    /// Volume, m³; area in 2D, m².
    pub volume: f64,
    /// Centre of the volume, m.
    pub centre: [f64; D],
    /// ∫ (x - c)(x - c)ᵀ dV about the centre c, m⁵ (m⁴ in 2D).
    pub second: [[f64; D]; D],
}

/// ∫ dV, ∫ x dV and ∫ x xᵀ dV about a point near the shape.
pub(super) struct Sums<const D: usize> {
    pub(super) origin: [f64; D],
    pub(super) volume: f64,
    pub(super) first: [f64; D],
    pub(super) second: [[f64; D]; D],
}

impl<const D: usize> Sums<D> {
    pub(super) fn new(origin: [f64; D]) -> Self {
        Self { origin, volume: 0.0, first: [0.0; D], second: [[0.0; D]; D] }
    }

    /// Adds a simplex with a corner at the origin, of this signed volume: ∫ x = V Σ p / (D + 1), ∫ x xᵀ = V
    /// (Σ p pᵀ + Σp Σpᵀ) / ((D + 1)(D + 2)) (Tonon 2004).
    pub(super) fn add_simplex(&mut self, volume: f64, corners: &[[f64; D]]) {
        let n = D as f64;
        let sum: [f64; D] = std::array::from_fn(|a| corners.iter().map(|p| p[a]).sum());
        self.volume += volume;
        for i in 0..D {
            self.first[i] += volume * sum[i] / (n + 1.0);
            for j in 0..D {
                let squares: f64 = corners.iter().map(|p| p[i] * p[j]).sum();
                self.second[i][j] += volume * (squares + sum[i] * sum[j]) / ((n + 1.0) * (n + 2.0));
            }
        }
    }

    /// Adds `sign` times integrals about another point, in a frame with these unit vectors.
    pub(super) fn add(&mut self, sign: f64, own: &Self, axes: &[[f64; D]; D]) {
        let shift: [f64; D] = std::array::from_fn(|a| own.origin[a] - self.origin[a]);
        let first: [f64; D] = std::array::from_fn(|i| (0..D).map(|k| axes[k][i] * own.first[k]).sum());
        self.volume += sign * own.volume;
        for i in 0..D {
            self.first[i] += sign * (first[i] + own.volume * shift[i]);
            for j in 0..D {
                let all = (0..D).flat_map(|k| (0..D).map(move |l| (k, l)));
                let turned: f64 = all.map(|(k, l)| axes[k][i] * own.second[k][l] * axes[l][j]).sum();
                let shifted = first[i] * shift[j] + shift[i] * first[j] + own.volume * shift[i] * shift[j];
                self.second[i][j] += sign * (turned + shifted);
            }
        }
    }

    pub(super) fn moments(&self) -> Option<Moments<D>> {
        if !(self.volume > 0.0 && self.volume.is_finite()) {
            return None;
        }
        let mean = self.first.map(|m| m / self.volume);
        let second = std::array::from_fn(|i| {
            std::array::from_fn(|j| self.second[i][j] - self.volume * mean[i] * mean[j])
        });
        let centre = std::array::from_fn(|a| self.origin[a] + mean[a]);
        Some(Moments { volume: self.volume, centre, second })
    }
}

impl<const D: usize> Shape<D> {
    /// Volume, centre and second moments; `None` of what is unbounded or has no volume.
    pub fn moments(&self) -> Option<Moments<D>> {
        match self {
            Self::Box(aabb) => {
                let edges: [f64; D] = std::array::from_fn(|a| aabb.upper[a] - aabb.lower[a]);
                let volume = edges.iter().product::<f64>();
                let second = diagonal(|a| volume * edges[a] * edges[a] / 12.0);
                found(Moments { volume, centre: aabb.centre(), second })
            }
            Self::Sphere { centre, radius } => {
                let (square, pi) = (radius * radius, std::f64::consts::PI);
                let volume = if D == 2 { pi * square } else { 4.0 / 3.0 * pi * square * radius };
                let second = diagonal(|_| volume * square / (D as f64 + 2.0));
                found(Moments { volume, centre: *centre, second })
            }
            Self::Frustum(frustum) => of_frustum(frustum),
            Self::HalfSpace { .. } => None,
            Self::Polygon(points) => {
                let origin: [f64; D] = std::array::from_fn(|a| points.first().map_or(0.0, |p| p[a % 2]));
                let mut sums = Sums::new(origin);
                for (i, b) in points.iter().enumerate() {
                    let a = points[(i + points.len() - 1) % points.len()];
                    let [a, b] = [&a, b].map(|p| std::array::from_fn::<f64, D, _>(|k| p[k % 2] - origin[k]));
                    sums.add_simplex(0.5 * (a[0] * b[1] - a[1] * b[0]), &[a, b]);
                }
                if sums.volume < 0.0 {
                    sums.volume = -sums.volume;
                    sums.first = sums.first.map(|m| -m);
                    sums.second = sums.second.map(|row| row.map(|m| -m));
                }
                sums.moments()
            }
            Self::Mesh(mesh) => of_mesh(mesh),
            Self::Rotated(shape, placement) => {
                let own = shape.moments()?;
                let r = &placement.rotation;
                let second = std::array::from_fn(|i| {
                    std::array::from_fn(|j| {
                        let all = (0..D).flat_map(|k| (0..D).map(move |l| (k, l)));
                        all.map(|(k, l)| r[i][k] * own.second[k][l] * r[j][l]).sum()
                    })
                });
                Some(Moments { volume: own.volume, centre: placement.to_space(&own.centre), second })
            }
            Self::Union(_) | Self::Intersection(_) | Self::Difference(..) => of_cells(self),
        }
    }
}

fn found<const D: usize>(moments: Moments<D>) -> Option<Moments<D>> {
    (moments.volume > 0.0 && moments.volume.is_finite()).then_some(moments)
}

fn diagonal<const D: usize>(value: impl Fn(usize) -> f64) -> [[f64; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { value(i) } else { 0.0 }))
}

/// Integrals over slices across the axis, of the radius r(t) = a + (b - a) t / h: powers of it are
/// polynomials of t.
fn of_frustum<const D: usize>(frustum: &Frustum<D>) -> Option<Moments<D>> {
    let Frustum { base, axis, height: h, lower_radius: a, upper_radius: b } = *frustum;
    let (volume, first, along, across) = if D == 2 {
        let cubes = a * a * a + a * a * b + a * b * b + b * b * b;
        (
            h * (a + b),
            h * h * (a + 2.0 * b) / 3.0,
            h * h * h * (a + 3.0 * b) / 6.0,
            2.0 / 3.0 * h * cubes / 4.0,
        )
    } else {
        let pi = std::f64::consts::PI;
        let fourth = a.powi(4) + a.powi(3) * b + a * a * b * b + a * b.powi(3) + b.powi(4);
        (
            pi * h * (a * a + a * b + b * b) / 3.0,
            pi * h * h * (a * a + 2.0 * a * b + 3.0 * b * b) / 12.0,
            pi * h * h * h * (a * a + 3.0 * a * b + 6.0 * b * b) / 30.0,
            pi * h * fourth / 20.0,
        )
    };
    let mean = first / volume;
    let along = along - volume * mean * mean;
    let centre = std::array::from_fn(|k| mean.mul_add(axis[k], base[k]));
    let second = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let one = if i == j { 1.0 } else { 0.0 };
            across * (one - axis[i] * axis[j]) + along * axis[i] * axis[j]
        })
    });
    found(Moments { volume, centre, second })
}

fn of_mesh<const D: usize>(mesh: &Mesh) -> Option<Moments<D>> {
    let centre = mesh.bounds().centre();
    let mut sums = Sums::<3>::new(centre);
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|p| -> [f64; 3] { std::array::from_fn(|k| p[k] - centre[k]) });
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        let volume = (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0;
        sums.add_simplex(volume, &[a, b, c]);
    }
    let Moments { volume, centre, second } = sums.moments()?;
    let second = std::array::from_fn(|i| std::array::from_fn(|j| second[i][j]));
    (mesh.volume() > 0.0).then_some(Moments { volume, centre: std::array::from_fn(|a| centre[a]), second })
}

/// Cells of an octree over the shape: those that the surface may cross are divided, and of the last ones the
/// part counts that a plane at the distance of their centre cuts off.
fn of_cells<const D: usize>(shape: &Shape<D>) -> Option<Moments<D>> {
    let bounds = shape.bounds();
    if bounds.lower.iter().chain(&bounds.upper).any(|c| !c.is_finite()) || bounds.is_empty() {
        return None;
    }
    // A cube around the shape, so that cells have equal edges.
    let centre = bounds.centre();
    let half = (0..D).map(|a| 0.5 * (bounds.upper[a] - bounds.lower[a])).fold(0.0, f64::max);
    let mut sums = Sums::new(centre);
    let cube = Aabb::new(centre.map(|c| c - half), centre.map(|c| c + half));
    add_cell(shape, &cube, DEPTH, &mut sums);
    sums.moments()
}

fn add_cell<const D: usize>(shape: &Shape<D>, cell: &Aabb<D>, depth: u32, sums: &mut Sums<D>) {
    let (centre, reach) = (cell.centre(), cell.half_diagonal());
    let distance = shape.distance(&centre);
    if distance >= reach {
        return;
    }
    if distance > -reach && depth > 0 {
        for corner in 0..1_usize << D {
            let is_upper = |a: usize| corner >> a & 1 == 1;
            let lower = std::array::from_fn(|a| if is_upper(a) { centre[a] } else { cell.lower[a] });
            let upper = std::array::from_fn(|a| if is_upper(a) { cell.upper[a] } else { centre[a] });
            add_cell(shape, &Aabb::new(lower, upper), depth - 1, sums);
        }
        return;
    }
    let edges: [f64; D] = std::array::from_fn(|a| cell.upper[a] - cell.lower[a]);
    let mean = edges.iter().sum::<f64>() / D as f64;
    let share = if distance <= -reach { 1.0 } else { (0.5 - distance / mean).clamp(0.0, 1.0) };
    let volume = share * edges.iter().product::<f64>();
    let x: [f64; D] = std::array::from_fn(|a| centre[a] - sums.origin[a]);
    sums.volume += volume;
    for i in 0..D {
        sums.first[i] += volume * x[i];
        for j in 0..D {
            let own = if i == j { edges[i] * edges[i] / 12.0 } else { 0.0 };
            sums.second[i][j] += volume * (x[i] * x[j] + own);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::Triangles;

    fn close<const D: usize>(found: &Moments<D>, exact: &Moments<D>, tolerance: f64) {
        let size = exact.volume.powf(1.0 / D as f64);
        assert!((found.volume / exact.volume - 1.0).abs() < tolerance, "{found:?} {exact:?}");
        for i in 0..D {
            assert!((found.centre[i] - exact.centre[i]).abs() < tolerance * size, "{found:?} {exact:?}");
            for j in 0..D {
                let off = (found.second[i][j] - exact.second[i][j]).abs();
                assert!(off < tolerance * exact.volume * size * size, "{found:?} {exact:?}");
            }
        }
    }

    /// A box as mesh, as polygon and as cells is the box; a cylinder and a cone agree with sums over cells.
    #[test]
    fn shapes_have_the_moments_of_their_closed_forms() {
        let block = Shape::Box(Aabb::new([1.0, 2.0, 3.0], [1.3, 2.2, 3.1]));
        let exact = block.moments().unwrap();
        let corner = |c: u32| {
            [1.0 + 0.3 * f64::from(c & 1), 2.0 + 0.2 * f64::from(c >> 1 & 1), 3.0 + 0.1 * f64::from(c >> 2)]
        };
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let indices = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let mesh = Mesh::new(Triangles { vertices: (0..8).map(corner).collect(), indices }).unwrap();
        close(&Shape::<3>::Mesh(mesh).moments().unwrap(), &exact, 1e-12);
        close(&Shape::Union(vec![block]).moments().unwrap(), &exact, 1e-3);
        let polygon = Shape::<2>::Polygon(vec![[0.0, 0.0], [0.0, 1.0], [2.0, 1.0], [2.0, 0.0]]);
        close(
            &polygon.moments().unwrap(),
            &Shape::Box(Aabb::new([0.0; 2], [2.0, 1.0])).moments().unwrap(),
            1e-14,
        );
        for (lower_radius, upper_radius) in [(0.3, 0.3), (0.3, 0.1)] {
            let axis = [0.6, 0.0, 0.8];
            let frustum = Frustum { base: [0.1, 0.2, 0.3], axis, height: 0.5, lower_radius, upper_radius };
            let exact = Shape::Frustum(frustum).moments().unwrap();
            close(&Shape::Union(vec![Shape::Frustum(frustum)]).moments().unwrap(), &exact, 1e-3);
            let flat =
                Frustum { base: [0.1, 0.2], axis: [0.6, 0.8], height: 0.5, lower_radius, upper_radius };
            let exact = Shape::Frustum(flat).moments().unwrap();
            close(&Shape::Union(vec![Shape::Frustum(flat)]).moments().unwrap(), &exact, 1e-3);
        }
        let ball = Shape::Sphere { centre: [0.1, 0.2, 0.3], radius: 0.4 };
        let exact = ball.moments().unwrap();
        close(&Shape::Union(vec![ball]).moments().unwrap(), &exact, 1e-3);
        assert!(Shape::HalfSpace { point: [0.0; 2], normal: [0.0, 1.0] }.moments().is_none());
    }
}
