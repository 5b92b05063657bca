//! Values of a job that are set from outside: `--set key=value` and the like.
//!
//! A setting changes the text of the job, all else stays as it is; the result is a job file like any other.
//! Places in it are mapped back to the file that the user has written.
use super::error::{Fault, QUOTED, names as listed};
use super::source::Path;
use super::syntax::unquoted;
use crate::text::excerpt;
use std::ffi::OsStr;
use std::ops::Range;
use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Key, Table, TableLike, Value};

/// Settings in the order in which they are made.
#[derive(Clone, Debug, Default)]
pub struct Settings(Vec<Setting>);

/// One value that replaces that of the job, or its default.
#[derive(Clone, Debug)]
struct Setting {
    /// As the user has typed it; the place of its faults.
    typed: String,
    keys: Vec<String>,
    value: Value,
}

impl Settings {
    /// Adds `KEY=VALUE`. Parts of the key are set apart by dots; a part after that of an array is a number,
    /// or the name of an element. The value is one of TOML; words need no quotes.
    ///
    /// # Errors
    /// It is not of that form; the message names the form.
    pub fn set(&mut self, text: &str) -> Result<(), String> {
        let typed = format!("--set {text}");
        let refuse = |reason: &str| format!("{}: {reason}", excerpt(&typed, QUOTED));
        let Some((path, value)) = split(text) else {
            return Err(refuse("found no \"=\"; expected KEY=VALUE, such as time.end=0.5"));
        };
        // Messages about jobs have `materials[0]`.
        let dotted = path.trim().replace('[', ".").replace(']', "");
        let keys = Key::parse(&dotted).map_err(|_| {
            refuse("found an invalid key; expected one such as time.end or materials.sand.density")
        })?;
        let keys = keys.iter().map(|key| key.get().to_owned()).collect();
        let value = read(value.trim()).ok_or_else(|| {
            refuse("found an invalid value; expected a TOML value, such as 0.5, [0, -9.81] or \"text\"")
        })?;
        self.0.push(Setting { typed, keys, value });
        Ok(())
    }

    /// Sets `output.directory`.
    pub fn set_directory(&mut self, directory: &str) {
        let keys = vec!["output".into(), "directory".into()];
        self.0.push(Setting { typed: format!("--out {directory}"), keys, value: directory.into() });
    }

    /// Sets `time.end`.
    pub fn set_end(&mut self, end: &str) {
        let keys = vec!["time".into(), "end".into()];
        let value = read(end).unwrap_or_else(|| end.into());
        self.0.push(Setting { typed: format!("--end {end}"), keys, value });
    }

    /// The settings as they are typed.
    pub fn words(&self) -> impl Iterator<Item = &OsStr> {
        self.0.iter().map(|setting| OsStr::new(&setting.typed))
    }

    /// The text of a job with the settings made. A text that is no TOML stays as it is.
    ///
    /// # Errors
    /// A key leads nowhere.
    pub(in crate::job) fn apply(&self, text: &str) -> Result<Edited, Vec<Fault>> {
        let mut edited = Edited { text: text.to_owned(), edits: Vec::new(), made: Vec::new() };
        if self.0.is_empty() {
            return Ok(edited);
        }
        // The editor writes line breaks in one way only, and no mark of the byte order.
        edited.replace(&text.trim_start_matches('\u{feff}').replace("\r\n", "\n"));
        let Ok(mut document) = edited.text.parse::<DocumentMut>() else { return Ok(edited) };
        edited.replace(&document.to_string());
        let mut faults = Vec::new();
        for setting in &self.0 {
            let mut path = Path::default();
            match set_in(document.as_table_mut(), &setting.keys, &setting.value, &mut path) {
                Ok(()) => {
                    edited.replace(&document.to_string());
                    edited.made.push((path.to_string(), setting.typed.clone()));
                }
                Err(message) => faults.push(Fault {
                    key: path.to_string(),
                    message,
                    span: 0..0,
                    help: None,
                    setting: Some(setting.typed.clone()),
                    included: None,
                }),
            }
        }
        if faults.is_empty() { Ok(edited) } else { Err(faults) }
    }
}

/// At the first `=` that is not quoted.
fn split(text: &str) -> Option<(&str, &str)> {
    let at = unquoted(text, '=')?;
    Some((&text[..at], &text[at + 1..]))
}

/// A value of TOML, a number as `.5` or `5.`, or a text without quotes.
fn read(text: &str) -> Option<Value> {
    if let Ok(mut value) = text.parse::<Value>() {
        value.decor_mut().clear();
        return Some(value);
    }
    if let (true, Ok(number)) = (text.contains('.'), text.parse::<f64>()) {
        return Some(number.into());
    }
    let is_plain = |c: char| c.is_alphanumeric() || "_-+./ ".contains(c);
    (!text.is_empty() && text.chars().all(is_plain)).then(|| text.into())
}

