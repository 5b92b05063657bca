//! Bodies of revolution with water: in the pores, seeping to wells, free in tanks, and out of sources. Closed forms
//! in cylindrical coordinates; masses, flows and forces are those of the whole circumference.
use std::f64::consts::{PI, TAU};

use crate::common::history::History;
use crate::common::restart;
use crate::fluids::still;

fn history(name: &str, text: &str) -> History {
    History::of_job(name, text, &[])
}

/// A job under gravity in a cylinder of this radius and height, m.
fn job(size: [f64; 2], root_edge: f64, rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\ngeometry = 'axisymmetric'\ngravity = [0, -9.81]\n\
         [domain]\nsize = {size:?}\nroot_edge = {root_edge}\n\
         [boundaries]\nx_max.kind = 'slip'\ny_min.kind = 'slip'\ny_max.kind = 'separating'\n\
         [output]\npicture = false\n[history]\nevery_steps = 5\n{rest}\n"
    )
}

const SOIL: &str = "[[materials]]\nname = 'soil'\ndensity = 1800\nsaturated_density = 2000\nmodel = 'mohr_coulomb'\n\
    young = 1e6\npoisson = 0.3\nfriction_angle = 30\ncohesion = 100\n";

/// Greatest speed, as the root of the kinetic energy per mass, m/s.
fn liveliness(history: &History) -> f64 {
    let most = history.column("kinetic_energy").iter().fold(0.0_f64, |most, &e| most.max(e));
    (2.0 * most / history.last("mass")).sqrt()
}

/// Ground with a water table, with a K0, is at rest at the axis too, and has the mass of its wet and its dry part. The
/// water bears a ring of the ground by its own weight in the pores and around it.
#[test]
fn ground_under_water_rests() {
    let text = job(
        [1.0, 1.0],
        0.5,
        &format!(
            "[water]\nlevel = 0.5\n{SOIL}[[bodies]]\nname = 'ground'\nmaterial = 'soil'\n\
             shape = {{ kind = 'box', min = [0, 0], max = [1, 0.75] }}\nstress = {{ kind = 'geostatic', k0 = 0.5 }}\n\
             [time]\nend = 0.05\n"
        ),
    );
    let history = history("ground", &text);
    println!("{} m/s", liveliness(&history));
    assert!(liveliness(&history) < 1e-10, "{}", liveliness(&history));
    let mass = PI * (2000.0 * 0.5 + 1800.0 * 0.25);
    assert!((history.last("mass") / mass - 1.0).abs() < 1e-12);
    let borne = 1000.0 * 9.81 * PI * 0.5;
    assert!((history.last("load_water_y") / borne - 1.0).abs() < 1e-9, "{} N", history.last("load_water_y"));
}

/// Thrust of the water on a plate about the axis and on the rim of the domain: pressure times area.
#[test]
fn water_presses_on_areas_of_revolution() {
    let text = job(
        [1.0, 1.0],
        0.5,
        &format!(
            "face_forces = true\n[water]\nlevel = 0.5\n{SOIL}[[bodies]]\nname = 'ground'\nmaterial = 'soil'\n\
             shape = {{ kind = 'box', min = [0, 0], max = [1, 0.125] }}\n\
             [[colliders]]\nname = 'buoy'\nacts_on = 'nodes'\ncontact.kind = 'slip'\n\
             shape = {{ kind = 'box', min = [-0.5, 0.25], max = [0.5, 0.75] }}\n[time]\nend = 1e-4\n"
        ),
    );
    let history = history("buoy", &text);
    // Archimedes: the water that the part below the level takes the place of.
    let lift = 9810.0 * PI * 0.25 * 0.25;
    assert!((history.last("water_buoy_y") / lift - 1.0).abs() < 1e-6, "{} N", history.last("water_buoy_y"));
    let rim = 9810.0 * TAU * 0.5 * 0.5 * 0.5;
    let found = history.last("water_x_max_x");
    assert!((found / rim - 1.0).abs() < 1e-3, "{found} N, exact {rim} N");
    assert!(history.last("water_x_min_x") == 0.0);
}

