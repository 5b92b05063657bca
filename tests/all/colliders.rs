//! Colliders through the whole program: exact solutions of sliding, resting, pushing and falling, and the
//! same bits on any ranks and threads and across restarts.

use std::path::Path;

use crate::common::history::History;
use crate::common::launch::{Outcome, agimp, job, run, succeed};
use crate::common::restart;

/// Runs a 2D job on one rank: an elastic body of 1000 kg/m³ and what `rest` adds.
fn elastic(young: f64, gravity: f64, body: &str, end: f64, rest: &str) -> History {
    let text = format!(
        "version = 1\ndimension = 2\ngravity = [0, {gravity}]\n\
         [boundaries]\nx_min = {{ kind = 'slip' }}\nx_max = {{ kind = 'slip' }}\n\
         y_min = {{ kind = 'slip' }}\ny_max = {{ kind = 'slip' }}\n\
         [domain]\nsize = [1.6, 0.8]\nroot_edge = 0.2\n[tree]\nbase_level = 1\n\
         [[materials]]\nname = 'rubber'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = {young}\npoisson = 0.2\n\
         [[bodies]]\nname = 'body'\nmaterial = 'rubber'\n{body}\n\
         [time]\nend = {end}\n[output]\npicture = false\n{rest}\n"
    );
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("body.toml");
    std::fs::write(&path, text).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    History::read(directory.path(), "body")
}

/// A block on a plane that descends by 30 degrees along x, off the lattice.
fn slide(friction: f64, young: f64) -> History {
    let block = "shape = { kind = 'rotated', centre = [0.2, 0.6], angle = -30, \
                 shape = { kind = 'box', min = [0.2, 0.6], max = [0.5, 0.7] } }";
    let plane = format!(
        "[[colliders]]\nname = 'plane'\n\
         shape = {{ kind = 'half_space', point = [0.2, 0.6], normal = [0.5, 0.8660254037844386] }}\n\
         contact = {{ kind = 'separating', friction = {friction} }}"
    );
    elastic(young, -9.81, block, 0.3, &plane)
}

#[test]
fn blocks_slide_down_a_slope_as_coulomb_says() {
    let (sine, cosine) = (0.5, 0.75_f64.sqrt());
    for friction in [0.0, 0.2, 0.4] {
        let history = slide(friction, 1e6);
        let mass = history.last("mass");
        let speed = |start| {
            let (time, x) = history.at("momentum_x", start);
            let (_, y) = history.at("momentum_y", start);
            (time, (cosine * x - sine * y) / mass)
        };
        let ((t0, v0), (t1, v1)) = (speed(0.05), speed(0.299));
        let (found, exact) = ((v1 - v0) / (t1 - t0), 9.81 * (sine - friction * cosine));
        println!("friction {friction}: {found:.4} m/s², exact {exact:.4}");
        // Of the acceleration without friction: the block vibrates, and friction follows the momentary
        // pressure.
        assert!((found - exact).abs() < 0.01 * 9.81 * sine, "friction {friction}: {found} against {exact}");
    }
    // It holds above tan(30 degrees) = 0.577. Near to that the block creeps while its vibrations unload it,
    // the more the softer it is.
    let history = slide(1.0, 1e7);
    let speed = history.last("momentum_x") / history.last("mass");
    println!("friction 1: {speed:.2e} m/s after 0.3 s, free fall along the slope 1.27");
    assert!(speed.abs() < 0.001, "{speed}");
}

#[test]
fn weight_is_the_mean_reaction_and_momentum_balances() {
    let support =
        "[[colliders]]\nname = 'table'\nshape = { kind = 'box', min = [0, -1], max = [1.6, 0.3125] }\n";
    let history = elastic(
        4e6,
        -9.81,
        "shape = { kind = 'box', min = [0.6, 0.3125], max = [0.9, 0.4125] }",
        0.5,
        support,
    );
    let (weight, time) = (9.81 * history.last("mass"), history.time_of_velocities());
    let (start, _) = history.at("time", 0.1);
    let mean = history.integral("force_table_y", start) / (time - start);
    println!("mean force {mean:.4} N, weight {:.4} N", -weight);
    assert!((mean / -weight - 1.0).abs() < 0.01, "{mean} against {}", -weight);
    // No other force acts: exact but for rounding.
    let error = history.last("momentum_y") + weight * time + history.integral("force_table_y", 0.0);
    println!("balance off by {:.1e} of the impulse", error / (weight * time));
    assert!(error.abs() < 1e-12 * weight * time, "{error:e}");
}

