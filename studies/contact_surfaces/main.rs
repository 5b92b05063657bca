//! Compares two ways to find the normal and the gap between bodies at a node: shares of volume, as the solver does, and logistic regression. Writes
//! a page about it.
//!
//! `studies/contact_surfaces/run` starts it.
use std::fmt::Write as _;
use std::process::ExitCode;

use agimp::boundary::bodies::{Meeting, gap_between, part_in_normals};
use nalgebra::{Matrix3, Vector2, Vector3};

/// Half width of particles, in cells.
const HALF: f64 = 0.25;
/// Positions of the bodies.
const TRIALS: usize = 400;
/// Cells around the node in which bodies have particles: more than the hats of its neighbours reach.
const REACH: f64 = 3.0;
/// Weight of the square of the coefficients beside the squares of the misfits in the regression.
const PENALTY: f64 = 1e-5;

type Point = Vector2<f64>;
/// Normal and gap of two bodies, as one of the ways finds them.
type Found = Option<(Point, f64)>;

/// Two bodies around a node at the origin, and what is right.
struct Scene {
    bodies: [Vec<Point>; 2],
    normal: Point,
    gap: f64,
}

/// Numbers from 0 to 1 that fill their space evenly (additive recurrence with the powers of a root of x^6 = x + 1).
fn sample(trial: usize) -> [f64; 5] {
    std::array::from_fn(|k| (0.5 + trial as f64 * 1.134_724_138_401_519_4_f64.powi(-(k as i32 + 1))).fract())
}

/// Centres of a lattice with this offset inside a shape.
fn lattice(offset: Point, is_inside: impl Fn(&Point) -> bool) -> Vec<Point> {
    let count = (REACH / HALF) as i32;
    let index = move || -count..=count;
    let all =
        index().flat_map(|i| index().map(move |j| Point::new(f64::from(i), f64::from(j)) * (2.0 * HALF)));
    all.map(|x| x + offset).filter(is_inside).collect()
}

/// Half spaces with an inclined joint of this width, on lattices of their own.
fn planes(degrees: f64, gap: f64, trial: usize) -> Scene {
    let [s, a, b, c, d] = sample(trial);
    let normal = Point::new(degrees.to_radians().cos(), degrees.to_radians().sin());
    let place = s - 0.5;
    let offsets = match degrees == 0.0 {
        // Boxes end at the surfaces.
        true => [Point::new(place - HALF, a), Point::new(place + gap + HALF, b)],
        false => [Point::new(a, b), Point::new(c, d)],
    };
    let offsets = offsets.map(|offset| offset.map(|x| x.rem_euclid(2.0 * HALF)));
    let first = lattice(offsets[0], |x| normal.dot(x) < place);
    let second = lattice(offsets[1], |x| normal.dot(x) > place + gap);
    Scene { bodies: [first, second], normal, gap }
}

/// A half space below, whose boxes end at its surface.
fn ground(place: f64, a: f64) -> Vec<Point> {
    let offset = Point::new(a, place - HALF).map(|x| x.rem_euclid(2.0 * HALF));
    lattice(offset, |x| x.y < place)
}

/// A disk of this radius that touches the ground.
fn disk(radius: f64, trial: usize) -> Scene {
    let [s, a, b, c, d] = sample(trial);
    let (place, centre) = (s - 0.5, Point::new(d - 0.5, s - 0.5 + radius));
    let offset = Point::new(b, c).map(|x| x.rem_euclid(2.0 * HALF));
    let disk = lattice(offset, |x| (x - centre).norm() < radius);
    Scene { bodies: [ground(place, a), disk], normal: Point::y(), gap: 0.0 }
}

