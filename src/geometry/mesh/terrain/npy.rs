//! Arrays of NumPy: one (`.npy`), or several in an archive (`.npz`).
use std::io::{Cursor, Read};

use npyz::{DType, NpyFile, Order, TypeChar};

use super::raster::{MOST, Placing, Raster, checked_size};
use crate::text::excerpt;

/// Most bytes of a header; one of an array of numbers has 128.
const HEADER: usize = 4096;

/// Most bytes of an array.
const MOST_BYTES: u64 = 8 * MOST as u64 + HEADER as u64;

/// Reads an array of two dimensions, whose first row is the northernmost.
pub(super) fn parse(bytes: &[u8], placing: &Placing) -> Result<Raster, String> {
    let wrong = |error: std::io::Error| error.to_string();
    check_header(bytes)?;
    let file = NpyFile::new(Cursor::new(bytes)).map_err(wrong)?;
    let size = match file.shape() {
        [rows, columns] => checked_size([*columns, *rows])?,
        shape => return Err(format!("it has the shape {shape:?}; expected two dimensions")),
    };
    let order = file.order();
    let DType::Plain(kind) = file.dtype() else {
        return Err("its elements are structures; expected numbers".into());
    };
    let wide = kind.size_field();
    // The file must be long enough for the heights that its header declares.
    if wide.saturating_mul((size[0] * size[1]) as u64) > bytes.len() as u64 {
        return Err(format!("it ends before its {} x {} heights are complete", size[0], size[1]));
    }
    let values: Vec<f64> = match (kind.type_char(), wide) {
        (TypeChar::Float, 8) => file.into_vec::<f64>(),
        (TypeChar::Float, 4) => file.into_vec::<f32>().map(|all| all.into_iter().map(f64::from).collect()),
        (TypeChar::Int, 1) => file.into_vec::<i8>().map(|all| all.into_iter().map(f64::from).collect()),
        (TypeChar::Int, 2) => file.into_vec::<i16>().map(|all| all.into_iter().map(f64::from).collect()),
        (TypeChar::Int, 4) => file.into_vec::<i32>().map(|all| all.into_iter().map(f64::from).collect()),
        (TypeChar::Int, 8) => file.into_vec::<i64>().map(|all| all.into_iter().map(|v| v as f64).collect()),
        (TypeChar::Uint, 1) => file.into_vec::<u8>().map(|all| all.into_iter().map(f64::from).collect()),
        (TypeChar::Uint, 2) => file.into_vec::<u16>().map(|all| all.into_iter().map(f64::from).collect()),
        (TypeChar::Uint, 4) => file.into_vec::<u32>().map(|all| all.into_iter().map(f64::from).collect()),
        (TypeChar::Uint, 8) => file.into_vec::<u64>().map(|all| all.into_iter().map(|v| v as f64).collect()),
        _ => return Err(format!("its elements are {kind}; expected integers, or floats of 4 or 8 bytes")),
    }
    .map_err(wrong)?;
    let [columns, rows] = size;
    let values = match order {
        Order::C => values,
        Order::Fortran => {
            (0..rows * columns).map(|at| values[at / columns + rows * (at % columns)]).collect()
        }
    };
    Raster::from_north(&values, size, None, placing, None)
}

/// Reads an array of an archive: the one that the job names, or the only one.
pub(super) fn parse_archive(bytes: &[u8], placing: &Placing) -> Result<Raster, String> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| error.to_string())?;
    let mut names: Vec<String> =
        archive.file_names().filter_map(|name| Some(name.strip_suffix(".npy")?.to_owned())).collect();
    names.sort_unstable();
    let listed = |names: &[String]| {
        let shown: Vec<String> =
            names.iter().take(9).map(|name| format!("\"{}\"", excerpt(name, 40))).collect();
        if names.is_empty() { "none".into() } else { shown.join(", ") }
    };
    let name = match (&placing.array, names.as_slice()) {
        (Some(array), _) if names.contains(array) => array,
        (Some(array), _) => {
            return Err(format!("it has no array \"{}\"; it has {}", excerpt(array, 40), listed(&names)));
        }
        (None, [only]) => only,
        (None, _) => return Err(format!("it has the arrays {}; name one in the job: array", listed(&names))),
    };
    let entry = archive.by_name(&format!("{name}.npy")).map_err(|error| error.to_string())?;
    let mut array = Vec::new();
    entry.take(MOST_BYTES + 1).read_to_end(&mut array).map_err(|error| error.to_string())?;
    if array.len() as u64 > MOST_BYTES {
        return Err(format!("its array \"{}\" has more than {MOST} heights", excerpt(name, 40)));
    }
    parse(&array, placing)
}

/// A header must be short and flat: its parser recurses as deep as its brackets.
fn check_header(bytes: &[u8]) -> Result<(), String> {
    if !bytes.starts_with(b"\x93NUMPY") || bytes.len() < 12 {
        return Err("it does not start with the header of an array".into());
    }
    let (length, from) = match bytes[6] {
        1 => (usize::from(u16::from_le_bytes([bytes[8], bytes[9]])), 10),
        _ => (u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize, 12),
    };
    let header = bytes.get(from..from + length.min(HEADER + 1)).ok_or("it ends inside its header")?;
    let deep = header.iter().filter(|c| b"([{".contains(c)).count();
    if length > HEADER || deep > 20 {
        return Err("its header does not describe an array of numbers".into());
    }
    Ok(())
}
