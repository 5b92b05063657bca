//! The lines of the table of results. What is expected, with what tolerance and from where, stands in `expected.toml`.
use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use crate::checked;

/// What is expected of one quantity.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Expected {
    /// The problem, by number and name.
    problem: String,
    quantity: String,
    /// How ours and the reference are compared.
    kind: Kind,
    /// The reference, or the bound.
    value: f64,
    /// Of the difference, for the kinds that have one.
    #[serde(default)]
    tolerance: f64,
    /// Where both come from.
    source: String,
    /// Why it fails, where it is known to.
    #[serde(default)]
    fails: String,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum Kind {
    /// `|ours / reference - 1|` is at most the tolerance.
    Relative,
    /// `|ours - reference|` is at most the tolerance.
    Absolute,
    /// Ours is at most the value.
    Most,
    /// Ours is at least the value.
    Least,
}

/// Lines that have been measured.
pub(crate) struct Lines {
    expected: BTreeMap<String, Expected>,
    found: Vec<(String, f64)>,
}

impl Lines {
    /// None yet; `top` is that of the repository.
    pub(crate) fn new(top: &Path) -> Self {
        let text = checked(std::fs::read_to_string(top.join("studies/verification/expected.toml")));
        let expected = checked(toml::from_str(&text));
        Self { expected, found: Vec::new() }
    }

    /// Adds what was measured; says whether it is as expected.
    pub(crate) fn add(&mut self, id: &str, ours: f64) -> bool {
        assert!(self.expected.contains_key(id), "expected.toml has no {id}");
        self.found.push((id.into(), ours));
        let passes = self.passes(id, ours);
        println!("{}{id}: {ours:.6e}", if passes { "" } else { "FAILS " });
        passes
    }

    fn passes(&self, id: &str, ours: f64) -> bool {
        let Expected { kind, value, tolerance, .. } = self.expected[id];
        match kind {
            Kind::Relative => (ours / value - 1.0).abs() <= tolerance,
            Kind::Absolute => (ours - value).abs() <= tolerance,
            Kind::Most => ours <= value,
            Kind::Least => ours >= value,
        }
    }

    /// Names and values, in the order in which they were measured.
    #[allow(dead_code, reason = "the test compares them")]
    pub(crate) fn found(&self) -> &[(String, f64)] {
        &self.found
    }

    /// Those from a number on, which becomes that of all.
    pub(crate) fn since(&self, number: &mut usize) -> Vec<(String, f64)> {
        let lines = self.found[*number..].to_vec();
        *number = self.found.len();
        lines
    }

    /// Adds lines that were measured by the same program.
    pub(crate) fn put(&mut self, lines: Vec<(String, f64)>) {
        self.found.extend(lines);
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.found.len()
    }

    /// Lines that are not as expected: how many, and those of them without an analysis.
    pub(crate) fn failures(&self) -> (usize, Vec<&str>) {
        let failing = self.found.iter().filter(|(id, ours)| !self.passes(id, *ours));
        let unknown = failing.clone().filter(|(id, _)| self.expected[id].fails.is_empty());
        (failing.clone().count(), unknown.map(|(id, _)| id.as_str()).collect())
    }

    /// The table in Markdown, with the analysis of what fails below it.
    pub(crate) fn table(&self) -> String {
        let mut text = String::from(
            "| problem | quantity | reference | ours | error | tolerance | |\n| --- | --- | --- | --- | --- | --- | --- |\n",
        );
        let mut rows: Vec<&(String, f64)> = self.found.iter().collect();
        let order = |id: &str| {
            let problem = &self.expected[id].problem;
            problem.split(' ').next().and_then(|number| number.parse::<u32>().ok()).unwrap_or(u32::MAX)
        };
        rows.sort_by_key(|(id, _)| order(id));
        let mut reasons = String::new();
        for (id, ours) in rows {
            let Expected { problem, quantity, kind, value, tolerance, fails, .. } = &self.expected[id];
            let (reference, error, bound) = match kind {
                Kind::Relative => (
                    short(*value),
                    format!("{:.3} %", 100.0 * (ours / value - 1.0)),
                    format!("{} %", short(100.0 * tolerance)),
                ),
                Kind::Absolute => (short(*value), short(ours - value), short(*tolerance)),
                Kind::Most => (String::new(), String::new(), format!("≤ {}", short(*value))),
                Kind::Least => (String::new(), String::new(), format!("≥ {}", short(*value))),
            };
            let passes = self.passes(id, *ours);
            let verdict = if passes { "passes" } else { "**fails**" };
            text += &format!(
                "| {problem} | {quantity} | {reference} | {} | {error} | {bound} | {verdict} |\n",
                short(*ours)
            );
            if !passes {
                let reason = if fails.is_empty() { "Not yet analysed." } else { fails };
                reasons += &format!("- {problem}, {quantity}: {reason}\n");
            }
        }
        if reasons.is_empty() { text } else { text + "\nWhat fails, and why:\n\n" + &reasons }
    }

    /// Sources of the references, one line for each problem and source.
    pub(crate) fn sources(&self) -> String {
        let mut seen = std::collections::BTreeSet::new();
        let mut text = String::new();
        for (id, _) in &self.found {
            let Expected { problem, source, .. } = &self.expected[id];
            if seen.insert((problem, source)) {
                text += &format!("- {problem}: {source}\n");
            }
        }
        text
    }
}

/// A number with four digits.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 {
        "0".into()
    } else if (1e-3..1e5).contains(&value.abs()) {
        let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.2e}")
    }
}
