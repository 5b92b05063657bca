//! Files of maps.
use crate::io::hdf5_file::FileError;
use crate::io::raster::{self, Raster};
use crate::job::Problem;
use crate::probe::Maxima;

/// Not collective. Writes the largest depths and speeds so far.
pub(in crate::run) fn write<const D: usize>(
    problem: &Problem<D>,
    maxima: &[Maxima],
) -> Result<(), FileError> {
    for (map, maxima) in problem.maps.iter().zip(maxima) {
        let origin = |axis: usize| if axis < D - 1 { problem.origin[axis] } else { 0.0 };
        let corner = std::array::from_fn(|axis| origin(axis) + map.corner[axis]);
        for (what, values) in [("depth", &maxima.depth), ("speed", &maxima.speed)] {
            let name = format!("{}.map_{}_{what}.asc", problem.name, map.name);
            let raster = Raster { columns: map.size[0], corner, cell: map.cell, values };
            raster::write(&problem.output.directory.join(name), &raster)?;
        }
    }
    Ok(())
}
