//! `agimp material`: drives one particle of a model along a path of strains and stresses.
//!
//! | file | content |
//! |---|---|
//! | `mod.rs` | the drive itself |
//! | `arguments.rs` | arguments |
//! | `error.rs` | errors, and reading of files |
//! | `path.rs` | paths from files |
//! | `trial.rs` | tests of the laboratory as paths |
//! | `table.rs` | columns of each state |
//! | `chart.rs` | the states as a picture |
use std::io::Write;
use std::path::Path;

pub(super) use self::arguments::Arguments;
use self::error::{MaterialError, read};
use self::path::{Deformation, Drive, Row};
use self::table::{Stage, Table};
use super::Failure;
use agimp::material::driver::control::Controlled;
use agimp::material::driver::{Point, increment};
use agimp::material::undrained::{self, Undrained};
use agimp::material::{Material, Parameters, build};

mod arguments;
#[cfg(feature = "post")]
mod chart;
mod error;
mod path;
mod table;
mod trial;

/// Drives the particle and prints its states as CSV.
///
/// # Errors
/// Model or path cannot be used, or standard output cannot be written.
pub(super) fn execute(args: &Arguments) -> Result<(), Failure> {
    drive(args, &mut std::io::stdout().lock()).map_err(|error| match error {
        MaterialError::Write(error) => error.into(),
        other => Failure::Usage(other.to_string()),
    })
}

/// Runs the command and writes CSV to `out`: the undeformed state, then one line per row of the path.
fn drive(args: &Arguments, out: &mut dyn Write) -> Result<(), MaterialError> {
    let parameters = model(&args.model)?;
    if !(args.density > 0.0 && args.density.is_finite()) {
        return Err(MaterialError::Density(args.density));
    }
    if !(args.size >= 0.0 && args.size.is_finite()) {
        return Err(MaterialError::Option { option: "size", value: args.size, range: "at least 0 (m)" });
    }
    let (place, drive) = match (&args.path, args.test) {
        (_, Some(test)) => ("--test".to_owned(), Drive::Control(trial::rows(test, args)?)),
        (Some(path), None) => {
            let drive = path::read_path(path)?;
            if drive.is_empty() {
                return Err(MaterialError::NoRow(path.clone()));
            }
            (path.display().to_string(), drive)
        }
        // clap requires one of them.
        (None, None) => (String::new(), Drive::Deformation(Vec::new())),
    };
    let water = args.undrained.as_deref().map(|text| water(text, &parameters)).transpose()?;
    let ground = match water {
        None => Ground { drained: build(&parameters, args.density), closed: None },
        Some(water) => Ground {
            drained: undrained::skeleton(&parameters, args.density),
            closed: Some(undrained::build(&parameters, Some(&water), args.density)),
        },
    };
    let mut table = Table::new(ground.names(), ground.closed.is_some(), args.tangent);
    let driven = match drive {
        Drive::Deformation(rows) => deform(&ground, &rows, args, &place, &mut table),
        Drive::Control(rows) => control(&ground, &rows, args, &place, &mut table),
    };
    // Rows before the error are printed as well.
    table.write(out)?;
    driven?;
    #[cfg(feature = "post")]
    if let Some(path) = &args.plot {
        return chart::draw(&table, path)
            .map_err(|reason| MaterialError::Plot { path: path.clone(), reason });
    }
    Ok(())
}

/// A material, and the same with water that cannot leave its pores where the command asks for it.
struct Ground {
    drained: Box<dyn Material>,
    closed: Option<Box<dyn Material>>,
}

impl Ground {
    fn names(&self) -> &'static [&'static str] {
        self.closed.as_ref().unwrap_or(&self.drained).history_names()
    }
}

/// Along total deformations.
fn deform(
    ground: &Ground,
    rows: &[Deformation],
    args: &Arguments,
    place: &str,
    table: &mut Table,
) -> Result<(), MaterialError> {
    let mut point = Point::new(ground.drained.as_ref());
    point.size = args.size;
    if let Some(closed) = &ground.closed {
        point.close_drains(closed.as_ref());
    }
    let mut last = Deformation::Strain([0.0; 3]);
    table.push(&Stage { time: 0.0, gradient: last.gradient(), point: &point });
    for (i, &target) in rows.iter().enumerate() {
        for part in 1..=args.substeps {
            let share = f64::from(part) / f64::from(args.substeps);
            let before = last.towards(&target, f64::from(part - 1) / f64::from(args.substeps));
            let after = last.towards(&target, share);
            if let (Deformation::Strain(before), Deformation::Strain(after)) = (before, after) {
                point.stretch(std::array::from_fn(|k| after[k] - before[k]));
                continue;
            }
            match increment(&before.gradient(), &after.gradient()) {
                Some(step) => point.deform(&step),
                None => {
                    let reason =
                        "the straight line from the previous row to this deformation gradient contains a singular one; add rows in between"
                            .to_string();
                    return Err(MaterialError::Row { path: place.into(), row: i + 1, reason });
                }
            }
        }
        last = target;
        table.push(&Stage { time: 0.0, gradient: target.gradient(), point: &point });
    }
    Ok(())
}

