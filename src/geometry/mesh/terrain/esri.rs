//! ESRI ASCII grids.
use super::raster::checked_size;
use super::{MOST, Placing, Raster};

/// Reads a header of `ncols`, `nrows`, `xllcorner` or `xllcenter`, `yllcorner` or `yllcenter`, `cellsize` and `NODATA_value`, and rows of
/// values from north to south.
pub(super) fn parse(text: &str, placing: &Placing) -> Result<Raster, String> {
    let mut lines = text.lines().peekable();
    let mut header = std::collections::BTreeMap::new();
    while let Some(line) = lines.next_if(|line| {
        line.trim().is_empty() || line.trim_start().starts_with(|first: char| first.is_ascii_alphabetic())
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
    let cell = given("cellsize")
        .filter(|cell| *cell > 0.0 && *cell < 1e9)
        .ok_or("its header has no cellsize above 0")?;
    let corner = |axis: char| {
        let centre = given(&format!("{axis}llcenter"));
        centre.or_else(|| Some(given(&format!("{axis}llcorner"))? + 0.5 * cell)).unwrap_or(0.5 * cell)
    };
    let none = given("nodata_value").unwrap_or(-9999.0);
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
    Raster::from_north(&found, [columns, rows], Some(none), placing, Some((cell, [corner('x'), corner('y')])))
}
