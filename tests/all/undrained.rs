//! Water that cannot leave the pores: the law against closed forms by independent code
//! (`tests/data/water_*.csv`), a column through the whole program, ground at rest, and stages that drain it.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::common::history::History;
use crate::common::launch::{agimp, run, succeed};
use crate::common::restart;
use agimp::material::driver::control::Prescribed::{Strain, Stress};
use agimp::material::driver::control::{Controlled, Target};
use agimp::material::driver::{Point, determinant};
use agimp::material::undrained::{Undrained, build, skeleton};
use agimp::material::{Material, Parameters};

/// Rows of a table, by column.
fn table(name: &str) -> Vec<BTreeMap<String, String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name);
    rows(&std::fs::read_to_string(path).expect("data"))
}

fn rows(text: &str) -> Vec<BTreeMap<String, String>> {
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("header").split(',').collect();
    let row =
        |line: &str| header.iter().map(|h| (*h).to_owned()).zip(line.split(',').map(str::to_owned)).collect();
    lines.map(row).collect()
}

fn number(row: &BTreeMap<String, String>, name: &str) -> f64 {
    row[name].parse().unwrap_or_else(|_| panic!("{name}: {}", row[name]))
}

fn model(text: &str) -> Parameters {
    text.parse().unwrap_or_else(|fault| panic!("{text}: {fault}"))
}

/// The skeleton, and the ground with water of this stiffness K/n.
fn ground(text: &str, modulus: f64) -> [Box<dyn Material>; 2] {
    let water = Undrained { bulk_modulus: 0.5 * modulus, porosity: 0.5 };
    [skeleton(&model(text), 2000.0), build(&model(text), Some(&water), 2000.0)]
}

fn close(found: f64, exact: f64, tolerance: f64, what: &str) {
    assert!((found - exact).abs() <= tolerance, "{what}: {found} for {exact}");
}

/// Ground in a sealed oedometer under a dead load.
#[test]
fn a_sealed_oedometer_is_that_of_the_closed_form() {
    for row in table("water_undrained.csv") {
        let of = |name: &str| number(&row, name);
        let text = format!("model = 'hencky', young = {}, poisson = {}", of("E"), of("nu"));
        let water = Undrained { bulk_modulus: of("K_f"), porosity: of("n") };
        let ground = build(&model(&text), Some(&water), 2000.0);
        let mut body = Controlled::new(&*ground);
        let none = Strain(0.0);
        let target = Target { shear: 0.0, components: [none, Stress(-of("q")), none, none, none, none] };
        body.go(&target, 1, 0.0).expect("a state");
        let (stress, excess) = (body.stress(), body.point.excess_pore_pressure());
        let q = of("q");
        close(excess, of("finite_u"), 1e-6 * q, "excess pressure");
        close(stress[0], of("finite_sigma_xx_total"), 1e-6 * q, "total stress");
        close(-stress[1] - excess, of("finite_eff_vertical_compression"), 1e-6 * q, "effective stress");
        close(determinant(&body.gradient()), of("finite_J"), 1e-9, "volume");
    }
}

/// Consolidated under p0, then the drains are closed.
fn consolidated<'a>([drained, closed]: [&'a dyn Material; 2], pressure: f64) -> Controlled<'a> {
    let (all, none) = (Stress(-pressure), Strain(0.0));
    let mut body = Controlled::new(drained);
    body.go(&Target { shear: 0.0, components: [all, all, all, none, none, none] }, 1, 0.0)
        .expect("consolidated");
    body.close_drains(closed);
    assert!(body.point.excess_pore_pressure().abs() < 1e-9 * pressure);
    body
}

