//! Colliders that act on particles: blocks on inclines, in narrow slots and on sheets without thickness,
//! cylinders between plates and rolling, by their closed forms; momentum to round-off; same bits on any ranks
//! and across restarts.

use crate::common::history::History;
use crate::common::launch::{run, succeed};
use crate::common::restart;

/// Common part of all jobs here; all faces let slip.
fn head(dimension: usize, gravity: &str, size: &str, root_edge: f64, level: u32) -> String {
    let faces: String = ["x", "y", "z"][..dimension]
        .iter()
        .map(|axis| format!("{axis}_min.kind = 'slip'\n{axis}_max.kind = 'slip'\n"))
        .collect();
    format!(
        "version = 1\ndimension = {dimension}\ngravity = {gravity}\n[boundaries]\n{faces}\
         [domain]\nsize = {size}\nroot_edge = {root_edge}\n[tree]\nbase_level = {level}\n\
         [output]\npicture = false\n[history]\nevery_steps = 5\nface_forces = true\n"
    )
}

/// An elastic body of 1000 kg/m³ with probes of its centre and extent.
fn elastic(young: f64, shape: &str) -> String {
    format!(
        "[[materials]]\nname = 'rubber'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = {young}\npoisson = 0.2\n\
         [[bodies]]\nname = 'body'\nmaterial = 'rubber'\nshape = {shape}\n\
         [[probes]]\nname = 'body'\nbodies = ['body']\nquantities = ['centre', 'velocity', 'extent']\n"
    )
}

/// Runs a job on one rank in a directory with some files.
fn history_with(job: &str, files: &[(&str, String)]) -> History {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("body.toml");
    std::fs::write(&path, job).expect("job");
    files.iter().for_each(|(name, text)| std::fs::write(directory.path().join(name), text).expect("file"));
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    History::read(directory.path(), "body")
}

fn history(job: &str) -> History {
    history_with(job, &[])
}

/// Distance of the centre of the body from where it was, along a direction, in each row.
fn way(history: &History, direction: &[f64]) -> Vec<f64> {
    let axes = ["x", "y", "z"];
    let columns: Vec<&[f64]> =
        (0..direction.len()).map(|a| history.column(&format!("centre_body_{}", axes[a]))).collect();
    (0..columns[0].len())
        .map(|row| columns.iter().zip(direction).map(|(x, d)| d * (x[row] - x[0])).sum())
        .collect()
}

/// Ways to incline a block by 30 degrees: gravity that turns, or a surface that does.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Incline {
    Face,
    HalfSpace,
    Mesh,
    Terrain,
}

const ANGLE: f64 = std::f64::consts::FRAC_PI_6;

