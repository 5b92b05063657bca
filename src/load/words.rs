//! Quantities in words.
use crate::quantity::Quantity;
use crate::text::quantity;

/// A quantity in words.
pub(super) fn in_words(of: &Quantity, unit: &str) -> String {
    match of {
        Quantity::Constant(value) => quantity(*value, unit),
        Quantity::Expression(_) => format!("an expression in {unit}"),
        Quantity::Table(_) => format!("a table in {unit}"),
        Quantity::Field(_) => format!("values from a file in {unit}"),
    }
}

/// Components in words.
pub(super) fn all_in_words(components: &[Quantity], unit: &str) -> String {
    components.iter().map(|component| in_words(component, unit)).collect::<Vec<_>>().join(", ")
}
