//! Constitutive models along strain paths, against closed forms computed by independent code
//! (`tests/data/driver_*.json`).
use agimp::material::driver::{Matrix, Point, increment};
use agimp::material::{HISTORIES, Material, PLASTIC_STRAIN, PLASTIC_VOLUME, Parameters};
use nalgebra::Matrix3;
use serde_json::Value;

mod cap;
mod damage;
mod flow;
mod friction;
mod metal;
mod random_paths;

const UNIT: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn data(name: &str) -> Value {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|i| number(&value[i]))
}

fn matrix(value: &Value) -> Matrix {
    std::array::from_fn(|i| numbers(&value[i]))
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn full(s: &[f64; 6]) -> Matrix {
    [[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]]
}

fn size(a: &Matrix) -> f64 {
    a.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()))
}

fn difference(a: &Matrix, b: &Matrix) -> f64 {
    size(&std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] - b[i][j])))
}

fn deformed<'a>(material: &'a dyn Material, f: &Matrix) -> Point<'a> {
    let mut point = Point::new(material);
    point.deform(f);
    point
}

/// A state of principal strains reached in one step from the undeformed material with a history.
fn stretched<'a>(
    material: &'a dyn Material,
    strain: &Value,
    dt: f64,
    history: impl FnOnce(&mut [f64; HISTORIES]),
) -> Point<'a> {
    let mut point = Point::new(material);
    history(&mut point.history);
    point.dt = dt;
    point.stretch(numbers(strain));
    point
}

/// Principal values along the axes agree with those of a reference, to 1e-10 of a scale.
fn close_on_axes(found: &[f64; 6], expected: &Value, scale: f64, what: &Value) {
    let expected: [f64; 3] = numbers(expected);
    for k in 0..3 {
        assert!((found[k] - expected[k]).abs() <= 1e-10 * scale, "{found:?} instead of {expected:?}: {what}");
    }
}

/// Greatest magnitude in a list.
fn greatest(values: &Value) -> f64 {
    values.as_array().unwrap().iter().fold(0.0, |most, value| f64::max(most, number(value).abs()))
}

/// Elastic logarithmic strains along the axes.
fn elastic_strain(point: &Point) -> [f64; 6] {
    point.elastic.map(|b| 0.5 * b.ln())
}

/// A model with the elastic constants of a case and more keys.
fn model(name: &str, case: &Value, keys: &str) -> Box<dyn Material> {
    let text = format!("model = '{name}', young = {}, poisson = {}{keys}", case["E"], case["nu"]);
    text.parse::<Parameters>().unwrap_or_else(|error| panic!("{text}: {error}")).build(1000.0)
}

