//! Pictures of the particles, drawn by the program itself.
//!
//! Each rank draws its own particles into an image with depth; the nearest of all ranks is kept for
//! each pixel, so a picture does not depend on the number of ranks.

use std::path::{Path, PathBuf};

use partition::comm::Comm;

use super::hdf5_file::{FileError, Reader};
use super::snapshot::fields::Values;
use super::snapshot::{Header, PointField, View};
use crate::particle::chunk::Layout;
use crate::text::{number, quantity};

mod canvas;
mod colour;
mod derived;
mod font;
mod scene;
pub(super) mod source;

use canvas::Canvas;
use derived::{Source, is_class, magnitude};
use scene::{Bounds, Camera, Raster, Splat};

/// How a picture looks.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// First line.
    pub title: String,
    /// Values of the first and the last colour; `None`: as found, without the outermost half percents.
    pub range: Option<[f64; 2]>,
    /// Lower and upper corner of what it shows, m; `None`: the particles with some room.
    pub frame: Option<[[f64; 3]; 2]>,
}

/// What a series of pictures shares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Values of the first and the last colour.
    pub range: [f64; 2],
    /// Lower and upper corner of what they show, m.
    pub frame: [[f64; 3]; 2],
}

impl Settings {
    /// A picture of usual size.
    pub fn new(title: &str) -> Self {
        Self { width: 1280, height: 800, title: title.into(), range: None, frame: None }
    }
}

/// What the colours of a picture mean.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Tint {
    /// Name of the quantity.
    name: String,
    /// Its unit, empty for pure numbers.
    unit: String,
    /// Whether its values are numbers of something rather than amounts.
    classes: bool,
}

impl Tint {
    fn of(field: PointField) -> Self {
        Self { name: field.name().into(), unit: field.unit().into(), classes: is_class(field.name()) }
    }
}

/// Free space beside the drawing: left, right, top, bottom, in pixels.
const MARGINS: [f64; 4] = [40.0, 190.0, 110.0, 60.0];
/// No axis has more ticks.
const MOST_TICKS: f64 = 100.0;
const PAPER: colour::Rgb = [250, 250, 248];
const INK: colour::Rgb = [40, 40, 44];

/// The particles of one rank and what all ranks know.
struct Drawing<'a> {
    comm: Option<&'a Comm>,
    flat: bool,
    domain: Bounds,
    /// Values are not yet scaled.
    splats: Vec<Splat>,
    tint: Tint,
    caption: String,
}

/// Collective. Draws the particles of a run, coloured by `field` (of vectors the magnitude), and writes the picture as PNG on rank 0.
pub fn draw<const D: usize>(
    comm: &Comm,
    view: &View<D>,
    field: PointField,
    settings: &Settings,
    path: &Path,
) -> Result<(), FileError> {
    let domain = domain(&view.origin, view.root_edge, &view.brick.roots.map(u64::from));
    let values = scalars(field.values(view));
    let mut values = values.into_iter();
    let mut splats = Vec::with_capacity(values.len());
    for chunk in view.chunks {
        let half = chunk.column(Layout::<D>::HALF);
        for (p, (half, value)) in half.iter().zip(values.by_ref()).enumerate() {
            let inner = chunk.position(p);
            let position = std::array::from_fn(|i| if i < D { view.origin[i] + inner[i] } else { 0.0 });
            splats.push(Splat { position, radius: 1.2 * half, value });
        }
    }
    let mut particles = [view.chunks.iter().map(|chunk| chunk.len() as u64).sum()];
    comm.sum_u64(&mut particles);
    let caption = caption(view.time, view.step, particles[0]);
    let drawing = Drawing { comm: Some(comm), flat: D == 2, domain, splats, tint: Tint::of(field), caption };
    let canvas = drawing.compose(settings);
    let saved = if comm.rank() == 0 { canvas.save(path) } else { Ok(()) };
    Ok(comm.agree(saved)?)
}