#[test]
fn pistons_give_the_momentum_that_they_report() {
    let piston = "[[colliders]]\nname = 'piston'\ncontact = { kind = 'separating', friction = 0.5 }\n\
                  shape = { kind = 'box', min = [0.1, 0.1], max = [0.3, 0.7] }\n\
                  motion = { kind = 'table', rows = [{ time = 0.01 }, { time = 0.04, translation = [0.2, 0.02] }, \
                  { time = 0.05, translation = [0.25, 0.02] }] }";
    let block = "shape = { kind = 'box', min = [0.36, 0.3], max = [0.56, 0.47] }";
    let history = elastic(1e5, 0.0, block, 0.06, piston);
    let gained = [history.last("momentum_x"), history.last("momentum_y")];
    for (axis, gained) in ["x", "y"].into_iter().zip(gained) {
        let error = gained + history.integral(&format!("force_piston_{axis}"), 0.0);
        println!("momentum {axis} {gained:.4}, off by {error:.1e}");
        assert!(error.abs() < 1e-12 * gained.abs(), "{axis}: {gained} off by {error:e}");
    }
    assert!(gained[0] > 0.9 * 5.0 * history.last("mass"), "{gained:?}");
    assert!((history.last("position_piston_x") - 0.45).abs() < 1e-15);
}

/// The top of a disc that turns counter-clockwise moves towards -x and takes the body along, which brakes it.
#[test]
fn turning_discs_are_braked_by_what_they_carry() {
    let disc = |spin: f64| {
        format!(
            "[[colliders]]\nname = 'disc'\ncontact = {{ kind = 'separating', friction = 0.3 }}\n\
             shape = {{ kind = 'circle', centre = [0.8, 0.2], radius = 0.2 }}\n\
             motion = {{ kind = 'steady', angular_velocity = {spin} }}"
        )
    };
    let block = "shape = { kind = 'box', min = [0.7, 0.4], max = [0.9, 0.5] }";
    for spin in [10.0, -10.0] {
        let history = elastic(1e6, -9.81, block, 0.1, &disc(spin));
        let torque = history.integral("torque_disc", 0.0);
        let (push, weight) = (history.last("momentum_x"), 9.81 * history.last("mass") * 0.1);
        println!(
            "spin {spin}: angular impulse {torque:.4}, momentum {push:.4}, impulse of weight {weight:.4}"
        );
        assert!(torque * spin < 0.0 && push * spin < 0.0, "{torque} {push}");
        // Friction along the surface at radius 0.2 is the torque; it is at most 0.3 of the weight.
        assert!((0.5..1.1).contains(&(push.abs() / (0.3 * weight))), "{push} {weight}");
        assert!((torque.abs() / (0.2 * push.abs()) - 1.0).abs() < 0.25, "{torque} {push}");
        // The run ends with the first step that reaches 0.1 s.
        let turned = history.last("time") * spin;
        assert!((history.last("angle_disc") - turned).abs() < 1e-14);
    }
}

#[test]
fn free_bodies_fall_exactly_and_take_what_they_give() {
    let ball = "[[colliders]]\nname = 'ball'\nshape = { kind = 'circle', centre = [0.4, 0.6], radius = 0.05 }\n\
                motion = { kind = 'free', mass = 3, velocity = [1, 0.5] }";
    let far = elastic(1e6, -9.81, "shape = { kind = 'box', min = [1.2, 0], max = [1.4, 0.1] }", 0.2, ball);
    let t = far.last("time");
    let exact = [0.4 + t, 0.6 + 0.5 * t - 0.5 * 9.81 * t * t];
    let found = [far.last("position_ball_x"), far.last("position_ball_y")];
    println!("falls to {found:?}, exact {exact:?}");
    assert!((0..2).all(|a| (found[a] - exact[a]).abs() < 1e-13), "{found:?} {exact:?}");

    let hit = "[[colliders]]\nname = 'ball'\nshape = { kind = 'circle', centre = [0.4, 0.4], radius = 0.1 }\n\
               motion = { kind = 'free', mass = 50, velocity = [5, 0] }";
    let block = "shape = { kind = 'box', min = [0.51, 0.3], max = [0.71, 0.5] }";
    let history = elastic(1e5, 0.0, block, 0.04, hit);
    let (given, taken) = (history.last("momentum_x"), 50.0 * (5.0 - history.last("velocity_ball_x")));
    println!("ball gives {taken:.6}, block has {given:.6}");
    assert!(given > 20.0 && (given - taken).abs() < 1e-11 * given, "{given} {taken}");
    assert!((given + history.integral("force_ball_x", 0.0)).abs() < 1e-12 * given);
}

