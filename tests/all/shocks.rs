//! Shocks through the whole program: Sod's tube against the exact solution of its Riemann problem, Noh's
//! problem, gas at rest, a blast; plates of metal, and metal that opens; detonations.
use std::path::Path;

use agimp::material::Parameters;
use agimp::material::driver::Point;

use crate::common::history::History;
use crate::common::launch::{run, succeed};
use crate::common::restart;
use crate::common::runs::particles;

/// A strip of gas along x in slip walls, from 0 to 1.
struct Strip {
    cells: u32,
    /// Keys of the table of numerics beside boxes.
    numerics: &'static str,
    /// Materials and bodies; `{h}` stands for the height.
    matter: &'static str,
    end: f64,
    cfl: f64,
}

impl Strip {
    /// Runs it; returns its history and position along x, density, pressure and velocity along x of its
    /// particles at the end.
    fn run(&self) -> (History, Vec<[f64; 4]>) {
        let Self { cells, numerics, matter, end, cfl } = self;
        let (mut level, mut height) = (0, 4.0 / f64::from(*cells));
        while height < 1.0 / 64.0 - 1e-9 {
            (level, height) = (level + 1, 2.0 * height);
        }
        let matter = matter.replace("{h}", &height.to_string());
        let job = format!(
            "version = 1\ndimension = 2\ndomain = {{ size = [1, {height}], root_edge = {height} }}\n\
             boundaries = {{ x_min.kind = 'slip', x_max.kind = 'slip', y_min.kind = 'slip', y_max.kind = 'slip' }}\n\
             [numerics]\nboxes = 'cell'\n{numerics}\n{matter}[tree]\nbase_level = {level}\n\
             [time]\nend = {end}\ncfl = {cfl}\n[history]\nevery_steps = 5\n\
             [output]\npicture = false\nfields = ['velocity', 'density', 'pressure']\n"
        );
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("strip.toml");
        std::fs::write(&path, job).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        (History::read(directory.path(), "strip"), state(directory.path()))
    }
}

/// Position along x, density, pressure and velocity along x of all particles at the end.
fn state(directory: &Path) -> Vec<[f64; 4]> {
    let of = |field: Option<&str>| particles(directory, "strip", 1, field);
    let (places, velocities) = (of(None), of(Some("velocity")));
    let (densities, pressures) = (of(Some("density")), of(Some("pressure")));
    (0..densities.len()).map(|p| [places[3 * p], densities[p], pressures[p], velocities[3 * p]]).collect()
}

/// Mean of a value over the particles in a piece of the strip.
fn mean(state: &[[f64; 4]], [from, to]: [f64; 2], value: usize) -> f64 {
    let inside: Vec<f64> = state.iter().filter(|p| p[0] > from && p[0] < to).map(|p| p[value]).collect();
    inside.iter().sum::<f64>() / inside.len() as f64
}

/// Sum of the energies at the start, and the greatest change since, over a scale.
fn change_of_energy(history: &History, scale: f64) -> f64 {
    let of = |name: &str| history.column(name);
    let (kinetic, elastic, work) = (of("kinetic_energy"), of("elastic_energy"), of("plastic_work"));
    let (viscous, heat) = (of("viscous_work"), of("viscous_heat"));
    let sum = |row: usize| kinetic[row] + elastic[row] + work[row] + viscous[row] - heat[row];
    (0..kinetic.len()).map(|row| (sum(row) - sum(0)).abs() / scale).fold(0.0, f64::max)
}

const SOD: &str = "[[materials]]\nname = 'dense'\ndensity = 1\nmodel = 'gas'\npressure = 1\n\
    [[materials]]\nname = 'thin'\ndensity = 0.125\nmodel = 'gas'\npressure = 0.1\n\
    [[bodies]]\nname = 'left'\nmaterial = 'dense'\nparticles_per_cell = 4\nshape = { kind = 'box', min = [0, 0], max = [0.5, {h}] }\n\
    [[bodies]]\nname = 'right'\nmaterial = 'thin'\nparticles_per_cell = 4\nshape = { kind = 'box', min = [0.5, 0], max = [1, {h}] }\n";

