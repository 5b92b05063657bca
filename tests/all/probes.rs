//! Measurements of a run through the whole program: probes, forces on faces and the report, against closed
//! forms, with the same results on any ranks and across restarts.

use crate::common::history::History;
use crate::common::launch::{file, run, succeed};
use crate::common::restart;
use agimp::io::hdf5_file::Reader;

fn history_of(name: &str, job: &str) -> (History, serde_json::Value) {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join(format!("{name}.toml"));
    std::fs::write(&path, job).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &[]));
    let report = directory.path().join(format!("out/{name}/{name}.report.json"));
    let report = serde_json::from_str(&std::fs::read_to_string(report).expect("report")).expect("JSON");
    (History::read(directory.path(), name), report)
}

const TWO_BLOCKS: &str = "version = 1\ndimension = 2\ngravity = [0, -10]\n[domain]\nmin = [1, 0]\nsize = [2, 2]\nroot_edge = 1\n\
    [boundaries]\ny_min.kind = 'sticky'\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_max.kind = 'separating'\n\
    [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.2\n\
    [[bodies]]\nname = 'left'\nmaterial = 'm'\nshape = { kind = 'box', min = [1.25, 1], max = [1.5, 1.5] }\n\
    [[bodies]]\nname = 'right'\nmaterial = 'm'\nshape = { kind = 'box', min = [2.25, 1], max = [2.75, 1.5] }\nvelocity = [0, 2]\n\
    [[probes]]\nname = 'left'\nbodies = ['left']\nquantities = ['mass', 'centre', 'velocity', 'momentum', 'kinetic_energy', 'extent', 'volume']\n\
    [[probes]]\nname = 'right'\nbodies = ['right']\nquantities = ['mass', 'centre', 'velocity', 'momentum', 'kinetic_energy', 'extent', 'greatest_speed']\n\
    [[probes]]\nname = 'below'\nshape = { kind = 'box', min = [1, 0], max = [3, 0.5] }\nquantities = ['mass', 'centre', 'stress', 'pressure']\n\
    [[probes]]\nname = 'under'\nbodies = ['right']\nfoot = [2.5, 0]\nquantities = ['run_out', 'edge', 'height']\n";

/// Bodies in free flight: centre, velocity and energy of each are those of a parabola, sums over bodies those
/// of the run, and a shape that nothing has reached has no mass and no mean.
#[test]
fn bodies_in_flight_follow_their_parabolas() {
    let (history, report) = history_of("flight", &format!("{TWO_BLOCKS}[time]\nend = 0.2\n"));
    let (t, before) = (history.last("time"), history.time_of_velocities());
    for (name, mass, height, start) in [("left", 125.0, 1.25, 0.0), ("right", 250.0, 1.25, 2.0)] {
        let of = |what: &str, axis: &str| history.last(&format!("{what}_{name}{axis}"));
        let close = |found: f64, exact: f64| {
            assert!((found - exact).abs() < 1e-11 * exact.abs(), "{name}: {found} for {exact}")
        };
        close(of("mass", ""), mass);
        close(of("velocity", "_y"), start - 10.0 * before);
        close(of("momentum", "_y"), mass * (start - 10.0 * before));
        close(of("kinetic_energy", ""), 0.5 * mass * (start - 10.0 * before).powi(2));
        // On the parabola, whatever the steps.
        close(of("centre", "_y"), height + start * t - 5.0 * t * t);
        // Centres of particles: an eighth of a cell, 1/16 m, from the surface.
        close(of("greatest", "_y") - of("least", "_y"), 0.5 - 0.125);
    }
    assert!(
        (history.last("centre_left_x") - 1.375).abs() < 1e-12
            && (history.last("volume_left") - 0.125).abs() < 1e-12
    );
    // The outermost column of its particles has more than 2 % of its mass; its centre is 1/16 m from the edge.
    for (what, exact) in [("run_out", 0.25 - 1.0 / 16.0), ("edge", 0.25)] {
        let found = history.last(&format!("{what}_under"));
        assert!((found - exact).abs() < 1e-3 * exact, "{what}: {found} for {exact}");
    }
    let top = history.last("greatest_right_y") + 1.0 / 16.0;
    assert!((history.last("height_under") - top).abs() < 1e-12, "{} for {top}", history.last("height_under"));
    let (fastest, mean) = (history.last("greatest_speed_right"), history.last("velocity_right_y").abs());
    assert!((fastest - mean).abs() < 1e-13 * mean, "{fastest} {mean}");
    let total = history.last("momentum_left_y") + history.last("momentum_right_y");
    assert!((total - history.last("momentum_y")).abs() < 1e-11 * total.abs());
    assert_eq!(history.last("mass_below"), 0.0);
    assert!(history.last("pressure_below").is_nan() && history.last("centre_below_y").is_nan());
    assert_eq!(report["steps"].as_u64(), Some(history.last("step") as u64));
    assert_eq!(report["history"]["momentum_y"][0].as_f64(), Some(history.last("momentum_y")));
    assert_eq!(report["history"]["momentum_y"][1], "kg m/s");
    assert!(report["history"]["pressure_below"][0].is_null());
    // The steps are few, and that is all there is to warn of.
    let warnings = report["warnings"].as_array().expect("warnings");
    let of_steps = |warning: &serde_json::Value| warning.to_string().contains("the run takes about 26 steps");
    assert!(warnings.len() == 1 && warnings.iter().all(of_steps), "{warnings:?}");
}

