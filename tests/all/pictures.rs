//! `agimp plot`, `movie` and `export`: pictures and exported files show the content of the output files.

use std::path::Path;

use crate::common::program::{RUBBER_BLOCK, RUBBER_MATERIAL, agimp, finished, succeed, told};
use agimp::io::snapshot::PointField;
use post::frame::Frame;

/// A plate comes down on the block of rubber.
const JOB: &str = r#"
version = 1
dimension = 2
[[colliders]]
name = "plate"
shape = { kind = "box", min = [0.3, 0.3], max = [0.7, 0.4] }
motion = { kind = "steady", velocity = [0, -5] }
contact = { kind = "slip" }
[time]
end = 0.02
[output]
every = 0.005
picture = false
"#;

/// Colours of the first material, and of colliders, on light paper.
const RUBBER: [u8; 3] = [94, 110, 160];
const PLATE: [u8; 3] = [186, 190, 198];

/// A directory with a run of the job.
fn run() -> tempfile::TempDir {
    finished("press", &[JOB, RUBBER_BLOCK].concat(), &[])
}

/// An image that is read back: width and pixels.
fn image(path: &Path) -> (usize, Vec<[u8; 3]>) {
    let file = std::fs::File::open(path).expect("a picture");
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("PNG");
    let mut bytes = vec![0; reader.output_buffer_size()];
    let info = reader.next_frame(&mut bytes).expect("a frame");
    (info.width as usize, bytes.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect())
}

/// Pixels of a colour, and the lowest and the highest row of them.
fn seen((width, pixels): &(usize, Vec<[u8; 3]>), colour: [u8; 3]) -> (usize, usize, usize) {
    // Without the legend.
    let rows: Vec<usize> = (0..pixels.len())
        .filter(|at| at % width < width - 190 && pixels[*at] == colour)
        .map(|at| at / width)
        .collect();
    (rows.len(), rows.iter().copied().min().unwrap_or(0), rows.iter().copied().max().unwrap_or(0))
}

#[test]
fn colliders_are_drawn_where_they_are_at_the_time_of_the_file() {
    let directory = run();
    let here = directory.path();
    let plot = |number: usize, options: &[&str]| {
        let file = format!("out/press/press_{number:06}.hdf");
        succeed(here, &[&["plot", &file, "--colour", "material", "--out", "picture.png"], options].concat());
        image(&here.join("picture.png"))
    };
    let first = plot(0, &[]);
    let (plate, top, bottom) = seen(&first, PLATE);
    let (rubber, above, below) = seen(&first, RUBBER);
    // 0.4 m by 0.1 m and 0.5 m by 0.25 m.
    let ratio = plate as f64 / rubber as f64;
    assert!((ratio / (0.04 / 0.125) - 1.0).abs() < 0.1, "{ratio}");
    assert!(top < bottom && bottom < above && above < below, "the plate is above the block");
    // After 10 ms it has gone down by 0.05 m and is on the block; particles are drawn over it.
    let later = plot(2, &[]);
    let ((_, _, lower), (_, top_of_block, _)) = (seen(&later, PLATE), seen(&later, RUBBER));
    assert!(
        above - bottom > 40 && lower.abs_diff(top_of_block) < 12,
        "{bottom} {above}, {lower} {top_of_block}"
    );
    assert_eq!(seen(&plot(0, &["--bare"]), PLATE).0, 0);
    // A job that is not found is no reason not to draw; only meshes are missed.
    std::fs::remove_file(here.join("press.toml")).expect("removed");
    assert!(seen(&plot(0, &[]), PLATE).0 > 1000, "the output holds the job");
}

