//! Tangents of all models against differences of their own updates.
use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::material::driver::{Matrix, Point};
use crate::material::undrained::{self, Undrained};
use crate::material::{Material, Parameters};

/// Principal strains of increments from the undeformed state, in axes that are turned by an angle (radians).
const STATES: [(&str, [f64; 3], f64); 18] = [
    ("undeformed", [0.0; 3], 0.0),
    ("small", [2e-4, -1e-4, 3e-5], 0.3),
    ("along the axes", [0.012, -0.02, 0.003], 0.0),
    ("turned", [0.012, -0.02, 0.003], 0.7),
    ("two equal, small", [-3e-4, 1e-4, 1e-4], 0.4),
    ("two equal, shear", [0.023, -0.012, -0.012], 0.4),
    ("two equal, compression", [-0.04, 0.001, 0.001], 0.4),
    ("two nearly equal", [0.023, -0.012, -0.012 + 1e-9], 0.4),
    ("two equal along the axes", [-0.05, -0.05, -0.01], 0.0),
    ("compressed evenly", [-0.03; 3], 0.2),
    ("stretched evenly", [0.02; 3], 0.2),
    ("large compression", [-0.4, -0.1, -0.25], 0.9),
    ("large shear", [0.5, -0.45, -0.1], 0.5),
    ("large tension", [0.3, 0.6, 0.05], 1.1),
    ("sheared under pressure", [-0.03, -0.05, -0.004], 0.6),
    ("compressed along one axis", [-0.06, 0.0, 0.0], 0.3),
    ("sheared under tension", [0.03, 0.01, -0.005], 0.8),
    ("apart", [0.05, 0.045, 0.04], 0.3),
];

/// A share of the modulus of pressure waves. Rounding of b (4e-15) over the step of the differences (1e-6)
/// makes 6e-9 at most; the deviator of 1e-10 that states without one get, over strains of 0.01, as much.
const TOLERANCE: f64 = 3e-8;

/// The increment with these principal strains.
fn increment(strain: [f64; 3], angle: f64) -> Matrix {
    let turned = Rotation3::from_scaled_axis(Vector3::new(0.6, 1.0, -0.4).normalize() * angle);
    let stretch = Matrix3::from_diagonal(&Vector3::from(strain.map(libm::exp)));
    let increment = turned.matrix() * stretch * turned.matrix().transpose();
    std::array::from_fn(|i| std::array::from_fn(|j| increment[(i, j)]))
}

/// Whether the stress of a model has no derivative in a state: it stands at a corner of its law.
fn is_corner(model: &str, state: &str) -> bool {
    let has = |word: &str| model.contains(word);
    let has_two = state.starts_with("two") || state == "compressed along one axis";
    match state {
        // Grains without cohesion and fluids without tension come apart; clay is at its preconsolidation.
        "undeformed" => {
            let is_dry = (has("drucker_prager") || has("mohr_coulomb")) && !has("cohesion");
            let is_consolidated = has("pressure = 1e4, preconsolidation_pressure = 1e4");
            // Under pressure the second derivative is another.
            let is_shocked = has("eos");
            is_dry || has("mu_i") || is_consolidated || is_shocked || (has("'fluid'") && !has("tension"))
        }
        // The greatest of three equal stresses cracks; the strength that is left at an apex falls with the
        // norm of the shear.
        "stretched evenly" => has("rankine") || ((has("mohr") || has("drucker")) && has("hardening")),
        // The deviator shrinks to an edge, instead of along it.
        _ => has_two && has("radial"),
    }
}

fn point<'a>(material: &'a dyn Material, strain: [f64; 3], angle: f64) -> Point<'a> {
    let mut point = Point::new(material);
    (point.dt, point.size, point.cell) = (1e-3, 0.1, 0.1);
    point.deform(&increment(strain, angle));
    point
}

