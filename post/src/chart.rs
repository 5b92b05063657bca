//! Curves over an axis, as SVG.
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use super::picture::further;
use agimp::text::{number, without_zeros};

/// Colours of the first curves of a chart, in their order; the first is for a curve alone.
const COLOURS: [&str; 8] =
    ["#1f6fb4", "#d9662b", "#2b9348", "#a33ea1", "#c9a227", "#3aa6a6", "#8c564b", "#6b7280"];

/// Colour of a curve of a chart, `#rrggbb`.
pub(crate) fn colour(curve: usize) -> String {
    match COLOURS.get(curve) {
        Some(colour) => (*colour).to_owned(),
        None => {
            let [red, green, blue] = further(curve - COLOURS.len());
            format!("#{red:02x}{green:02x}{blue:02x}")
        }
    }
}

/// Columns of a chart in which a curve keeps its least and its greatest value.
const COLUMNS: usize = 400;
/// Decades that a logarithmic axis has at most.
const DECADES: i32 = 12;

/// Error of a drawing.
type Failure = Box<dyn std::error::Error>;
/// A part of a picture.
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Charts beside each other as an SVG of so many pixels.
///
/// # Errors
/// The numbers cannot be drawn; why.
pub fn beside_each_other(charts: &[Chart], size: (u32, u32)) -> Result<String, String> {
    svg(size, |area| {
        area.fill(&WHITE)?;
        let areas = area.split_evenly((1, charts.len()));
        areas.iter().zip(charts).try_for_each(|(area, chart)| chart.draw(area, 1.0))
    })
}

/// A drawing by `draw` as an SVG of so many pixels.
fn svg(size: (u32, u32), draw: impl Fn(&Area<'_>) -> Result<(), Failure>) -> Result<String, String> {
    let mut text = String::new();
    let drawn = |text: &mut String| {
        let area = SVGBackend::with_string(text, size).into_drawing_area();
        draw(&area)?;
        area.present()?;
        Ok::<(), Failure>(())
    };
    drawn(&mut text).map_err(|error| error.to_string())?;
    Ok(text)
}

/// Curves that share two axes.
#[derive(Debug)]
pub struct Chart {
    /// Quantity on the horizontal axis, with its unit.
    pub across: String,
    /// Quantity on the vertical axis.
    pub up: String,
    /// Whether 0 belongs to both axes.
    pub from_zero: bool,
    /// Whether the vertical axis is logarithmic; values that are not positive are left out then.
    pub is_logarithmic: bool,
    /// Points of the curves. A NaN makes a gap.
    pub curves: Vec<Vec<(f64, f64)>>,
}

impl Chart {
    /// Whether any curve has a line to draw.
    pub(crate) fn is_empty(&self) -> bool {
        self.curves.iter().all(|curve| curve.iter().filter(|(x, y)| (x + y).is_finite()).count() < 2)
    }

    /// The chart as an SVG of so many pixels.
    ///
    /// # Errors
    /// The numbers cannot be drawn; why.
    pub fn svg(&self, size: (u32, u32)) -> Result<String, String> {
        svg(size, |area| self.draw(area, f64::from(size.1) / 240.0))
    }

    /// Least and greatest value of the vertical axis.
    fn heights(&self) -> (f64, f64) {
        let values = self.curves.iter().flatten().map(|p| p.1).filter(|y| y.is_finite());
        let (least, most) = values.fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)));
        if least > most { (0.0, 1.0) } else { (least, most) }
    }

    /// Draws the chart into an area; letters and lines are `size` times as large as usual.
    ///
    /// # Errors
    /// The numbers cannot be drawn.
    fn draw(&self, area: &Area<'_>, size: f64) -> Result<(), Failure> {
        let points = || self.curves.iter().flatten().filter(|(x, y)| (x + y).is_finite());
        let across = span(points().map(|p| p.0), self.from_zero, if self.from_zero { 0.04 } else { 0.0 });
        if self.is_logarithmic {
            let values = points().map(|p| p.1).filter(|y| *y > 0.0);
            let (low, high) =
                values.fold((f64::MAX, 0.0), |(low, high): (f64, f64), y| (low.min(y), high.max(y)));
            let high = if high > 0.0 { 1.5 * high } else { 1.0 };
            let up = (low / 1.5).max(high * 10_f64.powi(-DECADES)).min(0.1 * high)..high;
            return self.fill(area, size, across, (up.log_scale(), short));
        }
        let up = span(points().map(|p| p.1), self.from_zero, 0.04);
        let number = |y: f64| within(y, &up);
        self.fill(area, size, across, (up.clone(), number))
    }

    /// `number` writes the numbers of the vertical axis.
    fn fill<Y>(
        &self,
        area: &Area<'_>,
        size: f64,
        across: Range<f64>,
        (up, number): (Y, impl Fn(f64) -> String),
    ) -> Result<(), Failure>
    where
        Y: AsRangedCoord<Value = f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let pixels = |length: f64| (length * size).round() as u32;
        // Upper bounds on the widths of numbers: places between ticks have more digits.
        let widest = |number: &dyn Fn(f64) -> String, [low, high]: [f64; 2]| {
            let texts = (0..=12).map(|i| number(low + f64::from(i) / 12.0 * (high - low)));
            DIGIT * LETTERS * texts.map(|text| text.chars().count()).max().unwrap_or(0) as f64
        };
        let of_across = |x: f64| within(x, &across);
        let wide = widest(&of_across, [across.start, across.end]);
        let (least, most) = self.heights();
        let beside = (widest(&number, [least, most]) + 24.0).max(64.0);
        let room = f64::from(area.dim_in_pixel().0) / size - beside - 24.0;
        let labels = (room / (wide + LETTERS)).clamp(2.0, 6.0) as usize;
        let mut chart = ChartBuilder::on(area)
            .margin(pixels(12.0))
            .margin_right(pixels((0.5 * wide).max(12.0)))
            .x_label_area_size(pixels(40.0))
            .y_label_area_size(pixels(beside))
            .build_cartesian_2d(across.clone(), up)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(228, 228, 224).stroke_width(pixels(1.0)))
            .axis_style(RGBColor(120, 120, 120).stroke_width(pixels(1.0)))
            .x_labels(labels)
            .y_labels(6)
            .x_desc(&*self.across)
            .y_desc(&*self.up)
            .label_style(("sans-serif", pixels(LETTERS)))
            .x_label_formatter(&|x| of_across(*x))
            .y_label_formatter(&|y| number(*y))
            .draw()?;
        for (number, curve) in self.curves.iter().enumerate() {
            let colour = rgb(&colour(number));
            // A line for each piece between gaps.
            for piece in curve.split(|(x, y)| !(x + y).is_finite() || self.is_logarithmic && *y <= 0.0) {
                let points = thinned(piece, &across);
                chart.draw_series(LineSeries::new(points, colour.stroke_width(pixels(1.6))))?;
            }
        }
        Ok(())
    }
}

