//! Claim: elastic bodies hold together when they are stretched, with default settings: the force of a bar is
//! that of the closed form, particles become two where boxes are wide and one again on unloading, jobs of
//! small strain keep theirs; same bits on any ranks and across a restart; a bar that tears all the same is
//! named at the end.

use crate::common::history::History;
use crate::common::launch::{run, succeed, text};
use crate::common::restart;

/// Young's modulus, Pa, and Poisson's ratio of all bars here.
const YOUNG: f64 = 1e6;
const POISSON: f64 = 0.3;

/// A bar of three cells over its width between two sticky grips, 12 cells apart, that part.
const GRIPS: &str = r#"
version = 1
dimension = 2
[domain]
min = [-3.2, -0.4]
size = [6.4, 0.8]
root_edge = 0.4
[[materials]]
name = "rubber"
density = 1000
model = "neo_hookean"
young = 1e6
poisson = 0.3
[[bodies]]
name = "bar"
material = "rubber"
shape = { kind = "box", min = [-0.8, -0.15], max = [0.8, 0.15] }
velocity = ["max(-1, min(1, x / 0.6))", 0]
[[colliders]]
name = "left"
shape = { kind = "box", min = [-1.2, -0.35], max = [-0.6, 0.35] }
contact = { kind = "sticky" }
motion = { kind = "steady", velocity = [-1, 0] }
[[colliders]]
name = "right"
shape = { kind = "box", min = [0.6, -0.35], max = [1.2, 0.35] }
contact = { kind = "sticky" }
motion = { kind = "steady", velocity = [1, 0] }
[[tracks]]
name = "a"
point = [-0.225, 0.025]
quantities = ["centre"]
[[tracks]]
name = "b"
point = [0.225, 0.025]
quantities = ["centre"]
[time]
end = 1.5
[output]
picture = false
every = 10
[history]
every_steps = 5
"#;

/// A bar that a traction draws out and lets go; with a jump of the level of cells where `tree` says so.
fn pulled(rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\n\
         [domain]\nsize = [6, 1.5]\nroot_edge = 0.5\n[boundaries]\nx_min = {{ kind = 'slip' }}\n\
         [[materials]]\nname = 'rubber'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e6\npoisson = 0.3\n\
         [[bodies]]\nname = 'bar'\nmaterial = 'rubber'\nshape = {{ kind = 'box', min = [0, 0.5], max = [2, 1] }}\n\
         [[loads]]\nname = 'pull'\nkind = 'traction'\nfacing = [1, 0]\n\
         traction = ['2e5 * (1 - cos(6.283185307179586 * min(t, 1)))', 0]\n\
         [[loads]]\nname = 'calm'\nkind = 'damping'\nrate = 4\n\
         [[tracks]]\nname = 'end'\npoint = [1.99, 0.75]\nquantities = ['centre']\n\
         [output]\npicture = false\n{rest}"
    )
}

fn finished(job: &str, name: &str) -> (History, String) {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join(format!("{name}.toml"));
    std::fs::write(&path, job).expect("job");
    let output = succeed(&mut run(directory.path(), 1, 1, &path, &[]));
    (History::read(directory.path(), name), text(&output))
}

/// Nominal stress (Pa) of a neo-Hookean bar in plane strain, free sideways, under a stretch.
fn nominal_stress(stretch: f64) -> f64 {
    let (lambda, mu) =
        (YOUNG * POISSON / (1.0 + POISSON) / (1.0 - 2.0 * POISSON), 0.5 * YOUNG / (1.0 + POISSON));
    let stress = |along: f64, volume: f64| mu * (along * along - 1.0) + lambda * volume.ln();
    let (mut low, mut high) = (0.1, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let is_too_thick = stress(middle, stretch * middle) > 0.0;
        (low, high) = if is_too_thick { (low, middle) } else { (middle, high) };
    }
    stress(stretch, stretch * low) / stretch
}

/// Drawn to 3.5 times its length, a bar still has the force of the closed form for the stretch in its middle;
/// it tears at 2.0 to 2.2 if its particles stay whole. Mass is that of the start to the last bit.
#[test]
fn stretched_bar_has_the_force_of_the_closed_form() {
    let (history, _) = finished(GRIPS, "grips");
    let time = history.column("time");
    for stretch in [1.25, 1.5, 2.0, 2.5, 3.0, 3.45] {
        let end = 0.6 * (stretch - 1.0);
        let rows: Vec<usize> = (0..time.len()).filter(|&i| end - 0.06 < time[i] && time[i] <= end).collect();
        let mean =
            |name: &str| rows.iter().map(|&i| history.column(name)[i]).sum::<f64>() / rows.len() as f64;
        let middle = (mean("centre_b_x") - mean("centre_a_x")) / 0.45;
        let exact = 0.3 * nominal_stress(middle);
        let force = mean("force_right_x").abs();
        println!("{stretch}: {middle:.3} in the middle, force {:+.2} %", 100.0 * (force / exact - 1.0));
        assert!((force / exact - 1.0).abs() < 0.04, "{stretch}: {force} against {exact}");
    }
    assert!(history.last("particles") > 3.0 * history.column("particles")[0], "none was halved");
    assert!(history.column("mass").iter().all(|&mass| mass == history.column("mass")[0]));
}

