//! Accuracy against cost: errors over processor time, with uniform cells and with fine cells where they matter.
use super::collapse::PLANAR;
use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::Runs;

/// Runs of a scene: cells, error, processor time (s).
pub(super) struct Scene {
    pub id: &'static str,
    pub name: &'static str,
    pub uniform: Vec<(String, f64, f64)>,
    pub refined: Vec<(String, f64, f64)>,
    /// Why it gains what it gains.
    pub bound: &'static str,
}

impl Scene {
    /// Greatest ratio of processor times at equal error, that of uniform cells between two runs by powers; at errors below those of all uniform runs the
    /// time of the best of them, which is a lower bound. Whether it is one.
    fn gain(&self) -> (f64, bool) {
        let gains = self.refined.iter().filter_map(|(_, error, time)| {
            let best = self.uniform.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
            if *error <= best.1 {
                return Some((best.2 / time, true));
            }
            let pair = self.uniform.windows(2).find(|pair| pair[0].1 >= *error && pair[1].1 <= *error)?;
            let share = (error / pair[0].1).ln() / (pair[1].1 / pair[0].1).ln();
            Some((pair[0].2 * (pair[1].2 / pair[0].2).powf(share) / time, false))
        });
        gains.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NAN, false))
    }
}

fn settings(all: &[&str]) -> Vec<String> {
    all.iter().map(|setting| (*setting).to_owned()).collect()
}

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    if !runs.is_full() {
        return;
    }
    page.text(
        "## Accuracy against cost\n\n\
         Each scene with uniform cells of several sizes, and with fine cells where they matter; one thread, processor time of the whole run with its files. The gain is the ratio of times at equal error, the time of uniform cells interpolated between two runs by powers. Where the refined run is \
         better than all uniform ones, the gain is at least the number given (≥). Times move by some tenths with what else the machine does.\n",
    );
    let scenes = [
        CAVITY.scene(runs),
        SPHERE.scene(runs),
        pulse(runs),
        footing(runs),
        taylor(runs),
        collapse(runs),
        manufactured(runs),
    ];
    let gains = table(page, &scenes);
    let at_least = |bound: f64| gains.iter().filter(|gain| **gain >= bound).count() as f64;
    page.line("cost.ten", at_least(10.0));
    page.line("cost.five", at_least(5.0));
    for scene in &scenes {
        scene.curves(page);
    }
}

/// Writes the gains of scenes.
pub(super) fn table(page: &mut Page, scenes: &[Scene]) -> Vec<f64> {
    let mut gains = Vec::new();
    let mut rows = Vec::new();
    for scene in scenes {
        let (gain, is_bound) = scene.gain();
        page.line(&format!("cost.{}", scene.id), gain);
        gains.push(gain);
        let sign = if is_bound { "≥ " } else { "" };
        rows.push(vec![scene.name.to_owned(), format!("{sign}{gain:.1}"), scene.bound.to_owned()]);
    }
    page.table(&["scene", "gain at equal error", "what bounds it"], &rows);
    gains
}

impl Scene {
    /// Writes errors and times of its runs.
    pub(super) fn curves(&self, page: &mut Page) {
        let rows: Vec<Vec<String>> = [("uniform", &self.uniform), ("refined", &self.refined)]
            .into_iter()
            .flat_map(|(tree, points)| {
                points.iter().map(move |(cells, error, time)| {
                    vec![tree.to_owned(), cells.clone(), format!("{error:.2e}"), format!("{time:.1}")]
                })
            })
            .collect();
        page.text(&format!("*{}*\n", self.name));
        rows.iter().for_each(|row| println!("    {} {}", self.id, row.join("  ")));
        page.table(&["tree", "finest cells", "error", "processor time, s"], &rows);
        let curve =
            |points: &[(String, f64, f64)]| points.iter().map(|(_, error, time)| [*time, *error]).collect();
        page.plot(
            &format!("cost_{}", self.id),
            &Chart {
                title: self.name,
                labels: ["processor time, s", "error"],
                logarithmic: [true, true],
                series: vec![
                    Series { name: "uniform".into(), points: curve(&self.uniform), marks: false },
                    Series { name: "refined".into(), points: curve(&self.refined), marks: false },
                ],
            },
        );
    }
}

/// A cavity of 1 m radius in wide elastic ground (10 MPa, 0.3), of which an axis or three of symmetry leave a part.
struct Cavity {
    id: &'static str,
    name: &'static str,
    job: &'static str,
    shape: &'static str,
    centre: &'static str,
    /// Displacement of its wall under 7.5 kPa, m.
    exact: f64,
    /// Levels of uniform and of refined trees.
    levels: [std::ops::RangeInclusive<u32>; 2],
    bound: &'static str,
}

