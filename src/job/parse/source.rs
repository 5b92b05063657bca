//! The text of a job file as a tree of values with their places.
use super::error::QUOTED;
use super::{syntax, unclosed};
use crate::text::{excerpt, written};
use std::borrow::Cow;
use std::fmt::Write as _;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value of the file.
#[derive(Clone, Debug)]
pub(in crate::job) struct Node {
    /// Bytes of the value; of the header for tables that have one.
    pub span: Range<usize>,
    /// Bytes of the key, or of the value for elements of arrays.
    pub key_span: Range<usize>,
    /// The value.
    pub value: Value,
}

/// TOML values.
#[derive(Clone, Debug)]
pub(in crate::job) enum Value {
    Text(String),
    Integer(i64),
    Float(f64),
    Boolean(bool),
    Time(String),
    Array(Vec<Node>),
    Table(Vec<(String, Node)>),
}

/// One step of a path into the tree.
#[derive(Clone, Debug)]
enum Step {
    Key(Cow<'static, str>),
    Index(usize),
}

/// A path from the root of the file to a value.
#[derive(Clone, Debug, Default)]
pub(in crate::job) struct Path(Vec<Step>);

impl Path {
    pub(crate) fn key(&self, key: impl Into<Cow<'static, str>>) -> Self {
        let mut steps = self.0.clone();
        steps.push(Step::Key(key.into()));
        Self(steps)
    }

    pub(crate) fn index(&self, index: usize) -> Self {
        let mut steps = self.0.clone();
        steps.push(Step::Index(index));
        Self(steps)
    }
}

impl std::fmt::Display for Path {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, step) in self.0.iter().enumerate() {
            match step {
                Step::Key(key) if i == 0 => f.write_str(&excerpt(key, QUOTED))?,
                Step::Key(key) => write!(f, ".{}", excerpt(key, QUOTED))?,
                Step::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

impl Node {
    /// Parses the text of a file; the error has the place and the parser's words, or names what is not
    /// closed.
    pub(crate) fn parse(text: &str) -> Result<Self, (Range<usize>, String)> {
        let table = DeTable::parse(text).map_err(|error| {
            let end = text.len();
            let span = error.span().unwrap_or(end..end);
            unclosed::find(text, span.start)
                .or_else(|| syntax::explain(text, span.start))
                .unwrap_or_else(|| (span, error.message().to_owned()))
        })?;
        let value = from_table(table.into_inner())?;
        Ok(Self { span: 0..0, key_span: 0..0, value })
    }

    /// The value under a key, for tables.
    pub(crate) fn get(&self, key: &str) -> Option<&Self> {
        match &self.value {
            Value::Table(entries) => entries.iter().find(|(name, _)| name == key).map(|(_, node)| node),
            _ => None,
        }
    }

    /// Place of the value at `path`, or of the innermost value around it that exists.
    pub(crate) fn locate(&self, path: &Path) -> Range<usize> {
        let mut node = self;
        for step in &path.0 {
            let inner = match (step, &node.value) {
                (Step::Key(key), _) => node.get(key),
                (Step::Index(index), Value::Array(elements)) => elements.get(*index),
                _ => None,
            };
            match inner {
                Some(inner) => node = inner,
                None => break,
            }
        }
        node.span.clone()
    }

    /// The value as a person would name it in "found …".
    pub(crate) fn describe(&self) -> String {
        let mut words = String::new();
        let written = match &self.value {
            Value::Text(text) => write!(words, "the string \"{}\"", excerpt(text, QUOTED)),
            Value::Integer(number) => write!(words, "{number}"),
            Value::Float(number) => words.write_str(&written(*number)),
            Value::Boolean(flag) => write!(words, "{flag}"),
            Value::Time(time) => write!(words, "the date {time}"),
            Value::Array(elements) if elements.is_empty() => write!(words, "an empty array"),
            Value::Array(elements) if elements.len() == 1 => write!(words, "an array of 1 element"),
            Value::Array(elements) => write!(words, "an array of {} elements", elements.len()),
            Value::Table(_) => write!(words, "a table"),
        };
        debug_assert!(written.is_ok());
        words
    }
}

type Failure = (Range<usize>, String);

fn from_table(table: DeTable<'_>) -> Result<Value, Failure> {
    let mut entries = Vec::with_capacity(table.len());
    for (key, value) in table {
        let key_span = key.span();
        entries.push((key.into_inner().into_owned(), from_value(value, Some(key_span))?));
    }
    // The parser sorts keys; messages are better in the order of the file.
    entries.sort_by_key(|(_, node)| node.key_span.start);
    Ok(Value::Table(entries))
}

fn from_value(spanned: Spanned<DeValue<'_>>, key_span: Option<Range<usize>>) -> Result<Node, Failure> {
    let span = spanned.span();
    let value = match spanned.into_inner() {
        DeValue::String(text) => Value::Text(text.into_owned()),
        DeValue::Integer(digits) => match i64::from_str_radix(digits.as_str(), digits.radix()) {
            Ok(number) => Value::Integer(number),
            Err(_) => {
                return Err((
                    span,
                    format!(
                        "found the integer {}; expected one of at most 63 bits",
                        excerpt(digits.as_str(), QUOTED)
                    ),
                ));
            }
        },
        DeValue::Float(digits) => match digits.as_str().parse() {
            Ok(number) => Value::Float(number),
            Err(_) => {
                return Err((span, format!("found {}; expected a number", excerpt(digits.as_str(), QUOTED))));
            }
        },
        DeValue::Boolean(flag) => Value::Boolean(flag),
        DeValue::Datetime(time) => Value::Time(time.to_string()),
        DeValue::Array(elements) => {
            Value::Array(elements.into_iter().map(|e| from_value(e, None)).collect::<Result<_, _>>()?)
        }
        DeValue::Table(table) => from_table(table)?,
    };
    Ok(Node { key_span: key_span.unwrap_or_else(|| span.clone()), span, value })
}
