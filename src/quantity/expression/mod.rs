//! Expressions of place and time, such as `0.1 * sin(2 * pi * x) * exp(-t / 0.5)`; X, Y, Z are the place in
//! the undeformed body.
//!
//! | file | what it holds |
//! |---|---|
//! | `words` | names and operators, with `libm` behind them |
//! | `tokens` | text to tokens |
//! | `program` | tokens to a program in postfix order, and its value |
//! | this | expressions, and messages where they have no value |
//!
//! Two ambiguous forms are defined or refused: `-x^2` is `-(x^2)` as on paper, and chains such as `a^b^c` or
//! `a * -b` ask for parentheses.
use std::sync::{Mutex, OnceLock, PoisonError};

use super::Place;
use crate::text::{excerpt, number};

mod program;
mod tokens;
mod words;

use program::Program;
use words::VARIABLES;

/// Most bytes of an expression.
const LONGEST: usize = 10_000;

/// Longest piece of an expression in a message.
const QUOTED: usize = 80;

/// A scalar expression in x, y, z, X, Y, Z (m) and t (s).
#[derive(Debug)]
pub struct Expression {
    text: String,
    program: Program,
    /// Bit for each of [`VARIABLES`] that it has.
    used: u8,
    /// Key of the job that it is the value of.
    key: String,
    /// Where it had no finite value; set in the case of an error only.
    lost: OnceLock<Mutex<Lost>>,
}

impl Clone for Expression {
    /// A copy without the failed values of the original: where one is evaluated at places that the other does
    /// not need, only one fails.
    fn clone(&self) -> Self {
        let (text, key) = (self.text.clone(), self.key.clone());
        Self { text, program: self.program.clone(), used: self.used, key, lost: OnceLock::new() }
    }
}

/// Variables of an evaluation without a finite value, and the value: of several the least, so that it is the
/// same on any threads.
type Lost = ([f64; VARIABLES.len()], f64);

/// Why a text is no expression.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason} (column {column} of \"{}\")", excerpt(text, QUOTED))]
pub struct ExpressionError {
    /// The text.
    pub text: String,
    /// Column of the fault, from 1.
    pub column: usize,
    /// Found and expected text, in words.
    pub reason: String,
}

