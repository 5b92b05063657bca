//! Which columns of the history belong into one chart.
use super::history::{Column, History};

/// Curves that share a chart.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Panel {
    pub title: String,
    pub unit: String,
    /// Quantity on the horizontal axis, and its unit.
    pub across: (String, String),
    pub is_logarithmic: bool,
    /// Names and points.
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
}

impl Panel {
    /// Curves over time.
    pub(super) fn new(title: &str, unit: &str, curves: Vec<(String, Vec<(f64, f64)>)>) -> Self {
        let across = ("time".to_owned(), "s".to_owned());
        Self { title: title.into(), unit: unit.into(), across, is_logarithmic: false, curves }
    }

    /// Whether anything in it changes.
    pub(super) fn changes(&self) -> bool {
        self.curves.iter().any(|(_, points)| {
            let mut values = points.iter().map(|p| p.1).filter(|y| y.is_finite());
            let first = values.next();
            values.any(|y| Some(y) != first)
        })
    }
}

/// Columns that have no chart: they give the place of a row.
const LEFT_OUT: [&str; 3] = ["time", "stage", "grid_mass"];
/// Columns that share a chart: its title and their names there.
const TOGETHER: [(&str, &[(&str, &str)]); 8] = [
    (
        "Energy",
        &[
            ("kinetic_energy", "kinetic"),
            ("elastic_energy", "elastic"),
            ("gravitational_energy", "gravitational, change"),
            ("plastic_work", "plastic work"),
        ],
    ),
    (
        "Particles put back, deleted, left",
        &[("put_back", "put back"), ("deleted", "deleted"), ("left", "left")],
    ),
    ("Mass that has gone", &[("deleted_mass", "deleted"), ("left_mass", "left")]),
    (
        "Splits and merges so far",
        &[("splits", "splits"), ("merges", "merges"), ("merged_away", "particles merged away")],
    ),
    ("Kinetic energy that splits and merges took", &[("split_energy", "splits"), ("merge_energy", "merges")]),
    ("Root mean square of the speed at its last peak", &[("peak_speed", "speed")]),
    ("Unbalanced acceleration", &[("unbalanced_acceleration", "acceleration")]),
    ("Time step", &[("dt", "time step")]),
];
/// Charts with a logarithmic axis.
const LOGARITHMIC: [&str; 2] = ["peak_speed", "unbalanced_acceleration"];
/// Prefixes of the names of loads, probes and colliders in columns; the longest first where one is the start
/// of another.
const STEMS: [(&str, &str); 30] = [
    ("angular_momentum", "Angular momentum"),
    ("contact_work", "Work of contact"),
    ("plastic_work", "Plastic work of"),
    ("plastic_strain", "Mean plastic strain of"),
    ("greatest_speed", "Greatest speed of"),
    ("kinetic_energy", "Kinetic energy of"),
    ("elastic_energy", "Elastic energy of"),
    ("load", "Force of load"),
    ("work", "Work of load"),
    ("contact", "Force of contact"),
    ("force", "Force on"),
    ("torque", "Torque on"),
    ("position", "Position of"),
    ("orientation", "Orientation of"),
    ("angle", "Angle of"),
    ("velocity", "Velocity of"),
    ("spin", "Spin of"),
    ("passed", "Mass that has passed"),
    ("extent", "Extent of"),
    ("run_out", "Run-out of"),
    ("edge", "Outer edge of"),
    ("height", "Height of"),
    ("centre", "Displacement of the centre of"),
    ("momentum", "Momentum of"),
    ("displacement", "Displacement of"),
    ("stress", "Mean stress of"),
    ("pore_pressure", "Mean pore pressure of"),
    ("pressure", "Mean pressure of"),
    ("volume", "Volume of"),
    ("mass", "Mass of"),
];
/// Endings that name a component.
const COMPONENTS: [&str; 10] = ["_xx", "_yy", "_zz", "_xy", "_xz", "_yz", "_x", "_y", "_z", "_w"];

/// The charts of a history, in the order of its columns; those in which nothing changes are left out.
pub(super) fn panels(history: &History) -> Vec<Panel> {
    let Some(times) = history.column("time").map(|column| &column.values) else { return Vec::new() };
    let mut panels: Vec<Panel> = Vec::new();
    for column in history.columns.iter().filter(|column| !LEFT_OUT.contains(&&*column.name)) {
        let (title, name) = place(&column.name);
        let start = match (&*column.name, column.values.first()) {
            ("gravitational_energy", Some(first)) => *first,
            // A settlement of millimetres does not show beside heights of metres.
            (name, _) if name.starts_with("centre_") => {
                column.values.iter().copied().find(|value| value.is_finite()).unwrap_or_default()
            }
            _ => 0.0,
        };
        // No step has been done at the start.
        let value = |value: &f64| if column.name == "dt" && *value == 0.0 { f64::NAN } else { value - start };
        let points = times.iter().copied().zip(column.values.iter().map(value)).collect();
        match panels.iter_mut().find(|panel| panel.title == title && panel.unit == column.unit) {
            Some(panel) => panel.curves.push((name, points)),
            None => {
                let panel = Panel::new(&title, &column.unit, vec![(name, points)]);
                panels.push(Panel { is_logarithmic: LOGARITHMIC.contains(&&*column.name), ..panel });
            }
        }
    }
    for panel in panels.iter_mut().filter(|panel| panel.title == "Energy") {
        let sum = |row: usize| panel.curves.iter().map(|(_, points)| points[row].1).sum();
        let sums = times.iter().enumerate().map(|(row, time)| (*time, sum(row))).collect();
        panel.curves.push(("sum".into(), sums));
    }
    panels.retain(Panel::changes);
    // A component that is 0 all the time is left out.
    panels.iter_mut().for_each(|panel| panel.curves.retain(|(_, points)| points.iter().any(|p| p.1 != 0.0)));
    panels.extend(over_ways(history));
    panels
}

