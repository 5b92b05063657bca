//! Line charts as SVG.
use std::fmt::Write as _;

const SIZE: [f64; 2] = [720.0, 420.0];
/// Left, right, top, bottom.
const MARGIN: [f64; 4] = [84.0, 24.0, 40.0, 56.0];
const COLOURS: [&str; 7] = ["#111111", "#1b6ca8", "#c8502d", "#3c8d40", "#8450a8", "#a07d1c", "#555555"];

/// A curve or, with `marks`, points.
pub(crate) struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points.
    pub points: Vec<[f64; 2]>,
    /// Whether points are marked and not joined.
    pub marks: bool,
}

/// A chart with two axes.
pub(crate) struct Chart<'a> {
    /// Title.
    pub title: &'a str,
    /// Labels of the axes.
    pub labels: [&'a str; 2],
    /// Which axes are logarithmic.
    pub logarithmic: [bool; 2],
    /// What is drawn.
    pub series: Vec<Series>,
}

impl Chart<'_> {
    /// The chart as an SVG document.
    pub(crate) fn svg(&self) -> String {
        let axes: [Axis; 2] = std::array::from_fn(|i| {
            let values = self.series.iter().flat_map(|s| &s.points).map(|p| p[i]);
            Axis::new(values, self.logarithmic[i])
        });
        let [left, right, top, bottom] = MARGIN;
        let (width, height) = (SIZE[0] - left - right, SIZE[1] - top - bottom);
        let place = |p: [f64; 2]| [left + width * axes[0].at(p[0]), top + height * (1.0 - axes[1].at(p[1]))];
        let mut svg = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {} {}' font-family='sans-serif' font-size='13'>\n\
             <rect width='100%' height='100%' fill='white'/>\n\
             <text x='{left}' y='24' font-size='16'>{}</text>\n",
            SIZE[0], SIZE[1], self.title
        );
        for (tick, label) in axes[0].ticks() {
            let x = left + width * tick;
            let (low, text) = (top + height, top + height + 18.0);
            let _ = writeln!(
                svg,
                "<path d='M{x:.1} {top:.1}V{low:.1}' stroke='#ddd'/>\
                 <text x='{x:.1}' y='{text:.1}' text-anchor='middle'>{label}</text>"
            );
        }
        for (tick, label) in axes[1].ticks() {
            let y = top + height * (1.0 - tick);
            let (text, end) = (left - 6.0, left + width);
            let _ = writeln!(
                svg,
                "<path d='M{left:.1} {y:.1}H{end:.1}' stroke='#ddd'/>\
                 <text x='{text:.1}' y='{y:.1}' dy='4' text-anchor='end'>{label}</text>"
            );
        }
        let (middle, below) = (left + 0.5 * width, SIZE[1] - 14.0);
        let _ = writeln!(
            svg,
            "<text x='{middle}' y='{below}' text-anchor='middle'>{}</text>\
             <text transform='translate(18 {}) rotate(-90)' text-anchor='middle'>{}</text>",
            self.labels[0],
            top + 0.5 * height,
            self.labels[1]
        );
        for (number, series) in self.series.iter().enumerate() {
            let colour = COLOURS[number % COLOURS.len()];
            let points: Vec<[f64; 2]> = series.points.iter().map(|&p| place(p)).collect();
            if series.marks {
                for [x, y] in &points {
                    let _ = writeln!(svg, "<circle cx='{x:.1}' cy='{y:.1}' r='4' fill='{colour}'/>");
                }
            } else {
                let path: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
                let path = path.join(" ");
                let _ = writeln!(
                    svg,
                    "<polyline points='{path}' fill='none' stroke='{colour}' stroke-width='1.5'/>"
                );
            }
            let (x, y) = (left + 12.0, top + 16.0 + 18.0 * number as f64);
            let _ = writeln!(
                svg,
                "<rect x='{x}' y='{}' width='12' height='6' fill='{colour}'/><text x='{}' y='{}'>{}</text>",
                y - 4.0,
                x + 18.0,
                y + 4.0,
                series.name
            );
        }
        svg.push_str("</svg>\n");
        svg
    }
}

/// Range of one axis; of logarithms where it is logarithmic.
struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, logarithmic: bool) -> Self {
        let values = values.map(|v| if logarithmic { v.log10() } else { v }).filter(|v| v.is_finite());
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
        let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
        let room = if high > low { 0.05 * (high - low) } else { 0.5 };
        Self { low: low - room, high: high + room, logarithmic }
    }

    /// Place of a value, 0 to 1.
    fn at(&self, value: f64) -> f64 {
        let value = if self.logarithmic { value.log10().max(self.low) } else { value };
        (value - self.low) / (self.high - self.low)
    }

    /// Places and labels of the ticks.
    fn ticks(&self) -> Vec<(f64, String)> {
        let span = self.high - self.low;
        let raw = 10f64.powf((span / 5.0).log10().floor());
        let mut step = [1.0, 2.0, 5.0, 10.0].map(|f| f * raw).into_iter().find(|s| span / s <= 7.0);
        if self.logarithmic && span > 2.0 {
            step = step.map(|s| s.max(1.0));
        }
        let step = step.unwrap_or(span);
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        (first..=last)
            .map(|i| {
                let value = i as f64 * step;
                let shown = if self.logarithmic { 10f64.powf(value) } else { value };
                let label = if shown == 0.0 {
                    "0".into()
                } else if shown.abs() < 1e-2 || shown.abs() >= 1e5 {
                    format!("{shown:.0e}")
                } else {
                    format!("{}", (shown * 1e6).round() / 1e6)
                };
                ((value - self.low) / span, label)
            })
            .collect()
    }
}
