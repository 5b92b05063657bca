//! Dynamic refinement of the job file to that of the solver.
use super::checks::{Checks, Space};
use crate::adaptivity::criteria::Way;
use crate::adaptivity::criteria::{Job, Keys, Parameters};
use crate::adaptivity::resample::Limits;
use crate::adaptivity::{Adaptivity, Criterion, Thresholds};
use crate::boundary::motion::{Knot, Motion, Table};
use crate::geometry::{Shape, written};
use crate::job::parse::source::Path;
use crate::job::problem::{Body, BoxPolicy, TreeSetup};
use crate::job::schema::adaptivity::Adaptivity as Written;
use crate::job::schema::job_file::JobFile;
use crate::text::written as number;

/// Parts of the job that the conversion of its adaptivity depends on.
pub(super) struct Context<'a, const D: usize> {
    pub file: &'a JobFile,
    pub space: &'a Space<D>,
    pub tree: &'a TreeSetup<D>,
    pub bodies: &'a [Body<D>],
    pub boxes: BoxPolicy,
    pub root_edge: f64,
}

/// The job's dynamic refinement: what it writes, or sizes of particles alone where its cells differ in size.
pub(in crate::job) fn adaptivity<const D: usize>(
    checks: &mut Checks,
    context: &Context<D>,
    path: &Path,
) -> Option<Adaptivity<D>> {
    let Some(written) = &context.file.adaptivity else {
        let is_graded = context.tree.regions.iter().any(|region| region.level > context.tree.base_level);
        return is_graded.then(|| adaptivity_of(context, &Written::default(), Vec::new(), None));
    };
    let merge = &written.merge;
    if let BoxPolicy::Volume { max_stretch, .. } = context.boxes {
        if written.split_stretch > max_stretch {
            checks.fault(
                &path.key("split_stretch"),
                format!(
                    "found {}; expected at most {}, the upper bound of numerics.box_stretch",
                    number(written.split_stretch),
                    number(max_stretch)
                ),
            );
        }
        if merge.enabled && merge.stretch >= written.split_stretch {
            checks.fault(
                &path.key("merge").key("stretch"),
                format!(
                    "found {}; expected less than adaptivity.split_stretch = {}, or merges would undo splits",
                    number(merge.stretch),
                    number(written.split_stretch)
                ),
            );
        }
    }
    let coarsest = context.bodies.iter().map(|body| 1.0 / body.particles_per_cell).fold(0.0, f64::max);
    if let Some(gap) = written.split_gap
        && gap < 1.5 * coarsest
    {
        let message = format!(
            "found {}; expected at least {}, 1.5 times the distance of particles at the start",
            number(gap),
            number(1.5 * coarsest)
        );
        checks.fault(&path.key("split_gap"), message);
    }
    let criteria: Vec<Option<Criterion<D>>> = (written.criteria.iter().enumerate())
        .map(|(i, criterion)| self::criterion(checks, criterion, context, &path.key("criteria").index(i)))
        .collect();
    let stretch = matches!(context.boxes, BoxPolicy::Volume { .. }).then_some(written.split_stretch);
    Some(adaptivity_of(context, written, criteria.into_iter().collect::<Option<_>>()?, stretch))
}

/// The refinement by criteria; particles split at a stretch, if any is given.
fn adaptivity_of<const D: usize>(
    context: &Context<D>,
    written: &Written,
    criteria: Vec<Criterion<D>>,
    split_stretch: Option<f64>,
) -> Adaptivity<D> {
    let merge = &written.merge;
    let limits = Limits {
        velocity: merge.velocity,
        strain: merge.strain,
        volume: merge.volume,
        history: merge.plastic_strain,
        stretch: merge.stretch,
    };
    let regions = context.tree.regions.iter().map(|region| (region.shape.clone(), region.level));
    let cell = context.root_edge / 4.0;
    Adaptivity {
        every: written.every_steps,
        buffer: written.buffer,
        base_level: context.tree.base_level,
        regions: regions.collect(),
        criteria,
        split_stretch,
        split_gap: written.split_gap,
        merge: merge.enabled.then_some(limits),
        nominal: context.bodies.iter().map(|body| 0.5 * cell / body.particles_per_cell).collect(),
    }
}

fn criterion<const D: usize>(
    checks: &mut Checks,
    written: &Parameters,
    context: &Context<D>,
    path: &Path,
) -> Option<Criterion<D>> {
    let criterion = written.criterion(&mut Rest { checks: &mut *checks, context, path })?;
    let (level, base) = (criterion.level, context.tree.base_level);
    if level <= base {
        let message = format!("found {level}; expected a level deeper than tree.base_level = {base}");
        checks.fault(&path.key("level"), message);
    }
    let Thresholds { refine, coarsen, is_distance } = criterion.thresholds;
    let key = if is_distance { "distance" } else { "refine" };
    if is_distance && coarsen < refine || !is_distance && coarsen > refine {
        let side = if is_distance { "least" } else { "most" };
        checks.fault(
            &path.key("coarsen"),
            format!(
                "found {}; expected at {side} {key} = {}, or leaves would refine and coarsen in turn",
                number(coarsen),
                number(refine)
            ),
        );
    }
    Some(criterion)
}

/// The rest of the job for the criterion at `path`.
struct Rest<'a, 'c, 't, const D: usize> {
    checks: &'a mut Checks<'t>,
    context: &'a Context<'c, D>,
    path: &'a Path,
}

impl<const D: usize> Job<D> for Rest<'_, '_, '_, D> {
    fn shape(&mut self, shape: &written::Shape, key: &'static str) -> Option<Shape<D>> {
        self.checks.shape(shape, self.context.space, &self.path.key(key))
    }

    fn motion(&mut self, rows: &[Way], key: &'static str) -> Option<Motion<D>> {
        ways(self.checks, rows, &self.path.key(key))
    }

    fn collider(&mut self, name: &str, key: &'static str) -> Option<usize> {
        let names = || self.context.file.colliders.iter().map(|collider| collider.name.as_str());
        self.checks.named(name, "collider", names, &self.path.key(key))
    }

    fn material(&mut self, name: &str, key: &'static str) -> Option<usize> {
        let names = || self.context.file.materials.iter().map(|material| material.name.as_str());
        self.checks.named(name, "material", names, &self.path.key(key))
    }

    fn seepage(&mut self, key: &'static str) -> Option<()> {
        let seeps = self.context.file.water.as_ref().is_some_and(|water| water.seepage.is_some());
        if !seeps {
            let message = "found a criterion of the head in a job without seepage; expected [water] with `seepage`, or another criterion";
            self.checks.fault(&self.path.key(key), message.into());
        }
        seeps.then_some(())
    }
}

/// The motion of a region.
fn ways<const D: usize>(checks: &mut Checks, ways: &[Way], path: &Path) -> Option<Motion<D>> {
    if ways.is_empty() {
        return Some(Motion::Fixed);
    }
    let mut knots: Vec<Knot<D>> = Vec::new();
    for (i, way) in ways.iter().enumerate() {
        let here = path.index(i);
        if let Some(before) = knots.last().filter(|before| before.time >= way.time) {
            let message = format!(
                "found {}; expected more than {} of the previous row",
                number(way.time),
                number(before.time)
            );
            checks.fault(&here.key("time"), message);
        }
        let translation = checks.vector(&way.translation, &here.key("translation"))?;
        knots.push(Knot { time: way.time, translation, angle: 0.0 });
    }
    Some(Motion::Table(Table { rows: knots, is_smooth: false }))
}
