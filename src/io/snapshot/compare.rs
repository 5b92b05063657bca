//! Digest of a file's state, and the first difference between two files.

use std::path::Path;

use super::checked::{Checked, Rows};
use super::header::Header;
use super::state::{columns, path};
use crate::io::hdf5_file::{Element, FileError, ParallelFile};

/// What identifies the state in a file, whatever the ranks that wrote it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Digest {
    /// One number for all of it.
    pub whole: u64,
    /// CRC-32 of each part: the header, then the data sets.
    pub parts: Vec<(String, u32)>,
}

/// Not collective. Reads the whole state, verifies its checksums and digests it.
pub fn digest(path: &Path) -> Result<Digest, FileError> {
    let file = ParallelFile::open_alone(path)?;
    let header = restartable(&file)?;
    match header.dimension {
        2 => digest_in::<2>(&file, &header),
        3 => digest_in::<3>(&file, &header),
        other => Err(file.refuse(format!("{other} dimensions"))),
    }
}

fn restartable(file: &ParallelFile) -> Result<Header, FileError> {
    let header = Header::read(file)?;
    if header.restart { Ok(header) } else { Err(file.refuse("the file holds no restart state")) }
}

fn all(total: u64) -> Rows {
    Rows { offset: 0, count: total, total }
}

fn digest_in<const D: usize>(file: &ParallelFile, header: &Header) -> Result<Digest, FileError> {
    let mut parts = vec![("header".to_owned(), header.state_checksum())];
    let (leaves, particles) = (all(header.leaves), all(header.particles));
    let mut checked = Checked::new(None, file);
    checked.read::<u8>(&path("tree", "level"), leaves, 0)?;
    checked.read::<u32>(&path("tree", "coord"), leaves, D)?;
    checked.read::<u64>(&path("tree", "particles"), leaves, 0)?;
    for name in &header.leaf_fields {
        checked.read::<f64>(&path("leaf", name), leaves, 0)?;
    }
    for set in columns::<D>() {
        checked.read::<f64>(&path("particles", set.name), particles, set.components())?;
    }
    for name in ["id", "tag"] {
        checked.read::<u64>(&path("particles", name), particles, 0)?;
    }
    parts.extend(checked.verify()?);
    // FNV-1a over the names and checksums.
    let whole = parts.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, (name, crc)| {
        name.bytes()
            .chain(crc.to_le_bytes())
            .fold(hash, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
    });
    Ok(Digest { whole, parts })
}

/// A difference between two files.
#[derive(Clone, Debug, PartialEq)]
pub enum Difference {
    /// An entry of the header.
    Header {
        /// Name of the entry.
        name: &'static str,
        /// Its values in both files.
        values: [String; 2],
    },
    /// The trees differ from this leaf on, counted along the curve.
    Tree {
        /// Number of the leaf.
        leaf: u64,
        /// Level and coordinates in both files, empty behind the last leaf.
        octants: [String; 2],
    },
    /// Particles that only one file has.
    Missing {
        /// The file that has them: 0 or 1.
        only_in: usize,
        /// Lowest identifier among them.
        id: u64,
        /// Their number.
        count: u64,
    },
    /// The same particles in another order.
    Order {
        /// First row that differs.
        row: u64,
        /// Identifiers there in both files.
        ids: [u64; 2],
    },
    /// A field differs.
    Field {
        /// Name of the field.
        name: &'static str,
        /// Lowest identifier of a particle that differs.
        id: u64,
        /// Component that differs first.
        component: usize,
        /// Values in both files.
        values: [f64; 2],
        /// Number of particles that differ.
        count: u64,
        /// Largest difference over all of them.
        largest: f64,
    },
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Header { name, values: [a, b] } => write!(f, "header: {name} is {a} and {b}"),
            Self::Tree { leaf, octants: [a, b] } => {
                write!(f, "tree: leaf {leaf} along the curve is {a} and {b}")
            }
            Self::Missing { only_in, id, count } => {
                let file = ["first", "second"][*only_in];
                write!(f, "particles: {count} only in the {file} file, lowest id {id}")
            }
            Self::Order { row, ids: [a, b] } => {
                write!(f, "order: row {row} holds particle {a} and particle {b}")
            }
            Self::Field { name, id, component, values: [a, b], count, largest } => write!(
                f,
                "{name}: particle {id}, component {component}: {a:?} and {b:?} \
                 ({count} particles differ, by {largest:e} at most)"
            ),
        }
    }
}

/// Not collective. Where the states of two files differ, fields in the order of the particle layout,
/// particles by identifier. Empty if they are the same bit for bit.
pub fn diff(a: &Path, b: &Path) -> Result<Vec<Difference>, FileError> {
    let files = [ParallelFile::open_alone(a)?, ParallelFile::open_alone(b)?];
    let headers = [restartable(&files[0])?, restartable(&files[1])?];
    match headers.each_ref().map(|header| header.dimension) {
        [2, 2] => diff_in::<2>(&files, &headers),
        [3, 3] => diff_in::<3>(&files, &headers),
        [one, other] => Err(files[0].refuse(format!("{one} dimensions, the other file has {other}"))),
    }
}

