//! The size and the cost of a job in words.
use std::io::Write;

use agimp::adaptivity::Adaptivity;
use agimp::boundary::{ActsOn, Contact, Meets};
use agimp::job::Problem;
use agimp::job::problem::{Coordinates, InStages};
use agimp::setup::known::Known;
use agimp::setup::{stages, walls};
use agimp::solver::state::bookings::CarriedTotals;
use agimp::source::Source;
use agimp::text::{bytes, count as grouped, excerpt, number, quantity, wall_time};

/// Longest name that is printed, in characters.
const NAME: usize = 60;
/// Bodies that are listed.
const MOST_BODIES: usize = 100;
/// Most names in one line.
const MOST_NAMES: usize = 5;

/// Writes the size and the cost of a job on some ranks.
pub(crate) fn write<const D: usize>(
    out: &mut impl Write,
    ranks: u32,
    problem: &Problem<D>,
    known: &Known,
) -> std::io::Result<()> {
    let estimate = &known.estimate;
    if !problem.title.is_empty() {
        writeln!(out, "{}", excerpt(&problem.title, 200))?;
    }
    let size: Vec<String> = problem.size().iter().map(|edge| number(*edge, 7)).collect();
    let roots: Vec<String> = problem.brick.roots.iter().map(u32::to_string).collect();
    writeln!(out, "domain       {} m, {} root octants", size.join(" x "), roots.join(" x "))?;
    let is_ring = problem.coordinates == Coordinates::Axisymmetric;
    if is_ring {
        writeln!(
            out,
            "geometry     bodies of revolution; masses, forces and energies of the whole circumference"
        )?;
    }
    let least = if estimate.is_cut { "at least " } else { "" };
    writeln!(out, "particles    {least}{}", grouped(estimate.total_particles()))?;
    for (body, count) in problem.bodies.iter().zip(&estimate.particles).take(MOST_BODIES) {
        let when = if body.fed.is_some() { ", from its source by the end" } else { "" };
        writeln!(
            out,
            "  {:18} {:>14}  {}{when}",
            excerpt(&body.name, NAME),
            grouped(*count),
            excerpt(&problem.materials[body.material].name, NAME)
        )?;
    }
    if problem.bodies.len() > MOST_BODIES {
        writeln!(out, "  and {} more bodies", grouped((problem.bodies.len() - MOST_BODIES) as u64))?;
    }
    if let Some(names) = held_at_nodes(problem) {
        writeln!(out, "at walls     nodes hold, up to a cell ahead, what yields or moves with it: {names}")?;
    }
    if !problem.colliders.is_empty() {
        writeln!(out, "colliders    {}", problem.colliders.len())?;
        for (number, collider) in problem.colliders.iter().enumerate() {
            let stages = in_stages(problem, &problem.collider_stages[number]);
            let last = problem.stages.len().saturating_sub(1);
            let nodes = match walls::acts_on_nodes(problem, last, number) {
                true => "; thick enough to hold fluids at nodes",
                false => "",
            };
            writeln!(out, "  {:18} {}{stages}{nodes}", excerpt(&collider.name, NAME), collider)?;
        }
    }
    if !problem.sources.is_empty() {
        writeln!(out, "sources      {}", problem.sources.len())?;
        for (source, stages) in problem.sources.iter().zip(&problem.source_stages) {
            let stages = in_stages(problem, stages);
            writeln!(out, "  {:18} {}{stages}", excerpt(&source.name, NAME), source_in_words(source))?;
        }
    }
    let contacts = &problem.body_contacts;
    if !contacts.names.is_empty() {
        writeln!(out, "contacts     {}, {} velocity fields", contacts.names.len(), contacts.fields())?;
        for (number, (name, _)) in contacts.names.iter().enumerate() {
            let law = contacts.pairs.iter().find(|pair| usize::from(pair.contact) == number);
            let law = law.map_or("covered by other contacts".into(), |pair| pair.law.to_string());
            writeln!(out, "  {:18} {law}", excerpt(name, NAME))?;
        }
    }
    if problem.stages.len() > 1 {
        writeln!(out, "stages       {}", problem.stages.len())?;
        for stage in &problem.stages {
            let duration = match stage.duration.is_finite() {
                true => format!("at most {}", quantity(stage.duration, "s")),
                false => "to the end of the run".to_owned(),
            };
            let until = match (&stage.reduction, stage.equilibrium) {
                (Some(search), _) => {
                    format!("strength over {} to {}, ", number(search.from, 4), number(search.to, 4))
                }
                (None, Some(_)) => "to equilibrium, ".to_owned(),
                (None, None) => String::new(),
            };
            writeln!(out, "  {:18} {until}{duration}", excerpt(&stage.name, NAME))?;
        }
    }
    if !problem.loads.is_empty() {
        writeln!(out, "loads        {}", problem.loads.len())?;
        let mut carried = known.carried.iter();
        for (number, load) in problem.loads.iter().enumerate() {
            let stages = in_stages(problem, &problem.load_stages[number]);
            writeln!(out, "  {:18} {}{stages}", excerpt(&load.name, NAME), load.describe())?;
            if let Some(totals) = load.carried().and_then(|_| carried.next()) {
                writeln!(out, "  {:18} {}", "", carried_in_words::<D>(totals, is_ring, load.from.max(0.0)))?;
            }
        }
    }
    writeln!(out, "leaves       {least}{}", grouped(estimate.total_leaves()))?;
    writeln!(out, "  level      cell edge         leaves         filled          cells      particles")?;
    let cells_per_leaf = 4_u64.pow(D as u32);
    for (level, count) in estimate.levels.iter().enumerate().filter(|(_, count)| count.leaves > 0) {
        writeln!(
            out,
            "  {level:5}   {:>12} {:>14} {:>14} {:>14} {:>14}",
            quantity(problem.cell_edge(level as u8), "m"),
            grouped(count.leaves),
            grouped(count.filled),
            grouped(count.leaves * cells_per_leaf),
            grouped(count.particles)
        )?;
    }
    if estimate.is_cut {
        writeln!(
            out,
            "  The count is incomplete, because the tree or the surfaces of bodies are too large; these are lower bounds."
        )?;
    }
    if let Some(adaptivity) = &problem.adaptivity {
        write_refinement(out, adaptivity, known.is_refined)?;
    }
    let about = if estimate.is_cut { "more than" } else { "about" };
    writeln!(
        out,
        "memory       {about} {} per rank on {} at the start; outputs and spreading material increase it",
        bytes(estimate.memory_per_rank(ranks)),
        plural(ranks)
    )?;
    let kind = if problem.quasi_static.is_some() { "load step    at most" } else { "time step    about" };
    writeln!(out, "{kind} {}", quantity(estimate.time_step, "s"))?;
    let (steps, end) = (number(estimate.steps, 4), quantity(problem.time.end, "s"));
    writeln!(out, "steps        about {steps} to {end}")?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as u32;
    writeln!(
        out,
        "wall time    {} on {} of this {}if counts and time step remain constant",
        match (wall_time(estimate.wall_time(cores)), estimate.is_cut) {
            (time, false) if time.starts_with("less") => time,
            (time, _) => format!("{about} {time}"),
        },
        if cores == 1 { "1 core".into() } else { format!("{cores} cores") },
        if estimate.pace.is_some() { "machine by a few steps, " } else { "type, " }
    )?;
    writeln!(
        out,
        "outputs      {} of {about} {} each",
        grouped(estimate.outputs),
        bytes(estimate.output_bytes)
    )?;
    writeln!(
        out,
        "checkpoints  {about} {} each, the last {} kept",
        bytes(estimate.checkpoint_bytes),
        problem.checkpoint.keep
    )?;
    Ok(())
}