fn elastic_models(data: &Value) -> [(&'static str, Box<dyn Material>); 3] {
    [("NH", "neo_hookean"), ("FCR", "fixed_corotated"), ("HEN", "hencky")]
        .map(|(key, name)| (key, model(name, data, "")))
}

#[test]
fn elastic_stress_and_energy() {
    let data = data("driver_elastic.json");
    let models = elastic_models(&data);
    let modulus = number(&data["E"]);
    for row in data["rows"].as_array().unwrap() {
        let f = matrix(&row["F"]);
        for (name, material) in &models {
            let point = deformed(material.as_ref(), &f);
            let expected = matrix(&row[*name]["tau"]);
            // b = F Fᵀ is rounded before any model sees it: that much strain cannot be known.
            let scale = size(&expected).max(modulus * size(&f) * size(&f) * 1e-3);
            let error = difference(&full(&point.stress), &expected);
            assert!(error <= 1e-12 * scale, "{name}: {error} of {scale} at {f:?}");
            let energy = number(&row[*name]["W"]);
            let error = (point.energy() - energy).abs();
            assert!(error <= 1e-12 * energy.max(modulus * 1e-3), "{name}: W {} {energy}", point.energy());
        }
    }
}

#[test]
fn elastic_models_are_objective() {
    let data = data("driver_elastic.json");
    let models = elastic_models(&data);
    let (c, s) = (0.6, 0.8);
    let turn =
        product(&[[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], &[[1.0, 0.0, 0.0], [0.0, s, c], [0.0, -c, s]]);
    let back = std::array::from_fn(|i| std::array::from_fn(|j| turn[j][i]));
    for row in data["rows"].as_array().unwrap() {
        let f = matrix(&row["F"]);
        for (name, material) in &models {
            let plain = full(&deformed(material.as_ref(), &f).stress);
            let turned = full(&deformed(material.as_ref(), &product(&turn, &f)).stress);
            let expected = product(&product(&turn, &plain), &back);
            let scale = size(&plain).max(number(&data["E"]) * size(&f) * size(&f) * 1e-3);
            assert!(difference(&turned, &expected) <= 1e-12 * scale, "{name} at {f:?}");
        }
    }
}

#[test]
fn elastic_stress_is_the_derivative_of_the_energy() {
    let data = data("driver_elastic.json");
    let models = elastic_models(&data);
    let step = 1e-5;
    for row in data["rows"].as_array().unwrap() {
        let f = matrix(&row["F"]);
        for (name, material) in &models {
            let stress = full(&deformed(material.as_ref(), &f).stress);
            for i in 0..3 {
                for j in 0..3 {
                    // dW for F -> (1 + h e_i ⊗ e_j) F is h τ_ij.
                    let energy = |h: f64| {
                        let mut g = UNIT;
                        g[i][j] += h;
                        deformed(material.as_ref(), &product(&g, &f)).energy()
                    };
                    let slope = (energy(step) - energy(-step)) / (2.0 * step);
                    let scale = size(&stress).max(number(&data["E"]));
                    assert!((slope - stress[i][j]).abs() <= 1e-7 * scale, "{name} {slope} {}", stress[i][j]);
                }
            }
        }
    }
}

fn close(a: f64, b: f64, scale: f64) {
    assert!((a - b).abs() <= 1e-10 * scale, "{a} instead of {b}");
}

/// From zero to `end` in `steps`, in equal increments of logarithmic strain.
fn stretch_to(point: &mut Point, from: [f64; 3], end: [f64; 3], steps: u32) {
    for _ in 0..steps {
        point.stretch(std::array::from_fn(|k| (end[k] - from[k]) / f64::from(steps)));
    }
}

#[test]
fn von_mises_closed_forms() {
    let data = data("driver_j2.json");
    for case in data["cases"].as_array().unwrap() {
        let keys = format!(", yield_stress = {}, hardening = {}", case["sigma_y"], case["H"]);
        let material = model("von_mises", case, &keys);
        for row in case["rows"].as_array().unwrap() {
            for steps in [1, 7, 60] {
                let mut point = Point::new(material.as_ref());
                let path = row["path"].as_str().unwrap();
                if path.starts_with("cyclic") {
                    let mut last = 0.0;
                    for leg in row["legs"].as_array().unwrap() {
                        let a = number(&leg["a"]);
                        stretch_to(&mut point, [last, -last, 0.0], [a, -a, 0.0], steps);
                        last = a;
                        close(point.stress[0], number(&leg["tau1"]), number(&case["E"]) * 1e-2);
                        close(point.history[0], number(&leg["kappa"]), 1.0);
                    }
                    continue;
                }
                let a = number(&row["a"]);
                let end = if path.contains("pure_shear") {
                    [a, -a, 0.0]
                } else if path.starts_with("uniaxial_strain") {
                    [a, 0.0, 0.0]
                } else {
                    let lateral = number(&row["al"]);
                    [a, lateral, lateral]
                };
                stretch_to(&mut point, [0.0; 3], end, steps);
                let expected: [f64; 3] = numbers(&row["tau"]);
                for k in 0..3 {
                    close(point.stress[k], expected[k], number(&case["E"]) * 1e-2);
                }
                close(point.history[0], number(&row["kappa"]), 1.0);
                assert!(point.work >= 0.0);
            }
        }
    }
}

#[test]
fn von_mises_simple_shear() {
    let data = &data("driver_j2.json")["simple_shear_perfect_plasticity"];
    let material = model("von_mises", data, &format!(", yield_stress = {}", data["sigma_y"]));
    // First order in the step: extrapolate.
    let run = |steps: usize| {
        let mut point = Point::new(material.as_ref());
        let mut results = Vec::new();
        let mut shear = UNIT;
        shear[0][1] = 1.0 / steps as f64;
        for step in 1..=steps {
            point.deform(&shear);
            if step % (steps / 20) == 0 {
                results.push(point.stress);
            }
        }
        results
    };
    let (coarse, fine) = (run(4000), run(8000));
    for (i, row) in data["rows"].as_array().unwrap().iter().enumerate() {
        for (c, key) in [(0, "tau_xx"), (1, "tau_yy"), (2, "tau_zz"), (3, "tau_xy")] {
            let value = 2.0 * fine[i][c] - coarse[i][c];
            assert!(
                (value - number(&row[key])).abs() <= 1e-6 * number(&data["sigma_y"]),
                "{key} {value} {row}"
            );
        }
    }
}

fn sand(case: &Value, volume_correction: bool, matching: &str) -> Box<dyn Material> {
    let keys = format!(
        ", friction_angle = {}, match = '{matching}', volume_correction = {volume_correction}",
        case["phi_deg"]
    );
    model("drucker_prager", case, &keys)
}

#[test]
fn drucker_prager_closed_forms() {
    let data = data("driver_drucker_prager.json");
    for case in data["cases"].as_array().unwrap() {
        for correction in [false, true] {
            let material = sand(case, correction, "triaxial_compression");
            for row in case["rows"].as_array().unwrap() {
                let path = row["path"].as_str().unwrap();
                let end: [f64; 3] =
                    if path.starts_with("isotropic compression") || path.starts_with("drained") {
                        numbers(&row["eps_log"])
                    } else if path.starts_with("oedometer") {
                        [-number(&row["a"]), 0.0, 0.0]
                    } else {
                        continue;
                    };
                let expected: [f64; 3] = numbers(&row["tau"]);
                for steps in [1, 5, 40] {
                    let mut point = Point::new(material.as_ref());
                    if path.starts_with("oedometer") {
                        stretch_to(&mut point, [0.0; 3], end, steps);
                    } else {
                        let mean = [end.iter().sum::<f64>() / 3.0; 3];
                        stretch_to(&mut point, [0.0; 3], mean, steps);
                        stretch_to(&mut point, mean, end, steps);
                    }
                    for k in 0..3 {
                        close(point.stress[k], expected[k], 1000.0);
                    }
                    assert!(point.work >= 0.0 && point.history[1].abs() < 1e-15);
                }
            }
        }
    }
}

#[test]
fn drucker_prager_volume_correction() {
    let data = data("driver_drucker_prager.json");
    for case in data["cases"].as_array().unwrap() {
        for row in case["rows"].as_array().unwrap() {
            if !row["path"].as_str().unwrap().starts_with("isotropic expand") {
                continue;
            }
            let most = number(&row["b"]);
            for (correction, table, key) in [
                (true, "with_vc", "mean_tau_with_volume_correction"),
                (false, "without_vc", "mean_tau_no_correction"),
            ] {
                let material = sand(case, correction, "triaxial_compression");
                let mut point = Point::new(material.as_ref());
                let mut volume = 0.0;
                let mut go = |point: &mut Point, to: f64| {
                    stretch_to(point, [volume / 3.0; 3], [to / 3.0; 3], 3);
                    volume = to;
                };
                let mut rising = true;
                for entry in row[table].as_array().unwrap() {
                    let target = number(&entry["lnJ_total"]);
                    if rising && target < 0.019_5 && target > 0.015 {
                        // The way back starts at the greatest volume.
                        go(&mut point, most);
                        rising = false;
                    }
                    go(&mut point, target);
                    let mean = point.stress[..3].iter().sum::<f64>() / 3.0;
                    close(mean, number(&entry[key]), 1000.0);
                    // Elastic and plastic volume together are the particle's volume.
                    let elastic = 0.5 * point.elastic[..3].iter().map(|b| b.ln()).sum::<f64>();
                    assert!((elastic + point.history[1] - target).abs() < 1e-13);
                }
            }
        }
    }
}

#[test]
fn drucker_prager_in_plane_strain_mobilises_the_stated_friction() {
    let data = data("driver_drucker_prager.json");
    let sine = |stress: &[f64; 6]| {
        let (mean, half) = (0.5 * (stress[0] + stress[1]), 0.5 * (stress[0] - stress[1]));
        (half * half + stress[3] * stress[3]).sqrt() / -mean
    };
    for case in data["cases"].as_array().unwrap() {
        let expected =
            case["rows"].as_array().unwrap().iter().find(|r| r["path"] == "plane strain mobilised friction");
        let expected = expected.unwrap();
        let cases = [
            ("triaxial_compression", number(&expected["3D_embedding_F33_1"])),
            ("plane_strain", number(&case["phi_deg"]).to_radians().sin()),
        ];
        for (matching, expected) in cases {
            let material = sand(case, true, matching);
            let mut point = Point::new(material.as_ref());
            point.stretch([-0.01, -0.01, 0.0]);
            let mut shear = UNIT;
            shear[0][1] = 1e-4;
            for _ in 0..6000 {
                point.deform(&shear);
            }
            assert!((sine(&point.stress) - expected).abs() < 2e-3, "{} {expected}", sine(&point.stress));
        }
    }
}

#[test]
fn elastic_states_keep_their_bits() {
    let trial = [[1.0 + 1e-5, 2e-5, 1e-5], [-1e-5, 1.0 - 3e-5, 0.0], [0.0, 1e-5, 1.0 - 2e-5]];
    let case = serde_json::json!({"E": 1e6, "nu": 0.3, "phi_deg": 40.0});
    let metal = model("von_mises", &case, ", yield_stress = 1e5");
    for material in [metal, sand(&case, true, "triaxial_compression")] {
        let mut point = Point::new(material.as_ref());
        point.stretch([-0.01; 3]);
        let increment = Matrix3::from_fn(|i, j| trial[i][j]);
        let expected = increment * Matrix3::from(full(&point.elastic)) * increment.transpose();
        point.deform(&trial);
        for (c, (i, j)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            assert_eq!(point.elastic[c].to_bits(), expected[(i, j)].to_bits());
        }
        assert_eq!((point.work, point.history), (0.0, [0.0; HISTORIES]));
    }
}

#[test]
fn increments_between_deformation_gradients() {
    let from = [[1.1, 0.2, 0.0], [0.1, 0.9, 0.3], [0.0, 0.1, 1.2]];
    let to = [[1.0, 0.5, 0.1], [0.0, 1.3, 0.0], [0.2, 0.0, 0.8]];
    let step = increment(&from, &to).unwrap();
    assert!(difference(&product(&step, &from), &to) < 1e-15);
    assert!(increment(&[[1.0, 2.0, 0.0], [2.0, 4.0, 0.0], [0.0, 0.0, 1.0]], &to).is_none());
}
