//! Terrain from a raster of heights: the solid between its surface and a level below.
//!
//! | file | content |
//! |---|---|
//! | `raster` | values on a regular grid |
//! | `read` | the same from a file of any kind |
//! | `esri` `geotiff` `npy` | the kinds |
//! | this | the surface and the solid below |
use super::Triangles;

mod esri;
mod geotiff;
mod npy;
mod raster;
mod read;

use raster::MOST;
pub use raster::{Placing, Raster};

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

/// Pieces into which a smooth surface cuts each edge of a cell.
const PIECES: usize = 4;

impl Terrain {
    /// The terrain with the heights of a raster.
    ///
    /// # Errors
    /// Some cells have no height.
    pub fn new(raster: Raster) -> Result<Self, String> {
        let gaps = raster.gaps("height");
        let Raster { values, columns, rows, cell, corner } = raster;
        match gaps {
            Some(gaps) => Err(gaps),
            None => Ok(Self { heights: values, columns, rows, cell, corner }),
        }
    }

    /// This terrain under a layer of constant thickness, m, measured upwards.
    pub fn raised(&self, thickness: f64) -> Self {
        let mut above = self.clone();
        above.heights.iter_mut().for_each(|height| *height += thickness);
        above
    }

    /// This terrain under a layer whose thickness a raster of the same cells gives, m, measured upwards; none
    /// where it has no value.
    ///
    /// # Errors
    /// The raster has other cells, or a thickness below 0.
    pub fn under(&self, thickness: &Raster, is_smooth: bool) -> Result<Self, String> {
        let (ours, theirs) = ((self.columns, self.rows), (thickness.columns, thickness.rows));
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * self.cell;
        let places = thickness.corner.iter().zip(&self.corner);
        let same = ours == theirs
            && near(thickness.cell, self.cell)
            && places.into_iter().all(|(a, b)| near(*a, *b));
        if !same {
            let words = |(columns, rows): (usize, usize), cell: f64, [x, y]: [f64; 2]| {
                format!("{columns} x {rows} cells of {cell} m from ({x}, {y})")
            };
            return Err(format!(
                "it has {}, and the terrain {}; expected the same cells in both",
                words(theirs, thickness.cell, thickness.corner),
                words(ours, self.cell, self.corner)
            ));
        }
        let values = thickness.values.iter().map(|t| if t.is_nan() { 0.0 } else { *t });
        let layer = Self { heights: values.collect(), ..self.clone() };
        if let Some(at) = layer.heights.iter().position(|t| *t < 0.0) {
            let (row, column) = (self.rows - at / self.columns, at % self.columns + 1);
            return Err(format!("row {row}, column {column} is {}; expected 0 or more", layer.heights[at]));
        }
        let (mut above, layer) =
            if is_smooth { (self.smooth()?, layer.smooth()?) } else { (self.clone(), layer) };
        // At its end a smooth layer overshoots below 0.
        above.heights.iter_mut().zip(&layer.heights).for_each(|(height, t)| *height += t.max(0.0));
        Ok(above)
    }

