//! Tables of points from files: the first line names the columns, `x`, `y` and `z` (m) among them, as far as
//! the values depend on them.
use std::path::Path;

use super::triangles::Triangles;
use super::{Field, Values};
use crate::checksum::fnv1a;
use crate::input_file;
use crate::quantity::AXES;
use crate::quantity::record::{self, Column, MOST_BYTES, RecordError, Rows};

/// The field of a table of points; by default its values are in the first column that is no coordinate.
///
/// # Errors
/// The file cannot be read, is no such table, has a place twice, or points between which nothing can be
/// found.
pub fn read(path: &Path, value: Option<&Column>) -> Result<Field, RecordError> {
    parse(&input_file::read(path, MOST_BYTES)?, value)
}

fn parse(bytes: &[u8], value: Option<&Column>) -> Result<Field, RecordError> {
    let (line, names) = record::first_line(bytes).ok_or(RecordError::Empty)?;
    let places: Vec<Option<usize>> = AXES.iter().map(|axis| record::named(&names, axis)).collect();
    let axes: Vec<usize> = (0..3).filter(|&axis| places[axis].is_some()).collect();
    let other = (0..names.len()).find(|at| !places.contains(&Some(*at)));
    let value = match (value, other) {
        (Some(value), _) => value.clone(),
        (None, Some(at)) => Column::Number(at + 1),
        (None, None) => return Err(names_wanted(line, &names)),
    };
    if axes.is_empty() {
        return Err(names_wanted(line, &names));
    }
    let coordinates = places.iter().flatten().map(|at| Column::Number(at + 1));
    let columns: Vec<Column> = coordinates.chain([value]).collect();
    of_rows(&axes, &record::rows(bytes, &columns)?)
}

fn names_wanted(line: u64, names: &[Vec<u8>]) -> RecordError {
    let names: Vec<String> = names.iter().take(20).map(|name| record::quoted(name)).collect();
    let names = names.join(", ");
    let reason = format!("found {names}; expected the names of columns: x, y or z, and that of the values");
    RecordError::Line { line, reason }
}

