//! Waves along the axes of a square and a cube (Wallstedt and Guilkey 2008).
use std::f64::consts::PI;
use std::fmt::Write as _;

use super::{APIC, FLIP, Study, show};
use crate::checked;
use crate::page::Page;
use crate::runs::Runs;

const AMPLITUDE: f64 = 0.05;
/// 2 pi over the period, 1/s.
const FREQUENCY: f64 = 100.0 * PI;
/// Phases of the displacements along the axes.
const PHASES_2D: [f64; 2] = [0.0, PI];
const PHASES_3D: [f64; 3] = [0.0, 2.0 * PI / 3.0, 4.0 * PI / 3.0];
/// Radii of the fine disk and ball of the graded trees, m. Leaves are four cells wide: with fewer than 16 cells in 2D and 12 in 3D all of them would be
/// fine.
const DISK: f64 = 0.3;
const BALL: f64 = 0.2;

/// Where what was at X in the undeformed body is.
fn place(undeformed: f64, phase: f64, time: f64) -> f64 {
    undeformed + AMPLITUDE * (PI * undeformed).sin() * (FREQUENCY * time + phase).sin()
}

/// Where what is at x at the start was in the undeformed body.
fn undeformed(x: f64, phase: f64) -> f64 {
    (0..30).fold(x, |at, _| x - AMPLITUDE * (PI * at).sin() * phase.sin())
}

/// Greatest error of a particle's place over the amplitude, over all outputs of a run, and its processor time (s).
fn error<const D: usize>(
    runs: &Runs,
    job: &str,
    name: &str,
    settings: &[String],
    phases: [f64; D],
) -> (f64, f64) {
    let results = runs.run(job, name, settings);
    let mut worst: f64 = 0.0;
    for number in 1..results.outputs() {
        let time = results.time(number);
        let [places, moved] = ["position", "carried"].map(|field| results.particles(number, field, D));
        // Particles carry their displacement. Those that split know their places in the undeformed body.
        let is_undeformed = phases.map(f64::sin).iter().all(|sine| sine.abs() < 1e-9);
        let counts = results.are_whole(number).into_iter().map(|is_whole| is_whole || is_undeformed);
        for ((x, moved), _) in places.iter().zip(&moved).zip(counts).filter(|(_, counts)| *counts) {
            for (axis, &phase) in phases.iter().enumerate() {
                let exact = place(undeformed(x[axis] - moved[axis], phase), phase, time);
                worst = worst.max((x[axis] - exact).abs() / AMPLITUDE);
            }
        }
    }
    (worst, results.processor)
}

/// Greatest error over the amplitude in the square with FLIP, and the processor time (s).
pub(crate) fn flip(runs: &Runs, level: u32, is_graded: bool) -> (f64, f64) {
    let mut settings: Vec<String> = FLIP.iter().map(|setting| (*setting).to_owned()).collect();
    settings.push(format!("tree.base_level={level}"));
    settings.extend(is_graded.then(|| fine("circle", "[0.5, 0.5]", DISK, level)));
    let name = format!("mms_cost_{level}_{is_graded}");
    error(runs, "verification/axis_aligned_2d", &name, &settings, PHASES_2D)
}

/// Settings of so many cells along the edge: an edge of one root octant or of several.
fn cells(count: usize) -> (Vec<String>, u32) {
    let roots = [3, 5].into_iter().find(|roots| count.is_multiple_of(*roots)).unwrap_or(1);
    let level = (count / (4 * roots)).ilog2();
    let root = format!("domain.root_edge={:?}", 1.0 / roots as f64);
    (vec![root, format!("tree.base_level={level}")], level)
}

/// Settings of a refined disk or ball.
fn fine(kind: &str, centre: &str, radius: f64, level: u32) -> String {
    let shape = format!("{{ kind = \"{kind}\", centre = {centre}, radius = {radius} }}");
    format!("tree.regions=[{{ level = {}, shape = {shape} }}]", level + 1)
}

