//! Bodies and colliders from triangle meshes: a cube from a file is a box, in each format; a turned cube as
//! collider gives the same results on any ranks and across a restart; a raster of heights is the same terrain
//! from each format; hostile files give a message.

use crate::common::damage::damage;
use crate::common::history::History;
use crate::common::launch::{self, Outcome, run, succeed, text};
use crate::common::random::Random;
use crate::common::restart;
use crate::common::runs::outcome;
use agimp::geometry::Mesh;
use agimp::geometry::mesh::{HeightRaster, Placing, Terrain, read};
use std::fmt::Write as _;
use std::io::{Cursor, Write as _};
use tiff::encoder::{TiffEncoder, colortype::Gray32Float};
use tiff::tags::Tag;

/// A cube of edge 1 with a corner at the origin.
const FACES: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

fn corner(c: usize) -> [f32; 3] {
    [(c & 1) as f32, (c >> 1 & 1) as f32, (c >> 2) as f32]
}

fn triangles() -> impl Iterator<Item = [usize; 3]> {
    FACES.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
}

/// The cube in each format, by name of the file.
fn cubes() -> Vec<(&'static str, Vec<u8>)> {
    let mut text_stl = String::from("solid cube\n");
    let mut binary_stl = vec![b' '; 80];
    binary_stl.extend(12_u32.to_le_bytes());
    for corners in triangles() {
        text_stl.push_str(" facet normal 0 0 0\n  outer loop\n");
        binary_stl.extend([0; 12]);
        for x in corners.map(corner) {
            let _ = writeln!(text_stl, "   vertex {} {} {}", x[0], x[1], x[2]);
            x.iter().for_each(|c| binary_stl.extend(c.to_le_bytes()));
        }
        text_stl.push_str("  endloop\n endfacet\n");
        binary_stl.extend([0; 2]);
    }
    text_stl.push_str("endsolid cube\n");
    let (mut obj, mut ply) = (String::from("# squares, with a normal each\n"), String::new());
    let _ = write!(
        ply,
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nelement face 6\n\
         property list uchar int vertex_indices\nend_header\n"
    );
    let mut binary_ply = ply.replace("ascii", "binary_little_endian").into_bytes();
    for x in (0..8).map(corner) {
        let _ = writeln!(obj, "v {} {} {}", x[0], x[1], x[2]);
        let _ = writeln!(ply, "{} {} {}", x[0], x[1], x[2]);
        x.iter().for_each(|c| binary_ply.extend(c.to_le_bytes()));
    }
    for face in FACES {
        let [a, b, c, d] = face.map(|corner| corner + 1);
        let _ = writeln!(obj, "f {a} {b} {c} {d}");
        let [a, b, c, d] = face;
        let _ = writeln!(ply, "4 {a} {b} {c} {d}");
        binary_ply.push(4);
        face.iter().for_each(|&corner| binary_ply.extend((corner as i32).to_le_bytes()));
    }
    vec![
        ("text.stl", text_stl.into_bytes()),
        ("binary.stl", binary_stl),
        ("cube.OBJ", obj.into_bytes()),
        ("text.ply", ply.into_bytes()),
        ("binary.ply", binary_ply),
    ]
}

/// A block of jelly over a floor.
fn job(shape: &str, rest: &str) -> String {
    format!(
        "version = 1\ndimension = 3\ngravity = [0, 0, -9.81]\n[domain]\nmin = [0, 0, -0.5]\nsize = [2, 2, 2]\nroot_edge = 1\n\
         [boundaries]\nz_min.kind = 'separating'\nz_max.kind = 'separating'\nx_min.kind = 'slip'\nx_max.kind = 'slip'\ny_min.kind = 'slip'\n\
         y_max.kind = 'slip'\n[[materials]]\nname = 'jelly'\ndensity = 1000\nmodel = 'neo_hookean'\nyoung = 1e5\npoisson = 0.3\n\
         [[bodies]]\nname = 'block'\nmaterial = 'jelly'\nshape = {shape}\n{rest}\n"
    )
}

/// A cube of 1 m on the lattice from each format gives the particles, and so the run, of a box of that size.
#[test]
fn a_cube_from_a_file_is_a_box() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let rest = "[time]\nend = 0.05";
    let reference = outcome(
        directory.path(),
        &job("{ kind = 'box', min = [0.5, 0.5, -0.125], max = [1.5, 1.5, 0.875] }", rest),
    );
    std::fs::create_dir(directory.path().join("tools")).expect("directory");
    for (name, bytes) in cubes() {
        std::fs::write(directory.path().join("tools").join(name), bytes).expect("mesh");
        let shape =
            format!("{{ kind = 'mesh', file = 'tools/{name}', scale = 1, origin = [0.5, 0.5, -0.125] }}");
        let found = outcome(directory.path(), &job(&shape, rest));
        assert!(found.history == reference.history, "{name}: history");
        // The headers differ: they name the job.
        let state = |outcome: &Outcome| -> Vec<String> {
            outcome.digest.lines().filter(|line| line.contains("state/")).map(str::to_owned).collect()
        };
        assert!(state(&found).len() > 10);
        assert_eq!(state(&found), state(&reference), "{name}");
    }
}

