//! The restart state: tree and particles, bit by bit, in curve order.

use partition::comm::Comm;
use partition::{MAX_LEVEL, Octant};

use super::checked::{Checked, Rows};
use super::header::{GROUP, Header};
use super::{Restored, View};
use crate::io::hdf5_file::{FileError, ParallelFile};
use crate::particle::chunk::{Chunk, Layout, TILE};

/// One data set of particle columns.
pub(super) struct Columns {
    /// Name of the data set.
    pub name: &'static str,
    /// First column.
    pub first: usize,
    /// Number of columns.
    pub count: usize,
}

impl Columns {
    /// Components as [`ParallelFile::write_slab`] counts them: 0 for a plain list.
    pub fn components(&self) -> usize {
        if self.count == 1 { 0 } else { self.count }
    }
}

/// The data sets that hold the columns of [`Layout`], in its order.
pub(super) fn columns<const D: usize>() -> [Columns; 9] {
    let mut first = 0;
    let columns = [
        ("position", D),
        ("velocity", D),
        ("affine", D * D),
        ("left_cauchy_green", Layout::<D>::SYMMETRIC),
        ("stress", Layout::<D>::SYMMETRIC),
        ("mass", 1),
        ("half_width", 1),
        ("history", Layout::<D>::HISTORIES),
        ("plastic_work", 1),
    ]
    .map(|(name, count)| {
        first += count;
        Columns { name, first: first - count, count }
    });
    assert_eq!(first, Layout::<D>::REALS, "every column is saved");
    columns
}

/// The data set with the text of the job file.
pub(super) const JOB: &str = "state/job";

/// Path of a data set of the state.
pub(super) fn path(kind: &str, name: &str) -> String {
    format!("{GROUP}/{kind}/{name}")
}

/// Collective. Writes tree and particles below the header's group.
pub(super) fn write<const D: usize>(
    file: &ParallelFile,
    checked: &mut Checked,
    comm: &Comm,
    view: &View<D>,
    leaves: Rows,
    particles: Rows,
) -> Result<(), FileError> {
    // Rank 0 writes all of it.
    let text = if comm.rank() == 0 { view.job_text.as_bytes() } else { &[] };
    checked.write(JOB, Rows::place(comm, text.len() as u64), 0, text)?;
    for kind in ["tree", "leaf", "particles"] {
        file.create_group(&format!("{GROUP}/{kind}"))?;
    }
    let levels: Vec<u8> = view.leaves.iter().map(|leaf| leaf.level).collect();
    checked.write(&path("tree", "level"), leaves, 0, &levels)?;
    let coords: Vec<u32> = view.leaves.iter().flat_map(|leaf| leaf.coord).collect();
    checked.write(&path("tree", "coord"), leaves, D, &coords)?;
    let counts: Vec<u64> = view.chunks.iter().map(|chunk| chunk.len() as u64).collect();
    checked.write(&path("tree", "particles"), leaves, 0, &counts)?;
    for (name, values) in view.leaf_fields {
        checked.write(&path("leaf", name), leaves, 0, values)?;
    }
    for set in columns::<D>() {
        let Columns { name, first, count } = set;
        let mut values = Vec::with_capacity(particles.count as usize * count);
        for chunk in view.chunks {
            for p in 0..chunk.len() {
                values.extend(chunk.tile_of(p)[first..first + count].iter().map(|line| line[p % TILE]));
            }
        }
        checked.write(&path("particles", name), particles, set.components(), &values)?;
    }
    let ids: Vec<u64> = view.chunks.iter().flat_map(|chunk| chunk.ids()).copied().collect();
    checked.write(&path("particles", "id"), particles, 0, &ids)?;
    let tags: Vec<u64> = view.chunks.iter().flat_map(|chunk| chunk.tags()).copied().collect();
    checked.write(&path("particles", "tag"), particles, 0, &tags)
}