/// The job names a file, which lies beside it and nowhere near the outputs.
#[test]
fn outputs_know_where_their_job_is() {
    let home = tempfile::tempdir().expect("temporary directory");
    let here = home.path();
    let load = "[[loads]]\nname = \"shake\"\nkind = \"body_force\"\nacceleration = [{ file = \"shake.csv\", time = \"t\", value = \"a\" }, 0]\n";
    std::fs::create_dir_all(here.join("project/cases")).expect("made");
    std::fs::write(here.join("project/cases/press.toml"), [JOB, load, RUBBER_BLOCK].concat())
        .expect("written");
    std::fs::write(here.join("project/cases/shake.csv"), "t,a\n0,0\n1,1\n").expect("written");
    let project = here.join("project");
    succeed(&project, &["run", "--quiet", "cases/press.toml", "--out", "results/one"]);
    let plate = |from: &Path, output: &str| {
        let picture = here.join("picture.png");
        let name = picture.to_str().expect("a name");
        let told = succeed(from, &["plot", output, "--colour", "material", "--out", name]);
        (seen(&image(&picture), PLATE).0, told)
    };
    // From anywhere, and after all has been moved together.
    assert!(plate(&project.join("results/one"), "press_000000.hdf").0 > 1000);
    assert!(
        plate(Path::new("/"), project.join("results/one/press_000000.hdf").to_str().expect("a name")).0
            > 1000
    );
    std::fs::rename(&project, here.join("moved")).expect("moved");
    assert!(plate(here, "moved/results/one/press_000000.hdf").0 > 1000);
    // The output alone: what it has lost is said.
    std::fs::copy(here.join("moved/results/one/press_000000.hdf"), here.join("alone_000000.hdf"))
        .expect("copied");
    let (pixels, told) = plate(here, "alone_000000.hdf");
    assert!(pixels == 0 && told.contains("colliders are not drawn") && told.contains("--job"), "{told}");
    let given = [
        "plot",
        "alone_000000.hdf",
        "--colour",
        "material",
        "--job",
        "moved/cases/press.toml",
        "--out",
        "picture.png",
    ];
    succeed(here, &given);
    assert!(seen(&image(&here.join("picture.png")), PLATE).0 > 1000);
}

/// A ball in cells of two sizes.
const BALL: &str = r#"
version = 1
dimension = 3
[domain]
size = [1, 1, 1]
root_edge = 0.25
[tree]
regions = [{ level = 1, shape = { kind = "box", min = [0, 0, 0], max = [0.5, 1, 1] } }]
[boundaries]
z_min = { kind = "sticky" }
[[bodies]]
name = "ball"
material = "rubber"
shape = { kind = "sphere", centre = [0.5, 0.5, 0.5], radius = 0.3 }
[[bodies]]
name = "cube"
material = "rubber"
shape = { kind = "box", min = [0, 0, 0], max = [0.125, 0.125, 0.125] }
[time]
end = 1e-5
[output]
every = 1
picture = false
"#;

/// A mesh of OBJ: corners, normals, triangles.
type Mesh = (Vec<[f64; 3]>, Vec<[f64; 3]>, Vec<[usize; 3]>);

fn obj(text: &str) -> Mesh {
    let three = |line: &str| -> [f64; 3] {
        let numbers: Vec<f64> =
            line.split(' ').skip(1).map(|number| number.parse().expect("a number")).collect();
        numbers.try_into().expect("three numbers")
    };
    let triangle = |line: &str| -> [usize; 3] {
        let corner = |corner: &str| {
            corner.split('/').next().expect("a corner").parse::<usize>().expect("a number") - 1
        };
        line.split(' ').skip(1).map(corner).collect::<Vec<_>>().try_into().expect("three corners")
    };
    let of = |start: &'static str| text.lines().filter(move |line| line.starts_with(start));
    (of("v ").map(three).collect(), of("vn ").map(three).collect(), of("f ").map(triangle).collect())
}

