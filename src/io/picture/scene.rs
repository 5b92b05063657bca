//! Camera, depth buffer and shading.

use std::ops::Range;

use super::canvas::Canvas;
use super::colour::{Rgb, scaled};

/// A particle to be drawn.
#[derive(Clone, Copy)]
pub(super) struct Splat {
    pub position: [f64; 3],
    pub radius: f64,
    /// Between 0 and 1.
    pub value: f64,
}

/// Lower and upper corner of a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub low: [f64; 3],
    pub high: [f64; 3],
}

impl Bounds {
    fn corners(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        (0..8).map(|i| {
            std::array::from_fn(|axis| if i >> axis & 1 == 0 { self.low[axis] } else { self.high[axis] })
        })
    }

    /// Longest edge.
    pub(super) fn extent(&self) -> f64 {
        (0..3).fold(0.0, |most: f64, axis| most.max(self.high[axis] - self.low[axis]))
    }
}

/// An orthographic camera that fits a box into an image.
pub(super) struct Camera {
    right: [f64; 3],
    up: [f64; 3],
    toward: [f64; 3],
    /// Screen centre in camera coordinates.
    centre: [f64; 2],
    depths: Range<f64>,
    /// Pixels per metre.
    pub scale: f64,
    origin: [f64; 2],
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Camera {
    /// Looks along z from above (`flat`), or obliquely down on the x-y plane with z upwards, at `bounds`,
    /// which fill the given part of the image.
    pub(super) fn new(flat: bool, bounds: &Bounds, x: Range<f64>, y: Range<f64>) -> Self {
        let (right, up, toward) = if flat {
            ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
        } else {
            let ((sa, ca), (se, ce)) = ((-0.9_f64).sin_cos(), 0.42_f64.sin_cos());
            ([-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se])
        };
        let range = |axis: [f64; 3]| {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for corner in bounds.corners() {
                (low, high) = (low.min(dot(axis, corner)), high.max(dot(axis, corner)));
            }
            low..high
        };
        let (across, upward, depths) = (range(right), range(up), range(toward));
        let tiny = f64::MIN_POSITIVE;
        let scale = ((x.end - x.start) / (across.end - across.start).max(tiny))
            .min((y.end - y.start) / (upward.end - upward.start).max(tiny));
        let margin = 0.05 * bounds.extent() + tiny;
        Self {
            right,
            up,
            toward,
            centre: [0.5 * (across.start + across.end), 0.5 * (upward.start + upward.end)],
            depths: depths.start - margin..depths.end + margin,
            scale,
            origin: [0.5 * (x.start + x.end), 0.5 * (y.start + y.end)],
        }
    }

    /// Column, row and depth (towards the viewer, m) of a point.
    pub(super) fn project(&self, point: [f64; 3]) -> [f64; 3] {
        [
            self.origin[0] + self.scale * (dot(self.right, point) - self.centre[0]),
            self.origin[1] - self.scale * (dot(self.up, point) - self.centre[1]),
            dot(self.toward, point),
        ]
    }

    /// Where the ray of a pixel meets the plane of height `z`, and the depth there; not for a flat view.
    fn on_plane(&self, column: f64, row: f64, z: f64) -> ([f64; 3], f64) {
        let a = (column - self.origin[0]) / self.scale + self.centre[0];
        let b = (self.origin[1] - row) / self.scale + self.centre[1];
        let depth = (z - b * self.up[2]) / self.toward[2];
        let point = std::array::from_fn(|i| a * self.right[i] + b * self.up[i] + depth * self.toward[i]);
        (point, depth)
    }
}

/// What a pixel shows.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Seen {
    Nothing,
    Ground { line: bool },
    Particle(u16),
}

/// Depth and value per pixel in one number: the larger one is nearer, so the images of several ranks are
/// combined by an exact maximum, whatever their order.
pub(super) struct Raster {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<u64>,
}

