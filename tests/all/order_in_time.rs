//! The order of the step: one job with steps of 1, 1/2 and 1/4 of a length against 1/16 of it.

use crate::common::launch::{run, succeed};
use crate::common::runs::particles;

/// Places of all particles after 1.75 periods of a bar at rest on which a force acts from the start, with
/// steps of 1/32 s over `parts`, m. Powers of 2, so that all steps end at the same times.
fn places(numerics: &str, parts: u32) -> Vec<f64> {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/jobs/verification/bar.toml");
    let step = 1.0 / (32.0 * f64::from(parts));
    let settings = [
        "domain.root_edge=2",
        "domain.size=[26, 2]",
        "bodies[0].shape.max=[25, 2]",
        "bodies[0].velocity=[0, 0]",
        "loads=[{ name = 'push', kind = 'body_force', acceleration = ['0.05 * sin(pi / 50 * X)', 0] }]",
        "time.cfl=1",
        "time.end=17.5",
        "output={ every = 17.5, picture = false }",
        numerics,
        &format!("time.dt_max={step:?}"),
    ];
    let settings: Vec<&str> = settings.into_iter().flat_map(|setting| ["--set", setting]).collect();
    let arguments = [&["--quiet", "--out", "out/bar"][..], &settings].concat();
    succeed(&mut run(directory.path(), 1, 1, path.as_ref(), &arguments));
    particles(directory.path(), "bar", 1, None)
}

/// From rest, so that the velocity of the first step counts; with stress, which gives the bar its period.
#[test]
fn a_step_is_of_second_order() {
    for numerics in ["numerics={ transfer = 'flip', flip = 1 }", "numerics={ transfer = 'apic' }"] {
        let exact = places(numerics, 16);
        let errors = [1, 2, 4].map(|parts| {
            let squares =
                places(numerics, parts).into_iter().zip(&exact).map(|(x, exact)| (x - exact).powi(2));
            (squares.sum::<f64>() / exact.len() as f64).sqrt()
        });
        let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
        println!("{numerics}: errors {errors:?} m, orders {orders:?}");
        assert!(orders.iter().all(|order| *order >= 1.8), "{numerics}: orders {orders:?} of {errors:?}");
    }
}