fn diff_in<const D: usize>(
    files: &[ParallelFile; 2],
    headers: &[Header; 2],
) -> Result<Vec<Difference>, FileError> {
    let mut found = Vec::new();
    for (name, value) in [
        ("job digest", (|h: &Header| format!("{:016x}", h.job_digest)) as fn(&Header) -> String),
        ("step", |h| h.step.to_string()),
        ("time", |h| format!("{:?}", h.time)),
        ("dt", |h| format!("{:?}", h.dt)),
        ("leaves", |h| h.leaves.to_string()),
        ("particles", |h| h.particles.to_string()),
        ("domain", |h| format!("{:?} {:?} {:?}", h.origin, h.root_edge, h.roots)),
    ] {
        let values = headers.each_ref().map(value);
        if values[0] != values[1] {
            found.push(Difference::Header { name, values });
        }
    }
    found.extend(diff_trees::<D>(files, headers)?);

    let read = |i: usize, name| read_all::<u64>(&files[i], "particles", name);
    let ids = [read(0, "id")?, read(1, "id")?];
    let order = ids.each_ref().map(|ids| {
        let mut order: Vec<usize> = (0..ids.len()).collect();
        order.sort_by_key(|&row| ids[row]);
        order
    });
    let pairs = join(&ids, &order, &mut found);
    if ids[0].len() == pairs.len() && ids[1].len() == pairs.len() {
        let differs = |row: &usize| ids[0][*row] != ids[1][*row];
        if let Some(row) = (0..pairs.len()).find(differs) {
            found.push(Difference::Order { row: row as u64, ids: [ids[0][row], ids[1][row]] });
        }
    }
    for set in columns::<D>() {
        let values = [0, 1].map(|i| read_all::<f64>(&files[i], "particles", set.name));
        let [a, b] = values;
        found.extend(diff_field(set.name, set.count, &pairs, &ids[0], &[a?, b?]));
    }
    let tags =
        [read(0, "tag")?, read(1, "tag")?].map(|tags| tags.into_iter().map(|tag| tag as f64).collect());
    found.extend(diff_field("tag", 1, &pairs, &ids[0], &tags));
    Ok(found)
}

fn read_all<T: Element>(file: &ParallelFile, kind: &str, name: &str) -> Result<Vec<T>, FileError> {
    let dataset = path(kind, name);
    let rows = file.shape(&dataset)?.0;
    file.read_slab(&dataset, 0, rows)
}

fn diff_trees<const D: usize>(
    files: &[ParallelFile; 2],
    headers: &[Header; 2],
) -> Result<Option<Difference>, FileError> {
    let level = |i: usize| read_all::<u8>(&files[i], "tree", "level");
    let coord = |i: usize| read_all::<u32>(&files[i], "tree", "coord");
    let (levels, coords) = ([level(0)?, level(1)?], [coord(0)?, coord(1)?]);
    let most = headers[0].leaves.max(headers[1].leaves) as usize;
    let octant = |i: usize, leaf: usize| {
        levels[i]
            .get(leaf)
            .map_or(String::new(), |level| format!("level {level} at {:?}", &coords[i][leaf * D..][..D]))
    };
    let same = |leaf: usize| octant(0, leaf) == octant(1, leaf);
    let first = (0..most).find(|&leaf| !same(leaf));
    Ok(first.map(|leaf| Difference::Tree { leaf: leaf as u64, octants: [0, 1].map(|i| octant(i, leaf)) }))
}

/// Rows of the particles that both files have, by identifier; the others are reported.
fn join(ids: &[Vec<u64>; 2], order: &[Vec<usize>; 2], found: &mut Vec<Difference>) -> Vec<[usize; 2]> {
    let (mut pairs, mut alone) = (Vec::new(), [Vec::new(), Vec::new()]);
    let (mut i, mut j) = (0, 0);
    loop {
        let at = [order[0].get(i).map(|&row| ids[0][row]), order[1].get(j).map(|&row| ids[1][row])];
        match at {
            [None, None] => break,
            [Some(a), Some(b)] if a == b => {
                pairs.push([order[0][i], order[1][j]]);
                (i, j) = (i + 1, j + 1);
            }
            [Some(a), b] if b.is_none_or(|b| a < b) => {
                alone[0].push(a);
                i += 1;
            }
            [_, b] => {
                alone[1].extend(b);
                j += 1;
            }
        }
    }
    for (only_in, ids) in alone.iter().enumerate() {
        if let Some(&id) = ids.first() {
            found.push(Difference::Missing { only_in, id, count: ids.len() as u64 });
        }
    }
    pairs
}

fn diff_field(
    name: &'static str,
    width: usize,
    pairs: &[[usize; 2]],
    ids: &[u64],
    values: &[Vec<f64>; 2],
) -> Option<Difference> {
    let (mut first, mut count, mut largest) = (None, 0, 0.0_f64);
    for &[a, b] in pairs {
        let rows = [&values[0][a * width..][..width], &values[1][b * width..][..width]];
        let differing = (0..width).filter(|&c| rows[0][c].to_bits() != rows[1][c].to_bits());
        let mut any = false;
        for component in differing {
            any = true;
            let pair = [rows[0][component], rows[1][component]];
            largest = largest.max((pair[0] - pair[1]).abs());
            first.get_or_insert((ids[a], component, pair));
        }
        count += u64::from(any);
    }
    first.map(|(id, component, values)| Difference::Field { name, id, component, values, count, largest })
}