/// A flat wedge below a plane that falls by 30 degrees along x from the height 0.6 m at x = 0.2 m, as a
/// closed mesh in OBJ.
fn wedge() -> String {
    let height = |x: f64| 0.6 - (x - 0.2) * ANGLE.tan();
    let mut text = String::new();
    for (x, z) in [(-0.5, -1.5), (2.0, -1.5), (2.0, height(2.0)), (-0.5, height(-0.5))] {
        for y in [-0.5, 1.0] {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    text + "f 1 3 4 2\nf 3 5 6 4\nf 5 7 8 6\nf 7 1 2 8\nf 1 7 5 3\nf 2 4 6 8\n"
}

/// The same plane as heights.
fn slope() -> String {
    let row: Vec<String> =
        (0..26).map(|i| format!("{:.17}", 0.6 - (-0.5 + 0.1 * f64::from(i) - 0.2) * ANGLE.tan())).collect();
    format!(
        "ncols 26\nnrows 16\nxllcenter -0.5\nyllcenter -0.5\ncellsize 0.1\n{}",
        vec![row.join(" "); 16].join("\n")
    )
}

/// Time over which the part of gravity along the incline grows, s: at once, it would set off waves that
/// unload the block here and there.
const RAMP: f64 = 0.1;

/// A block slides down an incline, after it has come to rest under the part of gravity across the incline.
/// Returns history, direction down the slope and normal.
fn slide(dimension: usize, on: Incline, friction: f64) -> (History, Vec<f64>, Vec<f64>) {
    let (sine, cosine) = ANGLE.sin_cos();
    let last = dimension - 1;
    let vector = |along: f64, across: f64| -> Vec<f64> {
        (0..dimension)
            .map(|a| {
                if a == 0 {
                    along
                } else if a == last {
                    across
                } else {
                    0.0
                }
            })
            .collect()
    };
    let (down, normal) = match on {
        Incline::Face => (vector(1.0, 0.0), vector(0.0, 1.0)),
        _ => (vector(cosine, -sine), vector(sine, cosine)),
    };
    let pressing: Vec<f64> = normal.iter().map(|n| -9.81 * cosine * n).collect();
    let growing = |(p, d): (&f64, &f64)| format!("'{p} + {} * min(t / {RAMP}, 1)'", 9.81 * sine * d);
    let whole: Vec<String> = pressing.iter().zip(&down).map(growing).collect();
    let whole = whole.join(", ");
    // Waves that are left unload the block the less the faster they are; close to the angle of friction that
    // counts.
    let young = if friction == 0.5 { 1e8 } else { 1e7 };
    let (size, min, max, centre) = match dimension {
        2 => ("[1.6, 0.8]", "[0.2, 0.6]", "[0.5, 0.7]", "[0.2, 0.6]"),
        _ => ("[1.6, 0.4, 0.8]", "[0.2, 0.1, 0.6]", "[0.5, 0.3, 0.7]", "[0.2, 0.1, 0.6]"),
    };
    let level = if dimension == 2 { 1 } else { 0 };
    let law = format!("{{ kind = 'separating', friction = {friction} }}");
    let axis = if dimension == 2 { "angle = -30" } else { "axis = [0, 1, 0], angle = 30" };
    let block = format!("{{ kind = 'box', min = {min}, max = {max} }}");
    let turned = format!("{{ kind = 'rotated', centre = {centre}, {axis}, shape = {block} }}");
    let shape = match on {
        Incline::Face => String::new(),
        Incline::HalfSpace => format!("{{ kind = 'half_space', point = {centre}, normal = {normal:?} }}"),
        Incline::Mesh => "{ kind = 'mesh', file = 'wedge.obj' }".into(),
        Incline::Terrain => "{ kind = 'terrain', file = 'slope.asc', base = -2 }".into(),
    };
    let mut job = head(dimension, &format!("{pressing:?}"), size, 0.2, level);
    let floor = if on == Incline::Face {
        let to_floor = if dimension == 2 {
            "{ kind = 'box', min = [0.2, 0], max = [0.5, 0.1] }"
        } else {
            "{ kind = 'box', min = [0.2, 0.1, 0], max = [0.5, 0.3, 0.1] }"
        };
        let face = if dimension == 2 { "y_min" } else { "z_min" };
        job = job.replace(&format!("{face}.kind = 'slip'"), &format!("{face} = {law}"));
        job += &elastic(young, to_floor);
        String::new()
    } else {
        job += &elastic(young, &turned);
        format!("[[colliders]]\nname = 'plane'\nacts_on = 'particles'\nshape = {shape}\ncontact = {law}\n")
    };
    job += &floor;
    // Without damping the block would vibrate, and slip whenever it is unloaded.
    let end = 0.35;
    job += &format!(
        "[[loads]]\nname = 'calm'\nkind = 'damping'\nrate = 400\nstages = ['press']\n\
         [[stages]]\nname = 'press'\nduration = 0.05\n[[stages]]\nname = 'slide'\ngravity = [{whole}]\nat_rest = true\n\
         [time]\nend = {end}\n"
    );
    (history_with(&job, &[("wedge.obj", wedge()), ("slope.asc", slope())]), down, normal)
}

/// How far a block slides in a time (s), m: from when the part of gravity along the incline exceeds friction.
fn slid(friction: f64, time: f64) -> f64 {
    let (sine, cosine) = ANGLE.sin_cos();
    let grown = RAMP * (1.0 - friction * cosine / sine).max(0.0);
    let (rate, left) = (9.81 * sine / RAMP, time - RAMP);
    let late = 0.5 * rate * grown * grown * left + 0.5 * rate * grown * left * left;
    rate * grown.powi(3) / 6.0 + late
}

/// On a face of the domain, a half space, a mesh and a terrain.
fn blocks_slide_as_coulomb_says(dimension: usize, surfaces: &[Incline], frictions: &[f64]) {
    let cell = if dimension == 2 { 0.025 } else { 0.05 };
    for &on in surfaces {
        for &friction in frictions {
            let (history, down, normal) = slide(dimension, on, friction);
            let (along, across) = (way(&history, &down), way(&history, &normal));
            let time = history.last("time") - 0.05;
            let exact = slid(friction, time);
            let found = along.last().copied().unwrap_or_default();
            let lift = across.iter().fold(0.0, |most: f64, x| most.max(x.abs())) / cell;
            let free = slid(0.0, time);
            println!(
                "{dimension}D {on:?}, friction {friction}: {found:.6} m, exact {exact:.6}, off by {:.3} % of {}; off the surface {lift:.4} cells",
                100.0 * (found - exact) / if exact > 0.0 { exact } else { free },
                if exact > 0.0 { "it" } else { "the free way" }
            );
            let scale = if exact > 0.0 { exact } else { free };
            assert!((found - exact).abs() < 0.005 * scale, "{on:?} {friction}: {found} {exact}");
            assert!(on == Incline::Face || lift < 0.02, "{on:?} {friction}: {lift} cells");
        }
    }
}

#[test]
fn blocks_slide_down_inclines_in_the_plane() {
    blocks_slide_as_coulomb_says(2, &[Incline::HalfSpace], &[0.0, 0.1, 0.3, 0.5, 0.65]);
    blocks_slide_as_coulomb_says(2, &[Incline::Face], &[0.3]);
}

#[test]
#[ignore = "nightly: half a minute; in the plane they slide always"]
fn blocks_slide_down_inclines_in_space_nightly() {
    blocks_slide_as_coulomb_says(3, &[Incline::Face], &[0.65]);
    blocks_slide_as_coulomb_says(3, &[Incline::HalfSpace], &[0.3]);
    blocks_slide_as_coulomb_says(3, &[Incline::Mesh], &[0.1]);
    blocks_slide_as_coulomb_says(3, &[Incline::Terrain], &[0.2]);
}

/// A block falls through a slot half a cell wider than itself, between thick walls and between sheets, and
/// touches neither.
#[test]
fn narrow_slots_let_blocks_fall_free() {
    let cell = 0.025;
    let (left, right) = (0.3 - 0.25 * cell, 0.5 + 0.25 * cell);
    for wall in [0.1, 0.0] {
        let walls = format!(
            "[[colliders]]\nname = 'left'\nacts_on = 'particles'\nshape = {{ kind = 'box', min = [{}, 0], max = [{left}, 0.5] }}\n\
             [[colliders]]\nname = 'right'\nacts_on = 'particles'\nshape = {{ kind = 'box', min = [{right}, 0], max = [{}, 0.5] }}\n\
             [time]\nend = 0.25\n",
            left - wall,
            right + wall
        );
        let body = elastic(1e6, "{ kind = 'box', min = [0.3, 0.5], max = [0.5, 0.65] }");
        let history = history(&(head(2, "[0, -9.81]", "[0.8, 0.8]", 0.2, 1) + &body + &walls));
        let (fall, exact) =
            (history.last("momentum_y") / history.last("mass"), -9.81 * history.time_of_velocities());
        assert!((fall - exact).abs() < 1e-12 * exact.abs(), "{fall} {exact}");
        for column in ["force_left_x", "force_left_y", "force_right_x", "force_right_y"] {
            assert!(history.column(column).iter().all(|&force| force == 0.0), "{column}");
        }
    }
}

/// 10 m of water stand on a sheet without thickness, level or inclined, for 10,000 steps. None passes, and
/// the sheet carries the weight.
#[test]
fn sheets_hold_water() {
    for angle in [0.0_f64, 20.0] {
        let (sine, cosine) = angle.to_radians().sin_cos();
        let sheet = format!(
            "{{ kind = 'rotated', centre = [0.5, 2.77], angle = {angle}, shape = {{ kind = 'box', min = [-3, 2.77], max = [5, 2.77] }} }}"
        );
        let above = format!("{{ kind = 'half_space', point = [0.5, 2.77], normal = [{sine}, {}] }}", -cosine);
        let below = format!("{{ kind = 'half_space', point = [0.5, 2.77], normal = [{}, {cosine}] }}", -sine);
        let job = head(2, "[0, -9.81]", "[1, 16]", 1.0, 0)
            + &format!(
                "[[materials]]\nname = 'water'\ndensity = 1000\nmodel = 'fluid'\nbulk_modulus = 2e6\nviscosity = 1e-3\n\
                 [[bodies]]\nname = 'column'\nmaterial = 'water'\n\
                 shape = {{ kind = 'intersection', parts = [{above}, {{ kind = 'box', min = [0, 0], max = [1, 12.77] }}] }}\n\
                 [[colliders]]\nname = 'sheet'\nacts_on = 'particles'\nshape = {sheet}\n\
                 [[probes]]\nname = 'below'\nshape = {below}\nquantities = ['mass']\n[time]\nend = 19.5\n"
            );
        let history = history(&job);
        let steps = history.last("step");
        let weight = 9.81 * history.last("mass");
        let mean =
            -history.integral("force_sheet_y", 9.0) / (history.last("time") - history.at("time", 9.0).0);
        let leaked = history.column("mass_below").iter().fold(0.0, |most: f64, m| most.max(*m));
        println!(
            "{angle} degrees, {steps} steps: leaked {leaked} kg, mean force {mean:.0} N, weight {weight:.0} N"
        );
        assert!(steps >= 10_000.0, "{steps}");
        assert_eq!(leaked, 0.0);
        // An inclined sheet also pushes the water against a wall, along which it may slip.
        assert!((mean / weight - 1.0).abs() < 0.03, "{mean} {weight}");
    }
}

/// A block of rubber, ν = 0.45, between smooth plates that press it together: the stretch l along the plates,
/// the stress and the force F follow from `μ (l² - 1) + λ ln J = 0`, `J = h l`. Where nodes behind a plate were
/// free, the row of particles at it had half of the stress and F-bar took 16 % of the force. At 30 % particles
/// have split: where sweeps did not know how much of a plate each covers, and where nodes beside the edges of
/// the block moved over gaps that never closed, F-bar took 3 to 9 %.
#[test]
fn blocks_between_plates_bear_the_force_of_uniform_stress() {
    let (young, poisson) = (1e6, 0.45);
    let mu = 0.5 * young / (1.0 + poisson);
    let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    // Of a width of 0.1 m: the Kirchhoff stress over the height.
    let exact = |height: f64| {
        let (mut low, mut high) = (1.0, 2.0);
        for _ in 0..60 {
            let l: f64 = 0.5 * (low + high);
            if mu * (l * l - 1.0) + lambda * (height * l).ln() > 0.0 { high = l } else { low = l }
        }
        -0.1 * (mu * (height * height - 1.0) + lambda * (height * low).ln()) / height
    };
    let cases = [
        ("particles", 0.1, false),
        ("particles", 0.1, true),
        ("particles", 0.3, true),
        ("nodes", 0.3, false),
        ("nodes", 0.3, true),
    ];
    for (acts_on, pressed, bar) in cases {
        let case = format!("plates on {acts_on}, {pressed}, f_bar {bar}");
        let exact = exact(1.0 - pressed);
        let plate = |name: &str, y: [f64; 2]| {
            format!(
                "[[colliders]]\nname = '{name}'\nacts_on = '{acts_on}'\n\
                 shape = {{ kind = 'box', min = [-0.18, {}], max = [0.18, {}] }}\n",
                y[0], y[1]
            )
        };
        let history = history(&format!(
            "version = 1\ndimension = 2\n[domain]\nmin = [-0.2, -0.1]\nsize = [0.4, 0.3]\nroot_edge = 0.1\n\
             [tree]\nbase_level = 1\n[[materials]]\nname = 'rubber'\ndensity = 1100\nmodel = 'neo_hookean'\n\
             young = {young}\npoisson = {poisson}\n[[bodies]]\nname = 'block'\nmaterial = 'rubber'\n\
             shape = {{ kind = 'box', min = [-0.05, 0], max = [0.05, 0.1] }}\n{}{}\
             motion = {{ kind = 'table', smooth = true, rows = [{{ time = 0 }}, {{ time = {pressed}, translation = [0, {}] }}] }}\n\
             [numerics]\nf_bar = {bar}\n[time]\nend = {}\n[output]\npicture = false\n",
            plate("bottom", [-0.05, 0.0]),
            plate("top", [0.1, 0.15]),
            -0.1 * pressed,
            pressed + 0.02,
        ));
        let (start, _) = history.at("time", pressed);
        let time = history.last("time") - start;
        let [below, above] = ["force_bottom_y", "force_top_y"].map(|of| history.integral(of, start) / time);
        println!("{case}: {:.4} and {:.4} of the force", -below / exact, above / exact);
        for force in [-below, above] {
            assert!((force / exact - 1.0).abs() < 0.03, "{case}: {force} N/m of {exact} N/m");
        }
    }
}

/// A quarter of a cylinder of 40 cells radius is pressed by a plate: force and approach are those of Hertz
/// (Johnson, Contact mechanics, 1985, section 5.6), which finite elements of the same material meet within 1 %.
#[test]
fn cylinders_between_plates_are_those_of_hertz() {
    let (radius, young, poisson) = (40.0, 1e6, 0.3);
    let sound = (young * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson)) / 1000.0_f64).sqrt();
    let (approach, speed) = (4.1, 0.003 * sound);
    let end = 0.5 * approach / speed;
    let job = head(2, "[0, 0]", "[48, 48]", 4.0, 0)
        .replace("x_min.kind = 'slip'", "x_min.kind = 'symmetric'")
        .replace("y_min.kind = 'slip'", "y_min.kind = 'symmetric'")
        + &format!(
            "[[materials]]\nname = 'rubber'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = {young}\npoisson = {poisson}\n\
             [[bodies]]\nname = 'cylinder'\nmaterial = 'rubber'\nparticles_per_cell = 4\n\
             shape = {{ kind = 'intersection', parts = [{{ kind = 'circle', centre = [0, 0], radius = {radius} }}, \
             {{ kind = 'box', min = [0, 0], max = [48, 48] }}] }}\n\
             [[loads]]\nname = 'calm'\nkind = 'damping'\nrate = {}\n\
             [[colliders]]\nname = 'plate'\nacts_on = 'particles'\nshape = {{ kind = 'box', min = [-4, {radius}], max = [52, {}] }}\n\
             motion = {{ kind = 'table', rows = [{{ time = 0 }}, {{ time = {end}, translation = [0, {}] }}] }}\n[time]\nend = {end}\n",
            0.05 * sound * std::f64::consts::PI / (2.0 * radius),
            radius + 8.0,
            -0.5 * approach
        );
    let history = history(&job);
    let modulus = young / (1.0 - poisson * poisson);
    // Approach of a plate to the centre under a force per metre.
    let exact = |force: f64| {
        let half_width = (4.0 * force * radius / (std::f64::consts::PI * modulus)).sqrt();
        force / (std::f64::consts::PI * modulus) * (2.0 * (4.0 * radius / half_width).ln() - 1.0)
    };
    let at = history.column("position_plate_y");
    // The contact is 9 and 12 cells wide on each side of its middle.
    for (of_plate, tolerance) in [(1.0, 0.05), (2.0, 0.03)] {
        let near: Vec<usize> =
            (0..at.len()).filter(|&row| (at[0] - at[row] - of_plate).abs() < 0.05).collect();
        let mean = |column: &[f64]| near.iter().map(|&row| column[row]).sum::<f64>() / near.len() as f64;
        let (force, depth) = (2.0 * mean(history.column("force_plate_y")), at[0] - mean(at));
        let (mut low, mut high) = (0.0, modulus * radius);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if exact(middle) < depth { low = middle } else { high = middle }
        }
        println!("plates come closer by {:.3} cells: force {force:.0} N/m, Hertz {low:.0}", 2.0 * depth);
        assert!((force / low - 1.0).abs() < tolerance, "{force} {low}");
    }
}