/// Cohesion bears its shear stress on the area of the surface, and friction its share of the weight, at faces
/// of the domain and on colliders at any place between the nodes, on which of them they act, whether the
/// material could yield or not: a block that is pulled along moves with what is left, and stays where nothing
/// is.
#[test]
fn cohesion_holds_its_stress_times_the_area() {
    let speed = |law: &str, pull: f64, collider: &str, face: &str, surface: f64| {
        let contact = "{ kind = 'separating', friction = 0.1, cohesion = 500 }";
        let text = format!(
            "version = 1\ndimension = 2\ngravity = [{pull}, -10]\n[domain]\nsize = [2, 1]\nroot_edge = 0.5\n[tree]\nbase_level = 1\n\
             [[materials]]\nname = 'm'\ndensity = 1000\n{law}\nyoung = 1e6\npoisson = 0\n[[bodies]]\nname = 'block'\n\
             material = 'm'\nshape = {{ kind = 'box', min = [0.5, {surface}], max = [1, {}] }}\n{collider}\n{face}\n\
             [time]\nend = 0.4\n[output]\npicture = false\n",
            surface + 0.25,
        );
        let text = text.replace("CONTACT", contact);
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("held.toml");
        std::fs::write(&path, text).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let history = History::read(directory.path(), "held");
        history.last("momentum_x") / history.last("mass")
    };
    let floor = |height: f64, rest: &str| {
        format!(
            "[[colliders]]\nname = 'floor'\nshape = {{ kind = 'box', min = [-1, -1], max = [3, {height}] }}\ncontact = CONTACT\n{rest}"
        )
    };
    let cases = [
        (String::new(), "[boundaries]\ny_min = CONTACT", 0.0),
        (floor(0.25, ""), "", 0.25),
        (floor(0.28125, ""), "", 0.28125),
        (floor(0.28125, "acts_on = 'particles'"), "", 0.28125),
    ];
    let laws = ["model = 'neo_hookean'", "model = 'von_mises'\nyield_stress = 1e5"];
    for (law, (collider, face, surface)) in
        laws.iter().flat_map(|law| cases.iter().map(move |case| (law, case)))
    {
        // Of 125 kg on 0.5 m²: friction takes 1 m/s², cohesion 2 m/s².
        let [slides, stays] = [5.0, 2.5].map(|pull| speed(law, pull, collider, face, *surface));
        println!("{law} at {surface}: {slides:.4} m/s of 0.8, {stays:.1e} m/s of 0");
        assert!((slides / 0.8 - 1.0).abs() < 0.03, "{law} {collider}{face}: {slides}");
        assert!(stays.abs() < 0.01, "{law} {collider}{face}: {stays}");
    }
}

/// Viscous oil between a cylinder that turns and a fixed one around it sticks to both: the torque is that of
/// Couette's flow, `4 π η ω R₁² R₂² / (R₂² - R₁²)`, with ten cells over the gap.
#[test]
fn oil_sticks_to_curved_walls() {
    let text = "version = 1\ndimension = 2\n[domain]\nmin = [-0.12, -0.12]\nsize = [0.24, 0.24]\nroot_edge = 0.02\n\
        [[materials]]\nname = 'oil'\ndensity = 1000\nmodel = 'fluid'\nbulk_modulus = 1000\nviscosity = 1\ntension = true\n\
        [[bodies]]\nname = 'oil'\nmaterial = 'oil'\nshape = { kind = 'difference', from = { kind = 'circle', centre = [0, 0], \
        radius = 0.1 }, remove = [{ kind = 'circle', centre = [0, 0], radius = 0.05 }] }\n[[colliders]]\nname = 'inner'\n\
        shape = { kind = 'circle', centre = [0, 0], radius = 0.05 }\ncontact = { kind = 'sticky' }\n\
        motion = { kind = 'steady', angular_velocity = 1 }\n[[colliders]]\nname = 'outer'\nshape = { kind = 'difference', \
        from = { kind = 'box', min = [-1, -1], max = [1, 1] }, remove = [{ kind = 'circle', centre = [0, 0], radius = 0.1 }] }\n\
        contact = { kind = 'sticky' }\n[time]\nend = 2\n[output]\npicture = false\n";
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("couette.toml");
    std::fs::write(&path, text).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "couette");
    let torque = 4.0 * std::f64::consts::PI * 0.05_f64.powi(2) * 0.1_f64.powi(2)
        / (0.1_f64.powi(2) - 0.05_f64.powi(2));
    let (start, _) = history.at("time", 1.6);
    for (name, sign) in [("inner", -1.0), ("outer", 1.0)] {
        let time = history.last("time") - start;
        let mean = sign * history.integral(&format!("torque_{name}"), start) / time;
        println!("{name}: {mean:.5} N m of {torque:.5}");
        assert!((mean / torque - 1.0).abs() < 0.03, "{name}: {mean} of {torque}");
    }
}

