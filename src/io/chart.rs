//! Curves over an axis, as SVG.
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use crate::text::number;

/// Colours of the curves of a chart, in their order; the first is for a curve alone.
pub(crate) const COLOURS: [&str; 8] =
    ["#1f6fb4", "#d9662b", "#2b9348", "#a33ea1", "#c9a227", "#3aa6a6", "#8c564b", "#6b7280"];
/// Columns of a chart in which a curve keeps its least and its greatest value.
const COLUMNS: usize = 400;
/// Decades that a logarithmic axis has at most.
const DECADES: i32 = 12;

/// Error of a drawing.
type Failure = Box<dyn std::error::Error>;
/// A part of a picture.
pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Curves that share two axes.
pub(crate) struct Chart {
    /// What the horizontal axis shows, with its unit.
    pub across: String,
    /// What the vertical axis shows.
    pub up: String,
    /// Whether 0 belongs to both axes.
    pub from_zero: bool,
    /// Whether the vertical axis is logarithmic; values that are not positive are left out then.
    pub is_logarithmic: bool,
    /// Points of the curves. Gaps are where a value is not a number.
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
    pub(crate) fn svg(&self, size: (u32, u32)) -> Result<String, String> {
        let mut text = String::new();
        let draw = |text: &mut String| {
            let area = SVGBackend::with_string(text, size).into_drawing_area();
            self.draw(&area, f64::from(size.1) / 240.0)?;
            area.present()?;
            Ok::<(), Failure>(())
        };
        draw(&mut text).map_err(|error| error.to_string())?;
        Ok(text)
    }

    /// Draws the chart into an area; letters and lines are `size` times as large as usual.
    ///
    /// # Errors
    /// The numbers cannot be drawn.
    pub(crate) fn draw(&self, area: &Area<'_>, size: f64) -> Result<(), Failure> {
        let points = || self.curves.iter().flatten().filter(|(x, y)| (x + y).is_finite());
        let across = span(points().map(|p| p.0), self.from_zero, if self.from_zero { 0.04 } else { 0.0 });
        if self.is_logarithmic {
            let values = points().map(|p| p.1).filter(|y| *y > 0.0);
            let (low, high) =
                values.fold((f64::MAX, 0.0), |(low, high): (f64, f64), y| (low.min(y), high.max(y)));
            let high = if high > 0.0 { 1.5 * high } else { 1.0 };
            let up = (low / 1.5).max(high * 10_f64.powi(-DECADES)).min(0.1 * high)..high;
            return self.fill(area, size, across, up.log_scale());
        }
        self.fill(area, size, across, span(points().map(|p| p.1), self.from_zero, 0.04))
    }

    fn fill<Y>(&self, area: &Area<'_>, size: f64, across: Range<f64>, up: Y) -> Result<(), Failure>
    where
        Y: AsRangedCoord<Value = f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let pixels = |length: f64| (length * size).round() as u32;
        let mut chart = ChartBuilder::on(area)
            .margin(pixels(12.0))
            .x_label_area_size(pixels(40.0))
            .y_label_area_size(pixels(64.0))
            .build_cartesian_2d(across.clone(), up)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(228, 228, 224).stroke_width(pixels(1.0)))
            .axis_style(RGBColor(120, 120, 120).stroke_width(pixels(1.0)))
            .x_labels(6)
            .y_labels(6)
            .x_desc(&*self.across)
            .y_desc(&*self.up)
            .label_style(("sans-serif", pixels(12.0)))
            .x_label_formatter(&short)
            .y_label_formatter(&short)
            .draw()?;
        for (number, curve) in self.curves.iter().enumerate() {
            let colour = rgb(COLOURS[number % COLOURS.len()]);
            // A line for each piece between gaps.
            for piece in curve.split(|(x, y)| !(x + y).is_finite() || self.is_logarithmic && *y <= 0.0) {
                let points = thinned(piece, &across);
                chart.draw_series(LineSeries::new(points, colour.stroke_width(pixels(1.6))))?;
            }
        }
        Ok(())
    }
}

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

/// A curve of at most four points for each column of the picture: its ends there, its least and greatest value.
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

/// A number at an axis.
fn short(value: &f64) -> String {
    match value.abs() {
        ..1e-12 => "0".to_owned(),
        1e5.. => format!("{value:.1e}"),
        _ => number(*value, 4),
    }
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

    #[test]
    fn numbers_at_axes_are_short() {
        assert_eq!(
            [0.0, 0.05, 1250.0, 2.5e6, -0.25, 1e-7].map(|x| short(&x)),
            ["0", "0.05", "1250", "2.5e6", "-0.25", "1e-7"]
        );
    }
}
