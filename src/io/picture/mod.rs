//! Pictures of the particles, drawn by the program itself.
//!
//! Each rank draws its own particles into an image with depth; the nearest of all ranks is kept for
//! each pixel, so a picture does not depend on the number of ranks.
//!
//! | file | concern |
//! |---|---|
//! | this | the parts of a picture, and their composition |
//! | `settings.rs` | options of a picture |
//! | `drawing.rs` `tint.rs` | what a picture is drawn from; meaning of its colours |
//! | `camera.rs` | projection from space to pixels |
//! | `scene.rs`, `solids.rs`, `tree.rs` | particles with their light; colliders; leaves |
//! | `boxes.rs`, `vectors.rs`, `arrows.rs` | widths of particles; vectors; their arrows |
//! | `copies.rs` | mirror images and bodies of revolution |
//! | `canvas.rs`, `colour.rs`, `scales.rs` | an image and its file; colours; legends |
//! | `heading.rs`, `font.rs` | title and caption; letters |
//! | `source/` | quantities of a file, and those derived from them |

use std::path::{Path, PathBuf};

use partition::comm::Comm;

use super::hdf5_file::{FileError, Reader};
use super::snapshot::content::fields::Values;
use super::snapshot::{Header, PointField, View};
use crate::particle::chunk::Layout;
use crate::text::quantity;

mod arrows;
mod boxes;
mod camera;
mod canvas;
mod colour;
mod copies;
mod drawing;
mod font;
mod heading;
mod scales;
mod scene;
mod settings;
mod solids;
pub(super) mod source;
mod tint;
mod tree;
mod vectors;

pub use boxes::Boxes;
pub use camera::View as Direction;
use camera::{Bounds, Camera};
use canvas::Canvas;
pub use colour::Map;
pub(crate) use colour::further;
use drawing::Drawing;
use heading::Heading;
use scales::{Plot, colour_bar, legend, nice};
use scene::{LARGER, Looks, Raster, Splat};
pub use settings::{Clip, Look, Settings, place};
use solids::Layer;
pub use solids::{Distance, Solid};
use source::derived::{Source, magnitude};
use tint::Tint;
use tree::leaves;
use vectors::Vectors;

/// Surroundings of the particles in a picture.
#[derive(Debug, Default)]
pub struct Scene {
    /// Rigid bodies.
    pub solids: Vec<Solid>,
    /// Widths of particles; `None` where these are not known: they are then drawn as at the start.
    pub boxes: Option<Boxes>,
}

/// The scene at the time of a file.
pub type SceneOf<'a> = dyn Fn(&Header) -> Scene + 'a;

/// Free space beside the drawing: left, right, top, bottom, in units of the layout.
const MARGINS: [f64; 4] = [40.0, 190.0, 110.0, 60.0];

/// Collective. Draws the particles of a run, coloured by `field` (of vectors the magnitude), and writes the
/// picture as PNG on rank 0.
pub fn draw<const D: usize>(
    comm: &Comm,
    view: &View<D>,
    field: PointField,
    settings: &Settings,
    scene: Scene,
    path: &Path,
) -> Result<(), FileError> {
    let Scene { solids, boxes } = scene;
    let domain = domain(&view.origin, view.root_edge, &view.brick.roots.map(u64::from));
    let values = scalars(field.values(view));
    let mut values = values.into_iter();
    let mut splats = Vec::with_capacity(values.len());
    for chunk in view.chunks {
        let half = chunk.column(Layout::<D>::HALF);
        for (p, (half, value)) in half.iter().zip(values.by_ref()).enumerate() {
            let inner = chunk.position(p);
            let position = std::array::from_fn(|i| if i < D { view.origin[i] + inner[i] } else { 0.0 });
            let half = boxes.as_ref().map_or([*half; 3], |boxes| boxes.of_chunk(chunk, p, view.root_edge));
            splats.push(Splat { position, radii: half.map(|half| LARGER * half), value });
        }
    }
    let mut particles = [view.chunks.iter().map(|chunk| chunk.len() as u64).sum()];
    comm.sum_u64(&mut particles);
    let caption = caption(view.time, view.step, particles[0]);
    let tint = Tint::of(field, view.materials, view.bodies);
    let (leaves, vectors) = (Vec::new(), Vectors::default());
    let drawing = Drawing { flat: D == 2, domain, splats, tint, caption, solids, leaves, vectors };
    let canvas = drawing.compose(Some(comm), settings);
    let saved = if comm.rank() == 0 { canvas.save(path) } else { Ok(()) };
    Ok(comm.agree(saved)?)
}

/// Not collective. Draws the particles of an output file, coloured by the quantity of this name: a field that
/// the file shows, or one that follows from its fields or its state.
///
/// # Errors
/// The file cannot be read or does not offer the quantity, or the picture cannot be written.
pub fn draw_file(
    from: &Path,
    name: &str,
    settings: &Settings,
    scene: &SceneOf<'_>,
    path: &Path,
) -> Result<(), FileError> {
    let (drawing, _) = drawing(from, name, settings, scene)?;
    if let (Some(reason), false) = (drawing.emptied(settings), settings.may_be_empty) {
        return Err(FileError::Refused { path: from.into(), reason });
    }
    drawing.compose(None, settings).save(path)
}

/// Not collective. As [`draw_file`], but returns the bytes of the PNG, and the time of the file, s.
///
/// # Errors
/// The file cannot be read or does not offer the quantity.
pub fn png_of_file(
    from: &Path,
    name: &str,
    settings: &Settings,
    scene: &SceneOf<'_>,
) -> Result<(Vec<u8>, f64), FileError> {
    let (drawing, time) = drawing(from, name, settings, scene)?;
    let refused = |error: std::io::Error| FileError::Refused { path: from.into(), reason: error.to_string() };
    Ok((drawing.compose(None, settings).png().map_err(refused)?, time))
}