/// Criteria in words, and their meaning for the numbers above and below.
fn write_refinement<const D: usize>(
    out: &mut impl Write,
    adaptivity: &Adaptivity<D>,
    is_refined: bool,
) -> std::io::Result<()> {
    let merging = if adaptivity.merge.is_some() { "split and merge" } else { "split" };
    writeln!(
        out,
        "refinement   every {} steps, buffer of {}, particles {merging}",
        adaptivity.every,
        if adaptivity.buffer == 1 { "1 leaf".into() } else { format!("{} leaves", adaptivity.buffer) }
    )?;
    for criterion in &adaptivity.criteria {
        writeln!(out, "  level {:5}        {}", criterion.level, criterion.describe())?;
    }
    writeln!(
        out,
        "  Counts and memory are those {}; time step and steps assume the finest level",
        if is_refined { "at the start, with the criteria" } else { "of the job's tree, before the criteria" }
    )?;
    writeln!(out, "  that the criteria request.")
}

/// Names of the bodies that faces and colliders hold at nodes in any stage, since they move with material
/// that yields, if surfaces let go of anything.
fn held_at_nodes<const D: usize>(problem: &Problem<D>) -> Option<String> {
    let of_colliders = problem.colliders.iter().filter(|collider| collider.acts_on == ActsOn::Nodes);
    let of_colliders = of_colliders.map(|collider| collider.contact);
    let of_faces = problem.stages.iter().flat_map(|stage| stage.faces.as_flattened()).flatten();
    let of_each_face = problem.faces.as_flattened().iter().chain(of_faces);
    if !of_colliders.chain(of_each_face.clone().copied()).any(Contact::has_gap) {
        return None;
    }
    let last = problem.stages.len().saturating_sub(1);
    let fields = 0..problem.body_contacts.fields();
    let meets: Vec<Meets> = fields.map(|field| stages::meets(problem, field as u8, last)).collect();
    let field_of_body = &problem.body_contacts.field_of_body;
    let field = |body: usize| field_of_body.get(body).map_or(0, |&field| usize::from(field));
    let bodies = problem.bodies.iter().enumerate();
    let mut laws = problem.colliders.iter().map(|collider| collider.contact).chain(of_each_face.copied());
    let by_area = laws.any(Contact::acts_by_area);
    let at_nodes = |meets: Meets| meets == Meets::Nodes || (meets.yields() && by_area);
    let bodies = bodies.filter(|(number, _)| at_nodes(meets[field(*number)]));
    let names: Vec<String> = bodies.map(|(_, body)| excerpt(&body.name, NAME).into()).collect();
    match names.len() {
        0 => None,
        1..=MOST_NAMES => Some(names.join(", ")),
        more => Some(format!("{more} bodies")),
    }
}