/// A block falls on an edge of a turned cube: same results on 1 to 3 ranks and across a restart, and the
/// block presses the cube down.
#[test]
fn a_mesh_as_collider_gives_the_same_on_any_ranks_and_across_restart() {
    let rest = "[[colliders]]\nname = 'cube'\n[colliders.shape]\nkind = 'rotated'\ncentre = [1, 1, 0.2]\naxis = [1, 2, 0]\nangle = 40\n\
                shape = { kind = 'mesh', file = 'MESH', scale = 0.4, origin = [0.8, 0.8, 0] }\n\
                [time]\nend = 0.35\n[checkpoint]\nevery_steps = 20\nkeep = 99\n\
                [tree]\n[[tree.regions]]\nlevel = 1\nshape = { kind = 'box', min = [0, 0, -0.5], max = [1, 2, 1.5] }\n";
    let directory = tempfile::tempdir().expect("temporary directory");
    let file = directory.path().join("cube.stl");
    std::fs::write(&file, &cubes()[1].1).expect("mesh");
    let rest = rest.replace("MESH", &file.display().to_string());
    let block = "{ kind = 'box', min = [0.6, 0.6, 0.6], max = [1.4, 1.4, 1.1] }";
    restart::assert_same_on_any_ranks(&job(block, &rest), "block", |directory, _| {
        let least =
            History::read(directory, "block").column("force_cube_z").iter().copied().fold(0.0, f64::min);
        assert!(least < -1000.0, "the block presses the cube down");
    });
}

/// Another mesh in the file is another job: a restart is refused.
#[test]
fn a_changed_mesh_is_another_job() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("block.toml");
    std::fs::write(directory.path().join("cube.stl"), &cubes()[1].1).expect("mesh");
    let shape = "{ kind = 'mesh', file = 'cube.stl', scale = 0.5, origin = [0.5, 0.5, 0] }";
    std::fs::write(&path, job(shape, "[time]\nend = 0.01")).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &[]));
    let mut other = cubes()[1].1.clone();
    // The first coordinate of a corner, in each triangle that has it.
    let one = 1.0_f32.to_le_bytes();
    for at in (84..other.len()).step_by(50).flat_map(|face| [face + 12, face + 24, face + 36]) {
        if other[at..at + 4] == one {
            other[at..at + 4].copy_from_slice(&1.1_f32.to_le_bytes());
        }
    }
    std::fs::write(directory.path().join("cube.stl"), other).expect("mesh");
    let output = run(directory.path(), 1, 1, &path, &["--restart", "latest", "--end", "0.02"])
        .output()
        .expect("starts");
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
}

/// Heights of a hill with steps of 1/64 m, 9 x 6 of them 0.25 m apart, rows from north to south.
fn hill() -> Vec<f32> {
    let height = |at: u32| 16 + (at % 9) * 3 + (at / 9) * (5 - at / 9);
    (0..54).map(|at| height(at) as f32 / 64.0).collect()
}

/// The hill in each format of a raster, by name of the file, with its south-western height at (0, 0).
fn hills() -> Vec<(&'static str, Vec<u8>)> {
    let rows: Vec<String> =
        hill().chunks(9).map(|row| row.iter().map(f32::to_string).collect::<Vec<_>>().join(" ")).collect();
    let text = format!(
        "ncols 9\nnrows 6\nxllcenter 0\nyllcenter 0\ncellsize 0.25\nNODATA_value -9999\n{}\n",
        rows.join("\n")
    );
    let mut image = Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut image).expect("TIFF");
    let mut writer = encoder.new_image::<Gray32Float>(9, 6).expect("image");
    let tags = writer.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &[0.25, 0.25, 0.0][..]).expect("tag");
    // The corner of the north-western pixel, half a cell from its centre.
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, -0.125, 1.375, 0.0][..]).expect("tag");
    tags.write_tag(Tag::GeoKeyDirectoryTag, &[1_u16, 1, 0, 2, 1024, 0, 1, 1, 1025, 0, 1, 1][..])
        .expect("tag");
    tags.write_tag(Tag::GdalNodata, "-9999").expect("tag");
    writer.write_data(&hill()).expect("heights");
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (6, 9), }";
    let mut array = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    array.extend(format!("{header:117}\n").into_bytes());
    array.extend(hill().into_iter().flat_map(f32::to_le_bytes));
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in [("hill.npy", &array), ("other.npy", &vec![0; 9])] {
        archive.start_file(name, zip::write::SimpleFileOptions::default()).expect("archive");
        archive.write_all(bytes).expect("array");
    }
    let archive = archive.finish().expect("archive").into_inner();
    vec![
        ("hill.asc", text.into_bytes()),
        ("hill.tif", image.into_inner()),
        ("hill.npy", array),
        ("hill.npz", archive),
    ]
}