/// A cylinder slips down an incline where friction is below a third of the slope.
#[test]
fn cylinders_slip_down_inclines() {
    let (sine, cosine) = ANGLE.sin_cos();
    for friction in [0.0, 0.1] {
        let (point, radius) = ([0.3, 1.2], 0.2);
        let centre = [point[0] + radius * sine, point[1] + radius * cosine];
        let job = head(2, "[0, -9.81]", "[2, 1.6]", 0.2, 1)
            + &elastic(1e6, &format!("{{ kind = 'circle', centre = {centre:?}, radius = {radius} }}"))
            + &format!(
                "[[colliders]]\nname = 'plane'\nacts_on = 'particles'\ncontact = {{ kind = 'separating', friction = {friction} }}\n\
                 shape = {{ kind = 'half_space', point = {point:?}, normal = [{sine}, {cosine}] }}\n[time]\nend = 0.4\n"
            );
        let history = history(&job);
        let found = *way(&history, &[cosine, -sine]).last().expect("a row");
        let exact = 0.5 * 9.81 * (sine - friction * cosine) * history.last("time").powi(2);
        println!("friction {friction}: {found:.5} m, exact {exact:.5}");
        assert!((found / exact - 1.0).abs() < 0.01, "{found} {exact}");
    }
}

/// Material, a collider that is hit and a floor of zero thickness across changes of level: what one gives the
/// other takes, to round-off, and results do not depend on ranks and restarts.
#[test]
fn momentum_balances_and_ranks_and_restarts_change_no_bit() {
    for dimension in [2, 3] {
        let three = dimension == 3;
        let pick = |two: &'static str, space: &'static str| if three { space } else { two };
        let (gravity, size) = (pick("[0, -9.81]", "[0, 0, -9.81]"), pick("[1.6, 0.8]", "[1.6, 0.4, 0.8]"));
        let fine = pick("point = [0.8, 0], normal = [1, 0.3]", "point = [0.8, 0, 0], normal = [1, 0, 0.3]");
        let fine = format!(
            "base_level = 0\nregions = [{{ level = 2, shape = {{ kind = 'half_space', {fine} }} }}]\n"
        );
        let job = head(dimension, gravity, size, 0.4, 0)
            .replace("base_level = 0\n", &fine)
            .replace("picture = false\n", "")
            + &elastic(
                2e5,
                pick(
                    "{ kind = 'box', min = [0.5, 0.34], max = [1.1, 0.6] }",
                    "{ kind = 'box', min = [0.5, 0.1, 0.34], max = [1.1, 0.3, 0.6] }",
                ),
            )
            + &format!(
                "[[colliders]]\nname = 'sheet'\nacts_on = 'particles'\ncontact = {{ kind = 'separating', friction = 0.3 }}\nshape = {}\n\
                 [[colliders]]\nname = 'ball'\nacts_on = 'particles'\nshape = {}\nmotion = {{ kind = 'free', mass = {}, velocity = {} }}\n\
                 [time]\nend = 0.07\n[checkpoint]\nevery_steps = 20\nkeep = 100\n",
                pick(
                    "{ kind = 'rotated', centre = [0.8, 0.3], angle = 5, shape = { kind = 'box', min = [-1, 0.3], max = [3, 0.3] } }",
                    "{ kind = 'rotated', centre = [0.8, 0.2, 0.3], axis = [0, 1, 0], angle = -5, shape = { kind = 'box', min = [-1, -1, 0.3], max = [3, 2, 0.3] } }"
                ),
                pick(
                    "{ kind = 'circle', centre = [0.35, 0.5], radius = 0.1 }",
                    "{ kind = 'sphere', centre = [0.35, 0.2, 0.5], radius = 0.1 }"
                ),
                if three { 20.0 } else { 100.0 },
                pick("[3, 0]", "[3, 0, 0]"),
            );
        restart::assert_same_on_any_ranks(&job, "body", |directory, _| {
            let history = History::read(directory, "body");
            let (mass, time) = (history.last("mass"), history.time_of_velocities());
            let [x, up] = ["x", pick("y", "z")];
            let faces = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];
            let all = |axis: &str| -> f64 {
                let from = faces[..2 * dimension].iter().chain(&["sheet", "ball"]);
                from.map(|from| history.integral(&format!("force_{from}_{axis}"), 0.0)).sum()
            };
            let scale = 9.81 * mass * time;
            let errors = [
                history.last(&format!("momentum_{x}")) + all(x),
                history.last(&format!("momentum_{up}")) + scale + all(up),
            ];
            println!(
                "{dimension}D: balance off by {:.1e}, {:.1e} of the impulse of weight",
                errors[0] / scale,
                errors[1] / scale
            );
            assert!(errors.iter().all(|error| error.abs() < 1e-12 * scale), "{errors:?} of {scale}");
            let hit = history.last("velocity_ball_x");
            assert!(hit < 2.9, "the ball is braked: {hit} m/s");
            let borne = history.integral(&format!("force_sheet_{up}"), 0.0).abs() / scale;
            println!("{dimension}D: the sheet takes {borne:.3} of the impulse of weight");
            assert!(borne > 0.01, "the sheet bears {borne}");
        });
    }
}

