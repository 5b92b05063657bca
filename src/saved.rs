//! State beside particles and tree, on its way to a file or back.
//!
//! The type that owns a value hands it over with its name, in one function that serves both ways: nothing can
//! be written and not read.
use partition::comm::Comm;

use crate::exact_sum::ExactSum;

/// Scalars that are saved and come back bit by bit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scalars {
    /// Real numbers by name.
    pub reals: Vec<(String, f64)>,
    /// Counters by name.
    pub counts: Vec<(String, u64)>,
    /// Words of exact sums (see [`crate::exact_sum`]) by name.
    pub exact: Vec<(String, Vec<i64>)>,
}

impl Scalars {
    /// The real number of that name.
    pub fn real(&self, name: &str) -> Option<f64> {
        find(&self.reals, name).copied()
    }

    /// The counter of that name.
    pub fn count(&self, name: &str) -> Option<u64> {
        find(&self.counts, name).copied()
    }

    /// The words of the exact sum of that name.
    fn exact(&self, name: &str) -> Option<&[i64]> {
        find(&self.exact, name).map(Vec::as_slice)
    }
}

fn find<'a, T>(list: &'a [(String, T)], name: &str) -> Option<&'a T> {
    list.iter().find(|(n, _)| n == name).map(|(_, value)| value)
}

/// Values with their names, which go to a file or come from one.
pub struct Saved<'a> {
    way: Way<'a>,
    missing: Option<String>,
}

enum Way<'a> {
    To { scalars: Scalars, comm: &'a Comm },
    From { scalars: &'a Scalars, is_root: bool },
}

impl<'a> Saved<'a> {
    /// Values are read and stay as they are. Its calls for sums and counters of ranks are collective.
    pub fn to_file(comm: &'a Comm) -> Self {
        Self { way: Way::To { scalars: Scalars::default(), comm }, missing: None }
    }

    /// Values are set to those of a file. Totals over ranks come back on the root.
    pub fn from_file(scalars: &'a Scalars, is_root: bool) -> Self {
        Self { way: Way::From { scalars, is_root }, missing: None }
    }

    /// The values for the file; none if they come from one.
    pub fn into_scalars(self) -> Scalars {
        if let Way::To { scalars, .. } = self.way { scalars } else { Scalars::default() }
    }

    /// Whether values come from a file.
    pub fn is_reading(&self) -> bool {
        matches!(self.way, Way::From { .. })
    }

    /// Name of the first value that the file lacks.
    pub fn missing(&self) -> Option<&str> {
        self.missing.as_deref()
    }

    /// Has a value count as missing.
    pub fn lacks(&mut self, name: impl Into<String>) {
        self.missing.get_or_insert(name.into());
    }

    /// A number, the same on all ranks.
    pub fn real(&mut self, name: impl Into<String>, value: &mut f64) {
        let name = name.into();
        match &mut self.way {
            Way::To { scalars, .. } => scalars.reals.push((name, *value)),
            Way::From { scalars, .. } => match scalars.real(&name) {
                Some(read) => *value = read,
                None => self.lacks(name),
            },
        }
    }

    /// A counter, the same on all ranks.
    pub fn count(&mut self, name: impl Into<String>, value: &mut u64) {
        let name = name.into();
        match &mut self.way {
            Way::To { scalars, .. } => scalars.counts.push((name, *value)),
            Way::From { scalars, .. } => match scalars.count(&name) {
                Some(read) => *value = read,
                None => self.lacks(name),
            },
        }
    }

    /// A list of counters, the same on all ranks. From a file: as many as it has, `most` at most.
    pub fn counts(&mut self, name: impl Fn(usize) -> String, most: usize, values: &mut Vec<u64>) {
        match &mut self.way {
            Way::To { scalars, .. } => {
                scalars.counts.extend(values.iter().enumerate().map(|(i, value)| (name(i), *value)));
            }
            Way::From { scalars, .. } => {
                *values = (0..most).map_while(|i| scalars.count(&name(i))).collect();
            }
        }
    }

    /// Collective to a file. Counters of this rank, of which the file has the sums over all.
    pub fn counts_of_ranks<const N: usize>(&mut self, names: [&str; N], values: [&mut u64; N]) {
        match &mut self.way {
            Way::To { scalars, comm } => {
                let mut totals = values.map(|value| *value);
                comm.sum_u64(&mut totals);
                scalars.counts.extend(names.map(String::from).into_iter().zip(totals));
            }
            Way::From { scalars, is_root } => {
                let is_root = *is_root;
                let read = names.map(|name| scalars.count(name));
                for ((name, value), read) in names.into_iter().zip(values).zip(read) {
                    match read {
                        Some(read) => *value = if is_root { read } else { 0 },
                        None => self.lacks(name),
                    }
                }
            }
        }
    }

    /// Collective to a file. Exact sums of this rank, of which the file has the totals over all.
    pub fn sums<'s>(
        &mut self,
        name: impl Fn(usize) -> String,
        sums: impl ExactSizeIterator<Item = &'s mut ExactSum>,
    ) {
        match &mut self.way {
            Way::To { scalars, comm } => {
                let mut totals: Vec<ExactSum> = sums.map(|sum| sum.clone()).collect();
                ExactSum::sum_over_ranks(comm, &mut totals);
                let totals = totals.iter_mut().enumerate();
                scalars.exact.extend(totals.map(|(i, sum)| (name(i), sum.words().to_vec())));
            }
            Way::From { scalars, is_root } => {
                let (scalars, is_root) = (*scalars, *is_root);
                for (i, sum) in sums.enumerate() {
                    let name = name(i);
                    match scalars.exact(&name).and_then(ExactSum::from_words) {
                        Some(read) => *sum = if is_root { read } else { ExactSum::new() },
                        None => self.lacks(name),
                    }
                }
            }
        }
    }

    /// Values that the file of a run without them may lack.
    pub fn if_there(&mut self, values: impl FnOnce(&mut Self)) {
        let missing = self.missing.take();
        values(self);
        self.missing = missing;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Default, PartialEq)]
    struct State {
        real: f64,
        count: u64,
        of_rank: u64,
        many: Vec<u64>,
    }

    fn declare(state: &mut State, saved: &mut Saved<'_>) {
        saved.real("real", &mut state.real);
        saved.count("count", &mut state.count);
        saved.counts_of_ranks(["of_rank"], [&mut state.of_rank]);
        saved.counts(|i| format!("many_{i}"), 5, &mut state.many);
    }

    #[test]
    fn values_come_back_and_missing_ones_are_named() {
        let mut scalars = Scalars {
            reals: vec![("real".into(), 0.1)],
            counts: [("count", 7), ("of_rank", 3), ("many_0", 4), ("many_1", 5)]
                .map(|(name, count)| (name.into(), count))
                .to_vec(),
            exact: Vec::new(),
        };
        for (is_root, of_rank) in [(true, 3), (false, 0)] {
            let mut state = State::default();
            let mut saved = Saved::from_file(&scalars, is_root);
            declare(&mut state, &mut saved);
            assert_eq!(saved.missing(), None);
            assert_eq!(state, State { real: 0.1, count: 7, of_rank, many: vec![4, 5] });
        }
        scalars.counts.retain(|(name, _)| name != "count");
        let mut saved = Saved::from_file(&scalars, true);
        saved.if_there(|saved| declare(&mut State::default(), saved));
        assert_eq!(saved.missing(), None);
        declare(&mut State::default(), &mut saved);
        assert_eq!(saved.missing(), Some("count"));
    }
}
