//! `agimp info`: contents of output and checkpoint files.
use super::given::Given;
use crate::Failure;
use agimp::io::hdf5_file::{FileError, Reader};
use agimp::io::snapshot::{Header, PointField, compare};
use agimp::kernel::Coordinates;
use agimp::text::{bytes, count as grouped, number, printable, quantity_to};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `agimp info`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Outputs, checkpoints or trees: files, the directory of a run, its index (NAME.hdf.series) or its job
    /// file.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Read everything and compare the checksums.
    #[arg(long)]
    verify: bool,
}

/// Contents of an output file.
struct Contents {
    header: Header,
    size: u64,
    fields: Vec<&'static str>,
    /// Leaves and particles by level, if the file contains the tree.
    levels: BTreeMap<u8, (u64, u64)>,
}

/// Prints the contents of each file.
///
/// # Errors
/// The file is damaged or not of this program.
pub(crate) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let failed = |error: FileError| Failure::Usage(error.to_string());
    let files = Given::any(&arguments.files)?.files;
    let mut out = std::io::stdout().lock();
    for (number, path) in files.iter().enumerate() {
        let contents = read(path).map_err(failed)?;
        if files.len() > 1 {
            let gap = if number > 0 { "\n" } else { "" };
            writeln!(out, "{gap}file             {}", printable(&path.display().to_string()))?;
        }
        write(&mut out, &contents)?;
        if arguments.verify {
            let sets = compare::verify(path).map_err(failed)?;
            write!(out, "checksums        correct ({sets} data sets)")?;
            if contents.header.restart {
                let digest = compare::digest(path).map_err(failed)?;
                write!(out, "; digest {:016x}", digest.whole)?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<Contents, FileError> {
    let file = Reader::open_alone(path)?;
    let header = Header::read(&file)?;
    let size = std::fs::metadata(path).map_or(0, |data| data.len());
    let shown = |field: &&PointField| file.exists(&format!("VTKHDF/PointData/{}", field.name()));
    let fields = PointField::ALL.iter().filter(shown).map(|field| field.name()).collect();
    let levels = levels(&file, &header)?;
    Ok(Contents { header, size, fields, levels })
}

/// Leaves and particles by level, of the restart state or of a tree file.
fn levels(file: &Reader, header: &Header) -> Result<BTreeMap<u8, (u64, u64)>, FileError> {
    let mut levels: BTreeMap<u8, (u64, u64)> = BTreeMap::new();
    for (level, count) in compare::leaves(file, header)? {
        let entry = levels.entry(level).or_default();
        *entry = (entry.0 + 1, entry.1.saturating_add(count));
    }
    Ok(levels)
}

fn write(out: &mut impl Write, contents: &Contents) -> std::io::Result<()> {
    let Contents { header, size, fields, levels } = contents;
    let size = bytes(*size as f64);
    let program = printable(&header.program);
    writeln!(out, "written by       agimp {program} (format {}), {size}", header.format)?;
    writeln!(out, "job digest       {:016x}", header.job_digest)?;
    writeln!(out, "restart          {}", if header.restart { "possible" } else { "not from this file" })?;
    let point = |x: &mut dyn Iterator<Item = f64>| x.map(|c| number(c, 7)).collect::<Vec<_>>().join(", ");
    let low = point(&mut header.origin.iter().copied());
    let edges = header.origin.iter().zip(&header.roots);
    let high = point(&mut edges.map(|(low, &roots)| low + header.root_edge * roots as f64));
    writeln!(out, "domain           {}D, [{low}] to [{high}] m", header.dimension)?;
    if header.scalars.coordinates() == Coordinates::Axisymmetric {
        writeln!(out, "geometry         bodies of revolution about x = 0")?;
    }
    writeln!(out, "step             {}", header.step)?;
    let (time, dt) = (quantity_to(header.time, "s", 7), quantity_to(header.dt, "s", 4));
    writeln!(out, "time             {time} (last step {dt})")?;
    writeln!(out, "particles        {}", grouped(header.particles))?;
    writeln!(out, "leaves           {}", grouped(header.leaves))?;
    for (level, (leaves, particles)) in levels {
        let (leaves, particles) = (grouped(*leaves), grouped(*particles));
        writeln!(out, "  level {level:<2}       {leaves} leaves, {particles} particles")?;
    }
    writeln!(out, "materials        {}", printable(&header.materials.join(", ")))?;
    writeln!(out, "bodies           {}", printable(&header.bodies.join(", ")))?;
    if !fields.is_empty() {
        writeln!(out, "fields           {}", fields.join(", "))?;
    }
    for (name, value) in &header.scalars.reals {
        writeln!(out, "scalar           {} = {value:?}", printable(name))?;
    }
    for (name, value) in &header.scalars.counts {
        writeln!(out, "counter          {} = {value}", printable(name))?;
    }
    Ok(())
}