/// A column of water-like stress at rest: the faces carry its weight and its side pressure, and the mean
/// stress in a layer is that of the weight above. The probes of two halves add up to that of the whole.
#[test]
fn a_column_at_rest_weighs_on_its_floor() {
    let job = "version = 1\ndimension = 2\ngravity = [0, -10]\n[domain]\nsize = [2, 2]\nroot_edge = 1\n\
        [boundaries]\ny_min.kind = 'slip'\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_max.kind = 'separating'\n\
        [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'hencky'\nyoung = 1e8\npoisson = 0.25\n\
        [[bodies]]\nname = 'ground'\nmaterial = 'm'\nshape = { kind = 'box', min = [0, 0], max = [2, 1.125] }\n\
        stress = { kind = 'geostatic', k0 = 0.5 }\n\
        [[probes]]\nname = 'layer'\nshape = { kind = 'box', min = [0, 0.25], max = [2, 0.75] }\nquantities = ['stress', 'pressure', 'mass']\n\
        [history]\nface_forces = true\n[time]\nend = 0.01\n";
    let (history, _) = history_of("ground", job);
    let (weight, side) = (1000.0 * 10.0 * 2.0 * 1.125, 0.5 * 0.5 * 1e4 * 1.125 * 1.125);
    let close = |name: &str, exact: f64| {
        let found = history.last(name);
        println!("{name}: {found} for {exact}");
        assert!((found - exact).abs() <= 1e-9 * weight, "{name}: {found} for {exact}");
    };
    close("force_y_min_y", -weight);
    close("force_y_max_y", 0.0);
    close("force_x_min_x", -side);
    close("force_x_max_x", side);
    close("force_x_min_y", 0.0);
    // Mean depth of the layer: 1.125 m - 0.5 m.
    let vertical = -1e4 * 0.625;
    for (name, exact) in [("xx", 0.5 * vertical), ("yy", vertical), ("zz", 0.5 * vertical), ("xy", 0.0)] {
        close(&format!("stress_layer_{name}"), exact);
    }
    close("pressure_layer", -2.0 * vertical / 3.0);
    close("mass_layer", 1000.0);
}

