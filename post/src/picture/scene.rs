//! Depth buffer and shading.

use super::camera::{Bounds, Camera};
use super::layers::solids::Layer;
use super::paper::canvas::Canvas;
use super::paper::colour::{Paper, Rgb, mixed, scaled};

/// Radius of balls over the half width of the particles' boxes, so that no gaps are seen between them.
pub(super) const LARGER: f64 = 1.2;

/// A particle to be drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Splat {
    pub position: [f64; 3],
    /// Half axes along x, y and z, m.
    pub radii: [f64; 3],
    /// Between 0 and 1.
    pub value: f64,
}

impl Splat {
    /// How far its ellipsoid reaches in a direction of length 1, m.
    pub(super) fn reach(&self, direction: &[f64; 3]) -> f64 {
        (0..3).map(|axis| (self.radii[axis] * direction[axis]).powi(2)).sum::<f64>().sqrt()
    }
}

/// Foremost object in a pixel.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Seen {
    Nothing,
    Ground { line: bool },
    Particle(u16),
    Solid,
}

/// Depth and value per pixel in one number: the larger one is nearer, so the images of several ranks are
/// combined by an exact maximum, whatever their order.
pub(super) struct Raster {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<u64>,
    /// Radius of the largest ball of all ranks, pixels.
    pub grain: f64,
}

/// Style of a picture from a raster.
pub(super) struct Looks<'a> {
    pub paper: &'a Paper,
    /// Whether surfaces are shaded by their slope and darkened behind nearer ones.
    pub light: bool,
    pub solids: &'a Layer,
}

impl Raster {
    /// An empty image.
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![0; width * height], grain: 0.0 }
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

    /// Draws a particle as an ellipsoid, or as a rectangle in a plane picture, so that boxes side by side
    /// leave no gap.
    pub(super) fn splat(&mut self, camera: &Camera, splat: &Splat, flat: bool) {
        /// Least half axis, pixels.
        const LEAST: f64 = 0.75;
        let [column, row, depth] = camera.project(splat.position);
        let splat = Splat { radii: splat.radii.map(|radius| radius.max(LEAST / camera.scale)), ..*splat };
        let reach = [camera.right, camera.up].map(|axis| splat.reach(&axis) * camera.scale);
        self.grain = self.grain.max(reach[0].max(reach[1]));
        let shown = 2 << 16 | (splat.value.clamp(0.0, 1.0) * f64::from(u16::MAX)) as u64;
        let span = |centre: f64, reach: f64, most: usize| {
            let from = (centre - reach).floor().max(0.0) as i64;
            from..((centre + reach).ceil() + 1.0).clamp(0.0, most as f64) as i64
        };
        // The point o + s t of a ray is on the ellipsoid where a s² + 2 b s + c = 0; t points towards the
        // viewer.
        let inverse = splat.radii.map(|radius| 1.0 / (radius * radius));
        let product = |u: &[f64; 3], v: &[f64; 3]| (0..3).map(|i| u[i] * v[i] * inverse[i]).sum::<f64>();
        let a = product(&camera.toward, &camera.toward);
        for y in span(row, reach[1], self.height) {
            for x in span(column, reach[0], self.width) {
                let (dx, dy) = (x as f64 + 0.5 - column, y as f64 + 0.5 - row);
                if flat {
                    let edge = reach.map(|reach| reach / LARGER + 0.5);
                    if dx.abs() <= edge[0] && dy.abs() <= edge[1] {
                        self.put(camera, x, y, depth, shown);
                    }
                    continue;
                }
                let from: [f64; 3] =
                    std::array::from_fn(|i| (dx * camera.right[i] - dy * camera.up[i]) / camera.scale);
                let b = product(&from, &camera.toward);
                let inside = b * b - a * (product(&from, &from) - 1.0);
                if inside >= 0.0 {
                    self.put(camera, x, y, depth + (inside.sqrt() - b) / a, shown);
                }
            }
        }
    }

    /// Whether any pixel shows a particle.
    pub(super) fn has_particles(&self) -> bool {
        self.pixels.iter().any(|pixel| pixel >> 16 & 0xffff >= 2)
    }

    /// Draws the floor at the lower side of `bounds` with lines every `spacing` metres.
    pub(super) fn ground(&mut self, camera: &Camera, bounds: &Bounds, spacing: f64) {
        if camera.toward[2] < 1e-6 {
            return;
        }
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

    /// Paints the image; `colour` turns values between 0 and 1 into colours. Solids are visible where nothing
    /// is in front of them, and hide particles behind them by half.
    pub(super) fn paint(
        &self,
        camera: &Camera,
        canvas: &mut Canvas,
        looks: &Looks<'_>,
        colour: impl Fn(f64) -> Rgb,
    ) {
        let pixels_per_unit =
            camera.scale * (camera.depths.end - camera.depths.start) / f64::from(u32::MAX - 1);
        let solids = looks.solids;
        let solid = |at: usize| (solids.depth[at] - camera.depths.start) * camera.scale;
        // Depth in pixels, and the foremost object.
        let mut depth: Vec<f64> = self.pixels.iter().map(|&p| (p >> 32) as f64 * pixels_per_unit).collect();
        let mut seen: Vec<Seen> = (0..depth.len()).map(|at| self.seen(at)).collect();
        for at in 0..depth.len() {
            let is_free = match seen[at] {
                Seen::Nothing => solids.depth[at].is_finite(),
                Seen::Ground { .. } => !looks.light || solid(at) > depth[at] - 0.5,
                _ => false,
            };
            if is_free {
                (depth[at], seen[at]) = (solid(at), Seen::Solid);
            }
        }
        let surface = Surface { width: self.width, height: self.height, depth, seen };
        let smooth = if looks.light { surface.smoothed() } else { Vec::new() };
        // Large balls are lit one by one, small ones as the surface that they make.
        let balls = ((self.grain - 1.5) / 6.0).clamp(0.0, 0.6);
        for row in 0..self.height {
            for column in 0..self.width {
                let at = row * self.width + column;
                let base = match surface.seen[at] {
                    Seen::Nothing => continue,
                    Seen::Ground { line: true } => looks.paper.floor_line,
                    Seen::Ground { line: false } => looks.paper.floor,
                    Seen::Particle(value) => colour(f64::from(value) / f64::from(u16::MAX)),
                    Seen::Solid => scaled(looks.paper.solid, solids.light[at]),
                };
                let factor = if looks.light { surface.shade(&smooth, balls, column, row) } else { 1.0 };
                let mut shown = scaled(base, factor);
                let hidden = matches!(surface.seen[at], Seen::Particle(_))
                    && looks.light
                    && solid(at) > surface.depth[at] + 0.5;
                if hidden {
                    shown = mixed(shown, scaled(looks.paper.solid, solids.light[at]), 0.45);
                }
                canvas.set(column as i64, row as i64, shown);
            }
        }
    }

    /// Whether a place at this depth (m) is not behind the foremost object of a pixel.
    pub(super) fn is_free(&self, camera: &Camera, solids: &Layer, at: usize, depth: f64) -> bool {
        let unit = (camera.depths.end - camera.depths.start) / f64::from(u32::MAX - 1);
        let known = camera.depths.start + (self.pixels[at] >> 32) as f64 * unit;
        let close = 1.5 / camera.scale;
        depth + close >= solids.depth[at] && (self.pixels[at] == 0 || depth + close >= known)
    }
}

