//! Leaves of the tree over a picture.
use std::path::Path;

use crate::frame::Leaves;
use crate::picture::camera::{Bounds, Camera};
use crate::picture::drawing::Drawing;
use crate::picture::layers::solids::Layer;
use crate::picture::paper::canvas::Canvas;
use crate::picture::scene::Raster;
use crate::picture::settings::Settings;
use agimp::io::hdf5_file::FileError;
use agimp::io::snapshot::Header;

/// Lower corners and edges of the leaves that belong to an output, m.
pub(in crate::picture) fn leaves(from: &Path, header: &Header) -> Result<Vec<([f64; 3], f64)>, FileError> {
    let Leaves { levels, coords } = Leaves::of_output(from)?;
    let low = |axis: usize| header.origin.get(axis).copied().unwrap_or(0.0);
    let leaf = |(level, coord): (u8, [u32; 3])| {
        let edge = header.root_edge / f64::from(1_u32 << level.min(31));
        (std::array::from_fn(|axis| low(axis) + edge * f64::from(coord[axis])), edge)
    };
    Ok(levels.into_iter().zip(coords).map(leaf).collect())
}

impl Drawing {
    /// Draws the edges of leaves: all in the plane; in space those that the clip or the floor cuts.
    pub(in crate::picture) fn tree(
        &self,
        canvas: &mut Canvas,
        camera: &Camera,
        (raster, solids): (&Raster, &Layer),
        frame: &Bounds,
        settings: &Settings,
    ) {
        let (axis, at) = match settings.clip {
            _ if self.flat => (2, 0.0),
            Some(clip) => (clip.axis, clip.at),
            None => (2, frame.low[2]),
        };
        let [across, up] = match axis {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        for (corner, edge) in &self.leaves {
            let is_cut = self.flat || corner[axis] <= at && at <= corner[axis] + edge;
            let is_shown =
                [across, up].iter().all(|&i| corner[i] < frame.high[i] && corner[i] + edge > frame.low[i]);
            if !(is_cut && is_shown) {
                continue;
            }
            for along in [across, up] {
                // The lower of two sides; the upper one is the lower one of a neighbour.
                let mut from = *corner;
                from[axis] = at;
                let mut to = from;
                to[along] = (from[along] + edge).min(frame.high[along]);
                from[along] = from[along].max(frame.low[along]);
                let across = if along == across { up } else { across };
                if !(frame.low[across]..=frame.high[across]).contains(&corner[across]) {
                    continue;
                }
                let [a, b] = [from, to].map(|point| camera.project(point));
                let steps = (b[0] - a[0]).abs().max((b[1] - a[1]).abs()).ceil().clamp(1.0, 20_000.0);
                for step in 0..=steps as usize {
                    let share = step as f64 / steps;
                    let point: [f64; 3] = std::array::from_fn(|i| a[i] + share * (b[i] - a[i]));
                    let inside = point[0] >= 0.0 && point[1] >= 0.0;
                    let (column, row) = (point[0] as usize, point[1] as usize);
                    if inside && column < raster.width && row < raster.height {
                        let pixel = row * raster.width + column;
                        if self.flat || raster.is_free(camera, solids, pixel, point[2]) {
                            canvas.blend(column as i64, row as i64, settings.paper().tree, 0.55);
                        }
                    }
                }
            }
        }
    }
}
