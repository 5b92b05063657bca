//! Faces of the domain through solver and program: what crosses them is put back, refused, or leaves and is
//! counted; material lets go of faces that pull; states that no material can have end the run.

use crate::common::history::History;
use crate::common::launch::{run, succeed};
use crate::common::relaunch::{ran_if_launched, relaunch};
use crate::common::{launch, restart};
use agimp::job::{Problem, parse};
use agimp::particle::chunk::{Chunk, Layout};
use agimp::setup;
use agimp::solver::{Requests, Solver};
use partition::comm::Comm;

/// A block at rest in a domain whose lower corner lies at (10, 20) m.
fn block_far_from_the_origin(comm: &Comm) -> Solver<2> {
    let text = "version = 1\ndimension = 2\n[domain]\nmin = [10, 20]\nsize = [1, 1]\nroot_edge = 1\n[tree]\nbase_level = 2\n\
                [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.3\n\
                [[bodies]]\nname = 'b'\nmaterial = 'm'\nshape = { kind = 'box', min = [10, 20.25], max = [10.25, 20.5] }\n\
                [time]\nend = 1e3\n[output]\nevery = 1e3\n";
    let problem = parse(text, "faces.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}"));
    let problem = Problem::<2>::try_from(problem).unwrap_or_else(|_| panic!("another dimension"));
    setup::solver(comm, &problem).unwrap_or_else(|error| panic!("{error}"))
}

/// A particle that rounding took through a wall is put back and counted, and the run goes on; further away it
/// has left the domain, and the message has its place in the coordinates of the job.
#[test]
fn rounding_takes_no_particle_out_of_the_domain() {
    let is_test = ran_if_launched(|comm| {
        let mut solver = block_far_from_the_origin(comm);
        let chunk = solver.chunks.iter_mut().find(|chunk| !chunk.is_empty()).expect("particles");
        chunk.column_mut(Layout::<2>::POSITION)[0] = -1e-15;
        solver.step(1e3, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((solver.measured.crossings.put_back, solver.measured.crossings.deleted), (1, 0));
        let chunk = solver.chunks.iter_mut().find(|chunk| !chunk.is_empty()).expect("particles");
        assert!((0.0..1e-12).contains(&chunk.position(0)[0]), "{:?}", chunk.position(0));
        chunk.column_mut(Layout::<2>::POSITION)[0] = -1e-3;
        let error = solver.step(1e3, Requests::default()).expect_err("a particle has left").to_string();
        assert!(error.contains("left the domain at (9.99") && error.contains(", 20."), "{error}");
        assert!(error.contains("1 mm beyond `x_min`"), "{error}");
    });
    if !is_test {
        relaunch(module_path!(), "rounding_takes_no_particle_out_of_the_domain", 1, 60);
    }
}

/// A particle ahead of its body, which is still free to move on, stops at the face. The face gets what the
/// material loses.
#[test]
fn no_particle_passes_a_face_ahead_of_its_body() {
    let is_test = ran_if_launched(|comm| {
        let text = "version = 1\ndimension = 2\n[domain]\nsize = [1, 1]\nroot_edge = 1\n[tree]\nbase_level = 2\n\
                    [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.3\n\
                    [[bodies]]\nname = 'b'\nmaterial = 'm'\nvelocity = [-4, 1]\n\
                    shape = { kind = 'box', min = [0.04375, 0.25], max = [0.29375, 0.5] }\n\
                    [history]\nface_forces = true\n[time]\nend = 1e3\n[output]\nevery = 1e3\n";
        let problem = parse(text, "faces.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}"));
        let problem = Problem::<2>::try_from(problem).unwrap_or_else(|_| panic!("another dimension"));
        let mut solver = setup::solver(comm, &problem).unwrap_or_else(|error| panic!("{error}"));
        let (mass, velocity) = (Layout::<2>::MASS, Layout::<2>::VELOCITY);
        let momentum = |solver: &Solver<2>| {
            let of = |chunk: &Chunk<2>| {
                (0..chunk.len()).map(|p| chunk.column(mass)[p] * chunk.column(velocity)[p]).sum::<f64>()
            };
            solver.chunks.iter().map(of).sum::<f64>()
        };
        let chunk = solver.chunks.iter_mut().find(|chunk| !chunk.is_empty()).expect("particles");
        chunk.column_mut(Layout::<2>::POSITION)[0] = 2e-4;
        let (id, before) = (chunk.ids()[0], momentum(&solver));
        for _ in 0..40 {
            solver.step(1e3, Requests::default()).unwrap_or_else(|error| panic!("{error}"));
        }
        let given = -solver.face_forces()[0][0] * solver.time_of_velocities();
        assert!(given > 0.1 * before.abs());
        assert!((momentum(&solver) - before - given).abs() < 1e-12 * before.abs(), "{given} of {before}");
        assert!(solver.chunks.iter().any(|chunk| chunk.ids().contains(&id)));
        assert_eq!(solver.measured.crossings.put_back, 0);
    });
    if !is_test {
        relaunch(module_path!(), "no_particle_passes_a_face_ahead_of_its_body", 1, 60);
    }
}

