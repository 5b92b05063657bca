//! The data sets of the state that hold columns of particles.
use crate::particle::chunk::Layout;

/// One data set of particle columns.
pub(in crate::io::snapshot) struct Columns {
    /// Name of the data set.
    pub name: &'static str,
    /// Unit, empty for pure numbers.
    pub unit: &'static str,
    /// Description, a sentence.
    pub meaning: &'static str,
    /// First column.
    pub first: usize,
    /// Number of columns.
    pub count: usize,
}

impl Columns {
    /// Components as [`Writer::write_slab`] counts them: 0 for a plain list.
    pub(in crate::io::snapshot) fn components(&self) -> usize {
        if self.count == 1 { 0 } else { self.count }
    }
}

/// The data sets that hold the columns of [`Layout`], in its order.
pub(in crate::io::snapshot) fn columns<const D: usize>() -> [Columns; 9] {
    let (mut first, symmetric) = (0, Layout::<D>::SYMMETRIC);
    let columns = [
        ("position", D, "m", "Position relative to the domain's lower corner."),
        ("velocity", D, "m/s", "Velocity."),
        (
            "affine",
            D * D,
            "m²/s",
            "Affine state, row by row: B of APIC; else the velocity gradient, 1/s.",
        ),
        (
            "left_cauchy_green",
            symmetric,
            "",
            "Elastic left Cauchy-Green tensor b: xx, yy, zz, xy (and xz, yz).",
        ),
        ("stress", symmetric, "Pa", "Kirchhoff stress: xx, yy, zz, xy (and xz, yz)."),
        ("mass", 1, "kg", "Mass (per metre of thickness in plane strain; of the whole ring in axisymmetry)."),
        ("half_width", 1, "m", "Half of the edge of the undeformed box (in axisymmetry half of the root of the undeformed volume)."),
        ("history", Layout::<D>::HISTORIES, "", "History variables of the material."),
        ("plastic_work", 1, "J/m³", "Plastic work dissipated since the start, per reference volume."),
    ]
    .map(|(name, count, unit, meaning)| {
        first += count;
        Columns { name, unit, meaning, first: first - count, count }
    });
    assert_eq!(first, Layout::<D>::REALS, "every column is saved");
    columns
}

/// Name of the data set of carried columns, which a state has where any particle carries a value.
pub(in crate::io::snapshot) const CARRIED: &str = "carried";
