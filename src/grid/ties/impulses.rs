//! The ties of a velocity field, and their impulses.
use rayon::prelude::*;

use crate::grid::sums::node_fields::NodeFields;

/// A corner of a tied node.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// Number of its row.
    pub node: usize,
    /// P_r.
    pub weight: f64,
    /// `|P_r| S_r`.
    share: f64,
}

impl Corner {
    pub(super) fn new(node: usize, weight: f64) -> Self {
        Self { node, weight, share: 0.0 }
    }
}

/// A node that is tied.
#[derive(Clone, Copy, Debug)]
struct Tie {
    node: usize,
    /// First of its corners.
    first: usize,
}

/// Ties of a block or of a velocity field.
#[derive(Clone, Debug, Default)]
pub struct Tied {
    /// Block by block.
    ties: Vec<Tie>,
    /// Tie by tie.
    corners: Vec<Corner>,
}

impl Tied {
    /// Heap bytes held.
    pub(super) fn heap_bytes(&self) -> usize {
        size_of_val(&self.ties[..]) + size_of_val(&self.corners[..])
    }

    /// Forgets all ties.
    pub(super) fn clear(&mut self) {
        self.ties.clear();
        self.corners.clear();
    }

    /// Adds a tie.
    pub(super) fn push(&mut self, node: usize, corners: impl Iterator<Item = Corner>) {
        self.ties.push(Tie { node, first: self.corners.len() });
        self.corners.extend(corners);
    }

    /// Adds the ties of a block.
    pub(super) fn extend(&mut self, block: &Self) {
        let before = self.corners.len();
        self.ties.extend(block.ties.iter().map(|tie| Tie { first: before + tie.first, ..*tie }));
        self.corners.extend_from_slice(&block.corners);
    }

    /// Each tied node with its corners, in the order of their places.
    pub fn iter(&self) -> impl IndexedParallelIterator<Item = (usize, &[Corner])> {
        (0..self.ties.len()).into_par_iter().with_min_len(256).map(|number| self.get(number))
    }

    /// Finds what each corner bears of all ties. `sums` is zero for all rows, before and after.
    pub(super) fn share_out(&mut self, sums: &mut [f64]) {
        self.corners.iter().for_each(|corner| sums[corner.node] += corner.weight.abs());
        self.corners.iter_mut().for_each(|corner| corner.share = corner.weight.abs() * sums[corner.node]);
        self.corners.iter().for_each(|corner| sums[corner.node] = 0.0);
    }

    fn get(&self, number: usize) -> (usize, &[Corner]) {
        let Tie { node, first } = self.ties[number];
        let end = self.ties.get(number + 1).map_or(self.corners.len(), |next| next.first);
        (node, &self.corners[first..end])
    }

    /// Applies the impulses of a sweep to the nodes, whose rows hold velocities and masses.
    pub(super) fn pull<const D: usize>(&self, fields: &mut NodeFields<D>) {
        let rows = &mut fields.rows;
        let impulses: Vec<[f64; D]> = self
            .iter()
            .map(|(node, corners)| {
                let own = &rows[node].0;
                let (mut compliance, mut plane) = (1.0 / own[3], [0.0; D]);
                for Corner { node, weight, share } in corners {
                    let row = &rows[*node].0;
                    compliance += share / row[3];
                    (0..D).for_each(|a| plane[a] = weight.mul_add(row[a], plane[a]));
                }
                let inertia = 1.0 / compliance;
                std::array::from_fn(|a| inertia * (plane[a] - own[a]))
            })
            .collect();
        // In the order of the ties, which is that of their places, on any ranks.
        for (number, impulse) in impulses.iter().enumerate() {
            let (node, corners) = self.get(number);
            push(&mut rows[node].0, impulse, 1.0);
            corners.iter().for_each(|corner| push(&mut rows[corner.node].0, impulse, -corner.weight));
        }
    }
}

/// Changes the velocity of a node, `(v, m)`, by a share of an impulse.
#[inline(always)]
fn push<const D: usize>(row: &mut [f64; 4], impulse: &[f64; D], share: f64) {
    let factor = share / row[3];
    for axis in 0..D {
        row[axis] = factor.mul_add(impulse[axis], row[axis]);
    }
}