/// Blocks fall into a graded tree and onto a floor: probes and face forces have the same bits on 1 to 3 ranks
/// and across a restart, and the floor's impulse is what the momentum lacks.
#[test]
fn measurements_are_the_same_on_any_ranks_and_across_restart() {
    let rest = "[history]\nface_forces = true\nevery_steps = 5\n[time]\nend = 0.6\n[checkpoint]\nevery_steps = 20\nkeep = 99\n\
                [tree]\n[[tree.regions]]\nlevel = 1\nshape = { kind = 'box', min = [1, 0], max = [3, 0.6] }\n";
    restart::assert_same_on_any_ranks(&format!("{TWO_BLOCKS}{rest}"), "blocks", |directory, _| {
        let history = History::read(directory, "blocks");
        let impulse = history.integral("force_y_min_y", 0.0);
        let (t, mass) = (history.time_of_velocities(), history.last("mass"));
        let free = 500.0 - 10.0 * mass * t;
        let lost = free - history.last("momentum_y");
        println!("impulse {impulse} on the floor, momentum lost {lost}");
        assert!(impulse < -100.0 && (impulse - lost).abs() < 1e-9 * lost.abs(), "{impulse} for {lost}");
        assert!(history.column("mass_below").iter().any(|&mass| mass > 0.0));
    });
}