/// An expression of a job that has had no finite value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "{key}: found the value {value} of \"{}\" at {at}; expected a finite number wherever and whenever it is needed",
    excerpt(text, QUOTED)
)]
pub struct NotFinite {
    /// Key of the job.
    pub key: String,
    /// The expression.
    pub text: String,
    /// Values of its variables, in words.
    pub at: String,
    /// The value.
    pub value: f64,
}

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// With the column of the fault.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        let fault = |(at, reason): (usize, String)| ExpressionError {
            text: text.to_owned(),
            column: text[..at].chars().count() + 1,
            reason,
        };
        if text.len() > LONGEST {
            let found = text.len();
            let reason =
                format!("found {found} characters; expected at most {LONGEST}: use a table over time");
            return Err(fault((0, reason)));
        }
        let program = Program::new(&tokens::tokens(text).map_err(fault)?).map_err(fault)?;
        let used = program.variables();
        if used == 0 {
            let value = program.value(&[0.0; VARIABLES.len()]);
            if !value.is_finite() {
                return Err(fault((0, format!("found the value {value}; expected a finite number"))));
            }
        }
        Ok(Self { text: text.to_owned(), program, used, key: String::new(), lost: OnceLock::new() })
    }

    /// The expression as the value of a key of a job, for messages.
    pub fn of_key(self, key: String) -> Self {
        Self { key, ..self }
    }

    /// Value at a place (m) and a time (s). Not a finite number where the expression has none, as `ln(-1)`:
    /// see [`Expression::not_finite`].
    pub fn at(&self, place: &Place, t: f64) -> f64 {
        let ([x, y, z], [at_x, at_y, at_z]) = (place.now, place.undeformed);
        let variables = [x, y, z, t, at_x, at_y, at_z];
        let value = self.program.value(&variables);
        if !value.is_finite() {
            self.lose(variables, value);
        }
        value
    }

    #[cold]
    fn lose(&self, variables: [f64; VARIABLES.len()], value: f64) {
        let mut least = self
            .lost
            .get_or_init(|| Mutex::new((variables, value)))
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let bits = |of: &[f64; VARIABLES.len()]| of.map(|c| c.to_bits() as i64);
        if bits(&variables) < bits(&least.0) {
            *least = (variables, value);
        }
    }

    /// Where it has had no finite value so far, if it has been evaluated there.
    pub fn not_finite(&self) -> Option<NotFinite> {
        let (variables, value) = *self.lost.get()?.lock().unwrap_or_else(PoisonError::into_inner);
        let used = (0..VARIABLES.len()).filter(|&variable| self.used >> variable & 1 == 1);
        let words = used.map(|variable| {
            let unit = if variable == 3 { "s" } else { "m" };
            format!("{} = {} {unit}", VARIABLES[variable], number(variables[variable], 6))
        });
        let at = words.collect::<Vec<_>>().join(", ");
        Some(NotFinite { key: self.key.clone(), text: self.text.clone(), at, value })
    }

    /// Whether it names a coordinate of the present place; 0: x.
    pub fn names(&self, axis: usize) -> bool {
        self.used >> axis & 1 == 1
    }

    /// Whether it names X, Y or Z.
    pub fn names_undeformed(&self) -> bool {
        self.used >> 4 != 0
    }

    /// Whether it names z or Z.
    pub fn names_z(&self) -> bool {
        self.used & (1 << 2 | 1 << 6) != 0
    }

    /// Whether it names t.
    pub fn depends_on_time(&self) -> bool {
        self.used & 1 << 3 != 0
    }

    /// The text as given.
    pub fn text(&self) -> &str {
        &self.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::thread_seconds;

    fn value(text: &str) -> f64 {
        Expression::parse(text)
            .unwrap_or_else(|error| panic!("{error}"))
            .at(&Place::from([2.0, 3.0, 5.0]), 0.25)
    }

    #[test]
    fn values_are_those_on_paper() {
        let cases = [
            ("1.5e-3 * 2E2", 0.3),
            ("2 + 3 * x ^ 2", 14.0),
            ("-x^2", -4.0),
            ("(-x)^2", 4.0),
            ("3 - -x", 5.0),
            ("-x^2 - -y", -1.0),
            ("2^(-x)", 0.25),
            ("x - y - z", -6.0),
            ("60 / x / y", 10.0),
            ("6 / 2 * 3", 9.0),
            ("6 * 2 / 3", 4.0),
            ("sin(pi / 6)^2", 0.25),
            ("-sin(pi/2)^2", -1.0),
            ("min(x, y) + max(y, z)", 7.0),
            ("min(-x, 1 + y) * 2", -4.0),
            ("atan2(1, 1) * 4", std::f64::consts::PI),
            ("(t < 0.5) * z + (t >= 0.5) * y", 5.0),
            ("step(t - 1) + sign(-z) + abs(-z)", 4.0),
            ("sqrt(16) + ln(exp(2)) + log10(1000)", 9.0),
            ("+x", 2.0),
            ("4 * ramp(t) + ramp(-t) - ramp(x)", 2.0 * (1.0 - 0.5_f64.sqrt()) - 1.0),
            ("max(0, min(1, t / 0.1))", 1.0),
            ("-9.81 * max(0, min(1, t / 0.5))", -4.905),
            ("max(min(1, t), 0)", 0.25),
            ("min(atan2(1, max(x, y)), max(0, min(2, max(1, t))))", libm::atan2(1.0, 3.0)),
            ("max(-x, max(-(y), max(-z, min((1), (2)))))", 1.0),
            ("min(x, y < z)", 1.0),
            ("2 * max(x + y, x * y) ^ 2 / 4", 18.0),
        ];
        for (text, expected) in cases {
            let found = value(text);
            assert!(
                (found - expected).abs() <= 4.0 * f64::EPSILON * expected.abs(),
                "{text}: {found}, not {expected}"
            );
        }
    }

    #[test]
    fn functions_are_those_of_libm() {
        let expression = Expression::parse("exp(sin(x)) ^ t").unwrap();
        let expected = libm::pow(libm::exp(libm::sin(1.1)), 0.7);
        assert_eq!(expression.at(&Place::from([1.1, 0.0, 0.0]), 0.7).to_bits(), expected.to_bits());
        assert!(expression.names(0) && expression.depends_on_time());
        assert!(!(0..3).any(|axis| Expression::parse("2 * t").unwrap().names(axis)));
        let both = Expression::parse("x - X + 10 * Z").unwrap();
        assert!(both.names(0) && both.names_undeformed() && both.names_z());
        assert_eq!(both.at(&Place { now: [3.0; 3], undeformed: [1.0, 0.0, 2.0] }, 0.0), 22.0);
    }

    #[test]
    fn faults_name_their_column() {
        let cases = [
            ("2 * xx", 5, "\"xx\""),
            ("2 * (x + 1", 5, "without its \")\""),
            ("2 * x) + 1", 6, "without its \"(\""),
            ("x $ 2", 3, "'$'"),
            ("", 1, "no expression"),
            ("2^3^x", 4, "power of a power"),
            ("2 * -x", 5, "parentheses"),
            ("1.2.3 + x", 1, "a number"),
            ("ä + y", 1, "'ä'"),
            ("x +", 3, "nothing after \"+\""),
            ("x y", 3, "\"y\"; expected an operator"),
            ("2 * sin", 5, "\"sin\" without arguments"),
            ("sin x", 5, "\"sin\" without arguments"),
            ("1 + min(x)", 10, "one argument of \"min\""),
            ("max(x, min(y, z, t))", 16, "third argument of \"min\""),
            ("sin(x, y)", 6, "second argument of \"sin\""),
            ("(x, y)", 3, "commas"),
            ("2 (x)", 3, "\"(\"; expected an operator"),
            ("1 / 0", 1, "the value inf"),
        ];
        for (text, column, word) in cases {
            let error = Expression::parse(text).unwrap_err();
            assert_eq!(error.column, column, "{text}: {error}");
            assert!(error.to_string().contains(word), "{text}: {error}");
        }
        for text in
            ["sin", "()", "* x", ",", "sin()", "sin(,x)", "min(x,)", "x <", "pi pi", "min(x, y))", "sin * x"]
        {
            assert!(Expression::parse(text).is_err(), "{text}");
        }
    }

    /// Texts that are as long as they may be take some seconds at most, however deeply they are nested.
    #[test]
    fn long_expressions_take_time_in_proportion_to_their_length() {
        let many = |piece: &str, count: usize| piece.repeat(count);
        let texts = [
            format!("{}t", many("-", 9_999)),
            format!("1{}", many("-1", 4_999)),
            format!("{}t{}", many("sin(", 1_999), many(")", 1_999)),
            format!("{}t{}", many("max(1,", 1_428), many(")", 1_428)),
            format!("{}t{}", many("atan2(", 1_110), many(",1)", 1_110)),
            format!("{}t{}", many("t-(", 2_498), many(")", 2_498)),
        ];
        let start = thread_seconds();
        for text in &texts {
            let expression = Expression::parse(text).unwrap_or_else(|error| panic!("{error}"));
            assert!(expression.at(&Place::from([0.0; 3]), 0.5).is_finite(), "{}", &text[..20]);
        }
        assert!(thread_seconds() - start < 4.0);
        assert_eq!(Expression::parse(&texts[5]).unwrap().at(&Place::from([0.0; 3]), 0.5), 0.5);
        let error = Expression::parse(&many("-", 10_001)).unwrap_err().to_string();
        assert!(
            error.contains("found 10001 characters; expected at most 10000") && error.len() < 300,
            "{error}"
        );
    }

    /// The key, the expression and where: of several places the same one, in any order of evaluation.
    #[test]
    fn a_value_that_is_not_finite_is_remembered_with_its_place() {
        let expression = Expression::parse("sqrt(x - 1) / t").unwrap().of_key("gravity[1]".into());
        assert!(expression.at(&Place::from([5.0, 0.0, 0.0]), 0.5).is_finite());
        assert_eq!(expression.not_finite(), None);
        for x in [0.25, 0.125, 0.5] {
            assert!(expression.at(&Place::from([x, 0.0, 0.0]), 0.5).is_nan());
        }
        assert_eq!(
            expression.not_finite().unwrap().to_string(),
            "gravity[1]: found the value NaN of \"sqrt(x - 1) / t\" at x = 0.125 m, t = 0.5 s; expected a finite number \
             wherever and whenever it is needed"
        );
        assert_eq!(expression.clone().not_finite(), None);
    }
}
