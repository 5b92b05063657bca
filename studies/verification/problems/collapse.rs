//! Problem 6: granular columns collapse, in a plane and round an axis.
use agimp::exact_sum::ExactSum;

use crate::page::Page;
use crate::plot::{Chart, Series};
use crate::runs::{Results, Runs};

const GRAVITY: f64 = 9.81;
/// Share of the mass within the run-out.
const FRONT_SHARE: f64 = 0.98;
/// Height over radius of the highest of the low columns, whose run-out is proportional to it.
const LOW: f64 = 1.5;
/// Cells of half the size where the sand shears: "AMR to R/32 at the front" of the problem set.
const FRONT: &str = "adaptivity={ every_steps = 20, \
     criteria = [{ kind = \"plastic_strain_rate\", level = 3, refine = 2, coarsen = 0.5 }] }";

/// Heads of a table of deposits.
const HEADS: [&str; 7] = [
    "column",
    "cells over radius",
    "height over radius a",
    "run-out over radius (law)",
    "height over radius (law)",
    "98 % of the way after, sqrt(h/g) (rests at)",
    "processor time, s",
];

/// The laws that a deposit follows.
#[derive(Clone, Copy, PartialEq)]
enum Shape {
    Planar,
    Axisymmetric,
}

/// A kind of columns.
pub(crate) struct Columns {
    name: &'static str,
    job: &'static str,
    shape: Shape,
    /// 3 for a quarter of a cylinder in space.
    dimension: usize,
    /// Half width or radius, m.
    radius: f64,
    /// Level of a cell of a sixteenth of the radius.
    level: u32,
    aspects: &'static [f64],
    /// Halvings of the cells for columns up to 1.5: less of these slides.
    low: i32,
    /// Whether columns up to 1.5 have cells of half the size where they shear.
    front: bool,
    /// Time after which the material rests over `sqrt(height / g)`.
    rest: f64,
}

pub(crate) const PLANAR: Columns = Columns {
    name: "planar",
    job: "verification/collapse_planar",
    shape: Shape::Planar,
    dimension: 2,
    radius: 0.0195,
    level: 2,
    aspects: &[0.5, 1.0, 1.5, 4.0, 6.0, 8.0],
    low: 1,
    front: false,
    rest: 3.3,
};

const SPACE: Columns = Columns {
    name: "axisymmetric",
    job: "verification/collapse_axisymmetric",
    shape: Shape::Axisymmetric,
    dimension: 3,
    radius: 0.1,
    level: 2,
    aspects: &[0.55, 0.9, 1.25, 2.75, 4.0],
    low: 0,
    front: true,
    rest: 3.0,
};

/// Bodies of revolution; only low ones.
const RINGS: Columns = Columns {
    name: "as rings",
    job: "verification/collapse_rings",
    dimension: 2,
    aspects: &[0.55, 0.9, 1.25],
    ..SPACE
};

/// A deposit; lengths over the radius, time over `sqrt(height / g)`.
pub(crate) struct Deposit {
    /// Run-out beyond the first edge.
    pub runout: f64,
    height: f64,
    /// When the front had come 98 % of its way.
    rest: f64,
    /// Mass at the end less that at the start, over it.
    mass: f64,
    /// Processor time, s.
    pub processor: f64,
}

impl Columns {
    /// Run-out of the law beyond the first edge, and height on the axis, both over the radius (Lube et al. 2004, 2005; height of cylinders
    /// between by Lajeunesse et al. 2004).
    pub(crate) fn law(&self, aspect: f64) -> [f64; 2] {
        match self.shape {
            Shape::Planar => {
                let runout = if aspect < 1.8 { 1.2 * aspect } else { 1.9 * aspect.powf(2.0 / 3.0) };
                [runout, if aspect < 1.15 { aspect } else { aspect.powf(0.4) }]
            }
            Shape::Axisymmetric => {
                let runout = if aspect < 1.7 { 1.24 * aspect } else { 1.6 * aspect.sqrt() };
                let tall = if aspect < 1.7 { 0.74 } else { 0.88 * aspect.powf(1.0 / 6.0) };
                [runout, if aspect < 0.74 { aspect } else { tall }]
            }
        }
    }

