//! The command line: subcommands, their options, and how they end.
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use crate::common::program::{agimp, confined};
use crate::common::three_at_a_time;

fn printed(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn every_file_of_a_subcommand_is_a_subcommand() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let help = printed(&agimp(root, &["--help"]));
    let mut found = 0;
    let entries =
        ["cli", "cli/files", "cli/results"].map(|folder| std::fs::read_dir(root.join(folder)).unwrap());
    for entry in entries.into_iter().flatten() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        if !["mod", "lib", "main"].contains(&name) && text.contains("fn execute(") {
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

/// Output of `agimp material`: the names of the columns and the rows.
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

/// Simple shear of an elastic solid, `b_xy = γ`: a path of time and shear alone is one.
#[test]
fn material_is_sheared_along_a_path_of_time_and_shear_alone() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("path.csv");
    for header in ["time,shear", "shear,time"] {
        let of = |time, shear| {
            if header == "time,shear" { format!("{time},{shear}") } else { format!("{shear},{time}") }
        };
        std::fs::write(&path, format!("{header}\n{}\n{}\n", of(0.5, 0.1), of(1.0, 0.2))).unwrap();
        let model = "model = \"neo_hookean\", young = 3e6, poisson = 0.5e-9";
        let (names, rows) = drive(model, path.to_str().unwrap());
        let at = |row: usize, name: &str| rows[row][names.iter().position(|other| other == name).unwrap()];
        for (row, time, shear) in [(1, 0.5, 0.1), (2, 1.0, 0.2)] {
            assert_eq!(at(row, "time"), time);
            let expected = 3e6 / (2.0 * (1.0 + 0.5e-9)) * shear;
            assert!(
                (at(row, "tau_xy") - expected).abs() < 1e-9 * expected,
                "{header}: {} {expected}",
                at(row, "tau_xy")
            );
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

/// A directory with a finished run whose files show the velocity and no more, and one whose files carry the
/// state.
fn finished_run() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    let job = |directory: &str, output: &str| {
        format!(
            "version = 1\ndimension = 2\ngravity = [0, -10]\n\
             domain = {{ size = [1, 1], root_edge = 1 }}\ntree = {{ base_level = 1 }}\n\
             materials = [{{ name = \"m\", density = 1000, model = \"hencky\", young = 1e6, poisson = 0.25 }}]\n\
             time = {{ end = 2e-3 }}\n\
             bodies = [{{ name = \"b\", material = \"m\", velocity = [3, 4], \
             shape = {{ kind = \"box\", min = [0, 0], max = [0.5, 0.5] }} }}]\n\
             output = {{ directory = \"{directory}\", picture = false, {output} }}\n"
        )
    };
    let bare = "restart = false, fields = [\"velocity\"]";
    for (name, output) in [("bare", bare), ("full", "fields = []")] {
        let path = directory.path().join(format!("{name}.toml"));
        std::fs::write(&path, job(name, output)).unwrap();
        printed(&agimp(directory.path(), &["run", path.to_str().unwrap(), "--quiet"]));
    }
    directory
}

#[test]
fn plot_draws_what_follows_from_the_fields_or_the_state_of_a_file() {
    let directory = finished_run();
    let plot = |file: &str, option: &str, name: &str| {
        let out = directory.path().join("picture.png");
        let _ = std::fs::remove_file(&out);
        let output = agimp(directory.path(), &["plot", file, option, name, "--out", "picture.png"]);
        let drawn = out.exists();
        assert_eq!(output.status.code() == Some(0), drawn, "{}", String::from_utf8_lossy(&output.stderr));
        (drawn, String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let file = |name: &str| {
        let entries = std::fs::read_dir(directory.path().join(name)).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.retain(|file| file.starts_with(&format!("{name}_000000")) && !file.contains("tree"));
        assert_eq!(names.len(), 1, "{names:?}");
        format!("{name}/{}", names[0])
    };
    let (bare, full) = (file("bare"), file("full"));
    for name in ["speed", "velocity", "velocity_y", "x"] {
        assert!(plot(&bare, "--colour", name).0, "{name}");
    }
    for name in [
        "speed",
        "density",
        "pressure",
        "von_mises",
        "stress",
        "stress_xy",
        "stress_1",
        "stress_3",
        "max_shear",
        "stress_i1",
        "stress_j2",
        "plastic_strain",
        "volume_ratio",
        "body",
        "leaf_level",
        "mass",
    ] {
        assert!(plot(&full, "--color", name).0, "{name}");
    }
    let (drawn, message) = plot(&bare, "--colour", "sped");
    assert!(!drawn && message.contains("did you mean speed?"), "{message}");
    assert!(message.contains("velocity_x") && !message.contains("pressure"), "{message}");
    let (drawn, message) = plot(&bare, "--colour", "pressure");
    assert!(!drawn && message.contains("found no quantity pressure"), "{message}");
}

#[test]
fn new_without_a_name_lists_the_templates() {
    let directory = tempfile::tempdir().unwrap();
    let (plain, listed) = (agimp(directory.path(), &["new"]), agimp(directory.path(), &["new", "--list"]));
    assert_eq!(printed(&plain), printed(&listed));
    assert!(printed(&plain).contains("elastic_cubes"));
    let output = agimp(directory.path(), &["new", "elastic_cube"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("did you mean \"elastic_cubes\"?"));
    // What it says next can be pasted, whatever the name.
    let written = printed(&agimp(directory.path(), &["new", "silo", "my silo.toml"]));
    assert!(written.starts_with("my silo.toml written; next: agimp check 'my silo.toml'\n"), "{written}");
    let text = std::fs::read_to_string(directory.path().join("my silo.toml")).unwrap();
    assert!(text.contains("#     agimp run 'my silo.toml'"), "{text}");
}

#[test]
fn a_path_of_a_material_without_rows_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    for (text, file) in [("", "a.csv"), ("strain_xx,stress_yy\n", "b.csv"), ("[]", "c.json")] {
        std::fs::write(directory.path().join(file), text).unwrap();
        let model = "model = 'hencky', young = 1e6, poisson = 0.3";
        let output = agimp(directory.path(), &["material", "--model", model, file]);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{file}: {told}");
        assert!(told.contains(&format!("{file}: found no row; expected rows of 3")), "{file}: {told}");
    }
}

/// Each template is written with the files that it names, checked without a warning, and does a few steps as
/// it is; the schema lies beside it, where editors look.
#[test]
fn templates_run_as_they_are() {
    let list = printed(&agimp(Path::new("."), &["new", "--list"]));
    let names: Vec<&str> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() >= 24, "{names:?}");
    let schema = printed(&agimp(Path::new("."), &["schema"]));
    three_at_a_time(names, |name| {
        let directory = tempfile::tempdir().unwrap();
        let here = directory.path();
        let file = format!("my_{name}.toml");
        assert_eq!(agimp(here, &["new", "--template", name, &file]).status.code(), Some(0), "{name}");
        let text = std::fs::read_to_string(here.join(&file)).unwrap();
        assert!(text.starts_with("#:schema ./agimp.schema.json\n"), "{name}");
        // The commands of its comments are those for the new file.
        assert!(text.contains(&format!("agimp run {file}")), "{name}");
        assert!(
            !text.contains(&format!("jobs/{name}.toml")) && !text.contains(&format!("out/{name}/")),
            "{name}"
        );
        let check = agimp(here, &["check", &file]);
        assert!(!String::from_utf8_lossy(&check.stderr).contains("warning"), "{name}: {check:?}");
        let end = format!("{:e}", few_steps(&printed(&check)));
        let run = ["run", &file, "--end", &end, "--quiet", "--set", "output.picture=false"];
        let output = agimp(here, &run);
        assert_eq!(output.status.code(), Some(0), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let beside = std::fs::read_to_string(here.join("agimp.schema.json")).unwrap();
        assert_eq!(beside.trim_end(), schema.trim_end(), "{name}");
    });
}

/// Time of three steps and a half, by the time step or load step that `agimp check` prints, s.
fn few_steps(check: &str) -> f64 {
    let line_of = |name: &str| check.lines().find_map(|line| line.strip_prefix(name));
    let line = line_of("time step").or(line_of("load step")).expect("a step");
    let mut words = line.split_whitespace().skip_while(|word| word.parse::<f64>().is_err());
    let number: f64 = words.next().and_then(|word| word.parse().ok()).expect("a number");
    let scale = match words.next().expect("a unit").trim_end_matches([',', ';']) {
        "s" => 1.0,
        "ms" => 1e-3,
        "µs" => 1e-6,
        "ns" => 1e-9,
        other => panic!("{other}"),
    };
    3.5 * number * scale
}

/// As in `agimp schema | head -1`.
#[test]
fn who_stops_reading_ends_the_program_quietly() {
    for arguments in [vec!["schema"], vec!["schema", "--markdown"]] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_agimp"));
        command.args(arguments).stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped());
        let mut child = command.spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!((output.status.code(), output.stderr.as_slice()), (Some(0), &b""[..]));
    }
}

const JOB: &str = "version = 1\ndimension = 2\ntitle = \"TITLE\"\ndomain = { size = [1, 1], root_edge = 1 }\n\
    materials = [{ name = \"MATERIAL\", density = 1000, model = \"hencky\", young = 1e6, poisson = 0.25 }]\n\
    time = { end = 2e-3 }\n\
    bodies = [{ name = \"BODY\", material = \"MATERIAL\", shape = { kind = \"box\", min = [0, 0], max = [0.5, 0.5] } }]\n";

/// Most seconds of processor time of a check, which answers at once. Two in a release build.
const AT_ONCE: u32 = 15;

/// Answer of `agimp check` to a job, given at once: exit code, standard output and standard error.
fn check(text: &str) -> (i32, String, String) {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("job.toml"), text).unwrap();
    let output = confined(directory.path(), AT_ONCE, None, &["check", "job.toml"]);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let code = output.status.code().unwrap_or_else(|| panic!("{:?}", output.status));
    (code, text(&output.stdout), text(&output.stderr))
}

#[test]
fn text_of_a_job_controls_no_terminal() {
    let escape = r"\u001b]0;owned\u0007\u202e\nparticles 0";
    let job = JOB.replace("TITLE", escape).replace("MATERIAL", escape).replace("BODY", escape);
    let (code, out, _) = check(&job);
    assert_eq!(code, 0);
    let clean = |text: &str| !text.chars().any(|c| c.is_control() && c != '\n' || c == '\u{202e}');
    assert!(clean(&out), "{out:?}");
    assert!(!out.lines().any(|line| line.starts_with("particles 0")), "{out}");
    // In the names that a message quotes, and in the lines of the file that it shows.
    let wrong = [
        JOB.replace("material = \"MATERIAL\"", &format!("material = \"{escape}\"")),
        JOB.replace("time = {", "time = { \u{9b}31m"),
        format!("{JOB}titel = 1 # \u{1b}[31m \u{202e}\n"),
        format!("{JOB}\"ti\\u001b[31m\" = 1\n"),
    ];
    for text in wrong {
        let (code, _, message) = check(&text);
        assert!(code == 2 && clean(&message), "{message:?}");
    }
}

#[test]
fn messages_are_bounded() {
    let names = (0..60_000).map(|i| format!("[[materials]]\nname = \"m{i}\"\nx = 1\n")).collect::<String>();
    let corners: Vec<String> = (0..100_000).map(|i| format!("[0.1, {i}]")).collect();
    let polygon = format!("shape = {{ kind = \"polygon\", points = [{}] }}", corners.join(","));
    let cases = [
        format!("{JOB}output = {{ fields = [{}] }}\n", vec!["1"; 200_000].join(",")),
        (0..20_000).map(|i| format!("k{i} = 1\n")).collect::<String>() + JOB,
        format!("{}{names}", JOB.replace("materials = ", "ignored = ")),
        JOB.replace("shape = { kind = \"box\", min = [0, 0], max = [0.5, 0.5] }", &polygon),
        JOB.replace("material = \"MATERIAL\"", &format!("material = \"{}\"", "x".repeat(1_000_000))),
        format!("{} = 1\n{JOB}", "k".repeat(1_000_000)),
    ];
    for text in cases {
        let (code, _, message) = check(&text);
        let head = message.chars().take(300).collect::<String>();
        assert_eq!(code, 2, "{head}");
        // Twenty faults, each with a message, three lines of the file and their frame.
        assert!(message.len() < 60_000, "{} bytes: {head}", message.len());
        assert!(message.lines().all(|line| line.chars().count() < 700), "{head}");
    }
}

#[test]
fn shapes_and_words_of_the_other_dimension_are_not_offered() {
    let (code, _, message) = check(&JOB.replace("\"box\"", "\"cirle\""));
    assert_eq!(code, 2);
    assert!(message.contains("did you mean \"circle\"?") && !message.contains("sphere"), "{message}");
    let (_, _, message) =
        check(&JOB.replace("\"box\"", "\"spher\"").replace("dimension = 2", "dimension = 3"));
    assert!(message.contains("did you mean \"sphere\"?") && !message.contains("polygon"), "{message}");
    let (_, _, message) = check(&format!("{JOB}boundaries = {{ wall = {{ kind = \"slip\" }} }}\n"));
    assert!(message.contains("`y_max`") && !message.contains("`z_max`"), "{message}");
}

#[test]
fn a_key_that_is_not_there_is_named_missing() {
    let (code, _, message) = check(&JOB.replace("density = 1000, ", ""));
    assert_eq!(code, 2);
    assert!(message.contains("materials[0].density: missing key `density`: Density of"), "{message}");
    let (_, _, message) = check(&JOB.replace("end = 2e-3", "end = 2e-3, clf = 0.3"));
    assert!(message.contains("unknown key `clf`; did you mean `cfl`?"), "{message}");
}

/// Trees and regions far too large to be made are counted by arithmetic or up to a bound.
#[test]
fn check_answers_at_once_whatever_the_file_asks_for() {
    let body = "bodies = [";
    let bars: String = (0..200)
        .map(|i| {
            let (low, high) = (0.3 + 0.002 * f64::from(i), 0.301 + 0.002 * f64::from(i));
            format!(
                "{{ name = \"b{i}\", material = \"MATERIAL\", shape = {{ kind = \"rotated\", angle = 45, centre = [0.5, 0.5], \
                 shape = {{ kind = \"box\", min = [0.3, {low}], max = [0.7, {high}] }} }} }},"
            )
        })
        .collect();
    let strips: String = (0..10_000)
        .map(|i| {
            let (low, high) = (f64::from(i) / 1e4, f64::from(i + 1) / 1e4);
            format!(
                "{{ name = \"b{i}\", material = \"MATERIAL\", shape = {{ kind = \"box\", min = [{low}, 0.8], max = [{high}, 0.9] }} }},"
            )
        })
        .collect();
    let block = "shape = { kind = \"box\", min = [0, 0, 0], max = [0.5, 0.5, 0.5] }";
    let ball = "shape = { kind = \"sphere\", centre = [0.5, 0.5, 0.5], radius = 0.4 }";
    let region = "{ level = 15, shape = { kind = \"box\", min = [0, 0], max = [1, 1] } }";
    let space = JOB.replace("dimension = 2", "dimension = 3").replace("[1, 1]", "[1, 1, 1]");
    let space = space.replace("[0, 0]", "[0, 0, 0]").replace("[0.5, 0.5]", "[0.5, 0.5, 0.5]");
    let everywhere =
        "adaptivity = { criteria = [{ kind = \"material\", material = \"MATERIAL\", level = 15 }] }\n";
    let cases = [
        (format!("{space}tree.base_level = 10\n"), "leaves 1 073 741 824"),
        (format!("{JOB}tree.base_level = 15\n"), "particles 17 179 869 184"),
        (format!("{JOB}tree.regions = [{region}]\n"), "leaves 1 073 741 824"),
        (format!("{}tree.base_level = 10\n", space.replace(block, ball)), "particles at least "),
        (format!("{space}{everywhere}"), "of the job's tree, before the criteria"),
        (
            format!(
                "{}tree.base_level = 9\n",
                JOB.replace(body, &(body.to_owned() + &bars))
                    .replace("max = [0.5, 0.5]", "max = [0.01, 0.01]")
            ),
            "and 101 more bodies",
        ),
        (format!("{}tree.base_level = 11\n", JOB.replace(body, &(body.to_owned() + &strips))), "more bodies"),
    ];
    for (text, expected) in cases {
        let (code, out, message) = check(&text);
        let out: Vec<String> =
            out.lines().map(|l| l.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
        assert!(
            code == 0 && out.iter().any(|line| line.contains(expected)),
            "{expected}: {message}{}",
            out.join("\n")
        );
    }
}

/// A pipe without end, or a file of gigabytes, is no job.
#[test]
fn a_file_without_end_is_no_job() {
    let directory = tempfile::tempdir().unwrap();
    let output = agimp(directory.path(), &["check", "/dev/zero"]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("/dev/zero:1:1: found more than 2 MB"), "{message}");
}

#[test]
fn check_and_run_warn_of_what_is_likely_not_meant() {
    let directory = tempfile::tempdir().unwrap();
    let thin: Vec<String> = (0..16)
        .map(|i| {
            format!("{{ name = \"c{i}\", shape = {{ kind = \"box\", min = [0, 0.9], max = [1, 0.91] }} }}")
        })
        .collect();
    let sand = "model = \"drucker_prager\", friction_angle = 30,";
    let job = format!("{}colliders = [{}]\n", JOB.replace("model = \"hencky\",", sand), thin.join(", "));
    std::fs::write(directory.path().join("job.toml"), job).unwrap();
    for command in ["check", "run"] {
        let output = agimp(directory.path(), &[command, "job.toml"]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{message}");
        for part in [
            "agimp: warning: boundaries: found no condition for x_min, x_max, y_min, y_max; the default applies",
            "agimp: warning: materials[0].match: ",
            "agimp: warning: colliders[15].shape: \"c15\" is 10 mm thick",
        ] {
            assert!(message.contains(part), "{command}: {part} is not in\n{message}");
        }
    }
    // A run of 10^9 steps; many colliders and materials: twenty warnings.
    let sands: String = (0..30)
        .map(|i| format!("[[materials]]\nname = \"s{i}\"\ndensity = 1000\nmodel = \"drucker_prager\"\nyoung = 1e6\npoisson = 0.2\nfriction_angle = 30\n"))
        .collect();
    let many =
        JOB.replace("materials = [", "ignored = [").replace("material = \"MATERIAL\"", "material = \"s3\"");
    let many: String = many
        .lines()
        .filter(|line| !line.trim_start().starts_with("ignored"))
        .map(|l| format!("{l}\n"))
        .collect();
    let (code, _, message) = check(&format!("{many}{sands}"));
    assert_eq!((code, message.matches("agimp: warning: ").count()), (0, 21), "{message}");
    assert!(message.contains("agimp: warning: and 12 more"), "{message}");
    let (_, out, message) = check(&JOB.replace("end = 2e-3", "end = 1e6"));
    assert!(message.contains("steps; stiff material"), "{message}");
    assert!(out.contains("wall time    about "), "{out}");
    let (_, out, _) = check(JOB);
    assert!(out.contains("wall time    less than 1 s on "), "{out}");
}

#[test]
fn check_lists_loads() {
    let load =
        "[[loads]]\nname = \"wind\"\nkind = \"body_force\"\nacceleration = [1.5, \"sin(t)\"]\nfrom = 0.5\n";
    let (code, out, message) = check(&format!("{JOB}{load}"));
    assert_eq!(code, 0, "{message}");
    assert!(out.contains("loads        1\n"), "{out}");
    assert!(
        out.contains(
            "wind               body force (1.5 m/s², an expression in m/s²), everywhere, from 500 ms on"
        ),
        "{out}"
    );
}

/// Values of the command line take the place of those of the file, and are checked like these.
#[test]
fn settings_are_checked_like_the_file() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("job.toml"), JOB).unwrap();
    let refused = [
        (
            vec!["--set", "time.clf=0.3"],
            "--set time.clf=0.3: time.clf: unknown key `clf`; did you mean `cfl`?",
        ),
        (
            vec!["--set", "materials.0.density=-5"],
            "--set materials.0.density=-5: materials[0].density: found -5; expected a number at least",
        ),
        (
            vec!["--set", "materials.STEEL.density=5"],
            "--set materials.STEEL.density=5: materials: found no element \"STEEL\"; expected 0 or \"MATERIAL\"",
        ),
        (
            vec!["--set", "materials.MATERIAL.young=soft"],
            "found the string \"soft\"; expected a number above 0",
        ),
        (vec!["--set", "bodies[0].shape.max.0=9"], "--set bodies[0].shape.max.0=9"),
        (vec!["--set", "time.end"], "--set time.end: found no \"=\"; expected KEY=VALUE"),
        (vec!["--end", "0"], "--end 0: time.end: found 0; expected a number above 0"),
        (vec!["--end", "-1"], "--end -1: time.end: found -1; expected a number above 0"),
        (vec!["--end", "soon"], "--end soon: time.end: found the string \"soon\"; expected a number above 0"),
        (vec!["--out", ""], "--out : output.directory: found an empty string"),
    ];
    for (arguments, part) in refused {
        for command in ["check", "run"] {
            let output = agimp(directory.path(), &[&[command, "job.toml"], &arguments[..]].concat());
            let message = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
            // A shape that leaves the domain is a fault of the shape, in the file.
            if !part.starts_with("--set bodies") {
                assert!(message.contains(part), "{arguments:?}:\n{message}");
            }
        }
    }
    // A fault of the file keeps its line, also behind a value that takes more lines.
    let faulty = JOB.replace("time = {", "title2 = 1\ntime = {");
    std::fs::write(directory.path().join("faulty.toml"), faulty).unwrap();
    let output = agimp(
        directory.path(),
        &["check", "faulty.toml", "--set", "domain.min=[0, 0]", "--set", "gravity=[0, -1]"],
    );
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("faulty.toml:6:1: title2: unknown key"), "{message}");
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 2, "nothing is written");
}

