//! The built-in jobs, as job files.
//!
//! All have bodies of eight particles per cell (in 2D also four, as is usual there), in motion and deforming
//! from the first step, in a domain that is slightly larger. Sizes follow from the number of particles.

/// A built-in job.
#[derive(Clone, Copy, Debug)]
pub struct BenchJob {
    /// Name on the command line.
    pub name: &'static str,
    /// Description, for the table of results.
    pub title: &'static str,
    /// Steps before the measurement, until the state is a typical one.
    pub warm_up: u64,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Block(&'static str),
    Column { adaptive: bool },
    Sheet { per_cell: f64 },
}

const NEO_HOOKEAN: &str = r#"model = "neo_hookean""#;
// A negligible yield stress, so that all of the material flows all the time.
const VON_MISES: &str = "model = \"von_mises\"\nyield_stress = 1e-2\nhardening = 1.0";
const SAND: &str = "model = \"drucker_prager\"\nfriction_angle = 29.5\nmatch = \"plane_strain\"";

/// All built-in jobs.
pub const JOBS: [BenchJob; 6] = [
    BenchJob {
        name: "neo_hookean",
        title: "spinning neo-Hookean block, 3D, uniform tree",
        warm_up: 40,
        kind: Kind::Block(NEO_HOOKEAN),
    },
    BenchJob {
        name: "von_mises",
        title: "spinning von Mises block, 3D, uniform tree",
        warm_up: 40,
        kind: Kind::Block(VON_MISES),
    },
    BenchJob {
        name: "column",
        title: "Drucker-Prager column, flowing, 3D, three levels",
        warm_up: 100,
        kind: Kind::Column { adaptive: true },
    },
    BenchJob {
        name: "column_uniform",
        title: "Drucker-Prager column, flowing, 3D, uniform tree",
        warm_up: 100,
        kind: Kind::Column { adaptive: false },
    },
    BenchJob {
        name: "sheet",
        title: "spinning neo-Hookean sheet, 2D plane strain, uniform tree, four particles per cell",
        warm_up: 40,
        kind: Kind::Sheet { per_cell: 4.0 },
    },
    BenchJob {
        name: "sheet_8",
        title: "spinning neo-Hookean sheet, 2D plane strain, uniform tree, eight particles per cell",
        warm_up: 40,
        kind: Kind::Sheet { per_cell: 8.0 },
    },
];

impl BenchJob {
    /// 2 or 3.
    pub fn dimension(&self) -> usize {
        if matches!(self.kind, Kind::Sheet { .. }) { 2 } else { 3 }
    }

    /// Whether the material flows.
    pub fn is_plastic(&self) -> bool {
        !matches!(self.kind, Kind::Sheet { .. } | Kind::Block(NEO_HOOKEAN))
    }

