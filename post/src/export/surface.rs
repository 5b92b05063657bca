//! The surface of the material as a mesh of triangles, for renderers and for CAD.
//!
//! It is a level set of the density of the particles, each with a smooth kernel, found by marching cubes
//! (`splashsurf_lib`; Löschner, Böttcher, Jeske, Bender 2023). All particles must have one size for that:
//! larger ones are divided into cubes of small ones.
use std::io::{self, Write};
use std::path::Path;

use splashsurf_lib::{Parameters, nalgebra::Vector3, reconstruct_surface};

use crate::frame::Frame;
use agimp::io::hdf5_file::FileError;
use agimp::io::snapshot::PointField;
use agimp::io::snapshot::content::fields::Values;
use agimp::io::whole_file::{system, write_in_pieces};

/// Reach of the kernel of a particle, in its half widths.
const REACH: f64 = 4.0;
/// Edge of the cubes, in half widths.
const CUBE: f64 = 1.0;
/// Density at the surface, as a part of that inside: a ball of 4,000 particles keeps its volume to 2 %, one
/// of 270,000 to 0.3 %.
const LEVEL: f64 = 0.6;
/// Most particles of a surface, counted as small ones.
const MOST: f64 = 3e7;

/// Share of particles of one size that makes it one of whole particles.
const SHARE: f64 = 0.1;

/// How a mesh is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Stanford PLY, binary, single precision.
    Ply,
    /// Wavefront OBJ, text.
    Obj,
}

impl MeshFormat {
    /// Ending of the name of a file.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Ply => "surface.ply",
            Self::Obj => "surface.obj",
        }
    }
}

/// A closed mesh of triangles.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// Corners, m.
    pub points: Vec<[f64; 3]>,
    /// Unit normals at the corners, outwards.
    pub normals: Vec<[f64; 3]>,
    /// Corners of the triangles, counter-clockwise as seen from outside.
    pub triangles: Vec<[usize; 3]>,
}

/// The least half width of whole particles, all of which have the same; the surface of a body cuts others
/// into any size.
fn least_whole(mut sizes: Vec<f64>) -> f64 {
    sizes.sort_unstable_by(f64::total_cmp);
    let most = SHARE * sizes.len() as f64;
    let mut equal = sizes.chunk_by(|a, b| a == b);
    let whole = equal.find(|equal| equal.len() as f64 >= most).or(sizes.get(..1));
    whole.and_then(|equal| equal.first().copied()).unwrap_or(f64::INFINITY)
}

impl Surface {
    /// The surface of all particles of a frame, or of those of one body, by its name.
    ///
    /// # Errors
    /// The frame is plane, has no such body, does not show bodies, or too many particles; in words.
    pub fn of(frame: &Frame, body: Option<&str>) -> Result<Self, String> {
        if frame.header.dimension != 3 {
            return Err(
                "found an output of a 2D run; expected a 3D run or bodies of revolution, because surfaces exist in space only".into()
            );
        }
        let is_chosen = chosen(frame, body)?;
        let sizes =
            || frame.half_widths.iter().enumerate().filter(|(p, _)| is_chosen(*p)).map(|(_, size)| *size);
        let least = least_whole(sizes().collect());
        let parts = |size: f64| (size / least).round().max(1.0);
        let count: f64 = sizes().map(|size| parts(size).powi(3)).sum();
        if count > MOST {
            return Err(format!(
                "found the volume of {count:.1e} particles of the smallest half width, {least:.3e} m; expected at most {MOST:.0e}: select one body (--body)"
            ));
        }
        let mut points: Vec<Vector3<f64>> = Vec::with_capacity(count as usize);
        let particles = frame.positions.iter().zip(&frame.half_widths).enumerate();
        for (_, (at, size)) in particles.filter(|(p, _)| is_chosen(*p)) {
            // Each point counts as a whole particle: parts below half of one as none.
            if (size / least).powi(3) < 0.5 {
                continue;
            }
            let parts = parts(*size);
            let place = |number: f64| (number + 0.5) * 2.0 * size / parts - size;
            for number in 0..(parts as usize).pow(3) {
                let n = parts as usize;
                let own = [number % n, number / n % n, number / n / n];
                points.push(Vector3::from_fn(|axis, _| at[axis] + place(own[axis] as f64)));
            }
        }
        if points.is_empty() {
            return Ok(Self::default());
        }
        let mut parameters = Parameters::new(least, REACH * least, CUBE * least);
        parameters.iso_surface_threshold = LEVEL;
        let made =
            reconstruct_surface::<i64, f64>(&points, &parameters).map_err(|error| error.to_string())?;
        let normals = made.mesh.vertex_normals();
        Ok(Self {
            points: made.mesh.vertices.iter().map(|x| [x[0], x[1], x[2]]).collect(),
            normals: normals.iter().map(|x| [x[0], x[1], x[2]]).collect(),
            triangles: made.mesh.triangles,
        })
    }

    /// Not collective. Writes it, under a temporary name first.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, format: MeshFormat, path: &Path) -> Result<(), FileError> {
        let written = write_in_pieces(path, |out| match format {
            MeshFormat::Ply => self.ply(out),
            MeshFormat::Obj => self.obj(out),
        });
        written.map_err(|source| system(path, "write", source))
    }

    fn ply(&self, out: &mut impl Write) -> io::Result<()> {
        write!(
            out,
            "ply\nformat binary_little_endian 1.0\ncomment surface by agimp {}, m\nelement vertex {}\n",
            env!("CARGO_PKG_VERSION"),
            self.points.len()
        )?;
        for name in ["x", "y", "z", "nx", "ny", "nz"] {
            writeln!(out, "property float {name}")?;
        }
        write!(
            out,
            "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.triangles.len()
        )?;
        for (point, normal) in self.points.iter().zip(&self.normals) {
            for number in point.iter().chain(normal) {
                out.write_all(&(*number as f32).to_le_bytes())?;
            }
        }
        for triangle in &self.triangles {
            out.write_all(&[3])?;
            for corner in triangle {
                out.write_all(&(*corner as i32).to_le_bytes())?;
            }
        }
        Ok(())
    }

    fn obj(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "# surface by agimp {}, m", env!("CARGO_PKG_VERSION"))?;
        for [x, y, z] in &self.points {
            writeln!(out, "v {x} {y} {z}")?;
        }
        for [x, y, z] in &self.normals {
            writeln!(out, "vn {x:.6} {y:.6} {z:.6}")?;
        }
        for [a, b, c] in self.triangles.iter().map(|corners| corners.map(|corner| corner + 1)) {
            writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?;
        }
        Ok(())
    }
}

/// Which particles belong to a body; all without a name.
fn chosen<'f>(frame: &'f Frame, body: Option<&str>) -> Result<Box<dyn Fn(usize) -> bool + 'f>, String> {
    let Some(body) = body else { return Ok(Box::new(|_| true)) };
    let names = &frame.header.bodies;
    let Some(number) = names.iter().position(|name| name == body) else {
        let known: Vec<_> = names.iter().take(12).map(|name| agimp::text::excerpt(name, 40)).collect();
        let body = agimp::text::excerpt(body, 60);
        return Err(format!("found no body {body}; expected one of: {}", known.join(", ")));
    };
    let bodies = frame.fields.iter().find_map(|(field, values)| match values {
        Values::Integer(numbers) if *field == PointField::Body => Some(numbers),
        _ => None,
    });
    let bodies =
        bodies.ok_or("the file does not contain the bodies of particles; add \"body\" to output.fields")?;
    Ok(Box::new(move |p| usize::try_from(bodies[p]).is_ok_and(|of| of == number)))
}