/// A square on its tip, with the tip at this height above the ground.
fn tip(gap: f64, trial: usize) -> Scene {
    let [s, a, b, ..] = sample(trial);
    let (place, tip) = (s - 0.5, Point::new(b - 0.5, s - 0.5 + gap));
    let edge = (0..2 * (REACH / HALF) as i32).map(|i| f64::from(2 * i + 1) * HALF);
    let square =
        edge.clone().flat_map(|u| edge.clone().map(move |v| Point::new(u - v, u + v) / 2.0_f64.sqrt()));
    let square = square.map(|x| x + tip).collect();
    Scene { bodies: [ground(place, a), square], normal: Point::y(), gap }
}

/// Weight of a box around the point and its slope with the place of the point, along one axis.
fn weight(x: f64) -> [f64; 2] {
    let d = x.abs();
    let [value, slope] = match d {
        d if d < HALF => [1.0 - (d * d + HALF * HALF) / (2.0 * HALF), -d / HALF],
        d if d < 1.0 - HALF => [1.0 - d, -1.0],
        d if d < 1.0 + HALF => [(1.0 + HALF - d).powi(2) / (4.0 * HALF), -(1.0 + HALF - d) / (2.0 * HALF)],
        _ => [0.0; 2],
    };
    [value, slope * x.signum()]
}

/// `Σ V ∇w` and `Σ V w` of a body at a node.
fn sums(body: &[Point], node: Point) -> ([f64; 2], f64) {
    let volume = 4.0 * HALF * HALF;
    body.iter().map(|x| x - node).fold(([0.0; 2], 0.0), |([gx, gy], sum), x| {
        let ([wx, dx], [wy, dy]) = (weight(x.x), weight(x.y));
        ([gx + volume * dx * wy, gy + volume * wx * dy], sum + volume * wx * wy)
    })
}

/// Normal and gap from shares of volume, by the solver.
fn from_shares([first, second]: &[Vec<Point>; 2]) -> Found {
    let mut smoothed = [0.0; 2];
    for (i, j) in (-1..=1_i32).flat_map(|i| (-1..=1_i32).map(move |j| (i, j))) {
        let at = |body| sums(body, Point::new(f64::from(i), f64::from(j)));
        let ((a, of_first), (b, of_second)) = (at(first), at(second));
        if of_first > 0.0 && of_second > 0.0 {
            let share = 0.25 * 0.5_f64.powi(i.abs() + j.abs());
            let share = share * part_in_normals(gap_between([of_first, of_second]));
            (0..2).for_each(|k| smoothed[k] += share * (a[k] - b[k]));
        }
    }
    let of = |body| sums(body, Point::zeros());
    let meeting = Meeting::<2>::new([of(first), of(second)], smoothed, 1.0, 1.0, 0)?;
    Some((Point::from(meeting.normal), meeting.gap))
}

/// Normal and gap from the plane that separates the particles which reach the node best.
fn from_regression(bodies: &[Vec<Point>; 2]) -> Found {
    let reaches = |x: &&Point| weight(x.x)[0] * weight(x.y)[0] > 0.0;
    let near: [Vec<Point>; 2] = [0, 1].map(|i| bodies[i].iter().filter(reaches).copied().collect());
    let [first, second] = &near;
    if first.is_empty() || second.is_empty() {
        return None;
    }
    let mean = |body: &[Point]| body.iter().sum::<Point>() / body.len() as f64;
    let start = (mean(second) - mean(first)).normalize();
    let mut plane = Vector3::new(start.x, start.y, 0.0);
    for _ in 0..50 {
        let mut matrix = Matrix3::from_diagonal(&Vector3::new(PENALTY, PENALTY, 1e-9));
        let mut rest = Vector3::new(-PENALTY * plane.x, -PENALTY * plane.y, 0.0);
        for (side, x) in first.iter().map(|x| (-1.0, x)).chain(second.iter().map(|x| (1.0, x))) {
            let row = Vector3::new(x.x, x.y, 1.0);
            let label = (0.5 * row.dot(&plane)).tanh();
            let slope = 0.5 * (1.0 - label * label) * row;
            matrix += slope * slope.transpose();
            rest += (side - label) * slope;
        }
        let step = matrix.try_inverse()? * rest;
        plane += step * (4.0 / step.norm()).min(1.0);
        if step.norm() < 1e-5 * plane.norm() {
            break;
        }
    }
    let normal = plane.xy().normalize();
    let least = second.iter().map(|x| normal.dot(x)).fold(f64::INFINITY, f64::min);
    let greatest = first.iter().map(|x| normal.dot(x)).fold(f64::NEG_INFINITY, f64::max);
    Some((normal, least - greatest - 2.0 * HALF * normal.amax()))
}

