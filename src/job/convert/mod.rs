//! From the file's types to a checked problem: conditions beyond the schema on domain, tree, materials and
//! bodies.
//!
//! | file or folder | subject |
//! |---|---|
//! | `materials` | materials, and what becomes of failed particles |
//! | `bodies` | bodies |
//! | `checks` | state that all share: faults with their places, the domain |
//! | `quasi_static` | load steps, and what jobs with them cannot have |
//! | `settings` | faces, numerics, output |
//! | `shapes/` | shapes, among them terrain, and particles from a file |
//! | `conditions/` | what acts on the material: loads, colliders, contact, sources, stress, water |
//! | `adaptivity` | dynamic refinement |
//! | `axisymmetry` | what axisymmetric jobs cannot have |
//! | `probes` | probes, tracks, fluxes, lines and maps |
//! | `stages` | stages of the run |
//! | `overlap` | whether bodies overlap |
use self::adaptivity::{Context, adaptivity};
use self::bodies::bodies;
use self::checks::{Checks, Space};
use self::conditions::colliders::colliders;
use self::conditions::contact::body_contacts;
use self::conditions::loads::{gravity, loads};
use self::conditions::{sources, water};
use self::materials::materials;
use self::settings::{digest, faces, numerics, output};
use super::parse::error::{Fault, Position, QUOTED};
use super::parse::source::{Node, Path};
use super::problem::*;
use super::schema::job_file::{self as file, JobFile};
use crate::geometry::Aabb;
use crate::geometry::written::Vector;
use crate::load::{Gravity, Load};
use crate::particle::followed::Motion;
use crate::quantity::AXES;
use crate::solver::Ties;
use crate::text::{excerpt, number, written};
use partition::{Brick, key::MAX_ROOTS};

mod adaptivity;
mod axisymmetry;
mod bodies;
mod checks;
mod conditions;
mod materials;
mod overlap;
mod probes;
mod quasi_static;
pub(super) mod settings;
mod shapes;
mod stages;

/// Most leaves that a uniform tree of the base level may have.
const MAX_BASE_LEAVES: f64 = 4_294_967_296.0;

/// Converts and checks; `text` is what `file` and `tree` were made from, `position` gives line and column of
/// its bytes.
pub(super) fn convert(
    file: &JobFile,
    tree: &Node,
    text: &str,
    position: &dyn Fn(usize) -> Position,
    path: &std::path::Path,
) -> Result<AnyProblem, Vec<Fault>> {
    let directory = path.parent().unwrap_or(std::path::Path::new(""));
    let domain = bounds(&file.domain);
    let mut checks =
        Checks { tree, text, position, directory, domain, files: 0, takes_sheets: false, faults: Vec::new() };
    let problem = if file.dimension == 2 {
        problem(&mut checks, file, path).map(AnyProblem::Two)
    } else {
        problem(&mut checks, file, path).map(AnyProblem::Three)
    };
    match problem {
        Some(problem) if checks.faults.is_empty() => Ok(problem),
        _ => {
            checks.faults.sort_by_key(|fault| fault.span.start);
            Err(checks.faults)
        }
    }
}

/// The ends of the domain along each axis, m, as they are written.
fn bounds(domain: &file::Domain) -> [[f64; 2]; 3] {
    let component =
        |of: Option<&Vector>, axis: usize| of.and_then(|of| of.0.get(axis)).copied().unwrap_or(0.0);
    std::array::from_fn(|axis| {
        let low = component(domain.min.as_ref(), axis);
        [low, low + component(Some(&domain.size), axis)]
    })
}