#[test]
fn settings_decide_what_is_run() {
    let directory = tempfile::tempdir().unwrap();
    let file = |name: &str| {
        std::fs::read(directory.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    let other = JOB.replace("young = 1e6", "young = 3e6").replace("end = 2e-3", "end = 1e-3");
    std::fs::write(directory.path().join("job.toml"), JOB).unwrap();
    std::fs::create_dir(directory.path().join("edited")).unwrap();
    std::fs::write(directory.path().join("edited/job.toml"), other).unwrap();
    printed(&agimp(directory.path(), &["run", "edited/job.toml", "--quiet", "--out", "edited/out"]));
    let set = ["--set", "materials.MATERIAL.young=3e6"];
    let run =
        |rest: &[&str]| agimp(directory.path(), &[&["run", "job.toml", "--quiet"], &set[..], rest].concat());
    printed(&run(&["--end", "1e-3", "--out", "set"]));
    assert_eq!(file("set/job.history.csv"), file("edited/out/job.history.csv"));
    // The text in the files is that of the job as it was run.
    let text = printed(&agimp(directory.path(), &["info", "set/job_000001.hdf"]));
    assert!(text.contains("job"), "{text}");
    // A restart knows that the end may change, and that nothing else may.
    printed(&run(&["--end", "2e-3", "--out", "set", "--restart", "latest"]));
    printed(&run(&["--out", "whole"]));
    assert_eq!(file("set/job.history.csv"), file("whole/job.history.csv"));
    // A restart does not repeat the warnings of the run.
    let again = run(&["--end", "2e-3", "--out", "set", "--restart", "latest"]);
    let message = String::from_utf8_lossy(&again.stderr).into_owned();
    assert!(again.status.code() == Some(0) && !message.contains("boundaries"), "{message}");
    let refused = agimp(directory.path(), &["run", "job.toml", "--out", "set", "--restart", "latest"]);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert!(message.contains("`materials[0].young` is 3000000.0 there and 1000000.0 here"), "{message}");
}

/// `srun` is told the cores of a rank and how to start it; arguments of the script reach the program; after a
/// requeue it goes on from the checkpoint, whatever they were.
#[test]
fn the_script_for_slurm_passes_arguments_on() {
    use std::os::unix::fs::PermissionsExt as _;
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let stand_in = |name: &str, script: &str| {
        let path = here.join(name);
        std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    };
    stand_in("srun", "echo srun \"$@\"; exit ${CODE:-0}");
    stand_in("scontrol", "echo scontrol \"$@\"");
    let run = |arguments: &[&str], restarts: &str, code: &str| {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/slurm/collapse.sbatch");
        let path = format!("{}:{}", here.display(), std::env::var("PATH").unwrap());
        let mut command = Command::new("bash");
        command.arg(script).args(arguments).current_dir(here).env("PATH", path).env("AGIMP", "agimp");
        command.envs([("SLURM_CPUS_PER_TASK", "4"), ("SLURM_JOB_ID", "7"), ("CODE", code)]);
        let output = command.env("SLURM_RESTART_COUNT", restarts).output().unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    let given = ["my job.toml", "--restart", "latest", "--set", "time.end=2"];
    let (code, out) = run(&given, "0", "0");
    assert_eq!(code, Some(0));
    assert!(out.contains("--mpi=pmix --cpus-per-task=4 --cpu-bind=cores"), "{out}");
    assert!(out.contains("agimp run my job.toml --threads 4 --restart latest --set time.end=2\n"), "{out}");
    std::fs::create_dir_all(here.join("out/my job")).unwrap();
    std::fs::write(here.join("out/my job/my job.checkpoint_000000020.hdf"), "").unwrap();
    let (code, out) = run(&["my job.toml", "--restart", "old.hdf", "--overwrite", "--quiet"], "1", "3");
    assert_eq!(code, Some(3));
    assert!(out.contains("agimp run my job.toml --threads 4 --quiet --restart latest\n"), "{out}");
    assert!(out.contains("scontrol requeue 7\n"), "{out}");
    let (_, out) = run(&["my job.toml", "--restart=old.hdf"], "2", "0");
    assert!(out.contains("--threads 4 --restart latest\n"), "{out}");
}
