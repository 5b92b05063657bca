//! Sources: material that enters the domain during a run.
//!
//! A source adds particles in its shape, one layer after another. A layer has one particle in each line of
//! the lattice along the main axis of the velocity, where that line enters the shape. As long as a particle
//! is in the shape it moves with the velocity of the source, and the next layer enters once the one before
//! has moved by the distance between particles, or later where the mass rate is lower. So layers do not
//! overlap, whatever material is ahead, and the number of layers at any time depends on that time alone.
use crate::geometry::{Aabb, Shape};

/// A source of a job.
#[derive(Clone, Debug)]
pub struct Source<const D: usize> {
    /// Name; part of the names of its columns in the history.
    pub name: String,
    /// Where its material enters, m from the lower corner of the domain.
    pub shape: Shape<D>,
    /// Number of the body to which its particles belong.
    pub body: u16,
    /// Number of their material when they enter.
    pub material: u16,
    /// Level of the tree that they are made for.
    pub level: u8,
    /// Their distance, m.
    pub spacing: f64,
    /// Mass, kg, of the particles of a layer, by the lines of `entries`: rings have masses in proportion to
    /// their radii.
    pub masses: Vec<f64>,
    /// Half widths, m, of cubes (squares) of their volumes.
    pub halves: Vec<f64>,
    /// Velocity, m/s.
    pub velocity: [f64; D],
    /// Where the particles of a layer enter, m: by the lines of the lattice, in lexicographic order.
    pub entries: Vec<[f64; D]>,
    /// Time between layers, s.
    pub period: f64,
    /// Longest time that a particle takes through the shape, s.
    pub passage: f64,
    /// Time from which its own time is counted, s; infinite where it does not act.
    pub start: f64,
    /// Its own time at which the first layer enters, s.
    pub from: f64,
    /// Greatest number of particles that it feeds.
    pub total: u64,
}

/// Number of particles that a source feeds in a span of time (s), to the nearest.
pub fn particles_in(span: f64, period: f64, per_layer: usize) -> u64 {
    // Saturates, also where the span has no end.
    (span / period * per_layer as f64).round() as u64
}

impl<const D: usize> Source<D> {
    /// The axis along which a velocity is greatest.
    pub fn main_axis(velocity: &[f64; D]) -> usize {
        (1..D).fold(0, |axis, a| if velocity[a].abs() > velocity[axis].abs() { a } else { axis })
    }

    /// Where the particles of a layer enter a shape: on each line of the lattice along the main axis of the
    /// velocity the first point of the shape. `None` if there are more than `most` points to test.
    pub fn entries_of(
        shape: &Shape<D>,
        velocity: &[f64; D],
        size: &[f64; D],
        spacing: f64,
        most: f64,
    ) -> Option<Vec<[f64; D]>> {
        let axis = Self::main_axis(velocity);
        let bounds = shape.bounds().intersection(&Aabb::new([0.0; D], *size));
        // One more point on either side: the shape itself decides which points belong to it.
        let range: [(u64, u64); D] = std::array::from_fn(|a| {
            let place = |x: f64| (x / spacing - 0.5).max(0.0);
            (
                (place(bounds.lower[a]).floor() as u64).saturating_sub(1),
                place(bounds.upper[a]).ceil() as u64 + 2,
            )
        });
        if range.iter().map(|(first, end)| (end - first) as f64).product::<f64>() > most {
            return None;
        }
        let point = |index: &[u64; D]| index.map(|i| (i as f64 + 0.5) * spacing);
        let is_in = |x: &[f64; D]| shape.contains(x) && (0..D).all(|a| x[a] < size[a]);
        let mut entries = Vec::new();
        let mut index: [u64; D] = std::array::from_fn(|a| range[a].0);
        loop {
            let along = range[axis].0..range[axis].1;
            let first = |i: u64| {
                let mut index = index;
                index[axis] = i;
                Some(point(&index)).filter(is_in)
            };
            let found = match velocity[axis] > 0.0 {
                true => along.clone().find_map(first),
                false => along.rev().find_map(first),
            };
            entries.extend(found);
            // The next line: the last axis runs fastest.
            let mut a = D;
            loop {
                if a == 0 {
                    return Some(entries);
                }
                a -= 1;
                if a == axis {
                    continue;
                }
                index[a] += 1;
                if index[a] < range[a].1 {
                    break;
                }
                index[a] = range[a].0;
            }
        }
    }

    /// Greatest number of layers that it feeds; the last may be incomplete.
    fn layers(&self) -> u64 {
        self.total.div_ceil(self.entries.len().max(1) as u64)
    }

    /// Its own time at which a layer enters, s.
    fn own_time(&self, layer: u64) -> f64 {
        (layer as f64).mul_add(self.period, self.from)
    }

    /// Number of layers that enter before a time, s.
    pub fn layers_before(&self, time: f64) -> u64 {
        let own = time - self.start;
        // Also where it does not act: its own time then never begins.
        if own <= self.from {
            return 0;
        }
        let mut layers = (((own - self.from) / self.period).ceil() as u64).min(self.layers());
        while layers > 0 && self.own_time(layers - 1) >= own {
            layers -= 1;
        }
        while layers < self.layers() && self.own_time(layers) < own {
            layers += 1;
        }
        layers
    }

