//! The restart state: tree and particles, bit by bit, in curve order.

use partition::comm::Comm;
use partition::{MAX_LEVEL, Octant};

use super::columns::{CARRIED, Columns, columns};
use super::fields::PointField;
use crate::io::hdf5_file::{FileError, Reader, Writer};
use crate::io::snapshot::header::{GROUP, Header};
use crate::io::snapshot::intact::checked::{Checked, Recorded, Rows};
use crate::io::snapshot::intact::sane::{self, Limits};
use crate::io::snapshot::view::View;
use crate::particle::chunk::{Chunk, TILE};

/// The data set with the text of the job file.
pub(in crate::io::snapshot) const JOB: &str = "state/job";

/// Path of a data set of the state.
pub(in crate::io::snapshot) fn path(kind: &str, name: &str) -> String {
    format!("{GROUP}/{kind}/{name}")
}

/// Collective. Writes the text of the job, all of it by rank 0.
pub(in crate::io::snapshot) fn write_job<const D: usize>(
    recorded: &mut Recorded,
    comm: &Comm,
    view: &View<D>,
) -> Result<(), FileError> {
    let text = if comm.rank() == 0 { view.job_text.as_bytes() } else { &[] };
    recorded.write(JOB, Rows::place(comm, text.len() as u64), 0, text)
}

/// The data set of the largest values of a map.
pub(in crate::io::snapshot) fn map(name: &str, what: &str) -> String {
    format!("maps/{name}/{what}")
}

/// Collective. Writes the largest values of maps, all of them by rank 0.
pub(in crate::io::snapshot) fn write_maps<const D: usize>(
    file: &Writer,
    recorded: &mut Recorded,
    comm: &Comm,
    view: &View<D>,
) -> Result<(), FileError> {
    if view.maps.is_empty() {
        return Ok(());
    }
    file.create_group("maps")?;
    for (of, maxima) in view.maps.iter().zip(view.maxima) {
        file.create_group(&format!("maps/{}", of.name))?;
        let sets = [
            ("depth", "m", "Largest depth so far", &maxima.depth),
            ("speed", "m/s", "Largest speed so far", &maxima.speed),
        ];
        for (what, unit, meaning, values) in sets {
            let mine: &[f64] = if comm.rank() == 0 { values } else { &[] };
            recorded.write(&map(&of.name, what), Rows::place(comm, mine.len() as u64), 0, mine)?;
            let [columns, rows] = of.size;
            let meaning = format!(
                "{meaning}, in {rows} rows of {columns} from south to north, cells of {:?} m.",
                of.cell
            );
            file.set_texts(&map(&of.name, what), &[("units", unit), ("description", meaning.as_str())])?;
        }
    }
    Ok(())
}

/// Collective. Writes tree and particles below the header's group.
pub(in crate::io::snapshot) fn write<const D: usize>(
    file: &Writer,
    recorded: &mut Recorded,
    comm: &Comm,
    view: &View<D>,
    leaves: Rows,
    particles: Rows,
) -> Result<(), FileError> {
    for kind in ["tree", "leaf", "particles"] {
        file.create_group(&format!("{GROUP}/{kind}"))?;
    }
    let levels: Vec<u8> = view.leaves.iter().map(|leaf| leaf.level).collect();
    recorded.write(&path("tree", "level"), leaves, 0, &levels)?;
    let coords: Vec<u32> = view.leaves.iter().flat_map(|leaf| leaf.coord).collect();
    recorded.write(&path("tree", "coord"), leaves, D, &coords)?;
    let counts: Vec<u64> = view.chunks.iter().map(|chunk| chunk.len() as u64).collect();
    recorded.write(&path("tree", "particles"), leaves, 0, &counts)?;
    for (name, values) in view.leaf_fields {
        recorded.write(&path("leaf", name), leaves, 0, values)?;
    }
    for set in columns::<D>() {
        let Columns { name, first, count, .. } = set;
        let mut values = Vec::with_capacity(particles.count as usize * count);
        for chunk in view.chunks {
            for p in 0..chunk.len() {
                values.extend(chunk.tile_of(p)[first..first + count].iter().map(|line| line[p % TILE]));
            }
        }
        recorded.write(&path("particles", name), particles, set.components(), &values)?;
        let texts = [("units", set.unit), ("description", set.meaning)];
        file.set_texts(&path("particles", name), &texts)?;
    }
    write_carried(file, recorded, comm, view, particles)?;
    let ids: Vec<u64> = view.chunks.iter().flat_map(|chunk| chunk.ids()).copied().collect();
    recorded.write(&path("particles", "id"), particles, 0, &ids)?;
    let texts = [("units", ""), ("description", PointField::Id.meaning())];
    file.set_texts(&path("particles", "id"), &texts)?;
    let tags: Vec<u64> = view.chunks.iter().flat_map(|chunk| chunk.tags()).copied().collect();
    recorded.write(&path("particles", "tag"), particles, 0, &tags)?;
    let meaning = "Numbers of material (bits 0 to 15), body (16 to 31) and level (32 to 39).";
    file.set_texts(&path("particles", "tag"), &[("units", ""), ("description", meaning)])
}

