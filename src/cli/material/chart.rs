//! States of a particle as a picture of three panels: stress and volume over shear strain, and the path of stress.
use std::ops::Range;
use std::path::Path;

use plotters::prelude::*;

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
    let mut text = String::new();
    panels(table, &mut text).map_err(|error| error.to_string())?;
    std::fs::write(path, text).map_err(|error| error.to_string())
}

fn panels(table: &Table, text: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::with_string(text, (1200, 400)).into_drawing_area();
    area.fill(&WHITE)?;
    for (panel, (across, up, of)) in area.split_evenly((1, 3)).iter().zip(PANELS) {
        let points: Vec<(f64, f64)> =
            table.invariants.iter().map(of).filter(|(x, y)| (x + y).is_finite()).collect();
        let mut chart = ChartBuilder::on(panel)
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(64)
            .build_cartesian_2d(span(points.iter().map(|p| p.0)), span(points.iter().map(|p| p.1)))?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_labels(5)
            .y_labels(6)
            .x_desc(across)
            .y_desc(up)
            .label_style(("sans-serif", 12))
            .x_label_formatter(&short)
            .y_label_formatter(&short)
            .draw()?;
        chart.draw_series(LineSeries::new(points, BLUE.stroke_width(2)))?;
    }
    area.present()?;
    Ok(())
}

/// From least to greatest with a margin; 0 belongs to it.
fn span(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (least, most) = values.fold((0.0, 0.0), |(least, most): (f64, f64), x| (least.min(x), most.max(x)));
    let margin = if most > least { 0.04 * (most - least) } else { 1.0 };
    least - margin..most + margin
}

/// A number at an axis.
fn short(number: &f64) -> String {
    let size = number.abs();
    match size {
        ..1e-12 => "0".to_owned(),
        1e4.. => format!("{number:.1e}"),
        1.0.. => format!("{number:.0}"),
        1e-2.. => format!("{number:.2}"),
        _ => format!("{number:.0e}"),
    }
}
