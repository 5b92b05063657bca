//! Digest of a file's state, and the first difference between two files.

use std::path::Path;

use partition::comm::{Comm, Disagreement};

use super::content::columns::{CARRIED, columns};
use super::content::state::{self, carried_columns, carried_components, check_tree, octants, path};
use super::header::Header;
use super::intact::checked::{self, Checked};
use super::intact::sane::{self, Limits};
use crate::checksum::fnv1a;
use crate::io::hdf5_file::{Element, FileError, Reader};

/// Digest of the state in a file, independent of the ranks that wrote it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Digest {
    /// One number for all of it.
    pub whole: u64,
    /// CRC-32 of each part: the header, then the data sets.
    pub parts: Vec<(String, u32)>,
}

/// Not collective. Compares the checksums of all data sets of a file, with or without a state. Returns their
/// number.
pub fn verify(path: &Path) -> Result<usize, FileError> {
    let file = Reader::open_alone(path)?;
    let header = Header::read(&file)?;
    checked::verify(&file, &header, |_, _| true)
}

/// Collective. Compares the checksums of the data sets that [`super::read`] does not read, each on one rank.
/// An error is the same on all ranks.
pub fn verify_beside_state(comm: &Comm, path: &Path) -> Result<(), Disagreement> {
    let is_read = |name: &str| name.starts_with("state/") && name != state::JOB;
    let mine = |number: usize, name: &str| !is_read(name) && number % comm.size() == comm.rank();
    let verified =
        Reader::open_alone(path).and_then(|file| checked::verify(&file, &Header::read(&file)?, mine));
    comm.agree(verified).map(|_| ())
}

/// Not collective. Level and particles of each leaf, where the file holds the tree.
pub fn leaves(file: &Reader, header: &Header) -> Result<Vec<(u8, u64)>, FileError> {
    let rows = header.leaves;
    let (state, shown) = (path("tree", "level"), "VTKHDF/CellData/level");
    let (levels, counts): (Vec<u8>, Vec<u64>) = if file.exists(&state) {
        let counts = read_all(file, header, &path("tree", "particles"), rows, 0)?;
        (read_all(file, header, &state, rows, 0)?, counts)
    } else if file.exists(shown) {
        let counts = read_all::<i64>(file, header, "VTKHDF/CellData/particles", rows, 0)?;
        let counts = counts.into_iter().map(i64::unsigned_abs).collect();
        (read_all(file, header, shown, rows, 0)?, counts)
    } else {
        return Ok(Vec::new());
    };
    Ok(levels.into_iter().zip(counts).collect())
}

/// Not collective. Reads the whole state, verifies its checksums and digests it. Refuses a state that no run
/// can have written.
pub fn digest(path: &Path) -> Result<Digest, FileError> {
    let file = Reader::open_alone(path)?;
    let header = restartable(&file)?;
    match header.dimension {
        2 => digest_in::<2>(&file, &header),
        3 => digest_in::<3>(&file, &header),
        other => Err(file.refuse(format!("{other} dimensions"))),
    }
}

fn restartable(file: &Reader) -> Result<Header, FileError> {
    let header = Header::read(file)?;
    if header.restart { Ok(header) } else { Err(file.refuse("the file holds no restart state")) }
}