impl Raster {
    /// An empty image.
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![0; width * height] }
    }

    fn put(&mut self, camera: &Camera, column: i64, row: i64, depth: f64, shown: u64) {
        if !(0..self.width as i64).contains(&column) || !(0..self.height as i64).contains(&row) {
            return;
        }
        let whole = camera.depths.end - camera.depths.start;
        let near = ((depth - camera.depths.start) / whole).clamp(0.0, 1.0);
        let key = 1 + (near * f64::from(u32::MAX - 1)) as u64;
        let pixel = &mut self.pixels[row as usize * self.width + column as usize];
        *pixel = (*pixel).max(key << 32 | shown);
    }

    /// Draws a particle as a ball.
    pub(super) fn splat(&mut self, camera: &Camera, splat: &Splat) {
        let [column, row, depth] = camera.project(splat.position);
        let radius = (splat.radius * camera.scale).max(0.75);
        let shown = 2 << 16 | (splat.value.clamp(0.0, 1.0) * f64::from(u16::MAX)) as u64;
        let reach = radius.ceil() as i64;
        let (middle, centre) = ((column.floor() as i64, row.floor() as i64), (column, row));
        for y in middle.1 - reach..=middle.1 + reach {
            for x in middle.0 - reach..=middle.0 + reach {
                let (dx, dy) = (x as f64 + 0.5 - centre.0, y as f64 + 0.5 - centre.1);
                let inside = radius * radius - dx * dx - dy * dy;
                if inside >= 0.0 {
                    self.put(camera, x, y, depth + inside.sqrt() / camera.scale, shown);
                }
            }
        }
    }

    /// Draws the floor at the lower side of `bounds` with lines every `spacing` metres.
    pub(super) fn ground(&mut self, camera: &Camera, bounds: &Bounds, spacing: f64) {
        for row in 0..self.height as i64 {
            for column in 0..self.width as i64 {
                let (point, depth) = camera.on_plane(column as f64 + 0.5, row as f64 + 0.5, bounds.low[2]);
                if (0..2).all(|axis| (bounds.low[axis]..=bounds.high[axis]).contains(&point[axis])) {
                    let line = (0..2).any(|axis| {
                        let place = point[axis] / spacing;
                        (place - place.round()).abs() * spacing * camera.scale < 0.8
                    });
                    self.put(camera, column, row, depth, 1 << 16 | u64::from(line));
                }
            }
        }
    }

    fn seen(&self, at: usize) -> Seen {
        match self.pixels[at] >> 16 & 0xffff {
            0 => Seen::Nothing,
            1 => Seen::Ground { line: self.pixels[at] & 1 == 1 },
            _ => Seen::Particle(self.pixels[at] as u16),
        }
    }

    /// Paints the image; `colour` turns values between 0 and 1 into colours. With `light`, surfaces are
    /// shaded by their slope and darkened behind nearer ones.
    pub(super) fn paint(
        &self,
        camera: &Camera,
        canvas: &mut Canvas,
        light: bool,
        colour: impl Fn(f64) -> Rgb,
    ) {
        let pixels_per_unit =
            camera.scale * (camera.depths.end - camera.depths.start) / f64::from(u32::MAX - 1);
        // Depth in pixels.
        let depth: Vec<f64> = self.pixels.iter().map(|&p| (p >> 32) as f64 * pixels_per_unit).collect();
        let smooth = if light { self.smoothed(&depth) } else { Vec::new() };
        for row in 0..self.height {
            for column in 0..self.width {
                let at = row * self.width + column;
                let base = match self.seen(at) {
                    Seen::Nothing => continue,
                    Seen::Ground { line: true } => [200, 200, 196],
                    Seen::Ground { line: false } => [232, 232, 228],
                    Seen::Particle(value) => colour(f64::from(value) / f64::from(u16::MAX)),
                };
                let factor = if light { self.shade(&smooth, &depth, column, row) } else { 1.0 };
                canvas.set(column as i64, row as i64, scaled(base, factor));
            }
        }
    }

    /// Neighbours of a pixel on a square of half width `reach`.
    fn around(&self, column: usize, row: usize, reach: usize) -> impl Iterator<Item = usize> + '_ {
        let rows = row.saturating_sub(reach)..=(row + reach).min(self.height - 1);
        let columns = column.saturating_sub(reach)..=(column + reach).min(self.width - 1);
        rows.flat_map(move |y| columns.clone().map(move |x| y * self.width + x))
    }

    /// Depth averaged over the surface around, so that slopes show the pile rather than its grains.
    fn smoothed(&self, depth: &[f64]) -> Vec<f64> {
        const REACH: usize = 4;
        const STEP: f64 = 14.0;
        let mut smooth = depth.to_vec();
        for row in 0..self.height {
            for column in 0..self.width {
                let at = row * self.width + column;
                if let Seen::Particle(_) = self.seen(at) {
                    let (mut sum, mut count) = (0.0, 0.0);
                    for near in self.around(column, row, REACH) {
                        let particle = matches!(self.seen(near), Seen::Particle(_));
                        if particle && (depth[near] - depth[at]).abs() < STEP {
                            (sum, count) = (sum + depth[near], count + 1.0);
                        }
                    }
                    smooth[at] = sum / count;
                }
            }
        }
        smooth
    }

    /// Brightness from the slope (light from the upper left) and from what stands in front.
    fn shade(&self, smooth: &[f64], depth: &[f64], column: usize, row: usize) -> f64 {
        let at = row * self.width + column;
        let mut factor = 1.0;
        if let Seen::Particle(_) = self.seen(at) {
            let slope = |one: usize, other: usize, length: f64| {
                let usable = [one, other].into_iter().all(|i| matches!(self.seen(i), Seen::Particle(_)));
                if usable { ((smooth[other] - smooth[one]) / length).clamp(-4.0, 4.0) } else { 0.0 }
            };
            let (left, right) = (at - column.min(2), at + (self.width - 1 - column).min(2));
            let above = at - self.width * row.min(2);
            let below = at + self.width * (self.height - 1 - row).min(2);
            let (x, y) = (slope(left, right, 4.0), slope(above, below, 4.0));
            // Normal (-∂d/∂x, -∂d/∂y, 1) in image axes (y down); the light is a unit vector.
            let facing = (0.45 * x + 0.62 * y + 0.643) / (x * x + y * y + 1.0).sqrt();
            let grain = (smooth[at] - depth[at]).clamp(-4.0, 4.0) * 0.03;
            factor = 0.42 + 0.72 * facing.max(0.0) - grain;
        }
        // Pixels whose surroundings are nearer to the viewer lie in a hollow or behind an edge.
        let mut hidden = 0.0;
        for reach in [3_i64, 8] {
            for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1)] {
                let (x, y) = (column as i64 + dx * reach, row as i64 + dy * reach);
                if (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y) {
                    let near = y as usize * self.width + x as usize;
                    if matches!(self.seen(near), Seen::Particle(_)) {
                        let rise = (depth[near] - depth[at]) / reach as f64 - 2.5;
                        hidden += rise.clamp(0.0, 4.0);
                    }
                }
            }
        }
        factor * (-0.03 * hidden).exp()
    }
}
