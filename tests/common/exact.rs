//! Weights from their definition in exact arithmetic: nothing is shared with the program but the format of
//! trees.
//!
//! Boxes have integer coordinates in units of `2^-45` root edges, so that every weight is an integer over the
//! volume of the box and a power of two.
use std::collections::BTreeMap;

use partition::Octant;

/// Units of length along a root edge, as a power of two: boxes of 1e-9 root edges have 4 digits, and all
/// coordinates are exact in double precision.
pub(crate) const UNIT: u32 = 45;
/// Spare binary digits for the fractions of constraints.
const SPARE: u32 = 64;

/// An integer of 512 bits in two's complement, lowest word first.
#[derive(Clone, Copy, Default, PartialEq)]
struct Whole([u64; 8]);

impl Whole {
    fn add(self, other: Self) -> Self {
        let mut carry = 0;
        Self(std::array::from_fn(|i| {
            let sum = u128::from(self.0[i]) + u128::from(other.0[i]) + carry;
            carry = sum >> 64;
            sum as u64
        }))
    }

    fn negative(self) -> Self {
        let one = Self(std::array::from_fn(|i| u64::from(i == 0)));
        Self(self.0.map(|word| !word)).add(one)
    }

    /// Times a number; the product must fit.
    fn times(self, factor: u64) -> Self {
        if self.is_negative() {
            return self.negative().times(factor).negative();
        }
        let mut carry = 0;
        let product = Self(std::array::from_fn(|i| {
            let product = u128::from(self.0[i]) * u128::from(factor) + carry;
            carry = product >> 64;
            product as u64
        }));
        assert!(carry == 0 && !product.is_negative(), "512 bits are not enough");
        product
    }

    fn times_power(self, power: u32) -> Self {
        (0..power / 32).fold(self, |x, _| x.times(1 << 32)).times(1 << (power % 32))
    }

    /// Half of an even number.
    fn halves(self, times: u32) -> Self {
        if self.is_negative() {
            return self.negative().halves(times).negative();
        }
        (0..times).fold(self, |x, _| {
            assert!(x.0[0] & 1 == 0, "the fraction has too many digits");
            Self(std::array::from_fn(|i| x.0[i] >> 1 | x.0.get(i + 1).map_or(0, |above| above << 63)))
        })
    }

    fn is_negative(self) -> bool {
        self.0[7] >> 63 == 1
    }

    /// Times `2^-power`, rounded.
    fn real(self, power: i32) -> f64 {
        if self.is_negative() {
            return -self.negative().real(power);
        }
        // Words from the lowest, so that what is rounded off is small.
        (0..8).map(|i| self.0[i] as f64 * 2f64.powi(64 * i as i32 - power)).sum()
    }
}

/// A box in units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnitBox<const D: usize> {
    pub centre: [u64; D],
    pub half: [u64; D],
}

impl<const D: usize> UnitBox<D> {
    /// Centre and half widths in root edges, exact.
    pub(crate) fn reals(&self) -> [[f64; D]; 2] {
        [self.centre, self.half].map(|list| list.map(|x| x as f64 * 2f64.powi(-(UNIT as i32))))
    }
}

