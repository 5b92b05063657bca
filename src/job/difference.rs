//! Differences between two jobs, among the keys that decide the state.
use serde_json::Value;

use super::convert::settings::deciding;
use super::schema::job_file::JobFile;

/// A key whose value differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The key, such as `materials[0].friction_angle`.
    pub key: String,
    /// Its value in the first and in the second job, as JSON; `None` where it is not set.
    pub values: [Option<String>; 2],
}

/// The keys that decide the state and differ between the texts of two jobs, in alphabetical order.
/// `None` if one of the texts cannot be read by this version of the program.
pub fn differences(texts: [&str; 2]) -> Option<Vec<Difference>> {
    let mut jobs = Vec::new();
    for text in texts {
        let file: JobFile = toml::from_str(text).ok()?;
        jobs.push(serde_json::to_value(deciding(&file)).ok()?);
    }
    let mut found = Vec::new();
    compare("", Some(&jobs[0]), Some(&jobs[1]), &mut found);
    Some(found)
}

fn compare(key: &str, first: Option<&Value>, second: Option<&Value>, found: &mut Vec<Difference>) {
    match (first, second) {
        (Some(Value::Object(a)), Some(Value::Object(b))) => {
            let inner = |name: &String| if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            let added = b.keys().filter(|name| !a.contains_key(*name));
            for name in a.keys().chain(added) {
                compare(&inner(name), a.get(name), b.get(name), found);
            }
        }
        // Vectors and tables of numbers read best in one piece.
        (Some(Value::Array(a)), Some(Value::Array(b))) if a.iter().chain(b).any(Value::is_object) => {
            for index in 0..a.len().max(b.len()) {
                compare(&format!("{key}[{index}]"), a.get(index), b.get(index), found);
            }
        }
        _ if first == second => {}
        _ => {
            let value = |value: Option<&Value>| value.filter(|value| !value.is_null()).map(Value::to_string);
            found.push(Difference { key: key.to_owned(), values: [value(first), value(second)] });
        }
    }
}

impl std::fmt::Display for Difference {
    /// `KEY is OLD there and NEW here`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [there, here] = self.values.each_ref().map(|value| match value {
            None => "not set".to_owned(),
            Some(text) if text.chars().count() > LONGEST => {
                text.chars().take(LONGEST).chain("…".chars()).collect()
            }
            Some(text) => text.clone(),
        });
        write!(f, "`{}` is {there} there and {here} here", self.key)
    }
}

/// Letters of a value that are shown.
const LONGEST: usize = 60;

#[cfg(test)]
mod tests {
    use super::*;

    const JOB: &str = r#"
        version = 1
        dimension = 2
        domain = { size = [1, 1], root_edge = 1 }
        time = { end = 1 }
        materials = [{ name = "a", density = 1000, model = "hencky", young = 1e5, poisson = 0.3 }]
        bodies = [{ name = "b", material = "a", shape = { kind = "box", min = [0, 0], max = [0.5, 0.5] } }]
    "#;

    fn shown(changes: &[(&str, &str)]) -> Vec<String> {
        let changed = changes.iter().fold(JOB.to_owned(), |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        });
        differences([JOB, &changed]).unwrap().iter().map(Difference::to_string).collect()
    }

    #[test]
    fn keys_are_named_with_both_values() {
        assert_eq!(
            shown(&[("young = 1e5", "young = 2e5")]),
            ["`materials[0].young` is 100000.0 there and 200000.0 here"]
        );
        assert_eq!(
            shown(&[
                ("dimension = 2", "dimension = 2\ngravity = [0, -9.81]"),
                ("max = [0.5, 0.5]", "max = [0.5, 0.25]")
            ]),
            [
                "`bodies[0].shape.max` is [0.5,0.5] there and [0.5,0.25] here",
                "`gravity` is not set there and [0.0,-9.81] here"
            ]
        );
    }

    #[test]
    fn what_may_differ_is_not_named() {
        assert_eq!(
            shown(&[(
                "time = { end = 1 }",
                "time = { end = 2 }\ntitle = \"other\"\noutput = { every = 0.1 }"
            )]),
            [""; 0]
        );
        assert_eq!(differences([JOB, "of another program"]), None);
    }
}
