//! Checks a file against the schema: keys, types, choices and ranges.
//!
//! Working from the schema rather than from the parser's errors finds all faults at once, has the place of
//! each, and can explain a key.
use super::error::{Fault, MOST, QUOTED, alternatives};
use super::source::{Node, Path, Value as Toml};
use crate::text::{excerpt, nearest};
use serde_json::Value;

/// Keyword of the schema for keys and words that only jobs of one dimension have.
const DIMENSION: &str = "x-dimension";

/// The faults of form in the file, in its order; of very many the first ones found.
pub(in crate::job) fn check(file: &Node, schema: &Value) -> Vec<Fault> {
    let dimension = match file.get("dimension").map(|node| &node.value) {
        Some(Toml::Integer(dimension @ 2..=3)) => Some(*dimension),
        _ => None,
    };
    let mut checker = Checker { root: schema, dimension, faults: Vec::new() };
    checker.value(file, schema, &Path::default());
    let mut faults = checker.faults;
    faults.sort_by_key(|fault| fault.span.start);
    faults
}

struct Checker<'s> {
    root: &'s Value,
    /// Dimension of the job, if the file says so.
    dimension: Option<i64>,
    faults: Vec<Fault>,
}

/// Schemas that hold for a value at the same time, and the choices between schemas not yet made.
#[derive(Default)]
struct Layers<'s> {
    schemas: Vec<&'s Value>,
    choices: Vec<Vec<&'s Value>>,
}

impl<'s> Layers<'s> {
    /// Follows references and joins schemas that hold at the same time.
    fn add(&mut self, root: &'s Value, schema: &'s Value) {
        self.schemas.push(schema);
        let target = schema.get("$ref").and_then(Value::as_str).and_then(|name| name.strip_prefix('#'));
        if let Some(target) = target.and_then(|pointer| root.pointer(pointer)) {
            self.add(root, target);
        }
        for choice in ["anyOf", "oneOf"] {
            if let Some(options) = schema.get(choice).and_then(Value::as_array) {
                // TOML has no null: an optional value is given or left out.
                let given = |option: &&Value| option.get("type").and_then(Value::as_str) != Some("null");
                self.choices.push(options.iter().filter(given).collect());
            }
        }
    }

    fn keyword(&self, keyword: &str) -> Option<&'s Value> {
        self.schemas.iter().find_map(|schema| schema.get(keyword))
    }

    fn number(&self, keyword: &str) -> Option<f64> {
        self.keyword(keyword).and_then(Value::as_f64)
    }

    fn properties(&self) -> impl Iterator<Item = (&'s str, &'s Value)> + Clone {
        let maps = self.schemas.iter().filter_map(|schema| schema.get("properties")?.as_object());
        maps.flatten().map(|(key, schema)| (key.as_str(), schema))
    }

    fn required(&self) -> impl Iterator<Item = &'s str> {
        let lists = self.schemas.iter().filter_map(|schema| schema.get("required")?.as_array());
        lists.flatten().filter_map(Value::as_str)
    }

    /// The type that the value must have, leaving out null.
    fn type_name(&self) -> Option<&'s str> {
        match self.keyword("type")? {
            Value::String(name) => Some(name),
            Value::Array(names) => names.iter().filter_map(Value::as_str).find(|name| *name != "null"),
            _ => None,
        }
    }

    /// Meaning of the value: the innermost description, which is that of the key.
    fn description(&self) -> Option<String> {
        // Line breaks of the source are no part of the sentence.
        self.keyword("description").and_then(Value::as_str).map(|text| text.replace('\n', " "))
    }
}

impl<'s> Checker<'s> {
    /// Whether jobs of this dimension have the key or word.
    fn fits(&self, schema: &Value) -> bool {
        let only = schema.get(DIMENSION).and_then(Value::as_i64);
        only.is_none() || self.dimension.is_none() || only == self.dimension
    }

