//! Numbers of a frame as few bytes.
//!
//! Particles are sorted along a space-filling curve, so that neighbours in the file are neighbours in space
//! and differ little. Each column is a list of differences from number to number, modulo its range, with the
//! sign in the lowest bit, as planes of bytes: all lowest bytes, then all next ones. This form compresses
//! best.
use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::columns::{Column, LeafMaxima, Scale};
use crate::frame::{Frame, Leaves};

/// Steps of the half widths for each doubling.
pub(super) const STEPS_PER_DOUBLING: f64 = 16.0;

/// Columns of a frame: x, y, z (2 bytes each), half width (1), then the columns (2; identifiers 8).
pub(super) fn particles(frame: &Frame, columns: &[Column], scales: &[Scale], survey: &LeafMaxima) -> Vec<u8> {
    let (resolution, [low, _]) = (survey.resolution(), survey.bounds);
    let packed: Vec<[u16; 3]> = frame
        .positions
        .iter()
        .map(|p| std::array::from_fn(|axis| ((p[axis] - low[axis]) / resolution).round() as u16))
        .collect();
    let mut order: Vec<u32> = (0..packed.len() as u32).collect();
    order.sort_by_cached_key(|&i| along_curve(packed[i as usize]));
    let mut out = Vec::new();
    for axis in 0..3 {
        planes::<2>(&mut out, order.iter().map(|&i| u64::from(packed[i as usize][axis])));
    }
    let half_width = |&i: &u32| {
        let doublings = (frame.half_widths[i as usize] / survey.half_width).log2();
        (doublings * STEPS_PER_DOUBLING).round().clamp(0.0, 255.0) as u64
    };
    planes::<1>(&mut out, order.iter().map(half_width));
    for (column, scale) in columns.iter().zip(scales) {
        if let Some(ids) = column.ids(frame) {
            planes::<8>(&mut out, order.iter().map(|&i| ids[i as usize]));
            continue;
        }
        let values = column.values(frame);
        planes::<2>(&mut out, order.iter().map(|&i| u64::from(scale.level(values[i as usize]))));
    }
    out
}

/// Columns of a tree: level (1 byte), then the coordinates along the axes (4 each).
pub(super) fn leaves(leaves: &Leaves) -> Vec<u8> {
    let mut out = Vec::new();
    planes::<1>(&mut out, leaves.levels.iter().map(|&level| u64::from(level)));
    for axis in 0..3 {
        planes::<4>(&mut out, leaves.coords.iter().map(|coord| u64::from(coord[axis])));
    }
    out
}

/// Deflate in the format of zlib, which browsers decode.
pub(super) fn compress(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(7));
    // Writing to memory does not fail.
    encoder.write_all(bytes).and_then(|()| encoder.finish()).unwrap_or_default()
}

/// Appends a column of numbers of `BYTES` bytes.
fn planes<const BYTES: usize>(out: &mut Vec<u8>, values: impl Iterator<Item = u64>) {
    let unused = 64 - 8 * BYTES as u32;
    let mut before = 0_u64;
    let differences: Vec<u64> = values
        .map(|value| {
            // The difference modulo the range, as a signed number.
            let difference = (value.wrapping_sub(before) << unused).cast_signed() >> unused;
            before = value;
            ((difference << 1) ^ (difference >> 63)).cast_unsigned()
        })
        .collect();
    for byte in 0..BYTES {
        out.extend(differences.iter().map(|difference| (difference >> (8 * byte)) as u8));
    }
}

/// Morton key: the bits of the coordinates in turns.
fn along_curve(position: [u16; 3]) -> u64 {
    let spread = |value: u16| (0..16).fold(0, |key, bit| key | u64::from(value >> bit & 1) << (3 * bit));
    spread(position[0]) | spread(position[1]) << 1 | spread(position[2]) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decoding of a column, as the page does it.
    fn undo<const BYTES: usize>(bytes: &[u8]) -> Vec<u64> {
        let n = bytes.len() / BYTES;
        let mask = if BYTES == 8 { u64::MAX } else { (1 << (8 * BYTES)) - 1 };
        let mut value = 0_u64;
        (0..n)
            .map(|i| {
                let coded =
                    (0..BYTES).fold(0, |sum, byte| sum | u64::from(bytes[byte * n + i]) << (8 * byte));
                let difference = (coded >> 1).cast_signed() ^ -(coded & 1).cast_signed();
                value = value.wrapping_add(difference.cast_unsigned()) & mask;
                value
            })
            .collect()
    }

    #[test]
    fn columns_come_back_whatever_the_jumps() {
        fn check<const BYTES: usize>(values: &[u64]) {
            let mut bytes = Vec::new();
            planes::<BYTES>(&mut bytes, values.iter().copied());
            assert_eq!(bytes.len(), BYTES * values.len());
            assert_eq!(undo::<BYTES>(&bytes), values);
        }
        check::<1>(&[0, 255, 0, 1, 128, 3]);
        check::<2>(&[7, 65535, 0, 32768, 1, 65535, 40000]);
        check::<4>(&[0, u64::from(u32::MAX), 5, 1 << 31]);
        check::<8>(&[u64::MAX, 0, 1 << 63, 17]);
        check::<2>(&[]);
    }

    #[test]
    fn curve_visits_a_cube_before_it_goes_on() {
        let mut corners: Vec<[u16; 3]> = (0..64).map(|i| [i & 3, i >> 2 & 3, i >> 4]).collect();
        corners.sort_by_key(|&corner| along_curve(corner));
        assert!(corners[..8].iter().all(|corner| corner.iter().all(|&c| c < 2)));
        assert_eq!(along_curve([u16::MAX; 3]), (1 << 48) - 1);
    }
}
