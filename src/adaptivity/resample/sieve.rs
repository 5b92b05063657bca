//! A quick first look whether a key is one of a few.

/// Bits of a sieve.
const WORDS: usize = 64;

/// Holds some keys; of most others it is known at once that they are not among them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sieve {
    bits: [u64; WORDS],
}

impl Sieve {
    /// With these keys.
    pub fn of(keys: impl Iterator<Item = u64>) -> Self {
        let mut sieve = Self { bits: [0; WORDS] };
        for key in keys {
            let (word, bit) = place(key);
            sieve.bits[word] |= bit;
        }
        sieve
    }

    /// Whether the key may be one of them; true for all that are.
    pub fn may_hold(&self, key: u64) -> bool {
        let (word, bit) = place(key);
        self.bits[word] & bit != 0
    }
}

/// Word and bit of a key.
fn place(key: u64) -> (usize, u64) {
    let mixed = key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 52;
    ((mixed >> 6) as usize, 1 << (mixed & 63))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_its_keys_and_few_others() {
        let keys = (0..100_u64).map(|i| i * i * 7919 + 3);
        let sieve = Sieve::of(keys.clone());
        assert!(keys.clone().all(|key| sieve.may_hold(key)));
        let others = (0..10_000_u64).map(|i| i * 104_729 + (1 << 40));
        assert!(others.filter(|&key| sieve.may_hold(key)).count() < 500);
    }
}