/// Title of the chart of a column, and its name there.
fn place(column: &str) -> (String, String) {
    for (title, members) in TOGETHER {
        if let Some((_, name)) = members.iter().find(|(known, _)| *known == column) {
            return (title.to_owned(), (*name).to_owned());
        }
    }
    let ending = COMPONENTS.into_iter().find(|ending| column.ends_with(ending)).unwrap_or_default();
    let whole = column.strip_suffix(ending).unwrap_or(column);
    let mut name = ending.trim_start_matches('_').to_owned();
    let mut stem = whole.to_owned();
    for side in ["least", "greatest"] {
        if let Some(of) = whole.strip_prefix(&format!("{side}_")).filter(|_| !ending.is_empty()) {
            (stem, name) = (format!("extent_{of}"), format!("{side} {name}"));
        }
    }
    if name.is_empty() {
        name = stem.replace('_', " ");
    }
    for (start, words) in STEMS {
        if stem == start {
            let words = words.trim_end_matches(" of").to_owned();
            return (words, name);
        }
        if let Some(of) = stem.strip_prefix(&format!("{start}_")) {
            return (format!("{words} {of}"), name);
        }
    }
    let mut words = stem.replace('_', " ");
    if let Some(first) = words.get_mut(..1) {
        first.make_ascii_uppercase();
    }
    (words, name)
}

/// Forces on colliders that move, over their displacement along the axis of the largest.
fn over_ways(history: &History) -> Vec<Panel> {
    let named = |what: &str, name: &str, axis: &str| history.column(&format!("{what}_{name}{axis}"));
    let axes = ["_x", "_y", "_z"];
    let mut names: Vec<&str> = Vec::new();
    for column in &history.columns {
        let name = column
            .name
            .strip_prefix("position_")
            .and_then(|rest| rest.rsplit_once('_'))
            .map(|(name, _)| name);
        names.extend(name.filter(|name| !names.contains(name)));
    }
    let range = |column: &&Column| {
        let values = || column.values.iter().copied().filter(|x| x.is_finite());
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    names
        .into_iter()
        .filter_map(|name| {
            let ways = axes.iter().filter_map(|axis| Some((*axis, named("position", name, axis)?)));
            let (axis, way) = ways.max_by(|a, b| range(&a.1).total_cmp(&range(&b.1)))?;
            let first = *way.values.first()?;
            let force = named("force", name, axis)?;
            // The first row has no force: it is a mean since the row before.
            let points: Vec<_> =
                way.values.iter().zip(&force.values).skip(1).map(|(x, f)| (x - first, *f)).collect();
            let direction = axis.trim_start_matches('_');
            let panel = Panel::new(
                &format!("Force on {name} along {direction} over its displacement"),
                &force.unit,
                vec![(direction.into(), points)],
            );
            let panel =
                Panel { across: (format!("displacement along {direction}"), way.unit.clone()), ..panel };
            (range(&way) > 0.0 && panel.changes()).then_some(panel)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_find_their_charts() {
        let cases = [
            ("kinetic_energy", "Energy", "kinetic"),
            ("kinetic_energy_block", "Kinetic energy of block", "kinetic energy block"),
            ("momentum_x", "Momentum", "x"),
            ("angular_momentum_z", "Angular momentum", "z"),
            ("force_plate_y", "Force on plate", "y"),
            ("force_x_min_y", "Force on x_min", "y"),
            ("least_sand_x", "Extent of sand", "least x"),
            ("greatest_sand_x", "Extent of sand", "greatest x"),
            ("stress_core_xy", "Mean stress of core", "xy"),
            ("contact_work_joint", "Work of contact joint", "contact work joint"),
            ("particles", "Particles", "particles"),
        ];
        for (column, title, name) in cases {
            assert_eq!(place(column), (title.to_owned(), name.to_owned()), "{column}");
        }
    }

    #[test]
    fn what_does_not_change_has_no_chart_and_forces_are_drawn_over_the_way() {
        let column = |name: &str, unit: &str, values: [f64; 3]| Column {
            name: name.into(),
            unit: unit.into(),
            values: values.into(),
        };
        let history = History {
            steps: vec![0, 1, 2],
            columns: vec![
                column("time", "s", [0.0, 1.0, 2.0]),
                column("kinetic_energy", "J", [0.0, 1.0, 2.0]),
                column("gravitational_energy", "J", [100.0, 99.5, 99.0]),
                column("mass", "kg", [5.0, 5.0, 5.0]),
                column("force_punch_y", "N", [0.0, 3.0, 4.0]),
                column("position_punch_x", "m", [1.0, 1.0, 1.0]),
                column("position_punch_y", "m", [2.0, 1.5, 1.0]),
            ],
        };
        let panels = panels(&history);
        let titles: Vec<&str> = panels.iter().map(|panel| &*panel.title).collect();
        assert_eq!(
            titles,
            ["Energy", "Force on punch", "Position of punch", "Force on punch along y over its displacement"]
        );
        assert_eq!(panels[0].curves[2], ("sum".into(), vec![(0.0, 0.0), (1.0, 0.5), (2.0, 1.0)]));
        assert_eq!(panels[3].curves[0].1, [(-0.5, 3.0), (-1.0, 4.0)]);
    }
}