/// Keys that the arrays need in the job.
fn hill_keys(name: &str) -> &'static str {
    match &name[5..] {
        "npy" => ", cell = 0.25",
        "npz" => ", cell = 0.25, array = 'hill'",
        _ => "",
    }
}

/// A layer of jelly slides on a hill: the same raster gives the same run from each format.
#[test]
fn a_raster_of_any_format_is_the_same_terrain() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let outcomes: Vec<Outcome> = hills()
        .into_iter()
        .map(|(name, bytes)| {
            std::fs::write(directory.path().join(name), bytes).expect("raster");
            let shape = |rest: &str| {
                format!("kind = 'terrain', file = '{name}', base = -0.25{}{rest}", hill_keys(name))
            };
            let rest =
                format!("[[colliders]]\nname = 'hill'\nshape = {{ {} }}\n[time]\nend = 0.02", shape(""));
            outcome(directory.path(), &job(&format!("{{ {} }}", shape(", thickness = 0.3")), &rest))
        })
        .collect();
    let state = |outcome: &Outcome| -> Vec<String> {
        outcome.digest.lines().filter(|line| line.contains("state/")).map(str::to_owned).collect()
    };
    for other in &outcomes[1..] {
        assert!(other.history == outcomes[0].history);
        assert_eq!(state(other), state(&outcomes[0]));
    }
}

/// Rasters with bytes flipped, cut, doubled and overwritten: a terrain, or an error; never a panic, and never
/// slow.
#[test]
fn damaged_rasters_give_a_message() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let mut random = Random::new(2);
    let mut next = |below: usize| random.below(below as u64) as usize;
    let placing = Placing { cell: None, array: None };
    let mut read_well = 0;
    for (name, bytes) in hills() {
        let path = directory.path().join(name);
        let placing = match &name[5..] {
            "npz" => Placing { cell: Some(0.25), array: Some("hill".into()) },
            "npy" => Placing { cell: Some(0.25), array: None },
            _ => placing.clone(),
        };
        for _ in 0..300 {
            let damaged = damage(&bytes, &mut next);
            std::fs::write(&path, &damaged).expect("raster");
            match HeightRaster::read(&path, &placing) {
                Ok(raster) => match Terrain::new(raster) {
                    Ok(terrain) => read_well += usize::from(terrain.length() > 0.0),
                    Err(error) => assert!(!error.is_empty()),
                },
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
    println!("{read_well} of 1200 are terrains all the same");
}

/// A cube that lacks a triangle is filled by winding number: the particles are those of a box.
#[test]
fn a_torn_cube_is_filled() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let mut torn = cubes().swap_remove(1).1;
    torn.truncate(torn.len() - 50);
    torn[80] = 11;
    std::fs::write(directory.path().join("torn.stl"), torn).expect("mesh");
    let rest = "[time]\nend = 0.01";
    let reference =
        outcome(directory.path(), &job("{ kind = 'box', min = [0.5, 0.5, 0], max = [1.5, 1.5, 1] }", rest));
    let shape = "{ kind = 'mesh', solid = 'winding', file = 'torn.stl', origin = [0.5, 0.5, 0] }";
    let found = outcome(directory.path(), &job(shape, rest));
    assert!(found.history == reference.history);
}

/// Each format with bytes flipped, cut, doubled and overwritten: a mesh, or an error; never a panic, and
/// never slow.
#[test]
fn damaged_files_give_a_message() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let mut random = Random::new(1);
    let mut next = |below: usize| random.below(below as u64) as usize;
    let mut read_well = 0;
    for (name, bytes) in cubes() {
        for _ in 0..400 {
            let damaged = damage(&bytes, &mut next);
            let path = directory.path().join(name);
            std::fs::write(&path, &damaged).expect("mesh");
            match read(&path) {
                Ok(triangles) => {
                    for made in [Mesh::new(triangles.clone()), Mesh::wound(triangles)] {
                        match made {
                            Ok(_) => read_well += 1,
                            Err(error) => assert!(!error.to_string().is_empty()),
                        }
                    }
                }
                Err(error) => assert!(!error.to_string().is_empty()),
            }
        }
    }
    println!("{read_well} of 4000 are solids all the same");
}