#[test]
fn surface_of_a_ball_is_closed_and_has_its_volume() {
    let directory = finished("ball", &[BALL, RUBBER_MATERIAL].concat(), &[]);
    let here = directory.path();
    let export = |options: &[&str]| agimp(here, &[&["export", "out/ball/ball_000000.hdf"], options].concat());
    let output = export(&["--surface", "obj", "--body", "ball", "--out", "given"]);
    assert!(output.status.success(), "{}", told(&output));
    let text = std::fs::read_to_string(here.join("given/ball_000000.surface.obj")).expect("OBJ");
    let (points, normals, triangles) = obj(&text);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let volume: f64 =
        triangles.iter().map(|t| dot(points[t[0]], cross(points[t[1]], points[t[2]])) / 6.0).sum();
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.3_f64.powi(3);
    assert!((volume / ball - 1.0).abs() < 0.03, "{volume} of {ball}");
    // Each edge belongs to two triangles, which pass it in both ways.
    let mut edges: Vec<[usize; 2]> =
        triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]).collect();
    edges.sort_unstable();
    assert!(edges.windows(2).all(|pair| pair[0] != pair[1]), "no edge is passed twice");
    assert!(edges.iter().all(|&[a, b]| edges.binary_search(&[b, a]).is_ok()), "the mesh is closed");
    for (point, normal) in points.iter().zip(&normals) {
        let out = point.map(|x| x - 0.5);
        let radius = dot(out, out).sqrt();
        assert!((dot(*normal, *normal) - 1.0).abs() < 1e-5 && dot(out, *normal) > 0.0, "outwards: {point:?}");
        assert!((radius - 0.3).abs() < 0.03, "{radius}");
    }
    // All bodies together; as PLY the numbers follow the header.
    assert!(export(&["--surface", "ply"]).status.success());
    let ply = std::fs::read(here.join("out/ball/ball_000000.surface.ply")).expect("PLY");
    let end = ply.windows(11).position(|bytes| bytes == b"end_header\n").expect("a header") + 11;
    let header = String::from_utf8_lossy(&ply[..end]).into_owned();
    let count = |what: &str| -> usize {
        let line = header.lines().find(|line| line.starts_with(&format!("element {what} ")));
        line.expect("an element").rsplit(' ').next().expect("a number").parse().expect("a number")
    };
    assert_eq!(ply.len() - end, 24 * count("vertex") + 13 * count("face"));
    assert!(count("vertex") > points.len(), "the cube as well");
    for (options, message) in [
        (&["--surface", "stl"][..], "expected ply or obj"),
        (&["--surface", "ply", "--body", "bal"], "found no body bal; expected one of: ball, cube"),
        (&["--ply", "--body", "ball"], "found --body without --surface"),
        (&["--surface", "ply", "--fields", "velocity"], "cannot be used with"),
    ] {
        let output = export(options);
        assert!(output.status.code() == Some(2) && told(&output).contains(message), "{}", told(&output));
    }
    let flat = run();
    let output = agimp(flat.path(), &["export", "--surface", "ply", "out/press/press_000000.hdf"]);
    assert!(
        output.status.code() == Some(2) && told(&output).contains("expected a 3D run"),
        "{}",
        told(&output)
    );
}

/// Corners of the polygons of a colour in an SVG.
fn polygons(svg: &str, colour: &str) -> Vec<Vec<[f64; 2]>> {
    let pair = |pair: &str| {
        let (x, y) = pair.split_once(',').expect("two numbers");
        [x, y].map(|number| number.parse().expect("a number"))
    };
    let of_colour =
        |line: &&str| line.starts_with("<polygon") && line.contains(&format!("fill=\"{colour}\""));
    let corners = |line: &str| line.split('"').nth(1).expect("points").split(' ').map(pair).collect();
    svg.lines().filter(of_colour).map(corners).collect()
}

