//! Style of pictures: options of all subcommands that draw.
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use crate::Failure;
use crate::shared::message::warn_of;
use agimp::io::snapshot::Header;
use agimp::job::AnyProblem;
use agimp::run::scene;
use agimp::text::written;
use post::picture::{self, Clip, Direction, Map, Scene, SceneOf, Settings};
use post::revolve::Revolve;

/// Options of subcommands that draw particles.
#[derive(Debug, clap::Args)]
pub(crate) struct Looks {
    /// Quantity that gives the colours: a field of the file or a derived quantity, such as speed, pressure,
    /// stress_xy, stress_1 (greatest principal stress) or max_shear; by default damage or plastic strain if
    /// any particle has some, else the speed. An unknown name lists all quantities.
    #[arg(long, alias = "color")]
    colour: Option<String>,
    /// Value of the first colour; by default the range of the values without the outermost 0.5 % at each end.
    #[arg(long, requires = "to", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Value of the last colour.
    #[arg(long, requires = "from", allow_negative_numbers = true)]
    to: Option<f64>,
    /// Colours: viridis, magma, coolwarm (for quantities of both signs) or grey.
    #[arg(long, default_value = "viridis", value_parser = map)]
    map: Map,
    /// Dark background.
    #[arg(long)]
    dark: bool,
    /// Direction of view in 3D: iso, front, side, top, or a vector such as 1,-1,0.5.
    #[arg(long, default_value = "iso", value_parser = str::parse::<Direction>, allow_hyphen_values = true)]
    view: Direction,
    /// Factor of magnification over the size that fits.
    #[arg(long, default_value_t = 1.0, value_parser = zoom)]
    zoom: f64,
    /// Position at the centre, m, such as 0.5,0,0.2.
    #[arg(long, value_parser = picture::place, allow_hyphen_values = true)]
    focus: Option<[f64; 3]>,
    /// Half space to keep, such as x<0.5 or z>1; the rest is cut away.
    #[arg(long, value_parser = str::parse::<Clip>)]
    clip: Option<Clip>,
    /// Mirror at the lower face of the domain across these axes, for models of a half or a quarter: x, y, xy.
    #[arg(long, value_name = "AXES", default_value = "", value_parser = axes)]
    mirror: Axes,
    /// Draw bodies of revolution in space (jobs with geometry = "axisymmetric"), whole or with a quarter cut
    /// out.
    #[arg(long, value_name = "open|whole", num_args = 0..=1, require_equals = true, default_missing_value = "open",
        value_parser = str::parse::<Revolve>, conflicts_with_all = ["mirror", "tree"])]
    revolve: Option<Revolve>,
    /// Draw the leaves of the tree: in 2D, at the clip, or at the floor.
    #[arg(long)]
    tree: bool,
    /// Draw vectors as arrows: velocity, or displacement where outputs have it.
    #[arg(long, value_name = "QUANTITY")]
    vectors: Option<String>,
    /// Omit colliders.
    #[arg(long)]
    bare: bool,
    /// Job file of the run, if it is not at the path in the output.
    #[arg(long)]
    job: Option<PathBuf>,
    /// Width in pixels.
    #[arg(long, default_value_t = 1280, value_parser = clap::value_parser!(u32).range(400..=16384))]
    width: u32,
    /// Height in pixels.
    #[arg(long, default_value_t = 800, value_parser = clap::value_parser!(u32).range(300..=16384))]
    height: u32,
}

/// Axes by number.
#[derive(Clone, Copy, Debug)]
struct Axes([bool; 3]);

fn axes(text: &str) -> Result<Axes, String> {
    match text.chars().find(|c| !"xyz".contains(*c)) {
        Some(_) => Err("expected axes such as x, y or xy".into()),
        None => Ok(Axes(["x", "y", "z"].map(|axis| text.contains(axis)))),
    }
}

fn map(text: &str) -> Result<Map, String> {
    let found = Map::ALL.iter().find(|(name, _)| *name == text).map(|(_, map)| *map);
    found.ok_or_else(|| format!("expected one of {}", Map::ALL.map(|(name, _)| name).join(", ")))
}

fn zoom(text: &str) -> Result<f64, String> {
    let zoom = text.parse().ok().filter(|zoom: &f64| (0.01..=1000.0).contains(zoom));
    zoom.ok_or_else(|| "expected a number from 0.01 to 1000".into())
}

/// Title of a picture of an output: the given one, else that of the job that wrote the output, else `name`.
pub(crate) fn title(given: Option<&str>, output: Option<&Path>, name: &str) -> String {
    let of_job = || output.filter(|output| output.is_file()).and_then(scene::title_of);
    given.map(str::to_owned).or_else(of_job).unwrap_or_else(|| name.to_owned())
}

impl Looks {
    /// Quantity that gives the colours of these outputs, of which the last one decides where none is chosen.
    pub(crate) fn colour(&self, files: &[PathBuf], settings: &Settings, scene: &SceneOf<'_>) -> String {
        let usual = || files.last().map_or("speed", |file| picture::usual_colour(file, settings, scene));
        self.colour.clone().unwrap_or_else(|| usual().to_owned())
    }

    /// Settings of a picture of an output, with its [`title`].
    ///
    /// # Errors
    /// The range of the colours is empty.
    pub(crate) fn settings(
        &self,
        title: Option<&str>,
        output: Option<&Path>,
        name: &str,
    ) -> Result<Settings, Failure> {
        if let Some((from, to)) =
            self.from.zip(self.to).filter(|(from, to)| from.partial_cmp(to).is_none_or(Ordering::is_ge))
        {
            return Err(Failure::Usage(format!(
                "found --from {} --to {}; expected a first value below the last",
                written(from),
                written(to)
            )));
        }
        let title = self::title(title, output, name);
        Ok(Settings {
            width: self.width as usize,
            height: self.height as usize,
            range: self.from.zip(self.to).map(|(from, to)| [from, to]),
            map: self.map,
            dark: self.dark,
            view: self.view,
            zoom: self.zoom,
            focus: self.focus,
            clip: self.clip,
            mirror: self.mirror.0,
            revolve: self.revolve,
            tree: self.tree,
            vectors: self.vectors.clone(),
            ..Settings::new(&title)
        })
    }

    /// The job of outputs, for colliders and boxes in pictures; a warning where colliders cannot be drawn.
    fn job(&self, output: &Path) -> Option<AnyProblem> {
        if !output.is_file() {
            return None;
        }
        let job = scene::job_of(output, self.job.as_deref());
        if let (Err(reason), false) = (&job, self.bare) {
            warn_of(&[format!(
                "colliders are not drawn: {reason}; name the job file with --job, or leave them out with --bare"
            )]);
        }
        job.ok()
    }

    /// Colliders and widths of boxes for pictures of the outputs of one run, of which this is one.
    pub(crate) fn scene(&self, output: &Path) -> impl Fn(&Header) -> Scene + use<> {
        let (job, is_bare) = (self.job(output), self.bare);
        move |header| {
            let mut scene = job.as_ref().map_or_else(Scene::default, |job| scene::of_job(job, header));
            if is_bare {
                scene.solids.clear();
            }
            scene
        }
    }
}