/// A state that no material can have ends the run in the step in which it arises, with particle, place and
/// quantity.
#[test]
fn a_broken_state_is_named() {
    let is_test = ran_if_launched(|comm| {
        let cases = [
            (Layout::<2>::LEFT_CAUCHY_GREEN, -1.0, "squared elastic volume ratio"),
            (Layout::<2>::LEFT_CAUCHY_GREEN, f64::INFINITY, "left Cauchy-Green tensor"),
        ];
        for (column, value, quantity) in cases {
            let mut solver = block_far_from_the_origin(comm);
            let chunk = solver.chunks.iter_mut().find(|chunk| !chunk.is_empty()).expect("particles");
            let id = chunk.ids()[5];
            chunk.column_mut(column)[5] = value;
            let error = solver.step(1e3, Requests::default()).expect_err("it is broken").to_string();
            assert!(error.contains(&format!("particle {id} at (10.")), "{error}: not particle {id}");
            assert!(error.contains(&format!(" has {quantity} ")), "{error}: not {quantity}");
        }
    });
    if !is_test {
        relaunch(module_path!(), "a_broken_state_is_named", 1, 60);
    }
}

/// A 2D job with a block of 64 particles of 1 kg, which are numbers without rounding, and what `rest` adds.
fn text(end: f64, velocity: &str, rest: &str) -> String {
    format!(
        "version = 1\ndimension = 2\n[domain]\nmin = [-3.0, 7.0]\nsize = [1.0, 1.0]\nroot_edge = 0.5\n[tree]\nbase_level = 1\n\
         [[materials]]\nname = 'rubber'\ndensity = 1024\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.2\n\
         [[bodies]]\nname = 'body'\nmaterial = 'rubber'\nvelocity = {velocity}\n\
         shape = {{ kind = 'box', min = [-2.5, 7.5], max = [-2.25, 7.75] }}\n\
         [time]\nend = {end}\ndt_max = 1e-3\n[output]\npicture = false\n[history]\nevery_steps = 5\n{rest}\n"
    )
}

/// A block that flies out of the domain through a face of outflow: it keeps its velocity and stays without
/// stress, what is inside and what has left make up the whole at every time, and nothing is left in the end.
/// The same on any ranks and across a restart, which goes on counting.
#[test]
fn a_body_leaves_through_an_outflow() {
    let rest = "[checkpoint]\nevery_steps = 60\nkeep = 9\n[boundaries]\nx_max = { kind = 'outflow' }\n";
    let job = text(0.25, "[4.0, 0.5]", rest).replace("picture = false", "");
    // Some particles have left by the second checkpoint.
    restart::assert_same_on_any_ranks(&job, "body", |directory, told| {
        assert!(told.contains("64 left through outflow faces (64 kg)"), "{told}");
        let telemetry = std::fs::read_to_string(launch::file(directory, "body", ".telemetry.jsonl"));
        assert!(!telemetry.expect("telemetry").contains("null"), "a number is none");
        let history = History::read(directory, "body");
        let column = |name| history.column(name);
        let (mass, left_mass) = (column("mass"), column("left_mass"));
        let (inside, left) = (column("particles"), column("left"));
        let momenta = [column("momentum_x"), column("momentum_y")];
        let (elastic, kinetic) = (column("elastic_energy"), column("kinetic_energy"));
        for row in 0..mass.len() {
            assert_eq!((mass[row] + left_mass[row], inside[row] + left[row]), (64.0, 64.0), "row {row}");
            for (momentum, velocity) in momenta.iter().zip([4.0, 0.5]) {
                assert!((momentum[row] - velocity * mass[row]).abs() <= 1e-11 * mass[row], "row {row}");
            }
            assert!(elastic[row] <= 1e-12 * kinetic[row], "row {row}: {} of {}", elastic[row], kinetic[row]);
        }
        assert!(inside.iter().any(|&n| n > 0.0 && n < 64.0) && inside.last() == Some(&0.0), "{inside:?}");
    });
}

