//! Problem 8: materials along paths with closed forms.
use std::process::Command;

use crate::page::Page;
use crate::runs::Runs;

/// The last row of `agimp material` along a path: the columns of these names.
fn last<const N: usize>(
    runs: &Runs,
    model: &str,
    arguments: &[&str],
    path: Option<&str>,
    names: [&str; N],
) -> [f64; N] {
    let mut command = Command::new(&runs.agimp);
    command.args(["material", "--model", model]).args(arguments);
    if let Some(path) = path {
        let file = runs.folder.join("path.csv");
        crate::checked(std::fs::create_dir_all(&runs.folder));
        crate::checked(std::fs::write(&file, path));
        command.arg(file);
    }
    let output = crate::checked(command.output());
    assert!(output.status.success(), "{command:?}\n{}", String::from_utf8_lossy(&output.stderr));
    let mut reader = csv::Reader::from_reader(&output.stdout[..]);
    let heads = crate::checked(reader.headers()).clone();
    let row = reader.records().last().map(crate::checked).unwrap_or_default();
    names.map(|name| {
        let place = heads
            .iter()
            .position(|head| head.split(" [").next() == Some(name))
            .unwrap_or_else(|| panic!("no column {name} in {heads:?}"));
        row.get(place).and_then(|cell| cell.parse().ok()).unwrap_or(f64::NAN)
    })
}

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 8 Materials along paths\n\n\
         `agimp material` drives one particle; the answers are closed forms. J2 with Hencky elasticity and linear hardening: uniaxial logarithmic strain a gives the plastic strain \
         (2 mu |a| - s_y) / (3 mu + H) and tau_1 = K a -/+ (2/3) (s_y + H kappa). Drucker-Prager matched to triaxial compression: drained triaxial compression ends at sigma_1 / sigma_3 = \
         tan^2(45 + phi / 2). Oedometer on the same sand, loaded plastically: K0 is the greater of nu / (1 - nu) and (1 - sin phi) / (1 + sin phi). Weakly compressible fluid: p = \
         (K / 7) (J^-7 - 1). All 17 models are driven along 20 files of paths by independent integrators in `tests/all/materials`.\n",
    );
    let (young, poisson, yielding, hardening): (f64, f64, f64, f64) = (1e6, 0.3, 2e4, 1e5);
    let (mu, bulk) = (young / 2.0 / (1.0 + poisson), young / 3.0 / (1.0 - 2.0 * poisson));
    let a = -0.05_f64;
    let kappa = (2.0 * mu * a.abs() - yielding) / (3.0 * mu + hardening);
    let stress = (bulk * a - 2.0 / 3.0 * (yielding + hardening * kappa)) / a.exp();
    let model = "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 2e4, hardening = 1e5";
    let [found, plastic] =
        last(runs, model, &["--substeps", "7"], Some("strain_xx\n-0.05\n"), ["stress_xx", "plastic_strain"]);
    page.line("drivers.j2.stress", (found / stress - 1.0).abs());
    page.line("drivers.j2.strain", (plastic / kappa - 1.0).abs());
    let sand = "model = 'drucker_prager', young = 1e7, poisson = 0.3, friction_angle = 30";
    let [axial, lateral] = last(
        runs,
        sand,
        &["--test", "triaxial", "--pressure", "1e5", "--range", "-0.3"],
        None,
        ["stress_zz", "stress_xx"],
    );
    page.line("drivers.sand.triaxial", (axial / lateral / 3.0 - 1.0).abs());
    let stiff = "model = 'drucker_prager', young = 1e7, poisson = 0.2, friction_angle = 30";
    let [axial, lateral] = last(
        runs,
        stiff,
        &["--test", "oedometer", "--pressure", "1", "--range", "-0.1"],
        None,
        ["stress_zz", "stress_xx"],
    );
    page.line("drivers.sand.k0", (lateral / axial * 3.0 - 1.0).abs());
    let water = "model = 'fluid', bulk_modulus = 1e6, viscosity = 0";
    let [pressure] = last(runs, water, &[], Some("strain_xx\n-0.02\n"), ["p"]);
    let exact = 1e6 / 7.0 * ((7.0_f64 * 0.02).exp() - 1.0);
    page.line("drivers.fluid", (pressure / exact - 1.0).abs());
}