/// Collective. Reads tree and particles; each rank gets a contiguous share of the curve with about
/// the same number of particles.
pub(super) fn read<const D: usize>(
    file: &ParallelFile,
    comm: &Comm,
    header: Header,
) -> Result<Restored<D>, FileError> {
    let mut checked = Checked::new(Some(comm), file);
    let leaves = balanced_share(&mut checked, comm, &header)?;
    let levels: Vec<u8> = checked.read(&path("tree", "level"), leaves, 0)?;
    let coords: Vec<u32> = checked.read(&path("tree", "coord"), leaves, D)?;
    let counts: Vec<u64> = checked.read(&path("tree", "particles"), leaves, 0)?;
    let mut leaf_fields = Vec::new();
    for name in &header.leaf_fields {
        leaf_fields.push((name.clone(), checked.read::<f64>(&path("leaf", name), leaves, 0)?));
    }
    // Before the counts are trusted with memory.
    checked.verify()?;
    let octants: Vec<Octant<D>> = levels
        .iter()
        .zip(coords.chunks_exact(D))
        .map(|(&level, coord)| Octant { level, coord: std::array::from_fn(|axis| coord[axis]) })
        .collect();
    let particles = Rows::place(comm, counts.iter().sum());
    file.agree(check_tree(file, &header, &octants, particles.total))?;

    let mut chunks: Vec<Chunk<D>> = counts
        .iter()
        .map(|&count| {
            let mut chunk = Chunk::with_capacity(count as usize);
            chunk.extend_zeroed(count as usize);
            chunk
        })
        .collect();
    for set in columns::<D>() {
        let Columns { name, first, count } = set;
        let values: Vec<f64> = checked.read(&path("particles", name), particles, set.components())?;
        let mut rows = values.chunks_exact(count);
        for chunk in &mut chunks {
            let len = chunk.len();
            for (p, row) in rows.by_ref().take(len).enumerate() {
                chunk.write(first, p, row);
            }
        }
    }
    let ids: Vec<u64> = checked.read(&path("particles", "id"), particles, 0)?;
    let tags: Vec<u64> = checked.read(&path("particles", "tag"), particles, 0)?;
    let mut next = 0;
    for chunk in &mut chunks {
        let range = next..next + chunk.len();
        next = range.end;
        chunk.ids_mut().copy_from_slice(&ids[range.clone()]);
        chunk.tags_mut().copy_from_slice(&tags[range]);
    }
    checked.verify()?;
    Ok(Restored { header, leaves: octants, chunks, leaf_fields })
}

/// Collective. Cuts the curve so that each rank gets about the same number of particles (a leaf counts
/// as one more). Every rank looks at an equal part of the list of leaves, so none sees all of it.
fn balanced_share(checked: &mut Checked, comm: &Comm, header: &Header) -> Result<Rows, FileError> {
    let (rank, ranks) = (comm.rank() as u64, comm.size() as u64);
    let total = header.leaves;
    let even = |rank: u64| (u128::from(total) * u128::from(rank) / u128::from(ranks)) as u64;
    let part = Rows { offset: even(rank), count: even(rank + 1) - even(rank), total };
    let counts: Vec<u64> = checked.read(&path("tree", "particles"), part, 0)?;
    checked.verify()?;
    let mut before = comm.exclusive_sum_u64(counts.iter().map(|count| count + 1).sum());
    let whole = u128::from(header.particles + total);
    // Cut k comes behind the leaf with which the sum reaches k/P of the whole; one rank finds it.
    let mut cuts = vec![0; ranks as usize + 1];
    let shares = |sum: u64| (u128::from(sum) * u128::from(ranks) / whole.max(1)) as usize;
    for (leaf, count) in counts.iter().enumerate() {
        let after = before + count + 1;
        for cut in shares(before) + 1..=shares(after).min(ranks as usize) {
            cuts[cut] = part.offset + leaf as u64 + 1;
        }
        before = after;
    }
    comm.max_u64(&mut cuts);
    cuts[ranks as usize] = total;
    let [start, end] = [0, 1].map(|next| cuts[rank as usize + next]);
    Ok(Rows { offset: start, count: end.saturating_sub(start), total })
}

/// Octants inside the brick, in curve order, and the number of particles that the header says.
fn check_tree<const D: usize>(
    file: &ParallelFile,
    header: &Header,
    octants: &[Octant<D>],
    particles: u64,
) -> Result<(), FileError> {
    if particles != header.particles {
        let said = header.particles;
        return Err(file.refuse(format!("the leaves hold {particles} particles, the header says {said}")));
    }
    let inside = |octant: &Octant<D>| {
        let mut axes = octant.coord.iter().zip(&header.roots);
        octant.level <= MAX_LEVEL && axes.all(|(&c, &roots)| u64::from(c) < roots << octant.level)
    };
    if octants.iter().all(inside) { Ok(()) } else { Err(file.refuse("a leaf lies outside the domain")) }
}
