//! Particles that are followed.
//!
//! A track has an identifier. It follows the particles of its family: the one with this identifier, one that
//! holds it since a merge has undone a split, or all into which it has split. Once a merge of particles of
//! several families has removed the identifier, the track continues with the particle nearest to its place in
//! the last row of the history.
use rayon::prelude::*;

use super::probes::{Partial, Wanted, of_leaf, reduced};
use crate::adaptivity::resample::ids;
use crate::particle::chunk::Tag;
use crate::probe::{Readings, Track, Tracked};
use crate::solver::state::Solver;

impl<const D: usize> Solver<D> {
    /// Collective. Begins to follow the particles nearest to the points of tracks.
    pub fn begin_tracks(&mut self, tracks: &[Track<D>]) {
        self.measured.tracked = tracks
            .iter()
            .map(|track| Tracked { id: self.nearest(track, &track.point), place: track.point })
            .collect();
    }

    /// Collective. The particle nearest to a place, m; of several the one with the least identifier, and
    /// `u64::MAX` of none.
    fn nearest(&self, track: &Track<D>, place: &[f64; D]) -> u64 {
        let counts = |body| track.bodies.as_ref().is_none_or(|bodies| bodies.contains(&body));
        let distance = |x: &[f64; D]| (0..D).fold(0.0, |sum: f64, a| (x[a] - place[a]).powi(2) + sum);
        let leaves = self.chunks.par_iter().with_min_len(16).map(|chunk| {
            let particles = (0..chunk.len()).filter(|&p| counts(Tag::unpack(chunk.tags()[p]).body));
            let all = particles.map(|p| (distance(&chunk.position(p)), chunk.ids()[p]));
            all.fold((f64::INFINITY, u64::MAX), nearer)
        });
        let (own, id) = leaves.reduce(|| (f64::INFINITY, u64::MAX), nearer);
        let least = self.comm.min_f64(own);
        let mut ids = [if own == least { id } else { u64::MAX }];
        self.comm.min_u64(&mut ids);
        ids[0]
    }

    /// Collective. Readings of the tracks, in their order.
    pub fn read_tracks(&mut self, tracks: &[Track<D>]) -> Vec<Readings<D>> {
        if tracks.is_empty() {
            return Vec::new();
        }
        let mut readings = self.read_families(tracks);
        let mut is_lost = false;
        for (i, track) in tracks.iter().enumerate() {
            if readings[i].mass <= 0.0 {
                self.measured.tracked[i].id = self.nearest(track, &self.measured.tracked[i].place);
                is_lost = true;
            }
        }
        if is_lost {
            readings = self.read_families(tracks);
        }
        for (tracked, readings) in self.measured.tracked.iter_mut().zip(&readings) {
            if readings.mass > 0.0 {
                tracked.place = readings.mass_place.map(|sum| sum / readings.mass);
            }
        }
        readings
    }

    /// Collective. Sums over the family of each track.
    fn read_families(&self, tracks: &[Track<D>]) -> Vec<Readings<D>> {
        let physics = &self.physics;
        let partials = tracks.iter().zip(&self.measured.tracked).map(|(track, tracked)| {
            let wanted = Wanted::of(self, &track.quantities);
            let leaves = self.chunks.par_iter().with_min_len(16).map(|chunk| {
                let weight = |p: usize| f64::from(u8::from(ids::are_kin::<D>(chunk.ids()[p], tracked.id)));
                of_leaf(physics, chunk, &wanted, weight)
            });
            leaves.collect::<Vec<Option<Partial<D>>>>()
        });
        reduced(&self.comm, partials)
    }
}

/// The nearer of two particles, each with its distance and identifier.
fn nearer(a: (f64, u64), b: (f64, u64)) -> (f64, u64) {
    if b.0 < a.0 || b.0 == a.0 && b.1 < a.1 { b } else { a }
}
