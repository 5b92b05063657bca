//! `agimp export`: particles, their surface, or the tree, for other programs.
use super::given::Given;
use crate::cli::Failure;
use crate::io::export::points::{self, Format};
use crate::io::export::surface::{MeshFormat, Surface};
use crate::io::export::tree::Tree;
use crate::io::frame::{Frame, shown_in};
use crate::io::snapshot::PointField;
use crate::text::{bytes, count};
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
    /// With --surface: only the body of this name.
    #[arg(long, requires = "surface", value_name = "NAME")]
    body: Option<String>,
    /// Fields to export, separated by commas; by default all fields of the files.
    #[arg(long, value_delimiter = ',', value_parser = super::field, conflicts_with_all = ["surface", "htg"])]
    fields: Option<Vec<PointField>>,
    /// Directory to write to; by default that of each file.
    #[arg(long, value_name = "DIR")]
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
pub(in crate::cli) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let failed = |error: crate::io::hdf5_file::FileError| Failure::Usage(error.to_string());
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
    if let Some(directory) = &arguments.out {
        std::fs::create_dir_all(directory).map_err(|error| {
            Failure::Usage(format!("{}: cannot create the directory: {error}", directory.display()))
        })?;
    }
    let place = |file: &Path, ending: &str| {
        let beside = file.with_extension(ending);
        match (&arguments.out, beside.file_name()) {
            (Some(directory), Some(name)) => directory.join(name),
            _ => beside,
        }
    };
    let given =
        if arguments.htg { Given::any(&arguments.files) } else { Given::particles(&arguments.files) }?;
    for file in given.files {
        let (out, made) = if arguments.htg {
            let tree = Tree::read(&file).map_err(failed)?;
            let out = place(&file, "htg");
            tree.write(&out).map_err(failed)?;
            (out, format!("{} leaves", count(tree.leaf_count() as u64)))
        } else if let Some(format) = arguments.surface {
            let frame = Frame::read(&file, &[PointField::Body], false).map_err(failed)?;
            let surface = Surface::of(&frame, arguments.body.as_deref())
                .map_err(|reason| Failure::Usage(format!("{}: {reason}", file.display())))?;
            let out = place(&file, format.ending());
            surface.write(format, &out).map_err(failed)?;
            (out, format!("{} triangles", count(surface.triangles.len() as u64)))
        } else {
            let fields = match &arguments.fields {
                Some(fields) => fields.clone(),
                None => shown_in(&file).map_err(failed)?,
            };
            let frame = Frame::read(&file, &fields, true).map_err(failed)?;
            let out = place(&file, format.ending());
            points::write(&frame, format, &out).map_err(failed)?;
            (out, format!("{} particles", count(frame.positions.len() as u64)))
        };
        let size = std::fs::metadata(&out).map_or(0, |data| data.len());
        writeln!(std::io::stdout(), "{} ({made}, {})", out.display(), bytes(size as f64))?;
    }
    Ok(())
}
