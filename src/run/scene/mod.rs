//! Surroundings of the particles in pictures: colliders where they are, and how wide boxes are; the last
//! state of a run.
pub mod boxes;

use std::path::{Path, PathBuf};

use partition::comm::Comm;

use self::boxes::Boxes;
use super::restart;
use crate::boundary::{Collider, ColliderState};
use crate::geometry::{Aabb, Shape};
use crate::io::snapshot::{self, Header, PointField, View, directory};
use crate::job::{self, AnyProblem, Problem};
use crate::saved::Saved;
use crate::setup::stages;
use crate::solver::physics::Physics;

/// Signed distance of a place, m.
pub type Distance = dyn Fn(&[f64; 3]) -> f64 + Send + Sync;

/// A rigid body that a picture shows.
pub struct Solid {
    /// Signed distance of a place (m) to its surface, m, or a bound smaller in magnitude.
    pub distance: Box<Distance>,
    /// Its triangles, if it is made of them; else empty.
    pub triangles: Vec<[[f64; 3]; 3]>,
    /// Lower and upper corner of a box round it, m; may be infinite.
    pub bounds: [[f64; 3]; 2],
}

impl std::fmt::Debug for Solid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Solid within {:?}", self.bounds)
    }
}

/// Surroundings of the particles in a picture.
#[derive(Debug, Default)]
pub struct Scene {
    /// Rigid bodies.
    pub solids: Vec<Solid>,
    /// Widths of particles; `None` where these are not known: they are then drawn as at the start.
    pub boxes: Option<Boxes>,
}

/// The last state of a run, of which a picture is wanted.
#[derive(Debug)]
pub struct LastState<'a, const D: usize> {
    /// Particles and tree.
    pub view: View<'a, D>,
    /// The field that colours the particles.
    pub field: PointField,
    /// Title of the picture.
    pub title: &'a str,
    /// Colliders, and widths of particles.
    pub scene: Scene,
}

/// Collective. Draws the last state of a run into a file.
///
/// # Errors
/// The picture cannot be written; why, in words; the same on all ranks.
pub type Draw<const D: usize> = dyn Fn(&Comm, LastState<'_, D>, &Path) -> Result<(), String>;

/// Functions that draw the last state of a run. The solver knows no pictures: who starts a run says what
/// draws them.
#[derive(Clone, Copy)]
pub struct Pictures<'a> {
    /// In two dimensions.
    pub two: &'a Draw<2>,
    /// In three dimensions.
    pub three: &'a Draw<3>,
}

/// The colliders that are there, in these states. `origin` is the lower corner of the domain, m.
pub fn solids<const D: usize>(
    colliders: &[Collider<D>],
    states: &[ColliderState<D>],
    origin: [f64; D],
) -> Vec<Solid> {
    let present = colliders.iter().zip(states).filter(|(collider, _)| collider.is_present());
    present.map(|(collider, state)| solid(collider.clone(), *state, origin)).collect()
}

fn solid<const D: usize>(collider: Collider<D>, state: ColliderState<D>, origin: [f64; D]) -> Solid {
    let pose = state.pose;
    let to_space = |y: [f64; D]| -> [f64; 3] {
        let x = collider.to_space(&y, &pose);
        std::array::from_fn(|axis| if axis < D { x[axis] + origin[axis] } else { 0.0 })
    };
    let bounds = bounds(&collider.shape.bounds(), to_space);
    let corner = |corner: [f64; 3]| to_space(std::array::from_fn(|axis| corner[axis]));
    let triangles = own_triangles(&collider.shape).into_iter().map(|three| three.map(corner)).collect();
    let distance = Box::new(move |x: &[f64; 3]| {
        collider.distance(&std::array::from_fn(|axis| x[axis] - origin[axis]), &pose)
    });
    Solid { distance, triangles, bounds }
}

