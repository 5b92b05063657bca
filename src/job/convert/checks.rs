//! State that all conversions share: faults with their places, and the domain.
use crate::geometry::written::Vector;
use crate::job::parse::error::{Fault, MOST, Position, QUOTED, names};
use crate::job::parse::source::{Node, Path};
use crate::text::{excerpt, nearest, number};

/// Collects faults; knows where the keys of the file stand.
pub(in crate::job) struct Checks<'t> {
    /// The file with the places of its values.
    pub tree: &'t Node,
    /// Text of the job.
    pub text: &'t str,
    /// Place of a byte of the text in the files of the job.
    pub position: &'t dyn Fn(usize) -> Position,
    /// Directory of the job file, to which names of files in it are relative.
    pub directory: &'t std::path::Path,
    /// Ends of the domain along each axis, m; 0 along axes that the job does not have.
    pub domain: [[f64; 2]; 3],
    /// Checksum of the files that the job names, as far as they have been read; 0 without.
    pub files: u64,
    /// Whether shapes may be sheets: boxes that are flat along one axis, and meshes that are not closed.
    pub takes_sheets: bool,
    /// Faults so far.
    pub faults: Vec<Fault>,
}

impl Checks<'_> {
    /// Whether there are so many faults that a search for more is of no use.
    pub(crate) fn is_full(&self) -> bool {
        self.faults.len() > MOST
    }

    /// Adds a fault of the value at `path`.
    pub(crate) fn fault(&mut self, path: &Path, message: String) {
        if self.is_full() {
            return;
        }
        let span = self.tree.locate(path);
        self.faults.push(Fault {
            key: path.to_string(),
            message,
            span,
            help: None,
            setting: None,
            included: None,
        });
    }

    /// Refuses what jobs of a kind, such as "an axisymmetric job", cannot have: whether it is there, its key,
    /// what it is, and what is possible in its place.
    pub(super) fn refuse_in(&mut self, kind: &str) -> impl FnMut(bool, Path, &'static str, &'static str) {
        move |is_there, path, found, expected| {
            if is_there {
                self.fault(&path, format!("found {found} in {kind}; expected {expected}"));
            }
        }
    }

    /// Place of the value at `path`.
    pub(crate) fn place(&self, path: &Path) -> Position {
        (self.position)(self.tree.locate(path).start)
    }

    /// Adds a fault unless `name` can be part of the names of columns and differs from the names `before` it.
    pub(crate) fn column_name<'a>(
        &mut self,
        name: &str,
        mut before: impl Iterator<Item = &'a str>,
        path: &Path,
    ) {
        let allowed = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
        if name.is_empty() || !name.chars().all(allowed) {
            let name = excerpt(name, QUOTED);
            self.fault(path, format!("found \"{name}\"; expected letters, digits, \"_\" and \"-\" only"));
        } else if before.any(|other| other == name) {
            let name = excerpt(name, QUOTED);
            self.fault(path, format!("found \"{name}\" a second time; expected a name that is not taken"));
        }
    }

    /// Index of a name among those of things of one kind, or a fault that lists them.
    pub(crate) fn named<'a, I: Iterator<Item = &'a str>>(
        &mut self,
        name: &str,
        what: &str,
        known: impl Fn() -> I,
        path: &Path,
    ) -> Option<usize> {
        let index = known().position(|other| other == name);
        if index.is_none() {
            self.unknown(name, what, known, path);
        }
        index
    }

    /// Adds a fault for a name that is not among those of things of one kind.
    pub(crate) fn unknown<'a, I: Iterator<Item = &'a str>>(
        &mut self,
        name: &str,
        what: &str,
        known: impl Fn() -> I,
        path: &Path,
    ) {
        let list = if known().next().is_some() { names(known()) } else { "there is none".into() };
        let guess = nearest(name, known());
        let guess = guess.map_or(String::new(), |w| format!("; did you mean \"{}\"?", excerpt(w, QUOTED)));
        let name = excerpt(name, QUOTED);
        self.fault(path, format!("found \"{name}\"; expected the name of a {what}: {list}{guess}"));
    }

    /// Numbers of the bodies that are named, or a fault; `Some(None)` where no list is given.
    pub(crate) fn bodies(
        &mut self,
        names: Option<&[String]>,
        bodies: &[&str],
        path: &Path,
    ) -> Option<Option<Vec<u16>>> {
        let Some(names) = names else { return Some(None) };
        if names.is_empty() {
            self.fault(
                path,
                "found an empty array; expected at least one body, or no key for all bodies".into(),
            );
            return None;
        }
        let mut numbers = Vec::new();
        for (i, name) in names.iter().enumerate() {
            let number = self.named(name, "body", || bodies.iter().copied(), &path.index(i));
            numbers.extend(number.map(|number| number as u16));
        }
        (numbers.len() == names.len()).then_some(Some(numbers))
    }

    /// Contents of a file that the job names, or a fault.
    pub(crate) fn read<T, E: std::fmt::Display>(
        &mut self,
        file: &str,
        expected: &str,
        path: &Path,
        read: impl Fn(&std::path::Path) -> Result<T, E>,
    ) -> Option<T> {
        let from = self.directory.join(file);
        read(&from)
            .map_err(|error| {
                let message = format!(
                    "found \"{}\", but {error} ({}); expected {expected}, its name relative to the job file",
                    excerpt(file, QUOTED),
                    from.display()
                );
                self.fault(path, message);
            })
            .ok()
    }

    /// Adds the checksum of a file that the job names: with other contents it is another job.
    pub(crate) fn note_file(&mut self, checksum: u64) {
        self.files = self.files.rotate_left(1) ^ checksum;
    }

    /// The components of a vector of the job's dimension.
    pub(crate) fn vector<const D: usize>(&mut self, vector: &Vector, path: &Path) -> Option<[f64; D]> {
        let array = <[f64; D]>::try_from(vector.0.as_slice()).ok();
        if array.is_none() {
            self.fault(path, format!("found {} components; expected {D} in a {D}D job", vector.0.len()));
        }
        array
    }
}

/// The domain in the file's coordinates, for conversions and messages.
pub(in crate::job) struct Space<const D: usize> {
    pub origin: [f64; D],
    pub size: [f64; D],
}

impl<const D: usize> Space<D> {
    /// A point in the file's coordinates, in words.
    pub(crate) fn words(&self, x: &[f64; D]) -> String {
        let components: Vec<String> = (0..D).map(|a| number(x[a] + self.origin[a], 7)).collect();
        format!("[{}]", components.join(", "))
    }
}

/// Faults for names that are empty or taken.
pub(super) fn check_names<'a>(checks: &mut Checks, names: impl Iterator<Item = &'a str>, path: &Path) {
    let mut seen = rustc_hash::FxHashSet::default();
    let mut count = 0;
    for (i, name) in names.enumerate() {
        count += 1;
        let here = path.index(i).key("name");
        if name.trim().is_empty() {
            checks.fault(&here, "found an empty name; expected at least one letter".into());
        } else if !seen.insert(name) {
            let name = excerpt(name, QUOTED);
            checks.fault(&here, format!("found \"{name}\" a second time; expected a name that is not taken"));
        }
    }
    if count == 0 {
        checks.fault(path, "found an empty array; expected at least one element".into());
    } else if count > usize::from(u16::MAX) {
        checks.fault(path, format!("found {count} elements; expected at most {}", u16::MAX));
    }
}