pub(crate) fn square(runs: &Runs, page: &mut Page) {
    page.text(
        "## 2 Manufactured solutions\n\n\
         *Along the axes* ([2D](../jobs/verification/axis_aligned_2d.toml), [3D](../jobs/verification/axis_aligned_3d.toml)): a body force is found from the momentum balance so that \
         u = A sin(pi X) sin(w t + phi) along each axis is exact in the unit square and cube, with A = 0.05, w = pi c, phi = 0 and pi in 2D, 0, 2 pi / 3 and 4 pi / 3 in 3D, over one period \
         (Wallstedt and Guilkey 2008; neo-Hookean, E = 10 MPa, nu = 0.3, 1000 kg/m3). The forces of the jobs agree with tables of an independent code. The force belongs to the place X in the undeformed body, which \
         particles carry. The cube is deformed at the start; its particles come from a table, and those that split do not count, as their places at the start are not known. \
         The error is the greatest of any particle at 16 times, over A; Courant number 0.1 in 2D and 0.2 in 3D. Exercises large deformation, forces, and particles that cross cells. *2:1* has cells \
         of half the size in a disk of radius 0.3 or a ball of radius 0.2, counted by the coarse cells. Two controls must not converge: *fixed boxes*, which do not follow the stretch, and *linear hats*, boxes of a \
         hundredth of the distance between particles (particles of a table, with volumes and density so that the masses are the same).\n",
    );
    let fixed = [FLIP[0], FLIP[1], "numerics.boxes=\"fixed\""];
    let hats =
        [FLIP[0], FLIP[1], "materials[0].density=1e4", "materials[0].young=1e8", "bodies[0].velocity=[0, 0]"];
    let cases: [(&str, &[&str], bool); 6] = [
        ("flip", &FLIP, false),
        ("apic", &APIC, false),
        ("flip_2_1", &FLIP, true),
        ("apic_2_1", &APIC, true),
        ("fixed", &fixed, false),
        ("hats", &hats, false),
    ];
    let mut studies = Vec::new();
    for (name, numerics, is_graded) in cases {
        // With the disk, 32 cells have 64 in it.
        let meshes: &[usize] = match (runs.is_full(), is_graded) {
            (true, false) => &[8, 16, 32, 64],
            (false, false) => &[8, 16, 32],
            (true, true) => &[16, 24, 32],
            (false, true) => &[16, 32],
        };
        let points = meshes.iter().map(|&count| {
            let (mut settings, level) = cells(count);
            settings.extend(numerics.iter().map(|setting| (*setting).to_owned()));
            settings.extend(is_graded.then(|| fine("circle", "[0.5, 0.5]", DISK, level)));
            let run = format!("mms_{name}_{count}");
            if name == "hats" {
                let table = runs.folder.join(format!("{run}.csv"));
                checked(std::fs::create_dir_all(&runs.folder));
                checked(std::fs::write(&table, points_of_square(2 * count)));
                settings.push(format!(
                    "bodies[0].shape={{ kind = \"particles\", file = {:?} }}",
                    table.display().to_string()
                ));
            }
            (count as f64, error(runs, "verification/axis_aligned_2d", &run, &settings, PHASES_2D).0)
        });
        let study = Study { name: name.replace("_2_1", ", 2:1"), points: points.collect() };
        // Fixed boxes and hats stall from 32 cells on; with the disk, two meshes are not enough.
        if ["flip", "apic"].contains(&name) || runs.is_full() {
            page.line(&format!("mms.order.{name}"), study.last_order());
        }
        if let Some(at_64) = study.at(64.0).filter(|_| name == "flip" || name == "apic") {
            page.line(&format!("mms.error.{name}"), at_64);
        }
        studies.push(study);
    }
    if runs.is_full() {
        // In longer steps the error in time would show.
        let points = [32, 64].map(|count| {
            let (mut settings, _) = cells(count);
            settings.extend([APIC[0].to_owned(), "time.cfl=0.3".into()]);
            let run = format!("mms_apic_long_{count}");
            (count as f64, error(runs, "verification/axis_aligned_2d", &run, &settings, PHASES_2D).0)
        });
        let study = Study { name: "apic, Courant number 0.3".into(), points: points.into() };
        page.line("mms.order.apic_long", study.last_order());
        studies.push(study);
    }
    show(page, "manufactured", "Along the axes, 2D: greatest error over A", studies);
}