fn plural(ranks: u32) -> String {
    if ranks == 1 { "1 rank".into() } else { format!("{ranks} ranks") }
}

/// Particles, surface and force of a load that particles carry, in words, with the whole circumference of
/// rings; the force is that at `time`, s.
fn carried_in_words<const D: usize>(totals: &CarriedTotals, is_ring: bool, time: f64) -> String {
    let area = match (totals.area, D) {
        (Some(area), 2) if !is_ring => format!(", {} of surface", quantity(area, "m")),
        (Some(area), _) => format!(", {} m² of surface", number(area, 6)),
        (None, _) => String::new(),
    };
    let force: Vec<String> = totals.force[..D].iter().map(|&f| quantity(f, "N")).collect();
    let (particles, force) = (grouped(totals.particles), force.join(", "));
    format!("on {particles} particles{area}, force ({force}) at {}", quantity(time, "s"))
}

/// Velocity, layers and times of a source, in words.
fn source_in_words<const D: usize>(source: &Source<D>) -> String {
    let velocity: Vec<String> = source.velocity.iter().map(|&v| quantity(v, "m/s")).collect();
    let count = source.entries.len();
    let rate = quantity(source.mass_of_layer() / source.period, "kg/s");
    let all = if source.total == u64::MAX {
        String::new()
    } else {
        format!(", {} particles", grouped(source.total))
    };
    format!(
        "{rate} at ({}), a layer of {} every {} from {} on{all}",
        velocity.join(", "),
        grouped(count as u64),
        quantity(source.period, "s"),
        quantity(source.from, "s")
    )
}

/// The stages in which something acts, in words, if it names them.
fn in_stages<const D: usize>(problem: &Problem<D>, stages: &InStages) -> String {
    stages.0.as_ref().map_or_else(String::new, |stages| {
        let names: Vec<_> = stages.iter().map(|&stage| excerpt(&problem.stages[stage].name, NAME)).collect();
        format!(", in {}", names.join(", "))
    })
}
