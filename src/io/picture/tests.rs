use super::colour::LIGHT;
use super::scales::{lines, short};
use super::*;
use crate::io::snapshot::Scalars;
use crate::particle::chunk::Chunk;
use crate::particle::chunk::Tag;
use crate::particle::followed::Followed;
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
        .map(|(p, value)| Splat { position: chunk.position(p), radius: 0.0125, value })
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

/// A long name of a field is broken between words, so that no picture cuts it off.
#[test]
fn long_names_stand_in_lines() {
    assert_eq!(lines("speed", 175), ["speed"]);
    assert_eq!(lines("equivalent strain", 175), ["equivalent strain"]);
    let long = lines("equivalent plastic strain rate of a cell", 175);
    assert!(long.len() > 1 && long.join(" ") == "equivalent plastic strain rate of a cell");
    assert!(long.iter().all(|line| Canvas::text_width(2, line) <= 175), "{long:?}");
}