/// A cylinder that its rim's pressure squeezes between smooth plates, with water that cannot leave: its stiffness is that of
/// skeleton and water, `2 (λ + μ) + 2 K_w`, so the volume ratio counts the hoop.
#[test]
fn water_that_cannot_leave_stiffens_a_cylinder() {
    let (young, nu, water, pressure) = (1e6, 0.25, 2e6, 1e3);
    let pores = 0.5;
    let text = format!(
        "version = 1\ndimension = 2\ngeometry = 'axisymmetric'\n[domain]\nsize = [1.25, 0.25]\nroot_edge = 0.25\n\
         [boundaries]\nx_max.kind = 'slip'\ny_min.kind = 'slip'\ny_max.kind = 'slip'\n\
         [[materials]]\nname = 'clay'\ndensity = 1800\nmodel = 'hencky'\nyoung = {young}\npoisson = {nu}\n\
         undrained = {{ bulk_modulus = {}, porosity = {pores} }}\n\
         [[bodies]]\nname = 'cylinder'\nmaterial = 'clay'\nshape = {{ kind = 'box', min = [0, 0], max = [1, 0.25] }}\n\
         [[loads]]\nname = 'rim'\nkind = 'pressure'\npressure = {pressure}\nfacing = [1, 0]\n\
         [equilibrium]\nspeed = 1e-5\nacceleration = 1e-3\n[time]\nend = 9\n\
         [output]\npicture = false\n[history]\nevery_steps = 10\n",
        water * pores
    );
    let history = self::history("cylinder", &text);
    let (lambda, mu) = (young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 * young / (1.0 + nu));
    let exact = pressure / (2.0 * (lambda + mu + water));
    // The work of the pressure over its force: the way of the rim.
    let found = history.last("work_rim") / (pressure * TAU * 0.25);
    println!("{found} m, exact {exact} m");
    assert!((found / exact - 1.0).abs() < 0.01, "{found} m, exact {exact} m");
}

fn earth(k: f64) -> String {
    format!(
        "[[materials]]\nname = 'earth'\ndensity = 1800\nsaturated_density = 2000\npermeability = {k:e}\n\
         model = 'hencky'\nyoung = 2e7\npoisson = 0.3\n"
    )
}

/// Flow to a well: confined by a tight bed above it, `2π k b Δh / ln(R/r)` (Thiem), on cells of two sizes; with a free
/// surface `π k (h1² - h2²) / ln(R/r)` (Dupuit), though water leaves through the wall of the well above the level
/// in it. All of the circumference flows.
#[test]
fn wells_have_the_discharge_of_thiem_and_dupuit() {
    let k = 1e-3;
    let fixed = |rest: &str| format!("[time]\nend = 1e-6\n{rest}");
    let confined = job(
        [4.5, 1.0],
        0.5,
        &fixed(&format!(
            "[water.seepage]\nheads = [{{ name = 'well', shape = {{ kind = 'box', min = [0, 0], max = [0.5, 1] }}, level = 2 }}, \
             {{ name = 'far', shape = {{ kind = 'box', min = [4, 0], max = [4.5, 1] }}, level = 5 }}]\n\
             [tree]\nbase_level = 0\n[[tree.regions]]\nlevel = 2\nshape = {{ kind = 'box', min = [0, 0], max = [1.2, 1] }}\n\
             {}[[bodies]]\nname = 'bed'\nmaterial = 'earth'\nshape = {{ kind = 'box', min = [0.5, 0], max = [4, 1] }}\n",
            earth(k)
        )),
    );
    let history = self::history("confined", &confined);
    let exact = TAU * k * 3.0 / 8.0_f64.ln();
    let (into, out) = (history.last("flow_far"), history.last("flow_well"));
    println!("confined: {into} m³/s, exact {exact} m³/s");
    assert!((into / exact - 1.0).abs() < 5e-3, "{into} m³/s, exact {exact} m³/s");
    assert!((into + out).abs() < 1e-8 * exact, "{into} {out}");

    let free = job(
        [4.0, 3.0],
        1.0,
        &fixed(&format!(
            "[water.seepage]\nheads = [{{ name = 'well', shape = {{ kind = 'box', min = [0, 0], max = [0.5, 3] }}, level = 0.5 }}, \
             {{ name = 'far', shape = {{ kind = 'box', min = [3, 0], max = [4, 3] }}, level = 2 }}]\n\
             [tree]\nbase_level = 2\n\
             {}[[bodies]]\nname = 'bed'\nmaterial = 'earth'\nshape = {{ kind = 'box', min = [0.5, 0], max = [3, 2.5] }}\n",
            earth(k)
        )),
    );
    let history = self::history("free", &free);
    let exact = PI * k * (4.0 - 0.25) / 6.0_f64.ln();
    let [into, out, surface] = ["far", "well", "surface"].map(|name| history.last(&format!("flow_{name}")));
    println!("free: {into} m³/s, exact {exact} m³/s");
    assert!((into / exact - 1.0).abs() < 0.03, "{into} m³/s, exact {exact} m³/s");
    assert!((into + out + surface).abs() < 1e-8 * exact && surface < 0.0, "{into} {out} {surface}");
}

