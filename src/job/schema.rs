//! JSON schema of the job file, made from the types that parse it.
use super::file::JobFile;
use serde_json::{Map, Value, json};

/// The schema (JSON Schema, draft 2020-12).
///
/// It is also what job files are checked against before they are parsed, so the two cannot differ.
pub fn schema() -> Value {
    let mut root = schemars::schema_for!(JobFile).to_value();
    limit_model_parameters(&mut root);
    root
}

/// Ranges of the parameters that constitutive models share, by key: `(key, limits)`.
///
/// The models state them in words; here they become checkable for every model at once.
fn model_limits() -> [(&'static str, Value); 6] {
    [
        ("young", json!({"exclusiveMinimum": 0.0, "maximum": 1e13})),
        ("poisson", json!({"exclusiveMinimum": -1.0, "exclusiveMaximum": 0.5})),
        ("yield_stress", json!({"exclusiveMinimum": 0.0, "maximum": 1e13})),
        ("hardening", json!({"minimum": 0.0, "maximum": 1e13})),
        ("friction_angle", json!({"minimum": 0.0, "exclusiveMaximum": 90.0})),
        ("cohesion", json!({"minimum": 0.0, "maximum": 1e13})),
    ]
}

fn limit_model_parameters(root: &mut Value) {
    let Some(models) = root.pointer_mut("/$defs/Material/oneOf").and_then(Value::as_array_mut) else {
        return;
    };
    for model in models {
        let Some(properties) = model.get_mut("properties").and_then(Value::as_object_mut) else { continue };
        for (key, limits) in model_limits() {
            let Some(property) = properties.get_mut(key).and_then(Value::as_object_mut) else { continue };
            let Value::Object(limits) = limits else { continue };
            add_missing(property, limits);
        }
    }
}

/// A limit that the model's own type states wins.
fn add_missing(property: &mut Map<String, Value>, limits: Map<String, Value>) {
    for (keyword, limit) in limits {
        property.entry(keyword).or_insert(limit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every key that a user can write is explained.
    #[test]
    fn every_property_has_a_description() {
        fn walk(value: &Value, path: &str, missing: &mut Vec<String>) {
            if let Some(properties) = value.get("properties").and_then(Value::as_object) {
                for (key, property) in properties {
                    if property.get("const").is_none() && property.get("description").is_none() {
                        missing.push(format!("{path}/{key}"));
                    }
                }
            }
            match value {
                Value::Object(map) => map.iter().for_each(|(k, v)| walk(v, &format!("{path}/{k}"), missing)),
                Value::Array(list) => {
                    list.iter().enumerate().for_each(|(i, v)| walk(v, &format!("{path}/{i}"), missing));
                }
                _ => {}
            }
        }
        let mut missing = Vec::new();
        walk(&schema(), "", &mut missing);
        assert!(missing.is_empty(), "{missing:?}");
    }

    #[test]
    fn models_have_limits() {
        let text = schema().to_string();
        assert_eq!(text.matches("\"exclusiveMaximum\":0.5").count(), 5);
        assert!(text.contains("\"exclusiveMaximum\":90.0"));
    }
}
