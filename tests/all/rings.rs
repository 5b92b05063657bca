//! Bodies of revolution that are refined while they move, and such bodies in contact: what splits and merges of
//! rings conserve, and closed forms of impact and friction with the areas of whole circumferences.
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use crate::axisymmetry::{history, job, solver};
use crate::common::history::History;
use crate::common::launch::{file, run, succeed};
use crate::common::restart;
use crate::common::runs::particles;
use crate::common::scenarios::{Scenario, alone};
use agimp::adaptivity::resample::cell_fit::Resampling;
use agimp::adaptivity::resample::merge_backoff::RetrySlot;
use agimp::adaptivity::resample::{Limits, ids, merge};
use agimp::kernel::{BoxPolicy, Coordinates, Scheme, Transfer};
use agimp::particle::Chunk;
use agimp::particle::chunk::Layout;
use agimp::solver::{Requests, Solver};
use partition::Comm;

type L = Layout<2>;

pub(crate) const SCENARIOS: &[(&str, Scenario)] =
    &[("split_rings", split_and_merged), ("swept_rings", swept), ("gaps_of_rings", gaps)];

#[test]
fn a_split_keeps_the_field_and_a_merge_restores_the_ring() {
    alone("split_rings");
}

#[test]
fn sweeps_over_a_cylinder_keep_its_motion() {
    alone("swept_rings");
}

#[test]
fn gaps_are_closed_without_loss() {
    alone("gaps_of_rings");
}

/// Mass, volume, axial and radial momentum, and mass times height of centres, over all particles.
fn sums<'a>(chunks: impl IntoIterator<Item = &'a Chunk<2>>) -> [f64; 5] {
    let mut sums = [0.0; 5];
    for chunk in chunks {
        for p in 0..chunk.len() {
            let [m] = chunk.read(L::MASS, p);
            let [half] = chunk.read(L::HALF, p);
            let v: [f64; 2] = chunk.read(L::VELOCITY, p);
            let all = [m, 4.0 * half * half, m * v[1], m * v[0], m * chunk.position(p)[1]];
            sums.iter_mut().zip(all).for_each(|(sum, value)| *sum += value);
        }
    }
    sums
}

fn assert_same_sums(before: &[f64; 5], after: &[f64; 5], tolerance: f64, of: &str) {
    for (number, (a, b)) in before.iter().zip(after).enumerate() {
        assert!((a / b - 1.0).abs() < tolerance, "{of}: sum {number} was {a} and is {b}");
    }
}

const EVERYWHERE: &str = "[[adaptivity.criteria]]\nkind = 'region'\nlevel = 1\n\
    shape = { kind = 'box', min = [9, 9], max = [10, 10] }\n";

