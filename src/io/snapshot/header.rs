//! Header of a file: who wrote it, of which job, when, and how much is in it.

use partition::{MAX_LEVEL, Octant};

use super::view::View;
use crate::io::hdf5_file::{FileError, Reader, Writer};
use crate::saved::Scalars;

/// Version of the layout of the state. A file of another one is refused.
pub const FORMAT: u64 = 2;
/// First attribute of every file of ours.
const MAGIC: &str = "agimp state";
/// Steps are counted in real numbers too, which hold whole numbers up to this.
const MOST_STEPS: u64 = 1 << 53;
/// The group with the header and, in files that a run can restart from, the state.
pub(super) const GROUP: &str = "state";

/// The header of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Version of the layout.
    pub format: u64,
    /// Version of the program that wrote the file.
    pub program: String,
    /// 2 (plane strain) or 3.
    pub dimension: usize,
    /// Digest of the job.
    pub job_digest: u64,
    /// Lower corner of the domain, m.
    pub origin: Vec<f64>,
    /// Edge of a root octant, m.
    pub root_edge: f64,
    /// Root octants along each axis.
    pub roots: Vec<u64>,
    /// Steps done.
    pub step: u64,
    /// Simulated time, s.
    pub time: f64,
    /// Last time step, s.
    pub dt: f64,
    /// Leaves of the tree.
    pub leaves: u64,
    /// Particles.
    pub particles: u64,
    /// True when the file holds all that a restart needs.
    pub restart: bool,
    /// Names of the materials, in the order of the material numbers.
    pub materials: Vec<String>,
    /// Names of the bodies, in the order of the body numbers.
    pub bodies: Vec<String>,
    /// Names of the history variables.
    pub histories: Vec<String>,
    /// Names of the extra fields of leaves.
    pub leaf_fields: Vec<String>,
    /// Scalars to be restored.
    pub scalars: Scalars,
    /// CRC-32 of the data sets of the file, under all their names.
    pub checksums: Vec<(String, u32)>,
}

/// One attribute of the header.
enum Value {
    Text(String),
    Count(Vec<u64>),
    Integer(Vec<i64>),
    Real(Vec<f64>),
}

impl Header {
    /// The header of a view with these totals; checksums are not yet known.
    pub(super) fn new<const D: usize>(view: &View<D>, leaves: u64, particles: u64, restart: bool) -> Self {
        Self {
            format: FORMAT,
            program: env!("CARGO_PKG_VERSION").into(),
            dimension: D,
            job_digest: view.job_digest,
            origin: view.origin.to_vec(),
            root_edge: view.root_edge,
            roots: view.brick.roots.iter().map(|&n| u64::from(n)).collect(),
            step: view.step,
            time: view.time,
            dt: view.dt,
            leaves,
            particles,
            restart,
            materials: view.materials.to_vec(),
            bodies: view.bodies.to_vec(),
            histories: view.histories.to_vec(),
            leaf_fields: view.leaf_fields.iter().map(|(name, _)| name.clone()).collect(),
            scalars: view.scalars.clone(),
            checksums: Vec::new(),
        }
    }

    /// The checksum of a data set.
    pub fn checksum(&self, dataset: &str) -> Option<u32> {
        self.checksums.iter().find(|(name, _)| name == dataset).map(|&(_, crc)| crc)
    }

    /// Edge of an octant, m.
    pub fn edge<const D: usize>(&self, octant: &Octant<D>) -> f64 {
        self.root_edge / f64::from(1_u32 << octant.level)
    }