/// Not collective. Draws the particles of an output file, coloured by the quantity of this name: a field that the file
/// shows, or what follows from its fields or its state.
///
/// # Errors
/// The file cannot be read or does not offer the quantity, or the picture cannot be written.
pub fn draw_file(from: &Path, name: &str, settings: &Settings, path: &Path) -> Result<(), FileError> {
    drawing(from, name)?.0.compose(settings).save(path)
}

/// Not collective. As [`draw_file`], but returns the bytes of the PNG, and the time of the file, s.
///
/// # Errors
/// The file cannot be read or does not offer the quantity.
pub fn png_of_file(from: &Path, name: &str, settings: &Settings) -> Result<(Vec<u8>, f64), FileError> {
    let (drawing, time) = drawing(from, name)?;
    let refused = |error: std::io::Error| FileError::Refused { path: from.into(), reason: error.to_string() };
    Ok((drawing.compose(settings).png().map_err(refused)?, time))
}

/// Not collective. A frame and a range of colours for all of these files.
///
/// # Errors
/// One cannot be read or does not offer the quantity.
pub fn survey(files: &[PathBuf], name: &str) -> Result<Look, FileError> {
    let mut all: Option<Look> = None;
    for file in files {
        let (drawing, _) = drawing(file, name)?;
        let (Bounds { low, high }, [from, to]) = (drawing.frame(), drawing.range(None));
        let seen = all.get_or_insert(Look { range: [from, to], frame: [low, high] });
        seen.range = [seen.range[0].min(from), seen.range[1].max(to)];
        for axis in 0..3 {
            seen.frame[0][axis] = seen.frame[0][axis].min(low[axis]);
            seen.frame[1][axis] = seen.frame[1][axis].max(high[axis]);
        }
    }
    Ok(all.unwrap_or(Look { range: [0.0; 2], frame: [[0.0; 3], [1.0; 3]] }))
}

/// What a file shows of a quantity, and its time, s.
fn drawing(from: &Path, name: &str) -> Result<(Drawing<'static>, f64), FileError> {
    let file = Reader::open_alone(from)?;
    let header = Header::read(&file)?;
    let n = header.particles;
    let (tint, values) = Source::new(&file, &header).quantity(name)?;
    let points = source::points(&file, &header)?;
    let domain = domain(&header.origin, header.root_edge, &header.roots);
    let radii = source::radii(&file, &header)?;
    let splats = points.chunks_exact(3).zip(values).zip(radii);
    let splats = splats
        .map(|((point, value), half)| Splat {
            position: [point[0], point[1], point[2]],
            radius: 1.2 * half,
            value,
        })
        .collect();
    let caption = caption(header.time, header.step, n);
    let flat = header.dimension == 2;
    Ok((Drawing { comm: None, flat, domain, splats, tint, caption }, header.time))
}

/// One number per particle: scalars as they are, of vectors the magnitude.
fn scalars(values: Values) -> Vec<f64> {
    match values {
        Values::Id(ids) => ids.into_iter().map(|id| id as f64).collect(),
        Values::Integer(numbers) => numbers.into_iter().map(f64::from).collect(),
        Values::Single(values, components) => {
            scalars(Values::Real(values.into_iter().map(f64::from).collect(), components))
        }
        Values::Real(values, 0 | 1) => values,
        Values::Real(values, components) => values.chunks_exact(components).map(magnitude).collect(),
    }
}

fn domain(origin: &[f64], root_edge: f64, roots: &[u64]) -> Bounds {
    let at = |axis: usize, list: &[f64]| list.get(axis).copied().unwrap_or(0.0);
    let edges: Vec<f64> = roots.iter().map(|&n| n as f64 * root_edge).collect();
    Bounds {
        low: std::array::from_fn(|axis| at(axis, origin)),
        high: std::array::from_fn(|axis| at(axis, origin) + at(axis, &edges)),
    }
}

fn caption(time: f64, step: u64, particles: u64) -> String {
    let particles = crate::text::count(particles);
    format!("t = {}   step {step}   {particles} particles", quantity(time, "s"))
}