/// Of every example in every state, elastic, at faces, edges and tips of its surface of yield; and again from
/// there, with what the history then holds.
#[test]
fn tangents_are_derivatives_of_the_stress() {
    let (mut elastic, mut flows, mut wrong) = (0, 0, Vec::new());
    let mut worst = 0.0_f64;
    for text in Parameters::examples() {
        let material = text.parse::<Parameters>().expect("an example").build(1000.0);
        for (state, strain, angle) in STATES {
            // Beside a corner.
            let beside = if is_corner(text, state) { [3e-4, -1e-4, -3e-4] } else { [0.0; 3] };
            let mut point = point(material.as_ref(), std::array::from_fn(|k| strain[k] + beside[k]), angle);
            let mut agrees = |point: &Point, what: &str| {
                let error = point.tangent_error();
                worst = worst.max(error);
                if error.is_nan() || error > TOLERANCE {
                    wrong.push(format!("{error:e} {state}, {what}: {text}"));
                }
                *if point.work > 0.0 { &mut flows } else { &mut elastic } += 1;
            };
            agrees(&point, "first step");
            point.deform(&increment([0.004, -0.006, -0.0011], 0.5));
            agrees(&point, "second step");
        }
    }
    println!("{elastic} elastic, {flows} that flow, at most {worst:e}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(elastic > 300 && flows > 500, "{elastic} elastic, {flows} that flow");
}

/// With water that cannot leave the pores.
#[test]
fn water_in_the_pores_stiffens_the_tangent() {
    let water = Undrained { bulk_modulus: 1e7, porosity: 0.4 };
    let mut count = 0;
    for text in Parameters::examples() {
        let parameters = text.parse::<Parameters>().expect("an example");
        if Undrained::check_model(&parameters).is_err() {
            continue;
        }
        let material = undrained::build(&parameters, Some(&water), 1000.0);
        for (state, strain, angle) in STATES {
            if is_corner(text, state) {
                continue;
            }
            let error = point(material.as_ref(), strain, angle).tangent_error();
            assert!(error <= TOLERANCE, "{error:e} {state}: {text}");
            count += 1;
        }
    }
    assert!(count > 200, "{count}");
}

/// Elastic moduli of the undeformed material, and the uniaxial stress by Newton's method.
#[test]
fn small_strains_have_the_moduli_of_elasticity() {
    for model in ["neo_hookean", "fixed_corotated", "hencky"] {
        let text = format!("model = '{model}', young = 1e6, poisson = 0.3");
        let material = text.parse::<Parameters>().unwrap().build(1000.0);
        let matrix = Point::new(material.as_ref()).tangent();
        let (mu, lambda) = (1e6 / 2.6, 3e5 / (1.3 * 0.4));
        for (r, row) in matrix.iter().enumerate() {
            for (c, entry) in row.iter().enumerate() {
                let exact = match (r == c, r < 3 && c < 3) {
                    (true, true) => lambda + 2.0 * mu,
                    (false, true) => lambda,
                    (true, false) => mu,
                    (false, false) => 0.0,
                };
                assert!((entry - exact).abs() < 1e-9 * 1e6, "{model} {r} {c}: {entry} {exact}");
            }
        }
    }
}

/// The tangent is symmetric where the law is associated, and only there.
#[test]
fn associated_laws_have_symmetric_tangents() {
    let asymmetry = |text: &str| {
        let material = text.parse::<Parameters>().unwrap().build(1000.0);
        let point = point(material.as_ref(), [0.02, -0.05, -0.004], 0.6);
        assert!(point.work > 0.0 || text.contains("hencky"), "{text}");
        let matrix = point.tangent();
        let pairs = (0..6).flat_map(|r| (0..6).map(move |c| (r, c)));
        pairs.fold(0.0_f64, |most, (r, c)| most.max((matrix[r][c] - matrix[c][r]).abs())) / 1e6
    };
    let soil = "model = 'mohr_coulomb', young = 1e6, poisson = 0.3, friction_angle = 30, cohesion = 1e3";
    for text in [
        "model = 'hencky', young = 1e6, poisson = 0.3",
        "model = 'von_mises', young = 1e6, poisson = 0.3, yield_stress = 1e3, hardening = 1e5",
        "model = 'tresca', young = 1e6, poisson = 0.3, yield_stress = 1e3",
        &format!("{soil}, dilation_angle = 30"),
    ] {
        assert!(asymmetry(text) < 1e-12, "{}: {text}", asymmetry(text));
    }
    assert!(asymmetry(&format!("{soil}, dilation_angle = 5")) > 1e-3);
}
