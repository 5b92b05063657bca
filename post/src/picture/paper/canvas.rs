//! An image to write and draw on, and its file.

use std::fmt::Write as _;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use crate::picture::paper::colour::Rgb;
use crate::picture::paper::font;
use agimp::io::hdf5_file::FileError;
use agimp::io::whole_file::write_whole;
use agimp::text::{html, printable};

/// A colour in SVG.
fn hex([red, green, blue]: Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// An image.
pub(in crate::picture) struct Canvas {
    pub width: usize,
    pub height: usize,
    /// Pixels of a unit of the layout, in which sizes of letters and margins are given.
    pub unit: f64,
    pixels: Vec<u8>,
    /// Elements of SVG over the pixels, once they are collected.
    marks: Option<String>,
}

impl Canvas {
    /// A canvas of one colour.
    pub(in crate::picture) fn new([width, height]: [usize; 2], unit: f64, colour: Rgb) -> Self {
        Self { width, height, unit, pixels: colour.repeat(width * height), marks: None }
    }

    /// Pixels of a length of the layout.
    pub(in crate::picture) fn px(&self, length: f64) -> i64 {
        (length * self.unit).round() as i64
    }

    /// Red, green and blue of each pixel, row by row.
    pub(in crate::picture) fn into_pixels(self) -> Vec<u8> {
        self.pixels
    }

    /// From here on rectangles, texts and polygons are kept as elements of SVG; earlier ones stay pixels.
    pub(in crate::picture) fn collect(&mut self) {
        self.marks = Some(String::new());
    }

    /// Colours a pixel; places outside are ignored.
    pub(in crate::picture) fn set(&mut self, x: i64, y: i64, colour: Rgb) {
        if (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y) {
            let at = 3 * (y as usize * self.width + x as usize);
            self.pixels[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Colour of a pixel.
    #[cfg(test)]
    pub(in crate::picture) fn pixel(&self, x: usize, y: usize) -> Rgb {
        let at = 3 * (y * self.width + x);
        [self.pixels[at], self.pixels[at + 1], self.pixels[at + 2]]
    }

    /// Fills a rectangle.
    pub(in crate::picture) fn fill(&mut self, x: i64, y: i64, width: i64, height: i64, colour: Rgb) {
        if let Some(marks) = &mut self.marks {
            let colour = hex(colour);
            let _ = writeln!(
                marks,
                "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{colour}\" shape-rendering=\"crispEdges\"/>"
            );
            return;
        }
        for row in y..y + height {
            (x..x + width).for_each(|column| self.set(column, row, colour));
        }
    }

    /// Writes a text with the upper left corner of its capitals at `(x, y)`; they are `7 size` units high.
    pub(in crate::picture) fn text(&mut self, x: i64, y: i64, size: f64, text: &str, colour: Rgb) {
        let (text, size) = (&printable(text), size * self.unit);
        if let Some(marks) = &mut self.marks {
            let (base, em, colour) = (y + font::cap_height(size), font::em(size), hex(colour));
            let _ = writeln!(
                marks,
                "<text x=\"{x}\" y=\"{base}\" font-size=\"{em:.2}\" fill=\"{colour}\">{}</text>",
                html(text)
            );
            return;
        }
        font::draw(size, text, |column, row, coverage| self.blend(x + column, y + row, colour, coverage));
    }

    /// Pixels that a text is wide.
    pub(in crate::picture) fn text_width(&self, size: f64, text: &str) -> i64 {
        font::draw(size * self.unit, text, |_, _, _| ())
    }

    /// A text of at most `width` pixels: an ellipsis replaces the part that does not fit.
    pub(in crate::picture) fn shortened(&self, size: f64, text: &str, width: i64) -> String {
        let text = printable(text);
        match font::fitting(size * self.unit, &text, width) {
            (_, true) => text.into_owned(),
            _ => {
                let room = width - self.text_width(size, "…");
                format!("{}…", font::fitting(size * self.unit, &text, room).0.trim_end())
            }
        }
    }

    /// A text in at most `most` lines of at most `width` pixels: broken between words, and within words that
    /// are wider than a line. An ellipsis replaces the part that does not fit.
    pub(in crate::picture) fn lines(&self, size: f64, text: &str, width: i64, most: usize) -> Vec<String> {
        // Wide gaps between words stay, as they separate groups.
        let text = text.trim().replace(['\n', '\r', '\t'], " ");
        let text = printable(&text);
        let (mut rest, mut lines) = (&*text, Vec::new());
        while !rest.is_empty() {
            let (fitting, is_all) = font::fitting(size * self.unit, rest, width);
            if is_all || lines.len() + 1 >= most {
                lines.push(self.shortened(size, rest, width));
                break;
            }
            let is_word = rest[fitting.len()..].starts_with(' ');
            let end = if is_word { fitting.len() } else { fitting.rfind(' ').unwrap_or(fitting.len()) };
            // A line has a letter at least, however narrow it is.
            let end = end.max(rest.chars().next().map_or(0, char::len_utf8));
            lines.push(rest[..end].trim_end().to_owned());
            rest = rest[end..].trim_start();
        }
        lines
    }

    /// Fills a polygon with smooth edges.
    pub(in crate::picture) fn polygon(&mut self, corners: &[[f64; 2]], colour: Rgb) {
        if let Some(marks) = &mut self.marks {
            let points: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
            let _ = writeln!(marks, "<polygon points=\"{}\" fill=\"{}\"/>", points.join(" "), hex(colour));
            return;
        }
        /// Samples of a pixel along each axis.
        const FINE: i64 = 4;
        let range = |axis: usize, most: usize| {
            let values = || corners.iter().map(|corner| corner[axis]);
            let (low, high) =
                (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
            low.floor().max(0.0) as i64..(high.ceil() + 1.0).clamp(0.0, most as f64) as i64
        };
        for row in range(1, self.height) {
            for column in range(0, self.width) {
                let sample = |n: i64, at: i64| at as f64 + (n as f64 + 0.5) / FINE as f64;
                let inside = (0..FINE * FINE).filter(|n| {
                    let (x, y) = (sample(n % FINE, column), sample(n / FINE, row));
                    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
                    let crossed = edges.filter(|(a, b)| {
                        (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
                    });
                    crossed.count() % 2 == 1
                });
                let share = inside.count() as f32 / (FINE * FINE) as f32;
                if share > 0.0 {
                    self.blend(column, row, colour, share);
                }
            }
        }
    }

    /// Mixes a share of a colour into a pixel; places outside are ignored.
    pub(in crate::picture) fn blend(&mut self, x: i64, y: i64, colour: Rgb, share: f32) {
        if (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y) {
            let at = 3 * (y as usize * self.width + x as usize);
            for (pixel, value) in self.pixels[at..at + 3].iter_mut().zip(colour) {
                *pixel =
                    (f32::from(value) - f32::from(*pixel)).mul_add(share, f32::from(*pixel)).round() as u8;
            }
        }
    }

    /// The image as PNG.
    pub(in crate::picture) fn png(&self) -> std::io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// The image as SVG: its pixels, and over them the collected elements.
    fn svg(&self) -> std::io::Result<String> {
        let (width, height, png) = (self.width, self.height, BASE64.encode(self.png()?));
        Ok(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             xml:space=\"preserve\" font-family=\"DejaVu Sans, Verdana, sans-serif\">\n<image width=\"{width}\" height=\"{height}\" \
             href=\"data:image/png;base64,{png}\"/>\n{}</svg>\n",
            self.marks.as_deref().unwrap_or_default()
        ))
    }

    /// Not collective. Writes the image under a temporary name first: as SVG if marks were collected, else as
    /// PNG.
    pub(in crate::picture) fn save(&self, path: &Path) -> Result<(), FileError> {
        // In memory first, as a buffered writer hides the error of its last piece.
        let bytes = if self.marks.is_some() { self.svg().map(String::into_bytes) } else { self.png() };
        let saved = bytes.and_then(|bytes| write_whole(path, &bytes));
        saved.map_err(|source| FileError::System { path: path.into(), action: "write the picture", source })
    }
}
