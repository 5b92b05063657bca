//! JSON schema of the job file, made from the types that parse it.
use super::job_file::JobFile;
use serde_json::Value;

/// The schema (JSON Schema, draft 2020-12).
///
/// It is also what job files are checked against before they are parsed, so the two cannot differ.
pub fn schema() -> Value {
    schemars::schema_for!(JobFile).to_value()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Calls `look` with each part of a JSON value and its path.
    fn walk(value: &Value, path: &str, look: &mut impl FnMut(&Value, &str)) {
        look(value, path);
        match value {
            Value::Object(map) => map.iter().for_each(|(k, v)| walk(v, &format!("{path}/{k}"), look)),
            Value::Array(list) => {
                list.iter().enumerate().for_each(|(i, v)| walk(v, &format!("{path}/{i}"), look));
            }
            _ => {}
        }
    }

    /// Every key that a user can write is explained.
    #[test]
    fn every_property_has_a_description() {
        let mut missing = Vec::new();
        walk(&schema(), "", &mut |value, path| {
            if let Some(properties) = value.get("properties").and_then(Value::as_object) {
                for (key, property) in properties {
                    if property.get("const").is_none() && property.get("description").is_none() {
                        missing.push(format!("{path}/{key}"));
                    }
                }
            }
        });
        assert!(missing.is_empty(), "{missing:?}");
    }

    /// Every number of the file has a lower and an upper limit, so that none is finite and yet impossible.
    #[test]
    fn numbers_have_limits() {
        let mut missing = Vec::new();
        walk(&schema(), "", &mut |value, path| {
            let is_number = |kind: &Value| kind == "number" || kind == "integer";
            let kinds = match &value["type"] {
                Value::Array(kinds) => kinds.iter().any(is_number),
                kind => is_number(kind),
            };
            let has = |words: [&str; 2]| words.iter().any(|word| value.get(word).is_some());
            let lower = has(["minimum", "exclusiveMinimum"]);
            if kinds && !(lower && has(["maximum", "exclusiveMaximum"])) {
                missing.push(path.to_owned());
            }
        });
        assert!(missing.is_empty(), "{missing:#?}");
    }

    /// Every number among the parameters of a model has a range.
    #[test]
    fn models_have_limits() {
        let schema = schema();
        let models = schema["$defs"]["Material"]["oneOf"].as_array().unwrap();
        assert!(models.len() >= 5);
        let limits = ["minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum"];
        for model in models {
            for (key, property) in model["properties"].as_object().unwrap() {
                let has_limits = limits.iter().any(|limit| property.get(limit).is_some());
                assert!(property["type"] != "number" || has_limits, "{key} of {model}");
            }
        }
    }
}
