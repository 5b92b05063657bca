//! What users type: subcommands, their options, and how they end.
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn agimp(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_agimp")).args(arguments).current_dir(directory).output().unwrap()
}

fn printed(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn every_file_of_a_subcommand_is_a_subcommand() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let help = printed(&agimp(root, &["--help"]));
    let mut found = 0;
    for entry in std::fs::read_dir(root.join("src/cli")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        if name != "mod" && text.contains("fn execute(") {
            found += 1;
            assert!(
                help.lines().any(|line| line.starts_with(&format!("  {name} "))),
                "{name} is not in\n{help}"
            );
        }
    }
    assert!(found >= 11, "{found}");
}

fn data(name: &str) -> (String, Value) {
    let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
    let value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    (path, value)
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

/// What `agimp material` prints: the names of the columns and the rows.
fn drive(model: &str, path: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let directory = tempfile::tempdir().unwrap();
    let text = printed(&agimp(directory.path(), &["material", "--model", model, path]));
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',').map(str::to_owned).collect();
    (names, lines.map(|line| line.split(',').map(|field| field.parse().unwrap()).collect()).collect())
}

/// Stress and energy of elastic models at given deformation gradients, straight from the file.
#[test]
fn material_drives_elastic_models_along_the_deformation_gradients_of_a_file() {
    let (path, data) = data("driver_elastic.json");
    let parameters = format!("young = {}, poisson = {}", data["E"], data["nu"]);
    for (model, key) in [("neo_hookean", "NH"), ("fixed_corotated", "FCR"), ("hencky", "HEN")] {
        let (names, rows) = drive(&format!("model = \"{model}\", {parameters}"), &path);
        let column = |name: &str| names.iter().position(|other| other == name).unwrap();
        let expected = data["rows"].as_array().unwrap();
        assert_eq!(rows.len(), expected.len() + 1);
        for (row, expected) in rows[1..].iter().zip(expected) {
            let tau: Vec<f64> = expected[key]["tau"].as_array().unwrap().iter().flat_map(numbers).collect();
            let scale = tau.iter().fold(1e3, |most: f64, x| most.max(x.abs()));
            for (name, expected) in [("tau_xx", tau[0]), ("tau_yy", tau[4]), ("tau_xz", tau[2])] {
                let error = (row[column(name)] - expected).abs();
                assert!(error < 1e-9 * scale, "{model} {name}: {error} of {scale}");
            }
            let energy = expected[key]["W"].as_f64().unwrap();
            assert!((row[column("elastic_energy")] - energy).abs() < 1e-9 * energy.max(1e3), "{model}");
        }
    }
}

/// Closed forms of plastic models for paths written as CSV and as JSON.
#[test]
fn material_drives_plastic_models_along_paths_of_logarithmic_strain() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("path.csv");
    let (_, data_j2) = data("driver_j2.json");
    for case in data_j2["cases"].as_array().unwrap() {
        let model = format!(
            "model = \"von_mises\", young = {}, poisson = {}, yield_stress = {}, hardening = {}",
            case["E"], case["nu"], case["sigma_y"], case["H"]
        );
        let shear = |row: &&Value| row["path"].as_str().unwrap().contains("pure_shear F=");
        let rows: Vec<&Value> = case["rows"].as_array().unwrap().iter().filter(shear).collect();
        assert!(!rows.is_empty());
        let lines = rows.iter().map(|row| format!("{a},-{a},0\n", a = row["a"].as_f64().unwrap()));
        std::fs::write(&path, lines.collect::<String>()).unwrap();
        let (names, driven) = drive(&model, path.to_str().unwrap());
        let strain = names.iter().position(|name| name == "plastic_strain").unwrap();
        for (row, expected) in driven[1..].iter().zip(rows) {
            let tau = numbers(&expected["tau"]);
            assert!((row[1] - tau[0]).abs() < 1e-9 * case["E"].as_f64().unwrap(), "{model}");
            assert!((row[strain] - expected["kappa"].as_f64().unwrap()).abs() < 1e-10, "{model}");
        }
    }
    let path = directory.path().join("path.json");
    let (_, data_sand) = data("driver_drucker_prager.json");
    for case in data_sand["cases"].as_array().unwrap() {
        let model = format!(
            "model = \"drucker_prager\", young = {}, poisson = {}, friction_angle = {}",
            case["E"], case["nu"], case["phi_deg"]
        );
        let drained = |row: &&Value| row["path"].as_str().unwrap().starts_with("drained");
        for row in case["rows"].as_array().unwrap().iter().filter(drained) {
            let end = numbers(&row["eps_log"]);
            let mean = end.iter().sum::<f64>() / 3.0;
            let rows = serde_json::json!({"rows": [[mean, mean, mean], {"eps_log": end, "p": row["p"]}]});
            std::fs::write(&path, rows.to_string()).unwrap();
            let (_, driven) = drive(&model, path.to_str().unwrap());
            for (found, expected) in driven[2][1..4].iter().zip(numbers(&row["tau"])) {
                assert!((found - expected).abs() < 1e-7, "{model}: {found} {expected}");
            }
        }
    }
}

#[test]
fn material_refuses_what_it_cannot_use_with_exit_code_2() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("path.csv"), "0,0,0\n0,0\n").unwrap();
    let model = "model = \"hencky\", young = 1e6, poisson = 0.3";
    for (arguments, words) in [
        (vec!["material", "--model", model, "path.csv"], "path.csv, row 2: expected 3 numbers"),
        (vec!["material", "--model", model, "absent.csv"], "cannot read absent.csv"),
        (vec!["material", "--model", "model = \"rubber\"", "path.csv"], "rubber"),
        (vec!["material", "--model", model, "--density", "0", "path.csv"], "--density 0 is out of range"),
    ] {
        let output = agimp(directory.path(), &arguments);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(words), "{words:?} is not in {message:?}");
    }
}