/// Density, pressure and velocity of Sod's tube at `x` and a time (Toro 2009, section 4): pressure 0.30313
/// and velocity 0.92745 between rarefaction and shock are roots of the pressure function.
fn sod(x: f64, time: f64) -> [f64; 3] {
    const G: f64 = 1.4;
    let (pressure, velocity) = (0.303130178051, 0.927452620049);
    let speed = (x - 0.5) / time;
    if speed > velocity {
        let ratio: f64 = pressure / 0.1;
        let sound = (G * 0.1 / 0.125_f64).sqrt();
        let shock = sound * ((G + 1.0) / (2.0 * G) * ratio + (G - 1.0) / (2.0 * G)).sqrt();
        let share = (G - 1.0) / (G + 1.0);
        let density = 0.125 * (ratio + share) / (share * ratio + 1.0);
        return if speed > shock { [0.125, 0.1, 0.0] } else { [density, pressure, velocity] };
    }
    let sound = G.sqrt();
    let tail = velocity - sound * pressure.powf((G - 1.0) / (2.0 * G));
    if speed < -sound {
        [1.0, 1.0, 0.0]
    } else if speed > tail {
        [pressure.powf(1.0 / G), pressure, velocity]
    } else {
        let ratio = (2.0 - (G - 1.0) * speed / sound) / (G + 1.0);
        [ratio.powf(2.0 / (G - 1.0)), ratio.powf(2.0 * G / (G - 1.0)), 2.0 / (G + 1.0) * (sound + speed)]
    }
}

/// Mean error of the density over cells, each with the mean of its particles.
fn density_error(state: &[[f64; 4]], cells: u32) -> f64 {
    let mut sums = vec![[0.0; 2]; cells as usize];
    for [x, density, ..] in state {
        let sum = &mut sums[((x * f64::from(cells)) as usize).min(cells as usize - 1)];
        *sum = [sum[0] + 1.0, sum[1] + density];
    }
    let error = |(cell, [count, sum]): (usize, &[f64; 2])| {
        assert!(*count > 0.0, "an empty cell");
        (sum / count - sod((cell as f64 + 0.5) / f64::from(cells), 0.2)[0]).abs()
    };
    sums.iter().enumerate().map(error).sum::<f64>() / f64::from(cells)
}

/// Plateaus of Sod's tube on 100 and 200 cells, the order of the error, and the energies. Before viscosity
/// was there, density behind the shock was 3 % too high.
#[test]
fn sods_tube_has_the_plateaus_of_the_exact_solution() {
    let tube =
        |cells: u32, numerics: &'static str| Strip { cells, numerics, matter: SOD, end: 0.2, cfl: 0.5 };
    let mut errors = Vec::new();
    for cells in [100, 200] {
        let (history, state) = tube(cells, "artificial_viscosity = {}").run();
        errors.push(density_error(&state, cells));
        // On both sides of the contact, which is at 0.6855.
        for (piece, density) in [([0.55, 0.65], 0.42632), ([0.72, 0.82], 0.26557)] {
            for (value, exact) in [(1, density), (2, 0.30313), (3, 0.92745)] {
                let found = mean(&state, piece, value);
                assert!((found / exact - 1.0).abs() < 0.012, "{cells} cells, {piece:?}: {found} for {exact}");
            }
        }
        let change = change_of_energy(&history, 1.375 * 4.0 / f64::from(cells));
        assert!(change < 0.005, "{cells} cells: energy changes by {change} of the inner energy");
    }
    println!("mean errors of the density: {errors:?}");
    assert!(errors[1] < 0.005 && errors[0] / errors[1] > 1.6, "{errors:?}");
    // With FLIP the energy errs with the step alone.
    let flip = |cfl: f64| {
        let numerics = "artificial_viscosity = {}\ntransfer = 'flip'\nflip = 1.0";
        let (history, _) = Strip { cfl, ..tube(100, numerics) }.run();
        change_of_energy(&history, 1.375 * 0.04)
    };
    let changes = [flip(0.5), flip(0.25)];
    println!("changes of the energy with FLIP: {changes:?}");
    assert!(changes[0] < 0.003 && changes[1] < 0.7 * changes[0], "{changes:?}");
}

