//! Least squares with a few given functions.

/// Coefficients `c` that minimise `Σ (Σ c_k rows[i][k] - values[i])²`, by the normal equations; each row and its
/// value are divided by the value, so that relative errors count.
pub(crate) fn least_squares<const N: usize>(rows: &[[f64; N]], values: &[f64]) -> [f64; N] {
    let mut a = [[0.0; N]; N];
    let mut b = [0.0; N];
    for (row, value) in rows.iter().zip(values).filter(|(_, value)| **value > 0.0) {
        for i in 0..N {
            for j in 0..N {
                a[i][j] += row[i] * row[j] / (value * value);
            }
            b[i] += row[i] / value;
        }
    }
    for pivot in 0..N {
        let best = (pivot..N).max_by(|&i, &j| a[i][pivot].abs().total_cmp(&a[j][pivot].abs()));
        let best = best.unwrap_or(pivot);
        a.swap(pivot, best);
        b.swap(pivot, best);
        if a[pivot][pivot] == 0.0 {
            continue;
        }
        for i in pivot + 1..N {
            let factor = a[i][pivot] / a[pivot][pivot];
            for j in pivot..N {
                a[i][j] -= factor * a[pivot][j];
            }
            b[i] -= factor * b[pivot];
        }
    }
    let mut c = [0.0; N];
    for i in (0..N).rev() {
        let known: f64 = (i + 1..N).map(|j| a[i][j] * c[j]).sum();
        c[i] = if a[i][i] == 0.0 { 0.0 } else { (b[i] - known) / a[i][i] };
    }
    c
}

/// As [`least_squares`], of two terms that cannot be negative: one that would be is left out.
pub(crate) fn positive(rows: &[[f64; 2]], values: &[f64]) -> [f64; 2] {
    let both = least_squares(rows, values);
    if both.iter().all(|c| *c >= 0.0) {
        return both;
    }
    let alone = |term: usize| {
        let rows: Vec<[f64; 1]> = rows.iter().map(|row| [row[term]]).collect();
        let mut c = [0.0; 2];
        [c[term]] = least_squares(&rows, values);
        c
    };
    let (first, second) = (alone(0), alone(1));
    if worst(&first, rows, values) <= worst(&second, rows, values) { first } else { second }
}

/// Greatest relative error of a fit.
pub(crate) fn worst<const N: usize>(c: &[f64; N], rows: &[[f64; N]], values: &[f64]) -> f64 {
    let value = |row: &[f64; N]| row.iter().zip(c).map(|(x, c)| x * c).sum::<f64>();
    let pairs = rows.iter().zip(values).filter(|(_, v)| **v > 0.0);
    pairs.map(|(row, v)| (value(row) / v - 1.0).abs()).fold(0.0, f64::max)
}