/// Blocks of 64 and 128 particles of 1 kg fly through a plane and out of an outflow face: at every row what
/// has passed the face and what is there make up the whole exactly, and what has passed the plane is what
/// lies beyond it or has left. A plane with the reverse normal has the reverse flux. The same on any ranks
/// and across a restart, as are the particle that is followed and the files of a line.
#[test]
fn fluxes_tracks_and_lines_are_exact_on_any_ranks_and_across_restart() {
    let job = "version = 1\ndimension = 2\n[domain]\nmin = [-3, 7]\nsize = [1, 1]\nroot_edge = 0.5\n[tree]\nbase_level = 1\n\
        [boundaries]\nx_max.kind = 'outflow'\n\
        [[materials]]\nname = 'rubber'\ndensity = 1024\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.2\n\
        [[bodies]]\nname = 'small'\nmaterial = 'rubber'\nvelocity = [4, 0.5]\nshape = { kind = 'box', min = [-2.5, 7.5], max = [-2.25, 7.75] }\n\
        [[bodies]]\nname = 'large'\nmaterial = 'rubber'\nvelocity = [2, 0]\nshape = { kind = 'box', min = [-2.875, 7], max = [-2.625, 7.5] }\n\
        [[fluxes]]\nname = 'gate'\npoint = [-2.2, 0]\nnormal = [3, 0]\n\
        [[fluxes]]\nname = 'back'\npoint = [-2.2, 0]\nnormal = [-1, 0]\n\
        [[fluxes]]\nname = 'upper'\npoint = [-2.2, 0]\nnormal = [3, 0]\nmin = [-3, 7.63]\nmax = [-2, 8]\n\
        [[fluxes]]\nname = 'lower'\npoint = [-2.2, 0]\nnormal = [3, 0]\nmin = [-3, 7]\nmax = [-2, 7.63]\n\
        [[fluxes]]\nname = 'out'\nface = 'x_max'\n\
        [[fluxes]]\nname = 'none'\nface = 'y_max'\n\
        [[probes]]\nname = 'beyond'\nshape = { kind = 'box', min = [-2.2, 0], max = [9, 9] }\nquantities = ['mass']\n\
        [[tracks]]\nname = 'corner'\npoint = [-2.875, 7]\nquantities = ['centre', 'velocity', 'mass']\n\
        [[tracks]]\nname = 'small'\npoint = [-2.9, 7]\nbodies = ['small']\n\
        [[lines]]\nname = 'middle'\nfrom = [-3, 7.25]\nto = [-2, 7.25]\npoints = 5\n\
        [time]\nend = 0.2\ndt_max = 1e-3\n[history]\nevery_steps = 5\n[checkpoint]\nevery_steps = 60\nkeep = 9\n";
    let mut line: Option<String> = None;
    restart::assert_same_on_any_ranks(job, "flow", |directory, _| {
        let history = History::read(directory, "flow");
        let column = |name: &str| history.column(name);
        let (inside, gate, back) = (column("mass"), column("passed_gate"), column("passed_back"));
        let (out, beyond) = (column("passed_out"), column("mass_beyond"));
        let (upper, lower) = (column("passed_upper"), column("passed_lower"));
        for row in 0..inside.len() {
            assert_eq!(inside[row] + out[row], 192.0, "row {row}");
            assert_eq!((gate[row], back[row]), (beyond[row] + out[row], -gate[row]), "row {row}");
            assert_eq!(upper[row] + lower[row], gate[row], "row {row}: openings that make up the plane");
        }
        assert!(
            out.iter().any(|&mass| mass > 0.0 && mass < 64.0)
                && [&upper, &lower].iter().all(|passed| passed.iter().any(|&mass| mass > 16.0))
                && column("passed_none").iter().all(|&m| m == 0.0)
        );
        assert!(gate.iter().any(|&mass| mass > 0.0 && mass < 64.0), "{gate:?}");
        // The particle in the corner of the large block: an eighth of a cell from its faces, and it flies
        // freely.
        for (row, t) in column("time").iter().enumerate() {
            let (x, y) = (column("centre_corner_x")[row], column("centre_corner_y")[row]);
            let way = 1.0 / 64.0 - 2.875 + 2.0 * t;
            assert!((x - way).abs() < 1e-12 && (y - 7.0 - 1.0 / 64.0).abs() < 1e-12, "row {row}: {x} {y}");
            assert_eq!(column("mass_corner")[row], 1.0);
        }
        assert!((column("centre_small_x")[0] + 2.5 - 1.0 / 64.0).abs() < 1e-12);
        let path = directory.join("out/flow/flow.line_middle.csv");
        let text = std::fs::read_to_string(path).expect("the file of the line");
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(1)
            .map(|row| row.split(',').map(|cell| cell.parse().expect("number")).collect())
            .collect();
        let names: Vec<&str> = text.lines().next().expect("header").split(',').collect();
        let at =
            |name: &str| names.iter().position(|other| *other == name).unwrap_or_else(|| panic!("{names:?}"));
        assert_eq!(rows.len(), 5 * inside.len());
        // The second point lies in the large block, and the third behind it.
        let [in_block, behind] = [&rows[1], &rows[2]];
        assert_eq!((in_block[at("point")], in_block[at("x [m]")], in_block[at("level")]), (2.0, -2.75, 1.0));
        assert!((in_block[at("volume_fraction")] - 1.0).abs() < 1e-12, "{in_block:?}");
        assert!((in_block[at("density [kg/m³]")] - 1024.0).abs() < 1e-9);
        assert!((in_block[at("velocity_x [m/s]")] - 2.0).abs() < 1e-14);
        assert!(behind[at("volume_fraction")] == 0.0 && behind[at("pressure [Pa]")].is_nan(), "{behind:?}");
        assert_eq!(*line.get_or_insert(text.clone()), text, "the line");
    });
}

