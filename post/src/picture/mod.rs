//! Pictures of the particles, drawn by the program itself.
//!
//! Each rank draws its own particles into an image with depth; the nearest of all ranks is kept for
//! each pixel, so a picture does not depend on the number of ranks.
//!
//! | file | concern |
//! |---|---|
//! | this | the parts of a picture |
//! | `settings.rs` | options of a picture |
//! | `drawing.rs` `tint.rs` | what a picture is drawn from; meaning of its colours |
//! | `compose.rs` | frame, range of colours, and what is drawn after what |
//! | `camera.rs` | projection from space to pixels |
//! | `scene.rs`, `scales.rs` | particles with their light; legends |
//! | `layers/` | vectors, colliders, leaves, copies |
//! | `paper/` | an image and its file, colours, letters |
//! | `source/` | quantities of a file, and those derived from them |

use std::path::{Path, PathBuf};

use partition::comm::Comm;

use agimp::io::hdf5_file::{FileError, Reader};
use agimp::io::snapshot::content::fields::Values;
use agimp::io::snapshot::{Header, PointField, View};
use agimp::particle::chunk::Layout;
use agimp::run::scene::LastState;
pub use agimp::run::scene::Scene;
use agimp::text::quantity;

mod camera;
mod compose;
mod drawing;
mod layers;
mod paper;
mod scales;
mod scene;
mod settings;
pub(super) mod source;
mod tint;

use camera::Bounds;
pub use camera::View as Direction;
use drawing::Drawing;
use layers::tree::leaves;
use layers::vectors::Vectors;
use layers::widths;
pub use paper::colour::Map;
pub(crate) use paper::colour::further;
use scene::{LARGER, Splat};
pub use settings::{Clip, Look, Settings, place};
use source::derived::{Source, magnitude};
use tint::Tint;

/// The scene at the time of a file.
pub type SceneOf<'a> = dyn Fn(&Header) -> Scene + 'a;

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

/// Collective. Draws the last state of a run: see [`agimp::run::scene::Draw`].
///
/// # Errors
/// The picture cannot be written; why, in words.
pub fn draw_last<const D: usize>(comm: &Comm, last: LastState<'_, D>, path: &Path) -> Result<(), String> {
    let LastState { view, field, title, scene } = last;
    draw(comm, &view, field, &Settings::new(title), scene, path).map_err(|error| error.to_string())
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

/// Quantity that colours pictures of a file where nobody chooses one: damage or plastic strain if any
/// particle differs in it from others, else the speed, and where all is at rest the displacement or stress;
/// the level of leaves where the file does not have these.
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
    let stretched = boxes.map_or(Ok(None), |boxes| widths::of_file(&boxes, &file, &header))?;
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
    let particles = agimp::text::count(particles);
    format!("t = {}   step {step}   {particles} particles", quantity(time, "s"))
}

#[cfg(test)]
mod tests;
