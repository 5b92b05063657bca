//! Forces on surfaces and points: particles carry them.
//!
//! At the start each particle at a surface gets the area that it stands for, and each particle of a point
//! force its share. These numbers move with the particles, are shared among children and add up in merges, so
//! that the total force is that of the definition at all times.
use super::words::{all_in_words, in_words};
use crate::quantity::Quantity;

/// A force that particles carry.
#[derive(Clone, Debug)]
pub struct Carried<const D: usize> {
    /// Kind and values of the force.
    pub force: CarriedForce<D>,
    /// First of its columns among the carried columns of particles.
    pub first: usize,
    /// Numbers of the bodies whose particles carry it; `None`: all.
    pub bodies: Option<Vec<u16>>,
    /// Unit vector: only surface counts whose outward normal is within 45° of it.
    pub facing: Option<[f64; D]>,
}

/// Force that particles carry.
#[derive(Clone, Debug)]
pub enum CarriedForce<const D: usize> {
    /// Dead traction t (Pa): `t A` with the undeformed area A (m², in plane strain m), which is the
    /// particle's first number; the area vector of the deformed surface follows.
    Traction([Quantity; D]),
    /// Pressure p (Pa) against the outward normal: `-p a` with the area vector a (m², in plane strain m), one
    /// number per axis.
    Pressure {
        /// The pressure, Pa.
        pressure: Quantity,
        /// Whether a is that of the deformed surface, `da = J F⁻ᵀ dA`; else that of the undeformed one.
        follows: bool,
    },
    /// Dead force f (N; in plane strain per metre of thickness), of which each particle has a share.
    Point {
        /// The force.
        force: [Quantity; D],
        /// Whether shares are in proportion to volume; else all are the same.
        by_volume: bool,
    },
}

impl<const D: usize> CarriedForce<D> {
    /// Numbers that a particle carries for it.
    pub fn columns(&self) -> usize {
        match self {
            Self::Traction(_) => 1 + D,
            Self::Point { .. } => 1,
            Self::Pressure { .. } => D,
        }
    }

    /// All quantities that it has.
    pub fn quantities(&self) -> Vec<&Quantity> {
        match self {
            Self::Traction(components) | Self::Point { force: components, .. } => components.iter().collect(),
            Self::Pressure { pressure, .. } => vec![pressure],
        }
    }

    /// Kind and value, in words.
    pub fn describe(&self) -> String {
        match self {
            Self::Traction(components) => format!("traction ({})", all_in_words(components, "Pa")),
            Self::Pressure { pressure, follows } => {
                let surface = if *follows { "deformed" } else { "undeformed" };
                format!("pressure {} on the {surface} surface", in_words(pressure, "Pa"))
            }
            Self::Point { force, .. } => format!("point force ({})", all_in_words(force, "N")),
        }
    }

    /// Whether it depends on the place.
    pub fn depends_on_place(&self) -> bool {
        self.quantities().into_iter().any(Quantity::depends_on_place)
    }

    /// Whether it depends on places of the undeformed body.
    pub fn names_undeformed(&self) -> bool {
        self.quantities().into_iter().any(Quantity::names_undeformed)
    }

    /// Whether it acts on a surface.
    pub fn is_on_surface(&self) -> bool {
        !matches!(self, Self::Point { .. })
    }
}

impl<const D: usize> Carried<D> {
    /// Whether particles of a body carry it.
    pub fn is_on(&self, body: usize) -> bool {
        self.bodies.as_ref().is_none_or(|bodies| bodies.iter().any(|&own| usize::from(own) == body))
    }

    /// First of the numbers of the area vector, m², if particles carry one.
    fn area_vector(&self) -> Option<usize> {
        match self.force {
            CarriedForce::Pressure { .. } => Some(0),
            CarriedForce::Traction(_) => Some(1),
            CarriedForce::Point { .. } => None,
        }
    }

