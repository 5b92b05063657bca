//! Colliders and terrain behind and before the particles.
use agimp::geometry::vector::{cross, dot};
use agimp::run::scene::Solid;
use rayon::prelude::*;

use crate::picture::camera::{Bounds, Camera, unit};
use crate::revolve::Revolve;

/// The part of a solid above a plane across an axis, with its mirror image.
pub(in crate::picture) fn mirrored(solid: Solid, axis: usize, plane: f64) -> Solid {
    let Solid { distance: own, mut triangles, bounds: [mut low, mut high] } = solid;
    let image = |mut corner: [f64; 3]| {
        corner[axis] = 2.0 * plane - corner[axis];
        corner
    };
    let images: Vec<_> = triangles.iter().map(|three| three.map(image)).collect();
    triangles.extend(images);
    high[axis] = high[axis].max(2.0 * plane - low[axis]);
    low[axis] = 2.0 * plane - high[axis];
    let distance = Box::new(move |x: &[f64; 3]| {
        let mut folded = *x;
        folded[axis] = plane + (x[axis] - plane).abs();
        own(&folded)
    });
    Solid { distance, triangles, bounds: [low, high] }
}

/// The body of revolution of a section.
pub(in crate::picture) fn revolved(section: Solid, revolve: Revolve) -> Solid {
    let Solid { distance: own, bounds: [low, high], .. } = section;
    let reach = high[0];
    let distance = Box::new(move |x: &[f64; 3]| own(&[x[0].hypot(x[1]), x[2], 0.0]).max(revolve.distance(x)));
    let bounds = [[-reach, -reach, low[1]], [reach, reach, high[1]]];
    Solid { distance, triangles: Vec::new(), bounds }
}

/// Depth and brightness of the solids by pixel.
pub(in crate::picture) struct Layer {
    /// Depth of the surface, m; minus infinity where there is none.
    pub depth: Vec<f64>,
    /// Its brightness.
    pub light: Vec<f64>,
}

/// Most steps along a ray.
const MOST_STEPS: usize = 200;

impl Layer {
    /// The solids as far as they lie in `frame`.
    pub(in crate::picture) fn new(
        solids: &[Solid],
        camera: &Camera,
        frame: &Bounds,
        size: [usize; 2],
        flat: bool,
    ) -> Self {
        let [width, height] = size;
        let mut layer =
            Self { depth: vec![f64::NEG_INFINITY; width * height], light: vec![1.0; width * height] };
        for solid in solids {
            if !solid.triangles.is_empty() && !flat {
                layer.triangles(&solid.triangles, camera, frame, size);
                continue;
            }
            // Sheets are a pixel thick.
            let pad = 1.0 / camera.scale;
            let [low, high] = solid.bounds;
            let round = Bounds { low: low.map(|x| x - pad), high: high.map(|x| x + pad) };
            let within = if flat { *frame } else { frame.cut(&round) };
            if (0..3).any(|axis| within.low[axis] > within.high[axis]) {
                continue;
            }
            let rows = layer.depth.par_chunks_mut(width).zip(layer.light.par_chunks_mut(width));
            rows.enumerate().for_each(|(row, (depths, lights))| {
                for column in 0..width {
                    let at = [column as f64 + 0.5, row as f64 + 0.5];
                    let met = if flat {
                        inside(solid, camera, &within, at)
                    } else {
                        trace(solid, camera, &within, at)
                    };
                    if let Some((depth, light)) = met.filter(|(depth, _)| *depth > depths[column]) {
                        (depths[column], lights[column]) = (depth, light);
                    }
                }
            });
        }
        layer
    }