    /// Halvings of cells of a sixteenth of the radius.
    fn halvings(&self, aspect: f64) -> i32 {
        if aspect <= LOW { self.low } else { 0 }
    }

    /// Settings for a column of this height over radius.
    fn settings(&self, aspect: f64) -> Vec<String> {
        if self.front && aspect <= LOW { vec![FRONT.to_owned()] } else { vec![] }
    }

    /// Runs a column with cells of `radius / 16 * 2^-finer`.
    pub(crate) fn collapse(&self, runs: &Runs, aspect: f64, finer: i32, more: &[String]) -> Deposit {
        self.collapse_as(runs, aspect, finer, more, &more.len().to_string())
    }

    /// As [`Columns::collapse`], with results named by a title.
    fn collapse_as(&self, runs: &Runs, aspect: f64, finer: i32, more: &[String], title: &str) -> Deposit {
        let (radius, height) = (self.radius, aspect * self.radius);
        let duration = (height / GRAVITY).sqrt();
        let wide = radius * (2.0 + 1.6 * self.law(aspect)[0]).ceil();
        let high = radius * (aspect + 0.4).ceil();
        let level = self.level as i32 + finer;
        let mut settings = vec![
            format!("tree.base_level={level}"),
            format!("time.end={}", 6.0 * duration),
            format!("output.every={}", 0.1 * duration),
        ];
        settings.extend(match self.dimension {
            2 => vec![
                format!("domain.size=[{wide}, {high}]"),
                format!("bodies[0].shape.max=[{radius}, {height}]"),
            ],
            _ => vec![
                format!("domain.size=[{wide}, {wide}, {high}]"),
                format!("bodies[0].shape.parts[0].height={height}"),
                format!("bodies[0].shape.parts[1].max=[{radius}, {radius}, {height}]"),
            ],
        });
        settings.extend_from_slice(more);
        let name = format!("collapse_{}_{aspect}_{finer}_{title}", self.name.replace(' ', "_"));
        let results = runs.run(self.job, &name, &settings);
        let cell = radius / 16.0 * f64::from(-finer).exp2();
        let last = results.outputs() - 1;
        let runouts: Vec<f64> =
            (0..=last).map(|number| self.front(&results, number, cell) - radius).collect();
        let arrived = runouts.iter().position(|runout| *runout >= 0.98 * runouts[last]).unwrap_or(last);
        let near = results.particles(last, "position", self.dimension).into_iter();
        let halves = results.particles(last, "half_width", 1);
        let near = near.zip(halves).filter(|(x, _)| self.distance(x) < 2.0 * cell);
        let top = near.map(|(x, half)| x[self.dimension - 1] + half[0]).fold(0.0, f64::max);
        let mass = |number| {
            let mut sum = ExactSum::new();
            results.particles(number, "mass", 1).iter().for_each(|m| sum.add(m[0]));
            sum.to_f64()
        };
        Deposit {
            runout: runouts[last] / radius,
            height: top / radius,
            rest: results.time(arrived) / duration,
            mass: (mass(last) - mass(0)).abs() / mass(0),
            processor: results.processor,
        }
    }

    fn distance(&self, x: &[f64]) -> f64 {
        x[..self.dimension - 1].iter().map(|x| x * x).sum::<f64>().sqrt()
    }

    /// Distance within which 98 % of the connected mass lies, m: grains behind a gap of a cell do not count.
    fn front(&self, results: &Results, number: usize, cell: f64) -> f64 {
        let places = results.particles(number, "position", self.dimension);
        let masses = results.particles(number, "mass", 1);
        let mut grains: Vec<(f64, f64)> =
            places.iter().zip(&masses).map(|(x, mass)| (self.distance(x), mass[0])).collect();
        grains.sort_by(|a, b| a.0.total_cmp(&b.0));
        let gap = grains.windows(2).position(|pair| pair[1].0 - pair[0].0 > cell);
        grains.truncate(gap.map_or(grains.len(), |gap| gap + 1));
        let total: f64 = grains.iter().map(|(_, mass)| mass).sum();
        let mut inside = 0.0;
        let front = grains.iter().find(|(_, mass)| {
            inside += mass;
            inside >= FRONT_SHARE * total
        });
        front.map_or(0.0, |(distance, _)| *distance)
    }

