//! Von Mises with hardening, rates and temperature (`driver_von_mises_hardening.json`,
//! `driver_johnson_cook.json`, `driver_perzyna.json`).
use super::*;

fn hardening(case: &Value) -> String {
    let law = match case["law"].as_str().unwrap() {
        "linear" => format!("{{kind = 'linear', modulus = {}}}", case["H"]),
        "voce" => format!(
            "{{kind = 'voce', saturation = {}, rate = {}, modulus = {}}}",
            case["sigma_inf"], case["delta"], case["H"]
        ),
        "swift" => format!("{{kind = 'swift', strain = {}, exponent = {}}}", case["e0"], case["n"]),
        "ludwik" => format!("{{kind = 'ludwik', modulus = {}, exponent = {}}}", case["K_h"], case["n"]),
        "exponential_softening" => format!(
            "{{kind = 'exponential_softening', residual = {}, strain = {}}}",
            case["sigma_r"], case["kappa_c"]
        ),
        "table" => {
            let points: Vec<String> =
                points(case).iter().skip(1).map(|p| format!("[{:e}, {:e}]", p[0], p[1])).collect();
            format!("{{kind = 'table', points = [{}]}}", points.join(", "))
        }
        law => panic!("unknown law {law}"),
    };
    let initial = if case["law"] == "table" { points(case)[0][1] } else { number(&case["sigma_0"]) };
    format!(", yield_stress = {initial:e}, hardening = {law}")
}

/// Points of a table, the first at no plastic strain.
fn points(case: &Value) -> Vec<[f64; 2]> {
    let list = |key: &str| case[key].as_array().unwrap().iter().map(number).collect::<Vec<f64>>();
    list("kappa").into_iter().zip(list("sigma")).map(|(strain, stress)| [strain, stress]).collect()
}

#[test]
fn hardening_in_one_step() {
    for case in data("driver_von_mises_hardening.json")["cases"].as_array().unwrap() {
        let material = model("von_mises", case, &hardening(case));
        for row in case["returns"].as_array().unwrap() {
            let point = stretched(material.as_ref(), &row["eps_e_trial"], 0.0, |history| {
                history[PLASTIC_STRAIN] = number(&row["kappa_n"]);
            });
            let scale = greatest(&row["tau_trial"]);
            close_on_axes(&point.stress, &row["tau"], scale, row);
            close_on_axes(&elastic_strain(&point), &row["eps_e"], greatest(&row["eps_e_trial"]), row);
            let strain = scale / number(&case["E"]);
            let error = (point.history[PLASTIC_STRAIN] - number(&row["kappa"])).abs();
            assert!(error <= 1e-10 * (strain + number(&row["kappa"])), "{row}");
        }
    }
}

#[test]
fn hardening_along_paths() {
    for case in data("driver_von_mises_hardening.json")["cases"].as_array().unwrap() {
        let material = model("von_mises", case, &hardening(case));
        for path in case["paths"].as_array().unwrap() {
            let rows = path["rows"].as_array().unwrap();
            let scale = rows.iter().fold(0.0, |scale, row| f64::max(scale, greatest(&row["tau"])));
            for steps in [1, 20] {
                let mut point = Point::new(material.as_ref());
                let mut last = [0.0; 3];
                for row in rows {
                    let strain = numbers(&row["eps_log"]);
                    stretch_to(&mut point, last, strain, steps);
                    last = strain;
                    close_on_axes(&point.stress, &row["tau"], 10.0 * scale, row);
                    let error = (point.history[PLASTIC_STRAIN] - number(&row["kappa"])).abs();
                    assert!(error <= 1e-9 * number(&row["kappa"]).max(scale / number(&case["E"])), "{row}");
                }
            }
        }
    }
}

fn johnson_cook(case: &Value, beta: &Value) -> Box<dyn Material> {
    let keys = format!(
        "model = 'von_mises', young = {}, poisson = {}, yield_stress = {}, hardening = {{kind = 'johnson_cook', \
         modulus = {}, exponent = {}, rate_factor = {}, reference_rate = {}, thermal_exponent = {}, \
         reference_temperature = {}, temperature = {}, melting_temperature = {}, specific_heat = {}, heat_fraction = {beta}}}",
        case["E"],
        case["nu"],
        case["A"],
        case["B"],
        case["n"],
        case["C"],
        case["rate0"],
        case["m"],
        case["T_ref"],
        case["T_0"],
        case["T_melt"],
        case["c_p"],
    );
    keys.parse::<Parameters>().unwrap().build(number(&case["rho"]))
}

#[test]
fn johnson_cook_in_one_step() {
    for case in data("driver_johnson_cook.json")["materials"].as_array().unwrap() {
        for row in case["returns"].as_array().unwrap() {
            let material = johnson_cook(case, &row["beta"]);
            let temperature =
                material.history_names().iter().position(|name| *name == "temperature").unwrap();
            let point = stretched(material.as_ref(), &row["eps_e_trial"], number(&row["dt"]), |history| {
                history[PLASTIC_STRAIN] = number(&row["kappa_n"]);
                history[temperature] = number(&row["T_n"]);
            });
            let scale = greatest(&row["tau_trial"]);
            close_on_axes(&point.stress, &row["tau"], scale, row);
            close_on_axes(&elastic_strain(&point), &row["eps_e"], greatest(&row["eps_e_trial"]), row);
            let strain = scale / number(&case["E"]);
            let error = (point.history[PLASTIC_STRAIN] - number(&row["kappa"])).abs();
            assert!(error <= 1e-10 * (strain + number(&row["kappa"])), "{row}");
            assert!(
                (point.history[temperature] - number(&row["T"])).abs() <= 1e-9 * number(&row["T"]),
                "{row}"
            );
        }
    }
}

