//! States of a particle as a picture of three panels: stress and volume over shear strain, and the path of
//! stress.
use std::path::Path;

use post::chart::{Chart, beside_each_other};

use super::table::{Invariants, Table};

type Panel = (&'static str, &'static str, fn(&Invariants) -> (f64, f64));

const PANELS: [Panel; 3] = [
    ("shear strain", "q (Pa)", |at| (at.strain[1], at.stress[1])),
    ("shear strain", "volume strain", |at| (at.strain[1], at.strain[0])),
    ("p (Pa)", "q (Pa)", |at| (at.stress[0], at.stress[1])),
];

/// Draws the states into an SVG file.
///
/// # Errors
/// The file cannot be written, or the numbers cannot be drawn; why.
pub(super) fn draw(table: &Table, path: &Path) -> Result<(), String> {
    let charts = PANELS.map(|(across, up, of)| {
        let curve = table.invariants.iter().map(of).filter(|(x, y)| (x + y).is_finite()).collect();
        let (across, up) = (across.to_owned(), up.to_owned());
        Chart { across, up, from_zero: true, is_logarithmic: false, curves: vec![curve] }
    });
    let text = beside_each_other(&charts, (1200, 400))?;
    std::fs::write(path, text).map_err(|error| error.to_string())
}
