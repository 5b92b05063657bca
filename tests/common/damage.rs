//! Files that something has damaged.

/// Some bytes flipped, cut, overwritten or doubled.
pub(crate) fn damage(bytes: &[u8], next: &mut impl FnMut(usize) -> usize) -> Vec<u8> {
    let mut damaged = bytes.to_vec();
    for _ in 0..=next(3) {
        let at = next(damaged.len());
        match next(5) {
            0 => damaged[at] ^= 1 << next(8),
            1 => damaged.truncate(at.max(1)),
            2 => damaged[at] = b"0123456789-.e \n"[next(15)],
            3 => damaged[at] = 0xff,
            _ => damaged.extend_from_within(at..),
        }
    }
    damaged
}