    /// First column of the area vector that follows the deformation, if there is one.
    pub fn following(&self) -> Option<usize> {
        let is_fixed = matches!(self.force, CarriedForce::Pressure { follows: false, .. });
        Some(self.first + self.area_vector().filter(|_| !is_fixed)?)
    }

    /// Numbers, one per column, that a particle carries for a piece of surface with this area vector, m².
    pub fn of_surface(&self, area: &[f64; D]) -> Vec<f64> {
        match self.force {
            CarriedForce::Pressure { .. } => area.to_vec(),
            CarriedForce::Traction(_) => [length(area)].into_iter().chain(*area).collect(),
            CarriedForce::Point { .. } => vec![length(area)],
        }
    }

    /// Vector (m) from the centre of a particle that carries these numbers to the surface that they stand
    /// for, where a force on surfaces depends on the place; `half` are the half widths of its box, m. On an
    /// inclined surface particles lie at all distances, so the vector has their mean.
    pub fn way_to_surface(&self, numbers: &[f64], half: &[f64; D]) -> [f64; D] {
        let Some(first) = self.area_vector().filter(|_| self.force.depends_on_place()) else {
            return [0.0; D];
        };
        let area: [f64; D] = std::array::from_fn(|a| numbers[first + a]);
        let size = length(&area);
        if size == 0.0 {
            return [0.0; D];
        }
        // Along the main axis of the normal each line of particles has one at the surface, half a width from
        // it in the mean.
        let normal = area.map(|a| a / size);
        let main = normal.iter().fold(0.0_f64, |greatest, n| greatest.max(n.abs()));
        std::array::from_fn(|a| main * normal[a] * half[a])
    }

    /// First moment (N m) of this force (N) on a particle that carries these numbers: component i by the
    /// place along k. The parts of the area across each axis act at the face of its box there, with the half
    /// widths `half`, m; a pressure along that axis alone. The moment is about its centre of mass, which lies
    /// `ahead` of the middle of the box along the first axis, m. 0 for forces on points.
    pub fn moment(&self, numbers: &[f64], force: &[f64; D], half: &[f64; D], ahead: f64) -> [[f64; D]; D] {
        let area: [f64; D] =
            self.area_vector().map_or([0.0; D], |first| std::array::from_fn(|a| numbers[first + a]));
        let total: f64 = area.iter().map(|a| a.abs()).sum();
        if total == 0.0 {
            return [[0.0; D]; D];
        }
        let is_pressure = matches!(self.force, CarriedForce::Pressure { .. });
        let share = |i: usize, k: usize| match is_pressure {
            true => f64::from(u8::from(i == k && area[k] != 0.0)),
            false => area[k].abs() / total,
        };
        let way = |k: usize| area[k].signum() * half[k] - if k == 0 { ahead } else { 0.0 };
        std::array::from_fn(|i| std::array::from_fn(|k| force[i] * share(i, k) * way(k)))
    }

    /// The size of the area that a particle with these numbers stands for, m².
    pub fn area(&self, numbers: &[f64]) -> f64 {
        match self.force {
            CarriedForce::Pressure { .. } => numbers[..D].iter().map(|a| a * a).sum::<f64>().sqrt(),
            _ => numbers[0].abs(),
        }
    }

    /// Whether surface with this area vector counts.
    pub fn is_facing(&self, area: &[f64; D]) -> bool {
        self.facing.is_none_or(|facing| {
            let along: f64 = facing.iter().zip(area).map(|(f, a)| f * a).sum();
            along >= std::f64::consts::FRAC_1_SQRT_2 * length(area)
        })
    }
}

/// `J F⁻ᵀ` of a deformation gradient F, which maps undeformed area vectors to deformed ones (Nanson's
/// formula). In plane strain the thickness stays.
pub fn cofactor<const D: usize>(f: &[[f64; D]; D]) -> [[f64; D]; D] {
    let minor = |i: usize, j: usize| match D {
        2 => {
            let other = f[1 - i][1 - j];
            if i == j { other } else { -other }
        }
        _ => {
            let (a, b, c, d) = ((i + 1) % D, (i + 2) % D, (j + 1) % D, (j + 2) % D);
            f[a][c] * f[b][d] - f[a][d] * f[b][c]
        }
    };
    std::array::from_fn(|i| std::array::from_fn(|j| minor(i, j)))
}