/// Box round a box that is moved; infinite where it has no end.
fn bounds<const D: usize>(own: &Aabb<D>, to_space: impl Fn([f64; D]) -> [f64; 3]) -> [[f64; 3]; 2] {
    let mut round = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    for number in 0..1 << D {
        let corner = to_space(std::array::from_fn(|axis| {
            if number >> axis & 1 == 0 { own.lower[axis] } else { own.upper[axis] }
        }));
        for axis in 0..3 {
            if !corner[axis].is_finite() {
                (round[0][axis], round[1][axis]) = (f64::NEG_INFINITY, f64::INFINITY);
            } else {
                round[0][axis] = round[0][axis].min(corner[axis]);
                round[1][axis] = round[1][axis].max(corner[axis]);
            }
        }
    }
    round
}

/// Triangles of a mesh, also of one that the job has turned.
fn own_triangles<const D: usize>(shape: &Shape<D>) -> Vec<[[f64; 3]; 3]> {
    match shape {
        Shape::Mesh(mesh) => mesh.triangles().collect(),
        Shape::Rotated(inner, placement) => {
            let turned = |corner: [f64; 3]| {
                let x = placement.to_space(&std::array::from_fn(|axis| corner[axis]));
                std::array::from_fn(|axis| if axis < D { x[axis] } else { 0.0 })
            };
            own_triangles(inner).into_iter().map(|three| three.map(turned)).collect()
        }
        _ => Vec::new(),
    }
}

/// How the solver has the boxes of particles.
pub fn boxes<const D: usize>(physics: &Physics<D>) -> Boxes {
    let is_plastic = physics.materials.iter().map(|material| material.is_plastic()).collect();
    Boxes { policy: physics.boxes, coordinates: physics.coordinates, is_plastic }
}

/// Not collective. The scene of a job at the time of an output of it.
pub fn of_job(problem: &AnyProblem, header: &Header) -> Scene {
    match problem {
        AnyProblem::Two(problem) => at(problem, header),
        AnyProblem::Three(problem) => at(problem, header),
    }
}

fn at<const D: usize>(problem: &Problem<D>, header: &Header) -> Scene {
    let starts = restart::stage_starts(problem, header).unwrap_or_else(|| vec![0.0]);
    let mut physics = stages::physics(problem, &starts);
    physics.colliders.iter_mut().for_each(|collider| collider.deform(header.time));
    let state = |(number, collider): (usize, &Collider<D>)| {
        let mut state = collider.state_at(header.time);
        collider.save(number, &mut state, &mut Saved::from_file(&header.scalars, true));
        state
    };
    let states: Vec<_> = physics.colliders.iter().enumerate().map(state).collect();
    Scene { solids: solids(&physics.colliders, &states, problem.origin), boxes: Some(boxes(&physics)) }
}

/// Not collective. The title of the job of the run that wrote an output, from the text in it; none if it has
/// no title.
pub fn title_of(output: &Path) -> Option<String> {
    let job: toml::Table = snapshot::job_text(output)?.parse().ok()?;
    let title = job.get("title")?.as_str()?.trim();
    (!title.is_empty()).then(|| title.to_owned())
}

/// Not collective. The job of the run that wrote an output, from the text in it. Files that it names (meshes,
/// records) lie beside the job file: `job`, or where the output says it is.
///
/// # Errors
/// The output holds no job, or the job names files that are not found; why, in words.
pub fn job_of(output: &Path, job: Option<&Path>) -> Result<AnyProblem, String> {
    let text = snapshot::job_text(output).ok_or("the output holds no job")?;
    let mut places = job.map_or_else(|| snapshot::job_files(output), |job| vec![job.to_path_buf()]);
    if places.is_empty() {
        // Enough for a job that names no files.
        places.push(PathBuf::from(format!("{}.toml", directory::run_of(output))));
    }
    let mut reason = String::new();
    for place in places {
        match job::parse(&text, &place) {
            Ok(problem) => return Ok(problem),
            Err(faults) if reason.is_empty() => {
                reason = faults
                    .first()
                    .map_or_else(String::new, |fault| format!("{}: {}", fault.key, fault.message));
            }
            Err(_) => {}
        }
    }
    Err(reason)
}
