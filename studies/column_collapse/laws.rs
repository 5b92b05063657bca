//! Published laws of granular column collapse.

/// Which columns a law describes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum CollapseLaw {
    /// Cylinders.
    Axisymmetric,
    /// Columns between walls.
    Planar,
}

/// A deposit by a published law.
#[derive(Clone, Copy)]
pub(crate) struct Published {
    /// Its authors.
    pub(crate) authors: &'static str,
    /// Run-out radius, m; `None` where the law does not say.
    pub(crate) edge: Option<f64>,
    /// Final height, m; `None` where the law does not say.
    pub(crate) height: Option<f64>,
}

/// Predictions of the published laws for a column with this aspect ratio and radius (half width), m.
pub(crate) fn published(law: CollapseLaw, aspect: f64, radius: f64) -> [Published; 2] {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: Option<f64>, expected: f64) {
        let found = found.expect("a value");
        assert!((found - expected).abs() < 1e-12 * expected, "{found} for {expected}");
    }

    #[test]
    fn published_laws() {
        let Published { edge, height, .. } = lube(CollapseLaw::Axisymmetric, 0.9, 0.097);
        close(edge, 0.097 * (1.0 + 1.24 * 0.9));
        close(height, 0.0873);
        assert_eq!(lube(CollapseLaw::Planar, 2.0, 1.0).edge, None);
        close(lube(CollapseLaw::Planar, 8.0, 1.0).edge, 1.0 + 1.9 * 4.0);
        // The cone has the volume of the cylinder, the wedge the area of the column.
        let Published { edge, height, .. } = lajeunesse(CollapseLaw::Axisymmetric, 0.9, 0.097);
        close(edge.zip(height).map(|(edge, height)| edge * edge * height / 3.0), 0.097 * 0.097 * 0.0873);
        close(height, 0.07178);
        let Published { edge, height, .. } = lajeunesse(CollapseLaw::Planar, 8.0, 0.5);
        close(edge.zip(height).map(|(edge, height)| edge * height / 2.0), 0.5 * 4.0);
        assert_eq!(lajeunesse(CollapseLaw::Planar, 0.5, 1.0).edge, None);
    }
}
