//! Plausibility of a state: one that no run can have written is refused, whatever its checksums say.

use partition::{MAX_LEVEL, Octant};

use crate::grid::leaf_geometry::position_key;
use crate::io::snapshot::content::columns::{CARRIED, columns};
use crate::io::snapshot::header::Header;
use crate::io::snapshot::view::View;
use crate::particle::chunk::{TILE, Tag};
use crate::text::{number, place};

/// Numbers of the job that tags of particles refer to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Number of materials.
    pub materials: usize,
    /// Number of bodies.
    pub bodies: usize,
}

/// Time and this rank's particles have finite numbers only; says which one has not.
pub(in crate::io::snapshot) fn finite<const D: usize>(view: &View<D>) -> Result<(), String> {
    for (name, value) in [("time", view.time), ("last step", view.dt)] {
        if !value.is_finite() {
            return Err(format!("not written: the {name} is {value} s; expected a finite number"));
        }
    }
    for chunk in view.chunks {
        for p in 0..chunk.len() {
            let tile = chunk.tile_of(p);
            let Some(column) = tile.iter().position(|line| !line[p % TILE].is_finite()) else { continue };
            let sets = columns::<D>();
            let name = sets.iter().rfind(|set| set.first <= column).map_or("", |set| set.name);
            let (id, value, position) = (chunk.ids()[p], tile[column][p % TILE], chunk.position(p));
            return Err(unstable(name, id, value, &position));
        }
        for column in 0..chunk.carried_columns() {
            let carried = chunk.carried(column);
            if let Some(p) = carried.iter().position(|number| !number.is_finite()) {
                return Err(unstable(CARRIED, chunk.ids()[p], carried[p], &chunk.position(p)));
            }
        }
    }
    Ok(())
}

fn unstable(name: &str, id: u64, value: f64, position: &[f64]) -> String {
    format!(
        "not written: {name} of particle {id} is {}, at {} from the domain's lower corner; the run has become unstable",
        number(value, 4),
        place(position)
    )
}

/// Greatest half width, m: no domain is wider.
const WIDEST: f64 = 1e9;
/// Greatest number of a particle, in its unit.
const GREATEST: f64 = 1e30;

/// Finite numbers that a run can have; masses and half widths above 0. `values` has `width` numbers for each
/// particle.
pub(in crate::io::snapshot) fn reals(name: &str, values: &[f64], width: usize) -> Result<(), String> {
    let positive = ["mass", "half_width"].contains(&name);
    let most = if name == "half_width" { WIDEST } else { GREATEST };
    let is_wrong = |value: &f64| !value.is_finite() || value.abs() > most || (positive && *value <= 0.0);
    match values.iter().position(is_wrong) {
        None => Ok(()),
        Some(at) => {
            let expected = if positive { "a positive number" } else { "a finite number" };
            Err(format!(
                "{name} of the particle in row {} is {}; expected {expected}, at most {most:e} in size",
                at / width,
                number(values[at], 4)
            ))
        }
    }
}

/// Every particle in its leaf: the first leaves have the first rows, as many as `counts` says.
pub(in crate::io::snapshot) fn positions<const D: usize>(
    header: &Header,
    octants: &[Octant<D>],
    counts: &[u64],
    positions: &[f64],
) -> Result<(), String> {
    let roots: [u32; D] = std::array::from_fn(|axis| header.roots[axis] as u32);
    let mut rows = positions.chunks_exact(D).enumerate();
    for (octant, &count) in octants.iter().zip(counts) {
        for (row, position) in rows.by_ref().take(count as usize) {
            let position: [f64; D] = std::array::from_fn(|axis| position[axis]);
            let inside = (0..D).all(|axis| {
                position[axis] >= 0.0 && position[axis] <= header.root_edge * f64::from(roots[axis])
            });
            let key = position_key(position, roots, header.root_edge);
            if !(inside && (octant.key()..octant.key_end()).contains(&key)) {
                return Err(format!(
                    "the particle in row {row}, at {}, is not in its leaf of level {} at {:?}",
                    place(&position),
                    octant.level,
                    octant.coord
                ));
            }
        }
    }
    Ok(())
}

/// Materials and bodies of the job, levels of a tree.
pub(in crate::io::snapshot) fn tags(tags: &[u64], limits: Limits) -> Result<(), String> {
    let is_wrong = |tag: &u64| {
        let Tag { material, body, level } = Tag::unpack(*tag);
        usize::from(material) >= limits.materials || usize::from(body) >= limits.bodies || level > MAX_LEVEL
    };
    match tags.iter().position(is_wrong) {
        None => Ok(()),
        Some(row) => {
            let Tag { material, body, level } = Tag::unpack(tags[row]);
            Err(format!(
                "the particle in row {row} is of material {material}, body {body} and level {level}; \
                 there are {} materials, {} bodies and levels to {MAX_LEVEL}",
                limits.materials, limits.bodies
            ))
        }
    }
}

/// No identifier twice among these.
pub(in crate::io::snapshot) fn identifiers(ids: &[u64]) -> Result<(), String> {
    let mut sorted = ids.to_vec();
    sorted.sort_unstable();
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        None => Ok(()),
        Some(pair) => Err(format!("two particles have the identifier {}", pair[0])),
    }
}
