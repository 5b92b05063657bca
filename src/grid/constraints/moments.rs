//! First moments of constrained nodes whose parents are constrained, and of those parents. Other nodes need
//! none (`kernel/hanging.rs`).
//!
//! Which nodes of a block have them is a set with a bit each; they are kept node by node in the order of
//! bits.
use crate::kernel::Row;

/// First moments of one node: row `k` is column `k` of the matrix `A_j = Σ w m C` on the way from particles
/// to nodes, or of `V_j` on the way back. Lane 3 is zero.
pub type Moments<const D: usize> = [Row; D];

/// Rows that the moments of a set of nodes take.
#[inline(always)]
pub fn rows_of<const D: usize>(nodes: u64) -> usize {
    D * nodes.count_ones() as usize
}

/// First row of a node in a set, or of the nodes behind it.
#[inline(always)]
pub fn first_row<const D: usize>(nodes: u64, bit: u32) -> usize {
    rows_of::<D>(nodes & ((1 << bit) - 1))
}

/// The moments of a node from those of a set; zero if it is not among them.
#[inline(always)]
pub fn read<const D: usize>(values: &[Row], nodes: u64, bit: u32) -> Moments<D> {
    let own = &values[first_row::<D>(nodes, bit)..];
    match (nodes >> bit & 1, own.first_chunk()) {
        (1, Some(moments)) => *moments,
        _ => [Row::default(); D],
    }
}

/// Writes the moments of a node in a set.
#[inline(always)]
pub fn write<const D: usize>(values: &mut [Row], nodes: u64, bit: u32, moments: &Moments<D>) {
    values[first_row::<D>(nodes, bit)..][..D].copy_from_slice(moments);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_kept_node_by_node() {
        let nodes = 1 << 2 | 1 << 5 | 1 << 63;
        assert_eq!(rows_of::<3>(nodes), 9);
        assert_eq!([2, 3, 5, 9, 63].map(|bit| first_row::<3>(nodes, bit)), [0, 3, 3, 6, 6]);
        let mut values: Vec<Row> = (1..10).map(|i| Row([f64::from(i); 4])).collect();
        assert_eq!(read::<3>(&values, nodes, 5), values[3..6]);
        assert_eq!(read::<3>(&values, nodes, 9), [Row::default(); 3]);
        let zero = [Row::default(); 3];
        write::<3>(&mut values, nodes, 63, &zero);
        assert_eq!((read::<3>(&values, nodes, 63), values[5]), (zero, Row([6.0; 4])));
    }
}
