//! Fields: values at places, from rasters and tables of points in files.
//!
//! On a grid of places a field is linear along each coordinate. Between points of a plane that are no grid it
//! is linear on triangles (Delaunay 1934). Outside it has the value of its nearest place. Its bits do not
//! depend on the order of the points.
//!
//! | file | what it holds |
//! |---|---|
//! | `points.rs` | tables of points |
//! | `triangles.rs` | values between points of a plane |
//! | this | grids; values at any place |
mod points;
mod triangles;

pub use points::read;

use triangles::Triangles;

use crate::checksum::fnv1a;

/// A scalar over some of the coordinates.
#[derive(Debug)]
pub struct Field {
    values: Values,
    /// Where the origin of its own coordinates lies, m.
    origin: [f64; 3],
    /// Factor for its values.
    scale: f64,
    checksum: u64,
}

#[derive(Debug)]
enum Values {
    Grid(Grid),
    Triangles(Triangles),
}

/// Values at all combinations of some coordinates.
#[derive(Debug)]
struct Grid {
    /// Each coordinate, and its places, m, which increase.
    axes: Vec<(usize, Vec<f64>)>,
    /// The first coordinate runs fastest.
    values: Vec<f64>,
}

impl Field {
    /// A field over x and y from a raster: `values` in rows from south to north, `columns` from west to east
    /// in each, the first at `corner`, m, with neighbours `cell` (m) apart.
    pub fn raster(values: Vec<f64>, columns: usize, cell: f64, corner: [f64; 2]) -> Self {
        let rows = values.len() / columns;
        let places = |count: usize, from: f64| (0..count).map(|i| (i as f64).mul_add(cell, from)).collect();
        Self::of_grid(vec![(0, places(columns, corner[0])), (1, places(rows, corner[1]))], values)
    }

    fn of_grid(axes: Vec<(usize, Vec<f64>)>, values: Vec<f64>) -> Self {
        let numbers = axes.iter().flat_map(|(_, places)| places).chain(&values);
        let checksum = fnv1a(numbers.map(|value| value.to_bits()));
        Self::new(Values::Grid(Grid { axes, values }), checksum)
    }

    fn new(values: Values, checksum: u64) -> Self {
        Self { values, origin: [0.0; 3], scale: 1.0, checksum }
    }

    /// The same with the origin of its coordinates at a place (m), and values multiplied by a factor.
    pub fn placed(self, origin: [f64; 3], scale: f64) -> Self {
        Self { origin, scale, ..self }
    }

    /// Checksum of its places and values, as they are in its file.
    pub fn checksum(&self) -> u64 {
        self.checksum
    }

    /// Value at a place, m.
    pub fn at(&self, place: [f64; 3]) -> f64 {
        let place = std::array::from_fn(|axis| place[axis] - self.origin[axis]);
        self.scale
            * match &self.values {
                Values::Grid(grid) => grid.at(place),
                Values::Triangles(triangles) => triangles.at(place),
            }
    }

    /// Whether it has a coordinate; 0: x.
    pub fn has(&self, axis: usize) -> bool {
        match &self.values {
            Values::Grid(grid) => grid.axes.iter().any(|(of, _)| *of == axis),
            Values::Triangles(triangles) => triangles.axes.contains(&axis),
        }
    }

    /// Its coordinates (0: x), with the range of its places, m.
    pub fn ranges(&self) -> Vec<(usize, [f64; 2])> {
        let mut ranges = match &self.values {
            Values::Grid(grid) => {
                let range =
                    |(axis, places): &(usize, Vec<f64>)| (*axis, [places[0], places[places.len() - 1]]);
                grid.axes.iter().map(range).collect()
            }
            Values::Triangles(triangles) => triangles.ranges(),
        };
        ranges.iter_mut().for_each(|(axis, ends)| *ends = ends.map(|x| x + self.origin[*axis]));
        ranges
    }
}

impl Grid {
    fn at(&self, place: [f64; 3]) -> f64 {
        // Before and after the place along each coordinate: index of the value, and its share.
        let (mut near, mut count, mut stride) = ([(0, 1.0); 8], 1, 1);
        for (axis, places) in &self.axes {
            let x = place[*axis];
            let next = places.partition_point(|&at| at <= x);
            let low = next.saturating_sub(1).min(places.len() - 1);
            let high = next.min(places.len() - 1);
            let share = if high > low { (x - places[low]) / (places[high] - places[low]) } else { 0.0 };
            for i in 0..count {
                let (index, weight) = near[i];
                near[i] = (index + low * stride, weight * (1.0 - share));
                near[count + i] = (index + high * stride, weight * share);
            }
            (count, stride) = (2 * count, stride * places.len());
        }
        near[..count].iter().fold(0.0, |sum, &(index, weight)| weight.mul_add(self.values[index], sum))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_raster_is_linear_between_its_values() {
        // 2 + 3 x - y at (10, 20), (11, 20), (12, 20), (10, 21), …
        let values = [20.0, 21.0].iter().flat_map(|y| [10.0, 11.0, 12.0].map(|x| 2.0 + 3.0 * x - y));
        let field = Field::raster(values.collect(), 3, 1.0, [10.0, 20.0]);
        for [x, y] in [[10.0, 20.0], [12.0, 21.0], [10.25, 20.5], [11.75, 20.125], [11.0, 20.5]] {
            assert_eq!(field.at([x, y, 77.0]), 2.0 + 3.0 * x - y, "{x} {y}");
        }
        // Outside it is that of the nearest place.
        assert_eq!(field.at([0.0, 20.5, 0.0]), field.at([10.0, 20.5, 0.0]));
        assert_eq!(field.at([99.0, 99.0, 0.0]), field.at([12.0, 21.0, 0.0]));
        assert_eq!(field.ranges(), [(0, [10.0, 12.0]), (1, [20.0, 21.0])]);
        let (there, moved) = (field.at([10.5, 20.5, 0.0]), field.placed([-10.0, 5.0, 0.0], 2.0));
        assert_eq!(moved.at([0.5, 25.5, 0.0]), 2.0 * there);
        assert_eq!(moved.ranges(), [(0, [0.0, 2.0]), (1, [25.0, 26.0])]);
    }
}
