//! The vectors that a picture shows.
use crate::picture::source::derived::{Source, magnitude};
use agimp::io::hdf5_file::{FileError, Reader};
use agimp::io::snapshot::Header;

/// The vectors that a picture shows.
#[derive(Debug, Default)]
pub(in crate::picture) struct Vectors {
    /// Name of the quantity, and its unit.
    pub name: String,
    pub unit: String,
    /// One for each particle; empty if none are drawn.
    pub each: Vec<[f64; 3]>,
}

impl Vectors {
    /// The vectors of this name, if one is given, of all particles of a file.
    pub(in crate::picture) fn read(
        file: &Reader,
        header: &Header,
        name: Option<&str>,
    ) -> Result<Self, FileError> {
        let Some(name) = name else { return Ok(Self::default()) };
        let source = Source::new(file, header);
        if !["x", "y"].iter().all(|axis| source.offers(&format!("{name}_{axis}"))) {
            let known =
                ["velocity", "displacement"].into_iter().filter(|name| source.offers(&format!("{name}_x")));
            let known: Vec<&str> = known.collect();
            let name = agimp::text::excerpt(name, 60);
            return Err(
                file.refuse(format!("found no vectors {name}; expected one of: {}", known.join(", ")))
            );
        }
        let mut each = vec![[0.0; 3]; header.particles as usize];
        let mut unit = String::new();
        for (axis, ending) in ["x", "y", "z"].into_iter().enumerate() {
            let component = format!("{name}_{ending}");
            if source.offers(&component) {
                let (tint, values) = source.quantity(&component)?;
                unit = tint.unit;
                each.iter_mut().zip(values).for_each(|(vector, value)| vector[axis] = value);
            }
        }
        Ok(Self { name: name.to_owned(), unit, each })
    }

    /// Length of the longest one.
    pub(in crate::picture) fn longest(&self) -> f64 {
        self.each
            .iter()
            .map(|vector| magnitude(vector))
            .filter(|length| length.is_finite())
            .fold(0.0, f64::max)
    }
}
