//! Stress of bodies at the start.
//!
//! Stress is that at the centre of a particle's box. Where boxes tile the ground and stress is linear along
//! the vertical, this is its mean over each box, and the sums at the nodes are those of the exact integrals:
//! level ground is at rest to round-off. Stress is effective: water in the pores bears its part of the
//! weight. Where it seeps, its pressure is known when heads have been found, so that stress comes after them.
use std::borrow::Cow;

use partition::Octant;

use super::particles::seed::{SeedError, raster};
use crate::job::problem::{Body, InitialStress, Problem, StressKind};
use crate::load::water::{Given, Head};
use crate::load::{Up, Water};
use crate::material::initial::{NoState, Stressed, under_stress, yielded};
use crate::material::{HISTORIES, Material};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::followed::head;
use crate::quantity::Quantity;

/// Which particles get their stress.
#[derive(Clone, Copy, Debug)]
pub enum Which {
    /// Those whose stress does not depend on heads.
    WithoutHeads,
    /// Those from `first` on whose stress depends on heads, which they carry from this column on.
    WithHeads {
        /// Index of the first.
        first: usize,
        /// First column.
        column: usize,
    },
}

/// Whether the stress of a body depends on heads of water that seeps.
pub fn needs_heads<const D: usize>(problem: &Problem<D>, body: &Body<D>) -> bool {
    let is_weight = |stress: &InitialStress| matches!(stress.kind, StressKind::Weight { .. });
    let seeps = |water: &Water| matches!(water.given, Given::Seepage(_));
    body.stress.as_ref().is_some_and(is_weight) && problem.water_of_stage(body.stage).is_some_and(seeps)
}

/// Not collective. Gives the particles of a leaf the stress of their bodies. Their mass stays, and their
/// volume is the one under stress: the reference volume differs from it by the deformation under the stress.
///
/// # Errors
/// A material cannot have the stress.
pub fn put_under_stress<const D: usize>(
    problem: &Problem<D>,
    materials: &[Box<dyn Material>],
    octant: &Octant<D>,
    chunk: &mut Chunk<D>,
    which: Which,
) -> Result<(), SeedError> {
    let (first, column) = match which {
        Which::WithoutHeads => (0, None),
        Which::WithHeads { first, column } => (first, Some(column)),
    };
    let is_due = |body: &Body<D>| body.stress.is_some() && needs_heads(problem, body) == column.is_some();
    let due: Vec<bool> = problem.bodies.iter().map(is_due).collect();
    if !due.contains(&true) {
        return Ok(());
    }
    let mut columns = Columns::new(0.25 * problem.cell_edge(octant.level));
    for p in first..chunk.len() {
        let Tag { body: index, material, .. } = Tag::unpack(chunk.tags()[p]);
        let body = &problem.bodies[usize::from(index)];
        let Some(initial) = body.stress.as_ref().filter(|_| due[usize::from(index)]) else { continue };
        let x = chunk.position(p);
        let material = &*materials[usize::from(material)];
        let [half] = chunk.read::<1>(Layout::<D>::HALF, p);
        let about = head(chunk, column, p, &problem.origin);
        let section = problem.coordinates.half_width(half, x[0]);
        let stressed = at(problem, body, initial, material, (&x, section), about, &mut columns)
            .map_err(|reason| fault(problem, usize::from(index), initial, &x, reason))?;
        let symmetric = |tensor: &[f64; 6]| tensor[..Layout::<D>::SYMMETRIC].to_vec();
        chunk.write(Layout::<D>::LEFT_CAUCHY_GREEN, p, &symmetric(&stressed.elastic));
        chunk.write(Layout::<D>::STRESS, p, &symmetric(&stressed.stress));
        chunk.write(Layout::<D>::HISTORY, p, &stressed.history[..HISTORIES]);
        let reference = half * libm::pow(stressed.volume_ratio, -1.0 / D as f64);
        chunk.write(Layout::<D>::HALF, p, &[reference]);
    }
    Ok(())
}