/// Sets the value under the keys; `path` becomes that of the messages of the job.
fn set_in(table: &mut dyn TableLike, keys: &[String], value: &Value, path: &mut Path) -> Result<(), String> {
    let Some((key, rest)) = keys.split_first() else { return Err("found no key; expected one".into()) };
    *path = path.key(key.clone());
    match (table.get_mut(key), rest.is_empty()) {
        (Some(item), true) => replace(item, value),
        (Some(item), false) => return set_below(item, rest, value, path),
        (None, true) => {
            table.insert(key, Item::Value(value.clone()));
        }
        (None, false) => {
            let mut made = Table::new();
            set_in(&mut made, rest, value, path)?;
            table.insert(key, Item::Table(made));
        }
    }
    Ok(())
}

fn replace(item: &mut Item, value: &Value) {
    let decor = item.as_value().map(|old| old.decor().clone());
    let mut value = value.clone();
    if let Some(decor) = decor {
        *value.decor_mut() = decor;
    }
    *item = Item::Value(value);
}

fn set_below(item: &mut Item, keys: &[String], value: &Value, path: &mut Path) -> Result<(), String> {
    match item {
        Item::Table(table) => set_in(table, keys, value, path),
        Item::ArrayOfTables(tables) => {
            let index = element(tables.len(), tables_names(tables), &keys[0])?;
            *path = path.index(index);
            let table = tables.get_mut(index).ok_or("found no such element")?;
            match &keys[1..] {
                [] => Err("found a whole table; expected one of its keys".into()),
                rest => set_in(table, rest, value, path),
            }
        }
        Item::Value(inner) => set_in_value(inner, keys, value, path),
        Item::None => Err("found nothing there; expected a table".into()),
    }
}

fn set_in_value(item: &mut Value, keys: &[String], value: &Value, path: &mut Path) -> Result<(), String> {
    match item {
        Value::InlineTable(table) => set_in_inline(table, keys, value, path),
        Value::Array(array) => {
            let names =
                array.iter().map(|element| name_of(element.as_inline_table().and_then(|t| t.get("name"))));
            let index = element(array.len(), names.collect(), &keys[0])?;
            *path = path.index(index);
            let inner = array.get_mut(index).ok_or("found no such element")?;
            match &keys[1..] {
                [] => {
                    let decor = inner.decor().clone();
                    *inner = value.clone();
                    *inner.decor_mut() = decor;
                    Ok(())
                }
                rest => set_in_value(inner, rest, value, path),
            }
        }
        _ => Err(format!(
            "found a value without keys; expected a table or an array, as \"{}\" follows",
            excerpt(&keys[0], QUOTED)
        )),
    }
}

fn set_in_inline(
    table: &mut InlineTable,
    keys: &[String],
    value: &Value,
    path: &mut Path,
) -> Result<(), String> {
    let Some((key, rest)) = keys.split_first() else { return Err("found no key; expected one".into()) };
    *path = path.key(key.clone());
    match (table.get_mut(key), rest.is_empty()) {
        (Some(inner), true) => {
            let decor = inner.decor().clone();
            *inner = value.clone();
            *inner.decor_mut() = decor;
        }
        (Some(inner), false) => return set_in_value(inner, rest, value, path),
        (None, true) => {
            table.insert(key, value.clone());
        }
        (None, false) => {
            let mut made = InlineTable::new();
            set_in_inline(&mut made, rest, value, path)?;
            table.insert(key, Value::InlineTable(made));
        }
    }
    Ok(())
}

fn name_of(value: Option<&Value>) -> Option<String> {
    value.and_then(Value::as_str).map(str::to_owned)
}

fn tables_names(tables: &ArrayOfTables) -> Vec<Option<String>> {
    tables.iter().map(|table| name_of(table.get("name").and_then(Item::as_value))).collect()
}

/// The index that a number or a name means.
fn element(count: usize, names: Vec<Option<String>>, key: &str) -> Result<usize, String> {
    if let Some(index) = names.iter().position(|name| name.as_deref() == Some(key)) {
        return Ok(index);
    }
    match key.parse::<usize>() {
        Ok(index) if index < count => Ok(index),
        _ => {
            let known: Vec<&str> = names.iter().flatten().map(String::as_str).collect();
            let names = if known.is_empty() { String::new() } else { format!(" or {}", listed(known)) };
            let numbers = match count {
                0 => "an array that has elements".to_owned(),
                1 => "0".to_owned(),
                _ => format!("a number from 0 to {}", count - 1),
            };
            Err(format!("found no element \"{}\"; expected {numbers}{names}", excerpt(key, QUOTED)))
        }
    }
}

/// A text that settings have changed.
#[derive(Clone, Debug)]
pub(in crate::job) struct Edited {
    /// The changed text.
    pub text: String,
    edits: Vec<Edit>,
    /// Paths of the keys that are set, with the settings as typed.
    made: Vec<(String, String)>,
}

/// A piece of text that was replaced by another.
#[derive(Clone, Debug)]
struct Edit {
    start: usize,
    removed: usize,
    inserted: usize,
}