/// Voellmy's law: a block of the height H that is pulled along with an acceleration a, less Coulomb friction,
/// has the velocity `v = v_e tanh(a t / v_e)`, with `v_e² = a H ξ / g`; at faces of the domain and on colliders
/// at any place between the nodes, on which of them they act, and whether the material yields.
#[test]
fn turbulent_friction_brings_a_sliding_block_to_its_terminal_velocity() {
    let elastic = "model = 'neo_hookean'\nyoung = 1e6\npoisson = 0";
    let yields = "model = 'drucker_prager'\nyoung = 1e6\npoisson = 0\nfriction_angle = 30\ncohesion = 1e5";
    let speed = |model: &str, collider: &str, face: &str, surface: f64| {
        let contact = "{ kind = 'separating', friction = 0.1, turbulent_friction = 49.03325 }";
        let text = format!(
            "version = 1\ndimension = 2\ngravity = [5, -10]\n[domain]\nsize = [2, 1]\nroot_edge = 0.5\n[tree]\nbase_level = 1\n\
             [[materials]]\nname = 'm'\ndensity = 1000\n{model}\n[[bodies]]\nname = 'block'\nmaterial = 'm'\n\
             shape = {{ kind = 'box', min = [0.25, {surface}], max = [0.75, {}] }}\n{collider}\n{face}\n\
             [time]\nend = 0.6\n[output]\npicture = false\n",
            surface + 0.25,
        );
        let text = text.replace("CONTACT", contact);
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("flow.toml");
        std::fs::write(&path, text).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let history = History::read(directory.path(), "flow");
        history.last("momentum_x") / history.last("mass")
    };
    let floor = |height: f64, rest: &str| {
        format!(
            "[[colliders]]\nname = 'floor'\nshape = {{ kind = 'box', min = [-1, -1], max = [3, {height}] }}\ncontact = CONTACT\n{rest}"
        )
    };
    let cases = [
        (elastic, String::new(), "[boundaries]\ny_min = CONTACT", 0.0),
        (yields, String::new(), "[boundaries]\ny_min = CONTACT", 0.0),
        (elastic, floor(0.25, ""), "", 0.25),
        (elastic, floor(0.28125, ""), "", 0.28125),
        (yields, floor(0.28125, ""), "", 0.28125),
        (elastic, floor(0.28125, "acts_on = 'particles'"), "", 0.28125),
    ];
    let (pull, height): (f64, f64) = (4.0, 0.25);
    let terminal = (pull * height / 0.2).sqrt();
    let expected = terminal * (pull * 0.6 / terminal).tanh();
    for (model, collider, face, surface) in cases {
        let speed = speed(model, &collider, face, surface);
        println!("{model}, at {surface}: {speed:.4} m/s of {expected:.4}");
        assert!((speed / expected - 1.0).abs() < 0.03, "{model} {collider}{face}: {speed} of {expected}");
    }
}

