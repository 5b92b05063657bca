//! Terrain of the job file to geometry.
use super::super::checks::{Checks, Space};
use crate::geometry::mesh::{HeightRaster, Placing, Terrain};
use crate::geometry::written::{Shape as Written, Surface, Thickness};
use crate::geometry::{Mesh, Shape};
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::text::{excerpt, written};

/// Kinds of rasters, for messages.
pub(in crate::job::convert) const RASTERS: &str =
    "an ESRI ASCII grid (.asc), a GeoTIFF (.tif) or an array of NumPy (.npy, .npz)";

impl Checks<'_> {
    /// The solid below a terrain, or a layer on it; `None` with a fault, and for other shapes.
    pub(super) fn terrain<const D: usize>(
        &mut self,
        shape: &Written,
        space: &Space<D>,
        path: &Path,
    ) -> Option<Shape<D>> {
        let Written::Terrain { file, cell, array, surface, thickness, origin, base } = shape else {
            return None;
        };
        let origin = self.origin_of_file(origin.as_ref(), space, path)?;
        let here = path.key("file");
        let placing = self.placing(file, *cell, array.as_deref(), path)?;
        let raster = self.read(file, RASTERS, &here, |from| HeightRaster::read(from, &placing))?;
        let ground = self.made_of(Terrain::new(raster), file, &here)?;
        let [least, _] = ground.range();
        let base = base.unwrap_or(least - 0.1 * ground.length());
        if base >= least {
            let message =
                format!("found {}; expected less than the least height, {}", written(base), written(least));
            self.fault(&path.key("base"), message);
            return None;
        }
        let is_smooth = *surface == Surface::Smooth;
        let top = match thickness {
            None => None,
            Some(Thickness::Constant(thickness)) => Some(ground.raised(*thickness)),
            Some(Thickness::Raster(layer)) => {
                let here = path.key("thickness");
                let raster = self.read(layer, RASTERS, &here, |from| HeightRaster::read(from, &placing))?;
                Some(self.made_of(ground.under(&raster, is_smooth), layer, &here)?)
            }
        };
        let is_fine = is_smooth && matches!(thickness, Some(Thickness::Raster(_)));
        let smooth = |terrain: Terrain| if is_smooth { terrain.smooth() } else { Ok(terrain) };
        let top = match top {
            Some(top) => {
                Some(if is_fine { top } else { self.made_of(smooth(top), file, &path.key("surface"))? })
            }
            None => None,
        };
        let ground = self.made_of(smooth(ground), file, &path.key("surface"))?;
        let mut solid = |terrain: &Terrain| {
            self.solid(terrain.solid_above(base), 1.0, &origin, Mesh::terrain, file, &here).map(Shape::Mesh)
        };
        let below = solid(&ground)?;
        match top {
            None => Some(below),
            Some(top) => Some(Shape::Difference(Box::new(solid(&top)?), vec![below])),
        }
    }

    /// The keys at `path` that complement the file of a raster; a fault if the file has no arrays with names.
    pub(in crate::job::convert) fn placing(
        &mut self,
        file: &str,
        cell: Option<f64>,
        array: Option<&str>,
        path: &Path,
    ) -> Option<Placing> {
        if array.is_some() && !file.to_lowercase().ends_with(".npz") {
            let message = format!(
                "found an array name for the file \"{}\"; expected one for a .npz file only",
                excerpt(file, QUOTED)
            );
            self.fault(&path.key("array"), message);
            return None;
        }
        Some(Placing { cell, array: array.map(str::to_owned) })
    }

    fn made_of<T>(&mut self, made: Result<T, String>, file: &str, path: &Path) -> Option<T> {
        made.map_err(|reason| self.fault(path, format!("found \"{}\", but {reason}", excerpt(file, QUOTED))))
            .ok()
    }
}