/// Lamé: `(1 + ν) a p / E ((1 - 2 ν) a² + b²) / (b² - a²)` with b = 16 a.
const CAVITY: Cavity = Cavity {
    id: "cavity",
    name: "14 cavity in wide ground: displacement of its wall",
    job: "cavity",
    shape: "circle",
    centre: "[0, 0]",
    exact: 1.3 * 7.5e3 / 1e7 * (0.4 + 256.0) / 255.0,
    levels: [2..=4, 3..=5],
    bound: "nothing but the coarse ground: strains fall as the square of the distance",
};

/// Lamé: `a p / E ((1 - 2 ν) a³ + (1 + ν) b³ / 2) / (b³ - a³)` with b = 8 a.
const SPHERE: Cavity = Cavity {
    id: "sphere",
    name: "14 spherical cavity in wide ground: displacement of its wall",
    job: "cavity_sphere",
    shape: "sphere",
    centre: "[0, 0, 0]",
    exact: 7.5e3 / 1e7 * (0.4 + 1.3 * 256.0) / 511.0,
    levels: [1..=3, 2..=4],
    bound: "nothing but the coarse ground: strains fall as the cube of the distance",
};

impl Cavity {
    fn scene(&self, runs: &Runs) -> Scene {
        let [uniform, refined] = &self.levels;
        Scene {
            id: self.id,
            name: self.name,
            uniform: uniform.clone().map(|level| self.run(runs, level, false)).collect(),
            refined: refined.clone().map(|level| self.run(runs, level, true)).collect(),
            bound: self.bound,
        }
    }

    /// Finest cells, error and processor time of a run.
    fn run(&self, runs: &Runs, level: u32, is_refined: bool) -> (String, f64, f64) {
        let &Self { id, job, shape, centre, exact, .. } = self;
        let region = |at: u32| {
            let radius = 1.5 * f64::from(level - at).exp2().min(4.0) + 0.2;
            format!(
                "{{ level = {at}, shape = {{ kind = \"{shape}\", centre = {centre}, radius = {radius} }} }}"
            )
        };
        let settings = match is_refined {
            true => {
                vec![format!("tree.regions=[{}]", (1..=level).map(region).collect::<Vec<_>>().join(", "))]
            }
            false => vec!["tree.regions=[]".into(), format!("tree.base_level={level}")],
        };
        let results =
            runs.run(&format!("verification/{job}"), &format!("{id}_{level}_{is_refined}"), &settings);
        let rows = results.history(["time", "work_inside"]);
        // A quarter of a circle's rim is as long as an eighth of a sphere is large, m and m².
        let moved = rows[rows.len() - 1][1] / (7.5e3 * std::f64::consts::FRAC_PI_2);
        let cells = format!("1/{} of the radius", 1_u32 << level);
        (cells, (moved / exact - 1.0).abs(), results.processor)
    }
}

/// A pressure pulse that runs through a bar.
fn pulse(runs: &Runs) -> Scene {
    let run = |level: u32, is_refined: bool| {
        let settings = match is_refined {
            true => vec![format!("adaptivity.criteria[0].level={level}")],
            false => vec![format!("tree.base_level={level}"), "adaptivity.criteria=[]".into()],
        };
        let results = runs.run("verification/packet", &format!("pulse_{level}_{is_refined}"), &settings);
        let last = results.outputs() - 1;
        let time = results.time(last);
        let places = results.particles(last, "position", 2);
        let velocities = results.particles(last, "velocity", 2);
        let masses = results.particles(last, "mass", 1);
        let (mut sum, mut all) = (0.0, 0.0);
        for ((x, v), m) in places.iter().zip(&velocities).zip(&masses) {
            let exact = 1e-6 * (-0.125 * (x[0] - 20.0 - time).powi(2)).exp();
            sum += m[0] * (v[0] - exact).powi(2);
            all += m[0] * exact * exact;
        }
        (format!("{} m", 2.0 / f64::from(1_u32 << level)), (sum / all).sqrt(), results.processor)
    };
    Scene {
        id: "pulse",
        name: "9 pulse in a long bar: root mean square of the velocity's error",
        uniform: (1..=3).map(|level| run(level, false)).collect(),
        refined: (2..=4).map(|level| run(level, true)).collect(),
        bound: "the fine part is a tenth of the bar; splitting and merging at its ends",
    }
}

