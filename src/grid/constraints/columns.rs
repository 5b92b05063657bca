//! Which first moments constrained nodes have whose parents are constrained, and those that these pass through. The others
//! need none (`kernel/hanging.rs`).
//!
//! First moments are matrices, and what counts of their columns are those along axes on which a node's value comes from
//! nodes beside it: where its coordinate is odd, or where a constrained parent has that column.
use crate::grid::mask::bits;
use crate::kernel::Row;

/// First moments of one node: row `k` is column `k` of the matrix `A_j = Σ w m C` on the way from particles
/// to nodes, or of `V_j` on the way back. Lane 3 is zero, and so are columns that the node does not have.
pub type Moments<const D: usize> = [Row; D];

/// The columns that nodes of a block have, as sets of nodes by axis. They are kept node by node in the order of bits, those
/// of a node by axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Columns<const D: usize> {
    along: [u64; D],
}

impl<const D: usize> Columns<D> {
    /// No node has any.
    pub const NONE: Self = Self { along: [0; D] };

    /// From the set of nodes for each axis.
    pub fn new(along: [u64; D]) -> Self {
        Self { along }
    }

    /// The set of nodes for each axis.
    pub fn along(&self) -> [u64; D] {
        self.along
    }

    /// Gives a node the columns of some axes, a bit each.
    pub fn insert(&mut self, bit: u32, axes: u8) {
        for axis in 0..D {
            self.along[axis] |= u64::from(axes >> axis & 1) << bit;
        }
    }

    /// The columns of either.
    pub fn union(&self, other: &Self) -> Self {
        Self { along: std::array::from_fn(|axis| self.along[axis] | other.along[axis]) }
    }

    /// Those of some nodes.
    #[inline(always)]
    pub fn within(&self, nodes: u64) -> Self {
        Self { along: self.along.map(|along| along & nodes) }
    }

    /// Nodes that have any.
    #[inline(always)]
    pub fn nodes(&self) -> u64 {
        self.along.iter().fold(0, |all, along| all | along)
    }

    /// Number of columns.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.along.iter().map(|along| along.count_ones() as usize).sum()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.nodes() == 0
    }

    /// Axes of the columns of a node, a bit each.
    #[inline(always)]
    pub fn axes_of(&self, bit: u32) -> u8 {
        (0..D).fold(0, |axes, axis| axes | ((self.along[axis] >> bit & 1) as u8) << axis)
    }

    /// Number of the first column of a node, or of the nodes behind it.
    #[inline(always)]
    pub fn first_of(&self, bit: u32) -> usize {
        self.within((1 << bit) - 1).len()
    }

    /// All columns in order: node and axis.
    pub fn iter(self) -> impl Iterator<Item = (u32, usize)> {
        bits(self.nodes()).flat_map(move |bit| axes_in::<D>(self.axes_of(bit)).map(move |axis| (bit, axis)))
    }

    /// The columns of a node from `values`, which has those of all nodes.
    #[inline(always)]
    pub fn read(&self, values: &[Row], bit: u32) -> Moments<D> {
        let mut moments = [Row::default(); D];
        let own = &values[self.first_of(bit)..];
        axes_in::<D>(self.axes_of(bit)).zip(own).for_each(|(axis, from)| moments[axis] = *from);
        moments
    }

    /// Sets the columns that a node has in `values`, which has those of all nodes.
    #[inline(always)]
    pub fn write(&self, values: &mut [Row], bit: u32, moments: &Moments<D>) {
        let own = &mut values[self.first_of(bit)..];
        axes_in::<D>(self.axes_of(bit)).zip(own).for_each(|(axis, to)| *to = moments[axis]);
    }
}

/// The axes of a set that has a bit for each.
#[inline(always)]
pub fn axes_in<const D: usize>(set: u8) -> impl Iterator<Item = usize> {
    (0..D).filter(move |axis| set >> axis & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_kept_node_by_node() {
        let mut columns = Columns::<3>::NONE;
        assert!(columns.is_empty());
        columns.insert(5, 0b101);
        columns.insert(63, 0b010);
        columns.insert(2, 0b011);
        columns.insert(9, 0);
        assert_eq!(columns.len(), 5);
        assert_eq!(columns.nodes(), 1 << 2 | 1 << 5 | 1 << 63);
        assert_eq!(columns.iter().collect::<Vec<_>>(), [(2, 0), (2, 1), (5, 0), (5, 2), (63, 1)]);
        assert_eq!([2, 3, 5, 9, 63].map(|bit| columns.first_of(bit)), [0, 2, 2, 4, 4]);
        assert_eq!([2, 3, 5, 9, 63].map(|bit| columns.axes_of(bit)), [0b11, 0, 0b101, 0, 0b10]);
        let values: Vec<Row> = (1..6).map(|i| Row([f64::from(i); 4])).collect();
        let zero = Row::default();
        assert_eq!(columns.read(&values, 5), [values[2], zero, values[3]]);
        assert_eq!(columns.read(&values, 9), [zero; 3]);
        let mut changed = values.clone();
        columns.write(&mut changed, 5, &[values[0]; 3]);
        assert_eq!(changed, [0, 1, 0, 0, 4].map(|i| values[i]));
        let upper = columns.within(!0b111);
        assert_eq!((upper.len(), upper.first_of(63)), (3, 2));
        assert_eq!(upper.union(&columns), columns);
        assert_eq!(Columns::new(columns.along()), columns);
    }
}
