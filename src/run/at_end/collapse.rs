//! Evaluation of the granular column collapse at the end of a run.
use partition::comm::Comm;

use crate::job::problem::{CollapseLaw, Coordinates, ReportSetup};
use crate::particle::chunk::{Chunk, Layout};
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
    /// Predictions of the published laws.
    pub laws: [Published; 2],
}

/// A deposit by a published law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Published {
    /// Its authors.
    pub authors: &'static str,
    /// Run-out radius, m; `None` where the law does not say.
    pub edge: Option<f64>,
    /// Final height, m; `None` where the law does not say.
    pub height: Option<f64>,
}

/// Collective. Evaluates the deposit that the particles, of `total_mass` kg on all ranks, form.
pub fn evaluate<const D: usize>(
    comm: &Comm,
    setup: &ReportSetup<D>,
    (size, coordinates): ([f64; D], Coordinates),
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
            let half = coordinates.half_width(chunk.column(Layout::<D>::HALF)[p], x[0]);
            let particle = chunk.column(Layout::<D>::MASS)[p];
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
    // The centre is a tenth of the initial radius, where a bin alone may be empty.
    let centre = (0.1 * BINS_PER_RADIUS).ceil() as usize;
    Collapse {
        aspect,
        front: (front.unwrap_or(0) as f64 + 1.0) * width,
        edge: edge as f64 * width,
        height: top[..centre].iter().copied().fold(0.0, f64::max),
        laws: published(law, aspect, radius),
    }
}

/// Predictions of the published laws for a column with this aspect ratio and radius (half width), m.
pub fn published(law: CollapseLaw, aspect: f64, radius: f64) -> [Published; 2] {
    [lube(law, aspect, radius), lajeunesse(law, aspect, radius)]
}

/// Lube et al.: J. Fluid Mech. 508 (2004) for cylinders, Phys. Rev. E 72 (2005) for columns between walls.
/// `a` is the aspect ratio. The run-out laws count from the initial edge.
fn lube(law: CollapseLaw, a: f64, radius: f64) -> Published {
    let (runout, height) = match law {
        CollapseLaw::Axisymmetric => (
            Some(if a < 1.7 { 1.24 * a } else { 1.6 * a.sqrt() }),
            match a {
                _ if a < 1.0 => Some(a),
                _ if a > 1.7 => Some(0.88 * a.powf(1.0 / 6.0)),
                _ => None,
            },
        ),
        CollapseLaw::Planar => (
            match a {
                _ if a < 1.8 => Some(1.2 * a),
                _ if a > 2.8 => Some(1.9 * a.powf(2.0 / 3.0)),
                _ => None,
            },
            Some(if a < 1.15 { a } else { a.powf(0.4) }),
        ),
    };
    let edge = runout.map(|runout| radius * (1.0 + runout));
    Published { authors: "Lube et al.", edge, height: height.map(|height| radius * height) }
}

/// Lajeunesse et al.: Phys. Fluids 16 (2004) for cylinders, 17 (2005) for columns between walls. `a` is the
/// aspect ratio. Their heights; where the top has fallen, the run-out of the cone or wedge of that height and
/// of the initial volume.
fn lajeunesse(law: CollapseLaw, a: f64, radius: f64) -> Published {
    let (limit, fallen) = match law {
        CollapseLaw::Axisymmetric => (0.74, 0.74),
        CollapseLaw::Planar => (0.7, a.cbrt()),
    };
    let (edge, height) = match (law, a > limit) {
        (_, false) => (None, a),
        (CollapseLaw::Axisymmetric, true) => (Some((3.0 * a / fallen).sqrt()), fallen),
        (CollapseLaw::Planar, true) => (Some(2.0 * a / fallen), fallen),
    };
    Published {
        authors: "Lajeunesse et al.",
        edge: edge.map(|edge| radius * edge),
        height: Some(radius * height),
    }
}

impl std::fmt::Display for Collapse {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let published = |value: fn(&Published) -> Option<f64>| {
            let of = |law: &Published| Some(format!("{} {}", law.authors, quantity(value(law)?, "m")));
            let laws: Vec<String> = self.laws.iter().filter_map(of).collect();
            if laws.is_empty() { "no published law".to_owned() } else { laws.join(", ") }
        };
        writeln!(f, "column collapse, aspect ratio {}", number(self.aspect, 4))?;
        writeln!(
            f,
            "  run-out radius  {} (98 % of the mass)   {}",
            quantity(self.front, "m"),
            published(|law| law.edge)
        )?;
        writeln!(f, "  outer edge      {} (connected deposit)", quantity(self.edge, "m"))?;
        write!(f, "  final height    {}   {}", quantity(self.height, "m"), published(|law| law.height))
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn published_laws() {
        let Published { edge, height, .. } = lube(CollapseLaw::Axisymmetric, 0.9, 0.097);
        assert_relative_eq!(edge.unwrap(), 0.097 * (1.0 + 1.24 * 0.9));
        assert_relative_eq!(height.unwrap(), 0.0873);
        assert_eq!(lube(CollapseLaw::Planar, 2.0, 1.0).edge, None);
        assert_relative_eq!(lube(CollapseLaw::Planar, 8.0, 1.0).edge.unwrap(), 1.0 + 1.9 * 4.0);
        // The cone has the volume of the cylinder, the wedge the area of the column.
        let cone = lajeunesse(CollapseLaw::Axisymmetric, 0.9, 0.097);
        let (edge, height) = (cone.edge.unwrap(), cone.height.unwrap());
        assert_relative_eq!(edge * edge * height / 3.0, 0.097 * 0.097 * 0.0873, max_relative = 1e-12);
        assert_relative_eq!(height, 0.07178);
        let wedge = lajeunesse(CollapseLaw::Planar, 8.0, 0.5);
        assert_relative_eq!(
            wedge.edge.unwrap() * wedge.height.unwrap() / 2.0,
            0.5 * 4.0,
            max_relative = 1e-12
        );
        assert_eq!(lajeunesse(CollapseLaw::Planar, 0.5, 1.0).edge, None);
    }

    #[test]
    fn both_laws_are_shown() {
        let laws = [lube(CollapseLaw::Planar, 2.0, 1.0), lajeunesse(CollapseLaw::Planar, 2.0, 1.0)];
        let shown = Collapse { aspect: 2.0, front: 3.0, edge: 3.1, height: 1.3, laws }.to_string();
        assert!(shown.contains("3 m (98 % of the mass)   Lajeunesse et al. 3.175 m\n"), "{shown}");
        assert!(shown.contains("1.3 m   Lube et al. 1.32 m, Lajeunesse et al. 1.26 m"), "{shown}");
    }
}