/// Faces let go of what pulls unless the job says otherwise: a block that touches the ceiling falls freely,
/// and one between slip faces hangs there.
#[test]
fn a_block_does_not_hang_from_the_ceiling() {
    let fall = |rest: &str| {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("body.toml");
        let job = text(0.1, "[0, 0]", rest).replace("max = [-2.25, 7.75]", "max = [-2.25, 8.0]");
        std::fs::write(&path, job.replace("dimension = 2", "dimension = 2\ngravity = [0, -10]"))
            .expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let history = History::read(directory.path(), "body");
        let last = |name| history.last(name);
        last("momentum_y") / (last("mass") * -10.0 * history.time_of_velocities())
    };
    assert!((fall("") - 1.0).abs() < 1e-9, "{}", fall(""));
    let held = fall("[boundaries]\ny_max = { kind = 'slip' }\n");
    assert!(held.abs() < 0.2, "{held}");
}

/// An outflow comes before `leaving`, which holds at the other faces.
#[test]
fn other_faces_keep_their_policy() {
    let rest =
        "[boundaries]\nleaving = 'delete'\nx_max = { kind = 'outflow' }\ny_max = { kind = 'outflow' }\n";
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("body.toml");
    std::fs::write(&path, text(0.2, "[4.0, 4.0]", rest)).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "body");
    let last = |name| history.last(name);
    assert_eq!((last("left"), last("deleted"), last("deleted_mass")), (64.0, 0.0, 0.0));
}

/// A bar of rubber, 8 m long, between two faces that absorb waves.
fn bar(motion: &str, more: &str) -> String {
    let face = "{ kind = 'absorbing', p_speed = 10, s_speed = 7.0710678, density = 1000, pressure = 100 }";
    format!(
        "version = 1\ndimension = 2\n[domain]\nsize = [8, 0.5]\nroot_edge = 0.5\n[boundaries]\nx_min = {face}\nx_max = {face}\n\
         y_min = {{ kind = 'slip' }}\ny_max = {{ kind = 'slip' }}\n[[materials]]\nname = 'm'\ndensity = 1000\n\
         model = 'hencky'\nyoung = 1e5\npoisson = 0\n[[bodies]]\nname = 'bar'\nmaterial = 'm'\n\
         shape = {{ kind = 'box', min = [0, 0], max = [8, 0.5] }}\nvelocity = {motion}\n\
         [bodies.stress]\nkind = 'components'\nxx = -100\n{more}"
    )
}

/// A push in the middle runs out at both ends: after the waves have passed, next to nothing of their energy
/// is left.
#[test]
fn waves_leave_through_absorbing_faces() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("bar.toml");
    let job = bar(
        "['0.01 * exp(-2 * (x - 4)^2)', 0]",
        "[time]\nend = 1\n[numerics]\ntransfer = 'flip'\nflip = 1.0\n",
    );
    std::fs::write(&path, job).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let kinetic = History::read(directory.path(), "bar").column("kinetic_energy").to_vec();
    let left = kinetic[kinetic.len() - 1] / kinetic[0];
    println!("{left:e} of the kinetic energy is left");
    assert!(left < 1e-3, "{left}");
}