/// Triaxial tests of Cam-clay with constant total stress across: the effective path of the closed form, from
/// normally consolidated to far overconsolidated, until close to failure. The water is so stiff that it keeps
/// its volume.
#[test]
fn clay_follows_its_undrained_path() {
    let rows = table("water_triax_camclay.csv");
    let mut reached = 0;
    for ocr in [1.0, 1.5, 2.0, 5.0] {
        let rows: Vec<_> = rows.iter().filter(|row| number(row, "OCR") == ocr).collect();
        let of = |name: &str| number(rows[0], name);
        let p0 = of("p0_eff");
        let text = format!(
            "model = 'cam_clay', shear_modulus = 4e6, critical_stress_ratio = {}, compression_index = {}, \
             swelling_index = {}, pressure = {p0}, preconsolidation_pressure = {}",
            of("M"),
            of("lambda_hat"),
            of("kappa_hat"),
            ocr * p0
        );
        let materials = ground(&text, 1e13);
        let mut body = consolidated([&*materials[0], &*materials[1]], p0);
        let mut last = 0.0;
        for row in rows.iter().filter(|row| row["stage"] != "critical") {
            let [q, p, u] = ["q", "p_eff", "excess_u"].map(|name| number(row, name));
            if q == 0.0 {
                continue;
            }
            // No stress controls what softens: q is greatest at η² (2Λ - 1) = M².
            let eta = number(row, "eta");
            let share = 1.0 - of("kappa_hat") / of("lambda_hat");
            if q <= last || (ocr > 2.0 && eta * eta * (2.0 * share - 1.0) < of("M") * of("M")) {
                break;
            }
            last = q;
            let (across, none) = (Stress(-p0), Strain(0.0));
            let target =
                Target { shear: 0.0, components: [across, across, Stress(-p0 - q), none, none, none] };
            // Close to failure a stress hardly determines the strain.
            if body.go(&target, 8, 0.0).is_err() {
                break;
            }
            let (stress, excess) = (body.stress(), body.point.excess_pore_pressure());
            let mean = -(stress[0] + stress[1] + stress[2]) / 3.0;
            println!("OCR {ocr}: q {q}, p' {} for {p}, u {excess} for {u}", mean - excess);
            close(mean - excess, p, 2e-6 * p0, "effective pressure");
            close(excess, u, 2e-6 * p0, "excess pressure");
            reached += 1;
        }
    }
    assert!(reached >= 8, "{reached} rows");
}

/// Triaxial tests of soil with and without dilation, in compression and extension. The table has Kirchhoff
/// stress, and p0 makes the volume less by 0.6 %.
#[test]
fn soil_follows_its_undrained_path() {
    let mut reached = 0;
    let rows = table("water_triax_mc.csv");
    for start in rows.iter().filter(|row| number(row, "eps_axial_compression") == 0.0) {
        let keys = ["E", "nu", "cohesion", "phi_deg", "psi_deg", "p0_eff", "K_w_over_n", "extension"];
        let of = |name: &str| number(start, name);
        let p0 = of("p0_eff");
        let text = format!(
            "model = 'mohr_coulomb', young = {}, poisson = {}, cohesion = {}, friction_angle = {}, dilation_angle = {}",
            of("E"),
            of("nu"),
            of("cohesion"),
            of("phi_deg"),
            of("psi_deg")
        );
        let materials = ground(&text, of("K_w_over_n"));
        let mut body = consolidated([&*materials[0], &*materials[1]], p0);
        let begin = body.strain()[2];
        for row in rows.iter().filter(|row| keys.iter().all(|key| row[*key] == start[*key])) {
            let [strain, q, p, u] =
                ["eps_axial_compression", "q", "p_eff", "excess_u"].map(|name| number(row, name));
            let (across, none) = (Stress(-p0), Strain(0.0));
            let target =
                Target { shear: 0.0, components: [across, across, Strain(begin - strain), none, none, none] };
            body.go(&target, 10, 0.0).expect("a state");
            let (stress, excess) = (body.stress(), body.point.excess_pore_pressure());
            let mean = -(stress[0] + stress[1] + stress[2]) / 3.0;
            let allowed = 1e-2 * p.abs().max(q.abs());
            close(stress[0] - stress[2], q, allowed, "q");
            close(mean - excess, p, allowed, "effective pressure");
            close(excess, u, allowed, "excess pressure");
            reached += 1;
        }
    }
    assert!(reached >= 36, "{reached} rows");
}