/// Height over the surface (cells) of the lower face of a block of 8 x 8 cells that begins so many cells above
/// it, once it is at rest, and the mean stress of its two lowest rows of particles over that of their weight.
fn rest_on(law: &str, young: f64, surface: f64, collider: &str, above: f64) -> [f64; 2] {
    let (cell, height) = (0.0625, 0.5);
    let text = format!(
        "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [2, 2]\nroot_edge = 0.5\n[tree]\nbase_level = 1\n\
         [[materials]]\nname = 'm'\ndensity = 1000\n{law}\nyoung = {young}\npoisson = 0\n\
         [[bodies]]\nname = 'block'\nmaterial = 'm'\nshape = {{ kind = 'box', min = [0.5, {}], max = [1, {}] }}\n{collider}\n\
         [equilibrium]\nspeed = 1e-5\nacceleration = 1e-3\n[time]\nend = 3\n[output]\npicture = false\n\
         [[probes]]\nname = 'a'\nquantities = ['extent']\n[[probes]]\nname = 'b'\nquantities = ['stress']\n\
         shape = {{ kind = 'box', min = [0.6, {}], max = [0.9, {}] }}\n",
        surface + above * cell,
        surface + above * cell + height,
        surface - 0.2 * cell,
        surface + 1.02 * cell,
    );
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("rest.toml");
    std::fs::write(&path, text).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "rest");
    let gap = (history.last("least_a_y") - 0.25 * cell - surface) / cell;
    [gap, history.last("stress_b_yy") / (-9810.0 * (height - 0.5 * cell))]
}

/// On faces and colliders of each kind, at any height between rows of nodes, with soft and stiff material, and
/// metal, clay, rock and what cracks, as long as none has yielded, also beside a body in contact: the block
/// lies on the surface, and its lowest rows carry its weight. Without the gap it hovers up to a cell above, and
/// the lowest row has 6 to 23 times the stress. On `slip` colliders between rows the stress is within 6 %;
/// nodes behind a `sticky` one hold, so that there its lowest row is right on rows alone.
#[test]
fn blocks_come_to_rest_on_the_surface_with_their_weight() {
    let floor = |height: f64| {
        format!(
            "[[colliders]]\nname = 'floor'\nshape = {{ kind = 'box', min = [-1, -1], max = [3, {height}] }}"
        )
    };
    let elastic = "model = 'neo_hookean'";
    let mut cases = vec![(elastic, 1e5, 0.0, String::new()), (elastic, 1e6, 0.0, String::new())];
    cases.extend([0.25, 0.265625, 0.28125, 0.31].map(|height| (elastic, 1e6, height, floor(height))));
    for kind in ["slip", "sticky"] {
        let law = format!("contact = {{ kind = '{kind}' }}");
        let face = format!("[boundaries]\ny_min = {{ kind = '{kind}' }}");
        cases.extend([1e5, 1e6, 1e8].map(|young| (elastic, young, 0.0, face.clone())));
        cases.push((elastic, 1e6, 0.25, format!("{}\n{law}", floor(0.25))));
        let between = [0.265625, 0.28125, 0.31].into_iter().filter(|_| kind == "slip");
        cases.extend(between.map(|height| (elastic, 1e6, height, format!("{}\n{law}", floor(height)))));
    }
    let rock = "model = 'drucker_prager'\nfriction_angle = 30\ncohesion = 1e5";
    let metal = "model = 'von_mises'\nyield_stress = 1e5";
    let cracks = "model = 'hencky'\ndamage = { kind = 'rankine', strength = 1e5, fracture_energy = 1e3 }";
    let laws = [
        metal,
        "model = 'tresca'\nyield_stress = 1e5",
        rock,
        "model = 'mohr_coulomb'\nfriction_angle = 30\ncohesion = 1e5",
        cracks,
    ];
    for law in laws {
        cases.extend([(law, 1e6, 0.0, String::new()), (law, 1e6, 0.28125, floor(0.28125))]);
    }
    // Sums at walls are apart from those between bodies.
    for law in [metal, rock] {
        let beside = "[[bodies]]\nname = 'beside'\nmaterial = 'm'\n\
                      shape = { kind = 'box', min = [1, 0.34375], max = [1.25, 0.84375] }\n\
                      [[contact]]\nname = 'side'\nbetween = ['block', 'beside']\nfriction = 0.2\n";
        cases.push((law, 1e6, 0.28125, format!("{beside}{}", floor(0.28125))));
    }
    for (law, young, surface, collider) in cases {
        let [gap, stress] = rest_on(law, young, surface, &collider, 1.0);
        println!(
            "{law}, E {young:e}, surface at {surface} m: gap {gap:.4} cells, stress {stress:.4} of the weight"
        );
        assert!(gap.abs() < 0.05, "{law}, E {young:e}, {surface} m: gap {gap}");
        let bar = if collider.contains("slip") { 0.06 } else { 0.05 };
        assert!((stress - 1.0).abs() < bar, "{law}, E {young:e}, {surface} m: stress {stress}");
    }
}

