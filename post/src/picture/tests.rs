use super::camera::Camera;
use super::paper::canvas::Canvas;
use super::paper::colour::LIGHT;
use super::scales::{nice, short};
use super::scene::Raster;
use super::*;
use agimp::io::snapshot::Scalars;
use agimp::particle::chunk::Chunk;
use agimp::particle::chunk::Tag;
use agimp::particle::followed::Followed;
use partition::{Brick, Octant};

/// A cone of particles on the floor of a unit cube.
fn pile() -> Chunk<3> {
    let mut chunk = Chunk::new();
    let n = 48;
    for k in 0..n {
        for j in 0..n {
            for i in 0..n {
                let [x, y, z] = [i, j, k].map(|i| (f64::from(i) + 0.5) / f64::from(n));
                let r = ((x - 0.5).powi(2) + (y - 0.5).powi(2)).sqrt();
                if z < 0.35 - 0.8 * r {
                    let p = chunk.push_zeroed(0, Tag { material: 0, body: 0, level: 0 });
                    for (axis, value) in [x, y, z].into_iter().enumerate() {
                        chunk.column_mut(Layout::<3>::POSITION + axis)[p] = value;
                    }
                    chunk.column_mut(Layout::<3>::HALF)[p] = 0.5 / f64::from(n);
                    chunk.column_mut(Layout::<3>::HISTORY)[p] = r;
                }
            }
        }
    }
    chunk
}

fn compose(chunk: &Chunk<3>, field: PointField) -> Canvas {
    let chunks = std::slice::from_ref(chunk);
    let view = View {
        leaves: &[Octant { level: 0, coord: [0; 3] }],
        chunks,
        followed: Followed::default(),
        leaf_fields: &[],
        maps: &[],
        maxima: &[],
        origin: [0.0; 3],
        root_edge: 1.0,
        brick: Brick { roots: [1; 3] },
        water_moduli: &[],
        water: None,
        materials: &[],
        bodies: &[],
        histories: &[],
        job_digest: 0,
        job_text: "",
        job_file: Path::new(""),
        step: 0,
        time: 0.0,
        dt: 0.0,
        scalars: &Scalars::default(),
    };
    let splats = (0..chunk.len())
        .zip(scalars(field.values(&view)))
        .map(|(p, value)| Splat { position: chunk.position(p), radii: [0.0125; 3], value })
        .collect();
    let domain = domain(&[0.0; 3], 1.0, &[1; 3]);
    let (tint, caption) = (Tint::of(field, &[], &[]), caption(0.0, 0, 1));
    Drawing {
        flat: false,
        domain,
        splats,
        tint,
        caption,
        solids: Vec::new(),
        leaves: Vec::new(),
        vectors: Vectors::default(),
    }
    .compose(None, &Settings::new("pile"))
}

#[test]
fn a_pile_covers_the_middle_and_is_lit_from_one_side() {
    let canvas = compose(&pile(), PointField::PlasticStrain);
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("pile.png");
    canvas.save(&path).unwrap();
    if let Some(keep) = std::env::var_os("AGIMP_KEEP_PICTURE") {
        std::fs::copy(&path, keep).unwrap();
    }
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(&bytes[1..4], b"PNG");
    let lightness = |x: usize, y: usize| canvas.pixel(x, y).iter().map(|&c| u32::from(c)).sum::<u32>();
    let (middle, row) = (40 + 525, 470);
    let left: u32 = (0..100).map(|i| lightness(middle - 150 + i, row)).sum();
    let right: u32 = (0..100).map(|i| lightness(middle + 50 + i, row)).sum();
    assert!(left > right, "{left} {right}");
    assert_ne!(canvas.pixel(middle, row), LIGHT.paper);
}

#[test]
fn nothing_to_draw_is_no_error() {
    compose(&Chunk::new(), PointField::Velocity);
    compose(&Chunk::new(), PointField::LeafLevel);
}

#[test]
fn numbers_are_short() {
    let shown = [0.0, 0.05, 1.0, 1234.5, -0.25, 1e7, 2.5e-6].map(short);
    assert_eq!(shown, ["0", "0.05", "1", "1234", "-0.25", "1e7", "2.5e-6"]);
    assert_eq!([0.7, 3.0, 5.1, 0.023].map(nice), [0.5, 2.0, 5.0, 0.02]);
}

#[test]
fn microseconds_are_no_zero_seconds() {
    assert_eq!(caption(1.25e-5, 120, 4000), "t = 12.5 µs   step 120   4 000 particles");
}

/// A long name of a field is broken between words, so that no picture cuts it off; what has no room ends with
/// an ellipsis.
#[test]
fn long_names_stand_in_lines() {
    let canvas = Canvas::new([1280, 800], 1.0, LIGHT.paper);
    let lines = |name: &str, most: usize| canvas.lines(2.0, name, 175, most);
    assert_eq!(lines("speed", 4), ["speed"]);
    assert_eq!(lines("equivalent strain", 4), ["equivalent strain"]);
    let long = lines("equivalent plastic strain rate of a cell", 4);
    assert!(long.len() > 1 && long.join(" ") == "equivalent plastic strain rate of a cell");
    let word = lines(&"n".repeat(20_000), 3);
    let many = lines(&"word ".repeat(20_000), 3);
    assert!(
        word.len() == 3 && word[2].ends_with('…') && many.len() == 3 && many[2].ends_with('…'),
        "{many:?}"
    );
    for line in long.iter().chain(&word).chain(&many) {
        assert!(canvas.text_width(2.0, line) <= 175, "{line}");
    }
    assert_eq!(lines("a\u{1b}\nb", 3), ["a\\u{1b} b"]);
}

