//! Quantities that can colour the particles of a file: its fields, and those derived from them or from its
//! state.

use super::numbers;
use crate::picture::tint::{Tint, is_class};
use agimp::io::hdf5_file::{FileError, Reader};
use agimp::io::snapshot::content::averages::{mean, principal, third_invariant, von_mises};
use agimp::io::snapshot::content::fields::COMPONENTS;
use agimp::io::snapshot::intact::checked::Checked;
use agimp::io::snapshot::{Header, PointField};
use agimp::material::{PLASTIC_STRAIN, PLASTIC_VOLUME};
use agimp::particle::chunk::Tag;
use agimp::particle::volume::det_f;

/// Numbers of each particle, row by row.
struct Table {
    components: usize,
    values: Vec<f64>,
}

impl Table {
    fn row(&self, particle: usize) -> &[f64] {
        &self.values[self.components * particle..self.components * (particle + 1)]
    }
}

/// Definition of a quantity by others. Names with a slash are data sets of the file.
struct Rule {
    name: &'static str,
    unit: &'static str,
    from: &'static [&'static str],
    components: usize,
    append: fn(&[&[f64]], &mut Vec<f64>),
}

macro_rules! rules {
    ($($name:literal [$unit:literal] $components:literal <- $($from:literal),+ : $append:expr;)+) => {
        &[$(Rule { name: $name, unit: $unit, from: &[$($from),+], components: $components, append: $append }),+]
    };
}

/// All rules. Stress is Cauchy's, with components xx, yy, zz, xy, yz, xz; that of the state is Kirchhoff's,
/// with xz and yz the other way round. Principal stresses descend, tension is positive.
const RULES: &[Rule] = rules! {
    "velocity" ["m/s"] 3 <- "state/particles/velocity": |r, out| out.extend(padded(r[0]));
    "speed" ["m/s"] 1 <- "velocity": |r, out| out.push(magnitude(r[0]));
    "id" [""] 1 <- "state/particles/id": |r, out| out.push(r[0][0]);
    "material" [""] 1 <- "state/particles/tag": |r, out| out.push(r[0][0]);
    "body" [""] 1 <- "state/particles/tag": |r, out| out.push(r[0][1]);
    "particle_level" [""] 1 <- "state/particles/tag": |r, out| out.push(r[0][2]);
    "leaf_level" [""] 1 <- "state/tree/level": |r, out| out.push(r[0][0]);
    "mass" ["kg"] 1 <- "state/particles/mass": |r, out| out.push(r[0][0]);
    "plastic_strain" [""] 1 <- "state/particles/history": |r, out| out.push(r[0][PLASTIC_STRAIN]);
    "plastic_work" ["J/m³"] 1 <- "state/particles/plastic_work": |r, out| out.push(r[0][0]);
    "volume_ratio" [""] 1 <- "state/particles/left_cauchy_green", "state/particles/history":
        |r, out| out.push(det_f(full(r[0]), r[1][PLASTIC_VOLUME]));
    "density" ["kg/m³"] 1 <- "mass", "volume_ratio", "state/particles/half_width", "state/particles/position":
        |r, out| out.push(r[0][0] / (r[1][0] * (2.0 * r[2][0]).powi(r[3].len() as i32)));
    "stress" ["Pa"] 6 <- "state/particles/stress", "volume_ratio":
        |r, out| out.extend(full(r[0]).map(|component| component / r[1][0]));
    "pressure" ["Pa"] 1 <- "stress": |r, out| out.push(-mean(&six(r[0])));
    "von_mises" ["Pa"] 1 <- "stress": |r, out| out.push(von_mises(&six(r[0])));
    "stress_1" ["Pa"] 1 <- "stress": |r, out| out.push(principal(&six(r[0]))[0]);
    "stress_2" ["Pa"] 1 <- "stress": |r, out| out.push(principal(&six(r[0]))[1]);
    "stress_3" ["Pa"] 1 <- "stress": |r, out| out.push(principal(&six(r[0]))[2]);
    "max_shear" ["Pa"] 1 <- "stress": |r, out| out.push(0.5 * (principal(&six(r[0]))[0] - principal(&six(r[0]))[2]));
    "stress_i1" ["Pa"] 1 <- "stress": |r, out| out.push(3.0 * mean(&six(r[0])));
    "stress_j2" ["Pa²"] 1 <- "stress": |r, out| out.push(von_mises(&six(r[0])).powi(2) / 3.0);
    "stress_j3" ["Pa³"] 1 <- "stress": |r, out| out.push(third_invariant(&six(r[0])));
    "x" ["m"] 1 <- "VTKHDF/Points": |r, out| out.push(r[0][0]);
    "y" ["m"] 1 <- "VTKHDF/Points": |r, out| out.push(r[0][1]);
    "z" ["m"] 1 <- "VTKHDF/Points": |r, out| out.push(r[0][2]);
};

