//! Composition of a picture: frame, range of colours, and what is drawn after what.
use partition::comm::Comm;

use super::camera::{Bounds, Camera};
use super::drawing::Drawing;
use super::layers::solids::Layer;
use super::paper;
use super::paper::canvas::Canvas;
use super::paper::heading::Heading;
use super::scales::{self, Plot, colour_bar, legend, nice};
use super::scene::{Looks, Raster, Splat};
use super::settings::{Clip, Settings};
use agimp::text::quantity;

/// Free space beside the drawing: left, right, top, bottom, in units of the layout.
const MARGINS: [f64; 4] = [40.0, 190.0, 110.0, 60.0];

/// Collective on a shared drawing. The least value of all ranks.
fn min(comm: Option<&Comm>, value: f64) -> f64 {
    comm.map_or(value, |comm| comm.min_f64(value))
}

/// Collective on a shared drawing. The greatest value of all ranks.
fn max(comm: Option<&Comm>, value: f64) -> f64 {
    comm.map_or(value, |comm| comm.max_f64(value))
}

impl Drawing {
    /// Collective on a shared drawing. The box around all particles; the domain if there are none.
    fn bounds(&self, comm: Option<&Comm>) -> Bounds {
        let reach = |axis: usize, sign: f64| {
            let far = self.splats.iter().map(|s| sign * s.position[axis] + s.radii[axis]);
            sign * max(comm, far.fold(f64::NEG_INFINITY, f64::max))
        };
        let (low, high): ([f64; 3], [f64; 3]) =
            (std::array::from_fn(|axis| reach(axis, -1.0)), std::array::from_fn(|axis| reach(axis, 1.0)));
        if low.iter().chain(&high).all(|x| x.is_finite()) { Bounds { low, high } } else { self.domain }
    }

    /// Default frame: the particles with some room, rigid bodies that are not much larger, and the floor if
    /// it is not far below.
    pub(super) fn frame(&self, comm: Option<&Comm>) -> Bounds {
        let mut frame = self.bounds(comm);
        let extent = frame.extent();
        for solid in &self.solids {
            let own = Bounds { low: solid.bounds[0], high: solid.bounds[1] }.cut(&self.domain);
            let is_there = (0..3).all(|axis| own.low[axis] <= own.high[axis]);
            if is_there && own.extent() < 3.0 * extent {
                frame = frame.hull(&own);
            }
        }
        let room = 0.12 * frame.extent();
        for axis in 0..2 {
            frame.low[axis] = (frame.low[axis] - room).max(self.domain.low[axis].min(frame.low[axis]));
            frame.high[axis] = (frame.high[axis] + room).min(self.domain.high[axis].max(frame.high[axis]));
        }
        if frame.low[2] - self.domain.low[2] < frame.extent() {
            frame.low[2] = self.domain.low[2];
        }
        frame
    }

    /// Collective on a shared drawing. The values between which the colours run, and whether there are values
    /// below and above.
    pub(super) fn range(&self, comm: Option<&Comm>, given: Option<[f64; 2]>) -> ([f64; 2], [bool; 2]) {
        let values = || self.splats.iter().map(|splat| splat.value).filter(|value| value.is_finite());
        let low = min(comm, values().fold(f64::INFINITY, f64::min));
        let high = max(comm, values().fold(f64::NEG_INFINITY, f64::max));
        let [from, to] = given.unwrap_or_else(|| self.most([low, high], comm));
        ([from, to], [low < from, high > to])
    }

