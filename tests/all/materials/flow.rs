//! Dense granular flow, fluids and Bingham flow (`driver_mu_i.json`, `driver_fluid.json`,
//! `driver_perzyna.json`).
use super::*;

fn grains(case: &Value) -> Box<dyn Material> {
    let keys = format!(
        ", static_friction = {}, limit_friction = {}, inertial_number = {}, grain_diameter = {}, grain_density = {}",
        case["mu_s"], case["mu_2"], case["I0"], case["d"], case["rho_s"]
    );
    model("mu_i", case, &keys)
}

#[test]
fn granular_flow_in_one_step() {
    for case in data("driver_mu_i.json")["cases"].as_array().unwrap() {
        let material = grains(case);
        for row in case["returns"].as_array().unwrap() {
            let point = stretched(material.as_ref(), &row["eps_e_trial"], number(&row["dt"]), |_| {});
            close_on_axes(&point.stress, &row["tau"], greatest(&row["tau_trial"]), row);
            close_on_axes(&elastic_strain(&point), &row["eps_e"], greatest(&row["eps_e_trial"]), row);
            assert!(point.work >= 0.0);
        }
    }
}

/// Pure shear under constant pressure at six inertial numbers: the steady shear stress is μ(I) p.
#[test]
fn granular_flow_in_steady_shear() {
    for case in data("driver_mu_i.json")["cases"].as_array().unwrap() {
        let material = grains(case);
        let bulk = number(&case["E"]) / 3.0 / (1.0 - 2.0 * number(&case["nu"]));
        for row in case["steady_plane_shear"].as_array().unwrap() {
            let mut point = Point::new(material.as_ref());
            point.stretch([-number(&case["p"]) / (3.0 * bulk); 3]);
            let (steps, strain) = (4000, 0.5);
            point.dt = 2.0 * strain / number(&row["shear_rate"]) / f64::from(steps);
            stretch_to(&mut point, [0.0; 3], [strain, -strain, 0.0], steps);
            close_on_axes(&point.stress, &row["pure_shear_tau"], 100.0 * number(&case["p"]), row);
        }
    }
}

/// From rest: the limit of small steps follows the exact start.
#[test]
fn granular_flow_starts() {
    for case in data("driver_mu_i.json")["cases"].as_array().unwrap() {
        let material = grains(case);
        let pressure = number(&case["p"]);
        let bulk = number(&case["E"]) / 3.0 / (1.0 - 2.0 * number(&case["nu"]));
        for start in case["startup_pure_shear"]["cases"].as_array().unwrap() {
            let rows = start["rows"].as_array().unwrap();
            let run = |steps: u32| {
                let volume = -pressure / (3.0 * bulk);
                let mut point = Point::new(material.as_ref());
                point.stretch([volume; 3]);
                let (mut last, mut time) = ([volume; 3], 0.0);
                let mut results = Vec::new();
                for row in rows {
                    let (strain, end) = (numbers(&row["eps_log"]), number(&row["t"]));
                    point.dt = (end - time) / f64::from(steps);
                    stretch_to(&mut point, last, strain, steps);
                    (last, time) = (strain, end);
                    results.push(point.stress[0]);
                }
                results
            };
            let (coarse, fine) = (run(200), run(400));
            for (i, row) in rows.iter().enumerate() {
                let limit = 2.0 * fine[i] - coarse[i];
                assert!((limit - number(&row["tau"][0])).abs() <= 1e-4 * pressure, "{limit} {row}");
            }
        }
    }
}

fn fluid(keys: &str) -> Box<dyn Material> {
    format!("model = 'fluid', {keys}").parse::<Parameters>().unwrap().build(1000.0)
}

