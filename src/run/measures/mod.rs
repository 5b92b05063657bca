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

use partition::comm::Comm;

use crate::checksum::fnv1a;
use crate::exact_sum::ExactSum;
use crate::io::snapshot::{self, Scalars};
use crate::job::Problem;
use crate::probe::{Map, Maxima, Tracked};
use crate::solver::Solver;
use crate::solver::migration::fluxes::Fluxes;

/// Name of a number of a flux or a track in the header of a file.
fn measure(kind: &str, name: &str, what: &str) -> String {
    format!("{kind}_{what}{:016x}", fnv1a(name.bytes().map(u64::from)))
}

/// Collective. Appends the masses of fluxes, and the places of tracks.
pub(super) fn write<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    solver: &Solver<D>,
    reals: &mut Vec<(String, f64)>,
    counts: &mut Vec<(String, u64)>,
    exact: &mut Vec<(String, Vec<i64>)>,
) {
    let mut sums = solver.measured.crossings.fluxes.gather(comm);
    let fluxes = problem.fluxes.iter().zip(&mut sums);
    exact.extend(fluxes.map(|(flux, sum)| (measure("flux", &flux.name, ""), sum.words().to_vec())));
    for (track, tracked) in problem.tracks.iter().zip(&solver.measured.tracked) {
        // Halves of an identifier are numbers that counts may be.
        let halves = [("low_", tracked.id & HALF), ("high_", tracked.id >> 32)];
        counts.extend(halves.map(|(half, id)| (measure("track", &track.name, half), id)));
        let place = tracked.place.iter().enumerate();
        reals.extend(place.map(|(a, &x)| (measure("track", &track.name, &format!("{a}_")), x)));
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

/// Takes over the masses of fluxes (on rank 0), the places of tracks and the maxima of maps from the file at
/// `path`. Measurements that the file lacks begin here.
pub(super) fn restore<const D: usize>(
    rank: usize,
    problem: &Problem<D>,
    solver: &mut Solver<D>,
    scalars: &Scalars,
    path: &Path,
) {
    begin(problem, solver);
    for (flux, sum) in problem.fluxes.iter().zip(&mut solver.measured.crossings.fluxes.sums) {
        let read = scalars.exact(&measure("flux", &flux.name, "")).and_then(ExactSum::from_words);
        if let Some(read) = read {
            *sum = if rank == 0 { read } else { ExactSum::new() };
        }
    }
    for (track, tracked) in problem.tracks.iter().zip(&mut solver.measured.tracked) {
        let half = |half| scalars.count(&measure("track", &track.name, half));
        let coordinate = |a: usize| scalars.real(&measure("track", &track.name, &format!("{a}_")));
        let place: Option<Vec<f64>> = (0..D).map(coordinate).collect();
        if let (Some(low), Some(high), Some(place)) = (half("low_"), half("high_"), place) {
            *tracked = Tracked { id: low | high << 32, place: std::array::from_fn(|a| place[a]) };
        }
    }
    for (map, maxima) in problem.maps.iter().zip(&mut solver.measured.maxima) {
        let [depth, speed] =
            ["depth", "speed"].map(|what| snapshot::map_values(path, &map.name, what, map.len()));
        if let (Some(depth), Some(speed)) = (depth, speed) {
            *maxima = Maxima { depth, speed };
        }
    }
}