/// A cylinder in an affine motion, v_r = a r and v_z = c r + b z at the centres of mass of its rings. Each ring
/// becomes four: their masses are in proportion to their radii and add up to the last bit, their velocities are
/// those of the field at their own centres of mass, from the axis to the rim, so that momentum is kept. The
/// merge restores the ring.
fn split_and_merged(comm: &Comm) {
    let (a, b, c) = (0.3, -0.2, 0.5);
    for (name, transfer) in [("apic", Transfer::Apic), ("tpic", Transfer::Tpic)] {
        for (boxes, policy) in [("volume", BoxPolicy::default()), ("cell", BoxPolicy::Cell)] {
            let body = format!(
                "[adaptivity]\n{EVERYWHERE}[[bodies]]\nname = 'body'\nmaterial = 'rubber'\n\
                 velocity = ['{a} * x', '{b} * y + {c} * x']\nshape = {{ kind = 'box', min = [0, 0], max = [1, 1] }}\n\
                 [numerics]\ntransfer = '{name}'\nboxes = '{boxes}'\n[time]\nend = 1\n"
            );
            let solver = solver(comm, &job([1.0, 1.0], &body).replace("'slip'", "'outflow'"));
            let scheme = Scheme {
                coordinates: Coordinates::Axisymmetric,
                ..Scheme::new(policy, 0.125, transfer, &solver.physics.materials)
            };
            let adaptivity = solver.physics.adaptivity.as_ref();
            let resampling = Resampling::new(adaptivity, &scheme, [1.0; 2]).expect("adaptivity");
            for chunk in &solver.chunks {
                let mut parts = chunk.clone();
                let done = resampling.fit(&mut parts, 1, 0);
                assert_eq!((done.split as usize, parts.len()), (chunk.len(), 4 * chunk.len()));
                assert_same_sums(&sums([chunk]), &sums([&parts]), 2e-14, name);
                let mut families: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
                for p in 0..parts.len() {
                    let (parent, _) = ids::parent::<2>(parts.ids()[p]).expect("a child");
                    families.entry(parent).or_default().push(p);
                }
                for p in 0..chunk.len() {
                    let family = &families[&chunk.ids()[p]];
                    let mass = |p: usize| parts.column(L::MASS)[p];
                    assert_eq!(family.iter().map(|&p| mass(p)).sum::<f64>(), chunk.column(L::MASS)[p]);
                    for &child in family {
                        let x = parts.position(child);
                        let density = mass(child) / (TAU * x[0] * (0.125_f64 / 4.0).powi(2));
                        assert!((density / 1000.0 - 1.0).abs() < 1e-14, "{density} at {x:?}");
                        // Velocities of the start are those at the centres of mass of boxes that tile the body.
                        if policy == BoxPolicy::Cell {
                            continue;
                        }
                        let half: f64 = 0.125 / 8.0;
                        let radius = x[0] + half * half / (3.0 * x[0]);
                        let v: [f64; 2] = parts.read(L::VELOCITY, child);
                        let exact = [a * radius, b * x[1] + c * radius];
                        for k in 0..2 {
                            assert!((v[k] - exact[k]).abs() < 4e-15, "{name}: {v:?} at {x:?}, not {exact:?}");
                        }
                    }
                }
                let limits = Limits { velocity: 0.1, stretch: 1.3, ..Limits::default() };
                let setting = resampling.setting_at(0, RetrySlot::ALL);
                let report = merge(&mut parts, &setting, &limits, None, |_| true, &mut |_| ());
                assert_eq!((report.families as usize, parts.len()), (chunk.len(), chunk.len()));
                for column in 0..L::REALS {
                    let scale = chunk.column(column).iter().fold(1e-3_f64, |most, x| most.max(x.abs()));
                    let scale = if (L::STRESS..L::MASS).contains(&column) { 1e6 } else { scale };
                    for (one, other) in chunk.column(column).iter().zip(parts.column(column)) {
                        assert!(
                            (one - other).abs() < 1e-12 * scale,
                            "{name}, column {column}: {one}, {other}"
                        );
                    }
                }
            }
        }
    }
}

