//! Claim: folders of `src/` are floors, and nothing imports from a floor above its own. The list of floors is
//! that of `ARCHITECTURE.md`, so the map there is the one that the compiler's input follows. Files do not
//! import in circles, those of `post/` and `cli/` neither. No folder has more files than a reader takes in
//! at a glance. Tests start MPI in processes of their own.
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

/// Words and paths of a text, each with what stands before it.
fn paths(text: &str) -> impl Iterator<Item = (&str, &str)> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + text[at..].find(is_part)?;
        let end = text[start..].find(|c| !is_part(c)).map_or(text.len(), |length| start + length);
        at = end;
        Some((&text[..start], &text[start..end]))
    })
}

/// A path from the top of the crate on, if it starts in the crate: by one of its prefixes, or by a module
/// that the file itself has.
fn absolute(path: &[String], own: &[String], children: &[&str]) -> Option<Vec<String>> {
    let ups = path.iter().take_while(|part| *part == "super").count();
    let start = match path[0].as_str() {
        "crate" => return Some(path[1..].to_vec()),
        "self" => return Some([own, &path[1..]].concat()),
        "super" => &own[..own.len().saturating_sub(ups)],
        child if path.len() > 1 && children.contains(&child) => own,
        _ => return None,
    };
    Some([start, &path[ups..]].concat())
}

/// Modules and items that a file imports, from the top of the crate on. A module that only hands on what a
/// module of its own has does not import it; one that uses it as well does.
fn imports(file: &str, text: &str) -> Vec<Vec<String>> {
    let (own, text) = (module_of(file), code(text));
    let children: Vec<&str> = text
        .lines()
        .filter_map(|line| line.trim_start_matches("pub").strip_suffix(';')?.split_once("mod "))
        .filter(|(before, _)| before.trim().is_empty() || before.starts_with('('))
        .map(|(_, name)| name)
        .collect();
    let (mut body, mut found, mut handed) = (String::new(), Vec::new(), Vec::new());
    for statement in text.split_inclusive(';') {
        let Some((before, tree)) = statement.split_once("use ") else {
            body += statement;
            continue;
        };
        let (start, tree) = (before.rsplit('\n').next().unwrap_or_default(), tree.trim_end_matches(';'));
        if !start.trim().is_empty() && !start.starts_with("pub") {
            body += statement;
            continue;
        }
        body += before;
        let mut paths = Vec::new();
        expand(&tree.replace('\n', " "), &mut paths);
        match start.starts_with("pub") {
            true => handed.extend(paths),
            false => found.extend(paths),
        }
    }
    // Paths that are written out where they are used. `pub(in crate::grid)` says who may see an item, not
    // where one comes from, and a path of another crate begins with its name.
    let written = paths(&body).filter(|(before, path)| path.contains("::") && !before.ends_with("in "));
    found
        .extend(written.map(|(_, path)| path.trim_end_matches(':').split("::").map(str::to_owned).collect()));
    let words = body.lines().filter(|line| !line.trim_end().ends_with(';') || !line.contains("mod "));
    let words = words.collect::<Vec<_>>().join("\n");
    let words: BTreeSet<&str> =
        paths(&words).flat_map(|(_, path)| path.split(':')).filter(|word| !word.is_empty()).collect();
    let is_used = |path: &Vec<String>| {
        let is_own = path[0] == "self" || children.contains(&path[0].as_str());
        !is_own || path.last().is_some_and(|item| words.contains(item.as_str()))
    };
    found.extend(handed.into_iter().filter(is_used));
    found.iter().filter_map(|path| absolute(path, &own, &children)).collect()
}

/// Imports of a `mod.rs`: others may take it from there, its children even without `pub`.
fn handed_on(text: &str) -> Vec<Vec<String>> {
    let text = code(text);
    let mut handed = Vec::new();
    for (start, tree) in text.split(';').filter_map(|statement| statement.split_once("use ")) {
        let start = start.rsplit('\n').next().unwrap_or_default().trim();
        if start.is_empty() || start.starts_with("pub") {
            expand(&tree.replace('\n', " "), &mut handed);
        }
    }
    // `a::b::{self}` is `a::b`.
    handed
        .iter_mut()
        .for_each(|path| path.truncate(path.len() - usize::from(path.ends_with(&["self".to_owned()]))));
    handed
}

