//! Title and caption above a picture.

use crate::picture::paper::canvas::Canvas;
use crate::picture::paper::colour::Paper;

/// Most lines of each.
const LINES: usize = 3;

/// Title and caption in lines.
pub(in crate::picture) struct Heading {
    title: Vec<String>,
    caption: Vec<String>,
    /// Pixels that they need beside those of a line each.
    pub(in crate::picture) extra: i64,
}

impl Heading {
    pub(in crate::picture) fn new(canvas: &Canvas, title: &str, caption: &str) -> Self {
        let width = canvas.width as i64 - 2 * canvas.px(24.0);
        let (title, caption) =
            (canvas.lines(3.0, title, width, LINES), canvas.lines(2.0, caption, width, LINES));
        let more = |lines: &[String], height: f64| canvas.px(height * lines.len().saturating_sub(1) as f64);
        let extra = more(&title, 32.0) + more(&caption, 24.0);
        Self { title, caption, extra }
    }

    pub(in crate::picture) fn write(&self, canvas: &mut Canvas, paper: &Paper) {
        let (left, mut row) = (canvas.px(24.0), canvas.px(20.0));
        for line in &self.title {
            canvas.text(left, row, 3.0, line, paper.ink);
            row += canvas.px(32.0);
        }
        let mut row = row.max(canvas.px(52.0)) + canvas.px(8.0);
        for line in &self.caption {
            canvas.text(left, row, 2.0, line, paper.ink);
            row += canvas.px(24.0);
        }
    }
}
