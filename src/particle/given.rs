//! Particles that a job gives one by one.
use super::chunk::{Chunk, Layout};
use super::volume::reference_volume;
use crate::geometry::Aabb;

/// Particles in the order of their file, found by place.
pub struct Given<const D: usize> {
    chunk: Chunk<D>,
    /// Whether the file gives their velocities; otherwise the body does.
    pub has_velocity: bool,
    bounds: Aabb<D>,
    /// Cells of a raster over the bounds along each axis, about one for each particle.
    cells: [usize; D],
    /// The first in `order` of each cell, and the end.
    starts: Vec<u32>,
    /// Numbers of the particles by cell.
    order: Vec<u32>,
}

impl<const D: usize> Given<D> {
    /// These particles, at least one and fewer than 2^32, at finite places.
    pub fn new(chunk: Chunk<D>, has_velocity: bool) -> Self {
        let places = || (0..chunk.len()).map(|p| chunk.position(p));
        let bounds = places().fold(Aabb::EMPTY, |hull, x| hull.hull(&Aabb::new(x, x)));
        let along = (chunk.len() as f64).powf(1.0 / D as f64).ceil().max(1.0) as usize;
        let mut given = Self {
            cells: [along; D],
            bounds,
            has_velocity,
            starts: vec![0; along.pow(D as u32) + 1],
            order: Vec::new(),
            chunk: Chunk::new(),
        };
        let cells: Vec<usize> = places().map(|x| given.cell(&given.index(&x))).collect();
        cells.iter().for_each(|cell| given.starts[cell + 1] += 1);
        for cell in 1..given.starts.len() {
            given.starts[cell] += given.starts[cell - 1];
        }
        let mut next = given.starts.clone();
        given.order = vec![0; cells.len()];
        for (p, cell) in cells.into_iter().enumerate() {
            given.order[next[cell] as usize] = p as u32;
            next[cell] += 1;
        }
        given.chunk = chunk;
        given
    }

    /// The particles.
    pub fn chunk(&self) -> &Chunk<D> {
        &self.chunk
    }

    /// Whether mass over undeformed volume of all is this density, kg/m³ (with D = 2 per metre of thickness).
    pub fn has_density(&self, density: f64) -> bool {
        let masses = self.chunk.column(Layout::<D>::MASS);
        let close = |p: usize| {
            let mass = density * reference_volume(&self.chunk, p);
            (masses[p] - mass).abs() <= 1e-9 * mass
        };
        (0..self.chunk.len()).all(close)
    }

    /// A box that holds their undeformed boxes, m.
    pub fn bounds(&self) -> Aabb<D> {
        let half = self.chunk.greatest_half();
        Aabb::new(self.bounds.lower.map(|c| c - half), self.bounds.upper.map(|c| c + half))
    }

    /// Greatest speed, m/s.
    pub fn greatest_speed(&self) -> f64 {
        let speed = |p| self.chunk.read::<D>(Layout::<D>::VELOCITY, p).iter().map(|v| v * v).sum::<f64>();
        (0..self.chunk.len()).map(speed).fold(0.0, f64::max).sqrt()
    }

    /// Numbers of the particles in a half-open box, in the order of the file.
    pub fn in_box(&self, cell: &Aabb<D>) -> Vec<u32> {
        let (lower, upper) = (self.index(&cell.lower), self.index(&cell.upper));
        let mut found = Vec::new();
        let mut index = lower;
        loop {
            let cell_number = self.cell(&index);
            let range = self.starts[cell_number] as usize..self.starts[cell_number + 1] as usize;
            found.extend(
                self.order[range].iter().filter(|&&p| cell.contains(&self.chunk.position(p as usize))),
            );
            let Some(axis) = (0..D).find(|&axis| index[axis] < upper[axis]) else { break };
            index[axis] += 1;
            index[..axis].copy_from_slice(&lower[..axis]);
        }
        found.sort_unstable();
        found
    }

    /// Place in the raster; that of the nearest cell for points outside.
    fn index(&self, x: &[f64; D]) -> [usize; D] {
        std::array::from_fn(|a| {
            let length = self.bounds.upper[a] - self.bounds.lower[a];
            let share = if length > 0.0 { (x[a] - self.bounds.lower[a]) / length } else { 0.0 };
            ((share * self.cells[a] as f64) as usize).min(self.cells[a] - 1)
        })
    }

    fn cell(&self, index: &[usize; D]) -> usize {
        index.iter().zip(&self.cells).fold(0, |cell, (i, n)| cell * n + i)
    }
}

impl<const D: usize> std::fmt::Debug for Given<D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Given({} particles)", self.chunk.len())
    }
}

#[cfg(test)]
mod tests {
    use super::super::chunk::Tag;
    use super::*;

    /// Boxes that tile space have each particle once, in the order of the file.
    #[test]
    fn each_particle_is_in_one_box() {
        let mut chunk = Chunk::<2>::new();
        for i in 0..500_u32 {
            let p = chunk.push_zeroed(0, Tag { material: 0, body: 0, level: 0 });
            let place = [0.754_877_666, 0.569_840_291].map(|root| (f64::from(i) * root).fract() * 3.0);
            chunk.write(Layout::<2>::POSITION, p, &place);
        }
        let given = Given::new(chunk, true);
        let mut all = Vec::new();
        for index in 0..36_u32 {
            let lower = [index % 6, index / 6].map(|i| 0.5 * f64::from(i));
            let found = given.in_box(&Aabb::new(lower, lower.map(|c| c + 0.5)));
            assert!(found.is_sorted());
            all.extend(found);
        }
        all.sort_unstable();
        assert_eq!(all, (0..500).collect::<Vec<u32>>());
    }
}