/// Size of letters, and the width of a digit over it, no less than in usual fonts.
const LETTERS: f64 = 12.0;
const DIGIT: f64 = 0.6;

/// From least to greatest, with a margin on both sides as a share of the whole.
fn span(values: impl Iterator<Item = f64>, from_zero: bool, margin: f64) -> Range<f64> {
    let start = if from_zero { (0.0, 0.0) } else { (f64::INFINITY, f64::NEG_INFINITY) };
    let (least, most) = values.fold(start, |(least, most): (f64, f64), x| (least.min(x), most.max(x)));
    if least > most {
        return 0.0..1.0;
    }
    // A constant stands in the middle.
    let least_width = 1e-12 * least.abs().max(most.abs()).max(f64::MIN_POSITIVE);
    let margin = if most - least > least_width {
        margin * (most - least)
    } else if most == 0.0 {
        1.0
    } else {
        0.5 * most.abs()
    };
    least - margin..most + margin
}

/// The curve with at most four points for each column of the picture: the first, the last, the least and the
/// greatest.
fn thinned(points: &[(f64, f64)], across: &Range<f64>) -> Vec<(f64, f64)> {
    if points.len() <= 4 * COLUMNS {
        return points.to_vec();
    }
    let width = (across.end - across.start) / COLUMNS as f64;
    let column = |x: f64| ((x - across.start) / width) as i64;
    let mut kept = Vec::new();
    for piece in points.chunk_by(|a, b| column(a.0) == column(b.0)) {
        let places = 0..piece.len();
        let least = places.clone().min_by(|&a, &b| piece[a].1.total_cmp(&piece[b].1));
        let most = places.max_by(|&a, &b| piece[a].1.total_cmp(&piece[b].1));
        let mut few: Vec<usize> =
            [Some(0), least, most, Some(piece.len() - 1)].into_iter().flatten().collect();
        few.sort_unstable();
        few.dedup();
        kept.extend(few.into_iter().map(|place| piece[place]));
    }
    kept
}

/// `#rrggbb`.
fn rgb(text: &str) -> RGBColor {
    let part = |at: usize| u8::from_str_radix(text.get(at..at + 2).unwrap_or_default(), 16).unwrap_or(0);
    RGBColor(part(1), part(3), part(5))
}

/// A number at an axis, with enough digits to distinguish the numbers of the axis.
fn within(value: f64, axis: &Range<f64>) -> String {
    let (greatest, span) = (axis.start.abs().max(axis.end.abs()), axis.end - axis.start);
    if value.abs() < 1e-9 * span {
        return "0".to_owned();
    }
    let digits = if span > 0.0 { (greatest / span).log10().ceil().clamp(0.0, 12.0) as usize } else { 0 };
    match greatest {
        1e5.. if digits < 3 => without_zeros_of_power(&format!("{value:.*e}", digits + 2)),
        _ => number(value, digits + 4),
    }
}

