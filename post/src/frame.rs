//! State of a run at one time, from its files: particles with their fields, and leaves. For viewers and
//! exports; not collective.
use std::path::{Path, PathBuf};

use super::picture::source;
use super::revolve::{self, Revolve, Turn};
use agimp::io::hdf5_file::{FileError, Reader};
use agimp::io::snapshot::content::fields::Values;
use agimp::io::snapshot::intact::checked::Checked;
use agimp::io::snapshot::{Header, PointField};
use agimp::kernel::Coordinates;

/// Particles of an output or checkpoint file.
pub struct Frame {
    /// The header of the file.
    pub header: Header,
    /// Positions, m; the third component is 0 in plane strain.
    pub positions: Vec<[f64; 3]>,
    /// Half widths of the undeformed boxes, m.
    pub half_widths: Vec<f64>,
    /// The requested fields that the file has.
    pub(crate) fields: Vec<(PointField, Values)>,
}

/// Leaves of the tree.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Leaves {
    /// Level of each leaf.
    pub levels: Vec<u8>,
    /// Lower corner of each leaf, counted in leaves of its level from the lower corner of the domain.
    pub coords: Vec<[u32; 3]>,
}

/// A number for each leaf.
pub(crate) struct LeafField {
    pub name: &'static str,
    pub values: Vec<f64>,
    /// Whether the value of several leaves is their sum; else their mean.
    pub is_sum: bool,
}

impl Frame {
    /// Reads the particles of a file with those of the fields `wanted` that it shows. Fields that `required`
    /// names must be there.
    pub fn read(path: &Path, wanted: &[PointField], required: bool) -> Result<Self, FileError> {
        let file = Reader::open_alone(path)?;
        let header = header_of_particles(&file)?;
        let points = source::points(&file, &header)?;
        let half_widths = source::radii(&file, &header)?;
        let mut fields = Vec::new();
        for &field in wanted {
            match dataset(&file, field) {
                Some(name) => fields.push((field, values(&file, &header, field, &name)?)),
                None if required => {
                    let shown: Vec<&str> = shown(&file).into_iter().map(PointField::name).collect();
                    let (name, shown) = (field.name(), shown.join(", "));
                    return Err(file.refuse(format!("the file does not contain {name}; it contains {shown}")));
                }
                None => {}
            }
        }
        let positions = points.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        Ok(Self { header, positions, half_widths, fields })
    }

    /// Numbers of a field that was read, a row of components for each particle; of whole numbers as well,
    /// whatever their kind in the file.
    pub fn numbers(&self, field: PointField) -> Option<Vec<f64>> {
        let (_, values) = self.fields.iter().find(|(known, _)| *known == field)?;
        Some(match values {
            Values::Id(ids) => ids.iter().map(|&id| id as f64).collect(),
            Values::Integer(numbers) => numbers.iter().copied().map(f64::from).collect(),
            Values::Single(values, _) => values.iter().copied().map(f64::from).collect(),
            Values::Real(values, _) => values.clone(),
        })
    }

    /// Whether its bodies are those of revolution.
    pub fn is_of_revolution(&self) -> bool {
        self.header.scalars.coordinates() == Coordinates::Axisymmetric
    }

    /// Its bodies of revolution in space: each particle next to itself about the axis, with the same id.
    ///
    /// # Errors
    /// In words: the file is of another geometry, or its copies are too many.
    pub fn revolved(mut self, revolve: Revolve) -> Result<Self, String> {
        let sections = self.positions.iter().map(|x| x[0]).zip(self.half_widths.iter().copied());
        let copies = revolve::copies(&self.header, sections, revolve)?;
        for (_, values) in &mut self.fields {
            *values = match values {
                Values::Id(ids) => Values::Id(copies.iter().map(|&(p, _)| ids[p]).collect()),
                Values::Integer(all) => Values::Integer(copies.iter().map(|&(p, _)| all[p]).collect()),
                Values::Single(all, width) => {
                    let all: Vec<f64> = all.iter().copied().map(f64::from).collect();
                    Values::Real(turned(&copies, &all, *width), *width)
                }
                Values::Real(all, width) => Values::Real(turned(&copies, all, *width), *width),
            };
        }
        self.positions = copies.iter().map(|&(p, turn)| turn.place(self.positions[p])).collect();
        self.half_widths = copies.iter().map(|&(p, _)| self.half_widths[p]).collect();
        // The domain of the whole body: the radius to both sides of the axis, along x and y.
        let header = &mut self.header;
        let [radius, height] = [0, 1].map(|axis| header.roots.get(axis).copied().unwrap_or(1));
        let bottom = header.origin.get(1).copied().unwrap_or(0.0);
        let side = -(radius as f64) * header.root_edge;
        (header.origin, header.roots) = (vec![side, side, bottom], vec![2 * radius, 2 * radius, height]);
        header.dimension = 3;
        Ok(self)
    }

    /// Lower and upper corner of the domain, m.
    pub fn domain(&self) -> [[f64; 3]; 2] {
        let low = |axis: usize| self.header.origin.get(axis).copied().unwrap_or(0.0);
        let edge =
            |axis: usize| self.header.roots.get(axis).map_or(0.0, |&n| n as f64 * self.header.root_edge);
        [std::array::from_fn(low), std::array::from_fn(|axis| low(axis) + edge(axis))]
    }
}

