//! What the studies share.
use std::path::Path;

/// The value, or the end of the program with the reason.
pub(crate) fn checked<T, E: std::fmt::Display>(result: Result<T, E>, what: impl std::fmt::Display) -> T {
    result.unwrap_or_else(|error| {
        eprintln!("{what}: {error}");
        std::process::exit(1)
    })
}

/// Columns of a history whose names begin so, row by row; the end of the program if there is none.
#[allow(dead_code, reason = "each study uses its part")]
pub(crate) fn history<const N: usize>(path: &Path, names: [&str; N]) -> Vec<[f64; N]> {
    let text = checked(std::fs::read_to_string(path), path.display());
    let mut lines = text.lines();
    let heads: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let place = |name: &str| heads.iter().position(|head| head.starts_with(name)).ok_or("no such column");
    let places = names.map(|name| checked(place(name), format!("{}: {name}", path.display())));
    let rows = lines.map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        places.map(|place| cells.get(place).and_then(|cell| cell.parse().ok()).unwrap_or(f64::NAN))
    });
    rows.collect()
}