    /// The terrain with heights between those of the raster, on a cubic surface through them (Catmull and Rom
    /// 1974).
    ///
    /// # Errors
    /// It has too many.
    pub fn smooth(&self) -> Result<Self, String> {
        let finer = |count: usize| (count - 1) * PIECES + 1;
        let (columns, rows) = (finer(self.columns), finer(self.rows));
        if columns * rows > MOST {
            return Err(format!(
                "a smooth surface over {} x {} cells would have {columns} x {rows} heights; expected at most {MOST}: cut the raster, or use surface = \"triangles\"",
                self.columns, self.rows
            ));
        }
        let mut along = Vec::with_capacity(columns * self.rows);
        for row in self.heights.chunks_exact(self.columns) {
            along.extend(refined(row));
        }
        let mut heights = vec![0.0; columns * rows];
        for i in 0..columns {
            let column: Vec<f64> = (0..self.rows).map(|j| along[i + columns * j]).collect();
            for (j, height) in refined(&column).enumerate() {
                heights[i + columns * j] = height;
            }
        }
        Ok(Self { heights, columns, rows, cell: self.cell / PIECES as f64, corner: self.corner })
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

    /// The surface between the heights, two triangles for each cell, closed by walls down to `base`, m, which
    /// lies below all heights.
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

/// Values and those between them. Beyond the ends the curve is straight.
fn refined(values: &[f64]) -> impl Iterator<Item = f64> {
    let last = values.len() - 1;
    let before = move |i: usize| if i > 0 { values[i - 1] } else { 2.0 * values[0] - values[1] };
    let after = move |i: usize| if i < last { values[i + 1] } else { 2.0 * values[last] - values[last - 1] };
    (0..=last * PIECES).map(move |at| {
        let (i, piece) = (at / PIECES, at % PIECES);
        if piece == 0 {
            return values[i];
        }
        let t = piece as f64 / PIECES as f64;
        let (from, to) = (values[i], values[i + 1]);
        let [slope, next] = [0.5 * (to - before(i)), 0.5 * (after(i + 1) - from)];
        // Cubic Hermite form.
        let rise = to - from;
        from + t * (slope + t * ((3.0 * rise - 2.0 * slope - next) + t * (slope + next - 2.0 * rise)))
    })
}

#[cfg(test)]
mod tests {
    use super::super::Mesh;
    use super::*;

    fn parse(text: &str) -> Result<Terrain, String> {
        esri::parse(text, &Placing::default()).and_then(Terrain::new)
    }

    /// A plane that falls by 3 in 4 along x, 6 x 4 heights, with its south-western height at (10.5, 20.5).
    fn slope() -> String {
        let row: Vec<String> = (0..6).map(|i| format!("{}", 9.0 - 0.75 * f64::from(i))).collect();
        let rows = vec![row.join(" "); 4].join("\n");
        format!("ncols 6\nnrows 4\nxllcorner 10\nyllcorner 20\ncellsize 1\nNODATA_value -9999\n{rows}\n")
    }

    #[test]
    fn a_slope_is_a_half_space() {
        let terrain = parse(&slope()).unwrap();
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
        let terrain = parse("NCOLS 2\nNROWS 2\nXLLCENTER 0\nYLLCENTER 0\nCELLSIZE 2\n3 4\n1 2\n").unwrap();
        assert_eq!((terrain.heights, terrain.corner), (vec![1.0, 2.0, 3.0, 4.0], [0.0; 2]));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let text = slope();
        for (from, to, part) in [
            ("7.5", "-9999", "4 of 24 cells have no height, the first in row 1, column 3"),
            ("7.5", "seven", "found \"seven\" among the heights"),
            ("ncols 6", "ncols 7", "24 heights; its header says 7 x 4"),
            ("ncols 6", "ncols 1e9", "ncols is 1000000000"),
            ("ncols 6", "", "no ncols"),
            ("cellsize 1", "cellsize 0", "no cellsize above 0"),
            ("nrows 4", "nrows x", "nrows is \"x\", which is not a number"),
        ] {
            let error = parse(&text.replace(from, to)).expect_err(part);
            assert!(error.contains(part), "{error}");
        }
    }

    /// Forms that other programs write: a mark of the order of bytes, `dx` and `dy`; a hole in the first
    /// cell, declared or not.
    #[test]
    fn forms_of_other_programs() {
        let (text, whole) = (slope(), parse(&slope()).unwrap());
        for (from, to) in
            [("ncols", "\u{feff}ncols"), ("cellsize 1", "dx 1\ndy 1"), ("cellsize 1", "DX 1.0\nDY 1.0")]
        {
            assert_eq!(parse(&text.replace(from, to)).unwrap(), whole, "{to}");
        }
        let oblong = parse(&text.replace("cellsize 1", "dx 1\ndy 2")).unwrap_err();
        assert!(oblong.contains("1 m by 2 m (dx is not dy); expected squares"), "{oblong}");
        for hole in ["nan", "NaN", "-9999", "-32768", "-32768.0", "1e38"] {
            let torn = text.replacen("\n9 ", &format!("\n{hole} "), 1);
            let error = parse(&torn).unwrap_err();
            assert!(
                error.contains("1 of 24 cells have no height, the first in row 1, column 1"),
                "{hole}: {error}"
            );
        }
        let undeclared = text.replace("NODATA_value -9999\n", "").replacen("7.5", "-32768", 1);
        assert!(
            parse(&undeclared)
                .unwrap_err()
                .contains("1 of 24 cells have no height, the first in row 1, column 3")
        );
    }

    /// A smooth surface goes through the heights, keeps planes, and is nearer to a sine than triangles are:
    /// 0.0065 of its height for 8 heights to a wave, against 0.076.
    #[test]
    fn a_smooth_surface_is_nearer() {
        let wave = |x: f64| (std::f64::consts::TAU * x / 8.0).sin();
        let heights = (0..17 * 3).map(|at| wave((at % 17) as f64)).collect();
        let terrain = Terrain { heights, columns: 17, rows: 3, cell: 1.0, corner: [0.0; 2] };
        let smooth = terrain.smooth().unwrap();
        assert_eq!((smooth.columns, smooth.rows, smooth.cell), (65, 9, 0.25));
        for at in 8..57 {
            let (x, found) = (at as f64 / 4.0, smooth.heights[at + 4 * 65]);
            if at % 4 == 0 {
                assert_eq!(found, terrain.heights[at / 4]);
            }
            assert!((found - wave(x)).abs() < 0.0105, "{x} {found}");
        }
        let plane = parse(&slope()).unwrap();
        let finer = plane.smooth().unwrap();
        let exact = (0..finer.heights.len()).map(|at| 9.0 - 0.1875 * (at % finer.columns) as f64);
        assert!(finer.heights.iter().zip(exact).all(|(found, exact)| (found - exact).abs() < 1e-14));
    }

    /// A layer 0.5 m thick on a part of a slope is a difference of two solids with its volume.
    #[test]
    fn a_layer_has_its_thickness() {
        let ground = parse(&slope()).unwrap();
        let values = (0..24).map(|at| if at % 6 < 3 { 0.5 } else { f64::NAN }).collect();
        let layer = Raster { values, columns: 6, rows: 4, cell: 1.0, corner: [10.5, 20.5] };
        let solid = |terrain: &Terrain| Mesh::terrain(terrain.solid_above(0.0)).unwrap().volume();
        let volume = solid(&ground.under(&layer, false).unwrap()) - solid(&ground);
        // Two cells along x with 0.5, and one that falls to 0.
        assert!((volume - 3.0 * (2.0 * 0.5 + 0.25)).abs() < 1e-11, "{volume}");
        assert!((solid(&ground.raised(2.0)) - solid(&ground) - 30.0).abs() < 1e-11);
        let moved = Raster { corner: [10.0, 20.5], ..layer.clone() };
        assert!(ground.under(&moved, false).unwrap_err().contains("from (10, 20.5)"));
        let mut negative = layer;
        negative.values[7] = -1.0;
        assert!(ground.under(&negative, false).unwrap_err().contains("row 3, column 2 is -1"));
    }
}