/// Steps, each followed by what is due to tree and particles. Returns the greatest number of particles.
fn advance(solver: &mut Solver<2>, until: f64) -> u64 {
    let mut most = 0;
    while solver.clock.time < until {
        solver.step(until, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
        solver.regrid().unwrap_or_else(|error| panic!("{error}"));
        most = most.max(solver.particle_totals().count);
    }
    most
}

/// A fine slab goes up and down over a cylinder that moves along the axis: rigid, it keeps velocity, shape and
/// stretches with every transfer; when it breathes, mass to the last bit and volume and axial momentum to
/// round-off. In the end it has the rings of the start.
fn swept(comm: &Comm) {
    let slab = "[adaptivity]\nevery_steps = 1\n[[adaptivity.criteria]]\nkind = 'region'\nlevel = 1\n\
        shape = { kind = 'box', min = [-9, -0.3], max = [9, -0.2] }\n\
        motion = [{ time = 0, translation = [0, 0] }, { time = 0.02, translation = [0, 1.5] }, \
        { time = 0.04, translation = [0, 0] }]\n";
    for transfer in ["apic", "tpic", "flip", "xpic"] {
        for velocity in ["[0, 2]", "['0.2 * x', '2 - 0.3 * (y - 0.4)']"] {
            let body = format!(
                "{slab}[[bodies]]\nname = 'body'\nmaterial = 'rubber'\nvelocity = {velocity}\n\
                 shape = {{ kind = 'box', min = [0, 0.25], max = [0.5, 0.5] }}\n\
                 [numerics]\ntransfer = '{transfer}'\n[time]\nend = 1\n"
            );
            let mut solver = solver(comm, &job([1.0, 1.0], &body));
            let (start, before) = (solver.particle_totals(), sums(&solver.chunks));
            let most = advance(&mut solver, 0.09);
            let (end, after) = (solver.particle_totals(), sums(&solver.chunks));
            println!(
                "{transfer}, {velocity}: {} rings, {most} at most, {} at the end",
                start.count, end.count
            );
            println!("{before:?}\n{after:?}");
            assert!(most as f64 > 1.7 * start.count as f64 && end.mass == start.mass, "{most}");
            assert!((after[1] / before[1] - 1.0).abs() < 1e-13, "volume {} {}", before[1], after[1]);
            assert!((after[2] / before[2] - 1.0).abs() < 1e-13, "momentum {} {}", before[2], after[2]);
            if velocity != "[0, 2]" {
                continue;
            }
            assert_eq!(start.count, end.count);
            for chunk in &solver.chunks {
                for p in 0..chunk.len() {
                    let [radial, axial]: [f64; 2] = chunk.read(L::VELOCITY, p);
                    assert!(
                        radial.abs() < 1e-12 && (axial - 2.0).abs() < 1e-12,
                        "{transfer}: {radial} {axial}"
                    );
                    let stretch: [f64; 3] = chunk.read(L::LEFT_CAUCHY_GREEN, p);
                    assert!(stretch.iter().all(|b| (b - 1.0).abs() < 1e-12), "{transfer}: {stretch:?}");
                }
            }
        }
    }
}

/// Rings of sand that are drawn out along a line become two each: mass, volume, axial momentum and the height of
/// the centre are kept.
fn gaps(comm: &Comm) {
    let body = format!(
        "[[materials]]\nname = 'sand'\ndensity = 1600\nmodel = 'drucker_prager'\nyoung = 1e6\npoisson = 0.2\nfriction_angle = 30\n\
         [adaptivity]\nsplit_gap = 1\n{EVERYWHERE}[[bodies]]\nname = 'body'\nmaterial = 'sand'\nvelocity = ['0.3 * x', '2 - x']\n\
         shape = {{ kind = 'box', min = [0, 0.25], max = [1, 0.75] }}\n[time]\nend = 1\n"
    );
    let solver = solver(comm, &job([1.0, 1.0], &body));
    let scheme = Scheme {
        coordinates: Coordinates::Axisymmetric,
        ..Scheme::new(BoxPolicy::default(), 0.125, Transfer::Apic, &solver.physics.materials)
    };
    let resampling =
        Resampling::new(solver.physics.adaptivity.as_ref(), &scheme, [1.0; 2]).expect("adaptivity");
    for chunk in solver.chunks.iter().filter(|chunk| !chunk.is_empty()) {
        let mut parts = chunk.clone();
        parts.carry(3);
        // Three times as long along a line at 30 degrees, and a third as wide.
        let (along, across, n) = (9.0, 1.0 / 9.0, [0.75_f64.sqrt(), 0.5]);
        for (column, (i, j)) in [(0, 0), (1, 1), (0, 1)].into_iter().enumerate() {
            let unit = if i == j { across - 1.0 } else { 0.0 };
            parts.carried_mut(column).iter_mut().for_each(|e| *e = unit + (along - across) * n[i] * n[j]);
        }
        let before = sums([&parts]);
        let done = resampling.fit(&mut parts, 0, 0);
        assert_eq!((done.split as usize, parts.len()), (chunk.len(), 2 * chunk.len()));
        assert_same_sums(&before, &sums([&parts]), 1e-14, "gaps");
        // Halves of a section of 3 to 1/3 of the half width of a cell's fourth are a quarter of the length apart.
        for p in (0..parts.len()).step_by(2) {
            let (x, y) = (parts.position(p), parts.position(p + 1));
            let apart = (y[0] - x[0]).hypot(y[1] - x[1]);
            let whole = parts.position(p)[0] + 0.5 * (y[0] - x[0]);
            let is_at_wall = !(0.07..0.93).contains(&whole);
            assert!((apart / (3.0 * 0.125 / 4.0) - 1.0).abs() < 1e-12 || is_at_wall, "{apart} at {x:?}");
        }
    }
}

/// Sand that collapses under a rubber ring, which lies on it with friction, while rings split, merge, and split
/// where they drift apart: the same bits on any ranks and threads and across a restart.
#[test]
fn results_are_the_same_in_all_ways() {
    restart::assert_same_in_all_ways("adaptive_rings", |history| {
        let [splits, merges] = ["splits", "merges"].map(|name| history.last(name));
        println!("{splits} splits, {merges} merges");
        assert!(splits > 60.0 && merges > 20.0, "{splits} splits, {merges} merges");
        let mass = history.column("mass");
        assert!(mass.iter().all(|m| (m / mass[0] - 1.0).abs() < 1e-14), "{mass:?}");
        assert!(history.column("contact_under_y").iter().any(|force| *force < 0.0));
    });
}

/// Two cylinders that fill a smooth tube meet at 2 × 0.1 m/s: the force between them is `ρ c v π R²` until the
/// waves come back, and both momenta are those of the whole cylinders.
#[test]
fn cylinders_that_meet_press_with_their_whole_area() {
    let body = |name: &str, from: f64, v: f64| {
        format!(
            "[[bodies]]\nname = '{name}'\nmaterial = 'rubber'\nvelocity = [0, {v}]\n\
             shape = {{ kind = 'box', min = [0, {from}], max = [0.5, {}] }}\n",
            from + 1.0
        )
    };
    let text = format!(
        "[tree]\nbase_level = 1\n{}{}[[contact]]\nname = 'ends'\nbetween = ['lower', 'upper']\nfriction = 0.3\n\
         [time]\nend = 0.06\n[history]\nevery_steps = 1\n",
        body("lower", 0.5, 0.1),
        body("upper", 1.5, -0.1)
    );
    let history = history("cylinders", &job([0.5, 3.0], &text));
    let (time, force) = (history.column("time"), history.column("contact_ends_y"));
    let mut found = Vec::new();
    found.extend(time.iter().zip(force).filter(|(t, _)| (0.02..0.045).contains(*t)).map(|(_, f)| -f));
    let mean = found.iter().sum::<f64>() / found.len() as f64;
    let exact = 1000.0 * 36.689_969_285_267_14 * 0.1 * 0.25 * PI;
    println!("force {mean} N, exact {exact} N");
    assert!((mean / exact - 1.0).abs() < 0.01, "{mean}");
    assert!(history.column("contact_ends_x").iter().all(|f| f.abs() < 1e-9 * exact));
    let most = history.column("momentum_y").iter().fold(0.0_f64, |most, p| most.max(p.abs()));
    assert!(most < 1e-12 * 1000.0 * 0.25 * PI * 0.1, "{most}");
}

/// A rod in a tube under an even radial pressure p, both free at their ends, slides with friction μ: the tube
/// presses with `p 2π R (L - h)`, and takes μ times that from the momentum of the rod along the axis, which the
/// tube gets. Nodes at the ends, with half a cell h of the length each, see the empty half of their hats as a gap
/// at first.
#[test]
fn a_rod_in_a_tube_is_slowed_by_the_friction_on_its_circumference() {
    let (pressure, friction, radius, length) = (1e4, 0.3, 0.25, 0.5);
    let body = |name: &str, min: f64, max: f64, v: f64| {
        format!(
            "[[bodies]]\nname = '{name}'\nmaterial = 'rubber'\nvelocity = [0, {v}]\n\
             shape = {{ kind = 'box', min = [{min}, 0.25], max = [{max}, 0.75] }}\n\
             stress = {{ kind = 'components', xx = -{pressure}, zz = -{pressure} }}\n"
        )
    };
    let text = format!(
        "[tree]\nbase_level = 1\n{}{}[[contact]]\nname = 'wall'\nbetween = ['rod', 'tube']\nfriction = {friction}\n\
         [time]\nend = 0.002\n[history]\nevery_steps = 1\n",
        body("rod", 0.0, radius, 1.0),
        body("tube", radius, 0.5, 0.0)
    );
    let history = history("rod", &job([0.5, 1.0], &text));
    let (normal, tangential) = (history.column("contact_wall_x"), history.column("contact_wall_y"));
    let exact = pressure * TAU * radius * (length - 0.0625);
    println!("force {} N, exact {exact} N", -normal[1]);
    assert!((normal[1] / exact + 1.0).abs() < 1e-3, "{}", normal[1]);
    // As the rod shifts, normals at the ends lean.
    for (row, (n, t)) in normal.iter().zip(tangential).enumerate().skip(1) {
        let tolerance = if row == 1 { 1e-6 } else { 0.01 };
        assert!((t / n / friction - 1.0).abs() < tolerance, "row {row}: {t} N, {n} N");
    }
    let momentum = history.column("momentum_y");
    assert!(momentum.iter().all(|p| (p / momentum[0] - 1.0).abs() < 1e-13), "{momentum:?}");
}

/// A cylinder of height h: the map over r has the depth h in all its rings, the innermost too, and none beyond.
#[test]
fn a_map_over_the_radius_has_the_height_of_a_cylinder() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let text = job(
        [1.0, 1.0],
        "[tree]\nbase_level = 1\n[[bodies]]\nname = 'body'\nmaterial = 'rubber'\n\
         shape = { kind = 'box', min = [0, 0], max = [0.75, 0.25] }\n\
         [[maps]]\nname = 'plan'\ncell = 0.125\n[time]\nend = 1e-4\n[history]\nevery_steps = 1\n",
    );
    let path = directory.path().join("plan.toml");
    std::fs::write(&path, text).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let raster = std::fs::read_to_string(file(directory.path(), "plan", ".map_plan_depth.asc")).expect("map");
    let depths: Vec<f64> = (raster.lines().last().expect("a row").split_whitespace())
        .map(|depth| depth.parse().expect("number"))
        .collect();
    assert_eq!(depths.len(), 8);
    assert!(depths[..6].iter().all(|depth| (depth - 0.25).abs() < 1e-6), "{depths:?}");
    assert!(depths[6..].iter().all(|&depth| depth == -9999.0), "{depths:?}");
}