    /// A row of the table of deposits.
    fn row(&self, halvings: i32, front: bool, aspect: f64, deposit: &Deposit) -> Vec<String> {
        let [runout, height] = self.law(aspect);
        let cells = |halvings: i32| format!("1/{}", 1 << (4 + halvings));
        vec![
            self.name.to_owned(),
            if front {
                format!("{}, {} where it shears", cells(halvings), cells(halvings + 1))
            } else {
                cells(halvings)
            },
            format!("{aspect}"),
            format!("{:.3} ({runout:.3})", deposit.runout),
            format!("{:.3} ({height:.3})", deposit.height),
            format!("{:.2} ({})", deposit.rest, self.rest),
            format!("{:.0}", deposit.processor),
        ]
    }

    fn section(&self, runs: &Runs, page: &mut Page, tall_from: f64) {
        let mut rows = Vec::new();
        let (mut late, mut lost): (f64, f64) = (0.0, 0.0);
        let mut found: Vec<[f64; 2]> = Vec::new();
        for &aspect in self.aspects {
            let (halvings, settings) = (self.halvings(aspect), self.settings(aspect));
            let deposit = self.collapse(runs, aspect, halvings, &settings);
            let [runout, height] = self.law(aspect);
            let (name, ratio) = (self.name, deposit.runout / runout);
            page.line(&format!("collapse.{name}.runout.{aspect}"), ratio);
            page.line(&format!("collapse.{name}.height.{aspect}"), deposit.height / height);
            let time = deposit.rest / self.rest;
            late = if (time - 1.0).abs() > (late - 1.0).abs() || late == 0.0 { time } else { late };
            lost = lost.max(deposit.mass);
            found.push([aspect, deposit.runout]);
            rows.push(self.row(halvings, !settings.is_empty(), aspect, &deposit));
        }
        page.line(&format!("collapse.{}.time", self.name), late);
        page.line(&format!("collapse.{}.mass", self.name), lost);
        let slope = |points: Vec<&[f64; 2]>| {
            let logs = points.iter().map(|point| point.map(f64::ln));
            let count = points.len() as f64;
            let mean =
                logs.clone().fold([0.0; 2], |sum, log| [sum[0] + log[0] / count, sum[1] + log[1] / count]);
            let (up, across) = logs.fold((0.0, 0.0), |(up, across), log| {
                let x = log[0] - mean[0];
                (up + x * (log[1] - mean[1]), across + x * x)
            });
            up / across
        };
        page.line(
            &format!("collapse.{}.slope.low", self.name),
            slope(found.iter().filter(|p| p[0] <= LOW).collect()),
        );
        page.line(
            &format!("collapse.{}.slope.tall", self.name),
            slope(found.iter().filter(|p| p[0] >= tall_from).collect()),
        );
        for aspect in [1.0, 4.0, 1.25].into_iter().filter(|aspect| self.aspects.contains(aspect)) {
            if self.dimension == 3 && aspect == 4.0 {
                continue;
            }
            // In space without the cells of half the size: all of half the size would take hours.
            let halvings = self.halvings(aspect) + i32::from(self.dimension == 2);
            let other = self.collapse(runs, aspect, halvings, &[]);
            let change = other.runout / runout_of(&found, aspect) - 1.0;
            page.line(&format!("collapse.{}.cells.{aspect}", self.name), change.abs());
            rows.push(self.row(halvings, false, aspect, &other));
        }
        if self.dimension == 3 {
            rows.extend(rings(runs, page, &found));
        }
        rows.iter().for_each(|row| println!("    {}", row.join("  ")));
        page.table(&HEADS, &rows);
        let law = (0..40).map(|i| 0.5 * 1.08_f64.powi(i)).filter(|aspect| *aspect < 9.0);
        let title = format!("Run-out over the radius, {}", self.name);
        page.plot(
            &format!("collapse_{}", self.name),
            &Chart {
                title: &title,
                labels: ["height over radius", ""],
                logarithmic: [true, true],
                series: vec![
                    Series {
                        name: "law".into(),
                        points: law.map(|a| [a, self.law(a)[0]]).collect(),
                        marks: false,
                    },
                    Series { name: "ours".into(), points: found, marks: true },
                ],
            },
        );
    }
}

