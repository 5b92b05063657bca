//! Places of the particles of a body in the cells of their lattice.
//!
//! Each point of the lattice has one particle. Its place depends on the indices in the lattice alone, so that
//! it is the same on any ranks: jitter comes from a hash of it (splitmix64, Steele, Lea and Flood 2014), blue
//! noise from a tile that fills space.
//!
//! The tile is made once: points of a jittered lattice that repel each other over the distance of particles,
//! as soft balls do, across the faces of the tile as well. The result is dense, and without order beyond
//! neighbours. No point leaves its leaf, so that each leaf has as many as on the lattice.
use std::sync::Arc;

/// Greatest jitter along each axis, as a share of the distance of particles.
const JITTER: f64 = 0.35;

/// The same of the points from which a tile starts: they keep no order of the lattice.
const LOOSE: f64 = 1.0;

/// Rounds in which the points of a tile move apart.
const ROUNDS: usize = 30;

/// Distance up to which points repel each other, in distances of particles: a little more than dense packings
/// have.
const REPULSION: f64 = 1.2;

/// Share of an overlap that a round removes.
const STIFFNESS: f64 = 0.2;

/// Most points of a tile along an edge, unless a leaf has more.
const fn longest(d: usize) -> usize {
    if d == 2 { 32 } else { 16 }
}

/// Arrangement of the particles of a body.
#[derive(Clone, Debug, Default)]
pub enum Sampling<const D: usize> {
    /// On the lattice.
    #[default]
    Lattice,
    /// On the lattice; parts of its boxes at the surface of the body.
    Fitted,
    /// At random about the points of the lattice, by a seed.
    Jittered(u64),
    /// As blue noise.
    Poisson(Arc<Tile<D>>),
}

/// Displacements of points from their places in the lattice, in distances of particles, over a box that
/// repeats.
#[derive(Debug)]
pub struct Tile<const D: usize> {
    edge: usize,
    ways: Vec<[f64; D]>,
}

impl<const D: usize> Sampling<D> {
    /// Blue noise for leaves with so many points along an edge, by a seed.
    pub fn poisson(along_leaf: usize, seed: u64) -> Self {
        Self::Poisson(Arc::new(Tile::new(along_leaf, seed)))
    }

    /// Displacement from a point of the lattice to its particle, in distances of particles; leaves of
    /// different levels have lattices of their own.
    pub fn way(&self, index: &[u64; D], level: u8) -> [f64; D] {
        match self {
            Self::Lattice | Self::Fitted => [0.0; D],
            Self::Jittered(seed) => {
                let first = u64::from(level) ^ start_of(*seed);
                let seed = index.iter().fold(first, |seed, &i| mixed(seed ^ i));
                std::array::from_fn(|a| JITTER * part(mixed(seed.wrapping_add(a as u64))))
            }
            Self::Poisson(tile) => tile.ways[tile.number(&index.map(|i| (i % tile.edge as u64) as usize))],
        }
    }
}

impl<const D: usize> Tile<D> {
    /// For leaves with so many points along an edge, by a seed.
    fn new(along_leaf: usize, seed: u64) -> Self {
        let leaves = (longest(D) / along_leaf.max(1)).clamp(1, 4);
        let edge = along_leaf * leaves;
        let mut tile = Self { edge, ways: Vec::new() };
        let cells = edge.pow(D as u32);
        let lattice: Vec<[f64; D]> =
            (0..cells).map(|cell| tile.place(cell).map(|i| i as f64 + 0.5)).collect();
        let leaf = along_leaf as f64;
        let start = |cell: usize, a: usize| {
            let x = LOOSE.mul_add(part(mixed((cell * D + a) as u64 ^ start_of(seed))), lattice[cell][a]);
            // A point beyond its leaf is reflected at the face.
            let first = (lattice[cell][a] / leaf).floor() * leaf;
            let inside = (x - first).abs();
            first + if inside > leaf { 2.0 * leaf - inside } else { inside }
        };
        let mut points: Vec<[f64; D]> =
            (0..cells).map(|cell| std::array::from_fn(|a| start(cell, a))).collect();
        for _ in 0..ROUNDS {
            points = tile.apart(&points, &lattice, leaf);
        }
        tile.ways = (0..cells).map(|c| std::array::from_fn(|a| points[c][a] - lattice[c][a])).collect();
        tile
    }

    /// The points after a round.
    fn apart(&self, points: &[[f64; D]], lattice: &[[f64; D]], leaf: f64) -> Vec<[f64; D]> {
        let edge = self.edge as f64;
        // Which points lie in each cell now.
        let mut cells: Vec<Vec<u32>> = vec![Vec::new(); points.len()];
        let cell_of = |x: &[f64; D]| x.map(|c| (c as usize).min(self.edge - 1));
        for (number, x) in points.iter().enumerate() {
            cells[self.number(&cell_of(x))].push(number as u32);
        }
        let around = 5_usize.pow(D as u32);
        let moved = |number: usize| {
            let (x, own) = (&points[number], cell_of(&points[number]));
            let mut push = [0.0; D];
            for mut offset in 0..around {
                let cell = std::array::from_fn(|a| {
                    let step = offset % 5;
                    offset /= 5;
                    (own[a] + self.edge + step - 2) % self.edge
                });
                for &other in &cells[self.number(&cell)] {
                    let way: [f64; D] = std::array::from_fn(|a| {
                        let way = x[a] - points[other as usize][a];
                        // The nearest of its images.
                        if way > 0.5 * edge {
                            way - edge
                        } else if way < -0.5 * edge {
                            way + edge
                        } else {
                            way
                        }
                    });
                    let distance = way.iter().map(|c| c * c).sum::<f64>().sqrt();
                    if distance > 0.0 && distance < REPULSION {
                        let share = STIFFNESS * (REPULSION - distance) / distance;
                        (0..D).for_each(|a| push[a] += share * way[a]);
                    }
                }
            }
            std::array::from_fn(|a| {
                let first = (lattice[number][a] / leaf).floor() * leaf;
                (x[a] + push[a]).clamp(first + 1e-3, first + leaf - 1e-3)
            })
        };
        (0..points.len()).map(moved).collect()
    }

