//! Claim: folders of `src/` are floors, and nothing imports from a floor above its own. The list of floors is
//! that of `ARCHITECTURE.md`, so the map there is the one that the compiler's input follows. Tests start MPI in
//! processes of their own.
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Sources by path below `src/`.
type Sources = BTreeMap<String, String>;

fn read_sources(folder: &Path, under: &str, sources: &mut Sources) {
    for entry in fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.expect("an entry of a folder").path();
        let name = format!("{under}{}", path.file_name().unwrap_or_default().to_string_lossy());
        if path.is_dir() {
            read_sources(&path, &format!("{name}/"), sources);
        } else if name.ends_with(".rs") {
            sources.insert(name, fs::read_to_string(&path).expect("a source file in UTF-8"));
        }
    }
}

/// The module that a file holds: `["grid", "plan"]` for `grid/plan/mod.rs`.
fn module_of(file: &str) -> Vec<String> {
    let stem = file.trim_end_matches(".rs");
    let parts = stem.split('/').map(str::to_owned);
    parts.filter(|part| !["mod", "lib", "main"].contains(&part.as_str())).collect()
}

/// Code without comments and without the tests at the end of a file.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let lines = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    lines.map(|line| line.split(" // ").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// All paths of a `use` tree: `a::{b, c::d}` gives `a::b` and `a::c::d`.
fn expand(tree: &str, paths: &mut Vec<Vec<String>>) {
    let Some((prefix, rest)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default();
        paths.push(path.split("::").map(|part| part.trim().to_owned()).collect());
        return;
    };
    let inner = rest.trim().strip_suffix('}').unwrap_or(rest);
    let (mut depth, mut start) = (0, 0);
    for (at, character) in inner.char_indices().chain([(inner.len(), ',')]) {
        match character {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let item = inner[start..at].trim();
                if !item.is_empty() {
                    expand(&format!("{}{item}", prefix.trim()), paths);
                }
                start = at + 1;
            }
            _ => {}
        }
    }
}

/// Modules and items that a file imports, from the top of the crate on.
fn imports(file: &str, text: &str) -> Vec<Vec<String>> {
    let (own, text) = (module_of(file), code(text));
    let mut paths = Vec::new();
    for statement in text.split("use ").skip(1) {
        let tree = statement.split(';').next().unwrap_or_default().replace('\n', " ");
        if ["crate::", "super::", "self::"].iter().any(|start| tree.starts_with(start)) {
            expand(&tree, &mut paths);
        }
    }
    // Paths that are written out where they are used.
    for start in ["crate::", "super::"] {
        // `pub(in crate::grid)` says who may see an item, not where one comes from.
        for (at, _) in text.match_indices(start).filter(|(at, _)| !text[..*at].ends_with("in ")) {
            let path = text[at..].split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
            let path = path.into_iter().next().unwrap_or_default().trim_end_matches(':');
            paths.push(path.split("::").map(str::to_owned).collect());
        }
    }
    let resolve = |path: Vec<String>| {
        let ups = path.iter().take_while(|part| *part == "super").count();
        match path[0].as_str() {
            "crate" => path[1..].to_vec(),
            "self" => own.iter().chain(&path[1..]).cloned().collect(),
            _ => own[..own.len().saturating_sub(ups)].iter().chain(&path[ups..]).cloned().collect(),
        }
    };
    paths.into_iter().map(resolve).collect()
}

/// The file that an import comes from: what a `mod.rs` hands on belongs to the file that has it.
fn source_of(path: &[String], sources: &Sources) -> Option<String> {
    let has = |module: &[String]| {
        let stem = module.join("/");
        [format!("{stem}.rs"), format!("{stem}/mod.rs")].into_iter().find(|file| sources.contains_key(file))
    };
    let depth = (1..=path.len()).rev().find(|&depth| has(&path[..depth]).is_some())?;
    let file = has(&path[..depth])?;
    let Some(item) = path.get(depth) else { return Some(file) };
    if file.ends_with("/mod.rs") {
        let text = code(&sources[&file]);
        for statement in text.split("pub use ").skip(1) {
            let mut handed = Vec::new();
            expand(&statement.split(';').next().unwrap_or_default().replace('\n', " "), &mut handed);
            if let Some(mut from) =
                handed.into_iter().find(|from| from.last() == Some(item) && from.len() > 1)
            {
                from.retain(|part| part != "self");
                return source_of(&[&path[..depth], &from[..]].concat(), sources);
            }
        }
    }
    Some(file)
}

/// Who imports whom, by what `group` says of a file; a file that it leaves out counts for nothing.
fn arrows(
    sources: &Sources,
    group: impl Fn(&str) -> Option<String>,
) -> BTreeMap<(String, String), BTreeSet<String>> {
    let mut arrows: BTreeMap<_, BTreeSet<String>> = BTreeMap::new();
    for (file, text) in sources {
        let Some(from) = group(file) else { continue };
        for path in imports(file, text) {
            let Some(to) = source_of(&path, sources).and_then(|to| group(&to)) else { continue };
            if to != from {
                let example = format!("{file} imports {}", path.join("::"));
                arrows.entry((from.clone(), to)).or_default().insert(example);
            }
        }
    }
    arrows
}

