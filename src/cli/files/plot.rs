//! `agimp plot`: a picture of the particles in an output file.
use crate::cli::Failure;
use crate::io::picture::{Settings, draw_file};
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `agimp plot`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Output or checkpoint file.
    file: PathBuf,
    /// Quantity that gives the colours: a field of the file or what follows from it, such as speed, pressure,
    /// stress_xy, stress_1 (greatest principal stress) or max_shear. An unknown name lists what there is.
    #[arg(long, alias = "color", default_value = "leaf_level")]
    colour: String,
    /// Value of the first colour; without it, as found.
    #[arg(long, requires = "to", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Value of the last colour.
    #[arg(long, requires = "from", allow_negative_numbers = true)]
    to: Option<f64>,
    /// Title; without it, the name of the file.
    #[arg(long)]
    title: Option<String>,
    /// Picture to write; without it, beside the file with the ending png.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Pixels across.
    #[arg(long, default_value_t = 1280, value_parser = clap::value_parser!(u32).range(400..=16384))]
    width: u32,
    /// Pixels down.
    #[arg(long, default_value_t = 800, value_parser = clap::value_parser!(u32).range(300..=16384))]
    height: u32,
}

/// Draws the picture.
///
/// # Errors
/// The file cannot be read or does not offer the quantity, or the picture cannot be written.
pub(in crate::cli) fn execute(arguments: &Arguments) -> Result<(), Failure> {
    let name = arguments.file.file_stem().unwrap_or_default().to_string_lossy();
    let mut settings = Settings::new(arguments.title.as_deref().unwrap_or(&name));
    (settings.width, settings.height) = (arguments.width as usize, arguments.height as usize);
    settings.range = arguments.from.zip(arguments.to).map(|(from, to)| [from, to]);
    let out = arguments.out.clone().unwrap_or_else(|| arguments.file.with_extension("png"));
    draw_file(&arguments.file, &arguments.colour, &settings, &out)
        .map_err(|error| Failure::Usage(error.to_string()))?;
    writeln!(std::io::stdout(), "{}", out.display())?;
    Ok(())
}