fn length<const D: usize>(vector: &[f64; D]) -> f64 {
    vector.iter().map(|c| c * c).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::Load;

    /// Nanson: the cofactor turns the cross product of two edges into that of the deformed edges.
    #[test]
    fn areas_follow_the_deformation() {
        let f = [[1.1, 0.2, -0.3], [0.05, 0.9, 0.4], [0.1, -0.2, 1.3]];
        let turn = |m: &[[f64; 3]; 3], v: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|i| (0..3).map(|j| m[i][j] * v[j]).sum())
        };
        let cross = |u: [f64; 3], v: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|i| u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3])
        };
        let (u, v) = ([1.0, 0.5, 0.2], [-0.3, 0.8, 0.6]);
        let (found, exact) = (turn(&cofactor(&f), cross(u, v)), cross(turn(&f, u), turn(&f, v)));
        (0..3).for_each(|i| assert!((found[i] - exact[i]).abs() < 1e-15, "{found:?} {exact:?}"));

        // In the plane an edge (x, y) has the outward area (y, -x).
        let f = [[1.1, 0.2], [0.3, 0.8]];
        let edge = |x: f64, y: f64| [f[0][0] * x + f[0][1] * y, f[1][0] * x + f[1][1] * y];
        let [x, y] = edge(0.6, 0.7);
        let c = cofactor(&f);
        let found: [f64; 2] = std::array::from_fn(|i| c[i][0] * 0.7 - c[i][1] * 0.6);
        assert!((found[0] - y).abs() < 1e-15 && (found[1] + x).abs() < 1e-15);
    }

    #[test]
    fn pressure_is_against_the_normal_and_traction_along_its_vector() {
        let load = |force: CarriedForce<2>| {
            let carried = Carried { force, first: 0, bodies: None, facing: Some([0.0, 1.0]) };
            Load {
                name: "l".into(),
                kind: super::super::Kind::Carried(carried),
                region: None,
                start: 0.0,
                from: 0.0,
                until: 1.0,
                origin: [10.0, 0.0],
            }
        };
        let time = Quantity::Expression(Box::new(crate::quantity::Expression::parse("x * t").unwrap()));
        let pressure = load(CarriedForce::Pressure { pressure: time.clone(), follows: true });
        let carried = pressure.carried().unwrap();
        assert_eq!(carried.of_surface(&[0.0, 2.0]), [0.0, 2.0]);
        assert!(
            carried.is_facing(&[1.0, 2.0])
                && !carried.is_facing(&[2.0, 1.0])
                && !carried.is_facing(&[0.0, -1.0])
        );
        assert_eq!(
            pressure.force(carried, &[0.0, 2.0], &pressure.place(&[0.5, 0.0], &[0.0; 2]), 2.0),
            [0.0, -42.0]
        );
        let traction = load(CarriedForce::Traction([time, Quantity::Constant(3.0)]));
        let carried = traction.carried().unwrap();
        // With the area vector, for the place of the surface.
        assert_eq!(carried.of_surface(&[3.0, 4.0]), [5.0, 3.0, 4.0]);
        let way = carried.way_to_surface(&[5.0, 0.0, -5.0], &[0.1, 0.2]);
        assert_eq!(way, [0.0, -0.2]);
        let way = carried.way_to_surface(&[2.0, 1.0, 1.0], &[0.1, 0.2]);
        assert!((way[0] - 0.05).abs() < 1e-15 && (way[1] - 0.1).abs() < 1e-15);
        assert_eq!(
            traction.force(carried, &[5.0], &traction.place(&[0.5, 0.0], &[0.0; 2]), 2.0),
            [105.0, 15.0]
        );
    }
}
