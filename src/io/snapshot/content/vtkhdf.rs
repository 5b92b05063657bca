//! The group `/VTKHDF`: particles as vertices, leaves as voxels, in one piece, so that a file does not
//! depend on the number of ranks.

use partition::Octant;
use partition::comm::Comm;

use super::averages::{LeafAverage, mean, over_leaf, principal, von_mises};
use super::fields::{PointField, Values};
use super::state::path;
use crate::io::hdf5_file::{Element, FileError, Writer};
use crate::io::snapshot::intact::checked::{Recorded, Rows};
use crate::io::snapshot::{Options, View};
use crate::particle::chunk::Chunk;

const GROUP: &str = "VTKHDF";
/// Cell types of VTK.
const VERTEX: u8 = 1;
const PIXEL: u8 = 8;
const VOXEL: u8 = 11;
/// Single-precision coordinates are used only if the origin is at most this many domain sizes away.
const FAR: f64 = 8.0;

/// Collective. The group with its attributes and the time.
fn start(file: &Writer, recorded: &mut Recorded, comm: &Comm, time: f64) -> Result<(), FileError> {
    file.create_group(GROUP)?;
    file.set_attribute(GROUP, "Version", &[1_i64, 0])?;
    file.set_text(GROUP, "Type", "UnstructuredGrid")?;
    for group in ["PointData", "CellData", "FieldData"] {
        file.create_group(&format!("{GROUP}/{group}"))?;
    }
    single(recorded, comm, "FieldData/TimeValue", time)
}

/// Collective. A data set of one value, written by rank 0.
fn single<T: Element>(recorded: &mut Recorded, comm: &Comm, name: &str, value: T) -> Result<(), FileError> {
    let mine: &[T] = if comm.rank() == 0 { &[value] } else { &[] };
    let rows = Rows::place(comm, mine.len() as u64);
    recorded.write(&format!("{GROUP}/{name}"), rows, 0, mine)
}

/// Collective. Cells: cell `i` has the `corners` points from `corners * i`.
fn grid(
    recorded: &mut Recorded,
    comm: &Comm,
    cells: Rows,
    corners: u64,
    cell_type: u8,
) -> Result<(), FileError> {
    let connectivity = cells.times(corners);
    for (name, value) in [
        ("NumberOfPoints", connectivity.total),
        ("NumberOfCells", cells.total),
        ("NumberOfConnectivityIds", connectivity.total),
    ] {
        single(recorded, comm, name, value as i64)?;
    }
    let numbers = |rows: Rows, step: u64| -> Vec<i64> {
        (rows.offset..rows.offset + rows.count).map(|i| (i * step) as i64).collect()
    };
    let (ends, offsets, list) =
        (cells.and_one(comm), format!("{GROUP}/Offsets"), format!("{GROUP}/Connectivity"));
    recorded.write(&offsets, ends, 0, &numbers(ends, corners))?;
    if corners == 1 {
        // 0, 1, 2 and so on as well; readers take as many entries as the number above says.
        recorded.link(&offsets, &list)?;
    } else {
        recorded.write(&list, connectivity, 0, &numbers(connectivity, 1))?;
    }
    recorded.write(&format!("{GROUP}/Types"), cells, 0, &vec![cell_type; cells.count as usize])
}

/// Collective. An array of the group.
fn field(recorded: &mut Recorded, name: &str, rows: Rows, values: &Values) -> Result<(), FileError> {
    let dataset = format!("{GROUP}/{name}");
    match values {
        Values::Id(values) => recorded.write(&dataset, rows, 0, values),
        Values::Integer(values) => recorded.write(&dataset, rows, 0, values),
        Values::Real(values, components) => recorded.write(&dataset, rows, *components, values),
        Values::Single(values, components) => recorded.write(&dataset, rows, *components, values),
    }
}

/// Collective. Writes the particles with the chosen fields.
pub(in crate::io::snapshot) fn write_particles<const D: usize>(
    file: &Writer,
    recorded: &mut Recorded,
    comm: &Comm,
    view: &View<D>,
    particles: Rows,
    options: &Options,
) -> Result<(), FileError> {
    start(file, recorded, comm, view.time)?;
    let extent = view.brick.roots.iter().fold(0.0, |most: f64, &n| most.max(f64::from(n))) * view.root_edge;
    let near = view.origin.iter().all(|x| x.abs() <= FAR * extent);
    grid(recorded, comm, particles, 1, VERTEX)?;
    let is_at_zero = view.origin.iter().all(|&x| x == 0.0);
    if options.restart && D == 3 && is_at_zero {
        recorded.link(&path("particles", "position"), &format!("{GROUP}/Points"))?;
    } else {
        let points = Values::Real(positions(view), 3);
        field(
            recorded,
            "Points",
            particles,
            &if options.single && near { points.into_single() } else { points },
        )?;
    }
    for chosen in &options.fields {
        let name = format!("PointData/{}", chosen.name());
        if options.restart
            && let Some(set) = in_state::<D>(*chosen)
        {
            recorded.link(&path("particles", set), &format!("{GROUP}/{name}"))?;
            continue;
        }
        let values = chosen.values(view);
        let values = if options.single { values.into_single() } else { values };
        field(recorded, &name, particles, &values.without_infinities())?;
        let names = match chosen {
            PointField::Material => Some(view.materials),
            PointField::Body => Some(view.bodies),
            _ => None,
        };
        let names = names.map(|names| ("names", names.join("\n")));
        let mut texts = vec![("units", chosen.unit()), ("description", chosen.meaning())];
        texts.extend(names.iter().map(|(key, names)| (*key, names.as_str())));
        file.set_texts(&format!("{GROUP}/{name}"), &texts)?;
    }
    Ok(())
}

