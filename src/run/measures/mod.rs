//! Measurements beside the history: their files, and their state for a restart.
//!
//! | file | what it holds |
//! |---|---|
//! | `mod.rs` | fluxes, tracks and maps in the scalars of a state |
//! | [`lines`] | files of lines |
//! | [`maps`] | files of maps |
pub(super) mod lines;
pub(super) mod maps;

use std::path::Path;

use crate::checksum::fnv1a;
use crate::io::snapshot;
use crate::job::Problem;
use crate::probe::{Map, Maxima};
use crate::saved::Saved;
use crate::solver::Solver;
use crate::solver::migration::fluxes::Fluxes;

/// Name of a number of a flux or a track in the header of a file.
fn measure(kind: &str, name: &str, what: &str) -> String {
    format!("{kind}_{what}{:016x}", fnv1a(name.bytes().map(u64::from)))
}

/// Collective to a file. Masses of fluxes, and places of tracks; those that a file lacks begin where the run
/// goes on.
pub(super) fn save<const D: usize>(problem: &Problem<D>, solver: &mut Solver<D>, saved: &mut Saved<'_>) {
    let measured = &mut solver.measured;
    let passed = measured.crossings.fluxes.sums.iter_mut();
    saved.if_there(|saved| saved.sums(|i| measure("flux", &problem.fluxes[i].name, ""), passed));
    for (track, tracked) in problem.tracks.iter().zip(&mut measured.tracked) {
        let number = |what: &str| measure("track", &track.name, what);
        // Halves of an identifier are numbers that counts may be.
        let (mut low, mut high) = (tracked.id & HALF, tracked.id >> 32);
        saved.if_there(|saved| {
            saved.count(number("low_"), &mut low);
            saved.count(number("high_"), &mut high);
            tracked.place.iter_mut().enumerate().for_each(|(a, x)| saved.real(number(&format!("{a}_")), x));
        });
        tracked.id = low | high << 32;
    }
}

/// The lower half of an identifier.
const HALF: u64 = 0xffff_ffff;

/// Collective. Begins to count at fluxes, to follow tracks, and to record maxima over maps.
pub(super) fn begin<const D: usize>(problem: &Problem<D>, solver: &mut Solver<D>) {
    solver.measured.crossings.fluxes = Fluxes::new(&problem.fluxes);
    solver.measured.crossings.fluxes.add_beyond(&solver.chunks, -1.0);
    solver.begin_tracks(&problem.tracks);
    solver.measured.maxima = problem.maps.iter().map(Map::nothing).collect();
}

/// Reads the maxima of maps from the file at `path`; of maps that it lacks they begin here.
pub(super) fn read_maps<const D: usize>(problem: &Problem<D>, solver: &mut Solver<D>, path: &Path) {
    for (map, maxima) in problem.maps.iter().zip(&mut solver.measured.maxima) {
        let [depth, speed] =
            ["depth", "speed"].map(|what| snapshot::map_values(path, &map.name, what, map.len()));
        if let (Some(depth), Some(speed)) = (depth, speed) {
            *maxima = Maxima { depth, speed };
        }
    }
}