fn problem<const D: usize>(
    checks: &mut Checks,
    file: &JobFile,
    path: &std::path::Path,
) -> Option<Problem<D>> {
    let name = path.file_stem().map_or_else(|| "job".into(), |stem| stem.to_string_lossy().into_owned());
    let root = Path::default();
    let coordinates = axisymmetry::coordinates(checks, file);
    let is_ring = coordinates == Coordinates::Axisymmetric;
    let with_axis = is_ring.then(|| axisymmetry::with_axis(file));
    let file = with_axis.as_ref().unwrap_or(file);
    let (origin, brick) = domain::<D>(checks, &file.domain, &root.key("domain"))?;
    let root_edge = file.domain.root_edge;
    let space = Space { origin, size: brick.roots.map(|n| f64::from(n) * root_edge) };

    let tree = tree(checks, &file.tree, &brick, &space, &root.key("tree"));
    let materials = materials(checks, &file.materials, D, &root.key("materials"));
    let bodies = bodies(checks, file, &space, &root.key("bodies"));
    let colliders = colliders(checks, &file.colliders, &space, &root.key("colliders"));
    let gravity = match &file.gravity {
        Some(gravity) => self::gravity(checks, gravity, &root.key("gravity")),
        None => Some(Gravity::constant([0.0; D])),
    };
    let faces_with_sums = if file.history.face_forces { 2 * D } else { 0 };
    let body_contacts = body_contacts(checks, file, &root.key("contact"));
    let taken = 6 * file.colliders.len()
        + D * faces_with_sums
        + file.fluxes.len()
        + 4 * file.contact.len()
        + 5 * file.sources.len()
        + file
            .water
            .as_ref()
            .map_or(0, |water| 9 + water.seepage.as_ref().map_or(0, |seepage| 1 + seepage.heads.len()));
    let loads = loads(checks, file, taken, &space, &root.key("loads"));
    let water = water::water(checks, file, gravity.as_ref(), &space, &root);
    let water_stages = water::stages(checks, file, &root);
    let seepage = water::seepage(checks, file, &space, &root);
    let stages = stages::stages(checks, file, &root);
    let mut load_stages =
        stages::of_each(checks, file, file.loads.iter().map(|load| &load.stages), &root.key("loads"));
    let collider_stages = stages::of_each(
        checks,
        file,
        file.colliders.iter().map(|collider| &collider.stages),
        &root.key("colliders"),
    );
    let source_stages =
        stages::of_each(checks, file, file.sources.iter().map(|source| &source.stages), &root.key("sources"));
    let faces = faces(checks, &file.boundaries, &root.key("boundaries"));
    let absorbing = settings::absorbing(checks, &file.boundaries, &root.key("boundaries"));
    let (transfer, boxes) = numerics(checks, &file.numerics, &root.key("numerics"));
    let (tree, mut bodies, faces) = (tree?, bodies?, faces?);
    let mut load_places: Vec<_> =
        (0..file.loads.len()).map(|i| checks.place(&root.key("loads").index(i))).collect();
    let (mut loads, water) = (loads?, water?);
    if let Some(water) = water {
        loads.push(water);
        load_stages.push(water_stages);
        load_places.push(checks.place(&root.key("water")));
    }
    let context = sources::Context { file, space: &space, tree: &tree, root_edge, coordinates };
    let (sources, fed): (Vec<_>, Vec<_>) =
        sources::sources(checks, &context, &root.key("sources"))?.into_iter().unzip();
    bodies.extend(fed);
    let context = Context { file, space: &space, tree: &tree, bodies: &bodies, boxes, root_edge };
    let adaptivity = adaptivity(checks, &context, &root.key("adaptivity"));
    let probes = probes::probes(checks, file, &space, &root.key("probes"));
    let tracks = probes::tracks(checks, file, &space, &root.key("tracks"));
    let fluxes = probes::fluxes(checks, file, &space, &root.key("fluxes"));
    let lines = probes::lines(checks, file, &space, &root.key("lines"));
    let maps = probes::maps(checks, file, &space, &root.key("maps"));
    let mut output = output(checks, file, &name, &root.key("output"));
    let needs_places = loads.iter().any(Load::names_undeformed);
    if needs_places && output.followed.motion == Motion::Nothing {
        output.followed.motion = Motion::Displacement;
    }
    output.followed.head = file.water.as_ref().is_some_and(|water| water.seepage.is_some());
    output.followed.saturation =
        file.water.is_some() && materials.iter().any(|m| m.saturated_density != m.density);
    if is_ring && checks.faults.is_empty() {
        axisymmetry::check(checks, file, colliders.as_deref().unwrap_or(&[]));
    }
    let problem = Problem {
        name,
        path: path.to_path_buf(),
        text: checks.text.to_owned(),
        title: file.title.clone(),
        digest: digest(file) ^ checks.files,
        origin,
        root_edge,
        brick,
        tree,
        adaptivity,
        materials,
        bodies,
        sources,
        gravity: gravity?,
        load_places,
        seepage: seepage?,
        loads,
        faces: faces.map(|pair| pair.map(Option::unwrap_or_default)),
        absorbing: absorbing?,
        named_faces: faces.map(|pair| pair.map(|face| face.is_some())),
        colliders: colliders?,
        thick: std::sync::OnceLock::new(),
        body_contacts: body_contacts?,
        leaving: settings::leaving(file.boundaries.leaving.unwrap_or_default()),
        stages: stages?,
        load_stages,
        collider_stages,
        source_stages,
        time: TimeSetup {
            end: file.time.end,
            cfl: file.time.cfl,
            dt_max: file.time.dt_max,
            growth: file.time.growth,
        },
        transfer,
        coordinates,
        boxes,
        f_bar: file.numerics.f_bar,
        viscosity: settings::viscosity(&file.numerics),
        quasi_static: quasi_static::settings(checks, file, &root),
        ties: match (file.numerics.tied_surfaces, coordinates) {
            (Some(true), _) => Ties::All,
            (None, Coordinates::Cartesian) => Ties::Elastic,
            _ => Ties::None,
        },
        output,
        checkpoint: CheckpointSetup {
            every_steps: file.checkpoint.every_steps,
            every_time: file.checkpoint.every_time,
            every_wall_minutes: file.checkpoint.every_wall_minutes,
            keep: file.checkpoint.keep as usize,
        },
        history_every: file.history.every_steps,
        face_forces: file.history.face_forces,
        probes: probes?,
        tracks: tracks?,
        fluxes: fluxes?,
        lines: lines?,
        maps: maps?,
        telemetry_every: file.telemetry.every_steps,
    };
    quasi_static::check(checks, file, &problem);
    for overlap in overlap::find(&problem) {
        let [first, second] = overlap.bodies.map(|body| excerpt(&problem.bodies[body].name, QUOTED));
        let point = space.words(&overlap.point);
        let key = match problem.bodies[overlap.bodies[1]].fed {
            Some(source) => root.key("sources").index(source),
            None => root.key("bodies").index(overlap.bodies[1]),
        };
        checks.fault(
            &key.key("shape"),
            format!("found the body \"{second}\" overlapping \"{first}\" at {point}; expected bodies without a common point"),
        );
    }
    Some(problem)
}