    /// Collective on a shared drawing. The range `low` to `high` of all values without its outermost half
    /// percents.
    fn most(&self, [low, high]: [f64; 2], comm: Option<&Comm>) -> [f64; 2] {
        const BINS: usize = 1000;
        let classes = self.tint.classes;
        let values = || self.splats.iter().map(|splat| splat.value).filter(|value| value.is_finite());
        if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) || classes {
            return if low.is_finite() { [low, high] } else { [0.0, 0.0] };
        }
        let mut counts = vec![0_u64; BINS];
        let width = (high - low) / BINS as f64;
        values().for_each(|value| counts[(((value - low) / width) as usize).min(BINS - 1)] += 1);
        if let Some(comm) = comm {
            comm.sum_u64(&mut counts);
        }
        let outer = counts.iter().sum::<u64>() / 200;
        let beyond = |counts: &mut dyn Iterator<Item = &u64>| {
            let mut passed = 0;
            counts.take_while(|&&count| (passed, passed += count).0 + count <= outer).count()
        };
        let (below, above) = (beyond(&mut counts.iter()), beyond(&mut counts.iter().rev()));
        [low + width * below as f64, high - width * above as f64]
    }

    /// Collective on a shared drawing. The picture; whole on rank 0.
    pub(super) fn compose(mut self, comm: Option<&Comm>, settings: &Settings) -> Canvas {
        let classes = self.tint.classes;
        let paper = settings.paper();
        let frame = settings.frame.map_or_else(|| self.frame(comm), |[low, high]| Bounds { low, high });
        let frame = self.mirror(settings, frame);
        let ([low, high], beyond) = self.range(comm, settings.range);
        let (width, height) = (settings.width as f64, settings.height as f64);
        let size = [settings.width, settings.height];
        let mut canvas = Canvas::new(size, settings.unit(), paper.paper);
        let heading = Heading::new(&canvas, &settings.title, &self.caption);
        let unit = canvas.unit;
        let [left, right, top, bottom] = MARGINS.map(|margin| margin * unit);
        let top = top + heading.extra as f64;
        // Room for the numbers and the unit of the axes of a plane picture.
        let [left, right] = if self.flat {
            let numbers = scales::Metric::of(&frame).widest(&canvas, [frame.low[1], frame.high[1]]);
            [(left + 60.0 * unit).max(numbers as f64 + 34.0 * unit), right + 45.0 * unit]
        } else {
            [left, right]
        };
        let camera = Camera::new(
            (self.flat, settings.view),
            &frame,
            (settings.zoom, settings.focus),
            left..(width - right).max(left + 1.0),
            top..(height - bottom).max(top + 1.0),
        );
        let spacing = nice(frame.extent() / 8.0);

        let mut raster = Raster::new(settings.width, settings.height);
        let span = if high > low { high - low } else { 1.0 };
        let is_kept = |splat: &Splat| settings.clip.is_none_or(|clip| clip.keeps(splat.position[clip.axis]));
        for splat in self.splats.iter_mut().filter(|splat| is_kept(splat)) {
            splat.value = (splat.value - low) / span;
            raster.splat(&camera, splat, self.flat);
        }
        if !self.flat {
            raster.ground(&camera, &frame, spacing);
        }
        if let Some(comm) = comm {
            comm.max_u64(&mut raster.pixels);
            raster.grain = comm.max_f64(raster.grain);
        }
        if comm.is_some_and(|comm| comm.rank() != 0) {
            return canvas;
        }
        let mut shown = frame;
        if let Some(Clip { axis, at, above }) = settings.clip {
            let side = if above { &mut shown.high } else { &mut shown.low };
            side[axis] = at;
        }
        let solids = Layer::new(&self.solids, &camera, &shown, size, self.flat);
        let looks = Looks { paper, light: !self.flat, solids: &solids };
        raster.paint(&camera, &mut canvas, &looks, |value| {
            if classes {
                paper::colour::class((low + value * span).round() as usize)
            } else {
                settings.map.colour(value)
            }
        });
        if settings.tree {
            self.tree(&mut canvas, &camera, (&raster, &solids), &shown, settings);
        }
        if settings.collect {
            canvas.collect();
        }
        self.arrows(&mut canvas, &camera, settings, |splat, [column, row, depth]| {
            let at = row as usize * raster.width + column as usize;
            let inside = (column as usize) < raster.width && (row as usize) < raster.height;
            let front = depth + splat.reach(&camera.toward) + 1.5 / camera.scale;
            inside && is_kept(splat) && (self.flat || raster.is_free(&camera, &solids, at, front))
        });
        let plot = Plot { columns: [left, width - right], rows: [top, height - bottom] };
        let is_near = settings.zoom != 1.0 || settings.focus.is_some();
        let frame = if self.flat && is_near { plot.visible(&camera, &frame) } else { frame };
        if is_near {
            // Particles beyond the frame give way to axes and legend.
            plot.clear_around(&mut canvas, &camera, self.flat.then_some(&frame), paper.paper);
        }
        self.arrow_of_scale(&mut canvas, settings);
        if self.flat {
            scales::axes(&mut canvas, &camera, &frame, paper);
        } else {
            let note = format!("grid {}", quantity(spacing, "m"));
            canvas.text(canvas.px(24.0), settings.height as i64 - canvas.px(36.0), 2.0, &note, paper.ink);
        }
        heading.write(&mut canvas, paper);
        if !self.splats.is_empty() && !raster.has_particles() {
            let note = "no particle in view: change focus, zoom or clip";
            let row = 0.5 * (top + height - bottom);
            canvas.text(left as i64, row as i64, 2.0, note, paper.ink);
        }
        let below = top as i64;
        if classes {
            legend(&mut canvas, &self.tint, low as usize..=high as usize, (paper, below));
        } else {
            let room = if self.vectors.each.is_empty() { 0.0 } else { 60.0 };
            colour_bar(&mut canvas, &self.tint, ([low, high], beyond), (settings.map, paper), (below, room));
        }
        canvas
    }

    /// The reason if a clip removes all particles of the file.
    pub(super) fn emptied(&self, settings: &Settings) -> Option<String> {
        let clip = settings.clip?;
        let axis = clip.axis;
        let plane = settings.mirror[axis].then(|| self.domain.low[axis]);
        let places = self.splats.iter().flat_map(|splat| {
            let own = splat.position[axis];
            [Some(own), plane.map(|plane| 2.0 * plane - own)]
        });
        let places = || places.clone().flatten();
        if self.splats.is_empty() || places().any(|place| clip.keeps(place)) {
            return None;
        }
        let (low, high) =
            places().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let [low, high] = [low, high].map(|x| quantity(x, "m"));
        let name = ["x", "y", "z"][axis];
        Some(format!(
            "the clip {clip} keeps no particle; expected a place among them, {name} from {low} to {high}"
        ))
    }
}