    fn value(&mut self, node: &Node, schema: &'s Value, path: &Path) {
        if self.faults.len() > MOST {
            return;
        }
        let mut layers = Layers::default();
        layers.add(self.root, schema);
        while let Some(options) = layers.choices.pop() {
            match self.choose(node, &options, &layers, path) {
                Some(chosen) => layers.add(self.root, chosen),
                None => return,
            }
        }
        match (layers.type_name(), &node.value) {
            (Some("object"), Toml::Table(entries)) => self.table(node, entries, &layers, path),
            (Some("array"), Toml::Array(elements)) => self.array(node, elements, &layers, path),
            (Some("number"), Toml::Float(number)) => self.number(node, *number, &layers, path),
            // Exact within the limits; larger integers are beyond them anyway.
            (Some("number" | "integer"), Toml::Integer(number)) => {
                self.number(node, *number as f64, &layers, path);
            }
            (Some("string"), Toml::Text(_)) | (Some("boolean"), Toml::Boolean(_)) | (None, _) => {}
            (Some(name), _) => self.mismatch(node, &type_words(name, &layers), &layers, path),
        }
    }

    /// The one of several schemas that the value means, or a fault.
    fn choose(
        &mut self,
        node: &Node,
        options: &[&'s Value],
        layers: &Layers<'s>,
        path: &Path,
    ) -> Option<&'s Value> {
        if let [only] = options {
            return Some(only);
        }
        // Words, such as "slip".
        if options.iter().all(|option| option.get("const").is_some()) {
            let fitting = || options.iter().filter(|option| self.fits(option));
            let words: Vec<&str> = fitting().filter_map(|option| option.get("const")?.as_str()).collect();
            let Toml::Text(word) = &node.value else {
                self.mismatch(node, &alternatives(words), layers, path);
                return None;
            };
            let found =
                options.iter().find(|option| option.get("const") == Some(&Value::from(word.as_str())));
            if found.is_none() {
                self.unknown_word(node, word, &words, layers, path);
            }
            return found.copied();
        }
        // Tables that name their kind.
        if let Some(tag) = options.first().and_then(|option| tag_of(option)) {
            if !matches!(node.value, Toml::Table(_)) {
                self.mismatch(node, &format!("a table with the key \"{tag}\""), layers, path);
                return None;
            }
            let word_of = |option: &'s Value| option.get("properties")?.get(tag)?.get("const")?.as_str();
            let fitting = options.iter().filter(|option| self.fits(option));
            let words: Vec<&str> = fitting.filter_map(|option| word_of(option)).collect();
            let Some(kind) = node.get(tag) else {
                let message = format!("missing key `{tag}`; expected {tag} = {}", alternatives(words));
                self.fault(node, path, message, layers);
                return None;
            };
            let Toml::Text(word) = &kind.value else {
                self.mismatch(kind, &alternatives(words), layers, &path.key(tag.to_owned()));
                return None;
            };
            let found = options.iter().find(|option| word_of(option) == Some(word));
            if found.is_none() {
                self.unknown_word(kind, word, &words, layers, &path.key(tag.to_owned()));
            }
            return found.copied();
        }
        // Words beside tables, such as "delete" or { material = "rubble" }.
        if let Toml::Text(word) = &node.value
            && options.iter().any(|option| option.get("const").is_some())
        {
            let word_of = |option: &'s Value| option.get("const")?.as_str();
            let found = options.iter().find(|option| word_of(option) == Some(word));
            if found.is_none() {
                let words: Vec<&str> = options.iter().filter_map(|option| word_of(option)).collect();
                let key_of = |option: &&'s Value| option.get("required")?.get(0)?.as_str();
                let tables = options.iter().filter_map(key_of).map(|key| format!("{{ {key} = … }}"));
                let all: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).chain(tables).collect();
                let guess =
                    nearest(word, words).map_or(String::new(), |w| format!("; did you mean \"{w}\"?"));
                let message =
                    format!("found \"{}\"; expected one of {}{guess}", excerpt(word, QUOTED), all.join(", "));
                self.fault(node, path, message, layers);
            }
            return found.copied();
        }
        // Tables that differ by the key that each needs, which may be misspelt.
        if let Toml::Table(entries) = &node.value {
            let key_of = |option: &'s Value| {
                let mut one = Layers::default();
                one.add(self.root, option);
                one.required().next()
            };
            let tables = options.iter().filter(|option| option.get("$ref").is_some());
            let tables: Vec<_> = tables.filter_map(|option| Some((key_of(option)?, *option))).collect();
            let is_near = |key: &str| entries.iter().any(|(given, _)| nearest(given, [key]).is_some());
            let with_key = tables.iter().find(|(key, _)| node.get(key).is_some());
            match with_key.or_else(|| tables.iter().find(|(key, _)| is_near(key))) {
                Some((_, option)) => return Some(option),
                None if tables.len() > 1 => {
                    let keys: Vec<String> = tables.iter().map(|(key, _)| format!("`{key}`")).collect();
                    let message =
                        format!("found a table without a key of {}; expected one of them", keys.join(", "));
                    self.fault(node, path, message, layers);
                    return None;
                }
                None => {}
            }
        }
        // Different types; one with a definition of its own is a table.
        let found = options.iter().find(|option| {
            let is_table = option.get("$ref").is_some() && matches!(node.value, Toml::Table(_));
            is_table
                || matches!(
                    (option.get("type").and_then(Value::as_str), &node.value),
                    (Some("number"), Toml::Integer(_) | Toml::Float(_))
                        | (Some("integer"), Toml::Integer(_))
                        | (Some("array"), Toml::Array(_))
                        | (Some("string"), Toml::Text(_))
                        | (Some("object"), Toml::Table(_))
                        | (Some("boolean"), Toml::Boolean(_))
                )
        });
        if found.is_none() {
            let words: Vec<String> = options
                .iter()
                .filter_map(|option| {
                    let mut one = Layers::default();
                    one.add(self.root, option);
                    one.type_name().map(|name| type_words(name, &one))
                })
                .collect();
            self.mismatch(node, &words.join(" or "), layers, path);
        }
        found.copied()
    }

    fn table(&mut self, node: &Node, entries: &[(String, Node)], layers: &Layers<'s>, path: &Path) {
        let mut unknown = Vec::new();
        for (key, inner) in entries {
            match layers.properties().find(|(known, _)| known == key) {
                Some((_, schema)) => self.value(inner, schema, &path.key(key.clone())),
                None => unknown.push((key, inner)),
            }
        }
        let mut missing: Vec<&str> =
            layers.required().filter(|key| !entries.iter().any(|(given, _)| given == key)).collect();
        missing.dedup();
        for (key, inner) in unknown {
            if self.faults.len() > MOST {
                return;
            }
            let whole = path.key(key.clone()).to_string();
            // A misspelt key was most likely meant to be one that is missing.
            let keys = layers.properties().filter(|(_, schema)| self.fits(schema)).map(|(known, _)| known);
            // A key that is there already is meant where it is very near, as in a setting of the command
            // line.
            let is_near = |known: &&str| known.len() > 4 && strsim::damerau_levenshtein(key, known) <= 2;
            let known = keys.clone().filter(|known| node.get(known).is_none() || is_near(known));
            let meant = nearest(key, missing.iter().copied()).or_else(|| nearest(key, known));
            let quoted = excerpt(key, QUOTED);
            let message = match meant {
                Some(meant) => {
                    missing.retain(|other| *other != meant);
                    format!("unknown key `{quoted}`; did you mean `{meant}`?")
                }
                None => {
                    let known: Vec<String> = keys.map(|known| format!("`{known}`")).collect();
                    format!("unknown key `{quoted}`; expected one of {}", known.join(", "))
                }
            };
            let help = layers.properties().find(|(known, _)| Some(*known) == meant);
            self.faults.push(Fault {
                key: whole,
                message,
                span: inner.key_span.clone(),
                help: help.and_then(|(_, schema)| schema.get("description")?.as_str().map(str::to_owned)),
                setting: None,
                included: None,
            });
        }
        for key in missing {
            let mut wanted = Layers::default();
            if let Some((_, schema)) = layers.properties().find(|(known, _)| *known == key) {
                wanted.add(self.root, schema);
            }
            let meaning = wanted.description().map_or(String::new(), |text| format!(": {text}"));
            self.faults.push(Fault {
                key: path.key(key.to_owned()).to_string(),
                message: format!("missing key `{key}`{meaning}"),
                span: node.span.clone(),
                help: None,
                setting: None,
                included: None,
            });
        }
    }

    fn array(&mut self, node: &Node, elements: &[Node], layers: &Layers<'s>, path: &Path) {
        let least = layers.number("minItems").unwrap_or(0.0);
        let most = layers.number("maxItems").unwrap_or(f64::INFINITY);
        let count = elements.len() as f64;
        if count < least || count > most {
            self.mismatch(node, &type_words("array", layers), layers, path);
            // One fault suffices if there are far too many elements.
            if count > most && (count > 10.0 * most || most > 1000.0) {
                return;
            }
        }
        if let Some(items) = layers.keyword("items") {
            for (i, element) in elements.iter().enumerate() {
                self.value(element, items, &path.index(i));
            }
        }
    }

    fn number(&mut self, node: &Node, number: f64, layers: &Layers<'s>, path: &Path) {
        let above = |limit: f64| number > limit;
        let holds = number.is_finite()
            && layers.number("minimum").is_none_or(|limit| number >= limit)
            && layers.number("maximum").is_none_or(|limit| number <= limit)
            && layers.number("exclusiveMinimum").is_none_or(above)
            && layers.number("exclusiveMaximum").is_none_or(|limit| number < limit);
        if !holds {
            let name = layers.type_name().unwrap_or("number");
            self.mismatch(node, &type_words(name, layers), layers, path);
        }
    }

    fn unknown_word(&mut self, node: &Node, word: &str, words: &[&str], layers: &Layers<'s>, path: &Path) {
        let known = || words.iter().copied();
        let guess = nearest(word, known()).map_or(String::new(), |w| format!("; did you mean \"{w}\"?"));
        let message =
            format!("found \"{}\"; expected {}{guess}", excerpt(word, QUOTED), alternatives(known()));
        self.fault(node, path, message, layers);
    }

    fn mismatch(&mut self, node: &Node, expected: &str, layers: &Layers<'s>, path: &Path) {
        self.fault(node, path, format!("found {}; expected {expected}", node.describe()), layers);
    }

    fn fault(&mut self, node: &Node, path: &Path, message: String, layers: &Layers<'s>) {
        let (key, help) = (path.to_string(), layers.description());
        self.faults.push(Fault {
            key,
            message,
            span: node.span.clone(),
            help,
            setting: None,
            included: None,
        });
    }
}