/// The file that an import comes from: what a `mod.rs` hands on belongs to the file that has it.
fn source_of(path: &[String], handed: &BTreeMap<&String, Vec<Vec<String>>>) -> Option<String> {
    let has = |module: &[String]| {
        let stem = module.join("/");
        [format!("{stem}.rs"), format!("{stem}/mod.rs")].into_iter().find(|file| handed.contains_key(file))
    };
    let (depth, file) = (1..=path.len()).rev().find_map(|depth| Some((depth, has(&path[..depth])?)))?;
    let (item, within) = (path.get(depth), path.get(depth + 1..).unwrap_or_default());
    let from = handed[&file].iter().find(|from| from.last() == item && from.len() > 1);
    match from {
        Some(from) => {
            let own = || [&path[..depth], from].concat();
            let from = absolute(from, &path[..depth], &[]).unwrap_or_else(own);
            source_of(&[&from, within].concat(), handed)
        }
        None => Some(file),
    }
}

/// Who imports whom, by what `group` says of a file; a file that it leaves out counts for nothing.
fn arrows(
    sources: &Sources,
    group: impl Fn(&str) -> Option<String>,
) -> BTreeMap<(String, String), BTreeSet<String>> {
    let mut arrows: BTreeMap<_, BTreeSet<String>> = BTreeMap::new();
    let handed = sources.iter().map(|(file, text)| match file.ends_with("/mod.rs") {
        true => (file, handed_on(text)),
        false => (file, Vec::new()),
    });
    let handed = handed.collect();
    for (file, text) in sources {
        let Some(from) = group(file) else { continue };
        for path in imports(file, text) {
            let Some(to) = source_of(&path, &handed).and_then(|to| group(&to)) else { continue };
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
    sources_in("src")
}

/// Sources of a package.
fn sources_in(folder: &str) -> Sources {
    let mut sources = Sources::new();
    read_sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), "", &mut sources);
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

/// Imports that close a circle which is right in itself, each with its reason; at most five.
const RIGHT_IN_THEMSELVES: [(&str, &str); 1] = [
    // A state has room for the history variables of the law with most of them, which the list of laws knows;
    // each law takes a state. A number in its place would be a second thing to change with a law.
    ("material/state.rs", "material/laws/mod.rs"),
];

/// Files that a file imports, and those that these import, and so on.
fn reached<'a>(from: &'a str, imports: &BTreeMap<&'a str, Vec<&'a str>>) -> BTreeSet<&'a str> {
    let (mut seen, mut left) = (BTreeSet::new(), vec![from]);
    while let Some(file) = left.pop() {
        left.extend(imports.get(file).into_iter().flatten().filter(|to| seen.insert(**to)));
    }
    seen
}

/// Circles of files: the files of each, and the imports that close it. A `mod.rs` and a child are one if the
/// `mod.rs` uses the child and holds what the child needs. `but` has imports that do not count.
fn circles(sources: &Sources, but: &[(&str, &str)]) -> Vec<String> {
    let mut arrows = arrows(sources, |file| Some(file.to_owned()));
    for &(from, to) in but {
        let is_there = arrows.remove(&(from.to_owned(), to.to_owned())).is_some();
        assert!(is_there, "{from} does not import {to}: remove it from the list");
    }
    let mut next: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    arrows.keys().for_each(|(from, to)| next.entry(from).or_default().push(to));
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        next.keys().map(|file| (*file, reached(file, &next))).collect();
    let reaches = |from: &str, to: &str| reached.get(from).is_some_and(|files| files.contains(to));
    let circle = |file: &str| -> BTreeSet<&str> {
        reached[file].iter().copied().filter(|other| reaches(other, file)).collect()
    };
    let circles: BTreeSet<BTreeSet<&str>> =
        next.keys().map(|file| circle(file)).filter(|circle| !circle.is_empty()).collect();
    let in_words = |circle: &BTreeSet<&str>| {
        let is_in = |(from, to): &(String, String)| circle.contains(&**from) && circle.contains(&**to);
        let imports = arrows.iter().filter(|(ends, _)| is_in(ends)).flat_map(|(_, examples)| examples);
        let files = circle.iter().copied().collect::<Vec<_>>().join(", ");
        imports.fold(files, |text, import| format!("{text}\n    {import}"))
    };
    circles.iter().map(in_words).collect()
}