/// A file whose particles are to be drawn.
pub(in crate::picture) struct Source<'f> {
    file: &'f Reader,
    header: &'f Header,
}

impl<'f> Source<'f> {
    pub(in crate::picture) fn new(file: &'f Reader, header: &'f Header) -> Self {
        Self { file, header }
    }

    /// The quantity of that name, one number for each particle: of vectors and tensors the magnitude.
    ///
    /// # Errors
    /// The file offers no such quantity, or cannot be read.
    pub(in crate::picture) fn quantity(&self, name: &str) -> Result<(Tint, Vec<f64>), FileError> {
        let tint = Tint {
            name: name.to_owned(),
            unit: self.unit(name).to_owned(),
            classes: is_class(name),
            names: Vec::new(),
        };
        if !name.contains('/') && self.components(name).is_some() {
            let table = self.table(name)?;
            let values = match table.components {
                1 => table.values,
                _ => (0..self.len()).map(|p| magnitude(table.row(p))).collect(),
            };
            return Ok((tint, values));
        }
        if let Some((whole, component)) = self.component(name) {
            let table = self.table(whole)?;
            return Ok((tint, (0..self.len()).map(|p| table.row(p)[component]).collect()));
        }
        let offered = self.offered();
        let reason = if offered.is_empty() {
            super::NO_PARTICLES.into()
        } else {
            let meant = agimp::text::nearest(name, offered.iter().map(String::as_str));
            let guess = meant.map_or(String::new(), |meant| format!("; did you mean {meant}?"));
            let name = agimp::text::excerpt(name, 60);
            format!("found no quantity {name}{guess} Expected one of: {}", offered.join(", "))
        };
        Err(self.file.refuse(reason))
    }

    /// Whether there is a quantity of that name.
    pub(in crate::picture) fn offers(&self, name: &str) -> bool {
        self.components(name).is_some() || self.component(name).is_some()
    }

    fn len(&self) -> usize {
        self.header.particles as usize
    }

    /// All names that [`Source::quantity`] knows for this file.
    fn offered(&self) -> Vec<String> {
        let known =
            PointField::ALL.map(PointField::name).into_iter().chain(RULES.iter().map(|rule| rule.name));
        let mut names: Vec<String> = Vec::new();
        for name in known {
            let Some(components) = self.components(name) else { continue };
            let endings = COMPONENTS.iter().filter(|endings| endings.len() == components);
            let endings = endings.flat_map(|endings| endings.iter()).map(|ending| format!("{name}_{ending}"));
            for name in std::iter::once(name.to_owned()).chain(endings) {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
        }
        names
    }

    /// Splits `stress_xy` into the tensor and the number of the component.
    fn component<'n>(&self, name: &'n str) -> Option<(&'n str, usize)> {
        let (whole, ending) = name.rsplit_once('_')?;
        let components = self.components(whole)?;
        let endings = COMPONENTS.iter().find(|endings| endings.len() == components)?;
        Some((whole, endings.iter().position(|known| *known == ending)?))
    }