/// The run-out of the column of this height over radius.
fn runout_of(found: &[[f64; 2]], aspect: f64) -> f64 {
    found.iter().find(|point| point[0] == aspect).map_or(f64::NAN, |point| point[1])
}

/// Low columns as bodies of revolution, which have cells of half the size in seconds; `space` has height over
/// radius and run-out of those in space.
fn rings(runs: &Runs, page: &mut Page, space: &[[f64; 2]]) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    let (mut off, mut change): (f64, f64) = (0.0, 0.0);
    for &aspect in RINGS.aspects {
        let same = RINGS.collapse(runs, aspect, 0, &RINGS.settings(aspect));
        off = off.max((runout_of(space, aspect) / same.runout - 1.0).abs());
        rows.push(RINGS.row(0, true, aspect, &same));
        let [coarse, fine] = [0, 1].map(|finer| RINGS.collapse(runs, aspect, finer, &[]));
        change = change.max((fine.runout / coarse.runout - 1.0).abs());
        rows.extend(
            [(0, coarse), (1, fine)].map(|(finer, deposit)| RINGS.row(finer, false, aspect, &deposit)),
        );
    }
    page.line("collapse.rings.space", off);
    page.line("collapse.rings.cells", change);
    rows
}

/// Run-outs with both transfers in sand of several stiffnesses, which differ in the number of steps.
fn transfers(runs: &Runs, page: &mut Page) {
    page.text(
        "The planar column of a = 1 on cells of a sixteenth with other stiffness E and with both transfers. Stiffer sand takes more steps. \
         APIC takes energy from shear in each of them, more the fewer cells slide; FLIP takes less.\n",
    );
    let transfers = [("apic", "{ transfer = \"apic\" }"), ("flip", "{ transfer = \"flip\", flip = 1 }")];
    let rows = ["1e5", "1e6", "1e7"].map(|young| {
        let runouts = transfers.map(|(name, transfer)| {
            let settings = [format!("materials[0].young={young}"), format!("numerics={transfer}")];
            let deposit = PLANAR.collapse_as(runs, 1.0, 0, &settings, &format!("{name}_{young}"));
            format!("{:.3}", deposit.runout)
        });
        [vec![young.to_owned()], runouts.to_vec()].concat()
    });
    rows.iter().for_each(|row| println!("    {}", row.join("  ")));
    page.table(&["E, Pa", "run-out over radius, APIC", "FLIP"], &rows);
}

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    if !runs.is_full() {
        return;
    }
    page.text(
        "## 6 Granular columns\n\n\
         Columns of dry sand (Drucker-Prager, 29.5 degrees matched in the plane, no dilation, floor with tan 29.5 degrees) collapse: [planar](../jobs/verification/collapse_planar.toml) (half width 19.5 mm) and \
         [axisymmetric](../jobs/verification/collapse_axisymmetric.toml) (a quarter in space, radius 100 mm; low ones [as bodies of revolution](../jobs/verification/collapse_rings.toml) as well), on cells of a sixteenth of these, \
         low planar ones of a 32nd, low cylinders of a 32nd where they shear (criterion `plastic_strain_rate`, 2/s), with FLIP. Run-out beyond the first edge: 98 % of the connected mass lies within. Laws of measurements: Lube et al. (2004, 2005), heights of low cylinders \
         Lajeunesse et al. (2004). E = 1 MPa, a tenth of that of Fern and Soga (2016), for longer steps. The planar experiments had side walls, which slow the sand. Exercises plasticity with an apex, friction at the floor, large flow and long times.\n",
    );
    PLANAR.section(runs, page, 4.0);
    transfers(runs, page);
    SPACE.section(runs, page, 2.0);
}
