//! The reference of the job file in Markdown, made from its schema.
use std::fmt::Write as _;

use serde_json::{Map, Value};

use crate::job::parse::structure::plain;

/// Every table and key with its range, default and meaning.
pub fn reference() -> String {
    let schema = super::json::schema();
    let empty = Map::new();
    let definitions = schema["$defs"].as_object().unwrap_or(&empty);
    let mut out = String::from(
        "# Job file\n\n\
         Made by `agimp schema --markdown`; do not edit. All quantities are in SI units. `agimp new` writes commented\n\
         examples, `agimp check` estimates the size and the duration of a job.\n\n\
         ## The file\n\n",
    );
    keys(&mut out, &schema);
    // Names alone have no section: they stand in the line of their key.
    for (name, definition) in definitions.iter().filter(|(_, definition)| !is_choice_of_words(definition)) {
        let _ = write!(out, "\n## {name}\n\n{}\n", sentence(definition));
        let Some(variants) = definition["oneOf"].as_array() else {
            if definition.get("properties").is_some() {
                out.push('\n');
                keys(&mut out, definition);
            }
            continue;
        };
        if definition.get("properties").is_some() {
            out.push('\n');
            keys(&mut out, definition);
        }
        for variant in variants {
            let _ = write!(out, "\n### {}\n\n{}\n", word(variant), sentence(variant));
            if variant["properties"]
                .as_object()
                .is_some_and(|all| all.values().any(|p| p.get("const").is_none()))
            {
                out.push('\n');
                keys(&mut out, variant);
            }
        }
    }
    out
}

/// A table of the keys of an object.
fn keys(out: &mut String, object: &Value) {
    out.push_str("| key | value | default | meaning |\n|---|---|---|---|\n");
    let required: Vec<&str> =
        object["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    for (key, property) in object["properties"].as_object().into_iter().flatten() {
        if property.get("const").is_some() {
            continue;
        }
        let default = match &property["default"] {
            _ if required.contains(&key.as_str()) => "required".to_owned(),
            Value::Null => "–".to_owned(),
            // The defaults of its keys are in its own section.
            Value::Object(_) => "–".to_owned(),
            value => format!("`{value}`"),
        };
        let _ = writeln!(out, "| `{key}` | {} | {default} | {} |", value(property), sentence(property));
    }
}

/// Values that a key may have.
fn value(property: &Value) -> String {
    if let Some(name) = property["$ref"].as_str().and_then(|path| path.rsplit('/').next()) {
        let definitions = &super::json::schema()["$defs"][name];
        return if is_choice_of_words(definitions) {
            let words: Vec<String> =
                definitions["oneOf"].as_array().into_iter().flatten().map(word).collect();
            words.join(", ")
        } else {
            format!("[{name}](#{})", name.to_lowercase())
        };
    }
    if let Some(choices) = property["anyOf"].as_array() {
        let values: Vec<String> = choices.iter().filter(|c| c["type"] != "null").map(value).collect();
        return values.join(" or ");
    }
    let kind = match &property["type"] {
        Value::Array(kinds) => kinds.first().and_then(Value::as_str).unwrap_or_default(),
        kind => kind.as_str().unwrap_or_default(),
    };
    match kind {
        "array" => {
            let count = match (property["minItems"].as_u64(), property["maxItems"].as_u64()) {
                (Some(least), Some(most)) if least == most => least.to_string(),
                (Some(least), Some(most)) if most == least + 1 => format!("{least} or {most}"),
                (Some(least), Some(most)) => format!("{least} to {most}"),
                _ => "list".to_owned(),
            };
            match value(&property["items"]).as_str() {
                "string" if count == "list" => "list of strings".to_owned(),
                "string" => format!("{count} strings"),
                items => format!("{count} of {items}"),
            }
        }
        "boolean" => "`true` or `false`".to_owned(),
        "string" => "string".to_owned(),
        kind => {
            let bound = |key: &str, sign: &str| {
                property[key].as_f64().map(|limit| format!("{sign} {}", plain(limit)))
            };
            let limits =
                [("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<")];
            let limits: Vec<String> = limits.iter().filter_map(|(key, sign)| bound(key, sign)).collect();
            [vec![kind.to_owned()], limits].concat().join(" ").replace(" <", ", <").replace(" ≤", ", ≤")
        }
    }
}

/// A choice between words that have no keys of their own.
fn is_choice_of_words(definition: &Value) -> bool {
    definition["oneOf"].as_array().is_some_and(|all| all.iter().all(|choice| choice.get("const").is_some()))
}

/// The word that stands for a choice, as it is written in the file.
fn word(choice: &Value) -> String {
    if let Some(word) = choice["const"].as_str() {
        return format!("`\"{word}\"`");
    }
    let tagged = choice["properties"].as_object().into_iter().flatten();
    let tag = tagged
        .into_iter()
        .find_map(|(key, value)| Some(format!("`{key} = \"{}\"`", value["const"].as_str()?)));
    // A choice without a tag is named by its key.
    let key = || choice["properties"].as_object()?.keys().next().map(|key| format!("`{{ {key} = … }}`"));
    tag.or_else(key).unwrap_or_default()
}

/// The description on one line; bars would end a cell of a table.
fn sentence(described: &Value) -> String {
    described["description"].as_str().unwrap_or_default().replace('\n', " ").replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_page_is_up_to_date() {
        let page = include_str!("../../../docs/job-file.md");
        assert!(
            page == super::reference(),
            "docs/job-file.md differs; write it again: cargo run -- schema --markdown > docs/job-file.md"
        );
    }
}