/// Lines of the list in `ARCHITECTURE.md` that begins after this heading, from the bottom up.
fn floors(page: &str, heading: &str) -> Vec<Vec<String>> {
    let (_, after) = page.split_once(heading).unwrap_or_else(|| panic!("no heading {heading:?}"));
    let block = after.split("```").nth(1).unwrap_or_else(|| panic!("no list after {heading:?}"));
    let lines = block.lines().skip(1).filter(|line| !line.trim().is_empty());
    lines.map(|line| line.split_whitespace().map(str::to_owned).collect()).collect()
}

/// Imports from a lower to an upper floor, or beside each other on one, each with examples.
fn faults(arrows: &BTreeMap<(String, String), BTreeSet<String>>, floors: &[Vec<String>]) -> Vec<String> {
    let floor_of = |name: &String| floors.iter().position(|floor| floor.contains(name));
    let mut faults = Vec::new();
    for ((from, to), examples) in arrows {
        match (floor_of(from), floor_of(to)) {
            (Some(low), Some(high)) if low > high => {}
            (Some(_), Some(_)) => faults.extend(
                examples
                    .iter()
                    .map(|example| format!("{example}: {to} is not below {from} in ARCHITECTURE.md")),
            ),
            (None, _) => faults.push(format!("{from} has no floor in ARCHITECTURE.md")),
            (_, None) => faults.push(format!("{to} has no floor in ARCHITECTURE.md")),
        }
    }
    faults.sort();
    faults.dedup();
    faults
}

fn is_test(file: &str) -> bool {
    file.contains("/tests/") || file.ends_with("tests.rs")
}

fn sources() -> Sources {
    let mut sources = Sources::new();
    read_sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), "", &mut sources);
    sources.retain(|file, _| !is_test(file) && file != "lib.rs" && file != "main.rs");
    sources
}

fn page() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md");
    fs::read_to_string(path).expect("ARCHITECTURE.md")
}

/// The folder or file right below a folder, `grid/` or the top of the crate.
fn below(folder: &str, file: &str) -> Option<String> {
    let rest = file.strip_prefix(folder)?;
    let name = rest.split('/').next()?.trim_end_matches(".rs");
    Some(name.to_owned())
}

#[test]
fn folders_import_from_lower_floors_only() {
    let faults = faults(&arrows(&sources(), |file| below("", file)), &floors(&page(), "## Floors"));
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn rooms_import_from_lower_rooms_only() {
    for (folder, heading) in [("grid/", "Rooms of `grid/`"), ("solver/", "Rooms of `solver/`")] {
        let faults = faults(&arrows(&sources(), |file| below(folder, file)), &floors(&page(), heading));
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }
}

/// The list would not be the map of the house if it named what is not there.
#[test]
fn each_floor_exists() {
    let sources = sources();
    for (folder, heading) in
        [("", "## Floors"), ("grid/", "Rooms of `grid/`"), ("solver/", "Rooms of `solver/`")]
    {
        let there: BTreeSet<String> = sources.keys().filter_map(|file| below(folder, file)).collect();
        let listed: BTreeSet<String> = floors(&page(), heading).into_iter().flatten().collect();
        assert_eq!(there, listed, "{heading}");
    }
}

/// The checks above see what they are there for.
#[test]
fn an_upward_import_is_found() {
    let floors = vec![vec!["low".to_owned()], vec!["high".to_owned()]];
    let check = |low: &str| {
        let files = [
            ("low/mod.rs", low),
            ("low/part.rs", ""),
            ("high/mod.rs", "pub use inner::Thing;\nmod inner;\n"),
            ("high/inner.rs", "use crate::low::part;\n"),
        ];
        let sources = files.into_iter().map(|(file, text)| (file.to_owned(), text.to_owned())).collect();
        faults(&arrows(&sources, |file| below("", file)), &floors).len()
    };
    assert_eq!(check(""), 0);
    assert_eq!(check("use crate::high::Thing;"), 1);
    assert_eq!(check("use super::high::Thing;"), 1);
    assert_eq!(check("use crate::{low::part, high::{Thing, inner}};"), 2);
    assert_eq!(check("fn f() {\n    crate::high::f();\n}"), 1);
    assert_eq!(check("// use crate::high::Thing;\nuse self::part;"), 0);
    assert_eq!(check("#[cfg(test)]\nmod tests {\n    use crate::high::Thing;\n}"), 0);
}

/// MPI changes the environment of its process as it starts, and another thread that starts a program meanwhile
/// would read freed memory. So tests start MPI in processes of their own alone.
#[test]
fn tests_start_mpi_in_processes_of_their_own() {
    let own = ["common/relaunch.rs", "common/scenarios.rs", "all/io_files.rs", "layering.rs"];
    let mut sources = Sources::new();
    read_sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests"), "", &mut sources);
    let starts =
        |(name, text): &(&String, &String)| text.contains("World::init") && !own.contains(&name.as_str());
    let others: Vec<_> = sources.iter().filter(starts).map(|(name, _)| name).collect();
    assert!(others.is_empty(), "{others:?} start MPI: use ran_if_launched and relaunch");
}
