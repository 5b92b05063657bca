//! Fluids through the whole program: viscous flow by its closed form, stable from the first step.

use crate::common::history::History;
use crate::common::launch::{run, succeed};

/// Layers that slide over each other, `v = cos(π y / H)`, are slowed by viscosity alone: velocities fall like `exp(-ν (π/H)² t)`. The
/// viscosity is so great that a first step chosen by sound alone would be longer than all of this.
#[test]
fn layers_of_a_viscous_fluid_slow_down_from_the_first_step() {
    let (depth, viscosity, end) = (0.5, 1e5, 8e-4);
    let job = format!(
        "version = 1\ndimension = 2\n[domain]\nsize = [16, {depth}]\nroot_edge = 0.5\n\
         [boundaries]\ny_min.kind = 'slip'\ny_max.kind = 'slip'\n\
         [[materials]]\nname = 'honey'\ndensity = 1000\nmodel = 'fluid'\nbulk_modulus = 1e5\nviscosity = {viscosity}\ntension = true\n\
         [[bodies]]\nname = 'layers'\nmaterial = 'honey'\nvelocity = ['cos(pi * y / {depth})', 0]\n\
         shape = {{ kind = 'box', min = [0.5, 0], max = [15.5, {depth}] }}\n\
         [tree]\nbase_level = 1\n[time]\nend = {end}\n[output]\npicture = false\n[history]\nevery_steps = 1\n"
    );
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("layers.toml");
    std::fs::write(&path, job).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "layers");
    let (times, energies) = (history.column("time"), history.column("kinetic_energy"));
    assert!(history.last("kinetic_energy") < 0.01 * energies[0], "{energies:?}");
    assert!(energies.windows(2).skip(1).all(|pair| pair[1] < pair[0]), "{energies:?}");
    let rate = viscosity / 1000.0 * (std::f64::consts::PI / depth).powi(2);
    for (time, energy) in times.iter().zip(energies).skip(1) {
        // In the first step there is no stress yet.
        let exact = energies[0] * (-2.0 * rate * (time - times[1])).exp();
        // The ends are free.
        assert!((energy - exact).abs() < 0.02 * energies[0], "{energy} at {time}, exact {exact}");
    }
}
