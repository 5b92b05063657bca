//! `agimp export`: particles, their surface, or the tree, for other programs.
use crate::Failure;
use crate::files::given::Given;
use agimp::io::snapshot::PointField;
use agimp::text::{bytes, count};
use post::export::points::{self, Format};
use post::export::surface::{MeshFormat, Surface};
use post::export::tree::Tree;
use post::frame::{Frame, shown_in};
use post::revolve::Revolve;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `agimp export`.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("format").required(true))]
pub struct Arguments {
    /// Outputs or checkpoints: files, the directory of a run, its index (NAME.hdf.series) or its job file.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Binary PLY with radii, single precision: for renderers such as Blender.
    #[arg(long, group = "format")]
    ply: bool,
    /// A row for each particle, all digits, names and units in the first row.
    #[arg(long, group = "format")]
    csv: bool,
    /// XML of VTK for points: for ParaView, PyVista and others.
    #[arg(long, group = "format")]
    vtp: bool,
    /// The surface of the material as a mesh of triangles with normals, in 3D: PLY or OBJ.
    #[arg(long, group = "format", value_name = "ply|obj", value_parser = mesh_format)]
    surface: Option<MeshFormat>,
    /// The leaves of the tree as VTK's HyperTreeGrid (XML), with the hierarchy: for ParaView 5.10 and later.
    #[arg(long, group = "format")]
    htg: bool,
    /// Bodies of revolution in space (jobs with geometry = "axisymmetric"), whole or with a quarter cut out.
    /// Surfaces are always in space.
    #[arg(long, value_name = "open|whole", num_args = 0..=1, require_equals = true, default_missing_value = "whole",
        value_parser = str::parse::<Revolve>, conflicts_with = "htg")]
    revolve: Option<Revolve>,
    /// With --surface: only the body of this name.
    #[arg(long, requires = "surface", value_name = "NAME")]
    body: Option<String>,
    /// Fields to export, separated by commas; by default all fields of the files.
    #[arg(long, value_delimiter = ',', value_parser = super::field, conflicts_with_all = ["surface", "htg"])]
    fields: Option<Vec<PointField>>,
    /// Directory to write to, or of one output the file, with the ending of its format; by default beside
    /// each file.
    #[arg(long, value_name = "DIR|FILE")]
    out: Option<PathBuf>,
}

fn mesh_format(text: &str) -> Result<MeshFormat, String> {
    match text {
        "ply" => Ok(MeshFormat::Ply),
        "obj" => Ok(MeshFormat::Obj),
        _ => Err("expected ply or obj".into()),
    }
}

/// Writes a file for each output.
///
/// # Errors
/// A file cannot be read or does not show a field, or one cannot be written.
pub(crate) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let failed = |error: agimp::io::hdf5_file::FileError| Failure::Usage(error.to_string());
    if arguments.body.is_some() && arguments.surface.is_none() {
        // The parser lets the group of formats pass for --surface.
        return Err(Failure::Usage(
            "found --body without --surface; expected both, or --surface alone".into(),
        ));
    }
    let format = if arguments.ply {
        Format::Ply
    } else if arguments.csv {
        Format::Csv
    } else {
        Format::Vtp
    };
    let given =
        if arguments.htg { Given::any(&arguments.files) } else { Given::particles(&arguments.files) }?;
    let ending = match arguments.surface {
        _ if arguments.htg => "htg",
        Some(mesh) => mesh.ending(),
        None => format.ending(),
    };
    // A name that a user chooses need not say that it is a surface.
    let short = ending.rsplit('.').next().unwrap_or(ending);
    let outs = super::outs(arguments.out.as_deref(), &given.files, &[ending, short], "")?;
    for (file, out) in given.files.iter().zip(outs) {
        let made = if arguments.htg {
            let tree = Tree::read(file).map_err(failed)?;
            tree.write(&out).map_err(failed)?;
            format!("{} leaves", count(tree.leaf_count() as u64))
        } else if let Some(format) = arguments.surface {
            let frame = Frame::read(file, &[PointField::Body], false).map_err(failed)?;
            let whole = frame.is_of_revolution().then_some(Revolve::Whole);
            let frame = revolved(frame, arguments.revolve.or(whole), file)?;
            let surface = Surface::of(&frame, arguments.body.as_deref())
                .map_err(|reason| Failure::Usage(format!("{}: {reason}", file.display())))?;
            surface.write(format, &out).map_err(failed)?;
            format!("{} triangles", count(surface.triangles.len() as u64))
        } else {
            let fields = match &arguments.fields {
                Some(fields) => fields.clone(),
                None => shown_in(file).map_err(failed)?,
            };
            let frame = Frame::read(file, &fields, true).map_err(failed)?;
            let frame = revolved(frame, arguments.revolve, file)?;
            points::write(&frame, format, &out).map_err(failed)?;
            format!("{} particles", count(frame.positions.len() as u64))
        };
        let size = std::fs::metadata(&out).map_or(0, |data| data.len());
        writeln!(std::io::stdout(), "{} ({made}, {})", out.display(), bytes(size as f64))?;
    }
    Ok(())
}

/// The particles of a file as they are, or in space.
fn revolved(frame: Frame, revolve: Option<Revolve>, file: &Path) -> Result<Frame, Failure> {
    let refused = |reason: String| Failure::Usage(format!("{}: {reason}", file.display()));
    match revolve {
        Some(revolve) => frame.revolved(revolve).map_err(refused),
        None => Ok(frame),
    }
}
