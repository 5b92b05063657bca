//! Softening through the whole program: load and shear band of a compressed specimen do not depend on the
//! cells.
#[path = "../../studies/softening/band.rs"]
mod band;

use crate::common::history::History;
use crate::common::launch;
use crate::common::launch::{run, succeed};
use band::Band;

/// Results of a run of the study's specimen.
struct Outcome {
    /// Greatest load on the plate and that at the end, N.
    peak: f64,
    end: f64,
    /// Inclination of the shear band, degrees.
    band: f64,
    /// Particles.
    particles: u64,
}

/// Compresses the specimen of `studies/softening` to 2 % with cells of 125 mm / 2^level.
fn compress(level: u8, more: &[&str]) -> Outcome {
    let directory = tempfile::tempdir().expect("temporary directory");
    let job = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/softening/specimen.toml");
    let level = format!("tree.base_level={level}");
    let arguments = ["--quiet", "--end", "0.7", "--set", &level, "--set", "output.every=0.7"];
    succeed(&mut run(directory.path(), 1, 1, &job, &[&arguments[..], more].concat()));
    let history = History::read(directory.path(), "specimen");
    let load = history.column("load_press_y");
    let last = &load[load.len() * 19 / 20..];
    let Band { angle: band, particles } =
        Band::read(&launch::file(directory.path(), "specimen", "_000001.hdf")).expect("last output");
    Outcome {
        peak: load.iter().fold(0.0, |most, force| most.max(-force)),
        end: -last.iter().sum::<f64>() / last.len() as f64,
        band,
        particles,
    }
}

/// Softening is regularised by the size of cells: without, half the cells would halve the work that the band
/// takes, and the load would fall twice as fast.
#[test]
fn load_and_band_do_not_depend_on_the_cells() {
    let coarse = compress(0, &[]);
    let fine = compress(1, &[]);
    let criterion = "adaptivity.criteria=[{ kind = 'plastic_strain', level = 1, refine = 2e-2 }]";
    let adaptive = compress(0, &["--set", "adaptivity.every_steps=10", "--set", criterion]);
    println!("coarse {:.0} {:.0} {:.1}", coarse.peak, coarse.end, coarse.band);
    println!("fine {:.0} {:.0} {:.1}", fine.peak, fine.end, fine.band);
    println!("adaptive {:.0} {:.0} {:.1}", adaptive.peak, adaptive.end, adaptive.band);
    assert!(coarse.end < 0.95 * coarse.peak, "it softens");
    assert!(adaptive.particles > coarse.particles, "it refines where it shears");
    for other in [&fine, &adaptive] {
        assert!((other.peak / coarse.peak - 1.0).abs() < 0.05);
        assert!((other.end / coarse.end - 1.0).abs() < 0.05);
        assert!((other.band / coarse.band - 1.0).abs() < 0.05);
    }
}