impl Drawing<'_> {
    fn min(&self, value: f64) -> f64 {
        self.comm.map_or(value, |comm| comm.min_f64(value))
    }

    fn max(&self, value: f64) -> f64 {
        self.comm.map_or(value, |comm| comm.max_f64(value))
    }

    /// Collective on a shared drawing. The box around all particles; the domain if there are none.
    fn bounds(&self) -> Bounds {
        let reach = |axis: usize, sign: f64| {
            let far = self.splats.iter().map(|s| sign * s.position[axis] + s.radius);
            sign * self.max(far.fold(f64::NEG_INFINITY, f64::max))
        };
        let (low, high): ([f64; 3], [f64; 3]) =
            (std::array::from_fn(|axis| reach(axis, -1.0)), std::array::from_fn(|axis| reach(axis, 1.0)));
        if low.iter().chain(&high).all(|x| x.is_finite()) { Bounds { low, high } } else { self.domain }
    }

    /// What the picture shows: the particles with some room, and the floor if it is not far below.
    fn frame(&self) -> Bounds {
        let mut frame = self.bounds();
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

    /// Collective on a shared drawing. The values between which the colours run.
    fn range(&self, given: Option<[f64; 2]>) -> [f64; 2] {
        const BINS: usize = 1000;
        let classes = self.tint.classes;
        let values = || self.splats.iter().map(|splat| splat.value).filter(|value| value.is_finite());
        let low = self.min(values().fold(f64::INFINITY, f64::min));
        let high = self.max(values().fold(f64::NEG_INFINITY, f64::max));
        if let Some(range) = given {
            return range;
        }
        if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) || classes {
            return if low.is_finite() { [low, high] } else { [0.0, 0.0] };
        }
        let mut counts = vec![0_u64; BINS];
        let width = (high - low) / BINS as f64;
        values().for_each(|value| counts[(((value - low) / width) as usize).min(BINS - 1)] += 1);
        if let Some(comm) = self.comm {
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
    fn compose(mut self, settings: &Settings) -> Canvas {
        let classes = self.tint.classes;
        let frame = settings.frame.map_or_else(|| self.frame(), |[low, high]| Bounds { low, high });
        let [low, high] = self.range(settings.range);
        let (width, height) = (settings.width as f64, settings.height as f64);
        let [left, right, top, bottom] = MARGINS;
        let left = if self.flat { left + 60.0 } else { left };
        let camera = Camera::new(
            self.flat,
            &frame,
            left..(width - right).max(left + 1.0),
            top..(height - bottom).max(top + 1.0),
        );
        let spacing = nice(frame.extent() / 8.0);

        let mut raster = Raster::new(settings.width, settings.height);
        let span = if high > low { high - low } else { 1.0 };
        for splat in &mut self.splats {
            splat.value = (splat.value - low) / span;
            raster.splat(&camera, splat);
        }
        if !self.flat {
            raster.ground(&camera, &frame, spacing);
        }
        if let Some(comm) = self.comm {
            comm.max_u64(&mut raster.pixels);
        }
        let mut canvas = Canvas::new(settings.width, settings.height, PAPER);
        if self.comm.is_some_and(|comm| comm.rank() != 0) {
            return canvas;
        }
        if self.flat {
            axes(&mut canvas, &camera, &frame, spacing);
        } else {
            let note = format!("grid {}", quantity(spacing, "m"));
            canvas.text(24, settings.height as i64 - 36, 2, &note, INK);
        }
        raster.paint(&camera, &mut canvas, !self.flat, |value| {
            if classes {
                colour::class((low + value * span).round() as usize)
            } else {
                colour::sequential(value)
            }
        });
        canvas.text(24, 20, 3, &settings.title, INK);
        canvas.text(24, 60, 2, &self.caption, INK);
        if classes {
            legend(&mut canvas, &self.tint, low as usize..=high as usize);
        } else {
            colour_bar(&mut canvas, &self.tint, [low, high]);
        }
        canvas
    }
}

/// Lines and numbers along the lower and the left side of a plane picture.
fn axes(canvas: &mut Canvas, camera: &Camera, frame: &Bounds, spacing: f64) {
    let [left, bottom, _] = camera.project(frame.low).map(|x| x as i64);
    let [right, top, _] = camera.project(frame.high).map(|x| x as i64);
    canvas.fill(left, bottom, right - left + 1, 2, INK);
    canvas.fill(left - 2, top, 2, bottom - top + 2, INK);
    let ticks = |low: f64, high: f64| {
        let (first, last) = ((low / spacing).ceil(), (high / spacing).floor());
        // More than there is room for where the frame is no length at all.
        let count = if last - first < MOST_TICKS { (last - first) as i64 + 1 } else { 0 };
        (0..count).map(move |n| (first + n as f64) * spacing)
    };
    for x in ticks(frame.low[0], frame.high[0]) {
        let column = camera.project([x, 0.0, 0.0])[0] as i64;
        canvas.fill(column, bottom, 2, 8, INK);
        let text = short(x);
        canvas.text(column - Canvas::text_width(2, &text) / 2, bottom + 14, 2, &text, INK);
    }
    for y in ticks(frame.low[1], frame.high[1]) {
        let row = camera.project([0.0, y, 0.0])[1] as i64;
        let text = short(y);
        canvas.fill(left - 10, row, 8, 2, INK);
        canvas.text(left - 14 - Canvas::text_width(2, &text), row - 7, 2, &text, INK);
    }
    canvas.text(right + 8, bottom - 8, 2, "m", INK);
}

/// Name and unit of a field beside the drawing; the row below it.
fn heading(canvas: &mut Canvas, tint: &Tint) -> (i64, i64) {
    let x = canvas.width as i64 - 185;
    let lines = lines(&tint.name.replace('_', " "), 175);
    for (line, upwards) in lines.iter().zip((0..lines.len() as i64).rev()) {
        canvas.text(x, 110 - 24 * upwards, 2, line, INK);
    }
    if !tint.unit.is_empty() {
        canvas.text(x, 134, 2, &format!("[{}]", tint.unit), INK);
    }
    (x, 164)
}

/// A name in lines that are not wider than `width` pixels, broken between words; words that are wider stay whole.
fn lines(name: &str, width: i64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in name.split_whitespace() {
        match lines.last_mut() {
            Some(line) if Canvas::text_width(2, &format!("{line} {word}")) <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn colour_bar(canvas: &mut Canvas, tint: &Tint, [low, high]: [f64; 2]) {
    let (x, top) = heading(canvas, tint);
    let length = (canvas.height as i64 - top - 80).max(10);
    for row in 0..length {
        let value = 1.0 - row as f64 / (length - 1) as f64;
        canvas.fill(x, top + row, 24, 1, colour::sequential(value));
    }
    for tick in 0..5 {
        let part = f64::from(tick) / 4.0;
        let row = top + ((1.0 - part) * (length - 1) as f64) as i64;
        canvas.fill(x + 24, row, 6, 1, INK);
        canvas.text(x + 34, row - 7, 2, &short(low + part * (high - low)), INK);
    }
}

fn legend(canvas: &mut Canvas, tint: &Tint, numbers: std::ops::RangeInclusive<usize>) {
    let (x, top) = heading(canvas, tint);
    for (line, number) in numbers.take(16).enumerate() {
        let row = top + 30 * line as i64;
        canvas.fill(x, row, 24, 20, colour::class(number));
        canvas.text(x + 34, row + 3, 2, &number.to_string(), INK);
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is not above `length`.
fn nice(length: f64) -> f64 {
    if !(length.is_finite() && length > 0.0) {
        return 1.0;
    }
    let power = 10.0_f64.powi(length.log10().floor() as i32);
    [5.0, 2.0, 1.0].into_iter().map(|digit| digit * power).find(|&x| x <= length).unwrap_or(power)
}

/// A number for a scale.
fn short(value: f64) -> String {
    number(if value.abs() < 1e-12 { 0.0 } else { value }, 3)
}

#[cfg(test)]
mod tests;
