//! Vectors as arrows on a lattice of the picture, with an arrow beside them for their scale.
use crate::picture::camera::Camera;
use crate::picture::drawing::Drawing;
use crate::picture::paper::canvas::Canvas;
use crate::picture::paper::colour::Rgb;
use crate::picture::scales::{self, nice, short};
use crate::picture::scene::Splat;
use crate::picture::settings::Settings;

/// Pixels between arrows.
const SPACING: f64 = 26.0;
/// Length of the longest arrow, pixels: it may reach into the next place, not beyond it.
const LONGEST: f64 = 44.0;
/// Length below which no arrow is drawn, pixels.
const SHORTEST: f64 = 2.5;

/// Mean of the vectors about a place of the lattice.
#[derive(Clone, Copy, Default)]
struct Mean {
    place: [f64; 3],
    vector: [f64; 3],
    count: f64,
}

impl Drawing {
    /// Draws the arrows of the visible particles.
    pub(in crate::picture) fn arrows(
        &self,
        canvas: &mut Canvas,
        camera: &Camera,
        settings: &Settings,
        is_seen: impl Fn(&Splat, [f64; 3]) -> bool,
    ) {
        let longest = settings.longest.unwrap_or_else(|| self.vectors.longest());
        if self.vectors.each.is_empty() {
            return;
        }
        let scale = if longest > 0.0 { LONGEST / longest } else { 0.0 };
        let (columns, rows) =
            ((canvas.width as f64 / SPACING) as usize + 1, (canvas.height as f64 / SPACING) as usize + 1);
        let mut lattice = vec![Mean::default(); columns * rows];
        for (splat, vector) in self.splats.iter().zip(&self.vectors.each) {
            let at = camera.project(splat.position);
            let inside = at[0] >= 0.0 && at[1] >= 0.0 && vector.iter().all(|x| x.is_finite());
            let (column, row) = ((at[0] / SPACING) as usize, (at[1] / SPACING) as usize);
            if !inside || column >= columns || row >= rows || !is_seen(splat, at) {
                continue;
            }
            let mean = &mut lattice[row * columns + column];
            for axis in 0..3 {
                mean.place[axis] += splat.position[axis];
                mean.vector[axis] += vector[axis];
            }
            mean.count += 1.0;
        }
        let paper = settings.paper();
        for mean in lattice.iter().filter(|mean| mean.count > 0.0) {
            let place = mean.place.map(|x| x / mean.count);
            let from = camera.project(place);
            // Projected length of the vector in pixels, at the length of the scale.
            let end =
                camera.project(std::array::from_fn(|axis| place[axis] + mean.vector[axis] / mean.count));
            let way = [0, 1].map(|i| (end[i] - from[i]) / camera.scale * scale);
            arrow(canvas, [from[0] - 0.5 * way[0], from[1] - 0.5 * way[1]], way, [paper.ink, paper.paper]);
        }
    }

    /// The arrow of the scale.
    pub(in crate::picture) fn arrow_of_scale(&self, canvas: &mut Canvas, settings: &Settings) {
        let longest = settings.longest.unwrap_or_else(|| self.vectors.longest());
        if self.vectors.each.is_empty() || longest <= 0.0 {
            return;
        }
        let paper = settings.paper();
        let (value, unit) = (nice(longest), &self.vectors.unit);
        let (x, y) = (canvas.width as i64 - canvas.px(scales::WIDTH), canvas.height as i64 - canvas.px(44.0));
        arrow(canvas, [x as f64, y as f64], [value * LONGEST / longest, 0.0], [paper.ink, paper.paper]);
        let (right, half) = (x + LONGEST as i64 + canvas.px(10.0), canvas.px(7.0));
        canvas.text(right, y - half, 2.0, &format!("{} {unit}", short(value)), paper.ink);
        canvas.text(x, y + 2 * half, 2.0, &self.vectors.name, paper.ink);
    }
}

/// An arrow from a pixel along a way, with an edge of the other colour.
fn arrow(canvas: &mut Canvas, from: [f64; 2], way: [f64; 2], [ink, edge]: [Rgb; 2]) {
    let length = way[0].hypot(way[1]);
    if length < SHORTEST {
        return;
    }
    let (along, across) = ([way[0] / length, way[1] / length], [-way[1] / length, way[0] / length]);
    let at = |a: f64, b: f64| [0, 1].map(|i| from[i] + a * along[i] + b * across[i]);
    let head = (0.45 * length).min(9.0);
    let outline = |room: f64| {
        let (half, wide) = (0.8 + room, 0.42 * head + room);
        let neck = length - head;
        [
            at(-room, -half),
            at(neck - room, -half),
            at(neck - room, -wide - room),
            at(length + 2.0 * room, 0.0),
            at(neck - room, wide + room),
            at(neck - room, half),
            at(-room, half),
        ]
    };
    canvas.polygon(&outline(0.9), edge);
    canvas.polygon(&outline(0.0), ink);
}