/// Error of the normal (root mean square), mean error of the gap, and its least and greatest.
fn errors(scene: impl Fn(usize) -> Scene, find: fn(&[Vec<Point>; 2]) -> Found) -> [f64; 4] {
    let found = (0..TRIALS).filter_map(|trial| {
        let Scene { bodies, normal, gap } = scene(trial);
        find(&bodies).map(|(n, g)| (n.dot(&normal).clamp(-1.0, 1.0).acos().to_degrees(), g - gap))
    });
    let found: Vec<(f64, f64)> = found.collect();
    let count = found.len() as f64;
    [
        (found.iter().map(|(angle, _)| angle * angle).sum::<f64>() / count).sqrt(),
        found.iter().map(|(_, gap)| gap).sum::<f64>() / count,
        found.iter().map(|(_, gap)| *gap).fold(f64::INFINITY, f64::min),
        found.iter().map(|(_, gap)| *gap).fold(f64::NEG_INFINITY, f64::max),
    ]
}

fn page() -> Result<String, std::fmt::Error> {
    type Scenes = (&'static str, Box<dyn Fn(usize) -> Scene>);
    let scenes: [Scenes; 10] = [
        ("planes that touch, along an axis", Box::new(|trial| planes(0.0, 0.0, trial))),
        ("at 10 degrees", Box::new(|trial| planes(10.0, 0.0, trial))),
        ("at 27 degrees", Box::new(|trial| planes(27.0, 0.0, trial))),
        ("at 45 degrees", Box::new(|trial| planes(45.0, 0.0, trial))),
        ("planes half a cell apart, along an axis", Box::new(|trial| planes(0.0, 0.5, trial))),
        ("at 27 degrees", Box::new(|trial| planes(27.0, 0.5, trial))),
        ("disk of 4 cells that touches a plane", Box::new(|trial| disk(4.0, trial))),
        ("of 16 cells", Box::new(|trial| disk(16.0, trial))),
        ("square whose tip touches a plane", Box::new(|trial| tip(0.0, trial))),
        ("whose tip is a quarter of a cell inside", Box::new(|trial| tip(-0.25, trial))),
    ];
    let mut page = include_str!("about.md").to_owned();
    writeln!(
        page,
        "| bodies | normal, degrees rms: shares | regression | gap, mean error and range: shares | regression |"
    )?;
    writeln!(page, "|---|---|---|---|---|")?;
    for (name, scene) in scenes {
        let [shares, regression] = [from_shares, from_regression].map(|find| errors(&scene, find));
        let gap =
            |[_, mean, least, greatest]: [f64; 4]| format!("{mean:+.2} ({least:+.2} to {greatest:+.2})");
        let (a, b) = (gap(shares), gap(regression));
        writeln!(page, "| {name} | {:.1} | {:.1} | {a} | {b} |", shares[0], regression[0])?;
    }
    page.push_str(include_str!("findings.md"));
    // The page lies in docs/, its text here.
    Ok(page.replace("../../docs/", ""))
}

fn main() -> ExitCode {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("expected the file of the page to write");
        return ExitCode::from(2);
    };
    let written = page().map_err(|error| error.to_string());
    match written.and_then(|page| std::fs::write(&path, page).map_err(|error| format!("{path}: {error}"))) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
