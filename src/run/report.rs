//! Evaluation of the granular column collapse at the end of a run.
use partition::comm::Comm;

use crate::job::problem::{CollapseLaw, ReportSetup};
use crate::particle::Chunk;
use crate::text::{number, quantity};

/// Bins of the deposit's profile over the initial radius.
const BINS_PER_RADIUS: f64 = 25.0;
/// Share of the mass within the reported front; the rest are far-flung grains.
const FRONT_SHARE: f64 = 0.98;

/// Final shape of a collapsed column and what published fits give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collapse {
    /// Aspect ratio, initial height over radius or half width.
    pub aspect: f64,
    /// Radius (half width) within which 98 % of the mass lies, m.
    pub front: f64,
    /// Outer edge of the connected deposit, m.
    pub edge: f64,
    /// Height of the deposit at the centre, m.
    pub height: f64,
    /// Run-out radius by the fit, m; `None` where no law holds.
    pub law_edge: Option<f64>,
    /// Final height by the fit, m; `None` where no law holds.
    pub law_height: Option<f64>,
}

/// Collective. Evaluates the deposit that the particles, of `total_mass` kg on all ranks, form.
pub fn evaluate<const D: usize>(
    comm: &Comm,
    setup: &ReportSetup<D>,
    size: [f64; D],
    chunks: &[Chunk<D>],
    total_mass: f64,
) -> Collapse {
    let ReportSetup::ColumnCollapse { base, up, radius, height, law } = *setup;
    let reach = size.iter().fold(0.0, |sum: f64, s| s.mul_add(*s, sum)).sqrt();
    let width = radius / BINS_PER_RADIUS;
    let bins = (reach / width).ceil() as usize + 1;
    // Counts by distance, and the top per distance, so that one small reduction is enough.
    let mut mass = vec![0u64; bins];
    let mut top = vec![0.0f64; bins];
    let mut covered = vec![0u64; bins];
    for chunk in chunks {
        for p in 0..chunk.len() {
            let x = chunk.position(p);
            let distance = (0..D)
                .filter(|&axis| axis != up)
                .fold(0.0, |sum: f64, axis| (x[axis] - base[axis]).mul_add(x[axis] - base[axis], sum))
                .sqrt();
            let bin = ((distance / width) as usize).min(bins - 1);
            let half = chunk.column(crate::particle::Layout::<D>::HALF)[p];
            let particle = chunk.column(crate::particle::Layout::<D>::MASS)[p];
            // Integers add exactly in any order.
            mass[bin] += (particle / total_mass * (1u64 << 50) as f64) as u64;
            top[bin] = top[bin].max(x[up] - base[up] + half);
            // Particles may be farther apart than bins are wide.
            let [from, to] = [distance - half, distance + half].map(|edge| (edge.max(0.0) / width) as usize);
            covered[from.min(bins - 1)..=to.min(bins - 1)].fill(1);
        }
    }
    comm.sum_u64(&mut mass);
    comm.max_f64s(&mut top);
    comm.max_u64(&mut covered);

    let total: u64 = mass.iter().sum();
    let mut inside = 0;
    let front = mass.iter().position(|&m| {
        inside += m;
        inside as f64 >= FRONT_SHARE * total as f64
    });
    let edge = covered.iter().position(|&c| c == 0).unwrap_or(bins);
    let aspect = height / radius;
    let (law_edge, law_height) = fits(law, aspect, radius, height);
    // The centre is a tenth of the initial radius, where a bin alone may be empty.
    let centre = (0.1 * BINS_PER_RADIUS).ceil() as usize;
    Collapse {
        aspect,
        front: (front.unwrap_or(0) as f64 + 1.0) * width,
        edge: edge as f64 * width,
        height: top[..centre].iter().copied().fold(0.0, f64::max),
        law_edge,
        law_height,
    }
}

/// Run-out and final height by Lube et al.: J. Fluid Mech. 508 (2004) for cylinders, Phys. Rev. E 72
/// (2005) for columns between walls. The run-out laws count from the initial edge.
fn fits(law: CollapseLaw, a: f64, radius: f64, height: f64) -> (Option<f64>, Option<f64>) {
    let (runout, top) = match law {
        CollapseLaw::Axisymmetric => (
            Some(if a < 1.7 { 1.24 * a } else { 1.6 * a.sqrt() }),
            match a {
                _ if a < 1.0 => Some(height),
                _ if a > 1.7 => Some(0.88 * radius * a.powf(1.0 / 6.0)),
                _ => None,
            },
        ),
        CollapseLaw::Planar => (
            match a {
                _ if a < 1.8 => Some(1.2 * a),
                _ if a > 2.8 => Some(1.9 * a.powf(2.0 / 3.0)),
                _ => None,
            },
            Some(if a < 1.15 { height } else { radius * a.powf(0.4) }),
        ),
    };
    (runout.map(|runout| radius * (1.0 + runout)), top)
}

impl std::fmt::Display for Collapse {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let published = |value: Option<f64>| {
            value.map_or_else(
                || "no published fit".into(),
                |value| format!("published fit {}", quantity(value, "m")),
            )
        };
        writeln!(f, "column collapse, aspect ratio {}", number(self.aspect, 4))?;
        writeln!(
            f,
            "  run-out radius  {} (98 % of the mass)   {}",
            quantity(self.front, "m"),
            published(self.law_edge)
        )?;
        writeln!(f, "  outer edge      {} (connected deposit)", quantity(self.edge, "m"))?;
        write!(f, "  final height    {}   {}", quantity(self.height, "m"), published(self.law_height))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_fits() {
        let (edge, height) = fits(CollapseLaw::Axisymmetric, 0.9, 0.097, 0.0873);
        approx::assert_relative_eq!(edge.unwrap(), 0.097 * (1.0 + 1.24 * 0.9));
        assert_eq!(height, Some(0.0873));
        assert_eq!(fits(CollapseLaw::Planar, 2.0, 1.0, 2.0).0, None);
        approx::assert_relative_eq!(fits(CollapseLaw::Planar, 8.0, 1.0, 8.0).0.unwrap(), 1.0 + 1.9 * 4.0);
    }
}
