//! Data sets with a checksum over all ranks, and this rank's place in them.
//!
//! The header holds the names of all data sets of its file with their checksums, under a checksum of its own.
//! So no data set can be lost, changed or take the place of another without notice.

use partition::comm::Comm;

use crate::io::hdf5_file::{Element, FileError, Reader, Stored, Writer};
use crate::io::snapshot::header::Header;

/// The rows of this rank among those of all ranks, in rank order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::io::snapshot) struct Rows {
    /// First row of this rank.
    pub offset: u64,
    /// Rows of this rank.
    pub count: u64,
    /// Rows of all ranks.
    pub total: u64,
}

impl Rows {
    /// Collective. Places `count` rows behind those of the lower ranks.
    pub(in crate::io::snapshot) fn place(comm: &Comm, count: u64) -> Self {
        let mut total = [count];
        comm.sum_u64(&mut total);
        Self { offset: comm.exclusive_sum_u64(count), count, total: total[0] }
    }

    /// As many rows per row; for example the corners of each leaf.
    pub(in crate::io::snapshot) fn times(self, n: u64) -> Self {
        Self { offset: self.offset * n, count: self.count * n, total: self.total * n }
    }

    /// One more row at the end, on the last rank with rows (the first rank if none has).
    pub(in crate::io::snapshot) fn and_one(self, comm: &Comm) -> Self {
        let last = comm.rank() + 1 == comm.size();
        Self { count: self.count + u64::from(last), total: self.total + 1, ..self }
    }
}

/// CRC-32 of this rank's part of a data set, and its bytes.
fn part<T: Element>(values: &[T]) -> [u64; 2] {
    let bytes: &[u8] = bytemuck::cast_slice(values);
    [u64::from(crc32fast::hash(bytes)), bytes.len() as u64]
}

/// Collective with a communicator. The CRC-32 of whole data sets, in file order.
fn combine(comm: Option<&Comm>, parts: &[[u64; 2]]) -> Vec<u32> {
    let mine = parts.as_flattened();
    let all = comm.map_or_else(|| mine.to_vec(), |comm| comm.all_gather_u64(mine));
    let crc = |i: usize| {
        let mut whole = crc32fast::Hasher::new();
        for rank in all.chunks_exact(mine.len()) {
            whole.combine(&crc32fast::Hasher::new_with_initial_len(rank[2 * i] as u32, rank[2 * i + 1]));
        }
        whole.finalize()
    };
    (0..parts.len()).map(crc).collect()
}

/// Writes the data sets of a new file and collects their checksums.
pub(in crate::io::snapshot) struct Recorded<'a> {
    comm: &'a Comm,
    file: &'a Writer,
    names: Vec<String>,
    parts: Vec<[u64; 2]>,
    /// Second names: the first one, the second.
    links: Vec<(String, String)>,
}

impl<'a> Recorded<'a> {
    /// Starts to collect.
    pub(in crate::io::snapshot) fn new(comm: &'a Comm, file: &'a Writer) -> Self {
        Self { comm, file, names: Vec::new(), parts: Vec::new(), links: Vec::new() }
    }

    /// Collective. Writes this rank's rows of a new data set.
    pub(in crate::io::snapshot) fn write<T: Element>(
        &mut self,
        dataset: &str,
        rows: Rows,
        components: usize,
        values: &[T],
    ) -> Result<(), FileError> {
        debug_assert_eq!(values.len() as u64, rows.count * components.max(1) as u64);
        self.names.push(dataset.to_owned());
        self.parts.push(part(values));
        self.file.write_slab(dataset, rows.total, components, rows.offset, values)
    }

    /// Collective. Gives a data set a second name.
    pub(in crate::io::snapshot) fn link(&mut self, dataset: &str, new: &str) -> Result<(), FileError> {
        self.links.push((dataset.to_owned(), new.to_owned()));
        self.file.hard_link(dataset, new)
    }

