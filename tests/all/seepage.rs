//! Water that seeps: Darcy's flow through layers, the discharge of a dam, water at rest; ground weighs more as
//! its pores fill.
use std::path::Path;

use crate::common::history::History;
use crate::common::launch::{agimp, run, succeed};
use crate::common::restart;

/// A job with some ground, its water and boundaries.
fn job(domain: &str, water: &str, materials: &str, bodies: &str, rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\n{domain}\n\
         [boundaries]\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_min.kind = 'slip'\ny_max.kind = 'separating'\n\
         [water]\n{water}\n{materials}\n{bodies}\n{rest}\n"
    )
}

fn soil(name: &str, permeability: f64, densities: [f64; 2]) -> String {
    let [density, saturated] = densities;
    format!(
        "[[materials]]\nname = '{name}'\ndensity = {density}\nsaturated_density = {saturated}\n\
         permeability = {permeability:e}\nmodel = 'hencky'\nyoung = 2e7\npoisson = 0.3\n"
    )
}

fn body(name: &str, material: &str, min: [f64; 2], max: [f64; 2]) -> String {
    format!(
        "[[bodies]]\nname = '{name}'\nmaterial = '{material}'\nshape = {{ kind = 'box', min = {min:?}, max = {max:?} }}\n"
    )
}

fn run_in(directory: &Path, text: &str) -> History {
    let path = directory.join("ground.toml");
    std::fs::write(&path, text).expect("job");
    succeed(&mut run(directory, 1, 1, &path, &["--quiet"]));
    History::read(directory, "ground")
}

fn history_of(text: &str) -> History {
    run_in(tempfile::tempdir().expect("temporary directory").path(), text)
}

/// Values of a column and of x and y, of all particles of the first output.
fn at_particles(directory: &Path, field: &str) -> Vec<[f64; 3]> {
    of_output(directory, 0, field)
}

/// The same of another output.
fn of_output(directory: &Path, number: usize, field: &str) -> Vec<[f64; 3]> {
    succeed(agimp(directory).args(["export", "out/ground", "--csv", "--out", "given"]));
    let text = std::fs::read_to_string(directory.join(format!("given/ground_{number:06}.csv")));
    let text = text.expect("a table");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("header").split(',').collect();
    let column = |name: &str| {
        let is_named = |title: &&str| title.split(' ').next() == Some(name);
        header.iter().position(is_named).unwrap_or_else(|| panic!("{name} in {header:?}"))
    };
    let columns = ["x", "y", field].map(column);
    let row = |line: &str| {
        let values: Vec<&str> = line.split(',').collect();
        columns.map(|column| values[column].parse().expect("a number"))
    };
    lines.map(row).collect()
}

const SHORT: &str = "[time]\nend = 1e-6\n[output]\npicture = false\nfields = ['head', 'pore_pressure']\n";

/// Two layers in series, on cells of two sizes: Darcy's flow, and heads that are linear in each.
#[test]
fn flow_through_layers_is_that_of_darcy() {
    let [sand, silt] = [4e-4, 1e-4];
    let materials = soil("sand", sand, [1800.0, 2000.0]) + &soil("silt", silt, [1800.0, 2000.0]);
    let bodies =
        body("left", "sand", [10.0, 0.0], [12.0, 1.0]) + &body("right", "silt", [12.0, 0.0], [14.0, 1.0]);
    let water = "seepage = { heads = [{ name = 'in', face = 'x_min', level = 5 }, { name = 'out', face = 'x_max', level = 2 }] }";
    let rest = format!(
        "[tree]\n[[tree.regions]]\nlevel = 2\nshape = {{ kind = 'box', min = [11.2, 0], max = [12.3, 0.4] }}\n{SHORT}"
    );
    let text = job("min = [10, 0]\nsize = [4, 1]\nroot_edge = 1", water, &materials, &bodies, &rest);
    let directory = tempfile::tempdir().expect("temporary directory");
    let history = run_in(directory.path(), &text);
    let flow = 3.0 / (2.0 / sand + 2.0 / silt);
    for (column, exact) in [("flow_in", flow), ("flow_out", -flow), ("flow_surface", 0.0)] {
        let found = history.last(column);
        assert!((found - exact).abs() < 1e-8 * flow, "{column}: {found} for {exact}");
    }
    let heads = at_particles(directory.path(), "head");
    assert!(heads.len() > 200, "{}", heads.len());
    for [x, y, head] in heads {
        let exact = if x < 12.0 { 5.0 - flow / sand * (x - 10.0) } else { 2.0 + flow / silt * (14.0 - x) };
        assert!((head - exact).abs() < 1e-7, "head {head} at {x}, {y} for {exact}");
    }
}