/// The field of rows of these coordinates and a value.
fn of_rows(axes: &[usize], rows: &Rows) -> Result<Field, RecordError> {
    let of_line = |row: usize, reason: String| Err(RecordError::Line { line: rows.lines[row], reason });
    if rows.numbers.is_empty() {
        return Err(RecordError::Empty);
    }
    if let Some(row) = rows.numbers.iter().position(|row| row.iter().any(|number| !number.is_finite())) {
        return of_line(row, "found a number that is not finite; expected finite places and values".into());
    }
    // The first coordinate runs fastest; -0 is 0.
    let place = |row: usize, which: usize| rows.numbers[row][which] + 0.0;
    let mut order: Vec<usize> = (0..rows.numbers.len()).collect();
    order.sort_by(|&a, &b| {
        let along = (0..axes.len()).rev().map(|which| place(a, which).total_cmp(&place(b, which)));
        along.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
    });
    let is_same =
        |pair: &&[usize]| (0..axes.len()).all(|which| place(pair[0], which) == place(pair[1], which));
    if let Some(pair) = order.windows(2).find(is_same) {
        let [first, second] = [pair[0].min(pair[1]), pair[0].max(pair[1])];
        let line = rows.lines[first];
        return of_line(second, format!("found the place of line {line} again; expected each place once"));
    }
    let along = |which: usize| {
        let mut places: Vec<f64> = order.iter().map(|&row| place(row, which)).collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        places
    };
    let grid: Vec<(usize, Vec<f64>)> = (0..axes.len()).map(|which| (axes[which], along(which))).collect();
    let values = order.iter().map(|&row| rows.numbers[row][axes.len()]);
    if grid.iter().try_fold(1_usize, |all, (_, places)| all.checked_mul(places.len())) == Some(order.len()) {
        return Ok(Field::of_grid(grid, values.collect()));
    }
    let &[first, second] = axes else { return Err(RecordError::Scattered) };
    let samples = || order.iter().map(|&row| [place(row, 0), place(row, 1), rows.numbers[row][2]]);
    let triangles = Triangles::new([first, second], samples()).map_err(RecordError::Points)?;
    let checksum = fnv1a(samples().flatten().map(f64::to_bits));
    Ok(Field::new(Values::Triangles(triangles), checksum))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(text: &str) -> Result<Field, RecordError> {
        parse(text.as_bytes(), None)
    }

    /// One coordinate: a section, linear between its points, in any order of the rows.
    #[test]
    fn a_section_is_linear_between_its_points() {
        for text in ["x,level\n0,4\n10,6\n20,5\n", "# of a survey\nLevel (m);X [m]\n5;20\n4;0\n6;10\n"] {
            let section = field(text).unwrap();
            let found = [-3.0, 0.0, 5.0, 10.0, 12.5, 99.0].map(|x| section.at([x, 7.0, 8.0]));
            assert_eq!(found, [4.0, 4.0, 5.0, 6.0, 5.75, 5.0], "{text}");
            assert_eq!(section.ranges(), [(0, [0.0, 20.0])]);
        }
    }

    /// Grids over the vertical plane and over space, and points that are no grid, have a linear field
    /// exactly.
    #[test]
    fn a_linear_field_comes_out() {
        let value = |x: f64, y: f64, z: f64| 1.0 + 2.0 * x - 3.0 * y + 0.5 * z;
        let mut text = String::from("x y z u\n");
        for (x, y, z) in (0..24).map(|i| (f64::from(i % 2), f64::from(i / 2 % 3), f64::from(i / 6))) {
            text += &format!("{x} {y} {z} {}\n", value(x, y, z));
        }
        let space = field(&text).unwrap();
        let scattered = "x y p\n0 0 1\n4 0 9\n4 4 -3\n0 4 -11\n1 2.5 -4.5\n3 1 4\n";
        let plane = field(scattered).unwrap();
        for [x, y, z] in [[0.25, 1.5, 2.5], [1.0, 2.0, 3.0], [0.5, 0.0, 0.75]] {
            assert!((space.at([x, y, z]) - value(x, y, z)).abs() < 1e-14);
            assert!((plane.at([x, y, z]) - value(x, y, 0.0)).abs() < 1e-14);
        }
        // Outside: the nearest place of the hull, an edge or a corner.
        assert_eq!(plane.at([2.0, -5.0, 0.0]), value(2.0, 0.0, 0.0));
        assert_eq!(plane.at([9.0, 9.0, 0.0]), value(4.0, 4.0, 0.0));
        assert_eq!(plane.ranges(), [(0, [0.0, 4.0]), (1, [0.0, 4.0])]);
        let turned: Vec<&str> = scattered.lines().rev().collect();
        let turned = format!("x y p\n{}\n", turned[..6].join("\n"));
        assert_eq!(field(&turned).unwrap().checksum(), plane.checksum(), "any order of the points");
    }

    #[test]
    fn what_is_wrong_is_named() {
        let x_twice = "x,y,u\n0,0,1\n1,0,2\n0,-0,3\n";
        for (text, part) in [
            ("", "it contains no row of numbers"),
            ("x,u\n", "it contains no row of numbers"),
            ("0,1\n1,2\n", "line 1: found \"0\", \"1\"; expected the names of columns: x, y or z"),
            ("x,y\n1,2\n", "line 1: found \"x\", \"y\"; expected the names of columns"),
            ("x,u\n0,1\n1,dry\n", "line 3: found \"dry\" in column 2; expected a number"),
            ("x,u\n0,nan\n", "line 2: found a number that is not finite"),
            (x_twice, "line 4: found the place of line 2 again"),
            ("x,y,u\n0,0,1\n1,1,2\n3,3,3\n", "its points lie on one line"),
            ("x,y,z,u\n0,0,0,1\n1,1,0,2\n3,3,5,3\n", "no grid"),
        ] {
            let error = field(text).expect_err(part).to_string();
            assert!(error.contains(part), "{error}");
        }
        assert!(parse(b"x,u\n0,1\n", Some(&Column::Name("v".into()))).is_err());
    }
}
