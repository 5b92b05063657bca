//! Meaning of the colours of a picture.
use agimp::io::snapshot::PointField;

/// Meaning of the colours of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Tint {
    /// Name of the quantity.
    pub(super) name: String,
    /// Its unit, empty for pure numbers.
    pub(super) unit: String,
    /// Whether its values number classes, such as bodies, rather than measure amounts.
    pub(super) classes: bool,
    /// Names of these numbers, from 0 on, if they have names.
    pub(super) names: Vec<String>,
}

impl Tint {
    pub(super) fn of(field: PointField, materials: &[String], bodies: &[String]) -> Self {
        let (name, unit) = (field.name().to_owned(), field.unit().to_owned());
        Self { classes: is_class(&name), unit, names: Vec::new(), name }.named(materials, bodies)
    }

    /// With the names that its numbers stand for.
    pub(super) fn named(self, materials: &[String], bodies: &[String]) -> Self {
        let names = match &*self.name {
            "material" => materials.to_vec(),
            "body" => bodies.to_vec(),
            _ => Vec::new(),
        };
        Self { names, ..self }
    }
}

/// Whether the numbers of a quantity are names rather than amounts.
pub(in crate::picture) fn is_class(name: &str) -> bool {
    ["material", "body", "particle_level", "leaf_level"].contains(&name)
}