/// A block that is written upon a floor lies there with its weight, wherever they are between the cells: its
/// particles end at its faces. On the lattice of the cells it would begin inside the floor, and its lowest rows
/// would have 0.88 and 0.77 of their weight at a tenth and a quarter of a cell.
#[test]
fn blocks_written_upon_a_floor_lie_there_with_their_weight() {
    for (young, up) in [(1e6, 0.1), (1e6, 0.25), (1e6, 0.6), (1e8, 0.25), (1e8, 0.8)] {
        let surface = 0.25 + up * 0.0625;
        let floor = format!(
            "[[colliders]]\nname = 'floor'\nshape = {{ kind = 'box', min = [-1, -1], max = [3, {surface}] }}"
        );
        let [gap, stress] = rest_on("model = 'neo_hookean'", young, surface, &floor, 0.0);
        println!("E {young:e}, {up} cells up: gap {gap:.4} cells, stress {stress:.4} of the weight");
        assert!(gap.abs() < 0.01 && (stress - 1.0).abs() < 0.02, "E {young:e}, {up}: {gap}, {stress}");
    }
}

/// Water with its hydrostatic stress stays at rest in a tank, whichever way the tank is written and wherever
/// its floor is between the nodes.
#[test]
fn water_rests_in_tanks_however_they_are_written() {
    let part = |x: [f64; 2], y: [f64; 2]| {
        format!("{{ kind = 'box', min = [{}, {}], max = [{}, {}] }}", x[0], y[0], x[1], y[1])
    };
    let (floor, all) = (part([-0.1, 1.1], [-0.1, 0.0]), part([-0.1, 1.1], [-0.1, 0.8]));
    let (left, right) = (part([-0.1, 0.0], [0.0, 0.8]), part([1.0, 1.1], [0.0, 0.8]));
    let union = |parts: &str| format!("{{ kind = 'union', parts = [{parts}] }}");
    let halves = [part([-0.1, 0.5], [-0.1, 0.0]), part([0.5, 1.1], [-0.1, 0.0])].join(", ");
    let lapping = [part([-0.1, 0.55], [-0.1, 0.0]), part([0.45, 1.1], [-0.1, 0.0])].join(", ");
    let hole = part([0.0, 1.0], [0.0, 0.9]);
    let difference = format!("{{ kind = 'difference', from = {all}, remove = [{hole}] }}");
    let tanks = [
        ("difference", difference.clone(), 0.0),
        ("union", union(&[&floor[..], &left, &right].join(", ")), 0.0),
        ("seam", union(&[&halves[..], &left, &right].join(", ")), 0.0),
        ("overlap", union(&[&lapping[..], &left, &right].join(", ")), 0.0),
        ("between nodes", difference, 0.015625),
    ];
    // At particles it is as at nodes, since the walls are thick.
    let ways =
        tanks.iter().map(|tank| (tank, "nodes")).chain([0, 2].map(|number| (&tanks[number], "particles")));
    for ((name, shape, shift), acts_on) in ways {
        let text = format!(
            "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nmin = [{}, {}]\nsize = [1.5, 1]\nroot_edge = 0.25\n\
             [tree]\nbase_level = 1\n[[materials]]\nname = 'water'\ndensity = 1000\nmodel = 'fluid'\nbulk_modulus = 2e5\n\
             viscosity = 1e-3\n[[bodies]]\nname = 'water'\nmaterial = 'water'\nstress = {{ kind = 'hydrostatic' }}\n\
             shape = {{ kind = 'box', min = [0, 0], max = [1, 0.3125] }}\n\
             [[colliders]]\nname = 'tank'\nshape = {shape}\nacts_on = '{acts_on}'\ncontact = {{ kind = 'slip' }}\n\
             [[probes]]\nname = 'water'\nquantities = ['centre', 'extent']\n[time]\nend = 1\n[output]\npicture = false\n",
            -0.25 + shift,
            -0.125 + shift,
        );
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("tank.toml");
        std::fs::write(&path, text).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let history = History::read(directory.path(), "tank");
        let centre = history.column("centre_water_y");
        let change = history.last("centre_water_y") / centre[0] - 1.0;
        println!("{name}, {acts_on}: {:.4} %, least {:.2e} m", 100.0 * change, history.last("least_water_y"));
        assert!(change.abs() < 1e-3, "{name}, {acts_on}: the water sinks by {change}");
    }
}

