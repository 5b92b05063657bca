//! One particle of a material along a path of strain: simple shear of a metal that yields.
//!
//!     cargo run --example drive_a_material
use agimp::material::driver::Point;
use agimp::material::{self, Parameters};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The keys of a material as in a job file.
    let parameters: Parameters =
        "model = 'von_mises', young = 2.1e11, poisson = 0.3, yield_stress = 4e8, hardening = 1e9".parse()?;
    let steel = material::build(&parameters, 7850.0);
    let mut point = Point::new(&*steel);
    println!("shear strain  shear stress, Pa  plastic strain");
    for step in 1..=10 {
        // One more 0.1 % of shear.
        point.deform(&[[1.0, 1e-3, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        println!("{:>12.3}  {:>16.4e}  {:>14.4e}", 1e-3 * f64::from(step), point.stress[3], point.history[0]);
    }
    // Yield in shear is at the yield stress over the root of three; hardening adds to it.
    assert!(point.stress[3] > 4e8 / 3.0_f64.sqrt());
    Ok(())
}
