//! Particles from a file to the particles of a body.
use std::path::Path as File;
use std::sync::Arc;

use super::super::checks::{Checks, Space};
use crate::checksum::fnv1a;
use crate::io::particles::{Table, table};
use crate::io::snapshot;
use crate::job::parse::error::QUOTED;
use crate::job::parse::source::Path;
use crate::job::problem::MaterialSetup;
use crate::material::initial::{Stressed, under_strain, under_stress_after};
use crate::material::{HISTORIES, Material};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::given::Given;
use crate::text::{excerpt, nearest, number};

const POSITION: [&str; 3] = ["x", "y", "z"];
const VELOCITY: [&str; 3] = ["velocity_x", "velocity_y", "velocity_z"];
/// Components of a symmetric tensor in the order of the program.
const STRESS: [&str; 6] = ["stress_xx", "stress_yy", "stress_zz", "stress_xy", "stress_xz", "stress_yz"];
/// Deformation gradient, row by row.
const GRADIENT: [&str; 9] = ["f_xx", "f_xy", "f_xz", "f_yx", "f_yy", "f_yz", "f_zx", "f_zy", "f_zz"];

impl Checks<'_> {
    /// The particles of a file, or a fault.
    pub(in crate::job) fn particles<const D: usize>(
        &mut self,
        file: &str,
        body: &str,
        material: &MaterialSetup,
        space: &Space<D>,
        path: &Path,
    ) -> Option<Arc<Given<D>>> {
        let is_ours = [".hdf", ".h5", ".hdf5"].iter().any(|ending| file.to_lowercase().ends_with(ending));
        let read = |from: &File| {
            if is_ours { from_state(from, body, space) } else { from_table(from, material, space) }
        };
        let expected = "particles in a .csv or .ply, or an output of agimp (.hdf)";
        let (chunk, has_velocity) = self.read(file, expected, path, read)?;
        let outside = |x: &[f64; D]| (0..D).any(|a| !(0.0 <= x[a] && x[a] < space.size[a]));
        if let Some(p) = (0..chunk.len()).find(|&p| outside(&chunk.position(p))) {
            let message = format!(
                "found the particle {} of \"{}\" at {}; expected all inside the domain",
                p + 1,
                excerpt(file, QUOTED),
                space.words(&chunk.position(p))
            );
            self.fault(path, message);
            return None;
        }
        let words = (0..chunk.len()).flat_map(|p| (0..Layout::<D>::REALS).map(move |column| (p, column)));
        self.note_file(fnv1a(words.map(|(p, column)| chunk.read::<1>(column, p)[0].to_bits())));
        Some(Arc::new(Given::new(chunk, has_velocity)))
    }
}

/// Particles of an output or checkpoint.
fn from_state<const D: usize>(from: &File, body: &str, space: &Space<D>) -> Result<(Chunk<D>, bool), String> {
    let chunk = snapshot::particles(from, body, &space.origin).map_err(|error| error.to_string())?;
    if chunk.is_empty() {
        return Err("it has no particle of this body".into());
    }
    for p in 0..chunk.len() {
        let numbers: Vec<f64> = (0..Layout::<D>::REALS).map(|column| chunk.read::<1>(column, p)[0]).collect();
        let [mass, half] = [Layout::<D>::MASS, Layout::<D>::HALF].map(|column| numbers[column]);
        if !(numbers.iter().all(|n| n.is_finite()) && mass > 0.0 && half > 0.0) {
            return Err(format!("its particle {} is invalid: mass {mass} kg, half width {half} m", p + 1));
        }
    }
    Ok((chunk, true))
}

/// Particles of a table.
fn from_table<const D: usize>(
    from: &File,
    setup: &MaterialSetup,
    space: &Space<D>,
) -> Result<(Chunk<D>, bool), String> {
    let table = table(from).map_err(|error| error.to_string())?;
    let material = setup.build();
    let columns = Columns::find::<D>(&table, &*material)?;
    let rows = table.columns.first().map_or(0, |(_, values)| values.len());
    let mut chunk = Chunk::with_capacity(rows);
    for row in 0..rows {
        let p = chunk.push_zeroed(0, Tag { material: 0, body: 0, level: 0 });
        columns.put(row, &table, setup.density, &*material, space, &mut chunk, p).map_err(|reason| {
            match table.lines.get(row) {
                Some(line) => format!("line {line}: {reason}"),
                None => format!("vertex {}: {reason}", row + 1),
            }
        })?;
    }
    Ok((chunk, columns.velocity.is_some()))
}

