//! Reductions, gathers of a few scalars and broadcasts. Sums are over integers only, so that no
//! result depends on the number of ranks or on the order in which MPI combines them.

use super::Comm;
use super::library::Operation;

impl Comm {
    /// Collective. Smallest value over all ranks. Exact; NaN if any rank has NaN.
    pub fn min_f64(&self, value: f64) -> f64 {
        let mut values = [value];
        self.min_f64s(&mut values);
        values[0]
    }

    /// Collective. Largest value over all ranks. Exact; NaN if any rank has NaN.
    pub fn max_f64(&self, value: f64) -> f64 {
        let mut values = [value];
        self.max_f64s(&mut values);
        values[0]
    }

    /// Collective. [`Comm::min_f64`] of each entry; all ranks give the same number of entries.
    pub fn min_f64s(&self, values: &mut [f64]) {
        values.iter_mut().for_each(|v| *v = -*v);
        self.max_f64s(values);
        values.iter_mut().for_each(|v| *v = -*v);
    }

    /// Collective. [`Comm::max_f64`] of each entry; all ranks give the same number of entries.
    pub fn max_f64s(&self, values: &mut [f64]) {
        // MPI leaves the order of -0 and 0 and the meaning of NaN open, so integers are compared.
        let keys: Vec<i64> = values.iter().map(|&v| order_key(v)).collect();
        let keys = self.all().reduce(&keys, Operation::Largest);
        for (value, key) in values.iter_mut().zip(keys) {
            *value = from_order_key(key);
        }
    }

    /// Collective. Sum of each entry; all ranks give the same number of entries.
    ///
    /// # Panics
    /// If a sum exceeds 64 bits.
    pub fn sum_u64(&self, values: &mut [u64]) {
        let halves: Vec<u64> = values.iter().flat_map(|&v| [v >> 32, v & 0xffff_ffff]).collect();
        let halves = self.all().reduce(&halves, Operation::Sum);
        for (value, half) in values.iter_mut().zip(halves.chunks_exact(2)) {
            let sum = (u128::from(half[0]) << 32) + u128::from(half[1]);
            *value = u64::try_from(sum).expect("a sum over ranks exceeds 64 bits");
        }
    }

    /// Collective. Sum of each entry; all ranks give the same number of entries.
    ///
    /// # Panics
    /// If a sum exceeds 64 bits.
    pub fn sum_i64(&self, values: &mut [i64]) {
        // Upper and lower half are summed apart, so nothing can wrap unnoticed on the way.
        let halves: Vec<i64> = values.iter().flat_map(|&v| [v >> 32, v & 0xffff_ffff]).collect();
        let halves = self.all().reduce(&halves, Operation::Sum);
        for (value, half) in values.iter_mut().zip(halves.chunks_exact(2)) {
            let sum = (i128::from(half[0]) << 32) + i128::from(half[1]);
            *value = i64::try_from(sum).expect("a sum over ranks exceeds 64 bits");
        }
    }

    /// Collective. Sum over all ranks modulo 2^64.
    pub fn wrapping_sum_u64(&self, value: u64) -> u64 {
        let mut halves = [value >> 32, value & 0xffff_ffff];
        self.sum_u64(&mut halves);
        (halves[0] << 32).wrapping_add(halves[1])
    }

    /// Collective. Largest of each entry; all ranks give the same number of entries.
    pub fn max_u64(&self, values: &mut [u64]) {
        let result = self.all().reduce(values, Operation::Largest);
        values.copy_from_slice(&result);
    }

    /// Collective. Smallest of each entry; all ranks give the same number of entries.
    pub fn min_u64(&self, values: &mut [u64]) {
        let result = self.all().reduce(values, Operation::Smallest);
        values.copy_from_slice(&result);
    }

    /// Collective. Whether any rank gives `true`.
    pub fn any(&self, value: bool) -> bool {
        let mut values = [u64::from(value)];
        self.max_u64(&mut values);
        values[0] != 0
    }

    /// Collective. Sum of the values of all ranks below this one; 0 on rank 0.
    pub fn exclusive_sum_u64(&self, value: u64) -> u64 {
        self.all().sum_below(value)
    }

    /// Collective. The values of all ranks, in rank order. All ranks give the same number of
    /// values. The result grows with the number of ranks: for a few scalars per rank only.
    pub fn all_gather_u64(&self, values: &[u64]) -> Vec<u64> {
        self.all().gather(values)
    }

    /// Collective. Replaces `bytes` on every rank by those of rank `root`.
    pub fn broadcast_bytes(&self, root: usize, bytes: &mut Vec<u8>) {
        assert!(root < self.size(), "no rank {root} among {}", self.size());
        let mut len = [bytes.len() as u64];
        self.all().broadcast(root, &mut len);
        bytes.resize(len[0] as usize, 0);
        for piece in bytes.chunks_mut(self.piece_len::<u8>()) {
            self.all().broadcast(root, piece);
        }
    }

    /// Collective. The bytes of all ranks, in rank order, at rank 0; `None` elsewhere.
    pub fn gather_bytes(&self, bytes: &[u8]) -> Option<Vec<Vec<u8>>> {
        let received = self.sparse_exchange(vec![(0, bytes.to_vec())]);
        (self.rank() == 0).then(|| received.into_iter().map(|(_, bytes)| bytes).collect())
    }
}

/// Integer that orders like the number (IEEE total order), NaN of either sign above all.
fn order_key(value: f64) -> i64 {
    if value.is_nan() {
        return i64::MAX;
    }
    let bits = value.to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

/// Inverse of [`order_key`].
fn from_order_key(key: i64) -> f64 {
    f64::from_bits((key ^ (((key >> 63) as u64) >> 1) as i64) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_keys_order_like_numbers() {
        let numbers = [f64::NEG_INFINITY, -2.0, -1e-310, -0.0, 0.0, 1e-310, 1.0, f64::INFINITY, f64::NAN];
        for pair in numbers.windows(2) {
            assert!(order_key(pair[0]) < order_key(pair[1]), "{pair:?}");
        }
        for number in numbers {
            let back = from_order_key(order_key(number));
            assert!(back.to_bits() == number.to_bits() || (back.is_nan() && number.is_nan()));
        }
        assert!(from_order_key(order_key(-f64::NAN)).is_nan());
    }
}