/// A bar of four cells over its width between grips 24 cells apart holds as a short one does: its force grows
/// to a stretch of 3.6. Where only those particles are halved that are too wide themselves, it tears beside the
/// grips by 3.2.
#[test]
fn long_bar_holds_beside_its_grips() {
    let job = GRIPS
        .replace("min = [-3.2, -0.4]", "min = [-5.2, -0.4]")
        .replace("size = [6.4, 0.8]", "size = [10.4, 0.8]")
        .replace("min = [-0.8, -0.15], max = [0.8, 0.15]", "min = [-1.6, -0.2], max = [1.6, 0.2]")
        .replace("x / 0.6", "x / 1.2")
        .replace("min = [-1.2, -0.35], max = [-0.6, 0.35]", "min = [-2, -0.35], max = [-1.2, 0.35]")
        .replace("min = [0.6, -0.35], max = [1.2, 0.35]", "min = [1.2, -0.35], max = [2, 0.35]")
        .replace("end = 1.5", "end = 3.13");
    let (history, _) = finished(&job, "long");
    let (time, mut before) = (history.column("time"), 0.0);
    for stretch in [1.5, 2.0, 2.5, 3.0, 3.3, 3.6] {
        let end = 1.2 * (stretch - 1.0);
        let rows: Vec<usize> = (0..time.len()).filter(|&i| (time[i] - end).abs() < 0.04).collect();
        let force = rows.iter().map(|&i| history.column("force_right_x")[i]).sum::<f64>() / rows.len() as f64;
        println!("{stretch}: {force:.0} N");
        assert!(force.abs() > 1.04 * before, "{stretch}: {force} N after {before} N");
        before = force.abs();
    }
}

/// A bar whose law softens parts, and the run goes on to its end, with what is left of the bar as it was: all of
/// its mass, no energy from nowhere, and particles within a few times those that it had when it parted.
#[test]
fn bar_that_parts_runs_to_its_end() {
    let (history, told) = finished(&GRIPS.replace("neo_hookean", "hencky"), "parted");
    assert!(
        told.contains("body \"bar\" is in ") && told.contains("hencky, beyond a stretch of 2.7"),
        "{told}"
    );
    let energy = |row: usize| {
        ["kinetic_energy", "elastic_energy"].iter().map(|name| history.column(name)[row]).sum::<f64>()
    };
    let rows = history.column("time").len();
    let parted = (0..rows).max_by(|&a, &b| energy(a).total_cmp(&energy(b))).expect("a row");
    let (time, particles) = (history.column("time"), history.column("particles"));
    println!("parted at {} s with {} J, ends with {} J", time[parted], energy(parted), energy(rows - 1));
    println!("{} particles, then {}", particles[parted], particles[rows - 1]);
    assert!((0.6..1.2).contains(&time[parted]) && time[rows - 1] > 1.49);
    assert!(energy(rows - 1) < 0.8 * energy(parted));
    assert!(particles[rows - 1] < 8.0 * particles[parted]);
    assert!(history.column("mass").iter().all(|&mass| mass == history.column("mass")[0]));
}

/// A bar of four cells over its width between grips that part along a diagonal of the cells.
fn diagonal() -> String {
    let half = 0.5_f64.sqrt();
    let turned = |[x, y]: [f64; 2]| format!("[{}, {}]", half * (x - y), half * (x + y));
    let region = |[left, below]: [f64; 2], [right, above]: [f64; 2]| {
        let corners = [[left, below], [right, below], [right, above], [left, above]].map(turned);
        format!("shape = {{ kind = 'polygon', points = [{}] }}", corners.join(", "))
    };
    let grip = |name: &str, ends: [f64; 2], speed: f64| {
        format!(
            "[[colliders]]\nname = '{name}'\n{}\ncontact = {{ kind = 'sticky' }}\nmotion = {{ kind = 'steady', velocity = [{speed}, {speed}] }}\n",
            region([ends[0], -0.7], [ends[1], 0.7])
        )
    };
    format!(
        "version = 1\ndimension = 2\n[domain]\nmin = [-3.2, -3.2]\nsize = [6.4, 6.4]\nroot_edge = 0.4\n\
         [[materials]]\nname = 'rubber'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e6\npoisson = 0.3\n\
         [[bodies]]\nname = 'bar'\nmaterial = 'rubber'\n{}\n{}{}\
         [time]\nend = 1\n[output]\npicture = false\nevery = 10\n[history]\nevery_steps = 5\n",
        region([-0.5, -0.2], [0.5, 0.2]),
        grip("left", [-1.5, -0.39], -half),
        grip("right", [0.39, 1.5], half),
    )
}