/// A line through ground at rest shows the stress of the weight above, exactly in the middle of linear
/// fields, and the level of each leaf.
#[test]
fn a_line_through_ground_shows_the_stress_of_its_depth() {
    let job = "version = 1\ndimension = 2\ngravity = [0, -10]\n[domain]\nsize = [2, 2]\nroot_edge = 1\n\
        [boundaries]\ny_min.kind = 'slip'\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_max.kind = 'separating'\n\
        [tree]\n[[tree.regions]]\nlevel = 1\nshape = { kind = 'box', min = [0, 0], max = [0.9, 0.9] }\n\
        [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'hencky'\nyoung = 1e8\npoisson = 0.25\n\
        [[bodies]]\nname = 'ground'\nmaterial = 'm'\nshape = { kind = 'box', min = [0, 0], max = [2, 1.5] }\n\
        stress = { kind = 'geostatic', k0 = 0.5 }\n\
        [[lines]]\nname = 'depth'\nfrom = [0.5, 0.5]\nto = [0.5, 1.25]\npoints = 3\nquantities = ['stress', 'pressure']\n\
        [time]\nend = 1e-5\n";
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("ground.toml");
    std::fs::write(&path, job).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let text =
        std::fs::read_to_string(directory.path().join("out/ground/ground.line_depth.csv")).expect("line");
    let mut lines = text.lines();
    assert!(
        lines
            .next()
            .expect("header")
            .starts_with("step,time [s],point,x [m],y [m],level,stress_xx [Pa],stress_yy [Pa]")
    );
    for (row, (y, level)) in lines.zip([(0.5, 1.0), (0.875, 1.0), (1.25, 0.0)]) {
        let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().expect("number")).collect();
        let vertical = -1e4 * (1.5 - y);
        assert_eq!((cells[4], cells[5]), (y, level), "{row}");
        assert!((cells[7] - vertical).abs() < 1e-6 * vertical.abs(), "{row}: {vertical}");
        assert!((cells[6] - 0.5 * vertical).abs() < 1e-6 * vertical.abs(), "{row}: {vertical}");
    }
    // The leaves have the stress of their middle, and the volume that is filled.
    let file =
        Reader::open_alone(&directory.path().join("out/ground/ground_000000.tree.hdf")).expect("the tree");
    let count = file.stored("VTKHDF/CellData/level").expect("levels").rows;
    let read = |name: &str, count: u64| {
        file.read_slab::<f64>(&format!("VTKHDF/CellData/{name}"), 0, count).expect("a field")
    };
    let points = file.read_slab::<f64>("VTKHDF/Points", 0, 4 * count).expect("corners");
    let [fraction, pressure, greatest] =
        ["volume_fraction", "pressure", "stress_1"].map(|name| read(name, count));
    for (leaf, corners) in points.chunks_exact(12).enumerate() {
        let [low, high] = [corners[1], corners[7]];
        let filled = (1.5_f64.min(high) - low).max(0.0) / (high - low);
        assert!((fraction[leaf] - filled).abs() < 1e-3, "leaf {leaf}: {}", fraction[leaf]);
        let vertical = if filled > 0.0 { -1e4 * (1.5 - 0.5 * (low + high.min(1.5))) } else { 0.0 };
        assert!(
            (pressure[leaf] + 2.0 / 3.0 * vertical).abs() < 2.0,
            "leaf {leaf}: {} for {vertical}",
            pressure[leaf]
        );
        assert!((greatest[leaf] - 0.5 * vertical).abs() < 2.0, "leaf {leaf}: {}", greatest[leaf]);
    }
}

/// A particle that is followed into finer leaves and out of them: it splits twice, its family is merged
/// again, and the centre and the mass of the whole go on exactly.
#[test]
fn a_track_goes_on_through_splits_and_merges() {
    let job = "version = 1\ndimension = 2\n[domain]\nsize = [8, 1]\nroot_edge = 1\n[adaptivity]\nevery_steps = 2\nbuffer = 0\n\
        criteria = [{ kind = 'region', level = 2, shape = { kind = 'box', min = [2, 0], max = [3, 1] } }]\n\
        [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e4\npoisson = 0.2\n\
        [[bodies]]\nname = 'b'\nmaterial = 'm'\nvelocity = [10, 0]\nshape = { kind = 'box', min = [0.25, 0.25], max = [0.75, 0.75] }\n\
        [[tracks]]\nname = 'middle'\npoint = [0.5, 0.5]\nquantities = ['centre', 'velocity', 'mass']\n\
        [history]\nevery_steps = 2\n[time]\nend = 0.45\n";
    let (history, _) = history_of("flight", job);
    let column = |name: &str| history.column(name);
    assert_eq!(
        (history.last("splits"), history.last("merges"), history.last("particles")),
        (80.0, 80.0, 16.0)
    );
    for (row, t) in column("time").iter().enumerate() {
        let x = column("centre_middle_x")[row] - 0.4375 - 10.0 * t;
        assert!(x.abs() < 1e-12 && (column("centre_middle_y")[row] - 0.4375).abs() < 1e-12, "row {row}: {x}");
        assert!((column("velocity_middle_x")[row] - 10.0).abs() < 1e-12);
        assert_eq!(column("mass_middle")[row], 15.625, "row {row}");
    }
}