pub(crate) fn cube(runs: &Runs, page: &mut Page) {
    if !runs.is_full() {
        return;
    }
    let cases: [(&str, &[&str], bool); 4] = [
        ("flip", &FLIP, false),
        ("apic", &APIC, false),
        ("flip_2_1", &FLIP, true),
        ("apic_2_1", &APIC, true),
    ];
    let mut studies = Vec::new();
    for (name, numerics, is_graded) in cases {
        let meshes: &[usize] = if is_graded { &[12, 16] } else { &[4, 8, 12, 16] };
        let points = meshes.iter().map(|&count| {
            let (mut settings, level) = cells(count);
            let run = format!("mms_3d_{name}_{count}");
            let table = runs.folder.join(format!("{run}.csv"));
            let leaf = is_graded.then(|| 4.0 / count as f64);
            checked(std::fs::create_dir_all(&runs.folder));
            checked(std::fs::write(&table, deformed_cube(2 * count, leaf)));
            settings.push(format!("bodies.cube.shape.file={:?}", table.display().to_string()));
            settings.extend(numerics.iter().map(|setting| (*setting).to_owned()));
            settings.extend(is_graded.then(|| fine("sphere", "[0.5, 0.5, 0.5]", BALL, level)));
            (count as f64, error(runs, "verification/axis_aligned_3d", &run, &settings, PHASES_3D).0)
        });
        let study = Study { name: name.replace("_2_1", ", 2:1"), points: points.collect() };
        page.line(&format!("mms_3d.order.{name}"), study.last_order());
        if let Some(at_16) = study.at(16.0) {
            page.line(&format!("mms_3d.error.{name}"), at_16);
        }
        studies.push(study);
    }
    show(page, "manufactured_3d", "Along the axes, 3D: greatest error over A", studies);
}

/// Particles of the square at the start, so many along each axis, with boxes of a hundredth of their distance and a density that makes up for it to
/// 1 kg/m3.
fn points_of_square(count: usize) -> String {
    let mut text = String::from("x,y,volume,velocity_x,velocity_y\n");
    let spacing = 1.0 / count as f64;
    let volume = 1e-4 * spacing * spacing;
    for number in 0..count * count {
        let [x, y] = [number % count, number / count].map(|i| (i as f64 + 0.5) * spacing);
        let [vx, vy] = [(x, PHASES_2D[0]), (y, PHASES_2D[1])]
            .map(|(x, phase)| AMPLITUDE * FREQUENCY * (PI * x).sin() * phase.cos());
        let _ = writeln!(text, "{x},{y},{volume},{vx},{vy}");
    }
    text
}

/// Particles of the cube at the start, so many along each axis; with leaves of this edge those that meet the ball are refined, and particles in them
/// are eight.
fn deformed_cube(count: usize, leaf: Option<f64>) -> String {
    let mut text = String::from(
        "x,y,z,volume,velocity_x,velocity_y,velocity_z,f_xx,f_xy,f_xz,f_yx,f_yy,f_yz,f_zx,f_zy,f_zz\n",
    );
    let start = |at: [f64; 3]| -> [f64; 3] { std::array::from_fn(|a| place(at[a], PHASES_3D[a], 0.0)) };
    let spacing = 1.0 / count as f64;
    for number in 0..count.pow(3) {
        let index = [number % count, number / count % count, number / count.pow(2)];
        let at = index.map(|i| (i as f64 + 0.5) * spacing);
        let is_fine = leaf.is_some_and(|edge| {
            let beyond = start(at).map(|x| {
                let lower = (x / edge).floor() * edge;
                (lower - 0.5).max(0.5 - lower - edge).max(0.0)
            });
            beyond.iter().map(|d| d * d).sum::<f64>() <= BALL * BALL
        });
        let parts = if is_fine { 2 } else { 1 };
        let width = spacing / parts as f64;
        for part in 0..parts * parts * parts {
            let part = [part % parts, part / parts % parts, part / (parts * parts)];
            let at: [f64; 3] =
                std::array::from_fn(|a| index[a] as f64 * spacing + (part[a] as f64 + 0.5) * width);
            let x = start(at);
            let velocity: [f64; 3] =
                std::array::from_fn(|a| AMPLITUDE * FREQUENCY * (PI * at[a]).sin() * PHASES_3D[a].cos());
            let stretch: [f64; 3] =
                std::array::from_fn(|a| 1.0 + AMPLITUDE * PI * (PI * at[a]).cos() * PHASES_3D[a].sin());
            let volume = width.powi(3) * stretch.iter().product::<f64>();
            let ([x, y, z], [vx, vy, vz], [fx, fy, fz]) = (x, velocity, stretch);
            let _ = writeln!(text, "{x},{y},{z},{volume},{vx},{vy},{vz},{fx},0,0,0,{fy},0,0,0,{fz}");
        }
    }
    text
}
