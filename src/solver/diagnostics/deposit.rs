//! Deposits: how far material has run out about a foot, and how high it lies there.
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::probe::{Deposit, Probe};
use crate::solver::state::Solver;

/// Share of the mass within the run-out; the rest are far-flung grains.
const SHARE: f64 = 0.98;
/// Distances up to that of the farthest particle are told apart in so many parts.
const PARTS: usize = 4096;
/// The height is that within the run-out times this.
const MIDDLE: f64 = 0.05;
/// Masses are whole multiples of the total mass over this, so that sums do not depend on their order.
const UNITS: f64 = (1_u64 << 50) as f64;

/// A particle, seen from the foot.
struct Seen {
    /// Distance in plan, m.
    distance: f64,
    /// Half width of its box, m.
    half: f64,
    /// Height of its upper side, m.
    top: f64,
    /// Mass, kg.
    mass: f64,
}

impl<const D: usize> Solver<D> {
    /// Collective. The deposit that the particles of a probe, of `mass` kg on all ranks, form about a foot (m
    /// from the lower corner of the domain).
    pub(super) fn read_deposit(&self, probe: &Probe<D>, foot: &[f64; D], mass: f64) -> Deposit {
        let seen: Vec<Seen> = self.chunks.iter().flat_map(|chunk| self.seen(chunk, probe, foot)).collect();
        let reach = seen.iter().map(|seen| seen.distance + seen.half).fold(0.0, f64::max);
        let reach = self.comm.max_f64(reach);
        if mass <= 0.0 || reach <= 0.0 {
            return Deposit::NONE;
        }
        let width = reach / (PARTS - 1) as f64;
        let part = |distance: f64| ((distance.max(0.0) / width) as usize).min(PARTS - 1);
        let mut masses = vec![0_u64; PARTS];
        let mut covered = vec![0_u64; PARTS];
        let mut tops = vec![f64::NEG_INFINITY; PARTS];
        for Seen { distance, half, top, mass: own } in seen {
            masses[part(distance)] += (own / mass * UNITS) as u64;
            // A gap as wide as a box ends no deposit.
            covered[part(distance - 3.0 * half)..=part(distance + half)].fill(1);
            let nearest = part(distance - half);
            tops[nearest] = tops[nearest].max(top);
        }
        self.comm.sum_u64(&mut masses);
        self.comm.max_u64(&mut covered);
        self.comm.max_f64s(&mut tops);

        let total: u64 = masses.iter().sum();
        let mut inside = 0;
        let front = masses.iter().position(|&mass| {
            inside += mass;
            inside as f64 >= SHARE * total as f64
        });
        let front = front.unwrap_or(PARTS - 1);
        let edge = covered[front..].iter().position(|&is_covered| is_covered == 0);
        let run_out = (front + 1) as f64 * width;
        let height = tops[..=part(MIDDLE * run_out)].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Deposit {
            run_out,
            edge: edge.map_or(reach, |gap| (front + gap) as f64 * width),
            height: if height.is_finite() { height } else { f64::NAN },
        }
    }

    /// The particles of a leaf that count in a probe.
    fn seen<'a>(
        &'a self,
        chunk: &'a Chunk<D>,
        probe: &'a Probe<D>,
        foot: &'a [f64; D],
    ) -> impl Iterator<Item = Seen> + 'a {
        (0..chunk.len()).filter_map(move |p| {
            let x = chunk.position(p);
            let counts = probe.counts(&x, Tag::unpack(chunk.tags()[p]).body);
            counts.then(|| {
                let half = self.physics.coordinates.half_width(chunk.column(Layout::<D>::HALF)[p], x[0]);
                let plan = (0..D - 1).map(|a| x[a] - foot[a]);
                Seen {
                    distance: plan.fold(0.0, |sum: f64, d| d.mul_add(d, sum)).sqrt(),
                    half,
                    top: x[D - 1] - foot[D - 1] + half,
                    mass: chunk.column(Layout::<D>::MASS)[p],
                }
            })
        })
    }
}
