//! GeoTIFF: an image of one band whose tags give its place (OGC 19-008).
use std::io::Cursor;

use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::Tag;

use super::raster::{MOST, Placing, Raster, checked_size};

/// `GTModelTypeGeoKey`, and its value for degrees.
const MODEL: [u16; 2] = [1024, 2];

/// `GTRasterTypeGeoKey`, and its value where the place of a pixel is its centre.
const RASTER: [u16; 2] = [1025, 2];

/// Reads the first image.
pub(super) fn parse(bytes: &[u8], placing: &Placing) -> Result<Raster, String> {
    let wrong = |error: tiff::TiffError| error.to_string();
    let mut limits = Limits::default();
    limits.decoding_buffer_size = 8 * MOST;
    limits.intermediate_buffer_size = 8 * MOST;
    let mut image = Decoder::new(Cursor::new(bytes)).map_err(wrong)?.with_limits(limits);
    let (width, height) = image.dimensions().map_err(wrong)?;
    let size = checked_size([u64::from(width), u64::from(height)])?;
    match image.colortype().map_err(wrong)? {
        ColorType::Gray(_) => {}
        other => return Err(format!("it has the bands {other:?}; expected one band of heights")),
    }
    let of_file = place(&mut image, size[1], placing.cell.is_some())?;
    let none = image.get_tag_ascii_string(Tag::GdalNodata).ok();
    let none = none.and_then(|text| text.trim_matches(['\0', ' ']).parse().ok());
    let values = numbers(image.read_image().map_err(wrong)?);
    if values.len() != size[0] * size[1] {
        return Err(format!("it has {} heights; its header says {width} x {height}", values.len()));
    }
    Raster::from_north(&values, size, none, placing, of_file)
}

/// Distance of neighbours and place of the south-western height, if the tags have them.
fn place(
    image: &mut Decoder<Cursor<&[u8]>>,
    rows: usize,
    cell_is_given: bool,
) -> Result<Option<(f64, [f64; 2])>, String> {
    let keys = image.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).unwrap_or_default();
    // Four words for each key, after four of a header; the value is the fourth.
    let has = |[key, value]: [u16; 2]| keys.chunks_exact(4).skip(1).any(|k| k[0] == key && k[3] == value);
    if has(MODEL) && !cell_is_given {
        return Err(
            "its coordinates are degrees; project it to metres (gdalwarp -t_srs), or give cell, m, in the job".into()
        );
    }
    let half = if has(RASTER) { 0.0 } else { 0.5 };
    let mut numbers = |tag: Tag| image.get_tag_f64_vec(tag).ok();
    let (cells, [column, row], [x, y]) = match (
        numbers(Tag::ModelPixelScaleTag).as_deref(),
        numbers(Tag::ModelTiepointTag).as_deref(),
        numbers(Tag::ModelTransformationTag).as_deref(),
    ) {
        (Some([dx, dy, ..]), Some([i, j, _, x, y, ..]), _) => ([*dx, *dy], [*i, *j], [*x, *y]),
        (_, _, Some([dx, xy, _, x, yx, dy, _, y, ..])) if *xy == 0.0 && *yx == 0.0 => {
            ([*dx, -*dy], [0.0; 2], [*x, *y])
        }
        (_, _, Some(_)) => return Err("it is rotated; expected rows from west to east".into()),
        _ => return Ok(None),
    };
    if (cells[0] - cells[1]).abs() > 1e-6 * cells[0].abs() && !cell_is_given {
        return Err(format!("its cells are {} m by {} m; expected squares", cells[0], cells[1]));
    }
    let south = (rows - 1) as f64 - row + half;
    Ok(Some((cells[0], [x + (half - column) * cells[0], y - south * cells[1]])))
}

/// Values of any kind as numbers; all of 32 bits and less are kept.
fn numbers(values: DecodingResult) -> Vec<f64> {
    match values {
        DecodingResult::U8(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::U16(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::U32(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::U64(values) => values.into_iter().map(|value| value as f64).collect(),
        DecodingResult::I8(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::I16(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::I32(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::I64(values) => values.into_iter().map(|value| value as f64).collect(),
        DecodingResult::F16(values) => values.into_iter().map(|value| value.to_f64()).collect(),
        DecodingResult::F32(values) => values.into_iter().map(f64::from).collect(),
        DecodingResult::F64(values) => values,
    }
}
