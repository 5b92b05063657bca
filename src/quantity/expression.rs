//! Expressions of place and time, such as `0.1 * sin(2 * pi * x) * exp(-t / 0.5)`; X, Y, Z are the place in the undeformed body.
//!
//! The crate `exmex` parses and evaluates; all functions are `libm`'s, so values do not depend on the machine. Two forms
//! that parsers read differently are made plain here: `-x^2` is `-(x^2)` as on paper, and chains such as `a^b^c` or
//! `a * -b` ask for parentheses.
use exmex::{BinOp, Express, FlatEx, MakeOperators, Operator};

use super::Place;

/// Variables of an expression, in the order in which values are given.
const VARIABLES: [&str; 7] = ["x", "y", "z", "t", "X", "Y", "Z"];

/// Names of functions and constants, for messages.
const FUNCTIONS: &str = "sin, cos, tan, asin, acos, atan, atan2(y, x), sinh, cosh, tanh, exp, ln, log10, sqrt, abs, sign, \
     step, floor, ceil, min(a, b), max(a, b), pi";

/// A scalar expression in x, y, z, X, Y, Z (m) and t (s).
#[derive(Clone, Debug)]
pub struct Expression {
    text: String,
    parsed: FlatEx<f64, Operators>,
    /// Which of [`VARIABLES`] each variable of the expression is.
    used: Vec<usize>,
}

/// Why a text is no expression.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason} (column {column} of \"{text}\")")]
pub struct ExpressionError {
    /// The text.
    pub text: String,
    /// Column of the fault, from 1.
    pub column: usize,
    /// What was found and what is expected.
    pub reason: String,
}

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// With the column of the fault.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        let fault = |at: usize, reason: String| ExpressionError {
            text: text.to_owned(),
            column: text[..at].chars().count() + 1,
            reason,
        };
        let plain = with_plain_signs(&tokens(text).map_err(|(at, reason)| fault(at, reason))?)
            .map_err(|(at, reason)| fault(at, reason))?;
        let parsed = FlatEx::<f64, Operators>::parse(&plain)
            .map_err(|error| fault(0, format!("found an invalid expression: {error}")))?;
        let position = |name: &String| VARIABLES.iter().position(|known| known == name);
        let used: Option<Vec<usize>> = parsed.var_names().iter().map(position).collect();
        let used = used.ok_or_else(|| fault(0, format!("expected variables {}", VARIABLES.join(", "))))?;
        let expression = Self { text: text.to_owned(), parsed, used };
        // What cannot be evaluated at all is refused here, so that `at` cannot fail.
        match expression.parsed.eval(&vec![0.5; expression.used.len()]) {
            Ok(_) => Ok(expression),
            Err(error) => Err(fault(0, format!("found an expression without a value: {error}"))),
        }
    }

    /// Value at a place (m) and a time (s). Not a number where the expression has none, as `ln(-1)`.
    pub fn at(&self, place: &Place, t: f64) -> f64 {
        let ([x, y, z], [at_x, at_y, at_z]) = (place.now, place.undeformed);
        let all = [x, y, z, t, at_x, at_y, at_z];
        let mut values = [0.0; VARIABLES.len()];
        for (value, &variable) in values.iter_mut().zip(&self.used) {
            *value = all[variable];
        }
        self.parsed.eval(&values[..self.used.len()]).unwrap_or(f64::NAN)
    }

    /// Whether it names a place.
    pub fn depends_on_place(&self) -> bool {
        self.used.iter().any(|&variable| variable != 3)
    }

    /// Whether it names X, Y or Z.
    pub fn names_undeformed(&self) -> bool {
        self.used.iter().any(|&variable| variable > 3)
    }

    /// Whether it names z or Z.
    pub fn names_z(&self) -> bool {
        self.used.contains(&2) || self.used.contains(&6)
    }

    /// Whether it names t.
    pub fn depends_on_time(&self) -> bool {
        self.used.contains(&3)
    }

    /// The text as given.
    pub fn text(&self) -> &str {
        &self.text
    }
}

