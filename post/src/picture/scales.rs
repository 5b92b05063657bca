//! Scales, legends and numbers beside a picture.
use std::ops::RangeInclusive;

use super::camera::{Bounds, Camera};
use super::paper::canvas::Canvas;
use super::paper::colour::{Map, Paper, Rgb, class};
use super::tint::Tint;
use agimp::text::{number, without_zeros};

/// From the legend to the right edge, in units of the layout.
pub(super) const WIDTH: f64 = 185.0;

/// No axis has more ticks.
const MOST_TICKS: f64 = 100.0;

/// Place of the drawing, pixels.
pub(super) struct Plot {
    pub columns: [f64; 2],
    pub rows: [f64; 2],
}

impl Plot {
    /// Visible part of the frame of a plane picture.
    pub(super) fn visible(&self, camera: &Camera, frame: &Bounds) -> Bounds {
        let low = camera.point(self.columns[0], self.rows[1], 0.0);
        let high = camera.point(self.columns[1], self.rows[0], 0.0);
        let window = Bounds { low: [low[0], low[1], frame.low[2]], high: [high[0], high[1], frame.high[2]] };
        let seen = frame.cut(&window);
        if (0..2).all(|axis| seen.low[axis] < seen.high[axis]) { seen } else { window }
    }

    /// Clears the pixels outside: beyond the frame of a plane picture, else below title and legend.
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

/// The unit of the numbers at the axes.
#[derive(Clone, Copy)]
pub(super) struct Metric {
    /// Metres of it.
    by: f64,
    name: &'static str,
}

impl Metric {
    /// The unit in which the places of a plane picture have few digits.
    pub(super) fn of(frame: &Bounds) -> Self {
        let places = frame.low[..2].iter().chain(&frame.high[..2]);
        let (by, name) = match places.fold(0.0, |most: f64, x| most.max(x.abs())) {
            ..2e-5 => (1e-6, "µm"),
            ..2e-2 => (1e-3, "mm"),
            2e4.. => (1e3, "km"),
            _ => (1.0, "m"),
        };
        Self { by, name }
    }

    /// Ticks of an axis from `low` to `high`, m, with their numbers: no two ticks of a spacing have the same.
    fn ticks(self, [low, high]: [f64; 2], spacing: f64) -> Vec<(f64, String)> {
        let (first, last) = ((low / spacing - 1e-9).ceil(), (high / spacing + 1e-9).floor());
        // Too many if the frame has almost no length.
        let count = if last - first < MOST_TICKS { (last - first) as i64 + 1 } else { 0 };
        let decimals = (-(spacing / self.by).log10() - 1e-9).ceil().clamp(0.0, 15.0) as usize;
        let tick = |n: i64| {
            let place = (first + n as f64) * spacing;
            let text = format!("{:.decimals$}", place / self.by);
            let text = without_zeros(&text);
            (place, if text == "-0" { "0".to_owned() } else { text.to_owned() })
        };
        (0..count).map(tick).collect()
    }

    /// Ticks as close as their numbers have room: `needed` gives the width of a number, `scale` that of a
    /// metre, pixels.
    fn fitting(self, span: [f64; 2], scale: f64, needed: impl Fn(&str) -> i64) -> Vec<(f64, String)> {
        let mut spacing = nice((span[1] - span[0]) / 8.0);
        loop {
            let ticks = self.ticks(span, spacing);
            let widest = ticks.iter().map(|(_, text)| needed(text)).max().unwrap_or(0);
            if ticks.len() < 2 || widest as f64 <= spacing * scale {
                return ticks;
            }
            // From 1 to 2, from 2 to 5, from 5 to 10.
            spacing = nice(2.6 * spacing);
        }
    }

