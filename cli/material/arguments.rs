//! Arguments of `agimp material`.
use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// Arguments of `agimp material`.
#[derive(Args, Clone, Debug)]
pub struct Arguments {
    /// Model and parameters as in a job, for example 'model = "hencky", young = 1e6, poisson = 0.3';
    /// or the name of a TOML file that holds them
    #[arg(long, value_name = "TOML|FILE")]
    pub model: String,

    /// Density of the undeformed material, kg/m³ (for the wave speed)
    #[arg(long, default_value_t = 1000.0)]
    pub density: f64,

    /// Equal parts into which each step of the path is divided
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub substeps: u32,

    /// A laboratory test that replaces a path: it starts from an isotropic stress of --pressure
    #[arg(long, value_enum, conflicts_with = "path")]
    pub test: Option<Trial>,

    /// Confining pressure of --test, Pa
    #[arg(long, default_value_t = 1e5, requires = "test", allow_negative_numbers = true)]
    pub pressure: f64,

    /// End of --test, measured from the confined state: logarithmic strain along z, along all axes
    /// (isotropic), or shear (simple_shear) [default: -0.1; simple_shear: 0.2]
    #[arg(long, requires = "test", allow_negative_numbers = true)]
    pub range: Option<f64>,

    /// Rows of --test after the confinement
    #[arg(long, default_value_t = 50, requires = "test", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub rows: u32,

    /// Duration of --test, s; 0: no effects of rate
    #[arg(long, default_value_t = 0.0, requires = "test", allow_negative_numbers = true)]
    pub duration: f64,

    /// Fill the pores with water that cannot leave: after the confinement of --test, or from the start of a
    /// path. Keys as of `undrained` in a job, for example --undrained='bulk_modulus = 2.2e9, porosity = 0.35'
    /// [default: porosity = 0.4]
    #[arg(long, value_name = "TOML", num_args = 0..=1, require_equals = true, default_missing_value = "porosity = 0.4")]
    pub undrained: Option<String>,

    /// Edge of the cells on which softening and damage depend, m; 0: none, so that cracks do not open
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    pub size: f64,

    /// Add the tangent of the last substep of each row: the derivative of the Kirchhoff stress by the strain,
    /// Pa, as columns tangent_xx_xx to tangent_yz_yz (component of the stress, component of the strain; shear
    /// strains count twice). tangent_error is the greatest difference from differences of the stress, as a
    /// share of the modulus of pressure waves: below 1e-6, but at corners of a yield surface
    #[arg(long)]
    pub tangent: bool,

    /// Draw stress, strain and stress path into this file (SVG)
    #[cfg(feature = "post")]
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,

    /// The path: CSV or JSON. A CSV whose header names strain_xx (logarithmic) or stress_xx (Cauchy, Pa), and
    /// so on for yy, zz, xy, xz and yz, the shear (of x over y) or the time (s), prescribes these since the
    /// start; other components have no strain. Otherwise each row is the total deformation since the start: 3
    /// numbers are logarithmic strains along the axes, 9 are the deformation gradient row by row. JSON is a
    /// list of rows, alone or under the key "path" or "rows"; a row is a list of numbers (the 9 may be
    /// nested) or an object that holds one under "F" or "eps_log"; its other keys do not matter.
    #[arg(value_name = "PATH", required_unless_present = "test")]
    pub path: Option<PathBuf>,
}

/// A test of the laboratory. All begin under the same pressure on all sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum Trial {
    /// Compression along z, no strain across
    Oedometer,
    /// Compression along z, constant stress across
    Triaxial,
    /// Compression along z, constant stress along x, no strain along y
    Biaxial,
    /// Shear of x over y under a constant stress along y, no strain along x and z
    SimpleShear,
    /// The same strain along all axes
    Isotropic,
}
