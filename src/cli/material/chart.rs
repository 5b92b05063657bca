//! States of a particle as a picture of three panels: stress and volume over shear strain, and the path of
//! stress.
use std::path::Path;

use plotters::prelude::*;

use super::table::{Invariants, Table};
use crate::io::chart::Chart;

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
    let mut text = String::new();
    panels(table, &mut text).map_err(|error| error.to_string())?;
    std::fs::write(path, text).map_err(|error| error.to_string())
}

fn panels(table: &Table, text: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::with_string(text, (1200, 400)).into_drawing_area();
    area.fill(&WHITE)?;
    for (panel, (across, up, of)) in area.split_evenly((1, 3)).iter().zip(PANELS) {
        let curve = table.invariants.iter().map(of).filter(|(x, y)| (x + y).is_finite()).collect();
        let (across, up) = (across.to_owned(), up.to_owned());
        Chart { across, up, from_zero: true, is_logarithmic: false, curves: vec![curve] }.draw(panel, 1.0)?;
    }
    area.present()?;
    Ok(())
}
