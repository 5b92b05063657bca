//! Claim: bodies of revolution agree with closed forms: disks and rings that rotate, thin and between smooth
//! plates, and breathing of hollow spheres, cylinders and thin disks.
use crate::axisymmetry::{history, job, period};

/// Density times the square of the angular velocity, kg/(m³ s²), Young's modulus, Pa, and Poisson's ratio.
const ROTATION: (f64, f64, f64) = (4000.0, 1e7, 0.3);

/// A body of outer radius 1 m and inner radius `a` that rotates, with free faces or between smooth plates:
/// radial and hoop stress (Pa) and displacement (m) at r.
fn rotating(a: f64, is_thin: bool, r: f64) -> [f64; 3] {
    let (q, young, nu) = ROTATION;
    let (young, nu) = if is_thin { (young, nu) } else { (young / (1.0 - nu * nu), nu / (1.0 - nu)) };
    let c = (3.0 + nu) / 8.0 * q;
    let (inner, hoop) = (a * a * (1.0 - 1.0 / (r * r)), a * a * (1.0 + 1.0 / (r * r)));
    let radial = c * (1.0 - r * r + inner);
    let hoop = c * (1.0 - (1.0 + 3.0 * nu) / (3.0 + nu) * r * r + hoop);
    [radial, hoop, r / young * (hoop - nu * radial)]
}

/// A disk and a ring, 32 cells over the outer radius; thin ones have two cells over half of their thickness.
/// Stresses differ by the share of the greatest.
#[test]
fn disks_and_rings_in_rotation_have_the_stresses_of_the_closed_form() {
    // Rows of an independent table: hole, whether it is thin, radius, stresses, displacement.
    let table = [
        (0.0, false, 0.3, [1560.0, 1_611.428_571_428_571_6, 2.574e-5]),
        (0.0, true, 0.5, [1237.5, 1412.5, 5.206_25e-5]),
        (0.5, false, 1.0, [0.0, 1_428.571_428_571_428_5, 0.000_13]),
        (0.5, true, 0.5, [0.0, 3475.0, 0.000_173_75]),
    ];
    for (a, is_thin, r, row) in table {
        let found = rotating(a, is_thin, r);
        let is_equal =
            found.iter().zip(row).all(|(found, row)| (found - row).abs() < 1e-9 * row.abs().max(1e-3));
        assert!(is_equal, "{found:?} for {row:?}");
    }
    for (a, is_thin) in [(0.0, false), (0.0, true), (0.5, false), (0.5, true)] {
        let height = if is_thin { 0.0625 } else { 0.125 };
        // Cells: their two columns of particles, h/4 to each side.
        let places: Vec<f64> =
            [a, a + 0.25, f64::min(a + 0.5, 0.875), 31.0 / 32.0].map(|r| r + 1.0 / 64.0).to_vec();
        let probes: String = places
            .iter()
            .enumerate()
            .map(|(i, r)| {
                let (low, high) = (r - 0.01, r + 0.01);
                format!(
                    "[[probes]]\nname = 'p{i}'\nquantities = ['centre', 'stress']\n\
                     shape = {{ kind = 'box', min = [{low}, 0], max = [{high}, 0.125] }}\n"
                )
            })
            .collect();
        let text = job(
            [1.25, 0.125],
            &format!(
                "[[bodies]]\nname = 'disk'\nmaterial = 'rubber'\n\
                 shape = {{ kind = 'box', min = [{a}, 0], max = [1, {height}] }}\n\
                 [[loads]]\nname = 'rotation'\nkind = 'body_force'\nacceleration = ['2^2 * X', 0]\n\
                 {probes}[quasi_static]\nstep = 1\n[time]\nend = 1\n[history]\nevery_steps = 1\n"
            ),
        );
        let text = text.replace("root_edge = 0.5", "root_edge = 0.125").replace("young = 1e6", "young = 1e7");
        let found = history("disk", &text);
        let greatest = rotating(a, is_thin, a.max(1e-3))[1];
        for (i, &r) in places.iter().enumerate() {
            let sides = [r - 1.0 / 128.0, r + 1.0 / 128.0];
            let [inner, outer] = sides.map(|r| rotating(a, is_thin, r));
            let mean = |k: usize| (sides[0] * inner[k] + sides[1] * outer[k]) / (2.0 * r);
            let exact = [mean(0), mean(1), mean(2)];
            let stress = ["xx", "zz"].map(|component| found.last(&format!("stress_p{i}_{component}")));
            let way = found.column(&format!("centre_p{i}_x"));
            let off = [
                (stress[0] - exact[0]) / greatest,
                (stress[1] - exact[1]) / greatest,
                (way[way.len() - 1] - way[0]) / exact[2] - 1.0,
            ];
            println!(
                "a {a}, thin {is_thin}, r {r:.3}: stresses off by {:+.2} and {:+.2} %, displacement {:+.2} %",
                100.0 * off[0],
                100.0 * off[1],
                100.0 * off[2]
            );
            assert!(off[0].abs() < 0.01 && off[1].abs() < 0.01 && off[2].abs() < 0.01, "{off:?}");
        }
    }
}