/// A piece of an expression: where it begins, and what it is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Token<'a> {
    Number(&'a str),
    Name(&'a str),
    Sign(&'a str),
}

impl<'a> Token<'a> {
    fn text(&self) -> &'a str {
        match self {
            Self::Number(text) | Self::Name(text) | Self::Sign(text) => text,
        }
    }

    /// Whether an operand may end with it.
    fn ends_operand(&self) -> bool {
        !matches!(self, Self::Sign(sign) if *sign != ")")
    }
}

/// Cuts a text into tokens and refuses unknown names, unbalanced parentheses and strange characters.
fn tokens(text: &str) -> Result<Vec<(usize, Token<'_>)>, (usize, String)> {
    let bytes = text.as_bytes();
    let (mut found, mut at, mut open) = (Vec::new(), 0, Vec::new());
    while at < bytes.len() {
        let from = at;
        let run = |mut at: usize, ok: &dyn Fn(u8) -> bool| {
            while at < bytes.len() && ok(bytes[at]) {
                at += 1;
            }
            at
        };
        match bytes[at] {
            b' ' | b'\t' | b'\n' | b'\r' => {
                at += 1;
                continue;
            }
            b'0'..=b'9' | b'.' => {
                at = run(at, &|b| b.is_ascii_digit() || b == b'.');
                if at < bytes.len() && matches!(bytes[at], b'e' | b'E') {
                    let signed = at + 1 + usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
                    let end = run(signed, &|b| b.is_ascii_digit());
                    if end > signed {
                        at = end;
                    }
                }
                if text[from..at].parse::<f64>().is_err() {
                    return Err((from, format!("found \"{}\"; expected a number", &text[from..at])));
                }
                found.push((from, Token::Number(&text[from..at])));
            }
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                at = run(at, &|b| b.is_ascii_alphanumeric() || b == b'_');
                let name = &text[from..at];
                let known = VARIABLES.contains(&name)
                    || Operators::make().iter().any(|operator| operator.repr() == name);
                if !known {
                    let expected = format!("variables {} and {FUNCTIONS}", VARIABLES.join(", "));
                    return Err((from, format!("found the name \"{name}\"; expected {expected}")));
                }
                found.push((from, Token::Name(name)));
            }
            b'<' | b'>' if bytes.get(at + 1) == Some(&b'=') => {
                at += 2;
                found.push((from, Token::Sign(&text[from..at])));
            }
            b'+' | b'-' | b'*' | b'/' | b'^' | b'(' | b')' | b',' | b'<' | b'>' => {
                at += 1;
                match bytes[from] {
                    b'(' => open.push(from),
                    b')' if open.pop().is_none() => {
                        return Err((from, "found \")\" without its \"(\"".into()));
                    }
                    _ => {}
                }
                found.push((from, Token::Sign(&text[from..at])));
            }
            _ => {
                let odd = text[from..].chars().next().unwrap_or(' ');
                let expected = "numbers, names, + - * / ^ < > <= >= ( ) and commas";
                return Err((from, format!("found {odd:?}; expected {expected}")));
            }
        }
    }
    match open.pop() {
        Some(from) => Err((from, "found \"(\" without its \")\"".into())),
        None if found.is_empty() => Err((0, "found no expression; expected one such as 2 * x + t".into())),
        None => Ok(found),
    }
}