/// Of a packet of waves at a right angle a face returns less than 1 % of the amplitude at 20 cells to a wave,
/// whatever the time step: the dashpot acts in the middle of it.
#[test]
fn a_face_returns_less_than_a_percent_of_the_amplitude() {
    // A packet cos(k s) exp(-s²/2σ²) that moves to the right, s = x - 1.5, σ = 0.5 m, of waves of 0.6 m at 5
    // m/s.
    let packet = |size: f64, cfl: f64| {
        let slope = "(exp(-2 * (x - 1.5)^2) * (-4 * (x - 1.5) * cos(10.471975512 * (x - 1.5)) - 10.471975512 * sin(10.471975512 * (x - 1.5))))";
        let job = format!(
            "version = 1\ndimension = 2\n[domain]\nsize = [{size}, 0.125]\nroot_edge = 0.125\n\
             [boundaries]\nx_min.kind = 'outflow'\ny_min.kind = 'slip'\ny_max.kind = 'slip'\n\
             x_max = {{ kind = 'absorbing', density = 1000, p_speed = 5, s_speed = 3.5355339059327378 }}\n\
             [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'fixed_corotated'\nyoung = 25000\npoisson = 0\n\
             [[bodies]]\nname = 'b'\nmaterial = 'm'\nshape = {{ kind = 'box', min = [0, 0], max = [{size}, 0.125] }}\n\
             velocity = ['-5e-5 * {slope}', 0]\nstress = {{ kind = 'components', xx = '0.25 * {slope}' }}\n\
             [[tracks]]\nname = 'probe'\npoint = [3.5, 0.0625]\nquantities = ['centre']\n\
             [time]\nend = 1.2\ncfl = {cfl}\n[output]\npicture = false\nrestart = false\n[history]\nevery_steps = 1\n"
        );
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("packet.toml");
        std::fs::write(&path, job).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        let history = History::read(directory.path(), "packet");
        (history.column("time").to_vec(), history.column("centre_probe_x").to_vec())
    };
    for cfl in [0.4, 0.2] {
        let ((times, near), (other_times, far)) = (packet(5.0, cfl), packet(7.5, cfl));
        let start = near[0];
        let amplitude = far.iter().map(|x| (x - start).abs()).fold(0.0, f64::max);
        let mut returned: f64 = 0.0;
        for (i, (time, x)) in times.iter().zip(&near).enumerate().take(far.len()) {
            // Steps are the same but for the speed of particles, 1e-4 of that of waves.
            assert!((time - other_times[i]).abs() < 1e-3 * time.max(1e-9), "{time} and {}", other_times[i]);
            if (0.75..1.2).contains(time) {
                returned = returned.max((x - far[i]).abs());
            }
        }
        println!("Courant number {cfl}: {:.3} % of the amplitude comes back", 100.0 * returned / amplitude);
        assert!(amplitude > 5e-6 && returned < 0.01 * amplitude, "{returned} of {amplitude}");
    }
}

/// Under a lasting stress an absorbing face does not creep, if its pressure is that of the material.
#[test]
fn the_pressure_of_an_absorbing_face_holds() {
    let job = bar(
        "[0, 0]",
        "[time]\nend = 0.5\n[history]\nevery_steps = 5\n[checkpoint]\nevery_steps = 20\nkeep = 99\n",
    );
    restart::assert_same_on_any_ranks(&job, "bar", |directory, _| {
        let history = History::read(directory, "bar");
        let speed = (2.0 * history.last("kinetic_energy") / history.last("mass")).sqrt();
        println!("{speed:e} m/s");
        assert!(speed < 1e-14, "{speed} m/s");
    });
}

/// The silo of `jobs/silo.toml` in cells twice as large: sand runs out at the same rate for more than half of
/// the discharge, as no liquid does, near the rate of Beverloo's law for slots, W = 1.03 ρ √g B^(3/2) per
/// length (R. M. Nedderman, Statics and Kinematics of Granular Materials, 1992); what is inside and what has
/// left are the whole, to the last bit.
#[test]
fn a_silo_discharges_at_a_constant_rate() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let job = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("jobs/silo.toml");
    let options = ["--quiet", "--set", "tree.base_level=1", "--set", "output.every=9", "--end", "2.6"];
    succeed(&mut run(directory.path(), 1, 2, &job, &options));
    let history = History::read(directory.path(), "silo");
    let (time, mass) = (history.column("time"), history.column("mass"));
    let (out, slot) = (history.column("passed_out"), history.column("passed_slot"));
    let whole = mass[0];
    for row in 0..time.len() {
        assert_eq!(mass[row] + out[row], whole, "row {row}");
    }
    assert!(out.iter().zip(slot).all(|(out, slot)| out <= slot));
    // The silo has two such halves.
    let when = |part: f64| {
        let row = slot.iter().position(|&passed| passed >= part * whole).expect("so much has passed");
        (time[row], 2.0 * slot[row])
    };
    let rate = |from: f64, to: f64| {
        let ((start, before), (end, after)) = (when(from), when(to));
        (after - before) / (end - start)
    };
    let (mean, width) = (rate(0.1, 0.6), 2.0 * 0.021_484_375_f64);
    let law = 1500.0 * 9.81_f64.sqrt() * width.powf(1.5);
    println!("{mean} kg/(m s), C = {}", mean / law);
    for tenth in 1..6 {
        let part = 0.1 * f64::from(tenth);
        let slice = rate(part, part + 0.1);
        println!("{part:.1}: {slice}");
        assert!((slice / mean - 1.0).abs() < 0.06, "{slice} against {mean} from {part}");
    }
    // The edge of the slot is as sharp as a cell, and the slot has five and a half of them.
    assert!((0.7..1.3).contains(&(mean / law)), "C = {}", mean / law);
}