/// A number at a logarithmic axis.
fn short(value: f64) -> String {
    match value.abs() {
        ..1e-12 => "0".to_owned(),
        1e5.. => without_zeros_of_power(&format!("{value:.1e}")),
        _ => number(value, 4),
    }
}

/// `2.50e6` without the zeros before the power.
fn without_zeros_of_power(text: &str) -> String {
    let (digits, power) = text.split_once('e').unwrap_or((text, "0"));
    format!("{}e{power}", without_zeros(digits))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(curves: Vec<Vec<(f64, f64)>>, is_logarithmic: bool) -> Chart {
        Chart { across: "time (s)".into(), up: "force (N)".into(), from_zero: false, is_logarithmic, curves }
    }

    #[test]
    fn a_curve_keeps_its_peaks_when_it_is_thinned() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), 0.0)).collect();
        points[54_321].1 = 7.0;
        points[54_322].1 = -3.0;
        let few = thinned(&points, &(0.0..1e5));
        assert!(few.len() < 2000 && few.contains(&(54_321.0, 7.0)) && few.contains(&(54_322.0, -3.0)));
        assert!(few.is_sorted_by(|a, b| a.0 <= b.0));
    }

    #[test]
    fn gaps_part_a_curve_and_nothing_is_no_error() {
        let lines = |chart: &Chart| chart.svg((600, 300)).unwrap().matches("<polyline").count();
        let whole = chart(vec![vec![(0.0, 1.0), (1.0, 2.0), (2.0, 1.0), (3.0, 5.0)]], false);
        let gap = chart(vec![vec![(0.0, 1.0), (1.0, 2.0), (f64::NAN, 0.0), (2.0, 1.0), (3.0, 5.0)]], false);
        assert_eq!(lines(&gap), lines(&whole) + 1);
        for empty in [vec![], vec![vec![]], vec![vec![(0.0, f64::NAN)]], vec![vec![(1.0, 0.0), (1.0, 0.0)]]] {
            assert!(chart(empty.clone(), false).svg((600, 300)).is_ok());
            assert!(chart(empty, true).svg((600, 300)).is_ok());
        }
    }

    /// Numbers at the axes of charts over tiny spans, far from 0, and large: all differ, and none meets
    /// another.
    #[test]
    fn numbers_at_axes_differ_and_do_not_meet() {
        for (from, span) in [(0.0, 1e-3), (0.0, 1.0), (1000.0, 0.1), (1e6, 5.0), (-2e5, 4e5), (0.0, 3e8)] {
            for size in [(1120, 560), (600, 300), (300, 240)] {
                let curve = (0..50).map(|i| f64::from(i) / 49.0).map(|s| (from + s * span, from + s * span));
                let svg = chart(vec![curve.collect()], false).svg(size).unwrap();
                let number = |element: &str, key: &str| -> f64 {
                    let rest = element.split(&format!("{key}=\"")).nth(1).unwrap();
                    rest.split('"').next().unwrap().parse().unwrap()
                };
                let texts = svg.split("<text").skip(1).filter_map(|element| {
                    let words = element.split('>').nth(1)?.split('<').next()?.trim();
                    words.parse::<f64>().ok()?;
                    Some((
                        [number(element, " x"), number(element, " y")],
                        number(element, "font-size"),
                        words,
                    ))
                });
                let texts: Vec<_> = texts.collect();
                assert!(texts.len() >= 4, "{svg}");
                for axis in [0, 1] {
                    // Numbers of the horizontal axis stand in one row, those of the other end in one column.
                    let lowest = texts.iter().map(|(at, ..)| at[1]).fold(0.0, f64::max);
                    let of_axis: Vec<_> =
                        texts.iter().filter(|(at, ..)| (at[1] == lowest) == (axis == 0)).collect();
                    for (i, (at, size, words)) in of_axis.iter().enumerate() {
                        for (other, _, same) in &of_axis[..i] {
                            let width = 0.55 * size * words.len().max(same.len()) as f64;
                            let apart = (at[axis] - other[axis]).abs();
                            assert!(words != same, "{from} + {span}: {words} twice");
                            assert!(
                                apart > if axis == 0 { width } else { *size },
                                "{from} + {span}: {words} and {same}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn numbers_at_axes_are_short() {
        let axis = 0.0..2000.0;
        assert_eq!([0.0, 0.05, 1250.0, -0.25].map(|x| within(x, &axis)), ["0", "0.05", "1250", "-0.25"]);
        assert_eq!([2.5e6, 1e6].map(|x| within(x, &(0.0..3e6))), ["2.5e6", "1e6"]);
        assert_eq!([1000.05, 1000.1].map(|x| within(x, &(1000.0..1000.1))), ["1000.05", "1000.1"]);
        assert_eq!([1e-7, 2.5e6].map(short), ["1e-7", "2.5e6"]);
    }
}
