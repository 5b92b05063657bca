//! Particles of a file as those of another job.
use std::path::Path;

use super::content::columns::columns;
use super::header::{GROUP, Header, compatible};
use super::intact::checked::Checked;
use crate::io::hdf5_file::{FileError, Reader};
use crate::particle::chunk::{Chunk, Tag};

/// Not collective. The particles of a body of a file with restart state, or of its only body, in the order of
/// the file: with all of their state, at places relative to `origin`, m.
///
/// # Errors
/// The file cannot be read, is damaged, of another dimension, has no restart state, or several bodies and
/// none of this name.
pub fn particles<const D: usize>(path: &Path, body: &str, origin: &[f64; D]) -> Result<Chunk<D>, FileError> {
    let file = Reader::open_alone(path)?;
    let header = Header::read(&file)?;
    let wanted = match header.bodies.iter().position(|name| name == body) {
        Some(number) => Some(number),
        None if header.bodies.len() <= 1 => None,
        None => {
            let names =
                header.bodies.iter().take(9).map(|name| format!("\"{}\"", crate::text::excerpt(name, 40)));
            let names: Vec<String> = names.collect();
            return Err(file.refuse(format!(
                "it has the bodies {}, but none with the name of this body, \"{}\"",
                names.join(", "),
                crate::text::excerpt(body, 40)
            )));
        }
    };
    if !header.restart {
        return Err(file.refuse("it holds no restart state (output with `restart = false`, or a tree)"));
    }
    if header.dimension != D {
        return Err(file.refuse(format!("it is from a {}D run, but the job is {D}D", header.dimension)));
    }
    if !compatible(&header.program) {
        return Err(
            file.refuse(format!("it is from agimp {}, which uses another format of states", header.program))
        );
    }
    let shift: [f64; D] = std::array::from_fn(|a| header.origin.get(a).copied().unwrap_or(0.0) - origin[a]);
    let mut checked = Checked::new(None, &file, &header);
    let set = |name: &str| format!("{GROUP}/particles/{name}");
    let tags = checked.read_all::<u64>(&set("tag"), header.particles, 0)?;
    let is_wanted = |tag: u64| wanted.is_none_or(|number| usize::from(Tag::unpack(tag).body) == number);
    let rows: Vec<usize> = (0..tags.len()).filter(|&row| is_wanted(tags[row])).collect();
    let mut chunk = Chunk::with_capacity(rows.len());
    for _ in &rows {
        chunk.push_zeroed(0, Tag { material: 0, body: 0, level: 0 });
    }
    for of in columns::<D>() {
        let values = checked.read_all::<f64>(&set(of.name), header.particles, of.components())?;
        for (p, row) in rows.iter().enumerate() {
            chunk.write(of.first, p, &values[row * of.count..][..of.count]);
        }
    }
    for p in 0..chunk.len() {
        let x = chunk.position(p);
        // The same origin changes no bit.
        chunk.write(0, p, &std::array::from_fn::<f64, D, _>(|a| x[a] + shift[a]));
    }
    Ok(chunk)
}