/// An output shows the state and changes nothing that the history measures: with refinement, which computes
/// nodes for it, rows at outputs have the forces on faces and of loads that they have without outputs, and
/// without refinement.
#[test]
fn rows_at_outputs_have_the_forces_of_their_steps() {
    let job = |every: f64, adaptivity: &str| {
        format!(
            "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [1, 1]\nroot_edge = 0.5\n\
             [boundaries]\ny_min = {{ kind = 'sticky' }}\n[tree]\nbase_level = 1\n\
             regions = [{{ level = 2, shape = {{ kind = 'box', min = [0.5, 0], max = [1, 0.5] }} }}]\n{adaptivity}\
             [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'hencky'\nyoung = 1e5\npoisson = 0.3\n\
             [[bodies]]\nname = 'b'\nmaterial = 'm'\nshape = {{ kind = 'box', min = [0.25, 0], max = [0.75, 0.3] }}\n\
             [[loads]]\nname = 'grip'\nkind = 'velocity'\nx = 0.1\nshape = {{ kind = 'box', min = [0, 0.25], max = [1, 1] }}\n\
             [[loads]]\nname = 'drag'\nkind = 'damping'\nrate = 1\n\
             [time]\nend = 0.06\n[output]\nevery = {every}\npicture = false\n[history]\nevery_steps = 1\nface_forces = true\n"
        )
    };
    let history = |job: String| {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("block.toml");
        std::fs::write(&path, job).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        History::read(directory.path(), "block")
    };
    let refined = history(job(0.005, "[adaptivity]\n"));
    for other in [history(job(1.0, "[adaptivity]\n")), history(job(0.005, ""))] {
        for column in [
            "time",
            "force_x_min_x",
            "force_y_min_x",
            "force_y_min_y",
            "load_grip_x",
            "load_drag_y",
            "work_grip",
            "work_drag",
        ] {
            let [first, second] = [&refined, &other].map(|history| history.column(column));
            assert!(first == second, "{column}: {first:?} against {second:?}");
        }
    }
}

/// A disk about a point of a plane of symmetry is cut by it: the particles, and so the run, are those of the
/// half disk.
#[test]
fn a_plane_of_symmetry_cuts_bodies() {
    let half = |shape: &str| {
        let directory = tempfile::tempdir().expect("temporary directory");
        let path = directory.path().join("half.toml");
        let text = format!(
            "version = 1\ndimension = 2\ngravity = [0, -9.81]\n[domain]\nsize = [1, 1]\nroot_edge = 0.5\n\
             [boundaries]\nx_min.kind = 'symmetric'\ny_min.kind = 'slip'\n[tree]\nbase_level = 1\n\
             [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.2\n\
             [[bodies]]\nname = 'disk'\nmaterial = 'm'\nshape = {shape}\nvelocity = [0, -1]\n\
             [time]\nend = 0.05\n[output]\npicture = false\n[history]\nevery_steps = 1\n"
        );
        std::fs::write(&path, text).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
        History::read(directory.path(), "half")
    };
    let disk = "{ kind = 'circle', centre = [0, 0.4], radius = 0.3 }";
    let cut = half(disk);
    let given = half(&format!(
        "{{ kind = 'intersection', parts = [{disk}, {{ kind = 'box', min = [0, 0], max = [1, 1] }}] }}"
    ));
    for name in ["mass", "momentum_y", "elastic_energy", "kinetic_energy"] {
        assert_eq!(cut.column(name), given.column(name), "{name}");
    }
    let exact = 1000.0 * 0.5 * std::f64::consts::PI * 0.09;
    assert!((cut.last("mass") / exact - 1.0).abs() < 0.05, "{}", cut.last("mass"));
}