/// The stress of ground of every kind has the power of its energy: with elastic skeletons the energy is the
/// work done, in large strain too; and waves are no faster than their bound.
#[test]
fn stress_follows_from_the_energy() {
    for text in [
        "model = 'hencky', young = 1e6, poisson = 0.3",
        "model = 'neo_hookean', young = 1e6, poisson = 0.2",
        "model = 'cam_clay', shear_modulus = 4e5, critical_stress_ratio = 1.2, compression_index = 0.1, \
         swelling_index = 0.02, pressure = 1e5, preconsolidation_pressure = 1e9",
    ] {
        let [_, ground] = ground(text, 5e7);
        let at = |strain: [f64; 3]| {
            let mut point = Point::new(&*ground);
            point.stretch(strain);
            point
        };
        for strain in [[0.0, 0.0, 0.0], [-0.1, 0.05, 0.02], [0.02, -0.03, 0.04], [0.01, 0.02, -0.2]] {
            for axis in 0..3 {
                let h = 1e-5;
                let beside = |sign: f64| {
                    let mut strain = strain;
                    strain[axis] += sign * h;
                    at(strain)
                };
                let [left, right] = [beside(-1.0), beside(1.0)];
                let point = at(strain);
                let power = (right.energy() - left.energy()) / (2.0 * h);
                close(power, point.stress[axis], 1e-6 * (5e7 + power.abs()), text);
                // Along a principal direction ρ₀ c² = dτ/dε - τ.
                let modulus = (right.stress[axis] - left.stress[axis]) / (2.0 * h) - point.stress[axis];
                let bound = 2000.0 * point.wave_speed * point.wave_speed;
                assert!(modulus <= bound * (1.0 + 1e-6), "{text}: {modulus} over {bound}");
                assert!(modulus >= 0.8 * bound, "{text}: {modulus} far below {bound}");
            }
        }
    }
}

/// A job with ground of skeleton and water between slip faces.
fn job(material: &str, body: &str, rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\n[domain]\nsize = [1, 2]\nroot_edge = 1\n\
         [boundaries]\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_min.kind = 'slip'\ny_max.kind = 'separating'\n\
         [numerics]\nf_bar = true\n[history]\nevery_steps = 20\n\
         [[materials]]\nname = 'soil'\n{material}\n\
         [[bodies]]\nname = 'ground'\nmaterial = 'soil'\n{body}\n{rest}\n"
    )
}

fn written(directory: &Path, text: &str) -> PathBuf {
    let path = directory.join("ground.toml");
    std::fs::write(&path, text).expect("job");
    path
}

/// The particles of the last output as a table.
fn particles(directory: &Path) -> Vec<BTreeMap<String, String>> {
    succeed(agimp(directory).args(["export", "out/ground", "--csv", "--out", "given"]));
    let files = std::fs::read_dir(directory.join("given")).expect("a directory");
    let last = files.map(|file| file.expect("a file").path()).max().expect("a table");
    rows(&std::fs::read_to_string(last).expect("a table").replace(" [m]", "").replace(" [Pa]", ""))
}

/// A column is loaded at once and comes to rest: its base has the pressure of OpenSees' sealed element, 7.8788
/// Pa of 10 Pa in small strain, 7.8785 in finite strain. Once a stage has drained it, the skeleton bears the load
/// alone.
#[test]
fn a_loaded_column_has_the_pressure_of_a_sealed_element() {
    let elastic = "density = 1000\nmodel = 'hencky'\nyoung = 1e4\npoisson = 0.3\n";
    let soil = format!(
        "{elastic}undrained = {{ bulk_modulus = 2e4, porosity = 0.4 }}\n\
                        [[materials]]\nname = 'drained'\n{elastic}"
    );
    let load = "[[loads]]\nname = 'load'\nkind = 'pressure'\npressure = 10\nfacing = [0, 1]\n\
                [time]\nend = 200\n[output]\npicture = false\n\
                fields = ['id', 'stress', 'pressure', 'excess_pore_pressure', 'effective_pressure', 'effective_stress']\n";
    // Stress that is left out of balance is that acceleration times the mass above, 1e-3 Pa.
    let rest = "equilibrium = { speed = 1e-7, acceleration = 1e-6 }\n";
    let shape = "shape = { kind = 'box', min = [0, 0], max = [1, 1.125] }";
    let sealed = format!("{load}[[stages]]\nname = 'sealed'\n{rest}");
    let drained = format!(
        "{sealed}[[stages]]\nname = 'drain'\nmaterials = [{{ body = 'ground', material = 'drained' }}]\n{rest}"
    );
    // Excess pressure, and total and effective stress along the column.
    for (stages, [excess, total, effective]) in
        [(sealed, [7.87852, -10.0, -2.12148]), (drained, [0.0, -10.0, -10.0])]
    {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = written(directory.path(), &job(&soil, shape, &stages));
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let base: Vec<_> =
            particles(directory.path()).into_iter().filter(|row| number(row, "y") < 0.5).collect();
        assert!(base.len() >= 32);
        for row in &base {
            let [u, p, effective_p] =
                ["excess_pore_pressure", "pressure", "effective_pressure"].map(|name| number(row, name));
            close(u, excess, 2e-3, "excess pressure");
            close(number(row, "stress_yy"), total, 2e-3, "total stress");
            close(number(row, "stress_xx"), 0.3 / 0.7 * effective - excess, 4e-3, "total stress across");
            close(number(row, "effective_stress_yy"), effective, 2e-3, "effective stress");
            close(effective_p + u, p, 1e-9, "the shares of skeleton and water");
        }
    }
}