/// Sand that has collapsed and run along a floor between rows of nodes lies on it. Held at the nodes inside, it
/// would creep 0.4 cells into the floor.
#[test]
fn sand_that_has_flowed_lies_on_the_surface() {
    let surface = 0.11;
    let text = format!(
        "version = 1\ndimension = 2\ngravity = [0, -9.81]\n\
         [domain]\nsize = [1.6, 0.8]\nroot_edge = 0.2\n[tree]\nbase_level = 1\n\
         [boundaries]\nx_min.kind = 'symmetric'\nx_max.kind = 'slip'\ny_min.kind = 'slip'\ny_max.kind = 'separating'\n\
         [[materials]]\nname = 'sand'\ndensity = 1600\nmodel = 'drucker_prager'\nyoung = 2e5\npoisson = 0.3\n\
         friction_angle = 30\nmatch = 'plane_strain'\n[[bodies]]\nname = 'sand'\nmaterial = 'sand'\n\
         shape = {{ kind = 'box', min = [0, {surface}], max = [0.4, 0.51] }}\n\
         [[colliders]]\nname = 'floor'\nshape = {{ kind = 'box', min = [-1, -1], max = [2, {surface}] }}\n\
         contact = {{ kind = 'separating', friction = 0.4 }}\n\
         [[probes]]\nname = 'sand'\nquantities = ['extent']\n[time]\nend = 1.2\n[output]\npicture = false\n"
    );
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("sand.toml");
    std::fs::write(&path, text).expect("job");
    succeed(&mut run(directory.path(), 2, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "sand");
    let lowest = (history.last("least_sand_y") - surface) / 0.025;
    println!("the lowest particle is {lowest:.3} cells over the floor");
    assert!(history.last("greatest_sand_x") > 1.0, "the sand stands");
    assert!((0.0..0.5).contains(&lowest), "{lowest} cells over the floor");
}

/// Water in a tank that a table moves to and fro within 1 s, and that stands then: it sloshes, and whenever its
/// surface is level, the centre is back at its height. Where shifts drove water into walls, 2.4 % were lost in
/// 5 s.
#[test]
fn water_in_a_tank_that_has_moved_keeps_its_level() {
    let part = |name: &str, x: [f64; 2], y: [f64; 2]| {
        format!(
            "[[colliders]]\nname = '{name}'\nshape = {{ kind = 'box', min = [{}, {}], max = [{}, {}] }}\n\
             contact.kind = 'slip'\nmotion = {{ kind = 'table', smooth = true, rows = [{{ time = 0 }}, \
             {{ time = 0.5, translation = [0.04, 0] }}, {{ time = 1, translation = [0, 0] }}] }}\n",
            x[0], y[0], x[1], y[1]
        )
    };
    let walls = [
        part("floor", [-0.1, 1.1], [-0.1, 0.0]),
        part("left", [-0.1, 0.0], [-0.1, 0.8]),
        part("right", [1.0, 1.1], [-0.1, 0.8]),
    ];
    let text = format!(
        "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nmin = [-0.25, -0.125]\nsize = [1.5, 1]\n\
         root_edge = 0.125\n[[materials]]\nname = 'water'\ndensity = 1000\nmodel = 'fluid'\nbulk_modulus = 2e5\n\
         viscosity = 1e-3\n[[bodies]]\nname = 'water'\nmaterial = 'water'\nstress = {{ kind = 'hydrostatic' }}\n\
         shape = {{ kind = 'box', min = [0, 0], max = [1, 0.3] }}\n{}\
         [[probes]]\nname = 'water'\nquantities = ['centre']\n[time]\nend = 5\n[output]\npicture = false\n",
        walls.concat()
    );
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("moved.toml");
    std::fs::write(&path, text).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "moved");
    let (centre, time) = (history.column("centre_water_y"), history.column("time"));
    let late = centre.iter().zip(time).filter(|(_, time)| **time > 4.0);
    let (least, greatest) = late.fold((f64::INFINITY, 0.0_f64), |(least, greatest), (y, _)| {
        (least.min(y / centre[0] - 1.0), greatest.max(y / centre[0] - 1.0))
    });
    println!("level: {:.2} %, crest {:.2} %", 100.0 * least, 100.0 * greatest);
    assert!(least.abs() < 0.01, "the water has sunk by {least}");
    // By domain faces and a body force it goes on to slosh by 2 %.
    assert!(greatest > 0.012, "the water is still: {greatest}");
}

