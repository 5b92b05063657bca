//! Particles on their way between leaves: one record of 64-bit words each.
use rayon::prelude::*;

use crate::csr::Csr;
use crate::particle::chunk::{Chunk, Layout, TILE};

/// Words of one particle: a word for the way (where it goes), columns, identifier, tag, and columns of what
/// particles carry.
pub(super) const fn record_words<const D: usize>(carried: usize) -> usize {
    Layout::<D>::REALS + 3 + carried
}

/// Appends the record of particle `p`, with so many columns of what it carries.
pub(super) fn push_record<const D: usize>(
    records: &mut Vec<u64>,
    way: u64,
    chunk: &Chunk<D>,
    p: usize,
    carried: usize,
) {
    records.push(way);
    records.extend(chunk.tile_of(p).iter().map(|line| line[p % TILE].to_bits()));
    records.extend([chunk.ids()[p], chunk.tags()[p]]);
    records
        .extend((0..carried).map(|column| chunk.carried(column).get(p).map_or(0, |value| value.to_bits())));
}

/// Not collective. Appends each record to the chunk given with it; those of one chunk in the order given.
/// Chunks know their greatest half width afterwards.
pub(super) fn append_all<const D: usize>(chunks: &mut [Chunk<D>], arrivals: &[(u32, &[u64])]) {
    // Sorted, so that chunks can take theirs at the same time.
    let by_chunk = Csr::new(chunks.len(), arrivals.iter().copied());
    chunks.par_iter_mut().enumerate().with_min_len(32).for_each(|(number, chunk)| {
        for record in by_chunk.of(number) {
            if let Some((columns, [id, tag, carried @ ..])) = record[1..].split_at_checked(Layout::<D>::REALS)
            {
                chunk.push_words(columns, *id, *tag, carried);
            }
        }
        chunk.note_greatest_half();
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::particle::chunk::Tag;

    #[test]
    fn records_come_back_in_order() {
        let mut source = Chunk::<2>::new();
        for id in 0..20 {
            let p = source.push_zeroed(id, Tag { material: id as u16, body: 1, level: 2 });
            source.column_mut(Layout::<2>::MASS)[p] = id as f64;
        }
        source.carry(3);
        (0..20).for_each(|p| source.carried_mut(2)[p] = -(p as f64));
        let mut records = Vec::new();
        (0..20).rev().for_each(|p| push_record(&mut records, p as u64 % 3, &source, p, 3));
        let arrivals: Vec<(u32, &[u64])> =
            records.chunks_exact(record_words::<2>(3)).map(|record| (record[0] as u32, record)).collect();
        let mut chunks = vec![Chunk::<2>::new(); 4];
        append_all(&mut chunks, &arrivals);
        for (to, chunk) in chunks.iter().enumerate() {
            let expected: Vec<u64> = (0..20).rev().filter(|id| to < 3 && id % 3 == to as u64).collect();
            assert_eq!(chunk.ids(), expected);
            for (p, &id) in expected.iter().enumerate() {
                assert_eq!(chunk.column(Layout::<2>::MASS)[p], id as f64);
                assert_eq!(chunk.carried(2)[p], -(id as f64));
                let tag = Tag { material: id as u16, body: 1, level: 2 };
                assert_eq!(Tag::unpack(chunk.tags()[p]), tag);
            }
        }
    }
}