/// Ground under a K0 stress with stiff water in its pores stays at rest to round-off.
#[test]
fn undrained_ground_is_at_rest() {
    for (model, stress) in [
        (
            "model = 'mohr_coulomb'\nyoung = 2e7\npoisson = 0.3\nfriction_angle = 33\ndilation_angle = 5",
            "k0 = 0.45",
        ),
        (
            "model = 'cam_clay'\nshear_modulus = 4e6\ncritical_stress_ratio = 1.0\ncompression_index = 0.1\n\
          swelling_index = 0.02\npressure = 1e4\npreconsolidation_pressure = 2e4",
            "k0 = 0.7, ocr = 1.2",
        ),
    ] {
        let soil = format!("density = 1800\n{model}\nundrained = {{ porosity = 0.4 }}");
        let body = format!(
            "shape = {{ kind = 'box', min = [0, 0], max = [1, 1.125] }}\nstress = {{ kind = 'geostatic', {stress} }}"
        );
        let text = job(&soil, &body, "[time]\nend = 0.02\n[output]\npicture = false\n");
        let text = text.replace("dimension = 2\n", "dimension = 2\ngravity = [0, -9.81]\n");
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = written(directory.path(), &text);
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let history = History::read(directory.path(), "ground");
        let kinetic = history.column("kinetic_energy").iter().fold(0.0_f64, |most, &e| most.max(e));
        let speed = (2.0 * kinetic / history.last("mass")).sqrt();
        println!("{speed:e} m/s");
        assert!(speed < 1e-9, "{model}: {speed} m/s");
    }
}

/// A block of undrained clay falls on a floor, across a level jump and through a stage that drains it.
#[test]
fn same_bits_on_any_ranks_and_across_restart() {
    let text = "version = 1\ndimension = 2\ngravity = [0, -10]\n[domain]\nsize = [2, 2]\nroot_edge = 0.5\n\
        [boundaries]\ny_min = { kind = 'sticky' }\n[numerics]\nf_bar = true\n\
        [[materials]]\nname = 'clay'\ndensity = 1800\nmodel = 'mohr_coulomb'\nyoung = 1e6\npoisson = 0.3\n\
        friction_angle = 20\ncohesion = 2e3\ndilation_angle = 5\nundrained = { bulk_modulus = 2e7, porosity = 0.4 }\n\
        [[materials]]\nname = 'drained'\ndensity = 1800\nmodel = 'mohr_coulomb'\nyoung = 1e6\npoisson = 0.3\n\
        friction_angle = 20\ncohesion = 2e3\ndilation_angle = 5\nvolume_correction = false\n\
        [[bodies]]\nname = 'block'\nmaterial = 'clay'\nshape = { kind = 'box', min = [0.2, 0.05], max = [1.4, 1.0] }\n\
        velocity = [0.2, -1]\n\
        [tree]\n[[tree.regions]]\nlevel = 1\nshape = { kind = 'box', min = [0.5, 0.5], max = [1.3, 1.2] }\n\
        [adaptivity]\nevery_steps = 5\n[[adaptivity.criteria]]\nkind = 'plastic_strain'\nrefine = 0.02\nlevel = 1\n\
        [history]\nevery_steps = 5\n[checkpoint]\nevery_steps = 20\nkeep = 99\n[time]\nend = 0.06\n[output]\npicture = false\n\
        fields = ['excess_pore_pressure', 'effective_stress']\n";
    restart::assert_same_on_any_ranks(text, "undrained", |_, _| {});
}
