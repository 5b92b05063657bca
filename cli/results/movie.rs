//! `agimp movie`: the outputs of a run as a movie, with one frame and one range of colours.
use super::looks::Looks;
use crate::Failure;
use crate::files::given::Given;
use agimp::text::bytes;
use post::movie::{Format, Movie, gif_frame};
use post::picture::{Prepared, survey};
use rayon::prelude::*;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `agimp movie`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Outputs of one run, in order of time: files, the directory of the run, its index (NAME.hdf.series) or
    /// its job file.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Appearance.
    #[command(flatten)]
    looks: Looks,
    /// Title; by default the title of the job that wrote the files, or the name of the movie.
    #[arg(long)]
    title: Option<String>,
    /// Frames per second.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=60))]
    fps: u16,
    /// Movie to write: .png (APNG) or .gif; .mp4 and .webm with ffmpeg on the PATH; by default NAME.movie.png
    /// beside the first file.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Draws the frames in parallel and writes the movie.
///
/// # Errors
/// A file cannot be read or does not offer the quantity, or the movie cannot be written.
pub(crate) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let failed = |error: agimp::io::hdf5_file::FileError| Failure::Usage(error.to_string());
    let Given { files, first } = Given::particles(&arguments.files)?;
    let out = arguments.out.clone().unwrap_or_else(|| super::beside(&first, "movie.png"));
    let format = Format::of(&out).ok_or_else(|| {
        Failure::Usage(format!(
            "{}: found no extension of a movie; expected .png, .gif, .mp4 or .webm",
            out.display()
        ))
    })?;
    let name = out.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let given_looks = &arguments.looks;
    let name = name.trim_end_matches(".movie");
    let mut settings =
        given_looks.settings(arguments.title.as_deref(), files.first().map(PathBuf::as_path), name)?;
    let scene = given_looks.scene(&files[0]);
    // All frames share range, frame and scale of vectors.
    let colour = given_looks.colour(&files, &settings, &scene);
    let look = survey(&files, &colour, &settings, &scene).map_err(failed)?;
    settings.share(&look);

    let size = [settings.width, settings.height];
    let cannot = |error: std::io::Error| cannot(&out, format, &error);
    let mut movie = Movie::begin(&out, format, size, files.len(), arguments.fps).map_err(cannot)?;
    // HDF5 is read by this thread alone; as many frames are drawn at once as there are threads.
    for some in files.chunks(rayon::current_num_threads().max(1)) {
        let read = some.iter().map(|file| Prepared::read(file, &colour, &settings, &scene));
        let read = read.collect::<Result<Vec<_>, _>>().map_err(failed)?;
        let drawn: Vec<_> = read
            .into_par_iter()
            .map(|frame| {
                let pixels = frame.pixels(&settings);
                let gif = (format == Format::Gif).then(|| gif_frame(&pixels, size));
                (pixels, gif)
            })
            .collect();
        drawn.into_iter().try_for_each(|(pixels, gif)| movie.push(pixels, gif)).map_err(cannot)?;
    }
    movie.finish(&out).map_err(cannot)?;
    let size = std::fs::metadata(&out).map_or(0, |data| data.len());
    writeln!(std::io::stdout(), "{} ({} frames, {})", out.display(), files.len(), bytes(size as f64))?;
    Ok(())
}

fn cannot(out: &Path, format: Format, error: &std::io::Error) -> Failure {
    if format == Format::Ffmpeg && error.kind() == std::io::ErrorKind::NotFound {
        let out = out.display();
        return Failure::Usage(format!(
            "{out}: found no ffmpeg on the PATH; install it, or choose a name that ends in .png or .gif"
        ));
    }
    Failure::Usage(format!("{}: cannot write: {error}", out.display()))
}