/// A block that flies to the right: all its arrows do, as long as the arrow of the scale says.
#[test]
fn arrows_show_vectors_and_svg_keeps_lines_and_text() {
    let block = RUBBER_BLOCK.replace("max = [0.75, 0.25] }", "max = [0.75, 0.25] }\nvelocity = [4, 0]");
    let directory =
        finished("press", &[JOB, &block.replace("sticky", "separating")].concat(), &["--end", "1e-4"]);
    let here = directory.path();
    let plot = |options: &[&str]| {
        let words = [
            "plot",
            "out/press/press_000000.hdf",
            "--colour",
            "material",
            "--width",
            "800",
            "--height",
            "500",
        ];
        agimp(here, &[&words, options].concat())
    };
    assert!(plot(&["--vectors", "velocity", "--out", "a.svg", "--title", "Fast & <right>"]).status.success());
    let svg = std::fs::read_to_string(here.join("a.svg")).expect("SVG");
    assert!(svg.contains(">Fast &amp; &lt;right&gt;</text>") && svg.contains(">t = 0 s   step 0"), "texts");
    assert_eq!(svg.matches("<image ").count(), 1);
    let arrows = polygons(&svg, "#28282c");
    // 0.5 m by 0.25 m of the block, in squares of the lattice; and the arrow of the scale.
    let (width, pixels) = {
        plot(&["--out", "b.png"]);
        image(&here.join("b.png"))
    };
    let area = seen(&(width, pixels), RUBBER).0 as f64 / (26.0 * 26.0);
    let count = arrows.len() as f64 - 1.0;
    assert!(count > 0.8 * area && count < 1.5 * area + 20.0, "{count} arrows for {area} squares");
    // The arrow of the scale is as long as half of that speed.
    for (number, arrow) in arrows.iter().enumerate() {
        let length = if number + 1 == arrows.len() { 22.0 } else { 44.0 };
        let (tail, tip) = ([0, 1].map(|i| 0.5 * (arrow[0][i] + arrow[6][i])), arrow[3]);
        assert!(
            (tip[0] - tail[0] - length).abs() < 0.05 && (tip[1] - tail[1]).abs() < 0.05,
            "{tail:?} {tip:?}"
        );
    }
    assert!(svg.contains(">2 m/s</text>"), "the arrow of the scale says how long it is");
    // Without --title: that of the job, and without one the name of the file.
    assert!(plot(&["--out", "untitled.svg"]).status.success());
    let svg = std::fs::read_to_string(here.join("untitled.svg")).expect("SVG");
    assert!(svg.contains(">press_000000</text>"), "the name of the file");
    let job = ["title = \"A block & a plate\"\n", JOB, &block].concat();
    let titled = finished("titled", &job, &["--end", "1e-4"]);
    succeed(titled.path(), &["plot", "out/titled/titled_000000.hdf", "--out", "titled.svg"]);
    let svg = std::fs::read_to_string(titled.path().join("titled.svg")).expect("SVG");
    assert!(svg.contains(">A block &amp; a plate</text>"), "the title of the job");
    // As pixels too; and what is not there is said.
    assert!(plot(&["--vectors", "velocity", "--out", "c.png"]).status.success());
    assert!(image(&here.join("c.png")).1 != image(&here.join("b.png")).1);
    for (options, message) in [
        (&["--vectors", "pressure"][..], "found no vectors pressure; expected one of: velocity"),
        (&["--out", "a.jpg"], "a.jpg: found no extension of a picture; expected .png or .svg"),
        (&["--out", "none/a.svg"], "cannot write the picture"),
    ] {
        let output = plot(options);
        assert_eq!(output.status.code(), Some(2), "{}", told(&output));
        assert!(told(&output).contains(message), "{}", told(&output));
    }
}

#[test]
fn looks_can_be_chosen() {
    let directory = run();
    let here = directory.path();
    let plot = |options: &[&str]| {
        let words = ["plot", "out/press/press_000000.hdf", "--colour", "material", "--out", "picture.png"];
        succeed(here, &[&words, options].concat());
        image(&here.join("picture.png"))
    };
    let usual = seen(&plot(&[]), RUBBER).0 as f64;
    let near = |pixels: usize, share: f64| {
        assert!((pixels as f64 / usual / share - 1.0).abs() < 0.1, "{pixels} of {usual}: {share}")
    };
    near(seen(&plot(&["--clip", "x<0.5"]), RUBBER).0, 0.5);
    near(seen(&plot(&["--clip", "y>0.2"]), RUBBER).0, 0.25); // two of eight rows
    near(seen(&plot(&["--zoom", "0.5"]), RUBBER).0, 0.25);
    // Behind the lower face across x lies the mirror image; the domain is twice as wide, so all is smaller.
    let (width, pixels) = plot(&["--mirror", "x"]);
    let columns: Vec<usize> = (0..pixels.len())
        .filter(|at| pixels[*at] == RUBBER)
        .map(|at| at % width)
        .filter(|x| *x < width - 190)
        .collect();
    let (low, high) = (columns.iter().min().expect("some"), columns.iter().max().expect("some"));
    let middle = (low + high) / 2;
    assert!(!columns.contains(&middle) && columns.iter().any(|x| *x > middle), "two blocks and a gap");
    assert_eq!(plot(&["--dark"]).1[0], [20, 22, 26]);
    assert_ne!(plot(&["--tree"]).1, plot(&[]).1);
    for (options, message) in [
        (&["--view", "left"][..], "expected iso, front, side, top or a direction"),
        (&["--map", "jet"], "expected one of viridis, magma, coolwarm, grey"),
        (&["--clip", "w<1"], "expected the half space to keep, such as x<0.5"),
        (&["--zoom", "0"], "expected a number from 0.01 to 1000"),
        (&["--focus", "1"], "expected a position in m"),
        (&["--mirror", "a"], "expected axes such as x, y or xy"),
    ] {
        let output = agimp(here, &[&["plot", "out/press/press_000000.hdf"], options].concat());
        assert_eq!(output.status.code(), Some(2), "{options:?}: {}", told(&output));
        assert!(told(&output).contains(message), "{options:?}: {}", told(&output));
    }
}