const NOH: &str = "[[materials]]\nname = 'gas'\ndensity = 1\nmodel = 'gas'\nadiabatic_index = 1.6666666666666667\npressure = 1e-6\n\
    [[bodies]]\nname = 'gas'\nmaterial = 'gas'\nparticles_per_cell = 4\nvelocity = [-1, 0]\n\
    shape = { kind = 'box', min = [0, 0], max = [1, {h}] }\n";

/// Cold gas runs against a wall (Noh 1987): a shock travels at 1/3, behind it gas with γ = 5/3 rests with the
/// density 4 and the pressure 4/3. At the wall it is too hot and too thin, as with any such viscosity.
#[test]
fn nohs_gas_comes_to_rest_at_a_wall() {
    let numerics = "artificial_viscosity = {}\ntransfer = 'flip'\nflip = 1.0";
    let mut losses = Vec::new();
    for cfl in [0.5, 0.25] {
        let (history, state) = Strip { cells: 100, numerics, matter: NOH, end: 0.6, cfl }.run();
        let piece = [0.06, 0.16];
        let [density, pressure, velocity] = [1, 2, 3].map(|value| mean(&state, piece, value));
        let at_wall = mean(&state, [0.0, 0.02], 1);
        println!(
            "density {density}, pressure {pressure}, velocity {velocity}; density {at_wall} at the wall"
        );
        assert!((density / 4.0 - 1.0).abs() < 0.02, "density {density}");
        assert!((pressure * 0.75 - 1.0).abs() < 0.01, "pressure {pressure}");
        assert!(velocity.abs() < 0.01, "velocity {velocity}");
        assert!(at_wall > 2.4, "density {at_wall} at the wall");
        let front = state.iter().filter(|p| p[1] > 2.5).map(|p| p[0]).fold(0.0, f64::max);
        assert!((front - 0.2).abs() < 0.015, "shock at {front}");
        let kinetic = 0.5 * 0.04;
        let change = change_of_energy(&history, kinetic);
        assert!(change < 0.012, "energy changes by {change}");
        // Once the shock is steady, FLIP takes energy by the step.
        let row = history.column("time").iter().position(|time| *time >= 0.3).expect("a row");
        let sum = |row: usize| history.column("kinetic_energy")[row] + history.column("elastic_energy")[row];
        losses.push((sum(row) - sum(history.column("time").len() - 1)) / kinetic);
    }
    println!("parts of the energy lost in the second half: {losses:?}");
    assert!(losses[0] < 0.006 && losses[1] < 0.65 * losses[0], "{losses:?}");
}

/// Gas of one pressure and two densities, one of them by its stress at the start, is at rest.
#[test]
fn gas_of_one_pressure_is_at_rest() {
    let matter = "[[materials]]\nname = 'heavy'\ndensity = 1\nmodel = 'gas'\npressure = 2\n\
        [[materials]]\nname = 'light'\ndensity = 0.125\nmodel = 'gas'\npressure = 0.1\n\
        [[bodies]]\nname = 'left'\nmaterial = 'heavy'\nparticles_per_cell = 4\nshape = { kind = 'box', min = [0, 0], max = [0.5, {h}] }\n\
        [[bodies]]\nname = 'right'\nmaterial = 'light'\nparticles_per_cell = 4\nshape = { kind = 'box', min = [0.5, 0], max = [1, {h}] }\n\
        stress = { kind = 'components', xx = -2, yy = -2, zz = -2 }\n";
    let numerics = "artificial_viscosity = {}";
    let (history, state) = Strip { cells: 100, numerics, matter, end: 0.2, cfl: 0.5 }.run();
    for [x, density, pressure, velocity] in state {
        let exact = if x < 0.5 { 1.0 } else { 0.125 };
        assert!((density / exact - 1.0).abs() < 1e-9, "density {density} at {x}");
        assert!((pressure - 2.0).abs() < 1e-9 && velocity.abs() < 1e-9, "{pressure} {velocity} at {x}");
    }
    // More than that of their materials at the start: (2 - 0.1) Pa / 0.4 on half of the volume.
    for energy in history.column("elastic_energy") {
        assert!((energy - 1.9 / 0.4 * 0.5 * 0.04).abs() < 1e-9, "{energy}");
    }
}

