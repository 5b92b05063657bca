//! Terrain from a raster of heights (ESRI ASCII grid): the solid between its surface and a level below.
use std::path::Path;

use super::read::{MOST_BYTES, ReadError, Triangles};
use crate::input_file;

/// Heights on a regular grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Terrain {
    /// Heights, m, row by row from south to north, from west to east in each.
    heights: Vec<f64>,
    columns: usize,
    rows: usize,
    /// Distance of neighbours, m.
    cell: f64,
    /// Place of the south-western height in the raster's own coordinates, m.
    corner: [f64; 2],
}

/// Most heights of a raster.
const MOST: usize = 4_000_000;

impl Terrain {
    /// Reads an ESRI ASCII grid: a header of `ncols`, `nrows`, `xllcorner` or `xllcenter`, `yllcorner` or `yllcenter`, `cellsize` and
    /// `NODATA_value`, and rows of heights from north to south.
    ///
    /// # Errors
    /// The file cannot be read, is damaged, or has cells without data.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let bytes = input_file::read(path, MOST_BYTES)?;
        Self::parse(&String::from_utf8_lossy(&bytes))
            .map_err(|reason| ReadError::Damaged { kind: "ESRI ASCII grid", reason })
    }

    fn parse(text: &str) -> Result<Self, String> {
        let mut lines = text.lines().peekable();
        let mut header = std::collections::BTreeMap::new();
        while let Some(line) = lines.next_if(|line| {
            line.trim().is_empty() || line.trim_start().starts_with(|first: char| first.is_ascii_alphabetic())
        }) {
            let mut words = line.split_whitespace();
            if let (Some(key), Some(value)) = (words.next(), words.next()) {
                let value: f64 = value.parse().map_err(|_| format!("{key} is {value:?}, no number"))?;
                header.insert(key.to_ascii_lowercase(), value);
            }
        }
        let given = |key: &str| header.get(key).copied();
        let count = |key: &str| match given(key) {
            Some(count) if count >= 2.0 && count <= MOST as f64 && count.fract() == 0.0 => Ok(count as usize),
            Some(count) => Err(format!("{key} is {count}; 2 to {MOST} are possible")),
            None => Err(format!("its header has no {key}")),
        };
        let (columns, rows) = (count("ncols")?, count("nrows")?);
        if columns * rows > MOST {
            return Err(format!("it has {columns} x {rows} heights; at most {MOST} are possible"));
        }
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
            if height == none || height.is_nan() || height.abs() > 1e9 {
                let (row, column) = (found.len() / columns + 1, found.len() % columns + 1);
                return Err(format!(
                    "row {row}, column {column} has no height ({word}); fill or cut what has none"
                ));
            }
            found.push(height);
            if found.len() > columns * rows {
                break;
            }
        }
        if found.len() != columns * rows {
            return Err(format!("it has {} heights; its header says {columns} x {rows}", found.len()));
        }
        // The first row is the northernmost.
        let heights = (0..rows).rev().flat_map(|row| found[row * columns..][..columns].to_vec()).collect();
        Ok(Self { heights, columns, rows, cell, corner: [corner('x'), corner('y')] })
    }

    /// Least and greatest height, m.
    pub fn range(&self) -> [f64; 2] {
        self.heights
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| [low.min(*h), high.max(*h)])
    }

    /// The longer edge of the raster, m.
    pub fn length(&self) -> f64 {
        (self.columns.max(self.rows) - 1) as f64 * self.cell
    }

    /// The surface between the heights, two triangles for each cell, closed by walls down to `base`, m, which lies below all heights.
    pub fn solid_above(&self, base: f64) -> Triangles {
        let (columns, rows) = (self.columns, self.rows);
        let place = |i: usize, j: usize, z: f64| {
            [self.corner[0] + i as f64 * self.cell, self.corner[1] + j as f64 * self.cell, z]
        };
        let mut vertices: Vec<[f64; 3]> =
            (0..rows * columns).map(|at| place(at % columns, at / columns, self.heights[at])).collect();
        let top = |i: usize, j: usize| (i + columns * j) as u32;
        let mut indices = Vec::new();
        for j in 0..rows - 1 {
            for i in 0..columns - 1 {
                let [a, b, c, d] = [top(i, j), top(i + 1, j), top(i + 1, j + 1), top(i, j + 1)];
                indices.extend([[a, b, c], [a, c, d]]);
            }
        }
        // Around the edge, counter-clockwise seen from above.
        let south = (0..columns - 1).map(|i| (i, 0));
        let east = (0..rows - 1).map(|j| (columns - 1, j));
        let north = (1..columns).rev().map(|i| (i, rows - 1));
        let west = (1..rows).rev().map(|j| (0, j));
        let ring: Vec<(usize, usize)> = south.chain(east).chain(north).chain(west).collect();
        let first = vertices.len() as u32;
        vertices.extend(ring.iter().map(|&(i, j)| place(i, j, base)));
        let middle = vertices.len() as u32;
        let centre: [f64; 2] = [(columns - 1) as f64, (rows - 1) as f64].map(|n| 0.5 * n * self.cell);
        vertices.push([self.corner[0] + centre[0], self.corner[1] + centre[1], base]);
        for (number, &(i, j)) in ring.iter().enumerate() {
            let next = (number + 1) % ring.len();
            let (low, low_next) = (first + number as u32, first + next as u32);
            let (high, high_next) = (top(i, j), top(ring[next].0, ring[next].1));
            indices.extend([[low, low_next, high_next], [low, high_next, high], [middle, low_next, low]]);
        }
        Triangles { vertices, indices }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Mesh;
    use super::*;

    /// A plane that falls by 3 in 4 along x, 6 x 4 heights, with its south-western height at (10.5, 20.5).
    fn slope() -> String {
        let row: Vec<String> = (0..6).map(|i| format!("{}", 9.0 - 0.75 * f64::from(i))).collect();
        let rows = vec![row.join(" "); 4].join("\n");
        format!("ncols 6\nnrows 4\nxllcorner 10\nyllcorner 20\ncellsize 1\nNODATA_value -9999\n{rows}\n")
    }

    #[test]
    fn a_slope_is_a_half_space() {
        let terrain = Terrain::parse(&slope()).unwrap();
        assert_eq!(terrain.range(), [5.25, 9.0]);
        let mesh = Mesh::new(terrain.solid_above(0.0)).unwrap();
        assert!((mesh.volume() - 15.0 * 7.125).abs() < 1e-11, "{}", mesh.volume());
        for (x, y, above) in [(12.0, 22.0, 0.1), (13.3, 21.2, -0.1), (13.0, 22.7, 0.02)] {
            let z = 9.0 - 0.75 * (x - 10.5) + above;
            // The normal of the slope is (3, 0, 4) / 5.
            let (distance, normal) = (mesh.distance(&[x, y, z]), mesh.gradient(&[x, y, z]));
            assert!((distance - 0.8 * above).abs() < 1e-14, "{distance}");
            assert!((normal[0] - 0.6).abs() < 1e-10 && (normal[2] - 0.8).abs() < 1e-10, "{normal:?}");
        }
    }

    #[test]
    fn rows_go_from_north_to_south() {
        let terrain =
            Terrain::parse("NCOLS 2\nNROWS 2\nXLLCENTER 0\nYLLCENTER 0\nCELLSIZE 2\n3 4\n1 2\n").unwrap();
        assert_eq!((terrain.heights, terrain.corner), (vec![1.0, 2.0, 3.0, 4.0], [0.0; 2]));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let text = slope();
        for (from, to, part) in [
            ("7.5", "-9999", "row 1, column 3 has no height"),
            ("7.5", "seven", "found \"seven\" among the heights"),
            ("ncols 6", "ncols 7", "24 heights; its header says 7 x 4"),
            ("ncols 6", "ncols 1e9", "ncols is 1000000000"),
            ("ncols 6", "", "no ncols"),
            ("cellsize 1", "cellsize 0", "no cellsize above 0"),
            ("nrows 4", "nrows x", "nrows is \"x\", no number"),
        ] {
            let error = Terrain::parse(&text.replacen(from, to, 1)).expect_err(part);
            assert!(error.contains(part), "{error}");
        }
    }
}