/// Collective. Writes the carried columns, if any particle carries a value.
fn write_carried<const D: usize>(
    file: &Writer,
    recorded: &mut Recorded,
    comm: &Comm,
    view: &View<D>,
    particles: Rows,
) -> Result<(), FileError> {
    let mut most = [view.chunks.iter().map(Chunk::carried_columns).max().unwrap_or(0) as u64];
    comm.max_u64(&mut most);
    let columns = most[0] as usize;
    if columns == 0 {
        return Ok(());
    }
    let mut values = Vec::with_capacity(particles.count as usize * columns);
    for chunk in view.chunks {
        let number = |p: usize, column| chunk.carried(column).get(p).copied().unwrap_or(0.0);
        values.extend((0..chunk.len()).flat_map(|p| (0..columns).map(move |column| number(p, column))));
    }
    recorded.write(&path("particles", CARRIED), particles, carried_components(columns), &values)?;
    let meaning = "For each load that particles carry, in their order: the area (m²) of a traction, the area vector of a pressure, the \
                   share of a point force. Then, if the job follows them, the left Cauchy-Green tensor less the unit tensor of the stretch between neighbours, the total left Cauchy-Green tensor less the unit tensor, and the displacement (m).";
    file.set_texts(&path("particles", CARRIED), &[("units", ""), ("description", meaning)])
}

/// Components of the data set of carried columns as [`Writer::write_slab`] counts them.
pub(in crate::io::snapshot) fn carried_components(columns: usize) -> usize {
    if columns == 1 { 0 } else { columns }
}

/// Carried columns in a file; 0 if no particle carries a value.
pub(in crate::io::snapshot) fn carried_columns(file: &Reader, header: &Header) -> Result<usize, FileError> {
    let name = path("particles", CARRIED);
    if header.checksum(&name).is_none() {
        return Ok(0);
    }
    let columns = file.stored(&name)?.components.max(1);
    match columns <= MOST_CARRIED {
        true => Ok(columns),
        false => Err(file.refuse(format!("{name} has {columns} columns; expected at most {MOST_CARRIED}"))),
    }
}

/// Most carried columns: three of each of as many loads as a job can have.
const MOST_CARRIED: usize = 3 * 27;

/// Collective. Reads tree and particles; each rank gets a contiguous share of the curve with about
/// the same number of particles. Refuses a state that no run can have written.
pub(in crate::io::snapshot) fn read<const D: usize>(
    file: &Reader,
    comm: &Comm,
    header: &Header,
    limits: Limits,
) -> Result<Restored<D>, FileError> {
    let mut checked = Checked::new(Some(comm), file, header);
    let leaves = balanced_share(file, &mut checked, comm, header)?;
    let levels: Vec<u8> = checked.read(&path("tree", "level"), leaves, 0)?;
    let coords: Vec<u32> = checked.read(&path("tree", "coord"), leaves, D)?;
    let counts: Vec<u64> = checked.read(&path("tree", "particles"), leaves, 0)?;
    let mut leaf_fields = Vec::new();
    for name in &header.leaf_fields {
        leaf_fields.push((name.clone(), checked.read::<f64>(&path("leaf", name), leaves, 0)?));
    }
    let octants: Vec<Octant<D>> = octants(&levels, &coords);
    // Not more than the header says in any part, as `balanced_share` has seen.
    let particles = Rows::place(comm, counts.iter().fold(0, |sum: u64, &count| sum.saturating_add(count)));
    file.agree(check_tree(file, header, &octants, particles.total))?;
    let sane = |result: Result<(), String>| file.agree(result.map_err(|reason| file.refuse(reason)));

    let mut chunks: Vec<Chunk<D>> = counts
        .iter()
        .map(|&count| {
            let mut chunk = Chunk::with_capacity(count as usize);
            chunk.extend_zeroed(count as usize);
            chunk
        })
        .collect();
    for set in columns::<D>() {
        let Columns { name, first, count, .. } = set;
        let values: Vec<f64> = checked.read(&path("particles", name), particles, set.components())?;
        sane(sane::reals(name, &values, count))?;
        if name == "position" {
            sane(sane::positions(header, &octants, &counts, &values))?;
        }
        let mut rows = values.chunks_exact(count);
        for chunk in &mut chunks {
            let len = chunk.len();
            for (p, row) in rows.by_ref().take(len).enumerate() {
                chunk.write(first, p, row);
            }
        }
    }
    let columns = file.agree(carried_columns(file, header))?;
    if columns > 0 {
        let components = carried_components(columns);
        let values: Vec<f64> = checked.read(&path("particles", CARRIED), particles, components)?;
        sane(sane::reals(CARRIED, &values, columns))?;
        let mut rows = values.chunks_exact(columns);
        for chunk in &mut chunks {
            let rows: Vec<&[f64]> = rows.by_ref().take(chunk.len()).collect();
            if rows.iter().any(|row| row.iter().any(|&number| number != 0.0)) {
                chunk.carry(columns);
                for column in 0..columns {
                    let own = chunk.carried_mut(column).iter_mut();
                    own.zip(&rows).for_each(|(own, row)| *own = row[column]);
                }
            }
        }
    }
    let ids: Vec<u64> = checked.read(&path("particles", "id"), particles, 0)?;
    let tags: Vec<u64> = checked.read(&path("particles", "tag"), particles, 0)?;
    sane(sane::tags(&tags, limits).and_then(|()| sane::identifiers(&ids)))?;
    let mut next = 0;
    for chunk in &mut chunks {
        let range = next..next + chunk.len();
        next = range.end;
        chunk.ids_mut().copy_from_slice(&ids[range.clone()]);
        chunk.tags_mut().copy_from_slice(&tags[range]);
    }
    Ok(Restored { header: header.clone(), leaves: octants, chunks, leaf_fields })
}

