//! Tables over time.
use crate::checksum::fnv1a;

/// Values over time: linear between rows, constant before the first and after the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    times: Vec<f64>,
    values: Vec<f64>,
}

/// Why rows are no table.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TableError {
    /// No row.
    #[error("found a table without rows; expected at least one row [time, value]")]
    Empty,
    /// Times do not increase.
    #[error(
        "found the time {time} s in row {row}, which is not later than the previous row; expected increasing times"
    )]
    Order {
        /// Row, from 1.
        row: usize,
        /// Its time, s.
        time: f64,
    },
    /// A number that is none.
    #[error("found a number that is not finite in row {row}; expected finite times and values")]
    NotFinite {
        /// Row, from 1.
        row: usize,
    },
}

impl Table {
    /// From rows (time in s, value).
    ///
    /// # Errors
    /// No row, a number that is not finite, or times that do not increase.
    pub fn new(rows: &[(f64, f64)]) -> Result<Self, TableError> {
        if rows.is_empty() {
            return Err(TableError::Empty);
        }
        for (i, &(time, value)) in rows.iter().enumerate() {
            if !time.is_finite() || !value.is_finite() {
                return Err(TableError::NotFinite { row: i + 1 });
            }
            if i > 0 && time <= rows[i - 1].0 {
                return Err(TableError::Order { row: i + 1, time });
            }
        }
        Ok(Self {
            times: rows.iter().map(|row| row.0).collect(),
            values: rows.iter().map(|row| row.1).collect(),
        })
    }

    /// Checksum of its rows.
    pub fn checksum(&self) -> u64 {
        fnv1a(self.times.iter().chain(&self.values).map(|value| value.to_bits()))
    }

    /// Value at a time, s.
    pub fn at(&self, time: f64) -> f64 {
        let next = self.times.partition_point(|&t| t <= time);
        if next == 0 {
            return self.values[0];
        }
        if next == self.times.len() {
            return self.values[next - 1];
        }
        let (from, to) = (self.times[next - 1], self.times[next]);
        let part = (time - from) / (to - from);
        part.mul_add(self.values[next] - self.values[next - 1], self.values[next - 1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_linear_between_rows_and_constant_outside() {
        let table = Table::new(&[(1.0, 2.0), (2.0, 4.0), (4.0, -4.0)]).unwrap();
        for (time, value) in
            [(0.0, 2.0), (1.0, 2.0), (1.25, 2.5), (2.0, 4.0), (3.0, 0.0), (4.0, -4.0), (9.0, -4.0)]
        {
            assert_eq!(table.at(time), value, "{time}");
        }
    }

    #[test]
    fn rows_that_are_no_table_are_refused() {
        assert_eq!(Table::new(&[]), Err(TableError::Empty));
        assert_eq!(Table::new(&[(0.0, 1.0), (0.0, 2.0)]), Err(TableError::Order { row: 2, time: 0.0 }));
        assert_eq!(Table::new(&[(0.0, f64::NAN)]), Err(TableError::NotFinite { row: 1 }));
    }
}