/// Texts of a plane picture as SVG: column, row, width and height of each.
fn texts(drawing: Drawing, settings: &Settings) -> Vec<([f64; 4], String)> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.svg");
    let canvas = drawing.compose(None, settings);
    canvas.save(&path).unwrap();
    let svg = std::fs::read_to_string(&path).unwrap();
    let one = |element: &str| {
        let number = |key: &str| -> f64 {
            element.split(&format!("{key}=\"")).nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
        };
        let words = element.split('>').nth(1).unwrap().split('<').next().unwrap().to_owned();
        let height = number("font-size") * 0.729;
        let width = canvas.text_width(height / 7.0 / canvas.unit, &words) as f64;
        ([number(" x"), number(" y") - height, width, height], words)
    };
    svg.split("<text").skip(1).map(one).collect()
}

/// Numbers at axes and scales and the lines of a title neither meet nor leave the picture, in domains of any
/// size and place and in pictures of any size; no two ticks of an axis have the same number.
#[test]
fn texts_neither_meet_nor_leave_the_picture() {
    for (low, edge) in [
        ([0.0, 0.0], 1e-3),
        ([0.0, 0.0], 1.0),
        ([-0.3, 2.0], 0.5),
        ([4_649_120.0, 310.5], 4.0),
        ([0.0; 2], 3e5),
    ] {
        for [width, height] in [[400, 300], [640, 800], [1000, 640], [1280, 800], [3000, 2000]] {
            for classes in [false, true] {
                let place = |i: i32| {
                    let at = |axis: usize, share: f64| low[axis] + share * edge;
                    [at(0, f64::from(i % 5) / 5.0 + 0.1), at(1, f64::from(i / 5) / 5.0 + 0.1), 0.0]
                };
                let splats = (0..25).map(|i| Splat {
                    position: place(i),
                    radii: [0.12 * edge; 3],
                    value: 1e5 + f64::from(i),
                });
                let domain = Bounds { low: [low[0], low[1], 0.0], high: [low[0] + edge, low[1] + edge, 0.0] };
                let tint = Tint {
                    name: "equivalent_plastic_strain".into(),
                    unit: "kg/m³".into(),
                    classes,
                    names: vec!["a body with a very long name indeed".into(); 100_025],
                };
                let mut drawing = Drawing {
                    flat: true,
                    domain,
                    splats: splats.collect(),
                    tint,
                    caption: caption(1.25e-5, 123_456, 123_456_789),
                    solids: Vec::new(),
                    leaves: Vec::new(),
                    vectors: Vectors::default(),
                };
                if classes {
                    drawing.splats.iter_mut().for_each(|splat| splat.value -= 1e5);
                }
                let title =
                    "A title that says all about a run and more than fits into one line of any picture "
                        .repeat(4);
                let settings = Settings { width, height, collect: true, ..Settings::new(&title) };
                let texts = texts(drawing, &settings);
                for (i, ([x, y, w, h], words)) in texts.iter().enumerate() {
                    let inside =
                        *x >= 0.0 && *y >= 0.0 && x + w <= width as f64 + 1.0 && y + h <= height as f64;
                    assert!(inside, "{width} x {height}, {edge} m: {words:?} at {x}, {y}");
                    for ([a, b, c, d], other) in &texts[..i] {
                        let apart = x + w <= *a || a + c <= *x || y + h <= *b || b + d <= *y;
                        assert!(
                            apart,
                            "{width} x {height}, {edge} m: {words:?} at {x}, {y} meets {other:?} at {a}, {b}"
                        );
                    }
                }
                if !classes {
                    let numbers: Vec<&str> = texts.iter().map(|(_, words)| &**words).collect();
                    assert!(
                        numbers
                            .iter()
                            .filter(|words| words.starts_with("10000") || words.starts_with("1000"))
                            .count()
                            >= 2
                    );
                }
            }
        }
    }
}

/// A box that is stretched along x covers more columns than rows, by as much.
#[test]
fn a_stretched_ball_is_an_ellipsoid() {
    let bounds = Bounds { low: [0.0; 3], high: [1.0; 3] };
    let camera = Camera::new((false, Direction::Front), &bounds, (1.0, None), 0.0..200.0, 0.0..200.0);
    let mut raster = Raster::new(200, 200);
    let splat = Splat { position: [0.5; 3], radii: [0.4, 0.1, 0.1], value: 0.5 };
    raster.splat(&camera, &splat, false);
    let seen: Vec<usize> = (0..raster.pixels.len()).filter(|&at| raster.pixels[at] != 0).collect();
    let columns =
        seen.iter().map(|at| at % 200).max().unwrap() - seen.iter().map(|at| at % 200).min().unwrap() + 1;
    let rows =
        seen.iter().map(|at| at / 200).max().unwrap() - seen.iter().map(|at| at / 200).min().unwrap() + 1;
    assert!(columns.abs_diff(160) <= 2 && rows.abs_diff(40) <= 2, "{columns} {rows}");
    let area = std::f64::consts::PI * 80.0 * 20.0;
    assert!((seen.len() as f64 / area - 1.0).abs() < 0.02, "{} of {area}", seen.len());
}
