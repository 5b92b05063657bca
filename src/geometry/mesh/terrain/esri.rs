//! ESRI ASCII grids.
use super::raster::{MOST, Placing, Raster, checked_size};

/// Reads a header of `ncols`, `nrows`, `xllcorner` or `xllcenter`, `yllcorner` or `yllcenter`, `cellsize` (or
/// `dx` and `dy`) and `NODATA_value`, and rows of values from north to south.
pub(super) fn parse(text: &str, placing: &Placing) -> Result<Raster, String> {
    // Some programs put a mark of the order of bytes first.
    let mut lines = text.trim_start_matches('\u{feff}').lines().peekable();
    let mut header = std::collections::BTreeMap::new();
    // A row of values may begin with `nan`.
    let is_value =
        |line: &str| line.split_whitespace().next().is_some_and(|word| word.parse::<f64>().is_ok());
    while let Some(line) = lines.next_if(|line| {
        line.trim().is_empty()
            || (line.trim_start().starts_with(|first: char| first.is_ascii_alphabetic()) && !is_value(line))
    }) {
        let mut words = line.split_whitespace();
        if let (Some(key), Some(value)) = (words.next(), words.next()) {
            let value: f64 =
                value.parse().map_err(|_| format!("{key} is {value:?}, which is not a number"))?;
            header.insert(key.to_ascii_lowercase(), value);
        }
    }
    let given = |key: &str| header.get(key).copied();
    let count = |key: &str| match given(key) {
        Some(count) if count >= 2.0 && count <= MOST as f64 && count.fract() == 0.0 => Ok(count as u64),
        Some(count) => Err(format!("{key} is {count}; expected 2 to {MOST}")),
        None => Err(format!("its header has no {key}")),
    };
    let [columns, rows] = checked_size([count("ncols")?, count("nrows")?])?;
    let size = match (given("cellsize"), given("dx"), given("dy")) {
        (None, Some(dx), Some(dy)) if (dx - dy).abs() > 1e-6 * dx.abs() => {
            return Err(format!("its cells are {dx} m by {dy} m (dx is not dy); expected squares"));
        }
        (cell, dx, dy) => cell.or(dx).or(dy),
    };
    let cell = size
        .filter(|cell| *cell > 0.0 && *cell < 1e9)
        .ok_or("its header has no cellsize above 0, nor dx and dy")?;
    let corner = |axis: char| {
        let centre = given(&format!("{axis}llcenter"));
        centre.or_else(|| Some(given(&format!("{axis}llcorner"))? + 0.5 * cell)).unwrap_or(0.5 * cell)
    };
    let none = given("nodata_value");
    let mut found = Vec::new();
    for word in lines.flat_map(str::split_whitespace) {
        let height: f64 = word.parse().map_err(|_| format!("found {word:?} among the heights"))?;
        found.push(height);
        if found.len() > columns * rows {
            break;
        }
    }
    if found.len() != columns * rows {
        return Err(format!("it has {} heights; its header says {columns} x {rows}", found.len()));
    }
    Raster::from_north(&found, [columns, rows], none, placing, Some((cell, [corner('x'), corner('y')])))
}