/// Drawn along a diagonal of the cells, a bar holds as one along an axis does: its force grows to a stretch of
/// 3.5. With halves that part along the axes it falls from 3.1 on.
#[test]
fn bar_across_the_cells_holds_as_well() {
    let (history, _) = finished(&diagonal(), "diagonal");
    let (time, mut before) = (history.column("time"), 0.0);
    for stretch in [1.5, 2.0, 2.5, 3.0, 3.5] {
        let end = 0.39 * (stretch - 1.0);
        let rows: Vec<usize> = (0..time.len()).filter(|&i| (time[i] - end).abs() < 0.015).collect();
        let along = |i: usize| history.column("force_right_x")[i] + history.column("force_right_y")[i];
        let force = (0.5_f64.sqrt() * rows.iter().map(|&i| along(i)).sum::<f64>() / rows.len() as f64).abs();
        println!("{stretch}: {force:.0} N");
        assert!(force > 1.1 * before, "{stretch}: {force} N after {before} N");
        before = force;
    }
}

/// Up to a stretch of a sixth nothing is halved.
#[test]
fn small_strains_leave_particles_whole() {
    let (history, said) = finished(&GRIPS.replace("end = 1.5", "end = 0.1"), "grips");
    assert!(history.column("particles").iter().all(|&count| count == history.column("particles")[0]));
    assert!(!said.contains("became two"), "{said}");
}

/// A traction that is set on slowly draws a bar to the length of the closed form, and once it is gone the bar
/// has its length, and most of its particles are whole again.
#[test]
fn pulled_bar_is_as_long_as_theory_says_and_comes_back() {
    let held = pulled("[time]\nend = 2\n[history]\nevery_steps = 20\n").replace(
        "2e5 * (1 - cos(6.283185307179586 * min(t, 1)))",
        "1.336e5 * (1 - cos(3.141592653589793 * min(t, 1)))",
    );
    let (history, _) = finished(&held, "bar");
    let mut stretch = 1.3;
    (0..50).for_each(|_| stretch -= (nominal_stress(stretch) - 2.672e5) / YOUNG);
    let end = history.last("centre_end_x") / history.column("centre_end_x")[0];
    println!("stretch {end:.4}, exact {stretch:.4}");
    assert!((end / stretch - 1.0).abs() < 0.01);

    let (history, said) = finished(&pulled("[time]\nend = 2.5\n[history]\nevery_steps = 20\n"), "bar");
    let (count, centre) = (history.column("particles"), history.column("centre_end_x"));
    let most = count.iter().copied().fold(0.0, f64::max);
    let longest = centre.iter().copied().fold(0.0, f64::max) / centre[0];
    println!("{} to {most} to {} particles, {longest:.3} times as long", count[0], history.last("particles"));
    assert!(longest > 1.4 && most == 2.0 * count[0]);
    assert!(history.last("particles") < 1.35 * count[0]);
    assert!((history.last("centre_end_x") / centre[0] - 1.0).abs() < 0.02);
    assert!(
        said.contains("were stretched so far that they became two") && !said.contains("pieces"),
        "{said}"
    );
}

/// A run that halves, joins and refines gives the same result on any ranks, also from a checkpoint in
/// between.
#[test]
fn halves_are_the_same_on_any_ranks_and_across_restart() {
    let rest = "[time]\nend = 0.7\n[history]\nevery_steps = 20\n[checkpoint]\nevery_steps = 150\nkeep = 99\n";
    let refined = "[adaptivity]\nevery_steps = 10\n[[adaptivity.criteria]]\nkind = 'region'\nlevel = 1\n\
                   shape = { kind = 'box', min = [1.2, 0], max = [2.6, 1.5] }\n";
    let fields = "fields = ['displacement', 'stress']\n";
    for more in [String::new(), format!("[numerics]\ntransfer = 'flip'\n{refined}")] {
        restart::assert_same_on_any_ranks(
            &pulled(&format!("{fields}{rest}{more}")),
            "bar",
            |directory, said| {
                let history = History::read(directory, "bar");
                assert!(history.last("particles") > 1.5 * history.column("particles")[0]);
                assert!(said.contains("became two"), "{said}");
            },
        );
    }
}

/// One particle per cell is too few to hold together beyond a stretch of 2.4: the run says which body has
/// torn.
#[test]
fn torn_bar_is_named() {
    let job =
        GRIPS.replace("material = \"rubber\"\nshape", "material = \"rubber\"\nparticles_per_cell = 1\nshape");
    let (_, said) = finished(&job, "grips");
    assert!(said.contains("body \"bar\" is in "), "{said}");
    assert!(said.contains("pieces, 1 before it was stretched"), "{said}");
}
