//! A manufactured motion of a body of revolution: forces that make a given motion exact, by which errors converge
//! with second order, on equal and on refined cells.
use std::collections::HashMap;
use std::f64::consts::PI;

use crate::axisymmetry::solver;
use crate::common::scenarios::{Scenario, alone};
use agimp::particle::chunk::Layout;
use agimp::solver::Requests;
use partition::Comm;

pub(crate) const SCENARIOS: &[(&str, Scenario)] = &[("manufactured_rings", manufactured)];

#[test]
fn a_manufactured_motion_converges_with_second_order() {
    alone("manufactured_rings");
}

/// Amplitudes (m) and angular frequency (1/s) of the motion of a cylinder of radius and height 1 m between walls:
/// `r = R + A R (1 - R²) sin(πZ) sin ωt`, `z = Z + B (1 - R²) sin(2πZ) sin ωt`.
const AMPLITUDES: [f64; 2] = [0.1, 0.06];
const OMEGA: f64 = 40.0 * PI;
/// Young's modulus (Pa), Poisson's ratio, density (kg/m³); neo-Hookean, `P = μ (F - F⁻ᵀ) + λ ln J F⁻ᵀ`.
const MATERIAL: [f64; 3] = [1e6, 0.3, 1000.0];

/// Accelerations that make the motion exact, as expressions: that of the material less `Div P / ρ`. By Piola's
/// identity `Div P = μ Δx + (λ (1 - ln J) + μ) F⁻ᵀ ∇ ln J`, in cylindrical coordinates.
fn accelerations() -> [String; 2] {
    let [a, b] = AMPLITUDES;
    let [young, nu, density] = MATERIAL;
    let mu = 0.5 * young / (1.0 + nu) / density;
    let lambda = young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)) / density;
    let (q, t) = ("(1 - X^2)", format!("sin({OMEGA}*t)"));
    let (s, c, s2, c2) = ("sin(pi*Y)", "cos(pi*Y)", "sin(2*pi*Y)", "cos(2*pi*Y)");
    // F and its gradients: rr is ∂r/∂R, rz ∂r/∂Z, rrr ∂²r/∂R² and so on; h is r/R.
    let rr = format!("(1 + {a}*(1 - 3*X^2)*{s}*{t})");
    let rz = format!("({a}*pi*X*{q}*{c}*{t})");
    let zr = format!("(-2*{b}*X*{s2}*{t})");
    let zz = format!("(1 + 2*{b}*pi*{q}*{c2}*{t})");
    let h = format!("(1 + {a}*{q}*{s}*{t})");
    let rrr = format!("(-6*{a}*X*{s}*{t})");
    let rrz = format!("({a}*pi*(1 - 3*X^2)*{c}*{t})");
    let rzz = format!("(-{a}*pi^2*X*{q}*{s}*{t})");
    let zrr = format!("(-2*{b}*{s2}*{t})");
    let zrz = format!("(-4*{b}*pi*X*{c2}*{t})");
    let zzz = format!("(-4*{b}*pi^2*{q}*{s2}*{t})");
    let det = format!("({rr}*{zz} - {rz}*{zr})");
    let along_r =
        format!("(({rrr}*{zz} + {rr}*{zrz} - {rrz}*{zr} - {rz}*{zrr})/{det} - 2*{a}*X*{s}*{t}/{h})");
    let along_z =
        format!("(({rrz}*{zz} + {rr}*{zzz} - {rzz}*{zr} - {rz}*{zrz})/{det} + {a}*pi*{q}*{c}*{t}/{h})");
    let factor = format!("({lambda}*(1 - ln({det}*{h})) + {mu})/{det}");
    let square = OMEGA * OMEGA;
    [
        format!(
            "-{square}*{a}*X*{q}*{s}*{t} - {mu}*(-8*{a}*X*{s}*{t} + {rzz}) - {factor}*({zz}*{along_r} - {zr}*{along_z})"
        ),
        format!(
            "-{square}*{b}*{q}*{s2}*{t} - {mu}*(-4*{b}*{s2}*{t} + {zzz}) - {factor}*({rr}*{along_z} - {rz}*{along_r})"
        ),
    ]
}

/// Greatest distance of a particle from its exact place in half a period, over A, with so many cells across the body;
/// or with half as wide ones in a quarter of it as well.
fn error(comm: &Comm, cells: u32, is_refined: bool) -> f64 {
    type L = Layout<2>;
    let ([a, b], [young, nu, density]) = (AMPLITUDES, MATERIAL);
    let [radial, axial] = accelerations();
    let tree = match is_refined {
        true => {
            "[tree]\nregions = [{ level = 1, shape = { kind = 'box', min = [0, 0], max = [0.5, 0.5] } }]\n"
        }
        false => "",
    };
    let text = format!(
        "version = 1\ndimension = 2\ngeometry = 'axisymmetric'\n\
         [domain]\nsize = [1, 1]\nroot_edge = {}\n{tree}\
         [boundaries]\nx_max.kind = 'sticky'\ny_min.kind = 'sticky'\ny_max.kind = 'sticky'\n\
         [[materials]]\nname = 'rubber'\ndensity = {density}\nmodel = 'neo_hookean'\nyoung = {young}\npoisson = {nu}\n\
         [[bodies]]\nname = 'body'\nmaterial = 'rubber'\nshape = {{ kind = 'box', min = [0, 0], max = [1, 1] }}\n\
         velocity = ['{OMEGA}*{a}*x*(1 - x^2)*sin(pi*y)', '{OMEGA}*{b}*(1 - x^2)*sin(2*pi*y)']\n\
         [[loads]]\nname = 'force'\nkind = 'body_force'\nacceleration = [\"{radial}\", \"{axial}\"]\n\
         [numerics]\ntransfer = 'flip'\n[time]\nend = 0.025\ncfl = 0.2\n[output]\npicture = false\n",
        4.0 / f64::from(cells)
    );
    let mut solver = solver(comm, &text);
    let mut first: HashMap<u64, [f64; 2]> = HashMap::new();
    for chunk in &solver.chunks {
        first.extend((0..chunk.len()).map(|p| (chunk.ids()[p], chunk.position(p))));
    }
    let mut worst = 0.0_f64;
    while solver.clock.time < 0.025 {
        solver.step(0.025, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
        let now = libm::sin(OMEGA * solver.clock.time);
        for chunk in &solver.chunks {
            for p in 0..chunk.len() {
                let [x, y] = first[&chunk.ids()[p]];
                let exact = [
                    x + a * x * (1.0 - x * x) * libm::sin(PI * y) * now,
                    y + b * (1.0 - x * x) * libm::sin(2.0 * PI * y) * now,
                ];
                let found: [f64; 2] = chunk.read(L::POSITION, p);
                worst = worst.max((found[0] - exact[0]).hypot(found[1] - exact[1]));
            }
        }
    }
    worst / a
}

fn manufactured(comm: &Comm) {
    for is_refined in [false, true] {
        let [coarse, fine] = [8, 16].map(|cells| error(comm, cells, is_refined));
        let order = (coarse / fine).log2();
        println!("refined {is_refined}: {coarse:.3e}, {fine:.3e}, order {order:.2}");
        assert!(order > 1.8, "refined {is_refined}: {coarse}, {fine}");
    }
}