/// The discharge of a dam with upright faces is that of Dupuit and Charny, k (h1² - h2²) / (2 L), though its free
/// surface is not: water leaves through its face above the tailwater.
#[test]
fn a_dam_discharges_by_its_closed_form() {
    let k = 1e-3;
    let water = "seepage = { heads = [\
        { name = 'reservoir', shape = { kind = 'box', min = [0, 0], max = [1, 3] }, level = 2 },\
        { name = 'tailwater', shape = { kind = 'box', min = [3, 0], max = [4, 3] }, level = 0.5 }] }";
    let materials = soil("earth", k, [1800.0, 2000.0]);
    let dam = body("dam", "earth", [1.0, 0.0], [3.0, 2.5]);
    let rest = format!("[tree]\nbase_level = 2\n{SHORT}");
    let text = job("size = [4, 3]\nroot_edge = 1", water, &materials, &dam, &rest);
    let directory = tempfile::tempdir().expect("temporary directory");
    let history = run_in(directory.path(), &text);
    let exact = k * (4.0 - 0.25) / 4.0;
    let [into, out, surface] =
        ["reservoir", "tailwater", "surface"].map(|name| history.last(&format!("flow_{name}")));
    assert!((into / exact - 1.0).abs() < 0.02, "{into} m³/s for {exact}");
    assert!((into + out + surface).abs() < 1e-8 * exact, "{into} {out} {surface}");
    assert!(surface < -0.1 * exact, "water leaves through the face: {surface}");
    // The free surface falls from the reservoir to a point above the tailwater.
    let wet = at_particles(directory.path(), "pore_pressure");
    let top = |at: f64| {
        let column = wet.iter().filter(|[x, _, pressure]| (x - at).abs() < 0.1 && *pressure > 0.0);
        column.map(|[_, y, _]| *y).fold(0.0, f64::max)
    };
    let [left, middle, right] = [1.1, 2.0, 2.9].map(top);
    assert!(
        left > 1.85 && left < 2.05 && middle < left && right < middle && right > 0.7,
        "{left} {middle} {right}"
    );
}

/// Ground under water with the same head everywhere, as heavy as that water, rests to round-off, on cells of two
/// sizes; one under an upward gradient that bears its weight as well.
#[test]
fn ground_rests_where_water_bears_it() {
    let ground = body("ground", "soil", [3.0, -5.0], [5.0, 0.0]);
    let tree = "[tree]\nbase_level = 1\n[[tree.regions]]\nlevel = 2\nshape = { kind = 'box', min = [3, -2], max = [4, 0] }\n\
        [time]\nend = 0.02\n[output]\npicture = false\n[history]\nevery_steps = 10\n";
    let domain = "min = [3, -5]\nsize = [2, 8]\nroot_edge = 2";
    let above = "shape = { kind = 'box', min = [3, 0], max = [5, 3] }";
    let still = format!("seepage = {{ heads = [{{ name = 'sea', {above}, level = 2.7 }}] }}");
    let upward = format!(
        "seepage = {{ heads = [{{ name = 'foot', face = 'y_min', level = 5 }}, {{ name = 'top', {above}, level = 0 }}] }}"
    );
    for (water, densities, bound) in [(still, [900.0, 1000.0], 1e-12), (upward, [2000.0, 2000.0], 1e-8)] {
        let text = job(domain, &water, &soil("soil", 1e-5, densities), &ground, tree);
        let history = history_of(&text);
        let kinetic = history.column("kinetic_energy").iter().fold(0.0_f64, |most, &e| most.max(e));
        let speed = (2.0 * kinetic / history.last("mass")).sqrt();
        assert!(speed < bound, "{water}: {speed} m/s");
        let borne = history.last("load_water_y") / (9.81 * history.last("mass"));
        assert!((borne - 1.0).abs() < 1e-9, "{water}: {borne} of its weight");
    }
}

