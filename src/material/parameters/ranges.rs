//! Ranges of parameters, as the schema of the job file states them.
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::OutOfRange;

/// The first of these values that is outside the range that their schema states.
pub(crate) fn check<T: Serialize>(schema: &Value, values: &T) -> Result<(), OutOfRange> {
    // JSON has no form for numbers that are not finite; they come as null.
    let value = serde_json::to_value(values).unwrap_or_default();
    Ranges { root: schema }.look(schema, &value, "")
}

/// The first key of a table that is outside the range that its type states; `name` is that of the table.
pub(crate) fn check_table<T: JsonSchema + Serialize>(table: &T, name: &str) -> Result<(), OutOfRange> {
    let schema = schemars::schema_for!(T).to_value();
    let value = serde_json::to_value(table).unwrap_or_default();
    Ranges { root: &schema }.look(&schema, &value, name)
}

struct Ranges<'a> {
    root: &'a Value,
}

impl<'a> Ranges<'a> {
    fn look(&self, schema: &'a Value, value: &Value, key: &str) -> Result<(), OutOfRange> {
        if let Some(name) = schema["$ref"].as_str()
            && let Some(target) = self.root.pointer(name.trim_start_matches('#'))
        {
            self.look(target, value, key)?;
        }
        for choice in ["oneOf", "anyOf"] {
            let options = schema[choice].as_array().into_iter().flatten();
            for option in options.filter(|option| self.means(option, value)) {
                self.look(option, value, key)?;
            }
        }
        if is_number(schema) {
            return within(schema, value, key);
        }
        for (name, inner) in schema["properties"].as_object().into_iter().flatten() {
            let name = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            let own = name.rsplit('.').next().unwrap_or_default();
            if let Some(value) = value.get(own) {
                self.look(inner, value, &name)?;
            }
        }
        if let (Some(items), Some(elements)) = (schema.get("items"), value.as_array()) {
            for (i, element) in elements.iter().enumerate() {
                self.look(items, element, &format!("{key}[{i}]"))?;
            }
        }
        Ok(())
    }

    /// Whether an option of a choice is that of a value: tables are distinguished by a key with a constant.
    fn means(&self, option: &Value, value: &Value) -> bool {
        if let Some(name) = option["$ref"].as_str() {
            let target = self.root.pointer(name.trim_start_matches('#'));
            return target.is_some_and(|target| target.get("oneOf").is_some() || self.means(target, value))
                && value.is_object();
        }
        match value {
            Value::Object(entries) => {
                let tags = option["properties"].as_object().into_iter().flatten();
                let mut tags = tags.filter_map(|(key, schema)| Some((key, schema.get("const")?)));
                option["type"] == "object" && tags.all(|(key, word)| entries.get(key) == Some(word))
            }
            Value::Array(_) => option["type"] == "array",
            Value::Number(_) | Value::Null => is_number(option),
            _ => false,
        }
    }
}

fn is_number(schema: &Value) -> bool {
    let is = |kind: &Value| kind == "number" || kind == "integer";
    match &schema["type"] {
        Value::Array(kinds) => kinds.iter().any(is),
        kind => is(kind),
    }
}

fn within(schema: &Value, value: &Value, key: &str) -> Result<(), OutOfRange> {
    // A parameter that may be left out is null where it is.
    if value.is_null() && schema["type"].is_array() {
        return Ok(());
    }
    let number = value.as_f64().unwrap_or(f64::NAN);
    let limit = |keyword: &str| schema[keyword].as_f64();
    let mut words = Vec::new();
    let mut holds = number.is_finite();
    let mut require = |keyword: &str, word: &str, test: fn(&f64, &f64) -> bool| {
        if let Some(limit) = limit(keyword) {
            words.push(format!("{word} {}", plain(limit)));
            holds &= test(&number, &limit);
        }
    };
    require("minimum", "at least", f64::ge);
    require("exclusiveMinimum", "above", f64::gt);
    require("maximum", "at most", f64::le);
    require("exclusiveMaximum", "below", f64::lt);
    if holds {
        return Ok(());
    }
    let range = if words.is_empty() { "a finite number".to_owned() } else { words.join(" and ") };
    Err(OutOfRange { key: key.to_owned(), value: number, range })
}

/// A limit as a person would write it.
fn plain(limit: f64) -> String {
    if limit.abs() >= 1e7 || (limit != 0.0 && limit.abs() < 1e-3) {
        format!("{limit:e}")
    } else {
        limit.to_string()
    }
}