/// Weight and gradient in root edges of each real node, by place on the lattice of `level`.
pub(crate) fn weights<const D: usize>(
    leaves: &[Octant<D>],
    level: u32,
    given: &UnitBox<D>,
) -> BTreeMap<[u64; D], (f64, [f64; D])> {
    let mut nodes: BTreeMap<[u64; D], Vec<Whole>> = BTreeMap::new();
    for leaf in leaves {
        let cell = 1u64 << (UNIT - 2 - u32::from(leaf.level));
        let along: [Vec<(u64, u64, u64)>; D] =
            std::array::from_fn(|a| overlaps(leaf.coord[a], cell, given.centre[a], given.half[a]));
        for mut index in 0..along.iter().map(Vec::len).product::<usize>() {
            let cut: [(u64, u64, u64); D] = std::array::from_fn(|a| {
                let chosen = along[a][index % along[a].len()];
                index /= along[a].len();
                chosen
            });
            for corner in 0..1u64 << D {
                let upper = |a: usize| corner >> a & 1;
                // Over twice the cell and the width of the box, along each axis.
                let hat = |a: usize| [2 * cell - cut[a].2, cut[a].2][upper(a) as usize];
                // Common power of two of cells of all sizes.
                let start = Whole([1, 0, 0, 0, 0, 0, 0, 0])
                    .times_power(SPARE + D as u32 * (1 + u32::from(leaf.level)));
                let mut sums = vec![(0..D).fold(start, |x, a| x.times(cut[a].1).times(hat(a)))];
                for k in 0..D {
                    let x =
                        (0..D).fold(start, |x, a| x.times(cut[a].1).times(if a == k { 2 } else { hat(a) }));
                    sums.push(if upper(k) == 0 { x.negative() } else { x });
                }
                let place = std::array::from_fn(|a| (cut[a].0 + upper(a) * cell) >> (UNIT - level));
                hand_on(leaves, level, place, &sums, &mut nodes);
            }
        }
    }
    let power = (D as u32 * UNIT + SPARE) as i32;
    let volume: f64 = given.half.iter().map(|&half| 2.0 * half as f64).product();
    let real = |sums: Vec<Whole>| {
        let gradient = std::array::from_fn(|k| sums[k + 1].real(power - UNIT as i32) / volume);
        (sums[0].real(power) / volume, gradient)
    };
    nodes.into_iter().map(|(place, sums)| (place, real(sums))).collect()
}

/// Cells of a leaf that a box overlaps along one axis: lower corner, length, and twice the middle above that
/// corner.
fn overlaps(leaf: u32, cell: u64, centre: u64, half: u64) -> Vec<(u64, u64, u64)> {
    let cells = (0..4).map(|i| (4 * u64::from(leaf) + i) * cell);
    let cut = cells.filter_map(|lower| {
        let (low, high) = ((centre - half).max(lower), (centre + half).min(lower + cell));
        (low < high).then(|| (lower, high - low, low + high - 2 * lower))
    });
    cut.collect()
}

/// Adds to a real node; from any other node all goes to the corners of the coarsest cell on which it hangs.
fn hand_on<const D: usize>(
    leaves: &[Octant<D>],
    level: u32,
    place: [u64; D],
    sums: &[Whole],
    nodes: &mut BTreeMap<[u64; D], Vec<Whole>>,
) {
    let touches = |leaf: &&Octant<D>| {
        let edge = 4u64 << (level - 2 - u32::from(leaf.level));
        (0..D).all(|a| {
            let lower = u64::from(leaf.coord[a]) * edge;
            (lower..=lower + edge).contains(&place[a])
        })
    };
    let cell_of = |leaf: &Octant<D>| 1u64 << (level - 2 - u32::from(leaf.level));
    let hangs_on =
        leaves.iter().filter(touches).map(cell_of).filter(|cell| place.iter().any(|x| x % cell != 0));
    let Some(cell) = hangs_on.max() else {
        let node = nodes.entry(place).or_insert_with(|| vec![Whole::default(); D + 1]);
        node.iter_mut().zip(sums).for_each(|(sum, share)| *sum = sum.add(*share));
        return;
    };
    for corner in 0..1u64 << D {
        let upper = |a: usize| corner >> a & 1 == 1;
        if (0..D).any(|a| upper(a) && place[a].is_multiple_of(cell)) {
            continue;
        }
        let share = |a: usize| if upper(a) { place[a] % cell } else { cell - place[a] % cell };
        let parts: Vec<Whole> = sums
            .iter()
            .map(|sum| (0..D).fold(*sum, |x, a| x.times(share(a)).halves(cell.trailing_zeros())))
            .collect();
        let to = std::array::from_fn(|a| place[a] - place[a] % cell + if upper(a) { cell } else { 0 });
        hand_on(leaves, level, to, &parts, nodes);
    }
}
