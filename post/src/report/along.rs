//! Curves along lines of points at a few times.
use std::path::PathBuf;

use super::history::{Column, History};
use super::panels::Panel;
use agimp::text::quantity;

/// Times that a chart shows, from the first to the last.
const TIMES: usize = 5;
/// Columns with the place of a row.
const PLACE: [&str; 6] = ["time", "point", "x", "y", "z", "level"];

/// The charts of all lines, by name and file: one for each quantity, over the distance from the first point.
pub(super) fn panels(lines: &[(String, PathBuf)]) -> Vec<Panel> {
    lines.iter().flat_map(|(name, path)| of_line(name, &History::read(path))).collect()
}

fn of_line(name: &str, table: &History) -> Vec<Panel> {
    let Some(times) = table.column("time").map(|column| &column.values) else { return Vec::new() };
    // Rows of one time follow each other.
    let starts: Vec<usize> =
        (0..times.len()).filter(|&row| row == 0 || times[row] != times[row - 1]).collect();
    let Some(last) = starts.len().checked_sub(1) else { return Vec::new() };
    let shown = TIMES.min(starts.len());
    let mut chosen: Vec<usize> = (0..shown).map(|i| last * i / shown.max(2).saturating_sub(1)).collect();
    chosen.dedup();
    let axes: Vec<&Column> = ["x", "y", "z"].iter().filter_map(|axis| table.column(axis)).collect();
    let way = |row: usize, first: usize| {
        let square = |axis: &&Column| (axis.values[row] - axis.values[first]).powi(2);
        axes.iter().map(square).sum::<f64>().sqrt()
    };
    let quantities = table.columns.iter().filter(|column| !PLACE.contains(&&*column.name));
    let panel = |column: &Column| {
        let curve = |&number: &usize| {
            let first = starts[number];
            let end = starts.get(number + 1).copied().unwrap_or(times.len());
            let points = (first..end).map(|row| (way(row, first), column.values[row])).collect();
            (format!("t = {}", quantity(times[first], "s")), points)
        };
        let title = format!("{} along {name}", column.name.replace('_', " "));
        let across = (format!("way along {name}"), "m".to_owned());
        Panel { across, ..Panel::new(&title, &column.unit, chosen.iter().map(curve).collect()) }
    };
    quantities.map(panel).filter(Panel::changes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_a_curve_for_each_of_a_few_times() {
        let mut table = History { steps: Vec::new(), columns: Vec::new() };
        let names = [
            ("time", "s"),
            ("point", ""),
            ("x", "m"),
            ("y", "m"),
            ("level", ""),
            ("pressure", "Pa"),
            ("same", ""),
        ];
        for (name, unit) in names {
            table.columns.push(Column { name: name.into(), unit: unit.into(), values: Vec::new() });
        }
        for time in 0..9 {
            for point in 0..3 {
                table.steps.push(time);
                let (t, p) = (time as f64, f64::from(point));
                let row = [t, p + 1.0, 3.0 * p, 1.0 + 4.0 * p, 2.0, t * p, 7.0];
                table.columns.iter_mut().zip(row).for_each(|(column, value)| column.values.push(value));
            }
        }
        let panels = of_line("depth", &table);
        assert_eq!(panels.len(), 1, "what is the same everywhere has no chart");
        assert_eq!(
            (&*panels[0].title, &*panels[0].unit, &*panels[0].across.1),
            ("pressure along depth", "Pa", "m")
        );
        let names: Vec<&str> = panels[0].curves.iter().map(|(name, _)| &**name).collect();
        assert_eq!(names, ["t = 0 s", "t = 2 s", "t = 4 s", "t = 6 s", "t = 8 s"]);
        assert_eq!(panels[0].curves[4].1, [(0.0, 0.0), (5.0, 8.0), (10.0, 16.0)]);
        assert!(of_line("none", &History::default()).is_empty());
    }
}