const WATER: &str = "[[materials]]\nname = 'water'\ndensity = 1000\nmodel = 'fluid'\nbulk_modulus = 1e5\n";

/// A free jet has the mass, momentum and energy that its source brought, of a whole cylinder.
#[test]
fn a_jet_of_revolution_has_what_its_source_brought() {
    let text = job(
        [0.5, 1.0],
        0.5,
        &format!(
            "[time]\nend = 0.3\n[[probes]]\nname = 'jet'\nquantities = ['centre']\n{WATER}\
             [[sources]]\nname = 'jet'\nmaterial = 'water'\nvelocity = [0, 2]\nuntil = 0.25\n\
             shape = {{ kind = 'box', min = [0, 0.125], max = [0.125, 0.25] }}\n[tree]\nbase_level = 1\n"
        ),
    )
    .replace("gravity = [0, -9.81]", "gravity = [0, 0]");
    let history = history("jet", &text);
    let mass = 1000.0 * PI * 0.125 * 0.125 * 2.0 * 0.25;
    for (column, exact) in
        [("fed_jet", mass), ("mass", mass), ("fed_jet_y", 2.0 * mass), ("momentum_y", 2.0 * mass)]
    {
        let found = history.last(column);
        assert!((found / exact - 1.0).abs() < 1e-10, "{column}: {found}, exact {exact}");
    }
    assert!(history.last("momentum_x").abs() < 1e-9 * mass, "{}", history.last("momentum_x"));
    let front = 0.125 + 1.0 / 64.0 + 2.0 * history.last("time");
    let centre = front - 0.5 * (0.5 - 1.0 / 32.0);
    assert!((history.last("centre_jet_y") - centre).abs() < 1e-9, "{}", history.last("centre_jet_y"));
}

/// The stream of a rate fills a tank: its mass is rate times time, to a layer.
#[test]
fn a_rate_is_that_of_the_whole_circumference() {
    let text = job(
        [0.5, 1.0],
        0.5,
        &format!(
            "[time]\nend = 0.5\n{WATER}[[sources]]\nname = 'tap'\nmaterial = 'water'\nvelocity = [0, -1]\nrate = 20\n\
             shape = {{ kind = 'box', min = [0.1, 0.7], max = [0.2, 0.8] }}\n[tree]\nbase_level = 1\n"
        ),
    );
    let history = history("tap", &text);
    let layer = 1000.0 * PI * 0.04 / 32.0;
    let brought = 20.0 * history.last("time");
    assert!((history.last("fed_tap") - brought).abs() < layer, "{} for {brought}", history.last("fed_tap"));
    assert_eq!(history.last("mass"), history.last("fed_tap"));
    // What has left the source falls, and splashes: momentum along the radius is not kept.
    assert!(history.last("momentum_y") < 0.0);
}

/// Water in a tank, compressed as it is under its weight, stays so, on cells of two sizes.
#[test]
fn still_water_in_a_cylinder_stays_still() {
    let text = job(
        [1.0, 1.0],
        0.5,
        &format!(
            "[time]\nend = 1\n[[probes]]\nname = 'water'\nquantities = ['centre', 'volume']\n\
             {}[tree]\nbase_level = 1\n[[tree.regions]]\nlevel = 2\nshape = {{ kind = 'box', min = [0, 0], max = [0.4, 0.4] }}\n\
             [[bodies]]\nname = 'pool'\nmaterial = 'water'\nshape = {{ kind = 'box', min = [0, 0], max = [1, 0.5] }}\n\
             stress = {{ kind = 'geostatic', k0 = 1 }}\n",
            WATER.replace("1e5", "1e6")
        ),
    );
    let history = history("pool", &text);
    let (centre, speed) = (history.last("centre_water_y"), liveliness(&history));
    println!("centre {centre} m; {speed} m/s");
    assert!((history.last("mass") / (500.0 * PI) - 1.0).abs() < 1e-12);
    // The shape is that under the weight.
    assert!((centre / 0.25 - 1.0).abs() < 2e-3, "{centre} m");
    assert!(speed < 0.02, "{speed} m/s");
}

