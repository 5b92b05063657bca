//! Triangles from STL (text and binary), OBJ and PLY (text and binary).
use std::io::{BufReader, Cursor};
use std::path::Path;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, Payload, Property};

use super::triangles::{ReadError, Triangles};
use super::{polygon, stl};
use crate::input_file;

/// Most bytes of a file.
pub(super) const MOST_BYTES: u64 = 1 << 31;

/// Reads the triangles of a file, whose ending gives its format. Polygons are cut into triangles.
///
/// # Errors
/// The file cannot be read, is of no known kind, or damaged.
pub fn read(path: &Path) -> Result<Triangles, ReadError> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    let parse: fn(&[u8]) -> Result<Triangles, ReadError> = match ending.as_str() {
        "stl" => stl::parse,
        "obj" => obj,
        "ply" => ply,
        _ => return Err(ReadError::Kind),
    };
    let triangles = parse(&input_file::read(path, MOST_BYTES)?)?;
    let count = triangles.vertices.len();
    match triangles.indices.iter().flatten().find(|&&corner| corner as usize >= count) {
        Some(corner) => Err(ReadError::Damaged {
            kind: "mesh",
            reason: format!("a triangle refers to the vertex {corner}, but there are only {count}"),
        }),
        None => Ok(triangles),
    }
}

fn obj(bytes: &[u8]) -> Result<Triangles, ReadError> {
    let damaged = |reason: String| ReadError::Damaged { kind: "OBJ", reason };
    let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    // Colours are ignored.
    let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut BufReader::new(bytes), &options, no_materials)
        .map_err(|error| damaged(error.to_string()))?;
    let mut triangles = Triangles::default();
    for model in models {
        let first = triangles.vertices.len() as u64;
        let places = model.mesh.positions.as_chunks::<3>().0;
        triangles.vertices.extend(places);
        // Without counts of corners all faces are triangles.
        let mut left = &model.mesh.indices[..];
        let mut counts = model.mesh.face_arities.iter().map(|count| *count as usize);
        while !left.is_empty() {
            let (face, rest) = left.split_at(counts.next().unwrap_or(3).clamp(1, left.len()));
            left = rest;
            for corners in polygon::triangles(places, face) {
                let mut indices = [0; 3];
                for (index, corner) in indices.iter_mut().zip(corners) {
                    let sum = first + u64::from(corner);
                    *index = u32::try_from(sum).map_err(|_| damaged("too many vertices".into()))?;
                }
                triangles.indices.push(indices);
            }
        }
    }
    Ok(triangles)
}

/// The elements of a PLY file by their names.
fn ply_elements(bytes: &[u8]) -> Result<Payload<DefaultElement>, ReadError> {
    let damaged = |reason: String| ReadError::Damaged { kind: "PLY", reason };
    let parser = Parser::<DefaultElement>::new();
    let mut reader = Reader::new(Cursor::new(bytes));
    let header = parser.read_header(&mut reader).map_err(|error| damaged(error.to_string()))?;
    // Elements without properties take no bytes: any number of them would fit.
    let all: u128 = header.elements.values().map(|element| element.count as u128).sum();
    if all > bytes.len() as u128 {
        return Err(damaged(format!(
            "its header announces {all} elements, and it has {} bytes",
            bytes.len()
        )));
    }
    parser.read_payload(&mut reader, &header).map_err(|error| damaged(error.to_string()))
}

/// The numbers of the vertices of a PLY file: name and values of each property that is a number.
///
/// # Errors
/// It is damaged, or has no vertices.
pub fn ply_columns(bytes: &[u8]) -> Result<Vec<(String, Vec<f64>)>, ReadError> {
    let damaged = |reason: &str| ReadError::Damaged { kind: "PLY", reason: reason.into() };
    let payload = ply_elements(bytes)?;
    let vertices = payload.iter().find(|(key, _)| key.as_str() == "vertex").map(|(_, all)| all);
    let vertices = vertices.filter(|all| !all.is_empty()).ok_or_else(|| damaged("it has no vertices"))?;
    let numbers = vertices[0].iter().filter(|(_, value)| number(value).is_some());
    let columns = numbers.map(|(name, _)| {
        let values = vertices.iter().map(|vertex| property(vertex, name).and_then(number));
        let values: Option<Vec<f64>> = values.collect();
        Ok((name.to_string(), values.ok_or_else(|| damaged("a vertex has too few numbers"))?))
    });
    columns.collect()
}

fn ply(bytes: &[u8]) -> Result<Triangles, ReadError> {
    let damaged = |reason: String| ReadError::Damaged { kind: "PLY", reason };
    let payload = ply_elements(bytes)?;
    let elements = |name: &str| payload.iter().find(|(key, _)| key.as_str() == name).map(|(_, all)| all);
    let missing = |what: &str| damaged(format!("it has no {what}"));
    let mut triangles = Triangles::default();
    for vertex in elements("vertex").ok_or_else(|| missing("vertices"))? {
        let mut x = [0.0; 3];
        for (c, name) in x.iter_mut().zip(["x", "y", "z"]) {
            *c = property(vertex, name).and_then(number).ok_or_else(|| missing("coordinates x, y and z"))?;
        }
        triangles.vertices.push(x);
    }
    for face in elements("face").ok_or_else(|| missing("faces"))? {
        let corners =
            property(face, "vertex_indices").or_else(|| property(face, "vertex_index")).and_then(list);
        let corners = corners.ok_or_else(|| missing("corners of faces (vertex_indices)"))?;
        triangles.indices.extend(polygon::triangles(&triangles.vertices, &corners));
    }
    Ok(triangles)
}

fn property<'a>(element: &'a DefaultElement, name: &str) -> Option<&'a Property> {
    element.iter().find(|(key, _)| key.as_str() == name).map(|(_, value)| value)
}

fn number(property: &Property) -> Option<f64> {
    match property {
        Property::Float(value) => Some(f64::from(*value)),
        Property::Double(value) => Some(*value),
        Property::Int(value) => Some(f64::from(*value)),
        Property::UInt(value) => Some(f64::from(*value)),
        Property::Short(value) => Some(f64::from(*value)),
        Property::UShort(value) => Some(f64::from(*value)),
        Property::Char(value) => Some(f64::from(*value)),
        Property::UChar(value) => Some(f64::from(*value)),
        _ => None,
    }
}

/// Corners of a face; a negative one refers to no vertex.
fn list(property: &Property) -> Option<Vec<u32>> {
    let all = |values: &mut dyn Iterator<Item = i64>| {
        values.map(|value| u32::try_from(value).unwrap_or(u32::MAX)).collect()
    };
    Some(match property {
        Property::ListInt(values) => all(&mut values.iter().map(|v| i64::from(*v))),
        Property::ListUInt(values) => values.clone(),
        Property::ListShort(values) => all(&mut values.iter().map(|v| i64::from(*v))),
        Property::ListUShort(values) => all(&mut values.iter().map(|v| i64::from(*v))),
        Property::ListChar(values) => all(&mut values.iter().map(|v| i64::from(*v))),
        Property::ListUChar(values) => all(&mut values.iter().map(|v| i64::from(*v))),
        _ => return None,
    })
}