/// Not collective. Checks at some points of each body, before any particle is made, that its material can
/// have the stress.
///
/// # Errors
/// The first such point.
pub fn probe<const D: usize>(problem: &Problem<D>, materials: &[Box<dyn Material>]) -> Result<(), SeedError> {
    let interval = 0.25 * problem.cell_edge(problem.finest_level());
    for (index, body) in problem.bodies.iter().enumerate() {
        let Some(initial) = body.stress.as_ref().filter(|_| !needs_heads(problem, body)) else { continue };
        for x in raster(problem, body) {
            let material = &*materials[body.material];
            at(problem, body, initial, material, (&x, 0.0), None, &mut Columns::new(interval))
                .map_err(|reason| fault(problem, index, initial, &x, reason))?;
        }
    }
    Ok(())
}

fn fault<const D: usize>(
    problem: &Problem<D>,
    index: usize,
    initial: &InitialStress,
    x: &[f64; D],
    reason: NoState,
) -> SeedError {
    SeedError::Stress {
        place: format!("{}: bodies[{index}].stress", initial.place),
        body: problem.bodies[index].name.clone(),
        point: problem.place(x)[..D].to_vec(),
        reason,
    }
}

/// State of a particle of a body at a point, with a box of this half width, m; `about` is the head there
/// where water seeps.
fn at<const D: usize>(
    problem: &Problem<D>,
    body: &Body<D>,
    initial: &InitialStress,
    material: &dyn Material,
    (x, half): (&[f64; D], f64),
    about: Option<Head>,
    columns: &mut Columns<D>,
) -> Result<Stressed, NoState> {
    let place = problem.place(x);
    let gravity = problem.gravity_of_stage(body.stage).at(0.0);
    let up = Up::new(&gravity);
    let water = problem.water_of_stage(body.stage).map(|water| water.about(about));
    let pressures = match &initial.kind {
        StressKind::Components(components) => {
            let stress = components.each_ref().map(|component| component.at(place, 0.0));
            return under(material, &stress, initial, D == 2);
        }
        StressKind::Weight { ratio, surface, surcharge } => {
            let surface = surface.as_ref();
            let mut weight = |x: &[f64; D]| weight(problem, body, surface, x, water.as_ref(), columns);
            let faces = [-half, half].map(|way| {
                let mut face = *x;
                face[up.axis] += way;
                face
            });
            let is_below =
                |x: &[f64; D]| water.as_ref().is_some_and(|water| water.is_below(problem.place(x), 0.0));
            // Where the water table passes through a box, the particle has the mean density of both parts,
            // and the stress at its centre is the mean of those at its faces.
            let vertical = match is_below(&faces[0]) == is_below(&faces[1]) {
                true => weight(x),
                false => 0.5 * (weight(&faces[0]) + weight(&faces[1])),
            } + surcharge.at(place, 0.0);
            [vertical, vertical * ratio.at(place, 0.0)]
        }
        StressKind::Depth { rows, surface } => {
            let depth = match surface {
                Some(surface) => (surface.at(place, 0.0) - place[up.axis]) * up.sign,
                None => columns.at(problem, body.stage, up, x).top() - x[up.axis] * up.sign,
            };
            interpolate(rows, depth)
        }
    };
    let mut stress = [-pressures[1], -pressures[1], -pressures[1], 0.0, 0.0, 0.0];
    stress[up.axis] = -pressures[0];
    under(material, &stress, initial, D == 2)
}