/// Columns of the numbers of a particle in a table.
struct Columns {
    position: Vec<usize>,
    velocity: Option<Vec<usize>>,
    mass: Option<usize>,
    volume: Option<usize>,
    stress: Option<Vec<usize>>,
    gradient: Option<Vec<usize>>,
    history: Vec<Option<usize>>,
}

impl Columns {
    fn find<const D: usize>(table: &Table, material: &dyn Material) -> Result<Self, String> {
        let histories = material.history_names();
        let components = |names: &[&'static str], is_here: fn(&str) -> bool| -> Vec<&'static str> {
            names.iter().copied().filter(|name| D == 3 || is_here(name)).collect()
        };
        let in_plane = |name: &str| !name.contains('z') || name.ends_with("zz");
        let stress = components(&STRESS, in_plane);
        let gradient = components(&GRADIENT, in_plane);
        let groups = [&POSITION[..D], &VELOCITY[..D], &stress, &gradient];
        let known = groups.iter().flat_map(|group| group.iter().copied());
        let known: Vec<&str> = known.chain(["mass", "volume"]).chain(histories.iter().copied()).collect();
        let names = || table.columns.iter().map(|(name, _)| name.as_str());
        // Names in capitals are the same names.
        let is_known = |name: &str| known.iter().any(|known| known.eq_ignore_ascii_case(name));
        if let Some(other) = names().find(|name| !is_known(name) && !table.may_have_others) {
            let guess = nearest(other, known.iter().copied());
            let guess = guess.map_or(String::new(), |name| format!("; did you mean \"{name}\"?"));
            return Err(format!(
                "it has a column \"{}\"; expected {}{guess}",
                excerpt(other, QUOTED),
                known.join(", ")
            ));
        }
        if let Some(twice) =
            known.iter().find(|known| names().filter(|name| name.eq_ignore_ascii_case(known)).count() > 1)
        {
            return Err(format!("it has the column \"{twice}\" twice"));
        }
        let place = |name: &str| names().position(|other| other.eq_ignore_ascii_case(name));
        // All of a group, or none.
        let group = |names: &[&str]| -> Result<Option<Vec<usize>>, String> {
            let places: Vec<Option<usize>> = names.iter().map(|name| place(name)).collect();
            if places.iter().all(Option::is_none) {
                return Ok(None);
            }
            match names.iter().zip(&places).find(|(_, place)| place.is_none()) {
                Some((name, _)) => {
                    Err(format!("it has no column \"{name}\"; expected all of {}", names.join(", ")))
                }
                None => Ok(Some(places.into_iter().flatten().collect())),
            }
        };
        let found = Self {
            position: group(&POSITION[..D])?
                .ok_or_else(|| format!("it has no columns {}", POSITION[..D].join(", ")))?,
            velocity: group(&VELOCITY[..D])?,
            mass: place("mass"),
            volume: place("volume"),
            stress: group(&stress)?,
            gradient: group(&gradient)?,
            history: histories.iter().map(|name| place(name)).collect(),
        };
        if found.mass.is_none() && found.volume.is_none() {
            return Err("it has neither a column \"volume\" nor \"mass\"".into());
        }
        if found.stress.is_some() && found.gradient.is_some() {
            return Err("it has stress and deformation gradient; expected one of them".into());
        }
        Ok(found)
    }

    /// All of them.
    fn all(&self) -> impl Iterator<Item = usize> {
        let groups = [&self.velocity, &self.stress, &self.gradient].into_iter().flatten().flatten();
        let single = [&self.mass, &self.volume].into_iter().chain(&self.history).flatten();
        self.position.iter().chain(groups).chain(single).copied()
    }

    /// Writes the particle of a row.
    fn put<const D: usize>(
        &self,
        row: usize,
        table: &Table,
        density: f64,
        material: &dyn Material,
        space: &Space<D>,
        chunk: &mut Chunk<D>,
        p: usize,
    ) -> Result<(), String> {
        let value = |column: usize| table.columns[column].1[row];
        let values =
            |columns: &[usize]| -> Vec<f64> { columns.iter().map(|&column| value(column)).collect() };
        if let Some((name, values)) =
            self.all().map(|column| &table.columns[column]).find(|(_, values)| !values[row].is_finite())
        {
            return Err(format!("found {} in the column \"{name}\"; expected a finite number", values[row]));
        }
        let position = values(&self.position);
        chunk.write(
            Layout::<D>::POSITION,
            p,
            &std::array::from_fn::<f64, D, _>(|a| position[a] - space.origin[a]),
        );
        if let Some(velocity) = &self.velocity {
            chunk.write(Layout::<D>::VELOCITY, p, &values(velocity));
        }
        let state = self.state::<D>(&values, material)?;
        let reference = |volume: f64| volume / state.volume_ratio;
        let (mass, volume) = match (self.mass.map(value), self.volume.map(value)) {
            (Some(mass), Some(volume)) => (mass, reference(volume)),
            (Some(mass), None) => (mass, mass / density),
            (None, Some(volume)) => (density * reference(volume), reference(volume)),
            (None, None) => return Err("it has neither volume nor mass".into()),
        };
        for (number, what) in [(mass, "mass"), (volume, "volume")] {
            if !(number > 0.0 && number < 1e30) {
                return Err(format!("found the {what} {number}; expected more than 0"));
            }
        }
        chunk.write(Layout::<D>::MASS, p, &[mass]);
        chunk.write(Layout::<D>::HALF, p, &[0.5 * libm::pow(volume, 1.0 / D as f64)]);
        chunk.write(Layout::<D>::LEFT_CAUCHY_GREEN, p, &state.elastic[..Layout::<D>::SYMMETRIC]);
        chunk.write(Layout::<D>::STRESS, p, &state.stress[..Layout::<D>::SYMMETRIC]);
        chunk.write(Layout::<D>::HISTORY, p, &state.history[..HISTORIES]);
        Ok(())
    }

    /// Strain, stress and history of a row.
    fn state<const D: usize>(
        &self,
        values: &impl Fn(&[usize]) -> Vec<f64>,
        material: &dyn Material,
    ) -> Result<Stressed, String> {
        let mut history = material.initial_history();
        for (h, column) in self.history.iter().enumerate() {
            if let Some(column) = column {
                history[h] = values(&[*column])[0];
            }
        }
        if let Some(stress) = &self.stress {
            let mut all = [0.0; 6];
            all.iter_mut().zip(values(stress)).for_each(|(component, value)| *component = value);
            let stressed = under_stress_after(material, &all, None, history, D == 2);
            return stressed.map_err(|reason| format!("its material cannot have its stress: {reason}"));
        }
        let mut elastic = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
        if let Some(gradient) = &self.gradient {
            let numbers = values(gradient);
            let f: [[f64; 3]; 3] = match numbers[..] {
                [xx, xy, yx, yy, zz] => [[xx, xy, 0.0], [yx, yy, 0.0], [0.0, 0.0, zz]],
                _ => std::array::from_fn(|i| std::array::from_fn(|j| numbers[3 * i + j])),
            };
            let volume = f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1])
                - f[0][1] * (f[1][0] * f[2][2] - f[1][2] * f[2][0])
                + f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0]);
            if !(volume > 0.0 && volume.is_finite()) {
                return Err(format!(
                    "its deformation gradient has the determinant {}; expected more than 0",
                    number(volume, 4)
                ));
            }
            let b = |i: usize, j: usize| (0..3).map(|k| f[i][k] * f[j][k]).sum();
            elastic = [b(0, 0), b(1, 1), b(2, 2), b(0, 1), b(0, 2), b(1, 2)];
        }
        let state = under_strain(material, &elastic, history, D == 2);
        let numbers = state.elastic.iter().chain(&state.stress).chain(&state.history);
        let is_sane = state.volume_ratio > 0.0 && numbers.into_iter().all(|n| n.is_finite());
        if is_sane { Ok(state) } else { Err("its material cannot have its strain".into()) }
    }
}