/// Ground that starts under its weight, with heads that are the same everywhere, has the stress and the rest that it
/// has under a water table given there: below its surface, at it and above, and also where it comes with a later
/// stage. Cells have two sizes.
#[test]
fn ground_starts_under_its_stress_where_water_is_still() {
    let ground =
        body("ground", "soil", [3.0, -5.0], [5.0, 0.0]) + "stress = { kind = 'geostatic', k0 = 0.45 }\n";
    let tree = "[tree]\nbase_level = 1\n[[tree.regions]]\nlevel = 2\nshape = { kind = 'box', min = [3, -2], max = [4, 0] }\n\
        [output]\npicture = false\nfields = ['pressure']\n[history]\nevery_steps = 10\n";
    let domain = "min = [3, -5]\nsize = [2, 8]\nroot_edge = 2";
    let pressures = |water: &str, ground: &str, stages: &str, output: usize| {
        let text =
            job(domain, water, &soil("soil", 1e-5, [1700.0, 2050.0]), ground, &format!("{tree}{stages}"));
        // Without seepage there is no permeability.
        let text = if water.contains("seepage") { text } else { text.replace("permeability = 1e-5\n", "") };
        let directory = tempfile::tempdir().expect("temporary directory");
        let history = run_in(directory.path(), &text);
        let kinetic = history.column("kinetic_energy").iter().fold(0.0_f64, |most, &e| most.max(e));
        let speed = (2.0 * kinetic / history.last("mass")).sqrt();
        (speed, of_output(directory.path(), output, "pressure"))
    };
    let end = "[time]\nend = 0.02\n";
    let later =
        "[time]\nend = 0.03\n[[stages]]\nname = 'void'\nduration = 0.01\n[[stages]]\nname = 'ground'\n";
    for level in [-1.03, 0.0, 2.5] {
        let place = if level > 0.0 {
            "shape = { kind = 'box', min = [3, 0], max = [5, 3] }"
        } else {
            "face = 'x_min'"
        };
        let seepage = format!("seepage = {{ heads = [{{ name = 'table', {place}, level = {level:?} }}] }}");
        let given = pressures(&format!("level = {level:?}"), &ground, end, 0);
        let later_given = pressures(&format!("level = {level:?}"), &ground, end, 1);
        let found = pressures(&seepage, &ground, end, 0);
        let in_stage = pressures(
            &format!("{seepage}\nstages = ['ground']"),
            &format!("{ground}stage = 'ground'\n"),
            later,
            2,
        );
        // The surface lies on nodes, so that the ground is not quite still in either.
        for (other, given) in [(found, &given), (in_stage, &later_given)] {
            assert!(other.0 < 1.1 * given.0 + 1e-9 && other.0 < 1e-4, "{} and {} m/s", other.0, given.0);
            assert_eq!(other.1.len(), given.1.len());
            for ([.., a], [x, y, b]) in other.1.iter().zip(&given.1) {
                assert!((a - b).abs() < 0.1, "level {level}, ({x}, {y}): {a} Pa for {b}");
            }
        }
    }
}

/// A tight layer takes most of the head: leaves become fine there and nowhere else.
#[test]
fn leaves_are_fine_where_water_seeps_fast() {
    let materials = soil("sand", 1e-4, [2000.0; 2]) + &soil("silt", 1e-6, [2000.0; 2]);
    let bodies = body("base", "sand", [0.0, 0.0], [2.0, 2.0])
        + &body("layer", "silt", [0.0, 2.0], [2.0, 3.0])
        + &body("cover", "sand", [0.0, 3.0], [2.0, 4.0]);
    let water = "seepage = { heads = [{ name = 'foot', face = 'y_min', level = 5 }, \
                 { name = 'top', shape = { kind = 'box', min = [0, 3.9], max = [2, 6] }, level = 4 }] }";
    let rest = "[adaptivity]\nevery_steps = 1\nbuffer = 0\ncriteria = [{ kind = 'head_gradient', level = 2, refine = 0.5 }]\n\
                [tree]\nbase_level = 1\n[time]\nend = 2e-3\n[output]\npicture = false\n";
    let directory = tempfile::tempdir().expect("temporary directory");
    run_in(directory.path(), &job("size = [2, 6]\nroot_edge = 2", water, &materials, &bodies, rest));
    for [x, y, level] in of_output(directory.path(), 1, "leaf_level") {
        assert_eq!(level, if (2.0..3.0).contains(&y) { 2.0 } else { 1.0 }, "({x}, {y})");
    }
}

/// As the table rises through ground, its pores fill: mass and momentum of that water stand in columns of their
/// own, and the ground settles or swells by the change of its effective weight.
#[test]
fn ground_gains_weight_as_the_table_rises() {
    let ground = body("ground", "soil", [3.0, -5.0], [5.0, 0.0])
        + "stress = { kind = 'geostatic', k0 = 0.428571428571 }\n";
    let rest = "[tree]\nbase_level = 1\n[time]\nend = 9\n[output]\npicture = false\n[history]\nevery_steps = 1\n\
        [[probes]]\nname = 'top'\nquantities = ['centre']\nshape = { kind = 'box', min = [4, -0.12], max = [5, 1] }\n\
        [[stages]]\nname = 'dry'\nduration = 0.01\n\
        [[stages]]\nname = 'rise'\nduration = 2\n\
        [[stages]]\nname = 'rest'\nequilibrium = { speed = 1e-7, acceleration = 1e-4 }\n";
    let [dry, full] = [1700.0, 2050.0];
    let domain = "min = [3, -5]\nsize = [2, 8]\nroot_edge = 2";
    let text = job(
        domain,
        "level = [[0.01, -5], [2, 0.3]]",
        &soil("soil", 1e-5, [dry, full]).replace("permeability = 1e-5\n", ""),
        &ground,
        rest,
    );
    let history = history_of(&text);
    let [mass, water] = ["mass", "pore_water"].map(|name| history.column(name));
    for (mass, water) in mass.iter().zip(water) {
        assert!((mass - water - 10.0 * dry).abs() < 1e-9 * dry, "{mass} kg with {water} kg of water");
    }
    assert!((history.last("pore_water") - 10.0 * (full - dry)).abs() < 1e-9 * dry, "all pores are full");
    let centres = history.column("centre_top_y");
    let (m, h) = (2e7 * 0.7 / (1.3 * 0.4), 5.0);
    let swelling = (1000.0 - (full - dry)) * 9.81 * h * h / (2.0 * m);
    let found = centres[centres.len() - 1] - centres[0];
    assert!((found / swelling - 1.0).abs() < 0.01, "{found} m for {swelling} m");
}