/// First breathing mode of a body of the outer radius 1 m and the inner radius 0.5 m, which is a sphere (`angles`
/// 2) or a cylinder (1), at radius s, as a parabola: from the inner wall, where there is no stress, by Runge and
/// Kutta's method. `k` is the wave number, `ratio` the one of lateral to radial stiffness.
fn mode(angles: f64, k: f64, ratio: f64) -> String {
    let steps = 200;
    let h = 0.5 / f64::from(steps);
    let change = |r: f64, [u, slope]: [f64; 2]| [slope, -angles * slope / r + (angles / (r * r) - k * k) * u];
    let ahead = |at: [f64; 2], by: f64, rate: [f64; 2]| [at[0] + by * rate[0], at[1] + by * rate[1]];
    let mut at = [1.0, -angles * ratio / 0.5];
    let mut values = vec![at[0]];
    for i in 0..steps {
        let r = 0.5 + h * f64::from(i);
        let a = change(r, at);
        let b = change(r + 0.5 * h, ahead(at, 0.5 * h, a));
        let c = change(r + 0.5 * h, ahead(at, 0.5 * h, b));
        let d = change(r + h, ahead(at, h, c));
        at = std::array::from_fn(|i| at[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        values.push(at[0]);
    }
    // The outer wall has no stress, as the wave number is that of a mode.
    assert!((at[1] + angles * ratio * at[0]).abs() < 1e-6, "{at:?}");
    let (inner, middle, outer) = (values[0], values[steps as usize / 2], values[steps as usize]);
    let [first, second] = [middle - inner, outer - middle].map(|change| change / 0.25);
    format!("({inner} + (S - 0.5) * ({first} + (S - 0.75) * {}))", (second - first) / 0.5)
}

/// Roots of the equations of free surfaces, ν = 0.3, R = 1 m, 32 cells over the outer radius.
#[test]
fn hollow_and_thin_bodies_breathe_with_their_periods() {
    let nu = 0.3;
    let (solid_speed, thin_speed) = (36.689_969_285_267_14, 33.149_677_206_589_79);
    let lateral = nu / (1.0 - nu);
    let sphere = "{ kind = 'difference', from = { kind = 'intersection', parts = [{ kind = 'box', min = [0, 0], max = [1, 1] }, \
        { kind = 'circle', centre = [0, 0], radius = 1 }] }, remove = [{ kind = 'circle', centre = [0, 0], radius = 0.5 }] }";
    let square = "((2.0488502036421266 * x)^2)";
    let bessel = format!("(1 - {square}/8 + {square}^2/192 - {square}^3/9216 + {square}^4/737280)");
    let bodies = [
        ("hollow sphere", 2.0206791864918694, solid_speed, sphere, mode(2.0, 2.0206791864918694, lateral)),
        (
            "tube",
            1.2665266542352092,
            solid_speed,
            "{ kind = 'box', min = [0.5, 0], max = [1, 0.5] }",
            mode(1.0, 1.2665266542352092, lateral),
        ),
        (
            "thin ring",
            1.3232500939074279,
            thin_speed,
            "{ kind = 'box', min = [0.5, 0], max = [1, 0.0625] }",
            mode(1.0, 1.3232500939074279, nu),
        ),
        (
            "thin disk",
            2.0488502036421266,
            thin_speed,
            "{ kind = 'box', min = [0, 0], max = [1, 0.0625] }",
            format!("x * {bessel}"),
        ),
    ];
    for (name, k, speed, shape, mode) in bodies {
        let exact = std::f64::consts::TAU / (k * speed);
        let (velocity, size) = match name {
            "hollow sphere" => {
                let mode = mode.replace('S', "sqrt(x^2 + y^2)");
                (
                    format!("['0.1 * x / sqrt(x^2 + y^2) * {mode}', '0.1 * y / sqrt(x^2 + y^2) * {mode}']"),
                    [1.5, 1.5],
                )
            }
            _ => (format!("['0.1 * {}', 0]", mode.replace('S', "x")), [1.5, 0.5]),
        };
        let body = format!(
            "[tree]\nbase_level = 2\n[[bodies]]\nname = 'body'\nmaterial = 'rubber'\nsampling = 'fitted'\n\
             shape = {shape}\nvelocity = {velocity}\n[time]\nend = {}\n[history]\nevery_steps = 1\n",
            2.8 * exact
        );
        let found = period(&history("body", &job(size, &body)));
        println!("{name}: {found} s, exact {exact} s, {:+.2e}", found / exact - 1.0);
        assert!((found / exact - 1.0).abs() < 0.005, "{name}: {found} for {exact}");
    }
}