/// Collective. Cuts the curve so that each rank gets about the same number of particles (a leaf counts as one
/// more). Every rank reads an equal part of the list of leaves, and none all of it.
fn balanced_share(
    file: &Reader,
    checked: &mut Checked,
    comm: &Comm,
    header: &Header,
) -> Result<Rows, FileError> {
    let (rank, ranks) = (comm.rank() as u64, comm.size() as u64);
    let total = header.leaves;
    let even = |rank: u64| (u128::from(total) * u128::from(rank) / u128::from(ranks)) as u64;
    let part = Rows { offset: even(rank), count: even(rank + 1) - even(rank), total };
    let counts: Vec<u64> = checked.read(&path("tree", "particles"), part, 0)?;
    file.agree(bounded(file, header, &counts))?;
    let mut before = comm.exclusive_sum_u64(counts.iter().map(|count| count + 1).sum());
    let whole = u128::from(header.particles) + u128::from(total);
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

/// Leaves by their levels and coordinates.
pub(in crate::io::snapshot) fn octants<const D: usize>(levels: &[u8], coords: &[u32]) -> Vec<Octant<D>> {
    let octant =
        |(&level, coord): (&u8, &[u32])| Octant { level, coord: std::array::from_fn(|axis| coord[axis]) };
    levels.iter().zip(coords.chunks_exact(D)).map(octant).collect()
}

/// Particles of leaves, which together are no more than the file holds.
fn bounded(file: &Reader, header: &Header, counts: &[u64]) -> Result<(), FileError> {
    let held = file.stored(&path("particles", "id"))?.rows;
    let sum = counts.iter().try_fold(0_u64, |sum, &count| sum.checked_add(count));
    match sum {
        Some(sum) if sum <= header.particles && header.particles <= held => Ok(()),
        _ => Err(file.refuse(format!(
            "the leaves hold more particles than the header ({}) or the file ({held})",
            header.particles
        ))),
    }
}

/// Octants inside the brick, and the number of particles that the header says.
pub(in crate::io::snapshot) fn check_tree<const D: usize>(
    file: &Reader,
    header: &Header,
    octants: &[Octant<D>],
    particles: u64,
) -> Result<(), FileError> {
    if particles != header.particles {
        let said = header.particles;
        return Err(file.refuse(format!("the leaves hold {particles} particles, but the header has {said}")));
    }
    let inside = |octant: &Octant<D>| {
        let mut axes = octant.coord.iter().zip(&header.roots);
        octant.level <= MAX_LEVEL && axes.all(|(&c, &roots)| u64::from(c) < roots << octant.level)
    };
    if octants.iter().all(inside) { Ok(()) } else { Err(file.refuse("a leaf lies outside the domain")) }
}

/// A run read back: this rank's share, to be partitioned anew by the caller.
#[derive(Clone, Debug)]
pub struct Restored<const D: usize> {
    /// Header of the file, with the scalars.
    pub header: Header,
    /// Leaves of this rank: a contiguous part of the curve.
    pub leaves: Vec<Octant<D>>,
    /// Particles of each leaf.
    pub chunks: Vec<Chunk<D>>,
    /// Extra values per leaf.
    pub leaf_fields: Vec<(String, Vec<f64>)>,
}