/// Material that begins inside a collider that acts on particles stays there at rest: no energy comes from
/// nowhere. Under gravity it never has more than at the start.
#[test]
fn material_inside_a_collider_is_not_thrown_out() {
    let sill = "[[colliders]]\nname = 'sill'\nacts_on = 'particles'\nshape = { kind = 'circle', centre = [0.45, 0.05], radius = 0.08 }\n";
    for (gravity, stress) in [(0.0, ""), (-9.81, "stress = { kind = 'geostatic', k0 = 0.6 }")] {
        let ground = format!("{{ kind = 'box', min = [0, 0], max = [1, 0.1875] }}\n{stress}");
        let mut job = head(2, &format!("[0, {gravity}]"), "[1, 1]", 0.5, 2);
        job += &format!("{}{sill}[time]\nend = 0.2\n", elastic(2e5, &ground));
        let history = history(&job);
        let energy = |row: usize| -> f64 {
            ["kinetic_energy", "elastic_energy", "gravitational_energy"]
                .iter()
                .map(|name| history.column(name)[row])
                .sum()
        };
        let rows = history.column("time").len();
        let greatest = (0..rows).map(energy).fold(f64::MIN, f64::max);
        println!("gravity {gravity}: {} J at the start, at most {greatest} J", energy(0));
        if gravity == 0.0 {
            assert_eq!(greatest, 0.0);
        } else {
            assert!(greatest <= energy(0) * (1.0 + 1e-9), "{greatest} J after {} J", energy(0));
        }
    }
}