/// A cylinder of water collapses in a tank, sloshes to the axis and back, and comes to rest: it fills the volume that it
/// had, and the energy falls all the way. The same for a ring of water, which closes to the axis and gains some energy
/// there (docs/known-limits.md).
#[test]
fn a_cylinder_of_water_keeps_its_volume() {
    for (name, inner, outer, area, gain) in
        [("cylinder", 0.0, 0.35, 0.1225, 0.002), ("ring", 0.35, 0.5, 0.1275, 0.04)]
    {
        let text = job(
            [0.5, 1.5],
            0.5,
            &format!(
                "[time]\nend = 4\n[[probes]]\nname = 'water'\nquantities = ['centre', 'volume']\n{WATER}\
                 [tree]\nbase_level = 1\n[[loads]]\nname = 'stilling'\nkind = 'damping'\nrate = 3\nfrom = 2\n\
                 [[bodies]]\nname = 'column'\nmaterial = 'water'\n\
                 shape = {{ kind = 'box', min = [{inner}, 0], max = [{outer}, 0.8] }}\n"
            ),
        );
        let history = history(name, &text);
        let volume = history.last("mass") / 1000.0;
        // Particles of the lattice are whole.
        assert!((volume / (PI * area * 0.8) - 1.0).abs() < 0.06, "{volume} m³");
        let fill = history.last("centre_water_y") / still(volume / (PI * 0.25), 1e5);
        let most = history.column("volume_water").iter().copied().fold(0.0, f64::max) / volume;
        let [kinetic, elastic, weight] =
            ["kinetic_energy", "elastic_energy", "gravitational_energy"].map(|name| history.column(name));
        let (mut least, mut rise) = (f64::INFINITY, 0.0_f64);
        for row in 0..kinetic.len() {
            let energy = kinetic[row] + elastic[row] + weight[row];
            (rise, least) = (rise.max((energy - least) / weight[0]), least.min(energy));
        }
        println!(
            "{name}: fill {fill}, volume {}, at most {most}, rise {rise}",
            history.last("volume_water") / volume
        );
        assert!((0.96..=1.06).contains(&fill), "{name}: fill {fill}");
        assert!((0.95..=1.01).contains(&(history.last("volume_water") / volume)), "{name}");
        assert!(most < 1.3, "{name}: spray fills {most} times the volume");
        assert!(rise <= gain, "{name}: energy rises by {rise}");
    }
}

/// Water sloshes about a moving plunger and falls from a source, with cells that follow its surface: the same bits on any
/// ranks and across a restart.
#[test]
fn water_of_revolution_has_the_same_bits_on_any_ranks() {
    let text = job(
        [0.5, 1.0],
        0.5,
        &format!(
            "[time]\nend = 0.25\n{WATER}[tree]\nbase_level = 2\n\
             [[bodies]]\nname = 'pool'\nmaterial = 'water'\nshape = {{ kind = 'box', min = [0, 0], max = [0.35, 0.5] }}\n\
             [[sources]]\nname = 'tap'\nmaterial = 'water'\nvelocity = [0, -1]\n\
             shape = {{ kind = 'box', min = [0.1, 0.8], max = [0.2, 0.9] }}\n\
             [[colliders]]\nname = 'plunger'\ncontact.kind = 'slip'\nacts_on = 'nodes'\n\
             shape = {{ kind = 'box', min = [-0.06, 0.52], max = [0.06, 1.2] }}\n\
             motion = {{ kind = 'steady', velocity = [0, -0.3] }}\n\
             [adaptivity]\nevery_steps = 5\n[[adaptivity.criteria]]\nkind = 'free_surface'\nlevel = 3\n\
             [checkpoint]\nevery_steps = 80\nkeep = 9\n"
        ),
    );
    restart::assert_same_on_any_ranks(&text, "plunger", |directory, _| {
        let history = History::read(directory, "plunger");
        assert!(history.last("shift_work") != 0.0 && history.last("splits") > 0.0);
    });
}