    /// Place of a cell by its number, the first axis fastest.
    fn place(&self, mut cell: usize) -> [usize; D] {
        std::array::from_fn(|_| {
            let place = cell % self.edge;
            cell /= self.edge;
            place
        })
    }

    fn number(&self, place: &[usize; D]) -> usize {
        place.iter().rev().fold(0, |number, place| number * self.edge + place)
    }
}

/// Change that a seed makes to the numbers that are mixed: none if it is 0, the default.
fn start_of(seed: u64) -> u64 {
    if seed == 0 { 0 } else { mixed(seed) }
}

/// A number whose bits depend on all of the bits of another.
fn mixed(word: u64) -> u64 {
    let mut z = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number from -1 to 1.
fn part(word: u64) -> f64 {
    (word >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance of each point to its nearest neighbour, in distances of particles, for the points of some
    /// leaves.
    fn nearest<const D: usize>(sampling: &Sampling<D>, edge: u64) -> Vec<f64> {
        let place = |mut cell: u64| -> [u64; D] {
            std::array::from_fn(|_| {
                let place = cell % edge;
                cell /= edge;
                place
            })
        };
        let point = |index: &[u64; D]| -> [f64; D] {
            let way = sampling.way(index, 3);
            std::array::from_fn(|a| index[a] as f64 + 0.5 + way[a])
        };
        let all: Vec<[f64; D]> = (0..edge.pow(D as u32)).map(|cell| point(&place(cell))).collect();
        let distance = |x: &[f64; D], y: &[f64; D]| (0..D).map(|a| (x[a] - y[a]).powi(2)).sum::<f64>().sqrt();
        let least = |x: &[f64; D]| {
            all.iter().filter(|y| *y != x).map(|y| distance(x, y)).fold(f64::INFINITY, f64::min)
        };
        all.iter().map(least).collect()
    }

    /// No two points are much closer than on the lattice, also across the faces of leaves, and each leaf has
    /// all of its own.
    #[test]
    fn blue_noise_keeps_its_distance() {
        let (plane, space) = (Sampling::<2>::poisson(8, 0), Sampling::<3>::poisson(8, 3));
        for (found, least) in [(nearest(&plane, 40), 0.7), (nearest(&space, 16), 0.7)] {
            let worst = found.iter().copied().fold(f64::INFINITY, f64::min);
            let mean = found.iter().sum::<f64>() / found.len() as f64;
            println!("least distance {worst:.3}, mean {mean:.3}");
            assert!(worst > least && mean > 0.85, "{worst} {mean}");
        }
        let jittered = nearest(&Sampling::<2>::Jittered(0), 40).into_iter().fold(f64::INFINITY, f64::min);
        assert!(jittered < 0.7, "{jittered}");
        for (i, j) in (0..64).flat_map(|i| (0..64).map(move |j| (i, j))) {
            let way = plane.way(&[i, j], 0);
            for (index, way) in [i, j].into_iter().zip(way) {
                let x = index as f64 + 0.5 + way;
                assert_eq!((x / 8.0) as u64, index / 8);
            }
        }
    }

    #[test]
    fn seeds_give_other_places() {
        let of: [fn(u64) -> Sampling<2>; 2] = [|seed| Sampling::poisson(8, seed), Sampling::Jittered];
        for sampling in of {
            let places = |seed: u64| -> Vec<[f64; 2]> {
                let sampling = sampling(seed);
                (0..64).map(|i| sampling.way(&[i % 8, i / 8], 2)).collect()
            };
            assert_eq!(places(7), places(7));
            let [none, first, second] = [0, 1, 2].map(places);
            for (i, way) in none.iter().enumerate() {
                assert!(*way != first[i] && *way != second[i] && first[i] != second[i]);
            }
        }
    }

    /// There is no order beyond neighbours: the structure factor along the axes of the lattice, N for a
    /// lattice, stays below 3.
    #[test]
    fn blue_noise_has_no_planes() {
        let sampling = Sampling::<2>::poisson(8, 0);
        for direction in [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]] {
            let (mut real, mut imaginary, mut points) = (0.0_f64, 0.0_f64, 0.0);
            for (i, j) in (0..32).flat_map(|i| (0..32).map(move |j| (i, j))) {
                let way = sampling.way(&[i, j], 0);
                let x = direction[0] * (i as f64 + way[0]) + direction[1] * (j as f64 + way[1]);
                let phase = std::f64::consts::TAU * x;
                (real, imaginary, points) = (real + phase.cos(), imaginary + phase.sin(), points + 1.0);
            }
            let factor = (real * real + imaginary * imaginary) / points;
            println!("structure factor along {direction:?}: {factor:.2} of {points}");
            assert!(factor < 0.05 * points, "{direction:?}: {factor}");
        }
    }
}