impl Edited {
    /// Records the change to another text.
    fn replace(&mut self, text: &str) {
        let (old, new) = (self.text.as_bytes(), text.as_bytes());
        let start = old.iter().zip(new).take_while(|(a, b)| a == b).count();
        let rest = old.len().min(new.len()) - start;
        let same = old.iter().rev().zip(new.iter().rev()).take(rest).take_while(|(a, b)| a == b).count();
        let edit = Edit { start, removed: old.len() - same - start, inserted: new.len() - same - start };
        if edit.removed + edit.inserted > 0 {
            self.edits.push(edit);
            self.text = text.to_owned();
        }
    }

    /// Place of a byte in the text as the user has written it; of a new text, the place where it is inserted.
    pub(crate) fn original(&self, byte: usize) -> usize {
        self.edits.iter().rev().fold(byte, |byte, edit| {
            if byte < edit.start {
                byte
            } else if byte < edit.start + edit.inserted {
                edit.start.min(byte)
            } else {
                byte - edit.inserted + edit.removed
            }
        })
    }

    /// A fault of the changed text as one of the file or of the setting that it is about.
    pub(crate) fn attribute(&self, fault: Fault) -> Fault {
        let is_about = |path: &str| {
            let rest = fault.key.strip_prefix(path);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
        };
        let setting = self.made.iter().rev().find(|(path, _)| is_about(path));
        let Range { start, end } = fault.span;
        let (start, end) = (self.original(start), self.original(end));
        Fault { setting: setting.map(|(_, typed)| typed.clone()), span: start..end.max(start), ..fault }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const JOB: &str = "\
# A job.
gravity = [0, -9.81] # down
time = { end = 1.0 }

[domain]
size = [1, 1]

[[materials]]
name = \"sand\"
density = 1600

[[materials]]
name = \"3\"
density = 1000
";

    fn edited(settings: &[&str]) -> Result<Edited, Vec<Fault>> {
        let mut all = Settings::default();
        settings.iter().for_each(|text| all.set(text).expect("a setting"));
        all.apply(JOB)
    }

    #[test]
    fn values_are_set_in_tables_and_arrays_by_number_and_by_name() {
        let changes = [
            ("gravity.1=-1.6", "-9.81] # down", "-1.6] # down"),
            ("time.end=2", "end = 1.0", "end = 2"),
            ("time.cfl=0.5", "{ end = 1.0 }", "{ end = 1.0 , cfl = 0.5 }"),
            ("time.cfl=.5", "{ end = 1.0 }", "{ end = 1.0 , cfl = 0.5 }"),
            ("gravity.1=-9.", "-9.81] # down", "-9.0] # down"),
            ("materials.sand.density=1500", "1600", "1500"),
            ("materials[0].density=1500", "1600", "1500"),
            // A name comes before a number.
            ("materials.3.density=900", "1000", "900"),
            ("materials.1.name=clay", "\"3\"", "\"clay\""),
        ];
        for (setting, from, to) in changes {
            let text = edited(&[setting]).expect("applied").text;
            let same = |text: &str| text.replace(' ', "");
            assert_eq!(same(&text), same(&JOB.replace(from, to)), "{setting}");
        }
        let text = edited(&["output.every=0.1", "output.directory=a/b", "title=1.5.2", "domain.root_edge=1"])
            .expect("applied")
            .text;
        let value: toml::Table = text.parse().expect("TOML");
        assert_eq!(value["output"]["every"].as_float(), Some(0.1));
        assert_eq!(value["output"]["directory"].as_str(), Some("a/b"));
        assert_eq!(value["title"].as_str(), Some("1.5.2"));
        assert_eq!(value["domain"]["root_edge"].as_integer(), Some(1));
    }

    #[test]
    fn places_are_those_of_the_file() {
        let edited =
            edited(&["title=\"a longer title\"", "domain.root_edge=1", "gravity.0=12345"]).expect("applied");
        for word in ["sand", "1600", "size", "down", "A job"] {
            let [new, old] = [&edited.text, JOB].map(|text| text.find(word).expect("kept"));
            assert_eq!(edited.original(new), old, "{word}");
        }
    }

    #[test]
    fn keys_that_lead_nowhere_are_refused() {
        let refused = [
            (
                "materials.clay.density=1",
                "found no element \"clay\"; expected a number from 0 to 1 or \"sand\" or \"3\"",
            ),
            ("gravity.2=1", "found no element \"2\"; expected a number from 0 to 1"),
            ("time.end.x=1", "found a value without keys"),
            ("materials.0=1", "found a whole table"),
        ];
        for (setting, message) in refused {
            let faults = edited(&[setting]).expect_err(setting);
            assert!(faults[0].message.starts_with(message), "{:?}", faults[0]);
            assert_eq!(faults[0].setting.as_deref(), Some(&*format!("--set {setting}")));
        }
        for (text, message) in [
            ("time.end", "found no \"=\""),
            ("a..b=1", "found an invalid key"),
            ("a=[1", "found an invalid value"),
            ("=1", "found an invalid key"),
        ] {
            let error = Settings::default().set(text).expect_err(text);
            assert!(error.contains(message), "{error}");
        }
    }
}