    fn unit(&self, name: &str) -> &'static str {
        let field = PointField::from_name(name).map(PointField::unit);
        let rule = || RULES.iter().find(|rule| rule.name == name).map(|rule| rule.unit);
        let whole = || self.component(name).map(|(whole, _)| self.unit(whole));
        field.or_else(rule).or_else(whole).unwrap_or("")
    }

    /// Numbers of each particle that the quantity has; `None` if the file does not offer it.
    fn components(&self, name: &str) -> Option<usize> {
        if let Some(path) = self.data_set(name) {
            return match path.as_str() {
                TAG => Some(3),
                LEVEL => Some(1),
                _ => self.file.stored(&path).ok().map(|stored| stored.components.max(1)),
            };
        }
        self.rule(name).map(|rule| rule.components)
    }

    /// The data set of the quantity itself.
    fn data_set(&self, name: &str) -> Option<String> {
        let path = if name.contains('/') { name.to_owned() } else { format!("VTKHDF/PointData/{name}") };
        self.file.exists(&path).then_some(path)
    }

    fn rule(&self, name: &str) -> Option<&'static Rule> {
        let usable = |rule: &&Rule| rule.from.iter().all(|input| self.components(input).is_some());
        RULES.iter().filter(|rule| rule.name == name).find(usable)
    }

    fn table(&self, name: &str) -> Result<Table, FileError> {
        if let Some(path) = self.data_set(name) {
            return self.read(&path);
        }
        let Some(rule) = self.rule(name) else {
            return Err(self.file.refuse(format!("the file does not hold {name}")));
        };
        let inputs = rule.from.iter().map(|input| self.table(input)).collect::<Result<Vec<_>, _>>()?;
        let mut values = Vec::with_capacity(self.len() * rule.components);
        let mut rows: Vec<&[f64]> = Vec::with_capacity(inputs.len());
        for particle in 0..self.len() {
            rows.clear();
            rows.extend(inputs.iter().map(|table| table.row(particle)));
            (rule.append)(&rows, &mut values);
        }
        Ok(Table { components: rule.components, values })
    }

    fn read(&self, path: &str) -> Result<Table, FileError> {
        let n = self.header.particles;
        let mut checked = Checked::new(None, self.file, self.header);
        match path {
            TAG => {
                let tags: Vec<u64> = checked.read_all(path, n, 0)?;
                let parts = tags.into_iter().map(Tag::unpack);
                let values = parts.flat_map(|tag| [tag.material, tag.body, tag.level.into()].map(f64::from));
                Ok(Table { components: 3, values: values.collect() })
            }
            LEVEL => {
                let levels: Vec<u8> = checked.read_all(path, self.header.leaves, 0)?;
                let counts: Vec<u64> = checked.read_all("state/tree/particles", self.header.leaves, 0)?;
                let mut values = Vec::with_capacity(self.len());
                for (level, count) in levels.into_iter().zip(counts) {
                    let left = self.len() - values.len();
                    values.resize(values.len() + left.min(count as usize), f64::from(level));
                }
                values.resize(self.len(), 0.0);
                Ok(Table { components: 1, values })
            }
            _ => {
                let (values, components) = numbers(self.file, self.header, path)?;
                Ok(Table { components, values })
            }
        }
    }
}

const TAG: &str = "state/particles/tag";
const LEVEL: &str = "state/tree/level";

/// Length of a vector; of six components √(σ:σ) of the symmetric tensor.
pub(in crate::picture) fn magnitude(row: &[f64]) -> f64 {
    let squares = |part: &[f64]| part.iter().map(|v| v * v).sum::<f64>();
    match row.len() {
        6 => (squares(&row[..3]) + 2.0 * squares(&row[3..])).sqrt(),
        _ => squares(row).sqrt(),
    }
}

/// Three components of a vector in the plane or in space.
fn padded(row: &[f64]) -> [f64; 3] {
    std::array::from_fn(|axis| row.get(axis).copied().unwrap_or(0.0))
}

/// Components xx, yy, zz, xy, yz, xz of a symmetric tensor of the state: xx, yy, zz, xy and in 3D xz, yz.
fn full(row: &[f64]) -> [f64; 6] {
    let at = |component: usize| row.get(component).copied().unwrap_or(0.0);
    [at(0), at(1), at(2), at(3), at(5), at(4)]
}

fn six(row: &[f64]) -> [f64; 6] {
    std::array::from_fn(|component| row.get(component).copied().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniaxial tension s: principal stresses (s, 0, 0), σ_vm = s, J2 = s²/3, J3 = 2 s³/27.
    #[test]
    fn measures_of_uniaxial_tension_and_pure_shear() {
        let tension = [0.0, 6.0, 0.0, 0.0, 0.0, 0.0];
        approx::assert_relative_eq!(principal(&tension)[0], 6.0);
        approx::assert_abs_diff_eq!(principal(&tension)[2], 0.0, epsilon = 1e-12);
        approx::assert_relative_eq!(third_invariant(&tension), 2.0 * 216.0 / 27.0);
        let shear = [0.0, 0.0, 0.0, 0.0, 0.0, 3.0];
        let [first, second, third] = principal(&shear);
        approx::assert_relative_eq!(first, 3.0, epsilon = 1e-12);
        approx::assert_abs_diff_eq!(second, 0.0, epsilon = 1e-12);
        approx::assert_relative_eq!(third, -3.0, epsilon = 1e-12);
        approx::assert_relative_eq!(magnitude(&shear), 18.0_f64.sqrt());
    }

    #[test]
    fn rules_know_what_they_start_from() {
        for rule in RULES {
            for input in rule.from.iter().filter(|input| !input.contains('/')) {
                assert!(RULES.iter().any(|other| other.name == *input), "{input} of {}", rule.name);
            }
        }
    }
}