    /// All attributes in a fixed order. Those with a leading `true` distinguish states and
    /// enter the digest.
    fn entries(&self) -> Vec<(bool, &'static str, Value)> {
        let names =
            |list: Vec<&String>| Value::Text(list.into_iter().cloned().collect::<Vec<_>>().join("\n"));
        let s = &self.scalars;
        vec![
            (false, "magic", Value::Text(MAGIC.into())),
            (false, "format", Value::Count(vec![self.format])),
            (false, "program", Value::Text(self.program.clone())),
            (true, "dimension", Value::Count(vec![self.dimension as u64])),
            (true, "job_digest", Value::Count(vec![self.job_digest])),
            (true, "origin", Value::Real(self.origin.clone())),
            (true, "root_edge", Value::Real(vec![self.root_edge])),
            (true, "roots", Value::Count(self.roots.clone())),
            (true, "step", Value::Count(vec![self.step])),
            (true, "time", Value::Real(vec![self.time])),
            (true, "dt", Value::Real(vec![self.dt])),
            (true, "leaves", Value::Count(vec![self.leaves])),
            (true, "particles", Value::Count(vec![self.particles])),
            (false, "restart", Value::Count(vec![u64::from(self.restart)])),
            (true, "materials", names(self.materials.iter().collect())),
            (false, "bodies", names(self.bodies.iter().collect())),
            (true, "histories", names(self.histories.iter().collect())),
            (true, "leaf_fields", names(self.leaf_fields.iter().collect())),
            (false, "real_names", names(s.reals.iter().map(|(name, _)| name).collect())),
            (false, "reals", Value::Real(s.reals.iter().map(|&(_, value)| value).collect())),
            (false, "count_names", names(s.counts.iter().map(|(name, _)| name).collect())),
            (false, "counts", Value::Count(s.counts.iter().map(|&(_, value)| value).collect())),
            (false, "exact_names", names(s.exact.iter().map(|(name, _)| name).collect())),
            (
                false,
                "exact_lengths",
                Value::Count(s.exact.iter().map(|(_, words)| words.len() as u64).collect()),
            ),
            (false, "exact", Value::Integer(s.exact.iter().flat_map(|(_, words)| words.clone()).collect())),
            (false, "data_sets", names(self.checksums.iter().map(|(name, _)| name).collect())),
            (
                false,
                "data_sets_crc32",
                Value::Count(self.checksums.iter().map(|&(_, crc)| u64::from(crc)).collect()),
            ),
        ]
    }

    /// CRC-32 of the names and values of the attributes.
    fn crc(&self, only_state: bool) -> u32 {
        let mut crc = crc32fast::Hasher::new();
        for (of_state, name, value) in self.entries() {
            if only_state && !of_state {
                continue;
            }
            crc.update(name.as_bytes());
            match value {
                Value::Text(text) => crc.update(text.as_bytes()),
                Value::Count(values) => values.iter().for_each(|v| crc.update(&v.to_le_bytes())),
                Value::Integer(values) => values.iter().for_each(|v| crc.update(&v.to_le_bytes())),
                Value::Real(values) => values.iter().for_each(|v| crc.update(&v.to_bits().to_le_bytes())),
            }
        }
        crc.finalize()
    }

    /// CRC-32 of what distinguishes states: not the program, and not the bookkeeping of a run.
    pub fn state_checksum(&self) -> u32 {
        self.crc(true)
    }

    /// Collective. Makes the group of the header, before all else.
    pub(super) fn make_group(file: &Writer) -> Result<(), FileError> {
        file.create_group(GROUP)
    }

    /// Collective. Writes the header, with the mark that the file is whole: after all else.
    pub(super) fn write(&self, file: &Writer) -> Result<(), FileError> {
        for (_, name, value) in self.entries() {
            match value {
                Value::Text(text) => file.set_text(GROUP, name, &text)?,
                Value::Count(values) => file.set_attribute(GROUP, name, &values)?,
                Value::Integer(values) => file.set_attribute(GROUP, name, &values)?,
                Value::Real(values) => file.set_attribute(GROUP, name, &values)?,
            }
        }
        file.set_attribute(GROUP, "header_crc32", &[u64::from(self.crc(false))])?;
        file.set_attribute(GROUP, "complete", &[1_u64])
    }

    /// Collective on a shared file. Reads the header and refuses what this program cannot trust.
    pub fn read(file: &Reader) -> Result<Self, FileError> {
        file.agree(Self::read_here(file))
    }

