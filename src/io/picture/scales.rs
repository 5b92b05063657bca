//! Scales, legends and numbers beside a picture.
use std::ops::RangeInclusive;

use super::Tint;
use super::camera::{Bounds, Camera};
use super::canvas::Canvas;
use super::colour::{Map, Paper, Rgb, class};
use crate::text::{excerpt, number};

/// No axis has more ticks.
const MOST_TICKS: f64 = 100.0;

/// Where the drawing has its place, pixels.
pub(super) struct Plot {
    pub columns: [f64; 2],
    pub rows: [f64; 2],
}

impl Plot {
    /// What is seen of the frame of a plane picture.
    pub(super) fn visible(&self, camera: &Camera, frame: &Bounds) -> Bounds {
        let low = camera.point(self.columns[0], self.rows[1], 0.0);
        let high = camera.point(self.columns[1], self.rows[0], 0.0);
        let window = Bounds { low: [low[0], low[1], frame.low[2]], high: [high[0], high[1], frame.high[2]] };
        let seen = frame.cut(&window);
        if (0..2).all(|axis| seen.low[axis] < seen.high[axis]) { seen } else { window }
    }

    /// Clears what is outside: beyond the frame of a plane picture, else below title and legend.
    pub(super) fn clear_around(
        &self,
        canvas: &mut Canvas,
        camera: &Camera,
        frame: Option<&Bounds>,
        paper: Rgb,
    ) {
        let (width, height) = (canvas.width as i64, canvas.height as i64);
        let (mut columns, mut rows) = ([0, self.columns[1] as i64 + 1], [self.rows[0] as i64 - 25, height]);
        if let Some(frame) = frame {
            let [low, high] = [camera.project(frame.low), camera.project(frame.high)];
            columns = [low[0] as i64, high[0] as i64 + 1];
            rows = [high[1] as i64, low[1] as i64 + 1];
        }
        canvas.fill(0, 0, columns[0], height, paper);
        canvas.fill(columns[1], 0, width - columns[1], height, paper);
        canvas.fill(0, 0, width, rows[0], paper);
        canvas.fill(0, rows[1], width, height - rows[1], paper);
    }
}

/// Lines and numbers along the lower and the left side of a plane picture.
pub(super) fn axes(canvas: &mut Canvas, camera: &Camera, frame: &Bounds, spacing: f64, paper: &Paper) {
    let ink = paper.ink;
    let [left, bottom, _] = camera.project(frame.low).map(|x| x as i64);
    let [right, top, _] = camera.project(frame.high).map(|x| x as i64);
    canvas.fill(left, bottom, right - left + 1, 2, ink);
    canvas.fill(left - 2, top, 2, bottom - top + 2, ink);
    let ticks = |low: f64, high: f64| {
        let (first, last) = ((low / spacing).ceil(), (high / spacing).floor());
        // More than there is room for where the frame is no length at all.
        let count = if last - first < MOST_TICKS { (last - first) as i64 + 1 } else { 0 };
        (0..count).map(move |n| (first + n as f64) * spacing)
    };
    for x in ticks(frame.low[0], frame.high[0]) {
        let column = camera.project([x, 0.0, 0.0])[0] as i64;
        canvas.fill(column, bottom, 2, 8, ink);
        let text = short(x);
        canvas.text(column - Canvas::text_width(2, &text) / 2, bottom + 14, 2, &text, ink);
    }
    for y in ticks(frame.low[1], frame.high[1]) {
        let row = camera.project([0.0, y, 0.0])[1] as i64;
        let text = short(y);
        canvas.fill(left - 10, row, 8, 2, ink);
        canvas.text(left - 14 - Canvas::text_width(2, &text), row - 7, 2, &text, ink);
    }
    canvas.text(right + 8, bottom - 8, 2, "m", ink);
}

/// Name and unit of a field beside the drawing; the row below it.
fn heading(canvas: &mut Canvas, tint: &Tint, paper: &Paper) -> (i64, i64) {
    let x = canvas.width as i64 - 185;
    let lines = lines(&tint.name.replace('_', " "), 175);
    for (line, upwards) in lines.iter().zip((0..lines.len() as i64).rev()) {
        canvas.text(x, 110 - 24 * upwards, 2, line, paper.ink);
    }
    if !tint.unit.is_empty() {
        canvas.text(x, 134, 2, &format!("[{}]", tint.unit), paper.ink);
    }
    (x, 164)
}

/// A name in lines that are not wider than `width` pixels, broken between words; words that are wider stay whole.
pub(super) fn lines(name: &str, width: i64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in name.split_whitespace() {
        match lines.last_mut() {
            Some(line) if Canvas::text_width(2, &format!("{line} {word}")) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The bar of the colours; `room` is what is kept free below it, pixels.
pub(super) fn colour_bar(
    canvas: &mut Canvas,
    tint: &Tint,
    ([low, high], [is_below, is_above]): ([f64; 2], [bool; 2]),
    (map, paper): (Map, &Paper),
    room: i64,
) {
    let (x, top) = heading(canvas, tint, paper);
    let length = (canvas.height as i64 - top - 80 - room).max(10);
    for row in 0..length {
        let value = 1.0 - row as f64 / (length - 1) as f64;
        canvas.fill(x, top + row, 24, 1, map.colour(value));
    }
    for tick in 0..5 {
        let part = f64::from(tick) / 4.0;
        let row = top + ((1.0 - part) * (length - 1) as f64) as i64;
        canvas.fill(x + 24, row, 6, 1, paper.ink);
        let sign = match tick {
            0 if is_below => "≤ ",
            4 if is_above => "≥ ",
            _ => "",
        };
        let value = short(low + part * (high - low));
        canvas.text(x + 34, row - 7, 2, &format!("{sign}{value}"), paper.ink);
    }
}

pub(super) fn legend(canvas: &mut Canvas, tint: &Tint, numbers: RangeInclusive<usize>, paper: &Paper) {
    let (x, top) = heading(canvas, tint, paper);
    for (line, number) in numbers.take(16).enumerate() {
        let row = top + 30 * line as i64;
        canvas.fill(x, row, 24, 20, class(number));
        let name =
            tint.names.get(number).map_or_else(|| number.to_string(), |name| excerpt(name, 14).into_owned());
        canvas.text(x + 34, row + 3, 2, &name, paper.ink);
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `length`.
pub(super) fn nice(length: f64) -> f64 {
    if !(length.is_finite() && length > 0.0) {
        return 1.0;
    }
    let power = 10.0_f64.powi(length.log10().floor() as i32);
    [5.0, 2.0, 1.0].into_iter().map(|digit| digit * power).find(|&x| x <= length).unwrap_or(power)
}

/// A number for a scale.
pub(super) fn short(value: f64) -> String {
    number(if value.abs() < 1e-12 { 0.0 } else { value }, 3)
}