/// A block flies over a raster: each cell keeps the depth of what has been over it, exactly, and the speed;
/// the rasters are the same on any ranks and across a restart, as ESRI grids and in the outputs.
#[test]
fn maps_keep_the_largest_depth_and_speed() {
    let job = "version = 1\ndimension = 3\n[domain]\nmin = [10, 20, 30]\nsize = [2, 1, 1]\nroot_edge = 1\n[tree]\nbase_level = 1\n\
        [[materials]]\nname = 'm'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e4\npoisson = 0.2\n\
        [[bodies]]\nname = 'b'\nmaterial = 'm'\nvelocity = [8, 0, 0]\nshape = { kind = 'box', min = [10.25, 20.25, 30.25], max = [10.5, 20.75, 30.75] }\n\
        [[maps]]\nname = 'hazard'\ncell = 0.25\nmin = [10, 20]\nmax = [11, 21]\n\
        [time]\nend = 0.05\ndt_max = 2e-3\n[history]\nevery_steps = 1\n[checkpoint]\nevery_steps = 10\nkeep = 9\n";
    let mut first: Option<[String; 2]> = None;
    restart::assert_same_on_any_ranks(job, "slide", |directory, _| {
        let texts = ["depth", "speed"].map(|what| {
            let path = directory.join(format!("out/slide/slide.map_hazard_{what}.asc"));
            std::fs::read_to_string(path).expect("a map")
        });
        let header = "ncols 4\nnrows 4\nxllcorner 10.0\nyllcorner 20.0\ncellsize 0.25\nNODATA_value -9999\n";
        let rows = |text: &str| -> Vec<Vec<f64>> {
            let rows = text.strip_prefix(header).expect("header").lines();
            rows.map(|row| row.split(' ').map(|cell| cell.parse().expect("number")).collect()).collect()
        };
        // It begins over the second cell and ends over the third and the fourth; half a metre of depth, along
        // the middle rows.
        let [depth, speed] = texts.each_ref().map(|text| rows(text));
        for row in [0, 3] {
            assert_eq!((&depth[row], &speed[row]), (&vec![-9999.0; 4], &vec![-9999.0; 4]), "row {row}");
        }
        for row in [1, 2] {
            assert_eq!(depth[row][0], -9999.0);
            assert!(depth[row][1..3].iter().all(|depth| (depth - 0.5).abs() < 1e-12), "{depth:?}");
            assert!(depth[row][3] > 0.2 && depth[row][3] < 0.5, "{depth:?}");
            assert!(speed[row][1..].iter().all(|speed| (speed - 8.0).abs() < 1e-12), "{speed:?}");
        }
        assert_eq!(*first.get_or_insert(texts.clone()), texts);
    });
}