/// Along prescribed strains and stresses. Strains of a test count from its first row, the confined state.
fn control(
    ground: &Ground,
    rows: &[Row],
    args: &Arguments,
    place: &str,
    table: &mut Table,
) -> Result<(), MaterialError> {
    let mut body = Controlled::new(ground.drained.as_ref());
    body.point.size = args.size;
    let mut closed = ground.closed.as_deref();
    if args.test.is_none()
        && let Some(closed) = closed.take()
    {
        body.close_drains(closed);
    }
    let mut time = 0.0;
    table.push(&Stage { time, gradient: body.gradient(), point: &body.point });
    let mut start = [0.0; 6];
    for (i, row) in rows.iter().enumerate() {
        let dt = (row.time - time) / f64::from(args.substeps);
        body.go(&row.target.since(&start), args.substeps, dt).map_err(|reason| MaterialError::Stress {
            place: place.to_owned(),
            row: i + 1,
            reason,
        })?;
        if args.test.is_some() && i == 0 {
            start = body.strain();
            if let Some(closed) = closed.take() {
                body.close_drains(closed);
            }
        }
        time = row.time;
        table.push(&Stage { time, gradient: body.gradient(), point: &body.point });
    }
    Ok(())
}

/// Water in the pores of a model, from the inside of a TOML table.
fn water(text: &str, model: &Parameters) -> Result<Undrained, MaterialError> {
    #[derive(serde::Deserialize)]
    struct Inline {
        water: Undrained,
    }
    let fail = |reason: &dyn std::fmt::Display| MaterialError::Undrained(reason.to_string());
    let inline: Result<Inline, _> = toml::from_str(&format!("water = {{ {text} }}"));
    let keys = "expected keys as in 'bulk_modulus = 2.2e9, porosity = 0.4'";
    let water = inline.map_err(|error| fail(&format!("{}; {keys}", error.message().trim_end())))?.water;
    water.check().map_err(|error| fail(&error))?;
    Undrained::check_model(model).map_err(|reason| fail(&reason))?;
    Ok(water)
}

/// Reads a model from TOML text or from the file of that name.
fn model(text: &str) -> Result<Parameters, MaterialError> {
    if text.contains('=') {
        return Ok(text.parse()?);
    }
    Ok(read(Path::new(text))?.parse()?)
}

#[cfg(test)]
mod tests {
    use super::arguments::Trial;
    use super::*;

    fn arguments(model: &str) -> Arguments {
        Arguments {
            model: model.to_string(),
            density: 1000.0,
            substeps: 1,
            test: None,
            pressure: 1e5,
            range: None,
            rows: 50,
            duration: 0.0,
            undrained: None,
            size: 0.0,
            tangent: false,
            #[cfg(feature = "post")]
            plot: None,
            path: None,
        }
    }

    fn result(model: &str, name: &str, path: &str, substeps: u32) -> Result<String, String> {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join(name);
        std::fs::write(&file, path).unwrap();
        let args = Arguments { substeps, path: Some(file), ..arguments(model) };
        let mut out = Vec::new();
        drive(&args, &mut out).map_err(|error| error.to_string())?;
        Ok(String::from_utf8(out).unwrap())
    }

    const METAL: &str = "model = \"von_mises\", young = 1e9, poisson = 0.25, yield_stress = 1e6";

    fn last_row(text: &str) -> Vec<f64> {
        text.lines().last().unwrap().split(',').map(|field| field.parse().unwrap()).collect()
    }