    /// Pixels of the widest number between two places.
    pub(super) fn widest(self, canvas: &Canvas, span: [f64; 2]) -> i64 {
        let ticks = self.ticks(span, nice((span[1] - span[0]) / 8.0));
        ticks.iter().map(|(_, text)| canvas.text_width(2.0, text)).max().unwrap_or(0)
    }
}

/// Lines and numbers along the lower and the left side of a plane picture.
pub(super) fn axes(canvas: &mut Canvas, camera: &Camera, frame: &Bounds, paper: &Paper) {
    let (ink, metric) = (paper.ink, Metric::of(frame));
    let [left, bottom, _] = camera.project(frame.low).map(|x| x as i64);
    let [right, top, _] = camera.project(frame.high).map(|x| x as i64);
    canvas.fill(left, bottom, right - left + 1, 2, ink);
    canvas.fill(left - 2, top, 2, bottom - top + 2, ink);
    let (gap, length) = (canvas.px(12.0), canvas.px(8.0));
    let across = metric
        .fitting([frame.low[0], frame.high[0]], camera.scale, |text| canvas.text_width(2.0, text) + gap);
    for (x, text) in across {
        let column = camera.project([x, 0.0, 0.0])[0] as i64;
        canvas.fill(column, bottom, 2, length, ink);
        canvas.text(column - canvas.text_width(2.0, &text) / 2, bottom + canvas.px(14.0), 2.0, &text, ink);
    }
    let upward = metric.fitting([frame.low[1], frame.high[1]], camera.scale, |_| canvas.px(22.0));
    for (y, text) in upward {
        let row = camera.project([0.0, y, 0.0])[1] as i64;
        canvas.fill(left - 2 - length, row, length, 2, ink);
        let column = left - canvas.px(14.0) - canvas.text_width(2.0, &text);
        canvas.text(column, row - canvas.px(7.0), 2.0, &text, ink);
    }
    canvas.text(right + length, bottom - length, 2.0, metric.name, ink);
}

/// Name and unit of a field beside the drawing, from the row `top` on; the column of both and the row below
/// them.
fn heading(canvas: &mut Canvas, tint: &Tint, paper: &Paper, top: i64) -> (i64, i64) {
    let x = canvas.width as i64 - canvas.px(WIDTH);
    let mut row = top;
    for line in canvas.lines(2.0, &tint.name.replace('_', " "), canvas.px(WIDTH - 10.0), 4) {
        canvas.text(x, row, 2.0, &line, paper.ink);
        row += canvas.px(24.0);
    }
    if !tint.unit.is_empty() {
        canvas.text(x, row, 2.0, &format!("[{}]", tint.unit), paper.ink);
    }
    (x, row + canvas.px(30.0))
}

/// The bar of the colours below the row `top`; `room` stays free below it, in units of the layout.
pub(super) fn colour_bar(
    canvas: &mut Canvas,
    tint: &Tint,
    ([low, high], [is_below, is_above]): ([f64; 2], [bool; 2]),
    (map, paper): (Map, &Paper),
    (top, room): (i64, f64),
) {
    let (x, top) = heading(canvas, tint, paper, top);
    let length = (canvas.height as i64 - top - canvas.px(80.0 + room)).max(10);
    let width = canvas.px(24.0);
    for row in 0..length {
        let value = 1.0 - row as f64 / (length - 1) as f64;
        canvas.fill(x, top + row, width, 1, map.colour(value));
    }
    // As many numbers as there is room for.
    let parts = [4, 2].into_iter().find(|parts| length / parts >= canvas.px(22.0)).unwrap_or(1);
    for tick in 0..=parts {
        let part = tick as f64 / parts as f64;
        let row = top + ((1.0 - part) * (length - 1) as f64) as i64;
        canvas.fill(x + width, row, canvas.px(6.0), 1, paper.ink);
        let sign = match tick {
            0 if is_below => "≤ ",
            _ if tick == parts && is_above => "≥ ",
            _ => "",
        };
        let value = within(low + part * (high - low), [low, high]);
        canvas.text(x + canvas.px(34.0), row - canvas.px(7.0), 2.0, &format!("{sign}{value}"), paper.ink);
    }
}

/// Names of classes beside their colours, below the row `top`.
pub(super) fn legend(
    canvas: &mut Canvas,
    tint: &Tint,
    numbers: RangeInclusive<usize>,
    (paper, top): (&Paper, i64),
) {
    let (x, top) = heading(canvas, tint, paper, top);
    let (line, text) = (canvas.px(30.0), x + canvas.px(34.0));
    let all = numbers.clone().count();
    let fitting = ((canvas.height as i64 - top) / line.max(1)).clamp(1, 64) as usize;
    // The last line counts those without one.
    let shown = if all <= fitting { all } else { fitting - 1 };
    for (row, number) in (0..).map(|n| top + line * n).zip(numbers.take(shown)) {
        canvas.fill(x, row, canvas.px(24.0), canvas.px(20.0), class(number));
        let name = tint.names.get(number).map_or_else(|| number.to_string(), String::clone);
        let name = canvas.shortened(2.0, &name, canvas.width as i64 - text - canvas.px(4.0));
        canvas.text(text, row + canvas.px(3.0), 2.0, &name, paper.ink);
    }
    if shown < all {
        let more = format!("and {} more", all - shown);
        canvas.text(x, top + line * shown as i64 + canvas.px(3.0), 2.0, &more, paper.ink);
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

/// A number of a scale from `low` to `high`, with enough digits to distinguish its numbers.
pub(super) fn within(value: f64, [low, high]: [f64; 2]) -> String {
    let (greatest, span) = (low.abs().max(high.abs()), high - low);
    let digits = if span > 0.0 { (greatest / span).log10().ceil().clamp(0.0, 12.0) as usize + 3 } else { 3 };
    number(if value.abs() < 1e-12 * greatest.max(1.0) { 0.0 } else { value }, digits)
}
