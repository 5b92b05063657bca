//! Reading of output files for pictures. All of it has the right checksum.
//!
//! | file | content |
//! |---|---|
//! | this | places, sizes and numbers of the particles |
//! | `derived.rs` | quantities that give colours |
pub(super) mod derived;

use agimp::io::hdf5_file::{FileError, Kind, Reader};
use agimp::io::snapshot::Header;
use agimp::io::snapshot::intact::checked::Checked;
use agimp::kernel::Coordinates;

/// Message for a file of the tree where particles are required.
pub(crate) const NO_PARTICLES: &str = "found no particles: a file of the tree (NAME_000001.tree.hdf); expected the output beside it (NAME_000001.hdf)";

/// Cells of a leaf along an axis.
const CELLS: f64 = 4.0;

/// A data set with a row for each particle, and the numbers of a row.
pub(crate) fn numbers(file: &Reader, header: &Header, dataset: &str) -> Result<(Vec<f64>, usize), FileError> {
    rows(file, header, dataset, header.particles)
}

/// The numbers of the first `n` rows of a data set, and how many a row has.
pub(crate) fn rows(
    file: &Reader,
    header: &Header,
    dataset: &str,
    n: u64,
) -> Result<(Vec<f64>, usize), FileError> {
    let stored = file.stored(dataset)?;
    let components = stored.components;
    let mut checked = Checked::new(None, file, header);
    let values = match stored.kind {
        Kind::U64 => {
            checked.read_all::<u64>(dataset, n, components)?.into_iter().map(|value| value as f64).collect()
        }
        Kind::I64 => {
            checked.read_all::<i64>(dataset, n, components)?.into_iter().map(|value| value as f64).collect()
        }
        Kind::I32 => checked.read_all::<i32>(dataset, n, components)?.into_iter().map(f64::from).collect(),
        Kind::F32 => checked.read_all::<f32>(dataset, n, components)?.into_iter().map(f64::from).collect(),
        Kind::F64 => checked.read_all(dataset, n, components)?,
        other => return Err(file.refuse(format!("{dataset} holds {other}, which no field has"))),
    };
    Ok((values, components.max(1)))
}

/// Positions of the particles, three numbers each.
pub(crate) fn points(file: &Reader, header: &Header) -> Result<Vec<f64>, FileError> {
    match numbers(file, header, "VTKHDF/Points")? {
        (points, 3) if points.iter().all(|x| x.is_finite()) => Ok(points),
        _ => Err(file.refuse("VTKHDF/Points does not hold three finite numbers for each particle")),
    }
}

/// Half widths of the particles: of the restart state, or a quarter of a cell of their leaf, or of the
/// root octants where the file does not say.
pub(crate) fn radii(file: &Reader, header: &Header) -> Result<Vec<f64>, FileError> {
    let n = header.particles;
    let (state, level) = ("state/particles/half_width", "VTKHDF/PointData/leaf_level");
    let quarter = |level: i32| header.root_edge / f64::from(1_u32 << level.clamp(0, 31)) / CELLS / 4.0;
    let mut checked = Checked::new(None, file, header);
    let radii = if file.exists(state) {
        checked.read_all(state, n, 0)?
    } else if file.exists(level) {
        checked.read_all::<i32>(level, n, 0)?.into_iter().map(quarter).collect()
    } else {
        vec![quarter(3); n as usize]
    };
    match radii.iter().find(|radius| !(radius.is_finite() && **radius > 0.0)) {
        Some(radius) => Err(file.refuse(format!("a particle has a half width of {radius:?} m"))),
        None if header.scalars.coordinates() == Coordinates::Cartesian || !file.exists(state) => Ok(radii),
        None => {
            let points = points(file, header)?;
            let sections = radii.into_iter().zip(points.iter().step_by(3));
            Ok(sections.map(|(half, x)| header.scalars.coordinates().half_width(half, *x)).collect())
        }
    }
}