    /// Collective. The checksums of all data sets, under all their names.
    pub(in crate::io::snapshot) fn checksums(self) -> Vec<(String, u32)> {
        let crcs = combine(Some(self.comm), &self.parts);
        let mut sums: Vec<(String, u32)> = self.names.into_iter().zip(crcs).collect();
        for (dataset, new) in self.links {
            let crc = sums.iter().find(|(name, _)| *name == dataset).map(|&(_, crc)| crc);
            sums.extend(crc.map(|crc| (new, crc)));
        }
        sums
    }
}

/// Reads data sets, each of which must have the checksum that the header has for it.
pub struct Checked<'a> {
    comm: Option<&'a Comm>,
    file: &'a Reader,
    header: &'a Header,
    sums: Vec<(String, u32)>,
}

impl<'a> Checked<'a> {
    /// For a file that is opened on all ranks of `comm`, or alone.
    pub fn new(comm: Option<&'a Comm>, file: &'a Reader, header: &'a Header) -> Self {
        Self { comm, file, header, sums: Vec::new() }
    }

    /// Collective on a shared file. Reads this rank's rows. The ranks' parts must follow each other
    /// and cover the data set, or its checksum cannot be compared.
    pub(in crate::io::snapshot) fn read<T: Element>(
        &mut self,
        dataset: &str,
        rows: Rows,
        components: usize,
    ) -> Result<Vec<T>, FileError> {
        let expected = (rows.total, components, T::KIND);
        let shape = self.file.stored(dataset).and_then(|stored| {
            let Stored { rows, components, kind, .. } = stored;
            if (rows, components, kind) == expected {
                return Ok(());
            }
            let (total, numbers, wanted) = expected;
            Err(self.file.refuse(format!(
                "{dataset} has {rows} rows of {} {kind}; expected {total} rows of {} {wanted}",
                components.max(1),
                numbers.max(1),
            )))
        });
        self.file.agree(shape)?;
        let values = self.file.read_slab(dataset, rows.offset, rows.count)?;
        let crc = combine(self.comm, &[part(&values)])[0];
        self.file.agree(compare(self.file, self.header, dataset, crc))?;
        self.sums.push((dataset.to_owned(), crc));
        Ok(values)
    }

    /// Not collective, for a file opened alone. Reads a whole data set of as many rows as the header says.
    pub fn read_all<T: Element>(
        &mut self,
        dataset: &str,
        rows: u64,
        components: usize,
    ) -> Result<Vec<T>, FileError> {
        self.read(dataset, Rows { offset: 0, count: rows, total: rows }, components)
    }

    /// Names and checksums of the data sets read, in their order.
    pub fn into_sums(self) -> Vec<(String, u32)> {
        self.sums
    }
}

/// Refuses a data set whose checksum is not the one in the header.
fn compare(file: &Reader, header: &Header, dataset: &str, crc: u32) -> Result<(), FileError> {
    match header.checksum(dataset) {
        Some(expected) if expected == crc => Ok(()),
        Some(_) => Err(file.refuse(format!("wrong checksum of {dataset}: the file is damaged"))),
        None => Err(file.refuse(format!("{dataset} has no checksum in the header"))),
    }
}

/// Not collective. Compares the checksums of those data sets in the header's list that `is_meant` by number
/// and name. Returns how many they are.
pub(in crate::io::snapshot) fn verify(
    file: &Reader,
    header: &Header,
    is_meant: impl Fn(usize, &str) -> bool,
) -> Result<usize, FileError> {
    let sets = header.checksums.iter().enumerate().filter(|(number, (name, _))| is_meant(*number, name));
    let mut verified = 0;
    for (_, (dataset, _)) in sets {
        let mut crc = crc32fast::Hasher::new();
        file.for_bytes(dataset, |bytes| crc.update(bytes))?;
        compare(file, header, dataset, crc.finalize())?;
        verified += 1;
    }
    Ok(verified)
}
