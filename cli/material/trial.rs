//! Tests of the laboratory as paths of strains and stresses.
use super::arguments::{Arguments, Trial};
use super::error::MaterialError;
use super::path::Row;
use agimp::material::driver::control::Prescribed::{Strain, Stress};
use agimp::material::driver::control::Target;

/// Rows of a test: the confinement, and `rows` more to the end of the range.
pub(super) fn rows(test: Trial, args: &Arguments) -> Result<Vec<Row>, MaterialError> {
    let fail = |option, value, range| Err(MaterialError::Option { option, value, range });
    if !(args.pressure >= 0.0 && args.pressure.is_finite()) {
        return fail("pressure", args.pressure, "at least 0 (Pa)");
    }
    if !(args.duration >= 0.0 && args.duration.is_finite()) {
        return fail("duration", args.duration, "at least 0 (s)");
    }
    let range = args.range.unwrap_or(if test == Trial::SimpleShear { 0.2 } else { -0.1 });
    let (most, words) =
        if test == Trial::SimpleShear { (1e3, "from -1000 to 1000") } else { (5.0, "from -5 to 5") };
    if range.is_nan() || range.abs() > most {
        return fail("range", range, words);
    }
    let all = Stress(-args.pressure);
    let none = Strain(0.0);
    let confined = Target { shear: 0.0, components: [all, all, all, none, none, none] };
    let mut rows = vec![Row { time: 0.0, target: confined }];
    for row in 1..=args.rows {
        let share = f64::from(row) / f64::from(args.rows);
        let (strain, shear) =
            if test == Trial::SimpleShear { (0.0, share * range) } else { (share * range, 0.0) };
        let along = Strain(strain);
        let normal = match test {
            Trial::Oedometer => [none, none, along],
            Trial::Triaxial => [all, all, along],
            Trial::Biaxial => [all, none, along],
            Trial::SimpleShear => [none, all, none],
            Trial::Isotropic => [along; 3],
        };
        let [x, y, z] = normal;
        let target = Target { shear, components: [x, y, z, none, none, none] };
        rows.push(Row { time: share * args.duration, target });
    }
    Ok(rows)
}
