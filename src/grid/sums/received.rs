//! Sums of other ranks.
use crate::grid::constraints::moments::{self, Moments, rows_of};
use crate::grid::plan::GridPlan;
use crate::grid::plan::pieces::Piece;
use crate::kernel::Row;

const ZERO: Row = Row([0.0; 4]);

/// Partial sums of other ranks.
#[derive(Debug, Default)]
pub struct ReceivedSums<const D: usize> {
    rows: Vec<Row>,
    moments: Vec<Row>,
    pieces: Vec<Place>,
    /// Nodes of each piece that have values.
    touched: Vec<u64>,
}

/// Where a received piece is kept.
#[derive(Clone, Copy, Debug)]
struct Place {
    nodes: u64,
    with_moments: u64,
    first_row: usize,
    first_moment: usize,
}

/// Nodes of a piece that a message has values of; two bits.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Extent {
    /// No particle touches it.
    None = 0,
    /// All nodes are there.
    All = 1,
    /// A mask of the nodes comes first.
    Some = 2,
}

/// Pieces that one task adds up.
pub(super) const TASK: usize = 16;

impl<const D: usize> ReceivedSums<D> {
    pub(super) fn new(plan: &GridPlan<D>) -> Self {
        let (mut rows, mut moments) = (0, 0);
        let place = |piece: &Piece| {
            let (first_row, first_moment) = (rows, moments);
            rows += piece.nodes.count_ones() as usize;
            moments += rows_of::<D>(piece.with_moments);
            Place { nodes: piece.nodes, with_moments: piece.with_moments, first_row, first_moment }
        };
        let pieces: Vec<Place> = plan.pieces.iter().map(place).collect();
        Self { rows: vec![ZERO; rows], moments: vec![ZERO; moments], touched: vec![0; pieces.len()], pieces }
    }

    /// Nodes of a piece that have values in this step.
    pub(in crate::grid) fn touched(&self, piece: u32) -> u64 {
        self.touched[piece as usize]
    }

    /// Momentum and mass that a piece adds to a node.
    pub(in crate::grid) fn row(&self, piece: u32, bit: u32) -> Row {
        let touched = self.touched[piece as usize];
        if touched >> bit & 1 == 0 {
            return ZERO;
        }
        let before = touched & ((1 << bit) - 1);
        self.rows[self.pieces[piece as usize].first_row + before.count_ones() as usize]
    }

    /// First moments that it adds to a node.
    pub(in crate::grid) fn moments(&self, piece: u32, bit: u32) -> Moments<D> {
        let (place, touched) = (&self.pieces[piece as usize], self.touched[piece as usize]);
        moments::read(&self.moments[place.first_moment..], place.with_moments & touched, bit)
    }

    pub(super) fn unpack(&mut self, message: &[u8], pieces: std::ops::Range<usize>) {
        let (extents, values) = message.split_at(pieces.len().div_ceil(TASK) * 2 * TASK / 8);
        let mut values = Values(values);
        for (number, piece) in pieces.enumerate() {
            let place = &self.pieces[piece];
            let extent = extents[number / 4] >> (2 * (number % 4)) & 3;
            let touched = match extent {
                extent if extent == Extent::None as u8 => 0,
                extent if extent == Extent::All as u8 => place.nodes,
                _ => values.take::<1>()[0].to_bits() & place.nodes,
            };
            self.touched[piece] = touched;
            for row in &mut self.rows[place.first_row..][..touched.count_ones() as usize] {
                *row = if D == 3 {
                    Row(values.take())
                } else {
                    let [x, y, mass] = values.take();
                    Row([x, y, 0.0, mass])
                };
            }
            let moments = rows_of::<D>(place.with_moments & touched);
            for row in &mut self.moments[place.first_moment..][..moments] {
                row.0[..D].copy_from_slice(&values.take::<D>());
            }
        }
    }
}

/// Rest of the numbers of a message.
struct Values<'a>(&'a [u8]);

impl Values<'_> {
    /// The next `N` numbers; NaN behind the end.
    #[inline(always)]
    fn take<const N: usize>(&mut self) -> [f64; N] {
        let Some((next, rest)) = self.0.split_at_checked(8 * N) else { return [f64::NAN; N] };
        self.0 = rest;
        let mut values = [0.0; N];
        bytemuck::cast_slice_mut(&mut values).copy_from_slice(next);
        values
    }
}