fn domain<const D: usize>(
    checks: &mut Checks,
    domain: &file::Domain,
    path: &Path,
) -> Option<([f64; D], Brick<D>)> {
    let origin = match &domain.min {
        Some(min) => checks.vector(min, &path.key("min")),
        None => Some([0.0; D]),
    };
    let size: [f64; D] = checks.vector(&domain.size, &path.key("size"))?;
    let mut roots = [0; D];
    for a in 0..D {
        let here = path.key("size").index(a);
        let count = size[a] / domain.root_edge;
        let whole = count.round();
        let edge = domain.root_edge;
        if whole < 1.0 || (count - whole).abs() > 1e-9 * whole {
            let (below, above) = (count.floor().max(1.0) * edge, (count.floor() + 1.0).max(1.0) * edge);
            // Twelve digits: within the tolerance for whole numbers.
            let [below, above] = [below, above].map(|size| number(size, 12));
            let near = if below == above { above } else { format!("{below} or {above}") };
            let (found, edge) = (written(size[a]), written(edge));
            let message = format!(
                "found {found}; expected a whole multiple of domain.root_edge = {edge}, such as {near}"
            );
            checks.fault(&here, message);
        } else if whole > f64::from(MAX_ROOTS) {
            checks.fault(
                &here,
                format!(
                    "found {} root octants along {}; expected at most {MAX_ROOTS}: a larger domain.root_edge",
                    written(whole),
                    AXES[a]
                ),
            );
        } else {
            roots[a] = whole as u32;
        }
    }
    if roots.contains(&0) { None } else { Some((origin?, Brick { roots })) }
}

fn tree<const D: usize>(
    checks: &mut Checks,
    tree: &file::Tree,
    brick: &Brick<D>,
    space: &Space<D>,
    path: &Path,
) -> Option<TreeSetup<D>> {
    let roots: f64 = brick.roots.iter().map(|&n| f64::from(n)).product();
    let leaves = roots * f64::from(1_u32 << tree.base_level).powi(D as i32);
    if leaves > MAX_BASE_LEAVES {
        checks.fault(
            &path.key("base_level"),
            format!("found {}, which makes {leaves:.3e} leaves; expected a level with at most {MAX_BASE_LEAVES:.1e}", tree.base_level),
        );
    }
    let mut regions = Vec::new();
    for (i, region) in tree.regions.iter().enumerate() {
        let here = path.key("regions").index(i);
        if region.level <= tree.base_level {
            checks.fault(
                &here.key("level"),
                format!(
                    "found {}; expected a level deeper than tree.base_level = {}",
                    region.level, tree.base_level
                ),
            );
        }
        let Some(shape) = checks.shape(&region.shape, space, &here.key("shape")) else { continue };
        let inside = shape.bounds().intersection(&Aabb::new([0.0; D], space.size));
        if inside.is_empty() {
            checks.fault(
                &here.key("shape"),
                "found a region outside the domain; expected one that intersects it".into(),
            );
        }
        regions.push(Region { shape, level: region.level });
    }
    (regions.len() == tree.regions.len()).then_some(TreeSetup {
        base_level: tree.base_level,
        graded: tree.graded,
        regions,
    })
}