/// A cone on the ground, as a quarter in space and as a body of revolution, with a grain far off: 98 % of its
/// mass lies within 0.918 of its radius, and the grain is no part of it.
#[test]
fn a_deposit_has_a_run_out_an_edge_and_a_height() {
    let rest = "[[materials]]\nname = 'sand'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.3\n\
                [time]\nend = 1e-4\n[output]\npicture = false\n";
    let in_space = "version = 1\ndimension = 3\n[domain]\nsize = [1.5, 1.5, 0.75]\nroot_edge = 0.1875\n\
        [[bodies]]\nname = 'heap'\nmaterial = 'sand'\n\
        shape = { kind = 'intersection', parts = [{ kind = 'box', min = [0, 0, 0], max = [1, 1, 1] }, \
            { kind = 'cone', base = [0, 0, 0], axis = [0, 0, 1], radius = 1, height = 0.5 }] }\n\
        [[bodies]]\nname = 'grain'\nmaterial = 'sand'\nshape = { kind = 'box', min = [1.2, 0, 0], max = [1.3, 0.1, 0.1] }\n\
        [[probes]]\nname = 'heap'\nbodies = ['heap']\nfoot = [0, 0, 0]\nquantities = ['run_out', 'edge', 'height']\n\
        [[probes]]\nname = 'all'\nfoot = [0, 0, 0]\nquantities = ['edge']\n";
    let of_revolution = "version = 1\ndimension = 2\ngeometry = 'axisymmetric'\n[domain]\nsize = [1.5, 0.75]\nroot_edge = 0.09375\n\
        [[bodies]]\nname = 'heap'\nmaterial = 'sand'\nshape = { kind = 'polygon', points = [[0, 0], [1, 0], [0, 0.5]] }\n\
        [[bodies]]\nname = 'grain'\nmaterial = 'sand'\nshape = { kind = 'box', min = [1.2, 0], max = [1.23, 0.03] }\n\
        [[probes]]\nname = 'heap'\nbodies = ['heap']\nfoot = [0, 0]\nquantities = ['run_out', 'edge', 'height']\n\
        [[probes]]\nname = 'all'\nfoot = [0, 0]\nquantities = ['edge']\n";
    for (name, job) in [("in_space", in_space), ("of_revolution", of_revolution)] {
        let (history, _) = history_of(name, &format!("{job}{rest}"));
        let heap = [("run_out_heap", 0.918, 0.02), ("edge_heap", 1.0, 0.03), ("height_heap", 0.5, 0.03)];
        for (what, exact, allowed) in heap.into_iter().chain([("edge_all", 1.0, 0.03)]) {
            let found = history.last(what);
            println!("{name}: {what} {found} for {exact}");
            assert!((found - exact).abs() < allowed, "{name}: {what} {found} for {exact}");
        }
    }
}

/// A spinning disk of sand flies apart into particles that have nothing around them: they fill their boxes,
/// and not the domain. Their det F adds up to 28 times the volume of the disk.
#[test]
fn spray_has_no_more_volume_than_its_boxes() {
    let job = "version = 1\ndimension = 2\n[domain]\nsize = [2, 2]\nroot_edge = 0.5\n[boundaries]\nleaving = 'clamp'\n[tree]\nbase_level = 1\n\
               [[materials]]\nname = 'sand'\ndensity = 1000\nmodel = 'drucker_prager'\nyoung = 1e5\npoisson = 0.3\nfriction_angle = 30\n\
               [[bodies]]\nname = 'disk'\nmaterial = 'sand'\nangular_velocity = 40\nshape = { kind = 'circle', centre = [1, 1], radius = 0.2 }\n\
               [[probes]]\nname = 'disk'\nquantities = ['volume', 'extent']\n[[maps]]\nname = 'plan'\ncell = 0.25\n\
               [time]\nend = 0.15\n[output]\npicture = false\n[history]\nevery_steps = 5\n";
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("disk.toml");
    std::fs::write(&path, job).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let history = History::read(directory.path(), "disk");
    let volumes = history.column("volume_disk");
    let greatest = volumes.iter().copied().fold(0.0, f64::max);
    println!("{} m² at the start, at most {greatest} m²", volumes[0]);
    assert!(history.last("greatest_disk_x") > 1.9, "it has flown apart");
    assert!(greatest <= 4.0 * volumes[0] * (1.0 + 1e-12), "{greatest} m² of {} m²", volumes[0]);
    let depths = std::fs::read_to_string(file(directory.path(), "disk", ".map_plan_depth.asc")).expect("map");
    let deepest =
        depths.lines().last().expect("a row").split(' ').map(|depth| depth.parse::<f64>().expect("a number"));
    let deepest = deepest.fold(0.0, f64::max);
    assert!(deepest > 0.0 && deepest < 2.0, "{deepest} m deep in a domain of 2 m");
}
