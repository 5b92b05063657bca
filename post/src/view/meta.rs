//! Metadata of the page, as JSON.
use std::path::Path;

use serde::Serialize;

use super::Options;
use super::columns::{Column, LeafMaxima, Scale};
use super::pack::STEPS_PER_DOUBLING;
use agimp::io::snapshot::{Header, PointField};
use agimp::text::printable;

/// Metadata of all frames.
#[derive(Serialize)]
pub(super) struct Meta {
    title: String,
    program: &'static str,
    dimension: usize,
    /// Lower and upper corner, m.
    domain: [[f64; 3]; 2],
    root_edge: f64,
    /// Box round all particles, m.
    bounds: [[f64; 3]; 2],
    /// A unit of the packed positions, m; they count from the lower corner of `bounds`.
    resolution: f64,
    /// Half width 0, m, and the steps for each doubling.
    half_width: f64,
    steps_per_doubling: f64,
    columns: Vec<ColumnMeta>,
    frames: Vec<FrameMeta>,
}

#[derive(Serialize)]
struct ColumnMeta {
    name: String,
    unit: &'static str,
    /// `real`, `integer` or `id`.
    kind: &'static str,
    /// See [`Scale`].
    scale: [f64; 4],
    /// Least and greatest value over all times.
    range: [f64; 2],
    /// The same without the outermost half percents.
    usual: [f64; 2],
    /// Names of the whole numbers from 0 on, if they have names.
    names: Vec<String>,
}

/// One time.
#[derive(Serialize)]
pub(super) struct FrameMeta {
    file: String,
    time: f64,
    step: u64,
    particles: u64,
    /// The frame whose tree is also this one's, and its leaves.
    tree: usize,
    leaves: usize,
}

impl FrameMeta {
    pub(super) fn new(path: &Path, header: &Header, tree: usize, leaves: usize) -> Self {
        let file = printable(&path.file_name().unwrap_or_default().to_string_lossy()).into_owned();
        Self { file, time: header.time, step: header.step, particles: header.particles, tree, leaves }
    }
}

impl Meta {
    pub(super) fn new(
        options: &Options,
        columns: &[Column],
        scales: &[Scale],
        survey: &LeafMaxima,
        frames: Vec<FrameMeta>,
    ) -> Self {
        let domain = survey.first.as_ref().map_or([[0.0; 3]; 2], |first| first.domain);
        let header = survey.first.as_ref().map(|first| &first.header);
        let names = |field: PointField| {
            let names = match field {
                PointField::Material => header.map_or(&[][..], |header| &header.materials),
                PointField::Body => header.map_or(&[][..], |header| &header.bodies),
                _ => &[],
            };
            names.iter().map(|name| printable(name).into_owned()).collect()
        };
        let finite = |[low, high]: [f64; 2]| if low <= high { [low, high] } else { [0.0, 0.0] };
        let column = |(number, (column, scale)): (usize, (&Column, &Scale))| ColumnMeta {
            name: column.name.clone(),
            unit: column.source.unit(),
            kind: match column.source {
                PointField::Id => "id",
                _ if column.is_integer() => "integer",
                _ => "real",
            },
            scale: [scale.unit, scale.low, scale.high, f64::from(scale.levels)],
            range: finite(survey.ranges[number]),
            usual: survey.usual(number),
            names: names(column.source),
        };
        // Without particles there is no box round them; the page then shows the domain.
        let bounds = if survey.bounds[0][0].is_finite() { survey.bounds } else { domain };
        Self {
            title: printable(&options.title).into_owned(),
            program: env!("CARGO_PKG_VERSION"),
            dimension: header.map_or(3, |header| header.dimension),
            domain,
            root_edge: header.map_or(1.0, |header| header.root_edge),
            bounds,
            resolution: survey.resolution(),
            half_width: if survey.half_width.is_finite() { survey.half_width } else { 1.0 },
            steps_per_doubling: STEPS_PER_DOUBLING,
            columns: columns.iter().zip(scales).enumerate().map(column).collect(),
            frames,
        }
    }

    /// JSON without markup of HTML.
    pub(super) fn json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default().replace('<', "\\u003c")
    }
}
