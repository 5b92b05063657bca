//! Free rigid bodies that turn about any axis, through the whole program: what a body without torque keeps,
//! the balance of momentum and angular momentum of one that falls into sand, and the same bits on any ranks
//! and threads and across a restart.

use crate::common::history::History;
use crate::common::launch::{run, succeed};
use crate::common::restart;

/// The vector with these components in space, along the axes of the body in the job; and back.
fn turned(q: [f64; 4], v: [f64; 3], back: bool) -> [f64; 3] {
    let sign = if back { -1.0 } else { 1.0 };
    let u = [sign * q[1], sign * q[2], sign * q[3]];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let once = cross(u, v);
    let twice = cross(u, once);
    std::array::from_fn(|a| v[a] + 2.0 * (q[0] * once[a] + twice[a]))
}

/// Row by row: orientation, and the angular velocity in space, of a collider.
fn motion(history: &History, name: &str) -> Vec<([f64; 4], [f64; 3])> {
    let column = |what: &str, axis: &str| history.column(&format!("{what}_{name}_{axis}"));
    let q = ["w", "x", "y", "z"].map(|axis| column("orientation", axis));
    let spin = ["x", "y", "z"].map(|axis| column("spin", axis));
    (0..q[0].len()).map(|row| (q.map(|c| c[row]), spin.map(|c| c[row]))).collect()
}

/// A box of 0.3 x 0.2 x 0.1 m that turns nearly about its middle axis: it turns over time and again
/// (Dzhanibekov), while its angular momentum and its energy stay.
#[test]
fn bodies_without_torque_keep_energy_and_angular_momentum() {
    let text = "version = 1\ndimension = 3\n[domain]\nsize = [1.6, 0.8, 0.8]\nroot_edge = 0.8\n\
        [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e6\npoisson = 0.2\n\
        [[bodies]]\nname = 'b'\nmaterial = 'm'\nshape = { kind = 'box', min = [0.2, 0.2, 0.2], max = [0.6, 0.4, 0.4] }\n\
        [[colliders]]\nname = 'top'\nshape = { kind = 'box', min = [1.05, 0.3, 0.35], max = [1.35, 0.5, 0.45] }\n\
        motion = { kind = 'free', mass = 6, angular_velocity = [0.2, 5, 0.1], velocity = [0, 0, 0.02] }\n\
        [time]\nend = 7\n[output]\npicture = false\n[history]\nevery_steps = 5\n";
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("top.toml");
    std::fs::write(&path, text).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "top");
    let moments = [0.5 * (0.04 + 0.01), 0.5 * (0.09 + 0.01), 0.5 * (0.09 + 0.04)];
    let of = |(q, spin): &([f64; 4], [f64; 3])| {
        let own = turned(*q, *spin, true);
        let momentum = turned(*q, std::array::from_fn(|k| moments[k] * own[k]), false);
        (momentum, (0..3).map(|k| 0.5 * moments[k] * own[k] * own[k]).sum::<f64>(), own[1])
    };
    let rows = motion(&history, "top");
    let (first, start, _) = of(&rows[0]);
    let (mut drift, mut loss, mut flips, mut side) = (0.0_f64, 0.0_f64, 0, 1.0);
    for row in &rows {
        let (momentum, energy, about) = of(row);
        drift = (0..3).fold(drift, |most, k| most.max((momentum[k] - first[k]).abs() / 2.5));
        loss = loss.max((energy / start - 1.0).abs());
        // Seen from the body, the angular velocity turns to the other side.
        if about * side < -2.0 {
            (flips, side) = (flips + 1, -side);
        }
    }
    println!("{flips} somersaults in {} rows; angular momentum {drift:.1e}, energy {loss:.1e}", rows.len());
    assert!(flips >= 2 && drift < 1e-12 && loss < 1e-8, "{flips} {drift} {loss}");
    let way = history.last("position_top_z") - 0.4 - 0.02 * history.last("time");
    assert!(way.abs() < 1e-12, "{way}");
}

/// A block of 160 x 120 x 80 mm that falls on an edge into sand gains what its forces and torques give, and
/// comes to rest in it.
#[test]
fn blocks_tumble_with_the_same_bits_in_all_ways_and_across_restart() {
    restart::assert_same_in_all_ways("tumbling_block", balances);
}

/// Momentum and angular momentum of the block are those at the start and what gravity and the sand gave.
fn balances(history: &History) {
    let mass = 8000.0 * 0.16 * 0.12 * 0.08;
    let moments = [0.12_f64.powi(2) + 0.08_f64.powi(2), 0.16_f64.powi(2) + 0.08_f64.powi(2), 0.04]
        .map(|s| mass / 12.0 * s);
    let axis = [1.0, 2.0, 0.5].map(|c: f64| c / 5.25_f64.sqrt());
    let half = 17.5_f64.to_radians();
    let placed = [half.cos(), half.sin() * axis[0], half.sin() * axis[1], half.sin() * axis[2]];
    let rows = motion(history, "block");
    let momentum = |(q, spin): ([f64; 4], [f64; 3])| {
        let own = turned(placed, turned(q, spin, true), true);
        turned(q, turned(placed, std::array::from_fn(|k| moments[k] * own[k]), false), false)
    };
    let (before, after) = (momentum(rows[0]), momentum(rows[rows.len() - 1]));
    let time = history.last("time");
    let mut most = 0.0_f64;
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let torque = history.integral(&format!("torque_block_{axis}"), 0.0);
        let turn = (after[k] - before[k] - torque).abs() / 0.1;
        let start = [0.1, 0.2, -1.0][k];
        let gravity = [0.0, 0.0, -9.81][k];
        let force = history.integral(&format!("force_block_{axis}"), 0.0);
        let gained = mass * (history.last(&format!("velocity_block_{axis}")) - start - gravity * time);
        most = most.max(turn).max((gained - force).abs() / mass);
    }
    let size = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let spin = size(rows[rows.len() - 1].1);
    let speed = size(["x", "y", "z"].map(|axis| history.last(&format!("velocity_block_{axis}"))));
    let (height, turned) = (history.last("position_block_z"), 2.0 * rows[rows.len() - 1].0[0].abs().acos());
    println!(
        "balances to {most:.1e}; {speed:.3} m/s, {spin:.2} rad/s, centre at {height:.3} m, turned by {turned:.2} rad"
    );
    assert!(most < 1e-11, "{most:e}");
    assert!(
        speed < 0.1 && spin < 0.5 && turned > 0.2 && (0.05..0.2).contains(&height),
        "{speed} {spin} {turned} {height}"
    );
}
