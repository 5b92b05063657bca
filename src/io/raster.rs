//! Rasters over the plane as ESRI ASCII grids.
use std::fmt::Write as _;
use std::path::Path;

use super::hdf5_file::FileError;
use super::whole_file::write_whole;

/// Text for a raster's places without value.
const NO_VALUE: &str = "-9999";

/// Values on a regular grid, in rows from south to north, from west to east in each; 0 is no value.
#[derive(Clone, Copy, Debug)]
pub struct Raster<'a> {
    /// Number of columns.
    pub columns: usize,
    /// South-western corner, m.
    pub corner: [f64; 2],
    /// Edge of a cell, m.
    pub cell: f64,
    /// The values.
    pub values: &'a [f64],
}

/// Not collective. Writes a raster.
pub fn write(path: &Path, raster: &Raster<'_>) -> Result<(), FileError> {
    write_whole(path, text(raster).as_bytes()).map_err(|source| FileError::System {
        path: path.into(),
        action: "write",
        source,
    })
}

fn text(raster: &Raster<'_>) -> String {
    let Raster { columns, corner: [x, y], cell, values } = *raster;
    let rows = values.len() / columns;
    let mut text = format!(
        "ncols {columns}\nnrows {rows}\nxllcorner {x:?}\nyllcorner {y:?}\ncellsize {cell:?}\nNODATA_value {NO_VALUE}\n"
    );
    // The first row is the northernmost.
    for row in values.chunks_exact(columns).rev() {
        for (column, value) in row.iter().enumerate() {
            let gap = if column == 0 { "" } else { " " };
            let _ =
                if *value == 0.0 { write!(text, "{gap}{NO_VALUE}") } else { write!(text, "{gap}{value:?}") };
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_go_from_north_to_south() {
        let raster =
            Raster { columns: 3, corner: [10.0, -2.5], cell: 0.5, values: &[1.0, 2.0, 3.0, 0.0, 1e-9, 6.25] };
        assert_eq!(
            text(&raster),
            "ncols 3\nnrows 2\nxllcorner 10.0\nyllcorner -2.5\ncellsize 0.5\nNODATA_value -9999\n-9999 1e-9 6.25\n1.0 2.0 3.0\n"
        );
    }
}
