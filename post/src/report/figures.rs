//! Pictures and charts of a page.
use std::fmt::Write as _;
use std::path::PathBuf;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;

use super::panels::Panel;
use super::run::Run;
use crate::chart::{self, Chart};
use crate::picture;
use agimp::io::hdf5_file::FileError;
use agimp::io::snapshot::Header;
use agimp::run::scene;
use agimp::text::{html, quantity, scale};

/// Pixels of a picture, and of a chart, which is shown at half of its size.
const PICTURE: [usize; 2] = [1000, 640];
const CHART: (u32, u32) = (1120, 560);

/// Outputs from the first to the last, with one frame and one range of colours.
pub(super) fn pictures(body: &mut String, run: &Run, options: &Options) -> Result<(), FileError> {
    let outputs = &run.outputs;
    let wanted = options.pictures.min(outputs.len());
    if wanted == 0 {
        return Ok(());
    }
    // The last one always; the first one if there is room.
    let last = outputs.len() - 1;
    let mut chosen: Vec<_> =
        (0..wanted).map(|i| last - last * (wanted - 1 - i) / wanted.max(2).saturating_sub(1)).collect();
    chosen.dedup();
    let files: Vec<_> = chosen.into_iter().map(|number| outputs[number].clone()).collect();
    let job = scene::job_of(&outputs[last], options.job.as_deref()).ok();
    let scene =
        |header: &Header| job.as_ref().map_or_else(Default::default, |job| scene::of_job(job, header));
    let mut settings = picture::Settings::new("");
    [settings.width, settings.height] = PICTURE;
    let survey = |colour: &str| picture::survey(&files, colour, &settings, &scene);
    let (colour, look) = match &options.colour {
        Some(colour) => (colour.as_str(), survey(colour)?),
        None => {
            let colour = picture::usual_colour(&outputs[last], &settings, &scene);
            (colour, survey(colour)?)
        }
    };
    section(body, "pictures", "Pictures");
    let _ = write!(
        body,
        "<p>Coloured by {}, all with one range.</p>\n<div class=\"grid\">\n",
        html(&colour.replace('_', " "))
    );
    (settings.range, settings.frame) = (Some(look.range), Some(look.frame));
    for file in &files {
        let (png, time) = picture::png_of_file(file, colour, &settings, &scene)?;
        let (data, time) = (BASE64.encode(png), quantity(time, "s"));
        let name = html(&file.file_name().unwrap_or_default().to_string_lossy());
        let _ = writeln!(
            body,
            "<figure><img alt=\"particles at {time}\" src=\"data:image/png;base64,{data}\"><figcaption>t = {time} \
             <small>{name}</small></figcaption></figure>"
        );
    }
    body.push_str("</div>\n");
    Ok(())
}

/// Charts side by side, each with its curves named in their colours.
pub(super) fn charts(body: &mut String, id: &str, title: &str, panels: &[Panel]) {
    let mut drawn = String::new();
    for panel in panels {
        let greatest = |values: &mut dyn Iterator<Item = f64>| {
            values.filter(|x| x.is_finite()).fold(0.0, |m: f64, x| m.max(x.abs()))
        };
        let points = || panel.curves.iter().flat_map(|(_, points)| points);
        let (by, unit) = scale(greatest(&mut points().map(|p| p.1)), &panel.unit);
        let (by_across, unit_across) = scale(greatest(&mut points().map(|p| p.0)), &panel.across.1);
        let scaled = |points: &[(f64, f64)]| points.iter().map(|(x, y)| (x / by_across, y / by)).collect();
        let chart = Chart {
            across: format!("{} ({unit_across})", panel.across.0),
            up: unit,
            from_zero: false,
            is_logarithmic: panel.is_logarithmic,
            curves: panel.curves.iter().map(|(_, points)| scaled(points)).collect(),
        };
        let svg = if chart.is_empty() { continue } else { chart.svg(CHART) };
        let Ok(svg) = svg else { continue };
        let _ = write!(drawn, "<figure class=\"chart\"><figcaption><b>{}</b>", html(&panel.title));
        for (number, (name, _)) in panel.curves.iter().enumerate().filter(|_| panel.curves.len() > 1) {
            let colour = chart::colour(number);
            let _ = write!(drawn, " <span class=\"key\" style=\"--c:{colour}\">{}</span>", html(name));
        }
        let _ = writeln!(drawn, "</figcaption>\n{svg}</figure>");
    }
    if !drawn.is_empty() {
        section(body, id, title);
        let _ = write!(body, "<div class=\"grid\">\n{drawn}</div>\n");
    }
}

/// Options of a page.
#[derive(Clone, Debug)]
pub struct Options {
    /// Quantity that colours the pictures, as for `agimp plot`; `None` for plastic strain if there is any,
    /// else the speed.
    pub colour: Option<String>,
    /// Most pictures: times from the first output to the last.
    pub pictures: usize,
    /// Job file of the run, beside which the meshes of its colliders lie; `None`: where the run's name leads.
    pub job: Option<PathBuf>,
}

impl Default for Options {
    fn default() -> Self {
        Self { colour: None, pictures: 4, job: None }
    }
}

/// Begins a section.
pub(super) fn section(body: &mut String, id: &str, title: &str) {
    let _ = write!(body, "</section>\n<section id=\"{id}\">\n<h2>{title}</h2>\n");
}