/// The limit of a footing.
fn footing(runs: &Runs) -> Scene {
    let run = |level: u32, is_refined: bool| {
        let mut settings = settings(&["time.end=1.2", "history.every_steps=20"]);
        settings.extend(match is_refined {
            true => {
                let near = [[1.5, 3.8], [2.4, 3.0]];
                let regions: Vec<String> = (1..=level)
                    .map(|at| {
                        let [wide, deep] = near[usize::from(at < level)];
                        format!("{{ level = {at}, shape = {{ kind = \"box\", min = [0, {deep}], max = [{wide}, 4.9] }} }}")
                    })
                    .collect();
                vec!["tree.base_level=0".into(), format!("tree.regions=[{}]", regions.join(", "))]
            }
            false => vec!["tree.regions=[]".into(), format!("tree.base_level={level}")],
        });
        let results = runs.run("strip_footing", &format!("footing_{level}_{is_refined}"), &settings);
        let rows = results.history(["time", "force_footing_y"]);
        let last = &rows[rows.len() * 9 / 10..];
        let limit = last.iter().map(|row| row[1] / 5e3).sum::<f64>() / last.len() as f64;
        let cells = format!("B/{}", 5 << level);
        (cells, (limit / 5.14159 - 1.0).abs(), results.processor)
    };
    Scene {
        id: "footing",
        name: "14 strip footing on clay: its limit",
        uniform: (0..=2).map(|level| run(level, false)).collect(),
        refined: (1..=2).map(|level| run(level, true)).collect(),
        bound: "what flows: a fan of one and a half widths to the side and a width deep needs the fine cells, a sixteenth of the ground",
    }
}

/// Length of the rod of Taylor's test.
fn taylor(runs: &Runs) -> Scene {
    let run = |level: u32, is_refined: bool| {
        let mut settings = settings(&["probes=[{ name = \"rod\", quantities = [\"extent\"] }]"]);
        settings.extend(match is_refined {
            true => vec![
                format!("tree.base_level={}", level - 2),
                format!("adaptivity.criteria[0].level={level}"),
                format!("adaptivity.criteria[1].level={}", level - 1),
            ],
            false => vec![format!("tree.base_level={level}"), "adaptivity.criteria=[]".into()],
        });
        let results = runs.run("taylor_bar", &format!("taylor_{level}_{is_refined}"), &settings);
        let rows = results.history(["time", "greatest_rod_z"]);
        let length = rows[rows.len() - 1][1] + 32.4e-3 - rows[0][1];
        let cells = format!("R/{}", 2 << level);
        (cells, (length / 21.428e-3 - 1.0).abs(), results.processor)
    };
    Scene {
        id: "taylor",
        name: "7 Taylor rod: its length",
        uniform: (1..=2).map(|level| run(level, false)).collect(),
        refined: (2..=3).map(|level| run(level, true)).collect(),
        bound: "the mushroom: 40 % of the rod flows by more than a half, and the foot spreads to twice the radius within the layer of the finest cells",
    }
}

/// Run-out of a column of sand.
fn collapse(runs: &Runs) -> Scene {
    let reference = PLANAR.collapse(runs, 1.0, 1, &[]);
    let run = |finer: i32, more: &[String]| {
        let deposit = PLANAR.collapse(runs, 1.0, finer, more);
        // Where refined, the finest are half as wide again.
        let finest = 4 + finer + i32::from(!more.is_empty());
        let cells = format!("1/{} of the half width", f64::from(finest).exp2());
        (cells, (deposit.runout / reference.runout - 1.0).abs(), deposit.processor)
    };
    let refined = |finer: i32| {
        let criteria = format!(
            "adaptivity={{ every_steps = 20, criteria = [{{ kind = \"free_surface\", level = {} }}] }}",
            3 + finer
        );
        run(finer, &[format!("tree.base_level={}", 1 + finer), criteria])
    };
    Scene {
        id: "collapse",
        name: "6 column of sand: its run-out, over that with cells of a 32nd",
        uniform: (-2..=0).map(|finer| run(finer, &[])).collect(),
        refined: (-1..=0).map(refined).collect(),
        bound: "nearly all of the sand shears at once, and its deposit is a few cells thick",
    }
}

/// A manufactured solution.
fn manufactured(runs: &Runs) -> Scene {
    let run = |level: u32, is_refined: bool| {
        let (error, processor) = super::manufactured::flip(runs, level, is_refined);
        (format!("{}", 4_u32 << (level + u32::from(is_refined))), error, processor)
    };
    Scene {
        id: "manufactured",
        name: "2 manufactured solution, 2D: greatest error, fine in a disk",
        uniform: (1..=3).map(|level| run(level, false)).collect(),
        refined: (2..=3).map(|level| run(level, true)).collect(),
        bound: "it is smooth everywhere: nothing is local, and fine cells in one place only take steps half as long",
    }
}
