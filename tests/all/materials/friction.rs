//! Mohr-Coulomb and Tresca (`driver_mohr_coulomb_*.json`, `driver_tresca.json`).
use super::*;

fn mohr_coulomb(case: &Value, keys: &str) -> Box<dyn Material> {
    let tension = case["tension"].as_f64().map_or(String::new(), |t| format!(", tension_cutoff = {t:e}"));
    let dilation = case["psi_deg"].as_f64().unwrap_or(0.0);
    let keys = format!(
        ", friction_angle = {}, cohesion = {}, dilation_angle = {dilation}{tension}{keys}",
        case["phi_deg"], case["c"]
    );
    model("mohr_coulomb", case, &keys)
}

/// Returned stress and plastic strain of single steps.
fn check_returns(material: &dyn Material, rows: &Value) {
    for row in rows.as_array().unwrap() {
        let point = stretched(material, &row["eps_e_trial"], 0.0, |_| {});
        close_on_axes(&point.stress, &row["tau"], greatest(&row["tau_trial"]), row);
        close_on_axes(&elastic_strain(&point), &row["eps_e"], greatest(&row["eps_e_trial"]), row);
        let gained: f64 = numbers::<3>(&row["deps_p"]).iter().sum();
        let error = (point.history.get(PLASTIC_VOLUME).copied().unwrap_or(0.0) - gained).abs();
        assert!(error <= 1e-10 * greatest(&row["eps_e_trial"]), "{row}");
        assert!(point.work >= 0.0, "{row}");
    }
}

#[test]
fn mohr_coulomb_returns_to_faces_edges_and_apex() {
    for case in data("driver_mohr_coulomb_return.json")["cases"].as_array().unwrap() {
        check_returns(mohr_coulomb(case, ", volume_correction = false").as_ref(), &case["rows"]);
    }
}

#[test]
fn mohr_coulomb_returns_in_any_frame() {
    let data = data("driver_mohr_coulomb_return.json");
    for row in data["tensor_rows"].as_array().unwrap() {
        let case = &data["cases"][row["case"].as_u64().unwrap() as usize];
        let material = mohr_coulomb(case, "");
        let point = deformed(material.as_ref(), &matrix(&row["F"]));
        let expected = matrix(&row["tau"]);
        let scale = size(&expected).max(1e-3 * number(&case["E"]));
        assert!(difference(&full(&point.stress), &expected) <= 1e-10 * scale, "{row}");
    }
}

#[test]
fn mohr_coulomb_along_paths() {
    for case in data("driver_mohr_coulomb_paths.json")["cases"].as_array().unwrap() {
        let material = mohr_coulomb(case, ", volume_correction = false");
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
                }
            }
        }
    }
}

#[test]
fn mohr_coulomb_returns_radially() {
    for case in data("driver_mohr_coulomb_radial.json")["cases"].as_array().unwrap() {
        check_returns(
            mohr_coulomb(case, ", flow = 'radial', volume_correction = false").as_ref(),
            &case["rows"],
        );
    }
}

#[test]
fn tresca_returns_to_faces_and_edges() {
    for case in data("driver_tresca.json")["cases"].as_array().unwrap() {
        let material = model("tresca", case, &format!(", yield_stress = {}", case["sigma_y"]));
        check_returns(material.as_ref(), &case["rows"]);
    }
}

/// Volume that opens at the apex closes again before the material carries stress; dilation does not.
#[test]
fn volume_that_has_opened_is_given_back() {
    let elastic = serde_json::json!({"E": 1e7, "nu": 0.3});
    for dilation in [0, 10] {
        let keys = format!(", friction_angle = 30, dilation_angle = {dilation}");
        let material = model("mohr_coulomb", &elastic, &keys);
        let mut point = Point::new(material.as_ref());
        point.stretch([-1e-3; 3]);
        point.stretch([0.02, -0.02, 0.0]);
        let dilated = point.history[PLASTIC_VOLUME];
        assert!((dilated > 1e-3) == (dilation > 0), "{dilated}");
        let elastic_volume = elastic_strain(&point)[..3].iter().sum::<f64>();
        // Apart by 3 %, and back.
        point.stretch([0.01 - elastic_volume / 3.0; 3]);
        assert!((point.history[PLASTIC_VOLUME] - dilated - 0.03).abs() < 1e-12);
        assert!(point.stress.iter().all(|stress| stress.abs() < 1e-9));
        point.stretch([-0.0099; 3]);
        assert!(point.stress.iter().all(|stress| stress.abs() < 1e-9));
        point.stretch([-0.0011; 3]);
        let pressure = -point.stress[..3].iter().sum::<f64>() / 3.0;
        let bulk = 1e7 / 3.0 / (1.0 - 0.6);
        assert!((pressure - bulk * 0.003).abs() < 1e-6 * bulk, "{pressure}");
        assert!((point.history[PLASTIC_VOLUME] - dilated).abs() < 1e-12);
    }
}

fn cohesive(case: &Value, keys: &str) -> Box<dyn Material> {
    let tension = case["tension"].as_f64().map_or(String::new(), |t| format!(", tension_cutoff = {t:e}"));
    let matching = match case["match"].as_str().unwrap() {
        name if name.starts_with("plane_strain") => "plane_strain",
        name => name,
    };
    let keys = format!(
        ", friction_angle = {}, cohesion = {}, dilation_angle = {}, match = '{matching}'{tension}{keys}",
        case["phi_deg"], case["c"], case["psi_deg"]
    );
    model("drucker_prager", case, &keys)
}

#[test]
fn drucker_prager_returns_to_cone_apex_and_cut_off() {
    for case in data("driver_drucker_prager_cohesive.json")["cases"].as_array().unwrap() {
        check_returns(cohesive(case, ", volume_correction = false").as_ref(), &case["rows"]);
    }
}

#[test]
fn cohesive_drucker_prager_along_paths() {
    for case in data("driver_drucker_prager_cohesive.json")["cases"].as_array().unwrap() {
        let material = cohesive(case, ", volume_correction = false");
        for path in case["paths"].as_array().unwrap() {
            for steps in [1, 20] {
                let mut point = Point::new(material.as_ref());
                let mut last = [0.0; 3];
                for strain in path["eps_points"].as_array().unwrap() {
                    stretch_to(&mut point, last, numbers(strain), steps);
                    last = numbers(strain);
                }
                close_on_axes(&point.stress, &path["tau_end"], 10.0 * greatest(&path["tau_end"]), path);
            }
        }
    }
}
