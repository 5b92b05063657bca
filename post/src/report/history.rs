//! The table of the history, as far as it has been written.
use std::path::Path;

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub name: String,
    pub unit: String,
    pub values: Vec<f64>,
}

/// The history of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct History {
    /// Step of each row.
    pub steps: Vec<u64>,
    /// The other columns.
    pub columns: Vec<Column>,
}

impl History {
    /// Reads a history; one that cannot be read is empty. Rows that are not whole are left out.
    pub(super) fn read(path: &Path) -> Self {
        std::fs::read(path)
            .map_or_else(|_| Self::default(), |bytes| Self::of(&String::from_utf8_lossy(&bytes)))
    }

    fn of(text: &str) -> Self {
        // A line without its end is being written.
        let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
        let mut lines = whole.lines();
        let headings = lines.next().unwrap_or_default().split(',').skip(1);
        let column = |heading: &str| {
            let (name, unit) = heading.split_once(" [").unwrap_or((heading, ""));
            Column { name: name.to_owned(), unit: unit.trim_end_matches(']').to_owned(), values: Vec::new() }
        };
        let mut history = Self { steps: Vec::new(), columns: headings.map(column).collect() };
        for line in lines {
            let mut cells = line.split(',');
            let step = cells.next().and_then(|cell| cell.parse().ok());
            let values: Option<Vec<f64>> = cells.map(|cell| cell.parse().ok()).collect();
            let (Some(step), Some(values)) = (step, values) else { continue };
            if values.len() == history.columns.len() {
                history.steps.push(step);
                history.columns.iter_mut().zip(values).for_each(|(column, value)| column.values.push(value));
            }
        }
        history
    }

    /// The column of that name.
    pub(super) fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Last value of a column.
    pub(super) fn last(&self, name: &str) -> Option<f64> {
        self.column(name)?.values.last().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_are_not_whole_are_left_out() {
        let history = History::of("step,time [s],particles\n0,0.0,7\n5,half\n10,0.5,NaN\n20,0.");
        assert_eq!(history.steps, [0, 10]);
        assert_eq!(
            history.columns[0],
            Column { name: "time".into(), unit: "s".into(), values: vec![0.0, 0.5] }
        );
        assert!(history.last("particles").unwrap().is_nan());
        assert_eq!(History::of(""), History { steps: vec![], columns: vec![] });
    }
}
