//! Sums and means that are exact where all values are equal.

/// Squared Frobenius norm of a symmetric tensor.
pub(super) fn square(tensor: &[f64; 6]) -> f64 {
    (0..6).fold(0.0, |square, c| {
        f64::mul_add(if c < 3 { tensor[c] } else { 2.0 * tensor[c] }, tensor[c], square)
    })
}

/// Sum of the first `2^k` and the others, so that `2^k` equal numbers have an exact sum.
fn pairwise(values: &[f64]) -> f64 {
    match values {
        [] => 0.0,
        [value] => *value,
        _ => {
            let (first, rest) = values.split_at(values.len().next_power_of_two() / 2);
            pairwise(first) + pairwise(rest)
        }
    }
}

/// Weighted mean by differences from the first, exact where all are equal.
pub(super) fn mean<const N: usize>(shares: &[f64], values: impl Fn(usize) -> [f64; N]) -> [f64; N] {
    let first = values(0);
    let mut sum = [0.0; N];
    for (i, share) in shares.iter().enumerate() {
        let value = values(i);
        (0..N).for_each(|c| sum[c] = share.mul_add(value[c] - first[c], sum[c]));
    }
    std::array::from_fn(|c| first[c] + sum[c])
}

/// Shares of positive values in their sum, which comes last.
pub(super) fn shares(values: Vec<f64>) -> (Vec<f64>, f64) {
    let sum = pairwise(&values);
    (values.into_iter().map(|value| value / sum).collect(), sum)
}