    #[test]
    fn strains_and_gradients_agree() {
        let strains =
            result(METAL, "path.csv", "x, y, z\n# shear\n0.001,-0.001,0\n0.01,-0.01,0\n", 4).unwrap();
        assert_eq!(strains.lines().count(), 4);
        let f = |a: f64| format!("[[{:e},0,0],[0,{:e},0],[0,0,1]]", libm::exp(a), libm::exp(-a));
        let json = format!("{{\"path\": [{}, {}]}}", f(0.001), f(0.01));
        let gradients = result(METAL, "path.json", &json, 1).unwrap();
        // Perfect plasticity in pure shear: tau = σ_y / √3.
        for text in [&strains, &gradients] {
            assert!((last_row(text)[1] - 1e6 / 3.0_f64.sqrt()).abs() < 1e-3);
        }
        assert!(strains.starts_with("row,tau_xx,tau_yy,tau_zz,tau_xy,tau_xz,tau_yz,b_xx"));
        assert!(strains.lines().next().unwrap().contains(",plastic_strain,plastic_work,"));
    }

    #[test]
    fn errors_say_what_would_be_right() {
        let error = |model: &str, path: &str| result(model, "path.csv", path, 1).unwrap_err();
        assert!(error(METAL, "1,2\n").contains("row 1: expected 3 numbers"));
        assert!(error(METAL, "0,0,0\n0,a,0\n").contains("row 2: 'a' is not a number"));
        assert!(
            error(METAL, "1,0,0,0,1,0,0,0,-1\n").contains("with the determinant -1; expected more than 0")
        );
        let bad = "model = \"hencky\", young = 1e6, poisson = 0.5";
        assert!(
            error(bad, "0,0,0").contains("poisson = 0.5 is out of range: it must be above -1 and below 0.5")
        );
        assert!(error("model = \"rubber\", young = 1e6", "0,0,0").contains("rubber"));
        assert!(error("no_such_file.toml", "0,0,0").contains("cannot read no_such_file.toml"));
    }

    fn tested(model: &str, test: Trial, pressure: f64, range: f64) -> Result<Vec<Vec<f64>>, String> {
        let range = Some(range);
        let args =
            Arguments { test: Some(test), pressure, range, rows: 40, duration: 1.0, ..arguments(model) };
        let mut out = Vec::new();
        drive(&args, &mut out).map_err(|error| error.to_string())?;
        let text = String::from_utf8(out).unwrap();
        Ok(text.lines().skip(1).map(|line| line.split(',').map(|f| f.parse().unwrap()).collect()).collect())
    }

    /// Columns from the end: time, six strains, six stresses, p, q, Lode angle.
    fn stress(row: &[f64], component: usize) -> f64 {
        row[row.len() - 9 + component]
    }

    const SAND: &str = "model = 'mohr_coulomb', young = 1e8, poisson = 0.3, friction_angle = 30";

    #[test]
    fn sand_in_tests_of_the_laboratory() {
        // Triaxial compression: σ1 = N σ3 with N = 3.
        let rows = tested(SAND, Trial::Triaxial, 1e5, -0.05).unwrap();
        let last = rows.last().unwrap();
        assert!((stress(last, 2) / stress(last, 0) - 3.0).abs() < 1e-6, "{last:?}");
        assert!((stress(last, 0) + 1e5).abs() < 1.0);
        // q = 2 p0, p = 5/3 p0, compression has the Lode angle 60°.
        let [p, q, lode] = [last[last.len() - 3], last[last.len() - 2], last[last.len() - 1]];
        assert!(
            (p - 5e5 / 3.0).abs() < 1.0 && (q - 2e5).abs() < 1.0 && (lode - 60.0).abs() < 1e-3,
            "{last:?}"
        );
        // Oedometer: K0 = ν / (1 - ν), above 1/N.
        let rows = tested(SAND, Trial::Oedometer, 1.0, -0.05).unwrap();
        let last = rows.last().unwrap();
        assert!((stress(last, 0) / stress(last, 2) - 3.0 / 7.0).abs() < 1e-6, "{last:?}");
        // Biaxial: the same ratio, and the stress across is ν (σ1 + σ3).
        let rows = tested(SAND, Trial::Biaxial, 1e5, -0.05).unwrap();
        let last = rows.last().unwrap();
        assert!((stress(last, 2) / stress(last, 0) - 3.0).abs() < 1e-6, "{last:?}");
        assert!(stress(last, 1) < stress(last, 0) && stress(last, 1) > stress(last, 2));
        // The strain counts from the confined state.
        let confined = tested(SAND, Trial::Biaxial, 1e5, -0.05).unwrap()[1].clone();
        let strain = |row: &[f64], component: usize| row[row.len() - 15 + component];
        assert!((strain(last, 2) - strain(&confined, 2) + 0.05).abs() < 1e-12);
        assert!((strain(last, 1) - strain(&confined, 1)).abs() < 1e-12 && strain(last, 1) < -1e-4);
        // Simple shear under a constant normal stress; isotropic compression at K = E / (3 - 6 ν).
        let rows = tested(SAND, Trial::SimpleShear, 1e5, 0.1).unwrap();
        assert!((stress(rows.last().unwrap(), 1) + 1e5).abs() < 1.0);
        let rows = tested(SAND, Trial::Isotropic, 1e5, -0.01).unwrap();
        let last = rows.last().unwrap();
        let expected = 1e8 / 1.2 * 0.03 + 1e5;
        assert!((last[1] + expected).abs() < 1e-3 * expected, "{last:?}");
    }