/// Weight per area (Pa) of the material above a point of a body, and of free water on its surface, less the
/// pressure of the water in the pores.
fn weight<const D: usize>(
    problem: &Problem<D>,
    body: &Body<D>,
    surface: Option<&Quantity>,
    x: &[f64; D],
    water: Option<&Cow<'_, Water>>,
    columns: &mut Columns<D>,
) -> f64 {
    let place = problem.place(x);
    let gravity = problem.gravity_of_stage(body.stage).at(0.0);
    let up = Up::new(&gravity);
    let height = x[up.axis] * up.sign;
    // Material is saturated below the water table. Heights count from the lower corner of the domain.
    let densities = |material: usize, ends: [f64; 2]| {
        let setup = &problem.materials[material];
        let zero = problem.origin[up.axis] * up.sign;
        let table = water.map(|water| water.table(place, 0.0, ends.map(|end| end + zero)) - zero);
        [(table.unwrap_or(ends[0]), setup.saturated_density), (ends[1], setup.density)]
    };
    let (mass, depth) = match surface {
        Some(surface) => {
            let depth = ((surface.at(place, 0.0) - place[up.axis]) * up.sign).max(0.0);
            let above = Standing(vec![(body.material, [height, height + depth])]);
            (above.mass_above(height, densities), depth)
        }
        None => {
            let standing = columns.at(problem, body.stage, up, x);
            (standing.mass_above(height, densities), (standing.top() - height).max(0.0))
        }
    };
    let water = water.map_or(0.0, |water| {
        let mut surface = place;
        surface[up.axis] = up.sign.mul_add(depth, place[up.axis]);
        water.pressure(surface, 0.0, &gravity).max(0.0) - water.pressure(place, 0.0, &gravity)
    });
    gravity[up.axis].abs() * mass + water
}

/// The state under a stress, or on the yield surface if the job lets it return there.
fn under(
    material: &dyn Material,
    stress: &[f64; 6],
    initial: &InitialStress,
    plane: bool,
) -> Result<Stressed, NoState> {
    match under_stress(material, stress, initial.consolidation, plane) {
        Err(NoState::Yields { .. }) if initial.relax => {
            yielded(material, stress, initial.consolidation, plane)
        }
        other => other,
    }
}

/// Values of a table over depth, constant outside.
fn interpolate(rows: &[[f64; 3]], depth: f64) -> [f64; 2] {
    let after = rows.iter().position(|row| row[0] > depth).unwrap_or(rows.len());
    let [low, high] = [after.saturating_sub(1), after.min(rows.len() - 1)].map(|row| rows[row]);
    let share = if high[0] > low[0] { ((depth - low[0]) / (high[0] - low[0])).max(0.0) } else { 0.0 };
    [1, 2].map(|value| share.mul_add(high[value] - low[value], low[value]))
}

/// Material on a vertical line: pieces of bodies with their material, and the heights (m, up) where they
/// begin and end.
#[derive(Clone, Debug, Default)]
struct Standing(Vec<(usize, [f64; 2])>);

impl Standing {
    /// Mass per area above a height, kg/m². `densities` gives the layers of a material between two heights:
    /// the upper end of each, and its density, kg/m³.
    fn mass_above(&self, height: f64, densities: impl Fn(usize, [f64; 2]) -> [(f64, f64); 2]) -> f64 {
        let mut mass = 0.0;
        for &(material, ends) in &self.0 {
            let mut low = ends[0];
            for (high, density) in densities(material, ends) {
                mass += density * (high - low.max(height)).max(0.0);
                low = high;
            }
        }
        mass
    }