#[test]
fn a_movie_has_a_frame_for_each_output() {
    let directory = run();
    let here = directory.path();
    let words = succeed(
        here,
        &["movie", "out/press/press.hdf.series", "--colour", "speed", "--width", "640", "--height", "400"],
    );
    assert!(words.contains("press.movie.png (5 frames"), "{words}");
    let file = std::fs::File::open(here.join("out/press/press.movie.png")).expect("a movie");
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("PNG");
    assert_eq!(reader.info().animation_control.expect("an animation").num_frames, 5);
    let mut bytes = vec![0; reader.output_buffer_size()];
    let mut frames = 0;
    while reader.next_frame(&mut bytes).is_ok() {
        frames += 1;
    }
    assert_eq!(frames, 5);
    succeed(
        here,
        &["movie", "out/press/press.hdf.series", "--width", "400", "--height", "300", "--out", "press.gif"],
    );
    let gif = std::fs::read(here.join("press.gif")).expect("a movie");
    assert!(gif.starts_with(b"GIF89a"));
    let output = agimp(here, &["movie", "out/press/press.hdf.series", "--out", "press.avi"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(told(&output).contains("expected .png, .gif, .mp4 or .webm"), "{}", told(&output));
}

#[test]
fn exported_particles_are_those_of_the_file() {
    let directory = run();
    let here = directory.path();
    let file = here.join("out/press/press_000004.hdf");
    let frame = Frame::read(&file, &[PointField::Velocity], true).expect("an output");
    let n = frame.positions.len();
    for format in ["--csv", "--ply", "--vtp"] {
        succeed(
            here,
            &[
                "export",
                "out/press/press_000004.hdf",
                format,
                "--fields",
                "id,velocity,material",
                "--out",
                "given",
            ],
        );
    }
    let csv = std::fs::read_to_string(here.join("given/press_000004.csv")).expect("CSV");
    let mut rows = csv.lines();
    assert_eq!(
        rows.next(),
        Some("x [m],y [m],z [m],radius [m],id,velocity_x [m/s],velocity_y [m/s],velocity_z [m/s],material")
    );
    let rows: Vec<Vec<f64>> =
        rows.map(|row| row.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
    assert_eq!(rows.len(), n);
    for (row, position) in rows.iter().zip(&frame.positions) {
        assert_eq!(row[..3], *position, "to the last digit");
    }
    let ply = std::fs::read(here.join("given/press_000004.ply")).expect("PLY");
    let end = b"end_header\n";
    let start = ply.windows(end.len()).position(|part| part == end).expect("its header") + end.len();
    let header = String::from_utf8_lossy(&ply[..start]);
    assert!(
        header.contains(&format!("element vertex {n}\n")) && header.contains("property float radius\n"),
        "{header}"
    );
    assert_eq!(ply.len() - start, n * 9 * 4);
    let first = f32::from_le_bytes(ply[start..start + 4].try_into().expect("four bytes"));
    assert_eq!(first, frame.positions[0][0] as f32);
    let vtp = std::fs::read(here.join("given/press_000004.vtp")).expect("VTP");
    let mark = b"encoding=\"raw\">\n_";
    let start = vtp.windows(mark.len()).position(|part| part == mark).expect("its data") + mark.len();
    assert_eq!(u64::from_le_bytes(vtp[start..start + 8].try_into().expect("eight bytes")), 24 * n as u64);
    let y = f64::from_le_bytes(vtp[start + 16..start + 24].try_into().expect("eight bytes"));
    assert_eq!(y, frame.positions[0][1]);

    let output = agimp(here, &["export", "out/press/press_000004.hdf"]);
    assert_eq!(output.status.code(), Some(2), "which format: {}", told(&output));
    let output = agimp(here, &["export", "out/press/press_000004.tree.hdf", "--csv"]);
    assert!(
        output.status.code() == Some(2) && told(&output).contains("found the tree of a run"),
        "{}",
        told(&output)
    );
}

/// The tree for other programs keeps levels and particles: in the text, and as VTK reads it where it is
/// installed.
#[test]
fn an_exported_tree_is_that_of_the_run() {
    let levels = "tree.regions=[{level = 2, shape = {kind = 'box', min = [0.3, 0.05], max = [0.45, 0.2]}}]";
    for dimension in ["2", "3"] {
        let cube = RUBBER_BLOCK
            .replace("size = [1, 1]", "size = [1, 1, 0.5]")
            .replace("min = [0.25, 0.0]", "min = [0.25, 0.0, 0.0]")
            .replace("max = [0.75, 0.25]", "max = [0.75, 0.25, 0.25]");
        let [block, levels] = if dimension == "2" {
            [RUBBER_BLOCK.to_owned(), levels.to_owned()]
        } else {
            [cube, levels.replace("0.05]", "0.05, 0.05]").replace("0.2]", "0.2, 0.2]")]
        };
        let job = format!(
            "version = 1\ndimension = {dimension}\n[time]\nend = 0.002\n[output]\nevery = 0.001\n{block}"
        );
        let directory = finished("tree", &job, &["--set", &levels]);
        let here = directory.path();
        let output = here.join("out/tree/tree_000002.hdf");
        let leaves = post::frame::Leaves::of_output(&output).expect("leaves").levels;
        assert!(leaves.iter().max() > leaves.iter().min(), "{leaves:?}");
        let frame = Frame::read(&output, &[], true).expect("an output");
        let particles = frame.positions.len() as f64;
        let said = succeed(here, &["export", "out/tree/tree_000002.hdf", "--htg"]);
        assert!(said.contains(&format!("({} leaves", leaves.len())), "{said}");
        let path = here.join("out/tree/tree_000002.htg");
        let text = std::fs::read_to_string(&path).expect("XML");
        let array = |name: &str| -> Vec<f64> {
            let start = text.find(&format!("Name=\"{name}\"")).expect(name);
            let values = text[start..].split(['>', '<']).nth(1).expect("values").split_whitespace();
            values.map(|value| value.parse().expect("a number")).collect()
        };
        let (depths, counts) = (array("DepthPerTree"), array("NumberOfVerticesPerDepth"));
        assert_eq!(depths.iter().sum::<f64>() as usize, counts.len());
        let cells = counts.iter().sum::<f64>() as usize;
        let refined = array("Descriptors").iter().sum::<f64>() as usize;
        assert_eq!(cells - refined, leaves.len());
        assert_eq!(array("TimeValue"), [frame.header.time]);
        // The roots hold all particles.
        let firsts = depths.iter().scan([0, 0], |[tree, cell], depth| {
            let first = *cell;
            let rows = *tree..*tree + *depth as usize;
            *cell += counts[rows.clone()].iter().sum::<f64>() as usize;
            *tree = rows.end;
            Some(first)
        });
        let in_cells = array("particles");
        assert_eq!(firsts.map(|cell| in_cells[cell]).sum::<f64>(), particles);
        let pythons = std::env::var("AGIMP_VTK_PYTHON").unwrap_or_default();
        for python in pythons.split(':').filter(|python| !python.is_empty()) {
            let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vtk_check.py");
            let read =
                std::process::Command::new(python).arg(script).arg(&path).output().expect("python starts");
            assert!(read.status.success(), "{}", told(&read));
            let found: serde_json::Value = serde_json::from_slice(&read.stdout).expect("JSON");
            assert_eq!(found["leaves"], leaves.len(), "{found}");
            assert_eq!(found["sums_of_leaves"]["particles"], particles, "{found}");
            let sum: u32 = leaves.iter().map(|level| u32::from(*level)).sum();
            assert_eq!(found["sums_of_leaves"]["level"], f64::from(sum), "{found}");
            assert_eq!(found["bounds"][1], 1.0);
            // VTK 9.2 reads no field data of such files.
            assert!(found["time"].is_null() || found["time"] == frame.header.time, "{found}");
        }
    }
}

/// A file, several, a pattern with trees, the directory, the index and the job file mean the same outputs for
/// all subcommands.
#[test]
fn subcommands_take_files_directories_indices_and_jobs() {
    let directory = run();
    let here = directory.path();
    let all: Vec<String> = (0..5).map(|number| format!("out/press/press_{number:06}.hdf")).collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    let tree = "out/press/press_000000.tree.hdf";
    let pattern = [&all[..], &[tree]].concat();
    let words: [&[&str]; 5] =
        [&all, &pattern, &["out/press"], &["out/press/press.hdf.series"], &["press.toml"]];
    for words in words {
        let told = |command: &[&str], options: &[&str]| succeed(here, &[command, words, options].concat());
        let pictures = told(&["plot", "--colour", "speed"], &["--out", "pictures"]);
        assert_eq!(
            pictures.lines().filter(|line| line.starts_with("pictures/press_")).count(),
            5,
            "{pictures}"
        );
        assert!(told(&["view"], &["--out", "page.html"]).contains("5 times"));
        assert!(told(&["movie"], &["--out", "movie.png"]).contains("5 frames"));
        assert_eq!(told(&["export", "--csv"], &["--out", "csv"]).matches("particles").count(), 5);
        assert!(told(&["report"], &["--out", "report.html"]).contains("report.html"));
        let about = told(&["info"], &[]);
        assert_eq!(about.matches("particles        ").count(), 5, "{about}");
    }
    // Of one output a file each, as ever.
    succeed(here, &["plot", all[1], "--out", "one.png"]);
    assert!(succeed(here, &["export", "--csv", all[1], "--out", "one.csv"]).starts_with("one.csv ("));
    assert!(here.join("one.csv").is_file());
    assert!(told(&agimp(here, &["view", all[1], "--out", "page.html"])).contains("one time"));
    assert!(succeed(here, &["report", all[1]]).contains("out/press/press.report.html"));
    // A tree is none of these but for info and its own export.
    succeed(here, &["info", tree]);
    succeed(here, &["export", "--htg", tree, "--out", "csv"]);
    std::fs::create_dir(here.join("nothing")).expect("made");
    for (command, options) in
        [(&["plot"][..], &[][..]), (&["movie"], &[]), (&["view"], &[]), (&["export", "--csv"], &[])]
    {
        for (word, message) in [
            (
                tree,
                "press_000000.tree.hdf: found the tree of a run, which holds no particles; expected its outputs: out/press/press_000000.hdf",
            ),
            ("nothing", "nothing: found no outputs of a run; expected NAME.hdf.series or NAME_000000.hdf"),
        ] {
            let output = agimp(here, &[command, &[word], options].concat());
            assert_eq!(output.status.code(), Some(2), "{command:?} {word}: {}", told(&output));
            assert!(told(&output).contains(message), "{command:?} {word}: {}", told(&output));
        }
    }
    let output = agimp(here, &["plot", "out/press", "--out", "all.png"]);
    assert!(
        told(&output).contains("found one file for 5 outputs; expected a directory"),
        "{}",
        told(&output)
    );
    for command in ["plot", "movie"] {
        let output = agimp(here, &[command, "out/press", "--from", "2", "--to", "1"]);
        assert_eq!(output.status.code(), Some(2), "{}", told(&output));
        let message = "found --from 2 --to 1; expected a first value below the last";
        assert!(told(&output).contains(message), "{}", told(&output));
    }
}

#[test]
fn a_clip_that_keeps_nothing_is_refused() {
    let directory = run();
    let here = directory.path();
    let first = "out/press/press_000000.hdf";
    for words in [&["plot", first][..], &["plot", "out/press"], &["movie", "out/press"]] {
        let output = agimp(here, &[words, &["--clip", "x>5"]].concat());
        assert_eq!(output.status.code(), Some(2), "{}", told(&output));
        let message = "the clip x>5 keeps no particle; expected a place among them, x from ";
        assert!(told(&output).contains(message), "{}", told(&output));
    }
    // Behind a plane of symmetry there is the mirror image.
    let clip = |options: &[&str]| {
        agimp(here, &[&["plot", first, "--clip", "x<-0.3", "--out", "a.png"], options].concat())
    };
    assert!(!clip(&[]).status.success() && clip(&["--mirror", "x"]).status.success());
}

/// A sheet of rubber that flies apart along x alone is stretched one and a half times; its particles still
/// cover it without gaps.
#[test]
fn stretched_boxes_leave_no_gaps() {
    let job = r#"
version = 1
dimension = 2
[domain]
size = [2, 1]
root_edge = 0.25
[[materials]]
name = "rubber"
density = 1000
model = "neo_hookean"
young = 1
poisson = 0.3
[[bodies]]
name = "sheet"
material = "rubber"
shape = { kind = "box", min = [0.625, 0.25], max = [1.375, 0.75] }
velocity = ["2 * (x - 1)", 0]
[time]
end = 0.25
[output]
picture_field = "material"
"#;
    let directory = finished("sheet", job, &[]);
    let here = directory.path();
    succeed(here, &["plot", "out/sheet/sheet_000001.hdf", "--colour", "material", "--out", "file.png"]);
    let places =
        Frame::read(&here.join("out/sheet/sheet_000001.hdf"), &[], false).expect("a frame").positions;
    let reach = places.iter().fold([f64::MAX, f64::MIN], |[low, high], x| [low.min(x[0]), high.max(x[0])]);
    assert!(reach[1] - reach[0] > 1.4 * 0.7, "stretched: {reach:?}");
    for picture in ["file.png", "out/sheet/sheet.png"] {
        let (width, pixels) = image(&here.join(picture));
        let covered = |row: usize| {
            let columns: Vec<usize> =
                (0..width - 190).filter(|column| pixels[row * width + column] == RUBBER).collect();
            let span = columns.last().zip(columns.first()).map_or(0, |(last, first)| last - first + 1);
            (columns.len(), span)
        };
        let (count, span) = (0..pixels.len() / width)
            .map(covered)
            .filter(|(count, _)| *count > 100)
            .fold((0, 0), |(a, b), (c, d)| (a + c, b + d));
        assert!(count > 10_000 && count as f64 > 0.99 * span as f64, "{picture}: {count} of {span} pixels");
    }
}

/// Whatever a title or a name holds, pictures and pages are XML and HTML that say it in letters.
#[test]
fn control_characters_reach_no_picture_and_no_page() {
    let name = r"a\u0001\u001b]0;x\u0007\u007F\u2028\u202e";
    let block = RUBBER_BLOCK
        .replace("\"rubber\"", &format!("\"{name}\""))
        .replace("\"block\"", &format!("\"{name}\""));
    let directory = finished("press", &format!("title = \"{name}\"\n{JOB}{block}"), &[]);
    let here = directory.path();
    succeed(here, &["plot", "out/press/press_000001.hdf", "--colour", "body", "--out", "a.svg"]);
    succeed(here, &["report", "out/press", "--out", "report.html"]);
    succeed(here, &["view", "out/press", "--out", "view.html"]);
    for file in ["a.svg", "report.html", "view.html"] {
        let text = std::fs::read_to_string(here.join(file)).expect("a file");
        let hidden: Vec<char> =
            text.chars().filter(|c| agimp::text::controls(*c) && !matches!(c, '\n' | '\t')).collect();
        assert!(hidden.is_empty(), "{file}: {hidden:?}");
        assert!(text.contains(r"\u{1b}") || text.contains(r"\\u{1b}"), "{file} shows that there was one");
    }
}