/// A hot disk in cold gas, with a tree that follows the shock.
#[test]
fn same_bits_on_any_ranks_and_across_restart() {
    let disk = "{ kind = 'circle', centre = [0.7, 0.9], radius = 0.3 }";
    let text = format!(
        "version = 1\ndimension = 2\ndomain = {{ size = [2, 2], root_edge = 0.5 }}\n\
         boundaries = {{ x_min.kind = 'slip', x_max.kind = 'slip', y_min.kind = 'slip', y_max.kind = 'slip' }}\n\
         [numerics]\nboxes = 'cell'\nartificial_viscosity = {{}}\n\
         [[materials]]\nname = 'hot'\ndensity = 1\nmodel = 'gas'\npressure = 10\n\
         [[materials]]\nname = 'cold'\ndensity = 1\nmodel = 'gas'\npressure = 1\n\
         [[bodies]]\nname = 'fire'\nmaterial = 'hot'\nparticles_per_cell = 4\nshape = {disk}\n\
         [[bodies]]\nname = 'air'\nmaterial = 'cold'\nparticles_per_cell = 4\n\
         shape = {{ kind = 'difference', from = {{ kind = 'box', min = [0, 0], max = [2, 2] }}, remove = [{disk}] }}\n\
         [adaptivity]\nevery_steps = 5\n[[adaptivity.criteria]]\nkind = 'plastic_strain_rate'\nrefine = 0.5\nlevel = 1\n\
         [history]\nevery_steps = 5\n[checkpoint]\nevery_steps = 10\nkeep = 99\n[time]\nend = 0.15\n[output]\npicture = false\n\
         fields = ['density', 'pressure', 'plastic_strain']\n"
    );
    restart::assert_same_on_any_ranks(&text, "blast", |directory, _| {
        let history = History::read(directory, "blast");
        assert!(history.last("particles") > 1.2 * history.column("particles")[0], "nothing was split");
    });
}

/// A plate of copper strikes a rigid wall, which is half of an impact of two such plates: behind the shock,
/// of the speed `c₀ + s u`, are the states of Rankine and Hugoniot.
#[test]
fn a_plate_that_strikes_a_wall_has_the_states_behind_its_shock() {
    let [density, sound, slope] = [8930.0, 3940.0, 1.489];
    let length = 0.01;
    for speed in [500.0, 1000.0] {
        let shock = sound + slope * speed;
        let height = length / 50.0;
        let end = 0.6 * length / shock;
        let job = format!(
            "version = 1\ndimension = 2\ndomain = {{ size = [{length}, {height}], root_edge = {height} }}\n\
             boundaries = {{ x_min.kind = 'slip', x_max.kind = 'separating', y_min.kind = 'slip', y_max.kind = 'slip' }}\n\
             numerics = {{ artificial_viscosity = {{}} }}\n\
             [[materials]]\nname = 'copper'\ndensity = {density}\nmodel = 'von_mises'\nyoung = 1.24e11\npoisson = 0.34\nyield_stress = 1e6\n\
             eos = {{ kind = 'mie_gruneisen', sound_speed = {sound}, slope = {slope}, gruneisen = 2.02 }}\n\
             [[bodies]]\nname = 'plate'\nmaterial = 'copper'\nvelocity = [-{speed}, 0]\n\
             shape = {{ kind = 'box', min = [0, 0], max = [{length}, {height}] }}\n\
             [time]\nend = {end}\n[history]\nevery_steps = 5\n\
             [output]\npicture = false\nfields = ['velocity', 'density', 'pressure']\n"
        );
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("strip.toml");
        std::fs::write(&path, job).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let (history, state) = (History::read(directory.path(), "strip"), state(directory.path()));
        let time = history.last("time");
        let front = (shock - speed) * time;
        let exact = [density * shock / (shock - speed), density * shock * speed];
        for (value, exact) in [(1, exact[0]), (2, exact[1])] {
            let found = mean(&state, [0.3 * front, 0.8 * front], value);
            assert!((found / exact - 1.0).abs() < 0.01, "{speed} m/s: {found} for {exact}");
        }
        let reached = state.iter().filter(|p| p[2] > 0.5 * exact[1]).map(|p| p[0]).fold(0.0, f64::max);
        let found = reached / time + speed;
        assert!((found / shock - 1.0).abs() < 0.01, "{speed} m/s: a shock of {found} for {shock}");
        let change = change_of_energy(&history, history.column("kinetic_energy")[0]);
        assert!(change < 0.01, "{speed} m/s: energy changes by {change}");
    }
}