#[test]
fn files_do_not_import_in_circles() {
    let mut found = circles(&sources(), &RIGHT_IN_THEMSELVES);
    found.extend(["post/src", "cli"].iter().flat_map(|folder| circles(&sources_in(folder), &[])));
    assert!(found.is_empty(), "{} circles:\n{}", found.len(), found.join("\n"));
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

/// Most source files of a folder; files in its folders count there.
const MOST_FILES: usize = 12;

#[test]
fn folders_have_at_most_twelve_files() {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for package in ["src", "post/src", "cli", "partition/src"] {
        let mut sources = Sources::new();
        read_sources(
            &Path::new(env!("CARGO_MANIFEST_DIR")).join(package),
            &format!("{package}/"),
            &mut sources,
        );
        let folders = sources.keys().filter_map(|file| file.rsplit_once('/'));
        folders.for_each(|(folder, _)| *counts.entry(folder.to_owned()).or_default() += 1);
    }
    assert!(counts.contains_key("src/job/convert") && counts.contains_key("cli"), "{counts:?}");
    for (folder, count) in &counts {
        assert!(*count <= MOST_FILES, "{folder} has {count} files: group what belongs together");
    }
}

/// Comments fit into 110 columns, tables aside, and say what a thing is: none begins with "What".
#[test]
fn comments_have_their_form() {
    let mut faults = Vec::new();
    for package in ["src", "post/src", "cli", "partition/src"] {
        let mut sources = Sources::new();
        read_sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join(package), "", &mut sources);
        for (file, text) in &sources {
            for (number, line) in (1..).zip(text.lines()) {
                let comment = line.trim_start();
                let Some(words) = ["/// ", "//! "].iter().find_map(|mark| comment.strip_prefix(mark)) else {
                    continue;
                };
                let is_wide = line.chars().count() > 110 && !words.starts_with('|');
                if is_wide || words.starts_with("What ") && comment.ends_with('.') {
                    faults.push(format!("{package}/{file}:{number}: {comment}"));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
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

#[test]
fn a_circle_is_found() {
    let count = |room: &str, part: &str, but: &[(&str, &str)]| {
        let files = [("room/mod.rs", room), ("room/part.rs", part), ("other.rs", "use crate::room::Thing;")];
        let sources = files.into_iter().map(|(file, text)| (file.to_owned(), text.to_owned())).collect();
        circles(&sources, but).len()
    };
    let room = "mod part;\npub struct Thing;\nfn f() {\n    part::g();\n}";
    assert_eq!(count(room, "", &[]), 0);
    assert_eq!(count(room, "use super::Thing;", &[]), 1);
    assert_eq!(count(room, "use super::Thing;", &[("room/part.rs", "room/mod.rs")]), 0);
    assert_eq!(count(room, "use crate::other;", &[]), 1);
    // The room only hands on what the part has, or needs it as well.
    assert_eq!(count("mod part;\npub use part::g;", "use super::Thing;", &[]), 0);
    assert_eq!(count("mod part;\npub use part::g;\nfn f() {\n    g();\n}", "use super::Thing;", &[]), 1);
    // What the room imports belongs to the file that has it.
    assert_eq!(count("mod part;\nuse crate::other::Other;\nuse part::g;", "use super::Other;", &[]), 1);
    assert_eq!(count("mod part;\nuse part::g;", "fn g() {}", &[]), 0);
    assert_eq!(count("mod part;\nuse part::g;", "use super::g;", &[]), 0);
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