/// Numbers of copies of particles; rows of three are vectors, of six tensors.
fn turned(copies: &[(usize, Turn)], all: &[f64], width: usize) -> Vec<f64> {
    let width = width.max(1);
    let row = |&(p, turn): &(usize, Turn)| {
        let own = &all[width * p..][..width];
        match width {
            3 => turn.vector(std::array::from_fn(|i| own[i])).to_vec(),
            6 => turn.tensor(std::array::from_fn(|i| own[i])).to_vec(),
            _ => own.to_vec(),
        }
    };
    copies.iter().flat_map(row).collect()
}

/// The fields that a file shows, in the order of [`PointField::ALL`].
pub fn shown(file: &Reader) -> Vec<PointField> {
    PointField::ALL.into_iter().filter(|&field| dataset(file, field).is_some()).collect()
}

/// The fields that the file at `path` shows.
pub fn shown_in(path: &Path) -> Result<Vec<PointField>, FileError> {
    let file = Reader::open_alone(path)?;
    header_of_particles(&file)?;
    Ok(shown(&file))
}

/// The header of a file with particles; refuses others.
fn header_of_particles(file: &Reader) -> Result<Header, FileError> {
    let header = Header::read(file)?;
    if !file.exists("VTKHDF/PointData") || file.exists("VTKHDF/CellData/level") {
        return Err(file.refuse(source::NO_PARTICLES));
    }
    Ok(header)
}

fn dataset(file: &Reader, field: PointField) -> Option<String> {
    let name = format!("VTKHDF/PointData/{}", field.name());
    file.exists(&name).then_some(name)
}

fn values(file: &Reader, header: &Header, field: PointField, name: &str) -> Result<Values, FileError> {
    let rows = header.particles;
    let mut checked = Checked::new(None, file, header);
    Ok(match field {
        PointField::Id => Values::Id(checked.read_all(name, rows, 0)?),
        _ if is_integer(field) => Values::Integer(checked.read_all(name, rows, 0)?),
        _ => {
            let (values, components) = source::numbers(file, header, name)?;
            Values::Real(values, components)
        }
    })
}

/// Whether a field holds small whole numbers.
pub fn is_integer(field: PointField) -> bool {
    matches!(
        field,
        PointField::Material | PointField::Body | PointField::ParticleLevel | PointField::LeafLevel
    )
}

impl Leaves {
    /// The leaves that belong to an output: of the tree file beside it, or of its own restart state; none if
    /// there is neither.
    pub fn of_output(path: &Path) -> Result<Self, FileError> {
        let (file, header) = with_tree(path)?;
        Self::read(&file, &header)
    }

    /// The leaves that belong to an output, the header of their file, and its fields of leaves.
    pub(crate) fn with_fields(path: &Path) -> Result<(Header, Self, Vec<LeafField>), FileError> {
        let (file, header) = with_tree(path)?;
        let leaves = Self::read(&file, &header)?;
        let mut fields = Vec::new();
        for (name, is_sum) in
            [("particles", true), ("volume_fraction", false), ("pressure", false), ("von_mises", false)]
        {
            let shown = format!("VTKHDF/CellData/{name}");
            if file.exists(&shown) {
                let values = source::rows(&file, &header, &shown, header.leaves)?.0;
                fields.push(LeafField { name, values, is_sum });
            }
        }
        Ok((header, leaves, fields))
    }

    fn read(file: &Reader, header: &Header) -> Result<Self, FileError> {
        let (rows, dimension) = (header.leaves, header.dimension.clamp(1, 3));
        let mut checked = Checked::new(None, file, header);
        if file.exists("VTKHDF/CellData/level") {
            let levels: Vec<u8> = checked.read_all("VTKHDF/CellData/level", rows, 0)?;
            let corners = 1_u64 << dimension;
            let points: Vec<f64> = checked.read_all("VTKHDF/Points", rows.saturating_mul(corners), 3)?;
            let coords = points.chunks_exact(3 * corners as usize).zip(&levels).map(|(corner, &level)| {
                let edge = header.root_edge / f64::from(1_u32 << level.min(31));
                let low = |axis: usize| header.origin.get(axis).copied().unwrap_or(0.0);
                std::array::from_fn(|axis| ((corner[axis] - low(axis)) / edge).round() as u32)
            });
            return Ok(Self { coords: coords.collect(), levels });
        }
        if !file.exists("state/tree/level") {
            return Ok(Self::default());
        }
        let levels = checked.read_all("state/tree/level", rows, 0)?;
        let coords: Vec<u32> = checked.read_all("state/tree/coord", rows, dimension)?;
        let padded = |c: &[u32]| std::array::from_fn(|axis| c.get(axis).copied().unwrap_or(0));
        Ok(Self { coords: coords.chunks_exact(dimension).map(padded).collect(), levels })
    }
}

/// The file with the tree of an output: beside it, or itself.
fn with_tree(path: &Path) -> Result<(Reader, Header), FileError> {
    let beside = tree_beside(path);
    let file = Reader::open_alone(if beside.exists() { &beside } else { path })?;
    let header = Header::read(&file)?;
    Ok((file, header))
}

/// `a/b_000001.hdf` has its tree in `a/b_000001.tree.hdf`.
fn tree_beside(output: &Path) -> PathBuf {
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let ending = output.extension().unwrap_or_default().to_string_lossy();
    output.with_file_name(format!("{stem}.tree.{ending}"))
}