/// The collapse of `jobs/column_collapse_axisymmetric.toml`, of a column that fills coarse cells, with fine cells at the surface and where the sand
/// shears, and coarse ones of twice the size in the core: the radius with 98 % of the mass is that with fine cells
/// throughout.
#[test]
fn a_refined_collapse_runs_as_far_as_with_fine_cells() {
    let path =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/column_collapse_axisymmetric.toml");
    let text = std::fs::read_to_string(path).expect("job");
    let text = text
        .replace("max = [0.097, 0.0873]", "max = [0.096, 0.087]")
        .replace("end = 0.45 ", "end = 0.3 ")
        .replace("every = 0.045", "every = 0.3\nfields = ['mass']");
    let refined = "base_level = 2\n[adaptivity]\nevery_steps = 10\nbuffer = 0\n\
        [[adaptivity.criteria]]\nkind = 'free_surface'\nlevel = 3\n\
        [[adaptivity.criteria]]\nkind = 'plastic_strain_rate'\nlevel = 3\nrefine = 4\ncoarsen = 1.6\n#";
    let runs =
        [("fine", text.clone()), ("refined", text.replace("base_level = 3", refined))].map(|(name, text)| {
            let directory = tempfile::tempdir().expect("temporary directory");
            let path = directory.path().join(format!("{name}.toml"));
            std::fs::write(&path, text).expect("job");
            succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
            let [x, mass] = [None, Some("mass")].map(|field| particles(directory.path(), name, 1, field));
            let mut rings: Vec<(f64, f64)> = x.chunks(3).map(|x| x[0]).zip(mass).collect();
            rings.sort_by(|a, b| a.0.total_cmp(&b.0));
            let total: f64 = rings.iter().map(|ring| ring.1).sum();
            let mut within = 0.0;
            let front = rings.iter().find(|ring| {
                within += ring.1;
                within >= 0.98 * total
            });
            let splits =
                if name == "fine" { 0.0 } else { History::read(directory.path(), name).last("splits") };
            (front.expect("a ring").0, splits, rings.len())
        });
    println!("{runs:?}");
    let [(fine, ..), (refined, splits, _)] = runs;
    assert!(splits > 100.0 && (refined / fine - 1.0).abs() < 0.01, "{refined} m, {fine} m");
}