/// The expression with every leading minus as a product, so that powers come first, and without forms that can be read in
/// two ways.
fn with_plain_signs(tokens: &[(usize, Token)]) -> Result<String, (usize, String)> {
    let mut plain = String::new();
    // Depth of parentheses at which the last power stands, to find a^b^c.
    let (mut depth, mut power): (usize, Option<usize>) = (0, None);
    for (i, (at, token)) in tokens.iter().enumerate() {
        let before = i.checked_sub(1).map(|i| &tokens[i].1);
        let begins = before.is_none_or(|before| !before.ends_operand() && !matches!(before, Token::Name(_)));
        match token {
            Token::Sign("(") => depth += 1,
            Token::Sign(")") => {
                depth = depth.saturating_sub(1);
                power = power.filter(|&at| at <= depth);
            }
            Token::Sign("^") => {
                if power == Some(depth) {
                    return Err((
                        *at,
                        "found a power of a power; expected parentheses, as in (a^b)^c".into(),
                    ));
                }
                power = Some(depth);
            }
            Token::Sign(_) => power = power.filter(|&at| at < depth),
            _ => {}
        }
        match token {
            Token::Sign("-" | "+") if begins => {
                if let Some(Token::Sign(sign @ ("*" | "/" | "^"))) = before {
                    let reason = format!(
                        "found \"{}\" right after \"{sign}\"; expected parentheses, as in a {sign} (-b)",
                        token.text()
                    );
                    return Err((*at, reason));
                }
                plain.push_str(if token.text() == "-" { " (-1) * " } else { " " });
            }
            // Without exponents, which the parser does not read in all forms.
            Token::Number(number) => match number.parse::<f64>() {
                Ok(value) => plain.push_str(&format!("{value} ")),
                Err(_) => return Err((*at, format!("found \"{number}\"; expected a number"))),
            },
            _ => {
                plain.push_str(token.text());
                plain.push(' ');
            }
        }
    }
    Ok(plain)
}

/// Operators with `libm` behind them.
#[derive(Clone, Debug)]
struct Operators;

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        let binary = |name, prio, apply: fn(f64, f64) -> f64| {
            Operator::make_bin(name, BinOp { apply, prio, is_commutative: false })
        };
        vec![
            binary("<=", 0, |a, b| f64::from(u8::from(a <= b))),
            binary(">=", 0, |a, b| f64::from(u8::from(a >= b))),
            binary("<", 0, |a, b| f64::from(u8::from(a < b))),
            binary(">", 0, |a, b| f64::from(u8::from(a > b))),
            binary("+", 1, |a, b| a + b),
            Operator::make_bin_unary(
                "-",
                BinOp { apply: |a, b| a - b, prio: 1, is_commutative: false },
                |a| -a,
            ),
            binary("*", 2, |a, b| a * b),
            binary("/", 3, |a, b| a / b),
            binary("^", 4, libm::pow),
            binary("min", 0, f64::min),
            binary("max", 0, f64::max),
            binary("atan2", 0, libm::atan2),
            Operator::make_unary("sin", libm::sin),
            Operator::make_unary("cos", libm::cos),
            Operator::make_unary("tan", libm::tan),
            Operator::make_unary("asin", libm::asin),
            Operator::make_unary("acos", libm::acos),
            Operator::make_unary("atan", libm::atan),
            Operator::make_unary("sinh", libm::sinh),
            Operator::make_unary("cosh", libm::cosh),
            Operator::make_unary("tanh", libm::tanh),
            Operator::make_unary("exp", libm::exp),
            Operator::make_unary("ln", libm::log),
            Operator::make_unary("log10", libm::log10),
            Operator::make_unary("sqrt", libm::sqrt),
            Operator::make_unary("abs", f64::abs),
            Operator::make_unary("sign", |a| {
                if a > 0.0 {
                    1.0
                } else if a < 0.0 {
                    -1.0
                } else {
                    0.0
                }
            }),
            Operator::make_unary("step", |a| f64::from(u8::from(a >= 0.0))),
            Operator::make_unary("floor", libm::floor),
            Operator::make_unary("ceil", libm::ceil),
            Operator::make_constant("pi", std::f64::consts::PI),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert!(expression.depends_on_place() && expression.depends_on_time());
        assert!(!Expression::parse("2 * t").unwrap().depends_on_place());
        let both = Expression::parse("x - X + 10 * Z").unwrap();
        assert!(both.depends_on_place() && both.names_undeformed() && both.names_z());
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
        ];
        for (text, column, word) in cases {
            let error = Expression::parse(text).unwrap_err();
            assert_eq!(error.column, column, "{text}: {error}");
            assert!(error.to_string().contains(word), "{text}: {error}");
        }
        for text in ["x +", "x y", "sin", "()", "min(x)", "2 (x)", "* x", "x t", "min(x, y, z)", ",", "sin()"]
        {
            assert!(Expression::parse(text).is_err(), "{text}");
        }
    }
}