/// Backward Euler is of first order: twice a fine solution less a coarse one is the limit. The error of a
/// reference implementation at its number of steps is in the file; ours is compared with the limit.
#[test]
fn johnson_cook_in_pure_shear_at_four_rates() {
    for case in data("driver_johnson_cook.json")["materials"].as_array().unwrap() {
        for path in case["paths"].as_array().unwrap() {
            if path["path"] != "pure_shear" {
                continue;
            }
            let material = johnson_cook(case, &path["beta"]);
            let rows = path["rows"].as_array().unwrap();
            let run = |steps: u32| {
                let mut point = Point::new(material.as_ref());
                let (mut last, mut time) = ([0.0; 3], 0.0);
                let mut results = Vec::new();
                for row in rows {
                    let (strain, end) = (numbers(&row["eps_log"]), number(&row["time"]));
                    point.dt = (end - time) / f64::from(steps);
                    stretch_to(&mut point, last, strain, steps);
                    (last, time) = (strain, end);
                    results.push((point.stress[0], point.history[2]));
                }
                results
            };
            let (coarse, fine) = (run(200), run(400));
            for (i, row) in rows.iter().enumerate().skip(2) {
                let limit = 2.0 * fine[i].0 - coarse[i].0;
                let expected = number(&row["tau"][0]);
                assert!((limit - expected).abs() <= 1e-4 * expected.abs(), "{limit} {row}");
                let limit = 2.0 * fine[i].1 - coarse[i].1;
                assert!((limit - number(&row["T"])).abs() <= 0.05, "{limit} {row}");
            }
        }
    }
}

fn viscous(case: &Value) -> Box<dyn Material> {
    let keys = format!(
        ", yield_stress = {}, viscosity = {}, rate_exponent = {}",
        case["sigma_y"], case["eta"], case["h"]
    );
    model("von_mises", case, &keys)
}

#[test]
fn overstress_in_one_step() {
    for case in data("driver_perzyna.json")["cases"].as_array().unwrap() {
        let material = viscous(case);
        for row in case["returns"].as_array().unwrap() {
            let point = stretched(material.as_ref(), &row["eps_e_trial"], number(&row["dt"]), |_| {});
            close_on_axes(&point.stress, &row["tau"], greatest(&row["tau_trial"]), row);
            close_on_axes(&elastic_strain(&point), &row["eps_e"], greatest(&row["eps_e_trial"]), row);
        }
    }
}

/// Steady flow, which no step count changes: the law of the rheometer.
#[test]
fn overstress_in_steady_pure_shear() {
    for case in data("driver_perzyna.json")["cases"].as_array().unwrap() {
        let material = viscous(case);
        for row in case["steady"]["rows"].as_array().unwrap() {
            let pure = &row["pure_shear"];
            let rate = number(&pure["a_rate"]);
            let mut point = Point::new(material.as_ref());
            // Long against the time in which the start decays.
            let (eta, h) = (number(&case["eta"]), number(&case["h"]));
            let shear_modulus = number(&case["E"]) / (2.0 + 2.0 * number(&case["nu"]));
            let decay = eta * h * (2.0_f64.sqrt() * rate).powf(h - 1.0) / (2.0 * shear_modulus);
            let steps = 4000;
            let strain = 0.2_f64.max(40.0 * rate * decay);
            point.dt = strain / rate / f64::from(steps);
            stretch_to(&mut point, [0.0; 3], [strain, -strain, 0.0], steps);
            let expected = number(&pure["tau"][0]);
            assert!((point.stress[0] - expected).abs() <= 1e-8 * expected, "{} {row}", point.stress[0]);
        }
    }
}

#[test]
fn softening_takes_the_same_work_per_area_in_cells_of_any_size() {
    let keys = ", yield_stress = 1e4, hardening = {kind = 'exponential_softening', residual = 0.0, strain = 0.1, length = 0.02}";
    let material = model("von_mises", &serde_json::json!({"E": 1e7, "nu": 0.3}), keys);
    let work = |size: f64| {
        let mut point = Point::new(material.as_ref());
        point.size = size;
        let shear = 2.0 * 0.02 / size;
        stretch_to(&mut point, [0.0; 3], [shear, -shear, 0.0], 20_000);
        point.work * size
    };
    let coarse = work(0.02);
    for size in [0.01, 0.005] {
        assert!((work(size) / coarse - 1.0).abs() < 1e-3, "{size}: {} {coarse}", work(size));
    }
    // All of it: σ_y0 times the strain after which 1/e is left.
    assert!((coarse / (1e4 * 0.1 * 0.02) - 1.0).abs() < 1e-3, "{coarse}");
}