    /// Number of particles that enter before a time, s.
    pub fn particles_before(&self, time: f64) -> u64 {
        self.layers_before(time).saturating_mul(self.entries.len() as u64).min(self.total)
    }

    /// The first time (s) from a time on at which a layer enters; infinite if none does.
    pub fn next_layer(&self, time: f64) -> f64 {
        let layer = self.layers_before(time);
        if layer < self.layers() { self.start + self.own_time(layer) } else { f64::INFINITY }
    }

    /// Whether particles in its shape move with its velocity at a time, s.
    pub fn conveys(&self, time: f64) -> bool {
        let own = time - self.start;
        let last = self.own_time(self.layers()) + self.passage;
        self.from <= own && own <= last
    }

    /// Mass of a whole layer, kg.
    pub fn mass_of_layer(&self) -> f64 {
        self.masses.iter().sum()
    }

    /// Where the particles of a layer are at a time (s) after it has entered, m, with the numbers of their
    /// lines.
    pub fn layer(&self, layer: u64, time: f64) -> impl Iterator<Item = (usize, [f64; D])> + '_ {
        let way = time - self.start - self.own_time(layer);
        let all = self.entries.len() as u64;
        let count = self.total.saturating_sub(layer * all).min(all);
        let entries = self.entries.iter().zip(0..all);
        // The particles of an incomplete layer are spread over it.
        let chosen = entries.filter(move |(_, i)| (i + 1) * count / all > i * count / all);
        chosen.map(move |(entry, i)| {
            (i as usize, std::array::from_fn(|a| way.mul_add(self.velocity[a], entry[a])))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(velocity: [f64; 2], total: u64) -> Source<2> {
        let shape = Shape::Box(Aabb::new([1.0, 2.0], [1.5, 2.25]));
        let entries = Source::entries_of(&shape, &velocity, &[4.0, 4.0], 0.125, 1e6).unwrap();
        Source {
            name: "s".into(),
            shape,
            body: 0,
            material: 0,
            level: 0,
            spacing: 0.125,
            masses: vec![1.0; entries.len()],
            halves: vec![0.0625; entries.len()],
            velocity,
            entries,
            period: 0.1,
            passage: 0.2,
            start: 0.0,
            from: 0.5,
            total,
        }
    }

    /// Layers enter where the velocity leads into the shape, on the lattice of bodies.
    #[test]
    fn a_layer_enters_upstream() {
        let down = source([0.1, -1.0], 100);
        assert_eq!(down.entries, [1.0625, 1.1875, 1.3125, 1.4375].map(|x| [x, 2.1875]));
        assert_eq!(source([1.0, -0.1], 100).entries, [[1.0625, 2.0625], [1.0625, 2.1875]]);
        assert_eq!(source([0.0, 1.0], 100).entries[0], [1.0625, 2.0625]);
        let too_many = Source::entries_of(&down.shape, &[0.0, 1.0], &[4.0, 4.0], 1e-3, 1e4);
        assert!(too_many.is_none());
    }

    /// Each layer enters in the one step whose span contains its time, and all together have the particles of
    /// the source.
    #[test]
    fn layers_are_counted_by_time_alone() {
        let source = source([0.0, -1.0], 10);
        assert_eq!([0.0, 0.5, 0.55, 0.6, 0.65, 9.0].map(|t| source.layers_before(t)), [0, 0, 1, 1, 2, 3]);
        assert_eq!([0.0, 0.5, 0.55].map(|t| source.next_layer(t)), [0.5, 0.5, 0.6]);
        assert_eq!(source.next_layer(9.0), f64::INFINITY);
        assert_eq!([0, 1, 2].map(|layer| source.layer(layer, 0.8).count()), [4, 4, 2]);
        assert_eq!([0.5, 0.55, 0.65, 9.0].map(|t| source.particles_before(t)), [0, 4, 8, 10]);
        // The last two are spread over the layer, and it has moved since.
        let last: Vec<_> = source.layer(2, 0.75).map(|(_, x)| x).collect();
        assert_eq!(last.iter().map(|x| x[0]).collect::<Vec<_>>(), [1.1875, 1.4375]);
        assert!((last[0][1] - (2.1875 - 0.05)).abs() < 1e-15);
        assert!(!source.conveys(0.4) && source.conveys(0.5) && source.conveys(0.9) && !source.conveys(1.1));
        let never = Source { start: f64::INFINITY, ..source };
        assert_eq!((never.layers_before(1e9), never.next_layer(1e9)), (0, f64::INFINITY));
        assert!(!never.conveys(1e9));
    }

    #[test]
    fn the_mass_is_that_of_rate_and_time_to_a_particle() {
        assert_eq!(particles_in(1.0, 0.1, 4), 40);
        assert_eq!(particles_in(0.99, 0.1, 4), 40);
        assert_eq!(particles_in(0.98, 0.1, 4), 39);
        assert_eq!(particles_in(f64::INFINITY, 0.1, 4), u64::MAX);
    }
}
