//! Particles of an output for other programs: PLY, CSV, VTP.
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

use crate::frame::Frame;
use agimp::io::hdf5_file::FileError;
use agimp::io::snapshot::content::fields::{COMPONENTS, Values};
use agimp::io::whole_file::{system, write_in_pieces};

/// Format of an exported file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Stanford PLY, binary, single precision: points with their radii, for renderers.
    Ply,
    /// A row for each particle with all digits, names and units in the first row.
    Csv,
    /// VTK's XML of points, binary: for ParaView, PyVista and others.
    Vtp,
}

impl Format {
    /// Ending of the name of a file.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Csv => "csv",
            Self::Vtp => "vtp",
        }
    }
}

/// A number for each particle.
struct Column<'a> {
    name: String,
    unit: &'static str,
    value: Box<dyn Fn(usize) -> f64 + 'a>,
    /// The same where it is a whole number of up to 64 binary digits.
    whole: Option<Box<dyn Fn(usize) -> u64 + 'a>>,
}

/// Not collective. Writes the particles with their half widths and fields, under a temporary name first.
///
/// # Errors
/// The file cannot be written.
pub fn write(frame: &Frame, format: Format, path: &Path) -> Result<(), FileError> {
    let written = write_in_pieces(path, |out| match format {
        Format::Ply => ply(out, frame),
        Format::Csv => csv(out, frame),
        Format::Vtp => vtp(out, frame),
    });
    written.map_err(|source| system(path, "write", source))
}

fn real<'a>(name: String, unit: &'static str, value: impl Fn(usize) -> f64 + 'a) -> Column<'a> {
    Column { name, unit, value: Box::new(value), whole: None }
}

fn columns(frame: &Frame) -> Vec<Column<'_>> {
    let mut columns: Vec<Column<'_>> = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        columns.push(real(name.into(), "m", move |p| frame.positions[p][axis]));
    }
    columns.push(real("radius".into(), "m", |p| frame.half_widths[p]));
    for (field, values) in &frame.fields {
        let (name, unit) = (field.name(), field.unit());
        match values {
            Values::Id(ids) => columns.push(Column {
                whole: Some(Box::new(|p| ids[p])),
                ..real(name.into(), unit, |p| ids[p] as f64)
            }),
            Values::Integer(numbers) => columns.push(Column {
                whole: Some(Box::new(|p| numbers[p].max(0) as u64)),
                ..real(name.into(), unit, |p| f64::from(numbers[p]))
            }),
            Values::Single(values, width) => push(&mut columns, name, unit, *width, |p| f64::from(values[p])),
            Values::Real(values, width) => push(&mut columns, name, unit, *width, |p| values[p]),
        }
    }
    columns
}

/// A column for each component.
fn push<'a>(
    columns: &mut Vec<Column<'a>>,
    name: &str,
    unit: &'static str,
    width: usize,
    value: impl Fn(usize) -> f64 + Copy + 'a,
) {
    let width = width.max(1);
    let endings = COMPONENTS.iter().find(|endings| endings.len() == width);
    for component in 0..width {
        let ending = endings.map_or(String::new(), |endings| format!("_{}", endings[component]));
        let value = Box::new(move |p: usize| value(width * p + component));
        columns.push(Column { name: format!("{name}{ending}"), unit, value, whole: None });
    }
}

fn csv(out: &mut impl Write, frame: &Frame) -> io::Result<()> {
    let columns = columns(frame);
    let heading = |column: &Column<'_>| match column.unit {
        "" => column.name.clone(),
        unit => format!("{} [{unit}]", column.name),
    };
    writeln!(out, "{}", columns.iter().map(heading).collect::<Vec<_>>().join(","))?;
    let mut row = String::new();
    for particle in 0..frame.positions.len() {
        row.clear();
        for (number, column) in columns.iter().enumerate() {
            let gap = if number == 0 { "" } else { "," };
            let _ = match &column.whole {
                Some(whole) => write!(row, "{gap}{}", whole(particle)),
                None => write!(row, "{gap}{:?}", (column.value)(particle)),
            };
        }
        writeln!(out, "{row}")?;
    }
    Ok(())
}