/// Not collective. A picture that is read and not drawn yet.
#[derive(Debug)]
pub struct Prepared(Drawing);

impl Prepared {
    /// Not collective. Reads the particles of a file, coloured by a quantity.
    ///
    /// # Errors
    /// The file cannot be read or does not offer the quantity.
    pub fn read(
        from: &Path,
        name: &str,
        settings: &Settings,
        scene: &SceneOf<'_>,
    ) -> Result<Self, FileError> {
        Ok(Self(drawing(from, name, settings, scene)?.0))
    }

    /// Draws it: red, green and blue of each pixel, row by row.
    pub fn pixels(self, settings: &Settings) -> Vec<u8> {
        self.0.compose(None, settings).into_pixels()
    }
}

/// Not collective. A frame and a range of colours for all of these files.
///
/// # Errors
/// One cannot be read or does not offer the quantity.
pub fn survey(
    files: &[PathBuf],
    name: &str,
    settings: &Settings,
    scene: &SceneOf<'_>,
) -> Result<Look, FileError> {
    let mut all: Option<Look> = None;
    let (mut emptied, mut is_any_left) = (None, false);
    for file in files {
        let (drawing, _) = drawing(file, name, settings, scene)?;
        let (Bounds { low, high }, [from, to]) = (drawing.frame(None), drawing.range(None, None).0);
        let longest = drawing.vectors.longest();
        let reason = drawing.emptied(settings);
        is_any_left |= reason.is_none();
        emptied = emptied.or(reason.map(|reason| FileError::Refused { path: file.clone(), reason }));
        let seen = all.get_or_insert(Look { range: [from, to], frame: [low, high], longest });
        seen.longest = seen.longest.max(longest);
        seen.range = [seen.range[0].min(from), seen.range[1].max(to)];
        for axis in 0..3 {
            seen.frame[0][axis] = seen.frame[0][axis].min(low[axis]);
            seen.frame[1][axis] = seen.frame[1][axis].max(high[axis]);
        }
    }
    if let (Some(refused), false) = (emptied, is_any_left) {
        return Err(refused);
    }
    Ok(all.unwrap_or(Look { range: [0.0; 2], frame: [[0.0; 3], [1.0; 3]], longest: 0.0 }))
}

/// Quantity that colours pictures of a file where nobody chooses one: damage or plastic strain if any particle
/// differs in it from others, else the speed, and where all is at rest the displacement or stress; the level
/// of leaves where the file does not have these.
pub fn usual_colour(file: &Path, settings: &Settings, scene: &SceneOf<'_>) -> &'static str {
    let look = |name: &str| survey(&[file.to_owned()], name, settings, scene).ok();
    let varies = |name: &&str| look(name).is_some_and(|look| look.range[1] > look.range[0]);
    match ["damage", "plastic_strain", "speed", "displacement", "von_mises"].into_iter().find(varies) {
        Some(name) => name,
        None if look("speed").is_some() => "speed",
        None => "leaf_level",
    }
}

/// Drawing of a quantity of a file, and its time, s.
fn drawing(
    from: &Path,
    name: &str,
    settings: &Settings,
    scene: &SceneOf<'_>,
) -> Result<(Drawing, f64), FileError> {
    let file = Reader::open_alone(from)?;
    let header = Header::read(&file)?;
    let n = header.particles;
    let (tint, values) = Source::new(&file, &header).quantity(name)?;
    let tint = tint.named(&header.materials, &header.bodies);
    let points = source::points(&file, &header)?;
    let domain = domain(&header.origin, header.root_edge, &header.roots);
    let Scene { solids, boxes } = scene(&header);
    let stretched = boxes.map_or(Ok(None), |boxes| boxes.of_file(&file, &header))?;
    let half_widths = match stretched {
        Some(half_widths) => half_widths,
        None => source::radii(&file, &header)?.into_iter().map(|half| [half; 3]).collect(),
    };
    let splats = points.chunks_exact(3).zip(values).zip(half_widths);
    let splats = splats
        .map(|((point, value), half)| Splat {
            position: [point[0], point[1], point[2]],
            radii: half.map(|half| LARGER * half),
            value,
        })
        .collect();
    let caption = caption(header.time, header.step, n);
    let flat = header.dimension == 2;
    let leaves = if settings.tree { leaves(from, &header)? } else { Vec::new() };
    let vectors = Vectors::read(&file, &header, settings.vectors.as_deref())?;
    let drawing = Drawing { flat, domain, splats, tint, caption, solids, leaves, vectors };
    let drawing = match settings.revolve {
        Some(revolve) => drawing.revolved(&header, revolve).map_err(|reason| file.refuse(reason))?,
        None => drawing,
    };
    Ok((drawing, header.time))
}

/// Collective on a shared drawing. The least value of all ranks.
fn min(comm: Option<&Comm>, value: f64) -> f64 {
    comm.map_or(value, |comm| comm.min_f64(value))
}

/// Collective on a shared drawing. The greatest value of all ranks.
fn max(comm: Option<&Comm>, value: f64) -> f64 {
    comm.map_or(value, |comm| comm.max_f64(value))
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
    fn frame(&self, comm: Option<&Comm>) -> Bounds {
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
    fn range(&self, comm: Option<&Comm>, given: Option<[f64; 2]>) -> ([f64; 2], [bool; 2]) {
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
    fn compose(mut self, comm: Option<&Comm>, settings: &Settings) -> Canvas {
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
                colour::class((low + value * span).round() as usize)
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
    fn emptied(&self, settings: &Settings) -> Option<String> {
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

#[cfg(test)]
mod tests;