/// A head where no ground lies is found before the first step, with its key.
#[test]
fn a_head_without_ground_is_refused() {
    let water = "seepage = { heads = [{ name = 'well', face = 'x_max', level = 2 }] }";
    let dam = body("dam", "earth", [1.0, 0.0], [3.0, 2.5]);
    let text =
        job("size = [4, 3]\nroot_edge = 1", water, &soil("earth", 1e-3, [1800.0, 2000.0]), &dam, SHORT);
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("ground.toml");
    std::fs::write(&path, text).expect("job");
    let output = run(directory.path(), 1, 1, &path, &["--quiet"]).output().expect("a run");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    for part in
        ["ground.toml:", "water.seepage.heads[0]: found no ground below the level of the head \"well\""]
    {
        assert!(message.contains(part), "{message}");
    }
}

/// A level that falls in time, and ground that refines, splits and slides meanwhile.
#[test]
fn same_bits_on_any_ranks_and_across_restart() {
    let text = "version = 1\ndimension = 2\ngravity = [0, -10]\n[domain]\nmin = [-1, 2]\nsize = [2, 2]\nroot_edge = 0.5\n\
        [boundaries]\ny_min = { kind = 'sticky' }\n[numerics]\nf_bar = true\n\
        [water]\nstages = ['wet']\n[water.seepage]\nevery = 0.01\nheads = [\
        { name = 'pond', shape = { kind = 'box', min = [-1, 2], max = [-0.8, 4] }, level = '2.9 - 4 * t' },\
        { name = 'drain', shape = { kind = 'box', min = [0.3, 2], max = [1, 2.1] }, level = 2.05 }]\n\
        [[materials]]\nname = 'sand'\ndensity = 1600\nsaturated_density = 2000\npermeability = 1e-4\nmodel = 'mohr_coulomb'\n\
        young = 1e6\npoisson = 0.3\nfriction_angle = 25\ncohesion = 100\ndilation_angle = 2\n\
        [[bodies]]\nname = 'block'\nmaterial = 'sand'\nshape = { kind = 'box', min = [-0.8, 2], max = [0.4, 3] }\n\
        velocity = [0.2, -0.1]\n\
        [tree]\n[[tree.regions]]\nlevel = 1\nshape = { kind = 'box', min = [-0.5, 2.5], max = [0.3, 3.2] }\n\
        [adaptivity]\nevery_steps = 5\n[[adaptivity.criteria]]\nkind = 'plastic_strain'\nrefine = 0.005\nlevel = 1\n\
        [[adaptivity.criteria]]\nkind = 'head_gradient'\nrefine = 0.5\nlevel = 2\n\
        [[stages]]\nname = 'dry'\nduration = 0.015\n[[stages]]\nname = 'wet'\n\
        [history]\nevery_steps = 5\n[checkpoint]\nevery_steps = 20\nkeep = 99\n[time]\nend = 0.06\n[output]\npicture = false\n\
        fields = ['pore_pressure', 'head', 'total_stress']\n";
    restart::assert_same_on_any_ranks(text, "seepage", |_, _| {});
}

/// A level without a finite value is named with its key; it does not count as open ground.
#[test]
fn a_level_without_a_value_is_named() {
    let water = "[water.seepage]\nheads = [{ name = 'a', face = 'x_min', level = 'ln(y - 2)' }, { name = 'b', face = 'x_max', level = 0.1 }]";
    let text = job(
        "size = [1, 1]\nroot_edge = 0.5",
        "",
        &soil("soil", 1e-4, [1800.0; 2]),
        &body("ground", "soil", [0.0; 2], [1.0, 0.5]),
        "[time]\nend = 0.1\n",
    )
    .replace("[water]\n", water);
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("ground.toml");
    std::fs::write(&path, text).expect("job");
    for command in ["check", "run"] {
        let output = agimp(directory.path()).arg(command).arg(&path).output().expect("starts");
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{told}");
        assert!(
            told.contains("water.seepage.heads[0].level: found the value NaN of \"ln(y - 2)\""),
            "{told}"
        );
    }
}
