//! Free rigid bodies among faces, colliders and each other, through the whole program: rolling and slipping
//! against the closed forms, a body that a table drives, balances of momentum, and the same results on any
//! ranks and threads and across a restart.

use crate::common::history::History;
use crate::common::launch::{job, run, succeed};
use crate::common::restart;

const G: f64 = 9.81;
const SLOPE: f64 = 30.0;

/// Down a slope of 30 degrees: what rolls gains g sin α / (1 + I / m r²), that is 5/7 g sin α for a ball and
/// 2/3 for a cylinder; with friction 0.1 both slip and gain g (sin α - μ cos α). All stay on the slope.
#[test]
fn balls_and_cylinders_roll_and_slip_as_the_closed_forms_say() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let name = "bodies_on_a_slope";
    succeed(&mut run(directory.path(), 1, 2, &job(name), &["--quiet"]));
    let history = History::read(directory.path(), name);
    let (sine, cosine) = SLOPE.to_radians().sin_cos();
    let slips = G * (sine - 0.1 * cosine);
    for (body, exact) in [
        ("rolling_ball", 5.0 / 7.0 * G * sine),
        ("slipping_ball", slips),
        ("rolling_cylinder", 2.0 / 3.0 * G * sine),
        ("slipping_cylinder", slips),
    ] {
        let [x, z] = ["x", "z"].map(|axis| history.last(&format!("position_{body}_{axis}")));
        let time = history.last("time");
        let way = cosine * (x - 0.45) - sine * (z - 1.0 - 0.1 * cosine);
        let gap = sine * (x - 0.4) + cosine * (z - 1.0) - 0.1;
        let error = way / (0.5 * exact * time * time) - 1.0;
        println!("{body}: {way:.5} m, {error:.1e} off; gap {gap:.1e} m");
        assert!(error.abs() < 2e-3 && gap.abs() < 1e-6, "{body}: {error} {gap}");
    }
}

/// A block, a ball and a driven roller on rubber, between walls: each body that is free gains what gravity
/// and its forces give; the roller follows its table; nothing goes through walls.
#[test]
fn bodies_meet_with_the_same_results_in_all_ways_and_across_restart() {
    restart::assert_same_in_all_ways("bodies_that_meet", balances);
}

fn balances(history: &History) {
    let time = history.last("time");
    let ball = 3000.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.06_f64.powi(3);
    for (body, mass, start) in [("block", 12.0, [0.2, 0.0, -1.0]), ("ball", ball, [-1.0, 0.3, 0.0])] {
        for (axis, (start, gravity)) in ["x", "y", "z"].into_iter().zip(start.into_iter().zip([0.0, 0.0, -G]))
        {
            let force = history.integral(&format!("force_{body}_{axis}"), 0.0);
            let gained = mass * (history.last(&format!("velocity_{body}_{axis}")) - start - gravity * time);
            assert!((gained - force).abs() < 1e-9 * mass, "{body} {axis}: {gained} {force}");
        }
    }
    let (times, places) = (history.column("time"), history.column("position_roller_x"));
    for (time, place) in times.iter().zip(places) {
        assert!((place - (0.6 - 0.2 * time)).abs() < 1e-12, "{time} {place}");
    }
    let weight = history.integral("force_roller_z", 0.0) / time;
    let gained = 8.0 * history.last("velocity_roller_z") / time;
    assert!((weight - 8.0 * G - gained).abs() < 1e-9 * weight, "{weight} {gained}");
    let lowest = history.column("position_ball_z").iter().copied().fold(f64::INFINITY, f64::min);
    println!("ball down to {lowest:.4} m; roller at {:.4} m", history.last("position_roller_z"));
    for (body, radius) in [("ball", 0.06)] {
        for (axis, size) in [("x", 0.8), ("y", 0.4)] {
            for &place in history.column(&format!("position_{body}_{axis}")) {
                assert!((radius - 1e-4..=size - radius + 1e-4).contains(&place), "{body} {axis} {place}");
            }
        }
    }
}