/// The key whose constant names the variant of a table.
fn tag_of(option: &Value) -> Option<&str> {
    let properties = option.get("properties")?.as_object()?;
    properties.iter().find(|(_, schema)| schema.get("const").is_some()).map(|(key, _)| key.as_str())
}

/// A limit as a person would write it.
pub(in crate::job) fn plain(limit: f64) -> String {
    if limit.abs() >= 1e7 || (limit != 0.0 && limit.abs() < 1e-3) {
        format!("{limit:e}")
    } else {
        limit.to_string()
    }
}

/// "a number above 0 and at most 1".
fn type_words(name: &str, layers: &Layers<'_>) -> String {
    match name {
        "object" => "a table".into(),
        "string" => "a string".into(),
        "boolean" => "true or false".into(),
        "array" => {
            let kind = layers.keyword("items").and_then(|items| items.get("type")?.as_str());
            let kind = if kind == Some("number") { "numbers" } else { "elements" };
            match (layers.number("minItems"), layers.number("maxItems")) {
                (Some(least), Some(most)) if least == most => format!("an array of {least} {kind}"),
                (Some(least), Some(most)) => format!("an array of {least} to {most} {kind}"),
                (Some(least), None) => format!("an array of at least {least} {kind}"),
                (None, Some(most)) => format!("an array of at most {most} {kind}"),
                _ => format!("an array of {kind}"),
            }
        }
        _ => {
            let limits: Vec<String> = [
                ("exclusiveMinimum", "above"),
                ("minimum", "at least"),
                ("exclusiveMaximum", "below"),
                ("maximum", "at most"),
            ]
            .into_iter()
            .filter_map(|(keyword, words)| {
                layers.number(keyword).map(|limit| format!("{words} {}", plain(limit)))
            })
            .collect();
            let noun = if name == "integer" { "an integer" } else { "a number" };
            match (layers.number("minimum"), layers.number("maximum")) {
                (Some(least), Some(most)) if least == most => format!("{least}"),
                _ if limits.is_empty() && name == "number" => "a finite number".into(),
                _ if limits.is_empty() => noun.into(),
                _ => format!("{noun} {}", limits.join(" and ")),
            }
        }
    }
}
