//! Rasters from files whose ending gives the format.
use std::path::Path;

use super::{Placing, Raster, esri, geotiff, npy};
use crate::geometry::mesh::ReadError;
use crate::geometry::mesh::read::MOST_BYTES;
use crate::input_file;

impl Raster {
    /// Reads a raster: ESRI ASCII grid (`.asc`), GeoTIFF (`.tif`), or array of NumPy (`.npy`, `.npz`).
    ///
    /// # Errors
    /// The file cannot be read, is of another kind, or damaged.
    pub fn read(path: &Path, placing: &Placing) -> Result<Self, ReadError> {
        let ending =
            path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let bytes = input_file::read(path, MOST_BYTES)?;
        let (kind, raster) = match ending.as_str() {
            "tif" | "tiff" => ("GeoTIFF", geotiff::parse(&bytes, placing)),
            "npy" => ("NumPy", npy::parse(&bytes, placing)),
            "npz" => ("NumPy", npy::parse_archive(&bytes, placing)),
            _ => ("ESRI ASCII grid", esri::parse(&String::from_utf8_lossy(&bytes), placing)),
        };
        raster.map_err(|reason| ReadError::Damaged { kind, reason })
    }
}
