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

    /// Those from a number on, which becomes that of all, as rows of the page.
    pub(crate) fn rows_since(&self, number: &mut usize) -> Vec<Row> {
        let rows = self.found[*number..].iter().map(|(id, ours)| self.row(id, *ours)).collect();
        *number = self.found.len();
        rows
    }

    /// How many there are.
    #[allow(dead_code, reason = "the suite says it")]
    pub(crate) fn count(&self) -> usize {
        self.found.len()
    }

    /// Lines that are not as expected: how many, and those of them without an analysis.
    pub(crate) fn failures(&self) -> (usize, Vec<&str>) {
        let failing = self.found.iter().filter(|(id, ours)| !self.passes(id, *ours));
        let unknown = failing.clone().filter(|(id, _)| self.expected[id].fails.is_empty());
        (failing.clone().count(), unknown.map(|(id, _)| id.as_str()).collect())
    }

    fn row(&self, id: &str, ours: f64) -> Row {
        let Expected { problem, quantity, kind, value, tolerance, .. } = &self.expected[id];
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
        let verdict = if self.passes(id, ours) { "passes" } else { FAILS };
        let cells = [problem, quantity, &reference, &short(ours), &error, &bound, verdict].map(str::to_owned);
        Row(cells)
    }

    /// What is expected of the quantity of a row.
    fn expected(&self, row: &Row) -> Option<&Expected> {
        let [problem, quantity, ..] = &row.0;
        self.expected.values().find(|expected| expected.problem == *problem && expected.quantity == *quantity)
    }

    /// Whether anything is expected of the quantity of a row.
    pub(crate) fn is_expected(&self, row: &Row) -> bool {
        self.expected(row).is_some()
    }

    /// Why rows fail, in Markdown.
    pub(crate) fn reasons(&self, rows: &[Row]) -> String {
        let failing = rows.iter().filter(|row| row.fails());
        let reasons = failing.map(|row| {
            let [problem, quantity, ..] = &row.0;
            let reason = self.expected(row).map_or("", |expected| &expected.fails);
            let reason = if reason.is_empty() { "Not yet analysed." } else { reason };
            format!("- {problem}, {quantity}: {reason}\n")
        });
        let reasons: String = reasons.collect();
        if reasons.is_empty() { reasons } else { format!("\nWhat fails, and why:\n\n{reasons}") }
    }

    /// Sources of the references, one line for each problem and source.
    pub(crate) fn sources(&self, rows: &[Row]) -> String {
        let mut seen = std::collections::BTreeSet::new();
        let expected = rows.iter().filter_map(|row| self.expected(row));
        let new = expected.filter(|expected| seen.insert((&expected.problem, &expected.source)));
        new.map(|Expected { problem, source, .. }| format!("- {problem}: {source}\n")).collect()
    }
}

/// The verdict on what is not as expected.
const FAILS: &str = "**fails**";

/// A row of the table of results: problem, quantity, reference, ours, error, tolerance, verdict.
pub(crate) struct Row([String; 7]);

impl Row {
    /// Reads a row of a page; `None` for other lines.
    pub(crate) fn read(line: &str) -> Option<Self> {
        let cells: Vec<String> = line
            .strip_prefix("| ")?
            .strip_suffix(" |")?
            .split(" | ")
            .map(|cell| cell.trim().to_owned())
            .collect();
        Some(Self(cells.try_into().ok()?))
    }

    /// Whether it is of the same quantity as another.
    pub(crate) fn is_of_same(&self, other: &Self) -> bool {
        self.0[..2] == other.0[..2]
    }

    /// Number of the problem, in whose order rows stand.
    pub(crate) fn order(&self) -> u32 {
        let number = self.0[0].split(' ').next();
        number.and_then(|number| number.parse().ok()).unwrap_or(u32::MAX)
    }

    pub(crate) fn fails(&self) -> bool {
        self.0[6] == FAILS
    }
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "| {} |", self.0.join(" | "))
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