    /// The job file for about `particles` particles, with a record of telemetry every `steps` steps and a row
    /// of the history every 50.
    pub fn text(&self, particles: u64, steps: u64, directory: &str) -> String {
        let body = match self.kind {
            Kind::Block(model) => block(particles as f64, model),
            Kind::Column { adaptive } => column(particles as f64, adaptive),
            Kind::Sheet { per_cell } => sheet(particles as f64, per_cell),
        };
        format!(
            "version = 1\ntitle = \"{}\"\n{body}\n[time]\nend = 1e3\n[output]\ndirectory = {directory:?}\n\
             [history]\nevery_steps = 50\n[telemetry]\nevery_steps = {steps}\n",
            self.title
        )
    }
}

/// Cells of 20 mm, four to a leaf's edge; edges of bodies are whole spacings of 10 mm.
const SPACING: f64 = 0.01;
const ROOT: f64 = 0.32;
/// Room around a spinning body, m.
const MARGIN: f64 = 0.16;

fn block(particles: f64, model: &str) -> String {
    let edge = particles.cbrt().round() * SPACING;
    let domain = ((edge + 2.0 * MARGIN) / ROOT).ceil() * ROOT;
    let end = MARGIN + edge;
    // Surfaces move at one to two metres a second, whatever the size.
    let spin = 1.0 / edge;
    format!(
        "dimension = 3\n[domain]\nsize = [{domain}, {domain}, {domain}]\nroot_edge = {ROOT}\n\
         [tree]\nbase_level = 2\n[[materials]]\nname = \"solid\"\ndensity = 1000\nyoung = 1e6\npoisson = 0.3\n{model}\n\
         [[bodies]]\nname = \"block\"\nmaterial = \"solid\"\nvelocity = [0.5, 0.3, 0.2]\n\
         angular_velocity = [{}, {}, {spin}]\n\
         shape = {{ kind = \"box\", min = [{MARGIN}, {MARGIN}, {MARGIN}], max = [{end}, {end}, {end}] }}\n",
        0.3 * spin,
        0.6 * spin
    )
}

fn sheet(particles: f64, per_cell: f64) -> String {
    let along_axis = per_cell.sqrt();
    let edge = particles.sqrt().round() * (2.0 * SPACING / along_axis);
    let domain = ((edge + 2.0 * MARGIN) / ROOT).ceil() * ROOT;
    let end = MARGIN + edge;
    format!(
        "dimension = 2\n[domain]\nsize = [{domain}, {domain}]\nroot_edge = {ROOT}\n\
         [tree]\nbase_level = 2\n[[materials]]\nname = \"solid\"\ndensity = 1000\nyoung = 1e6\npoisson = 0.3\n{NEO_HOOKEAN}\n\
         [[bodies]]\nname = \"sheet\"\nmaterial = \"solid\"\nvelocity = [0.5, 0.3]\nangular_velocity = {}\n\
         particles_per_cell = {along_axis}\n\
         shape = {{ kind = \"box\", min = [{MARGIN}, {MARGIN}], max = [{end}, {end}] }}\n",
        1.0 / edge
    )
}

/// A square column that slides over a rough floor and falls apart. With `adaptive`, cells of 40 mm in its
/// core, 20 mm around it and 10 mm in its mantle; cells of 20 mm everywhere without.
fn column(particles: f64, adaptive: bool) -> String {
    // Height over width; share of the width that the middle and the core take.
    let (slender, middle, core) = (0.9, 0.85, 0.6);
    // Particles per volume in cells of 20 mm are 1 / SPACING³; eight times more or less by level.
    let share = |inner: f64| inner * inner * (slender - 0.5 * (1.0 - inner));
    let density = if adaptive {
        8.0 * (slender - share(middle)) + (share(middle) - share(core)) + share(core) / 8.0
    } else {
        slender
    };
    // Leaves that cross a border belong to the finer side; half a leaf's edge goes there.
    let crossing = if adaptive { 0.88 } else { 1.0 };
    let width = (particles / density).cbrt() * SPACING * crossing;
    let height = slender * width;
    let room = 0.3;
    let domain = ((width + 2.0 * room) / ROOT).ceil() * ROOT;
    let top = ((height + 0.1) / ROOT).ceil() * ROOT;
    let (low, high) = (0.5 * (domain - width), 0.5 * (domain + width));
    let region = |level: u8, inner: f64| {
        // The room that the sand runs into in the course of a measurement is fine as well, all else is
        // coarse.
        let (first, last) = (low - 0.03, high + 0.03);
        let (low, high) = (0.5 * (domain - inner * width), 0.5 * (domain + inner * width));
        let inner_height = height - 0.5 * (1.0 - inner) * width;
        format!(
            "[[tree.regions]]\nlevel = {level}\n[tree.regions.shape]\nkind = \"difference\"\n\
             from = {{ kind = \"box\", min = [{first}, {first}, 0], max = [{last}, {last}, {height}] }}\n\
             remove = [{{ kind = \"box\", min = [{low}, {low}, -1], max = [{high}, {high}, {inner_height}] }}]\n"
        )
    };
    let tree = if adaptive {
        format!("[tree]\nbase_level = 1\n{}{}", region(2, core), region(3, middle))
    } else {
        "[tree]\nbase_level = 2\n".to_owned()
    };
    format!(
        "dimension = 3\ngravity = [0, 0, -9.81]\n\
         [domain]\nsize = [{domain}, {domain}, {top}]\nroot_edge = {ROOT}\n\
         [boundaries]\nz_min = {{ kind = \"separating\", friction = 0.57 }}\n{tree}\
         [[materials]]\nname = \"sand\"\ndensity = 1600\nyoung = 3e5\npoisson = 0.2\n{SAND}\n\
         [[bodies]]\nname = \"column\"\nmaterial = \"sand\"\nvelocity = [0.5, 0.2, -0.5]\n\
         shape = {{ kind = \"box\", min = [{low}, {low}, 0], max = [{high}, {high}, {height}] }}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{AnyProblem, parse};
    use crate::setup::estimate::estimate;

    #[test]
    fn jobs_are_valid_and_of_the_size_asked_for() {
        for job in JOBS {
            let text = job.text(40_000, 5, "out");
            let problem = parse(&text, std::path::Path::new("job.toml"));
            let estimate = match problem.unwrap_or_else(|faults| panic!("{}: {faults:?}\n{text}", job.name)) {
                AnyProblem::Two(problem) => estimate(&problem),
                AnyProblem::Three(problem) => estimate(&problem),
            };
            let particles = estimate.unwrap().total_particles();
            assert!((15_000..90_000).contains(&particles), "{}: {particles}", job.name);
        }
    }
}