#[test]
fn fluids_follow_tait() {
    for row in data("driver_fluid.json")["rows"].as_array().unwrap() {
        let keys = format!("bulk_modulus = {}, gamma = {}, tension = true", row["K"], row["gamma"]);
        let material = fluid(&keys);
        let mut point = Point::new(material.as_ref());
        let volume = number(&row["J"]);
        point.stretch([volume.ln() / 3.0; 3]);
        let pressure = -(point.stress[0] + point.stress[1] + point.stress[2]) / 3.0 / volume;
        let error = (pressure - number(&row["p"])).abs();
        assert!(error <= 1e-10 * number(&row["p"]).abs().max(1e-3 * number(&row["K"])), "{pressure} {row}");
        // Whatever shear came before.
        point.deform(&[[1.0, 3.0, 0.5], [0.0, 1.0, 0.0], [0.0, 0.2, 1.0]]);
        let after = -(point.stress[0] + point.stress[1] + point.stress[2]) / 3.0 / volume;
        assert!(
            (after - pressure).abs() <= 1e-9 * pressure.abs().max(1e-3 * number(&row["K"])),
            "{after} {row}"
        );
    }
}

/// Plane Couette flow: the shear stress is viscosity times rate, from the first step on.
#[test]
fn fluids_between_plates() {
    let material = fluid("bulk_modulus = 1e6, viscosity = 0.3");
    let mut point = Point::new(material.as_ref());
    (point.dt, point.cell) = (1e-4, 0.01);
    let rate = 2.0;
    for _ in 0..100 {
        point.deform(&[[1.0, rate * point.dt, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        // A finite step of shear is not quite one of strain.
        assert!((point.stress[3] - 0.3 * rate).abs() < 1e-3 * rate * point.dt, "{:?}", point.stress);
    }
    assert!((point.history[0] - 0.02).abs() < 1e-9, "strain {}", point.history[0]);
    assert!((point.work - 0.3 * rate * rate * 0.01).abs() < 1e-9, "work {}", point.work);
    // Waves at 31.6 m/s, and as if faster by 8 ν / (3 h).
    let speed = (1e6_f64 / 1000.0).sqrt() + 8.0 / 3.0 * 0.3 / 1000.0 / 0.01;
    assert!((point.wave_speed - speed).abs() < 1e-9 * speed, "{}", point.wave_speed);
}

#[test]
fn fluids_without_tension_part() {
    let material = fluid("bulk_modulus = 1e6");
    let mut point = Point::new(material.as_ref());
    point.stretch([0.01; 3]);
    assert_eq!(point.stress, [0.0; 6]);
    assert_eq!(point.energy(), 0.0);
    point.stretch([-0.011; 3]);
    let pressure = 1e6 / 7.0 * ((0.021_f64).exp() - 1.0);
    assert!((point.stress[0] / (-0.003_f64).exp() + pressure).abs() < 1e-6 * pressure, "{:?}", point.stress);
}

/// Bingham and Herschel-Bulkley between plates: steady simple shear of von Mises with overstress, up to the
/// elastic strain.
#[test]
fn bingham_flow_between_plates() {
    for case in data("driver_perzyna.json")["cases"].as_array().unwrap() {
        let keys = format!(
            ", yield_stress = {}, viscosity = {}, rate_exponent = {}",
            case["sigma_y"], case["eta"], case["h"]
        );
        let material = model("von_mises", case, &keys);
        let modulus = number(&case["E"]) / (2.0 + 2.0 * number(&case["nu"]));
        for row in case["steady"]["rows"].as_array().unwrap() {
            let rate = number(&row["shear_rate"]);
            let run = |steps: u32| {
                let mut point = Point::new(material.as_ref());
                let expected = number(&row["simple_shear"]["tau_xy"]);
                let strain = 60.0 * expected / modulus;
                point.dt = strain / rate / f64::from(steps);
                for _ in 0..steps {
                    point.deform(&[[1.0, rate * point.dt, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
                }
                point.stress[3]
            };
            let limit = 2.0 * run(8000) - run(4000);
            let expected = number(&row["simple_shear"]["tau_xy"]);
            assert!((limit - expected).abs() <= 1e-5 * expected, "{limit} {row}");
        }
    }
}
