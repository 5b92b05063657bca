//! Widths of the particles of a file: those of their boxes in the solver.
use agimp::io::hdf5_file::{FileError, Reader};
use agimp::io::snapshot::Header;
use agimp::io::snapshot::intact::checked::Checked;
use agimp::material::PLASTIC_VOLUME;
use agimp::run::scene::boxes::{Boxes, Particle};

use crate::picture::source::{numbers, points};

/// Half widths of all particles of a file, m; of one without restart state `None`.
pub(in crate::picture) fn of_file(
    boxes: &Boxes,
    file: &Reader,
    header: &Header,
) -> Result<Option<Vec<[f64; 3]>>, FileError> {
    let set = |name: &str| format!("state/particles/{name}");
    let needed = ["half_width", "left_cauchy_green", "history", "tag"].map(set);
    if !needed.iter().all(|name| file.exists(name)) {
        return Ok(None);
    }
    let [half, elastic, history, tags] = needed;
    let (half, _) = numbers(file, header, &half)?;
    let points = points(file, header)?;
    let (elastic, components) = numbers(file, header, &elastic)?;
    let (history, histories) = numbers(file, header, &history)?;
    let tags: Vec<u64> = Checked::new(None, file, header).read_all(&tags, header.particles, 0)?;
    let radii = points.iter().step_by(3);
    let half = half.iter().zip(radii).map(|(half, x)| boxes.coordinates.half_width(*half, *x));
    let rows = half.zip(elastic.chunks_exact(components)).zip(history.chunks_exact(histories));
    let widths = rows.zip(tags).map(|(((half, elastic), history), tag)| {
        // Of the state: xx, yy, zz, xy and in 3D xz, yz.
        let at = |component: usize| elastic.get(component).copied().unwrap_or(0.0);
        let particle = Particle {
            half,
            elastic: [at(0), at(1), at(2), at(3), at(5), at(4)],
            plastic_volume: history.get(PLASTIC_VOLUME).copied().unwrap_or(0.0),
            tag,
        };
        boxes.half_widths(&particle, header.dimension, header.root_edge)
    });
    Ok(Some(widths.collect()))
}
