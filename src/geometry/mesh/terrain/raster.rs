//! Values on a regular grid.

/// Values on a regular grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Row by row from south to north, from west to east in each; NaN where there is none.
    pub values: Vec<f64>,
    /// Number of values in a row.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
    /// Distance of neighbours, m.
    pub cell: f64,
    /// Place of the south-western value in the raster's own coordinates, m.
    pub corner: [f64; 2],
}

/// Keys of a job that complement the file of a raster.
#[derive(Clone, Debug, Default)]
pub struct Placing {
    /// Distance of neighbours in place of that of the file, m: the south-western value then lies at the
    /// origin.
    pub cell: Option<f64>,
    /// Array of a file with several.
    pub array: Option<String>,
}

/// Greatest magnitude of a value; a larger one counts as none.
const GREATEST: f64 = 1e9;

/// The least integer of 16 bits counts as no value in any file: no ground lies so deep, and many programs
/// write it.
const HOLE: f64 = -32768.0;

/// Value without data, for files that declare none.
const NONE: f64 = -9999.0;

/// Most heights of a raster.
pub(super) const MOST: usize = 4_000_000;

impl Raster {
    /// A raster of values whose first row is the northernmost; `none` marks places without a value.
    pub(super) fn from_north(
        values: &[f64],
        [columns, rows]: [usize; 2],
        none: Option<f64>,
        placing: &Placing,
        of_file: Option<(f64, [f64; 2])>,
    ) -> Result<Self, String> {
        let (cell, corner) = match (placing.cell, of_file) {
            (Some(cell), _) => (cell, [0.0; 2]),
            (None, Some(of_file)) => of_file,
            (None, None) => {
                return Err(
                    "it does not contain the distance of its heights; give `cell`, in m, in the job".into()
                );
            }
        };
        if !(cell > 0.0 && cell < 1e9 && corner.iter().all(|c| c.abs() < 1e12)) {
            return Err(format!("its cells of {cell} m from {corner:?} have no finite position"));
        }
        let none = none.unwrap_or(NONE);
        let is_none = |value: f64| value == none || value == HOLE || value.abs() > GREATEST;
        let known = |value: f64| if is_none(value) { f64::NAN } else { value };
        let all = (0..rows).rev().flat_map(|row| &values[row * columns..][..columns]);
        Ok(Self { values: all.map(|value| known(*value)).collect(), columns, rows, cell, corner })
    }

    /// How many cells have no value, which the message calls `what`, and where the first is, in words.
    pub fn gaps(&self, what: &str) -> Option<String> {
        let count = self.values.iter().filter(|value| value.is_nan()).count();
        let from_north = |at: usize| (self.rows - 1 - at / self.columns) * self.columns + at % self.columns;
        let gaps = (0..self.values.len()).filter(|&at| self.values[at].is_nan());
        let first = gaps.min_by_key(|&at| from_north(at))?;
        let (row, column) = (from_north(first) / self.columns + 1, first % self.columns + 1);
        let place = [first % self.columns, first / self.columns];
        let [x, y] = [0, 1].map(|a| self.corner[a] + place[a] as f64 * self.cell);
        Some(format!(
            "{count} of {} cells have no {what}, the first in row {row}, column {column}, at {}; fill these cells or cut the raster",
            self.values.len(),
            crate::text::place(&[x, y])
        ))
    }
}

/// Columns and rows that a raster may have, or why not.
pub(super) fn checked_size([columns, rows]: [u64; 2]) -> Result<[usize; 2], String> {
    if columns.min(rows) < 2 || columns.saturating_mul(rows) > MOST as u64 {
        return Err(format!("it has {columns} x {rows} heights; expected 2 x 2 to {MOST}"));
    }
    Ok([columns as usize, rows as usize])
}