/// The data set of the restart state that holds the same numbers in the same shape as a field.
fn in_state<const D: usize>(field: PointField) -> Option<&'static str> {
    match field {
        // Plane strain lacks the third component.
        PointField::Velocity if D == 3 => Some("velocity"),
        PointField::Id => Some("id"),
        PointField::Mass => Some("mass"),
        _ => None,
    }
}

/// Positions with the origin added and three components.
fn positions<const D: usize>(view: &View<D>) -> Vec<f64> {
    let mut points = Vec::with_capacity(3 * view.chunks.iter().map(Chunk::len).sum::<usize>());
    for chunk in view.chunks {
        for p in 0..chunk.len() {
            let position = chunk.position(p);
            points.extend((0..3).map(|axis| if axis < D { view.origin[axis] + position[axis] } else { 0.0 }));
        }
    }
    points
}

/// Collective. Writes the leaves of the tree as cells with their level and number of particles.
pub(in crate::io::snapshot) fn write_leaves<const D: usize>(
    file: &Writer,
    recorded: &mut Recorded,
    comm: &Comm,
    view: &View<D>,
    leaves: Rows,
) -> Result<(), FileError> {
    start(file, recorded, comm, view.time)?;
    let corners = 1 << D;
    let cell_type = if D == 2 { PIXEL } else { VOXEL };
    let points = view.leaves.iter().flat_map(|leaf| leaf_corners(view, leaf)).flatten().collect();
    grid(recorded, comm, leaves, corners, cell_type)?;
    field(recorded, "Points", leaves.times(corners), &Values::Real(points, 3))?;
    let levels: Vec<u8> = view.leaves.iter().map(|leaf| leaf.level).collect();
    recorded.write(&format!("{GROUP}/CellData/level"), leaves, 0, &levels)?;
    let counts: Vec<i64> = view.chunks.iter().map(|chunk| chunk.len() as i64).collect();
    recorded.write(&format!("{GROUP}/CellData/particles"), leaves, 0, &counts)?;
    for (name, values) in view.leaf_fields {
        recorded.write(&format!("{GROUP}/CellData/{name}"), leaves, 0, values)?;
    }
    for (name, meaning) in [("level", "Level of the leaf."), ("particles", "Particles in the leaf.")] {
        let texts = [("units", ""), ("description", meaning)];
        file.set_texts(&format!("{GROUP}/CellData/{name}"), &texts)?;
    }
    write_averages(file, recorded, view, leaves)
}

/// Collective. Writes the volume fraction of leaves, and the mean stress.
fn write_averages<const D: usize>(
    file: &Writer,
    recorded: &mut Recorded,
    view: &View<D>,
    leaves: Rows,
) -> Result<(), FileError> {
    let edge = |leaf: &Octant<D>| view.root_edge / f64::from(1_u32 << leaf.level);
    let coordinates = view.scalars.coordinates();
    let around = |leaf: &Octant<D>| coordinates.around((f64::from(leaf.coord[0]) + 0.5) * edge(leaf));
    let all = view.leaves.iter().zip(view.chunks);
    let all = all.map(|(leaf, chunk)| over_leaf(edge(leaf), around(leaf), chunk));
    let all: Vec<LeafAverage> = all.collect();
    let scalar = |value: fn(&LeafAverage) -> f64| Values::Real(all.iter().map(value).collect(), 0);
    let stress = Values::Real(all.iter().flat_map(|leaf| leaf.stress).collect(), 6);
    let sets = [
        (
            "volume_fraction",
            "",
            "Volume of the material over that of the leaf.",
            scalar(|leaf| leaf.volume_fraction),
        ),
        ("stress", "Pa", "Mean Cauchy stress by volume: xx, yy, zz, xy, yz, xz; 0 without material.", stress),
        (
            "pressure",
            "Pa",
            "Pressure of the mean stress; compression is positive.",
            scalar(|leaf| -mean(&leaf.stress)),
        ),
        (
            "von_mises",
            "Pa",
            "Von Mises equivalent of the mean stress.",
            scalar(|leaf| von_mises(&leaf.stress)),
        ),
        (
            "stress_1",
            "Pa",
            "Greatest principal value of the mean stress.",
            scalar(|leaf| principal(&leaf.stress)[0]),
        ),
        (
            "stress_2",
            "Pa",
            "Middle principal value of the mean stress.",
            scalar(|leaf| principal(&leaf.stress)[1]),
        ),
        (
            "stress_3",
            "Pa",
            "Least principal value of the mean stress.",
            scalar(|leaf| principal(&leaf.stress)[2]),
        ),
    ];
    for (name, unit, meaning, values) in sets {
        field(recorded, &format!("CellData/{name}"), leaves, &values)?;
        let texts = [("units", unit), ("description", meaning)];
        file.set_texts(&format!("{GROUP}/CellData/{name}"), &texts)?;
    }
    Ok(())
}

/// Corners of a leaf, first axis fastest, in the order of VTK's pixels and voxels.
fn leaf_corners<const D: usize>(view: &View<D>, leaf: &Octant<D>) -> Vec<[f64; 3]> {
    let edge = view.root_edge / f64::from(1_u32 << leaf.level);
    let corner = |number: usize| {
        std::array::from_fn(|axis| {
            if axis >= D {
                return 0.0;
            }
            let count = leaf.coord[axis] + (number >> axis & 1) as u32;
            view.origin[axis] + edge * f64::from(count)
        })
    };
    (0..1 << D).map(corner).collect()
}
