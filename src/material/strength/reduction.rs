//! Strength over a factor of safety, which grows during a run.
use crate::material::undrained::{self, Undrained};
use crate::material::{Material, Parameters};

/// A material whose strength is divided by a factor.
#[derive(Clone, Debug)]
pub struct Weakened {
    /// The model with its full strength.
    pub model: Parameters,
    /// Water that cannot leave its pores.
    pub undrained: Option<Undrained>,
    /// Density of the undeformed material, kg/m³.
    pub density: f64,
    /// Whether flow becomes associated, with the strength that Davis (1968) gives for that.
    pub davis: bool,
}

impl Weakened {
    /// The material with its strength over `factor`; as it is where it has none.
    pub fn over(&self, factor: f64) -> Box<dyn Material> {
        let weakened = self.model.weakened(factor);
        let weakened = weakened.map(|model| if self.davis { model.associated() } else { model });
        undrained::build(weakened.as_ref().unwrap_or(&self.model), self.undrained.as_ref(), self.density)
    }
}