fn digest_in<const D: usize>(file: &Reader, header: &Header) -> Result<Digest, FileError> {
    let mut parts = vec![("header".to_owned(), header.state_checksum())];
    let (leaves, particles) = (header.leaves, header.particles);
    let mut checked = Checked::new(None, file, header);
    let levels = checked.read_all::<u8>(&path("tree", "level"), leaves, 0)?;
    let coords = checked.read_all::<u32>(&path("tree", "coord"), leaves, D)?;
    let counts = checked.read_all::<u64>(&path("tree", "particles"), leaves, 0)?;
    let octants = octants::<D>(&levels, &coords);
    let sum = counts.iter().fold(0, |sum: u64, &count| sum.saturating_add(count));
    check_tree(file, header, &octants, sum)?;
    for name in &header.leaf_fields {
        checked.read_all::<f64>(&path("leaf", name), leaves, 0)?;
    }
    let sane = |result: Result<(), String>| result.map_err(|reason| file.refuse(reason));
    for set in columns::<D>() {
        let values = checked.read_all(&path("particles", set.name), particles, set.components())?;
        sane(sane::reals(set.name, &values, set.count))?;
        if set.name == "position" {
            sane(sane::positions(header, &octants, &counts, &values))?;
        }
    }
    let columns = carried_columns(file, header)?;
    if columns > 0 {
        let values = checked.read_all(&path("particles", CARRIED), particles, carried_components(columns))?;
        sane(sane::reals(CARRIED, &values, columns))?;
    }
    sane(sane::identifiers(&checked.read_all(&path("particles", "id"), particles, 0)?))?;
    let tags = checked.read_all(&path("particles", "tag"), particles, 0)?;
    // The bodies are in the job only.
    let limits = Limits { materials: header.materials.len(), bodies: usize::MAX };
    sane(sane::tags(&tags, limits))?;
    parts.extend(checked.into_sums());
    // Over the names and checksums.
    let bytes = parts.iter().flat_map(|(name, crc)| name.bytes().chain(crc.to_le_bytes()));
    let whole = fnv1a(bytes.map(u64::from));
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

/// Not collective. Differences between the states of two files, fields in the order of the particle layout,
/// particles by identifier. Empty if they are the same bit for bit.
pub fn diff(a: &Path, b: &Path) -> Result<Vec<Difference>, FileError> {
    let files = [Reader::open_alone(a)?, Reader::open_alone(b)?];
    let headers = [restartable(&files[0])?, restartable(&files[1])?];
    match headers.each_ref().map(|header| header.dimension) {
        [2, 2] => diff_in::<2>(&files, &headers),
        [3, 3] => diff_in::<3>(&files, &headers),
        [one, other] => Err(files[0].refuse(format!("{one} dimensions, the other file has {other}"))),
    }
}

fn diff_in<const D: usize>(files: &[Reader; 2], headers: &[Header; 2]) -> Result<Vec<Difference>, FileError> {
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

    let rows = headers.each_ref().map(|header| header.particles);
    let read = |i: usize, name| read_all::<u64>(&files[i], &headers[i], &path("particles", name), rows[i], 0);
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
        let dataset = path("particles", set.name);
        let values =
            [0, 1].map(|i| read_all::<f64>(&files[i], &headers[i], &dataset, rows[i], set.components()));
        let [a, b] = values;
        found.extend(diff_field(set.name, set.count, &pairs, &ids[0], &[a?, b?]));
    }
    let carried = [0, 1].map(|i| carried_columns(&files[i], &headers[i]));
    let [a, b] = carried;
    let columns = a?.max(b?);
    if columns > 0 {
        let [a, b] = [0, 1].map(|i| carried_of(&files[i], &headers[i], columns));
        found.extend(diff_field(CARRIED, columns, &pairs, &ids[0], &[a?, b?]));
    }
    let tags =
        [read(0, "tag")?, read(1, "tag")?].map(|tags| tags.into_iter().map(|tag| tag as f64).collect());
    found.extend(diff_field("tag", 1, &pairs, &ids[0], &tags));
    Ok(found)
}

/// Surface and forces that particles carry, in so many columns; zeros if the file has other columns.
fn carried_of(file: &Reader, header: &Header, columns: usize) -> Result<Vec<f64>, FileError> {
    let rows = header.particles;
    match carried_columns(file, header)? == columns {
        true => read_all(file, header, &path("particles", CARRIED), rows, carried_components(columns)),
        false => Ok(vec![0.0; rows as usize * columns]),
    }
}

/// A whole data set with the right checksum.
fn read_all<T: Element>(
    file: &Reader,
    header: &Header,
    dataset: &str,
    rows: u64,
    components: usize,
) -> Result<Vec<T>, FileError> {
    Checked::new(None, file, header).read_all(dataset, rows, components)
}

fn diff_trees<const D: usize>(
    files: &[Reader; 2],
    headers: &[Header; 2],
) -> Result<Option<Difference>, FileError> {
    let rows = headers.each_ref().map(|header| header.leaves);
    let level = |i: usize| read_all::<u8>(&files[i], &headers[i], &path("tree", "level"), rows[i], 0);
    let coord = |i: usize| read_all::<u32>(&files[i], &headers[i], &path("tree", "coord"), rows[i], D);
    let (levels, coords) = ([level(0)?, level(1)?], [coord(0)?, coord(1)?]);
    let most = levels[0].len().max(levels[1].len());
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