/// Metal with a tension limit opens there, bears nothing while it is open, and pressure again once it has
/// closed.
#[test]
fn metal_opens_at_its_tension_limit() {
    let text = "model = 'von_mises', young = 1.24e11, poisson = 0.34, yield_stress = 9e7, \
        eos = {kind = 'mie_gruneisen', sound_speed = 3940.0, slope = 1.489, gruneisen = 2.02, tension_limit = 1.2e9}";
    let material = text.parse::<Parameters>().expect("a model").build(8930.0);
    let mut point = Point::new(material.as_ref());
    let mean = |point: &Point<'_>| (point.stress[0] + point.stress[1] + point.stress[2]) / 3.0;
    let (mut greatest, mut booked) = (0.0_f64, 0.0);
    for _ in 0..200 {
        let before = point.work;
        point.stretch([1e-4, 0.0, 0.0]);
        greatest = greatest.max(mean(&point));
        if point.history[1] > 0.0 && booked == 0.0 {
            booked = point.work - before;
        }
    }
    assert!(greatest > 1.18e9 && greatest <= 1.2e9 * 1.02, "{greatest}");
    assert!(point.stress.iter().all(|stress| stress.abs() < 1.0), "{point:?}");
    // p²/2K of the volume, and a little of the shear.
    let energy = 0.5 * 1.2e9 * 1.2e9 / (8930.0 * 3940.0 * 3940.0);
    assert!((booked / energy - 1.0).abs() < 0.1, "{booked} for {energy}");
    let opened = point.history[1];
    assert!((opened - 0.02).abs() < 2e-3, "{opened}");
    for _ in 0..210 {
        point.stretch([-1e-4, 0.0, 0.0]);
        assert!(mean(&point) < 1e6, "{point:?}");
    }
    assert!(point.history[1] == 0.0 && mean(&point) < -1e8, "{point:?}");
}

/// TNT (Lee, Finger and Collins 1973), lit at the lower left corner.
const TNT: &str = "[[materials]]\nname = 'tnt'\ndensity = 1630\nmodel = 'explosive'\na = 3.712e11\nb = 3.231e9\nr1 = 4.15\n\
    r2 = 0.95\nomega = 0.3\nenergy = 7e9\ndetonation_velocity = 6930\nignition = [{ point = [0, 0] }]\n\
    [[bodies]]\nname = 'charge'\nmaterial = 'tnt'\nparticles_per_cell = 4\nshape = { kind = 'box', min = [0, 0], max = [1, {h}] }\n";

/// Pressures behind a plane detonation of TNT that starts at a wall, at shares x/(D t) of its way: the
/// isentrope from the state of Chapman and Jouguet, where the line of Rayleigh of the given D touches it.
fn taylor_wave(shares: &[f64]) -> Vec<f64> {
    let ([a, b, r1, r2, omega], [density, front]) = ([3.712e11, 3.231e9, 4.15, 0.95, 0.3], [1630.0, 6930.0]);
    // At 21 GPa.
    let start = 1.0 - 21e9 / (density * front * front);
    let cold = |v: f64| a * (-r1 * v).exp() + b * (-r2 * v).exp();
    let thermal = (21e9 - cold(start)) * start.powf(1.0 + omega);
    let stiffness = |v: f64| {
        a * r1 * (-r1 * v).exp() + b * r2 * (-r2 * v).exp() + thermal * (1.0 + omega) * v.powf(-2.0 - omega)
    };
    let mut wave = Vec::new();
    let (mut v, mut speed) = (start, front * (1.0 - start));
    let step = 1e-5;
    while speed > 0.0 {
        let sound = (stiffness(v) / density).sqrt();
        wave.push([(speed + v * sound) / front, cold(v) + thermal * v.powf(-1.0 - omega)]);
        (v, speed) = (v + step, speed - step * sound);
    }
    let last = wave[wave.len() - 1];
    shares.iter().map(|share| wave.iter().find(|[at, _]| at <= share).unwrap_or(&last)[1]).collect()
}