    fn triangles(
        &mut self,
        triangles: &[[[f64; 3]; 3]],
        camera: &Camera,
        frame: &Bounds,
        [width, height]: [usize; 2],
    ) {
        let eps = 1e-6 * frame.extent();
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| camera.project(corner));
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let edge = |i: usize, j: usize| std::array::from_fn(|axis| triangle[j][axis] - triangle[i][axis]);
            let normal = unit(cross(edge(0, 1), edge(0, 2)));
            // Sheets have two sides.
            let normal = if dot(normal, camera.toward) < 0.0 { normal.map(|x| -x) } else { normal };
            if area == 0.0 || !area.is_finite() {
                continue;
            }
            let light = camera.light(normal);
            let span = |axis: usize, most: usize| {
                let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
                ((low - 0.5).ceil().max(0.0) as usize)
                    ..((high + 0.5).floor().clamp(0.0, most as f64) as usize)
            };
            for row in span(1, height) {
                for column in span(0, width) {
                    let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                    let share = |p: [f64; 3], q: [f64; 3]| {
                        ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area
                    };
                    let (u, v, w) = (share(b, c), share(c, a), share(a, b));
                    if u < 0.0 || v < 0.0 || w < 0.0 {
                        continue;
                    }
                    let depth = u * a[2] + v * b[2] + w * c[2];
                    let point = camera.point(x, y, depth);
                    let is_shown = (0..3).all(|axis| {
                        point[axis] >= frame.low[axis] - eps && point[axis] <= frame.high[axis] + eps
                    });
                    let at = row * width + column;
                    if is_shown && depth > self.depth[at] {
                        (self.depth[at], self.light[at]) = (depth, light);
                    }
                }
            }
        }
    }
}

/// Whether the place of a pixel in the plane lies in a solid.
fn inside(solid: &Solid, camera: &Camera, within: &Bounds, [column, row]: [f64; 2]) -> Option<(f64, f64)> {
    let [x, y, _] = camera.point(column, row, 0.0);
    if x < within.low[0] || x > within.high[0] || y < within.low[1] || y > within.high[1] {
        return None;
    }
    let distance = (solid.distance)(&[x, y, 0.0]) * camera.scale;
    // A line along the surface; sheets consist of it alone.
    let light = if distance.abs() < 1.0 { 0.55 } else { 1.0 };
    (distance < 1.0).then_some((0.0, light))
}

/// Depth and brightness of a solid at the first intersection with the ray of a pixel within a box, by sphere
/// tracing.
fn trace(solid: &Solid, camera: &Camera, within: &Bounds, [column, row]: [f64; 2]) -> Option<(f64, f64)> {
    let foot = camera.point(column, row, 0.0);
    // Depths between which the ray lies in the box, and the axis of the face through which it enters.
    let (mut near, mut far, mut face) = (f64::INFINITY, f64::NEG_INFINITY, 0);
    for axis in 0..3 {
        let (low, high, slope) = (within.low[axis], within.high[axis], camera.toward[axis]);
        if slope == 0.0 {
            if foot[axis] < low || foot[axis] > high {
                return None;
            }
            continue;
        }
        let (a, b) = ((low - foot[axis]) / slope, (high - foot[axis]) / slope);
        if a.max(b) < near {
            (near, face) = (a.max(b), axis);
        }
        far = far.max(a.min(b));
    }
    if near <= far {
        return None;
    }
    let close = 0.2 / camera.scale;
    let mut depth = near;
    for step in 0..MOST_STEPS {
        let point = camera.point(column, row, depth);
        let distance = (solid.distance)(&point);
        if distance <= close {
            // Where the box cuts the solid, the cut is visible.
            let normal = if step == 0 && distance < -close {
                std::array::from_fn(|axis| if axis == face { camera.toward[axis].signum() } else { 0.0 })
            } else {
                slope_of(solid, &point, close)
            };
            return Some((depth, camera.light(normal)));
        }
        depth -= distance.max(close);
        if depth < far {
            return None;
        }
    }
    None
}

/// Unit normal of the surface near a point.
fn slope_of(solid: &Solid, point: &[f64; 3], step: f64) -> [f64; 3] {
    unit(std::array::from_fn(|axis| {
        let at = |sign: f64| {
            (solid.distance)(&std::array::from_fn(|i| point[i] + if i == axis { sign * step } else { 0.0 }))
        };
        at(1.0) - at(-1.0)
    }))
}
