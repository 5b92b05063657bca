//! Data sets with a checksum over all ranks, and this rank's place in them.

use partition::comm::Comm;

use crate::io::hdf5_file::{Element, FileError, ParallelFile};

/// Attribute that holds the CRC-32 of a data set's bytes in file order.
const CHECKSUM: &str = "crc32";

/// The rows of this rank among those of all ranks, in rank order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rows {
    /// First row of this rank.
    pub offset: u64,
    /// Rows of this rank.
    pub count: u64,
    /// Rows of all ranks.
    pub total: u64,
}

impl Rows {
    /// Collective. Places `count` rows behind those of the lower ranks.
    pub fn place(comm: &Comm, count: u64) -> Self {
        let mut total = [count];
        comm.sum_u64(&mut total);
        Self { offset: comm.exclusive_sum_u64(count), count, total: total[0] }
    }

    /// As many rows per row; for example the corners of each leaf.
    pub fn times(self, n: u64) -> Self {
        Self { offset: self.offset * n, count: self.count * n, total: self.total * n }
    }

    /// One more row at the end, on the last rank with rows (the first rank if none has).
    pub fn and_one(self, comm: &Comm) -> Self {
        let last = comm.rank() + 1 == comm.size();
        Self { count: self.count + u64::from(last), total: self.total + 1, ..self }
    }
}

/// Checksums of the data sets of one file, collected while they are written or read.
pub(super) struct Checked<'a> {
    comm: Option<&'a Comm>,
    file: &'a ParallelFile,
    parts: Vec<(String, u32, u64)>,
}

impl<'a> Checked<'a> {
    /// Starts to collect for a file, shared by `comm` or opened alone.
    pub fn new(comm: Option<&'a Comm>, file: &'a ParallelFile) -> Self {
        Self { comm, file, parts: Vec::new() }
    }

    fn note<T: Element>(&mut self, dataset: &str, values: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        self.parts.push((dataset.to_owned(), crc32fast::hash(bytes), bytes.len() as u64));
    }

    /// Collective. Writes this rank's rows of a new data set.
    pub fn write<T: Element>(
        &mut self,
        dataset: &str,
        rows: Rows,
        components: usize,
        values: &[T],
    ) -> Result<(), FileError> {
        debug_assert_eq!(values.len() as u64, rows.count * components.max(1) as u64);
        self.note(dataset, values);
        self.file.write_slab(dataset, rows.total, components, rows.offset, values)
    }

    /// Collective on a shared file. Reads this rank's rows. The ranks' parts must follow each other
    /// and cover the data set, or the checksum cannot be compared.
    pub fn read<T: Element>(
        &mut self,
        dataset: &str,
        rows: Rows,
        components: usize,
    ) -> Result<Vec<T>, FileError> {
        let shape = self.file.shape(dataset).and_then(|shape| {
            let bytes = self.file.element_bytes(dataset)?;
            if shape == (rows.total, components) && bytes == size_of::<T>() {
                return Ok(());
            }
            Err(self.file.refuse(format!(
                "{dataset} has {} rows of {} numbers of {bytes} bytes; the header says {} rows of {components} of {}",
                shape.0,
                shape.1,
                rows.total,
                size_of::<T>()
            )))
        });
        self.file.agree(shape)?;
        let values = self.file.read_slab(dataset, rows.offset, rows.count)?;
        self.note(dataset, &values);
        Ok(values)
    }

    /// Collective on a shared file. The checksums over all ranks, in file order.
    pub fn combine(&mut self) -> Vec<(String, u32)> {
        let mine: Vec<u64> = self.parts.iter().flat_map(|&(_, crc, bytes)| [u64::from(crc), bytes]).collect();
        let all = match self.comm {
            Some(comm) => comm.all_gather_u64(&mine),
            None => mine,
        };
        let stride = (2 * self.parts.len()).max(1);
        let names = std::mem::take(&mut self.parts);
        let crc = |i: usize| {
            let mut whole = crc32fast::Hasher::new();
            for part in all.chunks_exact(stride) {
                whole.combine(&crc32fast::Hasher::new_with_initial_len(part[2 * i] as u32, part[2 * i + 1]));
            }
            whole.finalize()
        };
        names.into_iter().enumerate().map(|(i, (name, ..))| (name, crc(i))).collect()
    }

    /// Collective on a shared file. Attaches the checksums to the data sets written.
    pub fn attach(&mut self) -> Result<(), FileError> {
        for (dataset, crc) in self.combine() {
            self.file.set_attribute(&dataset, CHECKSUM, &[u64::from(crc)])?;
        }
        Ok(())
    }

    /// Collective on a shared file. Compares the checksums of the data sets read with those attached
    /// and returns them.
    pub fn verify(&mut self) -> Result<Vec<(String, u32)>, FileError> {
        let combined = self.combine();
        let compare = |(dataset, crc): &(String, u32)| {
            let attached = self.file.attribute::<u64>(dataset, CHECKSUM)?;
            if attached == [u64::from(*crc)] {
                return Ok(());
            }
            Err(self.file.refuse(format!("wrong checksum of {dataset}: the file is damaged")))
        };
        let compared = combined.iter().try_for_each(compare);
        self.file.agree(compared.map(|()| combined))
    }
}
