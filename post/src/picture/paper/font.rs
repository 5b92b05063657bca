//! Text as coverage of pixels: DejaVu Sans, whose outlines `ab_glyph` fills.
use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, PxScaleFont, ScaleFont, point};

/// DejaVu Sans 2.37 (`fonts/LICENSE`): Latin, Greek, Cyrillic, mathematical signs.
static FONT: LazyLock<Option<FontRef<'static>>> =
    LazyLock::new(|| FontRef::try_from_slice(include_bytes!("fonts/DejaVuSans.ttf")).ok());

/// Height of capital letters, pixels.
pub(in crate::picture) fn cap_height(size: f64) -> i64 {
    (7.0 * size).round() as i64
}

/// Size of the font, pixels: capitals of DejaVu Sans are 0.729 em high.
pub(in crate::picture) fn em(size: f64) -> f32 {
    cap_height(size) as f32 / 0.729
}

/// The beginning of a text that is not wider than `width` pixels, and whether that is all of it.
pub(in crate::picture) fn fitting(size: f64, text: &str, width: i64) -> (&str, bool) {
    let (mut pen, mut end) = (Pen::new(size), 0);
    for (at, character) in text.char_indices() {
        pen.add(character);
        if pen.width() > width {
            return (&text[..end], false);
        }
        end = at + character.len_utf8();
    }
    (text, true)
}

/// Positions of the letters of a text.
struct Pen {
    font: Option<PxScaleFont<&'static FontRef<'static>>>,
    /// Where the next letter begins, pixels.
    at: f32,
    before: Option<GlyphId>,
}

impl Pen {
    fn new(size: f64) -> Self {
        let font = FONT.as_ref().map(|font| {
            // Em over height of a line is the font's own.
            let units = font.units_per_em().unwrap_or(2048.0);
            font.as_scaled(em(size) * font.height_unscaled() / units)
        });
        Self { font, at: 0.0, before: None }
    }

    /// Adds a letter; returns its position and glyph.
    fn add(&mut self, character: char) -> Option<(f32, GlyphId)> {
        let font = self.font?;
        let id = font.glyph_id(character);
        self.at += self.before.map_or(0.0, |before| font.kern(before, id));
        let start = self.at;
        self.at += font.h_advance(id);
        self.before = Some(id);
        Some((start, id))
    }

    fn width(&self) -> i64 {
        self.at.ceil() as i64
    }
}

/// Calls `each` with column, row and coverage (0 to 1) of the pixels of a text whose first letter begins at
/// column 0 and whose capital letters have their tops at row 0. Characters that the font does not have are
/// boxes. Returns the width, pixels.
pub(in crate::picture) fn draw(size: f64, text: &str, mut each: impl FnMut(i64, i64, f32)) -> i64 {
    let mut pen = Pen::new(size);
    for character in text.chars() {
        let (Some((start, id)), Some(font)) = (pen.add(character), pen.font) else { continue };
        let glyph = id.with_scale_and_position(font.scale(), point(start, cap_height(size) as f32));
        if let Some(outline) = font.outline_glyph(glyph) {
            let corner = outline.px_bounds().min;
            outline.draw(|column, row, coverage| {
                each(corner.x as i64 + i64::from(column), corner.y as i64 + i64::from(row), coverage);
            });
        }
    }
    pen.width()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns and rows that a text covers by more than half.
    fn covered(text: &str) -> Vec<(i64, i64)> {
        let mut pixels = Vec::new();
        draw(3.0, text, |column, row, coverage| {
            if coverage > 0.5 {
                pixels.push((column, row));
            }
        });
        pixels
    }

    #[test]
    fn capitals_stand_between_top_and_base_line() {
        let rows: Vec<i64> = covered("H").into_iter().map(|(_, row)| row).collect();
        assert_eq!((rows.iter().min(), rows.iter().max()), (Some(&0), Some(&(cap_height(3.0) - 1))));
        assert!(covered("g").iter().any(|&(_, row)| row > cap_height(3.0)), "tails hang below");
    }

    #[test]
    fn titles_may_be_in_any_alphabet() {
        let missing = covered("\u{e000}");
        for character in "'éßµφЖ²³→≤°/%".chars().map(String::from) {
            assert!(!covered(&character).is_empty() && covered(&character) != missing, "{character}");
        }
        let none = |_: i64, _: i64, _: f32| ();
        assert!(draw(2.0, "iiii", none) < draw(2.0, "MMMM", none));
        assert_eq!(draw(2.0, "", none), 0);
    }
}
