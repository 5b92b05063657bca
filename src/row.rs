//! A row of a table: names and units of its columns, and their values.
use std::fmt::Arguments;

/// Axes as ends of names.
pub const AXES: [&str; 3] = ["_x", "_y", "_z"];

/// A row. One function that adds its columns gives their names, without values, or their values: the names of
/// a row of values are not formed.
#[derive(Debug, Default)]
pub struct Row {
    names: Option<Vec<(String, &'static str)>>,
    values: Vec<f64>,
}

impl Row {
    /// Names and units of the columns that `add` adds.
    pub fn names(add: impl FnOnce(&mut Self)) -> Vec<(String, &'static str)> {
        let mut row = Self { names: Some(Vec::new()), values: Vec::new() };
        add(&mut row);
        row.names.unwrap_or_default()
    }

    /// Values of the columns that `add` adds.
    pub fn values(add: impl FnOnce(&mut Self)) -> Vec<f64> {
        let mut row = Self::default();
        add(&mut row);
        row.values
    }

    /// Adds a column with its unit, empty for a pure number. A row of names has no values.
    pub fn add(&mut self, name: Arguments<'_>, unit: &'static str, value: Option<f64>) {
        if let Some(names) = &mut self.names {
            names.push((name.to_string(), unit));
        }
        self.values.extend(value);
    }

    /// Adds a column for each of the `ends` of its name, with the first values as many.
    pub fn vector<const N: usize>(
        &mut self,
        name: Arguments<'_>,
        ends: &[&str],
        unit: &'static str,
        values: Option<[f64; N]>,
    ) {
        for (i, end) in ends.iter().enumerate() {
            self.add(format_args!("{name}{end}"), unit, values.map(|values| values[i]));
        }
    }
}