/// Foremost objects by pixel, with depths in pixels.
struct Surface {
    width: usize,
    height: usize,
    depth: Vec<f64>,
    seen: Vec<Seen>,
}

impl Surface {
    /// Neighbours of a pixel on a square of half width `reach`.
    fn around(&self, column: usize, row: usize, reach: usize) -> impl Iterator<Item = usize> + '_ {
        let rows = row.saturating_sub(reach)..=(row + reach).min(self.height - 1);
        let columns = column.saturating_sub(reach)..=(column + reach).min(self.width - 1);
        rows.flat_map(move |y| columns.clone().map(move |x| y * self.width + x))
    }

    fn is_particle(&self, at: usize) -> bool {
        matches!(self.seen[at], Seen::Particle(_))
    }

    /// Depth averaged over the surface around, so that slopes are those of the pile rather than of its
    /// grains.
    fn smoothed(&self) -> Vec<f64> {
        const REACH: usize = 4;
        const STEP: f64 = 14.0;
        let mut smooth = self.depth.clone();
        for row in 0..self.height {
            for column in 0..self.width {
                let at = row * self.width + column;
                if self.is_particle(at) {
                    let (mut sum, mut count) = (0.0, 0.0);
                    for near in self.around(column, row, REACH) {
                        if self.is_particle(near) && (self.depth[near] - self.depth[at]).abs() < STEP {
                            (sum, count) = (sum + self.depth[near], count + 1.0);
                        }
                    }
                    smooth[at] = sum / count;
                }
            }
        }
        smooth
    }

    /// Brightness by the slopes of a field of depths over `reach` pixels: light from the upper left.
    fn facing(&self, depth: &[f64], column: usize, row: usize, reach: usize) -> f64 {
        let at = row * self.width + column;
        let slope = |one: usize, other: usize, length: f64| {
            let usable = self.is_particle(one) && self.is_particle(other);
            if usable { ((depth[other] - depth[one]) / length).clamp(-4.0, 4.0) } else { 0.0 }
        };
        let (left, right) = (at - column.min(reach), at + (self.width - 1 - column).min(reach));
        let above = at - self.width * row.min(reach);
        let below = at + self.width * (self.height - 1 - row).min(reach);
        let length = 2.0 * reach as f64;
        let (x, y) = (slope(left, right, length), slope(above, below, length));
        // Normal (-∂d/∂x, -∂d/∂y, 1) in image axes (y down); the light is a unit vector.
        ((0.45 * x + 0.62 * y + 0.643) / (x * x + y * y + 1.0).sqrt()).max(0.0)
    }

    /// Brightness from the slope and from occlusion.
    fn shade(&self, smooth: &[f64], balls: f64, column: usize, row: usize) -> f64 {
        let at = row * self.width + column;
        let mut factor = 1.0;
        if self.is_particle(at) {
            let whole = self.facing(smooth, column, row, 2);
            let facing = if balls > 0.0 {
                whole + balls * (self.facing(&self.depth, column, row, 1) - whole)
            } else {
                whole
            };
            let grain = (smooth[at] - self.depth[at]).clamp(-4.0, 4.0) * 0.03;
            factor = 0.42 + 0.72 * facing - grain;
        }
        // Pixels whose surroundings are nearer to the viewer lie in a hollow or behind an edge.
        let mut hidden = 0.0;
        for reach in [3_i64, 8, 20] {
            for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1)] {
                let (x, y) = (column as i64 + dx * reach, row as i64 + dy * reach);
                if (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y) {
                    let near = y as usize * self.width + x as usize;
                    if matches!(self.seen[near], Seen::Particle(_) | Seen::Solid) {
                        // A neighbour far in front is another object, whose edge casts no shade.
                        let step = self.depth[near] - self.depth[at];
                        let rise = step / reach as f64 - if reach > 8 { 1.0 } else { 2.5 };
                        hidden += rise.clamp(0.0, 4.0) * (1.0 - (step - 50.0) / 50.0).clamp(0.0, 1.0);
                    }
                }
            }
        }
        factor * (-0.025 * hidden).exp()
    }
}