    #[test]
    fn strains_and_stresses_by_name() {
        let path = "time, strain_zz, stress_xx, stress_yy\n1, -0.001, 0, 0\n2, -0.01, 0, 0\n";
        let text = result(METAL, "path.csv", path, 4).unwrap();
        // The Kirchhoff stress of a perfectly plastic bar is its yield stress.
        assert!((last_row(&text)[3] + 1e6).abs() < 1.0, "{text}");
        let error = |path: &str| result(METAL, "path.csv", path, 1).unwrap_err();
        assert!(
            error("strain_zx\n0\n")
                .contains("found the unknown column 'strain_zx'; expected time, shear, and")
        );
        assert!(
            error("strain_xx,stress_xx\n0,0\n").contains("'strain_xx' and 'stress_xx' prescribe the same")
        );
        assert!(error("strain_xx,time\n0,2\n0,1\n").contains("row 2: found time 1; expected at least 2"));
        assert!(error("strain_xx,time\n0\n").contains("row 1: expected 2 numbers as in the header, found 1"));
        let beyond = error("strain_xx,stress_yy,stress_zz\n0,0,-3e6\n");
        assert!(
            beyond.contains(
                "row 1: found no deformation with stress_yy = 0.0000e0, stress_zz = -3.0000e6 Pa; the nearest"
            ),
            "{beyond}"
        );
    }

    /// Clay in an undrained test from beyond its preconsolidation: each row has the tangent of its last
    /// substep.
    #[test]
    fn tangents_are_columns() {
        let clay = "model = 'cam_clay', shear_modulus = 4e6, critical_stress_ratio = 1.2, compression_index = 0.1, \
                    swelling_index = 0.02, pressure = 1e4, preconsolidation_pressure = 1e5";
        let water = Some("bulk_modulus = 1e7, porosity = 0.5".to_owned());
        let (test, range) = (Some(Trial::Triaxial), Some(-0.05));
        let (rows, substeps, undrained) = (10, 3, water);
        let args = Arguments {
            test,
            range,
            rows,
            substeps,
            undrained,
            pressure: 1.5e5,
            tangent: true,
            ..arguments(clay)
        };
        let mut out = Vec::new();
        drive(&args, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let column = |name: &str| names.iter().position(|other| *other == name).unwrap();
        assert_eq!(column("tangent_error") - column("tangent_xx_xx"), 36);
        assert_eq!(column("tangent_yy_xz") - column("tangent_xx_xx"), 10);
        let rows: Vec<Vec<f64>> =
            text.lines().skip(1).map(|line| line.split(',').map(|f| f.parse().unwrap()).collect()).collect();
        assert_eq!(rows.len(), 12);
        for row in &rows {
            assert!(row[column("tangent_error")] < 1e-6, "{row:?}");
        }
        // Undeformed: p/κ + 4/3 G; then with water, whose stiffness is 2e7 Pa.
        let [first, last] = [&rows[0], &rows[11]].map(|row| row[column("tangent_xx_xx")]);
        assert!((first - 1e4 / 0.02 - 4.0 / 3.0 * 4e6).abs() < 1.0, "{first}");
        assert!(last > 2e7 && last < 3e7, "{last}");
    }

    #[cfg(feature = "post")]
    #[test]
    fn states_are_drawn() {
        let directory = tempfile::tempdir().unwrap();
        let picture = directory.path().join("sand.svg");
        let mut table = Table::new(&[], false, false);
        let material = build(&SAND.parse().unwrap(), 1600.0);
        let (test, range) = (Some(Trial::Triaxial), Some(-0.05));
        let args = Arguments { density: 1600.0, test, range, rows: 20, ..arguments(SAND) };
        let rows = trial::rows(Trial::Triaxial, &args).unwrap();
        control(&Ground { drained: material, closed: None }, &rows, &args, "", &mut table).unwrap();
        chart::draw(&table, &picture).unwrap();
        let text = std::fs::read_to_string(&picture).unwrap();
        assert!(text.starts_with("<svg") && text.contains("polyline"), "{text}");
    }
}