/// Behind the front are the states of Taylor's wave, from that of Chapman and Jouguet to rest at the wall,
/// and the energies add up.
#[test]
fn a_detonation_is_followed_by_taylors_wave() {
    let numerics = "artificial_viscosity = {}\ntransfer = 'flip'\nflip = 1";
    let end = 0.9 / 6930.0;
    let strip = Strip { cells: 200, numerics, matter: TNT, end, cfl: 0.5 };
    let (history, state) = strip.run();
    let way = 6930.0 * history.last("time");
    for (share, exact) in [0.3, 0.6, 0.7, 0.8, 0.9].into_iter().zip(taylor_wave(&[0.3, 0.6, 0.7, 0.8, 0.9])) {
        let found = mean(&state, [(share - 0.01) * way, (share + 0.01) * way], 2);
        println!("{share} of the way: {found:.4e} Pa for {exact:.4e}");
        // Half of it with 400 cells.
        assert!((found / exact - 1.0).abs() < 0.05, "{share}: {found} for {exact}");
    }
    let greatest = state.iter().map(|p| p[2]).fold(0.0, f64::max);
    println!("greatest pressure {greatest:.4e} Pa");
    assert!((greatest / 21e9 - 1.0).abs() < 0.1, "{greatest}");
    let reached = state.iter().filter(|p| p[2] > 5e9).map(|p| p[0]).fold(0.0, f64::max);
    assert!((reached / way - 1.0).abs() < 0.015, "a front at {reached} for {way}");
    let change = change_of_energy(&history, 7e9 * way * 0.02);
    println!("energies change by {change:.4} of that of the explosive");
    assert!(change < 0.012, "{change}");
}

/// A charge in sand, with a tree that follows the burn.
#[test]
fn a_charge_has_the_same_bits_on_any_ranks_and_across_restart() {
    let disk = "{ kind = 'circle', centre = [0, 0.9], radius = 0.3 }";
    let text = format!(
        "version = 1\ndimension = 2\ngeometry = 'axisymmetric'\ndomain = {{ size = [2, 2], root_edge = 0.5 }}\n\
         boundaries = {{ x_max.kind = 'slip', y_min.kind = 'slip', y_max.kind = 'slip' }}\n\
         [numerics]\nboxes = 'cell'\nartificial_viscosity = {{}}\n{}\
         [[materials]]\nname = 'sand'\ndensity = 1700\nmodel = 'drucker_prager'\nyoung = 2e9\npoisson = 0.25\nfriction_angle = 35\n\
         [[bodies]]\nname = 'ground'\nmaterial = 'sand'\n\
         shape = {{ kind = 'difference', from = {{ kind = 'box', min = [0, 0], max = [2, 1.5] }}, remove = [{disk}] }}\n\
         [adaptivity]\nevery_steps = 5\n[[adaptivity.criteria]]\nkind = 'plastic_strain'\nrefine = 0.5\nlevel = 1\n\
         [history]\nevery_steps = 5\n[checkpoint]\nevery_steps = 10\nkeep = 99\n[time]\nend = 2e-4\n[output]\npicture = false\n\
         fields = ['density', 'pressure', 'plastic_strain']\n",
        TNT.replace("{ kind = 'box', min = [0, 0], max = [1, {h}] }", disk)
            .replace("point = [0, 0]", "point = [0, 0.8]")
    );
    restart::assert_same_on_any_ranks(&text, "charge", |directory, _| {
        let history = History::read(directory, "charge");
        assert!(history.last("elastic_energy") < 0.0 && history.last("viscous_heat") > 0.0);
        assert!(history.last("particles") != history.column("particles")[0], "nothing was split");
    });
}
