//! A job from text to its end, step by step, on one rank: a rubber ball that falls and bounces.
//!
//!     cargo run --release --example run_a_job
use agimp::job::{AnyProblem, Problem};
use agimp::setup;
use agimp::solver::Requests;
use partition::World;

const JOB: &str = r#"
version = 1
dimension = 2
gravity = [0, -9.81]

[domain]
size = [1.0, 1.0]
root_edge = 0.5

[tree]
base_level = 2

[[materials]]
name = "rubber"
density = 1000
model = "neo_hookean"
young = 1e5
poisson = 0.3

[[bodies]]
name = "ball"
material = "rubber"
shape = { kind = "circle", centre = [0.5, 0.4], radius = 0.15 }

[time]
end = 0.4
"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let world = World::init()?;
    let comm = world.comm();
    let problem = match agimp::job::parse(JOB, "ball.toml".as_ref()) {
        Ok(AnyProblem::Two(problem)) => problem,
        Ok(AnyProblem::Three(_)) => return Err("the job is not plane".into()),
        Err(faults) => return Err(format!("{faults:?}").into()),
    };
    let problem: Problem<2> = problem;
    let mut solver = setup::solver(comm, &problem)?;
    println!("time, s  kinetic, J  elastic, J  potential, J");
    while solver.clock.time < problem.time.end {
        solver.step(problem.time.end, Requests::default())?;
        if solver.clock.step.is_multiple_of(200) {
            let totals = solver.particle_totals();
            println!(
                "{:>7.3}  {:>10.3}  {:>10.3}  {:>12.3}",
                solver.clock.time, totals.kinetic, totals.elastic, totals.gravitational
            );
        }
    }
    Ok(())
}
