//! How often a particle has been halved along each axis.
//!
//! Elastic particles that are stretched become two, along one axis (see `adaptivity/resample/halve.rs`). What
//! belongs to a half is not a cube: its undeformed box has `2^-n_a` times the width of the particle from
//! which it came along each axis a, after `n_a` halvings. As the half width of a chunk is that of a cube of
//! the same volume, `l = l₀ 2^-(n/D)` with n the sum of all `n_a`, that is
//! `l 2^(n/D - n_a)`. The numbers are nine bits of the packed tag, and zero for all particles that have
//! not been halved.
use super::layout::Tag;

/// Lowest bit of the numbers in a packed tag: above those of [`Tag`] and of tries to merge.
const SHIFT: u32 = 48;
/// Bits of each number, which is at most that of the splits that an identifier has room for.
const BITS: u32 = 3;
/// Lowest of the bits, one for each split from the oldest on, that say which of them were halvings.
const SPLITS: u32 = SHIFT + 3 * BITS;
/// All bits of the numbers.
const NUMBERS: u64 = ((1 << (3 * BITS)) - 1) << SHIFT;
/// All bits.
const ALL: u64 = 0xffff << SHIFT;

/// Powers of the square root and the cube root of two below two.
const ROOTS: [&[f64]; 2] =
    [&[1.0, std::f64::consts::SQRT_2], &[1.0, 1.259_921_049_894_873_2, 1.587_401_051_968_199_5]];

/// Whether any particle with these packed tags has been halved.
pub fn is_any(tags: impl IntoIterator<Item = u64>) -> bool {
    tags.into_iter().fold(0, |all, tag| all | tag) & NUMBERS != 0
}

/// Halvings along an axis.
pub fn along(tag: u64, axis: usize) -> u32 {
    (tag >> (SHIFT + BITS * axis as u32)) as u32 & ((1 << BITS) - 1)
}

/// Halvings along all axes.
pub fn number<const D: usize>(tag: u64) -> u32 {
    (0..D).map(|axis| along(tag, axis)).sum()
}

/// The packed tag of a half; it is one of generation `split` + 1.
pub fn halved(tag: u64, axis: usize, split: u32) -> u64 {
    (tag | 1 << (SPLITS + split)) + (1 << (SHIFT + BITS * axis as u32))
}

/// The packed tag of what two halves of generation `split` + 1 become.
pub fn rejoined(tag: u64, axis: usize, split: u32) -> u64 {
    otherwise_split(tag, split) - (1 << (SHIFT + BITS * axis as u32))
}

/// The packed tag of a particle of generation `split` + 1 that is no half.
pub fn otherwise_split(tag: u64, split: u32) -> u64 {
    tag & !(1 << (SPLITS + split))
}

/// Whether a particle with this packed tag is a half, where it is of generation `split` + 1.
pub fn is_half(tag: u64, split: u32) -> bool {
    tag >> (SPLITS + split) & 1 == 1
}

/// Another tag for a particle with a packed one; halvings stay.
pub fn with(packed: u64, tag: Tag) -> u64 {
    tag.pack() | packed & ALL
}

/// `2^(n/D)`: edge of a cube before n halvings over that of one of equal volume after them.
pub fn edge_of_whole<const D: usize>(number: u32) -> f64 {
    let roots = ROOTS[usize::from(D > 2)];
    f64::from(1_u32 << (number as usize / D)) * roots[number as usize % D]
}

/// Width of the undeformed box along each axis over that of a cube of its volume.
pub fn shape<const D: usize>(tag: u64) -> [f64; D] {
    let whole = edge_of_whole::<D>(number::<D>(tag));
    std::array::from_fn(|axis| whole / f64::from(1_u32 << along(tag, axis)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Halved in any order, a box keeps its edges but for the halved ones, and its volume is half each time.
    fn boxes_of_halves<const D: usize>() {
        let tag = Tag { material: 65_535, body: 3, level: 255 };
        let (mut packed, mut edges, mut half) = (tag.pack(), [1.0; D], 1.0);
        for step in 0..7 {
            let axis = (step * step + 1) % D;
            let before = packed;
            packed = halved(packed, axis, step as u32);
            edges[axis] *= 0.5;
            half /= edge_of_whole::<D>(1);
            let shape = shape::<D>(packed);
            for (edge, shape) in edges.iter().zip(shape) {
                approx::assert_relative_eq!(half * shape, *edge, max_relative = 4e-15);
            }
            assert_eq!(number::<D>(packed), step as u32 + 1);
            assert_eq!((Tag::unpack(packed), with(packed, tag)), (tag, packed));
            assert!(is_half(packed, step as u32) && !is_half(before, step as u32));
            assert_eq!(rejoined(packed, axis, step as u32), before);
            assert!(!is_half(otherwise_split(packed, step as u32), step as u32));
            assert!(is_any([tag.pack(), packed]) && !is_any([tag.pack()]));
        }
    }

    #[test]
    fn boxes_of_halves_are_halves_of_boxes() {
        boxes_of_halves::<2>();
        boxes_of_halves::<3>();
    }
}