fn ply(out: &mut impl Write, frame: &Frame) -> io::Result<()> {
    let columns = columns(frame);
    writeln!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment agimp, t = {:?} s, SI units",
        frame.header.time
    )?;
    writeln!(out, "element vertex {}", frame.positions.len())?;
    for column in &columns {
        let kind = if column.whole.is_some() { "uint" } else { "float" };
        writeln!(out, "property {kind} {}", column.name)?;
    }
    writeln!(out, "end_header")?;
    for particle in 0..frame.positions.len() {
        for column in &columns {
            match &column.whole {
                // Of identifiers the lower half.
                Some(whole) => out.write_all(&(whole(particle) as u32).to_le_bytes())?,
                None => out.write_all(&((column.value)(particle) as f32).to_le_bytes())?,
            }
        }
    }
    Ok(())
}

/// VTK's XML with raw arrays behind the text: each begins with its bytes as a 64-bit number.
fn vtp(out: &mut impl Write, frame: &Frame) -> io::Result<()> {
    let n = frame.positions.len();
    let (mut text, mut offset) = (String::new(), 0);
    let mut array = |text: &mut String, name: &str, kind: &str, components: usize, bytes: usize| {
        let _ = writeln!(
            text,
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"appended\" offset=\"{offset}\"/>"
        );
        offset += 8 + bytes;
    };
    let _ = writeln!(
        text,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <PolyData>\n<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">{:?}</DataArray>\
         </FieldData>\n<Piece NumberOfPoints=\"{n}\" NumberOfVerts=\"{n}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">",
        frame.header.time
    );
    text.push_str("<Points>\n");
    array(&mut text, "Points", "Float64", 3, 24 * n);
    text.push_str("</Points>\n<Verts>\n");
    array(&mut text, "connectivity", "Int64", 1, 8 * n);
    array(&mut text, "offsets", "Int64", 1, 8 * n);
    text.push_str("</Verts>\n<PointData>\n");
    array(&mut text, "radius", "Float64", 1, 8 * n);
    for (field, values) in &frame.fields {
        let (kind, components) = match values {
            Values::Id(_) => ("UInt64", 1),
            Values::Integer(_) => ("Int32", 1),
            Values::Single(_, width) | Values::Real(_, width) => ("Float64", (*width).max(1)),
        };
        let size = if kind == "Int32" { 4 } else { 8 };
        array(&mut text, field.name(), kind, components, size * components * n);
    }
    text.push_str("</PointData>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");
    out.write_all(text.as_bytes())?;
    let mut raw = |bytes: usize, write: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>| {
        out.write_all(&(bytes as u64).to_le_bytes())?;
        write(&mut *out)
    };
    let reals = |out: &mut dyn Write, values: &mut dyn Iterator<Item = f64>| -> io::Result<()> {
        for value in values {
            out.write_all(&value.to_le_bytes())?;
        }
        Ok(())
    };
    raw(24 * n, &mut |out| reals(out, &mut frame.positions.iter().flatten().copied()))?;
    for first in [0, 1] {
        raw(8 * n, &mut |out| (0..n as i64).try_for_each(|p| out.write_all(&(p + first).to_le_bytes())))?;
    }
    raw(8 * n, &mut |out| reals(out, &mut frame.half_widths.iter().copied()))?;
    for (_, values) in &frame.fields {
        match values {
            Values::Id(ids) => {
                raw(8 * n, &mut |out| ids.iter().try_for_each(|id| out.write_all(&id.to_le_bytes())))?
            }
            Values::Integer(numbers) => {
                raw(4 * n, &mut |out| {
                    numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()))
                })?;
            }
            Values::Single(values, _) => {
                raw(8 * values.len(), &mut |out| reals(out, &mut values.iter().map(|x| f64::from(*x))))?;
            }
            Values::Real(values, _) => {
                raw(8 * values.len(), &mut |out| reals(out, &mut values.iter().copied()))?
            }
        }
    }
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}
