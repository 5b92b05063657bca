//! Problem 2: manufactured solutions.
//!
//! | file | what |
//! |---|---|
//! | `axes.rs` | waves along the axes of a square and a cube |
//! | `rings.rs` | the generalised vortex and the expanding ring |
use super::order;
use crate::page::Page;
use crate::plot::{Chart, Series};

mod axes;
mod rings;

pub(crate) use axes::{cube, flip, square};
pub(crate) use rings::section as rings;

/// Settings of the transfers.
const FLIP: [&str; 2] = ["numerics.transfer=\"flip\"", "numerics.flip=1"];
const APIC: [&str; 1] = ["numerics.transfer=\"apic\""];

/// Errors on several meshes.
struct Study {
    name: String,
    /// Cells along a metre, and the error.
    points: Vec<(f64, f64)>,
}

impl Study {
    /// Order between the finest two meshes.
    fn last_order(&self) -> f64 {
        match self.points[..] {
            [.., coarse, fine] => order(coarse, fine),
            _ => f64::NAN,
        }
    }

    /// Order over the finest three meshes.
    fn order_of_three(&self) -> f64 {
        match self.points[..] {
            [.., coarse, _, fine] => order(coarse, fine),
            _ => f64::NAN,
        }
    }

    /// Error at a number of cells.
    fn at(&self, cells: f64) -> Option<f64> {
        self.points.iter().find(|(count, _)| *count == cells).map(|(_, error)| *error)
    }
}

/// A table and a plot of errors over cells, with the order from each mesh to the next.
fn show(page: &mut Page, plot: &str, title: &str, studies: Vec<Study>) {
    let mut meshes: Vec<f64> =
        studies.iter().flat_map(|study| &study.points).map(|(cells, _)| *cells).collect();
    meshes.sort_by(f64::total_cmp);
    meshes.dedup();
    let mut heads = vec![String::new()];
    heads.extend(meshes.iter().map(|cells| format!("{cells} per metre")));
    heads.push("orders".into());
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let rows: Vec<Vec<String>> = studies
        .iter()
        .map(|study| {
            let errors = meshes.iter().map(|&cells| study.at(cells));
            let errors = errors.map(|error| error.map_or(String::new(), |error| format!("{error:.2e}")));
            let orders: Vec<String> =
                study.points.windows(2).map(|pair| format!("{:.2}", order(pair[0], pair[1]))).collect();
            std::iter::once(study.name.clone()).chain(errors).chain([orders.join(", ")]).collect()
        })
        .collect();
    rows.iter().for_each(|row| println!("    {}", row.join("  ")));
    page.table(&heads, &rows);
    let series = studies.into_iter().map(|study| Series {
        name: study.name,
        points: study.points.into_iter().map(|(cells, error)| [cells, error]).collect(),
        marks: false,
    });
    let labels = ["cells per metre", "error"];
    page.plot(plot, &Chart { title, labels, logarithmic: [true, true], series: series.collect() });
}