/// A foot whose lower face comes down by 80 mm in three meshes presses a block as one that moves down as a
/// whole. Same results on 1 to 3 ranks and across a restart.
#[test]
fn a_foot_that_deforms_presses_as_one_that_moves() {
    let name = "deforming_foot";
    let text = std::fs::read_to_string(launch::job(name)).expect("job");
    let frames = text.lines().find(|line| line.starts_with("frames")).expect("frames");
    let rows =
        "motion = { kind = 'table', rows = [{ time = 0 }, { time = 0.4, translation = [0, 0, -0.08] }] }";
    let directory = tempfile::tempdir().expect("temporary directory");
    let mesh = launch::job(name).with_file_name("frames").join("foot_0.obj");
    let rigid = text.replace(frames, rows).replace("frames/foot_0.obj", &mesh.display().to_string());
    let path = directory.path().join("rigid_foot.toml");
    std::fs::write(&path, rigid).expect("job");
    succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet"]));
    let rigid = History::read(directory.path(), "rigid_foot");
    restart::assert_same_in_all_ways(name, |history| {
        let impulse = [history, &rigid].map(|one| one.integral("force_foot_z", 0.0));
        println!("impulse {:.1} and {:.1} kg m/s", impulse[0], impulse[1]);
        assert!(impulse[1] > 1000.0 && (impulse[0] / impulse[1] - 1.0).abs() < 0.005, "{impulse:?}");
    });
}

/// A cube whose faces were meshed each by itself, a rounding apart at its edges, holds a block as the box
/// does, also by winding number.
#[test]
fn a_cube_of_unwelded_faces_is_a_cube() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let mut stl = String::from("SOLID CUBE\n");
    for (number, corners) in triangles().enumerate() {
        let gap = 1e-7 * (number / 2) as f64;
        let _ = writeln!(stl, "FACET NORMAL 0 0 0\nOUTER LOOP");
        for x in corners.map(corner) {
            let [x, y, z] = x.map(|c| f64::from(c) + gap);
            let _ = writeln!(stl, "VERTEX {x:.9} {y:.9} {z:.9}");
        }
        let _ = writeln!(stl, "ENDLOOP\nENDFACET");
    }
    std::fs::write(directory.path().join("faces.stl"), stl + "ENDSOLID CUBE\n").expect("mesh");
    let block = "{ kind = 'box', min = [0.75, 0.75, 0.9375], max = [1.25, 1.25, 1.1875] }";
    let force = |shape: &str| {
        let rest = format!(
            "[[colliders]]\nname = 'cube'\nshape = {shape}\n[time]\nend = 0.05\n[history]\nevery_steps = 5\n[output]\npicture = false"
        );
        let path = directory.path().join("rest.toml");
        std::fs::write(&path, job(block, &rest)).expect("job");
        succeed(&mut run(directory.path(), 1, 1, &path, &["--quiet", "--overwrite"]));
        History::read(directory.path(), "rest").integral("force_cube_z", 0.0)
    };
    // Off the nodes, which would be inside or outside by the gap.
    let exact = force("{ kind = 'box', min = [0.25, 0.25, -0.55], max = [1.75, 1.75, 0.95] }");
    for solid in ["closed", "winding"] {
        let shape = format!(
            "{{ kind = 'mesh', solid = '{solid}', file = 'faces.stl', scale = 1.5, origin = [0.25, 0.25, -0.55] }}"
        );
        let found = force(&shape);
        assert!(exact < -1.0 && (found / exact - 1.0).abs() < 1e-3, "{solid}: {found} for {exact}");
    }
}

/// A channel whose U-shaped sides are polygons of an OBJ is its three walls.
#[test]
fn concave_faces_of_an_obj_are_cut_rightly() {
    let outline = ["0 0", "1 0", "1 1", "0.75 1", "0.75 0.25", "0.25 0.25", "0.25 1", "0 1"];
    let mut obj = String::new();
    for z in ["0", "1"] {
        outline.iter().for_each(|x| _ = writeln!(obj, "v {x} {z}"));
    }
    obj += "f 8 7 6 5 4 3 2 1\nf 9 10 11 12 13 14 15 16\n";
    for k in 0..8 {
        let next = (k + 1) % 8;
        let _ = writeln!(obj, "f {} {} {} {}", k + 1, next + 1, next + 9, k + 9);
    }
    let directory = tempfile::tempdir().expect("temporary directory");
    std::fs::write(directory.path().join("channel.obj"), obj).expect("mesh");
    let rest = "[time]\nend = 0.01";
    let mesh = "{ kind = 'mesh', file = 'channel.obj', origin = [0.5, 0.5, 0] }";
    let walls = "{ kind = 'difference', from = { kind = 'box', min = [0.5, 0.5, 0], max = [1.5, 1.5, 1] }, \
                 remove = [{ kind = 'box', min = [0.75, 0.75, -1], max = [1.25, 2, 2] }] }";
    let [found, exact] = [mesh, walls].map(|shape| outcome(directory.path(), &job(shape, rest)));
    assert!(found.history == exact.history);
}