    /// Height of the uppermost surface.
    fn top(&self) -> f64 {
        self.0.iter().map(|(_, ends)| ends[1]).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Vertical lines of a leaf that have been followed: those of its lattice.
struct Columns<const D: usize> {
    lines: Vec<([f64; D], Standing)>,
    /// Layers thinner than this may be missed, m.
    interval: f64,
}

impl<const D: usize> Columns<D> {
    fn new(interval: f64) -> Self {
        Self { lines: Vec::new(), interval }
    }

    /// Material on the vertical line through a point.
    fn at(&mut self, problem: &Problem<D>, stage: usize, up: Up, x: &[f64; D]) -> &Standing {
        let mut foot = *x;
        foot[up.axis] = 0.0;
        let found = self.lines.iter().position(|(other, _)| *other == foot).unwrap_or_else(|| {
            self.lines.push((foot, standing(problem, stage, up, &foot, self.interval)));
            self.lines.len() - 1
        });
        &self.lines[found].1
    }
}

fn standing<const D: usize>(
    problem: &Problem<D>,
    stage: usize,
    up: Up,
    foot: &[f64; D],
    interval: f64,
) -> Standing {
    let mut all = Standing::default();
    let extent = problem.size()[up.axis];
    for body in problem.bodies_of_stage(stage).map(|body| &problem.bodies[body]) {
        let bounds = body.shape.bounds();
        let (low, high) = (bounds.lower[up.axis].max(0.0), bounds.upper[up.axis].min(extent));
        let point = |height: f64| {
            let mut x = *foot;
            x[up.axis] = height;
            x
        };
        let mut push = |from: f64, to: f64| {
            let [a, b] = [from * up.sign, to * up.sign];
            all.0.push((body.material, [a.min(b), a.max(b)]));
        };
        // Each step is as long as the distance to the surface, and no shorter than the interval.
        let (mut height, mut inside_from) = (low, None);
        let mut was_inside = body.shape.contains(&point(low));
        if was_inside {
            inside_from = Some(low);
        }
        while height < high {
            let next = (height + body.shape.distance(&point(height)).abs().max(interval)).min(high);
            let is_inside = next < high && body.shape.contains(&point(next));
            if is_inside != was_inside {
                let crossing =
                    crossing(height, next, |height| body.shape.contains(&point(height)) == was_inside);
                match inside_from.take() {
                    Some(from) => push(from, crossing),
                    None => inside_from = Some(crossing),
                }
                was_inside = is_inside;
            }
            height = next;
        }
        if let Some(from) = inside_from {
            push(from, high);
        }
    }
    all
}

/// Where a property that holds at `low` and not at `high` ends.
fn crossing(mut low: f64, mut high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return high;
        }
        if holds(middle) { low = middle } else { high = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::{AnyProblem, parse};

    /// A slope on a layer: columns through a corner, a hole and the layer.
    #[test]
    fn weight_above_counts_every_body_and_no_hole() {
        let text = r#"
version = 1
dimension = 2
gravity = [0, -10]
domain = { min = [1, -2], size = [4, 4], root_edge = 1 }
time = { end = 1 }
[[materials]]
name = "light"
density = 1000
model = "hencky"
young = 1e8
poisson = 0.3
[[materials]]
name = "heavy"
density = 2000
model = "hencky"
young = 1e8
poisson = 0.3
[[bodies]]
name = "slope"
material = "light"
shape = { kind = "difference", from = { kind = "polygon", points = [[1, -1], [5, -1], [5, 1], [3, 1]] }, remove = [{ kind = "box", min = [4, -0.5], max = [5, 0.25] }] }
[[bodies]]
name = "layer"
material = "heavy"
shape = { kind = "box", min = [1, -2], max = [5, -1] }
"#;
        let any = parse(text, "test.toml".as_ref()).unwrap_or_else(|faults| panic!("{faults:?}"));
        let problem: Problem<2> = match any {
            AnyProblem::Two(problem) => problem,
            AnyProblem::Three(_) => panic!("a 2D job"),
        };
        let up = Up::new(&problem.gravity.at(0.0));
        for (x, height, expected) in [
            (1.0, 0.0, 2000.0 + 1000.0),
            (1.0, 0.5, 1000.0 + 1000.0),
            (1.5, 1.25, 1000.0 * (1.0 + 0.5 - 0.25)),
            (3.5, 1.0, 1000.0 * 1.25),
            (3.5, 1.25, 1000.0),
            (3.5, 2.75, 250.0),
        ] {
            let dry = |material: usize, [low, high]: [f64; 2]| {
                let density = problem.materials[material].density;
                [(low, density), (high, density)]
            };
            let found = standing(&problem, 0, up, &[x, 0.0], 0.1).mass_above(height, dry);
            assert!((found / expected - 1.0).abs() < 1e-14, "{x}, {height}: {found} for {expected}");
        }
        assert_eq!(standing(&problem, 0, up, &[1.5, 0.0], 0.1).top(), 2.5);
    }

    #[test]
    fn tables_over_depth_are_linear_and_constant_outside() {
        let rows = [[1.0, 10.0, 5.0], [3.0, 30.0, 6.0]];
        for (depth, expected) in
            [(0.0, [10.0, 5.0]), (1.0, [10.0, 5.0]), (2.0, [20.0, 5.5]), (7.0, [30.0, 6.0])]
        {
            assert_eq!(interpolate(&rows, depth), expected, "{depth}");
        }
    }
}
