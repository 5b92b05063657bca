//! An image to write and draw on, and its file.

use std::path::Path;

use super::colour::Rgb;
use super::font;
use crate::io::hdf5_file::FileError;
use crate::io::lines::write_whole;

/// An image.
pub(super) struct Canvas {
    pub width: usize,
    pub height: usize,
    pixels: Vec<u8>,
}

impl Canvas {
    /// A canvas of one colour.
    pub(super) fn new(width: usize, height: usize, colour: Rgb) -> Self {
        Self { width, height, pixels: colour.repeat(width * height) }
    }

    /// Red, green and blue of each pixel, row by row.
    pub(super) fn into_pixels(self) -> Vec<u8> {
        self.pixels
    }

    /// Colours a pixel; outside nothing happens.
    pub(super) fn set(&mut self, x: i64, y: i64, colour: Rgb) {
        if (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y) {
            let at = 3 * (y as usize * self.width + x as usize);
            self.pixels[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Colour of a pixel.
    #[cfg(test)]
    pub(super) fn pixel(&self, x: usize, y: usize) -> Rgb {
        let at = 3 * (y * self.width + x);
        [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]
    }

    /// Fills a rectangle.
    pub(super) fn fill(&mut self, x: i64, y: i64, width: i64, height: i64, colour: Rgb) {
        for row in y..y + height {
            (x..x + width).for_each(|column| self.set(column, row, colour));
        }
    }

    /// Writes a text with the upper left corner of its capitals at `(x, y)`; they are `7 size` pixels high.
    pub(super) fn text(&mut self, x: i64, y: i64, size: i64, text: &str, colour: Rgb) {
        font::draw(size, text, |column, row, coverage| self.blend(x + column, y + row, colour, coverage));
    }

    /// Pixels that a text is wide.
    pub(super) fn text_width(size: i64, text: &str) -> i64 {
        font::draw(size, text, |_, _, _| ())
    }

    /// Mixes a share of a colour into a pixel; outside nothing happens.
    pub(super) fn blend(&mut self, x: i64, y: i64, colour: Rgb, share: f32) {
        if (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y) {
            let at = 3 * (y as usize * self.width + x as usize);
            for (pixel, value) in self.pixels[at..at + 3].iter_mut().zip(colour) {
                *pixel =
                    (f32::from(value) - f32::from(*pixel)).mul_add(share, f32::from(*pixel)).round() as u8;
            }
        }
    }

    /// The image as PNG.
    pub(super) fn png(&self) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// Not collective. Writes the image as PNG, under a temporary name first.
    pub(super) fn save(&self, path: &Path) -> Result<(), FileError> {
        // In memory first, as a buffered writer hides the error of its last piece.
        let saved = self.png().and_then(|bytes| write_whole(path, &bytes));
        saved.map_err(|source| FileError::System { path: path.into(), action: "write the picture", source })
    }
}