    fn read_here(file: &Reader) -> Result<Self, FileError> {
        if !file.exists(GROUP) || file.text(GROUP, "magic").ok().as_deref() != Some(MAGIC) {
            return Err(file.refuse("not a file written by agimp (no group 'state' with its mark)"));
        }
        let one = |name| -> Result<u64, FileError> { only(file, name, file.attribute(GROUP, name)?) };
        let real = |name| -> Result<f64, FileError> { only(file, name, file.attribute(GROUP, name)?) };
        let names = |name| -> Result<Vec<String>, FileError> {
            let text = file.text(GROUP, name)?;
            Ok(if text.is_empty() { Vec::new() } else { text.split('\n').map(str::to_owned).collect() })
        };
        let (format, program) = (one("format")?, file.text(GROUP, "program")?);
        if format != FORMAT {
            return Err(file.refuse(format!(
                "written in format {format} by agimp {program}; this is agimp {}, which reads format {FORMAT}: use the program that wrote it, or run the job again",
                env!("CARGO_PKG_VERSION")
            )));
        }
        if !file.has_attribute(GROUP, "complete") {
            return Err(file.refuse("the file is incomplete: its program did not finish writing"));
        }
        let mut words = file.attribute::<i64>(GROUP, "exact")?.into_iter();
        let lengths = file.attribute::<u64>(GROUP, "exact_lengths")?;
        let scalars = Scalars {
            reals: names("real_names")?.into_iter().zip(file.attribute(GROUP, "reals")?).collect(),
            counts: names("count_names")?.into_iter().zip(file.attribute(GROUP, "counts")?).collect(),
            exact: names("exact_names")?
                .into_iter()
                .zip(lengths)
                .map(|(name, length)| (name, words.by_ref().take(length as usize).collect()))
                .collect(),
        };
        let header = Self {
            format,
            program,
            dimension: one("dimension")? as usize,
            job_digest: one("job_digest")?,
            origin: file.attribute(GROUP, "origin")?,
            root_edge: real("root_edge")?,
            roots: file.attribute(GROUP, "roots")?,
            step: one("step")?,
            time: real("time")?,
            dt: real("dt")?,
            leaves: one("leaves")?,
            particles: one("particles")?,
            restart: one("restart")? != 0,
            materials: names("materials")?,
            bodies: names("bodies")?,
            histories: names("histories")?,
            leaf_fields: names("leaf_fields")?,
            scalars,
            checksums: names("data_sets")?
                .into_iter()
                .zip(file.attribute::<u64>(GROUP, "data_sets_crc32")?)
                .map(|(name, crc)| (name, crc as u32))
                .collect(),
        };
        if one("header_crc32")? != u64::from(header.crc(false)) {
            return Err(file.refuse("wrong checksum of the header: the file is damaged"));
        }
        header.check().map_err(|reason| file.refuse(reason))?;
        Ok(header)
    }

    /// Refuses headers that no run can have written, even if the checksum is right.
    fn check(&self) -> Result<(), String> {
        let Self { dimension, origin, root_edge, roots, time, dt, step, .. } = self;
        if !(2..=3).contains(dimension) {
            return Err(format!("the header has {dimension} dimensions; expected 2 or 3"));
        }
        if origin.len() != *dimension || roots.len() != *dimension {
            return Err(format!("the domain in the header does not have {dimension} axes"));
        }
        let most = u64::from(u32::MAX >> MAX_LEVEL);
        if let Some(count) = roots.iter().find(|&&count| count == 0 || count > most) {
            return Err(format!("the header has {count} root octants along an axis; expected 1 to {most}"));
        }
        if !(origin.iter().all(|x| x.is_finite()) && root_edge.is_finite() && *root_edge > 0.0) {
            return Err(format!("the header's domain is at {origin:?} m with roots of {root_edge:?} m"));
        }
        for (name, value) in [("time", time), ("last step", dt)] {
            if !(value.is_finite() && *value >= 0.0) {
                return Err(format!("the header has a {name} of {value:?} s; expected 0 or more"));
            }
        }
        if *step > MOST_STEPS {
            return Err(format!("the header has {step} steps; expected at most {MOST_STEPS}"));
        }
        if let Some((name, _)) = self.scalars.reals.iter().find(|(_, value)| value.is_nan()) {
            return Err(format!("the scalar {name} is not a number"));
        }
        Ok(())
    }
}

fn only<T: Copy>(file: &Reader, name: &str, values: Vec<T>) -> Result<T, FileError> {
    match values[..] {
        [value] => Ok(value),
        _ => Err(file.refuse(format!("attribute {name} has {} values, not one", values.len()))),
    }
}

/// States are continued within one minor version below 1.0 and one major version from there on.
pub fn compatible(program: &str) -> bool {
    let series = |version: &str| -> Option<(u64, u64)> {
        let mut parts = version.split('.').map(|part| part.parse().ok());
        let (major, minor) = (parts.next()??, parts.next()??);
        Some(if major == 0 { (0, minor) } else { (major, 0) })
    };
    series(program).is_some() && series(program) == series(env!("CARGO_PKG_VERSION"))
}

#[cfg(test)]
mod tests {
    use super::compatible;

    #[test]
    fn states_of_the_same_series_are_continued() {
        assert!(compatible(env!("CARGO_PKG_VERSION")));
        assert!(!compatible("9999.0.0"));
        assert!(!compatible(""));
        assert!(!compatible("new"));
    }
}