#[test]
fn same_bits_in_all_ways_and_across_restart() {
    let name = "collider_drop";
    let mut reference: Option<Outcome> = None;
    for (ranks, threads) in [(1, 1), (1, 2), (2, 1), (3, 1), (4, 1), (2, 2)] {
        let directory = tempfile::tempdir().expect("temporary directory");
        succeed(&mut run(directory.path(), ranks, threads, &job(name), &["--quiet"]));
        let result = Outcome::read(directory.path(), name);
        match &reference {
            Some(first) => first.assert_same(&result, &format!("{ranks} ranks x {threads} threads")),
            None => {
                restart_gives_the_same(directory.path(), name, &result);
                reference = Some(result);
            }
        }
    }
}

/// Goes on from a checkpoint between two rows of the history, on other ranks.
fn restart_gives_the_same(done: &Path, name: &str, whole: &Outcome) {
    let history = History::read(done, name);
    let fall = history.last("velocity_cylinder_y");
    assert!(fall > -1.9 && fall < 1.0, "the cylinder is braked by sand: {fall} m/s");
    assert!(history.column("force_paddle_x").iter().any(|force| force.abs() > 1.0));
    restart::assert_middle_gives(whole, done, &job(name), name);
}

#[test]
fn check_lists_colliders() {
    let output = succeed(agimp(Path::new(".")).arg("check").arg(job("collider_drop")));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in ["colliders    3", "free, 25 kg", "by a table of 3 rows", "slip, fixed"] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

/// A table of motion in a file moves a collider as the same rows in the job, bit by bit; smooth motions go
/// through their rows on cosines.
#[test]
fn motions_come_from_files_and_start_smoothly() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let rows = "Time [s];U;Phi\n0.01;0;0\n0.04;-2.0D+01;90\n0.05;-25;90\n";
    std::fs::write(directory.path().join("press.csv"), rows).expect("record");
    let history = |motion: &str| {
        let text = format!(
            "version = 1\ndimension = 2\n[domain]\nsize = [1, 1]\nroot_edge = 0.5\n\
             [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.2\n\
             [[bodies]]\nname = 'body'\nmaterial = 'm'\nshape = {{ kind = 'box', min = [0.25, 0], max = [0.75, 0.5] }}\n\
             [[colliders]]\nname = 'press'\nshape = {{ kind = 'box', min = [0.25, 0.5], max = [0.75, 1] }}\nmotion = {motion}\n\
             [time]\nend = 0.06\n[output]\npicture = false\n[history]\nevery_steps = 1\n"
        );
        let path = directory.path().join("press.toml");
        std::fs::write(&path, text).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet", "--overwrite"]));
        History::read(directory.path(), "press")
    };
    let rows = "rows = [{ time = 0.01 }, { time = 0.04, translation = [0, -0.02], rotation = 90 }, \
                { time = 0.05, translation = [0, -0.025], rotation = 90 }]";
    let record = "record = { file = 'press.csv', time = 'time', y = 'u', rotation = 3, scale = 1e-3 }";
    let linear = history(&format!("{{ kind = 'table', {rows} }}"));
    let from_file = history(&format!("{{ kind = 'table', {record} }}"));
    for name in ["time", "position_press_y", "angle_press", "force_press_y", "momentum_y"] {
        assert_eq!(linear.column(name), from_file.column(name), "{name}");
    }
    let smooth = history(&format!("{{ kind = 'table', smooth = true, {record} }}"));
    for (time, y) in smooth.column("time").iter().zip(smooth.column("position_press_y")) {
        let fall = |from: f64, to: f64| {
            0.5 * (1.0 - (std::f64::consts::PI * ((time - from) / (to - from)).clamp(0.0, 1.0)).cos())
        };
        let exact = 0.75 - 0.02 * fall(0.01, 0.04) - 0.005 * fall(0.04, 0.05);
        assert!((y - exact).abs() < 1e-14, "{time}: {y} for {exact}");
    }
    let rising = history("{ kind = 'steady', velocity = [0, -1], ramp = 0.04 }");
    let (time, y) = (rising.last("time"), rising.last("position_press_y"));
    assert!((y - (0.75 - (time - 0.02))).abs() < 1e-14, "{time} {y}");
}
